// Words of the command line and what they stand for.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "arguments/command_line.h"
#include "kiln/error.h"

namespace kiln::cli {

/// The words that an option takes, in the order of the alphabet, as help lists them. A view.
template <typename T>
class Words {
 public:
  struct Row {
    const char* word;
    T value;
  };

  template <std::size_t N>
  Words(const Row (&rows)[N]) : begin_(rows), end_(rows + N) {}

  const Row* begin() const { return begin_; }
  const Row* end() const { return end_; }

  /// nullptr: none of these words.
  const T* find(std::string_view word) const {
    for (const Row& row : *this) {
      if (row.word == word) return &row.value;
    }
    return nullptr;
  }
  bool contains(std::string_view word) const { return find(word) != nullptr; }
  /// Of a word that was checked.
  T at(std::string_view word) const {
    const T* const value = find(word);
    if (value == nullptr) throw Error(ErrorCode::internal, "An option's value is not known.");
    return *value;
  }

 private:
  const Row *begin_, *end_;
};

template <typename T>
Check one_of(const Words<T>& words) {
  std::vector<std::string> names;
  for (const auto& [word, value] : words) names.emplace_back(word);
  return one_of(names);
}

/// A value as it is written on the command line.
template <typename T>
std::string name_of(const Words<T>& words, T wanted) {
  for (const auto& [word, value] : words) {
    if (value == wanted) return word;
  }
  throw Error(ErrorCode::internal, "An option's value has no name.");
}

}  // namespace kiln::cli

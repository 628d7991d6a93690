// Values of options as text: what may stand there, and what is said where it may not.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

/// The words that an option was given, of which there is one at least.
using OptionWords = std::vector<std::string>;

/// The check of a value.
class Check {
 public:
  /// \param function  returns what is wrong with a value, as it follows the option's name in a sentence; empty:
  ///                  nothing. It may put another value in its place
  /// \param words  what help says of values
  Check(std::function<std::string(std::string&)> function, std::string_view words)
      : function_(std::move(function)), words_(words) {}

  /// The fault of a value, such as " is '0': give 1 to 16"; empty: nothing.
  std::string operator()(std::string& value) const { return function_(value); }
  /// Values, in the words of help.
  const std::string& words() const { return words_; }

 private:
  std::function<std::string(std::string&)> function_;
  std::string words_;
};

/// Numbers of a range, whole ones where its ends are.
Check range(double low, double high);
Check range(unsigned low, unsigned high);
/// Names, capital letters or not, blanks around them or not. The value becomes the name.
Check one_of(const std::vector<std::string>& names);

/// True if all of a text is a number. A plus sign before it is let through.
template <typename Number>
bool read_number(std::string_view text, Number& value);

}  // namespace kiln

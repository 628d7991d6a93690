// A hash of contents that stands for them: 128 bits, so that two contents of one hash do not happen by chance. It keeps
// nobody out who wants two (xxHash, XXH3).
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace kiln {

class ContentHash {
 public:
  ContentHash();
  ~ContentHash();
  ContentHash(ContentHash&&) noexcept;
  ContentHash& operator=(ContentHash&&) noexcept;

  void add(std::span<const std::byte> bytes);
  /// A text with its length, so that "ab", "c" and "a", "bc" are not alike.
  void add(std::string_view text);
  /// An array with its length.
  template <typename T>
  void add_array(const T& array) {
    const std::size_t size = array.size();
    add(std::as_bytes(std::span(&size, 1)));
    add(std::as_bytes(std::span(array)));
  }
  /// 32 of 0-9 and a-f.
  std::string text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Hash of a text.
std::string content_hash(std::string_view text);
/// Hash of a file's bytes; none where it cannot be read.
std::optional<std::string> file_hash(const std::filesystem::path& path);

}  // namespace kiln

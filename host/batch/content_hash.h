// A 128-bit content hash (xxHash, XXH3): accidental collisions are negligible. It is not cryptographic, so deliberate
// collisions are possible.
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
  /// Adds a text with its length, so that "ab", "c" and "a", "bc" have different hashes.
  void add(std::string_view text);
  /// Adds an array with its length.
  template <typename T>
  void add_array(const T& array) {
    const std::size_t size = array.size();
    add(std::as_bytes(std::span(&size, 1)));
    add(std::as_bytes(std::span(array)));
  }
  /// Returns the hash as 32 hexadecimal digits.
  std::string text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Hashes a text.
std::string content_hash(std::string_view text);
/// Hashes a file's bytes; nullopt if the file cannot be read.
std::optional<std::string> file_hash(const std::filesystem::path& path);

}  // namespace kiln

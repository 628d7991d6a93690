// Files that appear whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace kiln {

/// A file being written under a temporary name in the destination's folder. commit() flushes it to
/// the disk's queue and renames it over the destination; without commit, the destructor removes it.
class AtomicFile {
 public:
  /// \throws Error(output) where the folder is missing or cannot be written; says which
  explicit AtomicFile(std::filesystem::path destination);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& destination() const { return destination_; }
  const std::filesystem::path& temporary() const { return temporary_; }
  std::FILE* stream() const { return stream_; }

  /// \throws Error(output), for a full disk say
  void write(const void* data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// For writers that open the temporary path by name: close our stream first.
  void close_stream();
  /// \throws Error(output); the temporary is removed then
  void commit();

  /// An Error(output) that names the destination and says why (from errno where not zero).
  [[noreturn]] void fail(std::string_view what, int error_number) const;

 private:
  std::filesystem::path destination_;
  std::filesystem::path temporary_;
  std::FILE* stream_ = nullptr;
  int slot_ = -1;
};

}  // namespace kiln

// Files that appear whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>
#include <vector>

namespace kiln {

/// A file being written out of sight, in the destination's folder. commit() renames it over the
/// destination; without commit, the destructor removes it.
///
/// Where the file system can (Linux's O_TMPFILE), the file has no name until it is complete, so that
/// even a killed process leaves nothing behind; elsewhere it has a hidden name. The new file gets the
/// permissions of the process's umask. A symbolic link to a file is followed. A destination that is
/// neither a file nor a folder (`/dev/stdout`, a pipe) is written to directly. Nothing is forced to
/// the medium (no fsync): what is promised holds against errors and kills, not against a power cut.
class AtomicFile {
 public:
  /// \throws Error(output) where the folder is missing or cannot be written, or the destination is a
  ///         folder or write-protected; says which
  /// \param allow_unnamed  false: use a hidden name even where the file system needs none
  explicit AtomicFile(std::filesystem::path destination, bool allow_unnamed = true);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// As given.
  const std::filesystem::path& destination() const { return destination_; }
  /// The file's present name; empty while it has none (before close_stream).
  const std::filesystem::path& temporary() const { return temporary_; }
  /// Null after close_stream or commit.
  std::FILE* stream() const { return stream_; }

  /// \throws Error(output), for a full disk say
  void write(const void* data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// For writers that open the file by name: closes our stream and sees to it that temporary() names
  /// the file.
  /// \throws Error(output)
  void close_stream();
  /// Once only.
  /// \throws Error(output); the temporary is removed then
  void commit();

  /// An Error(output) that names the destination, says why (from errno where not zero) and what to
  /// do about it.
  [[noreturn]] void fail(std::string_view what, int error_number) const;

 private:
  void open_stream(int descriptor);
  int create_named();
  void name_file();
  void discard() noexcept;

  std::filesystem::path destination_;
  std::filesystem::path target_;  ///< The destination, links followed, absolute
  std::filesystem::path temporary_;
  std::vector<char> buffer_;  ///< The stream's
  std::FILE* stream_ = nullptr;
  int slot_ = -1;
  bool direct_ = false;  ///< A device or a pipe: no temporary, no rename
};

}  // namespace kiln

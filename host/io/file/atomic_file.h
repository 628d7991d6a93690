// Files that appear whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "io/file/temporary.h"

namespace kiln {

/// A file being written out of sight, in the destination's folder. commit() renames it over the
/// destination, or leaves that to the OutputSet that is open; without commit, the destructor removes it.
///
/// On file systems that can (Linux's O_TMPFILE), the file has no name until it is complete. So even a
/// killed process leaves nothing behind; elsewhere it has a hidden name. A file that is replaced keeps
/// its permissions; a new one gets those of the process's umask. Symbolic links are followed, and what
/// they name is replaced or made. A destination that is neither a file nor a folder (`/dev/stdout`, a
/// pipe) is written to directly. The bytes are on the medium before they take the destination's name.
class AtomicFile {
 public:
  /// \throws Error(output) where the folder is missing or cannot be written, or the destination is a
  ///         folder or write-protected; says which. Error(usage) for a file that was read while an
  ///         OutputSet is open
  /// \param allow_unnamed  false: use a hidden name even where the file system needs none
  explicit AtomicFile(std::filesystem::path destination, bool allow_unnamed = true);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// As given.
  const std::filesystem::path& destination() const { return destination_; }
  /// The file's present name; empty while it has none (before close_stream).
  const std::filesystem::path& temporary() const { return temporary_.path(); }
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
  void follow_links();
  void examine();
  void open_stream(int descriptor);
  int create_named();
  void name_file();
  void send(int descriptor) const;
  void discard() noexcept;

  std::filesystem::path destination_;
  std::filesystem::path target_;  ///< The destination, links followed, absolute
  TemporaryName temporary_;
  std::optional<unsigned> mode_;  ///< Permissions of the file that is replaced
  std::vector<char> buffer_;      ///< The stream's
  std::FILE* stream_ = nullptr;
  bool direct_ = false;  ///< A device or a pipe: no temporary, no rename
  bool done_ = false;    ///< Committed
};

}  // namespace kiln

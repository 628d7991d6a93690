// Files that are written atomically: either complete, or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "io/file/temporary.h"

namespace kiln {

/// A temporary file in the destination's folder. commit() renames it to the destination, or passes
/// it to the open OutputSet, which does so later. Without commit(), the destructor removes it.
///
/// On file systems with O_TMPFILE (Linux) the file has no name until it is complete, so that even a
/// killed process leaves no file; elsewhere it has a hidden name. Replaced files keep their permissions;
/// new ones follow the process's umask. Symbolic links are followed, and their target is replaced or
/// created. A destination that is neither a file nor a folder (`/dev/stdout`, a pipe) is written to
/// directly. The bytes are flushed to the medium before the rename.
class AtomicFile {
 public:
  /// \throws Error(output) if the folder is missing or not writable, or the destination is a folder
  ///         or write-protected; the message says which. Error(usage) for a file that was read while
  ///         an OutputSet is open
  /// \param allow_unnamed  false: use a hidden name even on file systems with O_TMPFILE
  explicit AtomicFile(std::filesystem::path destination, bool allow_unnamed = true);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The destination as the caller gave it.
  const std::filesystem::path& destination() const { return destination_; }
  /// The file's current name; empty while it is unnamed (before close_stream()).
  const std::filesystem::path& temporary() const { return temporary_.path(); }
  /// The stream to write to; null after close_stream() or commit().
  std::FILE* stream() const { return stream_; }

  /// \throws Error(output), for example for a full disk
  void write(const void* data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// For libraries that open the file by name: closes the stream and gives the file the name
  /// temporary().
  /// \throws Error(output)
  void close_stream();
  /// Completes the file; at most one call.
  /// \throws Error(output); in this case, the temporary file is removed
  void commit();

  /// Throws an Error(output) that names the destination, the reason (from errno if not zero) and a
  /// remedy.
  [[noreturn]] void fail(std::string_view what, int error_number) const;

 private:
  void follow_links();
  void examine_destination();
  void open_stream(int descriptor);
  int create_named();
  void give_hidden_name();
  void begin_flush(int descriptor) const;
  void discard() noexcept;

  std::filesystem::path destination_;
  std::filesystem::path target_;  ///< Absolute path of the destination with links resolved
  TemporaryName temporary_;
  std::optional<unsigned> mode_;  ///< Permissions of the replaced file
  std::vector<char> buffer_;      ///< Buffer of the stream
  std::FILE* stream_ = nullptr;
  /// True if the destination is a device or a pipe, which is written to directly
  bool is_written_directly_ = false;
  bool is_committed_ = false;  ///< True after commit()
};

}  // namespace kiln

// File operations beyond std::filesystem. Implemented in posix/ and windows/. On Windows, files have names while they
// are written, and the access rights of folders are not checked.
//
// Functions that fail return -1, false or an empty value, and set errno.
#pragma once

#include <cerrno>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace kiln::os {

/// Identity of a file, independent of its names.
struct FileId {
  std::uint64_t device = 0, file = 0;
  friend auto operator<=>(const FileId&, const FileId&) = default;
};

struct FileStatus {
  FileId id;
  bool is_regular = false;
  bool is_folder = false;
  bool is_owned_by_user = false;  ///< Owned by the user who runs the process
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  ///< Time of the last change, in seconds since 1970
  /// Times of the last change of contents and of metadata, nanoseconds since 1970; 0: unknown.
  std::int64_t modified_ns = 0, changed_ns = 0;
  unsigned permissions = 0;  ///< Permission bits as in chmod
};

std::optional<FileStatus> query_file(const std::filesystem::path& path) noexcept;
/// The properties of a symbolic link itself, not of its target.
std::optional<FileStatus> query_link(const std::filesystem::path& path) noexcept;
std::optional<FileStatus> query_file(int file) noexcept;

// These functions open files whose descriptors are not inherited by child programs.

/// Opens a file for reading. For a pipe, does not wait until the pipe has a writer.
int open_to_read(const std::filesystem::path& path) noexcept;
/// Opens an existing file for writing, such as a pipe.
int open_to_write(const std::filesystem::path& path) noexcept;
/// Creates a file; fails if it exists.
int create_file(const std::filesystem::path& path, unsigned permissions) noexcept;
/// Creates a file without a name; link_unnamed_file() can assign one.
int create_unnamed(const std::filesystem::path& folder) noexcept;
/// Opens a folder and locks it against other processes. Waits for at most `seconds`, then returns -1 with
/// EWOULDBLOCK. On file systems without locks, it succeeds without a lock.
int lock_folder(const std::filesystem::path& folder, double seconds) noexcept;
int duplicate(int file) noexcept;
void close(int file) noexcept;

/// Assigns a name, which must not exist, to a file of create_unnamed().
bool link_unnamed_file(int file, const std::filesystem::path& name) noexcept;
/// A path at which other processes can read an open file.
std::string path_of_open_file(int file);

std::FILE* stream_of(int file) noexcept;  ///< For writing; closing the stream closes the file
int descriptor_of_stream(std::FILE* stream) noexcept;  ///< File descriptor of a stream
std::ptrdiff_t read_at(int file, std::uint64_t offset, void* to, std::size_t bytes) noexcept;
/// Calls read_at() until all bytes are read. \returns the number of bytes; fewer at the end of the file, with errno 0,
/// or after an error, with its errno
inline std::size_t read_fully(int file, std::uint64_t offset, void* to,
                              std::size_t bytes) noexcept {
  std::size_t total_bytes = 0;
  errno = 0;
  while (total_bytes < bytes) {
    const std::ptrdiff_t read_bytes = read_at(
        file, offset + total_bytes, static_cast<char*>(to) + total_bytes, bytes - total_bytes);
    if (read_bytes < 0 && errno == EINTR) {
      errno = 0;
      continue;
    }
    if (read_bytes <= 0) break;
    total_bytes += static_cast<std::size_t>(read_bytes);
  }
  return total_bytes;
}
std::ptrdiff_t write_some(int file, const void* from, std::size_t bytes) noexcept;

/// Waits until the file is on its storage device.
bool sync(int file) noexcept;
/// Starts writing the file to its storage device, without waiting.
void begin_sync(int file) noexcept;
bool set_permissions(int file, unsigned permissions) noexcept;
/// True if the process may write to the file.
bool may_write(const std::filesystem::path& path) noexcept;
/// True if the process may create files in the folder.
bool may_write_in(const std::filesystem::path& folder) noexcept;
/// Moves a file to another name atomically, replacing a file that has it.
bool replace(const std::filesystem::path& from, const std::filesystem::path& to) noexcept;
bool add_hard_link(const std::filesystem::path& of,
                   const std::filesystem::path& name) noexcept;  ///< Adds a hard link

// These functions replace those of std::filesystem with the same names, which treat a network share of Windows
// (\\server\share) as a folder of the current drive.
bool is_absolute(const std::filesystem::path& path);
std::filesystem::path join(const std::filesystem::path& folder, const std::filesystem::path& path);
std::filesystem::path absolute(const std::filesystem::path& path, std::error_code& error);
/// lexically_normal()
std::filesystem::path normal(const std::filesystem::path& path);
/// The normal form of absolute(). \throws std::filesystem::filesystem_error if there is no current folder
std::filesystem::path absolute_normal(const std::filesystem::path& path);
/// weakly_canonical() of absolute(): follows links as far as the path exists. Not on Windows.
std::filesystem::path canonical(const std::filesystem::path& path, std::error_code& error);

/// A key that is equal for all spellings of a name that the system takes for the same file: on Windows, case, the kind
/// of slash, and dots and spaces at the end make no difference. Links are not followed.
std::string name_key(const std::filesystem::path& path);
/// True on Windows for names of devices other than `NUL`, with any extension: a file `con.png` would be written to the
/// console.
bool is_device_name(const std::filesystem::path& path);

// Removes a file. Async-signal-safe, so the parameter is path.c_str(), not a path.
bool remove_file(const std::filesystem::path::value_type* path) noexcept;
/// Removes an empty folder.
bool remove_folder(const std::filesystem::path::value_type* path) noexcept;

// Functions for folders that other users cannot put files into.

/// The first level of a path at which another user could replace a part of the path: a folder or link that belongs to
/// another user, or that others may write to. Root's folders are trusted. Folders that all users may write to and that
/// have the sticky bit, such as /tmp, are trusted, too, if the next level exists and belongs to this user. Empty if
/// there is no such level.
std::filesystem::path find_unsafe_level(const std::filesystem::path& path);
/// Creates a folder and its missing parents, accessible by this user only.
void create_private_folders(const std::filesystem::path& path) noexcept;
/// The folder for temporary files: TMPDIR, or the system's default.
std::filesystem::path temporary_folder();
/// Creates a folder with a new name in temporary_folder(), accessible by this user only. \returns its path;
/// empty on failure
std::filesystem::path create_temporary_folder(const std::string& start_of_name);
/// This user's permanent folder in temporary_folder(): `kiln-USER`.
std::filesystem::path user_folder();
/// Sets an environment variable; null: unsets it.
void set_environment_variable(const char* name, const char* value) noexcept;

long process_id() noexcept;
/// A text of 16 hexadecimal digits that names temporary files. It identifies the machine, its current boot and the
/// process numbering, of which each container has its own. Files with another id may belong to processes that this one
/// cannot see.
const std::string& process_namespace_id();
/// True if the process with this number has ended. Only valid for processes with the same process_namespace_id().
bool has_process_ended(long process) noexcept;

}  // namespace kiln::os

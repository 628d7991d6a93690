// The operating system's calls on files, beyond std::filesystem: those of POSIX have their home in file.cpp. Elsewhere
// than on POSIX, files have names while they are written, and folders no locks.
//
// Functions that fail return -1, false or nothing, and set errno.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

namespace kiln::os {

/// A file, whatever its names.
struct FileId {
  std::uint64_t device = 0, file = 0;
  friend auto operator<=>(const FileId&, const FileId&) = default;
};

struct FileFacts {
  FileId id;
  bool is_regular = false;
  bool is_folder = false;
  bool is_own = false;  ///< Owned by the user who runs the process
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  ///< Seconds since 1970
  /// Of the contents and of anything about the file, nanoseconds since 1970; 0: not to be known.
  std::int64_t modified_ns = 0, changed_ns = 0;
  unsigned permissions = 0;  ///< As chmod has them
};

std::optional<FileFacts> facts_of(const std::filesystem::path& path) noexcept;
/// Facts of a link itself, where the path names one.
std::optional<FileFacts> facts_of_link(const std::filesystem::path& path) noexcept;
std::optional<FileFacts> facts_of(int file) noexcept;

// Descriptors of open files, which no program that is run from here inherits.
int open_to_read(
    const std::filesystem::path& path) noexcept;  ///< Does not wait for a pipe's writer
int open_to_write(
    const std::filesystem::path& path) noexcept;  ///< Opens what is there, such as a pipe
/// A file that is not there yet.
int create_file(const std::filesystem::path& path, unsigned permissions) noexcept;
/// A file without a name, which name_file() can give one.
int create_unnamed(const std::filesystem::path& folder) noexcept;
/// Opens a folder, and waits until no other process has it locked: at most so many seconds, then returns -1 with
/// EWOULDBLOCK. File systems without locks do without.
int lock_folder(const std::filesystem::path& folder, double seconds) noexcept;
int duplicate(int file) noexcept;
void close(int file) noexcept;

/// Gives a file of create_unnamed() its name, at which there is nothing yet.
bool name_file(int file, const std::filesystem::path& name) noexcept;
/// A path at which other processes can read an open file.
std::string name_of_open(int file);

std::FILE* stream_of(int file) noexcept;  ///< To write; closes the file
int file_of(std::FILE* stream) noexcept;  ///< The stream's
std::ptrdiff_t read_at(int file, std::uint64_t offset, void* to, std::size_t bytes) noexcept;
std::ptrdiff_t write_some(int file, const void* from, std::size_t bytes) noexcept;

/// Waits until the file is on the medium.
bool sync(int file) noexcept;
/// Lets its bytes set out for the medium: a hint.
void begin_sync(int file) noexcept;
bool set_permissions(int file, unsigned permissions) noexcept;
/// True if the process may write there.
bool may_write(const std::filesystem::path& path) noexcept;
/// True if it may make files in a folder.
bool may_write_in(const std::filesystem::path& folder) noexcept;
/// Puts a file in the place of another, at once.
bool replace(const std::filesystem::path& from, const std::filesystem::path& to) noexcept;
bool add_name(const std::filesystem::path& of,
              const std::filesystem::path& name) noexcept;  ///< A hard link

// For signal handlers, too: of fs::path::c_str().
bool remove_file(const std::filesystem::path::value_type* path) noexcept;
bool remove_folder(const std::filesystem::path::value_type* path) noexcept;  ///< An empty one

// Folders that nobody else can put files into.

/// First level of a path, its end included, by which someone else could put files at its end: the level, or a link on
/// the way, belongs to another user, or others may write to it. The system's (root's) are trusted; so is a level that
/// is open to all, where each may remove only files of their own (sticky, as /tmp), if the next one is there and one's
/// own. Empty: there is none.
std::filesystem::path shared_level(const std::filesystem::path& path);
/// Makes a folder, and those that it lies in, for this user alone, where they are missing.
void create_private_folders(const std::filesystem::path& path) noexcept;
/// The folder for temporary files: TMPDIR, else the system's.
std::filesystem::path temporary_folder();
/// This user's own name within it, of a folder that stays: `kiln-USER`.
std::filesystem::path user_folder();
/// Sets a variable of the environment; null: it is not set any more.
void set_variable(const char* name, const char* value) noexcept;

long process_id() noexcept;
/// Of this start of this machine and its numbers of processes (containers have their own): files with another mark may
/// be of processes that are not seen from here. 16 of 0-9 and a-f.
const std::string& process_mark();
/// True if there is no such process any more, of those with this process's mark.
bool is_gone(long process) noexcept;

}  // namespace kiln::os

#include "base/file.h"

#include <cerrno>

#ifdef _WIN32
#include <direct.h>
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <sys/stat.h>
#else
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>
#endif

namespace kiln::os {

namespace fs = std::filesystem;

#ifdef _WIN32

namespace {

FileFacts facts(const struct _stat64& status) {
  FileFacts facts;
  facts.is_regular = (status.st_mode & _S_IFMT) == _S_IFREG;
  facts.is_folder = (status.st_mode & _S_IFMT) == _S_IFDIR;
  facts.is_own = true;
  facts.bytes = static_cast<std::uint64_t>(status.st_size);
  facts.modified = status.st_mtime;
  facts.permissions = status.st_mode & 0777U;
  return facts;
}

bool done(const std::error_code& error) {
  if (error) errno = error.default_error_condition().value();
  return !error;
}

}  // namespace

std::optional<FileFacts> facts_of(const fs::path& path) noexcept {
  struct _stat64 status {};
  if (_wstat64(path.c_str(), &status) != 0) return std::nullopt;
  FileFacts found = facts(status);
  // Files have no numbers here: names stand for them.
  std::error_code error;
  found.id.file = fs::hash_value(fs::weakly_canonical(path, error));
  return found;
}
std::optional<FileFacts> facts_of_link(const fs::path& path) noexcept { return facts_of(path); }
std::optional<FileFacts> facts_of(int file) noexcept {
  struct _stat64 status {};
  if (_fstat64(file, &status) != 0) return std::nullopt;
  return facts(status);
}

int open_to_read(const fs::path& path) noexcept {
  return _wopen(path.c_str(), _O_RDONLY | _O_BINARY | _O_NOINHERIT);
}
int open_to_write(const fs::path& path) noexcept {
  return _wopen(path.c_str(), _O_WRONLY | _O_BINARY | _O_NOINHERIT);
}
int create_file(const fs::path& path, unsigned /*permissions*/) noexcept {
  return _wopen(path.c_str(), _O_CREAT | _O_EXCL | _O_WRONLY | _O_BINARY | _O_NOINHERIT,
                _S_IREAD | _S_IWRITE);
}
int create_unnamed(const fs::path& /*folder*/) noexcept { return -1; }
int lock_folder(const fs::path& /*folder*/, double /*seconds*/) noexcept { return -1; }
int duplicate(int file) noexcept { return _dup(file); }
void close(int file) noexcept { _close(file); }

bool name_file(int /*file*/, const fs::path& /*name*/) noexcept {
  errno = EINVAL;
  return false;
}
std::string name_of_open(int /*file*/) { return {}; }

std::FILE* stream_of(int file) noexcept { return _fdopen(file, "wb"); }
int file_of(std::FILE* stream) noexcept { return _fileno(stream); }
std::ptrdiff_t read_at(int file, std::uint64_t offset, void* to, std::size_t bytes) noexcept {
  if (_lseeki64(file, static_cast<std::int64_t>(offset), SEEK_SET) < 0) return -1;
  return _read(file, to, static_cast<unsigned>(bytes));
}
std::ptrdiff_t write_some(int file, const void* from, std::size_t bytes) noexcept {
  return _write(file, from, static_cast<unsigned>(bytes));
}

bool sync(int file) noexcept {
  // A file that is open to read cannot be; it is closed after it was written.
  return _commit(file) == 0 || errno == EBADF;
}
void begin_sync(int /*file*/) noexcept {}
bool set_permissions(int /*file*/, unsigned /*permissions*/) noexcept { return true; }
bool may_write(const fs::path& path) noexcept { return _waccess(path.c_str(), 2) == 0; }
bool may_write_in(const fs::path& folder) noexcept { return may_write(folder); }
bool replace(const fs::path& from, const fs::path& to) noexcept {
  std::error_code error;
  fs::rename(from, to, error);
  return done(error);
}
bool add_name(const fs::path& of, const fs::path& name) noexcept {
  std::error_code error;
  fs::create_hard_link(of, name, error);
  return done(error);
}
bool remove_file(const wchar_t* path) noexcept { return _wunlink(path) == 0; }
bool remove_folder(const wchar_t* path) noexcept { return _wrmdir(path) == 0; }

long process_id() noexcept { return _getpid(); }
bool is_gone(long /*process*/) noexcept { return false; }  // not to be known

#else

namespace {

FileFacts facts(const struct stat& status) {
  FileFacts facts;
  facts.id = {status.st_dev, status.st_ino};
  facts.is_regular = S_ISREG(status.st_mode);
  facts.is_folder = S_ISDIR(status.st_mode);
  facts.is_own = status.st_uid == geteuid();
  facts.bytes = static_cast<std::uint64_t>(status.st_size);
  facts.modified = status.st_mtime;
  facts.permissions = status.st_mode & 07777;
  return facts;
}

}  // namespace

std::optional<FileFacts> facts_of(const fs::path& path) noexcept {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  return facts(status);
}
std::optional<FileFacts> facts_of_link(const fs::path& path) noexcept {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return std::nullopt;
  return facts(status);
}
std::optional<FileFacts> facts_of(int file) noexcept {
  struct stat status {};
  if (fstat(file, &status) != 0) return std::nullopt;
  return facts(status);
}

int open_to_read(const fs::path& path) noexcept {
  return open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}
int open_to_write(const fs::path& path) noexcept {
  return open(path.c_str(), O_WRONLY | O_CLOEXEC);
}
int create_file(const fs::path& path, unsigned permissions) noexcept {
  return open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, permissions);
}
int create_unnamed(const fs::path& folder) noexcept {
#ifdef O_TMPFILE
  const int file = open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  // The file is given its name through /proc: without that it could never appear.
  if (file < 0 || access(("/proc/self/fd/" + std::to_string(file)).c_str(), F_OK) == 0) return file;
  ::close(file);
#endif
  return -1;
}
int lock_folder(const fs::path& folder, double seconds) noexcept {
  constexpr std::chrono::milliseconds kPause(20);
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (file >= 0 && flock(file, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) break;
    if (std::chrono::steady_clock::now() >= end) {
      ::close(file);
      errno = EWOULDBLOCK;
      return -1;
    }
    std::this_thread::sleep_for(kPause);
  }
  return file;
}
int duplicate(int file) noexcept { return fcntl(file, F_DUPFD_CLOEXEC, 0); }
void close(int file) noexcept { ::close(file); }

bool name_file(int file, const fs::path& name) noexcept {
  const std::string open_file = "/proc/self/fd/" + std::to_string(file);
  return linkat(AT_FDCWD, open_file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}
std::string name_of_open(int file) {
  return "/proc/" + std::to_string(process_id()) + "/fd/" + std::to_string(file);
}

std::FILE* stream_of(int file) noexcept { return fdopen(file, "wb"); }
int file_of(std::FILE* stream) noexcept { return fileno(stream); }
std::ptrdiff_t read_at(int file, std::uint64_t offset, void* to, std::size_t bytes) noexcept {
  return pread(file, to, bytes, static_cast<off_t>(offset));
}
std::ptrdiff_t write_some(int file, const void* from, std::size_t bytes) noexcept {
  return write(file, from, bytes);
}

bool sync(int file) noexcept { return fsync(file) == 0; }
void begin_sync(int file) noexcept {
#ifdef SYNC_FILE_RANGE_WRITE
  if (sync_file_range(file, 0, 0, SYNC_FILE_RANGE_WRITE) != 0) errno = 0;
#endif
}
bool set_permissions(int file, unsigned permissions) noexcept {
  return fchmod(file, permissions) == 0;
}
bool may_write(const fs::path& path) noexcept { return access(path.c_str(), W_OK) == 0; }
bool may_write_in(const fs::path& folder) noexcept {
  return access(folder.c_str(), W_OK | X_OK) == 0;
}
bool replace(const fs::path& from, const fs::path& to) noexcept {
  return std::rename(from.c_str(), to.c_str()) == 0;
}
bool add_name(const fs::path& of, const fs::path& name) noexcept {
  return link(of.c_str(), name.c_str()) == 0;
}
bool remove_file(const char* path) noexcept { return unlink(path) == 0; }
bool remove_folder(const char* path) noexcept { return rmdir(path) == 0; }

long process_id() noexcept { return getpid(); }
bool is_gone(long process) noexcept {
  return process > 0 && kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH;
}

#endif

}  // namespace kiln::os

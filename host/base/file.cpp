#include "base/file.h"

#include <cerrno>
#include <cstdlib>

#include "base/fnv.h"

#ifdef _WIN32
#include <direct.h>
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <sys/stat.h>
#else
#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <list>
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

fs::path shared_level(const fs::path& /*path*/) { return {}; }  // not to be known
void create_private_folders(const fs::path& path) noexcept {
  std::error_code error;
  fs::create_directories(path, error);
}
fs::path user_folder() { return temporary_folder() / "kiln"; }  // the folder is the user's own
void set_variable(const char* name, const char* value) noexcept {
  _putenv_s(name, value == nullptr ? "" : value);
}

long process_id() noexcept { return _getpid(); }
const std::string& process_mark() {
  static const std::string none(16, '0');
  return none;
}
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
#ifdef __linux__
  const auto nanoseconds = [](const timespec& time) {
    return std::int64_t{time.tv_sec} * 1000000000 + time.tv_nsec;
  };
  facts.modified_ns = nanoseconds(status.st_mtim);
  facts.changed_ns = nanoseconds(status.st_ctim);
#endif
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

namespace {

std::string line_of(const char* path) {
  std::string line;
  std::ifstream file(path);
  std::getline(file, line);
  return line;
}

/// The owner by which files of the system's show within a namespace of users that does not have root; else none.
std::optional<uid_t> root_without_number() {
  std::ifstream map("/proc/self/uid_map");
  unsigned long inside = 0, outside = 0, count = 0;
  bool any = false;
  while (map >> inside >> outside >> count) {
    any = true;
    if (inside == 0) return std::nullopt;
  }
  const std::string shown = line_of("/proc/sys/kernel/overflowuid");
  if (!any || shown.empty()) return std::nullopt;
  return static_cast<uid_t>(std::strtoul(shown.c_str(), nullptr, 10));
}

/// True of root's group, and of one that has this user's name and no other member, as many systems give each user.
bool is_private(gid_t group) {
  if (group == 0) return true;
  std::array<char, 4096> user_text{}, group_text{};
  struct passwd user {};
  struct group members {};
  struct passwd* found_user = nullptr;
  struct group* found_group = nullptr;
  getpwuid_r(geteuid(), &user, user_text.data(), user_text.size(), &found_user);
  getgrgid_r(group, &members, group_text.data(), group_text.size(), &found_group);
  if (found_user == nullptr || found_group == nullptr) return false;
  const std::string name = user.pw_name;
  if (name != members.gr_name) return false;
  for (char** member = members.gr_mem; *member != nullptr; ++member) {
    if (name != *member) return false;
  }
  return true;
}

bool others_may_write(const struct stat& status) {
  return (status.st_mode & S_IWOTH) != 0 ||
         ((status.st_mode & S_IWGRP) != 0 && !is_private(status.st_gid));
}

}  // namespace

fs::path shared_level(const fs::path& path) {
  constexpr int kMostLinks = 40;  // as Linux follows
  static const std::optional<uid_t> system = root_without_number();
  const auto parts_of = [](const fs::path& whole) {
    std::list<fs::path> parts(whole.begin(), whole.end());
    parts.remove_if([](const fs::path& part) { return part.empty() || part == "."; });
    return parts;
  };
  std::error_code error;
  std::list<fs::path> left = parts_of(fs::absolute(path, error));
  if (error) return path;
  fs::path at;
  bool open_to_all = false;   // others may make names in `at`
  bool among_others = false;  // or in one of the levels before
  for (int links = 0; !left.empty();) {
    const fs::path part = left.front();
    left.pop_front();
    if (part == "..") {
      left.splice(left.begin(), parts_of(at.parent_path()));  // looked at again, from the root on
      at.clear();
      continue;
    }
    const fs::path next = at / part;
    struct stat status {};
    // What is not there yet is this process's to make, unless others can do so first.
    if (lstat(next.c_str(), &status) != 0) return open_to_all ? next : fs::path();
    const bool is_trusted = status.st_uid == geteuid() || status.st_uid == 0 ||
                            (!among_others && status.st_uid == system);
    if (!is_trusted) return next;
    if (S_ISLNK(status.st_mode)) {
      const fs::path to = fs::read_symlink(next, error);
      if (error || ++links > kMostLinks) return next;
      left.splice(left.begin(), parts_of(to));
      continue;
    }
    at = next;
    open_to_all = others_may_write(status);
    among_others = among_others || open_to_all;
    if (open_to_all && ((status.st_mode & S_ISVTX) == 0 || left.empty())) return at;
  }
  return {};
}

void create_private_folders(const fs::path& path) noexcept {
  try {
    fs::path folder;
    for (const fs::path& part : path) {
      folder /= part;
      if (mkdir(folder.c_str(), 0700) != 0) errno = 0;  // it is there, or its use fails
    }
  } catch (const std::exception&) {
  }
}

fs::path user_folder() { return temporary_folder() / ("kiln-" + std::to_string(geteuid())); }

void set_variable(const char* name, const char* value) noexcept {
  value == nullptr ? unsetenv(name) : setenv(name, value, 1);
}

long process_id() noexcept { return getpid(); }
const std::string& process_mark() {
  static const std::string made = [] {
    std::string text = line_of("/proc/sys/kernel/random/boot_id");
    std::array<char, 256> name{};
    if (text.empty() && gethostname(name.data(), name.size() - 1) == 0) text = name.data();
    std::error_code error;
    text += '\n' + fs::read_symlink("/proc/self/ns/pid", error).string();
    std::snprintf(name.data(), name.size(), "%016llx",
                  static_cast<unsigned long long>(fnv1a(text)));
    return std::string(name.data());
  }();
  return made;
}
bool is_gone(long process) noexcept {
  return process > 0 && kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH;
}

#endif

fs::path temporary_folder() {
  if (const char* given = std::getenv("TMPDIR"); given != nullptr && *given != '\0') return given;
#ifdef _WIN32
  std::error_code error;
  return fs::temp_directory_path(error);
#else
  return "/tmp";
#endif
}

}  // namespace kiln::os

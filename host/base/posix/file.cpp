#include "base/file.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <list>
#include <thread>

#include "base/fnv.h"

namespace kiln::os {

namespace fs = std::filesystem;

namespace {

FileStatus to_file_status(const struct stat& status) {
  FileStatus result;
  result.id = {status.st_dev, status.st_ino};
  result.is_regular = S_ISREG(status.st_mode);
  result.is_folder = S_ISDIR(status.st_mode);
  result.is_owned_by_user = status.st_uid == geteuid();
  result.bytes = static_cast<std::uint64_t>(status.st_size);
  result.modified = status.st_mtime;
#ifdef __linux__
  const auto nanoseconds = [](const timespec& time) {
    return std::int64_t{time.tv_sec} * 1000000000 + time.tv_nsec;
  };
  result.modified_ns = nanoseconds(status.st_mtim);
  result.changed_ns = nanoseconds(status.st_ctim);
#endif
  result.permissions = status.st_mode & 07777;
  return result;
}

}  // namespace

std::optional<FileStatus> query_file(const fs::path& path) noexcept {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  return to_file_status(status);
}
std::optional<FileStatus> query_link(const fs::path& path) noexcept {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return std::nullopt;
  return to_file_status(status);
}
std::optional<FileStatus> query_file(int file) noexcept {
  struct stat status {};
  if (fstat(file, &status) != 0) return std::nullopt;
  return to_file_status(status);
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
  // link_unnamed_file() needs /proc to assign a name, so a file is only created if /proc is available.
  if (file < 0 || access(("/proc/self/fd/" + std::to_string(file)).c_str(), F_OK) == 0) return file;
  ::close(file);
#endif
  return -1;
}
int lock_folder(const fs::path& folder, double seconds) noexcept {
  constexpr std::chrono::milliseconds kRetryInterval(20);
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (file >= 0 && flock(file, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) break;
    if (std::chrono::steady_clock::now() >= end) {
      ::close(file);
      errno = EWOULDBLOCK;
      return -1;
    }
    std::this_thread::sleep_for(kRetryInterval);
  }
  return file;
}
int duplicate(int file) noexcept { return fcntl(file, F_DUPFD_CLOEXEC, 0); }
void close(int file) noexcept { ::close(file); }

bool link_unnamed_file(int file, const fs::path& name) noexcept {
  const std::string open_file = "/proc/self/fd/" + std::to_string(file);
  return linkat(AT_FDCWD, open_file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}
std::string path_of_open_file(int file) {
  return "/proc/" + std::to_string(process_id()) + "/fd/" + std::to_string(file);
}

std::FILE* stream_of(int file) noexcept { return fdopen(file, "wb"); }
int descriptor_of_stream(std::FILE* stream) noexcept { return fileno(stream); }
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
bool add_hard_link(const fs::path& of, const fs::path& name) noexcept {
  return link(of.c_str(), name.c_str()) == 0;
}
bool is_absolute(const fs::path& path) { return path.is_absolute(); }
fs::path join(const fs::path& folder, const fs::path& path) { return folder / path; }
fs::path absolute(const fs::path& path, std::error_code& error) {
  return fs::absolute(path, error);
}
fs::path normal(const fs::path& path) { return path.lexically_normal(); }
fs::path absolute_normal(const fs::path& path) { return fs::absolute(path).lexically_normal(); }
fs::path canonical(const fs::path& path, std::error_code& error) {
  // If the first folder of a relative path does not exist, weakly_canonical() returns a relative path.
  const fs::path whole = fs::absolute(path, error);
  return error ? fs::path() : fs::weakly_canonical(whole, error);
}
std::string name_key(const fs::path& path) { return path.string(); }
bool is_device_name(const fs::path& /*path*/) { return false; }
bool remove_file(const char* path) noexcept { return unlink(path) == 0; }
bool remove_folder(const char* path) noexcept { return rmdir(path) == 0; }

namespace {

std::string read_first_line(const char* path) {
  std::string line;
  std::ifstream file(path);
  std::getline(file, line);
  return line;
}

/// On Linux: the user id that root's files have in a user namespace that does not map root; else nullopt.
std::optional<uid_t> unmapped_root_id() {
  std::ifstream map("/proc/self/uid_map");
  unsigned long inside_id = 0, outside_id = 0, count = 0;
  bool has_entries = false;
  while (map >> inside_id >> outside_id >> count) {
    has_entries = true;
    if (inside_id == 0) return std::nullopt;
  }
  const std::string unmapped_id_text = read_first_line("/proc/sys/kernel/overflowuid");
  if (!has_entries || unmapped_id_text.empty()) return std::nullopt;
  return static_cast<uid_t>(std::strtoul(unmapped_id_text.c_str(), nullptr, 10));
}

/// True for root's group, and for a group that has this user's name and no other member; many systems create such a
/// group for each user.
bool is_private_group(gid_t group) {
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
         ((status.st_mode & S_IWGRP) != 0 && !is_private_group(status.st_gid));
}

}  // namespace

fs::path find_unsafe_level(const fs::path& path) {
  constexpr int kMaxLinks = 40;  // as in Linux
  static const std::optional<uid_t> system = unmapped_root_id();
  const auto split_path = [](const fs::path& whole) {
    std::list<fs::path> path_parts(whole.begin(), whole.end());
    path_parts.remove_if([](const fs::path& part) { return part.empty() || part == "."; });
    return path_parts;
  };
  std::error_code error;
  std::list<fs::path> remaining = split_path(fs::absolute(path, error));
  if (error) return path;
  fs::path at;
  bool others_may_create = false;        // others may create files in the folder `at`
  bool others_may_create_above = false;  // others may create files in a level above
  for (int links = 0; !remaining.empty();) {
    const fs::path part = remaining.front();
    remaining.pop_front();
    if (part == "..") {
      // Walks to the parent folder again, beginning at the root
      remaining.splice(remaining.begin(), split_path(at.parent_path()));
      at.clear();
      continue;
    }
    const fs::path next = at / part;
    struct stat status {};
    // A missing folder is safe, since this process will create it, unless others may create it first.
    if (lstat(next.c_str(), &status) != 0) return others_may_create ? next : fs::path();
    const bool is_trusted = status.st_uid == geteuid() || status.st_uid == 0 ||
                            (!others_may_create_above && status.st_uid == system);
    if (!is_trusted) return next;
    if (S_ISLNK(status.st_mode)) {
      const fs::path to = fs::read_symlink(next, error);
      if (error || ++links > kMaxLinks) return next;
      // If the link's target is an absolute path, the walk restarts at the root
      remaining.splice(remaining.begin(), split_path(to));
      continue;
    }
    at = next;
    others_may_create = others_may_write(status);
    others_may_create_above = others_may_create_above || others_may_create;
    if (others_may_create && ((status.st_mode & S_ISVTX) == 0 || remaining.empty())) return at;
  }
  return {};
}

void create_private_folders(const fs::path& path) noexcept {
  try {
    fs::path folder;
    for (const fs::path& part : path) {
      folder /= part;
      // an existing folder is not an error; other errors are reported when the folder is first used
      if (mkdir(folder.c_str(), 0700) != 0) errno = 0;
    }
  } catch (const std::exception&) {
  }
}

fs::path user_folder() { return temporary_folder() / ("kiln-" + std::to_string(geteuid())); }

void set_environment_variable(const char* name, const char* value) noexcept {
  value == nullptr ? unsetenv(name) : setenv(name, value, 1);
}

long process_id() noexcept { return getpid(); }
const std::string& process_namespace_id() {
  static const std::string folder_path = [] {
    std::string text = read_first_line("/proc/sys/kernel/random/boot_id");
    std::array<char, 256> name{};
    if (text.empty() && gethostname(name.data(), name.size() - 1) == 0) text = name.data();
    std::error_code error;
    text += '\n' + fs::read_symlink("/proc/self/ns/pid", error).string();
    std::snprintf(name.data(), name.size(), "%016llx",
                  static_cast<unsigned long long>(fnv1a(text)));
    return std::string(name.data());
  }();
  return folder_path;
}
bool has_process_ended(long process) noexcept {
  return process > 0 && kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH;
}

fs::path create_temporary_folder(const std::string& start_of_name) {
  std::string folder = temporary_folder() / (start_of_name + "XXXXXX");
  return mkdtemp(folder.data()) == nullptr ? "" : folder;
}
fs::path temporary_folder() {
  const char* const variable_value = std::getenv("TMPDIR");
  return variable_value != nullptr && *variable_value != '\0' ? variable_value : "/tmp";
}

}  // namespace kiln::os

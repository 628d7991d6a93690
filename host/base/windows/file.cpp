#include "base/file.h"

#include <fcntl.h>
#include <io.h>
#include <process.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "base/fnv.h"
#include "base/lower_case.h"
#include "base/windows/api.h"

namespace kiln::os {

namespace fs = std::filesystem;

namespace {

/// Share mode that lets this process and others rename and remove an open file, as on POSIX.
constexpr DWORD kShareModeAll = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
constexpr DWORD kMaxBytesPerCall = DWORD{1} << 30;

/// A handle, which the destructor closes.
class Handle {
 public:
  explicit Handle(HANDLE handle) : handle_(handle) {}
  ~Handle() {
    if (good()) CloseHandle(handle_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  bool good() const { return handle_ != INVALID_HANDLE_VALUE && handle_ != nullptr; }
  HANDLE get() const { return handle_; }

 private:
  HANDLE handle_;
};

HANDLE handle_of(int file) { return reinterpret_cast<HANDLE>(_get_osfhandle(file)); }

int descriptor_of(HANDLE handle, int flags) noexcept {
  if (!succeeded(handle != INVALID_HANDLE_VALUE)) return -1;
  const int file =
      _open_osfhandle(reinterpret_cast<intptr_t>(handle), flags | _O_BINARY | _O_NOINHERIT);
  if (file < 0) CloseHandle(handle);
  return file;
}

HANDLE open_handle(const fs::path& path, DWORD access, DWORD creation, DWORD flags) {
  return CreateFileW(api_path(path).c_str(), access, kShareModeAll, nullptr, creation, flags,
                     nullptr);
}

/// Converts units of 100 ns since 1601 to nanoseconds since 1970.
std::int64_t unix_nanoseconds(std::int64_t file_time) {
  constexpr std::int64_t kTicksTo1970 = 116444736000000000;
  return file_time <= 0 ? 0 : (file_time - kTicksTo1970) * 100;
}

std::optional<FileStatus> query_handle(HANDLE handle) noexcept {
  FileStatus file_status;
  file_status.is_owned_by_user = true;
  BY_HANDLE_FILE_INFORMATION handle_information{};
  FILE_BASIC_INFO file_times{};
  // For consoles, pipes and NUL, size and times cannot be queried.
  if (const DWORD type = GetFileType(handle); type == FILE_TYPE_CHAR || type == FILE_TYPE_PIPE) {
    return file_status;
  }
  if (!succeeded(GetFileInformationByHandle(handle, &handle_information) != FALSE))
    return std::nullopt;
  file_status.id.device = handle_information.dwVolumeSerialNumber;
  file_status.id.file =
      std::uint64_t{handle_information.nFileIndexHigh} << 32 | handle_information.nFileIndexLow;
  file_status.is_folder = (handle_information.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
  file_status.is_regular = !file_status.is_folder;
  file_status.bytes =
      std::uint64_t{handle_information.nFileSizeHigh} << 32 | handle_information.nFileSizeLow;
  file_status.permissions =
      (handle_information.dwFileAttributes & FILE_ATTRIBUTE_READONLY) != 0 ? 0444 : 0666;
  if (GetFileInformationByHandleEx(handle, FileBasicInfo, &file_times, sizeof file_times) !=
      FALSE) {
    file_status.modified_ns = unix_nanoseconds(file_times.LastWriteTime.QuadPart);
    file_status.changed_ns = unix_nanoseconds(file_times.ChangeTime.QuadPart);
    file_status.modified = file_status.modified_ns / 1000000000;
  }
  return file_status;
}

std::optional<FileStatus> query_file(const fs::path& path, DWORD flags) noexcept {
  // Folders can only be opened with backup semantics; only access to attributes is requested.
  const Handle file(
      open_handle(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS | flags));
  if (!succeeded(file.good())) return std::nullopt;
  return query_handle(file.get());
}

/// True if a retry cannot succeed, since the target is a folder or write-protected.
bool is_refused(const std::wstring& target) {
  const DWORD attributes = GetFileAttributesW(target.c_str());
  return attributes != INVALID_FILE_ATTRIBUTES &&
         (attributes & (FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_READONLY)) != 0;
}

}  // namespace

std::optional<FileStatus> query_file(const fs::path& path) noexcept { return query_file(path, 0); }
std::optional<FileStatus> query_link(const fs::path& path) noexcept {
  return query_file(path, FILE_FLAG_OPEN_REPARSE_POINT);
}
std::optional<FileStatus> query_file(int file) noexcept { return query_handle(handle_of(file)); }

int open_to_read(const fs::path& path) noexcept {
  return descriptor_of(open_handle(path, GENERIC_READ, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL),
                       _O_RDONLY);
}
int open_to_write(const fs::path& path) noexcept {
  return descriptor_of(open_handle(path, GENERIC_WRITE, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL),
                       _O_WRONLY);
}
int create_file(const fs::path& path, unsigned /*permissions*/) noexcept {
  return descriptor_of(open_handle(path, GENERIC_WRITE, CREATE_NEW, FILE_ATTRIBUTE_NORMAL),
                       _O_WRONLY);
}
int create_unnamed(const fs::path& /*folder*/) noexcept {
  errno = EINVAL;
  return -1;
}

int lock_folder(const fs::path& folder, double seconds) noexcept {
  // A lock is a file that only one process at a time can open, and that is deleted when it is closed, even if
  // the process crashes.
  constexpr std::chrono::milliseconds kRetryInterval(20);
  const fs::path name = folder / ".kiln-lock";
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  for (;;) {
    const HANDLE handle =
        CreateFileW(api_path(name).c_str(), GENERIC_WRITE | DELETE, 0, nullptr, OPEN_ALWAYS,
                    FILE_ATTRIBUTE_HIDDEN | FILE_FLAG_DELETE_ON_CLOSE, nullptr);
    if (handle != INVALID_HANDLE_VALUE) return descriptor_of(handle, _O_WRONLY);
    const DWORD error = GetLastError();
    set_errno();
    // Access is also denied while another process's file is being deleted.
    const bool is_held = error == ERROR_SHARING_VIOLATION ||
                         (error == ERROR_ACCESS_DENIED &&
                          GetFileAttributesW(api_path(name).c_str()) != INVALID_FILE_ATTRIBUTES);
    if (!is_held) return -1;
    if (std::chrono::steady_clock::now() >= end) {
      errno = EWOULDBLOCK;
      return -1;
    }
    std::this_thread::sleep_for(kRetryInterval);
  }
}
int duplicate(int file) noexcept { return _dup(file); }
void close(int file) noexcept { _close(file); }

bool link_unnamed_file(int /*file*/, const fs::path& /*name*/) noexcept {
  errno = EINVAL;
  return false;
}
std::string path_of_open_file(int /*file*/) { return {}; }

std::FILE* stream_of(int file) noexcept { return _fdopen(file, "wb"); }
int descriptor_of_stream(std::FILE* stream) noexcept { return _fileno(stream); }
std::ptrdiff_t read_at(int file, std::uint64_t offset, void* to, std::size_t bytes) noexcept {
  OVERLAPPED file_offset{};
  file_offset.Offset = static_cast<DWORD>(offset);
  file_offset.OffsetHigh = static_cast<DWORD>(offset >> 32);
  DWORD count = 0;
  const auto wanted = static_cast<DWORD>(std::min<std::size_t>(bytes, kMaxBytesPerCall));
  if (ReadFile(handle_of(file), to, wanted, &count, &file_offset) != FALSE) return count;
  if (GetLastError() == ERROR_HANDLE_EOF) return 0;
  set_errno();
  return -1;
}
std::ptrdiff_t write_some(int file, const void* from, std::size_t bytes) noexcept {
  return _write(file, from, static_cast<unsigned>(std::min<std::size_t>(bytes, kMaxBytesPerCall)));
}

bool sync(int file) noexcept {
  // Only a file that is open for writing can be flushed.
  const Handle writable_handle(ReOpenFile(handle_of(file), GENERIC_WRITE, kShareModeAll, 0));
  return succeeded(FlushFileBuffers(writable_handle.good() ? writable_handle.get()
                                                           : handle_of(file)) != FALSE) ||
         errno == EACCES || errno == EBADF;
}
void begin_sync(int /*file*/) noexcept {}
bool set_permissions(int /*file*/, unsigned /*permissions*/) noexcept { return true; }
bool may_write(const fs::path& path) noexcept { return _waccess(api_path(path).c_str(), 2) == 0; }
bool may_write_in(const fs::path& folder) noexcept {
  const Handle opened_file(
      open_handle(folder, FILE_ADD_FILE, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS));
  return succeeded(opened_file.good());
}
bool replace(const fs::path& from, const fs::path& to) noexcept {
  // A search indexer or virus scanner may have a file open for a moment, so the operation is retried.
  constexpr int kAttempts = 25;
  constexpr std::chrono::milliseconds kRetryInterval(40);
  const std::wstring source = api_path(from), target = api_path(to);
  for (int attempt = 1;; ++attempt) {
    const BOOL moved = MoveFileExW(source.c_str(), target.c_str(),
                                   MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH);
    if (moved != FALSE) return true;
    set_errno();
    if (errno != EACCES || attempt == kAttempts || is_refused(target)) return false;
    std::this_thread::sleep_for(kRetryInterval);
  }
}
bool add_hard_link(const fs::path& of, const fs::path& name) noexcept {
  return succeeded(CreateHardLinkW(api_path(name).c_str(), api_path(of).c_str(), nullptr) != FALSE);
}
bool remove_file(const wchar_t* path) noexcept {
  return succeeded(DeleteFileW(api_path(path).c_str()) != FALSE);
}
bool remove_folder(const wchar_t* path) noexcept {
  return succeeded(RemoveDirectoryW(api_path(path).c_str()) != FALSE);
}

namespace {

/// True for a share, and for the API's own paths: \\server\share\file, \\?\C:\file.
bool is_share(const fs::path& path) {
  const auto is_slash = [](wchar_t c) { return c == L'\\' || c == L'/'; };
  const std::wstring& name = path.native();
  return name.size() > 2 && is_slash(name[0]) && is_slash(name[1]) && !is_slash(name[2]);
}

}  // namespace

bool is_absolute(const fs::path& path) { return is_share(path) || path.is_absolute(); }
fs::path join(const fs::path& folder, const fs::path& path) {
  return is_share(path) ? path : folder / path;
}
fs::path absolute(const fs::path& path, std::error_code& error) {
  error.clear();
  fs::path whole = full_path(path);
  if (whole.empty()) error = std::make_error_code(std::errc::invalid_argument);
  return whole;
}
fs::path normal(const fs::path& path) {
  return is_share(path) ? fs::path(full_path(path)) : path.lexically_normal();
}
fs::path absolute_normal(const fs::path& path) {
  std::error_code error;
  fs::path whole = os::absolute(path, error);
  if (error) throw fs::filesystem_error("absolute_normal", path, error);
  return whole;
}
fs::path canonical(const fs::path& path, std::error_code& error) {
  return os::absolute(path, error);
}
std::string name_key(const fs::path& path) {
  std::wstring whole = full_path(path);
  if (whole.empty()) whole = path.native();
  std::wstring key(whole.size(), L'\0');
  const int units = static_cast<int>(whole.size());
  const int mapped = LCMapStringEx(LOCALE_NAME_INVARIANT, LCMAP_UPPERCASE, whole.data(), units,
                                   key.data(), units, nullptr, nullptr, 0);
  return to_utf8(mapped == units ? key : whole);
}
bool is_device_name(const fs::path& path) {
  std::string name = path.filename().string();
  if (lower_case(name) == "nul") return false;
  // Windows ignores the rest of the name from the first dot on, and spaces before the dot.
  name = lower_case(name.substr(0, std::min(name.find_first_of(".:"), name.size())));
  while (name.ends_with(' ')) name.pop_back();
  if (name == "con" || name == "prn" || name == "aux" || name == "nul") return true;
  return name.size() == 4 && (name.starts_with("com") || name.starts_with("lpt")) &&
         name[3] >= '0' && name[3] <= '9';
}

// access control lists are not checked
fs::path find_unsafe_level(const fs::path& /*path*/) { return {}; }
void create_private_folders(const fs::path& path) noexcept {
  std::error_code error;
  fs::create_directories(path, error);
}
fs::path temporary_folder() {
  if (const wchar_t* given = _wgetenv(L"TMPDIR"); given != nullptr && *given != L'\0') return given;
  std::error_code error;
  return fs::temp_directory_path(error);
}
fs::path create_temporary_folder(const std::string& start_of_name) {
  static std::atomic<unsigned> number{0};
  const std::string start = start_of_name + std::to_string(process_id()) + "-";
  std::error_code error;
  // A folder of an earlier process with the same number may exist.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const fs::path folder = temporary_folder() / (start + std::to_string(number++));
    if (fs::create_directory(folder, error)) return folder;
    if (error) break;
  }
  return {};
}
// Each user has a temporary folder of their own.
fs::path user_folder() { return temporary_folder() / "kiln"; }
void set_environment_variable(const char* name, const char* value) noexcept {
  _putenv_s(name, value == nullptr ? "" : value);
}

long process_id() noexcept { return _getpid(); }
const std::string& process_namespace_id() {
  static const std::string made = [] {
    wchar_t name[MAX_COMPUTERNAME_LENGTH + 1]{};
    DWORD size = MAX_COMPUTERNAME_LENGTH + 1;
    if (GetComputerNameW(name, &size) == FALSE) size = 0;
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx",
                  static_cast<unsigned long long>(fnv1a(to_utf8({name, size}))));
    return std::string(digits);
  }();
  return made;
}
bool has_process_ended(long process) noexcept {
  const Handle process_handle(OpenProcess(SYNCHRONIZE, FALSE, static_cast<DWORD>(process)));
  if (!process_handle.good()) return GetLastError() == ERROR_INVALID_PARAMETER;
  return WaitForSingleObject(process_handle.get(), 0) == WAIT_OBJECT_0;
}

}  // namespace kiln::os

#include "base/windows/api.h"

#include <cerrno>

namespace kiln::os {

namespace fs = std::filesystem;

std::wstring full_path(const fs::path& path) {
  constexpr DWORD kMaxLength = 32768;
  // libstdc++'s absolute() is not used, since it treats a network share as a folder.
  std::wstring absolute_path(kMaxLength, L'\0');
  const DWORD length = GetFullPathNameW(path.c_str(), kMaxLength, absolute_path.data(), nullptr);
  absolute_path.resize(length < kMaxLength ? length : 0);
  return absolute_path;
}

std::wstring api_path(const fs::path& path) {
  // Paths of folders must be 12 characters shorter than MAX_PATH, to leave space for a short file name.
  constexpr std::size_t kMaxPlainLength = MAX_PATH - 12 - 1;
  // The limit applies to the length of the absolute path.
  const std::wstring absolute_path = full_path(path);
  if (absolute_path.size() < kMaxPlainLength) return path.native();
  if (absolute_path.starts_with(LR"(\\?\)") || absolute_path.starts_with(LR"(\\.\)"))
    return absolute_path;
  if (absolute_path.starts_with(LR"(\\)")) return LR"(\\?\UNC\)" + absolute_path.substr(2);
  return LR"(\\?\)" + absolute_path;
}

std::wstring to_wide(std::string_view utf8) {
  const int bytes = static_cast<int>(utf8.size());
  std::wstring wide(
      static_cast<std::size_t>(MultiByteToWideChar(CP_UTF8, 0, utf8.data(), bytes, nullptr, 0)),
      L'\0');
  MultiByteToWideChar(CP_UTF8, 0, utf8.data(), bytes, wide.data(), static_cast<int>(wide.size()));
  return wide;
}

std::string to_utf8(std::wstring_view wide) {
  const int units = static_cast<int>(wide.size());
  std::string utf8(static_cast<std::size_t>(WideCharToMultiByte(CP_UTF8, 0, wide.data(), units,
                                                                nullptr, 0, nullptr, nullptr)),
                   '\0');
  WideCharToMultiByte(CP_UTF8, 0, wide.data(), units, utf8.data(), static_cast<int>(utf8.size()),
                      nullptr, nullptr);
  return utf8;
}

namespace {

int errno_of(DWORD error) noexcept {
  switch (error) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_DRIVE:
    case ERROR_BAD_NETPATH:
    case ERROR_BAD_NET_NAME:
      return ENOENT;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
    case ERROR_DELETE_PENDING:
      return EACCES;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS:
      return EEXIST;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL:
      return ENOSPC;
    case ERROR_WRITE_PROTECT:
      return EROFS;
    case ERROR_FILENAME_EXCED_RANGE:
      return ENAMETOOLONG;
    case ERROR_TOO_MANY_OPEN_FILES:
      return EMFILE;
    case ERROR_NOT_SAME_DEVICE:
      return EXDEV;
    case ERROR_DIRECTORY:
      return ENOTDIR;
    case ERROR_DIR_NOT_EMPTY:
      return ENOTEMPTY;
    case ERROR_NOT_ENOUGH_MEMORY:
    case ERROR_OUTOFMEMORY:
      return ENOMEM;
    case ERROR_INVALID_NAME:
    case ERROR_INVALID_PARAMETER:
    case ERROR_INVALID_FUNCTION:
    case ERROR_NOT_SUPPORTED:
      return EINVAL;
    case ERROR_INVALID_HANDLE:
      return EBADF;
    case ERROR_BROKEN_PIPE:
    case ERROR_NO_DATA:
      return EPIPE;
    default:
      return EIO;
  }
}

}  // namespace

void set_errno() noexcept { errno = errno_of(GetLastError()); }

}  // namespace kiln::os

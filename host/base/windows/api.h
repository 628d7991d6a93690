// The Windows API, without its macros for names of the standard library, and helpers for windows/.
#pragma once

#ifndef NOMINMAX
#define NOMINMAX
#endif
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#include <windows.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace kiln::os {

/// Converts a path for the API's wide functions: a long path becomes absolute, with the prefix `\\?\`, so that any
/// length works regardless of the system's settings and the program's manifest.
std::wstring api_path(const std::filesystem::path& path);

/// A path's absolute form, with backslashes; empty if it is invalid or longer than the system allows.
std::wstring full_path(const std::filesystem::path& path);

std::wstring to_wide(std::string_view utf8);
std::string to_utf8(std::wstring_view wide);

/// Sets errno by GetLastError().
void set_errno() noexcept;
/// Sets errno if a call failed. \returns whether it succeeded
inline bool succeeded(bool result) noexcept {
  if (!result) set_errno();
  return result;
}

}  // namespace kiln::os

// The Windows API, without its macros for names of the standard library, and what all of windows/ needs of it.
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

/// A path as the API's wide calls take it at any length: a long one becomes absolute, with the prefix `\\?\`, so that
/// neither the system's settings nor the program's manifest matter.
std::wstring api_path(const std::filesystem::path& path);

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

// Words and names of files in lower case.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace kiln {

/// ASCII letters in lower case; all other bytes as they are.
inline std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

/// Extension of a file's name in lower case: ".png".
inline std::string lower_extension(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

}  // namespace kiln

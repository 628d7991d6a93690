// Conversion of ASCII text to lower case.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace kiln {

/// Converts ASCII letters to lower case; all other bytes are unchanged.
inline std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

/// A file's extension in lower case: ".png".
inline std::string lower_extension(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

}  // namespace kiln

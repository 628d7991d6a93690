// Identifies files whose contents are cached.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

#include "base/file.h"

namespace kiln {

/// Key of a file: its absolute path, size, time and inode number, so that a changed file has
/// another key. \param bytes the file's size
inline std::string file_identity(const std::filesystem::path& path, std::uint64_t bytes) {
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::absolute(path, error);
  std::string identity = (error ? path : whole).string() + "\n" + std::to_string(bytes);
  if (const std::optional<os::FileStatus> facts = os::query_file(path)) {
    identity += "\n" +
                std::to_string(facts->modified_ns != 0 ? facts->modified_ns : facts->modified) +
                "\n" + std::to_string(facts->id.file);
  }
  return identity;
}

}  // namespace kiln

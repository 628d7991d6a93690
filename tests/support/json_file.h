// Reads JSON files that the command wrote.
#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace kiln::test {

/// Reads and parses a whole file.
inline nlohmann::json read_json(const std::filesystem::path& path) {
  std::ifstream stream(path);
  return nlohmann::json::parse(stream);
}

}  // namespace kiln::test

// JSON files, as the command writes them.
#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace kiln::test {

/// The whole file, parsed.
inline nlohmann::json read_json(const std::filesystem::path& path) {
  std::ifstream stream(path);
  return nlohmann::json::parse(stream);
}

}  // namespace kiln::test

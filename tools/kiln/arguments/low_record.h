// Which low poly the maps in a folder belong to: maps are named after it, and two may have one name.
#pragma once

#include <filesystem>
#include <string>

namespace kiln::cli {

/// Refuses a folder that has maps of another low poly of the same name.
/// \param stem    of the maps' names
/// \param source  LOW; where Kiln makes it, HIGH
/// \throws Error(usage) names both meshes and the remedy
void check_low_record(const std::filesystem::path& folder, const std::string& stem,
                      const std::filesystem::path& source);

/// Notes whose maps these are, in the hidden file FOLDER/.STEM.kiln.json. The path in it starts at the
/// folder, so that both can move together. \throws Error(output)
void save_low_record(const std::filesystem::path& folder, const std::string& stem,
                     const std::filesystem::path& source);

}  // namespace kiln::cli

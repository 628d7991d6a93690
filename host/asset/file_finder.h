// Finds files whose stored paths are invalid on this machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "kiln/error.h"

namespace kiln {

/// True if a file lies in a folder or below it after all symbolic links are followed. Missing files are judged by
/// their names. Relative paths start at the working directory; an empty path is that directory.
bool lies_within(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Prefix of the key that register_query() records for a search by name: see FileFinder::named().
inline constexpr const char* kNamedAnswerPrefix = "named ";

/// Finds pictures and materials with paths of another machine, in a folder and its subfolders. It never
/// searches above the folder, follows no links to folders, and ignores links to files elsewhere.
class FileFinder {
 public:
  /// Creates a finder for a folder. \param warnings  receives "found-elsewhere"; may be null
  explicit FileFinder(std::filesystem::path folder, std::vector<Warning>* warnings = nullptr)
      : folder_(std::move(folder)), warnings_(warnings) {}

  /// Returns the path itself if the file exists, or if no file of its name is found; otherwise the path of the file
  /// found. \param named_by  file and line that name the path, for the warning
  std::filesystem::path find(const std::filesystem::path& path, const std::string& named_by);

  /// Files called `name` in the folder and its subfolders, ignoring case: sorted relative paths, one per line.
  std::string named(const std::string& name);

 private:
  void list();

  std::filesystem::path folder_;
  std::vector<Warning>* warnings_;
  bool is_folder_listed_ = false;
  /// Paths of the files in the folder, by lower-case file name
  std::map<std::string, std::vector<std::filesystem::path>> files_;
  std::map<std::filesystem::path, std::filesystem::path> found_paths_;
};

}  // namespace kiln

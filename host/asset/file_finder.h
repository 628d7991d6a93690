// Finds files whose stored paths are invalid on this machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "kiln/error.h"

namespace kiln {

/// True if a file is in a folder or below it, after all symbolic links were followed. For files
/// that do not exist, their path decides. Relative paths start at the working directory, which an
/// empty path stands for.
bool lies_within(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Prefix of the key under which register_query() records the result of FileFinder::find_by_name().
inline constexpr const char* kNamedAnswerPrefix = "named ";

/// Finds pictures and material files whose paths come from another machine, by their names, in a
/// folder and its subfolders. It never searches above the folder, does not follow links to folders,
/// and ignores links to files outside.
class FileFinder {
 public:
  /// Creates a finder for a folder. \param warnings  receives "found-elsewhere"; may be null
  explicit FileFinder(std::filesystem::path folder, std::vector<Warning>* warnings = nullptr)
      : folder_(std::move(folder)), warnings_(warnings) {}

  /// The path itself if the file exists, or if no file of its name is found; otherwise the path of
  /// the file that was found.
  /// \param named_by  file and line that contain the path, for the warning
  std::filesystem::path find(const std::filesystem::path& path, const std::string& named_by);

  /// The files called `name` in the folder and its subfolders, ignoring case, as sorted relative
  /// paths with one per line.
  std::string find_by_name(const std::string& name);

 private:
  void list();

  std::filesystem::path folder_;
  std::vector<Warning>* warnings_;
  bool is_folder_listed_ = false;
  /// Paths of the files in the folder, by file name in lower case
  std::map<std::string, std::vector<std::filesystem::path>> files_;
  std::map<std::filesystem::path, std::filesystem::path> found_paths_;
};

}  // namespace kiln

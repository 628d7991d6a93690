// Files that are not where another file says they are.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "kiln/error.h"

namespace kiln {

/// True if a file lies in a folder or the folders in it once all symbolic links are followed. What is not there counts
/// by its name. Relative paths begin at the current folder; an empty one is that folder.
bool lies_within(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Begins what note_answer() is asked of a folder, before a name: see FileFinder::named().
inline constexpr const char* kNamedQuestion = "named ";

/// Finds pictures and materials whose paths are those of another machine, in a folder and the folders in it. It
/// never looks above it, follows no links to folders, and finds no link to a file that lies elsewhere.
class FileFinder {
 public:
  /// \param warnings  where to append "found-elsewhere"; may be null
  explicit FileFinder(std::filesystem::path folder, std::vector<Warning>* warnings = nullptr)
      : folder_(std::move(folder)), warnings_(warnings) {}

  /// The path itself where a file is there, or nothing of its name is found; else what is found.
  /// \param named_by  file and line that name it, for the warning
  std::filesystem::path find(const std::filesystem::path& path, const std::string& named_by);

  /// Files of a name in the folder and those in it, below the folder, sorted, a line each: capital letters or not.
  std::string named(const std::string& name);

 private:
  void list();

  std::filesystem::path folder_;
  std::vector<Warning>* warnings_;
  bool listed_ = false;
  /// By the name in lower case.
  std::map<std::string, std::vector<std::filesystem::path>> files_;
  std::map<std::filesystem::path, std::filesystem::path> found_;
};

}  // namespace kiln

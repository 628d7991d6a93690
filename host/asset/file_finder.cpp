#include "asset/file_finder.h"

#include <algorithm>
#include <system_error>
#include <tuple>

#include "asset/udim_files.h"
#include "base/file.h"
#include "base/input_log.h"
#include "base/lower_case.h"
#include "io/file/text_scanner.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxFolderDepth = 4;
constexpr std::size_t kMaxFolderEntries = 20000;

std::vector<std::string> parts_of(const fs::path& path) {
  std::vector<std::string> parts;
  for (const fs::path& part : path) parts.push_back(lower_case(part.string()));
  return parts;
}

/// Number of names, counted from the end, that two paths have in common.
std::size_t count_shared_parts(const std::vector<std::string>& a,
                               const std::vector<std::string>& b) {
  const auto [end, other] = std::mismatch(a.rbegin(), a.rend(), b.rbegin(), b.rend());
  return static_cast<std::size_t>(end - a.rbegin());
}

}  // namespace

bool lies_within(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const auto resolved = [&](const fs::path& path) {
    const fs::path found = os::canonical(path.empty() ? fs::path(".") : path, error);
    // If the path ends in "/" and does not exist, the resolved path ends in an empty file name.
    return found.has_filename() ? found : found.parent_path();
  };
  const fs::path resolved_folder = os::name_key(resolved(folder));
  if (error) return false;
  const fs::path target = os::name_key(resolved(file));
  if (error) return false;
  return std::mismatch(resolved_folder.begin(), resolved_folder.end(), target.begin(), target.end())
             .first == resolved_folder.end();
}

/// Lists the files in the folder. If it has more entries than the limit, none is listed, since the
/// order of entries is arbitrary.
void FileFinder::list() {
  is_folder_listed_ = true;
  std::error_code error;
  const fs::path start = folder_.empty() ? fs::path(".") : folder_;
  fs::recursive_directory_iterator at(start, fs::directory_options::skip_permission_denied, error);
  std::size_t entry_count = 0;
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    if (++entry_count > kMaxFolderEntries) {
      files_.clear();
      return;
    }
    std::error_code ignored;
    if (at->is_directory(ignored)) {
      if (at.depth() + 1 >= kMaxFolderDepth || at->is_symlink(ignored))
        at.disable_recursion_pending();
    } else if (at->is_regular_file(ignored) &&
               (!at->is_symlink(ignored) || lies_within(start, at->path()))) {
      const fs::path path = folder_.empty() ? at->path().lexically_relative(start) : at->path();
      files_[lower_case(path.filename().string())].push_back(path);
    }
  }
}

std::string FileFinder::find_by_name(const std::string& name) {
  if (!is_folder_listed_) list();
  const auto found = files_.find(lower_case(name));
  if (found == files_.end()) return {};
  std::vector<std::string> paths;
  for (const fs::path& path : found->second) {
    paths.push_back(path.lexically_proximate(folder_.empty() ? fs::path(".") : folder_).string());
  }
  std::sort(paths.begin(), paths.end());
  std::string list;
  for (const std::string& path : paths) list += path + "\n";
  return list;
}

fs::path FileFinder::find(const fs::path& path, const std::string& named_by) {
  std::error_code ignored;
  if (register_file_check(path) || fs::exists(path, ignored)) return path;
  if (const auto tiles = TileName::parse_token(path)) {
    if (!tiles->files().empty()) return path;
    // A UDIM set is found by the first of its pictures that exists.
    constexpr std::uint32_t kFirstTileNumber = 1001, kLastTileNumber = 1100;
    for (std::uint32_t tile = kFirstTileNumber; tile <= kLastTileNumber; ++tile) {
      const fs::path file = tiles->file_of(tile), found = find(file, named_by);
      if (found != file) return found.parent_path() / path.filename();
    }
    return path;
  }
  const auto [entry, added] = found_paths_.emplace(path, path);
  if (!added) return entry->second;
  if (!is_folder_listed_) list();
  register_query(folder_.empty() ? "." : folder_, kNamedAnswerPrefix + path.filename().string(),
                 find_by_name(path.filename().string()));
  const auto candidates = files_.find(lower_case(path.filename().string()));
  if (candidates == files_.end()) return path;
  const std::vector<std::string> wanted_parts = parts_of(path);
  const auto rank = [&](const fs::path& candidate) {
    const std::vector<std::string> parts = parts_of(candidate);
    return std::tuple(-static_cast<std::ptrdiff_t>(count_shared_parts(wanted_parts, parts)),
                      candidate.filename() != path.filename(), parts.size(), candidate.string());
  };
  const std::vector<fs::path>& same_name_files = candidates->second;
  entry->second =
      *std::min_element(same_name_files.begin(), same_name_files.end(),
                        [&](const fs::path& a, const fs::path& b) { return rank(a) < rank(b); });
  if (warnings_ != nullptr) {
    std::string others_text;
    if (same_name_files.size() > 1)
      others_text = ", one of " + std::to_string(same_name_files.size()) + " files of that name";
    warnings_->push_back({"found-elsewhere",
                          named_by + ": \"" + path.string() + "\" does not exist; '" +
                              entry->second.string() + "' is used instead" + others_text + ".",
                          1});
  }
  return entry->second;
}

}  // namespace kiln

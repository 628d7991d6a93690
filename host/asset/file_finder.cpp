#include "asset/file_finder.h"

#include <algorithm>
#include <system_error>
#include <tuple>

#include "base/lower_case.h"
#include "io/file/text_scanner.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr int kLevels = 4;
constexpr std::size_t kMostEntries = 20000;

std::vector<std::string> parts_of(const fs::path& path) {
  std::vector<std::string> parts;
  for (const fs::path& part : path) parts.push_back(lower_case(part.string()));
  return parts;
}

/// Number of folders and names at the ends of two paths that are the same.
std::size_t shared_parts(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  const auto [end, other] = std::mismatch(a.rbegin(), a.rend(), b.rbegin(), b.rend());
  return static_cast<std::size_t>(end - a.rbegin());
}

}  // namespace

bool lies_within(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, error);
  if (error) return false;
  const fs::path target = fs::weakly_canonical(file, error);
  if (error) return false;
  return std::mismatch(whole.begin(), whole.end(), target.begin(), target.end()).first ==
         whole.end();
}

/// A folder that has more entries than the limit is not searched at all: which of them come first is chance.
void FileFinder::list() {
  listed_ = true;
  std::error_code error;
  const fs::path start = folder_.empty() ? fs::path(".") : folder_;
  fs::recursive_directory_iterator at(start, fs::directory_options::skip_permission_denied, error);
  std::size_t entries = 0;
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    if (++entries > kMostEntries) {
      files_.clear();
      return;
    }
    std::error_code ignored;
    if (at->is_directory(ignored)) {
      if (at.depth() + 1 >= kLevels || at->is_symlink(ignored)) at.disable_recursion_pending();
    } else if (at->is_regular_file(ignored) &&
               (!at->is_symlink(ignored) || lies_within(start, at->path()))) {
      const fs::path path = folder_.empty() ? at->path().lexically_relative(start) : at->path();
      files_[lower_case(path.filename().string())].push_back(path);
    }
  }
}

fs::path FileFinder::find(const fs::path& path, const std::string& named_by) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) return path;
  const auto [entry, added] = found_.emplace(path, path);
  if (!added) return entry->second;
  if (!listed_) list();
  const auto candidates = files_.find(lower_case(path.filename().string()));
  if (candidates == files_.end()) return path;
  const std::vector<std::string> wanted = parts_of(path);
  const auto rank = [&](const fs::path& candidate) {
    const std::vector<std::string> parts = parts_of(candidate);
    return std::tuple(-static_cast<std::ptrdiff_t>(shared_parts(wanted, parts)),
                      candidate.filename() != path.filename(), parts.size(), candidate.string());
  };
  const std::vector<fs::path>& all = candidates->second;
  entry->second =
      *std::min_element(all.begin(), all.end(),
                        [&](const fs::path& a, const fs::path& b) { return rank(a) < rank(b); });
  if (warnings_ != nullptr) {
    std::string others;
    if (all.size() > 1) others = ", one of " + std::to_string(all.size()) + " files of that name";
    warnings_->push_back({"found-elsewhere",
                          named_by + ": \"" + path.string() + "\" is not there; '" +
                              entry->second.string() + "' was taken" + others + ".",
                          1});
  }
  return entry->second;
}

}  // namespace kiln

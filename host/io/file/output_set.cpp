#include "io/file/output_set.h"

#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln {
namespace {

/// Files that are held open without a name, which leave nothing behind where the process is killed. Further ones get a
/// hidden name and are closed, since a process may have 1,024 files open by default.
constexpr std::size_t kMostUnnamed = 256;

struct PathHash {
  std::size_t operator()(const std::filesystem::path& path) const noexcept {
    return std::filesystem::hash_value(path);
  }
};
using Index = std::unordered_map<std::filesystem::path, std::size_t, PathHash>;

struct State {
  std::mutex mutex;
  bool is_open = false;
  std::vector<HeldFile> files;
  Index by_target;       ///< The first in `files` of each target
  Index by_destination;  ///< The last of each destination
  std::set<os::FileId> read;

  /// Hands over the files that are held, and forgets them.
  std::vector<HeldFile> release() {
    by_target.clear();
    by_destination.clear();
    return std::exchange(files, {});
  }
};

State& state() {
  static State the_state;
  return the_state;
}

/// A file's name before links are followed.
std::filesystem::path whole_name(const HeldFile& file) {
  return std::filesystem::absolute(file.destination).lexically_normal();
}

}  // namespace

OutputSet::OutputSet() {
  const std::lock_guard lock(state().mutex);
  if (state().is_open) {
    throw Error(ErrorCode::usage, "An OutputSet is open already, and a process has one at a time.");
  }
  state().is_open = true;
}

OutputSet::~OutputSet() {
  std::vector<HeldFile> dropped;
  const std::lock_guard lock(state().mutex);
  state().is_open = false;
  state().read.clear();
  dropped = state().release();
}

void OutputSet::commit() {
  std::vector<HeldFile> files;
  {
    const std::lock_guard lock(state().mutex);
    files = state().release();
  }
  // Refuses inputs, too, that were read after a file of that name was written.
  for (const HeldFile& file : files) {
    if (const auto found = os::facts_of(file.target)) refuse_input(file.destination, found->id);
  }
  place_files(files);
}

std::filesystem::path OutputSet::held(const std::filesystem::path& destination) {
  const std::lock_guard lock(state().mutex);
  const auto found = state().by_destination.find(destination);
  if (found == state().by_destination.end()) return {};
  const HeldFile& file = state().files[found->second];
  if (!file.temporary.empty()) return file.temporary.path();
  return os::name_of_open(file.descriptor);
}

void OutputSet::protect(const std::filesystem::path& input) {
  if (const auto found = os::facts_of(input)) note_read(found->id);
}

void OutputSet::check(const std::filesystem::path& destination) {
  if (const auto found = os::facts_of(destination)) refuse_input(destination, found->id);
}

bool hold_output(HeldFile& file) {
  const std::lock_guard lock(state().mutex);
  if (!state().is_open) return false;
  // Files of one target that were let in have one whole name, so the first of them stands for all.
  const std::size_t number = state().files.size();
  if (number >= kMostUnnamed) file.name();
  const auto [first, is_new] = state().by_target.emplace(file.target, number);
  if (!is_new) {
    const HeldFile& other = state().files[first->second];
    if (whole_name(other) != whole_name(file)) {
      throw Error(ErrorCode::usage, "'" + file.destination.string() + "' and '" +
                                        other.destination.string() +
                                        "' would be one file, by a link: remove the link, or "
                                        "choose another folder for the output.");
    }
  }
  state().by_destination[file.destination] = number;
  state().files.push_back(std::move(file));
  return true;
}

void refuse_input(const std::filesystem::path& destination, os::FileId file) {
  {
    const std::lock_guard lock(state().mutex);
    if (state().read.count(file) == 0) return;
  }
  throw Error(ErrorCode::usage, "'" + destination.string() +
                                    "' would be written over, and it is read, too: choose another "
                                    "name or folder for the output.");
}

void note_read(os::FileId file) {
  const std::lock_guard lock(state().mutex);
  if (state().is_open) state().read.insert(file);
}

}  // namespace kiln

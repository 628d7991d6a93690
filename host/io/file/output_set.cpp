#include "io/file/output_set.h"

#include <algorithm>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln {
namespace {

struct State {
  std::mutex mutex;
  bool is_open = false;
  std::vector<HeldFile> files;
  std::set<os::FileId> read;
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
  dropped.swap(state().files);
}

void OutputSet::commit() {
  std::vector<HeldFile> files;
  {
    const std::lock_guard lock(state().mutex);
    files.swap(state().files);
  }
  // Refuses inputs, too, that were read after a file of that name was written.
  for (const HeldFile& file : files) {
    if (const auto found = os::facts_of(file.target)) refuse_input(file.destination, found->id);
  }
  place_files(files);
}

std::filesystem::path OutputSet::held(const std::filesystem::path& destination) {
  const std::lock_guard lock(state().mutex);
  const std::vector<HeldFile>& files = state().files;
  const auto found = std::find_if(files.rbegin(), files.rend(), [&](const HeldFile& file) {
    return file.destination == destination;
  });
  if (found == files.rend()) return {};
  if (!found->temporary.empty()) return found->temporary.path();
  return os::name_of_open(found->descriptor);
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
  for (const HeldFile& other : state().files) {
    if (other.target != file.target || whole_name(other) == whole_name(file)) continue;
    throw Error(ErrorCode::usage, "'" + file.destination.string() + "' and '" +
                                      other.destination.string() +
                                      "' would be one file, by a link: remove the link, or choose "
                                      "another folder for the output.");
  }
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

#include "io/file/output_set.h"

#include <sys/stat.h>
#include <unistd.h>

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

using Identity = std::pair<dev_t, ino_t>;

struct State {
  std::mutex mutex;
  bool is_open = false;
  std::vector<HeldFile> files;
  std::set<Identity> read;
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
  // What was read after a file of that name was written, too.
  for (const HeldFile& file : files) {
    struct stat found {};
    if (stat(file.target.c_str(), &found) == 0) refuse_input(file.destination, found);
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
  return "/proc/" + std::to_string(static_cast<long>(getpid())) + "/fd/" +
         std::to_string(found->descriptor);
}

void OutputSet::protect(const std::filesystem::path& input) {
  struct stat found {};
  if (stat(input.c_str(), &found) == 0) note_read(found);
}

void OutputSet::check(const std::filesystem::path& destination) {
  struct stat found {};
  if (stat(destination.c_str(), &found) == 0) refuse_input(destination, found);
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

void refuse_input(const std::filesystem::path& destination, const struct stat& file) {
  {
    const std::lock_guard lock(state().mutex);
    if (state().read.count({file.st_dev, file.st_ino}) == 0) return;
  }
  throw Error(ErrorCode::usage, "'" + destination.string() +
                                    "' would be written over, and it is read, too: choose another "
                                    "name or folder for the output.");
}

void note_read(const struct stat& file) {
  const std::lock_guard lock(state().mutex);
  if (state().is_open) state().read.insert({file.st_dev, file.st_ino});
}

}  // namespace kiln

#include "io/file/output_set.h"

#include <algorithm>
#include <iterator>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/input_log.h"
#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln {
namespace {

/// Maximum number of unnamed files, which disappear if the process is killed, but must stay open.
/// Further files are named and closed, since by default a process may have 1,024 open files.
constexpr std::size_t kMaxUnnamedFiles = 256;

using FileIndex = std::unordered_map<std::string, std::size_t>;  // By os::name_key()

struct OutputState {
  std::mutex mutex;
  bool is_open = false;
  std::vector<PendingFile> files;
  FileIndex by_target;       ///< For each target, the index in `files` of its first file
  FileIndex by_destination;  ///< For each destination, the index in `files` of its last file
  std::set<os::FileId> read;

  /// Computes both indices anew after files were removed.
  void rebuild_indices() {
    by_target.clear();
    by_destination.clear();
    for (std::size_t i = 0; i < files.size(); ++i) {
      by_target.emplace(os::name_key(files[i].target), i);
      by_destination[os::name_key(files[i].destination)] = i;
    }
  }
  /// Removes all files from the set, and returns them.
  std::vector<PendingFile> release_files() {
    std::vector<PendingFile> all = std::exchange(files, {});
    rebuild_indices();
    return all;
  }
};

OutputState& output_state() {
  static OutputState global_state;
  return global_state;
}

/// Path at which a file's bytes can be read.
std::filesystem::path bytes_of(const PendingFile& file) {
  return file.temporary.empty() ? std::filesystem::path(os::path_of_open_file(file.descriptor))
                                : file.temporary.path();
}

/// Absolute path of a file's destination, without following links.
std::filesystem::path absolute_name(const PendingFile& file) {
  return os::absolute_normal(file.destination);
}

}  // namespace

OutputSet::OutputSet() {
  const std::lock_guard lock(output_state().mutex);
  if (output_state().is_open) {
    throw Error(ErrorCode::usage,
                "An OutputSet is open already: a process can have only one at a time.");
  }
  output_state().is_open = true;
}

OutputSet::~OutputSet() {
  std::vector<PendingFile> dropped_files;
  const std::lock_guard lock(output_state().mutex);
  output_state().is_open = false;
  output_state().read.clear();
  dropped_files = output_state().release_files();
}

namespace {

void place_pending(std::vector<PendingFile>& files) {
  // An output may have been read as an input after it had been written; such an output is refused
  // here, too.
  for (const PendingFile& file : files) {
    if (const auto found = os::query_file(file.target)) refuse_input(file.destination, found->id);
  }
  place_files(files);
}

}  // namespace

void OutputSet::commit() {
  std::vector<PendingFile> files;
  {
    const std::lock_guard lock(output_state().mutex);
    files = output_state().release_files();
  }
  place_pending(files);
}

namespace {

/// Removes the files that a run has written from the set, and returns them. The caller must hold
/// the lock.
std::vector<PendingFile> extract_files_of(const InputLog& run) {
  std::vector<PendingFile>& files = output_state().files;
  const auto first = std::stable_partition(
      files.begin(), files.end(), [&](const PendingFile& file) { return file.run != &run; });
  std::vector<PendingFile> run_files(std::make_move_iterator(first),
                                     std::make_move_iterator(files.end()));
  files.erase(first, files.end());
  output_state().rebuild_indices();
  return run_files;
}

}  // namespace

void commit_outputs(const InputLog& run) {
  std::vector<PendingFile> files;
  {
    const std::lock_guard lock(output_state().mutex);
    files = extract_files_of(run);
  }
  place_pending(files);
}

void discard_outputs(const InputLog& run) {
  std::vector<PendingFile> dropped_files;
  const std::lock_guard lock(output_state().mutex);
  dropped_files = extract_files_of(run);
}

std::vector<PendingOutput> outputs_of(const InputLog& run) {
  const std::lock_guard lock(output_state().mutex);
  std::vector<PendingOutput> outputs;
  for (const PendingFile& file : output_state().files) {
    if (file.run != &run) continue;
    std::erase_if(outputs,
                  [&](const PendingOutput& o) { return o.destination == file.destination; });
    outputs.push_back({file.destination, bytes_of(file)});
  }
  return outputs;
}

std::size_t held_outputs() {
  const std::lock_guard lock(output_state().mutex);
  return output_state().files.size();
}

std::filesystem::path OutputSet::temporary_path(const std::filesystem::path& destination) {
  const std::lock_guard lock(output_state().mutex);
  const auto found = output_state().by_destination.find(os::name_key(destination));
  return found == output_state().by_destination.end()
             ? std::filesystem::path()
             : bytes_of(output_state().files[found->second]);
}

void OutputSet::protect(const std::filesystem::path& input) {
  register_file_check(input);
  if (const auto found = os::query_file(input)) register_input(found->id);
}

void OutputSet::check(const std::filesystem::path& destination) {
  if (const auto found = os::query_file(destination)) refuse_input(destination, found->id);
}

bool add_to_open_set(PendingFile& file) {
  const std::lock_guard lock(output_state().mutex);
  if (!output_state().is_open) return false;
  file.run = current_input_log();
  // All files that were accepted for one target have the same absolute name and the same run, so it
  // suffices to compare with the first of them.
  const std::size_t number = output_state().files.size();
  if (number >= kMaxUnnamedFiles) file.name();
  const auto [first, is_new] = output_state().by_target.emplace(os::name_key(file.target), number);
  if (!is_new) {
    const PendingFile& other = output_state().files[first->second];
    if (other.run != file.run) {
      throw Error(ErrorCode::usage, "'" + file.destination.string() +
                                        "' is written by another bake of this run, too: give each "
                                        "a folder of its own.");
    }
    const bool same_key = os::name_key(absolute_name(other)) == os::name_key(absolute_name(file));
    if (same_key && other.destination.filename() != file.destination.filename()) {
      throw Error(ErrorCode::usage, "'" + file.destination.string() + "' and '" +
                                        other.destination.string() +
                                        "' are the same name on Windows: rename one of them.");
    }
    if (!same_key) {
      throw Error(ErrorCode::usage,
                  "'" + file.destination.string() + "' and '" + other.destination.string() +
                      "' would be the same file because of a link: remove the link, or "
                      "choose another folder for the output.");
    }
  }
  output_state().by_destination[os::name_key(file.destination)] = number;
  output_state().files.push_back(std::move(file));
  return true;
}

void refuse_input(const std::filesystem::path& destination, os::FileId file) {
  {
    const std::lock_guard lock(output_state().mutex);
    if (output_state().read.count(file) == 0) return;
  }
  throw Error(ErrorCode::usage,
              "'" + destination.string() +
                  "' is an input of this run and would be overwritten: choose another "
                  "name or folder for the output.");
}

void register_input(os::FileId file) {
  const std::lock_guard lock(output_state().mutex);
  if (output_state().is_open) output_state().read.insert(file);
}

}  // namespace kiln

#include "base/control_group.h"

#include <algorithm>
#include <fstream>

namespace kiln {

std::uint64_t read_number_after(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  std::string word;
  while (file >> word) {
    std::uint64_t value = 0;
    if (word == key && file >> value) return value;
  }
  return kNoNumber;
}

std::uint64_t read_first_number(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? value : kNoNumber;
}

std::uint64_t remaining_bytes(std::uint64_t limit, std::uint64_t used) {
  if (limit == kNoNumber || used == kNoNumber) return kNoNumber;
  return limit > used ? limit - used : 0;
}

namespace {

/// Names that differ between the versions of control groups: the files with the limit and with the usage, and the keys
/// in memory.stat for cached files and for files of tmpfs.
struct GroupNames {
  const char *limit_file, *usage_file, *cached_key, *shared_key;
};
constexpr GroupNames kGroupNamesV2 = {"memory.max", "memory.current", "file", "shmem"};
constexpr GroupNames kGroupNamesV1 = {"memory.limit_in_bytes", "memory.usage_in_bytes",
                                      "total_cache", "total_shmem"};
/// Larger limits count as "no limit", for which control groups of version 1 report a multiple of the
/// page size just below 2^63.
constexpr std::uint64_t kMaxRealLimit = std::uint64_t{1} << 62;

std::uint64_t bytes_left_in_group(const std::string& folder, const GroupNames& names) {
  const std::string stat = folder + "/memory.stat";
  // Version 1 reports the limits of enclosing groups in memory.stat.
  const std::uint64_t limit = std::min(read_first_number(folder + "/" + names.limit_file),
                                       read_number_after(stat, "hierarchical_memory_limit"));
  if (limit >= kMaxRealLimit) return kNoNumber;
  const auto bytes = [&](const char* key) {
    const std::uint64_t number = read_number_after(stat, key);
    return number == kNoNumber ? 0 : number;
  };
  const std::uint64_t reclaimable =
      remaining_bytes(bytes(names.cached_key), bytes(names.shared_key));
  return remaining_bytes(
      limit, remaining_bytes(read_first_number(folder + "/" + names.usage_file), reclaimable));
}

}  // namespace

std::uint64_t free_in_control_groups(const std::string& root, const std::string& group_file) {
  // In a container, the process's group is the mounted root. Otherwise `group_file` states its path: "0::/a/b", or in
  // version 1 "9:memory:/a/b".
  std::uint64_t available_bytes = std::min(bytes_left_in_group(root, kGroupNamesV2),
                                           bytes_left_in_group(root + "/memory", kGroupNamesV1));
  std::ifstream groups(group_file);
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool is_version_2 = controllers == ",,";
    if (!is_version_2 && controllers.find(",memory,") == std::string::npos) continue;
    // The limit of a group applies to the groups within it, too, so the parents are checked as well.
    for (std::string path = line.substr(second + 1); path.size() > 1 && path[0] == '/';
         path.resize(path.find_last_of('/'))) {
      available_bytes =
          std::min(available_bytes,
                   is_version_2 ? bytes_left_in_group(root + path, kGroupNamesV2)
                                : bytes_left_in_group(root + "/memory" + path, kGroupNamesV1));
    }
  }
  return available_bytes;
}

}  // namespace kiln

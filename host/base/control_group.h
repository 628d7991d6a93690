// Memory available in control groups, and numbers in files of /proc and /sys.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace kiln {

/// Value for "no number" and "no limit".
inline constexpr std::uint64_t kNoNumber = std::numeric_limits<std::uint64_t>::max();

/// The number after `key` in a file of lines "KEY NUMBER ..."; kNoNumber if there is none.
std::uint64_t read_number_after(const std::string& path, const std::string& key);
/// The number at the start of a file; kNoNumber if there is none, as in a file of "max".
std::uint64_t read_first_number(const std::string& path);
/// The limit minus the used bytes, at least 0; kNoNumber if either is unknown.
std::uint64_t remaining_bytes(std::uint64_t limit, std::uint64_t used);

/// Memory available in the control groups of the process and the groups that contain them, of version 2 or 1;
/// kNoNumber if none has a limit. Cached files, which these groups count as used, are reclaimable and count as
/// available here, except those of tmpfs.
/// \param root folder where groups are mounted \param group_file file that lists the process's groups
std::uint64_t free_in_control_groups(const std::string& root = "/sys/fs/cgroup",
                                     const std::string& group_file = "/proc/self/cgroup");

}  // namespace kiln

// Memory that control groups leave, and numbers in files of /proc and /sys.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace kiln {

/// No number, or no limit.
inline constexpr std::uint64_t kNoNumber = std::numeric_limits<std::uint64_t>::max();

/// The number after `key` in a file of lines "KEY NUMBER ..."; kNoNumber where there is none.
std::uint64_t number_in(const std::string& path, const std::string& key);
/// The number that a file begins with; kNoNumber where it begins otherwise, as with "max".
std::uint64_t first_number_in(const std::string& path);
/// What of a limit is left, at least 0; kNoNumber where one of them is not known.
std::uint64_t bytes_left(std::uint64_t limit, std::uint64_t used);

/// Memory left in the control groups of the process and those around them, of version 2 or 1; kNoNumber where none
/// has a limit. Cached files count as used there but are given back at need; those of tmpfs are not.
/// \param root  where they are mounted \param own  the file that names them
std::uint64_t free_in_control_groups(const std::string& root = "/sys/fs/cgroup",
                                     const std::string& own = "/proc/self/cgroup");

}  // namespace kiln

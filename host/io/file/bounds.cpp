#include "io/file/bounds.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>

namespace kiln {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();

/// Bytes made of one, rounded up.
constexpr std::uint64_t ratio(Packing packing) {
  // Deflate (RFC 1951): at best one bit for a length of 258 and one for its distance, 4 x 258 a byte.
  constexpr std::uint64_t kDeflate = 1032;
  switch (packing) {
    case Packing::none:
      return 1;
    case Packing::deflate:
      return kDeflate;
    case Packing::exr_rle:
      return 64;  // 2 bytes are a run of at most 128
    case Packing::exr_piz:
      return 454;  // Huffman: one bit for "run", 8 for its length, at most 255 values of 2 bytes
    case Packing::exr_pxr24:
      return kDeflate * 4 / 3;  // of a float's 4 bytes, 3 are deflated
    case Packing::exr_b44:
      return 11;  // 3 bytes are a flat block of 4 x 4 values of 2 bytes
    case Packing::exr_dwa:
      // A block of 8 x 8 values of 4 bytes ends at its first 2 bytes, which are deflated; run lengths of
      // deflated bytes are below that.
      return kDeflate * 128;
  }
  return kDeflate;
}

/// The number after `key` in a file of lines "KEY NUMBER ..."; kMost where there is none.
std::uint64_t number_of(const char* path, const std::string& key) {
  std::ifstream file(path);
  std::string word;
  while (file >> word) {
    std::uint64_t value = 0;
    if (word == key && file >> value) return value;
  }
  return kMost;
}

std::uint64_t first_number(const char* path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? value : kMost;  // "max" is no number
}

std::uint64_t left_of(std::uint64_t limit, std::uint64_t used) {
  if (limit == kMost || used == kMost) return kMost;
  return limit > used ? limit - used : 0;
}

std::uint64_t free_addresses() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kMost;
  const std::uint64_t pages = first_number("/proc/self/statm");
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return left_of(limit.rlim_cur, pages == kMost ? kMost : pages * page);
}

std::uint64_t free_in_machine() {
  const std::uint64_t available = number_of("/proc/meminfo", "MemAvailable:");
  const std::uint64_t swap = number_of("/proc/meminfo", "SwapFree:");
  if (available == kMost) return kMost;
  return (available + (swap == kMost ? 0 : swap)) * 1024;
}

/// Of control groups, version 2 as a container sees it. What is cached of files counts as used there but
/// is given back at need.
std::uint64_t free_in_group() {
  const std::uint64_t limit = first_number("/sys/fs/cgroup/memory.max");
  if (limit == kMost) return kMost;
  const std::uint64_t used = first_number("/sys/fs/cgroup/memory.current");
  const std::uint64_t cached = number_of("/sys/fs/cgroup/memory.stat", "file");
  return left_of(limit, used == kMost ? kMost : left_of(used, cached == kMost ? 0 : cached));
}

std::string mebibytes(std::uint64_t bytes) {
  return std::to_string((bytes >> 20) + ((bytes & 0xFFFFF) != 0 ? 1 : 0)) + " MiB";
}

}  // namespace

std::uint64_t capped_product(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > kMost / b ? kMost : a * b;
}

std::uint64_t most_unpacked(Packing packing, std::uint64_t packed) {
  return capped_product(packed, ratio(packing));
}

std::uint64_t free_memory() {
  return std::min({free_in_machine(), free_in_group(), free_addresses()});
}

void check_memory(const FailWith& fail, const std::string& place, const std::string& what,
                  std::uint64_t bytes) {
  constexpr std::uint64_t kLittle = std::uint64_t{16} << 20;
  if (bytes <= kLittle) return;
  const std::uint64_t left = free_memory();
  if (bytes <= left) return;
  fail(place,
       what + " take " + mebibytes(bytes) + " of memory, but only " + mebibytes(left) + " are free",
       "Free some memory, or make the file smaller.");
}

}  // namespace kiln

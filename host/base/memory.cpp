#include "base/memory.h"

#ifndef _WIN32
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>

#include "base/control_group.h"
#include "base/option.h"
#include "kiln/error.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace kiln {
namespace {

constexpr std::uint64_t kUnlimited = kNoNumber;

#ifdef _WIN32
std::uint64_t free_addresses() { return kUnlimited; }
#else
std::uint64_t free_addresses() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  const std::uint64_t pages = first_number_in("/proc/self/statm");
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return bytes_left(limit.rlim_cur, pages == kUnlimited ? kUnlimited : pages * page);
}
#endif

std::uint64_t free_in_machine() {
  const std::uint64_t available = number_in("/proc/meminfo", "MemAvailable:");
  const std::uint64_t swap = number_in("/proc/meminfo", "SwapFree:");
  if (available == kUnlimited) return kUnlimited;
  return (available + (swap == kUnlimited ? 0 : swap)) * 1024;
}

/// Bytes that the process holds in memory; 0 where the system does not say. Allocates nothing.
#ifdef _WIN32
std::uint64_t resident_memory() noexcept { return 0; }
#else
std::uint64_t resident_memory() noexcept {
  std::array<char, 128> text{};
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const bool any = read(file, text.data(), text.size() - 1) > 0;
  close(file);
  const char* second = any ? std::strchr(text.data(), ' ') : nullptr;
  const std::uint64_t resident = second == nullptr ? 0 : std::strtoull(second, nullptr, 10);
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}
#endif

std::atomic<std::uint64_t> explicit_limit{0};
std::atomic<std::int64_t> untouched{0};

std::uint64_t default_limit() {
  const std::uint64_t free = free_memory();
  return free == kUnlimited ? kUnlimited : resident_memory() + free / 4 * 3;
}

}  // namespace

#ifdef _WIN32
std::uint64_t peak_resident_bytes() noexcept { return 0; }
#else
std::uint64_t peak_resident_bytes() noexcept {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}
#endif

std::uint64_t capped_product(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > kUnlimited / b ? kUnlimited : a * b;
}

std::string mebibytes(std::uint64_t bytes) {
  return std::to_string((bytes >> 20) + ((bytes & 0xFFFFF) != 0 ? 1 : 0)) + " MiB";
}

std::uint64_t free_memory() {
  return std::min({free_in_machine(), free_in_control_groups(), free_addresses()});
}

std::uint64_t memory_limit() {
  const std::uint64_t set = explicit_limit;
  if (set != 0) return set;
  // Not a static with a dynamic initializer: its allocations would query the limit recursively.
  static std::atomic<std::uint64_t> unset{0};
  std::uint64_t first = unset;
  if (first != 0) return first;
  const std::uint64_t made = default_limit();
  return unset.compare_exchange_strong(first, made) ? made : first;
}

void set_memory_limit(std::uint64_t bytes) noexcept { explicit_limit = bytes; }

std::uint64_t memory_left() {
  const auto more = static_cast<std::uint64_t>(std::max<std::int64_t>(0, untouched));
  return bytes_left(std::min(bytes_left(memory_limit(), resident_memory()), free_memory()), more);
}

void count_untouched(std::int64_t bytes) noexcept { untouched += bytes; }

bool memory_fits(std::uint64_t bytes) {
  if (bytes <= memory_left()) return true;
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  return bytes <= memory_left();
}

namespace {
thread_local bool obeys_limit = false;
thread_local std::size_t unchecked_bytes = 0;
}  // namespace

void obey_memory_limit() noexcept { obeys_limit = true; }

bool may_take(std::size_t bytes) {
  constexpr std::size_t kBytesBetweenChecks = std::size_t{1} << 20;
  if (!obeys_limit ||
      (unchecked_bytes += std::min(bytes, kBytesBetweenChecks)) < kBytesBetweenChecks)
    return true;
  unchecked_bytes = 0;
  const auto fits = [bytes] {
    const auto more = static_cast<std::uint64_t>(std::max<std::int64_t>(0, untouched));
    return resident_memory() + more + bytes <= memory_limit();
  };
  if (fits()) return true;
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  return fits();
}

void fail_for_stage(const std::string& problem) {
  throw Error(ErrorCode::internal, problem +
                                       ". Use smaller inputs or a smaller size, or raise the " +
                                       option("memory_limit") + ".");
}

void require_memory(const std::string& what, std::uint64_t bytes, const MemoryFailure& fail) {
  if (bytes <= kMaxUncheckedBytes) return;
  if (memory_fits(bytes)) return;
  const std::uint64_t left = memory_left();
  fail(what + " would take " + mebibytes(bytes) + " of memory, but only " + mebibytes(left) +
       " are left of the memory limit");
}

}  // namespace kiln

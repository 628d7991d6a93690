#include "base/system_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "base/control_group.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace kiln::os {

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

std::uint64_t peak_resident_memory() noexcept {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t free_memory_of_machine() {
  const std::uint64_t available = read_number_after("/proc/meminfo", "MemAvailable:");
  const std::uint64_t swap = read_number_after("/proc/meminfo", "SwapFree:");
  if (available == kNoNumber) return kNoNumber;
  return (available + (swap == kNoNumber ? 0 : swap)) * 1024;
}

std::uint64_t free_address_space() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoNumber;
  const std::uint64_t pages = read_first_number("/proc/self/statm");
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return remaining_bytes(limit.rlim_cur, pages == kNoNumber ? kNoNumber : pages * page);
}

void return_free_blocks() noexcept {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

void keep_free_blocks() noexcept {
#ifdef __GLIBC__
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

void* allocate_pages(std::size_t bytes) noexcept {
  void* const pages =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return pages == MAP_FAILED ? nullptr : pages;
}

void return_pages(void* first, std::size_t bytes) noexcept { munmap(first, bytes); }

namespace {

/// Calls `advise` with the whole pages of a range, if there are any.
template <typename Advise>
void for_whole_pages(void* first, std::size_t bytes, const Advise& advise) {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto at = reinterpret_cast<std::uintptr_t>(first);
  const std::uintptr_t begin = (at + page - 1) / page * page, end = (at + bytes) / page * page;
  if (begin < end) advise(reinterpret_cast<void*>(begin), end - begin);
}

}  // namespace

void discard_pages(void* first, std::size_t bytes) noexcept {
  for_whole_pages(first, bytes,
                  [](void* begin, std::size_t size) { madvise(begin, size, MADV_DONTNEED); });
}

void populate_pages([[maybe_unused]] void* first, [[maybe_unused]] std::size_t bytes) noexcept {
#ifdef MADV_POPULATE_WRITE  // Linux kernels before 5.14 reject this advice
  for_whole_pages(first, bytes,
                  [](void* begin, std::size_t size) { madvise(begin, size, MADV_POPULATE_WRITE); });
#endif
}

}  // namespace kiln::os

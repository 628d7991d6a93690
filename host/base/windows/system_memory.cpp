#include "base/system_memory.h"

#include "base/control_group.h"
#include "base/windows/api.h"
// This header must follow the API's header, whose types it uses.
#include <psapi.h>

namespace kiln::os {
namespace {

PROCESS_MEMORY_COUNTERS counters() noexcept {
  PROCESS_MEMORY_COUNTERS found{};
  K32GetProcessMemoryInfo(GetCurrentProcess(), &found, sizeof found);
  return found;
}

}  // namespace

std::uint64_t resident_memory() noexcept { return counters().WorkingSetSize; }
std::uint64_t peak_resident_memory() noexcept { return counters().PeakWorkingSetSize; }

std::uint64_t free_memory_of_machine() {
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  // The available commit charge: memory and page file; without a page file, memory only.
  return GlobalMemoryStatusEx(&status) == FALSE ? kNoNumber : status.ullAvailPageFile;
}

std::uint64_t free_address_space() { return kNoNumber; }
void return_free_blocks() noexcept {}
void keep_free_blocks() noexcept {}

void* allocate_pages(std::size_t bytes) noexcept {
  return VirtualAlloc(nullptr, bytes, MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE);
}

void return_pages(void* first, std::size_t /*bytes*/) noexcept {
  VirtualFree(first, 0, MEM_RELEASE);
}

void discard_pages(void* first, std::size_t bytes) noexcept {
  SYSTEM_INFO system{};
  GetSystemInfo(&system);
  const ULONG_PTR page = system.dwPageSize;
  const auto at = reinterpret_cast<ULONG_PTR>(first);
  const ULONG_PTR begin = (at + page - 1) / page * page, end = (at + bytes) / page * page;
  // The pages are decommitted and committed again, since pages that are only reset stay in the working set.
  if (begin >= end) return;
  void* const pages = reinterpret_cast<void*>(begin);
  VirtualFree(pages, end - begin, MEM_DECOMMIT);
  VirtualAlloc(pages, end - begin, MEM_COMMIT, PAGE_READWRITE);
}

void populate_pages(void* /*first*/, std::size_t /*bytes*/) noexcept {}

}  // namespace kiln::os

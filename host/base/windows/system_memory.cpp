#include "base/system_memory.h"

#include "base/control_group.h"
#include "base/windows/api.h"
// Must follow the API's header, whose types it needs.
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

std::uint64_t free_in_machine() {
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  // The available commit charge: memory and page file; without a page file, memory only.
  return GlobalMemoryStatusEx(&status) == FALSE ? kNoNumber : status.ullAvailPageFile;
}

std::uint64_t free_addresses() { return kNoNumber; }
void return_free_blocks() noexcept {}
void keep_free_blocks() noexcept {}

}  // namespace kiln::os

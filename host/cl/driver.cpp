#include "cl/driver.h"

#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace kiln {
namespace {

std::atomic<bool> failed{false};
static_assert(std::atomic<bool>::is_always_lock_free);
thread_local volatile int depth = 0;
// Calls of all threads: how many have begun, and how many have ended.
std::atomic<std::uint64_t> begun{0}, ended{0};
std::atomic<int> own_maps{0};
std::atomic<pid_t> opened_by{0};  // the process that opened the last device

}  // namespace

bool driver_failed() noexcept { return failed.load(); }
bool in_driver() noexcept { return depth > 0; }
bool runs_own_map() noexcept { return own_maps > 0; }

namespace ocl {

DriverCall::DriverCall() noexcept {
  depth = depth + 1;
  ++begun;
}
DriverCall::~DriverCall() {
  ++ended;
  depth = depth - 1;
}

OwnMapRun::OwnMapRun() noexcept { ++own_maps; }
OwnMapRun::~OwnMapRun() { --own_maps; }

std::uint64_t call_under_way() noexcept {
  const std::uint64_t done = ended, all = begun;
  return all > done ? all + done : 0;
}

void note_driver_failure() noexcept { failed = true; }

void throw_driver_failure() {
  throw Error(ErrorCode::device,
              "The OpenCL driver failed within a call, most likely for want of memory. Free some "
              "memory, or use a smaller size; then run it again.");
}

void note_opened() noexcept { opened_by = getpid(); }

bool is_forked() noexcept {
  const pid_t opener = opened_by;
  return opener != 0 && opener != getpid();
}

void throw_forked() {
  throw Error(ErrorCode::device,
              "This process was forked from one that had opened an OpenCL device: the driver's "
              "threads are not in it. Open devices after fork(), or run another program (exec).");
}

std::string cache_hint(const DeviceInfo& info) {
  if (info.platform != "Portable Computing Language") return {};
  const char* set = std::getenv("POCL_CACHE_DIR");
  return "Where PoCL's cache of kernels is damaged or its disk is full, remove it, or set "
         "POCL_CACHE_DIR (now " +
         (set == nullptr ? std::string("unset: ~/.cache/pocl") : "'" + std::string(set) + "'") +
         ") to another folder. ";
}

}  // namespace ocl
}  // namespace kiln

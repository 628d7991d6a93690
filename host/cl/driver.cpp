#include "cl/driver.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <utility>

#include "base/file.h"
#include "base/formatted.h"
#include "base/option.h"

namespace kiln {
namespace {

std::atomic<bool> has_driver_failed{false};
static_assert(std::atomic<bool>::is_always_lock_free);
thread_local volatile int call_depth = 0;
// Numbers of driver calls of all threads that have begun, and that have ended.
std::atomic<std::uint64_t> begun_calls{0}, ended_calls{0};
std::atomic<int> own_maps{0};
// Name of the user-written map that last started while no other one was running. Read by signal handlers
std::array<char, 512> own_map_name{};
std::atomic<long> opener_process{0};  // process that opened the last device

}  // namespace

bool driver_failed() noexcept { return has_driver_failed.load(); }
bool in_driver() noexcept { return call_depth > 0; }
const char* running_own_map() noexcept { return own_maps > 0 ? own_map_name.data() : nullptr; }

namespace ocl {

DriverCall::DriverCall() noexcept {
  call_depth = call_depth + 1;
  ++begun_calls;
}
DriverCall::~DriverCall() {
  ++ended_calls;
  call_depth = call_depth - 1;
}

namespace {
thread_local const OwnMapRun* current_run = nullptr;
}

OwnMapRun::OwnMapRun(std::string label, double seconds)
    : map_label_(std::move(label)), time_limit_seconds_(seconds), before_(current_run) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (own_maps == 0) {
    const std::size_t size = std::min(map_label_.size(), own_map_name.size() - 1);
    std::transform(map_label_.begin(), map_label_.begin() + static_cast<std::ptrdiff_t>(size),
                   own_map_name.begin(), [](char c) {
                     return static_cast<unsigned char>(c) < ' ' || c == 127 ? '?' : c;
                   });
    own_map_name[size] = '\0';
  }
  ++own_maps;
  current_run = this;
}

OwnMapRun::~OwnMapRun() {
  current_run = before_;
  --own_maps;
}

const OwnMapRun* OwnMapRun::current() noexcept { return current_run; }

void OwnMapRun::abandon_compilation() const {
  record_driver_failure();
  throw Error(ErrorCode::input, "The map " + map_label_ + " is not compiled within " +
                                    formatted("%g s", time_limit_seconds_) +
                                    ": its macros or unrolled loops may be too large. "
                                    "Shorten it, or raise " +
                                    option("own_map_seconds") + ".");
}

std::uint64_t call_under_way() noexcept {
  const std::uint64_t done = ended_calls, all = begun_calls;
  return all > done ? all + done : 0;
}

void record_driver_failure() noexcept { has_driver_failed = true; }

void throw_driver_failure() {
  throw Error(ErrorCode::device,
              "The OpenCL driver failed within a call, most likely for want of memory. Free some "
              "memory, or use a smaller size; then run it again.");
}

void record_opened() noexcept { opener_process = os::process_id(); }

bool is_forked() noexcept {
  const long opening_process = opener_process;
  return opening_process != 0 && opening_process != os::process_id();
}

void throw_forked() {
  throw Error(
      ErrorCode::device,
      "This process was forked from one that had opened an OpenCL device: the driver's "
      "threads do not exist in it. Open devices after fork(), or run another program (exec).");
}

std::string cache_hint(const DeviceInfo& info) {
  if (info.platform != "Portable Computing Language") return {};
  const char* set = std::getenv("POCL_CACHE_DIR");
  const char* caches = std::getenv("XDG_CACHE_HOME");
  const std::string cache_folder = caches == nullptr || *caches == '\0' ? "~/.cache" : caches;
  return "If PoCL's cache of kernels is damaged or its disk is full, remove the cache, or set "
         "POCL_CACHE_DIR (now " +
         (set == nullptr ? "unset: " + cache_folder + "/pocl" : "'" + std::string(set) + "'") +
         ") to another folder. ";
}

}  // namespace ocl
}  // namespace kiln

// Guards calls of OpenCL drivers, which may throw C++ exceptions.
#pragma once

#include <cstdint>
#include <string>

#include "cl/context.h"
#include "cl/driver_state.h"

namespace kiln::ocl {

/// Marks a driver call during its lifetime, in which in_driver() returns true.
class DriverCall {
 public:
  DriverCall() noexcept;
  ~DriverCall();
  DriverCall(const DriverCall&) = delete;
};

/// Returns a number that changes whenever a driver call begins or ends on any thread; 0 if no call is in progress.
std::uint64_t call_under_way() noexcept;

/// Called in handlers of exceptions from a driver: disables all further calls.
void record_driver_failure() noexcept;

/// The scope in which a user's kernel function is built and run: during its lifetime, running_own_map() returns the
/// map's name.
class OwnMapRun {
 public:
  /// \param label    name of the map and its file, for messages
  /// \param seconds  time limit of its compilation
  OwnMapRun(std::string label, double seconds);
  ~OwnMapRun();
  OwnMapRun(const OwnMapRun&) = delete;
  OwnMapRun& operator=(const OwnMapRun&) = delete;

  /// The innermost scope of the calling thread; null if there is none.
  static const OwnMapRun* current() noexcept;
  const std::string& label() const { return map_label_; }
  double seconds() const { return time_limit_seconds_; }
  /// Abandons a compilation that exceeded its time limit, since compilers cannot be stopped: disables all further calls.
  /// \throws Error(input)
  [[noreturn]] void abandon_compilation() const;

 private:
  std::string map_label_;
  double time_limit_seconds_;
  const OwnMapRun* before_;
};

/// Throws the error for a driver that has failed, now or before. \throws Error(device)
[[noreturn]] void throw_driver_failure();

/// Records that this process has opened a device. A forked child has none of the driver's threads, so calls there would
/// never return.
void record_opened() noexcept;
/// True in a child that was forked after a device was opened.
bool is_forked() noexcept;
/// Throws the error for the child of a fork. \throws Error(device)
[[noreturn]] void throw_forked();

/// Calls a driver function. \returns its status \throws Error(device) if the driver throws, or has thrown before, and
/// in a forked child of the process that opened a device
template <typename Call>
cl_int driver(const Call& call) {
  if (is_forked()) throw_forked();
  if (driver_failed()) throw_driver_failure();
  try {
    const DriverCall here;
    return call();
  } catch (...) {
    // Any exception leaves the driver's locks and lists in an unknown state.
    record_driver_failure();
  }
  throw_driver_failure();
}

/// Calls a driver to release an object, for destructors. Skipped once a driver has failed.
template <typename Call>
void release(const Call& call) noexcept {
  if (driver_failed() || is_forked()) return;
  try {
    const DriverCall here;
    call();
  } catch (...) {
    record_driver_failure();
  }
}

/// Text for messages about failed builds: a likely cause other than the kernel's source. Empty for drivers other than
/// PoCL.
std::string cache_hint(const DeviceInfo& info);

}  // namespace kiln::ocl

// Calls of the driver, which may throw: it is C++ inside.
#pragma once

#include <cstdint>
#include <string>

#include "cl/context.h"
#include "cl/driver_state.h"

namespace kiln::ocl {

/// Stands around a call of the driver: in_driver() is true meanwhile.
class DriverCall {
 public:
  DriverCall() noexcept;
  ~DriverCall();
  DriverCall(const DriverCall&) = delete;
};

/// A number that changes with every call that begins or ends on any thread; 0 where none is under way.
std::uint64_t call_under_way() noexcept;

/// For a handler of an exception that came out of the driver: no call is made after this.
void note_driver_failure() noexcept;

/// Around the build and the runs of a kernel that has a function of the user's: running_own_map() names it meanwhile.
class OwnMapRun {
 public:
  /// \param label    of the map and its file, for messages
  /// \param seconds  the most that its compiler may take
  OwnMapRun(std::string label, double seconds);
  ~OwnMapRun();
  OwnMapRun(const OwnMapRun&) = delete;
  OwnMapRun& operator=(const OwnMapRun&) = delete;

  /// The last that this thread made and that is still there; null: there is none.
  static const OwnMapRun* current() noexcept;
  const std::string& label() const { return label_; }
  double seconds() const { return seconds_; }

 private:
  std::string label_;
  double seconds_;
  const OwnMapRun* before_;
};

/// \throws Error(device) where the driver has failed, now or before
[[noreturn]] void throw_driver_failure();

/// Notes that this process has opened a device. In a child that it forks the driver has no threads: a call there would
/// not return.
void note_opened() noexcept;
/// True in such a child.
bool is_forked() noexcept;
/// \throws Error(device)
[[noreturn]] void throw_forked();

/// Makes a call. \returns its status \throws Error(device) where the driver throws, or has done so before, and in a
/// child of the process that opened a device
template <typename Call>
cl_int driver(const Call& call) {
  if (is_forked()) throw_forked();
  if (driver_failed()) throw_driver_failure();
  try {
    const DriverCall here;
    return call();
  } catch (...) {
    // Whatever it was: the driver's locks and lists are as the exception left them.
    note_driver_failure();
  }
  throw_driver_failure();
}

/// Makes a call that gives something back, for destructors. None where the driver has failed.
template <typename Call>
void release(const Call& call) noexcept {
  if (driver_failed() || is_forked()) return;
  try {
    const DriverCall here;
    call();
  } catch (...) {
    note_driver_failure();
  }
}

/// Likely cause beside the kernel of a build that fails, for a message; empty but for PoCL.
std::string cache_hint(const DeviceInfo& info);

}  // namespace kiln::ocl

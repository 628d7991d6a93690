// Progress and cancelling of long work: workers poll, and the callback is called about twenty times a second.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "kiln/error.h"
#include "kiln/types.h"

namespace kiln {

/// Thrown by running work when the progress callback returns false.
struct Cancelled : Error {
  Cancelled() : Error(ErrorCode::cancelled, "Stopped by the progress callback.") {}
};

/// Installs a progress callback on the calling thread during its lifetime; parallel loops and waits for the
/// device poll it. The innermost guard with a callback is used.
class ProgressGuard {
 public:
  /// \param callback may be empty; the guard then has no effect
  explicit ProgressGuard(Progress callback);
  ~ProgressGuard();
  ProgressGuard(const ProgressGuard&) = delete;
  ProgressGuard& operator=(const ProgressGuard&) = delete;

  /// Calls the callback now. \returns false to cancel
  bool report(double done, std::string_view stage);
  /// report() as a callback, for functions that report their progress themselves; empty if the guard has no callback.
  /// Valid during the guard's lifetime.
  Progress progress();

  /// Repeats the last progress to the calling thread's callback, if more than 50 ms have passed. Otherwise the cost
  /// is one reading of a clock. \throws Cancelled if the callback returns false
  static void poll();
  /// Calls the calling thread's callback now. \throws Cancelled if the callback returns false
  static void poll_at(double done, std::string_view stage);
  /// As poll(), but reports the name of a part of the current stage, such as a chunk of a large input. The reported
  /// share is unchanged.
  static void poll_within_stage(std::string_view stage);
  /// True if the calling thread has a callback.
  static bool is_active();

 private:
  Progress callback_;
  ProgressGuard* outer_ = nullptr;
  double last_done_ = 0;
  std::string last_stage_ = "preparing";
  std::chrono::steady_clock::time_point last_call_time_;
  // true during a callback; functions of Kiln that the callback calls then report no progress
  bool is_calling_back_ = false;
};

/// Locks a mutex, polling progress while another thread holds it. \throws as ProgressGuard::poll()
template <typename Mutex>
std::unique_lock<Mutex> lock_polling(Mutex& mutex) {
  std::unique_lock lock(mutex, std::try_to_lock);
  if (!lock && !ProgressGuard::is_active()) lock.lock();
  while (!lock && !lock.try_lock()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ProgressGuard::poll();
  }
  return lock;
}

}  // namespace kiln

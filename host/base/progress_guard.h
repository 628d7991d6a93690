// Progress and cancelling of long work: whoever works polls, and the caller is told about twenty times a second.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "kiln/error.h"
#include "kiln/types.h"

namespace kiln {

/// Thrown by what is under way where its caller says stop.
struct Cancelled : Error {
  Cancelled() : Error(ErrorCode::cancelled, "Stopped: the progress callback said so.") {}
};

/// Carries the caller's progress callback on the thread that made it: parallel loops and waits for the device
/// poll it while it lives. Of several on one thread the innermost with a callback counts.
class ProgressGuard {
 public:
  /// \param callback  may be empty: then nothing changes
  explicit ProgressGuard(Progress callback);
  ~ProgressGuard();
  ProgressGuard(const ProgressGuard&) = delete;
  ProgressGuard& operator=(const ProgressGuard&) = delete;

  /// Calls the callback now. \returns whether to go on
  bool tell(double done, std::string_view stage);
  /// tell() as a callback, for work that knows how far it is; empty where this one is. Good while this lives.
  Progress progress();

  /// Calls the calling thread's callback with what it was told last, if that was more than 50 ms ago. Costs the
  /// reading of a clock. \throws Cancelled where it says stop
  static void poll();
  /// Calls the calling thread's callback now. \throws Cancelled where it says stop
  static void poll_at(double done, std::string_view stage);
  /// True if the calling thread has a callback.
  static bool active();

 private:
  Progress callback_;
  ProgressGuard* outer_ = nullptr;
  double done_ = 0;
  std::string stage_ = "preparing";
  std::chrono::steady_clock::time_point last_;
  bool calling_ = false;  // calls of Kiln by the callback itself are not reported
};

/// Locks; polls while another thread holds the mutex. \throws as ProgressGuard::poll()
template <typename Mutex>
std::unique_lock<Mutex> lock_polling(Mutex& mutex) {
  std::unique_lock lock(mutex, std::try_to_lock);
  if (!lock && !ProgressGuard::active()) lock.lock();
  while (!lock && !lock.try_lock()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ProgressGuard::poll();
  }
  return lock;
}

}  // namespace kiln

// Signs of life of long work: whoever works asks now and then, and the caller is told ten times a second.
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

/// While it lives, beat() calls the callback where that was not called for a while. It does so on
/// the thread that made it. Of several on one thread the last one counts.
class Heartbeat {
 public:
  /// \param callback  may be empty: then nothing changes
  explicit Heartbeat(Progress callback);
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;

  /// Calls the callback now. \returns whether to go on
  bool tell(double done, std::string_view stage);

  /// Of the calling thread, where it has one: tells the callback what it was told last, if that was more
  /// than 50 ms ago. Costs the reading of a clock. \throws Cancelled where it says stop
  static void beat();

  /// Of the calling thread, where it has one: tells the callback now. \throws Cancelled where it says stop
  static void at(double done, std::string_view stage);

  /// Whether the calling thread has one.
  static bool here();

 private:
  Progress callback_;
  Heartbeat* outer_ = nullptr;
  double done_ = 0;
  std::string stage_ = "preparing";
  std::chrono::steady_clock::time_point last_;
  bool calling_ = false;  // what the callback itself asks of Kiln is not told
};

/// Locks; where another thread holds the mutex, the wait gives signs of life. \throws as Heartbeat::beat()
template <typename Mutex>
std::unique_lock<Mutex> lock_alive(Mutex& mutex) {
  std::unique_lock lock(mutex, std::try_to_lock);
  if (!lock && !Heartbeat::here()) lock.lock();
  while (!lock && !lock.try_lock()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    Heartbeat::beat();
  }
  return lock;
}

}  // namespace kiln

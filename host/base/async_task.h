// Work on a thread of its own, beside what its caller does meanwhile.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <utility>

#include "base/input_log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress_guard.h"

namespace kiln {

/// Starts work at once, where there is more than one thread; else it is done when it is asked for. What it uses must
/// outlive this, and nobody else may change it meanwhile. Its end waits for the work.
template <typename Result>
class AsyncTask {
 public:
  explicit AsyncTask(std::function<Result()> work)
      : made_(std::async(thread_count() > 1 ? std::launch::async : std::launch::deferred,
                         [work = std::move(work), log = current_input_log()] {
                           const InputLogScope scope(log);
                           obey_memory_limit();
                           return work();
                         })) {}

  /// Once. Gives signs of life while it waits. \throws what the work threw; as ProgressGuard::poll()
  Result get() {
    constexpr std::chrono::milliseconds kBetweenBeats(20);
    while (made_.wait_for(kBetweenBeats) == std::future_status::timeout) ProgressGuard::poll();
    return made_.get();
  }

 private:
  std::future<Result> made_;
};

}  // namespace kiln

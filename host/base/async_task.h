// Asynchronous work on a separate thread.
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

/// Starts work immediately if there is more than one thread; otherwise get() runs it. Data that the work uses must
/// outlive the task, and must not change while it runs. The destructor waits for the work.
template <typename Result>
class AsyncTask {
 public:
  explicit AsyncTask(std::function<Result()> work)
      : future_result_(std::async(thread_count() > 1 ? std::launch::async : std::launch::deferred,
                                  [work = std::move(work), log = current_input_log()] {
                                    const InputLogScope log_scope(log);
                                    obey_memory_limit();
                                    return work();
                                  })) {}

  /// Waits for the result, polling progress; must be called once. \throws the work's exception, or
  /// as ProgressGuard::poll()
  Result get() {
    constexpr std::chrono::milliseconds kPollInterval(20);
    while (future_result_.wait_for(kPollInterval) == std::future_status::timeout)
      ProgressGuard::poll();
    return future_result_.get();
  }

 private:
  std::future<Result> future_result_;
};

}  // namespace kiln

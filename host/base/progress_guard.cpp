#include "base/progress_guard.h"

#include <utility>

namespace kiln {

/// Minimum time between two calls of the callback. Tests that count polls declare this variable and set it to
/// 0.
std::chrono::milliseconds min_progress_interval{50};

namespace {

thread_local ProgressGuard* of_thread = nullptr;

}  // namespace

ProgressGuard::ProgressGuard(Progress callback)
    : callback_(std::move(callback)), outer_(of_thread), last_(std::chrono::steady_clock::now()) {
  if (callback_) of_thread = this;
}

ProgressGuard::~ProgressGuard() {
  if (callback_) of_thread = outer_;
}

bool ProgressGuard::report(double done, std::string_view stage) {
  if (!callback_) return true;
  done_ = done;
  if (stage_ != stage) stage_ = stage;
  struct Calling {
    bool& flag;
    explicit Calling(bool& calling) : flag(calling) { flag = true; }
    ~Calling() { flag = false; }
  };
  const Calling calling(calling_);
  const bool go_on = callback_(done, stage);
  last_ = std::chrono::steady_clock::now();
  return go_on;
}

Progress ProgressGuard::progress() {
  if (!callback_) return {};
  return [this](double done, std::string_view stage) { return report(done, stage); };
}

void ProgressGuard::poll_at(double done, std::string_view stage) {
  ProgressGuard* const guard = of_thread;
  if (guard == nullptr || guard->calling_) return;
  if (!guard->report(done, stage)) throw Cancelled();
}

void ProgressGuard::poll_in(std::string_view stage) {
  ProgressGuard* const guard = of_thread;
  if (guard == nullptr || guard->calling_) return;
  if (!guard->report(guard->done_, stage)) throw Cancelled();
}

bool ProgressGuard::active() { return of_thread != nullptr; }

void ProgressGuard::poll() {
  ProgressGuard* const guard = of_thread;
  if (guard == nullptr || guard->calling_) return;
  if (std::chrono::steady_clock::now() - guard->last_ < min_progress_interval) return;
  if (!guard->report(guard->done_, guard->stage_)) throw Cancelled();
}

}  // namespace kiln

#include "base/progress_guard.h"

#include <utility>

namespace kiln {

/// Minimum time between two calls of the callback. Tests that count polls declare this variable and set it to
/// 0.
std::chrono::milliseconds min_progress_interval{50};

namespace {

thread_local ProgressGuard* current_guard = nullptr;

}  // namespace

ProgressGuard::ProgressGuard(Progress callback)
    : callback_(std::move(callback)),
      outer_(current_guard),
      last_call_time_(std::chrono::steady_clock::now()) {
  if (callback_) current_guard = this;
}

ProgressGuard::~ProgressGuard() {
  if (callback_) current_guard = outer_;
}

bool ProgressGuard::report(double done, std::string_view stage) {
  if (!callback_) return true;
  last_done_ = done;
  if (last_stage_ != stage) last_stage_ = stage;
  struct CallingFlag {
    bool& flag;
    explicit CallingFlag(bool& is_calling) : flag(is_calling) { flag = true; }
    ~CallingFlag() { flag = false; }
  };
  const CallingFlag calling_flag(is_calling_back_);
  const bool should_continue = callback_(done, stage);
  last_call_time_ = std::chrono::steady_clock::now();
  return should_continue;
}

Progress ProgressGuard::progress() {
  if (!callback_) return {};
  return [this](double done, std::string_view stage) { return report(done, stage); };
}

void ProgressGuard::poll_at(double done, std::string_view stage) {
  ProgressGuard* const guard = current_guard;
  if (guard == nullptr || guard->is_calling_back_) return;
  if (!guard->report(done, stage)) throw Cancelled();
}

void ProgressGuard::poll_within_stage(std::string_view stage) {
  ProgressGuard* const guard = current_guard;
  if (guard == nullptr || guard->is_calling_back_) return;
  if (!guard->report(guard->last_done_, stage)) throw Cancelled();
}

bool ProgressGuard::is_active() { return current_guard != nullptr; }

void ProgressGuard::poll() {
  ProgressGuard* const guard = current_guard;
  if (guard == nullptr || guard->is_calling_back_) return;
  if (std::chrono::steady_clock::now() - guard->last_call_time_ < min_progress_interval) return;
  if (!guard->report(guard->last_done_, guard->last_stage_)) throw Cancelled();
}

}  // namespace kiln

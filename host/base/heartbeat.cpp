#include "base/heartbeat.h"

#include <utility>

namespace kiln {
namespace {

constexpr std::chrono::milliseconds kPause{50};
thread_local Heartbeat* of_thread = nullptr;

}  // namespace

Heartbeat::Heartbeat(Progress callback)
    : callback_(std::move(callback)), outer_(of_thread), last_(std::chrono::steady_clock::now()) {
  if (callback_) of_thread = this;
}

Heartbeat::~Heartbeat() {
  if (callback_) of_thread = outer_;
}

bool Heartbeat::tell(double done, std::string_view stage) {
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

void Heartbeat::at(double done, std::string_view stage) {
  Heartbeat* const heart = of_thread;
  if (heart == nullptr || heart->calling_) return;
  if (!heart->tell(done, stage)) throw Cancelled();
}

bool Heartbeat::here() { return of_thread != nullptr; }

void Heartbeat::beat() {
  Heartbeat* const heart = of_thread;
  if (heart == nullptr || heart->calling_) return;
  if (std::chrono::steady_clock::now() - heart->last_ < kPause) return;
  if (!heart->tell(heart->done_, heart->stage_)) throw Cancelled();
}

}  // namespace kiln

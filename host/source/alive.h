// Long work that tells its caller it is alive, also while it waits for the device.
#pragma once

#include <utility>

#include "base/heartbeat.h"
#include "cl/context.h"

namespace kiln {

/// While it lives, its thread's parallel loops and waits for the device beat.
class Alive {
 public:
  explicit Alive(const Progress& callback)
      : heart_(callback), any_(static_cast<bool>(callback)), before_(ocl::while_waiting) {
    if (any_) ocl::while_waiting = &Heartbeat::beat;
  }
  ~Alive() { ocl::while_waiting = before_; }
  Alive(const Alive&) = delete;
  Alive& operator=(const Alive&) = delete;

  /// For those who know how far the work is; empty where the callback is. Good while this lives.
  Progress progress() {
    if (!any_) return {};
    return [this](double done, std::string_view stage) { return heart_.tell(done, stage); };
  }

 private:
  Heartbeat heart_;
  bool any_;
  void (*before_)();
};

}  // namespace kiln

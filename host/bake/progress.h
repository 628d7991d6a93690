// Reports the progress of a bake to the caller, who may cancel.
#pragma once

#include <string_view>
#include <utility>

#include "kiln/types.h"
#include "match/visibility.h"

namespace kiln {

/// Reports the progress of one part of a bake to the caller's callback.
class BakeProgress {
 public:
  explicit BakeProgress(Progress callback = {}, double from = 0, double to = 1)
      : callback_(std::move(callback)), begin_share_(from), end_share_(to) {}

  /// Returns the progress of a sub-part, from and to shares of this part.
  BakeProgress part(double from, double to) const {
    return BakeProgress(callback_, share_of_whole(from), share_of_whole(to));
  }

  explicit operator bool() const { return static_cast<bool>(callback_); }
  /// Reports the completed share of this part, [0, 1]. \returns false to cancel
  bool report(double done, std::string_view stage) const {
    return !callback_ || callback_(share_of_whole(done), stage);
  }
  /// Reports progress. \throws Cancelled if the callback returns false
  void at(double done, std::string_view stage) const {
    if (!report(done, stage)) throw Cancelled();
  }

 private:
  double share_of_whole(double done) const {
    return begin_share_ + (end_share_ - begin_share_) * done;
  }

  Progress callback_;
  double begin_share_, end_share_;
};

/// Returns the result of `work`; if it was cancelled, an empty result that `mark` marks as cancelled.
template <typename Result, typename Work, typename Mark>
Result unless_cancelled(const Work& work, const Mark& mark) {
  try {
    return work();
  } catch (const Cancelled&) {
    Result none;
    mark(none);
    return none;
  }
}

}  // namespace kiln

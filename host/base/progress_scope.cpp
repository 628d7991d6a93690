#include <utility>

#include "base/progress_guard.h"
#include "kiln/progress.h"

namespace kiln {

struct ProgressScope::Impl {
  explicit Impl(Progress progress) : progress_guard(std::move(progress)) {}

  ProgressGuard progress_guard;
};

ProgressScope::ProgressScope(Progress progress) : impl_(new Impl(std::move(progress))) {}
ProgressScope::~ProgressScope() { delete impl_; }

void ProgressScope::at(double done, std::string_view stage) {
  if (!impl_->progress_guard.report(done, stage)) throw Cancelled();
}

}  // namespace kiln

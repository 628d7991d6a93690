#include <utility>

#include "kiln/progress.h"
#include "source/alive.h"

namespace kiln {

struct ProgressScope::Impl {
  explicit Impl(Progress given) : progress(std::move(given)), alive(progress) {}

  const Progress progress;
  Alive alive;
};

ProgressScope::ProgressScope(Progress progress) : impl_(new Impl(std::move(progress))) {}
ProgressScope::~ProgressScope() { delete impl_; }

void ProgressScope::at(double done, std::string_view stage) {
  const Progress tell = impl_->alive.progress();
  if (tell && !tell(done, stage)) throw Cancelled();
}

}  // namespace kiln

// The dense mesh on the device.
#pragma once

#include <vector>

#include "detail.h"
#include "geometry/frame.h"
#include "kiln/bake.h"
#include "ray.h"

namespace kiln {

struct Source::Impl {
  Device device;
  Frame frame;
  std::unique_ptr<RayCaster> rays;
  SourceAttributes attributes;
  Stats stats;
  std::vector<Warning> warnings;
};

}  // namespace kiln

// The dense mesh: on the host in the working frame, and on the device as its users need it.
#pragma once

#include <mutex>
#include <vector>

#include "closest.h"
#include "detail.h"
#include "geometry/frame.h"
#include "kiln/bake.h"
#include "raster.h"
#include "ray.h"

namespace kiln {

struct Source::Impl {
  Impl(const Device& opened, const Mesh& high, Traversal wanted);

  Device device;
  Frame frame;
  Traversal traversal;
  std::vector<Vec3> positions;  ///< In the frame
  std::vector<Triangle> triangles;
  SourceAttributes attributes;
  std::vector<Warning> warnings;

  /// Made when first asked for: what is not used costs nothing.
  RayCaster& rays() const;
  ClosestFinder& closest() const;
  Rasterizer& raster() const;

  Stats stats() const;

 private:
  const std::shared_ptr<const Tree>& tree() const;  ///< The mutex is held

  mutable std::mutex mutex_;
  mutable std::shared_ptr<const Tree> tree_;
  mutable std::unique_ptr<RayCaster> rays_;
  mutable std::unique_ptr<ClosestFinder> closest_;
  mutable std::unique_ptr<Rasterizer> raster_;
  mutable Stats stats_;
};

}  // namespace kiln

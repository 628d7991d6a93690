// Nearest-point queries on the high poly.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "accel/device_bvh.h"
#include "cl/context.h"
#include "kiln/types.h"
#include "texel/device_correspondence.h"

namespace kiln {

struct ClosestQuery {
  float max_distance = 1;  ///< Maximum distance of the nearest point, in frame units; 0 to 2^20
  bool two_sided = false;  ///< Include faces turned away from the sample's direction
};

/// Nearest-point queries on a surface, whose data may be in memory or in parts of a file.
class ClosestSearch {
 public:
  ClosestSearch() = default;
  ClosestSearch(const ClosestSearch&) = default;
  ClosestSearch& operator=(const ClosestSearch&) = default;
  virtual ~ClosestSearch() = default;

  /// Finds the nearest points for samples [0, count) of `points` (planes of `capacity`: position x y z,
  /// unit direction x y z; see TexelBand). Writes triangle, barycentric, distance (negative if the
  /// point lies behind the sample, against its direction) and status for each.
  /// \throws Error(usage) for a distance out of range
  virtual void find(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
                    const ClosestQuery& query, DeviceCorrespondence& result) const = 0;
};

/// Finds the nearest point of the high poly (Tarini, Cignoni, Scopigno 2003, "Visibility Based Methods
/// and Assessment for Detail-Recovery", section 3.1).
///
/// Exact up to rounding (the bound is in kernels/accel/nearest.clh). Ties go to the smaller triangle
/// index. The result is a function of the triangles and the sample alone: it does not depend on tree,
/// variant and threads.
class ClosestFinder : public ClosestSearch {
 public:
  /// \param tree may be shared with other queries
  ClosestFinder(cl::Context& context, std::shared_ptr<const Tree> tree,
                Traversal traversal = Traversal::automatic);

  void find(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
            const ClosestQuery& query, DeviceCorrespondence& result) const override;

  Traversal traversal() const { return traversal_; }  ///< The resolved variant, never `automatic`

 private:
  cl::Context* context_;
  std::shared_ptr<const Tree> tree_;
  Traversal traversal_;
  // true if the kernel variant is chosen automatically, by the number of samples
  bool is_automatic_;
};

}  // namespace kiln

// Matching by depth views: directions, size, and the best view of each sample.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "accel/raster.h"
#include "cl/context.h"
#include "kiln/bake.h"
#include "mesh/vector.h"
#include "texel/device_correspondence.h"

namespace kiln {

/// Returns directions that are spread evenly over the sphere. If there are 12, they are the
/// icosahedron's corners, the most even distribution of 12 directions, in opposite pairs. Other
/// numbers: Fibonacci's spiral (Gonzalez 2010, "Measurement of areas on a sphere using Fibonacci and
/// latitude-longitude lattices").
std::vector<Vec3d> spread_directions(std::uint32_t count);

/// The ball that views show: centre and radius, frame units.
struct ViewArea {
  Vec3d center{};
  double radius = 1;
};

struct ViewQuery {
  ViewCriterion criterion = ViewCriterion::angle;
  float max_distance = 1;  ///< Frame units
  float least_cosine = 0;  ///< Minimum cosine between a view and the sample's direction
  /// Move the found point to the line through the sample along the sample's own direction
  bool refine = true;
  bool two_sided = false;  ///< Also draw and match faces that are turned away from the view
  ViewArea area;           ///< The area that the view shows
};

/// What depth views are drawn for.
enum class ViewUse {
  match,  ///< DepthViews::match()
  probe,  ///< DepthViews::probe() alone, which needs no triangles
};

/// Depth views on the device. They are drawn once, and any number of bands of samples can be matched with them.
class DepthViews {
 public:
  /// \param size  pixels a side of each view
  DepthViews(cl::Context& context, ViewedSurface& surface, const std::vector<Vec3d>& directions,
             std::uint32_t size, bool two_sided, const ViewArea& area,
             ViewUse use = ViewUse::match);

  /// Improves the correspondence of samples [0, count) of `points` where a view is better than a
  /// sample's current `score`; ties keep the earlier view.
  void match(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
             const ViewQuery& query, const cl::Array<float>& score,
             DeviceCorrespondence& result) const;

  /// Computes, per view and sample, the cosine between the view and the sample's direction, or 0 if the view
  /// does not see the sample.
  /// \param quality  [views * count]
  void probe(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
             const ViewQuery& query, const cl::Array<float>& quality) const;

  /// Resets a band's samples to "no point found".
  static void reset(cl::Context& context, std::uint32_t count, const cl::Array<float>& score,
                    DeviceCorrespondence& result);

  /// Number of views of this size in one batch on this device.
  static std::uint32_t batch_size(const cl::Context& context, std::uint32_t size);

  const std::vector<kiln_view>& views() const { return views_; }
  const DepthKeys& keys() const { return batch_keys_; }

 private:
  kiln_views_params params(std::uint32_t count, std::uint32_t capacity,
                           const ViewQuery& query) const;

  cl::Context& context_;
  std::vector<kiln_view> views_;
  cl::Array<kiln_view> device_views_;
  DepthKeys batch_keys_;
  std::shared_ptr<const ShownTriangles> shown_;  // Null for ViewUse::probe
};

}  // namespace kiln

// Matching by depth views: directions, size, and the best view of each sample.
#pragma once

#include <cstdint>
#include <vector>

#include "accel/raster.h"
#include "cl/context.h"
#include "kiln/bake.h"
#include "mesh/vector.h"
#include "texel/device_correspondence.h"

namespace kiln {

/// Directions spread evenly over the sphere. 12: the icosahedron's corners, the most even 12 there are,
/// in opposite pairs. Other numbers: Fibonacci's spiral (Gonzalez 2010, "Measurement of areas on a sphere
/// using Fibonacci and latitude-longitude lattices").
std::vector<Vec3d> spread_directions(std::uint32_t count);

/// Ball that views show: radius around a centre, frame units.
struct ViewArea {
  Vec3d center{};
  double radius = 1;
};

struct ViewQuery {
  ViewCriterion criterion = ViewCriterion::angle;
  float max_distance = 1;  ///< Frame units
  float least_cosine = 0;  ///< Smallest cosine of a view's angle to the sample's direction
  bool refine = true;      ///< Move to the point on the sample's own direction
  bool two_sided = false;  ///< Also draw and match faces that are turned away
  ViewArea area;           ///< The area that the view shows
};

/// Depth views on the device, drawn once and matched with any number of bands of samples.
class DepthViews {
 public:
  /// \param size  pixels a side of each view
  DepthViews(cl::Context& context, Rasterizer& rasterizer, const std::vector<Vec3d>& directions,
             std::uint32_t size, bool two_sided, const ViewArea& area);

  /// Improves the correspondence of samples [0, count) of `points` if a view is better than their
  /// `score` so far; among equally good views the first one stays.
  void match(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
             const ViewQuery& query, const cl::Array<float>& score,
             DeviceCorrespondence& result) const;

  /// Computes, per view and sample, the cosine between the view and the sample's direction, or 0 if it is not seen.
  /// \param quality  [views * count]
  void probe(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
             const ViewQuery& query, const cl::Array<float>& quality) const;

  /// Sets a band's samples to undecided.
  static void reset(cl::Context& context, std::uint32_t count, const cl::Array<float>& score,
                    DeviceCorrespondence& result);

  /// Number of views of this size in one batch on this device.
  static std::uint32_t batch_size(const cl::Context& context, std::uint32_t size);

  const std::vector<kiln_view>& views() const { return views_; }
  const DepthKeys& keys() const { return keys_; }

 private:
  kiln_views_params params(std::uint32_t count, std::uint32_t capacity,
                           const ViewQuery& query) const;

  cl::Context& context_;
  const Rasterizer& rasterizer_;
  std::vector<kiln_view> views_;
  cl::Array<kiln_view> device_views_;
  DepthKeys keys_;
};

}  // namespace kiln

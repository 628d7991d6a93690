// Tests the visibility of samples by depth views of all occluders, from directions over the whole
// sphere.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "accel/device_bvh.h"
#include "accel/raster.h"
#include "cl/context.h"
#include "shared/hemisphere_views.h"

namespace kiln {

/// Sums the directions in which nothing hides a sample (kernels/detail/hemisphere_views.cl).
/// Directions are added in a fixed order, so the sum of a sample does not depend on other samples.
class HemisphereViews {
 public:
  /// Side of each view in pixels, for a map of this size.
  static std::uint32_t size_for(std::uint32_t width, std::uint32_t height);

  /// \param positions positions of the occluders, at any distance; not empty
  /// \param size side of each view in pixels
  /// \param traversal  Traversal::gpu: each work-item handles one sample; otherwise
  ///   KILN_VISIBILITY_SAMPLES samples
  HemisphereViews(cl::Context& context, std::vector<Vec3> positions,
                  std::span<const Triangle> triangles, std::uint32_t directions, std::uint32_t size,
                  Traversal traversal);

  /// \param points      position, normal and face normal, 9 planes of `capacity`
  /// \param capacity    a multiple of KILN_VISIBILITY_SAMPLES; planes are 0 from `count` on
  /// \param sums        KILN_HEMISPHERE_VIEW_SUMS planes of `capacity`
  /// \param bent_sum    3 planes of bent_sum_plane, at least `capacity`; empty: not computed
  void add(const cl::Array<float>& points, std::uint32_t count, std::uint32_t capacity,
           const cl::Array<float>& sums, const cl::Array<float>& bent_sum,
           std::uint32_t bent_sum_plane);

  std::uint32_t directions() const { return static_cast<std::uint32_t>(views_.size()); }

 private:
  cl::Context& context_;
  std::uint32_t size_;
  bool uses_scalar_kernel_;
  float scale_ = 1;  // Factor that scales all occluders to within 0.5 of the origin
  std::optional<Rasterizer> rasterizer_;
  std::vector<kiln_view> views_;
  DepthKeys depth_keys_;
  cl::Array<float> view_depths_;
};

}  // namespace kiln

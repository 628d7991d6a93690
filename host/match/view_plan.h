// Chooses views and their size.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "accel/depth_views.h"
#include "mesh/triangle_blocks.h"
#include "source/high_poly.h"
#include "texel/texels.h"

namespace kiln {

/// Side in pixels at which most of the surface consists of triangles of at least
/// kPixelsPerTriangle pixels, seen face-on; a multiple of 256 from 1024 on, or `limit` if that is less.
struct ViewSize {
  std::uint32_t size = 0;
  double undersampled = 0;  ///< Share of the surface whose triangles are smaller than a pixel
};
ViewSize choose_view_size(const TriangleBlocks& mesh, double radius, std::uint32_t limit);
double undersampled_share(const TriangleBlocks& mesh, double radius, std::uint32_t size);

/// The area that views must show: everything within reach of the low poly, so that a floor or a stray
/// face far away does not consume pixels; the whole high poly if that is not much larger. The high poly
/// is limited to the drawable range: 60,000 pixels.
/// \param reach  frame units  \param dense_radius  radius of the high poly around the frame's origin
ViewArea view_area(const LowSurface& surface, double reach, double dense_radius);
void widen_view_area(ViewArea& area, double dense_radius, std::uint32_t size);

/// The direction from which all faces of both meshes are front faces, if there is one: for example,
/// a single view shows all of a height field. At most 2% of the low poly's area may be steeper than 84 degrees.
std::optional<Vec3d> height_field_direction(const TriangleBlocks& mesh, const LowSurface& surface);

/// Directions of views, and the coverage after each of them.
struct ViewPlan {
  std::vector<Vec3d> directions;
  std::vector<double> coverage;  ///< Share of the probed samples seen after each view
};

/// Chooses views greedily from candidates spread over the sphere, by the samples that no earlier
/// view sees, or that the candidate sees at a smaller angle to their normals than all earlier
/// views. After Stuerzlinger 1999, "Imaging all visible surfaces", who covers surfaces by as few
/// views as possible. Stops when another view would gain less than `least_gain`, or at `limit`
/// views.
/// \param points  probed samples: 6 planes of `capacity`
ViewPlan plan_views(const Source::Impl& source, const cl::Array<float>& points, std::uint32_t count,
                    std::uint32_t capacity, const ViewQuery& query,
                    const std::vector<Vec3d>& given_views, double least_gain, std::uint32_t limit);

}  // namespace kiln

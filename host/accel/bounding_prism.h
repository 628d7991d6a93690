// A bounding prism: three sides, a bottom and a top around some triangles.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "mesh/vector.h"
#include "shared/bvh.h"

namespace kiln::bvh {

/// Corners of triangles, three per triangle.
struct Corners {
  std::vector<float> x, y, z;
  void add(float px, float py, float pz) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(pz);
  }
  Vec3d at(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

struct Prism {
  std::array<Vec3d, 6> corners{};  ///< The 3 corners of the bottom, then the 3 corners of the top
  std::array<Vec3d, 5> normals{};  ///< Outward unit normals: sides, bottom, top
  std::array<double, 5> ends{};    ///< Largest extent of the corners along each normal
  double slack = 0, tilt = 0;      ///< Slack and tilt as in kiln_bvh_prism
  double height() const { return ends[3] + ends[4]; }
  double half_area = std::numeric_limits<double>::infinity();  ///< Infinite if there is no prism
};

/// Fits a small prism around all corners, enlarged by KILN_BVH_PRISM_MARGIN: the best of three directions of
/// the axis and 16 directions of sides. `half_area` is infinite if the prism would extend beyond 2 frame
/// units.
Prism fit_prism(const Corners& corners);

kiln_bvh_prism prism_of(const Prism& prism);

}  // namespace kiln::bvh

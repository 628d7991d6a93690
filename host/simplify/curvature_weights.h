// Weights of high-poly samples that grow with curvature, for fitting a low poly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/quadric.h"
#include "mesh/vector.h"

namespace kiln {

/// Weights of a high poly's triangles. They grow with the curvature, as in bent_planes().
class CurvatureWeights {
 public:
  CurvatureWeights(std::span<const Vec3> positions, std::span<const Triangle> triangles)
      : positions_(positions), vertex_normals_(positions.size()) {
    for (const Triangle& t : triangles) {
      const Vec3d normal = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
      for (const std::uint32_t v : t) vertex_normals_[v] += normal;
    }
    for (Vec3d& normal : vertex_normals_) {
      if (const double size = length(normal); size > 0) normal = normal * (1 / size);
    }
  }
  /// Weight per unit of a triangle's area: 1 where the surface is flat. The triangle's curvature is the mean over its
  /// sides.
  double weight_of(const Triangle& t) const {
    double bent = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const Vec3d side = at(b) - at(a);
      const double turn = dot(vertex_normals_[b] - vertex_normals_[a], side),
                   square = dot(side, side);
      if (square > 0) bent += (turn > 0 ? turn : -kConcaveWeight * turn) / square;
    }
    return 1 + kSampleCurvatureWeight * bent / 3;
  }

 private:
  /// Increase of the weight per unit of curvature. Curvature counts more in fitting than in collapsing, since outlines
  /// depend on it.
  static constexpr double kSampleCurvatureWeight = 1;

  Vec3d at(std::uint32_t vertex) const { return to_double(positions_[vertex]); }

  std::span<const Vec3> positions_;
  std::vector<Vec3d> vertex_normals_;  ///< Unit normals at the vertices
};

}  // namespace kiln

// UV mapping of a triangle of the high poly.
#pragma once

#include <array>

#include "mesh/kernels_shared.h"
#include "mesh/uv_grid.h"
#include "mesh/vector.h"
#include "source/high_poly.h"

namespace kiln {

/// Affine mapping from points of a triangle to UVs. It is kept while consecutive samples lie on the
/// same triangle.
struct UvFacet {
  std::uint32_t triangle = KILN_NO_TRIANGLE;
  bool has_uv = false;                   ///< True if all three corners have UVs
  Vec3d normal{};                        ///< Unit normal; zero for a triangle without area
  std::array<double, 2> at, to_b, to_c;  ///< UV of corner 0, and differences to corners 1 and 2
  std::array<Vec3d, 2>
      /// Gradients of u and v on the triangle, per frame unit; 0 for a triangle without area
      gradient{};
  std::array<Vec3d, 2> weight_gradient{};  ///< Gradients of the weights of corners 1 and 2

  /// Computes the mapping of a triangle, unless it is the current one.
  void move_to(const Source::Impl& source, std::uint32_t next) {
    if (next == triangle) return;
    *this = {};
    triangle = next;
    const Triangle& corners = source.triangles[next];
    const Vec3d corner = to_double(source.positions[corners[0]]);
    const Vec3d p = to_double(source.positions[corners[1]]) - corner;
    const Vec3d q = to_double(source.positions[corners[2]]) - corner;
    const Vec3d across = cross(p, q);
    if (const double size = length(across); size > 0) normal = across * (1 / size);
    // Solves the normal equations for the gradients of the corners' weights, from which those of u
    // and v follow.
    const double pp = dot(p, p), pq = dot(p, q), qq = dot(q, q), area = pp * qq - pq * pq;
    if (area > 0) {
      weight_gradient = {(p * qq - q * pq) * (1 / area), (q * pp - p * pq) * (1 / area)};
    }
    if (source.uv_triangles.empty()) return;
    const Triangle& uvs = source.uv_triangles[next];
    const Vec2 &a = source.uvs[uvs[0]], &b = source.uvs[uvs[1]], &c = source.uvs[uvs[2]];
    has_uv = is_finite(a) && is_finite(b) && is_finite(c);
    if (!has_uv) return;
    at = {a.x, a.y};
    to_b = {double{b.x} - a.x, double{b.y} - a.y};
    to_c = {double{c.x} - a.x, double{c.y} - a.y};
    if (!(area > 0)) return;
    for (std::size_t k = 0; k < 2; ++k) {
      gradient[k] = weight_gradient[0] * to_b[k] + weight_gradient[1] * to_c[k];
    }
  }
};

}  // namespace kiln

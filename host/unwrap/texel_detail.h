// Detail that a normal map cannot resolve: the error of the map's normals as a function of the texel size.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/frame.h"
#include "mesh/normals.h"
#include "mesh/surface_distance.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Sides of texels for which errors are computed, as multiples of the side at uniform density.
inline constexpr std::array<double, 3> kTexelSides = {2, 1, 0.5};

/// Error of a map's normals at each of kTexelSides: the length of the difference of two unit vectors.
using TexelErrors = std::array<double, kTexelSides.size()>;

/// A mesh's triangles in the UV layout, at the scale of the surface. Triangles without area are points.
struct FlatTriangles {
  std::vector<std::array<Vec2d, 3>> corners;
  /// For each side, the half-edge of the triangle across it; kNoIndex if there is none
  std::vector<std::array<std::uint32_t, 3>> neighbours;
};

/// The high poly's normals, prepared for lookups from low polys. Immutable. Cost: n log n to build; about 1
/// microsecond per lookup, 13 lookups per sample.
class TexelDetail {
 public:
  /// \throws Error(input) if no triangle has an extent
  explicit TexelDetail(const Mesh& high);

  /// Error of each triangle at several texel sizes. At a few samples on the triangle, the high poly's normal at the
  /// nearest point is compared with the mean of its normals at the corners of a texel-sized square. Corners outside of
  /// the chart are skipped. Normals are compared in the low poly's tangent frame, as tangent-space maps store them:
  /// where the low poly's normals vary, such a map varies even over a flat surface. The error is 0 where no surface of
  /// the high poly faces the same way as the triangle.
  /// \param flat     layout of the mesh's triangles
  /// \param size     side of the map in texels
  /// \param threads  number of threads; 0 for thread_count(); never changes the result
  std::vector<TexelErrors> errors(const Mesh& low, const FlatTriangles& flat, std::uint32_t size,
                                  int threads = 0) const;

 private:
  class LowPolySampler;
  bool normal_at(const Vec3d& point, const Vec3d& facing, Vec3d& normal) const;

  Frame frame_;
  std::vector<Vec3> positions_;
  std::vector<std::uint32_t>
      finite_triangles_;             ///< Indices of the mesh's triangles with finite corners
  std::vector<Triangle> triangles_;  ///< Triangles listed in finite_triangles_
  CornerNormals normals_;
  SurfaceDistance surface_;
};

}  // namespace kiln

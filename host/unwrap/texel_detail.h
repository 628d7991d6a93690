// Detail that a normal map cannot hold: the error per texel, by texel size.
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

/// Sides of texels that are looked at, times that of texels spread evenly.
inline constexpr std::array<double, 3> kTexelSides = {2, 1, 0.5};

/// Error of a map's normals, as the length of the difference of unit vectors, at each of kTexelSides.
using TexelErrors = std::array<double, kTexelSides.size()>;

/// A mesh's triangles laid flat at the surface's scale; those without area at one point.
struct FlatTriangles {
  std::vector<std::array<Vec2d, 3>> corners;
  std::vector<std::array<std::uint32_t, 3>>
      beside;  ///< Over the side from corner k on; kNoIndex: none
};

/// The high poly's normals, ready to be looked up from low polys. Immutable.
/// Cost: n log n to build; about 1 microsecond a look-up, 13 look-ups a place.
class TexelDetail {
 public:
  /// \throws Error(input) where no triangle has an extent
  explicit TexelDetail(const Mesh& high);

  /// Error of each triangle for several texel sizes. At a few places on it, the high poly's normal at
  /// the nearest point is held against a mean: of those at the corners of a square as large as a texel. The corners
  /// lie on the same chart, or do not count. Normals are seen in the frame of the low poly, as maps in tangent
  /// space keep them: where its normals turn, such a map turns too, even over a flat. Where nothing of the high
  /// poly faces as the triangle does, 0.
  /// \param flat     where the mesh's triangles lie
  /// \param size     texels a side of the map
  /// \param threads  0: thread_count(); never changes the result
  std::vector<TexelErrors> errors(const Mesh& low, const FlatTriangles& flat, std::uint32_t size,
                                  int threads = 0) const;

 private:
  class Walk;
  bool normal_at(const Vec3d& point, const Vec3d& facing, Vec3d& normal) const;

  Frame frame_;
  std::vector<Vec3> positions_;
  std::vector<std::uint32_t> source_;  ///< Indices in the mesh of triangles with finite corners.
  std::vector<Triangle> triangles_;    ///< These.
  CornerNormals normals_;
  SurfaceDistance surface_;
};

}  // namespace kiln

// Checks whether coordinates are precise enough for the edges of a mesh.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "mesh/frame.h"
#include "mesh/vector.h"

namespace kiln {

/// Quantization step of a vertex's coordinates in world units, and the axis on which it is the largest. A step of 0
/// means double precision.
struct Step {
  double size = 0;
  std::size_t axis = 0;
};

/// Finds axes on which all double-precision coordinates are multiples of single-precision steps. This shows that the
/// coordinates were stored in single precision before. Axes on a coarser grid, such as whole metres, do not count,
/// since rounding has not changed their coordinates.
class FloatGrid {
 public:
  FloatGrid(std::span<const Triangle> triangles,
            const std::function<Vec3d(std::uint32_t vertex)>& position);
  /// Spacing of the stored coordinates at a point, for the axis on which it is largest.
  Step step(const Vec3d& p) const;

 private:
  std::array<bool, 3> on_grid_{};
};

/// Functions that read a mesh whose coordinates are quantized.
struct SteppedMesh {
  std::span<const Triangle> triangles;
  /// Returns true if the triangle is finite and has an area
  std::function<bool(std::size_t triangle)> is_usable;
  /// Returns the most precise known position of a vertex
  std::function<Vec3d(std::uint32_t vertex)> position;
  std::function<Step(std::uint32_t vertex)> step;
};

/// If a quarter of the edges are shorter than 256 steps (at which normals have errors of 0.1 degrees), describes the
/// problem with a remedy: "coordinates near 500000 are kept in steps of 0.031, and its edges are 0.05 long (median):
/// normals are off by 20 degrees". Names vertices that lie far from all others.
/// \param how  "stored" or "rounded"
/// \returns the empty string if steps are fine enough
std::string coarse_steps(const SteppedMesh& mesh, const char* how);

/// Describes vertices that are more than 100,000 times as far from the centre as three quarters of the others. With
/// such vertices, single precision has no digits left for the others, and lengths in % become meaningless. Only
/// vertices of usable triangles count.
/// \returns the empty string if there are none
std::string describe_stretched_box(const SteppedMesh& mesh);

/// Bounding box without the vertices that describe_stretched_box() reports. It is `all` if there are none, or if one is
/// more than 2^40 times as far out, since its square overflows single precision.
Bounds bulk_bounds(const Mesh& mesh, const Bounds& all);

/// True if a mesh may have outliers, so that bulk_bounds() may differ from `all`. False if it certainly has none.
/// \param sample  at least kSampledTriangles of the mesh's triangles, evenly spaced, or all of them
/// \param all  bounds of the whole mesh
bool may_have_outliers(const Mesh& sample, const Bounds& all);
/// Number of triangles in a sample that shows where most of a mesh lies.
inline constexpr std::size_t kSampledTriangles = 4096;

/// Describes steps that are too coarse, first those of the mesh's own floats, then those of rounding to the working
/// frame. If both are fine enough, returns the result of describe_stretched_box(); empty if nothing is wrong.
std::string coarse_steps(const Mesh& mesh, const Frame& frame);

}  // namespace kiln

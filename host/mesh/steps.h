// True if coordinates are fine enough for a mesh's own edges.
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

/// The coarsest step that a vertex' coordinates are kept in, world units, and whose axis it is. 0: they are as fine as
/// double precision.
struct Step {
  double size = 0;
  std::size_t axis = 0;
};

/// Which axes hold multiples of single precision's steps alone, although they came in double: they were stored in
/// single precision once. An axis on a coarser grid, such as whole metres, uses no such step, and lost nothing.
class FloatGrid {
 public:
  FloatGrid(std::span<const Triangle> triangles,
            const std::function<Vec3d(std::uint32_t vertex)>& position);
  /// The coarsest of a place's three.
  Step step(const Vec3d& p) const;

 private:
  std::array<bool, 3> on_grid_{};
};

/// A mesh, and how coarsely its coordinates are kept.
struct SteppedMesh {
  std::span<const Triangle> triangles;
  std::function<bool(std::size_t triangle)> counts;     ///< Finite and with an area
  std::function<Vec3d(std::uint32_t vertex)> position;  ///< As far as it is known
  std::function<Step(std::uint32_t vertex)> step;
};

/// Says if a quarter of the edges are shorter than 256 steps (normals are off by 0.1 degrees there): "coordinates near
/// 500000 are kept in steps of 0.031, and its edges are 0.05 long (median): normals are off by 20 degrees", and what
/// to do. It names vertices that lie far from all others.
/// \param how  "stored" or "rounded"
/// \returns the empty string where they are finer
std::string coarse_steps(const SteppedMesh& mesh, const char* how);

/// Says if some vertices lie over 100,000 times as far out as three quarters of the others, and which: single precision
/// has no digits left for the others, and lengths in % are theirs no more. Of triangles that count; no steps are needed.
/// \returns the empty string where none does
std::string stretched_box(const SteppedMesh& mesh);

/// Box, as Bounds::of() has it, of the vertices that stretched_box() names none of; `all` where it names none, or where
/// one lies farther than 2^40 times as far out, which squares in single precision do not bear.
Bounds bulk_bounds(const Mesh& mesh, const Bounds& all);

/// coarse_steps() of a mesh's own floats, and of what the working frame rounds them to; or else stretched_box().
std::string coarse_steps(const Mesh& mesh, const Frame& frame);

}  // namespace kiln

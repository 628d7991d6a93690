// Views of a mesh from all directions, rasterized on the host.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Pixel counts of a group of triangles, summed over all views.
struct SeenPixels {
  std::uint32_t drawn = 0;  ///< Pixels that the group covers, visible or not
  std::uint32_t front = 0;  ///< Pixels that show a front face of the group
  std::uint32_t back = 0;   ///< Pixels that show a back face of the group
};

/// Directions and size of the views.
struct OutsideViews {
  std::uint32_t count = 32;    ///< Number of directions, evenly distributed over the sphere
  std::uint32_t step = 1;      ///< Only every `step`-th of these directions is drawn
  std::uint32_t first = 0;     ///< Index of the first direction that is drawn
  std::uint32_t pixels = 512;  ///< Side of a picture in pixels
  bool backs = true;  ///< True: back faces are drawn and occlude; false: they are transparent
};

/// Draws orthographic views of a mesh, and counts the visible pixels of each group of triangles. If a back face and a
/// front face coincide, the front face is visible. Pixels are sampled at their centres. The time is linear in the
/// number of triangles, because pictures are smaller if triangles would cover them more than 32 times.
/// \param group   group of each triangle
/// \param groups  number of groups
/// \param counted   0 for each group that only occludes others and is not counted; if empty, all groups are counted
std::vector<SeenPixels> count_seen_pixels(const Mesh& mesh, std::span<const std::uint32_t> group,
                                          std::size_t groups, const OutsideViews& views,
                                          std::span<const std::uint8_t> counted = {});

}  // namespace kiln

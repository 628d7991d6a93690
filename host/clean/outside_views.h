// Views of a mesh from all around: pictures of triangles, drawn on the host.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Pixels of a group of triangles, of all views together.
struct SeenPixels {
  std::uint32_t drawn = 0;  ///< Pixels that it covers, seen or not
  std::uint32_t front = 0;  ///< Pixels that show a front of it
  std::uint32_t back = 0;   ///< Pixels that show a back of it
};

/// Settings of the views.
struct OutsideViews {
  std::uint32_t count = 32;    ///< Directions, spread evenly
  std::uint32_t step = 1;      ///< Every so many of these are looked along
  std::uint32_t first = 0;     ///< ... from this one on
  std::uint32_t pixels = 512;  ///< A side of a picture
  bool backs = true;           ///< Backs are drawn, too; else one looks through them
};

/// Draws orthographic views of a mesh, and counts what they show. Where a back and a front lie in one place, the front
/// is seen. Pixels are points at their centres. Time is bounded by the number of triangles: pictures that these cover
/// over 32 times are smaller.
/// \param group   of a triangle
/// \param groups  how many
/// \param asked   of a group, whether it is asked for: others only hide it, and have no counts. Empty: all are
std::vector<SeenPixels> look_from_outside(const Mesh& mesh, std::span<const std::uint32_t> group,
                                          std::size_t groups, const OutsideViews& views,
                                          std::span<const std::uint8_t> asked = {});

}  // namespace kiln

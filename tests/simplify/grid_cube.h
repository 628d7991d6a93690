// A cube of squares cut into triangles, welded.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/weld.h"
#include "support/shapes.h"

namespace kiln::test {

/// From -0.25 to 0.25; 12 * n * n triangles.
inline Mesh grid_cube(std::uint32_t n) {
  Mesh cube;
  for (int face = 0; face < 6; ++face) {
    const Mesh side = plane(n, n, 0.5, 0.5);
    const auto first = static_cast<std::uint32_t>(cube.positions.size());
    const float sign = face < 3 ? 1.0F : -1.0F;
    for (const Vec3& p : side.positions) {
      const Vec3 up{p.x, p.y, 0.25F};
      const Vec3 turned = face % 3 == 0   ? up
                          : face % 3 == 1 ? Vec3{up.y, up.z, up.x}
                                          : Vec3{up.z, up.x, up.y};
      cube.positions.push_back({sign * turned.x, sign * turned.y, sign * turned.z});
    }
    for (Triangle t : side.triangles) {
      if (sign < 0) std::swap(t[1], t[2]);
      cube.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  const std::vector<std::uint32_t> welded = weld_vertices(cube.positions);
  for (Triangle& t : cube.triangles) t = {welded[t[0]], welded[t[1]], welded[t[2]]};
  return cube;
}

}  // namespace kiln::test

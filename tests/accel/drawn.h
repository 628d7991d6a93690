// Triangles to draw, in their frame.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/frame.h"

namespace kiln::test {

struct Drawn {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
};

inline Drawn in_frame(const Mesh& mesh) { return {Frame::of(mesh).to_frame(mesh), mesh.triangles}; }

inline Drawn shuffled(Drawn drawn) {
  std::shuffle(drawn.triangles.begin(), drawn.triangles.end(), std::mt19937(7));
  return drawn;
}

}  // namespace kiln::test

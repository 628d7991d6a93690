// The least mesh of two charts.
#pragma once

#include "kiln/mesh.h"

namespace kiln::test {

/// Two unit quads, the second facing down and elsewhere, with UVs edge to edge.
inline Mesh two_quads() {
  Mesh mesh;
  mesh.name = "quads";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                    {5, 0, 0}, {5, 1, 0}, {6, 1, 0}, {6, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  mesh.uvs = {{0, 0}, {0.5F, 0}, {0.5F, 1}, {0, 1}, {1, 0}, {1, 1}};
  mesh.uv_triangles = {{0, 1, 2}, {0, 2, 3}, {1, 2, 5}, {1, 5, 4}};
  return mesh;
}

}  // namespace kiln::test

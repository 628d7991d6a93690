// Surfaces whose maps are laid out texel by texel, for tests of visibility.
#pragma once

#include <cstdint>
#include <functional>
#include <numbers>
#include <utility>

#include "kiln/mesh.h"

namespace kiln::test {

inline constexpr double kDegree = std::numbers::pi / 180;
using Cell = std::pair<int, int>;

/// A grid of quads, each with UVs of its own: `place` says where the texels of a quad's corners (i, j) of
/// {0, 1}^2 lie on a map of the given size.
inline Mesh grid(int columns, int rows, const std::function<Vec3(int, int)>& position,
                 const std::function<Vec2(int, int, int, int)>& place, float width, float height) {
  Mesh mesh;
  mesh.name = "grid";
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) mesh.positions.push_back(position(c, r));
  }
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const auto vertex = [&](int i, int j) {
        return static_cast<std::uint32_t>((r + j) * (columns + 1) + c + i);
      };
      const auto first = static_cast<std::uint32_t>(mesh.uvs.size());
      for (const auto& [i, j] : {Cell{0, 0}, Cell{1, 0}, Cell{1, 1}, Cell{0, 1}}) {
        const Vec2 texel = place(c, r, i, j);
        mesh.uvs.push_back({texel.x / width, 1 - texel.y / height});
      }
      mesh.triangles.push_back({vertex(0, 0), vertex(1, 0), vertex(1, 1)});
      mesh.triangles.push_back({vertex(0, 0), vertex(1, 1), vertex(0, 1)});
      mesh.uv_triangles.push_back({first, first + 1, first + 2});
      mesh.uv_triangles.push_back({first, first + 2, first + 3});
    }
  }
  return mesh;
}

inline constexpr int kCell = 32;

/// Strips of unit squares folded to and fro, row upon row: lengths stay, so texels can.
inline Vec3 folded(int column, int row) {
  const auto c = static_cast<float>(column);
  return {0.75F * c, static_cast<float>(row), column % 2 == 0 ? 0.0F : 0.66143783F};
}

inline Vec2 whole_map(int c, int r, int i, int j) {
  return {static_cast<float>(8 + kCell * (c + i)), static_cast<float>(8 + kCell * (r + j))};
}

}  // namespace kiln::test

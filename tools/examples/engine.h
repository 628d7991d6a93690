// Stands for your engine and its vertex format.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <vector>

struct Vertex {
  std::array<float, 3> position, normal;
  std::array<float, 2> uv;
};

struct VertexBuffer {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// A sheet of cells x cells over the unit square that faces +Z; waves run along x, so that its normals lean
/// to -X and +X.
inline VertexBuffer sheet(std::uint32_t cells, float wave, float phase = 0) {
  constexpr float kTurns = 4 * 6.2831853F;
  VertexBuffer sheet;
  for (std::uint32_t y = 0; y <= cells; ++y) {
    for (std::uint32_t x = 0; x <= cells; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(cells);
      const float v = static_cast<float>(y) / static_cast<float>(cells);
      const float slope = wave * kTurns * std::cos(kTurns * u + phase);
      const float size = std::sqrt(1 + slope * slope);
      sheet.vertices.push_back(
          {{u, v, wave * std::sin(kTurns * u + phase)}, {-slope / size, 0, 1 / size}, {u, v}});
      if (x == cells || y == cells) continue;
      const std::uint32_t at = y * (cells + 1) + x, above = at + cells + 1;
      for (const std::uint32_t i : {at, at + 1, above + 1, at, above + 1, above}) {
        sheet.indices.push_back(i);
      }
    }
  }
  return sheet;
}

/// Uploads a texture of 16-bit RGBA; here, it prints its size.
inline void upload(std::span<const std::uint16_t> texels, std::size_t width) {
  std::size_t opaque = 0;
  for (std::size_t i = 3; i < texels.size(); i += 4) opaque += texels[i] == 65535 ? 1 : 0;
  const std::size_t middle = 4 * (texels.size() / 8 + width / 2);
  std::printf("%zu texels, %zu opaque, in the middle %u %u %u\n", texels.size() / 4, opaque,
              unsigned{texels[middle]}, unsigned{texels[middle + 1]}, unsigned{texels[middle + 2]});
}

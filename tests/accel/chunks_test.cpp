// Chunks of triangles to draw: each triangle once, in boxes and cones that hold it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "accel/drawn.h"
#include "accel/raster_chunks.h"
#include "kiln/mesh.h"
#include "mesh/vector.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

/// Checks chunks: each triangle once, with its own vertices, within the box and the cone.
void expect_sound_chunks(const Drawn& drawn) {
  std::vector<int> times(drawn.triangles.size());
  for (const RasterChunks& piece : make_raster_chunks(drawn.positions, drawn.triangles)) {
    ASSERT_EQ(piece.chunks.size(), piece.bounds.size() * KILN_RASTER_BOXES);
    for (std::size_t c = 0; c < piece.chunks.size(); ++c) {
      const kiln_raster_chunk& chunk = piece.chunks[c];
      const kiln_raster_bounds& bounds = piece.bounds[c / KILN_RASTER_BOXES];
      const std::size_t lane = c % KILN_RASTER_BOXES;
      for (std::size_t t = 0; t < KILN_RASTER_CHUNK; ++t) {
        if (chunk.corner[0][t] == chunk.corner[1][t]) continue;  // fills up, or is degenerate
        const Triangle& triangle = drawn.triangles[chunk.triangle[t]];
        ++times[chunk.triangle[t]];
        std::array<kiln::Vec3d, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t v = chunk.corner[k][t];
          const Vec3& expected = drawn.positions[triangle[k]];
          const std::array<float, 3> components = {expected.x, expected.y, expected.z};
          for (std::size_t axis = 0; axis < 3; ++axis) {
            ASSERT_EQ(chunk.position[axis][v], components[axis]);
            ASSERT_LE(std::abs(double{components[axis]} - double{bounds.centre[axis][lane]}),
                      double{bounds.half_extent[axis][lane]});
          }
          p[k] = kiln::to_double(expected);
        }
        if (bounds.cosine[lane] < 0) continue;
        const kiln::Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
        const double along = normal.x * double{bounds.axis[0][lane]} +
                             normal.y * double{bounds.axis[1][lane]} +
                             normal.z * double{bounds.axis[2][lane]};
        ASSERT_GE(along, double{bounds.cosine[lane]} * length(normal));
        const double longest =
            std::max({length(p[1] - p[0]), length(p[2] - p[0]), length(p[2] - p[1])});
        ASSERT_GE(length(normal) / longest, double{bounds.height[lane]});
        ASSERT_GT(bounds.height[lane], 0);
      }
    }
  }
  for (std::size_t t = 0; t < times.size(); ++t) {
    const Triangle& triangle = drawn.triangles[t];
    bool whole = triangle[0] != triangle[1];
    for (const std::uint32_t v : triangle) whole = whole && is_finite(drawn.positions[v]);
    ASSERT_EQ(times[t], whole ? 1 : 0) << t;
  }
}

TEST(Tiles, ChunksHoldEveryTriangleOnce) {
  expect_sound_chunks(in_frame(icosphere(5)));  // more than one piece
  expect_sound_chunks(shuffled(in_frame(icosphere(5))));
  expect_sound_chunks(in_frame(random_soup(1000, 4, 0.2)));
  expect_sound_chunks(in_frame(plane(33, 1)));
  expect_sound_chunks({});
  Drawn odd = in_frame(random_soup(40, 5, 0.5));
  odd.positions[7].y = std::nanf("");
  odd.positions[10].x = std::numeric_limits<float>::infinity();
  odd.triangles.push_back({3, 3, 4});
  odd.triangles.push_back({3, 4, 3});
  odd.triangles.push_back({0, 1, 2});
  expect_sound_chunks(odd);
}

TEST(Tiles, OrderOfTrianglesIsFoundAgain) {
  // A mesh in no order is cut into chunks that are about as close as those of the mesh in order.
  const auto looseness = [](const Drawn& drawn) {
    double area = 0;
    double diagonals = 0;
    for (const RasterChunks& piece : make_raster_chunks(drawn.positions, drawn.triangles)) {
      area += piece.area;
      diagonals += piece.diagonals;
    }
    return diagonals / area;
  };
  const Drawn sphere = in_frame(icosphere(6));
  EXPECT_LT(looseness(sphere), 32);
  EXPECT_LT(looseness(shuffled(sphere)), 20);
}

}  // namespace
}  // namespace kiln::test

// Samples of texels in their places on the map, for tests of the texel kernels.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "reference/texel.h"
#include "support/environment.h"
#include "texel/texels.h"

namespace kiln::test {

inline constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

/// Positions that have nothing to do with the UVs, so that interpolation is seen to use weights.
inline LowSurface surface_of(const std::vector<ReferenceTriangle>& triangles) {
  LowSurface surface;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(-0.5F, 0.5F);
  for (const ReferenceTriangle& triangle : triangles) {
    std::array<LowSurface::Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k].position = {unit(random), unit(random), unit(random)};
      corners[k].direction = {unit(random), unit(random), 1 + unit(random)};
      corners[k].uv = {triangle[k].u, triangle[k].v};
    }
    if (std::ranges::all_of(corners, [](const LowSurface::Corner& corner) {
          return std::isfinite(corner.uv.x) && std::isfinite(corner.uv.y);
        })) {
      surface.with_uvs.push_back(static_cast<std::uint32_t>(surface.triangles.size()));
    }
    surface.triangles.push_back(corners);
    surface.usable.push_back(1);
  }
  return surface;
}

/// A band's samples put back in their places on the map.
struct Map {
  explicit Map(const TexelOptions& o)
      : options(o),
        columns(std::size_t{o.width} * o.samples),
        rows(std::size_t{o.height} * o.samples),
        triangle(columns * rows, kNothing),
        barycentric(columns * rows),
        point(columns * rows) {}
  TexelOptions options;
  std::size_t columns, rows;
  std::vector<std::uint32_t> triangle;
  std::vector<std::array<float, 2>> barycentric;
  std::vector<std::array<float, 7>> point;
  TexelReport report;
};

inline void put_band(const TexelBand& band, Map& map) {
  cl::Context& context = context_of(*device());
  const std::vector<std::uint32_t> index = band.texel_index.download(context);
  const std::vector<std::uint32_t> first = band.texel_first.download(context);
  const std::vector<std::uint32_t> slot = band.sample_slot.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<float> barycentric = band.barycentric.download(context);
  const std::vector<float> points = band.points.download(context);
  ASSERT_LE(band.sample_count, band.capacity);
  ASSERT_GE(first.size(), band.texel_count + std::size_t{1});
  EXPECT_EQ(first[band.texel_count], band.sample_count);
  if (band.texel_count != 0) {
    EXPECT_EQ(first[0], 0U);
  }
  const std::uint32_t n = map.options.samples;
  for (std::size_t t = 0; t < band.texel_count; ++t) {
    ASSERT_LT(first[t], first[t + 1]) << "a texel without samples";
    ASSERT_LE(first[t + 1] - first[t], n * n);
    const std::size_t row = band.first_row + index[t] / map.options.width;
    const std::size_t column = index[t] % map.options.width;
    ASSERT_LT(row, std::size_t{band.first_row} + band.row_count);
    for (std::size_t s = first[t]; s < first[t + 1]; ++s) {
      ASSERT_LT(slot[s], n * n);
      if (s > first[t]) {
        ASSERT_GT(slot[s], slot[s - 1]) << "slots in a texel must ascend";
      }
      const std::size_t place = (row * n + slot[s] / n) * map.columns + column * n + slot[s] % n;
      ASSERT_EQ(map.triangle[place], kNothing) << "a sample was written twice";
      map.triangle[place] = triangle[s];
      for (std::size_t k = 0; k < 2; ++k) {
        map.barycentric[place][k] = barycentric[k * band.capacity + s];
      }
      for (std::size_t k = 0; k < 7; ++k) map.point[place][k] = points[k * band.capacity + s];
    }
  }
}

inline Map sample_all(const LowSurface& surface, const TexelOptions& options) {
  TexelSampler sampler(context_of(*device()), surface, options);
  Map map(options);
  std::uint32_t next_row = 0;
  TexelBand band;
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    band = sampler.sample(b, std::move(band));
    EXPECT_EQ(band.first_row, next_row);
    next_row += band.row_count;
    put_band(band, map);
  }
  EXPECT_EQ(next_row, options.height);
  map.report = sampler.report();
  return map;
}

inline std::uint64_t warned(const TexelReport& report, const std::string& code) {
  for (const Warning& warning : report.warnings) {
    if (warning.code == code) return warning.count;
  }
  return 0;
}

inline ReferenceTriangle random_triangle(std::mt19937& random, float spread) {
  std::uniform_real_distribution<float> anywhere(-0.1F, 1.1F);
  std::uniform_real_distribution<float> near(-spread, spread);
  const float u = anywhere(random);
  const float v = anywhere(random);
  const auto corner = [&] {
    return ReferenceUv{std::clamp(u + near(random), -1.0F, 2.0F),
                       std::clamp(v + near(random), -1.0F, 2.0F)};
  };
  return {corner(), corner(), corner()};
}

/// A grid of squares over the unit square with jittered inner points, two triangles each, some mirrored.
inline std::vector<ReferenceTriangle> tiling(std::uint32_t side, std::mt19937& random) {
  std::uniform_real_distribution<float> jitter(-0.24F, 0.24F);
  std::vector<ReferenceUv> points;
  const auto n = static_cast<float>(side);
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      const float dx = x == 0 || x == side ? 0 : jitter(random) / n;
      const float dy = y == 0 || y == side ? 0 : jitter(random) / n;
      points.push_back({static_cast<float>(x) / n + dx, static_cast<float>(y) / n + dy});
    }
  }
  std::vector<ReferenceTriangle> triangles;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::size_t a = std::size_t{y} * (side + 1) + x;
      const std::size_t corners[4] = {a, a + 1, a + side + 2, a + side + 1};
      // With jitter below a quarter of a cell both triangles keep their winding.
      triangles.push_back({points[corners[0]], points[corners[1]], points[corners[2]]});
      triangles.push_back({points[corners[0]], points[corners[2]], points[corners[3]]});
      if (random() % 2 == 0) std::swap(triangles.back()[0], triangles.back()[1]);
    }
  }
  return triangles;
}

}  // namespace kiln::test

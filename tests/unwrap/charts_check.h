// Checks of a layout by charts, whatever the mesh.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "kiln/unwrap.h"
#include "reference/layout.h"

namespace kiln::test {

/// UVs by charts are whole multiples of this share of the map.
inline constexpr std::int64_t kChartGrid = std::int64_t{1} << 24;

/// Unwraps by charts and holds the result against the exact oracle: nothing mirrored, no two triangles
/// overlapping, charts as far apart as the report says, nothing but the UVs changed.
inline LayoutFacts check_charts(const Mesh& mesh, UnwrapOptions options, UnwrapReport& report,
                                Mesh* result = nullptr) {
  options.method = UnwrapMethod::charts;
  const Mesh out = unwrap(mesh, options, &report);
  // Bits, since a position need not be a number.
  EXPECT_TRUE(std::ranges::equal(out.positions, mesh.positions, [](const Vec3& a, const Vec3& b) {
    using Bits = std::array<std::uint32_t, 3>;
    return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
  }));
  EXPECT_EQ(out.triangles, mesh.triangles);
  const auto border = static_cast<std::int64_t>(
      std::floor(report.border_texels * static_cast<double>(kChartGrid) / options.size));
  EXPECT_GE(border, 1);
  LayoutFacts facts = check_layout(out, kChartGrid, border, options.size);
  EXPECT_EQ(facts.first_fault, "");
  EXPECT_EQ(facts.charts, report.charts);
  EXPECT_NEAR(facts.coverage, report.coverage, 1e-9);
  EXPECT_NEAR(facts.density_spread, report.density_spread, 1e-4);
  if (result != nullptr) *result = out;
  return facts;
}

}  // namespace kiln::test

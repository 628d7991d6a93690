// simplify() with UVs that lack something, or that leave charts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "kiln/simplify.h"
#include "support/shapes.h"

namespace kiln {
namespace {

double doubled(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
}

const Warning* find(const SimplifyReport& report, const std::string& code) {
  const auto found = std::find_if(report.warnings.begin(), report.warnings.end(),
                                  [&](const Warning& warning) { return warning.code == code; });
  return found == report.warnings.end() ? nullptr : &*found;
}

TEST(KeepUvs, SingleUvsThatAreNotFiniteAreTheMeanOfThoseBeside) {
  Mesh high = test::plane(30, 30);
  const std::uint32_t bad = high.uv_triangles[high.triangles.size() / 2 + 15][0];
  const Vec2 was = high.uvs[bad];
  high.uvs[bad].x = std::numeric_limits<float>::quiet_NaN();
  for (const std::uint32_t faces : {300U, 5000U}) {
    SimplifyReport report;
    const Mesh low = simplify(high, {.faces = faces, .keep_uvs = true}, &report);
    for (const Vec2& uv : low.uvs) EXPECT_TRUE(std::isfinite(uv.x) && std::isfinite(uv.y));
    const Warning* warning = find(report, "non-finite-uvs");
    ASSERT_NE(warning, nullptr);
    EXPECT_EQ(warning->count, 6U);
    if (faces == 5000) {
      EXPECT_TRUE(std::any_of(low.uvs.begin(), low.uvs.end(), [&](const Vec2& uv) {
        return std::hypot(uv.x - was.x, uv.y - was.y) < 1e-6;
      }));
    }
    EXPECT_EQ(find(report, "uv-outside"), nullptr);
  }
}

TEST(KeepUvs, CornersWithoutUvsTakeThoseThatTheirChartHasThere) {
  const Mesh right = test::plane(30, 30);
  Mesh high = right;
  const auto nowhere = static_cast<std::uint32_t>(high.uvs.size());
  high.uvs.push_back({std::numeric_limits<float>::quiet_NaN(), 0});  // As readers give to all.
  for (std::size_t t = 5; t < high.uv_triangles.size(); t += 9)
    high.uv_triangles[t][t % 3] = nowhere;
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 5000, .keep_uvs = true}, &report);
  ASSERT_NE(find(report, "non-finite-uvs"), nullptr);
  EXPECT_EQ(find(report, "non-finite-uvs")->count, 200U);
  EXPECT_EQ(report.charts, 1U);
  double area = 0;
  for (const Triangle& c : low.uv_triangles) {
    const double part = doubled(low.uvs[c[0]], low.uvs[c[1]], low.uvs[c[2]]);
    EXPECT_GT(part, 0);
    area += part / 2;
  }
  SimplifyReport as_it_was;
  simplify(right, {.faces = 5000, .keep_uvs = true}, &as_it_was);
  EXPECT_NEAR(area, as_it_was.coverage, 1e-6);
  EXPECT_EQ(find(report, "uv-outside"), nullptr);
}

TEST(KeepUvs, WhatHasNoUvsIsNotOutOfTheUnitSquare) {
  Mesh high = test::plane(30, 30);
  const auto nowhere = static_cast<std::uint32_t>(high.uvs.size());
  high.uvs.push_back({std::numeric_limits<float>::quiet_NaN(), 0});
  for (std::size_t t = 0; t < 100; ++t) high.uv_triangles[t] = {nowhere, nowhere, nowhere};
  SimplifyReport report;
  simplify(high, {.faces = 600, .keep_uvs = true}, &report);
  EXPECT_EQ(find(report, "uv-outside"), nullptr);
  // One that is, beside them.
  for (std::uint32_t uv : high.uv_triangles.back()) high.uvs[uv].x += 3;
  simplify(high, {.faces = 5000, .keep_uvs = true}, &report);
  ASSERT_NE(find(report, "uv-outside"), nullptr);
  EXPECT_NE(find(report, "uv-outside")->message.text().find("as triangles of the high poly do"),
            std::string::npos);
}

TEST(KeepUvs, HowFarUvsLieOutsideOfChartsIsTold) {
  // A disc: fewer faces cut its outline short, or go beyond it.
  Mesh high = test::plane(60, 60);
  const auto outside = [&](const Triangle& v) {
    return std::any_of(v.begin(), v.end(), [&](std::uint32_t at) {
      return std::hypot(high.uvs[at].x - 0.5F, high.uvs[at].y - 0.5F) > 0.4F;
    });
  };
  ASSERT_EQ(high.triangles, high.uv_triangles);
  std::erase_if(high.triangles, outside);
  high.uv_triangles = high.triangles;
  high.normals.clear();
  high.normal_triangles.clear();
  SimplifyReport report;
  simplify(high, {.faces = 100000, .keep_uvs = true}, &report);
  EXPECT_LT(report.uv_strays, 1e-6);
  const Mesh low = simplify(high, {.faces = 12, .keep_uvs = true}, &report);
  double farthest = 0;  // By steps along all edges, from the centres of the high poly's cells
  for (const Triangle& c : low.uv_triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 &a = low.uvs[c[k]], &b = low.uvs[c[(k + 1) % 3]];
      for (const double at : {0.0, 0.5}) {
        farthest = std::max(farthest,
                            std::hypot(a.x + at * (b.x - a.x) - 0.5, a.y + at * (b.y - a.y) - 0.5));
      }
    }
  }
  // The outline is a staircase of cells inside the circle: it lies at least 0.4 less a cell's diagonal out.
  EXPECT_LE(report.uv_strays, std::max(0.0, farthest - (0.4 - std::sqrt(2.0) / 60)) + 1e-6);
  EXPECT_GE(report.uv_strays, std::max(0.0, farthest - 0.4) - 1e-6);
}

TEST(KeepUvs, TrianglesOutOfTheUnitSquareAreCounted) {
  // Beyond both sides along u, and beyond each side alone
  const Vec2 scales[] = {{4, 1}, {2, 1}, {2, 1}, {1, 2}, {1, 2}},
             offsets[] = {{-1, 0}, {0, 0}, {-1, 0}, {0, 0}, {0, -1}};
  for (std::size_t i = 0; i < std::size(scales); ++i) {
    Mesh high = test::plane(30, 30);
    for (Vec2& uv : high.uvs)
      uv = {scales[i].x * uv.x + offsets[i].x, scales[i].y * uv.y + offsets[i].y};
    SimplifyReport report;
    const Mesh low = simplify(high, {.faces = 5000, .keep_uvs = true}, &report);
    std::uint64_t outside = 0;
    for (const Triangle& t : low.uv_triangles) {
      outside += std::any_of(t.begin(), t.end(), [&](std::uint32_t v) {
        const Vec2& uv = low.uvs[v];
        return uv.x < 0 || uv.x > 1 || uv.y < 0 || uv.y > 1;
      });
    }
    const Warning* warning = find(report, "uv-outside");
    ASSERT_NE(warning, nullptr) << i;
    EXPECT_EQ(warning->count, outside);
    EXPECT_NE(warning->message.text().find(std::to_string(outside) + " of 1800"), std::string::npos)
        << warning->message.text();
  }
}

}  // namespace
}  // namespace kiln

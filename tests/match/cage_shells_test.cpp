// Shells of cages that are fitted to given heights, by closed forms.
#include "match/cage_shells.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "shared/bvh.h"

namespace kiln {
namespace {

constexpr float kFree = std::numeric_limits<float>::infinity();
constexpr double kMargin = 0.01;
constexpr double kTolerance = 4 * KILN_BVH_EPSILON + 1e-6;

/// Triangles in the plane z = 0, and points on them.
struct Fit {
  LowSurface surface;
  std::vector<std::uint32_t> vertex_of;
  CageNeeds needs;

  /// \param cosine  between the vertices' directions and the normal
  void add_triangle(const std::array<std::uint32_t, 3>& vertices, const std::array<Vec3, 3>& at,
                    double cosine = 1) {
    std::array<LowSurface::Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k].position = at[k];
      corners[k].direction = direction_of(cosine);
    }
    surface.triangles.push_back(corners);
    surface.usable.push_back(1);
    vertex_of.insert(vertex_of.end(), vertices.begin(), vertices.end());
  }
  static Vec3 direction_of(double cosine) {
    return to_float(Vec3d{std::sqrt(1 - cosine * cosine), 0, cosine});
  }
  void add_point(std::uint32_t triangle, float u, float v, float least, float most,
                 double cosine = 1) {
    needs.points.list.push_back({triangle, u, v});
    needs.counts.push_back(1);
    needs.found.push_back(1);
    needs.min_outward_height.push_back(least);
    needs.max_outward_height.push_back(most);
    needs.min_inward_depth.push_back(0);
    needs.max_inward_depth.push_back(kFree);
    needs.direction.push_back(direction_of(cosine));
  }
  void add_corner_points(std::uint32_t triangle, float least, float most, double cosine = 1) {
    add_point(triangle, 0, 0, least, most, cosine);
    add_point(triangle, 1, 0, least, most, cosine);
    add_point(triangle, 0, 1, least, most, cosine);
  }
  CageShells run(std::size_t vertices) const {
    return fit_shells(needs, surface, vertex_of, vertices, kMargin);
  }
};

constexpr std::array<Vec3, 3> kCorners = {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}};

/// A quarter above what is needed, or the margin, but no more than half of the free space; never into the last 5% of it.
TEST(CageShells, RiseByAQuarterOrTheMarginWithinHalfOfTheFreeSpace) {
  struct Case {
    float least, most;
    double expected;
  };
  for (const Case& of : {Case{0, kFree, kMargin}, Case{0.02F, kFree, 0.03},
                         Case{0.1F, kFree, 0.125}, Case{0.1F, 0.12F, 0.11}, Case{0.1F, 0.1F, 0.1},
                         Case{0.1F, 0.05F, 0.1}, Case{0, 0.005F, 0.95 * 0.005}}) {
    Fit fit;
    fit.add_triangle({0, 1, 2}, kCorners);
    fit.add_corner_points(0, of.least, of.most);
    const CageShells shells = fit.run(3);
    for (const float offset : shells.outward) EXPECT_NEAR(offset, of.expected, 1e-6) << of.least;
    for (const float offset : shells.inward) EXPECT_NEAR(offset, kMargin, 1e-6);
    EXPECT_EQ(shells.conflicts, of.most < of.least ? 3U : 0U);
    // The same, inwards; it is no conflict there.
    std::swap(fit.needs.min_outward_height, fit.needs.min_inward_depth);
    std::swap(fit.needs.max_outward_height, fit.needs.max_inward_depth);
    const CageShells turned = fit.run(3);
    EXPECT_EQ(turned.inward, shells.outward);
    EXPECT_EQ(turned.conflicts, 0U);
    // Points that another part covers, and that have no face, count for nothing.
    std::swap(fit.needs.min_outward_height, fit.needs.min_inward_depth);
    std::swap(fit.needs.max_outward_height, fit.needs.max_inward_depth);
    fit.needs.counts.assign(3, 0);
    fit.needs.found.assign(3, 0);
    const CageShells none = fit.run(3);
    EXPECT_EQ(none.conflicts, 0U);
    for (const float offset : none.outward) EXPECT_NEAR(offset, kMargin, 1e-6);
  }
}

/// Heights hold along a point's ray, offsets along the vertices' directions: both may be slanted.
TEST(CageShells, FollowSlantedDirections) {
  for (const double vertices : {1.0, 0.5}) {
    for (const double ray : {1.0, 0.5}) {
      for (const auto& [least, most, expected] :
           {std::array{0.1F, kFree, 0.125F}, std::array{0.1F, 0.12F, 0.11F},
            std::array{0.0F, 0.001F, 0.00095F}}) {
        Fit fit;
        fit.add_triangle({0, 1, 2}, kCorners, vertices);
        fit.add_corner_points(0, least, most, ray);
        for (const float offset : fit.run(3).outward)
          EXPECT_NEAR(offset * vertices / ray, expected, 1e-6) << vertices << ray;
      }
    }
  }
}

/// A vertex below its neighbours' mean rises by half of the difference in each of four steps.
TEST(CageShells, AreSmoothedUpward) {
  constexpr std::uint32_t kSides = 7;
  const auto at = [](std::uint32_t i, double radius) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    return to_float(Vec3d{radius * std::cos(angle), radius * std::sin(angle), 0});
  };
  // A vertex, a ring around it, and faces with points between that and a second ring.
  Fit fit;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t next = (i + 1) % kSides;
    fit.add_triangle({0, 1 + i, 1 + next}, {Vec3{0, 0, 0}, at(i, 1), at(next, 1)});
    fit.add_triangle({1 + i, 1 + kSides + i, 1 + kSides + next}, {at(i, 1), at(i, 2), at(next, 2)});
    fit.add_triangle({1 + i, 1 + kSides + next, 1 + next}, {at(i, 1), at(next, 2), at(next, 1)});
    fit.add_point(3 * i + 1, 0.3F, 0.3F, 0.4F, kFree);
    fit.add_point(3 * i + 2, 0.3F, 0.3F, 0.4F, kFree);
  }
  const CageShells shells = fit.run(1 + 2 * kSides);
  for (std::uint32_t i = 1; i <= 2 * kSides; ++i) EXPECT_NEAR(shells.outward[i], 0.5, 1e-6);
  EXPECT_NEAR(shells.outward[0], 0.5 - (0.5 - kMargin) / 16, 1e-6);
}

/// Whatever the bounds, each point's own face lies within the shell, and the points above their bounds are counted.
TEST(CageShells, PutFacesBeforeBounds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 20; ++round) {
    Fit fit;
    constexpr std::uint32_t kSide = 5;
    const auto vertex = [](std::uint32_t x, std::uint32_t y) { return y * (kSide + 1) + x; };
    const auto place = [](std::uint32_t x, std::uint32_t y) {
      return Vec3{static_cast<float>(x), static_cast<float>(y), 0};
    };
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t x = 0; x < kSide; ++x) {
        fit.add_triangle({vertex(x, y), vertex(x + 1, y), vertex(x + 1, y + 1)},
                         {place(x, y), place(x + 1, y), place(x + 1, y + 1)});
        const auto t = static_cast<std::uint32_t>(fit.surface.triangles.size() - 1);
        const float least = 0.1F * unit(random);
        fit.add_point(t, 0.3F, 0.3F, least, least + 0.1F * unit(random));
      }
    }
    const CageShells shells = fit.run((kSide + 1) * (kSide + 1));
    std::uint64_t above = 0;
    for (std::size_t i = 0; i < fit.needs.points.list.size(); ++i) {
      const std::uint32_t* v = &fit.vertex_of[3 * fit.needs.points.list[i].triangle];
      const double height =
          0.4 * shells.outward[v[0]] + 0.3 * shells.outward[v[1]] + 0.3 * shells.outward[v[2]];
      EXPECT_GE(height, fit.needs.min_outward_height[i] - kTolerance);
      above += height > fit.needs.max_outward_height[i] + kTolerance ? 1 : 0;
    }
    EXPECT_EQ(shells.conflicts, above);
  }
}

}  // namespace
}  // namespace kiln

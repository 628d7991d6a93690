// Widths of bevels at hard edges, against profiles of known widths.
#include "match/bevel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "mesh/hard_edges.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// Points (x, z) of a profile that is extruded along y. It runs along the face that looks up, turns down at the origin,
/// and runs along the face that looks to +x.
using Profile = std::vector<std::pair<double, double>>;

const Profile kSharp = {{-1, 0}, {0, 0}, {0, -1}};

/// Adds a profile from y = `from` to y = `from` + 1, with normals of its faces.
void add(Mesh& mesh, const Profile& profile, double from) {
  for (std::size_t i = 1; i < profile.size(); ++i) {
    const auto [x0, z0] = profile[i - 1];
    const auto [x1, z1] = profile[i];
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [x, y, z] :
         {std::array{x0, from, z0}, {x1, from, z1}, {x1, from + 1, z1}, {x0, from + 1, z0}}) {
      mesh.positions.push_back(to_float(Vec3d{x, y, z}));
    }
    const auto normal = static_cast<std::uint32_t>(mesh.normals.size());
    const double size = std::hypot(x1 - x0, z1 - z0);
    mesh.normals.push_back(to_float(Vec3d{(z0 - z1) / size, 0, (x1 - x0) / size}));
    for (const Triangle& t :
         {Triangle{first, first + 1, first + 2}, Triangle{first, first + 2, first + 3}}) {
      mesh.triangles.push_back(t);
      mesh.normal_triangles.push_back({normal, normal, normal});
    }
  }
}

struct Found {
  Bevels bevels;
  HardEdges hard;
  double diagonal = 0;  ///< Of the high poly, in its units
  /// Width of edge i in units of the high poly
  double width(std::size_t i = 0) const { return bevels.widths[i] / scale; }
  double scale = 1;
  /// The least of the distances that are looked at from `width` on
  double ring(double width) const {
    for (int r = 1;; ++r) {
      const double at = 0.04 * diagonal * r * r / (24.0 * 24.0);
      if (at >= width) return r == 1 ? 0 : at;
    }
  }
};

Found find(const Mesh& high, const Mesh& low, double reach = 0.1) {
  const Source source(*test::device(), high);
  const Source::Impl& impl = impl_of(source);
  const LowSurface surface = LowSurface::without_uvs(low, impl.frame);
  Found found;
  found.hard = HardEdges::of(surface);
  found.scale = impl.frame.scale;
  found.diagonal = impl.frame.diagonal;
  found.bevels = find_bevels(impl, surface, found.hard, reach * impl.frame.scale, nullptr);
  return found;
}

Found find_one(const std::vector<Profile>& profiles) {
  Mesh high, low;
  for (const Profile& profile : profiles) add(high, profile, 0);
  add(low, kSharp, 0);
  const Found found = find(high, low);
  EXPECT_EQ(found.hard.edges.size(), 1U);
  return found;
}

/// Two fifths of the wider side, whichever it is, and of the only side that there is.
TEST(Bevel, ASlopeIsAsWideAsItsWiderSide) {
  KILN_REQUIRE_DEVICE();
  for (const auto& [a, b] : {std::pair{0.03, 0.03}, {0.03, 0.015}, {0.015, 0.03}}) {
    const Found found = find_one({{{-1, 0}, {-a, 0}, {0, -b}, {0, -1}}});
    EXPECT_EQ(found.bevels.found, 1U);
    EXPECT_NEAR(found.width(), 0.4 * found.ring(std::max(a, b)), 1e-5) << a << " " << b;
    EXPECT_EQ(found.bevels.median, found.bevels.widths[0]);
  }
  for (const bool up : {true, false}) {
    const Found found =
        find_one({up ? Profile{{-1, 0}, {-0.03, 0}} : Profile{{0, -0.03}, {0, -1}}});
    EXPECT_EQ(found.bevels.found, 1U);
    EXPECT_NEAR(found.width(), 0.4 * found.ring(0.03), 1e-5) << up;
  }
}

/// Twice the height of the face that lies lower, and no less than a two thousandth of the diagonal.
TEST(Bevel, FacesFartherOutTurnRaysByTheLowerOne) {
  KILN_REQUIRE_DEVICE();
  for (const auto& [up, side] : {std::pair{0.02, 0.02}, {0.03, 0.02}, {0.02, 0.03}}) {
    const Found found = find_one({{{-1, up}, {side, up}, {side, -1}}});
    EXPECT_NEAR(found.width(), 2 * std::min(up, side), 1e-5);
  }
  const Found found = find_one({{{-1, 0.03}, {0, 0.03}, {0, -1}}});
  EXPECT_NEAR(found.width(), 0.0005 * found.diagonal, 1e-6);
}

/// Faces that are nowhere parallel: a slope ends where the angle is that of the face farther off.
TEST(Bevel, OfTiltedFacesEndWhereTheyStayTilted) {
  KILN_REQUIRE_DEVICE();
  // 20 degrees inwards; before it, a slope over less than half of the distances, but most of those that are looked at.
  const double tilt = std::tan(20 * std::numbers::pi / 180), slope = 0.025;
  const Profile down = {{-1, -tilt}, {-slope, -tilt * slope}, {0, -slope - tilt * slope}};
  const Found chamfer = find_one({down});
  EXPECT_GT(slope, 0.3 * 0.04 * chamfer.diagonal);
  EXPECT_LT(slope, 0.5 * 0.04 * chamfer.diagonal);
  EXPECT_NEAR(chamfer.width(), 0.4 * chamfer.ring(slope), 1e-5);
}

/// Of several sheets the outermost is the high poly's face.
TEST(Bevel, InnerSheetsDoNotCount) {
  KILN_REQUIRE_DEVICE();
  const Profile chamfer = {{-1, 0}, {-0.03, 0}, {0, -0.03}, {0, -1}};
  const Profile slanted = {{-1, -0.05}, {-0.07, -0.05}, {0, -0.09}};
  const Found found = find_one({chamfer, slanted});
  EXPECT_NEAR(found.width(), 0.4 * found.ring(0.03), 1e-5);
}

TEST(Bevel, WithoutAHighPolyIsAHundredthOfTheDiagonal) {
  KILN_REQUIRE_DEVICE();
  const Found found = find_one({{{-1, 1}, {1, 1}, {1, -1}}});
  EXPECT_EQ(found.bevels.found, 0U);
  EXPECT_EQ(found.bevels.median, 0);
  EXPECT_NEAR(found.width(), 0.01 * found.diagonal, 1e-5);
}

/// Adds a profile at `x`.
void add_at(Mesh& mesh, Profile profile, double x, double y) {
  for (auto& point : profile) point.first += x;
  add(mesh, profile, y);
}

/// Each edge has its own width, and those without one the median.
TEST(Bevel, EachEdgeHasItsOwnWidth) {
  KILN_REQUIRE_DEVICE();
  const std::array<double, 9> slopes = {0.055, 0, 0.015, 0.025, 0, 0.04, 0.02, 0, 0.05};
  Mesh high, low;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    const double x = 1.2 * static_cast<double>(i), a = slopes[i];
    if (a > 0) add_at(high, {{-1, 0}, {-a, 0}, {0, -a}, {0, -1}}, x, 0);
    add_at(low, kSharp, x, 0);
  }
  const Found found = find(high, low);
  ASSERT_EQ(found.hard.edges.size(), slopes.size());
  EXPECT_EQ(found.bevels.found, 6U);
  EXPECT_NEAR(found.bevels.median / found.scale, 0.4 * found.ring(0.04), 1e-4)
      << "the upper one of the two in the middle";
  for (std::size_t e = 0; e < slopes.size(); ++e) {
    const double x = found.hard.edges[e].from.x / found.scale + 4.3;  // -1 to 9.6 around the middle
    const double a = slopes[static_cast<std::size_t>(std::lround(x / 1.2))];
    EXPECT_NEAR(found.width(e), 0.4 * found.ring(a > 0 ? a : 0.04), 1e-4) << x;
  }
}

/// Of 4,096 edges and more every second one is measured, in its own place.
TEST(Bevel, OfManyEdgesSomeAreMeasured) {
  KILN_REQUIRE_DEVICE();
  for (const int count : {4095, 4096}) {
    Mesh high, low;
    const auto has_high = [&](int i) { return i < 1000 || i == count - 1; };
    for (int i = 0; i < count; ++i) {
      const double x = 3 * (i % 64), y = 2 * (i / 64);
      if (has_high(i)) add_at(high, {{-1, 0}, {-0.005, 0}, {0, -0.005}, {0, -1}}, x, y);
      add_at(low, kSharp, x, y);
    }
    const Found found = find(high, low);
    ASSERT_EQ(found.hard.edges.size(), static_cast<std::size_t>(count));
    std::size_t expected = 0;
    for (std::size_t e = 0; e < found.hard.edges.size(); e += count < 4096 ? 1 : 2) {
      const HardEdges::Edge& edge = found.hard.edges[e];
      const double x = edge.from.x / found.scale + 94,
                   y = (edge.from.y + 0.5 * edge.along.y) / found.scale + 63.5;
      const int i = static_cast<int>(std::lround(x / 3)) + 64 * static_cast<int>(std::floor(y / 2));
      expected += has_high(i) ? 1 : 0;
    }
    EXPECT_EQ(found.bevels.found, expected) << count;
  }
}

/// Of more than 4,095 edges every second one is measured: each has its own width, and those between them the median.
TEST(Bevel, OfManyEdgesEachMeasuredOneHasItsOwnWidth) {
  KILN_REQUIRE_DEVICE();
  constexpr int kCount = 4100;
  // No pattern of these repeats in twos: a width of another edge shows.
  const auto slope_of = [](int i) { return 0.01 + 0.005 * (i * i % 7); };
  Mesh high, low;
  for (int i = 0; i < kCount; ++i) {
    const double a = slope_of(i), x = 2.5 * (i % 41) / 16, y = 2 * (i / 41);
    add(high, {{x - 0.06, 0}, {x - a, 0}, {x, -a}, {x, -0.06}}, y);
    add(low, {{x - 0.06, 0}, {x, 0}, {x, -0.06}}, y);
  }
  // Narrower along y, so that slopes of hundredths are measured.
  for (Mesh* mesh : {&high, &low}) {
    for (Vec3& p : mesh->positions) p.y /= 64;
  }
  const Found found = find(high, low, 0.05);
  ASSERT_EQ(found.hard.edges.size(), static_cast<std::size_t>(kCount));
  EXPECT_EQ(found.bevels.found, static_cast<std::size_t>(kCount / 2));
  // Where edges lie: by their place among all, from the least x and y on.
  float least_x = 1e30F, least_y = 1e30F;
  for (const HardEdges::Edge& edge : found.hard.edges) {
    least_x = std::min(least_x, edge.from.x);
    least_y = std::min(least_y, edge.from.y + 0.5F * edge.along.y);
  }
  std::vector<double> measured;
  std::vector<int> order;
  for (const HardEdges::Edge& edge : found.hard.edges) {
    const double x = (edge.from.x - least_x) / found.scale,
                 y = (edge.from.y + 0.5 * edge.along.y - least_y) / found.scale;
    order.push_back(static_cast<int>(std::lround(x * 16 / 2.5)) +
                    41 * static_cast<int>(std::lround(y * 32)));
  }
  const auto width_of = [&](int i) {
    return std::max(0.4 * found.ring(slope_of(i)), 0.0005 * found.diagonal);
  };
  for (std::size_t e = 0; e < order.size(); e += 2) {
    EXPECT_NEAR(found.width(e), width_of(order[e]), 1e-5) << e;
    measured.push_back(width_of(order[e]));
  }
  std::sort(measured.begin(), measured.end());
  EXPECT_GT(measured.back(), 2 * measured.front());
  const double median = measured[measured.size() / 2];
  EXPECT_NEAR(found.bevels.median / found.scale, median, 1e-5);
  for (std::size_t e = 1; e < order.size(); e += 2) EXPECT_NEAR(found.width(e), median, 1e-5) << e;
}

}  // namespace
}  // namespace kiln

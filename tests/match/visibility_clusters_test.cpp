// Clusters of the directions that see a texel, and the maps of each.
#include "match/visibility_clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRoof = 2;     // half its width; it hangs 1 over the floor
constexpr double kFloor = 4;    // half its width
constexpr double kLong = 20;    // half the length of both
constexpr double kDepth = 0.2;  // of the high poly's floor under the low poly
constexpr double kWave = 0.06;

double angle(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) / kDegree;
}

/// A floor under a narrower roof, open on both long sides. The floor has the left half of the map.
Mesh shelter() {
  Mesh mesh;
  mesh.name = "shelter";
  const auto add = [&](double half, float z, float left) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [i, j] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      mesh.positions.push_back(
          {static_cast<float>((2 * i - 1) * half), static_cast<float>((2 * j - 1) * kLong), z});
      mesh.uvs.push_back({left + 0.5F * static_cast<float>(i), static_cast<float>(j)});
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  };
  add(kFloor, 0, 0);
  add(kRoof, 1, 0.5F);
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

double wave(double x) { return kWave * std::sin(2 * x) - kDepth; }

/// The same with waves in the floor, which lies deeper.
Mesh dense_shelter() {
  constexpr int kCells = 2000;
  Mesh mesh = shelter();
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.triangles = {mesh.triangles[2], mesh.triangles[3]};
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int i = 0; i <= kCells; ++i) {
    const double x = (2.0 * i / kCells - 1) * 2 * kFloor;
    for (const double y : {-2 * kLong, 2 * kLong}) {
      mesh.positions.push_back(
          {static_cast<float>(x), static_cast<float>(y), static_cast<float>(wave(x))});
    }
  }
  for (std::uint32_t i = 0; i < kCells; ++i) {
    const std::uint32_t a = first + 2 * i;
    mesh.triangles.push_back({a, a + 2, a + 3});
    mesh.triangles.push_back({a, a + 3, a + 1});
  }
  return mesh;
}

/// The mean of the directions that pass the roof's edge, `reach` away, weighted by the cosine.
Vec3d side_direction(double reach) {
  const double first = std::atan(reach);  // from +Z
  const double across = std::cos(first) * std::cos(first) / 2;
  const double up = (std::numbers::pi / 2 - first) / 2 - std::sin(2 * first) / 4;
  return Vec3d{across, 0, up} * (1 / std::hypot(across, up));
}

BakeOptions cluster_options(std::uint32_t size, std::uint32_t clusters) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.method = MatchMethod::visibility;
  options.match.visibility.clusters = clusters;
  options.encoding.space = NormalMapSpace::object;
  options.encoding.raw = true;
  options.match.max_distance = Length::absolute(3);
  return options;
}

double place(std::uint32_t column, std::uint32_t size) {
  return ((column + 0.5) / (size / 2.0) * 2 - 1) * kFloor;
}

TEST(PartDirections, FindsWhatLiesTogether) {
  const std::vector<SeenDirection> directions = {{{0.8, 0.1, 0.59}, 1},
                                                 {{-0.8, 0.05, 0.6}, 1},
                                                 {{0.8, -0.1, 0.59}, 1},
                                                 {{-0.8, -0.05, 0.6}, 3}};
  const std::vector<Vec3d> two = cluster_directions(directions, 2);
  ASSERT_EQ(two.size(), 2U);
  EXPECT_LT(angle(two[0], {1.6, 0, 1.18}), 1e-6);
  EXPECT_LT(angle(two[1], {-3.2, -0.1, 2.4}), 1e-6);
  EXPECT_EQ(cluster_directions(directions, 4).size(), 4U);
  EXPECT_EQ(cluster_directions(std::span(directions).first(1), 4).size(), 1U);
  EXPECT_TRUE(cluster_directions({}, 2).empty());
}

TEST(VisibilityClusters, AreTheTwoSidesThatAFloorIsSeenFrom) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSize = 32;
  const Mesh low = shelter();
  const Source source(*test::device(), dense_shelter());
  for (const VisibilityTest test : {VisibilityTest::rays, VisibilityTest::views}) {
    BakeOptions options = cluster_options(kSize, 2);
    const bool rays = test == VisibilityTest::rays;
    options.match.visibility.test = test;
    options.match.visibility.directions = 1024;
    const BakeResult result = bake(source, low, options);
    ASSERT_TRUE(result.clusters && result.report.visibility);
    EXPECT_EQ(result.maps.size(), 2U);
    EXPECT_EQ(result.maps[1].cluster, 1U);
    EXPECT_GE(result.report.visibility->clustered, 4 * 20U);
    double worst = 0;
    for (std::uint32_t y = 6; y < kSize - 6; ++y) {
      for (std::uint32_t x = 0; x < kSize; ++x) {
        const std::size_t i = std::size_t{y} * kSize + x;
        const double at = place(x, kSize);
        if (x >= kSize / 2) {
          EXPECT_EQ(result.clusters->number[i], 1) << x << y;
        }
        if (std::abs(at) > 1) continue;
        ASSERT_EQ(result.clusters->number[i], 2) << x << ' ' << y;
        const Vec3d right = side_direction(kRoof - at);
        const Vec3d left = side_direction(kRoof + at);
        worst = std::max(worst, angle(to_double(result.clusters->directions[2 * i]), right));
        worst = std::max(
            worst, angle(to_double(result.clusters->directions[2 * i + 1]), {-left.x, 0, left.z}));
      }
    }
    EXPECT_LT(worst, rays ? 2 : 5);
  }
}

TEST(VisibilityClusters, AreTheSameWithBothTraversals) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = shelter();
  const Source vectors(*test::device(), dense_shelter(), RayTraversal::cpu);
  const Source scalars(*test::device(), dense_shelter(), RayTraversal::gpu);
  for (const VisibilityTest test : {VisibilityTest::rays, VisibilityTest::views}) {
    // Odd sizes: the last directions and samples do not fill their words and vectors.
    BakeOptions options = cluster_options(61, 3);
    options.match.visibility.test = test;
    options.match.visibility.directions = 77;
    const BakeResult a = bake(vectors, low, options);
    const BakeResult b = bake(scalars, low, options);
    EXPECT_GT(a.report.visibility->clustered, 300U);
    EXPECT_EQ(a.clusters->number, b.clusters->number);
    for (std::size_t i = 0; i < a.clusters->directions.size(); ++i) {
      EXPECT_EQ(a.clusters->directions[i].x, b.clusters->directions[i].x);
      EXPECT_EQ(a.clusters->directions[i].z, b.clusters->directions[i].z);
    }
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(a.maps[k].image.pixels, b.maps[k].image.pixels);
  }
}

TEST(VisibilityClusters, LeaveAPlaneAlone) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(20, 20);
  for (Vec3& p : high.positions) p.z += 0.05F * std::sin(9 * p.x) * std::cos(7 * p.y);
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  const Mesh low = test::plane(2, 2);
  const BakeResult one = bake(source, low, cluster_options(64, 1));
  const BakeResult three = bake(source, low, cluster_options(64, 3));
  EXPECT_FALSE(one.clusters);
  EXPECT_EQ(three.report.visibility->clustered, 0U);
  ASSERT_EQ(three.maps.size(), 3U);
  for (const BakedMap& map : three.maps) EXPECT_EQ(map.image.pixels, one.maps[0].image.pixels);
  for (const std::uint8_t number : three.clusters->number) EXPECT_EQ(number, 1);
}

TEST(VisibilityClusters, ShowWhatViewsSee) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSize = 128;
  const Source source(*test::device(), dense_shelter());
  const BakeResult single = bake(source, shelter(), cluster_options(kSize, 1));
  const BakeResult parted = bake(source, shelter(), cluster_options(kSize, 2));
  double of_single = 0;
  double of_parted = 0;
  int count = 0;
  for (const double side : {-1.0, 1.0}) {
    for (const double degrees : {70.0, 74.0, 78.0}) {
      for (const double along : {-0.3, 0.0, 0.3}) {
        Vec3d view{side * std::sin(degrees * kDegree), along, std::cos(degrees * kDegree)};
        view = view * (1 / length(view));
        for (std::uint32_t x = 0; x < kSize / 2; ++x) {
          const double at = place(x, kSize);
          if (std::abs(at) > 0.5) continue;
          // Point at which the line of sight meets the waves.
          double near = 0;
          double far = 3;
          for (int round = 0; round < 60; ++round) {
            const double middle = (near + far) / 2;
            (-view.z * middle > wave(at - view.x * middle) ? near : far) = middle;
          }
          const double slope = 2 * kWave * std::cos(2 * (at - view.x * near));
          const Vec3d truth{-slope, 0, 1};
          const std::size_t i = std::size_t{kSize / 2} * kSize + x;
          const Vec3* directions = &parted.clusters->directions[2 * i];
          const std::size_t best =
              dot(to_double(directions[1]), view) > dot(to_double(directions[0]), view);
          const auto normal = [&](const BakedMap& map) {
            const float* p = &map.image.pixels[3 * i];
            return Vec3d{p[0], p[1], p[2]};
          };
          of_single += angle(normal(single.maps[0]), truth);
          of_parted += angle(normal(parted.maps[best]), truth);
          ++count;
        }
      }
    }
  }
  of_single /= count;
  of_parted /= count;
  std::printf("mean error: %.2f degrees with one map, %.2f with two\n", of_single, of_parted);
  EXPECT_LT(of_parted, of_single / 2);
}

TEST(VisibilityClusters, AreForVisibilityAtTexels) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), dense_shelter());
  const Mesh low = shelter();
  BakeOptions options = cluster_options(16, 5);
  EXPECT_THROW(bake(source, low, options), Error);
  options = cluster_options(16, 2);
  options.match.method = MatchMethod::hybrid;
  EXPECT_THROW(bake(source, low, options), Error);
  options = cluster_options(16, 2);
  options.match.visibility.at = VisibilityAt::vertex;
  EXPECT_THROW(bake(source, low, options), Error);
  options = cluster_options(16, 2);
  options.report.keep_match = true;
  EXPECT_THROW(bake(source, low, options), Error);
}

}  // namespace
}  // namespace kiln

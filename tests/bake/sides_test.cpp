// Which side of a surface a bake takes: cages, faces turned away, hard edges, cards without thickness.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

TEST(Bake, CageFindsTheOuterSurfaceFirst) {
  KILN_REQUIRE_DEVICE();
  // Two sheets above a plane, both facing up: the cage ray meets the upper one first.
  Mesh high = test::plane(1, 1, 4, 4);
  const Mesh upper = high;
  const auto offset = static_cast<std::uint32_t>(high.positions.size());
  for (Vec3& p : high.positions) p.z = 0.1F;
  for (const Vec3& p : upper.positions) high.positions.push_back({p.x, p.y, 0.3F});
  for (const Triangle& t : upper.triangles) {
    high.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    high.normal_triangles.push_back(high.normal_triangles[0]);
  }
  high.uvs.clear();
  high.uv_triangles.clear();
  const Mesh low = test::plane(2, 2, 1, 1);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.report.keep_match = true;
  const auto distance = [&] {
    const BakeResult result = bake(source, low, options);
    EXPECT_EQ(result.report.missed, 0U);
    return result.match->distance[8 * 16 + 8];
  };
  options.match.max_distance = Length::absolute(1);
  options.match.ray.rule = RayRule::nearest;
  EXPECT_NEAR(distance(), 0.1, 1e-6) << "the ray from the surface meets the lower sheet first";
  options.match.ray.rule = RayRule::outermost;
  EXPECT_NEAR(distance(), 0.3, 1e-6) << "a viewer sees the upper sheet";
  options.match.cage = Length::absolute(0.5);
  EXPECT_NEAR(distance(), 0.3, 1e-6);
  options.match.cage = Length::absolute(0.2);
  EXPECT_NEAR(distance(), 0.1, 1e-6);
  options.match.cage.reset();
  Mesh cage = low;
  for (Vec3& p : cage.positions) p.z += 0.5F;
  options.match.cage_mesh = &cage;
  EXPECT_NEAR(distance(), 0.3, 1e-6);
  for (Vec3& p : cage.positions) p.z = 0.25F;
  EXPECT_NEAR(distance(), 0.1, 1e-6);
}

TEST(Bake, SkipsFacesTurnedAwayUnlessTwoSided) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  for (Vec3& p : high.positions) p.z = 0.1F;
  for (Triangle& t : high.triangles) std::swap(t[1], t[2]);
  high.normals.clear();
  high.normal_triangles.clear();
  const Mesh low = test::plane(1, 1, 1, 1);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.match.max_distance = Length::absolute(1);
  EXPECT_EQ(bake(source, low, options).report.missed, 256U);
  options.match.two_sided = true;
  EXPECT_EQ(bake(source, low, options).report.outward, 256U);
  options.match.cage = Length::absolute(0.5);
  EXPECT_EQ(bake(source, low, options).report.cage, 256U);
  options.match.two_sided = false;
  EXPECT_EQ(bake(source, low, options).report.missed, 256U);
}

TEST(Bake, HardEdgesLeaveNoGaps) {
  KILN_REQUIRE_DEVICE();
  // A cube inside a larger rounded one: with split normals, rays along the faces' normals would leave
  // the edges without a match; the continuous field finds something everywhere.
  const Mesh high = test::icosphere(5, 1.0);
  const Mesh low = test::cube(1.0);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 128;
  options.match.max_distance = Length::absolute(2);
  const BakeResult result = bake(source, low, options);
  EXPECT_EQ(result.report.missed, 0U);
}

/// A square in the plane y = 0 whose sides have vertices of their own; UVs of the upper side in the left half
/// of the map. The corners run from 0 to 1.
Mesh two_sided_card(std::uint32_t cells) {
  Mesh mesh;
  mesh.name = "card";
  for (int side = 0; side < 2; ++side) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t y = 0; y <= cells; ++y) {
      for (std::uint32_t x = 0; x <= cells; ++x) {
        const float u = static_cast<float>(x) / static_cast<float>(cells);
        const float v = static_cast<float>(y) / static_cast<float>(cells);
        mesh.positions.push_back({u, 0, v});
        mesh.uvs.push_back({u * 0.4F + (side == 0 ? 0.05F : 0.55F), v * 0.9F + 0.05F});
      }
    }
    for (std::uint32_t y = 0; y < cells; ++y) {
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = base + y * (cells + 1) + x;
        const std::uint32_t b = a + 1, c = a + cells + 1, d = c + 1;
        if (side == 0) {  // +Y
          mesh.triangles.push_back({a, c, b});
          mesh.triangles.push_back({b, c, d});
        } else {
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({b, d, c});
        }
      }
    }
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

TEST(Bake, TellsOfNormalsWithoutDirection) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(2000, true), low = test::BumpySphere::light(12, 6);
  // A triangle without area may have any normals, and often has none: nobody sees it.
  high.triangles.push_back({0, 0, 1});
  high.normals.emplace_back();
  const auto last = static_cast<std::uint32_t>(high.normals.size() - 1);
  high.normal_triangles.push_back({last, last, last});
  BakeOptions options;
  options.width = options.height = 16;
  const auto count_of = [&](std::string_view name) {
    const Source source(*test::device(), high);
    std::vector<Warning> warnings = bake(source, low, options).report.warnings;
    warnings.insert(warnings.end(), source.warnings().begin(), source.warnings().end());
    std::uint64_t count = 0;
    for (const Warning& warning : warnings) {
      if (warning.code != "normals-computed") continue;
      if (warning.message.text().find("'" + std::string(name) + "'") != std::string::npos) {
        count += warning.count;
      }
    }
    return count;
  };
  high.name = "rock", low.name = "game";
  EXPECT_EQ(count_of("rock") + count_of("game"), 0U);
  ASSERT_FALSE(low.normal_triangles.empty());
  high.normals[high.normal_triangles[7][1]] = {0, 0, 0};
  low.normals[low.normal_triangles[3][2]] = {0, std::nanf(""), 1};
  const auto using_it = [](const Mesh& mesh, std::uint32_t normal) {
    return std::count_if(
        mesh.normal_triangles.begin(), mesh.normal_triangles.end(),
        [&](const Triangle& t) { return std::find(t.begin(), t.end(), normal) != t.end(); });
  };
  EXPECT_EQ(count_of("rock"), using_it(high, high.normal_triangles[7][1]));
  EXPECT_EQ(count_of("game"), using_it(low, low.normal_triangles[3][2]));
}

TEST(Bake, CardsWithoutThicknessKeepTheirSides) {
  KILN_REQUIRE_DEVICE();
  // At every vertex the two sides' normals cancel out: each takes its own face's.
  const Source source(*test::device(), two_sided_card(8));
  BakeOptions options;
  options.width = options.height = 32;
  options.encoding.space = NormalMapSpace::object;
  options.encoding.gutter = 0;
  const BakeResult result = bake(source, two_sided_card(1), options);
  EXPECT_GT(result.report.samples, 500U);
  EXPECT_EQ(result.report.missed, 0U);
  for (std::size_t y = 0; y < 32; ++y) {
    for (std::size_t x = 0; x < 32; ++x) {
      if (result.coverage[y * 32 + x] != 1) continue;
      const float expected = x < 16 ? 1.0F : 0.0F;
      ASSERT_NEAR(result.maps[0].image.at(x, y)[1], expected, 1e-6) << x << ", " << y;
    }
  }
}

TEST(Bake, TwoSidedTurnsNormalsTowardsTheLightMesh) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(6, 6);
  for (Triangle& t : high.triangles) std::swap(t[1], t[2]);
  high.uvs.clear();
  high.uv_triangles.clear();
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  options.encoding.gutter = 0;
  EXPECT_EQ(bake(source, test::plane(1, 1), options).report.missed, 256U);
  options.match.two_sided = true;
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::views}) {
    options.match.method = method;
    const BakeResult result = bake(source, test::plane(1, 1), options);
    EXPECT_EQ(result.report.missed, 0U);
    for (std::size_t i = 0; i < 256; ++i) {
      ASSERT_NEAR(result.maps[0].image.pixels[i * 3 + 2], 1, 1e-6);
    }
  }
}

}  // namespace
}  // namespace kiln

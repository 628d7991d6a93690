// HighCoverage against geometry: what share of the high poly a bake leaves out, by construction.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "hard_scenes.h"
#include "kiln/bake.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/hard_scene.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A plate from (-1, -1) to (1, 1), just off z = 0, and a sheet above its left half.
Mesh plate_with_sheet(float height) {
  Mesh high = test::plane(8, 8, 2, 2);
  for (Vec3& p : high.positions) p.z = 1e-3F;
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  for (const auto& [x, y] : {std::pair{-1.0F, -1.0F}, {0.0F, -1.0F}, {0.0F, 1.0F}, {-1.0F, 1.0F}}) {
    high.positions.push_back({x, y, height});
  }
  high.triangles.push_back({first, first + 1, first + 2});
  high.triangles.push_back({first, first + 2, first + 3});
  high.uvs.clear();
  high.uv_triangles.clear();
  high.normals.clear();
  high.normal_triangles.clear();
  return high;
}

BakeOptions options_of(RayRule rule) {
  BakeOptions options;
  options.width = options.height = 128;
  options.match.max_distance = Length::absolute(0.2);
  options.match.ray.rule = rule;
  return options;
}

/// The sheet hides half of the plate, so views show an area of 2 of each. The nearest rule takes the plate.
///
/// From aslant, views also show some of the plate below the sheet: of all that would be seen from a place d
/// within the rim of a ceiling h above it, (1 - d / sqrt(d^2 + h^2)) / 2; over all d that is h / 2 a unit of
/// rim. With h = 0.1 and a rim of 6 that is 0.3, less at the corners, where two rims see the same.
TEST(HighCoverage, IsTheHiddenHalfOfAPlate) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), plate_with_sheet(0.1F));
  const Mesh low = test::plane(1, 1, 2, 2);
  const BakeResult outermost = bake(source, low, options_of(RayRule::outermost));
  ASSERT_TRUE(outermost.report.recall.has_value());
  EXPECT_LT(outermost.report.recall->lost, 0.3 / 4.3);

  const BakeResult nearest = bake(source, low, options_of(RayRule::nearest));
  ASSERT_TRUE(nearest.report.recall.has_value());
  // 8192 places: within 0.6%, one standard error, and 64 directions as evenly.
  EXPECT_GT(nearest.report.recall->lost, 2 / 4.3 - 0.02);
  EXPECT_LT(nearest.report.recall->lost, 0.5 + 0.02);
  EXPECT_NEAR(nearest.report.recall->largest, nearest.report.recall->lost, 0.02);
  EXPECT_NEAR(nearest.report.recall->where[0], -0.5, 0.1);
  EXPECT_NEAR(nearest.report.recall->where[1], 0, 0.1);
  EXPECT_NEAR(nearest.report.recall->where[2], 0.1, 1e-6);
  const auto& warnings = nearest.report.warnings;
  const auto lost = std::find_if(warnings.begin(), warnings.end(),
                                 [](const Warning& w) { return w.code == "lost-surface"; });
  ASSERT_NE(lost, warnings.end());
  EXPECT_NE(lost->message.text().find("`match.ray.rule` outermost"), std::string::npos);
}

/// A surface beyond the distance is not near, so nothing of it can be lost.
TEST(HighCoverage, CountsWhatIsWithinTheDistance) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), plate_with_sheet(0.3F));
  const BakeResult baked = bake(source, test::plane(1, 1, 2, 2), options_of(RayRule::nearest));
  ASSERT_TRUE(baked.report.recall.has_value());
  EXPECT_LT(baked.report.recall->lost, 0.002);
  EXPECT_GT(baked.report.recall->places, 2000U);
}

/// Vertices are marked by the same rule: those of the sheet, and those of the plate beside it.
TEST(HighCoverage, MarksVertices) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = plate_with_sheet(0.1F);
  const Source source(*test::device(), high);
  BakeOptions options = options_of(RayRule::nearest);
  options.report.vertex_coverage = true;
  const BakeResult baked = bake(source, test::plane(1, 1, 2, 2), options);
  ASSERT_EQ(baked.recalled.size(), high.positions.size());
  for (std::size_t i = 0; i < high.positions.size(); ++i) {
    const Vec3& p = high.positions[i];
    if (p.z > 0.05F) {
      EXPECT_EQ(baked.recalled[i], VertexCoverage::lost) << i;
    } else if (p.x > 0.2F) {
      EXPECT_EQ(baked.recalled[i], VertexCoverage::represented) << i;
    }
  }
}

/// By default no scene loses a part; by the nearest rule the cube's discs go, and are named.
TEST(HighCoverage, TellsWhereDiscsAreLost) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("cube");
  const Source source(*test::device(), scene.high);
  BakeOptions options;
  options.width = options.height = 512;
  const BakeResult found = bake(source, scene.low, options);
  options.match.ray.rule = RayRule::nearest;
  const BakeResult lost = bake(source, scene.low, options);
  ASSERT_TRUE(found.report.recall && lost.report.recall);
  EXPECT_LT(found.report.recall->lost, 0.01);
  // 18 discs of radius 0.18 to 0.22 on six faces of 2 x 2: a tenth, and what they hide is seen less.
  EXPECT_GT(lost.report.recall->lost, 0.07);
  EXPECT_LT(lost.report.recall->lost, 0.13);
  const auto& where = lost.report.recall->where;
  bool on_a_disc = false;
  for (const sample::RaisedDisc& disc : scene.raised_discs) {
    const Vec3d way(where[0] - disc.at.x, where[1] - disc.at.y, where[2] - disc.at.z);
    on_a_disc = on_a_disc || length(way) < disc.radius;
  }
  EXPECT_TRUE(on_a_disc);
}

/// Smooth detail loses nothing, and the share is the same on every run. Where samples are many beside
/// triangles, those that no place lies near are not looked at.
TEST(HighCoverage, LosesNothingOfASmoothMesh) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(20000));
  BakeOptions options;
  options.match.max_distance = Length::absolute(0.1);
  for (const std::uint32_t size : {256U, 1024U}) {
    options.width = options.height = size;
    const BakeResult a = bake(source, test::BumpySphere::light(), options);
    const BakeResult b = bake(source, test::BumpySphere::light(), options);
    ASSERT_TRUE(a.report.recall && b.report.recall);
    EXPECT_LT(a.report.recall->lost, 0.001) << size;
    EXPECT_GT(a.report.recall->places, 7000U);
    EXPECT_EQ(a.report.recall->lost, b.report.recall->lost);
  }
}

TEST(HighCoverage, IsNotToldWhereItIsNotAskedForOrCannotBe) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(2, 2));
  BakeOptions options;
  options.width = options.height = 16;
  options.report.recall = 0;
  EXPECT_FALSE(bake(source, test::plane(1, 1), options).report.recall.has_value());
  options.report.recall = 64;
  options.match.method = MatchMethod::views;
  EXPECT_FALSE(bake(source, test::plane(1, 1), options).report.recall.has_value());
  options.report.recall = (1U << 20) + 1;
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
}

}  // namespace
}  // namespace kiln

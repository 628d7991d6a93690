// Levels of a plan: their layouts, and those with more faces where the first ones do not do.
#include "plan/level_evaluator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "kiln/plan.h"
#include "kiln/unwrap.h"
#include "plan/settings.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// An evaluator with all that it refers to.
struct Levels {
  explicit Levels(const Mesh& mesh, const LowPolyPlanOptions& given = {})
      : high(mesh), options(given), source(*test::device(), high) {
    bake = options.bake;
    evaluator.emplace(source, high, options, bake, plan, cache);
  }
  const Mesh& high;
  LowPolyPlanOptions options;
  Source source;
  BakeOptions bake;
  LowPolyPlan plan;
  LevelCache cache;
  std::optional<LevelEvaluator> evaluator;
};

/// Waves of a sphere on its side x > 0 alone.
Mesh half_rough() {
  Mesh mesh = test::icosphere(5);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Vec3& p : mesh.positions) {
    const float ripple = std::max(p.x, 0.0F) * std::sin(70 * p.y) * std::sin(70 * p.z);
    const float scale = 1 + 0.01F * ripple;
    p = {p.x * scale, p.y * scale, p.z * scale};
  }
  return mesh;
}

/// Area in UVs over that in space, of triangles whose middle has this sign of x.
double density(const Mesh& low, bool is_rough) {
  double uv_area = 0, area = 0;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const Triangle &v = low.triangles[t], &w = low.uv_triangles[t];
    const Vec3 &a = low.positions[v[0]], &b = low.positions[v[1]], &c = low.positions[v[2]];
    if ((a.x + b.x + c.x > 0) != is_rough) continue;
    const double x1 = b.x - a.x, y1 = b.y - a.y, z1 = b.z - a.z;
    const double x2 = c.x - a.x, y2 = c.y - a.y, z2 = c.z - a.z;
    area += std::sqrt(std::pow(y1 * z2 - z1 * y2, 2) + std::pow(z1 * x2 - x1 * z2, 2) +
                      std::pow(x1 * y2 - y1 * x2, 2));
    const Vec2 &p = low.uvs[w[0]], &q = low.uvs[w[1]], &r = low.uvs[w[2]];
    uv_area +=
        std::abs(double{q.x - p.x} * double{r.y - p.y} - double{q.y - p.y} * double{r.x - p.x});
  }
  return uv_area / area;
}

/// Charts lie apart by 1/256 of the map, and by two texels at least; a layout is made once for its size.
TEST(LevelEvaluator, LayoutsArePaddedByTheirSize) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = half_rough();
  Levels levels(high);
  const std::size_t level = levels.evaluator->count() - 20;
  for (const auto& [size, padding] :
       {std::pair{256U, 2.0}, std::pair{512U, 2.0}, std::pair{1024U, 4.0}, std::pair{2048U, 8.0}}) {
    const UnwrappedLowPoly& made = levels.evaluator->unwrapped(level, size);
    EXPECT_EQ(made.report.border_texels, padding) << size;
    EXPECT_EQ(&levels.evaluator->unwrapped(level, size), &made);
    EXPECT_EQ(made.mesh.triangles.size(), levels.evaluator->mesh(level).triangles.size());
  }
}

/// Texels go where the high poly has detail, if that is asked for, and never at the cost of padding.
TEST(LevelEvaluator, TexelsFollowDetailWhereAskedFor) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = half_rough();
  LowPolyPlanOptions by_detail;
  by_detail.density = TexelDensity::detail;
  Levels area(high), detail(high, by_detail);
  const std::size_t level = area.evaluator->count() - 30;
  const auto ratio = [&](Levels& levels, std::uint32_t size) {
    const Mesh& low = levels.evaluator->unwrapped(level, size).mesh;
    return density(low, true) / density(low, false);
  };
  EXPECT_NEAR(ratio(area, 128), 1, 0.05);
  EXPECT_GT(ratio(detail, 128), 1.1 * ratio(area, 128));
  for (const std::uint32_t size : {16U, 32U, 64U}) {
    EXPECT_GE(detail.evaluator->unwrapped(level, size).report.border_texels,
              area.evaluator->unwrapped(level, size).report.border_texels)
        << size;
  }
}

/// Where the finest level does not do there are finer ones once, of eight times the faces at most, down to the old
/// finest, whose errors are still known.
TEST(LevelEvaluator, FinerLevelsAreMadeOnce) {
  KILN_REQUIRE_DEVICE();
  const Mesh small = test::icosphere(4);
  EXPECT_FALSE(Levels(small).evaluator->refine());
  const Mesh high = test::icosphere(6);
  ASSERT_GT(high.triangles.size(), plan_settings::kFinestFaces);
  Levels levels(high);
  LevelEvaluator& evaluator = *levels.evaluator;
  EXPECT_NEAR(evaluator.faces(0), plan_settings::kFinestFaces, 4);
  const std::size_t count = evaluator.count();
  const double error = evaluator.at(0, false).without_map;
  ASSERT_TRUE(evaluator.refine());
  EXPECT_EQ(evaluator.faces(0), static_cast<double>(high.triangles.size()));
  EXPECT_NEAR(evaluator.faces(evaluator.count() - 1), plan_settings::kFinestFaces, 4);
  EXPECT_LT(evaluator.count(), count);
  EXPECT_EQ(evaluator.evaluated_levels(false), std::vector<std::size_t>{evaluator.count() - 1});
  EXPECT_TRUE(evaluator.evaluated_levels(true).empty());
  EXPECT_EQ(evaluator.at(evaluator.count() - 1, false).without_map, error);
  for (std::size_t i = 1; i < evaluator.count(); ++i) {
    const double share = evaluator.faces(i) / evaluator.faces(i - 1);
    EXPECT_LT(share, 1) << i;
    if (i + 1 < evaluator.count()) EXPECT_NEAR(share, plan_settings::kLevelFaceRatio, 0.001) << i;
  }
  EXPECT_FALSE(evaluator.refine());
}

/// What is measured replaces what was predicted there, and scales what is predicted next to it.
TEST(LevelEvaluator, MeasuredLevelsCorrectTheirNeighbours) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = half_rough();
  Levels levels(high);
  LevelEvaluator& evaluator = *levels.evaluator;
  const std::size_t level = plan_settings::kNodeStep, next = 2 * plan_settings::kNodeStep;
  const LevelErrors before = evaluator.at(level, true), other = evaluator.at(next, true);
  evaluator.record_measured(
      level, true, {2 * before.without_map, 3 * before.infinite_map, before.silhouette_mismatch});
  EXPECT_DOUBLE_EQ(evaluator.at(level, true).without_map, 2 * before.without_map);
  EXPECT_DOUBLE_EQ(evaluator.at(level, true).infinite_map, 3 * before.infinite_map);
  EXPECT_DOUBLE_EQ(evaluator.at(next, true).without_map, 2 * other.without_map);
  EXPECT_DOUBLE_EQ(evaluator.at(next, true).infinite_map, 3 * other.infinite_map);
  // An error of nothing scales nothing.
  evaluator.record_measured(next, true, {0, 0, 0});
  const LevelErrors coarse = evaluator.at(3 * plan_settings::kNodeStep, true);
  EXPECT_GT(coarse.without_map, 0);
  EXPECT_EQ(evaluator.at(next, true).without_map, 0);
}

}  // namespace
}  // namespace kiln

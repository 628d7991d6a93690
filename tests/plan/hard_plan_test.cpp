// Plans of low polys of few faces, which may lose what they show.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hard_scenes.h"
#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "measure/normal_probe.h"
#include "simplify/prism_tube.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// The lightest mesh of this bracket within 3 degrees has two triangles that face away.
TEST(LowPolyPlan, RatherTakesAFinerMeshThanFoldedTriangles) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = sample::hard_scene("bracket").high;
  LowPolyPlanOptions options;
  options.max_error = 3;
  options.screen = 600;
  const LowPolyPlan plan = plan_low_poly(Source(*test::device(), high), high, options);
  EXPECT_TRUE(plan.reached);
  EXPECT_EQ(plan.simplified.folded + plan.simplified.without_area + plan.simplified.holes, 0U);
}

/// Each side of a prism is a plane: its own normals show it as it is. Normals that are smooth over its edges are some 10
/// degrees off, and take a large map.
TEST(LowPolyPlan, HardEdgesNeedNoMap) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::prism_tube(9);
  ASSERT_EQ(shade_high(high, {.rule = ShadingRule::angle, .angle_degrees = 30}).hard_parts, 1U);
  LowPolyPlanOptions options;
  options.max_error = 2;
  const LowPolyPlan plan = plan_low_poly(Source(*test::device(), high), high, options);
  EXPECT_TRUE(plan.reached);
  EXPECT_EQ(plan.chosen.size, 0U);
  EXPECT_LE(plan.chosen.faces, 40U);
}

/// A wavy sheet of two sides. The coarsest mesh, two triangles back to back, is half of it, with about the right normals.
TEST(LowPolyPlan, DoesNotLoseHalfOfASheet) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 40;
  Mesh high;
  for (std::uint32_t i = 0; i <= kSide; ++i) {
    for (std::uint32_t j = 0; j <= kSide; ++j) {
      const float x = static_cast<float>(i) / kSide, y = static_cast<float>(j) / kSide;
      high.positions.push_back({x, y, 0.004F * std::sin(9 * x + 2 * y)});
      if (i == kSide || j == kSide) continue;
      const std::uint32_t a = i * (kSide + 1) + j, b = a + kSide + 1;
      for (const Triangle& t : {Triangle{a, b, b + 1}, Triangle{a, b + 1, a + 1}}) {
        high.triangles.push_back(t);
        high.triangles.push_back({t[0], t[2], t[1]});
      }
    }
  }
  LowPolyPlanOptions options;
  options.max_error = 5;
  options.screen = 300;
  const LowPolyPlan plan = plan_low_poly(Source(*test::device(), high), high, options);
  EXPECT_TRUE(plan.reached);
  EXPECT_LT(plan.chosen.silhouette_mismatch, 0.05);
  EXPECT_LT(plan.chosen.faces, 20U);
}

/// Rendered normals tell little of outlines. Those of a pipe are found again from directions that plans do not look from.
TEST(LowPolyPlan, BoundsHowFarOutlinesDiffer) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = sample::hard_scene("pipe").high;
  const Source source(*test::device(), high);
  LowPolyPlanOptions options;
  options.max_error = 20;
  options.screen = 300;
  const LowPolyPlan any = plan_low_poly(source, high, options);
  const HighPolyView shown = make_high_poly_view(impl_of(source), 300, spread_views(40));
  const auto differs = [&](const LowPolyPlan& plan) {
    const NormalProbe probe(impl_of(source), add_placeholder_uvs(plan.low), shown);
    return probe.without_map().one_sided_share;
  };
  std::uint64_t faces = any.chosen.faces;
  for (const double most : {0.02, 0.008}) {
    ASSERT_GT(any.chosen.silhouette_mismatch, most);
    options.max_outline = most;
    const LowPolyPlan plan = plan_low_poly(source, high, options);
    EXPECT_TRUE(plan.reached) << most;
    EXPECT_LE(plan.chosen.measured, 20) << most;
    EXPECT_LE(plan.chosen.silhouette_mismatch, most);
    EXPECT_NEAR(differs(plan), plan.chosen.silhouette_mismatch, 0.3 * most);
    EXPECT_GT(plan.chosen.faces, faces) << most;
    EXPECT_LT(plan.chosen.bytes.total(), 64 * any.chosen.bytes.total()) << most;
    for (const Candidate& row : plan.trade) EXPECT_GE(row.faces, faces);
    faces = plan.chosen.faces;
  }
  // A bound that is not reached is told.
  options.max_outline = 1e-7;
  const LowPolyPlan never = plan_low_poly(source, high, options);
  EXPECT_EQ(never.reached, never.chosen.silhouette_mismatch <= 1e-7);
  for (const double bad : {-0.1, 1.0, std::nan("")}) {
    options.max_outline = bad;
    EXPECT_THROW(plan_low_poly(source, high, options), Error) << bad;
  }
}

}  // namespace
}  // namespace kiln

// Plans of hard surfaces: of few faces, with parts of few triangles.
#include <gtest/gtest.h>

#include "hard_scenes.h"
#include "kiln/kiln.h"
#include "kiln/light_plan.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// Of this bracket, the lightest mesh within 3 degrees has two triangles that face away.
TEST(LightPlan, RatherTakesAFinerMeshThanFoldedTriangles) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = sample::hard_scene("bracket").high;
  LightPlanOptions options;
  options.max_error = 3;
  options.screen = 600;
  const LightBake light = bake_light(Source(*test::device(), high), high, options);
  EXPECT_TRUE(light.reached);
  EXPECT_EQ(light.simplified.folded + light.simplified.without_area + light.simplified.holes, 0U);
  EXPECT_LT(light.trials.front().measured, 3);
  EXPECT_LT(light.trials.front().faces, light.chosen.faces);
}

}  // namespace
}  // namespace kiln

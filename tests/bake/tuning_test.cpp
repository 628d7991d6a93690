// No byte of any map depends on the tuning of a device: who builds trees, and the work-group sizes.
#include "cl/tuning.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "accel/bvh_device.h"
#include "bake/all_matches.h"
#include "bake/golden_scene.h"
#include "cl/context.h"
#include "kiln/bake.h"
#include "kiln/source.h"
#include "support/environment.h"

namespace kiln {
namespace {

std::vector<BakeOptions> all_bakes() {
  return test::bakes_by_all_matches(
      96, {MapKind::normal, {"height"}, {"id"}, {"ao"}, {"thickness"}, {"bent_normal"}});
}

TEST(Tuning, NoMapDependsOnIt) {
  KILN_REQUIRE_DEVICE();
  const Device usual = Device::open(test::device()->info().name);
  const Device tuned = Device::open(test::device()->info().name);
  context_of(usual).set_tuning({});
  const Mesh low = test::golden_low();
  const auto groups_of = [](std::uint32_t size) {
    return cl::Tuning{.min_device_build_triangles = 0,
                      .ray_group = size,
                      .closest_group = size,
                      .occlusion_group = size,
                      .raster_group = size,
                      .view_group = size};
  };
  // With copies of triangles, so that equally near ones occur
  const Mesh high = test::with_flaws(test::golden_high());
  EXPECT_TRUE(bvh::build_on_device(context_of(tuned), high.positions, high.triangles).has_value());
  for (const RayTraversal traversal : {RayTraversal::automatic, RayTraversal::gpu}) {
    const Source expected_source(usual, high, traversal);
    for (const BakeOptions& options : all_bakes()) {
      const BakeResult expected = bake(expected_source, low, options);
      for (const std::uint32_t size : {1U, cl::Tuning::kMaxGroup}) {
        SCOPED_TRACE(std::string(options.match.method.name) + ", groups of " +
                     std::to_string(size));
        context_of(tuned).set_tuning(groups_of(size));
        const BakeResult result = bake(Source(tuned, high, traversal), low, options);
        ASSERT_EQ(result.maps.size(), expected.maps.size());
        for (std::size_t i = 0; i < result.maps.size(); ++i) {
          EXPECT_TRUE(result.maps[i].image.pixels == expected.maps[i].image.pixels)
              << result.maps[i].kind.name;
        }
        ASSERT_TRUE(result.match && expected.match);
        EXPECT_TRUE(result.match->triangle == expected.match->triangle &&
                    result.match->u == expected.match->u && result.match->v == expected.match->v &&
                    result.match->status == expected.match->status);
        ASSERT_EQ(result.report.warnings.size(), expected.report.warnings.size());
        for (std::size_t i = 0; i < result.report.warnings.size(); ++i)
          EXPECT_EQ(result.report.warnings[i].message, expected.report.warnings[i].message);
      }
    }
  }
}

}  // namespace
}  // namespace kiln

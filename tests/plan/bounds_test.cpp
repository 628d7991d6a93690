// Plans that bound the errors of several maps at once.
#include "measure/bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bake/map_units.h"
#include "detail/occlusion_scene.h"
#include "detail/registry.h"
#include "kiln/plan.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

double wave(double x) { return 0.01 * std::sin(60 * x); }

/// A wave over a plane: all of its maps are known.
Mesh waves() {
  Mesh mesh = test::plane(4096, 1);
  for (Vec3& p : mesh.positions) p.z = static_cast<float>(wave(p.x));
  return mesh;
}

BakeOptions options_of(std::vector<MapKind> maps, std::uint32_t size) {
  BakeOptions options;
  options.maps = std::move(maps);
  options.width = options.height = size;
  options.match.max_distance = Length::absolute(0.05);
  return options;
}

/// Root mean square between the map, read between its texels, and the wave, at points of its own.
double error_of_heights(const Image& map) {
  constexpr int kPoints = 20011;
  double squares = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double u = (i + 0.5) / kPoints;
    const double x = std::clamp(u * map.width - 0.5, 0.0, map.width - 1.0);
    const auto left = static_cast<std::uint32_t>(x);
    const std::uint32_t right = std::min(left + 1, map.width - 1);
    const std::size_t row = std::size_t{map.height / 2} * map.width;
    const double read =
        map.pixels[row + left] * (1 - (x - left)) + map.pixels[row + right] * (x - left);
    squares += std::pow(read - wave(u - 0.5), 2);
  }
  return std::sqrt(squares / kPoints);
}

TEST(Bounds, TakeTheSmallestMapThatReachesAllOfThem) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), waves());
  const Mesh low = test::plane(1, 1);
  const MapKind height{"height"};
  const std::vector<std::uint32_t> sizes{128, 256, 512};
  std::vector<double> errors;
  for (const std::uint32_t size : sizes) {
    errors.push_back(
        error_of_heights(bake(source, low, options_of({height}, size)).map(height).image));
  }
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
    ASSERT_GT(errors[i], 2 * errors[i + 1]);
    PlanOptions options;
    options.max_error = 30;  // the smallest map does for normals
    options.bake = options_of({MapKind::normal, height, MapKind{"mask"}}, 1024);
    options.bounds = {{height, std::sqrt(errors[i] * errors[i + 1])}};
    const PlannedBake planned = bake_planned(source, low, options);
    EXPECT_TRUE(planned.reached);
    EXPECT_EQ(planned.chosen.width, sizes[i + 1]);
    ASSERT_EQ(planned.bounds.size(), 1U);
    EXPECT_EQ(planned.bounds[0].unit, "world units");
    EXPECT_NEAR(planned.bounds[0].error, errors[i + 1], 0.05 * errors[i + 1]);
    EXPECT_GT(planned.bounds[0].points, 1500U);
    // The maps written are a bake of this size.
    ASSERT_EQ(planned.result.maps.size(), 3U);
    EXPECT_EQ(planned.result.map(height).image.pixels,
              bake(source, low, options_of({height}, sizes[i + 1])).map(height).image.pixels);
  }
}

TEST(Bounds, OutOfReachAreSaidToBe) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), waves());
  PlanOptions options;
  options.max_error = 30;
  options.bake = options_of({MapKind::normal, MapKind{"height"}, MapKind{"position"}}, 256);
  options.bounds = {{MapKind{"height"}, 1e-9}, {MapKind{"position"}, 1}};
  const PlannedBake planned = bake_planned(source, test::plane(1, 1), options);
  EXPECT_FALSE(planned.reached);
  EXPECT_LE(planned.chosen.error.mean_degrees, planned.wanted);
  EXPECT_EQ(planned.chosen.width, 256U);
  ASSERT_EQ(planned.bounds.size(), 2U);
  EXPECT_FALSE(planned.bounds[0].reached());
  EXPECT_TRUE(planned.bounds[1].reached());
}

TEST(Bounds, LeaveHalfOfOcclusionToItsRays) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  test::add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high);
  PlanOptions options;
  options.max_error = 30;
  options.bake = options_of({MapKind::normal, MapKind{"ao"}}, 256);
  options.bounds = {{MapKind{"ao"}, 2.0 / 255}};
  const PlannedBake planned = bake_planned(source, test::ground(1), options);
  ASSERT_EQ(planned.bounds.size(), 1U);
  EXPECT_TRUE(planned.bounds[0].reached()) << planned.bounds[0].error;
  EXPECT_EQ(planned.bounds[0].unit, "");
  // 64 rays at each texel are further off, however large the map is.
  options.choose_rays = false;
  const PlannedBake grain = bake_planned(source, test::ground(1), options);
  EXPECT_FALSE(grain.bounds[0].reached()) << grain.bounds[0].error;
}

TEST(Bounds, ShapeTheLowPolyToo) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options;
  options.max_error = 12;
  options.bake.maps = {MapKind::normal, MapKind{"position"}};
  options.bake.width = options.bake.height = 512;
  options.may_leave_map_out = false;
  const LowPolyPlan free = plan_low_poly(source, high, options);
  ASSERT_TRUE(free.reached);
  options.bounds = {{MapKind{"position"}, 1}};
  const LowPolyPlan wide = plan_low_poly(source, high, options);
  ASSERT_EQ(wide.bounds.size(), 1U);
  EXPECT_EQ(wide.chosen.size, free.chosen.size) << "what is reached anyway costs nothing";
  options.bounds[0].max_error = 0.7 * wide.bounds[0].error;
  const LowPolyPlan bound = plan_low_poly(source, high, options);
  EXPECT_TRUE(bound.reached);
  EXPECT_LE(bound.bounds[0].error, options.bounds[0].max_error);
  EXPECT_GT(bound.chosen.size, wide.chosen.size);
  EXPECT_EQ(bound.result->map(MapKind{"position"}).image.width, bound.chosen.size);
}

TEST(Bounds, RefuseWhatHasNoError) {
  BakeOptions bake = options_of({MapKind::normal, MapKind{"mask"}, MapKind{"wireframe"}}, 64);
  bake.maps.push_back(MapKind{"ao"});
  const auto refused = [&](const std::vector<MapBound>& bounds) {
    EXPECT_THROW(check_bounds(bake, bounds), Error);
  };
  EXPECT_NO_THROW(check_bounds(bake, std::vector<MapBound>{{MapKind{"ao"}, 0.01}}));
  refused({{MapKind{"ao"}, 0}});
  refused({{MapKind{"ao"}, NAN}});
  refused({{MapKind{"ao"}, 0.1}, {MapKind{"ao"}, 0.2}});
  refused({{MapKind{"mask"}, 1}});
  refused({{MapKind{"wireframe"}, 1}});
  refused({{MapKind{"height"}, 1}});
  refused({{MapKind::normal, 1}});
}

TEST(MapUnits, ColoursDifferAsInCielab) {
  const MapRow& color = map_row(MapKind{"color"});
  EXPECT_EQ(unit_of(color).name, "ΔE");
  const float black[3] = {0, 0, 0}, white[3] = {1, 1, 1}, red[3] = {1, 0, 0};
  const float grey[3] = {0.2158605F, 0.2158605F, 0.2158605F};  // 128 of 255, L* = 53.585
  EXPECT_NEAR(map_difference(color, black, white), 100, 0.01);
  EXPECT_NEAR(map_difference(color, black, grey), 53.585, 0.01);
  // sRGB's red is (53.24, 80.09, 67.20) in CIELAB.
  EXPECT_NEAR(map_difference(color, red, black), std::hypot(53.24, 80.09, 67.20), 0.05);
  EXPECT_NEAR(map_difference(color, red, white), std::hypot(46.76, 80.09, 67.20), 0.05);
}

}  // namespace
}  // namespace kiln

// Plans that bound the errors of several maps at once.
#include "measure/bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bake/map_units.h"
#include "detail/occlusion_scene.h"
#include "detail/registry.h"
#include "image/gutter.h"
#include "kiln/plan.h"
#include "source/high_poly.h"
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

/// The error of a map by views is measured with views of the resolution that the bake had: here by a bake of the same
/// points, whose views have that size, and the mean square of what the map reads there.
TEST(Bounds, OfViewsAreMeasuredWithViewsOfTheSameSize) {
  KILN_REQUIRE_DEVICE();
  // Triangles so small that views of 1024 pixels would not show them, unless the map's samples are few.
  Mesh high = test::plane(4096, 32);
  for (Vec3& p : high.positions) p.z = static_cast<float>(wave(p.x));
  const Source source(*test::device(), high);
  const Mesh low = test::plane(1, 1);
  const MapKind height{"height"};
  constexpr std::uint32_t kWidth = 800, kHeight = 768;
  BakeOptions baked_as = options_of({height}, kWidth);
  baked_as.height = kHeight;
  baked_as.match.method = MatchMethod::views;
  const BakeResult result = bake(source, low, baked_as);
  ASSERT_TRUE(result.report.views.has_value());
  const std::uint32_t size = result.report.views->size;
  // The whole unit square is covered: 47 cells a side, more than the root of 2,000.
  constexpr std::uint32_t kSide = 47;
  BakeOptions points_as = baked_as;
  points_as.width = points_as.height = kSide;
  points_as.encoding.gutter = 0;
  points_as.encoding.raw = true;
  const BakeResult own_size = bake(source, low, points_as);
  ASSERT_NE(own_size.report.views->size, size)
      << "views of the reference's own size would be others";
  points_as.match.views.size = size;
  const BakeResult points = bake(source, low, points_as);
  const Image& map = result.map(height).image;
  const auto error_of = [&](const BakeResult& reference) {
    double squares = 0;
    std::uint64_t count = 0;
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t x = 0; x < kSide; ++x) {
        if (reference.coverage[std::size_t{y} * kSide + x] != kCoverageBaked) continue;
        const double at_x = std::clamp((x + 0.5) / kSide * kWidth - 0.5, 0.0, kWidth - 1.0),
                     at_y = std::clamp((y + 0.5) / kSide * kHeight - 0.5, 0.0, kHeight - 1.0);
        const auto left = static_cast<std::uint32_t>(at_x), top = static_cast<std::uint32_t>(at_y);
        const auto texel = [&](std::uint32_t i, std::uint32_t j) {
          return double{map.at(std::min(i, kWidth - 1), std::min(j, kHeight - 1))[0]};
        };
        const double s = at_x - left, t = at_y - top;
        const double read = (texel(left, top) * (1 - s) + texel(left + 1, top) * s) * (1 - t) +
                            (texel(left, top + 1) * (1 - s) + texel(left + 1, top + 1) * s) * t;
        squares += std::pow(read - reference.map(height).image.at(x, y)[0], 2);
        ++count;
      }
    }
    return std::pair(std::sqrt(squares / static_cast<double>(count)), count);
  };
  const std::vector<MapBound> bounds{{height, 1}};
  const std::vector<MapReached> reached =
      reached_bounds(impl_of(source), low, baked_as, bounds, result);
  ASSERT_EQ(reached.size(), 1U);
  const auto [error, count] = error_of(points);
  EXPECT_EQ(reached[0].points, count);
  EXPECT_NEAR(reached[0].error, error, 1e-6 * error);
  EXPECT_GT(std::abs(error_of(own_size).first - error), 0.01 * error);
}

/// Half of a bound goes to the rays of the map that it bounds: to the variant's, where that has its own.
TEST(Bounds, LeaveHalfToTheRaysOfTheirVariant) {
  const auto variant = [](const char* name, const OcclusionOptions& occlusion) {
    MapVariant result;
    result.name = name;
    result.kind = MapKind{"ao"};
    result.occlusion = occlusion;
    return result;
  };
  OcclusionOptions views, given;
  views.by = OcclusionBy::views;
  given.max_error = 0.25;
  BakeOptions bake = options_of({MapKind::normal, MapKind{"ao"}, MapKind{"position"}}, 64);
  bake.variants = {variant("ao_none", {}), variant("ao_far", {}), variant("ao_views", views),
                   variant("ao_given", given), variant("ao_loose", {})};
  const std::vector<MapBound> bounds{{MapKind{"position"}, 0.5},
                                     {MapKind{std::string_view("ao_far")}, 0.0625},
                                     {MapKind{std::string_view("ao_views")}, 0.125},
                                     {MapKind{std::string_view("ao_given")}, 0.125},
                                     {MapKind{std::string_view("ao_loose")}, 2}};
  EXPECT_NO_THROW(check_bounds(bake, bounds));
  reserve_bound_for_rays(bounds, bake);
  EXPECT_EQ(bake.occlusion.max_error, 0);
  const std::vector<double> wanted{0, 0.03125, 0, 0.25, 0};
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(bake.variants[i].occlusion->max_error, wanted[i]) << bake.variants[i].name;
  }
  reserve_bound_for_rays(std::vector<MapBound>{{MapKind{"ao"}, 0.5}}, bake);
  EXPECT_EQ(bake.occlusion.max_error, 0.25);
  EXPECT_EQ(bake.variants[0].occlusion->max_error, 0) << "it has its own";
}

/// Bounds of transfers, own maps and variants, none of them the first of its kind, beside maps that have none.
TEST(Bounds, BelongToMapsOfEveryKind) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), waves());
  const Mesh low = test::plane(1, 1);
  const auto plain = [](const char* name, float grey) {
    Texture texture;
    texture.kind = TextureKind::linear;
    texture.images = {std::make_shared<const Image>(Image{1, 1, 1, {grey}})};
    return Transfer{name, texture};
  };
  const auto own = [](const char* name, const char* value) {
    OwnMap map;
    map.name = name;
    map.channels = 1;
    map.source = std::string("float4 kiln_map(const kiln_point* p) { return (float4)(") + value +
                 ", 0.0f, 0.0f, 0.0f); }\n";
    return map;
  };
  BakeOptions options = options_of({MapKind{"height"}, MapKind{"position"}}, 128);
  options.transfers = {plain("first", 0.25F), plain("second", 0.75F), plain("third", 0.5F)};
  options.own_maps = {own("zero", "0.0f"), own("wave", "p->position.z"), own("last", "1.0f")};
  const BakeResult result = bake(source, low, options);
  const std::vector<MapBound> bounds{{MapKind{std::string_view("wave")}, 1},
                                     {MapKind{std::string_view("second")}, 0.5},
                                     {MapKind{"height"}, 0.25}};
  const std::vector<MapReached> reached =
      reached_bounds(impl_of(source), low, options, bounds, result);
  ASSERT_EQ(reached.size(), 3U);
  EXPECT_EQ(reached[0].kind.name, "wave");
  EXPECT_EQ(reached[1].kind.name, "second");
  EXPECT_EQ(reached[2].kind.name, "height");
  EXPECT_EQ(reached[0].wanted, 1);
  EXPECT_EQ(reached[1].wanted, 0.5);
  EXPECT_EQ(reached[2].wanted, 0.25);
  // The own map is the height, of which the wave's error is known; one value everywhere has none.
  const double known = error_of_heights(result.map(MapKind{"height"}).image);
  EXPECT_NEAR(reached[2].error, known, 0.05 * known);
  EXPECT_NEAR(reached[0].error, reached[2].error, 1e-3 * known);
  EXPECT_EQ(reached[1].error, 0);
  EXPECT_EQ(reached[1].points, reached[0].points);
}

/// Directions are decoded as they were encoded: as three components, or as two.
TEST(Bounds, OfDirectionsAreOfDecodedOnes) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  test::add_disc(high, {0.3F, 0.1F, 0.4F}, 0.5F, false);
  const Source source(*test::device(), high);
  const Mesh low = test::ground(1);
  const MapKind bent{"bent_normal"};
  const auto error_of = [&](bool two_component) {
    BakeOptions options = options_of({bent}, 32);
    options.occlusion.rays = 256;
    options.encoding.two_component = two_component;
    const BakeResult result = bake(source, low, options);
    const std::vector<MapBound> bounds{{bent, 1}};
    const std::vector<MapReached> reached =
        reached_bounds(impl_of(source), low, options, bounds, result);
    EXPECT_EQ(reached[0].unit, "degrees");
    return reached[0].error;
  };
  const double encoded = error_of(false);
  EXPECT_GT(encoded, 0);
  EXPECT_LT(encoded, 4);
  EXPECT_NEAR(error_of(true), encoded, 1e-2 * encoded + 1e-2);
}

}  // namespace
}  // namespace kiln

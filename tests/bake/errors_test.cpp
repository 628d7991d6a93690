// Errors that bakes report of themselves, against what is known of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "detail/occlusion_scene.h"
#include "image/gutter.h"
#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

const MapError& error_of(const BakeResult& result, std::string_view map, std::string_view against) {
  for (const MapError& error : result.report.errors) {
    if (error.kind.name == map && error.against.find(against) != std::string_view::npos) {
      return error;
    }
  }
  throw std::runtime_error("no such error");
}

BakeOptions asking(std::vector<MapKind> maps, std::uint32_t side) {
  BakeOptions options;
  options.width = options.height = side;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.2);
  options.report.errors = true;
  return options;
}

TEST(MapErrors, FallWithMoreSamples) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(40000, true));
  const Mesh low = test::BumpySphere::light(24, 12);
  BakeOptions options =
      asking({MapKind::normal, MapKind{"height"}, MapKind::mask, MapKind{"id"}}, 64);
  const BakeResult one = bake(source, low, options);
  EXPECT_EQ(one.report.errors.size(), 2U) << "names and masks have no means";
  options.samples = 4;
  const BakeResult many = bake(source, low, options);
  const MapError &normal = error_of(one, "normal", "16 times"),
                 &height = error_of(one, "height", "");
  EXPECT_EQ(normal.unit, "degrees");
  EXPECT_EQ(height.unit, "world units");
  EXPECT_GT(normal.texels, 900U);
  EXPECT_LE(normal.texels, 2000U);
  EXPECT_GT(normal.rms, 0.02);
  EXPECT_LT(normal.rms, 3);
  EXPECT_LE(normal.mean, normal.rms);
  EXPECT_LE(normal.rms, normal.max);
  EXPECT_LE(normal.p95, normal.max);
  EXPECT_LT(error_of(many, "normal", "").rms, normal.rms / 2);
  EXPECT_LT(error_of(many, "height", "").rms, height.rms / 2);
}

TEST(MapErrors, AreThoseThatAFinerBakeShows) {
  KILN_REQUIRE_DEVICE();
  // Heights of a wave over a plane are known: what a texel holds is the wave at its middle, and what it is
  // compared with is the mean over 4 x 4 points.
  constexpr std::uint32_t kSide = 32;
  Mesh high = test::plane(256, 1);
  const auto wave = [](double x) { return 0.05 * std::sin(40 * x); };
  for (Vec3& p : high.positions) p.z = static_cast<float>(wave(p.x));
  const BakeResult baked =
      bake(Source(*test::device(), high), test::plane(1, 1), asking({MapKind{"height"}}, kSide));
  double squares = 0;
  for (std::uint32_t x = 0; x < kSide; ++x) {
    double mean = 0;
    for (int i = 0; i < 4; ++i) mean += wave((x + (i + 0.5) / 4) / kSide - 0.5) / 4;
    squares += std::pow(wave((x + 0.5) / kSide - 0.5) - mean, 2) / kSide;
  }
  EXPECT_NEAR(error_of(baked, "height", "").rms, std::sqrt(squares), 0.03 * std::sqrt(squares));
}

TEST(MapErrors, OfRaysFallWithTheirNumber) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(20000, true));
  const Mesh low = test::BumpySphere::light(24, 12);
  double last = 1e9;
  for (const std::uint32_t rays : {16U, 64U, 256U}) {
    BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}, MapKind::normal}, 32);
    options.occlusion.rays = rays;
    const BakeResult baked = bake(source, low, options);
    const MapError& ao = error_of(baked, "ao", "4096 rays");
    EXPECT_EQ(ao.unit, "1/255");
    EXPECT_EQ(error_of(baked, "bent_normal", "4096 rays").unit, "degrees");
    EXPECT_THROW(error_of(baked, "normal", "4096 rays"), std::runtime_error);
    EXPECT_LT(ao.rms, last * 0.7) << rays;
    EXPECT_GT(ao.rms, 0);
    last = ao.rms;
  }
  EXPECT_LT(last, 4);
}

TEST(MapErrors, OcclusionIsMadeToTheErrorAskedFor) {
  KILN_REQUIRE_DEVICE();
  // Under a disc that hovers over a floor: all shades from dark to open.
  Mesh high = test::plane(1, 1, 4, 4);
  test::add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high);
  const Mesh low = test::ground(1);
  BakeOptions options = asking({MapKind{"ao"}}, 64);
  options.report.errors = false;
  options.occlusion.rays = 16;
  double last = 1;
  for (const double wanted : {0.02, 0.004, 0.002}) {
    options.occlusion.max_error = wanted;
    const BakeResult baked = bake(source, low, options);
    ASSERT_EQ(baked.report.errors.size(), 1U) << "what was reached is always said";
    const double reached = error_of(baked, "ao", "4096 rays").rms / 255;
    EXPECT_LT(reached, wanted);
    EXPECT_LT(reached, last);
    last = reached;
    for (const Warning& warning : baked.report.warnings) {
      EXPECT_NE(warning.code, "ray-error-not-reached");
    }
  }
  // No rays of 4096 come this near.
  options.occlusion.max_error = 1e-7;
  const BakeResult beyond = bake(source, low, options);
  EXPECT_TRUE(
      std::any_of(beyond.report.warnings.begin(), beyond.report.warnings.end(),
                  [](const Warning& warning) { return warning.code == "ray-error-not-reached"; }));
  // Any map is within 1, so nothing is cast to say so; the map is that of 0.99, which is reached at once.
  options.occlusion.max_error = 1;
  const BakeResult smooth = bake(source, low, options);
  EXPECT_TRUE(smooth.report.errors.empty());
  options.occlusion.max_error = 0.99;
  EXPECT_EQ(smooth.maps[0].image.pixels, bake(source, low, options).maps[0].image.pixels);
}

// Errors are measured at 2,000 texels, whatever the map's size, also where the match wants whole bands. (Once all texels of such a map
// cast 4096 rays: 64 times as long here.)
TEST(MapErrors, TakeAsLongForLargeMapsAsForSmallOnes) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 4, 4);
  test::add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high);
  const Mesh low = test::ground(1);
  BakeOptions options = asking({MapKind{"ao"}}, 48);
  options.report.errors = false;
  options.match.method = MatchMethod::visibility;
  options.match.visibility.directions = 16;
  options.match.visibility.view_size = 64;
  options.occlusion.rays = 8;
  options.occlusion.max_error = 0.9;
  const auto least_seconds = [&](std::uint32_t side) {
    options.width = options.height = side;
    double least = 1e9;
    for (int attempt = 0; attempt < 3; ++attempt) {
      const BakeResult baked = bake(source, low, options);
      EXPECT_GT(error_of(baked, "ao", "4096 rays").texels, 1000U);
      least = std::min(least, baked.report.seconds_errors);
    }
    return least;
  };
  const double small = least_seconds(48);
  EXPECT_LT(least_seconds(384), 10 * small);
}

TEST(MapErrors, ChangeNoTexelAndSayNothingUnasked) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(2000, true));
  const Mesh low = test::BumpySphere::light(8, 4);
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views,
                                   MatchMethod::visibility, MatchMethod::hybrid}) {
    BakeOptions options = asking({MapKind::normal, MapKind{"ao"}}, 20);
    options.match.method = method;
    options.match.visibility.directions = 48;
    options.match.visibility.view_size = 64;
    options.report.keep_match = true;
    const BakeResult with = bake(source, low, options);
    options.report.errors = false;
    const BakeResult without = bake(source, low, options);
    EXPECT_EQ(with.maps[0].image.pixels, without.maps[0].image.pixels) << method.name;
    EXPECT_EQ(with.maps[1].image.pixels, without.maps[1].image.pixels) << method.name;
    EXPECT_EQ(with.report.errors.size(), 3U) << method.name;
    EXPECT_TRUE(without.report.errors.empty());
    EXPECT_EQ(with.report.missed, without.report.missed);
    // A saved match has no further points.
    options.report.errors = true;
    options.match.saved = &*without.match;
    options.report.keep_match = false;
    const BakeResult saved = bake(source, low, options);
    ASSERT_EQ(saved.report.errors.size(), 1U);
    EXPECT_NEAR(saved.report.errors[0].rms, error_of(with, "ao", "4096 rays").rms, 1e-9)
        << method.name;
  }
}

}  // namespace
}  // namespace kiln

// The whole library: determinism, policies, encodings, cancelling.
#include "kiln/bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "kiln/image.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Pair {
  Mesh high = test::BumpySphere::dense(20000);
  Mesh low = test::BumpySphere::light();
};

BakeOptions small_options(std::uint32_t size = 128) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.max_distance = Length::absolute(0.15);
  return options;
}

TEST(Bake, IsTheSameForAnyOrderOfTheDenseTriangles) {
  KILN_REQUIRE_DEVICE();
  Pair pair;
  // The exact normals are given, since summing computed ones in another order moves the last bit.
  pair.high = test::BumpySphere::dense(20000, true);
  const BakeResult expected = bake(Source(*test::device(), pair.high), pair.low, small_options());
  std::mt19937 random(5);
  std::vector<std::size_t> order(pair.high.triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  Mesh shuffled = pair.high;
  for (std::size_t i = 0; i < order.size(); ++i) {
    shuffled.triangles[i] = pair.high.triangles[order[i]];
    shuffled.normal_triangles[i] = pair.high.normal_triangles[order[i]];
  }
  const BakeResult result = bake(Source(*test::device(), shuffled), pair.low, small_options());
  // If a ray meets an edge, another of the triangles that share it may win: the same normal but for
  // rounding.
  const ImageDifference difference =
      compare_images(expected.maps[0].image, result.maps[0].image, nullptr);
  EXPECT_LT(difference.max_angle_degrees, 0.01);
  EXPECT_EQ(expected.coverage, result.coverage);
}

TEST(Bake, MovesWithTheScene) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const BakeResult expected = bake(Source(*test::device(), pair.high), pair.low, small_options());
  for (const double scale : {1e-30, 1e-3, 1e3, 1e30}) {
    Mesh high = pair.high;
    Mesh low = pair.low;
    for (Mesh* mesh : {&high, &low}) {
      for (Vec3& p : mesh->positions) p = to_float(to_double(p) * scale);
      mesh->origin = {1e6 * scale, 0, -1e6 * scale};
    }
    BakeOptions options = small_options();
    options.match.max_distance = Length::absolute(0.15 * scale);
    const BakeResult result = bake(Source(*test::device(), high), low, options);
    const ImageDifference difference =
        compare_images(expected.maps[0].image, result.maps[0].image, nullptr);
    EXPECT_LT(difference.mean_angle_degrees, 0.001) << scale;
    EXPECT_EQ(expected.report.texels, result.report.texels);
    EXPECT_NEAR(result.report.mean_abs_distance / scale / expected.report.mean_abs_distance, 1,
                1e-4);
  }
}

TEST(Bake, SupersamplingTakesEverySampleAndStaysClose) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options(100);
  const BakeResult one = bake(source, pair.low, options);
  options.samples = 3;
  const BakeResult nine = bake(source, pair.low, options);
  EXPECT_GE(nine.report.texels, one.report.texels);
  EXPECT_NEAR(static_cast<double>(nine.report.samples) / static_cast<double>(one.report.samples), 9,
              0.1);
  EXPECT_LT(compare_images(one.maps[0].image, nine.maps[0].image).mean_angle_degrees, 1);
}

TEST(Bake, KeptMatchSaysWhatTheReportSays) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options(96);
  options.samples = 2;
  options.report.keep_match = true;
  options.match.max_distance = Length::absolute(0.01);  // some miss
  const BakeResult result = bake(source, pair.low, options);
  ASSERT_TRUE(result.match);
  const Match& match = *result.match;
  EXPECT_EQ(match.width, 192U);
  std::array<std::uint64_t, 5> counts{};
  for (std::size_t i = 0; i < match.status.size(); ++i) {
    ++counts.at(match.status[i]);
    if (match.triangle[i] == 0xFFFFFFFFU) continue;
    EXPECT_LT(match.triangle[i], pair.high.triangles.size());
    EXPECT_GE(match.u[i], 0);
    EXPECT_GE(match.v[i], 0);
    EXPECT_LE(match.u[i] + match.v[i], 1 + 1e-6);
    EXPECT_LE(std::abs(match.distance[i]), 0.01 * (1 + 1e-5));
    EXPECT_EQ(match.distance[i] >= 0, match.status[i] == 1);
  }
  EXPECT_EQ(counts[1], result.report.outward);
  EXPECT_EQ(counts[2], result.report.inward);
  EXPECT_EQ(counts[4], result.report.missed);
  EXPECT_GT(counts[1], 1000U);
  EXPECT_GT(counts[2], 1000U);
  EXPECT_GT(counts[4], 1000U);

  options.report.keep_match = false;
  options.match.saved = &match;
  const BakeResult again = bake(source, pair.low, options);
  EXPECT_EQ(again.maps[0].image.pixels, result.maps[0].image.pixels);
  EXPECT_EQ(again.coverage, result.coverage);
}

TEST(Bake, MissPoliciesDoWhatTheySay) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options();
  options.match.max_distance = Length::absolute(0.01);
  const BakeResult keep = bake(source, pair.low, options);
  options.encoding.miss = MissPolicy::mark;
  const BakeResult mark = bake(source, pair.low, options);
  options.encoding.miss = MissPolicy::fill;
  const BakeResult fill = bake(source, pair.low, options);
  std::uint64_t missed = 0;
  for (std::size_t i = 0; i < keep.coverage.size(); ++i) {
    const float* k = &keep.maps[0].image.pixels[i * 3];
    const float* m = &mark.maps[0].image.pixels[i * 3];
    const float* f = &fill.maps[0].image.pixels[i * 3];
    if (keep.coverage[i] == 1) {
      EXPECT_TRUE(std::equal(k, k + 3, m) && std::equal(k, k + 3, f));
    } else if (keep.coverage[i] == 2) {
      ++missed;
      // The low poly's own normal is straight up in its own frame.
      EXPECT_NEAR(k[0], 0.5, 1e-4);
      EXPECT_NEAR(k[1], 0.5, 1e-4);
      EXPECT_NEAR(k[2], 1, 1e-4);
      EXPECT_EQ((std::array{m[0], m[1], m[2]}), (std::array{1.0F, 0.0F, 1.0F}));
      const Vec3d value(f[0] * 2 - 1, f[1] * 2 - 1, f[2] * 2 - 1);
      EXPECT_NEAR(length(value), 1, 1e-4);
    }
  }
  EXPECT_GT(missed, 1000U);
  bool warned = false;
  for (const Warning& warning : keep.report.warnings) warned |= warning.code == "many-misses";
  EXPECT_TRUE(warned);
}

/// UVs in a wrong scale are told at any size of a map, however few texels they cover.
TEST(Bake, LittleCoverageIsTold) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const auto told = [&](float scale, std::uint32_t side) {
    Mesh low = pair.low;
    for (Vec2& uv : low.uvs) uv = {uv.x * scale, uv.y * scale};
    BakeOptions options = small_options();
    options.width = options.height = side;
    const BakeReport report = bake(source, low, options).report;
    const double share =
        static_cast<double>(report.texels) / std::pow(static_cast<double>(side), 2);
    bool warned = false;
    for (const Warning& warning : report.warnings) warned |= warning.code == "little-coverage";
    EXPECT_EQ(warned, report.texels > 0 && share < 0.01) << share;
    return warned;
  };
  for (const std::uint32_t side : {32U, 64U, 256U}) {
    EXPECT_FALSE(told(1, side)) << side;
    EXPECT_TRUE(told(1 / 16.0F, side)) << side;
  }
}

TEST(Bake, FlipYTurnsGreenAndTwoComponentsDropBlue) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options();
  const BakeResult plain = bake(source, pair.low, options);
  options.encoding.flip_y = true;
  const BakeResult flipped = bake(source, pair.low, options);
  options.encoding.flip_y = false;
  options.encoding.two_component = true;
  const BakeResult two = bake(source, pair.low, options);
  for (std::size_t i = 0; i < plain.coverage.size(); ++i) {
    const float* p = &plain.maps[0].image.pixels[i * 3];
    const float* f = &flipped.maps[0].image.pixels[i * 3];
    const float* t = &two.maps[0].image.pixels[i * 3];
    EXPECT_FLOAT_EQ(p[0], f[0]);
    EXPECT_NEAR(p[1], 1 - f[1], 1e-6);
    EXPECT_EQ(t[2], 0);
    if (p[2] > 0.5F) {
      EXPECT_NEAR(t[0], p[0], 1e-6);
    }
  }
}

TEST(Bake, TwoComponentsCountWhatPointsBelowTheSurface) {
  KILN_REQUIRE_DEVICE();
  // A plane under waves so steep that some of their normals, turned by 75 degrees, point below it.
  const Mesh low = test::plane(1, 1);
  Mesh high = test::plane(32, 32);
  high.normals.clear();
  for (const Vec3& p : high.positions) {
    const double angle = 1.9 * std::sin(9 * double{p.x});
    high.normals.push_back(
        {static_cast<float>(std::sin(angle)), 0, static_cast<float>(std::cos(angle))});
  }
  high.normal_triangles = high.triangles;
  const Source source(*test::device(), high);
  for (const std::uint32_t samples : {1U, 2U, 3U}) {
    BakeOptions options = small_options();
    options.encoding.space = samples == 1 ? NormalMapSpace::face : NormalMapSpace::tangent;
    options.encoding.raw = true;
    options.samples = samples;
    const BakeResult whole = bake(source, low, options);
    const auto counted = [](const BakeResult& result) {
      std::uint64_t count = 0;
      for (const Warning& warning : result.report.warnings) {
        if (warning.code == "below-surface") count += warning.count;
      }
      return count;
    };
    EXPECT_EQ(counted(whole), 0U);
    options.encoding.two_component = true;
    const BakeResult two = bake(source, low, options);
    // A texel's normal is the mean of its samples', and is pulled up where that points below.
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < whole.coverage.size(); ++i) {
      if (whole.coverage[i] != 1) continue;
      const float* n = &whole.maps[0].image.pixels[3 * i];
      const float* t = &two.maps[0].image.pixels[3 * i];
      const double size = n[2] < 0 ? std::hypot(n[0], n[1]) : 1;
      below += n[2] < 0 ? 1 : 0;
      ASSERT_NEAR(t[0], n[0] / size, 1e-6) << samples << " " << i;
      ASSERT_NEAR(t[1], n[1] / size, 1e-6) << samples << " " << i;
    }
    ASSERT_GT(below, 100U);
    EXPECT_EQ(counted(two), below) << samples;
    // The message states the share of the baked texels.
    const auto baked = std::count(whole.coverage.begin(), whole.coverage.end(), 1);
    char share[32];
    std::snprintf(share, sizeof share, "%.2g%% of the texels",
                  100 * static_cast<double>(below) / static_cast<double>(baked));
    for (const Warning& warning : two.report.warnings) {
      if (warning.code != "below-surface") continue;
      EXPECT_TRUE(warning.message.text().starts_with(share)) << warning.message.text();
    }
  }
  // If all point up, there is nothing to say.
  BakeOptions options = small_options();
  options.encoding.two_component = true;
  for (const Warning& warning : bake(Source(*test::device(), low), low, options).report.warnings) {
    EXPECT_NE(warning.code, "below-surface");
  }
}

TEST(Bake, OverlapsAreLocated) {
  KILN_REQUIRE_DEVICE();
  Mesh low = test::plane(1, 1);
  low.normals.clear();
  low.normal_triangles.clear();
  // A second square, over the texel in column 5, row 2 of 8 x 8
  const auto vertex = static_cast<std::uint32_t>(low.positions.size()),
             uv = static_cast<std::uint32_t>(low.uvs.size());
  for (const auto& [x, y] : {std::pair(0.0F, 0.0F), {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}}) {
    low.positions.push_back({x / 8, y / 8, 0});
    low.uvs.push_back({(5 + x) / 8, (5 + y) / 8});
  }
  low.triangles.push_back({vertex, vertex + 1, vertex + 2});
  low.triangles.push_back({vertex, vertex + 2, vertex + 3});
  if (!low.uv_triangles.empty()) {
    low.uv_triangles.push_back({uv, uv + 1, uv + 2});
    low.uv_triangles.push_back({uv, uv + 2, uv + 3});
  }
  BakeOptions options = small_options();
  options.width = options.height = 8;
  std::string text;
  for (const Warning& warning :
       bake(Source(*test::device(), test::plane(4, 4)), low, options).report.warnings) {
    if (warning.code == "uv-overlap") text = warning.message.text();
  }
  EXPECT_NE(text.find("overlap on 1 sample (1.56% of those covered)"), std::string::npos) << text;
  EXPECT_NE(text.find("at texel column 5, row 2"), std::string::npos) << text;
}

TEST(Bake, CancelsAndReportsProgressInOrder) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options(2048);
  std::vector<double> seen;
  options.progress = [&](double done, std::string_view) {
    seen.push_back(done);
    return true;
  };
  EXPECT_FALSE(bake(source, pair.low, options).cancelled);
  EXPECT_GT(seen.size(), 4U);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1.0);
  int calls = 0;
  options.progress = [&](double, std::string_view) { return ++calls < 2; };
  const BakeResult cancelled = bake(source, pair.low, options);
  EXPECT_TRUE(cancelled.cancelled);
  EXPECT_TRUE(cancelled.maps.empty());
  EXPECT_EQ(calls, 2);
}

TEST(Bake, RefusesParametersOutOfRange) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  const auto expect_usage = [&](const char* name, const auto& change) {
    BakeOptions options = small_options();
    change(options);
    try {
      bake(source, pair.low, options);
      ADD_FAILURE() << name << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage) << error.what();
    }
  };
  expect_usage("width 0", [](BakeOptions& o) { o.width = 0; });
  expect_usage("height 16385", [](BakeOptions& o) { o.height = 16385; });
  expect_usage("samples 0", [](BakeOptions& o) { o.samples = 0; });
  expect_usage("no maps", [](BakeOptions& o) { o.maps.clear(); });
  expect_usage("distance 0", [](BakeOptions& o) { o.match.max_distance = Length::share(0); });
  expect_usage("distance NaN", [](BakeOptions& o) { o.match.max_distance = Length::share(NAN); });
  expect_usage("cage -1", [](BakeOptions& o) { o.match.cage = Length::share(-1); });
  expect_usage("gutter -2", [](BakeOptions& o) { o.encoding.gutter = -2; });
}

TEST(Bake, WorksAtTheSmallestSizes) {
  KILN_REQUIRE_DEVICE();
  const Pair pair;
  const Source source(*test::device(), pair.high);
  BakeOptions options = small_options();
  for (const auto& [width, height] : {std::pair{1U, 1U}, {1U, 7U}, {65U, 1U}, {3U, 2U}}) {
    options.width = width;
    options.height = height;
    const BakeResult result = bake(source, pair.low, options);
    EXPECT_EQ(result.maps[0].image.pixels.size(), std::size_t{width} * height * 3);
    for (float value : result.maps[0].image.pixels) EXPECT_TRUE(std::isfinite(value));
  }
}

}  // namespace
}  // namespace kiln

// The two halves of a bake: a match alone, and maps, the caller's own values and padding from it.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <cstring>

#include "kiln/attribute.h"
#include "kiln/bake.h"
#include "kiln/render.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Scene {
  Mesh high = test::BumpySphere::dense(3000);
  Mesh low = test::BumpySphere::light(12, 8);
  Source source{*test::device(), high};
};

void expect_same(const BakeResult& a, const BakeResult& b) {
  ASSERT_EQ(a.maps.size(), b.maps.size());
  for (std::size_t m = 0; m < a.maps.size(); ++m) {
    ASSERT_EQ(a.maps[m].image.pixels.size(), b.maps[m].image.pixels.size());
    EXPECT_EQ(std::memcmp(a.maps[m].image.pixels.data(), b.maps[m].image.pixels.data(),
                          a.maps[m].image.pixels.size() * sizeof(float)),
              0)
        << a.maps[m].kind.name;
  }
  EXPECT_EQ(a.coverage, b.coverage);
}

TEST(MatchAlone, BothHalvesMakeWhatBakeMakes) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest, MatchMethod::views}) {
    BakeOptions options{.width = 64, .height = 48, .samples = 2};
    options.maps = {MapKind::normal, MapKind{"position"}, MapKind::mask};
    options.match.method = method;
    options.match.max_distance = Length::share(0.02);
    const BakeResult whole = bake(scene.source, scene.low, options);
    const MatchResult found = match(scene.source, scene.low, options);
    EXPECT_FALSE(found.cancelled);
    EXPECT_EQ(found.report.samples, whole.report.samples);
    EXPECT_EQ(found.report.missed, whole.report.missed);
    EXPECT_EQ(found.report.mean_abs_distance, whole.report.mean_abs_distance);
    expect_same(bake(found.match, scene.source, scene.low, options), whole);
  }
}

TEST(MatchAlone, IsWhatBakeKeeps) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  BakeOptions options{.width = 40, .height = 40, .samples = 3};
  options.match.fallback = {MatchMethod::closest};
  const Match alone = match(scene.source, scene.low, options).match;
  options.report.keep_match = true;
  const Match kept = *bake(scene.source, scene.low, options).match;
  EXPECT_EQ(alone.triangle, kept.triangle);
  EXPECT_EQ(alone.status, kept.status);
  EXPECT_EQ(alone.u, kept.u);
  EXPECT_EQ(alone.v, kept.v);
  EXPECT_EQ(alone.distance, kept.distance);
  EXPECT_EQ(alone.source_hash, kept.source_hash);
  EXPECT_EQ(alone.low_hash, kept.low_hash);
}

TEST(MatchAlone, RefusesWhatIsAboutMaps) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  BakeOptions options{.width = 8, .height = 8};
  const Match found = match(scene.source, scene.low, options).match;
  BakeOptions again = options;
  again.match.saved = &found;
  EXPECT_THROW(match(scene.source, scene.low, again), Error);
  EXPECT_THROW(bake(found, scene.source, scene.low, again), Error);
  BakeOptions clusters = options;
  clusters.match.method = MatchMethod::visibility;
  clusters.match.visibility.clusters = 2;
  EXPECT_THROW(match(scene.source, scene.low, clusters), Error);
}

TEST(MatchAlone, MapsAreFoundByName) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  BakeOptions options{.width = 16, .height = 16};
  options.maps = {MapKind::mask, MapKind::normal};
  const BakeResult result = bake(scene.source, scene.low, options);
  EXPECT_EQ(&result.map(MapKind::normal), &result.maps[1]);
  EXPECT_EQ(&result.map(MapKind{"mask"}), &result.maps[0]);
  EXPECT_EQ(result.find(MapKind{"height"}), nullptr);
  EXPECT_EQ(result.find(MapKind::mask, 1), nullptr);
  try {
    result.map(MapKind{"height"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.id(), "no-map");
    EXPECT_NE(std::string(error.what()).find("mask normal"), std::string::npos);
  }
}

/// Positions are values like any others: the map `position` is the oracle.
TEST(BakeAttribute, PositionsAreTheMapOfPositions) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  BakeOptions options{.width = 64, .height = 64, .samples = 2};
  options.maps = {MapKind{"position"}};
  options.encoding.miss = MissPolicy::mark;
  options.match.max_distance = Length::share(0.011);  // some samples miss
  options.encoding.raw = true;
  options.encoding.gutter = 3;
  const Match found = match(scene.source, scene.low, options).match;
  const BakeResult baked = bake(found, scene.source, scene.low, options);
  const auto* const positions = &scene.high.positions[0].x;
  const BakedAttribute own =
      bake_attribute(found, scene.source, {positions, scene.high.positions.size() * 3}, 3,
                     {.unit_vectors = false, .padding = 3});
  ASSERT_EQ(own.image.pixels.size(), baked.maps[0].image.pixels.size());
  std::size_t baked_texels = 0, missed = 0;
  for (std::size_t t = 0; t < own.coverage.size(); ++t) {
    if (own.coverage[t] != static_cast<std::uint8_t>(TexelState::baked)) {
      missed += own.coverage[t] == static_cast<std::uint8_t>(TexelState::missed) ? 1 : 0;
      continue;
    }
    ++baked_texels;
    ASSERT_EQ(baked.coverage[t], own.coverage[t]);
    for (std::size_t c = 0; c < 3; ++c) {
      // Positions of about 1 in a frame of single precision: a few of its units.
      ASSERT_NEAR(own.image.pixels[3 * t + c], baked.maps[0].image.pixels[3 * t + c], 1e-6);
    }
  }
  EXPECT_GT(baked_texels, 1000U);
  EXPECT_GT(missed, 10U);
}

TEST(BakeAttribute, ValuesOfALinearFunctionComeBack) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(4, 4);
  const Source source(*test::device(), plane);
  const Match found = match(source, plane, {.width = 32, .height = 32}).match;
  std::vector<float> values;
  for (const Vec3& p : plane.positions) values.push_back(3 * p.x - p.y + 2);
  const BakedAttribute own = bake_attribute(found, source, values, 1, {.padding = 0});
  for (std::size_t y = 0; y < 32; ++y) {
    for (std::size_t x = 0; x < 32; ++x) {
      const double px = (static_cast<double>(x) + 0.5) / 32 - 0.5;
      const double py = 0.5 - (static_cast<double>(y) + 0.5) / 32;
      ASSERT_NEAR(*own.image.at(x, y), 3 * px - py + 2, 2e-6);
    }
  }
}

TEST(BakeAttribute, VectorsAreMadeUnit) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  const Match found = match(scene.source, scene.low, {.width = 24, .height = 24}).match;
  const auto* const positions = &scene.high.positions[0].x;
  const BakedAttribute own = bake_attribute(
      found, scene.source, {positions, scene.high.positions.size() * 3}, 3, {.unit_vectors = true});
  for (std::size_t t = 0; t < own.coverage.size(); ++t) {
    if (own.coverage[t] != static_cast<std::uint8_t>(TexelState::baked)) continue;
    const float* v = &own.image.pixels[3 * t];
    EXPECT_NEAR(std::hypot(v[0], v[1], v[2]), 1, 1e-6);
  }
}

TEST(BakeAttribute, RefusesOtherNumbersOfValues) {
  KILN_REQUIRE_DEVICE();
  const Scene scene;
  const Match found = match(scene.source, scene.low, {.width = 8, .height = 8}).match;
  const auto id = [&](std::size_t count, std::uint32_t channels) {
    const std::vector<float> values(count);
    try {
      bake_attribute(found, scene.source, values, channels);
    } catch (const Error& error) {
      return std::string(error.id());
    }
    return std::string();
  };
  const std::size_t vertices = scene.high.positions.size();
  EXPECT_EQ(id(vertices, 1), "");
  EXPECT_EQ(id(vertices - 1, 1), "attribute-size");
  EXPECT_EQ(id(vertices, 2), "attribute-size");
  EXPECT_EQ(id(0, 0), "attribute-channels");
  EXPECT_EQ(id(vertices * 5, 5), "attribute-channels");
}

/// The nearest baked texel, by looking at all of them.
TEST(FillPadding, TakesTheNearestBakedTexel) {
  KILN_REQUIRE_DEVICE();
  const bool passed = rc::check([] {
    const auto width = *rc::gen::inRange(1, 20), height = *rc::gen::inRange(1, 20);
    const auto reach = *rc::gen::inRange(0, 6);
    const auto size = static_cast<std::size_t>(width * height);
    Image image{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1,
                std::vector<float>(size)};
    std::vector<std::uint8_t> coverage(size);
    for (std::size_t i = 0; i < size; ++i) {
      coverage[i] = *rc::gen::inRange(0, 6) == 0 ? 1 : 0;
      if (coverage[i] == 1) image.pixels[i] = static_cast<float>(i + 1);
    }
    Image padded = image;
    std::vector<std::uint8_t> states = coverage;
    const std::uint64_t filled = fill_padding(*test::device(), padded, states, {.texels = reach});
    std::uint64_t expected = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto i = static_cast<std::size_t>(y * width + x);
        float value = image.pixels[i];
        int nearest = reach * reach + 1;
        for (int b = 0; coverage[i] == 0 && b < width * height; ++b) {
          const int dx = b % width - x, dy = b / width - y;
          if (coverage[static_cast<std::size_t>(b)] == 1 && dx * dx + dy * dy < nearest) {
            nearest = dx * dx + dy * dy;
            value = image.pixels[static_cast<std::size_t>(b)];
          }
        }
        const bool is_filled = coverage[i] == 0 && nearest <= reach * reach;
        expected += is_filled ? 1 : 0;
        RC_ASSERT(padded.pixels[i] == value);
        RC_ASSERT(states[i] == (is_filled ? 3 : coverage[i]));
      }
    }
    RC_ASSERT(filled == expected);
  });
  EXPECT_TRUE(passed);
}

TEST(FillPadding, RefusesWhatDoesNotFit) {
  KILN_REQUIRE_DEVICE();
  Image image{4, 4, 3, std::vector<float>(48)};
  std::vector<std::uint8_t> coverage(15);
  const auto id = [&](const PaddingOptions& options) {
    try {
      fill_padding(*test::device(), image, coverage, options);
    } catch (const Error& error) {
      return std::string(error.id());
    }
    return std::string();
  };
  EXPECT_EQ(id({}), "padding-size");
  coverage.resize(16);
  EXPECT_EQ(id({}), "");
  EXPECT_EQ(id({.texels = -2}), "padding-range");
  EXPECT_EQ(id({.texels = 16385}), "padding-range");
  image.pixels.pop_back();
  EXPECT_EQ(id({}), "padding-size");
}

}  // namespace
}  // namespace kiln

// Settings that ambient occlusion, bent normals and thickness depend on, and others that they do not; misses, blends, sessions, errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "bake/layers.h"
#include "detail/occlusion_scene.h"
#include "kiln/session.h"
#include "source/high_poly.h"

namespace kiln {
namespace {

using test::add_disc;
using test::asking;
using test::ground;
using test::map_of;

const std::vector<MapKind> kAll = {MapKind{"ao"}, MapKind{"bent_normal"}, MapKind{"thickness"}};

/// Correspondences along +Z, at heights from `low` to `high` over the low poly.
DeviceCorrespondence look(const Source::Impl& source, const TexelBand& band, float low,
                          float high) {
  DeviceCorrespondence match(context_of(source.device), band.capacity);
  RayQuery query;
  query.t_min = low * static_cast<float>(source.frame.scale);
  query.t_max = high * static_cast<float>(source.frame.scale);
  source.rays().intersect(band.points, band.sample_count, band.capacity, query, match);
  return match;
}

/// Bakes in bands of up to so many samples. \returns the maps' values
std::vector<std::vector<float>> in_bands(const Source::Impl& source, const Mesh& low,
                                         const BakeOptions& options, std::uint32_t samples,
                                         std::uint32_t* bands = nullptr) {
  const LowSurface surface = LowSurface::of(low, source.frame);
  TexelSampler sampler(context_of(source.device), surface,
                       {options.width, options.height, options.samples, samples});
  Layers layers(source, surface, options);
  if (bands != nullptr) *bands = sampler.band_count();
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    const TexelBand band = sampler.sample(b);
    layers.invalidate_band_results();
    layers.run(band, look(source, band, -0.1F, 0.1F));
  }
  std::vector<std::vector<float>> values;
  for (const Layer& layer : layers.all()) values.push_back(layer.image.pixels);
  return values;
}

TEST(OcclusionParts, BandsAndPiecesChangeNoByte) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(7, 7, 2, 2);
  add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high);
  BakeOptions options = asking(kAll, 97);
  options.samples = 2;
  options.occlusion.rays = 75;  // odd, and more than one launch of a piece holds
  std::uint32_t one = 0, several = 0;
  // 37,636 samples: three pieces of one band, or bands of one piece each, the last lanes of which are padded.
  const auto whole = in_bands(impl_of(source), ground(1), options, 1 << 20, &one);
  const auto parts = in_bands(impl_of(source), ground(1), options, 3000, &several);
  EXPECT_EQ(one, 1U);
  EXPECT_GT(several, 4U);
  ASSERT_EQ(whole.size(), 3U);
  EXPECT_EQ(whole, parts);
  // ... and those of a bake.
  const BakeResult baked = bake(source, ground(1), options);
  for (std::size_t m = 0; m < 3; ++m) EXPECT_EQ(baked.maps[m].image.pixels, whole[m]);
}

TEST(OcclusionParts, TraversalsAndOtherMapsChangeNoByte) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(20, 20, 2, 2);
  add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Mesh low = ground(1);
  BakeOptions options = asking(kAll, 40);
  options.occlusion.rays = 33;
  const BakeResult cpu = bake(Source(*test::device(), high, RayTraversal::cpu), low, options);
  const BakeResult gpu = bake(Source(*test::device(), high, RayTraversal::gpu), low, options);
  for (std::size_t m = 0; m < kAll.size(); ++m) {
    EXPECT_EQ(cpu.maps[m].image.pixels, gpu.maps[m].image.pixels) << kAll[m].name;
    options.maps = {kAll[m]};
    const BakeResult alone = bake(Source(*test::device(), high), low, options);
    EXPECT_EQ(cpu.maps[m].image.pixels, alone.maps[0].image.pixels) << kAll[m].name;
  }
  // Something is there to be seen: the disc's shade.
  std::size_t shaded = 0;
  for (std::size_t i = 0; i < cpu.coverage.size(); ++i) {
    const float open = map_of(cpu, "ao").pixels[i];
    shaded += cpu.coverage[i] == kCoverageBaked && open > 0.5F && open < 0.98F ? 1 : 0;
  }
  EXPECT_GT(shaded, 100U);
}

// Many rays of few samples are cast sample by sample, but not where bent normals ask for their directions.
TEST(OcclusionParts, OrderOfRaysChangesNoByte) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(20, 20, 2, 2);
  add_disc(high, {0.1F, 0, 0.3F}, 0.3F, false);
  const Source source(*test::device(), high), scalars(*test::device(), high, RayTraversal::gpu);
  // 513: not in whole lanes, and a launch does not hold all of a piece. From 2049 on in two blocks.
  for (const std::uint32_t rays : {512U, 513U, 2049U, 4095U}) {
    BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}}, rays > 2048 ? 20 : 50);
    options.occlusion.rays = rays;
    const BakeResult both = bake(source, ground(1), options);
    options.maps = {MapKind{"ao"}};
    const BakeResult alone = bake(source, ground(1), options);
    EXPECT_EQ(map_of(alone, "ao").pixels, map_of(both, "ao").pixels) << rays;
    const BakeResult gpu = bake(scalars, ground(1), options);
    EXPECT_EQ(map_of(alone, "ao").pixels, map_of(gpu, "ao").pixels) << rays;
    const std::vector<float>& open = map_of(alone, "ao").pixels;
    EXPECT_LT(*std::min_element(open.begin(), open.end()), 0.8F);
  }
}

TEST(OcclusionParts, OneRay) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(3, 3, 6, 6);
  add_disc(high, {0, 0, 0.5F}, 0.5F, false);
  BakeOptions options = asking(kAll, 64);
  options.occlusion.rays = 1;
  const BakeResult baked = bake(Source(*test::device(), high), ground(0.01), options);
  double mean = 0;
  for (const float value : map_of(baked, "ao").pixels) {
    EXPECT_TRUE(value == 0.0F || value == 1.0F);
    mean += value / 4096;
  }
  // Half of the disk lies under the disc. In each of the 8 sets the ray has a height of its own.
  EXPECT_NEAR(mean, 0.5, 0.05);
  for (std::size_t i = 0; i < 4096; ++i) {
    const float* bent = &map_of(baked, "bent_normal").pixels[3 * i];
    const bool open = map_of(baked, "ao").pixels[i] != 0;
    // The one open ray, which leans by 45 degrees or more; or the normal.
    if (open) {
      EXPECT_LT(bent[2], 0.71F);
    } else {
      EXPECT_NEAR(bent[2], 1, 1e-6);
    }
  }
}

TEST(OcclusionParts, MissesSeeFromTheLowPoly) {
  KILN_REQUIRE_DEVICE();
  Mesh high;
  high.name = "half a floor under a disc";
  test::add_rectangle(high, {-2, -2, 0}, {2, 0, 0}, {0, 4, 0});
  add_disc(high, {0, 0, 0.5F}, 0.5F, false);
  const Source source(*test::device(), high);
  BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}}, 16);
  options.occlusion.rays = 1024;
  const BakeResult kept = bake(source, ground(0.5), options);
  options.encoding.miss = MissPolicy::mark;
  const BakeResult marked = bake(source, ground(0.5), options);
  std::size_t missed = 0;
  for (std::size_t y = 0; y < 16; ++y) {
    for (std::size_t x = 8; x < 16; ++x) {
      const std::size_t i = 16 * y + x, mirrored = 16 * y + 15 - x;
      missed += kept.coverage[i] == kCoverageMissed ? 1 : 0;
      // The scene is its own mirror image but for the floor, which rays upward do not meet.
      EXPECT_NEAR(map_of(kept, "ao").pixels[i], map_of(kept, "ao").pixels[mirrored], 0.02);
      EXPECT_GT(map_of(kept, "ao").pixels[i], 0.4F);
      EXPECT_LT(map_of(kept, "ao").pixels[i], 0.8F);
      EXPECT_EQ(map_of(marked, "bent_normal").pixels[3 * i], 1.0F);
      EXPECT_EQ(map_of(marked, "bent_normal").pixels[3 * i + 1], -1.0F);
    }
    // The points found do not depend on what is done with misses.
    for (std::size_t x = 0; x < 8; ++x) {
      EXPECT_EQ(map_of(kept, "ao").pixels[16 * y + x], map_of(marked, "ao").pixels[16 * y + x]);
    }
  }
  EXPECT_EQ(missed, 128U);
}

/// Two sheets, the lower one in the upper one's shade: matches that find one each are mixed by shares.
TEST(OcclusionParts, BlendsMixValues) {
  KILN_REQUIRE_DEVICE();
  Mesh high;
  high.name = "two sheets";
  test::add_rectangle(high, {-1, -1, 0.1F}, {1, 0, 0}, {0, 2, 0});
  test::add_rectangle(high, {-1, -1, -0.1F}, {2, 0, 0}, {0, 2, 0});
  const Source opened(*test::device(), high);
  const Source::Impl& source = impl_of(opened);
  cl::Context& context = context_of(source.device);
  BakeOptions options = asking(kAll, 24);
  options.encoding.space = NormalMapSpace::object;
  options.occlusion.distance = Length::absolute(0.5);
  const LowSurface surface = LowSurface::of(ground(1), source.frame);
  TexelSampler sampler(context, surface, {options.width, options.height, 1, 1 << 20});
  const TexelBand band = sampler.sample(0);
  const DeviceCorrespondence above = look(source, band, 0.05F, 0.15F);
  const DeviceCorrespondence below = look(source, band, -0.15F, -0.05F);
  const auto values = [&](const std::function<void(Layers&)>& run) {
    Layers layers(source, surface, options);
    run(layers);
    std::vector<std::vector<float>> all;
    for (const Layer& layer : layers.all()) all.push_back(layer.image.pixels);
    return all;
  };
  const auto only_below = values([&](Layers& layers) { layers.run(band, below); });
  const auto only_above = values([&](Layers& layers) { layers.run(band, above); });
  cl::Array<float> shares(context, band.capacity);
  context.fill(shares, 0.25F);
  // The upper sheet ends in the middle: no other value to mix there. Twice: nothing is left over.
  const auto mixed = values([&](Layers& layers) {
    layers.run(band, above);
    layers.run_blended(band, below, above, shares);
  });
  std::size_t differ = 0;
  for (std::size_t i = 0; i < 24 * 24; ++i) {
    const bool both = i % 24 < 12;
    for (const std::size_t m : {std::size_t{0}, std::size_t{2}}) {
      const float other = both ? only_above[m][i] : only_below[m][i];
      EXPECT_EQ(mixed[m][i], both ? only_below[m][i] * 0.25F + other * 0.75F : other) << i;
      if (both && std::abs(only_below[m][i] - other) > 0.1F) ++differ;
    }
    std::array<double, 3> sum{};
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] = both ? only_below[1][3 * i + c] * 0.25 + only_above[1][3 * i + c] * 0.75
                    : only_below[1][3 * i + c];
    }
    const double size = std::hypot(sum[0], sum[1], sum[2]);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(mixed[1][3 * i + c], sum[c] / size, 1e-6);
  }
  EXPECT_GT(differ, 200U);
}

TEST(OcclusionParts, SessionsFollowPositionsAndNormals) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(12, 12);
  high.normals.clear();
  for (Vec3& p : high.positions) {
    p.z = 0.02F * std::sin(9 * p.x);
    high.normals.push_back({0, 0, 1});
  }
  high.normal_triangles = high.triangles;
  BakeOptions options = asking(kAll, 32);
  options.maps.push_back(MapKind::normal);
  options.occlusion.rays = 40;
  options.match.max_distance = Length::absolute(0.2);
  SessionOptions within;
  within.bounds = Bounds{{-0.5, -0.5, -0.25}, {0.5, 0.5, 0.25}};
  BakeSession session(*test::device(), high, ground(1), options, within);
  std::vector<std::vector<float>> before;
  for (const int step : {0, 1, 2}) {
    if (step == 1) {
      std::vector<Vec3> moved(high.positions.begin() + 40, high.positions.begin() + 60);
      for (Vec3& p : moved) p.z += 0.1F;
      session.set_positions(40, moved);
    }
    if (step == 2) session.set_normals(100, std::vector<Vec3>{{0.6F, 0, 0.8F}, {0, 0.6F, 0.8F}});
    const BakeResult& live = session.bake();
    const Source again(*test::device(), session.high(), RayTraversal::automatic, session.bounds());
    const BakeResult fresh = bake(again, ground(1), options);
    for (std::size_t m = 0; m < fresh.maps.size(); ++m) {
      EXPECT_EQ(live.maps[m].image.pixels, fresh.maps[m].image.pixels)
          << fresh.maps[m].kind.name << ", step " << step;
      if (step != 0 && m < 2) {
        EXPECT_NE(live.maps[m].image.pixels, before[m]) << step;
      }
    }
    before.clear();
    for (const BakedMap& map : live.maps) before.push_back(map.image.pixels);
  }
}

TEST(OcclusionParts, OptionsOutOfRangeAreErrors) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(2, 2));
  const auto expect_usage = [&](const OcclusionOptions& wrong, const char* named) {
    BakeOptions options = asking(kAll, 8);
    options.occlusion = wrong;
    try {
      bake(source, ground(1), options);
      FAIL() << named;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
    }
  };
  expect_usage({.rays = 0}, "occlusion.rays");
  expect_usage({.rays = 4097}, "occlusion.rays");
  expect_usage({.distance = Length::absolute(0)}, "occlusion.distance");
  expect_usage({.distance = Length::share(-0.1)}, "occlusion.distance");
  expect_usage({.distance = Length::absolute(std::nan(""))}, "occlusion.distance");
  // The ends of the range, and distances beyond what floats tell apart.
  for (const double distance : {1e-300, 1e300}) {
    BakeOptions options = asking(kAll, 4);
    options.occlusion.rays = 4096;
    options.occlusion.distance = Length::absolute(distance);
    const BakeResult baked = bake(source, ground(0.5), options);
    for (const float value : map_of(baked, "ao").pixels) EXPECT_EQ(value, 1.0F);
    for (const float value : map_of(baked, "thickness").pixels) EXPECT_EQ(value, 1.0F);
  }
}

TEST(OcclusionParts, OccludeByWhatIsAskedFor) {
  KILN_REQUIRE_DEVICE();
  // A floor, and a disc above it that is either part of the high poly, or another mesh: the same shade.
  const Mesh floor = test::plane(5, 5, 2, 2);
  Mesh disc = test::plane(1, 1, 0.001, 0.001);
  disc.positions.clear();
  disc.triangles.clear();
  disc.normals.clear();
  disc.normal_triangles.clear();
  add_disc(disc, {0.1F, 0, 0.3F}, 0.3F, false);
  Mesh both = floor;
  add_disc(both, {0.1F, 0, 0.3F}, 0.3F, false);
  const Mesh low = ground(2);
  BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}, MapKind{"shadow"}}, 40);
  options.light = {{0.2F, 0, 1}, 8};
  Bounds bounds = Bounds::of(both);
  const Source alone(*test::device(), floor, RayTraversal::automatic, bounds);
  const BakeResult joined =
      bake(Source(*test::device(), both, RayTraversal::automatic, bounds), low, options);
  const BakeResult open = bake(alone, low, options);
  options.occlusion.by_others = {&disc};
  const BakeResult beside = bake(alone, low, options);
  EXPECT_EQ(map_of(beside, "ao").pixels, map_of(joined, "ao").pixels);
  EXPECT_EQ(map_of(beside, "bent_normal").pixels, map_of(joined, "bent_normal").pixels);
  EXPECT_EQ(map_of(beside, "shadow").pixels, map_of(joined, "shadow").pixels);
  EXPECT_NE(map_of(open, "ao").pixels, map_of(joined, "ao").pixels);
  // Without the floor itself nothing else changes: it is flat.
  options.occlusion.by_high = false;
  EXPECT_EQ(map_of(bake(alone, low, options), "ao").pixels, map_of(joined, "ao").pixels);
  // The low poly lies 0.5 above the floor, and hides the sky.
  Mesh lid = ground(2);
  for (Vec3& p : lid.positions) p.z = 0.05F;
  options.occlusion = {};
  options.occlusion.by_low = true;
  const BakeResult under = bake(alone, lid, options);
  const std::vector<float>& dark = map_of(under, "ao").pixels;
  EXPECT_LT(dark[20 * 40 + 20], 0.1F);
  options.occlusion.by_low = options.occlusion.by_high = false;
  EXPECT_THROW(bake(alone, lid, options), Error);
}

}  // namespace
}  // namespace kiln

// Chains of low polys: each within the error at its size, each lighter than the one before.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "kiln/measure.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A sphere with waves that only near views show.
Mesh wavy(std::uint32_t level = 5) {
  Mesh mesh = test::icosphere(level);
  for (Vec3& p : mesh.positions) {
    const float scale = 1 + 0.01F * (std::sin(30 * p.x) + std::sin(30 * p.y) + std::sin(30 * p.z));
    p = {p.x * scale, p.y * scale, p.z * scale};
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

LodOptions lod_options(double max_error, std::uint32_t screen, std::uint32_t levels) {
  LodOptions options;
  options.plan.max_error = max_error;
  options.plan.screen = screen;
  options.plan.bake.width = options.plan.bake.height = 256;
  options.plan.choose_match = false;
  options.levels = levels;
  return options;
}

/// Error of pictures three times as fine as the screen, normals averaged over its pixels.
double on_screen(const Mesh& high, const Mesh& low, const Image& map, NormalMapSpace space,
                 std::uint32_t screen) {
  RenderOptions options;
  options.size = 3 * screen;
  options.frame = &high;
  options.zoom =
      1 / 0.92;  // A size on screen is the mesh's own: without the margin of 4% on each side.
  options.samples = 1;
  options.show_normals = true;
  const auto draw = [&](const Scene& scene, const ViewAngles& view) {
    options.azimuth_degrees = view.azimuth_degrees;
    options.elevation_degrees = view.elevation_degrees;
    const Image fine = scene.draw(options);
    Image mean{screen, screen, 3, std::vector<float>(std::size_t{3} * screen * screen)};
    for (std::uint32_t y = 0; y < screen; ++y) {
      for (std::uint32_t x = 0; x < screen; ++x) {
        double sum[3] = {0, 0, 0};
        bool whole = true;
        for (std::uint32_t i = 0; i < 9; ++i) {
          const std::size_t at = std::size_t{3 * y + i / 3} * 3 * screen + 3 * x + i % 3;
          const float* p = &fine.pixels[at * fine.channels];
          whole = whole && (p[0] != 0 || p[1] != 0 || p[2] != 0);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += 2.0 * p[c] - 1;
        }
        const double size = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
        for (std::size_t c = 0; c < 3 && whole && size > 0; ++c) {
          mean.pixels[3 * (std::size_t{y} * screen + x) + c] =
              static_cast<float>(0.5 + 0.5 * sum[c] / size);
        }
      }
    }
    return mean;
  };
  const Scene dense(*test::device(), high);
  const Scene simple(*test::device(), low, {&map, space});
  NormalComparison comparison;
  for (const Vec3& toward : held_out_views(kPlanViews, spread_views(12))) {
    const ViewAngles view = view_angles(toward);
    comparison.add(draw(dense, view), draw(simple, view));
  }
  return comparison.error().mean_degrees;
}

/// Checks of every chain.
void expect_chain(const LodChain& chain, const LodOptions& options) {
  ASSERT_FALSE(chain.cancelled);
  ASSERT_FALSE(chain.levels.empty());
  EXPECT_EQ(chain.levels.size() + chain.warnings.size(), options.levels);
  EXPECT_EQ(chain.levels.front().screen, options.plan.screen);
  EXPECT_TRUE(chain.reached);
  for (std::size_t k = 0; k < chain.levels.size(); ++k) {
    const LodLevel& level = chain.levels[k];
    EXPECT_LE(level.plan.chosen.measured, options.plan.max_error) << k;
    EXPECT_EQ(level.plan.low.triangles.size(), level.plan.chosen.faces);
    if (k == 0) continue;
    const LodLevel& before = chain.levels[k - 1];
    EXPECT_LE(2 * level.screen, before.screen);
    EXPECT_LE(level.plan.chosen.faces, before.plan.chosen.faces);
    EXPECT_LT(level.plan.chosen.bytes.total(), before.plan.chosen.bytes.total());
  }
}

TEST(Lods, EachLevelIsThePlanForItsSize) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = wavy(4);
  const Source source(*test::device(), high);
  LodOptions options = lod_options(3, 128, 2);
  // Each level has its share of the progress, and says which one it is.
  std::array<int, 2> calls{};
  options.plan.bake.progress = [&](double done, std::string_view stage) {
    const std::size_t level = stage.substr(0, 8) == "level 0:" ? 0 : 1;
    EXPECT_EQ(stage.substr(0, 8), level == 0 ? "level 0:" : "level 1:");
    EXPECT_GE(done, 0.5 * static_cast<double>(level));
    EXPECT_LE(done, 0.5 * static_cast<double>(level + 1));
    ++calls[level];
    return true;
  };
  const LodChain chain = bake_lods(source, high, options);
  EXPECT_GT(calls[0], 0);
  EXPECT_GT(calls[1], 0);
  options.plan.bake.progress = {};
  expect_chain(chain, options);
  ASSERT_EQ(chain.levels.size(), 2U);
  for (const LodLevel& level : chain.levels) {
    LowPolyPlanOptions plan = options.plan;
    plan.screen = level.screen;
    const LowPolyPlan alone = plan_low_poly(source, high, plan);
    EXPECT_TRUE(level.own_maps);
    EXPECT_EQ(level.plan.low.positions, alone.low.positions);
    EXPECT_EQ(level.plan.low.uvs, alone.low.uvs);
    EXPECT_EQ(level.plan.chosen.measured, alone.chosen.measured);
    EXPECT_EQ(level.plan.drawn.pixels, alone.drawn.pixels);
  }
}

TEST(Lods, LetErrorsGrow) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = wavy(4);
  const Source source(*test::device(), high);
  LodOptions options = lod_options(3, 128, 3);
  options.error_growth = 2;
  options.plan.max_outline = 0.01;
  for (const bool share : {false, true}) {
    options.share_uvs = share;
    const LodChain chain = bake_lods(source, high, options);
    ASSERT_EQ(chain.levels.size(), 3U) << share;
    EXPECT_TRUE(chain.reached);
    EXPECT_TRUE(chain.warnings.empty());
    for (std::size_t k = 0; k < 3; ++k) {
      const LowPolyPlan& plan = chain.levels[k].plan;
      EXPECT_EQ(plan.wanted, 3.0 * (1U << k));
      EXPECT_LE(plan.chosen.measured, plan.wanted);
      EXPECT_EQ(plan.max_outline, 0.01 * (1U << k));
      EXPECT_LE(plan.chosen.silhouette_mismatch, plan.max_outline);
      if (k == 0) continue;
      // The allowance is used: within the bounds of the level before, more faces would be needed.
      const LowPolyPlan& before = chain.levels[k - 1].plan;
      EXPECT_TRUE(plan.chosen.measured > before.wanted ||
                  plan.chosen.silhouette_mismatch > before.max_outline)
          << share << k;
    }
  }
}

/// The bound of a map grows as the normals' does, and a level uses what it is allowed.
TEST(Lods, LetBoundsOfOtherMapsGrow) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = wavy(4);
  const Source source(*test::device(), high);
  const MapKind position{"position"};
  LodOptions options = lod_options(12, 128, 2);
  options.plan.may_leave_map_out = false;
  options.plan.bake.maps = {MapKind::normal, position};
  options.plan.bounds = {{position, 1}};
  const LodChain free = bake_lods(source, high, options);
  ASSERT_FALSE(free.levels.front().plan.bounds.empty());
  // Of what a map reaches that nothing bounds: so it is this bound that decides the size of the first level's.
  options.plan.bounds[0].max_error = 0.5 * free.levels.front().plan.bounds[0].error;
  options.error_growth = 2;
  const LodChain chain = bake_lods(source, high, options);
  ASSERT_EQ(chain.levels.size(), 2U);
  EXPECT_TRUE(chain.reached);
  for (std::size_t k = 0; k < chain.levels.size(); ++k) {
    const LowPolyPlan& plan = chain.levels[k].plan;
    ASSERT_EQ(plan.bounds.size(), 1U) << k;
    EXPECT_EQ(plan.bounds[0].kind, position) << k;
    EXPECT_EQ(plan.bounds[0].wanted, options.plan.bounds[0].max_error * (1U << k)) << k;
    EXPECT_LE(plan.bounds[0].error, plan.bounds[0].wanted) << k;
    if (k == 0) continue;
    EXPECT_GT(plan.bounds[0].error, chain.levels[k - 1].plan.bounds[0].wanted)
        << "within the bound of the level before, level " << k << " would be heavier";
  }
}

/// Levels that share UVs have HIGH's colours as the first level has them.
TEST(Lods, ColoursFollowLevelsThatShareUvs) {
  KILN_REQUIRE_DEVICE();
  Mesh high = wavy(4);
  // A ramp of light along x, and of opacity along y.
  const auto share = [](float at) { return std::clamp(0.5 + 0.4 * at, 0.0, 1.0); };
  const auto encoded = [](double linear) { return 1.055 * std::pow(linear, 1 / 2.4) - 0.055; };
  for (const Vec3& p : high.positions) {
    high.colors.push_back({static_cast<std::uint8_t>(std::lround(255 * encoded(share(p.x)))), 255,
                           0, static_cast<std::uint8_t>(std::lround(255 * share(p.y)))});
  }
  const Source source(*test::device(), high);
  LodOptions options = lod_options(6, 96, 3);
  options.share_uvs = true;
  const LodChain chain = bake_lods(source, high, options);
  ASSERT_GE(chain.levels.size(), 2U);
  for (std::size_t k = 0; k < chain.levels.size(); ++k) {
    const Mesh& low = chain.levels[k].plan.low;
    ASSERT_EQ(low.colors.size(), low.positions.size()) << k;
    double sum = 0;
    for (std::size_t v = 0; v < low.positions.size(); ++v) {
      const Vec3& p = low.positions[v];
      const auto& [r, g, b, a] = low.colors[v];
      EXPECT_EQ(g, 255) << k;
      EXPECT_EQ(b, 0) << k;
      sum += std::abs(r / 255.0 - encoded(share(p.x))) + std::abs(a / 255.0 - share(p.y));
    }
    // Vertices of coarse levels stand for a fifth of the sphere's radius around them: 0.04 of a ramp on either side.
    EXPECT_LT(sum / static_cast<double>(low.positions.size()), 0.08) << k;
  }
}

TEST(Lods, OneMapServesAllLevels) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = wavy();
  const Source source(*test::device(), high);
  LodOptions options = lod_options(6, 96, 3);
  options.share_uvs = true;
  options.plan.bake.encoding.space = NormalMapSpace::object;
  const LodChain chain = bake_lods(source, high, options);
  expect_chain(chain, options);
  ASSERT_GE(chain.levels.size(), 2U);
  const LowPolyPlan& first = chain.levels.front().plan;
  ASSERT_TRUE(first.result.has_value());
  for (const LodLevel& level : chain.levels) {
    const Mesh& low = level.plan.low;
    EXPECT_EQ(level.own_maps, &level == &chain.levels.front());
    EXPECT_EQ(level.plan.result.has_value(), level.own_maps);
    const double seen = on_screen(high, low, first.drawn, NormalMapSpace::object, level.screen);
    EXPECT_NEAR(seen, level.plan.chosen.measured, 0.02 * options.plan.max_error) << level.screen;
    // A place of the map is the same place of the surface, but for what was simplified.
    double farthest = 0;
    for (std::size_t t = 0; t < low.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        const Vec2 uv = low.uvs[low.uv_triangles[t][c]];
        const Vec3 p = low.positions[low.triangles[t][c]];
        double nearest = 10;
        for (std::size_t s = 0; s < first.low.triangles.size(); ++s) {
          const auto& u = first.low.uv_triangles[s];
          const Vec2 a = first.low.uvs[u[0]], b = first.low.uvs[u[1]], d = first.low.uvs[u[2]];
          const double area =
              (double{b.x} - a.x) * (double{d.y} - a.y) - (double{d.x} - a.x) * (double{b.y} - a.y);
          const double v = ((double{uv.x} - a.x) * (double{d.y} - a.y) -
                            (double{d.x} - a.x) * (double{uv.y} - a.y)) /
                           area;
          const double w = ((double{b.x} - a.x) * (double{uv.y} - a.y) -
                            (double{uv.x} - a.x) * (double{b.y} - a.y)) /
                           area;
          if (v < -0.05 || w < -0.05 || v + w > 1.05) continue;
          const auto& q = first.low.triangles[s];
          const Vec3 x = first.low.positions[q[0]], y = first.low.positions[q[1]],
                     z = first.low.positions[q[2]];
          nearest = std::min(nearest, std::hypot(x.x + v * (y.x - x.x) + w * (z.x - x.x) - p.x,
                                                 x.y + v * (y.y - x.y) + w * (z.y - x.y) - p.y,
                                                 x.z + v * (y.z - x.z) + w * (z.z - x.z) - p.z));
        }
        farthest = std::max(farthest, nearest);
      }
    }
    EXPECT_LT(farthest, 0.3) << level.screen;  // of a sphere of radius 1
  }
}

TEST(Lods, LeavesOutWhatWouldHardlyBeLighter) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::icosphere(4);
  const Source source(*test::device(), high);
  const LodOptions options = lod_options(6, 512, 4);
  const LodChain chain = bake_lods(source, high, options);
  expect_chain(chain, options);
  ASSERT_LT(chain.levels.size(), 4U);
  EXPECT_EQ(chain.warnings.front().code, "lod-left-out");
}

TEST(Lods, RefusesAndCancels) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000, true);
  const Source source(*test::device(), high);
  for (const auto& [screen, levels] :
       {std::pair{512U, 1U}, std::pair{512U, 9U}, std::pair{127U, 4U}, std::pair{0U, 2U}}) {
    EXPECT_THROW(bake_lods(source, high, lod_options(5, screen, levels)), Error) << screen;
  }
  LodOptions options = lod_options(5, 128, 2);
  for (const double growth : {0.9, 4.5, std::nan("")}) {
    options.error_growth = growth;
    EXPECT_THROW(bake_lods(source, high, options), Error) << growth;
  }
  options.error_growth = 1;
  int calls = 0;
  options.plan.bake.progress = [&](double, std::string_view) { return ++calls < 4; };
  EXPECT_TRUE(bake_lods(source, high, options).cancelled);
}

/// A chain that is stopped says so, in its first level as in those that are simplified from it.
TEST(Lods, CancelInEveryLevel) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = wavy(4);
  const Source source(*test::device(), high);
  for (const bool share_uvs : {false, true}) {
    for (const char* level : {"level 0", "level 1"}) {
      LodOptions options = lod_options(12, 64, 2);
      options.plan.bake.width = options.plan.bake.height = 64;
      options.share_uvs = share_uvs;
      bool is_stopped = false;
      options.plan.bake.progress = [&](double, std::string_view stage) {
        is_stopped = is_stopped || stage.starts_with(level);
        return !is_stopped;
      };
      const LodChain chain = bake_lods(source, high, options);
      EXPECT_TRUE(is_stopped) << level;
      EXPECT_TRUE(chain.cancelled) << level << ' ' << share_uvs;
    }
  }
}

}  // namespace
}  // namespace kiln

// Plans of faces, texels and match together: the error asked for, by few bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kiln/height_field.h"
#include "kiln/limits.h"
#include "kiln/measure.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "measure/normal_probe.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

LowPolyPlanOptions low_poly_options(double max_error, std::uint32_t size = 512) {
  LowPolyPlanOptions options;
  options.max_error = max_error;
  options.bake.width = options.bake.height = size;
  return options;
}

/// Error of rendered normals, by pictures that are drawn. Null map: the mesh's own normals.
double by_pictures(const Mesh& high, const Mesh& low, const Image* map) {
  std::vector<ViewAngles> views;
  for (const Vec3& toward : held_out_views(kPlanViews, spread_views(12))) {
    views.push_back(view_angles(toward));
  }
  const NormalReference reference(Scene(*test::device(), high), high, views, 96);
  return reference
      .compare(map != nullptr ? Scene(*test::device(), low, {map}) : Scene(*test::device(), low))
      .mean_degrees;
}

TEST(LowPolyPlan, ReachesTheErrorWithFewerBytesThanAGridFinds) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(8000, true);
  const Source source(*test::device(), high);
  const double wanted = 5;
  LowPolyPlanOptions options = low_poly_options(wanted);
  options.may_leave_map_out = false;
  const LowPolyPlan plan = plan_low_poly(source, high, options);
  ASSERT_TRUE(plan.reached);
  ASSERT_TRUE(plan.result.has_value());
  EXPECT_EQ(plan.wanted, wanted);
  EXPECT_LE(plan.chosen.measured, wanted);
  EXPECT_EQ(plan.low.triangles.size(), plan.chosen.faces);
  EXPECT_EQ(plan.chosen.vertices, split_vertices(plan.low));
  const BakedMap& map = plan.result->maps.front();
  EXPECT_EQ(map.image.width, plan.chosen.size);
  EXPECT_EQ(map.image.height, plan.chosen.size);
  const double seen = by_pictures(high, plan.low, &map.image);
  EXPECT_NEAR(seen, plan.chosen.measured, 0.04 * wanted);

  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint32_t size : {32U, 64U, 128U}) {
    for (std::uint32_t faces = 1200; faces >= 100; faces = faces * 3 / 4) {
      const Mesh low =
          unwrap(simplify(high, {.faces = faces}), {.method = UnwrapMethod::charts, .size = size});
      const LowPolyBytes bytes =
          low_poly_bytes(split_vertices(low), low.triangles.size(), size, {3}, plan.chosen.bits);
      if (bytes.total() >= plan.chosen.bytes.total()) continue;
      BakeOptions bake = plan.bake;
      bake.width = bake.height = size;
      const BakeResult result = kiln::bake(source, low, bake);
      if (by_pictures(high, low, &result.maps.front().image) >
          seen * wanted / plan.chosen.measured) {
        break;  // and so will fewer faces
      }
      least = std::min(least, bytes.total());
    }
  }
  EXPECT_LE(static_cast<double>(plan.chosen.bytes.total()), 1.1 * static_cast<double>(least));
}

TEST(LowPolyPlan, IsTheSameOnEveryRun) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  const LowPolyPlan first = plan_low_poly(source, high, low_poly_options(4, 256));
  EXPECT_LE(first.candidates.size(), 8U);
  for (const int threads : {1, 3}) {
    set_thread_limit(threads);
    const LowPolyPlan again = plan_low_poly(source, high, low_poly_options(4, 256));
    set_thread_limit(0);
    EXPECT_EQ(again.low.positions, first.low.positions);
    EXPECT_EQ(again.low.uvs, first.low.uvs);
    EXPECT_EQ(again.drawn.pixels, first.drawn.pixels);
    ASSERT_EQ(again.candidates.size(), first.candidates.size());
    for (std::size_t i = 0; i < first.candidates.size(); ++i) {
      EXPECT_EQ(again.candidates[i].measured, first.candidates[i].measured);
      EXPECT_EQ(again.candidates[i].expected, first.candidates[i].expected);
    }
  }
}

/// Two bumpy spheres, one just inside the other: coarse low polys stray far.
TEST(LowPolyPlan, SearchesAsFarAsTheLowPolyStrays) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(8000);
  const auto corners = static_cast<std::uint32_t>(high.positions.size());
  const std::size_t faces = high.triangles.size();
  for (std::uint32_t i = 0; i < corners; ++i) {
    const Vec3 p = high.positions[i];
    high.positions.push_back({0.99F * p.x, 0.99F * p.y, 0.99F * p.z});
  }
  for (std::size_t t = 0; t < faces; ++t) {
    const Triangle v = high.triangles[t];
    high.triangles.push_back({v[0] + corners, v[2] + corners, v[1] + corners});
  }
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(8, 128);
  options.may_leave_map_out = false;
  const LowPolyPlan plan = plan_low_poly(source, high, options);
  ASSERT_TRUE(plan.result.has_value());
  EXPECT_GT(plan.simplified.error, 0.02);
  EXPECT_LT(plan.result->report.missed, plan.result->report.samples / 50);
  ASSERT_TRUE(plan.bake.match.max_distance.has_value());

  // A distance that is asked for stays.
  options.bake.match.max_distance = Length::share(0.03);
  const LowPolyPlan asked = plan_low_poly(source, high, options);
  EXPECT_EQ(asked.result->report.max_distance, 0.03 * source.stats().diagonal);
}

TEST(LowPolyPlan, SaysWhatItTriedAndExpected) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(8);
  LowPolyPlan told;
  options.on_measured = [&](const LowPolyPlan& plan) { told = plan; };
  const LowPolyPlan plan = plan_low_poly(source, high, options);
  ASSERT_FALSE(plan.candidates.empty());
  EXPECT_EQ(told.chosen.measured, plan.chosen.measured);
  EXPECT_EQ(told.outlook.size(), plan.outlook.size());
  EXPECT_TRUE(
      std::any_of(plan.candidates.begin(), plan.candidates.end(), [&](const Candidate& candidate) {
        return candidate.faces == plan.chosen.faces && candidate.size == plan.chosen.size;
      }));
  for (const Candidate& candidate : plan.candidates) {
    EXPECT_GE(candidate.measured, 0);
    if (candidate.measured <= plan.wanted)
      EXPECT_GE(candidate.bytes.total(), plan.chosen.bytes.total());
  }
  EXPECT_TRUE(std::is_sorted(plan.trade.begin(), plan.trade.end(),
                             [](const auto& a, const auto& b) { return a.size < b.size; }));
  for (const Candidate& row : plan.trade) {
    EXPECT_LE(row.expected, plan.wanted);
    EXPECT_GE(row.faces, plan.levels.front().faces) << "coarser than all that was looked at";
    for (const Candidate& candidate : plan.candidates) {
      if (candidate.size == row.size && candidate.measured > plan.wanted)
        EXPECT_GT(row.faces, candidate.faces) << row.size;
    }
  }
  EXPECT_TRUE(std::is_sorted(plan.levels.begin(), plan.levels.end(),
                             [](const auto& a, const auto& b) { return a.faces < b.faces; }));
  EXPECT_GT(plan.levels.front().limit, plan.levels.back().limit);
  EXPECT_EQ(plan.outlook.size() % plan.levels.size(), 0U);
}

TEST(LowPolyPlan, LeavesTheMapOutWhereNoneIsNeeded) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::icosphere(5);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(8);
  const LowPolyPlan without = plan_low_poly(source, high, options);
  EXPECT_TRUE(without.reached);
  EXPECT_EQ(without.chosen.size, 0U);
  EXPECT_FALSE(without.result.has_value());
  EXPECT_EQ(without.chosen.bytes.texels, 0U);
  EXPECT_TRUE(without.low.uvs.empty());
  EXPECT_LE(by_pictures(high, without.low, nullptr), 8 * 1.04);
  options.may_leave_map_out = false;
  const LowPolyPlan with = plan_low_poly(source, high, options);
  EXPECT_TRUE(with.result.has_value());
  EXPECT_GE(with.chosen.size, 16U);
}

/// A ball with waves, two horns and two rows of teeth.
Mesh toothed_ball() {
  Mesh mesh = test::icosphere(5);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  const auto cone = [](const Vec3d& p, Vec3d tip, double width) {
    tip = tip * (1 / length(tip));
    return std::max(0.0, 1 - length(p - tip) / width);
  };
  for (Vec3& position : mesh.positions) {
    const Vec3d p(position.x, position.y, position.z);
    double scale = 1 + 0.03 * std::sin(9 * p.x) * std::cos(8 * p.y) * std::sin(7 * p.z);
    for (int k = 0; k < 20; ++k) {
      const double angle = -0.9 + 0.2 * (k % 10);
      scale += 0.22 * cone(p, {std::sin(angle), k < 10 ? -0.18 : -0.38, std::cos(angle)}, 0.07);
    }
    for (const double side : {-0.7, 0.7}) {
      scale += 0.7 * std::pow(cone(p, {side, 0.7, 0.1}, 0.22), 1.2);
    }
    position = to_float(p * scale);
  }
  return mesh;
}

/// Meshes without a map are an offer, not a reason to look at no map: the first mesh that a map is tried on may be
/// heavier than they are, while coarser ones with a map are lighter.
TEST(LowPolyPlan, ThatMayLeaveTheMapOutIsNoHeavier) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = toothed_ball();
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(11);
  const LowPolyPlan free = plan_low_poly(source, high, options);
  options.may_leave_map_out = false;
  const LowPolyPlan mapped = plan_low_poly(source, high, options);
  EXPECT_TRUE(free.reached);
  EXPECT_TRUE(mapped.reached);
  EXPECT_LE(free.chosen.bytes.total(), 1.08 * mapped.chosen.bytes.total())
      << free.chosen.faces << " faces, map of " << free.chosen.size << "; with a map "
      << mapped.chosen.faces << " and " << mapped.chosen.size;
}

TEST(LowPolyPlan, FarAwayItNeedsLess) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::icosphere(5);
  for (Vec3& p : high.positions) {
    const float scale = 1 + 0.004F * (std::sin(60 * p.x) + std::sin(60 * p.y) + std::sin(60 * p.z));
    p = {p.x * scale, p.y * scale, p.z * scale};
  }
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(4);
  const LowPolyPlan near = plan_low_poly(source, high, options);
  options.screen = 24;
  const LowPolyPlan far = plan_low_poly(source, high, options);
  EXPECT_TRUE(near.reached);
  EXPECT_TRUE(far.reached);
  EXPECT_LT(2 * far.chosen.bytes.total(), near.chosen.bytes.total());
}

/// The rounding of 8 bits is 0.16 degrees on average, and a texel of 16 bits weighs four times as much.
TEST(LowPolyPlan, TakesSixteenBitsOnlyWhereEightAskForMoreBytes) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(3000, true);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(0.4, 256);
  options.may_leave_map_out = false;
  const LowPolyPlan coarse = plan_low_poly(source, high, options);
  EXPECT_EQ(coarse.chosen.bits, 8U);
  options.bits = 16;
  const LowPolyPlan more = plan_low_poly(source, high, options);
  if (more.reached) EXPECT_TRUE(coarse.reached);
  EXPECT_LT(coarse.chosen.bytes.total(), more.chosen.bytes.total());
  options.bits = 0;
  options.max_error = 0.15;
  EXPECT_EQ(plan_low_poly(source, high, options).chosen.bits, 16U);
}

/// A size on screen is the mesh's, from every side: a ball is as wide as that. Boxes around it are wider.
TEST(LowPolyPlan, SizesOnScreenAreThoseOfTheMesh) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::icosphere(5));
  const auto extent = [&](const Picture& picture, const Vec3d& axis) {
    double low = 1e300, high = -1e300;
    for (const Vec3& p : impl_of(source).positions) {
      low = std::min(low, dot(to_double(p) - picture.center, axis));
      high = std::max(high, dot(to_double(p) - picture.center, axis));
    }
    EXPECT_NEAR(low + high, 0, 1e-5) << "in the middle";
    return high - low;
  };
  const HighPolyView shown = make_high_poly_view(impl_of(source), 50, plan_directions());
  ASSERT_EQ(shown.pictures.size(), kPlanViews);
  for (const Picture& picture : shown.pictures) {
    const double wide = std::max(extent(picture, picture.right), extent(picture, picture.up));
    EXPECT_NEAR(50 * picture.pixel_footprint, wide, 1e-5);
    EXPECT_NEAR(2 * picture.half_side, wide, 1e-5);
  }
}

TEST(LowPolyPlan, TellsHowFarOutlinesDiffer) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::icosphere(5));
  // With a size on screen and without.
  for (const std::uint32_t screen : {0U, 50U}) {
    const HighPolyView shown = make_high_poly_view(impl_of(source), screen, plan_directions());
    const auto share = [&](double radius) {
      const Mesh low = add_placeholder_uvs(test::icosphere(5, radius));
      const NormalError error = NormalProbe(impl_of(source), low, shown).without_map();
      EXPECT_GE(error.standard_error_degrees, 0);
      return error.one_sided_share;
    };
    EXPECT_EQ(share(1), 0);
    EXPECT_NEAR(share(0.9), 1 - 0.9 * 0.9, 0.01);
    EXPECT_NEAR(share(0.5), 1 - 0.5 * 0.5, 0.01);
  }
}

TEST(LowPolyPlan, ObeysWhatIsGiven) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(6000, true);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(5);
  options.choose_match = options.choose_samples = options.may_leave_map_out = false;
  options.bits = 16;
  options.bake.match.method = MatchMethod::closest;
  options.bake.samples = 2;
  options.bake.maps = {MapKind::normal, MapKind::mask};
  options.bake.encoding.raw = true;
  const LowPolyPlan plan = plan_low_poly(source, high, options);
  EXPECT_EQ(plan.chosen.method, MatchMethod::closest);
  EXPECT_EQ(plan.chosen.samples, 2U);
  EXPECT_EQ(plan.chosen.bits, 16U);
  ASSERT_TRUE(plan.result.has_value());
  ASSERT_EQ(plan.result->maps.size(), 2U);
  const auto& pixels = plan.result->maps.front().image.pixels;
  EXPECT_LT(*std::min_element(pixels.begin(), pixels.end()), 0.0F) << "not encoded into 0 to 1";
  EXPECT_EQ(plan.chosen.bytes.texels, low_poly_bytes(0, 0, plan.chosen.size, {3, 1}, 16).texels);
}

/// A plan of a height field is a mesh over its rectangle with its layout, whatever its size and place.
TEST(LowPolyPlan, OfHeightFieldsKeepTheirLayout) {
  KILN_REQUIRE_DEVICE();
  Image heights;
  heights.width = heights.height = 97;
  heights.channels = 1;
  for (std::uint32_t i = 0; i < 97 * 97; ++i) {
    const float x = static_cast<float>(i % 97) / 96, y = static_cast<float>(i / 97) / 96;
    heights.pixels.push_back(0.5F + 0.2F * std::sin(5 * x) * std::cos(4 * y) +
                             0.004F * std::sin(90 * x) * std::sin(80 * y));
  }
  const HeightFieldOptions extent{300, 200, 60};
  const Mesh high = height_field_mesh(heights, extent);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(4);
  options.height_field = true;
  options.may_leave_map_out = false;
  for (const bool choose : {true, false}) {
    options.choose_match = choose;
    options.bake.match.method = choose ? MatchMethod::ray : MatchMethod::uv;
    const LowPolyPlan plan = plan_low_poly(source, high, options);
    EXPECT_TRUE(plan.reached);
    EXPECT_LT(plan.low.triangles.size(), high.triangles.size() / 8);
    ASSERT_TRUE(plan.result.has_value());
    Mesh laid_out = plan.low;
    lay_out_over_height_field(laid_out, heights, extent);
    ASSERT_EQ(plan.low.uvs.size(), laid_out.uvs.size());
    std::size_t corners = 0;
    for (std::size_t v = 0; v < laid_out.uvs.size(); ++v) {
      const Vec2 &uv = plan.low.uvs[v], &wanted = laid_out.uvs[v];
      EXPECT_NEAR(uv.x, wanted.x, 1e-6);
      EXPECT_NEAR(uv.y, wanted.y, 1e-6);
      corners += (uv.x == 0 || uv.x == 1) && (uv.y == 0 || uv.y == 1) ? 1 : 0;
    }
    EXPECT_EQ(corners, 4U);
    EXPECT_EQ(plan.result->report.texels, std::uint64_t{plan.chosen.size} * plan.chosen.size);
  }
  Mesh upright = high;
  for (Vec3& p : upright.positions) p.y = 0;
  EXPECT_THROW(plan_low_poly(Source(*test::device(), upright), upright, options), Error);
}

TEST(LowPolyPlan, SaysWhereTheErrorIsOutOfReach) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000, true);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(1e-4, 32);
  options.may_leave_map_out = false;  // The high poly itself has hardly an error.
  const LowPolyPlan plan = plan_low_poly(source, high, options);
  EXPECT_FALSE(plan.reached);
  EXPECT_GT(plan.chosen.measured, 1e-4);
  EXPECT_TRUE(plan.trade.empty());
}

TEST(LowPolyPlan, RefusesAndCancels) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000, true);
  const Source source(*test::device(), high);
  const auto refuses = [&](const auto& change) {
    LowPolyPlanOptions options = low_poly_options(5);
    change(options);
    EXPECT_THROW(plan_low_poly(source, high, options), Error);
  };
  refuses([](LowPolyPlanOptions& o) { o.max_error = 0; });
  refuses([](LowPolyPlanOptions& o) { o.max_error = std::nan(""); });
  refuses([](LowPolyPlanOptions& o) { o.screen = 15; });
  refuses([](LowPolyPlanOptions& o) { o.bits = 9; });
  refuses([](LowPolyPlanOptions& o) { o.bake.width = 8; });
  refuses([](LowPolyPlanOptions& o) { o.bake.maps = {MapKind::mask}; });
  refuses([](LowPolyPlanOptions& o) { o.bake.match.method = MatchMethod::uv; });
  refuses([&](LowPolyPlanOptions& o) { o.bake.match.cage_mesh = &high; });
  LowPolyPlanOptions options = low_poly_options(5);
  options.bake.progress = [](double, std::string_view) { return false; };
  EXPECT_TRUE(plan_low_poly(source, high, options).cancelled);
}

TEST(LowPolyPlan, CountsBytes) {
  // 100 vertices of 24 bytes, 180 triangles of 6; 16 x 16 texels and a third.
  const LowPolyBytes bytes = low_poly_bytes(100, 180, 16, {3}, 8);
  EXPECT_EQ(bytes.vertices, 2400U + 1080U);
  EXPECT_EQ(bytes.texels, 342U);
  EXPECT_EQ(bytes.total(), bytes.vertices + bytes.texels);
  EXPECT_EQ(low_poly_bytes(100, 180, 0, {3}, 8).total(), 1600U + 1080U);
  // 16 bits hold indices up to 65534, since 65535 restarts a primitive.
  EXPECT_EQ(low_poly_bytes(65535, 1, 0, {}, 8).total(), 65535U * 16 + 6);
  EXPECT_EQ(low_poly_bytes(65536, 1, 0, {}, 8).total(), 65536U * 16 + 12);
  EXPECT_EQ(low_poly_bytes(0, 0, 16, {1}, 8).texels, 171U);
  EXPECT_EQ(low_poly_bytes(0, 0, 16, {3}, 16).texels, 1366U);
  Mesh mesh = test::cube();
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  EXPECT_EQ(split_vertices(mesh), 24U);  // A cube's corners have three normals.
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  EXPECT_EQ(split_vertices(mesh), mesh.positions.size());
  const Mesh laid_out = unwrap(mesh, {.size = 64});
  EXPECT_GT(split_vertices(laid_out), mesh.positions.size());
}

/// Cubes on a grid, far from each other.
Mesh far_cubes(int a_side, float apart) {
  Mesh cube = test::cube();
  Mesh mesh;
  mesh.name = "cubes";
  for (int i = 0; i < a_side * a_side; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const float x = apart * static_cast<float>(i % a_side);
    const float y = apart * static_cast<float>(i / a_side);
    for (const Vec3& p : cube.positions) mesh.positions.push_back({p.x + x, p.y + y, p.z});
    for (const Triangle& t : cube.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return mesh;
}

TEST(LowPolyPlan, UsesMoreThanHalfOfTheFacesWhereNothingElseDoes) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = far_cubes(6, 2);
  const LowPolyPlan plan =
      plan_low_poly(Source(*test::device(), high), high, low_poly_options(0.5, 64));
  EXPECT_TRUE(plan.reached);
  EXPECT_EQ(plan.chosen.size, 0U);
  EXPECT_EQ(plan.low.triangles.size(), high.triangles.size());
}

TEST(LowPolyPlan, WhatIsSmallerThanAPixelIsNotSaidToBeReached) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = far_cubes(4, 200);
  LowPolyPlanOptions options = low_poly_options(5, 64);
  options.screen = 32;
  const LowPolyPlan plan = plan_low_poly(Source(*test::device(), high), high, options);
  EXPECT_FALSE(plan.reached);
  EXPECT_EQ(plan.chosen.measured, 180);
}

/// What cannot be planned is refused with the number that is wrong.
TEST(LowPolyPlan, RefusalsNameTheNumber) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::icosphere(2);
  const Source source(*test::device(), high);
  const auto refusal = [&](const auto& change) -> std::string {
    LowPolyPlanOptions options = low_poly_options(5);
    change(options);
    try {
      plan_low_poly(source, high, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  using Options = LowPolyPlanOptions;
  EXPECT_EQ(refusal([](Options& o) { o.max_error = -2; }),
            "plan_low_poly: max_error is -2 degrees; it must be finite and above 0");
  for (const double outline : {-0.5, 1.0}) {
    EXPECT_EQ(refusal([&](Options& o) { o.max_outline = outline; }),
              std::string("plan_low_poly: max_outline is ") + (outline < 0 ? "-0.5" : "1") +
                  "; it must be a share above 0 and below 1, or 0");
  }
  const std::string density =
      "plan_low_poly: the texel density detail requires the unwrap method charts, and a high poly "
      "that is no height field";
  EXPECT_EQ(refusal([](Options& o) {
              o.density = TexelDensity::detail;
              o.unwrap = UnwrapMethod::pairs;
            }),
            density);
  EXPECT_EQ(refusal([](Options& o) {
              o.density = TexelDensity::detail;
              o.height_field = true;
            }),
            density);
  for (const std::uint32_t screen : {1U, 15U, 16385U}) {
    EXPECT_EQ(refusal([&](Options& o) { o.screen = screen; }),
              "plan_low_poly: screen is " + std::to_string(screen) +
                  " pixels; it must be 16 to 16384, or 0");
  }
  for (const std::uint32_t bits : {1U, 32U}) {
    EXPECT_EQ(refusal([&](Options& o) { o.bits = bits; }),
              "plan_low_poly: bits is " + std::to_string(bits) + "; it must be 8, 16 or 0");
  }
  EXPECT_EQ(refusal([](Options& o) {
              o.bake.width = 64;
              o.bake.height = 15;
            }),
            "plan_low_poly: the largest map is 64 x 15; it must be 16 x 16 at least");
  const std::string given =
      "plan_low_poly: a cage mesh, parts and a saved match require a given low poly";
  const Parts parts;
  const Match match;
  EXPECT_EQ(refusal([&](Options& o) { o.bake.match.cage_mesh = &high; }), given);
  EXPECT_EQ(refusal([&](Options& o) { o.bake.match.parts = &parts; }), given);
  EXPECT_EQ(refusal([&](Options& o) { o.bake.match.saved = &match; }), given);
  EXPECT_EQ(refusal([](Options& o) { o.bake.match.method = MatchMethod::uv; }),
            "plan_low_poly: matching by uv requires a given low poly");
}

/// A distance of a cage is for rays: the plan compares no others. Bits that are given are taken.
TEST(LowPolyPlan, ACageIsForRaysAndBitsAreTaken) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(3000, true);
  const Source source(*test::device(), high);
  LowPolyPlanOptions options = low_poly_options(5, 64);
  options.may_leave_map_out = false;
  options.bake.match.method = MatchMethod::closest;
  options.bake.match.cage = Length::share(0.05);
  options.bits = 8;
  const LowPolyPlan plan = plan_low_poly(source, high, options);
  EXPECT_EQ(plan.chosen.method, MatchMethod::ray);
  EXPECT_EQ(plan.chosen.bits, 8U);
  ASSERT_TRUE(plan.result.has_value());
  EXPECT_EQ(plan.result->report.closest, 0U);
  // What is said of the result is what the result is.
  const LowPolyBytes bytes =
      low_poly_bytes(split_vertices(plan.low), plan.low.triangles.size(), plan.chosen.size, {3}, 8);
  EXPECT_EQ(plan.chosen.bytes.vertices, bytes.vertices);
  EXPECT_EQ(plan.chosen.bytes.texels, bytes.texels);
  EXPECT_EQ(plan.chosen.positions, plan.low.positions.size());
  EXPECT_EQ(plan.chosen.samples, std::clamp(1024 / plan.chosen.size, 1U, 4U));
  EXPECT_EQ(plan.chosen.charts, plan.unwrapped.value().charts);
}

}  // namespace
}  // namespace kiln

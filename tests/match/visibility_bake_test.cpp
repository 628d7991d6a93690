// Bakes along visibility directions: against the oracle, with every way to look, and where it
// ends.
#include <gtest/gtest.h>

#include <cmath>

#include "kiln/bake.h"
#include "match/visibility.h"
#include "match/visibility_scene.h"
#include "mesh/frame.h"
#include "mesh/kernels_shared.h"
#include "reference/ray.h"
#include "reference/visibility.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::folded;
using test::grid;
using test::kDegree;
using test::whole_map;

TEST(VisibilityBake, FindsWhatTheOracleFinds) {
  KILN_REQUIRE_DEVICE();
  Mesh low = grid(4, 2, folded, whole_map, 256, 128);
  low.name = "low";
  // The dense one: the same strip with more folds on it.
  const Mesh high = grid(
      40, 20,
      [](int c, int r) {
        const double x = c / 10.0;
        const double fold = x - 2 * std::floor(x / 2);
        const double z = 0.66143783 * (fold < 1 ? fold : 2 - fold);
        return Vec3{static_cast<float>(0.75 * x), static_cast<float>(0.1 * r),
                    static_cast<float>(z + 0.03 * std::sin(2.1 * c + 1.3 * r))};
      },
      whole_map, 4096, 2048);
  BakeOptions options;
  options.width = 256;
  options.height = 128;
  options.match.method = MatchMethod::visibility;
  options.match.visibility.test = VisibilityTest::rays;
  options.match.visibility.smoothing = 0;
  options.match.visibility.directions = 48;
  options.match.max_distance = Length::absolute(0.2);
  options.report.keep_match = true;
  const Source source(*test::device(), high);
  const BakeResult result = bake(source, low, options);

  // Everything again, in double precision and by brute force.
  const Frame frame = Frame::of(high);
  const LowSurface surface = LowSurface::of(low, frame);
  const std::vector<Vec3> low_positions = frame.to_frame(low);
  const std::vector<Vec3> high_positions = frame.to_frame(high);
  std::vector<reference::SeenDirection> directions;
  for (const ProbeDirection& d : probe_directions(options.match.visibility)) {
    const Vec3 toward = to_float(d.toward);
    directions.push_back({{toward.x, toward.y, toward.z}, d.weight});
  }
  TexelSampler sampler(context_of(*test::device()), surface, {256, 128, 1, 1U << 22});
  const TexelBand band = sampler.sample(0);
  cl::Context& context = context_of(*test::device());
  const std::vector<float> points = band.points.download(context);
  const std::vector<std::uint32_t> triangle = band.triangle.download(context);
  const std::vector<std::uint32_t> index = band.texel_index.download(context);
  std::size_t doubtful = 0;
  std::size_t found = 0;
  std::size_t compared = 0;
  for (std::size_t i = 0; i < band.sample_count; ++i) {
    const std::array<double, 3> place = {points[i], points[i + band.capacity],
                                         points[i + 2 * std::size_t{band.capacity}]};
    ASSERT_LT(triangle[i], surface.triangles.size()) << i;
    const auto& t = surface.triangles[triangle[i]];
    const Vec3d up = cross(to_double(t[1].position) - to_double(t[0].position),
                           to_double(t[2].position) - to_double(t[0].position));
    const Vec3d normal = up * (1 / length(up));
    const reference::SeenSum seen =
        reference::see(low_positions, low.triangles, place, {normal.x, normal.y, normal.z},
                       directions, KILN_VISIBILITY_LEAST_COSINE, 1.0 / 65536, 8, 1e-4);
    if (seen.doubtful > 0) {
      ++doubtful;
      continue;
    }
    Vec3d d{seen.sum[0], seen.sum[1], seen.sum[2]};
    d = d * (1 / length(d));
    const double rise = dot(d, normal);
    if (rise < KILN_VISIBILITY_LEAST_RISE) {
      d = d + normal * (KILN_VISIBILITY_LEAST_RISE - rise);
      d = d * (1 / length(d));
    }
    reference::RaySearch search;
    const double reach = 0.2 * frame.scale;
    search.t_min = -reach;
    search.t_max = reach;
    search.nearest_outward_first = true;
    search.keep = 1;
    const reference::RayHit hit =
        reference::cast_ray(high_positions, high.triangles, place, {d.x, d.y, d.z}, search);
    ++compared;
    const std::uint32_t ours = result.match->triangle[index[i]];
    ASSERT_EQ(ours != KILN_NO_TRIANGLE, hit.found) << i;
    if (!hit.found) continue;
    ++found;
    if (ours == hit.triangle) continue;
    ASSERT_NEAR(result.match->distance[index[i]] * frame.scale, hit.t, 1e-5) << i;
  }
  EXPECT_GT(found, compared / 2);
  EXPECT_LT(doubtful, compared / 3);
  EXPECT_GT(compared, 5000U);
}

TEST(VisibilityBake, AllWaysFindTheSurface) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(10000);
  const Mesh low = test::BumpyTorus::light();
  const Source source(*test::device(), high);
  const auto mean_error = [&](const BakeResult& result) {
    // Angle of the point found to the exact surface's normal there: how well the map shows it.
    return result.report.mean_abs_distance;
  };
  BakeOptions options;
  options.width = 150;  // neither square nor a multiple of anything
  options.height = 85;
  options.match.max_distance = Length::absolute(0.1);
  options.report.recall = 0;
  const double ray = mean_error(bake(source, low, options));
  for (const MatchMethod method : {MatchMethod::visibility, MatchMethod::hybrid}) {
    for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
      for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
        for (const std::uint32_t samples : {1U, 2U}) {
          if (samples == 2 && method == MatchMethod::hybrid) continue;
          options.match.method = method;
          options.samples = samples;
          options.match.visibility.at = at;
          options.match.visibility.test = test;
          options.match.visibility.directions = 100;
          const BakeResult result = bake(source, low, options);
          EXPECT_EQ(result.report.missed, 0U);
          EXPECT_NEAR(mean_error(result), ray, 0.2 * ray);
          EXPECT_GT(result.report.visibility->mean_deviation, 0.5);
          EXPECT_LT(result.report.visibility->mean_deviation, 0.8);
        }
      }
    }
  }
}

TEST(VisibilityBake, LargeMapsTakeASmallerField) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(20000);
  const Mesh low = test::BumpyTorus::light();
  BakeOptions options;
  options.width = 4200;
  options.height = 40;
  options.encoding.gutter = 0;
  options.match.method = MatchMethod::visibility;
  options.match.visibility.directions = 32;
  options.match.max_distance = Length::absolute(0.1);
  const BakeResult result = bake(Source(*test::device(), high), low, options);
  EXPECT_EQ(result.report.visibility->width, 1400U);
  EXPECT_EQ(result.report.visibility->height, 14U);
  EXPECT_EQ(result.report.missed, 0U);
}

TEST(VisibilityBake, TakesImperfectLightMeshes) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::icosphere(4);
  const Source source(*test::device(), high);
  // A vertex that is nowhere, a triangle without area, three triangles at an edge, and one inside out.
  Mesh low = test::uv_sphere(24, 12);
  low.positions[30].y = std::nanf("");
  low.triangles.push_back({5, 5, 6});
  low.uv_triangles.push_back({5, 5, 6});
  low.triangles.push_back(low.triangles[40]);
  low.uv_triangles.push_back(low.uv_triangles[40]);
  std::swap(low.triangles[60][0], low.triangles[60][1]);
  std::swap(low.uv_triangles[60][0], low.uv_triangles[60][1]);
  low.normals.clear();
  low.normal_triangles.clear();
  // And one that no texel lies on.
  Mesh nowhere = test::uv_sphere(24, 12);
  for (Vec2& uv : nowhere.uvs) uv.x += 5;
  BakeOptions options;
  options.width = options.height = 64;
  options.match.max_distance = Length::share(0.1);
  for (const MatchMethod method : {MatchMethod::visibility, MatchMethod::hybrid}) {
    for (const VisibilityAt at : {VisibilityAt::texel, VisibilityAt::vertex, VisibilityAt::face}) {
      for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
        options.match.method = method;
        options.match.visibility.at = at;
        options.match.visibility.test = test;
        options.match.visibility.directions = 32;
        const BakeResult result = bake(source, low, options);
        EXPECT_GT(result.report.samples, 3000U);
        EXPECT_LT(result.report.missed, result.report.samples / 20);
        for (const float value : result.maps[0].image.pixels) ASSERT_TRUE(std::isfinite(value));
        EXPECT_EQ(bake(source, nowhere, options).report.samples, 0U);
      }
    }
  }
  options.width = options.height = 1;
  EXPECT_LE(bake(source, low, options).report.samples, 1U);
}

TEST(VisibilityBake, StopsWhereItIsTold) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpyTorus::dense(20000);
  const Mesh low = test::BumpyTorus::light();
  const Source source(*test::device(), high);
  for (const VisibilityTest test : {VisibilityTest::views, VisibilityTest::rays}) {
    BakeOptions options;
    options.width = options.height = 128;
    options.match.max_distance = Length::absolute(0.1);
    options.match.method = MatchMethod::hybrid;
    options.match.visibility.test = test;
    double last = -1;
    int asked = 0;
    options.progress = [&](double done, std::string_view) {
      EXPECT_GE(done, last);
      last = done;
      ++asked;
      return true;
    };
    EXPECT_FALSE(bake(source, low, options).cancelled);
    EXPECT_EQ(last, 1);
    EXPECT_GT(asked, 15);
    asked = 0;
    options.progress = [&](double done, std::string_view stage) {
      ++asked;
      return stage != "visibility" || done < 0.2;
    };
    const BakeResult stopped = bake(source, low, options);
    EXPECT_TRUE(stopped.cancelled);
    EXPECT_TRUE(stopped.maps.empty());
    EXPECT_GT(asked, 5);
  }
}

TEST(SwitchedMethods, AreMeasuredWhereTheyMeet) {
  KILN_REQUIRE_DEVICE();
  // Rays find the middle of the plane, nearest points a rim of it, and what is farther keeps its normal.
  Mesh high = test::plane(20, 20, 0.8, 0.8);
  for (Vec3& p : high.positions) p.z += 0.03F;
  high.normals = {{0.6F, 0, 0.8F}};
  const Mesh low = test::plane(2, 2);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 200;
  options.encoding.space = NormalMapSpace::object;
  options.match.max_distance = Length::absolute(0.05);
  EXPECT_FALSE(bake(source, low, options).report.transitions);
  options.match.fallback = {MatchMethod::closest};
  const double leap = std::acos(0.8) / kDegree;
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::visibility}) {
    options.match.method = method;
    const BakeResult result = bake(source, low, options);
    ASSERT_TRUE(result.report.transitions);
    // 160 texels a side of rays, and 8 more all around within sqrt(0.05^2 - 0.03^2) = 0.04.
    const double inner = 4 * 160;
    const double outer = 4 * 176;
    EXPECT_NEAR(static_cast<double>(result.report.transitions->sides), inner + outer, 40);
    EXPECT_NEAR(result.report.transitions->mean_degrees, leap * outer / (inner + outer), 1);
    EXPECT_NEAR(result.report.transitions->elsewhere_degrees, 0, 1e-3);
  }
  // Far enough, nothing is missed, and no seam is left.
  options.match.max_distance = Length::absolute(0.5);
  const BakeResult all = bake(source, low, options);
  EXPECT_EQ(all.report.missed, 0U);
  EXPECT_GT(all.report.transitions->sides, 600U);
  EXPECT_NEAR(all.report.transitions->mean_degrees, 0, 1e-3);
}

TEST(VisibilityBake, ViewsDecideWhatRaysLeave) {
  KILN_REQUIRE_DEVICE();
  // A light plane wider than the dense one: past its rim only slanted lines find it.
  Mesh high = test::plane(20, 20, 0.9, 0.9);
  for (Vec3& p : high.positions) p.z += 0.05F;
  const Mesh low = test::plane(2, 2);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 128;
  options.match.method = MatchMethod::hybrid;
  options.match.max_distance = Length::absolute(0.1);
  const BakeResult rays = bake(source, low, options);
  EXPECT_GT(rays.report.missed, rays.report.samples / 10);
  options.match.fallback = {MatchMethod::views};
  options.match.views.count = 64;
  options.match.views.refine = false;
  const BakeResult both = bake(source, low, options);
  EXPECT_GT(both.report.viewed, rays.report.missed / 10);
  EXPECT_EQ(both.report.viewed + both.report.missed, rays.report.missed);
  EXPECT_TRUE(both.report.views);
  options.match.method = MatchMethod::views;
  EXPECT_THROW(bake(source, low, options), Error);
}

}  // namespace
}  // namespace kiln

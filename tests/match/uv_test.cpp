// Matching by UVs: against brute force in double precision, and against rays.
#include "match/uv.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "kiln/bake.h"
#include "match/uv_points.h"
#include "match/uv_scene.h"
#include "mesh/kernels_shared.h"
#include "mesh/vector.h"
#include "reference/texel.h"
#include "source/high_poly.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/small_charts.h"
#include "texel/texels.h"

namespace kiln {
namespace {

using test::bent_plane;
using test::by_uv;
using test::random_layout;
using test::trusting;

std::vector<test::ReferenceTriangle> layout_of(const Mesh& mesh) {
  std::vector<test::ReferenceTriangle> result;
  for (const Triangle& triangle : mesh.uv_triangles) {
    test::ReferenceTriangle uvs;
    for (std::size_t k = 0; k < 3; ++k) uvs[k] = {mesh.uvs[triangle[k]].x, mesh.uvs[triangle[k]].y};
    result.push_back(uvs);
  }
  return result;
}

/// Every sample of a bake against brute force: who covers it, where in the triangle, how far it lies.
void expect_as_reference(const Mesh& dense, const Mesh& low, const BakeOptions& options) {
  const BakeResult baked = bake(Source(*test::device(), dense), low, options);
  const auto width = static_cast<int>(options.width);
  const auto height = static_cast<int>(options.height);
  const auto samples = static_cast<int>(options.samples);
  const std::vector<test::ReferenceSample> ours =
      test::reference_samples(layout_of(dense), width, height, samples);
  const std::vector<test::ReferenceSample> lows =
      test::reference_samples(layout_of(low), width, height, samples);
  const Match& match = *baked.match;
  ASSERT_EQ(match.triangle.size(), ours.size());
  // Texels of charts that cover no sample: their samples have UVs of their own.
  const LowSurface surface = LowSurface::of(low, Frame::of(dense));
  const TexelPieces pieces =
      TexelPieces::of(surface, options.width * options.samples, options.height * options.samples);
  std::set<std::size_t> owned;
  for (const AssignedTexel& texel :
       SmallCharts::of(surface, pieces, options.width, options.height, options.samples).texels) {
    owned.insert(std::size_t{texel.row} * options.width + texel.column);
  }
  std::uint64_t covered = 0, overlapping = 0, found = 0;
  double sum = 0;
  std::vector<double> distances;
  const auto at = [](const Mesh& mesh, std::int64_t t, double u, double v) {
    const Triangle& corners = mesh.triangles[static_cast<std::size_t>(t)];
    return to_double(mesh.positions[corners[0]]) * (1 - u - v) +
           to_double(mesh.positions[corners[1]]) * u + to_double(mesh.positions[corners[2]]) * v;
  };
  for (std::size_t i = 0; i < ours.size(); ++i) {
    covered += ours[i].covering > 0 ? 1 : 0;
    overlapping += ours[i].covering > 1 ? 1 : 0;
    const std::size_t across = std::size_t{options.width} * options.samples;
    const std::size_t texel =
        i / across / options.samples * options.width + i % across / options.samples;
    if (owned.contains(texel)) {
      ASSERT_NE(match.status[i], KILN_STATUS_NONE) << i;
      if (match.status[i] == KILN_STATUS_MISS) continue;
      ++found;
      sum += std::abs(match.distance[i]);
      distances.push_back(std::abs(match.distance[i]));
      continue;
    }
    if (lows[i].triangle < 0) {
      ASSERT_EQ(match.status[i], KILN_STATUS_NONE) << i;
      continue;
    }
    if (ours[i].triangle < 0) {
      ASSERT_EQ(match.status[i], KILN_STATUS_MISS) << i;
      ASSERT_EQ(match.triangle[i], KILN_NO_TRIANGLE) << i;
      continue;
    }
    ++found;
    ASSERT_EQ(match.status[i], KILN_STATUS_UV) << i;
    ASSERT_EQ(match.triangle[i], ours[i].triangle) << i;
    // Three roundings of 2^-24 each; the second weight is also held to 1 - u.
    ASSERT_NEAR(match.u[i], ours[i].u, 4e-7) << i;
    ASSERT_NEAR(match.v[i], ours[i].v, 4e-7) << i;
    const Vec3d point = at(dense, ours[i].triangle, ours[i].u, ours[i].v);
    const double distance = length(point - at(low, lows[i].triangle, lows[i].u, lows[i].v));
    // The low poly's point is rounded in the working frame: a few units in the last place of 1.
    ASSERT_NEAR(std::abs(match.distance[i]), distance, 1e-5) << i;
    sum += distance;
    distances.push_back(distance);
  }
  EXPECT_EQ(baked.report.by_uv, found);
  ASSERT_TRUE(baked.report.uv);
  EXPECT_EQ(baked.report.uv->covered, covered);
  EXPECT_EQ(baked.report.uv->overlapping, overlapping);
  if (found == 0) return;
  EXPECT_NEAR(baked.report.uv->mean_distance, sum / static_cast<double>(found), 1e-5);
  std::sort(distances.begin(), distances.end());
  const double exact = distances[distances.size() - distances.size() / 20 - 1];
  EXPECT_GE(baked.report.uv->p95_distance, exact - 1e-5);
  EXPECT_LE(baked.report.uv->p95_distance, exact * (1 + 1.0 / 256) + 1e-5);
}

/// A chart that covers no sample finds the point at its own UV, not at its texel's centre.
TEST(Uv, OfSmallChartsIsTheirOwn) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh = test::plane(1, 1);
  for (Vec2& uv : mesh.uvs) uv = {0.1F + uv.x * 0.005F, 0.1F + uv.y * 0.005F};
  BakeOptions options;
  options.width = options.height = 16;
  options.match.method = MatchMethod::uv;
  options.report.keep_match = true;
  const BakeResult baked = bake(Source(*test::device(), mesh), mesh, options);
  EXPECT_EQ(baked.report.small_triangles, 2U);
  EXPECT_EQ(baked.report.by_uv, 2U);
  EXPECT_EQ(baked.report.missed, 0U);
  for (std::size_t i = 0; i < baked.match->status.size(); ++i) {
    if (baked.match->status_of(i) == SampleStatus::empty) continue;
    EXPECT_NEAR(baked.match->distance[i], 0, 1e-4);
  }
}

TEST(Uv, MatchesBruteForceOnAGrid) {
  KILN_REQUIRE_DEVICE();
  expect_as_reference(bent_plane(37, 0.02), test::plane(3, 3), by_uv(64));
  expect_as_reference(bent_plane(150, 0.02), test::plane(1, 1), by_uv(61));
}

TEST(Uv, MatchesBruteForceWithSamplesAndOddSizes) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = by_uv(1);
  expect_as_reference(bent_plane(9, 0.02), test::plane(1, 1), options);
  options.width = 65;
  options.height = 3;
  options.samples = 3;
  expect_as_reference(bent_plane(9, 0.02), test::plane(2, 1), options);
  options.width = 129;
  options.height = 70;
  options.samples = 2;
  expect_as_reference(bent_plane(2, 0.02), test::plane(1, 1), options);  // tiles of large triangles
}

TEST(Uv, MatchesBruteForceOnAnyLayout) {
  KILN_REQUIRE_DEVICE();
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    for (const double size : {0.02, 0.3}) {
      expect_as_reference(random_layout(60, seed, size, false),
                          random_layout(20, seed + 9, 0.4, false), trusting(by_uv(48)));
    }
  }
}

/// Result of a raster for all samples of a low mesh: triangles, weights, statuses, and the report.
struct Raster {
  std::vector<std::uint32_t> triangle;
  std::vector<float> weights;
  UvReport report;
};

Raster rasterise(const Mesh& dense, const Mesh& low, std::uint32_t size, std::uint32_t samples,
                 std::uint32_t band_samples, UvPath path) {
  const Source source(*test::device(), dense);
  cl::Context& context = context_of(*test::device());
  const LowSurface surface = LowSurface::of(low, impl_of(source).frame);
  TexelSampler sampler(context, surface, {size, size, samples, band_samples});
  UvRaster raster(impl_of(source), size, size, samples, path);
  Raster result;
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    const TexelBand band = sampler.sample(b);
    DeviceCorrespondence match(context, band.capacity);
    match.count = band.sample_count;
    raster.match(band, match, true);
    const std::vector<std::uint32_t> triangle = match.triangle.download(context);
    const std::vector<float> weights = match.barycentric.download(context);
    result.triangle.insert(result.triangle.end(), triangle.begin(),
                           triangle.begin() + band.sample_count);
    for (const std::size_t plane : {std::size_t{0}, std::size_t{match.capacity}}) {
      const auto first = weights.begin() + static_cast<std::ptrdiff_t>(plane);
      result.weights.insert(result.weights.end(), first, first + band.sample_count);
    }
  }
  UvOptions all;
  all.max_overlap = all.max_distance = std::numeric_limits<double>::infinity();
  MatchNotes notes;
  raster.report(all, notes);
  result.report = *notes.uv;
  return result;
}

TEST(Uv, BothPathsGiveTheSameBytes) {
  KILN_REQUIRE_DEVICE();
  if (choose_traversal(context_of(*test::device()), Traversal::automatic) != Traversal::cpu) {
    GTEST_SKIP() << "not a device for runs of rows";
  }
  EXPECT_TRUE(rc::check("random layouts", [] {
    const auto seed = *rc::gen::arbitrary<std::uint32_t>();
    // From slivers of a sample to triangles that 32 bits do not hold.
    const double size = *rc::gen::element(0.004, 0.02, 0.1, 1.5);
    const bool far = *rc::gen::inRange(0, 4) == 0;
    const auto map_size = *rc::gen::inRange(1U, 300U);
    const auto samples = *rc::gen::inRange(1U, 4U);
    const auto band = *rc::gen::element(2048U, 1U << 20);
    const Mesh dense = random_layout(*rc::gen::inRange(1U, 400U), seed, size, far);
    const Mesh low = random_layout(12, seed + 1, 0.6, false);
    const Raster a = rasterise(dense, low, map_size, samples, band, UvPath::atomics);
    const Raster b = rasterise(dense, low, map_size, samples, band, UvPath::runs);
    RC_ASSERT(a.triangle == b.triangle);
    RC_ASSERT(a.weights == b.weights);
    RC_ASSERT(a.report.covered == b.report.covered);
    RC_ASSERT(a.report.overlapping == b.report.overlapping);
    if (a.report.overlapping == 0) return;
    RC_ASSERT(a.report.overlap.lower == b.report.overlap.lower);
    RC_ASSERT(a.report.overlap.upper == b.report.overlap.upper);
    RC_ASSERT(a.report.overlap.column == b.report.overlap.column);
    RC_ASSERT(a.report.overlap.row == b.report.overlap.row);
  }));
}

TEST(Uv, ReadsTheNormalOfThePointWithTheSameUv) {
  KILN_REQUIRE_DEVICE();
  Mesh dense = bent_plane(60, 0.03);
  std::mt19937 random(5);
  for (std::size_t i = 0; i < dense.positions.size(); ++i) {
    Vec3d n(random() % 1000 / 1000.0 - 0.5, random() % 1000 / 1000.0 - 0.5, 1);
    dense.normals.push_back(to_float(n * (1 / length(n))));
  }
  dense.normal_triangles = dense.triangles;
  const BakeResult baked = bake(Source(*test::device(), dense), test::plane(2, 2), by_uv(50));
  const auto reference = test::reference_samples(layout_of(dense), 50, 50, 1);
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const Triangle& t = dense.normal_triangles[static_cast<std::size_t>(reference[i].triangle)];
    const double u = reference[i].u;
    const double v = reference[i].v;
    Vec3d n = to_double(dense.normals[t[0]]) * (1 - u - v) + to_double(dense.normals[t[1]]) * u +
              to_double(dense.normals[t[2]]) * v;
    n = n * (1 / length(n));
    const float* pixel = &baked.maps[0].image.pixels[i * 3];
    ASSERT_NEAR(pixel[0], n.x, 2e-6);
    ASSERT_NEAR(pixel[1], n.y, 2e-6);
    ASSERT_NEAR(pixel[2], n.z, 2e-6);
  }
}

TEST(Uv, AgreesWithRaysOverAPlane) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), bent_plane(80, 0.02));
  BakeOptions options = by_uv(96);
  const BakeResult uv = bake(source, test::plane(1, 1), options);
  options.match.method = MatchMethod::ray;
  options.match.max_distance = Length::absolute(0.1);
  const BakeResult rays = bake(source, test::plane(1, 1), options);
  EXPECT_EQ(uv.report.missed, 0U);
  EXPECT_EQ(rays.report.missed, 0U);
  // The normals turn by up to 20 degrees over the width of a cell; points agree to rounding.
  for (std::size_t i = 0; i < uv.maps[0].image.pixels.size(); ++i) {
    ASSERT_NEAR(uv.maps[0].image.pixels[i], rays.maps[0].image.pixels[i], 1e-5);
  }
  for (std::size_t i = 0; i < uv.match->distance.size(); ++i) {
    ASSERT_NEAR(uv.match->distance[i], rays.match->distance[i], 1e-6);  // the sign, too
  }
}

TEST(UvPoints, AreThoseOfTheLowestTriangleThatCoversTheUv) {
  KILN_REQUIRE_DEVICE();
  // Also triangles and UVs beside the unit square.
  Mesh mesh = random_layout(400, 7, 0.3, true);
  mesh.uvs[mesh.uv_triangles[3][1]].x = std::numeric_limits<float>::quiet_NaN();
  mesh.uvs[mesh.uv_triangles[4][1]] = mesh.uvs[mesh.uv_triangles[4][0]];
  mesh.positions[mesh.triangles[5][2]].y = std::numeric_limits<float>::infinity();
  const Source source(*test::device(), mesh);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-0.5F, 1.5F);
  std::vector<Vec2> uvs(3000);
  for (Vec2& uv : uvs) uv = {uniform(random), uniform(random)};
  uvs[0].x = std::numeric_limits<float>::quiet_NaN();
  const UvPoints found = find_uv_points(impl_of(source), uvs);
  std::size_t covered = 0, beside = 0;
  for (std::size_t i = 0; i < uvs.size(); ++i) {
    std::uint32_t expected = KILN_NO_TRIANGLE;
    bool near_edge = false;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto corner = [&](std::size_t k) { return mesh.uvs[mesh.uv_triangles[t][k]]; };
      const auto finite = [&](std::uint32_t p) { return is_finite(mesh.positions[p]); };
      if (!std::all_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), finite)) continue;
      // Signed areas of the three triangles that the UV makes with the edges.
      std::array<double, 3> area{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2 a = corner((k + 1) % 3), b = corner((k + 2) % 3), p = uvs[i];
        area[k] =
            (double{a.x} - p.x) * (double{b.y} - p.y) - (double{b.x} - p.x) * (double{a.y} - p.y);
      }
      const double whole = area[0] + area[1] + area[2];
      if (!(whole != 0)) continue;
      const double least = std::min({area[0] / whole, area[1] / whole, area[2] / whole});
      near_edge = near_edge || std::abs(least) < 1e-6;
      if (!(least >= 0)) continue;
      expected = t;
      if (found.triangle[i] == t) {
        EXPECT_NEAR(found.barycentric[i], area[1] / whole, 1e-5);
        EXPECT_NEAR(found.barycentric[i + uvs.size()], area[2] / whole, 1e-5);
      }
      break;
    }
    if (near_edge) continue;
    EXPECT_EQ(found.triangle[i], expected) << i;
    if (expected == KILN_NO_TRIANGLE) continue;
    ++covered;
    beside += uvs[i].x < 0 || uvs[i].x > 1 ? 1 : 0;
  }
  EXPECT_GT(covered, 500U);
  EXPECT_LT(covered, 2999U);
  EXPECT_GT(beside, 10U);
}

}  // namespace
}  // namespace kiln

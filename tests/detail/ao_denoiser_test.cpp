// Ambient occlusion to a given error: what smoothing takes away, and what it leaves.
#include "detail/ao_denoiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "cl/context.h"
#include "detail/occlusion_scene.h"
#include "kiln/limits.h"
#include "kiln/unwrap.h"
#include "mesh/vector.h"
#include "shared/ao_denoiser.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::asking;
using test::map_of;

/// Root mean square, and the most, of what two maps are apart where both were baked.
struct Apart {
  double rms = 0, most = 0;
};

Apart apart(const BakeResult& a, const BakeResult& b) {
  const Image &of_a = map_of(a, "ao"), &of_b = map_of(b, "ao");
  Apart result;
  double count = 0;
  for (std::size_t i = 0; i < a.coverage.size(); ++i) {
    if (a.coverage[i] != kCoverageBaked) continue;
    const double error = std::abs(static_cast<double>(of_a.pixels[i]) - of_b.pixels[i]);
    result.rms += error * error;
    result.most = std::max(result.most, error);
    ++count;
  }
  result.rms = std::sqrt(result.rms / count);
  return result;
}

BakeOptions with_rays(std::uint32_t side, std::uint32_t rays) {
  BakeOptions options = asking({MapKind{"ao"}}, side);
  options.occlusion.rays = rays;
  return options;
}

/// A paraboloid over the ground's square.
Mesh bowl() {
  Mesh mesh = test::plane(40, 40, 3, 3);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Vec3& p : mesh.positions) p.z = 0.4F * (p.x * p.x + p.y * p.y);
  return mesh;
}

/// No error is too large: 16 rays a texel, smoothed where that serves, else all 64.
BakeOptions smoothed(std::uint32_t side) {
  BakeOptions options = with_rays(side, 64);
  options.occlusion.max_error = 1;
  return options;
}

TEST(AoDenoiser, TakesNoiseOffABumpyBody) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(20000, true));
  const Mesh low = test::BumpySphere::light(24, 12);
  const BakeResult truth = bake(source, low, with_rays(192, 768));
  const double raw = apart(bake(source, low, with_rays(192, 16)), truth).rms;
  const double filtered = apart(bake(source, low, smoothed(192)), truth).rms;
  EXPECT_LT(filtered, raw / 2.5);
  EXPECT_GT(filtered, 0);
}

TEST(AoDenoiser, SmoothsAcrossSeams) {
  KILN_REQUIRE_DEVICE();
  // The same body with two triangles a chart: charts of some 12 texels a side, mostly border.
  const Source source(*test::device(), test::BumpySphere::dense(20000, true));
  UnwrapOptions layout;
  layout.method = UnwrapMethod::pairs;
  layout.size = 192;
  const Mesh low = unwrap(test::BumpySphere::light(24, 12), layout);
  const BakeResult truth = bake(source, low, with_rays(192, 768));
  const double raw = apart(bake(source, low, with_rays(192, 16)), truth).rms;
  const double filtered = apart(bake(source, low, smoothed(192)), truth).rms;
  EXPECT_LT(filtered, raw / 2);
}

TEST(AoDenoiser, LeavesAnEdgeWhereRaysShowOne) {
  KILN_REQUIRE_DEVICE();
  // A plate just over the floor: from open to half dark within a texel.
  Mesh high = test::plane(4, 4, 4, 4);
  test::add_rectangle(high, {-0.5F, -0.5F, 0.004F}, {0, 1, 0}, {1, 0, 0});
  const Source source(*test::device(), high);
  const Mesh low = test::ground(3);
  const BakeResult truth = bake(source, low, with_rays(160, 2048));
  BakeOptions options = with_rays(160, 64);
  options.occlusion.max_error = 0.004;
  const Apart kept = apart(bake(source, low, options), truth);
  EXPECT_LT(kept.rms, 0.004);
  // Two steps of smoothing alone would move the edge by a quarter.
  EXPECT_LT(kept.most, 0.1);
}

/// Share of the texels that have the very value of plain rays, so that these were cast.
double share_cast(const BakeResult& smoothed, const BakeResult& plain) {
  const Image &a = map_of(smoothed, "ao"), &b = map_of(plain, "ao");
  double same = 0, all = 0;
  for (std::size_t i = 0; i < plain.coverage.size(); ++i) {
    if (plain.coverage[i] != kCoverageBaked) continue;
    ++all;
    // Both are 1 or 0 where nothing, or all, is dark.
    same += a.pixels[i] == b.pixels[i] && b.pixels[i] > 0 && b.pixels[i] < 1 ? 1 : 0;
  }
  return same / all;
}

/// Smoothing few rays is never further from the truth than all of them: neither on the whole, nor at the worst texel.
void expect_no_worse(const Mesh& high, const Mesh& low, std::uint32_t side) {
  const Source source(*test::device(), high);
  const BakeResult truth = bake(source, low, with_rays(side, 2048));
  const Apart plain = apart(bake(source, low, with_rays(side, 64)), truth);
  const Apart smooth = apart(bake(source, low, smoothed(side)), truth);
  EXPECT_LE(smooth.rms, plain.rms) << side;
  EXPECT_LE(smooth.most, plain.most) << side;
}

TEST(AoDenoiser, IsNoWorseThanPlainRaysOnCoarseMaps) {
  KILN_REQUIRE_DEVICE();
  for (const std::uint32_t side : {48U, 160U})
    expect_no_worse(test::BumpyTorus::dense(20000), test::BumpyTorus::light(), side);
  expect_no_worse(test::BumpySphere::dense(20000, true), test::BumpySphere::light(24, 12), 96);
}

TEST(AoDenoiser, IsNoWorseThanPlainRaysAtShadowsEdges) {
  KILN_REQUIRE_DEVICE();
  // Plates just over the floor: from open to half dark within a texel, along lines and at spots of a few texels.
  Mesh high = test::plane(4, 4, 4, 4);
  test::add_rectangle(high, {-0.5F, -0.5F, 0.004F}, {0, 1, 0}, {1, 0, 0});
  for (int i = 0; i < 4; ++i) {
    test::add_rectangle(high, {-1.2F + 0.6F * static_cast<float>(i), 0.9F, 0.004F}, {0, 0.05F, 0},
                        {0.05F, 0, 0});
  }
  for (const std::uint32_t side : {64U, 160U}) expect_no_worse(high, test::ground(3), side);
}

TEST(AoDenoiser, IsNoWorseThanPlainRaysAtCreases) {
  KILN_REQUIRE_DEVICE();
  // Walls that lean to each other: shares fall steeply towards creases and open borders, where half the neighbours lack.
  Mesh high;
  for (int i = 0; i < 4; ++i) {
    const float x = static_cast<float>(i);
    test::add_rectangle(high, {x, 0, 0}, {0.4F, 0, 0.9F}, {0, 2, 0});
    test::add_rectangle(high, {x + 0.5F, 0, 0.9F}, {0.4F, 0, -0.9F}, {0, 2, 0});
  }
  Mesh low = high;
  UnwrapOptions layout;
  layout.size = 128;
  low = unwrap(low, layout);
  for (const std::uint32_t side : {96U, 160U}) expect_no_worse(high, low, side);
}

// Three deviations of plain rays reach two texels around, two and a half reach one; what does not show in 8 bits, none.
TEST(AoDenoiser, BlurReachesByDeviationsOfPlainRays) {
  const double deviation = 0.03, variance = deviation * deviation;
  for (const double sign : {-1.0, 1.0}) {
    const auto reach = [&](double deviations) {
      return AoDenoiser::blur_reach(0.5 + sign * deviations * deviation, 0.5, variance);
    };
    EXPECT_EQ(reach(2.4), 0U);
    EXPECT_EQ(reach(2.6), 1U);
    EXPECT_EQ(reach(2.9), 1U);
    EXPECT_EQ(reach(3.1), 2U);
  }
  // Both estimates agree: the deviation is no less than 2 of 255.
  EXPECT_EQ(AoDenoiser::blur_reach(0.5 + 4.0 / 255, 0.5, 0), 0U);
  EXPECT_EQ(AoDenoiser::blur_reach(0.5 + 7.0 / 255, 0.5, 0), 2U);
}

// The variance from which blur is told is that of the noise: of constant shares, that of both estimates' mean, times the
// share that plain rays have of it.
TEST(AoDenoiser, MeasuresTheVarianceOfPlainRays) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 32;
  cl::Context& context = context_of(*test::device());
  const Mesh low = test::ground(1);
  const LowSurface surface = LowSurface::of(low, Frame::of(low));
  std::vector<std::uint32_t> place(kSide * kSide), triangle(place.size());
  std::vector<float> points(6 * place.size()), estimates(2 * place.size());
  std::mt19937 random(3);
  const double deviation = 0.05;
  std::normal_distribution<double> noise(0.5, deviation);
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    place[i] = i;
    points[i] = static_cast<float>(i % kSide);
    points[i + place.size()] = static_cast<float>(i / kSide);
    points[i + 5 * place.size()] = 1;
    for (std::size_t k = 0; k < 2; ++k) estimates[2 * i + k] = static_cast<float>(noise(random));
  }
  const cl::Array<float> device_points(context, std::span<const float>(points));
  AoDenoiser denoiser(context, surface, kSide, kSide);
  denoiser.prepare({0, kSide, place, triangle, device_points, kSide * kSide});
  const double share = 0.25;
  const AoDenoiser::Result result = denoiser.run(estimates, share);
  ASSERT_EQ(result.plain_variance.size(), place.size());
  double mean = 0;
  for (const float variance : result.plain_variance) mean += variance / place.size();
  // 1,024 squared differences: a relative deviation of sqrt(2 / 1,024), of which this is three.
  EXPECT_NEAR(mean / (share * deviation * deviation / 2), 1, 0.14);
}

TEST(AoDenoiser, SpreadsToTheSquareAroundATexel) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 16;
  cl::Context& context = context_of(*test::device());
  const Mesh low = test::ground(1);
  const LowSurface surface = LowSurface::of(low, Frame::of(low));
  std::vector<std::uint32_t> place(kSide * kSide), triangle(place.size());
  std::vector<float> points(6 * place.size());
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    place[i] = i;
    points[i] = static_cast<float>(i % kSide);
    points[i + place.size()] = static_cast<float>(i / kSide);
    points[i + 5 * place.size()] = 1;
  }
  const cl::Array<float> device_points(context, std::span<const float>(points));
  AoDenoiser denoiser(context, surface, kSide, kSide);
  denoiser.prepare({0, kSide, place, triangle, device_points, kSide * kSide});
  const auto square = [&](std::uint32_t x, std::uint32_t y, std::uint32_t reach) {
    std::vector<std::uint32_t> list;
    for (std::uint32_t j = y - reach; j <= y + reach; ++j) {
      for (std::uint32_t i = x - reach; i <= x + reach; ++i) list.push_back(j * kSide + i);
    }
    return list;
  };
  for (const std::uint32_t reach : {1U, 2U}) {
    std::vector<std::uint8_t> unsure(place.size());
    const std::uint32_t at = 7 * kSide + 6;
    unsure[at] = 1;
    // A neighbour that is marked already is passed, not told again.
    unsure[at + 1] = 1;
    std::vector<std::uint32_t> expected = square(6, 7, reach);
    std::erase(expected, at);
    std::erase(expected, at + 1);
    EXPECT_EQ(denoiser.mark_nearby(std::vector{at}, reach, unsure), expected) << reach;
    EXPECT_EQ(std::count(unsure.begin(), unsure.end(), 1),
              static_cast<std::ptrdiff_t>(expected.size() + 2));
    EXPECT_TRUE(denoiser.mark_nearby(std::vector{at}, reach, unsure).empty());
    EXPECT_TRUE(denoiser.mark_nearby({}, reach, unsure).empty());
  }
  // All neighbours are marked already: the second step goes on from them all the same.
  std::vector<std::uint8_t> unsure(place.size());
  std::vector<std::uint32_t> ring = square(6, 7, 2);
  for (const std::uint32_t texel : square(6, 7, 1)) {
    unsure[texel] = 1;
    std::erase(ring, texel);
  }
  EXPECT_EQ(denoiser.mark_nearby(std::vector{7 * kSide + 6}, 2, unsure), ring);
}

TEST(AoDenoiser, CastsFewRaysWhereSmoothingIsRight) {
  KILN_REQUIRE_DEVICE();
  // A wide bowl: dark in the middle, and even over many texels.
  const Source source(*test::device(), bowl());
  const Mesh low = test::ground(3);
  const BakeResult plain = bake(source, low, with_rays(192, 64));
  EXPECT_LT(share_cast(bake(source, low, smoothed(192)), plain), 0.4);
}

TEST(AoDenoiser, IsTheSameOnAnyNumberOfThreads) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(5000, true));
  const Mesh low = test::BumpySphere::light(12, 6);
  BakeOptions options = with_rays(100, 32);
  options.samples = 2;
  options.occlusion.max_error = 0.01;
  set_thread_limit(1);
  const BakeResult one = bake(source, low, options);
  set_thread_limit(3);
  const BakeResult three = bake(source, low, options);
  set_thread_limit(0);
  EXPECT_EQ(map_of(one, "ao").pixels, map_of(three, "ao").pixels);
  options.occlusion.max_error = 1;
  set_thread_limit(1);
  const BakeResult one_guarded = bake(source, low, options);
  set_thread_limit(3);
  const BakeResult three_guarded = bake(source, low, options);
  set_thread_limit(0);
  EXPECT_EQ(map_of(one_guarded, "ao").pixels, map_of(three_guarded, "ao").pixels);
}

/// Weights of a step and their centroids, by their formulas in double precision: diagonal neighbours count as nearer by the
/// square root of 2; normals 26 degrees apart, and neighbours over six times as far as the nearest, have no weight.
TEST(AoDenoiser, WeightsFollowDistancesAndNormals) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  constexpr std::uint32_t kCount = 500;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<float> planes(6 * kCount);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const double distance = std::exp(2 * unit(random));  // from 1 to 54 times as far
    Vec3d p(unit(random), unit(random), unit(random)), n(0.3 * unit(random), 0.3 * unit(random), 1);
    p = p * (distance / length(p));
    n = n * (1 / length(n));
    const double values[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
    for (std::size_t k = 0; k < 6; ++k) planes[k * kCount + i] = static_cast<float>(values[k]);
  }
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    for (int k = 0; k < 8; ++k) indices.push_back(random() % 4 == 0 ? i : random() % kCount);
  }
  const cl::Array<float> points(context, std::span<const float>(planes));
  const cl::Array<std::uint32_t> neighbours(context, std::span<const std::uint32_t>(indices));
  const cl::Array<float> centroids(context, 2 * std::size_t{kCount});
  const kiln_ao_denoiser_params params{kCount, kCount};
  context.launch(context.kernel("ao_denoiser", "kiln_ao_denoiser_compute_weights"), kCount, 64,
                 params, neighbours, points);
  context.launch(context.kernel("ao_denoiser", "kiln_ao_denoiser_measure_centroids"), kCount, 64,
                 params, neighbours, centroids);
  const std::vector<std::uint32_t> packed = neighbours.download(context);
  const std::vector<float> found = centroids.download(context);
  const auto at = [&](std::size_t first, std::uint32_t i) {
    return Vec3d(planes[first * kCount + i], planes[(first + 1) * kCount + i],
                 planes[(first + 2) * kCount + i]);
  };
  std::size_t weighted = 0, cut = 0;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    double squared[8], share[8], nearest = 1e300, sum = 1;
    for (std::size_t k = 0; k < 8; ++k) {
      const Vec3d way = at(0, indices[8 * i + k]) - at(0, i);
      squared[k] = dot(way, way) * (k < 4 ? 1 : 0.5);
      if (indices[8 * i + k] != i) nearest = std::min(nearest, squared[k]);
    }
    for (std::size_t k = 0; k < 8; ++k) {
      const std::uint32_t other = indices[8 * i + k];
      const double similarity = std::max(0.0, 1 - 10 * (1 - dot(at(3, i), at(3, other))));
      const bool counts = other != i && squared[k] <= 36 * nearest;
      cut += other != i && !counts ? 1 : 0;
      share[k] = counts ? similarity * similarity : 0;
      sum += share[k];
    }
    double x = 0, y = 0, own = 1;
    constexpr int kColumns[8] = {-1, 1, 0, 0, -1, 1, -1, 1}, kRows[8] = {0, 0, -1, 1, -1, -1, 1, 1};
    for (std::size_t k = 0; k < 8; ++k) {
      const std::uint32_t weight = packed[8 * i + k] >> 24U;
      EXPECT_EQ(packed[8 * i + k] & 0xFFFFFFU, indices[8 * i + k]);
      EXPECT_NEAR(weight, share[k] / sum * 256, 1.01) << i << " " << k;
      weighted += weight > 8 ? 1 : 0;
      x += kColumns[k] * (weight / 256.0);
      y += kRows[k] * (weight / 256.0);
      own -= weight / 256.0;
    }
    EXPECT_NEAR(found[2 * i], x * x + y * y + std::max(0.0, own - 0.25), 1e-5) << i;
    EXPECT_EQ(found[2 * i + 1], found[2 * i]);
  }
  EXPECT_GT(weighted, 500U);
  EXPECT_GT(cut, 50U);
}

}  // namespace
}  // namespace kiln

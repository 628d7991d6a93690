// Ambient occlusion to a given error: what smoothing takes away, and what it leaves.
#include <gtest/gtest.h>

#include <cmath>

#include "detail/occlusion_scene.h"
#include "kiln/unwrap.h"
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

/// No error is too large: 16 rays a texel, smoothed.
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
}

}  // namespace
}  // namespace kiln

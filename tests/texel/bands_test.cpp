// Bands of texels: any size and order gives the same map, and nothing lies beyond the count.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "reference/texel.h"
#include "support/environment.h"
#include "texel/texel_samples.h"
#include "texel/texels.h"

namespace kiln {
namespace {

using test::Map;
using test::random_triangle;
using test::ReferenceTriangle;
using test::sample_all;
using test::surface_of;
using test::tiling;

TEST(Texel, SmallBandsGiveTheSameMap) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(5);
  std::vector<ReferenceTriangle> triangles;
  for (int i = 0; i < 60; ++i) triangles.push_back(random_triangle(random, 0.3F));
  const LowSurface surface = surface_of(triangles);
  for (std::uint32_t samples : {1U, 2U, 3U, 8U}) {
    const Map whole = sample_all(surface, {130, 97, samples, 1U << 22});
    for (std::uint32_t bound : {1U, 2000U, 20000U}) {
      const Map cut = sample_all(surface, {130, 97, samples, bound});
      EXPECT_EQ(whole.triangle, cut.triangle);
      EXPECT_EQ(whole.barycentric, cut.barycentric);
      EXPECT_EQ(whole.point, cut.point);
      EXPECT_EQ(whole.report.texels, cut.report.texels);
      EXPECT_EQ(whole.report.overlapping_samples, cut.report.overlapping_samples);
      ASSERT_EQ(whole.report.warnings.size(), cut.report.warnings.size());
      for (std::size_t i = 0; i < whole.report.warnings.size(); ++i) {
        EXPECT_EQ(whole.report.warnings[i].message.text(), cut.report.warnings[i].message.text());
      }
    }
  }
}

TEST(Texel, NeighboursAreCloseInMemory) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(6);
  TexelSampler sampler(context_of(*test::device()), surface_of(tiling(4, random)),
                       {128, 128, 1, 1U << 22});
  const TexelBand band = sampler.sample(0);
  ASSERT_EQ(band.sample_count, 128U * 128U);
  const std::vector<std::uint32_t> index = band.texel_index.download(context_of(*test::device()));
  for (std::size_t run : {8U, 64U}) {
    for (std::size_t i = 0; i + run <= band.texel_count; i += run) {
      std::uint32_t low_x = 1000, high_x = 0, low_y = 1000, high_y = 0;
      for (std::size_t k = i; k < i + run; ++k) {
        low_x = std::min(low_x, index[k] % 128);
        high_x = std::max(high_x, index[k] % 128);
        low_y = std::min(low_y, index[k] / 128);
        high_y = std::max(high_y, index[k] / 128);
      }
      EXPECT_EQ(high_x - low_x, run == 8 ? 3U : 7U);
      EXPECT_EQ(high_y - low_y, run == 8 ? 1U : 7U);
    }
  }
}

TEST(Texel, NothingBeyondTheCountIsWritten) {
  KILN_REQUIRE_DEVICE();
  cl::Context& context = context_of(*test::device());
  std::mt19937 random(8);
  std::vector<ReferenceTriangle> triangles;
  for (int i = 0; i < 20; ++i) triangles.push_back(random_triangle(random, 0.1F));
  TexelSampler sampler(context, surface_of(triangles), {61, 43, 2, 1U << 22});
  ASSERT_EQ(sampler.band_count(), 1U);
  constexpr std::uint32_t kRoom = 20000;
  constexpr std::uint32_t kCanary = 0xABCD1234U;
  constexpr float kFloatCanary = -123456.0F;
  TexelBand large;
  large.texel_index = cl::Array<std::uint32_t>(context, kRoom);
  large.texel_first = cl::Array<std::uint32_t>(context, kRoom);
  large.sample_slot = cl::Array<std::uint32_t>(context, kRoom);
  large.triangle = cl::Array<std::uint32_t>(context, kRoom);
  large.barycentric = cl::Array<float>(context, 2 * kRoom);
  large.points = cl::Array<float>(context, 7 * kRoom);
  for (auto* array :
       {&large.texel_index, &large.texel_first, &large.sample_slot, &large.triangle}) {
    context.fill(*array, kCanary);
  }
  context.fill(large.barycentric, kFloatCanary);
  context.fill(large.points, kFloatCanary);
  const TexelBand band = sampler.sample(0, std::move(large));
  ASSERT_EQ(band.capacity, kRoom);
  ASSERT_GT(band.sample_count, 100U);
  ASSERT_LT(band.sample_count, kRoom);
  const auto check = [&](const auto& values, std::size_t plane, std::size_t count, auto canary) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(values[i] == canary, i % plane >= count) << i;
    }
  };
  check(band.texel_index.download(context), kRoom, band.texel_count, kCanary);
  check(band.texel_first.download(context), kRoom, band.texel_count + 1, kCanary);
  check(band.sample_slot.download(context), kRoom, band.sample_count, kCanary);
  check(band.triangle.download(context), kRoom, band.sample_count, kCanary);
  check(band.barycentric.download(context), kRoom, band.sample_count, kFloatCanary);
  check(band.points.download(context), kRoom, band.sample_count, kFloatCanary);
}

TEST(Texel, BandsInAnyOrderCountOnce) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(11);
  TexelSampler sampler(context_of(*test::device()), surface_of(tiling(3, random)),
                       {64, 64, 1, 600});
  ASSERT_GT(sampler.band_count(), 4U);
  for (std::uint32_t b = sampler.band_count(); b-- > 0;) sampler.sample(b);
  sampler.sample(2);
  EXPECT_EQ(sampler.report().samples, 64U * 64U);
}

}  // namespace
}  // namespace kiln

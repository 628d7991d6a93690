// The sample volumes: fields with the sign and slope that they promise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <string>

#include "fields.h"
#include "kiln/volume.h"

namespace kiln::sample {
namespace {

template <typename T>
T voxel(const Volume& volume, std::size_t x, std::size_t y, std::size_t z) {
  T value{};
  const std::size_t i = (z * volume.size[1] + y) * volume.size[0] + x;
  std::memcpy(&value, volume.voxels.data() + i * sizeof(T), sizeof(T));
  return value;
}

TEST(SampleVolume, SolidsHaveTheirVolumeAndStayInside) {
  constexpr std::uint32_t n = 81;
  constexpr double pi = std::numbers::pi;
  for (const char* name : {"sphere", "torus", "gyroid", "boxes"}) {
    SCOPED_TRACE(name);
    const Volume volume = sample_volume(*field_of(name), n, VoxelType::f32);
    const double spacing = volume.axes[0][0];
    EXPECT_DOUBLE_EQ(volume.origin[0] + (n - 1) * spacing, 1.1);
    double inside = 0, steepest = 0;
    for (std::size_t z = 0; z < n; ++z) {
      for (std::size_t y = 0; y < n; ++y) {
        for (std::size_t x = 0; x < n; ++x) {
          const double value = voxel<float>(volume, x, y, z);
          inside += value > 0;
          const bool border = std::min({x, y, z}) == 0 || std::max({x, y, z}) == n - 1;
          if (border) {
            ASSERT_LT(value, 0);
          }
          if (x + 1 < n) {
            const double next = voxel<float>(volume, x + 1, y, z);
            steepest = std::max(steepest, std::abs(next - value) / spacing);
          }
        }
      }
    }
    inside *= spacing * spacing * spacing;
    if (name == std::string("sphere")) {
      EXPECT_NEAR(inside, 4.0 / 3 * pi * 0.729, 0.03);
    }
    if (name == std::string("torus")) {
      EXPECT_NEAR(inside, 2 * pi * pi * 0.65 * 0.0625, 0.02);
    }
    EXPECT_GT(inside, 0.3);
    EXPECT_LT(inside, 3.1);
    // Distances have a slope of at most 1; the gyroid's first-order one may be steeper far off.
    if (name != std::string("gyroid")) {
      EXPECT_LT(steepest, 1 + 1e-5);
    }
  }
}

TEST(SampleVolume, BoxesHaveFlatFacesWithExactDistances) {
  // Just off a face of the body, away from the other boxes.
  EXPECT_NEAR(boxes_field({-0.2, 0.30, -0.51}), -0.01, 1e-12);
  EXPECT_NEAR(boxes_field({-0.2, 0.30, -0.49}), 0.01, 1e-12);
}

TEST(SampleVolume, IntegersHoldTheBandAroundTheSurface) {
  constexpr std::uint32_t n = 64;
  const Volume exact = sample_volume(sphere_field, n, VoxelType::f32);
  const double spacing = exact.axes[0][0];
  const Volume bytes = sample_volume(sphere_field, n, VoxelType::u8);
  const Volume words = sample_volume(sphere_field, n, VoxelType::u16);
  for (std::size_t i = 0; i < n; ++i) {
    const double share = std::clamp(voxel<float>(exact, i, 30, 31) / (4 * spacing), -1.0, 1.0);
    EXPECT_NEAR(voxel<std::uint8_t>(bytes, i, 30, 31), 127.5 + 127.5 * share, 0.501);
    EXPECT_NEAR(voxel<std::uint16_t>(words, i, 30, 31), 32767.5 + 32767.5 * share, 0.51);
  }
  EXPECT_EQ(voxel<std::uint8_t>(bytes, 0, 0, 0), 0);
  EXPECT_EQ(voxel<std::uint8_t>(bytes, n / 2, n / 2, n / 2), 255);
  EXPECT_EQ(bytes.voxels, sample_volume(sphere_field, n, VoxelType::u8).voxels);
}

TEST(SampleVolume, RefusesWhatItCannotMake) {
  EXPECT_THROW(sample_volume(sphere_field, 1, VoxelType::f32), Error);
  EXPECT_THROW(sample_volume(sphere_field, 8, VoxelType::i32), Error);
  EXPECT_EQ(field_of("cube"), std::nullopt);
}

}  // namespace
}  // namespace kiln::sample

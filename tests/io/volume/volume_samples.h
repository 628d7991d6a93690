// Volumes for tests of their files, and ways to load and compare them.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volume_check.h"

namespace kiln::test::volume_samples {

inline constexpr VoxelType all_types[] = {VoxelType::u8,  VoxelType::i8,  VoxelType::u16,
                                          VoxelType::i16, VoxelType::u32, VoxelType::i32,
                                          VoxelType::f32, VoxelType::f64};

/// All in one folder.
inline std::filesystem::path write_file(const std::string& name, const std::string& content) {
  static const std::filesystem::path folder = scratch_folder();
  const std::filesystem::path path = folder / name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

struct Loaded {
  Volume volume;
  std::vector<Warning> warnings;

  std::uint64_t count(const std::string& code) const {
    std::uint64_t sum = 0;
    for (const Warning& warning : warnings) sum += warning.code == code ? warning.count : 0;
    return sum;
  }
};

inline Loaded load(const std::filesystem::path& path) {
  Loaded result;
  result.volume = load_volume(path, &result.warnings);
  EXPECT_EQ(broken_promise(result.volume), "") << path;
  return result;
}

template <typename T>
T voxel(const Volume& volume, std::size_t i) {
  T value{};
  std::memcpy(&value, volume.voxels.data() + i * sizeof(T), sizeof(T));
  return value;
}

template <typename T>
void set_voxels(Volume& volume, const std::vector<T>& values) {
  volume.voxels.resize(values.size() * sizeof(T));
  std::memcpy(volume.voxels.data(), values.data(), volume.voxels.size());
}

/// 4 x 3 x 2 voxels whose bytes all differ in a value of several, and the type's extremes; axes turned
/// and of different lengths.
inline Volume sample(VoxelType type) {
  Volume volume;
  volume.size = {4, 3, 2};
  volume.type = type;
  volume.origin = {-12.5, 0.1, 1e6};
  volume.axes = {{{0.36, 0.48, 0}, {-0.8, 0.6, 0}, {0, 0.25, 2.75}}};
  const auto fill = [&volume](auto one) {
    using T = decltype(one);
    std::vector<T> values(24);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double share = static_cast<double>(i) / 23;
      values[i] =
          static_cast<T>(static_cast<double>(std::numeric_limits<T>::lowest()) / 3 * share +
                         static_cast<double>(std::numeric_limits<T>::max()) / 3 * (1 - share));
    }
    values[3] = std::numeric_limits<T>::max();
    values[4] = std::numeric_limits<T>::lowest();
    values[5] = 1;
    set_voxels(volume, values);
  };
  switch (type) {
    case VoxelType::u8:
      fill(std::uint8_t{});
      break;
    case VoxelType::i8:
      fill(std::int8_t{});
      break;
    case VoxelType::u16:
      fill(std::uint16_t{});
      break;
    case VoxelType::i16:
      fill(std::int16_t{});
      break;
    case VoxelType::u32:
      fill(std::uint32_t{});
      break;
    case VoxelType::i32:
      fill(std::int32_t{});
      break;
    case VoxelType::f32:
      fill(float{});
      break;
    case VoxelType::f64:
      fill(double{});
      break;
  }
  return volume;
}

/// Equal but for the name; geometry within `tolerance`, absolute.
inline void expect_same(const Volume& got, const Volume& wanted, double tolerance = 0) {
  EXPECT_EQ(got.size, wanted.size);
  EXPECT_EQ(got.type, wanted.type);
  EXPECT_EQ(got.voxels, wanted.voxels);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(got.origin[c], wanted.origin[c], tolerance);
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(got.axes[a][c], wanted.axes[a][c], tolerance) << "axis " << a;
    }
  }
}

}  // namespace kiln::test::volume_samples

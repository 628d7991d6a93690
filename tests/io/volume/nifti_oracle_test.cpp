// NIfTI against nibabel: places in space and voxels of files that it wrote (tests/data/nifti/make.py).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "kiln/volume.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

template <typename T>
double value_at(const Volume& volume, std::size_t i) {
  T value;
  std::memcpy(&value, &volume.voxels[i * sizeof(T)], sizeof(T));
  return static_cast<double>(value);
}

double voxel(const Volume& volume, std::size_t i) {
  switch (volume.type) {
    case VoxelType::u8:
      return value_at<std::uint8_t>(volume, i);
    case VoxelType::i8:
      return value_at<std::int8_t>(volume, i);
    case VoxelType::u16:
      return value_at<std::uint16_t>(volume, i);
    case VoxelType::i16:
      return value_at<std::int16_t>(volume, i);
    case VoxelType::u32:
      return value_at<std::uint32_t>(volume, i);
    case VoxelType::i32:
      return value_at<std::int32_t>(volume, i);
    case VoxelType::f32:
      return value_at<float>(volume, i);
    default:
      return value_at<double>(volume, i);
  }
}

TEST(NiftiOracle, ReadsWhatNibabelReads) {
  const fs::path folder = test::test_data("nifti");
  std::ifstream expected(folder / "expected.txt");
  int files = 0;
  for (std::string line; std::getline(expected, line); ++files) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    SCOPED_TRACE(name);
    const std::vector<double> numbers{std::istream_iterator<double>(words), {}};
    ASSERT_EQ(numbers.size(), 12U + 24U);
    std::vector<Warning> warnings;
    const Volume volume = load_volume(folder / name, &warnings);
    EXPECT_TRUE(warnings.empty());
    EXPECT_EQ(volume.size, (std::array<std::uint32_t, 3>{4, 3, 2}));
    for (std::size_t row = 0; row < 3; ++row) {
      // Rotations lose their last digits to the quaternion's single precision.
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(volume.axes[axis][row], numbers[4 * row + axis], 1e-6) << row << axis;
      }
      EXPECT_EQ(volume.origin[row], numbers[4 * row + 3]);
    }
    for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(voxel(volume, i), numbers[12 + i]) << i;
  }
  EXPECT_EQ(files, 11);
}

TEST(NiftiOracle, PairsNeedBothFiles) {
  const fs::path folder = test::scratch_folder();
  const auto message = [&](const fs::path& path) {
    try {
      load_volume(path);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      return std::string(error.what());
    }
    ADD_FAILURE() << path << " was read";
    return std::string();
  };
  const auto expect_words = [](const std::string& text, const std::vector<std::string>& words) {
    for (const std::string& word : words) EXPECT_NE(text.find(word), text.npos) << text;
  };
  fs::copy_file(test::test_data("nifti") / "pair.hdr", folder / "alone.hdr");
  expect_words(message(folder / "alone.hdr"), {"alone.hdr", "alone.img"});
  fs::copy_file(test::test_data("nifti") / "pair.hdr", folder / "alone.nii");
  expect_words(message(folder / "alone.nii"), {"two files", ".hdr"});
  fs::copy_file(test::test_data("nifti") / "pair.img", folder / "alone.img");
  expect_words(message(folder / "alone.img"), {"data file of a NIfTI volume", "alone.hdr"});
  fs::resize_file(folder / "alone.img", 47);
  expect_words(message(folder / "alone.hdr"), {"48 bytes", "47", "truncated"});
}

}  // namespace
}  // namespace kiln

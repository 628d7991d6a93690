// Reading OpenVDB, in builds that have it.
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "kiln/volume.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/volume_check.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

fs::path write(const std::string& name, const openvdb::GridPtrVec& grids) {
  const fs::path path = test::scratch_folder() / name;
  openvdb::io::File file(path.string());
  file.write(grids);
  file.close();
  return path;
}

float at(const Volume& volume, std::size_t x, std::size_t y, std::size_t z) {
  float value = 0;
  std::memcpy(
      &value,
      volume.voxels.data() + ((z * volume.size[1] + y) * volume.size[0] + x) * sizeof(float),
      sizeof value);
  return value;
}

std::string error_of(const fs::path& path) {
  try {
    load_volume(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    return error.what();
  }
  return {};
}

TEST(VolumeVdb, ReadsAFogWithItsMarginAndPlace) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(0.5f);
  grid->setName("density");
  openvdb::math::Mat4d matrix = openvdb::math::Mat4d::identity();
  matrix.preScale(openvdb::Vec3d(2, 3, 4));
  matrix.postTranslate(openvdb::Vec3d(10, 20, 30));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  auto accessor = grid->getAccessor();
  accessor.setValue({-1, 5, 7}, 2.0f);
  accessor.setValue({1, 6, 9}, 3.0f);
  std::vector<Warning> warnings;
  const Volume volume = load_volume(write("Fog.VDB", {grid}), &warnings);
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(test::broken_promise(volume), "");
  EXPECT_EQ(volume.name, "Fog");
  EXPECT_EQ(volume.type, VoxelType::f32);
  EXPECT_EQ(volume.size, (std::array<std::uint32_t, 3>{3 + 4, 2 + 4, 3 + 4}));
  EXPECT_EQ(volume.origin, (std::array<double, 3>{10 + 2 * -3, 20 + 3 * 3, 30 + 4 * 5}));
  const std::array<std::array<double, 3>, 3> axes{{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}};
  EXPECT_EQ(volume.axes, axes);
  EXPECT_EQ(at(volume, 2, 2, 2), 2.0f);
  EXPECT_EQ(at(volume, 4, 3, 4), 3.0f);
  for (std::size_t z = 0; z < 7; ++z) {
    for (std::size_t y = 0; y < 6; ++y) {
      for (std::size_t x = 0; x < 7; ++x) {
        if ((x == 2 && y == 2 && z == 2) || (x == 4 && y == 3 && z == 4)) continue;
        ASSERT_EQ(at(volume, x, y, z), 0.5f);
      }
    }
  }
}

TEST(VolumeVdb, ReadsALevelSetOfASphere) {
  openvdb::initialize();
  const float radius = 5, voxel = 0.25f;
  const auto grid =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(radius, {1, 2, 3}, voxel);
  const Volume volume = load_volume(write("sphere.vdb", {grid}));
  double worst = 0;
  std::size_t inside = 0;
  for (std::size_t z = 0; z < volume.size[2]; ++z) {
    for (std::size_t y = 0; y < volume.size[1]; ++y) {
      for (std::size_t x = 0; x < volume.size[0]; ++x) {
        const double dx = volume.origin[0] + static_cast<double>(x) * volume.axes[0][0] - 1;
        const double dy = volume.origin[1] + static_cast<double>(y) * volume.axes[1][1] - 2;
        const double dz = volume.origin[2] + static_cast<double>(z) * volume.axes[2][2] - 3;
        const double distance = std::hypot(dx, dy, dz) - radius;
        const double value = at(volume, x, y, z);
        inside += value < 0;
        // Beyond the narrow band of three voxels: its half width, with the side's sign.
        const double wanted = std::clamp(distance, -3.0 * voxel, 3.0 * voxel);
        worst = std::max(worst, std::abs(value - wanted));
      }
    }
  }
  EXPECT_LT(worst, 1e-4);
  const double ball = 4.0 / 3 * 3.14159265 * radius * radius * radius / (voxel * voxel * voxel);
  EXPECT_NEAR(static_cast<double>(inside), ball, 0.01 * ball);
}

TEST(VolumeVdb, TakesTheFirstScalarGridAndNamesTheOthers) {
  openvdb::initialize();
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  vectors->tree().setValue({0, 0, 0}, {1, 2, 3});
  const auto doubles = openvdb::DoubleGrid::create(0);
  doubles->setName("heat");
  doubles->tree().setValue({0, 0, 0}, std::numeric_limits<double>::quiet_NaN());
  std::vector<Warning> warnings;
  const Volume volume = load_volume(write("two.vdb", {vectors, doubles}), &warnings);
  EXPECT_EQ(volume.size, (std::array<std::uint32_t, 3>{5, 5, 5}));
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0].code, "ignored-grids");
  EXPECT_EQ(warnings[0].count, 1u);
  EXPECT_NE(warnings[0].message.text().find("velocity"), std::string::npos);
  EXPECT_EQ(warnings[1].code, "non-finite-voxels");
}

TEST(VolumeVdb, RefusesWhatItCannotUse) {
  openvdb::initialize();
  EXPECT_TRUE(reads_openvdb());
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  vectors->tree().setValue({0, 0, 0}, {1, 2, 3});
  EXPECT_NE(error_of(write("v.vdb", {vectors})).find("velocity"), std::string::npos);
  const auto grid = openvdb::FloatGrid::create(0);
  EXPECT_NE(error_of(write("none.vdb", {grid})).find("no active voxels"), std::string::npos);
  grid->tree().setValue({0, 0, 0}, 1);
  grid->tree().setValue({1 << 20, 1 << 20, 1 << 20}, 1);
  EXPECT_NE(error_of(write("far.vdb", {grid})).find("limit"), std::string::npos);
  grid->tree().setValue({std::numeric_limits<int>::max(), 0, 0}, 1);
  EXPECT_NE(error_of(write("end.vdb", {grid})).find("index space"), std::string::npos);
  const fs::path path = test::scratch_folder() / "bad.vdb";
  std::ofstream(path) << "\x20\x42\x44\x56 and no more";
  const std::string message = error_of(path);
  EXPECT_NE(message.find("does not begin as an OpenVDB file"), std::string::npos) << message;
}

fs::path write_bytes(const std::string& name, const std::string& bytes) {
  const fs::path path = test::scratch_folder() / name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

/// Little-endian.
std::string number(std::uint64_t value, std::size_t bytes) {
  std::string result;
  for (std::size_t k = 0; k < bytes; ++k) result += static_cast<char>(value >> (8 * k) & 255);
  return result;
}

const std::string& header() {
  static const std::string text = number(0x56444220, 8) + number(224, 4) + number(9, 4) +
                                  number(0, 4) + '\1' + std::string(36, '0');
  return text;
}

TEST(VolumeVdb, RefusesLengthsBeyondTheFile) {
  // OpenVDB would allocate or read on for gigabytes.
  const std::string none = number(0, 4);
  const std::string long_name = number(0xfffffff0, 4);
  const struct {
    std::string rest, place;
  } cases[] = {
      {number(2, 4) + long_name + std::string(100, 'x'), "byte 61: the file is damaged: the name"},
      {number(0x050607ff, 4) + std::string(100, 'x'), "metadata need more"},
      {number(1, 4) + number(1, 4) + 'a' + number(6, 4) + "string" + long_name + "abcd",
       "metadata 0 of 4294967280 bytes"},
      {number(1, 4) + number(1, 4) + 'a' + number(5, 4) + "int32" + number(8, 4) + "abcdefgh",
       "8 bytes instead of 4"},
      {none + number(0xffffffff, 4), "-1 grids"},
      {none + number(1000000, 4) + std::string(100, 'x'), "1000000 grids"},
      {none + number(1, 4) + long_name + std::string(100, 'x'), "the name of grid 0"},
      {none + number(1, 4) + number(1, 4) + 'a' + long_name + std::string(100, 'x'),
       "the type of grid 0"},
      {none + number(1, 4) + number(1, 4) + 'a' + number(16, 4) + "Tree_float_5_4_3" + none +
           number(100, 8) + number(1000, 8) + number(1 << 30, 8),
       "grid 0 is said to lie from byte 100"},
      {none.substr(1), "the number of metadata"},
  };
  for (const auto& [rest, place] : cases) {
    const std::string message = error_of(write_bytes("frame.vdb", header() + rest));
    EXPECT_NE(message.find("damaged"), std::string::npos) << message;
    EXPECT_NE(message.find(place), std::string::npos) << message;
  }
  for (const auto& entry : fs::directory_iterator(test::test_data("fuzz") / "vdb")) {
    EXPECT_NE(error_of(entry.path()).find("damaged"), std::string::npos) << entry.path();
  }
  EXPECT_NE(error_of(write_bytes("short.vdb", "BDV")).find("does not begin"), std::string::npos);
}

TEST(VolumeVdb, RefusesATruncatedFileAndARootBeyondIt) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(0.5f);
  grid->tree().setValue({0, 0, 0}, 1);
  const std::string whole = test::read_file(write("whole.vdb", {grid}));
  EXPECT_EQ(error_of(write_bytes("same.vdb", whole)), "");
  for (const std::size_t size : {whole.size() - 1, whole.size() / 2, std::size_t{200}}) {
    const std::string message = error_of(write_bytes("cut.vdb", whole.substr(0, size)));
    EXPECT_NE(message.find("damaged"), std::string::npos) << size << ": " << message;
  }
  // The root's table: background, no tile, one node, whose origin is 0.
  const std::string root = number(0x3f000000, 4) + number(0, 4) + number(1, 4) + number(0, 12);
  const std::size_t at = whole.find(root);
  ASSERT_NE(at, std::string::npos);
  for (const std::size_t count : {at + 4, at + 8}) {
    std::string bad = whole;
    bad.replace(count, 4, number(0x7fffffff, 4));
    const std::string message = error_of(write_bytes("root.vdb", bad));
    EXPECT_NE(message.find("2147483647"), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace kiln

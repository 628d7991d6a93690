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
  EXPECT_NE(warnings[0].message.find("velocity"), std::string::npos);
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
  EXPECT_NE(message.find("OpenVDB cannot read it"), std::string::npos) << message;
}

}  // namespace
}  // namespace kiln

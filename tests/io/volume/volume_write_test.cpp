// Writing volumes: what was written is read again, and files are whole or absent.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <limits>

#include "io/volume/volume_reader.h"
#include "io/volume/volume_samples.h"
#include "kiln/volume.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::volume_samples::all_types;
using test::volume_samples::expect_same;
using test::volume_samples::load;
using test::volume_samples::Loaded;
using test::volume_samples::sample;

TEST(VolumeIo, ReadsTheNrrdThatItWrites) {
  const fs::path path = test::scratch_folder() / "out.nrrd";
  for (const VoxelType type : all_types) {
    Volume wanted = sample(type);
    wanted.name = "a name\nof two lines";
    save_nrrd(wanted, path);
    const Loaded got = load(path);
    expect_same(got.volume, wanted);
    EXPECT_TRUE(got.warnings.empty());
    EXPECT_EQ(got.volume.name, "out");
  }
  EXPECT_TRUE(rc::check("any volume", [&path] {
    Volume volume;
    volume.type =
        *rc::gen::elementOf(std::vector<VoxelType>(std::begin(all_types), std::end(all_types)));
    for (auto& n : volume.size) n = *rc::gen::inRange<std::uint32_t>(1, 6);
    volume.voxels.resize(std::size_t{volume.size[0]} * volume.size[1] * volume.size[2] *
                         size_of(volume.type));
    for (auto& byte : volume.voxels) byte = std::byte{*rc::gen::arbitrary<std::uint8_t>()};
    for (auto& axis : volume.axes) {
      for (double& c : axis) c = *rc::gen::arbitrary<int>() / 7.0;
    }
    for (double& c : volume.origin) c = *rc::gen::arbitrary<int>() / 3.0;
    RC_PRE(geometry_fault(volume).empty());
    save_nrrd(volume, path);
    const Volume got = load_volume(path);
    RC_ASSERT(got.size == volume.size);
    RC_ASSERT(got.type == volume.type);
    RC_ASSERT(got.voxels == volume.voxels);
    RC_ASSERT(got.origin == volume.origin);
    RC_ASSERT(got.axes == volume.axes);
  }));
}

TEST(VolumeIo, WritesWholeOrNotAtAll) {
  Volume volume = sample(VoxelType::u8);
  const fs::path path = test::scratch_folder() / "refused.nrrd";
  const auto code_of = [&](const fs::path& to) {
    try {
      save_nrrd(volume, to);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code_of(test::scratch_folder() / "no_folder" / "v.nrrd"), ErrorCode::output);
  volume.voxels.pop_back();
  EXPECT_EQ(code_of(path), ErrorCode::usage);
  volume = sample(VoxelType::u8);
  volume.axes[1] = volume.axes[0];
  EXPECT_EQ(code_of(path), ErrorCode::usage);
  volume.axes[1] = {0, std::numeric_limits<double>::quiet_NaN(), 0};
  EXPECT_EQ(code_of(path), ErrorCode::usage);
  EXPECT_FALSE(fs::exists(path));
}

TEST(VolumeIo, NamesItsTypes) {
  for (const VoxelType type : all_types) EXPECT_EQ(voxel_type_of(name_of(type)), type);
  EXPECT_EQ(voxel_type_of("u64"), std::nullopt);
  EXPECT_EQ(voxel_type_of(""), std::nullopt);
}

}  // namespace
}  // namespace kiln

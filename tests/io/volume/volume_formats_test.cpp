// Reading volumes: every format, type, byte order and encoding. Bad files: volume_bad_test.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "io/volume/volume_reader.h"
#include "io/volume/volume_samples.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volume_files.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::volume_samples::all_types;
using test::volume_samples::expect_same;
using test::volume_samples::load;
using test::volume_samples::Loaded;
using test::volume_samples::sample;
using test::volume_samples::voxel;
using test::volume_samples::write_file;

constexpr ByteOrder both_orders[] = {ByteOrder::little, ByteOrder::big};

std::string number(double value) {
  std::ostringstream text;
  text.precision(17);
  text << value;
  return text.str();
}

std::string order_name(ByteOrder order) { return order == ByteOrder::little ? "little" : "big"; }

/// All voxels as text.
std::string text_of(const Volume& volume, const std::string& between) {
  std::string text;
  for (std::size_t i = 0; i < 24; ++i) {
    switch (volume.type) {
      case VoxelType::u8:
        text += std::to_string(voxel<std::uint8_t>(volume, i));
        break;
      case VoxelType::i8:
        text += std::to_string(voxel<std::int8_t>(volume, i));
        break;
      case VoxelType::u16:
        text += std::to_string(voxel<std::uint16_t>(volume, i));
        break;
      case VoxelType::i16:
        text += std::to_string(voxel<std::int16_t>(volume, i));
        break;
      case VoxelType::u32:
        text += std::to_string(voxel<std::uint32_t>(volume, i));
        break;
      case VoxelType::i32:
        text += std::to_string(voxel<std::int32_t>(volume, i));
        break;
      case VoxelType::f32:
        text += number(voxel<float>(volume, i));
        break;
      case VoxelType::f64:
        text += number(voxel<double>(volume, i));
        break;
    }
    text += between;
  }
  return text;
}

std::string nrrd_header(const Volume& volume, const std::string& encoding, ByteOrder order,
                        const std::string& more = "") {
  static constexpr const char* types[] = {"uint8",        "signed char", "ushort", "int16_t",
                                          "unsigned int", "int",         "float",  "double"};
  std::string text = "NRRD0005\ntype: " + std::string(types[static_cast<int>(volume.type)]) +
                     "\ndimension: 3\nspace: right-anterior-superior\nsizes: 4 3 2\n" +
                     "encoding: " + encoding + "\nendian: " + order_name(order) +
                     "\nspace directions:";
  for (const auto& a : volume.axes) {
    text += " (" + number(a[0]) + ", " + number(a[1]) + "," + number(a[2]) + ")";
  }
  text += "\nspace origin: (" + number(volume.origin[0]) + "," + number(volume.origin[1]) + "," +
          number(volume.origin[2]) + ")\n";
  return text + more + "\n";
}

std::string meta_header(const Volume& volume, ByteOrder order, const std::string& more,
                        const std::string& file = "LOCAL") {
  static constexpr const char* types[] = {"UCHAR", "CHAR", "USHORT", "SHORT",
                                          "UINT",  "INT",  "FLOAT",  "DOUBLE"};
  std::string text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementByteOrderMSB = " +
                     std::string(order == ByteOrder::big ? "True" : "False") + "\n" + more;
  // Directions of length 1 beside their spacings.
  std::string directions, spacing;
  for (const auto& a : volume.axes) {
    const double length = std::hypot(a[0], a[1], a[2]);
    spacing += " " + number(length);
    for (const double c : a) directions += " " + number(c / length);
  }
  text += "TransformMatrix =" + directions + "\nOffset = " + number(volume.origin[0]) + " " +
          number(volume.origin[1]) + " " + number(volume.origin[2]) +
          "\nElementSpacing =" + spacing + "\nDimSize = 4 3 2\nElementType = MET_" +
          types[static_cast<int>(volume.type)] + "\nElementDataFile = " + file + "\n";
  return text;
}

test::NiftiFile nifti_file(const Volume& volume, bool second, ByteOrder order) {
  static constexpr std::int16_t codes[] = {2, 256, 512, 4, 768, 8, 16, 64};
  test::NiftiFile file;
  file.second = second;
  file.order = order;
  file.dim = {3, 4, 3, 2, 1, 1, 1, 1};
  file.datatype = codes[static_cast<int>(volume.type)];
  file.sform = 2;
  for (std::size_t r = 0; r < 3; ++r) {
    file.rows[r] = {volume.axes[0][r], volume.axes[1][r], volume.axes[2][r], volume.origin[r]};
  }
  return file;
}

// ---- one volume in every variant ----------------------------------------------------------------

TEST(VolumeIo, ReadsOneVolumeFromEveryFormat) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(test::test_data("volume"))) {
    if (entry.path().extension() == ".raw") continue;
    SCOPED_TRACE(entry.path());
    const Loaded ramp = load(entry.path());
    EXPECT_TRUE(ramp.warnings.empty()) << ramp.warnings[0].message.text();
    const bool scaled = entry.path().stem() == "ramp_scaled";
    EXPECT_EQ(ramp.volume.type, scaled ? VoxelType::f32 : VoxelType::i16);
    EXPECT_EQ(ramp.volume.size, (std::array<std::uint32_t, 3>{3, 2, 2}));
    for (std::size_t i = 0; i < 12; ++i) {
      if (scaled) {
        EXPECT_EQ(voxel<float>(ramp.volume, i), 0.5f * static_cast<float>(10 + i) - 1);
      } else {
        EXPECT_EQ(voxel<std::int16_t>(ramp.volume, i), static_cast<std::int16_t>(10 + i));
      }
    }
    EXPECT_EQ(ramp.volume.origin, (std::array<double, 3>{5, 6, 7}));
    const std::array<std::array<double, 3>, 3> axes{{{1, 0, 0}, {0, 2, 0}, {0, 0, 3}}};
    EXPECT_EQ(ramp.volume.axes, axes);
    EXPECT_EQ(ramp.volume.name.rfind("ramp", 0), 0u);
    EXPECT_EQ(ramp.volume.name.find('.'), std::string::npos);
    ++files;
  }
  EXPECT_EQ(files, 17);
}

TEST(VolumeIo, ReadsNrrdOfEveryTypeOrderAndEncoding) {
  for (const VoxelType type : all_types) {
    const Volume wanted = sample(type);
    for (const ByteOrder order : both_orders) {
      SCOPED_TRACE(name_of(type) + order_name(order));
      const std::string voxels = test::voxel_bytes(wanted, order);
      expect_same(load(write_file("a.nrrd", nrrd_header(wanted, "raw", order) + voxels)).volume,
                  wanted);
      expect_same(load(write_file("a.NRRD",
                                  nrrd_header(wanted, "gzip", order) + test::packed(voxels, true)))
                      .volume,
                  wanted);
      expect_same(
          load(write_file("a.nrrd", nrrd_header(wanted, "ASCII", order) + text_of(wanted, ",\n")))
              .volume,
          wanted);
    }
  }
}

TEST(VolumeIo, ReadsMetaImageOfEveryTypeOrderAndEncoding) {
  for (const VoxelType type : all_types) {
    const Volume wanted = sample(type);
    for (const ByteOrder order : both_orders) {
      SCOPED_TRACE(name_of(type) + order_name(order));
      const std::string voxels = test::voxel_bytes(wanted, order);
      expect_same(load(write_file("a.mha", meta_header(wanted, order, "") + voxels)).volume, wanted,
                  1e-15);
      expect_same(load(write_file("a.Mha", meta_header(wanted, order, "CompressedData = True\n") +
                                               test::packed(voxels, false)))
                      .volume,
                  wanted, 1e-15);
      write_file("a.zraw", test::packed(voxels, false));
      expect_same(
          load(write_file("a.mhd", meta_header(wanted, order, "CompressedData = True\n", "a.zraw")))
              .volume,
          wanted, 1e-15);
      write_file("a.raw", "skipped" + voxels);
      for (const char* skip : {"HeaderSize = 7\n", "HeaderSize = -1\n"}) {
        expect_same(load(write_file("a.mhd", meta_header(wanted, order, skip, "a.raw"))).volume,
                    wanted, 1e-15);
      }
    }
  }
}

TEST(VolumeIo, ReadsNiftiOfEveryTypeOrderAndVersion) {
  for (const VoxelType type : all_types) {
    const Volume wanted = sample(type);
    for (const ByteOrder order : both_orders) {
      for (const bool second : {false, true}) {
        SCOPED_TRACE(name_of(type) + order_name(order) + (second ? "2" : "1"));
        const std::string file =
            nifti_file(wanted, second, order).text(test::voxel_bytes(wanted, order));
        const double tolerance = second ? 0 : 1e-6;  // version 1 has floats
        expect_same(load(write_file("a.nii", file)).volume, wanted, tolerance);
        expect_same(load(write_file("a.nii.GZ", test::packed(file, true))).volume, wanted,
                    tolerance);
        EXPECT_EQ(load(write_file("a.nii.gz", test::packed(file, true))).volume.name, "a");
      }
    }
  }
}

TEST(VolumeIo, ReadsRawOfEveryTypeAndOrder) {
  for (const VoxelType type : all_types) {
    Volume wanted = sample(type);
    wanted.origin = {};
    wanted.axes = {{{0.5, 0, 0}, {0, 2, 0}, {0, 0, 3}}};
    for (const ByteOrder order : both_orders) {
      for (const std::int64_t header : {std::int64_t{0}, std::int64_t{5}, std::int64_t{-1}}) {
        const fs::path path = write_file(
            "volume.raw", std::string(header == 0 ? 0 : 5, '!') + test::voxel_bytes(wanted, order));
        std::vector<Warning> warnings;
        const Volume got = load_raw_volume(path,
                                           {.size = {4, 3, 2},
                                            .type = type,
                                            .spacing = {0.5, 2, 3},
                                            .byte_order = order,
                                            .header_bytes = header},
                                           &warnings);
        expect_same(got, wanted);
        EXPECT_EQ(got.name, "volume");
        EXPECT_TRUE(warnings.empty());
      }
    }
  }
}

// ---- scaled values ------------------------------------------------------------------------------

TEST(VolumeIo, AppliesNiftiScaleToEveryType) {
  for (const VoxelType type : all_types) {
    if (type == VoxelType::f64 || type == VoxelType::f32) continue;
    Volume stored = sample(type);
    test::NiftiFile file = nifti_file(stored, false, ByteOrder::big);
    file.slope = -0.25;
    file.intercept = 3;
    const Volume got =
        load(write_file("s.nii", file.text(test::voxel_bytes(stored, ByteOrder::big)))).volume;
    ASSERT_EQ(got.type, VoxelType::f32);
    std::istringstream values(text_of(stored, " "));
    for (std::size_t i = 0; i < 24; ++i) {
      double value = 0;
      values >> value;
      EXPECT_EQ(voxel<float>(got, i), static_cast<float>(value * -0.25 + 3)) << name_of(type);
    }
  }
  Volume real = sample(VoxelType::f32);
  test::NiftiFile file = nifti_file(real, true, ByteOrder::little);
  const std::string voxels = test::voxel_bytes(real, ByteOrder::little);
  file.slope = 1;  // identity
  expect_same(load(write_file("s.nii", file.text(voxels))).volume, real);
  file.slope = std::numeric_limits<double>::quiet_NaN();
  const Loaded got = load(write_file("s.nii", file.text(voxels)));
  EXPECT_EQ(got.count("ignored-scale"), 1u);
  expect_same(got.volume, real);
}

// ---- warnings -----------------------------------------------------------------------------------

TEST(VolumeIo, CountsVoxelsThatAreNotFiniteAndKeepsThem) {
  for (const VoxelType type : {VoxelType::f32, VoxelType::f64}) {
    Volume volume = sample(type);
    const auto set = [&volume](auto bad, std::size_t i) {
      std::memcpy(volume.voxels.data() + i * sizeof bad, &bad, sizeof bad);
    };
    if (type == VoxelType::f32) {
      set(std::numeric_limits<float>::quiet_NaN(), 13);
      set(-std::numeric_limits<float>::infinity(), 20);
    } else {
      set(std::numeric_limits<double>::quiet_NaN(), 13);
      set(-std::numeric_limits<double>::infinity(), 20);
    }
    const fs::path path = test::scratch_folder() / "nan.nrrd";
    save_nrrd(volume, path);
    const Loaded got = load(path);
    EXPECT_EQ(got.volume.voxels, volume.voxels);
    EXPECT_EQ(got.count("non-finite-voxels"), 2u);
    EXPECT_NE(got.warnings.at(0).message.text().find("1, 0, 1"), std::string::npos);
    EXPECT_NE(got.warnings.at(0).message.text().find(path.string()), std::string::npos);
  }
  const Loaded text = load(write_file(
      "nan.nrrd",
      "NRRD0001\ntype: float\ndimension: 3\nspacings: 1 1 1\nsizes: 4 1 1\nencoding: text\n\n"
      "nan -inf 1e99 3"));
  EXPECT_EQ(text.count("non-finite-voxels"), 3u);
}

TEST(VolumeIo, WarnsOfTrailingBytes) {
  const Volume volume = sample(VoxelType::u16);
  const std::string voxels = test::voxel_bytes(volume, ByteOrder::little);
  const auto expect_trailing = [&](const std::string& name, const std::string& content,
                                   std::uint64_t count) {
    const Loaded got = load(write_file(name, content));
    EXPECT_EQ(got.count("trailing-bytes"), count) << name;
    EXPECT_EQ(got.volume.voxels, volume.voxels) << name;
  };
  const ByteOrder little = ByteOrder::little;
  expect_trailing("t.nrrd", nrrd_header(volume, "raw", little) + voxels + "xyz", 3);
  expect_trailing("t.nrrd", nrrd_header(volume, "gzip", little) + test::packed(voxels + "xy", true),
                  2);
  expect_trailing("t.nrrd", nrrd_header(volume, "text", little) + text_of(volume, " ") + "1 2", 2);
  expect_trailing("t.mha", meta_header(volume, little, "") + voxels + "x", 1);
  expect_trailing("t.nii", nifti_file(volume, false, little).text(voxels + "1234"), 4);
  const Loaded meta = load(write_file(
      "t.mha", meta_header(volume, little, "ElementToIntensityFunctionSlope = 2\n") + voxels));
  EXPECT_EQ(meta.count("ignored-scale"), 1u);
}

}  // namespace
}  // namespace kiln

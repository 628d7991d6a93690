// Reading and writing volumes: every format, type, byte order and encoding. Bad files:
// volume_bad_test.cpp.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "io/volume/volume_reader.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volume_check.h"
#include "support/volume_files.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr VoxelType all_types[] = {VoxelType::u8,  VoxelType::i8,  VoxelType::u16, VoxelType::i16,
                                   VoxelType::u32, VoxelType::i32, VoxelType::f32, VoxelType::f64};
constexpr ByteOrder both_orders[] = {ByteOrder::little, ByteOrder::big};

/// All in one folder.
fs::path write_file(const std::string& name, const std::string& content) {
  static const fs::path folder = test::scratch_folder();
  const fs::path path = folder / name;
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

Loaded load(const fs::path& path) {
  Loaded result;
  result.volume = load_volume(path, &result.warnings);
  EXPECT_EQ(test::broken_promise(result.volume), "") << path;
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
Volume sample(VoxelType type) {
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
void expect_same(const Volume& got, const Volume& wanted, double tolerance = 0) {
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
    EXPECT_TRUE(ramp.warnings.empty()) << ramp.warnings[0].message;
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

// ---- what the formats say of space and of where voxels are --------------------------------------

TEST(VolumeIo, ReadsNrrdSpacingsMinimaAndHandedness) {
  const std::string start = "NRRD0003\r\ntype: uchar\r\ndimension: 3\r\nsizes: 2 1 1\r\n";
  const std::string end = "encoding: raw\r\n\r\nab";
  Loaded got = load(write_file("s.nrrd", start + "spacings: 0.5 2 NaN\r\n" + end));
  const std::array<std::array<double, 3>, 3> axes{{{0.5, 0, 0}, {0, 2, 0}, {0, 0, 1}}};
  EXPECT_EQ(got.volume.axes, axes);
  EXPECT_EQ(got.count("missing-spacing"), 1u);
  EXPECT_EQ(voxel<char>(got.volume, 1), 'b');
  got = load(write_file("s.nrrd", start + "spacings: 0.5 2 4\r\naxis mins: 10 20 nan\r\n" +
                                      "centers: cell node cell\r\n" + end));
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{10.25, 20, 0}));
  EXPECT_TRUE(got.warnings.empty());
  got = load(write_file("s.nrrd", start + end));
  EXPECT_EQ(got.count("missing-spacing"), 3u);
  for (const char* space : {"left-anterior-superior", "LAS", "3D-left-handed"}) {
    got = load(write_file("s.nrrd", start + "space: " + space +
                                        "\r\nspace directions: (2,0,1) (0,2,0) (0,0,2)\r\n"
                                        "space origin: (3,4,5)\r\n" +
                                        end));
    EXPECT_EQ(got.volume.origin, (std::array<double, 3>{-3, 4, 5}));
    EXPECT_EQ(got.volume.axes[0], (std::array<double, 3>{-2, 0, 1}));
  }
}

TEST(VolumeIo, LeavesOutDimensionsOfSizeOne) {
  const auto nrrd = [](const std::string& lines) {
    return load(write_file("d.nrrd", "NRRD0004\ntype: uchar\ndimension: 4\nencoding: raw\n" +
                                         lines + "\nabcdef"))
        .volume.size;
  };
  const std::array<std::uint32_t, 3> wanted{3, 2, 1};
  EXPECT_EQ(nrrd("sizes: 3 2 1 1\n"), wanted);
  EXPECT_EQ(nrrd("sizes: 1 3 2 1\nkinds: vector domain domain domain\n"), wanted);
  EXPECT_EQ(nrrd("sizes: 3 2 1 1\nkinds: domain domain domain time\n"), wanted);
  EXPECT_EQ(nrrd("sizes: 1 3 2 1\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"), wanted);
  const Loaded meta = load(write_file(
      "d.mha",
      "NDims = 4\nDimSize = 3 2 1 1\nElementSpacing = 4 5 6 7\nOffset = 1 2 3 4\nTransformMatrix = "
      "0 1 0 "
      "0 1 0 0 0 0 0 1 0 0 0 0 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdef"));
  EXPECT_EQ(meta.volume.size, wanted);
  EXPECT_EQ(meta.volume.origin, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(meta.volume.axes[0], (std::array<double, 3>{0, 4, 0}));
  EXPECT_EQ(meta.volume.axes[1], (std::array<double, 3>{5, 0, 0}));
  test::NiftiFile nifti;
  nifti.dim = {5, 3, 2, 1, 1, 1, 1, 1};
  EXPECT_EQ(load(write_file("d.nii", nifti.text("abcdef"))).volume.size, wanted);
}

TEST(VolumeIo, SkipsLinesAndBytesBeforeNrrdData) {
  const auto read = [](const std::string& lines, const std::string& data) {
    write_file("skip.data", data);
    return voxel<char>(
        load(write_file("skip.nhdr", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 1\n" + lines +
                                         "data file: skip.data\n"))
            .volume,
        0);
  };
  EXPECT_EQ(read("encoding: raw\nlineskip: 2\n", "one\ntwo\nX"), 'X');
  EXPECT_EQ(read("encoding: raw\nline skip: 1\nbyte skip: 2\n", "one\n..X"), 'X');
  EXPECT_EQ(read("encoding: raw\nbyte skip: -1\n", "anything\nX"), 'X');
  EXPECT_EQ(read("encoding: gzip\nbyte skip: 3\n", test::packed("...X", true)), 'X');
  EXPECT_EQ(read("encoding: gzip\nline skip: 1\n", "line\n" + test::packed("X", true)), 'X');
  EXPECT_EQ(read("encoding: text\nline skip: 1\n", "title\n88"), 'X');
  // Several members one after the other are one stream.
  const fs::path twice = test::test_data("fuzz") / "nrrd" / "gzip_twice.nrrd";
  EXPECT_EQ(voxel<std::int16_t>(load(twice).volume, 11), 21);
}

TEST(VolumeIo, TakesSformThenQformThenPixelSizes) {
  test::NiftiFile file;
  file.dim = {3, 1, 1, 1, 1, 1, 1, 1};
  file.pixdim = {-1, 2, 3, 4, 0, 0, 0, 0};
  file.qform = 1;
  file.quaternion = {0, 0,
                     std::sqrt(0.5)};  // a quarter turn about z; the factor -1 turns the third axis
  file.quaternion_offset = {7, 8, 9};
  file.rows = {{{1, 0, 0, 10}, {0, 1, 0, 20}, {0, 0, 1, 30}}};
  file.sform = 1;
  EXPECT_EQ(load(write_file("f.nii", file.text("a"))).volume.origin,
            (std::array<double, 3>{10, 20, 30}));
  file.rows[1] = {1, 0, 0, 20};  // flat
  Loaded got = load(write_file("f.nii", file.text("a")));
  EXPECT_EQ(got.count("bad-transform"), 1u);
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{7, 8, 9}));
  const double wanted[3][3] = {{0, 2, 0}, {-3, 0, 0}, {0, 0, -4}};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got.volume.axes[a][c], wanted[a][c], 1e-6);
  }
  file.sform = file.qform = 0;
  got = load(write_file("f.nii", file.text("a")));
  EXPECT_EQ(got.volume.origin, (std::array<double, 3>{}));
  const std::array<std::array<double, 3>, 3> axes{{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}};
  EXPECT_EQ(got.volume.axes, axes);
}

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
    EXPECT_NE(got.warnings.at(0).message.find("1, 0, 1"), std::string::npos);
    EXPECT_NE(got.warnings.at(0).message.find(path.string()), std::string::npos);
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

// ---- writing ------------------------------------------------------------------------------------

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

// ---- real data ----------------------------------------------------------------------------------

TEST(VolumeIo, ReadsAScannedHead) {
  KILN_REQUIRE_DATA("head_t1.nrrd");
  const Loaded head = load(*test::shared_data("head_t1.nrrd"));
  EXPECT_EQ(head.volume.size, (std::array<std::uint32_t, 3>{188, 256, 190}));
  EXPECT_EQ(head.volume.type, VoxelType::u8);
  for (std::size_t a = 0; a < 3; ++a) EXPECT_EQ(head.volume.axes[a][a], 0.88);
  EXPECT_TRUE(head.warnings.empty());
  // Air around a head: the corners are dark, the middle is not.
  std::uint64_t dark = 0;
  for (const std::byte value : head.volume.voxels) dark += value < std::byte{30};
  const double share = static_cast<double>(dark) / static_cast<double>(head.volume.voxels.size());
  EXPECT_GT(share, 0.3);
  EXPECT_LT(share, 0.9);
  const std::size_t middle = (std::size_t{95} * 256 + 128) * 188 + 94;
  EXPECT_GT(head.volume.voxels[middle], std::byte{30});
  EXPECT_LT(head.volume.voxels[0], std::byte{30});
}

}  // namespace
}  // namespace kiln

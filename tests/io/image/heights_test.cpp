// Heights of pictures and of GeoTIFFs, which are written here byte by byte.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "kiln/height_field.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/tiff_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

fs::path write(const std::string& name, const std::string& bytes) {
  const fs::path path = test::scratch_folder() / name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::uint64_t count(const std::vector<Warning>& warnings, const std::string& code) {
  std::uint64_t sum = 0;
  for (const Warning& warning : warnings) sum += warning.code == code ? warning.count : 0;
  return sum;
}

TEST(Heights, PicturesSayWhatOneStandsFor) {
  const Image image{2, 2, 1, {0, 1, 0.5F, 0.25F}};
  const fs::path folder = test::scratch_folder();
  save_image(image, folder / "h.png", {.format = ImageFormat::png16});
  EXPECT_EQ(load_heights(folder / "h.png").largest, 65535);
  EXPECT_EQ(load_heights(folder / "h.png").image.pixels[1], 1);
  save_image(image, folder / "h.png", {.format = ImageFormat::png8});
  EXPECT_EQ(load_heights(folder / "h.png").largest, 255);
  Image metres{2, 2, 1, {-9999, 1234.5F, std::nanf(""), 8}};
  save_image(metres, folder / "h.exr", {.format = ImageFormat::exr_float});
  const Heights exr = load_heights(folder / "h.exr");
  EXPECT_EQ(exr.largest, 1);
  EXPECT_EQ(exr.image.pixels[0], -9999);
  EXPECT_TRUE(std::isnan(exr.image.pixels[2]));
  EXPECT_FALSE(exr.no_data);
  EXPECT_EQ(exr.spacing[0], 0);
}

#ifdef KILN_HAS_TIFF

using test::TiffFile;

constexpr std::uint16_t kUnsigned = 1, kSigned = 2, kFloats = 3;

TEST(Heights, TiffsOfFloatsAndSignedNumbersAreAsTheyStand) {
  const Heights floats = load_heights(
      write("h.tif",
            TiffFile(2, 2, kFloats, std::vector<float>{1.5F, -9999, 8848, std::nanf("")}).bytes()));
  EXPECT_EQ(floats.image.pixels[0], 1.5F);
  EXPECT_EQ(floats.image.pixels[2], 8848);
  EXPECT_TRUE(std::isnan(floats.image.pixels[3]));
  EXPECT_EQ(floats.largest, 1);
  const Heights doubles = load_heights(
      write("h.tif", TiffFile(2, 1, kFloats, std::vector<double>{0.1, -2e300}).bytes()));
  EXPECT_EQ(doubles.image.pixels[0], 0.1F);
  EXPECT_TRUE(std::isinf(doubles.image.pixels[1]));
  const Heights words = load_heights(write(
      "h.tif", TiffFile(2, 2, kSigned, std::vector<std::int16_t>{-32768, -5, 0, 8848}).bytes()));
  EXPECT_EQ(words.image.pixels, (std::vector<float>{-32768, -5, 0, 8848}));
  const Heights longs = load_heights(
      write("h.tif", TiffFile(2, 1, kSigned, std::vector<std::int32_t>{-100000, 70000}).bytes()));
  EXPECT_EQ(longs.image.pixels, (std::vector<float>{-100000, 70000}));
  const Heights bytes = load_heights(
      write("h.tif", TiffFile(2, 1, kSigned, std::vector<std::int8_t>{-100, 70}).bytes()));
  EXPECT_EQ(bytes.image.pixels, (std::vector<float>{-100, 70}));
  // A picture of signed numbers is none.
  EXPECT_THROW(
      load_image(write("h.tif", TiffFile(2, 1, kSigned, std::vector<std::int16_t>{1, 2}).bytes())),
      Error);
}

TEST(Heights, UnsignedNumbersAreOfTheGroundWhereTagsSayIt) {
  const std::vector<std::uint16_t> metres{0, 300, 65535, 8};
  const Heights grey = load_heights(write("h.tif", TiffFile(2, 2, kUnsigned, metres).bytes()));
  EXPECT_EQ(grey.image.pixels[2], 1);
  EXPECT_EQ(grey.largest, 65535);
  const Heights scaled =
      load_heights(write("h.tif", TiffFile(2, 2, kUnsigned, metres).scale(30, 20).bytes()));
  EXPECT_EQ(scaled.image.pixels, (std::vector<float>{0, 300, 65535, 8}));
  EXPECT_EQ(scaled.largest, 1);
  const Heights told =
      load_heights(write("h.tif", TiffFile(2, 2, kUnsigned, metres).no_data("65535").bytes()));
  EXPECT_EQ(told.image.pixels[1], 300);
}

TEST(Heights, GdalsNumberOfNoData) {
  const auto read = [](const std::string& text) {
    return load_heights(
               write("h.tif",
                     TiffFile(2, 1, kFloats, std::vector<float>{1, 2}).no_data(text).bytes()))
        .no_data;
  };
  EXPECT_EQ(read("-9999"), -9999);
  EXPECT_EQ(read(" -9999 "), -9999);
  EXPECT_EQ(read("-3.4028234663852886e+38"), -3.4028234663852886e+38);
  ASSERT_TRUE(read("nan"));
  EXPECT_TRUE(std::isnan(*read("nan")));
  EXPECT_FALSE(read(""));
  EXPECT_FALSE(read("none"));
}

TEST(Heights, DistanceOfPixels) {
  const auto made = [] { return TiffFile(3, 2, kFloats, std::vector<float>(6, 1)); };
  std::vector<Warning> warnings;
  const auto read = [&](TiffFile& file) {
    warnings.clear();
    return load_heights(write("h.tif", file.bytes()), &warnings).spacing;
  };
  using Pair = std::array<double, 2>;
  EXPECT_EQ(read(made().scale(30, 20)), (Pair{30, 20}));
  EXPECT_EQ(read(made().scale(30, 20).keys({{1024, 1}, {3076, 9001}})), (Pair{30, 20}));
  EXPECT_TRUE(warnings.empty());
  // Feet across and metres up: 100 feet are 30.48 m. Where one is not said, both are taken for the same.
  EXPECT_EQ(read(made().scale(100, 100).keys({{1024, 1}, {3076, 9002}, {4099, 9001}}))[0],
            100 * 0.3048);
  EXPECT_EQ(read(made().scale(100, 100).keys({{1024, 1}, {3076, 9002}}))[0], 100);
  // A grid turned by 90 degrees: 4 by 7.
  EXPECT_EQ(read(made().add<double>(34264, TiffFile::kDouble,
                                    {0, 7, 0, 5, 4, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, 1})),
            (Pair{4, 7}));
  EXPECT_EQ(read(made().scale(0, 20)), (Pair{0, 0}));
  EXPECT_EQ(read(made().scale(std::numeric_limits<double>::infinity(), 20)), (Pair{0, 0}));
}

/// A second of arc at 60 degrees north. Oracle: the ellipsoid's radii of curvature (WGS 84, closed form).
TEST(Heights, DegreesBecomeMetresAtTheirLatitude) {
  const double second = 1.0 / 3600, latitude = 60;
  std::vector<Warning> warnings;
  TiffFile file(3, 2, kFloats, std::vector<float>(6, 1));
  file.scale(second, second).tie(10, latitude + second).keys({{1024, 2}});
  const Heights heights = load_heights(write("h.tif", file.bytes()), &warnings);
  const double a = 6378137, f = 1 / 298.257223563, e2 = f * (2 - f), pi = std::acos(-1.0);
  const double s = std::sin(latitude * pi / 180), w = std::sqrt(1 - e2 * s * s);
  const double east = a / w * std::cos(latitude * pi / 180) * second * pi / 180;
  const double north = a * (1 - e2) / (w * w * w) * second * pi / 180;
  // The series is good to centimetres a degree: 1e-6 of it.
  EXPECT_NEAR(heights.spacing[0], east, 2e-6 * east);
  EXPECT_NEAR(heights.spacing[1], north, 2e-6 * north);
  EXPECT_EQ(count(warnings, "spacing-in-degrees"), 1U);
}

/// Feet, survey feet and metres of heights over degrees, with a side to each axis.
TEST(Heights, DegreesBecomeTheUnitOfHeights) {
  const auto read = [](std::uint16_t unit, std::vector<Warning>* warnings) {
    TiffFile file(3, 2, kFloats, std::vector<float>(6, 1));
    file.scale(0.25, 0.5).tie(10, 30.5);
    if (unit == 0) {
      file.keys({{1024, 2}});
    } else {
      file.keys({{1024, 2}, {4099, unit}});
    }
    return load_heights(write("h.tif", file.bytes()), warnings).spacing;
  };
  std::vector<Warning> metres, feet, survey;
  const std::array<double, 2> plain = read(0, &metres);
  EXPECT_GT(plain[1], 1.9 * plain[0]);
  EXPECT_EQ(read(9001, nullptr), plain);
  EXPECT_EQ(read(4242, nullptr), plain) << "an unknown unit is taken for metres";
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(read(9002, &feet)[k], plain[k] / 0.3048, 1e-9 * plain[k]);
    EXPECT_NEAR(read(9003, &survey)[k], plain[k] * 3937 / 1200, 1e-9 * plain[k]);
  }
  const auto text = [](const std::vector<Warning>& warnings) {
    return warnings.empty() ? std::string() : warnings.front().message.text();
  };
  EXPECT_NE(text(metres).find(" metres. If that"), std::string::npos) << text(metres);
  EXPECT_NE(text(feet).find(" feet. If that"), std::string::npos) << text(feet);
  EXPECT_NE(text(survey).find(" feet. If that"), std::string::npos) << text(survey);
  // Without a distance there is nothing to convert, and nothing to say.
  std::vector<Warning> none;
  TiffFile bare(3, 2, kFloats, std::vector<float>(6, 1));
  bare.keys({{1024, 2}});
  EXPECT_EQ(load_heights(write("h.tif", bare.bytes()), &none).spacing,
            (std::array<double, 2>{0, 0}));
  EXPECT_TRUE(none.empty());
}

/// US survey feet across and metres up, and the other way round.
TEST(Heights, SurveyFeetAcrossAndUp) {
  const auto read = [](std::uint16_t across, std::uint16_t up) {
    TiffFile file(3, 2, kFloats, std::vector<float>(6, 1));
    file.scale(30, 20).keys({{1024, 1}, {3076, across}, {4099, up}});
    return load_heights(write("h.tif", file.bytes())).spacing;
  };
  const double survey_foot = 1200.0 / 3937;
  EXPECT_DOUBLE_EQ(read(9003, 9001)[0], 30 * survey_foot);
  EXPECT_DOUBLE_EQ(read(9003, 9001)[1], 20 * survey_foot);
  EXPECT_DOUBLE_EQ(read(9001, 9003)[1], 20 / survey_foot);
  EXPECT_DOUBLE_EQ(read(9002, 9003)[0], 30 * 0.3048 / survey_foot);
  EXPECT_EQ(read(9002, 1)[0], 30);
}

/// The place that a file gives may be that of any row: here of one far below, which lies at the equator.
TEST(Heights, TheTiePointMayBeAnyRow) {
  std::vector<Warning> warnings;
  const auto spacing = [&](double latitude, double row) {
    TiffFile file(3, 2, kFloats, std::vector<float>(6, 1));
    file.scale(0.5, 0.5).tie(10, latitude, row).keys({{1024, 2}});
    return load_heights(write("h.tif", file.bytes()), &warnings).spacing;
  };
  EXPECT_EQ(spacing(0, 120), spacing(60, 0));
  EXPECT_EQ(spacing(59.5, 1), spacing(60, 0));
  EXPECT_LT(spacing(0, 120)[0], 0.6 * spacing(0, 0)[0]);
}

TEST(Heights, CutShortIsAnError) {
  const std::string whole = TiffFile(3, 2, kFloats, std::vector<float>(6, 1))
                                .scale(30, 20)
                                .keys({{1024, 1}})
                                .no_data("-9999")
                                .bytes();
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    const fs::path path = write("h.tif", whole.substr(0, size));
    try {
      load_heights(path);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << size;
    }
  }
}

#endif

}  // namespace
}  // namespace kiln

// Height fields as high polys.
#include "kiln/height_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "kiln/bake.h"
#include "kiln/limits.h"
#include "kiln/simplify.h"
#include "simplify/height_layout.h"
#include "support/environment.h"

namespace kiln {
namespace {

Image waves(std::uint32_t width, std::uint32_t height) {
  Image image{width, height, 1, std::vector<float>(std::size_t{width} * height)};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      *image.at(x, y) = 0.5F + 0.5F * std::sin(0.2F * static_cast<float>(x)) *
                                   std::cos(0.3F * static_cast<float>(y));
    }
  }
  return image;
}

TEST(HeightField, PixelsAreVertices) {
  Image image{3, 2, 1, {0.0F, 0.25F, 0.5F, 0.75F, 1.0F, -1.0F}};
  const Mesh mesh = height_field_mesh(image, {4, 6, 2});
  ASSERT_EQ(mesh.positions.size(), 6U);
  ASSERT_EQ(mesh.triangles.size(), 4U);
  EXPECT_EQ(mesh.positions[0], (Vec3{-2, 3, 0}));
  EXPECT_EQ(mesh.positions[2], (Vec3{2, 3, 1}));
  EXPECT_EQ(mesh.positions[5], (Vec3{2, -3, -2}));
  EXPECT_EQ(mesh.uvs[0], (Vec2{0, 1}));
  EXPECT_EQ(mesh.uvs[1], (Vec2{0.5F, 1}));
  EXPECT_EQ(mesh.uvs[5], (Vec2{1, 0}));
  // All face up, in space and in the layout, and share out the rectangle.
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const double doubled = double{b.x - a.x} * (c.y - a.y) - double{b.y - a.y} * (c.x - a.x);
    EXPECT_GT(doubled, 0);
    area += doubled / 2;
  }
  EXPECT_DOUBLE_EQ(area, 24);
}

TEST(HeightField, ExtentsFollowTheImage) {
  const Image image = waves(11, 6);
  EXPECT_EQ(height_field_mesh(image).positions[0], (Vec3{-0.5F, 0.25F, image.pixels[0]}));
  EXPECT_EQ(height_field_mesh(image, {20, 0, 1}).positions[0].y, 5);
  EXPECT_EQ(height_field_mesh(image, {0, 20, 1}).positions[0].x, -20);
}

TEST(HeightField, RefusesWhatIsNone) {
  Image image = waves(5, 5);
  EXPECT_THROW(height_field_mesh(waves(1, 5)), Error);
  EXPECT_THROW(height_field_mesh(image, {-1, 1, 1}), Error);
  EXPECT_THROW(height_field_mesh(image, {1, 1, std::nan("")}), Error);
  image.pixels.assign(25, std::nanf(""));
  EXPECT_THROW(height_field_mesh(image), Error);
  image.pixels[0] = image.pixels[1] = image.pixels[24] = 0;  // no three side by side
  EXPECT_THROW(height_field_mesh(image), Error);
}

// Before it is made: a picture of a few megabytes may hold 2^28 pixels, whose mesh takes 17 GiB.
TEST(HeightField, ThatNeedsMoreMemoryThanIsLeftIsRefused) {
  const Image image = waves(2048, 1024);
  set_memory_limit(1);
  try {
    height_field_mesh(image);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_EQ(std::string(error.what())
                  .find("The mesh of the height field of 2048 x 1024 pixels would take 136 MiB"),
              0U)
        << error.what();
  }
  set_memory_limit(0);
}

TEST(HeightField, WhatIsNotFiniteIsAHole) {
  Image image = waves(5, 5);
  image.pixels[12] = std::nanf("");  // the middle, which six triangles have
  image.pixels[4] = HUGE_VALF;       // the upper right corner, which two have
  const Mesh mesh = height_field_mesh(image);
  EXPECT_EQ(mesh.triangles.size(), 32U - 6 - 2);
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t corner : t) {
      EXPECT_NE(corner, 12U);
      EXPECT_NE(corner, 4U);
      EXPECT_EQ(mesh.positions[corner].z, image.pixels[corner]);
    }
  }
}

/// Heights of a slope from 100 to 200, with some numbers put in.
Heights slope(const std::vector<std::pair<std::size_t, float>>& put) {
  Heights heights;
  heights.image = {16, 16, 1, std::vector<float>(256)};
  for (std::size_t i = 0; i < 256; ++i) {
    heights.image.pixels[i] = 100 + static_cast<float>(i % 16) * (100.0F / 15);
  }
  for (const auto& [at, value] : put) heights.image.pixels[at] = value;
  return heights;
}

TEST(NoData, NumbersThatProgramsWriteAreFoundWhereTheyAreFarOff) {
  for (const float none : {-9999.0F, -32768.0F, -3.4028235e38F, 3.4028235e38F, -99999.0F, 1e30F}) {
    Heights heights = slope({{3, none}, {77, none}, {200, none}});
    const NoData found = mark_no_data(heights);
    EXPECT_EQ(found.pixels, 3U) << none;
    ASSERT_EQ(found.values.size(), 1U) << none;
    EXPECT_EQ(found.values[0], double{none});
    EXPECT_TRUE(std::isnan(heights.image.pixels[77]));
    EXPECT_EQ(heights.image.pixels[76], slope({}).image.pixels[76]);
  }
  Heights two = slope({{3, -9999}, {4, -32768}, {5, std::nanf("")}, {6, -HUGE_VALF}});
  EXPECT_EQ(mark_no_data(two).pixels, 4U);
  Heights flat = slope({});
  flat.image.pixels.assign(256, 7);
  flat.image.pixels[9] = -9999;
  EXPECT_EQ(mark_no_data(flat).pixels, 1U);
}

TEST(NoData, HeightsThatReachSoFarAreHeights) {
  Heights trench = slope({});
  for (std::size_t i = 0; i < 256; ++i) {
    trench.image.pixels[i] = -10994 + static_cast<float>(i) * 60;  // to 4306
  }
  trench.image.pixels[9] = -9999;
  const NoData found = mark_no_data(trench);
  EXPECT_EQ(found.pixels, 0U);
  EXPECT_FALSE(found.doubtful);
  // The lowest of a sea's floor may be that number itself.
  Heights floor = slope({});
  for (std::size_t i = 0; i < 256; ++i) floor.image.pixels[i] = -9999 + static_cast<float>(i) * 60;
  EXPECT_EQ(mark_no_data(floor).pixels, 0U);
  Heights plain = slope({});
  EXPECT_EQ(mark_no_data(plain).pixels, 0U);
}

TEST(NoData, TheFilesWordAndTheCallersGoFirst) {
  Heights own = slope({{1, 0}, {2, 0}, {3, -9999}});
  own.no_data = 0;
  EXPECT_EQ(mark_no_data(own).pixels, 2U);
  EXPECT_EQ(own.image.pixels[3], -9999);
  Heights given = slope({{1, 0}, {2, 0}, {3, -9999}});
  given.no_data = -9999;
  EXPECT_EQ(mark_no_data(given, 0).pixels, 2U);
  Heights kept = slope({{1, 0}, {2, std::nanf("")}, {3, -9999}});
  kept.no_data = -9999;
  EXPECT_EQ(mark_no_data(kept, {}, false).pixels, 1U);
  // As the file holds it: of a PNG of 16 bits whole numbers, of the lowest float more digits than it has.
  Heights png = slope({});
  for (float& value : png.image.pixels) value /= 65535;
  png.largest = 65535;
  png.image.pixels[5] = 0;
  png.image.pixels[6] = 1.0F / 65535;
  EXPECT_EQ(mark_no_data(png, 1).pixels, 1U);
  EXPECT_TRUE(std::isnan(png.image.pixels[6]));
  Heights lowest = slope({{8, -3.4028235e38F}});
  lowest.no_data = -3.40282346638529e+38;
  EXPECT_EQ(mark_no_data(lowest).pixels, 1U);
}

/// A number of programs is no height if it is farther from the next one than all others from each other.
TEST(NoData, TheGapDecides) {
  const auto marked = [](float lowest_height, float highest_height, float none) {
    Heights heights = slope({{7, none}});
    for (float& value : heights.image.pixels) {
      if (value != none)
        value = lowest_height + (highest_height - lowest_height) * (value - 100) / 100;
    }
    return mark_no_data(heights).pixels;
  };
  // From -9999 to 0 are 9999 metres; below the highest, 9999 lies as far off.
  EXPECT_EQ(marked(0, 9998, -9999), 1U);
  EXPECT_EQ(marked(0, 9999, -9999), 0U);
  EXPECT_EQ(marked(-9998, 0, 9999), 1U);
  EXPECT_EQ(marked(-9999, 0, 9999), 0U);
  // A caller's or a file's number that is not finite is there already; nothing is guessed beside it.
  Heights given = slope({{1, -9999}, {2, std::nanf("")}});
  EXPECT_EQ(mark_no_data(given, std::nan("")).pixels, 1U);
  EXPECT_EQ(given.image.pixels[1], -9999);
  // Of whole numbers none is guessed, since 32,767 may be a height.
  Heights whole = slope({{1, -9999}});
  whole.largest = 65535;
  EXPECT_EQ(mark_no_data(whole).pixels, 0U);
  // What is no number stays so, and is counted once.
  Heights infinite = slope({{1, HUGE_VALF}, {2, HUGE_VALF}});
  const NoData found = mark_no_data(infinite, HUGE_VAL);
  EXPECT_EQ(found.pixels, 2U);
  EXPECT_EQ(infinite.image.pixels[1], HUGE_VALF);
  // Farther than all floats: the farthest float.
  Heights farthest = slope({{1, std::numeric_limits<float>::max()}});
  EXPECT_EQ(mark_no_data(farthest, 1e300).pixels, 1U);
}

TEST(NoData, DoubtNeedsTenTimesTheRangeAndTwoPixels) {
  const auto doubts = [](float height) {
    Heights heights = slope({{1, height}, {2, height}});  // others are 100 to 200
    const NoData found = mark_no_data(heights);
    EXPECT_EQ(found.pixels, 0U);
    return found.doubtful.has_value();
  };
  EXPECT_FALSE(doubts(200 + 999));
  EXPECT_TRUE(doubts(200 + 1001));
  EXPECT_FALSE(doubts(100 - 999));
  EXPECT_TRUE(doubts(100 - 1001));
}

TEST(HeightField, LayoutsCoverTheRectangleFromAnyOrigin) {
  Mesh mesh;
  mesh.origin = {500, -40, 7};
  mesh.positions = {{-8, -1, 0}, {0, 0, 5}, {8, 1, 0}, {4, -0.5F, 0}};
  mesh.triangles = {{0, 3, 2}, {0, 2, 1}};
  lay_out_over_rectangle(mesh, {{500, -40}, {16, 2}});
  const std::vector<Vec2> wanted = {{0, 0}, {0.5F, 0.5F}, {1, 1}, {0.75F, 0.25F}};
  EXPECT_EQ(mesh.uvs, wanted);
  EXPECT_EQ(mesh.uv_triangles, mesh.triangles);
}

TEST(NoData, OthersFarOffAreDoubtful) {
  Heights odd = slope({{1, -5000}, {2, -5000}});
  const NoData found = mark_no_data(odd);
  EXPECT_EQ(found.pixels, 0U);
  ASSERT_TRUE(found.doubtful);
  EXPECT_EQ(*found.doubtful, -5000);
  Heights peak = slope({{1, 5000}});  // alone it may be a mast
  EXPECT_FALSE(mark_no_data(peak).doubtful);
}

/// A low poly that is made of a field with holes at its border keeps the layout of the whole field.
TEST(NoData, ABorderOfHolesMovesNoLayout) {
  Image image = waves(33, 33);
  for (std::uint32_t y = 0; y < 33; ++y) {
    for (std::uint32_t x = 0; x < 8; ++x) *image.at(x, y) = std::nanf("");
  }
  const Mesh field = height_field_mesh(image, {32, 32, 3});
  SimplifyOptions options;
  options.faces = 200;
  options.height_field = true;
  Mesh low = simplify(field, options);
  EXPECT_LE(low.triangles.size(), 200U);
  lay_out_over_rectangle(low, FieldRectangle::of(field));
  for (std::size_t v = 0; v < low.positions.size(); ++v) {
    EXPECT_NEAR(low.uvs[v].x, low.positions[v].x / 32 + 0.5F, 1e-5);
    EXPECT_NEAR(low.uvs[v].y, low.positions[v].y / 32 + 0.5F, 1e-5);
    EXPECT_GE(low.positions[v].x, -8 - 1e-4);
  }
}

TEST(HeightField, BakesOntoItsPlaneWithTheFieldsSlopes) {
  KILN_REQUIRE_DEVICE();
  const Image image = waves(65, 65);
  const HeightFieldOptions field{64, 64, 3};
  BakeOptions options;
  options.width = options.height = 64;  // texel centres in the middles of cells
  options.match.method = MatchMethod::uv;
  options.encoding.raw = true;
  const BakeResult baked = bake(Source(*test::device(), height_field_mesh(image, field)),
                                height_field_plane(image, field), options);
  EXPECT_EQ(baked.report.by_uv, 64U * 64);
  for (std::size_t y = 8; y < 56; ++y) {
    for (std::size_t x = 8; x < 56; ++x) {
      // The exact surface: z = 3 (1/2 + 1/2 sin(0.2 i) cos(0.3 j)), i to the right, j down.
      const double i = static_cast<double>(x) + 0.5;
      const double j = static_cast<double>(y) + 0.5;
      const double dx = 1.5 * 0.2 * std::cos(0.2 * i) * std::cos(0.3 * j);
      const double dy = 1.5 * 0.3 * std::sin(0.2 * i) * std::sin(0.3 * j);
      const double size = std::sqrt(dx * dx + dy * dy + 1);
      const float* n = baked.maps[0].image.at(x, y);
      const double cosine = (-dx * n[0] - dy * n[1] + n[2]) / size;
      ASSERT_GT(cosine, std::cos(1.5 * M_PI / 180)) << x << ' ' << y;
    }
  }
}

class SimplifiedHeightField : public testing::TestWithParam<std::uint32_t> {};

TEST_P(SimplifiedHeightField, KeepsTheLayout) {
  const Image image = waves(GetParam(), GetParam());
  const HeightFieldOptions field{64, 64, 3};
  const Mesh dense = height_field_mesh(image, field);
  SimplifyOptions options;
  options.faces = 400;
  options.height_field = true;
  Mesh low = simplify(dense, options);
  EXPECT_LE(low.triangles.size(), 400U);
  lay_out_over_height_field(low, image, field);
  ASSERT_EQ(low.uv_triangles.size(), low.triangles.size());
  for (std::size_t i = 0; i < low.positions.size(); ++i) {
    EXPECT_NEAR(low.uvs[i].x, (low.positions[i].x + low.origin[0]) / 64 + 0.5, 1e-6);
    EXPECT_NEAR(low.uvs[i].y, (low.positions[i].y + low.origin[1]) / 64 + 0.5, 1e-6);
    EXPECT_TRUE(low.uvs[i].x >= 0 && low.uvs[i].x <= 1) << low.uvs[i].x;
    EXPECT_TRUE(low.uvs[i].y >= 0 && low.uvs[i].y <= 1) << low.uvs[i].y;
  }
  // No triangle turned over, and together they fill the unit square.
  double sum = 0;
  for (const Triangle& t : low.triangles) {
    const Vec2 a = low.uvs[t[0]], b = low.uvs[t[1]], c = low.uvs[t[2]];
    const double area = 0.5 * ((double{b.x} - a.x) * (double{c.y} - a.y) -
                               (double{b.y} - a.y) * (double{c.x} - a.x));
    EXPECT_GT(area, 0);
    sum += area;
  }
  EXPECT_NEAR(sum, 1, 1e-6);
}

// Simplified at once, and after presimplification.
INSTANTIATE_TEST_SUITE_P(Sizes, SimplifiedHeightField, testing::Values(65U, 300U));

/// Each extent and each side of the picture is checked, and the message says which.
TEST(HeightField, SaysWhatIsOutOfRange) {
  const auto error_of = [](const Image& image, const HeightFieldOptions& options) -> std::string {
    try {
      (void)height_field_mesh(image, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const Image image = waves(4, 3);
  const std::string extent = ": it must be finite and above 0, or 0 for the image's proportions.";
  EXPECT_EQ(error_of(image, {-2, 1, 1}), "The height field's extent is -2" + extent);
  EXPECT_EQ(error_of(image, {1, -3, 1}), "The height field's extent is -3" + extent);
  EXPECT_EQ(error_of(image, {1, 2, 3}), "");
  const std::string size = " pixels: it must be 2 x 2 or more.";
  EXPECT_EQ(error_of(Image{1, 3, 1, {1, 2, 3}}, {}), "The height field is 1 x 3" + size);
  EXPECT_EQ(error_of(Image{3, 1, 1, {1, 2, 3}}, {}), "The height field is 3 x 1" + size);
  EXPECT_EQ(error_of(Image{2, 3, 0, {}}, {}), "The height field is 2 x 3" + size);
  EXPECT_EQ(error_of(Image{2, 3, 1, {1, 2, 3, 4, 5}}, {}), "The height field is 2 x 3" + size);
}

}  // namespace
}  // namespace kiln

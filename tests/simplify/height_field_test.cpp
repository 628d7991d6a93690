// Height fields as high polys.
#include "kiln/height_field.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kiln/kiln.h"
#include "kiln/simplify.h"
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
  image.pixels[7] = std::nanf("");
  EXPECT_THROW(height_field_mesh(image), Error);
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

}  // namespace
}  // namespace kiln

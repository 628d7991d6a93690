// Rays along an axis: straight down on the high poly, whatever the low poly's normals say.
#include <gtest/gtest.h>

#include <cmath>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

TEST(Axis, LooksStraightAlongIt) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(8, 8, 4, 4);
  for (Vec3& p : high.positions) p.z = 0.125F;
  const Source source(*test::device(), high);
  // A low poly that bends, so that its normals lean up to 30 degrees.
  Mesh low = test::plane(8, 8);
  low.normals.clear();
  low.normal_triangles.clear();
  for (Vec3& p : low.positions) p.z = 0.1F * std::sin(5 * p.x);
  BakeOptions options;
  options.width = options.height = 32;
  options.maps = {MapKind{"position"}};
  options.match.method = MatchMethod{"axis"};
  options.match.views.directions = {
      {0, 0, -7}};  // either sense: outward is where the low poly faces
  options.match.max_distance = Length::absolute(1);
  const BakeResult baked = bake(source, low, options);
  EXPECT_EQ(baked.report.missed, 0U);
  EXPECT_EQ(baked.report.samples, 32U * 32U);
  double lean = 0;
  BakeOptions by_normals = options;
  by_normals.match.method = MatchMethod::ray;
  by_normals.match.views.directions.clear();
  const BakeResult bent = bake(source, low, by_normals);
  for (std::size_t y = 0; y < 32; ++y) {
    for (std::size_t x = 0; x < 32; ++x) {
      const float* at = &baked.maps[0].image.pixels[3 * (32 * y + x)];
      EXPECT_NEAR(at[0], (static_cast<double>(x) + 0.5) / 32 - 0.5, 1e-6);
      EXPECT_NEAR(at[1], 0.5 - (static_cast<double>(y) + 0.5) / 32, 1e-6);
      EXPECT_NEAR(at[2], 0.125, 1e-6);
      lean += std::abs(bent.maps[0].image.pixels[3 * (32 * y + x)] - at[0]);
    }
  }
  EXPECT_GT(lean / 1024, 0.01);  // rays along normals land elsewhere
}

TEST(Axis, NeedsOneDirection) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(2, 2));
  BakeOptions options;
  options.width = options.height = 8;
  options.match.method = MatchMethod{"axis"};
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
  options.match.views.directions = {{0, 0, 1}, {0, 1, 0}};
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
  options.match.method = MatchMethod{"axes"};
  try {
    bake(source, test::plane(1, 1), options);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("axis"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kiln

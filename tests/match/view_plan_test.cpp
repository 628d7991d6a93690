// How views are planned: the size of their pictures, what they show, and the one view of a height field.
#include "match/view_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// Separate right triangles of given areas.
struct Soup {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  void add(double area, int count) {
    const auto leg = static_cast<float>(std::sqrt(2 * area));
    for (int i = 0; i < count; ++i) {
      const auto first = static_cast<std::uint32_t>(positions.size());
      positions.insert(positions.end(), {{0, 0, 0}, {leg, 0, 0}, {0, leg, 0}});
      triangles.push_back({first, first + 1, first + 2});
    }
  }
  ViewSize size(double radius, std::uint32_t limit = 65536) const {
    return choose_view_size({positions, triangles}, radius, limit);
  }
};

/// Four pixels for the triangle at the middle of the area, whatever the number of triangles: areas are powers of two, in
/// steps of which they are sorted.
TEST(ViewPlan, PicturesHaveFourPixelsForTheMedianTriangle) {
  const double coarse = std::exp2(-10), fine = std::exp2(-19);  // Sides of pixels: 1/64 and 1/1448
  for (const double share : {0.1, 0.45, 0.55, 0.9}) {
    Soup soup;
    soup.add(coarse, static_cast<int>(std::lround((1 - share) * 100)));
    soup.add(fine, static_cast<int>(std::lround(share * 100 * 512)));
    const ViewSize chosen = soup.size(0.5);
    // One over the side of a pixel, to the next 256
    EXPECT_EQ(chosen.size, share > 0.5 ? 1536U : 1024U) << share;
    EXPECT_EQ(soup.size(1).size, share > 0.5 ? 3072U : 1024U) << share;
    EXPECT_EQ(soup.size(1, 800).size, 800U);
    EXPECT_EQ(soup.size(1, 2048).size, share > 0.5 ? 2048U : 1024U);
    // At 512 pixels over 1 the fine ones are smaller than a pixel, at 1024 they are not.
    EXPECT_NEAR(undersampled_share({soup.positions, soup.triangles}, 0.5, 512), share, 1e-3);
    EXPECT_EQ(undersampled_share({soup.positions, soup.triangles}, 0.5, 1024), 0);
    EXPECT_NEAR(soup.size(1, 800).undersampled, share, 1e-3);
    EXPECT_EQ(chosen.undersampled, 0);
  }
}

/// A face of the low poly, whose corners have its normal.
void add_face(LowSurface& surface, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d normal = cross(b - a, c - a);
  std::array<LowSurface::Corner, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k].position = to_float(k == 0 ? a : k == 1 ? b : c);
    corners[k].normal = corners[k].direction = to_float(normal * (1 / length(normal)));
  }
  surface.triangles.push_back(corners);
  surface.usable.push_back(1);
}

LowSurface low_of(const Mesh& mesh) {
  LowSurface surface;
  const auto at = [&](std::uint32_t v) { return to_double(mesh.positions[v]); };
  for (const Triangle& t : mesh.triangles) add_face(surface, at(t[0]), at(t[1]), at(t[2]));
  return surface;
}

TEST(ViewPlan, ViewsShowTheLowPolyAloneWhereTheHighPolyIsMuchLarger) {
  const LowSurface low = low_of(test::icosphere(2, 0.25));
  const double radius = 0.25;
  for (const double reach : {0.0, 0.1, 0.14, 0.16, 0.5}) {
    const ViewArea area = view_area(low, reach, 0.5);
    const double expected = radius + reach > 0.8 * 0.5 ? 0.5 : radius + reach;
    EXPECT_NEAR(area.radius, expected, 1e-6) << reach;
    EXPECT_NEAR(length(area.center), 0, 1e-6);
  }
  // All of the high poly lies within 60,000 pixels.
  for (const std::uint32_t size : {1024U, 8192U}) {
    ViewArea small{{}, 1e-3}, large{{}, 0.3};
    widen_view_area(small, 0.5, size);
    widen_view_area(large, 0.5, size);
    EXPECT_DOUBLE_EQ(small.radius * 2 * 60000 / size, 2 * 0.5);
    EXPECT_EQ(large.radius, 0.3);
  }
}

/// One view shows a height field: along an axis where its mean normal is within 8 degrees of it, else along the mean.
TEST(ViewPlan, AHeightFieldHasOneView) {
  for (const double degrees : {0.0, 7.0, 9.0, 30.0}) {
    const double angle = degrees * std::acos(-1.0) / 180, c = std::cos(angle), s = std::sin(angle);
    for (const bool down : {false, true}) {
      Mesh field = test::plane(4, 4);
      for (Vec3& p : field.positions) {
        const double x = p.x, y = p.y, sign = down ? -1 : 1;
        p = to_float(Vec3d{x * c, sign * y, -x * s * sign});
      }
      const auto view = height_field_direction({field.positions, field.triangles}, low_of(field));
      ASSERT_TRUE(view.has_value());
      const double side = down ? -1 : 1;
      const Vec3d wanted = degrees < 8 ? Vec3d{0, 0, side} : Vec3d{s, 0, side * c};
      EXPECT_LT(length(*view - wanted), 1e-5) << degrees << down;
    }
  }
}

/// Walls steeper than 84 degrees are up to 2% of the low poly, and no face of either mesh is turned away.
TEST(ViewPlan, SteepAndTurnedFacesAreNoHeightField) {
  const Mesh flat = test::plane(2, 2);
  const auto view = [&](double degrees, double share) {
    LowSurface low = low_of(flat);
    const double angle = degrees * std::acos(-1.0) / 180;
    // A square has the area 1; a wall's two triangles have `share` of all.
    const double area = share / (1 - share);
    const Vec3d up{area * std::cos(angle), 0, area * std::sin(angle)}, along{0, 1, 0};
    add_face(low, {}, up, along);
    add_face(low, along * -1.0, up - along, {});
    return height_field_direction({flat.positions, flat.triangles}, low).has_value();
  };
  EXPECT_TRUE(view(86, 0.018));
  EXPECT_FALSE(view(86, 0.022));
  EXPECT_TRUE(view(82, 0.5));
  EXPECT_FALSE(view(91, 0.001));
  Mesh turned = flat;
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_FALSE(height_field_direction({turned.positions, turned.triangles}, low_of(flat)));
}

}  // namespace
}  // namespace kiln

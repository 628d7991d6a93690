// Ratings of UV layouts against closed forms.
#include "kiln/layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// Adds the image of a rectangle of the layout: origin + along_u (u - u0) + along_v (v - v0).
void add_patch(Mesh& mesh, const std::array<float, 4>& box, const std::array<Vec3, 3>& map) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const auto& [u, v] : {std::pair{box[0], box[1]}, std::pair{box[2], box[1]},
                             std::pair{box[2], box[3]}, std::pair{box[0], box[3]}}) {
    const float s = u - box[0], t = v - box[1];
    mesh.uvs.push_back({u, v});
    mesh.positions.push_back({map[0].x + map[1].x * s + map[2].x * t,
                              map[0].y + map[1].y * s + map[2].y * t,
                              map[0].z + map[1].z * s + map[2].z * t});
  }
  for (const Triangle& t : {Triangle{0, 1, 2}, Triangle{0, 2, 3}}) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    mesh.uv_triangles.push_back(mesh.triangles.back());
  }
}

LayoutRating rate(const Mesh& mesh, std::uint32_t width = 128, std::uint32_t height = 128) {
  return rate_layout(*test::device(), mesh, width, height);
}

// Positions are floats of a few units: 2^-22 of what is computed from them.
constexpr double kRounding = 1e-5;

TEST(Layout, SingularValuesOfAnAffineMapAreTheStretch) {
  KILN_REQUIRE_DEVICE();
  // S = turn(a) diag(large, small) turn(b), in a slanted plane.
  for (const std::array<double, 4>& of :
       {std::array{1.0, 1.0, 0.3, 1.1}, std::array{4.0, 1.0, 0.0, 0.0},
        std::array{3.0, 0.5, 0.7, 0.4}, std::array{2.0, 1.5, 2.0, 5.0}}) {
    const double large = of[0], small = of[1], a = of[2], b = of[3];
    const auto image = [&](double s, double t) {
      const double x = large * (std::cos(b) * s - std::sin(b) * t);
      const double y = small * (std::sin(b) * s + std::cos(b) * t);
      const double p = std::cos(a) * x - std::sin(a) * y;
      const double q = std::sin(a) * x + std::cos(a) * y;
      return Vec3{static_cast<float>(p), static_cast<float>(0.6 * q), static_cast<float>(0.8 * q)};
    };
    Mesh mesh;
    add_patch(mesh, {0, 0, 1, 1}, {Vec3{1, 2, 3}, image(1, 0), image(0, 1)});
    const LayoutRating r = rate(mesh);
    const double scale = 1 / std::sqrt(large * small);
    EXPECT_NEAR(r.stretch_l2, std::sqrt((large * large + small * small) / 2) * scale, kRounding);
    EXPECT_NEAR(r.stretch_linf, large * scale, kRounding);
    EXPECT_NEAR(r.area, large * small, kRounding);
    EXPECT_NEAR(r.mean_density, 128 * scale, 128 * kRounding);
    EXPECT_NEAR(r.least_density, r.greatest_density, 128 * kRounding);
    const double u = std::hypot(large * std::cos(b), small * std::sin(b));
    const double v = std::hypot(large * std::sin(b), small * std::cos(b));
    EXPECT_NEAR(r.uniformity_percent, 100 * std::abs(u - v) / (u + v), 100 * kRounding);
    EXPECT_EQ(r.texels, 128U * 128);
    EXPECT_EQ(r.used, 1);
    EXPECT_EQ(r.charts, 1U);
    EXPECT_EQ(r.seams, 0U);
    EXPECT_EQ(r.mirrored, 0U);
  }
}

TEST(Layout, UnevenPatchesAreWeighedByTexelsAndByArea) {
  KILN_REQUIRE_DEVICE();
  // Half of the texels on a square of side 1, half on one of side 3.
  Mesh mesh;
  add_patch(mesh, {0, 0, 0.5F, 0.5F}, {Vec3{0, 0, 0}, Vec3{2, 0, 0}, Vec3{0, 2, 0}});
  add_patch(mesh, {0.5F, 0, 1, 0.5F}, {Vec3{5, 0, 0}, Vec3{6, 0, 0}, Vec3{0, 6, 0}});
  const LayoutRating r = rate(mesh);
  EXPECT_NEAR(r.uniformity_percent, 50, 1e-3);  // steps of 1 and 3 about their mean of 2
  EXPECT_NEAR(r.least_density, 64 / 3.0, 1e-3);
  EXPECT_NEAR(r.greatest_density, 64, 1e-3);
  EXPECT_NEAR(r.mean_density, 64 * std::sqrt(2 / 10.0), 1e-3);
  // Squared singular values are 4 on an area of 1 and 36 on one of 9; the layout's area is 1/2, the surface's 10.
  EXPECT_NEAR(r.stretch_l2, std::sqrt((4 + 36 * 9) / 10.0 * 0.5 / 10), kRounding);
  EXPECT_NEAR(r.stretch_linf, 6 * std::sqrt(0.5 / 10), kRounding);
  EXPECT_EQ(r.charts, 2U);
  EXPECT_EQ(r.used, 0.5);
  // A map twice as wide as high stretches all texels by 2.
  const LayoutRating wide = rate(mesh, 256, 128);
  EXPECT_NEAR(wide.stretch_linf, r.stretch_linf * std::sqrt(2.0), kRounding);
}

TEST(Layout, SeamsOfACubeAreItsEdges) {
  KILN_REQUIRE_DEVICE();
  const LayoutRating r = rate(test::cube(2.5));
  EXPECT_EQ(r.triangles, 12U);
  EXPECT_EQ(r.charts, 6U);
  EXPECT_EQ(r.seams, 12U);
  EXPECT_NEAR(r.seam_length, 12 * 2.5, 1e-4);
  // Each face has a third of the width and half of the height, less a border of 0.01 all around.
  const double width = 1 / 3.0 - 0.02, height = 0.5 - 0.02;
  EXPECT_NEAR(r.stretch_l2, std::sqrt((width / height + height / width) / 2), 1e-4);
  EXPECT_NEAR(r.uniformity_percent, 100 * (height - width) / (height + width), 0.01);
  EXPECT_EQ(r.overlap, 0);
}

/// Two triangles beside an edge of length 2, whose UVs agree at one of its ends, at both, or at neither.
TEST(Layout, AnEdgeThatIsSplitAtOneEndIsASeam) {
  KILN_REQUIRE_DEVICE();
  for (const bool first_end : {false, true}) {
    for (const bool second_end : {false, true}) {
      for (const std::uint32_t turn : {0U, 1U, 2U}) {
        Mesh mesh;
        mesh.positions = {{0, 0, 0}, {0, 2, 0}, {-1, 1, 0}, {1, 1, 0}};
        mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
        mesh.uvs = {{0.4F, 0.1F}, {0.4F, 0.9F}, {0.1F, 0.5F},
                    {0.9F, 0.5F}, {0.6F, 0.1F}, {0.6F, 0.9F}};
        mesh.uv_triangles = {{0, 1, 2}, {second_end ? 5U : 1U, first_end ? 4U : 0U, 3}};
        for (auto* const list : {&mesh.triangles, &mesh.uv_triangles}) {
          for (Triangle& t : *list) {
            std::rotate(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(turn), t.end());
          }
        }
        const LayoutRating r = rate(mesh);
        const bool is_seam = first_end || second_end;
        EXPECT_EQ(r.seams, is_seam ? 1U : 0U) << first_end << second_end << turn;
        EXPECT_NEAR(r.seam_length, is_seam ? 2 : 0, kRounding) << first_end << second_end << turn;
      }
    }
  }
}

TEST(Layout, CountsOverlapMirroredAndFlat) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh;
  add_patch(mesh, {0, 0, 0.5F, 1}, {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}});
  add_patch(mesh, {0.25F, 0, 0.75F, 1}, {Vec3{3, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}});
  add_patch(mesh, {0, 0, 1, 0}, {Vec3{6, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}});
  // The last patch has no area in the layout, but one on the surface.
  mesh.positions[10].y = mesh.positions[11].y = 1;
  const LayoutRating r = rate(mesh);
  EXPECT_EQ(r.triangles, 4U);
  EXPECT_EQ(r.flat, 2U);
  EXPECT_EQ(r.mirrored, 0U);  // seen from its own side, the second is not
  EXPECT_EQ(r.degenerate, 0U);
  EXPECT_EQ(r.used, 0.75);
  EXPECT_NEAR(r.overlap, 1 / 3.0, 1e-12);
  for (Vec2& uv : mesh.uvs) uv.x = 1 - uv.x;
  EXPECT_EQ(rate(mesh).mirrored, 4U);
}

TEST(Layout, RefusesWhatItCannotRate) {
  KILN_REQUIRE_DEVICE();
  Mesh bare = test::plane(2, 2);
  bare.uvs.clear();
  bare.uv_triangles.clear();
  EXPECT_THROW(rate(bare), Error);
  EXPECT_THROW(rate(test::plane(2, 2), 0), Error);
}

TEST(Layout, CountsTrianglesWithoutAnyArea) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh;
  add_patch(mesh, {0, 0, 0.5F, 1}, {Vec3{0, 0, 0}, Vec3{2, 0, 0}, Vec3{0, 1, 0}});
  add_patch(mesh, {0.5F, 0, 1, 0.5F}, {Vec3{3, 0, 0}, Vec3{1, 2, 3}, Vec3{2, 4, 6}});
  mesh.positions[6].x = std::numeric_limits<float>::infinity();
  const LayoutRating r = rate(mesh, 64, 32);
  EXPECT_EQ(r.triangles, 2U);
  EXPECT_EQ(r.degenerate, 2U) << "one on a line would be, and both have the corner without a place";
  EXPECT_EQ(r.flat, 0U);
  EXPECT_NEAR(r.area, 1, 1e-6) << "0.5 x 1 of UV, twice as wide";
}

}  // namespace
}  // namespace kiln

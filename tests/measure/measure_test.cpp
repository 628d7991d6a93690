#include "kiln/measure.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "kiln/render.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A picture of one row; {0, 0, 0} is a pixel that nothing covers.
Image picture(const std::vector<Vec3>& normals) {
  Image image{static_cast<std::uint32_t>(normals.size()), 1, 3, {}};
  for (const Vec3& n : normals) {
    const bool covered = n.x != 0 || n.y != 0 || n.z != 0;
    for (const float c : {n.x, n.y, n.z}) image.pixels.push_back(covered ? c / 2 + 0.5F : 0.0F);
  }
  return image;
}

Vec3 tilted(double degrees) {
  return {static_cast<float>(std::sin(degrees * kDegree)), 0,
          static_cast<float>(std::cos(degrees * kDegree))};
}

TEST(CompareNormals, IdenticalPicturesDifferByNothing) {
  const Image image = picture({{0, 0, 1}, {0.6F, 0.8F, 0}, {0, 0, 0}, {-1, 0, 0}});
  const NormalError error = compare_normals(image, image);
  EXPECT_EQ(error.pixels, 3U);
  EXPECT_EQ(error.one_sided, 0U);
  EXPECT_EQ(error.mean_degrees, 0);
  EXPECT_EQ(error.max_degrees, 0);
  EXPECT_EQ(error.mean_8bit, 0);
  for (const double share : error.above_8bit) EXPECT_EQ(share, 0);
}

TEST(CompareNormals, AConstantTiltIsItsAngle) {
  const std::vector<Vec3> flat(200, {0, 0, 1});
  const NormalError error =
      compare_normals(picture(flat), picture(std::vector<Vec3>(200, tilted(10))));
  EXPECT_EQ(error.pixels, 200U);
  // Single precision keeps components to 6e-8.
  for (const double value : {error.mean_degrees, error.rms_degrees, error.median_degrees,
                             error.p95_degrees, error.p99_degrees, error.max_degrees}) {
    EXPECT_NEAR(value, 10, 1e-5);
  }
}

TEST(CompareNormals, PercentilesAreOfNearestRank) {
  std::vector<Vec3> flat;
  std::vector<Vec3> other;
  for (int degrees = 100; degrees >= 1; --degrees) {
    flat.push_back({0, 0, 1});
    other.push_back(tilted(degrees));
  }
  const NormalError error = compare_normals(picture(flat), picture(other));
  EXPECT_NEAR(error.mean_degrees, 50.5, 1e-5);
  EXPECT_NEAR(error.median_degrees, 50, 1e-5);
  EXPECT_NEAR(error.p95_degrees, 95, 1e-5);
  EXPECT_NEAR(error.p99_degrees, 99, 1e-5);
  EXPECT_NEAR(error.max_degrees, 100, 1e-5);
}

TEST(CompareNormals, LeavesOutWhatOnlyOneCovers) {
  const Image a = picture({{0, 0, 1}, {0, 0, 0}, {0, 0, 1}, {0, 0, 0}});
  const Image b = picture({{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {0, 0, 0}});
  const NormalError error = compare_normals(a, b);
  EXPECT_EQ(error.pixels, 1U);
  EXPECT_EQ(error.one_sided, 2U);
  EXPECT_NEAR(error.one_sided_share, 2.0 / 3, 1e-12);
  EXPECT_NEAR(error.mean_degrees, 90, 1e-12);
  const Image angles = normal_angles(a, b);
  EXPECT_EQ(angles.channels, 1U);
  EXPECT_EQ(angles.pixels, (std::vector<float>{-2, -2, 90, -1}));

  const NormalError nothing = compare_normals(picture({{0, 0, 0}}), picture({{0, 0, 1}}));
  EXPECT_EQ(nothing.pixels, 0U);
  EXPECT_EQ(nothing.one_sided, 1U);
  EXPECT_EQ(nothing.p99_degrees, 0);
}

TEST(CompareNormals, StandardErrorIsThatOfPicturesNotPixels) {
  // Two pictures of 0 and two of 10 degrees: their mean may be off by 2.9, however many pixels there are.
  NormalComparison comparison;
  for (const double degrees : {0.0, 10.0, 0.0, 10.0}) {
    const Image flat = picture(std::vector<Vec3>(1000, tilted(0)));
    comparison.add(flat, picture(std::vector<Vec3>(1000, tilted(degrees))));
  }
  EXPECT_NEAR(comparison.error().mean_degrees, 5, 1e-5);
  EXPECT_NEAR(comparison.error().standard_error_degrees, 5 / std::sqrt(3.0), 1e-5);
  // Pixels of one picture tell nothing of others.
  const Image flat = picture(std::vector<Vec3>(4, tilted(0)));
  const Image both = picture({tilted(0), tilted(10), tilted(0), tilted(10)});
  EXPECT_EQ(compare_normals(flat, both).standard_error_degrees, 0);
  // Difference of pictures that all have the same mean: none.
  NormalComparison alike;
  alike.add(flat, both);
  alike.add(flat, both);
  EXPECT_NEAR(alike.error().standard_error_degrees, 0, 1e-9);
}

TEST(CompareNormals, EightBitDifferenceByHand) {
  // (0, 0, 1) is stored as (128, 128, 255), since 255/2 + 1/2 is 128; (1, 0, 0) as (255, 128, 128).
  const NormalError right = compare_normals(picture({{0, 0, 1}}), picture({{1, 0, 0}}));
  EXPECT_DOUBLE_EQ(right.mean_8bit, std::sqrt(2.0) * 127);
  for (const double share : right.above_8bit) EXPECT_EQ(share, 1);

  // 0.52 is stored as 133 (132.6 + 0.5, rounded down), 0.48 as 122: 5 from 128, and 6.
  Image a{4, 1, 3, {0.5F, 0.5F, 1, 0.5F, 0.5F, 1, 0.5F, 0.5F, 1, 0.5F, 0.5F, 1}};
  Image b = a;
  b.pixels[0] = 0.52F;
  b.pixels[3] = 0.48F;
  b.pixels[4] = 0.52F;
  b.pixels[6] = 0.5F + 0.4F / 255;  // 127.9 + 0.5: still 128
  const NormalError small = compare_normals(a, b);
  EXPECT_DOUBLE_EQ(small.mean_8bit, (5 + std::sqrt(61.0)) / 4);
  EXPECT_EQ(small.above_8bit[0], 0.5);  // 4
  EXPECT_EQ(small.above_8bit[1], 0);    // 8
  EXPECT_GT(small.mean_degrees, 0);
}

TEST(CompareNormals, ThresholdsAreExceededAndNotMet) {
  Image a{1, 1, 3, {0.5F, 0.5F, 1}};
  Image b = a;
  b.pixels[0] = 132.0F / 255;  // 4 more than 128
  EXPECT_EQ(compare_normals(a, b).mean_8bit, 4);
  EXPECT_EQ(compare_normals(a, b).above_8bit[0], 0);
  b.pixels[0] = 133.0F / 255;
  EXPECT_EQ(compare_normals(a, b).above_8bit[0], 1);
}

TEST(CompareNormals, RefusesWhatCannotBeCompared) {
  const Image a = picture({{0, 0, 1}});
  EXPECT_THROW(compare_normals(a, picture({{0, 0, 1}, {0, 0, 1}})), Error);
  EXPECT_THROW(compare_normals(a, Image{1, 1, 1, {1}}), Error);
  EXPECT_THROW(normal_angles(Image{1, 1, 3, {1}}, a), Error);
}

RC_GTEST_PROP(CompareNormals, PicturesAddUpInAnyPieces, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(2, 60);
  const auto split = *rc::gen::inRange<std::size_t>(1, count);
  std::vector<Vec3> a(count);
  std::vector<Vec3> b(count);
  for (std::size_t i = 0; i < count; ++i) {
    a[i] = *rc::gen::inRange(0, 4) == 0 ? Vec3{} : tilted(*rc::gen::inRange(-180, 180));
    b[i] = *rc::gen::inRange(0, 4) == 0 ? Vec3{} : tilted(*rc::gen::inRange(-180, 180));
  }
  const auto at = static_cast<std::ptrdiff_t>(split);
  NormalComparison pieces;
  pieces.add(picture({a.begin(), a.begin() + at}), picture({b.begin(), b.begin() + at}));
  pieces.add(picture({a.begin() + at, a.end()}), picture({b.begin() + at, b.end()}));
  const NormalError whole = compare_normals(picture(a), picture(b));
  const NormalError sum = pieces.error();
  RC_ASSERT(sum.pixels == whole.pixels);
  RC_ASSERT(sum.one_sided == whole.one_sided);
  RC_ASSERT(sum.mean_degrees == whole.mean_degrees);
  RC_ASSERT(sum.median_degrees == whole.median_degrees);
  RC_ASSERT(sum.p95_degrees == whole.p95_degrees);
  RC_ASSERT(sum.mean_8bit == whole.mean_8bit);
  RC_ASSERT(sum.above_8bit == whole.above_8bit);
}

TEST(MatchDistance, ByHand) {
  Match match;
  match.width = 5;
  match.height = 1;
  match.status = {0, 1, 2, 4, 5};
  match.distance = {9, 1, -3, 7, 2};  // of an empty sample and of a miss: not counted
  const DistanceError error = match_distance(match);
  EXPECT_EQ(error.samples, 3U);
  EXPECT_EQ(error.missed, 1U);
  EXPECT_EQ(error.mean, 2);
  EXPECT_EQ(error.p95, 3);
  EXPECT_EQ(error.max, 3);
  EXPECT_EQ(match_distance({}).samples, 0U);
}

RC_GTEST_PROP(ViewAngles, LeadBackToTheDirection, ()) {
  const auto component = [] { return static_cast<double>(*rc::gen::inRange(-100, 101)); };
  const test::Vec3d toward{component(), component(), component()};
  const double size = std::hypot(toward.x, toward.y, toward.z);
  RC_PRE(size > 0);
  const ViewAngles view = view_angles(
      {static_cast<float>(toward.x), static_cast<float>(toward.y), static_cast<float>(toward.z)});
  const double a = view.azimuth_degrees * kDegree;
  const double e = view.elevation_degrees * kDegree;
  RC_ASSERT(std::abs(std::sin(a) * std::cos(e) - toward.x / size) < 1e-12);
  RC_ASSERT(std::abs(std::sin(e) - toward.y / size) < 1e-12);
  RC_ASSERT(std::abs(std::cos(a) * std::cos(e) - toward.z / size) < 1e-12);
}

TEST(HeldOutViews, LieApartFromAllUsedOnesAndFromEachOther) {
  std::vector<Vec3> used;
  for (std::uint32_t count : {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48}) {
    const std::vector<Vec3> views = spread_views(count);
    ASSERT_EQ(views.size(), count);
    used.insert(used.end(), views.begin(), views.end());
  }
  const std::vector<Vec3> views = held_out_views(30, used);
  ASSERT_EQ(views.size(), 30U);
  EXPECT_EQ(held_out_views(30, used), views) << "run twice";
  EXPECT_GE(least_angle_degrees(views, used), 2);
  Vec3 sum;
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_NEAR(std::hypot(views[i].x, views[i].y, views[i].z), 1, 1e-6);
    sum = {sum.x + views[i].x, sum.y + views[i].y, sum.z + views[i].z};
    for (std::size_t j = 0; j < i; ++j) {
      const double cosine =
          views[i].x * views[j].x + views[i].y * views[j].y + views[i].z * views[j].z;
      // 30 directions cannot all be more than about 40 degrees apart.
      EXPECT_LT(cosine, std::cos(20 * kDegree)) << i << " and " << j;
    }
  }
  EXPECT_LT(std::hypot(sum.x, sum.y, sum.z), 1) << "to no side";
}

TEST(HeldOutViews, SayWhereThereIsNoRoom) {
  const std::vector<Vec3> everywhere = spread_views(512);
  try {
    held_out_views(30, everywhere, 10);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
    EXPECT_NE(std::string(error.what()).find("512"), std::string::npos) << error.what();
  }
}

TEST(LeastAngle, ByHand) {
  const std::vector<Vec3> axes = {{1, 0, 0}, {0, 1, 0}};
  const std::vector<Vec3> other = {{0, 0, 1}, {-1, 0, 0}, {0.6F, 0, 0.8F}};
  EXPECT_NEAR(least_angle_degrees(axes, other), std::acos(0.6) / kDegree, 1e-5);
  EXPECT_EQ(least_angle_degrees(axes, {}), 180);
}

TEST(NormalReference, SeesAPlanesTilt) {
  KILN_REQUIRE_DEVICE();
  const Mesh plane = test::plane(4, 4);
  Mesh other = plane;
  const auto turn = [](Vec3& v) {
    const auto s = static_cast<float>(std::sin(10 * kDegree));
    const auto c = static_cast<float>(std::cos(10 * kDegree));
    v = {v.x, c * v.y - s * v.z, s * v.y + c * v.z};
  };
  for (Vec3& position : other.positions) turn(position);
  for (Vec3& normal : other.normals) turn(normal);
  const Scene scene(*test::device(), plane);
  const NormalReference reference(scene, plane, {{0, 0}, {20, 30}}, 64);
  EXPECT_EQ(reference.compare(scene).max_degrees, 0);
  const NormalError error = reference.compare(Scene(*test::device(), other));
  EXPECT_GT(error.pixels, 3000U);
  EXPECT_GT(error.one_sided, 50U);  // it looks narrower from ahead
  EXPECT_NEAR(error.mean_degrees, 10, 1e-3);
  EXPECT_NEAR(error.max_degrees, 10, 1e-3);
}

TEST(ScreenPictures, RefuseScreensAndViewsOutOfRange) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(1, 1));
  const auto error_of = [&](std::uint32_t screen, std::size_t views) -> std::string {
    try {
      const ScreenPictures pictures(source, screen, views);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  const std::string rule = ": screen must be 16 to 16384 pixels, and views at least 1.";
  EXPECT_EQ(error_of(15, 2), "ScreenPictures: screen is 15 pixels, views is 2" + rule);
  EXPECT_EQ(error_of(16385, 3), "ScreenPictures: screen is 16385 pixels, views is 3" + rule);
  EXPECT_EQ(error_of(64, 0), "ScreenPictures: screen is 64 pixels, views is 0" + rule);
  EXPECT_EQ(error_of(16, 1), "");
}

}  // namespace
}  // namespace kiln

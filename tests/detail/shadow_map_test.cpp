// The map shadow against closed forms: a wall on a floor, under a point and under a disc.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "detail/occlusion_scene.h"

namespace kiln {
namespace {

constexpr double kSide = 2, kWall = 0.6;
constexpr std::uint32_t kTexels = 64;

/// A floor around 0 with a wall along y at the left border, too long to be passed by.
Mesh walled() {
  Mesh mesh;
  test::add_rectangle(mesh, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  test::add_rectangle(mesh, {-1, -60, 0}, {0, 120, 0}, {0, 0, static_cast<float>(kWall)});
  return mesh;
}

Image shadow_of(const Mesh& high, const ShadowLight& light, std::uint32_t rays) {
  BakeOptions options;
  options.width = options.height = kTexels;
  options.encoding.gutter = 0;
  options.maps = {MapKind{"shadow"}};
  options.match.max_distance = Length::absolute(0.01);
  options.light = light;
  options.occlusion.rays = rays;
  return bake(Source(*test::device(), high), test::ground(kSide), options).maps[0].image;
}

/// Towards -X, so many degrees over the floor.
Vec3 light_at(double degrees) {
  const double radians = degrees * std::numbers::pi / 180;
  return {static_cast<float>(-2 * std::cos(radians)), 0, static_cast<float>(2 * std::sin(radians))};
}

double distance_to_wall(std::uint32_t x) { return (x + 0.5) / kTexels * kSide; }

TEST(ShadowMap, AWallCastsAShadowAsLongAsItsTangentSays) {
  KILN_REQUIRE_DEVICE();
  for (const double degrees : {20.0, 40.0, 70.0}) {
    const Image map = shadow_of(walled(), {light_at(degrees), 0}, 64);
    const double length = kWall / std::tan(degrees * std::numbers::pi / 180);
    int checked = 0;
    for (std::uint32_t y = 0; y < kTexels; ++y) {
      for (std::uint32_t x = 0; x < kTexels; ++x) {
        const double away = distance_to_wall(x);
        if (std::abs(away - length) < 1e-4) continue;
        EXPECT_EQ(*map.at(x, y), away > length ? 1.0F : 0.0F) << x << " " << degrees;
        ++checked;
      }
    }
    EXPECT_GT(checked, 4000);
  }
}

TEST(ShadowMap, UnderADiscTheShareIsThatOfItsSegment) {
  KILN_REQUIRE_DEVICE();
  constexpr double kDegrees = 40, kDiameter = 12;
  const Image map = shadow_of(walled(), {light_at(kDegrees), kDiameter}, 1024);
  double most = 0, partly = 0;
  for (std::uint32_t x = 0; x < kTexels; ++x) {
    // The wall's top is a great circle, so far from the disc's middle; on the disc nearly a straight line.
    const double top = std::atan2(kWall, distance_to_wall(x));
    const double radius = std::sin(kDiameter / 2 * std::numbers::pi / 180);
    const double h =
        std::clamp(std::sin(kDegrees * std::numbers::pi / 180 - top) / radius, -1.0, 1.0);
    const double share = 1 - (std::acos(h) - h * std::sqrt(1 - h * h)) / std::numbers::pi;
    most = std::max(most, std::abs(*map.at(x, 32) - share));
    partly += share > 0.05 && share < 0.95 ? 1 : 0;
  }
  EXPECT_LT(most, 0.02);
  EXPECT_GT(partly, 5) << "there is a half shadow";
}

TEST(ShadowMap, WhatLooksAwayIsDark) {
  KILN_REQUIRE_DEVICE();
  const Mesh floor = test::plane(1, 1, kSide, kSide);
  for (const float value : shadow_of(floor, {{0, 0.1F, -1}, 10}, 16).pixels) EXPECT_EQ(value, 0);
  for (const float value : shadow_of(floor, {{0, 0.1F, 1}, 10}, 16).pixels) EXPECT_EQ(value, 1);
}

TEST(ShadowMap, RefusesLightsFromNowhere) {
  KILN_REQUIRE_DEVICE();
  const Mesh floor = test::plane(1, 1);
  EXPECT_THROW(shadow_of(floor, {{0, 0, 0}, 0}, 1), Error);
  EXPECT_THROW(shadow_of(floor, {{0, 1, 0}, 91}, 1), Error);
  EXPECT_THROW(shadow_of(floor, {{0, NAN, 0}, 0}, 1), Error);
}

}  // namespace
}  // namespace kiln

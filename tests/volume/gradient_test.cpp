// Normals of maps against a volume's gradient: known answers.
#include "kiln/gradient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "kiln/contour.h"
#include "kiln/volume.h"
#include "support/volumes.h"

namespace kiln {
namespace {

using Vector = std::array<double, 3>;

constexpr std::uint32_t kSize = 96;

/// A square of the plane z = height, facing up, on the whole map but a rim of a texel.
Mesh square(double side, double height, Vector middle) {
  Mesh mesh;
  mesh.name = "square";
  mesh.origin = middle;
  const auto h = static_cast<float>(side / 2), z = static_cast<float>(height);
  mesh.positions = {{-h, -h, z}, {h, -h, z}, {h, h, z}, {-h, h, z}};
  const float low = 1.5F / kSize, high = 1 - 1.5F / kSize;
  mesh.uvs = {{low, low}, {high, low}, {high, high}, {low, high}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv_triangles = mesh.normal_triangles = mesh.triangles;
  return mesh;
}

/// A map of object-space normals by a texel's place on the square, relative to its middle.
Image make_map(double side, const std::function<Vector(double, double)>& normal) {
  Image map{kSize, kSize, 3, std::vector<float>(kSize * kSize * 3, 0.5F)};
  for (std::uint32_t y = 0; y < kSize; ++y) {
    for (std::uint32_t x = 0; x < kSize; ++x) {
      const double u = (x - 1.0) / (kSize - 3) - 0.5, v = 0.5 - (y - 1.0) / (kSize - 3);
      const Vector n = normal(u * side, v * side);
      for (std::size_t c = 0; c < 3; ++c) map.at(x, y)[c] = static_cast<float>(n[c] / 2 + 0.5);
    }
  }
  return map;
}

Vector unit(Vector v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  for (double& c : v) c /= length;
  return v;
}

/// Turned by an angle about some axis across it.
Vector turned(const Vector& n, double degrees) {
  const Vector across = unit({n[2], 0, -n[0]});
  const double a = degrees * std::numbers::pi / 180;
  Vector result;
  for (std::size_t c = 0; c < 3; ++c) result[c] = std::cos(a) * n[c] + std::sin(a) * across[c];
  return result;
}

constexpr double kRadius = 20.3;
const Vector kMiddle = {24.2, 23.7, 24.4};

Volume ball() {
  return test::make_float_volume({49, 48, 50}, [](double x, double y, double z) {
    return test::sphere_field(x - kMiddle[0], y - kMiddle[1], z - kMiddle[2], kRadius);
  });
}

/// Radial where the vertical line through the place meets the ball.
Vector ball_normal(double x, double y) {
  return unit({x, y, std::sqrt(std::max(0.0, kRadius * kRadius - x * x - y * y))});
}

TEST(Gradient, OfABallIsRadial) {
  // Square above, below and through the surface: what is looked for is the same place of it.
  const Volume volume = ball();
  constexpr double kSide = 16;
  const Image right = make_map(kSide, ball_normal);
  for (const double height : {17.0, 19.0, 22.0}) {
    const GradientReference reference(volume, {}, square(kSide, height, kMiddle),
                                      {.size = kSize, .reach = 6});
    EXPECT_EQ(reference.covered(), std::uint64_t{kSize - 2} * (kSize - 2));
    EXPECT_EQ(reference.no_surface() + reference.cut() + reference.no_gradient(), 0U);
    const GradientError error = reference.compare(right);
    EXPECT_EQ(error.texels, reference.covered());
    // Central differences of a distance are off by up to about (h / r)^2 / 6 radians: 0.023 degrees.
    EXPECT_LT(error.max_degrees, 0.03);
    EXPECT_LE(error.mean_degrees, error.rms_degrees);
    EXPECT_LE(error.p95_degrees, error.p99_degrees);

    // Known angles come back.
    for (const double degrees : {1.0, 30.0, 120.0}) {
      const GradientError off = reference.compare(
          make_map(kSide, [&](double x, double y) { return turned(ball_normal(x, y), degrees); }));
      EXPECT_NEAR(off.mean_degrees, degrees, 0.03);
      EXPECT_NEAR(off.rms_degrees, degrees, 0.03);
      EXPECT_NEAR(off.median_degrees, degrees, 0.03);
      EXPECT_NEAR(off.p95_degrees, degrees, 0.03);
    }
    // No map: the angle from the square's own normal to the radius, asin(r / R).
    double sum = 0;
    for (std::uint32_t j = 1; j + 1 < kSize; ++j) {
      for (std::uint32_t i = 1; i + 1 < kSize; ++i) {
        const double u = ((i - 1.0) / (kSize - 3) - 0.5) * kSide;
        const double v = ((j - 1.0) / (kSize - 3) - 0.5) * kSide;
        sum += std::asin(std::hypot(u, v) / kRadius) * 180 / std::numbers::pi;
      }
    }
    const auto count = static_cast<double>(reference.covered());
    EXPECT_NEAR(reference.compare_without_map().mean_degrees, sum / count, 0.01);
    // A map without a normal is no map, and says so.
    const GradientError empty =
        reference.compare(make_map(kSide, [](double, double) { return Vector{}; }));
    EXPECT_EQ(empty.empty, reference.covered());
    EXPECT_EQ(empty.mean_degrees, reference.compare_without_map().mean_degrees);
    EXPECT_EQ(error.empty, 0U);
  }
}

TEST(Gradient, WhatIsOutOfReachIsCounted) {
  // A line at distance s from the axis meets the ball at height sqrt(R^2 - s^2), if at all.
  constexpr double kSide = 44, kHeight = 21, kReach = 5;
  std::uint64_t missed = 0;
  for (std::uint32_t j = 1; j + 1 < kSize; ++j) {
    for (std::uint32_t i = 1; i + 1 < kSize; ++i) {
      const double u = ((i - 1.0) / (kSize - 3) - 0.5) * kSide;
      const double v = ((j - 1.0) / (kSize - 3) - 0.5) * kSide;
      const double squared = kRadius * kRadius - u * u - v * v;
      missed += squared < 0 || kHeight - std::sqrt(squared) > kReach ? 1 : 0;
    }
  }
  const GradientReference reference(ball(), {}, square(kSide, kHeight, kMiddle),
                                    {.size = kSize, .reach = kReach});
  EXPECT_NEAR(static_cast<double>(reference.no_surface()), static_cast<double>(missed), 8);
  EXPECT_GT(missed, 3000U);
  const GradientError error = reference.compare(make_map(kSide, ball_normal));
  EXPECT_EQ(error.texels + reference.no_surface(), reference.covered());
  EXPECT_LT(error.max_degrees, 0.06);
}

TEST(Gradient, OfATorusInWorldUnits) {
  // Oblique, mirrored axes of other lengths, voxels of 16 bits, the solid below the iso value.
  constexpr double kMajor = 14, kMinor = 5.5;  // world; the ring lies flat, seen from above
  Volume volume = test::make_volume<std::int16_t>(
      {81, 75, 40}, VoxelType::i16, [&](double i, double j, double k) {
        const double x = -0.5 * (i - 40) + 0.1 * (j - 37), y = 0.6 * (j - 37), z = 0.4 * (k - 20);
        return std::lround(-500 * test::torus_field(x, z, y, kMajor, kMinor) + 77);
      });
  volume.origin = {3 + 20 - 3.7, -2 - 0.6 * 37, 5 - 0.4 * 20};
  volume.axes = {{{-0.5, 0, 0}, {0.1, 0.6, 0}, {0, 0, 0.4}}};
  constexpr double kSide = 30;
  const auto normal = [](double x, double y) {
    const double ring = std::hypot(x, y), out = ring - kMajor;
    const double up = std::sqrt(std::max(0.0, kMinor * kMinor - out * out));
    return unit({x / ring * out, y / ring * out, up});
  };
  const GradientReference reference(volume, {.iso = 77, .inside = Inside::below},
                                    square(kSide, 3.5, {3, -2, 5}), {.size = kSize, .reach = 3});
  const GradientError error = reference.compare(make_map(kSide, normal));
  EXPECT_GT(error.texels, 3000U);
  EXPECT_GT(reference.no_surface(), 1000U);  // the hole and around
  // Curved by a few voxels, and steep at the rims, where a place is less sure: small, not 0.
  EXPECT_LT(error.mean_degrees, 0.2);
  EXPECT_LT(error.p95_degrees, 0.4);
  EXPECT_LT(error.max_degrees, 2);
}

TEST(Gradient, BordersAndInnerSurfacesAreNoGradient) {
  const auto shell = [](double x, double y, double z) {
    const double r = std::hypot(x - 24, y - 24, z - 24);
    return std::min(20 - r, r - 14.5);
  };
  const auto look = [](const Volume& volume, ContourOptions contour, const Vector& at) {
    return GradientReference(volume, contour, square(3, 0, at), {.size = kSize, .reach = 3});
  };
  const auto all = std::uint64_t{kSize - 2} * (kSize - 2);
  // Cut by the volume's top.
  const Volume cut = test::make_float_volume({48, 48, 36}, shell);
  const Vector on_cut = {37, 24, 35.5};
  EXPECT_EQ(look(cut, {}, on_cut).cut(), all);
  EXPECT_EQ(look(cut, {.border = VolumeBorder::open}, on_cut).no_surface(), all);
  // Whole. At the hollow's ceiling one leaves the solid downwards, at its floor upwards.
  const Volume whole = test::make_float_volume({48, 48, 48}, shell);
  EXPECT_EQ(look(whole, {}, {24, 24, 38}).no_surface(), all);
  const Vector on_floor = {24, 24, 10};
  const GradientReference floor = look(whole, {}, on_floor);
  EXPECT_EQ(floor.no_surface() + floor.cut() + floor.no_gradient(), 0U);
  // Not where the hollow counts as solid; the outside stays.
  EXPECT_EQ(look(whole, {.outer_only = true}, on_floor).no_surface(), all);
  EXPECT_EQ(look(whole, {.outer_only = true}, {24, 24, 43}).no_surface(), 0U);
}

TEST(Gradient, SaysWhatIsWrong) {
  const Volume volume = ball();
  const auto code = [&](const Mesh& low, const GradientOptions& options) {
    try {
      GradientReference(volume, {}, low, options);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  const Mesh low = square(4, 20, kMiddle);
  EXPECT_EQ(code(low, {.size = 0, .reach = 1}), ErrorCode::usage);
  EXPECT_EQ(code(low, {.size = 64, .reach = 0}), ErrorCode::usage);
  EXPECT_EQ(code(low, {.size = 64, .reach = std::nan("")}), ErrorCode::usage);
  Mesh bare = low;
  bare.uv_triangles.clear();
  EXPECT_EQ(code(bare, {.size = 64, .reach = 1}), ErrorCode::input);
  const GradientReference reference(volume, {}, low, {.size = 64, .reach = 1});
  EXPECT_THROW(reference.compare(Image{32, 32, 3, std::vector<float>(32 * 32 * 3)}), Error);
}

}  // namespace
}  // namespace kiln

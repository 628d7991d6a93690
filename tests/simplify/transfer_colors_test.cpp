// Vertex colours that a simplified mesh keeps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "base/srgb.h"
#include "kiln/image.h"
#include "kiln/limits.h"
#include "kiln/plan.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "mesh/surface_distance.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Rgba8 = std::array<std::uint8_t, 4>;

std::uint8_t srgb_byte(double linear) {
  return static_cast<std::uint8_t>(std::lround(255 * to_srgb(static_cast<float>(linear))));
}

/// Linear light that grows along the axes, and alpha along x.
Rgba8 ramp(const Vec3& p) {
  return {srgb_byte(0.5 + 0.3 * p.x), srgb_byte(0.5 + 0.3 * p.y), srgb_byte(0.5 + 0.3 * p.z),
          static_cast<std::uint8_t>(std::lround(255 * (0.5 + 0.3 * p.x)))};
}

/// A cube's faces, cut finely: simplified, its corners are where they were.
Mesh fine_cube() {
  Mesh mesh;
  mesh.name = "cube";
  constexpr std::uint32_t n = 24;
  for (int side = 0; side < 6; ++side) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const int axis = side / 2;
    const float at = side % 2 == 0 ? 1.0F : -1.0F;
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t k = 0; k <= n; ++k) {
        // Rounded once, so that corners of neighbouring sides are equal.
        const auto u = (2 * static_cast<float>(i) - n) / n, v = (2 * static_cast<float>(k) - n) / n;
        std::array<float, 3> p{};
        p[static_cast<std::size_t>(axis)] = at;
        p[static_cast<std::size_t>((axis + 1) % 3)] = u;
        p[static_cast<std::size_t>((axis + 2) % 3)] = at * v;
        mesh.positions.push_back({p[0], p[1], p[2]});
      }
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t k = 0; k < n; ++k) {
        const std::uint32_t a = first + i * (n + 1) + k, b = a + n + 1;
        mesh.triangles.push_back({a, b, b + 1});
        mesh.triangles.push_back({a, b + 1, a + 1});
      }
    }
  }
  return mesh;
}

TEST(KeepColors, LinearOnesStayWhatTheyAre) {
  Mesh high = fine_cube();
  for (const Vec3& p : high.positions) high.colors.push_back(ramp(p));
  const Mesh low = simplify(high, {.faces = 60});
  ASSERT_EQ(low.colors.size(), low.positions.size());
  // Bytes are rounded, and slivers make more of that.
  double sum = 0;
  for (std::size_t v = 0; v < low.positions.size(); ++v) {
    const Rgba8 wanted = ramp(low.positions[v]);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(low.colors[v][k], wanted[k], 16) << v;
      sum += std::abs(low.colors[v][k] - wanted[k]);
    }
  }
  EXPECT_LT(sum / (4.0 * static_cast<double>(low.positions.size())), 0.7);
  const Mesh laid_out = unwrap(low);
  ASSERT_EQ(laid_out.colors.size(), laid_out.positions.size());
  for (std::size_t v = 0; v < laid_out.positions.size(); ++v) {
    EXPECT_NEAR(laid_out.colors[v][0], ramp(laid_out.positions[v])[0], 16);
  }
}

/// The mean squared error, in linear light, of a low poly's colours at the high poly's vertices.
double error_of(const Mesh& high, const Mesh& low) {
  const SurfaceDistance surface(low.positions, low.triangles);
  const auto& linear = linear_values_of_bytes();
  double sum = 0;
  for (std::size_t v = 0; v < high.positions.size(); ++v) {
    const Vec3& p = high.positions[v];
    const Triangle& t = low.triangles[surface.nearest(p)];
    std::array<std::array<double, 3>, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& q = low.positions[t[k]];
      c[k] = {double{q.x}, double{q.y}, double{q.z}};
    }
    // By areas of the triangles that the point makes with two corners: near the surface, these are its weights.
    const auto area = [&](const std::array<double, 3>& a, const std::array<double, 3>& b) {
      const std::array<double, 3> d = {a[0] - p.x, a[1] - p.y, a[2] - p.z},
                                  e = {b[0] - p.x, b[1] - p.y, b[2] - p.z};
      return std::hypot(d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2],
                        d[0] * e[1] - d[1] * e[0]);
    };
    const std::array<double, 3> w = {area(c[1], c[2]), area(c[2], c[0]), area(c[0], c[1])};
    double red = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      red += w[k] / (w[0] + w[1] + w[2]) * linear[low.colors[t[k]][0]];
    }
    const double off = red - linear[high.colors[v][0]];
    sum += off * off;
  }
  return sum / static_cast<double>(high.positions.size());
}

/// No single vertex's colour, made lighter or darker, makes the whole better by much: it is the least.
TEST(KeepColors, AreTheBestThatTrianglesCanShow) {
  Mesh high = test::BumpySphere::dense(8000);
  for (const Vec3& p : high.positions) {
    const double stripes = 0.5 + 0.5 * std::sin(7 * p.x + 3 * p.y);
    high.colors.push_back({srgb_byte(stripes), 0, 0, 255});
  }
  Mesh low = simplify(high, {.faces = 400});
  ASSERT_EQ(low.colors.size(), low.positions.size());
  const double reached = error_of(high, low);
  Mesh nearest = low;
  const SurfaceDistance surface(high.positions, high.triangles);
  for (std::size_t v = 0; v < low.positions.size(); ++v) {
    nearest.colors[v] = high.colors[high.triangles[surface.nearest(low.positions[v])][0]];
  }
  EXPECT_LT(reached, 0.9 * error_of(high, nearest));
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    const std::size_t v = random() % low.colors.size();
    for (const int change : {-12, 12}) {
      Mesh other = low;
      other.colors[v][0] =
          static_cast<std::uint8_t>(std::clamp(int{other.colors[v][0]} + change, 0, 255));
      EXPECT_GT(error_of(high, other), 0.99 * reached) << v << " by " << change;
    }
  }
}

TEST(KeepColors, OneColourStaysAndNoneStaysNone) {
  Mesh high = test::BumpySphere::dense(3000);
  EXPECT_TRUE(simplify(high, {.faces = 200}).colors.empty());
  high.colors.assign(high.positions.size(), {12, 200, 77, 31});
  const Mesh low = simplify(high, {.faces = 200});
  ASSERT_EQ(low.colors.size(), low.positions.size());
  for (const Rgba8& color : low.colors) EXPECT_EQ(color, (Rgba8{12, 200, 77, 31}));
}

TEST(KeepColors, DoNotDependOnThreads) {
  Mesh high = test::BumpySphere::dense(6000);
  for (const Vec3& p : high.positions) high.colors.push_back(ramp(p));
  set_thread_limit(1);
  const Mesh one = simplify(high, {.faces = 300});
  set_thread_limit(0);
  EXPECT_EQ(one.colors, simplify(high, {.faces = 300}).colors);
}

/// Planned low polys keep them, and so do lighter levels that share its UVs.
TEST(KeepColors, OfPlans) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(6000);
  for (const Vec3& p : high.positions) high.colors.push_back(ramp(p));
  const Source source(*test::device(), high);
  LodOptions options;
  options.levels = 2;
  options.share_uvs = true;
  options.plan.max_error = 8;
  options.plan.screen = 256;
  options.plan.bake.width = options.plan.bake.height = 64;
  const LodChain chain = bake_lods(source, high, options);
  ASSERT_FALSE(chain.levels.empty());
  for (const LodLevel& level : chain.levels) {
    const Mesh& low = level.plan.low;
    ASSERT_EQ(low.colors.size(), low.positions.size());
    for (std::size_t v = 0; v < low.positions.size(); ++v) {
      EXPECT_NEAR(low.colors[v][0], ramp(low.positions[v])[0], 40) << v;
    }
  }
}

/// Two spheres apart in two colours: neither takes the other's.
TEST(KeepColors, StayOnTheirParts) {
  const Mesh one = test::BumpySphere::dense(3000);
  Mesh high;
  high.name = "two";
  for (std::uint32_t side = 0; side < 2; ++side) {
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    for (const Vec3& p : one.positions) {
      high.positions.push_back({p.x + 4 * static_cast<float>(side), p.y, p.z});
      high.colors.push_back(side == 0 ? Rgba8{255, 0, 0, 255} : Rgba8{0, 0, 255, 255});
    }
    for (const Triangle& t : one.triangles) {
      high.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  }
  const Mesh low = simplify(high, {.faces = 300});
  for (std::size_t v = 0; v < low.positions.size(); ++v) {
    EXPECT_EQ(low.colors[v],
              (low.positions[v].x < 2 ? Rgba8{255, 0, 0, 255} : Rgba8{0, 0, 255, 255}));
  }
}

}  // namespace
}  // namespace kiln

// Ambient occlusion, bent normals and thickness: closed forms, and an oracle of random rays.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "detail/occlusion_scene.h"
#include "reference/occlusion.h"

namespace kiln {
namespace {

using test::add_disc;
using test::add_rectangle;
using test::asking;
using test::ground;
using test::map_of;

constexpr double kPi = std::numbers::pi;

/// Calls with the texel and the place on ground(side) of each texel that was baked.
void each_texel(const BakeResult& baked, double side,
                const std::function<void(std::size_t, double, double)>& call) {
  const Image& image = baked.maps[0].image;
  std::size_t count = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    ++count;
    const std::size_t x = i % image.width, y = i / image.width;
    const double u = (static_cast<double>(x) + 0.5) / image.width;
    const double v = 1 - (static_cast<double>(y) + 0.5) / image.height;
    call(i, (u - 0.5) * side, (v - 0.5) * side);
  }
  ASSERT_EQ(count, baked.coverage.size());
}

/// Share of a hemisphere's cosine that a disc takes, parallel to the plane at height h and off by a.
double disc_share(double radius, double height, double off) {
  const double sum = height * height + off * off + radius * radius;
  return 0.5 *
         (1 - (sum - 2 * radius * radius) / std::sqrt(sum * sum - 4 * radius * radius * off * off));
}

TEST(OcclusionMaps, ADiscAboveAPlane) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(3, 3, 6, 6);
  add_disc(high, {0, 0, 0.5F}, 0.4F, false);
  const Source source(*test::device(), high);
  BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}}, 24);
  options.occlusion.rays = 1024;
  const BakeResult baked = bake(source, ground(2), options);
  double mean = 0;
  each_texel(baked, 2, [&](std::size_t i, double x, double y) {
    const double off = std::hypot(x, y);
    const double error = map_of(baked, "ao").pixels[i] - (1 - disc_share(0.4, 0.5, off));
    // Five standard deviations of 1024 random rays at worst; spread ones err less.
    EXPECT_LT(std::abs(error), 0.03) << x << ' ' << y;
    mean += error / (24 * 24);
    // Towards the rim, and never under the plane.
    const float* bent = &map_of(baked, "bent_normal").pixels[3 * i];
    EXPECT_GT(bent[2], 0.0F);
    if (off > 0.2 && off < 0.8) {
      EXPECT_GT(bent[0] * x + bent[1] * y, 0);
    }
  });
  EXPECT_LT(std::abs(mean), 0.0015);  // the polygon for the disc takes 0.0003 less
}

TEST(OcclusionMaps, ASphereOnAPlane) {
  KILN_REQUIRE_DEVICE();
  constexpr double kRadius = 0.4;
  Mesh high = test::plane(3, 3, 6, 6);
  const Mesh sphere = test::icosphere(4, kRadius);
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  for (Vec3 p : sphere.positions) {
    p.z += static_cast<float>(kRadius);
    high.positions.push_back(p);
  }
  for (const Triangle& t : sphere.triangles) {
    high.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  high.normals.clear();
  high.normal_triangles.clear();
  high.uvs.clear();
  high.uv_triangles.clear();
  BakeOptions options = asking({MapKind{"ao"}}, 24);
  options.match.max_distance =
      Length::absolute(1e-4);  // the sphere itself is out of reach but at its foot
  options.occlusion.rays = 1024;
  const BakeResult baked = bake(Source(*test::device(), high), ground(3), options);
  double mean = 0;
  each_texel(baked, 3, [&](std::size_t i, double x, double y) {
    const double away = std::sqrt(x * x + y * y + kRadius * kRadius);
    const double error = map_of(baked, "ao").pixels[i] - (1 - std::pow(kRadius / away, 3));
    EXPECT_LT(std::abs(error), 0.03) << x << ' ' << y;
    mean += error / (24 * 24);
  });
  EXPECT_LT(std::abs(mean), 0.0015);
}

/// A wall along x = -1, over ground(2), so that texels are 0 to 2 away from it.
Mesh corner(float height) {
  Mesh high;
  high.name = "corner";
  add_rectangle(high, {-1, -20, 0}, {3, 0, 0}, {0, 40, 0});
  add_rectangle(high, {-1, -20, 0}, {0, 40, 0}, {0, 0, height});
  return high;
}

TEST(OcclusionMaps, AWallOnAFloor) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), corner(1));
  BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}}, 20);
  options.occlusion.rays = 1024;
  options.match.max_distance = Length::absolute(0.01);
  const BakeResult baked = bake(source, ground(2), options);
  double mean = 0;
  each_texel(baked, 2, [&](std::size_t i, double x, double) {
    const double away = x + 1;
    const double error =
        map_of(baked, "ao").pixels[i] - (1 - 0.5 * (1 - away / std::hypot(away, 1)));
    EXPECT_LT(std::abs(error), 0.02) << x;
    mean += error / 400;
    // Over the profile from the wall's top to the far horizon, all along the wall.
    const double top = std::atan(away);
    const double across = (1 - std::sin(top) * std::sin(top)) / 2;
    const double up = (kPi / 2 + top) / 2 + std::sin(2 * top) / 4;
    const float* bent = &map_of(baked, "bent_normal").pixels[3 * i];
    EXPECT_NEAR(bent[0], across / std::hypot(across, up), 0.02) << x;
    EXPECT_NEAR(bent[1], 0, 0.02);
    EXPECT_NEAR(bent[2], up / std::hypot(across, up), 0.02) << x;
    EXPECT_NEAR(std::hypot(bent[0], bent[1], bent[2]), 1, 1e-6);
  });
  EXPECT_LT(std::abs(mean), 0.002);  // the wall ends, 20 away to both sides
}

TEST(OcclusionMaps, NothingOccludesBeyondTheDistance) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), corner(2));
  BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}}, 20);
  options.occlusion.rays = 1024;
  options.occlusion.distance = Length::absolute(0.8);
  options.match.max_distance = Length::absolute(0.01);
  const BakeResult baked = bake(source, ground(2), options);
  each_texel(baked, 2, [&](std::size_t i, double x, double) {
    const double near = (x + 1) / 0.8;
    // The disk's segment beyond `near`: rays that lean so far to the wall are short enough.
    const double segment =
        near < 1 ? (std::acos(near) - near * std::sqrt(1 - near * near)) / kPi : 0;
    EXPECT_NEAR(map_of(baked, "ao").pixels[i], 1 - segment, 0.02) << x;
    if (near < 1) return;
    EXPECT_EQ(map_of(baked, "ao").pixels[i], 1.0F) << x;
    // Opposite rays cancel but for rounding: 1024 of 1e-7.
    EXPECT_NEAR(map_of(baked, "bent_normal").pixels[3 * i], 0, 1e-6);
    EXPECT_NEAR(map_of(baked, "bent_normal").pixels[3 * i + 1], 0, 1e-6);
    EXPECT_NEAR(map_of(baked, "bent_normal").pixels[3 * i + 2], 1, 1e-6);
  });
}

TEST(OcclusionMaps, AnOpenSurfaceIsOpenToItsNormal) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::icosphere(5, 1);
  BakeOptions options = asking({MapKind::normal, MapKind{"ao"}, MapKind{"bent_normal"}}, 48);
  options.samples = 2;
  options.match.max_distance = Length::share(0.05);
  const Mesh low = test::uv_sphere(24, 12);
  const Source source(*test::device(), high);
  for (const NormalMapSpace space :
       {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
    options.encoding.space = space;
    options.encoding.flip_y = space == NormalMapSpace::tangent;
    options.encoding.two_component = space == NormalMapSpace::face;
    options.encoding.raw = space != NormalMapSpace::object;
    const BakeResult baked = bake(source, low, options);
    const Image& normal = map_of(baked, "normal");
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      if (baked.coverage[i] != kCoverageBaked) continue;
      // Interpolated normals lean off the faces by 1 degree: rays under a face meet the inside. Of 64
      // rays that is one at most in each of 4 samples.
      EXPECT_GT(map_of(baked, "ao").pixels[i], 1 - 1.0 / 64 - 1e-6);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(map_of(baked, "bent_normal").pixels[3 * i + c], normal.pixels[3 * i + c], 0.03)
            << static_cast<int>(space);
      }
    }
  }
}

TEST(OcclusionMaps, BacksOccludeOnlyWhereAsked) {
  KILN_REQUIRE_DEVICE();
  for (const bool faces_down : {true, false}) {
    Mesh high = test::plane(3, 3, 6, 6);
    add_disc(high, {0, 0, 0.5F}, 2, !faces_down);
    const Source source(*test::device(), high);
    BakeOptions options = asking({MapKind{"ao"}}, 8);
    const float either = map_of(bake(source, ground(0.5), options), "ao").pixels[27];
    EXPECT_LT(either, 0.1F);
    options.occlusion.back_faces = false;
    const float fronts = map_of(bake(source, ground(0.5), options), "ao").pixels[27];
    EXPECT_EQ(fronts, faces_down ? either : 1.0F);
  }
}

TEST(OcclusionMaps, ThicknessOfASlab) {
  KILN_REQUIRE_DEVICE();
  constexpr double kThick = 0.2, kReach = 0.5;
  for (const bool closed : {true, false}) {
    Mesh high = test::plane(3, 3, 6, 6);
    // The back looks down, as a solid's does, or up, as a sheet's below does: both end a ray.
    const float deep = -static_cast<float>(kThick);
    if (closed) {
      add_rectangle(high, {-3, -3, deep}, {0, 6, 0}, {6, 0, 0});
    } else {
      add_rectangle(high, {-3, -3, deep}, {6, 0, 0}, {0, 6, 0});
    }
    BakeOptions options = asking({MapKind{"thickness"}}, 16);
    options.occlusion.distance = Length::absolute(kReach);
    options.occlusion.rays = 256;
    options.match.max_distance = Length::absolute(0.01);
    const BakeResult baked = bake(Source(*test::device(), high), ground(1), options);
    each_texel(baked, 1, [&](std::size_t i, double, double) {
      // Ways of T / cos, up to the reach: 2 T - T^2 / D on average. Rays have each height once.
      EXPECT_NEAR(baked.maps[0].image.pixels[i], (2 * kThick - kThick * kThick / kReach) / kReach,
                  2.0 / 256);
    });
  }
  // Without another side everything is as thick as can be.
  const BakeResult open = bake(Source(*test::device(), test::plane(3, 3, 6, 6)), ground(1),
                               asking({MapKind{"thickness"}}, 8));
  for (const float value : open.maps[0].image.pixels) EXPECT_EQ(value, 1.0F);
}

TEST(OcclusionMaps, ThicknessOfASphere) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::uv_sphere(128, 64, 1);
  BakeOptions options = asking({MapKind{"thickness"}, MapKind{"ao"}}, 32);
  options.occlusion.distance = Length::absolute(2);
  options.occlusion.rays = 256;
  options.match.max_distance = Length::share(0.05);
  const BakeResult baked = bake(Source(*test::device(), high), test::uv_sphere(24, 12), options);
  double mean = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    ++count;
    // Chords of 2 R cos: 4 R / 3 on average.
    const double value = map_of(baked, "thickness").pixels[i];
    EXPECT_NEAR(value, 2.0 / 3, 0.015);
    mean += value;
  }
  ASSERT_GT(count, 500U);
  EXPECT_NEAR(mean / static_cast<double>(count), 2.0 / 3, 0.003);
}

/// Against random rays, on a mesh that shades itself, with normals that lean off its faces.
TEST(OcclusionMaps, RandomRaysSayTheSame) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::torus(20, 10, 1, 0.45);
  const Source source(*test::device(), high);
  for (const bool two_sided_search : {true, false}) {
    BakeOptions options = asking({MapKind{"ao"}, MapKind{"bent_normal"}, MapKind{"thickness"}}, 24);
    options.encoding.space = NormalMapSpace::object;
    options.match.max_distance = Length::share(0.1);
    options.report.keep_match = true;
    options.occlusion.rays = 1024;
    options.occlusion.back_faces = two_sided_search;
    options.occlusion.distance = Length::absolute(1.2);
    const BakeResult baked = bake(source, test::torus(30, 12, 1, 0.45), options);
    const Match& match = *baked.match;
    double open_error = 0, way_error = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); i += 19) {
      if (baked.coverage[i] != kCoverageBaked) continue;
      ++count;
      const double w[3] = {1.0 - match.u[i] - match.v[i], match.u[i], match.v[i]};
      std::array<double, 3> at{}, normal{}, opposite{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = high.positions[high.triangles[match.triangle[i]][k]];
        const Vec3& n = high.normals[high.normal_triangles[match.triangle[i]][k]];
        const double ps[3] = {p.x, p.y, p.z}, ns[3] = {n.x, n.y, n.z};
        for (std::size_t c = 0; c < 3; ++c) at[c] += w[k] * ps[c], normal[c] += w[k] * ns[c];
      }
      const double size = std::hypot(normal[0], normal[1], normal[2]);
      for (std::size_t c = 0; c < 3; ++c) opposite[c] = -(normal[c] /= size);
      reference::HemisphereSearch search;
      search.rays = 1500;
      search.seed = i + 1;
      search.distance = 1.2;
      search.back_faces = two_sided_search;
      const auto out =
          reference::view_hemisphere(high.positions, high.triangles, at, normal, search);
      search.back_faces = true;
      const auto in =
          reference::view_hemisphere(high.positions, high.triangles, at, opposite, search);
      // Five deviations of 1500 random rays, 0.013 at worst, and what 1024 spread ones err.
      const double open = map_of(baked, "ao").pixels[i], way = map_of(baked, "thickness").pixels[i];
      EXPECT_NEAR(open, out.open, 0.07) << i;
      EXPECT_NEAR(way, in.way / 1.2, 0.05) << i;
      open_error += open - out.open;
      way_error += way - in.way / 1.2;
      const double lean = std::hypot(out.lean[0], out.lean[1], out.lean[2]);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(map_of(baked, "bent_normal").pixels[3 * i + c], out.lean[c] / lean, 0.1) << i;
      }
    }
    ASSERT_GT(count, 20U);
    EXPECT_LT(std::abs(open_error) / static_cast<double>(count), 0.015);
    EXPECT_LT(std::abs(way_error) / static_cast<double>(count), 0.012);
  }
}

}  // namespace
}  // namespace kiln

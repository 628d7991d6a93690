// Measures of a match, against answers known by hand and by brute force.
#include "kiln/assess.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "kiln/measure.h"
#include "shared/common.h"
#include "shared/match.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kSize = 64;

/// A triangle over the unit square at height z.
Mesh big_triangle(float z) {
  Mesh mesh;
  mesh.name = "big";
  mesh.positions = {{-0.5F, -0.5F, z}, {3.5F, -0.5F, z}, {-0.5F, 3.5F, z}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

using Map = std::function<Vec2(double, double)>;

/// A match of the plane with big_triangle: texel (x, y) goes to the map's place.
Match made_match(const Map& map) {
  Match match;
  match.width = match.height = kSize;
  match.source_triangles = 1;
  for (std::uint32_t row = 0; row < kSize; ++row) {
    for (std::uint32_t column = 0; column < kSize; ++column) {
      const Vec2 to = map((column + 0.5) / kSize - 0.5, 0.5 - (row + 0.5) / kSize);
      match.triangle.push_back(0);
      match.u.push_back((to.x + 0.5F) / 4);
      match.v.push_back((to.y + 0.5F) / 4);
      match.distance.push_back(0);
      match.status.push_back(KILN_STATUS_CLOSEST);
    }
  }
  return match;
}

Vec2 point(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

MatchAssessment assess_plane(float height, const Map& map, std::uint32_t directions = 2048) {
  const Source source(*test::device(), big_triangle(height));
  AssessOptions options;
  options.directions = directions;
  options.fields = true;
  return assess(source, test::plane(1, 1), made_match(map), options);
}

TEST(Assess, APlaneOverAPlaneHasTheDistancesOfGeometry) {
  KILN_REQUIRE_DEVICE();
  const MatchAssessment a = assess_plane(0.25F, point);
  EXPECT_EQ(a.samples, kSize * kSize);
  EXPECT_EQ(a.missed, 0U);
  EXPECT_NEAR(a.match_distance.mean, 0.25, 1e-6);
  EXPECT_NEAR(a.match_distance.rms, 0.25, 1e-6);
  EXPECT_NEAR(a.match_distance.p95, 0.25, 1e-6);
  EXPECT_NEAR(a.match_distance.max, 0.25, 1e-6);
  EXPECT_NEAR(a.match_distance.area, 1, 1e-6);
  // The integral of h sin(t) cos(t) over the hemisphere over that of cos(t): 2/3 h.
  EXPECT_NEAR(a.image_space_over_area.mean, 0.25 * 2 / 3, 2e-3);
  EXPECT_NEAR(a.image_space.mean, 0.25 * 2 / 3, 2e-3);
  EXPECT_EQ(a.never_visible, 0);
  EXPECT_NEAR(a.mean_stretch, 0, 1e-4);
  EXPECT_NEAR(a.stretch.max, 0, 1e-3);
  EXPECT_NEAR(a.stretch.area, (kSize - 1.0) * (kSize - 1.0) / (kSize * kSize), 1e-6);
  EXPECT_EQ(a.folded, 0);
  EXPECT_NEAR(a.largest_jump, 1.0 / kSize, 1e-6);
  EXPECT_NEAR(a.largest_step, 1.0 / kSize, 1e-6);
  EXPECT_EQ(a.cells, (kSize - 1) * (kSize - 1));
  EXPECT_EQ(a.directions, 2048U);
}

TEST(Assess, APerfectMatchHasNoDistance) {
  KILN_REQUIRE_DEVICE();
  const MatchAssessment a = assess_plane(0, point, 64);
  EXPECT_NEAR(a.match_distance.max, 0, 1e-6);
  EXPECT_NEAR(a.image_space_over_area.max, 0, 1e-6);
}

TEST(Assess, DistancesAlongAPictureDoNotCountInIt) {
  KILN_REQUIRE_DEVICE();
  // A shift within the plane shows most from above: the mean of cos(t) sqrt(1 - sin^2(t) cos^2(p)) over
  // that of cos(t), by quadrature.
  double sum = 0, weights = 0;
  for (int i = 0; i < 1000; ++i) {
    const double z = (i + 0.5) / 1000;
    for (int k = 0; k < 1000; ++k) {
      const double c = std::cos(2 * std::numbers::pi * (k + 0.5) / 1000);
      sum += z * std::sqrt(1 - (1 - z * z) * c * c);
      weights += z;
    }
  }
  const MatchAssessment a = assess_plane(0, [](double x, double y) { return point(x + 0.25, y); });
  EXPECT_NEAR(a.match_distance.mean, 0.25, 1e-6);
  EXPECT_NEAR(a.image_space_over_area.mean, 0.25 * sum / weights, 1e-3);
}

TEST(Assess, FoldsAndStretchAreFound) {
  KILN_REQUIRE_DEVICE();
  const MatchAssessment mirrored = assess_plane(
      0, [](double x, double y) { return point(-x, y); }, 12);
  EXPECT_EQ(mirrored.folded, 1);
  EXPECT_NEAR(mirrored.mean_stretch, 0, 1e-4);

  const MatchAssessment halved = assess_plane(
      0, [](double x, double y) { return point(x / 2, y / 2); }, 12);
  EXPECT_EQ(halved.folded, 0);
  EXPECT_NEAR(halved.mean_stretch, -2, 1e-3);
  EXPECT_NEAR(halved.stretch.max, 0, 1e-3);

  // Half of the cells as they are, half four times as dense: log2 is 0 or -2, so 1 off the mean.
  const MatchAssessment uneven = assess_plane(
      0, [](double x, double y) { return x < 0 ? point(x, y) : point(x / 4, y); }, 12);
  EXPECT_NEAR(uneven.mean_stretch, -1, 0.03);
  EXPECT_NEAR(uneven.stretch.mean, 1, 0.03);

  // A fold in the middle third only.
  const MatchAssessment partly = assess_plane(
      0,
      [](double x, double y) {
        return point(x < -1.0 / 6 ? x : x < 1.0 / 6 ? -1.0 / 3 - x : x - 2.0 / 3, y);
      },
      12);
  EXPECT_NEAR(partly.folded, 1.0 / 3, 0.03);
}

TEST(Assess, JumpsAreFound) {
  KILN_REQUIRE_DEVICE();
  const MatchAssessment a = assess_plane(
      0, [](double x, double y) { return point(x < 0 ? x : x + 0.3, y); }, 12);
  EXPECT_NEAR(a.largest_jump, 0.3 + 1.0 / kSize, 1e-5);
  EXPECT_NEAR(a.largest_step, 1.0 / kSize, 1e-6);
}

TEST(Assess, MissesAreLeftOut) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), big_triangle(0.25F));
  Match match = made_match(point);
  for (std::size_t i = 0; i < match.triangle.size() / 4; ++i) {
    match.triangle[i] = KILN_NO_TRIANGLE;
    match.status[i] = KILN_STATUS_MISS;
  }
  AssessOptions options;
  options.directions = 12;
  options.fields = true;
  const MatchAssessment a = assess(source, test::plane(1, 1), match, options);
  EXPECT_EQ(a.missed, kSize * kSize / 4);
  EXPECT_NEAR(a.match_distance.area, 0.75, 1e-6);
  EXPECT_EQ(a.fields.match_distance.pixels.front(), -1);
  EXPECT_EQ(a.fields.image_space.pixels.front(), -1);
  EXPECT_EQ(a.fields.stretch.pixels.front(), -64);
  EXPECT_NEAR(a.fields.match_distance.pixels.back(), 0.25, 1e-6);
}

TEST(Assess, WhatIsHiddenDoesNotCount) {
  KILN_REQUIRE_DEVICE();
  // A cube turned inside out: every face looks at others, and is seen from nowhere.
  Mesh inside = test::cube(1);
  for (auto* triangles : {&inside.triangles, &inside.uv_triangles, &inside.normal_triangles}) {
    for (Triangle& t : *triangles) std::swap(t[1], t[2]);
  }
  for (Vec3& n : inside.normals) n = {-n.x, -n.y, -n.z};
  const Source source(*test::device(), test::cube(0.98));
  BakeOptions bake_with;
  bake_with.width = bake_with.height = 64;
  bake_with.match.method = MatchMethod::closest;
  bake_with.match.two_sided = true;
  bake_with.report.keep_match = true;
  const BakeResult baked = bake(source, inside, bake_with);
  ASSERT_EQ(baked.report.missed, 0U);
  AssessOptions options;
  options.directions = 64;
  options.fields = true;
  const MatchAssessment a = assess(source, inside, *baked.match, options);
  EXPECT_NEAR(a.never_visible, 1, 0.02);
  EXPECT_GT(a.match_distance.mean, 0);
  // What no direction sees has no place in a picture: of the rest alone there are distances.
  EXPECT_NEAR(a.image_space_over_area.area, (1 - a.never_visible) * a.match_distance.area, 1e-6);
  EXPECT_TRUE(std::isfinite(a.image_space_over_area.mean));
  EXPECT_TRUE(std::isfinite(a.image_space_over_area.max));
  EXPECT_TRUE(std::isfinite(a.image_space.mean));
  std::size_t seen = 0;
  for (const float value : a.fields.image_space.pixels) {
    ASSERT_TRUE(std::isfinite(value));
    seen += value >= 0 ? 1 : 0;
  }
  EXPECT_LT(seen, a.samples / 20);
}

/// Shifts of 0.1, 0.2, 0.3 and 0.4 in 33, 27, 3 and 1 of 64 rows.
TEST(Assess, QuantilesAreOfAllPlaces) {
  KILN_REQUIRE_DEVICE();
  const MatchAssessment a = assess_plane(
      0,
      [](double x, double y) {
        const double row = (0.5 - y) * kSize;
        return point(x + (row < 33 ? 0.1 : row < 60 ? 0.2 : row < 63 ? 0.3 : 0.4), y);
      },
      12);
  constexpr double kRows = kSize;
  EXPECT_NEAR(a.match_distance.mean, (33 * 0.1 + 27 * 0.2 + 3 * 0.3 + 0.4) / kRows, 1e-6);
  EXPECT_NEAR(a.match_distance.rms, std::sqrt((33 * 0.01 + 27 * 0.04 + 3 * 0.09 + 0.16) / kRows),
              1e-6);
  EXPECT_NEAR(a.match_distance.median, 0.1, 1e-6);
  EXPECT_NEAR(a.match_distance.p95, 0.3, 1e-6);
  EXPECT_NEAR(a.match_distance.p99, 0.4, 1e-6);
  EXPECT_NEAR(a.match_distance.max, 0.4, 1e-6);
}

/// The right half of the texels lies on three quarters of the surface.
TEST(Assess, PlacesCountByTheirArea) {
  KILN_REQUIRE_DEVICE();
  Mesh low = test::plane(2, 1);
  for (Vec3& p : low.positions) {
    if (p.x > 0.1F) p.x = 1.5F;
  }
  const Source source(*test::device(), big_triangle(0));
  AssessOptions options;
  options.directions = 12;
  options.fields = true;
  const MatchAssessment a = assess(source, low, made_match([](double x, double y) {
                                     return x < 0 ? point(x + 0.1, y) : point(3 * x + 0.2, y);
                                   }),
                                   options);
  EXPECT_NEAR(a.match_distance.area, 2, 1e-5);
  EXPECT_NEAR(a.match_distance.mean, (0.5 * 0.1 + 1.5 * 0.2) / 2, 1e-5);
  EXPECT_NEAR(a.match_distance.rms, std::sqrt((0.5 * 0.01 + 1.5 * 0.04) / 2), 1e-5);
  EXPECT_NEAR(a.match_distance.median, 0.2, 1e-5);
  for (std::size_t i = 0; i < kSize * kSize; ++i) {
    ASSERT_NEAR(a.fields.match_distance.pixels[i], i % kSize < kSize / 2 ? 0.1 : 0.2, 1e-5) << i;
  }
}

// ---- by brute force -----------------------------------------------------------------------------

struct V {
  double x, y, z;
};
V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
V operator*(V a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot_of(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
V cross_of(V a, V b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
V vector_of(const Vec3& v) { return {v.x, v.y, v.z}; }

/// Moeller and Trumbore's test, both sides.
bool meets(V origin, V d, V a, V b, V c) {
  const V ab = b - a, ac = c - a;
  const V p = cross_of(d, ac);
  const double det = dot_of(ab, p);
  if (std::abs(det) < 1e-14) return false;
  const V s = origin - a;
  const double u = dot_of(s, p) / det;
  const V q = cross_of(s, ab);
  const double v = dot_of(d, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && dot_of(ac, q) / det > 1e-4;
}

TEST(Assess, AgreesWithBruteForceWhereThingsHideEachOther) {
  KILN_REQUIRE_DEVICE();
  // A torus hides parts of itself.
  Mesh low = test::torus(16, 8, 1, 0.6);
  // So that no texel's centre lies on an edge.
  for (Vec2& uv : low.uvs) uv = {uv.x * 0.97F + 0.0131F, uv.y * 0.97F + 0.0173F};
  const Mesh high = test::torus(48, 24, 1, 0.62);
  const Source source(*test::device(), high);
  BakeOptions bake_with;
  bake_with.width = bake_with.height = 24;
  bake_with.match.max_distance = Length::share(0.1);
  bake_with.report.keep_match = true;
  const BakeResult baked = bake(source, low, bake_with);
  AssessOptions options;
  options.directions = 40;
  options.fields = true;
  const MatchAssessment a = assess(source, low, *baked.match, options);
  ASSERT_EQ(a.missed, 0U);

  const std::vector<Vec3> directions = held_out_views(40, spread_views(12), 0.5);
  double plain = 0, plain_weight = 0, normalised = 0, area = 0;
  std::size_t compared = 0;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) {
      return vector_of(low.positions[low.triangles[t][k]]);
    };
    const auto uv = [&](std::size_t k) { return low.uvs[low.uv_triangles[t][k]]; };
    const V a0 = corner(0), ab = corner(1) - a0, ac = corner(2) - a0;
    const V n = cross_of(ab, ac);
    const double size = std::sqrt(dot_of(n, n));
    const double ux = uv(1).x - uv(0).x, uy = uv(1).y - uv(0).y;
    const double vx = uv(2).x - uv(0).x, vy = uv(2).y - uv(0).y;
    const double uv_size = ux * vy - uy * vx;
    for (std::uint32_t row = 0; row < 24; ++row) {
      for (std::uint32_t column = 0; column < 24; ++column) {
        const double px = (column + 0.5) / 24 - uv(0).x, py = 1 - (row + 0.5) / 24 - uv(0).y;
        const double u = (px * vy - py * vx) / uv_size, v = (ux * py - uy * px) / uv_size;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const std::size_t i = std::size_t{row} * 24 + column;
        const V p = a0 + ab * u + ac * v;
        const Match& match = *baked.match;
        const Triangle& h = high.triangles[match.triangle[i]];
        const V h0 = vector_of(high.positions[h[0]]);
        const V f = h0 + (vector_of(high.positions[h[1]]) - h0) * match.u[i] +
                    (vector_of(high.positions[h[2]]) - h0) * match.v[i];
        double weight = 0, sum = 0;
        for (const Vec3& direction : directions) {
          const V d = vector_of(direction);
          const double cosine = dot_of(n, d) / size;
          if (!(cosine > 0)) continue;
          bool hidden = false;
          for (const Triangle& other : low.triangles) {
            hidden = hidden ||
                     meets(p, d, vector_of(low.positions[other[0]]),
                           vector_of(low.positions[other[1]]), vector_of(low.positions[other[2]]));
          }
          if (hidden) continue;
          const V x = f - p;
          const V across = x - d * dot_of(x, d);
          weight += cosine;
          sum += cosine * std::sqrt(dot_of(across, across));
        }
        const double texel_area = size / std::abs(uv_size) / (24 * 24);
        plain += texel_area * sum;
        plain_weight += texel_area * weight;
        if (weight > 0) {
          normalised += texel_area * sum / weight;
          area += texel_area;
          EXPECT_NEAR(a.fields.image_space.pixels[i], sum / weight, 2e-4) << row << ' ' << column;
        }
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, a.samples);
  EXPECT_NEAR(a.image_space.mean, plain / plain_weight, 1e-4 * plain / plain_weight);
  EXPECT_NEAR(a.image_space_over_area.mean, normalised / area, 1e-4 * normalised / area);
}

TEST(Assess, RefusesWhatDoesNotFit) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), big_triangle(0));
  AssessOptions options;
  options.directions = 11;
  EXPECT_THROW(assess(source, test::plane(1, 1), made_match(point), options), Error);
  options.directions = 5000;
  EXPECT_THROW(assess(source, test::plane(1, 1), made_match(point), options), Error);
  options.directions = 12;
  Match match = made_match(point);
  match.source_triangles = 2;
  EXPECT_THROW(assess(source, test::plane(1, 1), match, options), Error);
  options.progress = [](double, std::string_view) { return false; };
  EXPECT_TRUE(assess(source, test::plane(1, 1), made_match(point), options).cancelled);
}

TEST(Assess, RaysAndNearestPointsDifferAsTheyShould) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("bunny_high.ply");
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Mesh low = load_mesh(*test::shared_data("bunny_low.obj"));
  const Source source(*test::device(), load_mesh(*test::shared_data("bunny_high.ply")));
  BakeOptions bake_with;
  bake_with.width = bake_with.height = 256;
  bake_with.report.keep_match = true;
  const BakeResult ray = bake(source, low, bake_with);
  bake_with.match.method = MatchMethod::closest;
  const BakeResult closest = bake(source, low, bake_with);
  AssessOptions options;
  options.directions = 64;
  const MatchAssessment a = assess(source, low, *ray.match, options);
  const MatchAssessment b = assess(source, low, *closest.match, options);
  // Nearest points are nearest, and rays sample more evenly and never fold where both find something.
  EXPECT_LT(b.match_distance.mean, a.match_distance.mean);
  EXPECT_LT(a.stretch.rms, b.stretch.rms);
}

}  // namespace
}  // namespace kiln

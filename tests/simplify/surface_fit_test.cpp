// Vertices moved so that faces lie on the high poly.
#include "simplify/surface_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "kiln/simplify.h"
#include "mesh/surface_distance.h"
#include "simplify/grid_cube.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// 20,000 faces, and 800 whose corners lie on the same surface.
struct Pair {
  Mesh dense = test::BumpySphere::dense(20000), low = test::BumpySphere::dense(800);
  std::vector<Vec3d> given, moved;
  std::vector<Quadric> planes;  ///< By vertex; empty: none hold it.

  Pair() {
    for (const Vec3& p : low.positions) given.push_back(to_double(p));
  }
  void fit() {
    moved = given;
    SurfaceFit(dense.positions, dense.triangles, false, [](const Vec3d& p) {
      return to_double(to_float(p));
    }).run(moved, low.triangles, {}, planes);
  }
  double distance(const std::vector<Vec3d>& points) const {
    std::vector<Vec3> floats;
    for (const Vec3d& p : points) floats.push_back(to_float(p));
    return one_sided_distance(dense.positions, dense.triangles,
                              SurfaceDistance(floats, low.triangles), 1 << 18)
        .root_mean_square;
  }
  Vec3d normal(const std::vector<Vec3d>& points, const Triangle& t) const {
    const Vec3d n = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
    return n * (1 / length(n));
  }
};

TEST(SurfaceFit, FacesComeNearerAndNoneTurnsFar) {
  Pair pair;
  pair.fit();
  EXPECT_LT(pair.distance(pair.moved), 0.6 * pair.distance(pair.given));
  for (const Triangle& t : pair.low.triangles) {
    EXPECT_GT(dot(pair.normal(pair.given, t), pair.normal(pair.moved, t)), 0.5);
  }
}

/// Each vertex meets three planes to rounding, or misses them by far.
TEST(SurfaceFit, PlanesThatAreMetHoldVertices) {
  const auto moved_by = [](double missed, bool held) {
    Pair pair;
    for (const Vec3d& p : pair.given) {
      if (!held) break;
      Quadric& corner = pair.planes.emplace_back();
      for (const Vec3d& normal : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
        corner.add_plane(normal, p + normal * missed, 1);
        corner.add_plane(normal, p - normal * missed, 1);
        corner.area += 2;
      }
    }
    pair.fit();
    double sum = 0;
    for (std::size_t v = 0; v < pair.given.size(); ++v)
      sum += length(pair.moved[v] - pair.given[v]);
    return sum;
  };
  const double free = moved_by(0, false);
  EXPECT_GT(free, 0);
  EXPECT_LT(moved_by(0, true), 0.5 * free);
  EXPECT_GT(moved_by(1, true), 0.9 * free);
}

TEST(SurfaceFit, OpenBordersStay) {
  Pair pair;
  pair.low.triangles.resize(pair.low.triangles.size() / 2);
  pair.fit();
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : pair.low.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[std::minmax({t[k], t[(k + 1) % 3]})];
  }
  std::size_t open = 0;
  for (const auto& [side, count] : sides) {
    if (count != 1) continue;
    ++open;
    for (const std::uint32_t v : {side.first, side.second}) {
      EXPECT_EQ(length(pair.moved[v] - pair.given[v]), 0);
    }
  }
  EXPECT_GT(open, 0u);
}

TEST(SurfaceFit, WhatFacesTheOtherWayPullsNothing) {
  Pair pair;
  for (Triangle& t : pair.dense.triangles) std::swap(t[1], t[2]);
  pair.fit();
  for (std::size_t v = 0; v < pair.given.size(); ++v) {
    EXPECT_EQ(length(pair.moved[v] - pair.given[v]), 0) << v;
  }
}

/// Its rounded edges are small, and most samples by area lie on its flats.
TEST(SurfaceFit, RoundedEdgesAreMet) {
  Mesh box = test::grid_cube(80);
  for (Vec3& p : box.positions) {
    constexpr float kRound = 0.025F;
    const auto inner = [](float x) { return std::clamp(x, kRound - 0.25F, 0.25F - kRound); };
    const Vec3d core = to_double(Vec3{inner(p.x), inner(p.y), inner(p.z)});
    const Vec3d out = to_double(p) - core;
    const Vec3d rounded = core + out * (double{kRound} / length(out));
    p = to_float({rounded.x, 0.7 * rounded.y, 0.4 * rounded.z});
  }
  SimplifyOptions options;
  options.faces = 1000;
  SimplifyReport report;
  simplify(box, options, &report);
  EXPECT_LE(report.faces, 1000U);
  EXPECT_LT(report.error, 0.001);
}

}  // namespace
}  // namespace kiln

// Presimplification of very high polys: what it may not leave, and what it leaves alone.
#include "simplify/presimplify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <vector>

#include "kiln/simplify.h"
#include "mesh/fans.h"
#include "mesh/surface_distance.h"
#include "simplify/grid_cube.h"
#include "simplify/simplify_job.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::size_t kGoal = 50'000;

/// Between 0 and 1.
double noise(std::uint32_t v) {
  v = (v ^ 61U ^ (v >> 16)) * 9U;
  v = (v ^ (v >> 4)) * 0x27d4eb2dU;
  return static_cast<double>((v ^ (v >> 15)) & 0xffffU) / 65535;
}

/// A sphere of 327,680 triangles, its radius off by up to `rough` of it at each vertex.
Work rough_sphere(double rough) {
  const Mesh sphere = test::icosphere(7);
  Work work;
  for (std::uint32_t v = 0; v < sphere.positions.size(); ++v) {
    work.points.push_back(to_double(sphere.positions[v]) * (0.28 * (1 + rough * noise(v))));
  }
  work.triangles = sphere.triangles;
  return work;
}

/// Triangles that face the middle.
std::size_t facing_in(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles) {
  std::size_t count = 0;
  for (const Triangle& t : triangles) {
    const Vec3d normal = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
    count += dot(normal, points[t[0]] + points[t[1]] + points[t[2]]) < 0;
  }
  return count;
}

std::size_t in_use(const std::vector<Triangle>& triangles) {
  std::set<std::uint32_t> used;
  for (const Triangle& t : triangles) used.insert(t.begin(), t.end());
  return used.size();
}

TEST(Presimplify, LeavesOnePartOfASphere) {
  for (const double rough : {0.01, 0.03, 0.1}) {
    Work work = rough_sphere(rough);
    presimplify(work, kGoal, 1, false, {});
    EXPECT_LT(work.triangles.size(), 1.3 * kGoal);
    EXPECT_EQ(count_components(work.triangles, work.points.size()), 1U);
    // Closed, without handles.
    EXPECT_EQ(in_use(work.triangles), work.triangles.size() / 2 + 2);
  }
}

/// Four triangles over four vertices.
std::vector<Triangle> tetrahedron(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                  std::uint32_t d) {
  return {{a, b, c}, {a, d, b}, {b, d, c}, {c, d, a}};
}

TEST(Presimplify, DropsPartsThatWereCutOff) {
  const std::vector<Triangle> sphere = test::icosphere(3).triangles;
  constexpr std::uint32_t kVertices = 642;
  std::vector<std::uint32_t> origin(kVertices);
  std::iota(origin.begin(), origin.end(), 0U);
  origin.insert(origin.end(), {5, 90});  // A cut made two vertices more.
  std::vector<Triangle> triangles = sphere;
  std::erase_if(
      triangles, [](const Triangle& t) {  // The small component's own vertices are no longer there.
        return std::ranges::any_of(t, [](std::uint32_t v) { return v == 300 || v == 301; });
      });
  const std::vector<Triangle> rest = triangles;
  for (const Triangle& t : tetrahedron(kVertices, kVertices + 1, 300, 301)) triangles.push_back(t);
  drop_small_components(triangles, sphere, origin, SideLists(sphere, kVertices));
  EXPECT_EQ(triangles, rest);
}

TEST(Presimplify, KeepsSmallPartsOfTheHighPoly) {
  // A tetrahedron that touches the sphere at vertex 5, where a cut takes them apart.
  std::vector<Triangle> dense = test::icosphere(3).triangles;
  for (const Triangle& t : tetrahedron(5, 642, 643, 644)) dense.push_back(t);
  std::vector<Triangle> triangles = test::icosphere(3).triangles;
  for (const Triangle& t : tetrahedron(645, 642, 643, 644)) triangles.push_back(t);
  std::vector<std::uint32_t> origin(645);
  std::iota(origin.begin(), origin.end(), 0U);
  origin.push_back(5);
  const std::vector<Triangle> all = triangles;
  drop_small_components(triangles, dense, origin, SideLists(dense, 645));
  EXPECT_EQ(triangles, all);
}

TEST(Presimplify, ItsFoldsAreTurnedBack) {
  Work work = rough_sphere(0.01);
  presimplify(work, kGoal, 1, false, {});
  const std::size_t before = facing_in(work.points, work.triangles);
  ASSERT_GT(before, 20U);
  const Mesh unit = test::icosphere(2);
  const SimplifyOptions options;
  const SimplifyState shrinking(work, nullptr, options, Scale(unit, unit.triangles));
  SimplifyResult after;
  shrinking.extract(after);
  EXPECT_GT(after.triangles.size(), work.triangles.size() * 9 / 10);
  EXPECT_LT(facing_in(after.points, after.triangles), before / 2);
}

TEST(Presimplify, LeavesNoSliversAcrossFlats) {
  Work work;
  const Mesh cube = test::grid_cube(170);
  for (const Vec3& p : cube.positions) work.points.push_back(to_double(p));
  work.triangles = cube.triangles;
  ASSERT_EQ(facing_in(work.points, work.triangles), 0U);
  presimplify(work, kGoal, 1, false, {});
  EXPECT_LT(work.triangles.size(), 1.3 * kGoal);
  std::vector<std::uint32_t> around(work.points.size(), 0);
  double longest = 0;
  for (const Triangle& t : work.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++around[t[k]];
      longest = std::max(longest, length(work.points[t[k]] - work.points[t[(k + 1) % 3]]));
    }
  }
  EXPECT_LT(*std::max_element(around.begin(), around.end()), 30U);
  EXPECT_LT(longest, 0.25);
}

TEST(Presimplify, IsForRoughMeshes) {
  EXPECT_FALSE(is_finely_curved(rough_sphere(0.03)));
  EXPECT_TRUE(is_finely_curved(rough_sphere(0)));
  Work flat;
  const Mesh cube = test::grid_cube(40);
  for (const Vec3& p : cube.positions) flat.points.push_back(to_double(p));
  flat.triangles = cube.triangles;
  EXPECT_TRUE(is_finely_curved(flat));
  flat.triangles.clear();
  EXPECT_FALSE(is_finely_curved(flat));
}

/// A smooth tube of 200,000 triangles: off by 0.47% of the diagonal, by 0.76% after presimplification.
TEST(Presimplify, IsLeftOutForFineTubes) {
  Mesh tube;
  constexpr std::uint32_t kRound = 500, kAlong = 200;
  constexpr double kTurn = 6.283185307179586;
  for (std::uint32_t j = 0; j <= kAlong; ++j) {
    for (std::uint32_t i = 0; i < kRound; ++i) {
      const double angle = kTurn * i / kRound, along = 4.0 * j / kAlong;
      const double radius = 1 + 0.2 * std::sin(2 * along);
      tube.positions.push_back(
          to_float({radius * std::cos(angle), along, radius * std::sin(angle)}));
    }
  }
  for (std::uint32_t j = 0; j < kAlong; ++j) {
    for (std::uint32_t i = 0; i < kRound; ++i) {
      const std::uint32_t next = (i + 1) % kRound;
      const std::uint32_t a = j * kRound + i, b = j * kRound + next;
      tube.triangles.push_back({a, a + kRound, b});
      tube.triangles.push_back({b, a + kRound, b + kRound});
    }
  }
  SimplifyOptions options;
  options.faces = 300;
  SimplifyReport report;
  simplify(tube, options, &report);
  EXPECT_LT(report.error, 0.006);
}

TEST(Presimplify, LeavesPlacesUntouched) {
  const Work dense = rough_sphere(0.01);
  Work work = dense;
  const std::vector<Ball> places{{{0.28, 0, 0}, 0.03}, {{0, -0.28, 0}, 0.02}};
  presimplify(work, kGoal, 1, false, places);
  const std::set<Triangle> left(work.triangles.begin(), work.triangles.end());
  std::size_t inside = 0;
  for (const Triangle& t : dense.triangles) {
    bool in = false;
    for (const Ball& place : places) {
      in = in || length(dense.points[t[0]] - place.center) < place.radius;
    }
    inside += in;
    if (in) EXPECT_TRUE(left.contains(t));
  }
  EXPECT_GT(inside, 100U);
  EXPECT_LT(work.triangles.size(), 1.3 * kGoal + static_cast<double>(inside));
}

/// Largest distance from points of a mesh to what presimplify() leaves of it.
double deviation_after(const Mesh& high, std::size_t goal) {
  Work work;
  for (const Vec3& p : high.positions) work.points.push_back(to_double(p) * 0.28);
  work.triangles = high.triangles;
  const std::vector<Vec3> points = to_floats(work.points);
  presimplify(work, goal, 1, false, {});
  EXPECT_LT(work.triangles.size(), 1.3 * static_cast<double>(goal));
  const std::vector<Vec3> left = to_floats(work.points);
  const SurfaceDistance surface(left, work.triangles);
  return one_sided_distance(points, high.triangles, surface, 1 << 18).largest;
}

/// From 1,000,000 triangles on, pieces are eight and not four, and along their borders lie as many triangles as the
/// goal has: as on the way from 4.5 million to 50,000.
TEST(Presimplify, KeepsReliefWherePiecesBecomeMore) {
  constexpr std::size_t kFew = 12'500;
  const double below = deviation_after(test::BumpySphere::dense(970'000), kFew);
  const double above = deviation_after(test::BumpySphere::dense(1'030'000), kFew);
  EXPECT_GT(below, 0);
  // Both are about as dense; with borders that fill the goal it is several times as far.
  EXPECT_LT(above, 1.3 * below);
}

TEST(Presimplify, TakesPiecesThatItKnows) {
  const Work dense = rough_sphere(0.01);
  const std::vector<Ball> places{
      {{0.163, 0.163, 0.163}, 0.03}};  // Halves along any axis meet elsewhere.
  PresimplifiedPieces known;
  Work first = dense;
  presimplify(first, kGoal, 1, false, {}, true, &known);
  ASSERT_EQ(known.size(), 2U);
  Work again = dense, anew = dense;
  presimplify(again, kGoal, 1, false, places, true, &known);
  presimplify(anew, kGoal, 1, false, places);
  EXPECT_EQ(again.triangles, anew.triangles);
  EXPECT_EQ(to_floats(again.points), to_floats(anew.points));
  // The piece without a place is not worked at again.
  for (std::vector<Triangle>& piece : known) piece.clear();
  Work without = dense;
  presimplify(without, kGoal, 1, false, places, false, &known);
  EXPECT_LT(without.triangles.size(), 0.7 * static_cast<double>(anew.triangles.size()));
}

TEST(Presimplify, LosesNoPart) {
  Work high = rough_sphere(0.03);
  constexpr std::uint32_t kParts = 20;
  for (std::uint32_t i = 0; i < kParts; ++i) {
    const auto first = static_cast<std::uint32_t>(high.points.size());
    const Vec3d p{0.4, 0.01 * i, 0};
    constexpr double kSmall = 1e-4;
    for (const Vec3d& d : {Vec3d{0, 0, 0}, {kSmall, 0, 0}, {0, kSmall, 0}, {0, 0, kSmall}}) {
      high.points.push_back(p + d);
    }
    for (const Triangle& t : tetrahedron(first, first + 2, first + 1, first + 3)) {
      high.triangles.push_back(t);
    }
  }
  Work kept = high, lost = high;
  presimplify(kept, kGoal, 1, false, {});
  EXPECT_EQ(count_components(kept.triangles, kept.points.size()), kParts + 1);
  EXPECT_LT(kept.triangles.size(), 1.3 * kGoal);
  presimplify(lost, kGoal, 1, false, {}, false);
  EXPECT_LT(count_components(lost.triangles, lost.points.size()), kParts + 1);
}

}  // namespace
}  // namespace kiln

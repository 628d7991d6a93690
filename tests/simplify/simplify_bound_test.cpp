// simplify() with a bound: fewer faces than by count, never beyond it, under all rules.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "kiln/simplify.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "simplify/collapse.h"
#include "support/shapes.h"

namespace kiln {
namespace {

bool warns(const SimplifyReport& report, const std::string& code) {
  return std::any_of(report.warnings.begin(), report.warnings.end(),
                     [&](const Warning& w) { return w.code == code; });
}

std::uint64_t flaws(const SimplifyReport& report) {
  return report.folded + report.without_area + report.holes;
}

double diagonal(const Mesh& mesh) {
  Vec3 low = mesh.positions.front(), high = low;
  for (const Vec3& p : mesh.positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return length(to_double(high) - to_double(low));
}

/// Deviation of a low poly from its high poly, at many points of each triangle; a share of the diagonal.
double strays(const Mesh& low, const Mesh& high) {
  constexpr int kSteps = 8;
  const SurfaceDistance surface(high.positions, high.triangles);
  double most = 0;
  for (const Triangle& t : low.triangles) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int k = 0; i + k <= kSteps; ++k) {
        const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(k) / kSteps;
        const Vec3d p = to_double(low.positions[t[0]]) * (1 - u - v) +
                        to_double(low.positions[t[1]]) * u + to_double(low.positions[t[2]]) * v;
        most = std::max(most, surface.squared(to_float(p)));
      }
    }
  }
  return std::sqrt(most) / diagonal(high);
}

/// True if a low poly of fewer faces, made by their count, is within the bound both ways.
bool fewer_do(const Mesh& high, SimplifyOptions options, std::uint64_t faces) {
  if (faces < 2) return false;
  options.faces = static_cast<std::uint32_t>(faces - 1);
  SimplifyReport report;
  const Mesh low = simplify(high, options, &report);
  return low.triangles.size() < faces && report.error <= options.max_error &&
         strays(low, high) <= options.max_error;
}

/// A sphere with waves, steep in one place and small all around.
Mesh with_a_steep_place() {
  Mesh mesh = test::icosphere(5);
  for (Vec3& p : mesh.positions) {
    const double near = std::exp(-40 * ((p.x - 1) * (p.x - 1) + p.y * p.y + p.z * p.z));
    const double r = 1 + 0.004 * std::sin(20 * p.y) * std::sin(20 * p.z) + 0.5 * near;
    p = to_float(to_double(p) * r);
  }
  return mesh;
}

/// Hills over the unit square, above which they are a height field.
Mesh hills() {
  Mesh mesh = test::plane(70, 70);
  for (Vec3& p : mesh.positions) {
    p.z = static_cast<float>(0.05 * std::sin(9 * p.x) * std::cos(7 * p.y) +
                             0.01 * std::sin(40 * p.x + 3 * p.y));
  }
  return mesh;
}

TEST(SimplifyBound, FewerFacesByCountAreBeyondIt) {
  const std::vector<Mesh> meshes{test::BumpySphere::dense(2000), with_a_steep_place(),
                                 test::torus(60, 40), test::cube(1, 0.05), hills()};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    for (const double bound : {0.001, 0.02}) {
      SimplifyReport report;
      simplify(meshes[i], {.max_error = bound}, &report);
      EXPECT_LE(report.error, bound) << i;
      EXPECT_EQ(flaws(report), 0U) << i;
      EXPECT_FALSE(fewer_do(meshes[i], {.max_error = bound}, report.faces)) << i << ' ' << bound;
    }
  }
}

/// A wire that is thinner than the bound: vertices far outside of it would be no farther from any of its points.
TEST(SimplifyBound, ThinWiresDoNotGrowThick) {
  const Mesh wire = test::torus(400, 12, 1, 0.02);
  for (const double bound : {0.002, 0.005, 0.01}) {
    SimplifyReport report;
    const Mesh low = simplify(wire, {.max_error = bound}, &report);
    EXPECT_LT(low.triangles.size(), wire.triangles.size() / 8) << bound;
    EXPECT_LE(report.error, bound);
    EXPECT_LE(report.back_error, bound);
    // Between the points that are bounded, a little more.
    const double found = strays(low, wire);
    EXPECT_LE(found, 1.2 * bound);
    EXPECT_GE(1.2 * report.back_error, found);
  }
  SimplifyReport report;
  simplify(wire, {.faces = 500}, &report);
  EXPECT_EQ(report.back_error, 0) << "measured with a bound alone";
}

/// The needs of one steep place say nothing of the others.
TEST(SimplifyBound, OnePlaceDoesNotStopTheOthers) {
  const Mesh high = with_a_steep_place();
  SimplifyReport report;
  const Mesh low = simplify(high, {.max_error = 0.005}, &report);
  const auto far = std::count_if(low.positions.begin(), low.positions.end(),
                                 [](const Vec3& p) { return p.x < 0; });
  EXPECT_LT(far, 80);  // Measured: 52, of 5,000.
  EXPECT_GT(far, 10);
}

TEST(SimplifyBound, FewerFacesUnderRulesAreBeyondIt) {
  Mesh with_uvs = hills();
  ASSERT_FALSE(with_uvs.uvs.empty());
  const Mesh closed = test::BumpySphere::dense(6000);
  struct Case {
    const Mesh& high;
    SimplifyOptions options;
  };
  const Case cases[] = {{with_uvs, {.max_error = 0.004, .keep_uvs = true}},
                        {with_uvs, {.max_error = 0.004, .height_field = true}},
                        {closed, {.max_error = 0.01, .hull = true}}};
  for (const Case& c : cases) {
    SimplifyReport report;
    const Mesh low = simplify(c.high, c.options, &report);
    EXPECT_LE(report.error, c.options.max_error);
    EXPECT_EQ(flaws(report), 0U);
    EXPECT_FALSE(fewer_do(c.high, c.options, report.faces));
    EXPECT_EQ(low.uvs.empty(), !c.options.keep_uvs);
  }
}

/// Dense meshes are brought down first. The bound holds for the mesh that was given, not for what that leaves, which is
/// off itself.
TEST(SimplifyBound, HoldsForTheHighPolyAfterPresimplification) {
  constexpr double kBound = 0.01;
  const Mesh high = test::BumpySphere::dense(101'000);
  SimplifyReport report;
  const Mesh low = simplify(high, {.max_error = kBound}, &report);
  EXPECT_LE(report.error, kBound);
  EXPECT_LE(strays(low, high), 1.1 * kBound);
  EXPECT_EQ(flaws(report), 0U);
  EXPECT_LT(
      report.faces,
      100U);  // Measured: 88; of the same shape with 60,000 faces, which has no presimplification: 86.
}

TEST(SimplifyBound, TinyBoundsKeepAllButFlatPlaces) {
  SimplifyReport report;
  const Mesh round = test::icosphere(3);
  EXPECT_EQ(simplify(round, {.max_error = 1e-9}, &report).triangles.size(), round.triangles.size());
  EXPECT_TRUE(warns(report, "all-faces-kept"));
  EXPECT_EQ(report.error, 0);
  EXPECT_EQ(simplify(test::plane(30, 30), {.max_error = 1e-5}, &report).triangles.size(), 2U);
  EXPECT_TRUE(report.warnings.empty());
}

TEST(SimplifyBound, HugeBoundsLeaveWhatTopologyNeeds) {
  SimplifyReport report;
  EXPECT_EQ(simplify(test::icosphere(3), {.max_error = 1}, &report).triangles.size(), 4U);
  EXPECT_TRUE(report.warnings.empty());
  const Mesh ring = simplify(test::torus(60, 40), {.max_error = 1}, &report);
  EXPECT_LE(ring.triangles.size(), 30U);  // No torus has fewer than 14.
  EXPECT_EQ(ring.positions.size() * 2, ring.triangles.size());
  EXPECT_EQ(simplify(test::plane(9, 9), {.max_error = 1}, &report).triangles.size(), 1U);
  EXPECT_TRUE(warns(report, "one-triangle"));
  // Triangles that touch nowhere are a part each.
  const Mesh soup = test::random_soup(500, 7);
  EXPECT_EQ(simplify(soup, {.max_error = 1}, &report).triangles.size(), soup.triangles.size());
  EXPECT_TRUE(warns(report, "all-faces-kept"));
}

TEST(SimplifyBound, OneTriangleIsKeptAndSaid) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  SimplifyReport report;
  EXPECT_EQ(simplify(mesh, {.max_error = 0.01}, &report).triangles.size(), 1U);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_EQ(report.warnings[0].message.text(), "the mesh has only one usable face, which was kept");
}

/// After collapses and moves, no sample is beyond the bound; without the bound, some are.
TEST(DeviationBound, HoldsEverySample) {
  Mesh dense = test::icosphere(4);
  for (Vec3& p : dense.positions) p = to_float(to_double(p) * 0.28);
  std::vector<Vec3d> points;
  for (const Vec3& p : dense.positions) points.push_back(to_double(p));
  const DeviationSamples samples(dense.positions, dense.triangles, 1 << 18);
  EXPECT_EQ(samples.points.size(), dense.positions.size() + dense.triangles.size());
  const double bound = 0.004;
  const auto measured = [&](const CollapseMesh& mesh) {
    std::vector<Vec3d> left;
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> sources;
    mesh.extract(left, triangles, sources);
    std::vector<Vec3> floats(left.size());
    std::transform(left.begin(), left.end(), floats.begin(), to_float);
    return one_sided_distance(dense.positions, dense.triangles, SurfaceDistance(floats, triangles),
                              1 << 18);
  };
  CollapseMesh mesh(points, dense.triangles), free(points, dense.triangles);
  EdgeCollapser collapser(mesh), unbounded(free);
  DeviationBound limit(mesh, samples, bound, true);
  EXPECT_TRUE(limit.was_within_bound());
  collapser.limit_deviation(&limit, 0, bound);
  collapser.run(0);
  EXPECT_TRUE(limit.has_rejected_collapse());
  const std::size_t before = mesh.faces;
  EXPECT_LT(before, 320U);  // Measured: 304.
  EXPECT_LE(measured(mesh).largest, bound * (1 + 1e-6));
  EXPECT_GT(measured(mesh).largest, 0.9 * bound);
  const double mean = measured(mesh).mean;
  for (int i = 0; i < 3; ++i) collapser.relax(DistanceNorm::all);
  EXPECT_LE(measured(mesh).largest, bound * (1 + 1e-6));
  EXPECT_LT(measured(mesh).mean, mean);
  unbounded.run(before);
  EXPECT_GT(measured(free).largest, bound);
  // A closer bound somewhere keeps triangles there.
  CollapseMesh close(points, dense.triangles);
  EdgeCollapser closer(close);
  DeviationBound narrow(close, samples, bound, true);
  const Ball place{{0.28, 0, 0}, 0.1};
  narrow.tighten_limits({&place, 1});
  closer.limit_deviation(&narrow, 0, bound);
  closer.run(0);
  EXPECT_GT(close.faces, before);
}

}  // namespace
}  // namespace kiln

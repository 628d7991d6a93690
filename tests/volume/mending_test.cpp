// Low polys from volumes: no folds, no triangles without area, no closed gaps. Held against the full contour by brute
// force.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "kiln/contour.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/mesh_check.h"
#include "support/volumes.h"

namespace kiln {
namespace {

Vec3d normal_of(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
              c = to_double(mesh.positions[t[2]]);
  const Vec3d normal = cross(b - a, c - a);
  const double size = length(normal);
  return size > 0 ? normal * (1 / size) : Vec3d{};
}

/// Triangles whose normal turns far from a neighbour's.
std::vector<std::uint32_t> bent_back(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> edges;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      edges[std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3])].push_back(t);
    }
  }
  std::vector<std::uint32_t> found;
  for (const auto& [ends, of] : edges) {
    for (std::size_t i = 1; i < of.size(); ++i) {
      const Vec3d a = normal_of(mesh, mesh.triangles[of[i - 1]]);
      if (dot(a, normal_of(mesh, mesh.triangles[of[i]])) > -0.9) continue;
      found.insert(found.end(), {of[i - 1], of[i]});
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

/// Number of triangles that face away from the full contour: on average, at the nearest of its vertices.
std::size_t count_folded(const Mesh& low, const Mesh& full) {
  constexpr int kSteps = 5;
  std::size_t count = 0;
  for (const std::uint32_t t : bent_back(low)) {
    const Triangle& v = low.triangles[t];
    const Vec3d normal = normal_of(low, v);
    const std::array<Vec3d, 3> p = {to_double(low.positions[v[0]]), to_double(low.positions[v[1]]),
                                    to_double(low.positions[v[2]])};
    double sum = 0;
    int points = 0;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; i + j < kSteps; ++j) {
        const double a = (i + 1.0 / 3) / kSteps, b = (j + 1.0 / 3) / kSteps;
        const Vec3d at = p[0] * (1 - a - b) + p[1] * a + p[2] * b;
        double nearest = 1e30;
        std::size_t best = 0;
        for (std::size_t k = 0; k < full.positions.size(); ++k) {
          const Vec3d d = to_double(full.positions[k]) - at;
          if (dot(d, d) < nearest) nearest = dot(d, d), best = k;
        }
        sum += dot(normal, to_double(full.normals[best]));
        ++points;
      }
    }
    count += sum < -0.7 * points;
  }
  return count;
}

std::size_t count_without_area(const Mesh& mesh) {
  return static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                    [&](const Triangle& t) { return !(length(normal_of(mesh, t)) > 0); }));
}

/// Triangles that have the corners of an earlier one.
std::size_t count_repeated(const Mesh& mesh) {
  std::vector<Triangle> sorted = mesh.triangles;
  for (Triangle& t : sorted) std::sort(t.begin(), t.end());
  std::sort(sorted.begin(), sorted.end());
  const auto last = std::unique(sorted.begin(), sorted.end());
  return static_cast<std::size_t>(sorted.end() - last);
}

std::uint64_t count_of(const ExtractReport& report, const char* code) {
  for (const Warning& warning : report.warnings) {
    if (warning.code == code) return warning.count;
  }
  return 0;
}

TEST(VolumeMending, HeadHasNoFolds) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("head_t1.nrrd");
  const Volume volume = load_volume(*test::shared_data("head_t1.nrrd"));
  ExtractOptions options;
  options.contour = {.iso = 40, .outer_only = true, .outer_gap = 2};
  const Mesh full = contour(*test::device(), volume, options.contour);
  for (const UnwrapMethod unwrap : {UnwrapMethod::pairs, UnwrapMethod::charts}) {
    options.faces = 3000;
    options.unwrap = unwrap;
    const ExtractResult result = extract(*test::device(), volume, options);
    EXPECT_EQ(count_folded(result.mesh, full), 0U);
    EXPECT_EQ(count_without_area(result.mesh), 0U);
    EXPECT_GT(result.report.mended, 5U);
    EXPECT_EQ(result.report.folded + result.report.without_area + result.report.repeated, 0U);
    EXPECT_TRUE(test::topology(result.mesh).is_closed_manifold());
    EXPECT_EQ(test::topology(result.mesh).euler, 2);
    EXPECT_EQ(test::broken_promise(result.mesh), "");
    EXPECT_EQ(result.mesh.triangles.size(), result.report.faces);
  }
}

/// A thin sheet along a gyroid.
Volume sheet(std::uint32_t side) {
  return test::make_float_volume({side, side, side}, [](double x, double y, double z) {
    return 0.25 - std::abs(test::gyroid_field(x, y, z, 24));
  });
}

ExtractOptions freely(std::uint32_t faces) {
  ExtractOptions options;
  options.faces = faces;
  options.size = 256;
  options.keep_topology = false;
  return options;
}

TEST(VolumeMending, BytesAreTheSameOnAnyThreads) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = sheet(64);
  const ExtractOptions options = freely(3000);
  const ExtractResult a = extract(*test::device(), volume, options);
  setenv("KILN_THREADS", "1", 1);
  const ExtractResult b = extract(*test::device(), volume, options);
  unsetenv("KILN_THREADS");
  EXPECT_GT(a.report.mended, 0U);
  EXPECT_EQ(a.mesh.positions, b.mesh.positions);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.normal_map.pixels, b.normal_map.pixels);
}

/// Thin walls with few faces: sheets become one, across gaps and across walls.
TEST(VolumeMending, ClosedGapsAreLeftOutAndTheRestIsCounted) {
  KILN_REQUIRE_DEVICE();
  const ExtractResult result = extract(*test::device(), sheet(96), freely(2000));
  const ExtractReport& report = result.report;
  EXPECT_GT(report.left_out, 50U);
  EXPECT_EQ(count_repeated(result.mesh), report.repeated);
  EXPECT_EQ(count_of(report, "repeated-triangles"), report.repeated);
  EXPECT_EQ(count_of(report, "folded-triangles"), report.folded);
  EXPECT_GT(report.mended, report.folded);
  EXPECT_EQ(count_without_area(result.mesh), report.without_area);
  EXPECT_EQ(result.mesh.triangles.size(), report.faces);
  const test::Topology t = test::topology(result.mesh);
  EXPECT_EQ(t.border_edges + t.inconsistent_edges, 0U);
}

}  // namespace
}  // namespace kiln

// Borders between materials, groups and objects: lines that a low poly holds.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "kiln/simplify.h"
#include "simplify/presimplify.h"
#include "simplify/simplify_levels.h"
#include "simplify/surface_fit.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using LabelAt = std::function<std::uint32_t(const Vec3d&)>;

std::array<Vec3d, 3> corners_of(const Mesh& mesh, std::size_t t) {
  std::array<Vec3d, 3> p{};
  for (std::size_t k = 0; k < 3; ++k) p[k] = to_double(mesh.positions[mesh.triangles[t][k]]);
  return p;
}

Mesh with_materials(Mesh mesh, const LabelAt& label, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    mesh.material_names.push_back("material " + std::to_string(i));
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = corners_of(mesh, t);
    mesh.materials.push_back(label((a + b + c) * (1.0 / 3)));
  }
  return mesh;
}

/// Share of a mesh's area that has another material than its place says.
double wrong_share(const Mesh& mesh, const LabelAt& label) {
  constexpr int kSteps = 12;
  double wrong = 0, all = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = corners_of(mesh, t);
    const double area = length(cross(b - a, c - a)) / (kSteps * kSteps);
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < 2 * (kSteps - i) - 1; ++j) {
        // Middles of the small triangles of a row.
        const double u = (i + (j % 2 == 0 ? 1.0 : 2.0) / 3) / kSteps;
        const double v = (j / 2 + (j % 2 == 0 ? 1.0 : 2.0) / 3) / kSteps;
        all += area;
        if (label(a + (b - a) * u + (c - a) * v) != mesh.materials.at(t)) wrong += area;
      }
    }
  }
  return wrong / all;
}

std::uint32_t disc(const Vec3d& p) { return std::hypot(p.x, p.y) < 0.3 ? 1 : 0; }
std::uint32_t stripes(const Vec3d& p) {
  return static_cast<std::uint32_t>(std::floor(8 * p.x + 3 * p.y + 20)) % 2;
}
std::uint32_t thirds(const Vec3d& p) { return p.y > 0.2 ? 0 : p.x > p.z ? 1 : 2; }

TEST(LabelBorders, OfADiscInAPlaneAreALine) {
  const Mesh high = with_materials(test::plane(100, 100), disc, 2);
  for (const std::uint32_t faces : {100U, 500U, 2000U}) {
    const Mesh low = simplify(high, {.faces = faces});
    EXPECT_LE(low.triangles.size(), faces);
    // 0.4% of the dense disc are steps. By a vote of places, 1.5% to 4% went to the wrong side.
    EXPECT_LT(wrong_share(low, disc), 0.007) << faces;
    EXPECT_EQ(low.material_names, high.material_names);
  }
}

TEST(LabelBorders, OfStripesAreLines) {
  const Mesh high = with_materials(test::plane(100, 100), stripes, 2);
  EXPECT_LT(wrong_share(simplify(high, {.faces = 400}), stripes), 0.02);
}

TEST(LabelBorders, MeetOnACurvedSurface) {
  const Mesh high = with_materials(test::BumpySphere::dense(20000), thirds, 3);
  EXPECT_LT(wrong_share(simplify(high, {.faces = 300}), thirds), 0.02);
  EXPECT_LT(wrong_share(simplify(high, {.faces = 2000}), thirds), 0.01);
  EXPECT_LT(wrong_share(simplify(high, {.faces = 1000, .hull = true}), thirds), 0.012);
  // The purpose of materials does not matter.
  Mesh grouped = high, apart = high;
  grouped.groups = std::exchange(grouped.materials, {});
  grouped.group_names = std::exchange(grouped.material_names, {});
  apart.objects = std::exchange(apart.materials, {});
  apart.object_names = std::exchange(apart.material_names, {});
  const Mesh low = simplify(high, {.faces = 500});
  EXPECT_EQ(simplify(grouped, {.faces = 500}).groups, low.materials);
  EXPECT_EQ(simplify(apart, {.faces = 500}).objects, low.materials);
}

TEST(LabelBorders, AreLinesInAllLevels) {
  const Mesh high = with_materials(test::BumpySphere::dense(20000), thirds, 3);
  const std::vector<std::uint32_t> faces{4000, 1000, 300};
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    EXPECT_LT(wrong_share(levels.mesh(i), thirds), 0.02) << i;
  }
}

TEST(LabelBorders, AreNotLostByABound) {
  const Mesh high = with_materials(test::plane(100, 100), disc, 2);
  const Mesh low = simplify(high, {.max_error = 0.002});
  EXPECT_LT(low.triangles.size(), 400U);
  EXPECT_LT(wrong_share(low, disc), 0.04);  // A plane was two triangles of one material: 28%.
}

/// If triangles have labels of their own everywhere, nothing can hold them all.
TEST(LabelBorders, EverywhereGiveWayToTheShape) {
  const Mesh plain = test::BumpySphere::dense(20000);
  std::uint32_t next = 0;
  const Mesh high = with_materials(
      plain, [&](const Vec3d&) { return next++; }, 20000);
  SimplifyReport report, of_plain;
  const Mesh low = simplify(high, {.faces = 500}, &report);
  simplify(plain, {.faces = 500}, &of_plain);
  EXPECT_LE(low.triangles.size(), 500U);
  EXPECT_LT(report.mean_error, 1.05 * of_plain.mean_error);
  EXPECT_EQ(low.materials.size(), low.triangles.size());
}

TEST(LabelBorders, ThatAreNoneChangeNothing) {
  const Mesh plain = test::BumpySphere::dense(20000);
  const Mesh one = with_materials(
      plain, [](const Vec3d&) { return 0U; }, 1);
  EXPECT_EQ(simplify(one, {.faces = 500}).positions, simplify(plain, {.faces = 500}).positions);
}

/// A sphere of 327,680 triangles.
Work labelled_sphere(const LabelAt& label) {
  const Mesh sphere = test::icosphere(7);
  Work work;
  for (const Vec3& p : sphere.positions) work.points.push_back(to_double(p) * 0.28);
  work.triangles = sphere.triangles;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    const auto [a, b, c] = corners_of(sphere, t);
    work.labels.push_back(label(a + b + c));
  }
  return work;
}

TEST(LabelBorders, OutlivePresimplification) {
  const Work dense = labelled_sphere(thirds);
  Work work = dense;
  presimplify(work, 50'000, 1, false, {});
  EXPECT_LT(work.triangles.size(), 65'000U);
  ASSERT_EQ(work.labels.size(), work.triangles.size());
  // Vertices on borders were on them, and corners of three stay.
  const auto labels_around = [](const Work& of) {
    std::vector<std::set<std::uint32_t>> labels(of.points.size());
    for (std::size_t t = 0; t < of.triangles.size(); ++t) {
      for (const std::uint32_t v : of.triangles[t]) labels[v].insert(of.labels[t]);
    }
    return labels;
  };
  const auto before = labels_around(dense), after = labels_around(work);
  std::size_t on_line = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    if (before[v].size() > 2) EXPECT_EQ(after[v], before[v]);
    if (after[v].size() < 2) continue;
    ++on_line;
    EXPECT_EQ(after[v], before[v]);
  }
  EXPECT_GT(on_line, 100U);
}

TEST(LabelBorders, EverywhereDoNotStopPresimplification) {
  std::uint32_t next = 0;
  Work work = labelled_sphere([&](const Vec3d&) { return next++; });
  presimplify(work, 50'000, 1, false, {});
  EXPECT_LT(work.triangles.size(), 65'000U);
  EXPECT_TRUE(work.labels.empty());  // A vote decides.
}

/// Way that vertices of a border went along the surface.
TEST(LabelBorders, StayWhereVerticesAreFitted) {
  const Mesh dense = test::BumpySphere::dense(20000);
  const Mesh low = with_materials(test::BumpySphere::dense(800), thirds, 3);
  std::vector<std::set<std::uint32_t>> around(low.positions.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (const std::uint32_t v : low.triangles[t]) around[v].insert(low.materials[t]);
  }
  const auto strayed = [&](const std::vector<std::uint32_t>& labels) {
    std::vector<Vec3d> points;
    for (const Vec3& p : low.positions) points.push_back(to_double(p));
    SurfaceFit(dense.positions, dense.triangles, false, [](const Vec3d& p) {
      return p;
    }).run(points, low.triangles, labels, {});
    double sum = 0;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (around[v].size() < 2) continue;
      const Vec3d from = to_double(low.positions[v]), way = points[v] - from;
      sum += length(way - from * (dot(way, from) / dot(from, from)));
    }
    return sum;
  };
  EXPECT_LT(strayed(low.materials), 0.5 * strayed({}));
}

}  // namespace
}  // namespace kiln

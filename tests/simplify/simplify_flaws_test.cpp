// Folds, triangles without area, and height fields that face down: found, mended, counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kiln/height_field.h"
#include "kiln/map.h"
#include "kiln/simplify.h"
#include "mesh/weld.h"
#include "simplify/collapse.h"
#include "simplify/simplify_check.h"
#include "support/shapes.h"

namespace kiln {
namespace {

std::vector<Vec3d> doubles(const std::vector<Vec3>& points) {
  std::vector<Vec3d> result;
  for (const Vec3& p : points) result.push_back(to_double(p));
  return result;
}

/// A mesh of diagonal 1.
Mesh shrunk(Mesh mesh, float factor) {
  for (Vec3& p : mesh.positions) p = {p.x * factor, p.y * factor, p.z * factor};
  return mesh;
}

struct Pulled {
  Mesh dense = shrunk(test::icosphere(5), 0.28F);
  Mesh light = shrunk(test::icosphere(3), 0.28F);
  std::vector<Vec3d> points;

  /// The low poly with one vertex pulled along the sphere over its neighbours.
  explicit Pulled(std::uint32_t vertex) : points(doubles(light.positions)) {
    std::uint32_t neighbour = vertex;
    for (const Triangle& t : light.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (t[k] == vertex) neighbour = t[(k + 1) % 3];
      }
    }
    const Vec3d step = points[neighbour] - points[vertex];
    const Vec3d far = points[vertex] + step * 1.6;
    points[vertex] = far * (0.28 / length(far));
  }

  Vec3d normal(std::uint32_t t) const {
    const Triangle& v = light.triangles[t];
    return cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]);
  }
};

TEST(SimplifyFlaws, ASphereHasNone) {
  const Mesh dense = shrunk(test::icosphere(5), 0.28F), light = shrunk(test::icosphere(2), 0.28F);
  SimplifyCheck check(dense.positions, dense.triangles, false);
  EXPECT_TRUE(check.find(doubles(light.positions), light.triangles).none());
}

TEST(SimplifyFlaws, AVertexPulledOverItsNeighboursFoldsTriangles) {
  for (const std::uint32_t vertex : {0U, 17U, 200U, 411U}) {
    const Pulled scene(vertex);
    SimplifyCheck check(scene.dense.positions, scene.dense.triangles, false);
    const Flaws flaws = check.find(scene.points, scene.light.triangles);
    // The oracle: triangles around it whose normal points into the sphere.
    std::vector<std::uint32_t> expected;
    for (std::uint32_t t = 0; t < scene.light.triangles.size(); ++t) {
      const Triangle& v = scene.light.triangles[t];
      const Vec3d middle = scene.points[v[0]] + scene.points[v[1]] + scene.points[v[2]];
      if (dot(scene.normal(t), middle) < 0) expected.push_back(t);
    }
    EXPECT_FALSE(expected.empty());
    EXPECT_TRUE(std::ranges::includes(flaws.folded, expected));
    // All else that is found lies back to back with one of these.
    for (const std::uint32_t t : flaws.folded) {
      const auto back_to_back = [&](std::uint32_t other) {
        const Triangle &a = scene.light.triangles[t], &b = scene.light.triangles[other];
        const auto common = std::ranges::count_if(
            a, [&](std::uint32_t v) { return std::ranges::find(b, v) != b.end(); });
        const Vec3d n = scene.normal(t), m = scene.normal(other);
        return common == 2 && dot(n, m) < -0.98 * length(n) * length(m);
      };
      EXPECT_TRUE(std::ranges::binary_search(expected, t) ||
                  std::ranges::any_of(expected, back_to_back))
          << t;
    }
  }
}

/// Looks after the first keep what it loaded of the high poly where that serves.
TEST(SimplifyFlaws, ALookFindsTheSameWhateverWasLookedAtBefore) {
  const Pulled first(17);
  SimplifyCheck check(first.dense.positions, first.dense.triangles, false);
  check.find(first.points, first.light.triangles);
  std::size_t folded = 0;
  for (const std::uint32_t vertex : {17U, 18U, 200U, 17U, 411U}) {
    const Pulled scene(vertex);
    SimplifyCheck fresh(first.dense.positions, first.dense.triangles, false);
    const Flaws expected = fresh.find(scene.points, scene.light.triangles);
    EXPECT_EQ(check.find(scene.points, scene.light.triangles).folded, expected.folded) << vertex;
    folded += expected.folded.size();
  }
  EXPECT_GT(folded, 5U);
}

TEST(SimplifyFlaws, AThinPlateHasSharpEdgesButNoFold) {
  // Two sides of a plate 0.002 thick, whose rim the low poly leaves out.
  const auto plate = [](std::uint32_t n, double rim) {
    Mesh mesh;
    for (std::uint32_t side = 0; side < 2; ++side) {
      const Mesh plane = test::plane(n, n, 0.7, 0.7);
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (Vec3 p : plane.positions) {
        const bool inside = std::max(std::abs(p.x), std::abs(p.y)) < 0.349F;
        p.z = static_cast<float>((side == 0 ? 1 : -1) * (inside ? 0.001 : rim));
        mesh.positions.push_back(p);
      }
      for (Triangle t : plane.triangles) {
        if (side == 1) std::swap(t[1], t[2]);
        mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      }
    }
    return mesh;
  };
  const Mesh dense = plate(40, 0.0005);
  Mesh light = plate(4, 0);
  const std::vector<std::uint32_t> welded = weld_vertices(light.positions);
  for (Triangle& t : light.triangles) t = {welded[t[0]], welded[t[1]], welded[t[2]]};
  EXPECT_EQ(count_rims(light.triangles, light.positions.size()), 0U);
  SimplifyCheck check(dense.positions, dense.triangles, false);
  EXPECT_TRUE(check.find(doubles(light.positions), light.triangles).folded.empty());
}

/// Half a sphere of radius 0.33, 0.002 thick, open upwards.
Mesh bowl(std::uint32_t slices, std::uint32_t rings) {
  Mesh mesh;
  const std::uint32_t rows =
      2 * rings;  // From beside the outer pole up to the rim, and down again inside.
  for (std::uint32_t row = 0; row < rows; ++row) {
    const bool inside = row >= rings;
    const double angle = (inside ? rows - row : row + 1) * (std::acos(0.0) / rings);
    const double radius = inside ? 0.328 : 0.33;
    for (std::uint32_t i = 0; i < slices; ++i) {
      const double turn = i * (4 * std::acos(0.0) / slices);
      mesh.positions.push_back(
          to_float({radius * std::sin(angle) * std::cos(turn),
                    radius * std::sin(angle) * std::sin(turn), -radius * std::cos(angle)}));
    }
  }
  const std::uint32_t outer = rows * slices, inner = outer + 1;
  mesh.positions.push_back({0, 0, -0.33F});
  mesh.positions.push_back({0, 0, -0.328F});
  for (std::uint32_t i = 0; i < slices; ++i) {
    const std::uint32_t next = (i + 1) % slices, last = (rows - 1) * slices;
    mesh.triangles.push_back({outer, next, i});
    mesh.triangles.push_back({inner, last + i, last + next});
    for (std::uint32_t row = 0; row + 1 < rows; ++row) {
      const std::uint32_t below = row * slices, above = below + slices;
      mesh.triangles.push_back({below + i, below + next, above + next});
      mesh.triangles.push_back({below + i, above + next, above + i});
    }
  }
  return mesh;
}

TEST(SimplifyFlaws, AThinShellWhoseSidesReachThroughEachOtherHasNone) {
  const Mesh dense = bowl(96, 48), light = bowl(14, 4);
  ASSERT_EQ(count_rims(dense.triangles, dense.positions.size()), 0U);
  SimplifyCheck check(dense.positions, dense.triangles, false);
  EXPECT_TRUE(check.find(doubles(dense.positions), dense.triangles).none());
  EXPECT_TRUE(check.find(doubles(light.positions), light.triangles).none());
}

TEST(SimplifyFlaws, ALightBowlHasNone) {
  SimplifyOptions options;
  options.faces = 150;
  SimplifyReport report;
  const Mesh light = simplify(bowl(120, 60), options, &report);
  EXPECT_EQ(report.folded, 0U);
  EXPECT_LE(light.triangles.size(), 150U);
}

TEST(SimplifyFlaws, FoldsAreMended) {
  for (const std::uint32_t vertex : {0U, 17U, 200U, 411U}) {
    const Pulled scene(vertex);
    SimplifyCheck check(scene.dense.positions, scene.dense.triangles, false);
    const Flaws flaws = check.find(scene.points, scene.light.triangles);
    CollapseMesh mesh(scene.points, scene.light.triangles);
    EdgeCollapser collapser(mesh);
    for (const std::uint32_t t : flaws.folded) {
      collapser.repair_triangle(
          t, [&](const TriangleCorners& corners) { return check.is_flaw(corners); });
    }
    std::vector<Vec3d> points;
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> sources;
    mesh.extract(points, triangles, sources);
    EXPECT_TRUE(check.find(points, triangles).none());
    EXPECT_GE(triangles.size() + 8, scene.light.triangles.size());
    EXPECT_EQ(count_rims(triangles, points.size()), 0U);
  }
}

TEST(SimplifyFlaws, TrianglesWithoutAreaAreFound) {
  Mesh mesh = shrunk(test::icosphere(2), 0.28F);
  // A corner onto the next: the two triangles of that side have no area.
  const Triangle t = mesh.triangles[7];
  mesh.positions[t[0]] = mesh.positions[t[1]];
  const Mesh dense = shrunk(test::icosphere(4), 0.28F);
  SimplifyCheck check(dense.positions, dense.triangles, false);
  const Flaws flaws = check.find(doubles(mesh.positions), mesh.triangles);
  EXPECT_EQ(flaws.flat.size(), 2U);
  EXPECT_EQ(std::count(flaws.flat.begin(), flaws.flat.end(), 7U), 1);
}

TEST(SimplifyFlaws, RimsAreCounted) {
  Mesh mesh = test::icosphere(2);
  EXPECT_EQ(count_rims(mesh.triangles, mesh.positions.size()), 0U);
  mesh.triangles.erase(mesh.triangles.begin() + 5);
  mesh.triangles.erase(mesh.triangles.begin() + 200);
  EXPECT_EQ(count_rims(mesh.triangles, mesh.positions.size()), 2U);
  EXPECT_EQ(count_rims(test::plane(3, 3).triangles, 16), 1U);
}

/// Hills, plains and steps; in `levels` steps as integer images have them, or smooth.
Image terrain(std::uint32_t side, int levels) {
  Image image{side, side, 1, std::vector<float>(std::size_t{side} * side)};
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const double u = static_cast<double>(x) / side, v = static_cast<double>(y) / side;
      double h = 0;
      for (int octave = 0; octave < 6; ++octave) {
        const double f = 3.1 * std::pow(2.03, octave);
        h += std::pow(0.5, octave) * std::abs(std::sin(f * u + 1.7 * octave + std::sin(f * v)));
      }
      h = std::clamp(h / 2 - 0.1, 0.0, 1.0);  // Plains at the bottom
      *image.at(x, y) = static_cast<float>(levels == 0 ? h : std::floor(h * levels) / levels);
    }
  }
  return image;
}

struct Field {
  std::uint32_t side;
  int levels;
  double height;
  std::uint32_t faces;
};

class HeightFieldFlaws : public testing::TestWithParam<Field> {};

TEST_P(HeightFieldFlaws, EveryTriangleFacesUp) {
  const Field& p = GetParam();
  const Mesh dense = height_field_mesh(terrain(p.side, p.levels), {1000, 1000, p.height});
  SimplifyReport report;
  const Mesh low = simplify(dense, {.faces = p.faces, .height_field = true}, &report);
  EXPECT_LE(low.triangles.size(), p.faces);
  EXPECT_GE(low.triangles.size(), p.faces - 8);
  double area = 0;
  for (const Triangle& t : low.triangles) {
    const Vec3 &a = low.positions[t[0]], &b = low.positions[t[1]], &c = low.positions[t[2]];
    const float up = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    EXPECT_GT(up, 0.0F);
    area += 0.5 * (double{b.x - a.x} * (c.y - a.y) - double{b.y - a.y} * (c.x - a.x));
  }
  EXPECT_NEAR(area, 1e6, 1);  // The whole rectangle, each place once.
  EXPECT_EQ(report.folded + report.without_area + report.holes, 0U);
}

INSTANTIATE_TEST_SUITE_P(Fields, HeightFieldFlaws,
                         testing::Values(Field{150, 0, 1, 500}, Field{150, 0, 60, 2000},
                                         Field{150, 0, 200, 5000}, Field{150, 8, 60, 500},
                                         Field{150, 8, 200, 4000}, Field{150, 255, 200, 1000},
                                         Field{260, 0, 60, 2000}, Field{260, 16, 200, 20000}),
                         [](const auto& info) {
                           const Field& f = info.param;
                           return "side" + std::to_string(f.side) + "levels" +
                                  std::to_string(f.levels) + "height" +
                                  std::to_string(static_cast<int>(f.height)) + "faces" +
                                  std::to_string(f.faces);
                         });

}  // namespace
}  // namespace kiln

// Tests of the generated shapes: they are closed, oriented, and as exact as documented.
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

namespace kiln::test {
namespace {

Vec3d at(const Mesh& mesh, std::uint32_t i) {
  const Vec3& p = mesh.positions[i];
  return {p.x, p.y, p.z};
}
Vec3d sub(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec3d cross_product(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double inner(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double degrees_between(const Vec3d& a, const Vec3d& b) {
  const Vec3d c = cross_product(a, b);
  return std::atan2(std::sqrt(inner(c, c)), inner(a, b)) * 180 / M_PI;
}

/// Expects each directed edge once, and its reverse once: the mesh is closed, manifold along edges, and oriented.
void expect_closed(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_LT(t[i], mesh.positions.size());
      ++edges[{t[i], t[(i + 1) % 3]}];
    }
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << mesh.name << ' ' << edge.first << ' ' << edge.second;
    ASSERT_TRUE(edges.contains({edge.second, edge.first}))
        << mesh.name << ' ' << edge.first << ' ' << edge.second;
  }
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += inner(at(mesh, a), cross_product(at(mesh, b), at(mesh, c))) / 6;
  }
  return sum;
}

/// The UV area of a mesh. Expects each UV triangle to be counter-clockwise, so that no chart is mirrored, and inside
/// [0, 1]^2.
double uv_area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.uv_triangles) {
    const Vec2 &p = mesh.uvs[a], &q = mesh.uvs[b], &r = mesh.uvs[c];
    const double area =
        (double{q.x} - p.x) * (double{r.y} - p.y) - (double{r.x} - p.x) * (double{q.y} - p.y);
    EXPECT_GT(area, 0) << mesh.name;
    for (const Vec2& uv : {p, q, r}) {
      EXPECT_TRUE(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1) << mesh.name;
    }
    sum += area / 2;
  }
  return sum;
}

TEST(Shapes, ClosedOnesAreClosedAndOutward) {
  const double pi = M_PI;
  const auto check = [](const Mesh& mesh, std::size_t triangles, double exact, double tolerance) {
    EXPECT_EQ(mesh.triangles.size(), triangles) << mesh.name;
    expect_closed(mesh);
    EXPECT_NEAR(volume(mesh), exact, tolerance * exact) << mesh.name;
  };
  check(tetrahedron(), 4, 8 * std::sqrt(3.0) / 27, 1e-6);
  check(cube(2), 12, 8, 1e-6);
  check(icosphere(4), 5120, 4 * pi / 3, 0.005);
  check(uv_sphere(64, 32), 2 * 64 * 31, 4 * pi / 3, 0.01);
  check(uv_sphere(3, 2), 6, std::sqrt(3.0) / 2, 1e-6);
  check(torus(96, 48), 2 * 96 * 48, 2 * pi * pi * 0.35 * 0.35, 0.01);
  for (const std::uint64_t faces : {8u, 32u, 72u, 128u, 20000u}) {
    const Mesh mesh = BumpySphere::dense(faces);
    EXPECT_EQ(mesh.triangles.size(), faces);
    EXPECT_EQ(mesh.positions.size(), faces / 2 + 2);
    expect_closed(mesh);
    EXPECT_GT(volume(mesh), 0);
  }
  const Mesh bumpy = BumpyTorus::dense(20000);
  EXPECT_NEAR(static_cast<double>(bumpy.triangles.size()), 20000, 1000);
  expect_closed(bumpy);
  EXPECT_NEAR(volume(bumpy), 2 * pi * pi * 0.35 * 0.35, 0.05);
}

TEST(Shapes, UvsAreNotMirroredAndCoverWhatTheyShould) {
  EXPECT_NEAR(uv_area(plane(5, 7)), 1, 1e-6);
  EXPECT_NEAR(uv_area(torus(24, 12)), 1, 1e-6);
  EXPECT_NEAR(uv_area(uv_sphere(24, 12)), 11.0 / 12, 1e-6);
  EXPECT_NEAR(uv_area(cube(1, 0.01)), 6 * (1 / 3.0 - 0.02) * (0.5 - 0.02), 1e-6);
}

TEST(Shapes, NormalsFaceTheSameWayAsTriangles) {
  for (const Mesh& mesh : {plane(2, 3), cube(), uv_sphere(24, 12), torus(48, 24),
                           BumpySphere::dense(20000, true), BumpyTorus::dense(20000, true)}) {
    ASSERT_EQ(mesh.normal_triangles.size(), mesh.triangles.size()) << mesh.name;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      const Vec3d face =
          cross_product(sub(at(mesh, b), at(mesh, a)), sub(at(mesh, c), at(mesh, a)));
      for (const std::uint32_t i : mesh.normal_triangles[t]) {
        const Vec3& n = mesh.normals[i];
        ASSERT_NEAR(inner({n.x, n.y, n.z}, {n.x, n.y, n.z}), 1, 1e-6) << mesh.name;
        ASSERT_LT(degrees_between(face, {n.x, n.y, n.z}), 16) << mesh.name << ' ' << t;
      }
    }
  }
}

/// Compares the exact normal with central differences of the surface.
TEST(Shapes, ExactNormalsAreThoseOfTheSurface) {
  const double e = 1e-5;
  double largest = 0;
  for (const Vec3& n : icosphere(3).positions) {
    const double length = std::sqrt(inner({n.x, n.y, n.z}, {n.x, n.y, n.z}));
    const Vec3d d{n.x / length, n.y / length, n.z / length};
    const auto surface = [&](double x, double y, double z) {
      const Vec3d q{d.x + x, d.y + y, d.z + z};
      const double l = std::sqrt(inner(q, q));
      const double r = BumpySphere::radius({q.x / l, q.y / l, q.z / l});
      return Vec3d{r * q.x / l, r * q.y / l, r * q.z / l};
    };
    const Vec3d normal = BumpySphere::exact_normal({2 * d.x, 2 * d.y, 2 * d.z});
    EXPECT_NEAR(inner(normal, normal), 1, 1e-12);
    EXPECT_NEAR(inner(normal, sub(surface(e, 0, 0), surface(-e, 0, 0))) / (2 * e), 0, 1e-7);
    EXPECT_NEAR(inner(normal, sub(surface(0, e, 0), surface(0, -e, 0))) / (2 * e), 0, 1e-7);
    EXPECT_NEAR(inner(normal, sub(surface(0, 0, e), surface(0, 0, -e))) / (2 * e), 0, 1e-7);
    EXPECT_LE(std::abs(BumpySphere::radius(d) - 1), BumpySphere::kAmplitude);
    largest = std::max(largest, degrees_between(normal, d));
  }
  EXPECT_LT(largest, 23);
  EXPECT_GT(largest, 10);

  largest = 0;
  for (double u = -3; u < 3; u += 0.1) {
    for (double v = -3; v < 3; v += 0.1) {
      const auto surface = [](double a, double b, double scale) {
        const double r = 0.35 + scale * BumpyTorus::height(a, b);
        return Vec3d{(1 + r * std::cos(b)) * std::cos(a), r * std::sin(b),
                     -(1 + r * std::cos(b)) * std::sin(a)};
      };
      const Vec3d normal = BumpyTorus::exact_normal(surface(u, v, 0.5));
      EXPECT_NEAR(inner(normal, sub(surface(u + e, v, 1), surface(u - e, v, 1))) / (2 * e), 0,
                  1e-7);
      EXPECT_NEAR(inner(normal, sub(surface(u, v + e, 1), surface(u, v - e, 1))) / (2 * e), 0,
                  1e-7);
      EXPECT_LE(std::abs(BumpyTorus::height(u, v)), BumpyTorus::kAmplitude);
      const Vec3d smooth{std::cos(v) * std::cos(u), std::sin(v), -std::cos(v) * std::sin(u)};
      largest = std::max(largest, degrees_between(normal, smooth));
    }
  }
  EXPECT_LT(largest, 35);
  EXPECT_GT(largest, 10);
}

TEST(Shapes, SoupFollowsItsSeed) {
  EXPECT_EQ(random_soup(100, 7).positions, random_soup(100, 7).positions);
  EXPECT_NE(random_soup(100, 7).positions, random_soup(100, 8).positions);
  for (const Vec3& p : random_soup(1000, 1, 0.5).positions) {
    ASSERT_TRUE(std::abs(p.x) <= 1 && std::abs(p.y) <= 1 && std::abs(p.z) <= 1);
  }
}

}  // namespace
}  // namespace kiln::test

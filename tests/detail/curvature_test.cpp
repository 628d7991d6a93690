// Mean curvature against closed forms, and against the normal cycle by brute force.
#include "mesh/curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "detail/curvature_check.h"
#include "kiln/bake.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Shape = std::function<double(const Vec3d&)>;

/// At all vertices.
std::vector<double> mean_curvature(std::span<const Vec3> positions,
                                   std::span<const Triangle> triangles, double radius,
                                   std::uint64_t* steps = nullptr) {
  const MeanCurvature curvature(positions, triangles, radius);
  MeanCurvature::Scratch scratch;
  std::vector<double> found;
  for (const Vec3& p : positions) {
    found.push_back(is_finite(p) ? curvature.at(to_double(p), scratch) : 0);
  }
  if (steps != nullptr) *steps = scratch.steps;
  return found;
}

/// Mean over the vertices of |found - closed form|.
double mean_error(const Mesh& mesh, double radius, const Shape& exact) {
  const std::vector<double> found = mean_curvature(mesh.positions, mesh.triangles, radius);
  double sum = 0;
  for (std::size_t v = 0; v < found.size(); ++v) {
    sum += std::abs(found[v] - exact(to_double(mesh.positions[v])));
  }
  return sum / static_cast<double>(found.size());
}

/// A grid over [-1, 1]^2 bent to z = (a x^2 + b y^2) / 2, facing +Z.
Mesh paraboloid(std::uint32_t cells, double a, double b) {
  Mesh mesh = test::plane(cells, cells, 2, 2);
  for (Vec3& p : mesh.positions) {
    p.z = static_cast<float>((a * p.x * p.x + b * p.y * p.y) / 2);
  }
  return mesh;
}

double at_centre(const Mesh& mesh, double radius) {
  const std::vector<double> found = mean_curvature(mesh.positions, mesh.triangles, radius);
  for (std::size_t v = 0; v < found.size(); ++v) {
    if (mesh.positions[v].x == 0 && mesh.positions[v].y == 0) return found[v];
  }
  ADD_FAILURE() << "no vertex in the centre";
  return 0;
}

/// The normal cycle as it is defined: over all edges and all triangles. Vertices must be one a
/// place.
class BruteForce {
 public:
  explicit BruteForce(const Mesh& mesh) : mesh_(mesh) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
        runs_[{from, to}].push_back(t);
      }
    }
  }

  double at(std::uint32_t vertex, double radius, int depth) const {
    const Vec3d centre = place(vertex);
    double bend = 0, area = 0;
    for (const auto& [edge, owners] : runs_) {
      const auto back = runs_.find({edge.second, edge.first});
      if (edge.first > edge.second || owners.size() != 1) continue;
      if (back == runs_.end() || back->second.size() != 1) continue;
      const Vec3d n = normal(owners[0]), m = normal(back->second[0]);
      const double angle = std::acos(std::clamp(dot(n, m), -1.0, 1.0));
      // Convex where the other triangle's far corner lies below this one's plane.
      const double side = dot(n, far_corner(back->second[0], edge) - place(edge.first));
      bend += (side < 0 ? angle : -angle) *
              inside(place(edge.first) - centre, place(edge.second) - centre, radius) / 2;
    }
    for (const Triangle& t : mesh_.triangles) {
      area +=
          covered(place(t[0]) - centre, place(t[1]) - centre, place(t[2]) - centre, radius, depth);
    }
    return bend / area;
  }

 private:
  Vec3d place(std::uint32_t vertex) const { return to_double(mesh_.positions[vertex]); }
  Vec3d normal(std::size_t t) const {
    const Triangle& c = mesh_.triangles[t];
    const Vec3d n = cross(place(c[1]) - place(c[0]), place(c[2]) - place(c[0]));
    return n * (1 / length(n));
  }
  Vec3d far_corner(std::size_t t, const std::pair<std::uint32_t, std::uint32_t>& edge) const {
    for (const std::uint32_t corner : mesh_.triangles[t]) {
      if (corner != edge.first && corner != edge.second) return place(corner);
    }
    return {};
  }
  /// Length of an edge in the ball, by its distance from the foot of the perpendicular.
  static double inside(const Vec3d& a, const Vec3d& b, double radius) {
    const double whole = length(b - a);
    const Vec3d way = (b - a) * (1 / whole);
    const double foot = -dot(a, way);
    const double away = length(a + way * foot);
    if (away >= radius) return 0;
    const double half = std::sqrt(radius * radius - away * away);
    return std::max(0.0, std::min(whole, foot + half) - std::max(0.0, foot - half));
  }
  /// Area of a triangle in the ball: what lies across the border is split, and counts in the end by
  /// its middle.
  static double covered(const Vec3d& a, const Vec3d& b, const Vec3d& c, double radius, int depth) {
    const Vec3d middle = (a + b + c) * (1.0 / 3);
    const double size = std::max({length(a - middle), length(b - middle), length(c - middle)});
    const double area = length(cross(b - a, c - a)) / 2;
    if (length(middle) - size >= radius) return 0;
    if (length(middle) + size <= radius) return area;
    if (depth == 0) return length(middle) <= radius ? area : 0;
    const Vec3d ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
    return covered(a, ab, ca, radius, depth - 1) + covered(ab, b, bc, radius, depth - 1) +
           covered(ca, bc, c, radius, depth - 1) + covered(ab, bc, ca, radius, depth - 1);
  }

  const Mesh& mesh_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> runs_;
};

/// Corners moved at random; some triangles are gone, so that there are borders.
Mesh crumpled(std::uint32_t levels, double by) {
  Mesh mesh = test::icosphere(levels);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> shift(-static_cast<float>(by), static_cast<float>(by));
  for (Vec3& p : mesh.positions)
    p = {p.x + shift(random), p.y + shift(random), p.z + shift(random)};
  mesh.triangles.erase(mesh.triangles.begin() + 5, mesh.triangles.begin() + 12);
  return mesh;
}

TEST(Curvature, OfASphereIsOneOverItsRadius) {
  const auto exact = [](const Vec3d&) { return 0.5; };
  double before = std::numeric_limits<double>::infinity();
  // Balls of two edges and more: by their border 1 in some 6 edges is cut, which errs by a tenth of
  // it.
  for (const std::uint32_t levels : {3U, 4U, 5U}) {
    const double error = mean_error(test::icosphere(levels, 2), 0.5, exact);
    RecordProperty("levels_" + std::to_string(levels), std::to_string(error));
    EXPECT_LT(error, before);
    before = error;
  }
  EXPECT_LT(before, 0.01);
}

TEST(Curvature, OfASphereTurnedInsideOutIsNegative) {
  Mesh mesh = test::icosphere(3);
  const std::vector<double> outward = mean_curvature(mesh.positions, mesh.triangles, 0.3);
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  const std::vector<double> inward = mean_curvature(mesh.positions, mesh.triangles, 0.3);
  for (std::size_t v = 0; v < outward.size(); ++v) {
    EXPECT_GT(outward[v], 0.8);
    EXPECT_NEAR(inward[v], -outward[v], 1e-9);
  }
}

TEST(Curvature, OfACylinderIsHalfOfOneOverItsRadius) {
  constexpr double kRadius = 0.5, kBall = 0.2;
  Mesh mesh = test::plane(128, 82, 2 * std::numbers::pi * kRadius, 2);
  for (Vec3& p : mesh.positions) {
    const double turn = p.x / kRadius;
    p = {static_cast<float>(kRadius * std::sin(turn)), p.y,
         static_cast<float>(kRadius * std::cos(turn))};
  }
  const std::vector<double> found = mean_curvature(mesh.positions, mesh.triangles, kBall);
  std::size_t count = 0;
  double sum = 0;
  for (std::size_t v = 0; v < found.size(); ++v) {
    // Neither at the open ends nor at the seam, where float positions may be a bit apart.
    if (std::abs(mesh.positions[v].y) > 1 - kBall || mesh.positions[v].z < -0.4) continue;
    sum += std::abs(found[v] - 1 / (2 * kRadius));
    ++count;
  }
  ASSERT_GT(count, 1000U);
  EXPECT_LT(sum / static_cast<double>(count), 0.02);
}

TEST(Curvature, OfATorusIsItsClosedForm) {
  constexpr double kMajor = 1, kMinor = 0.35;
  const auto exact = [](const Vec3d& p) {
    const double away = std::hypot(p.x, p.z);
    return (1 / kMinor + (away - kMajor) / kMinor / away) / 2;
  };
  // The closed form runs from 0.66 to 1.8.
  const double coarse = mean_error(test::torus(3 * 48, 48, kMajor, kMinor), 0.1, exact);
  const double fine = mean_error(test::torus(3 * 96, 96, kMajor, kMinor), 0.1, exact);
  EXPECT_LT(coarse, 0.08);
  EXPECT_LT(fine, 0.04);
  EXPECT_LT(fine, coarse);
}

TEST(Curvature, OfAPlaneIsNothing) {
  const Mesh mesh = test::plane(9, 7, 2, 1);
  for (const double radius : {0.01, 0.3, 10.0}) {
    for (const double found : mean_curvature(mesh.positions, mesh.triangles, radius)) {
      EXPECT_EQ(found, 0.0);
    }
  }
}

TEST(Curvature, HasTheSignOfTheStrongerBend) {
  // Facing +Z, a bowl is concave: minus the mean of both second derivatives.
  EXPECT_NEAR(at_centre(paraboloid(64, 1, -2), 0.2), 0.5, 0.1);
  EXPECT_NEAR(at_centre(paraboloid(64, 2, -1), 0.2), -0.5, 0.1);
  EXPECT_NEAR(at_centre(paraboloid(64, 1, -1), 0.2), 0, 0.1);
  EXPECT_NEAR(at_centre(paraboloid(64, -1, -1), 0.2), 1, 0.1);
}

TEST(Curvature, IsTheNormalCycle) {
  const Mesh mesh = crumpled(2, 0.1);
  const BruteForce brute(mesh);
  for (const double radius : {0.05, 0.4, 0.9, 3.0}) {
    const std::vector<double> found = mean_curvature(mesh.positions, mesh.triangles, radius);
    for (std::uint32_t v = 0; v < mesh.positions.size(); v += 3) {
      // Pieces of 1/256 of an edge decide by their middle: 1/1000 of the area of the smallest ball, less of others.
      const double exact = brute.at(v, radius, 8);
      EXPECT_NEAR(found[v], exact, 2e-3 + 1e-3 * std::abs(exact)) << v << " within " << radius;
    }
  }
}

TEST(Curvature, OfManySmallTrianglesIsNearTheNormalCycle) {
  const Mesh mesh = test::BumpySphere::dense(32000);
  const BruteForce brute(mesh);
  const double radius = 0.8;  // some 27 edges
  const std::vector<double> found = mean_curvature(mesh.positions, mesh.triangles, radius);
  for (std::uint32_t v = 0; v < mesh.positions.size(); v += 2000) {
    EXPECT_NEAR(found[v], brute.at(v, radius, 2), 0.01) << v;  // curvatures of about 1
  }
}

/// A cone of n needles round a tip, whose rim goes up and down.
Mesh needles(std::uint32_t n) {
  Mesh mesh;
  mesh.positions.push_back({0, 0, 0.5F});
  for (std::uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    mesh.positions.push_back({static_cast<float>(std::cos(angle)),
                              static_cast<float>(std::sin(angle)), i % 2 == 0 ? 1e-4F : -1e-4F});
    mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % n});
  }
  return mesh;
}

/// n sheets of one large triangle each, a hair apart.
Mesh sheets(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    const float z = 1e-6F * static_cast<float>(i);
    mesh.positions.insert(mesh.positions.end(), {{0, 0, z}, {1, 0, z}, {0, 1, z}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

TEST(Curvature, OfManyNeedlesIsNearTheNormalCycle) {
  const Mesh mesh = needles(6000);  // a ball at the rim holds some 1,100 of them
  const BruteForce brute(mesh);
  const double radius = 0.6;
  const std::vector<double> found = mean_curvature(mesh.positions, mesh.triangles, radius);
  double most = 0;
  for (std::uint32_t v = 0; v < mesh.positions.size(); v += 1500) {
    const double exact = brute.at(v, radius, 6);
    most = std::max(most, std::abs(exact));
    // The brute force takes pieces of 1/64 of an edge.
    EXPECT_NEAR(found[v], exact, 0.05 * std::abs(exact)) << v;
  }
  EXPECT_GT(most, 0.1);  // not all flat
}

/// Thin triangles of all lengths up to 0.6, in all directions.
Mesh random_needles(std::uint32_t n) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-0.5F, 0.5F), way(-0.3F, 0.3F);
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 at{place(random), place(random), place(random)};
    const Vec3 along{way(random), way(random), way(random)};
    mesh.positions.insert(
        mesh.positions.end(),
        {at, {at.x + along.x, at.y + along.y, at.z + along.z}, {at.x + 1e-3F, at.y + 1e-3F, at.z}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

/// Steps of a ball, on average over some points of the mesh.
double steps_of_a_ball(const Mesh& mesh, double radius) {
  constexpr std::size_t kPoints = 256;
  const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
  MeanCurvature::Scratch scratch;
  for (std::size_t i = 0; i < kPoints; ++i) {
    curvature.on(static_cast<std::uint32_t>(mesh.triangles.size() * i / kPoints), 0.3, 0.3,
                 scratch);
  }
  return static_cast<double>(scratch.steps) / kPoints;
}

TEST(Curvature, CostsWhatIsAskedFor) {
  // Needles round a tip and sheets: a ball's border crosses all of them, of which it looks at a bounded number.
  for (Mesh (*make)(std::uint32_t) : {needles, sheets}) {
    const double radius = make == needles ? 0.4 : 0.05;
    const double few = steps_of_a_ball(make(12000), radius);
    const double many = steps_of_a_ball(make(36000), radius);
    EXPECT_LE(many, 1.5 * few);
    EXPECT_LE(many, 40000);
  }
  // In all directions: boxes of cut needles keep balls from most of them. 4 times as many are
  // in 4 times as many balls.
  const double few = steps_of_a_ball(random_needles(10000), 0.005);
  const double many = steps_of_a_ball(random_needles(40000), 0.005);
  EXPECT_LE(many, 4.4 * few);
  EXPECT_LE(many, 40000 / 10);
  // 16 times the triangles in the same ball, as many points: nothing is found at the others' vertices.
  const double coarse = steps_of_a_ball(test::icosphere(5), 0.2);
  const double fine = steps_of_a_ball(test::icosphere(7), 0.2);
  EXPECT_LE(fine, 6 * coarse);
}

/// Each triangle in four, in its plane.
Mesh cut_in_four(const Mesh& mesh, int times) {
  Mesh cut = mesh;
  for (int i = 0; i < times; ++i) {
    Mesh next;
    for (const Triangle& t : cut.triangles) {
      const auto first = static_cast<std::uint32_t>(next.positions.size());
      for (const std::uint32_t corner : t) next.positions.push_back(cut.positions[corner]);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d middle =
            (to_double(cut.positions[t[k]]) + to_double(cut.positions[t[(k + 1) % 3]])) * 0.5;
        next.positions.push_back(to_float(middle));
      }
      const std::uint32_t a = first, b = first + 1, c = first + 2;
      const std::uint32_t ab = first + 3, bc = first + 4, ca = first + 5;
      next.triangles.insert(next.triangles.end(),
                            {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    cut = next;
  }
  return cut;
}

/// [-1, 1]^3 whose edges are cut off at 45 degrees, `width` along each face. Quads cut along either diagonal.
Mesh bevelled_cube(float width, bool other_diagonal) {
  Mesh mesh;
  const float in = 1 - width;
  const auto quad = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
    const auto cut = other_diagonal ? std::array<Triangle, 2>{{{first, first + 1, first + 3},
                                                               {first + 1, first + 2, first + 3}}}
                                    : std::array<Triangle, 2>{{{first, first + 1, first + 2},
                                                               {first, first + 2, first + 3}}};
    mesh.triangles.insert(mesh.triangles.end(), cut.begin(), cut.end());
  };
  const auto at = [](std::size_t axis, float along, float next, float last) {
    std::array<float, 3> p{};
    p[axis] = along;
    p[(axis + 1) % 3] = next;
    p[(axis + 2) % 3] = last;
    return Vec3{p[0], p[1], p[2]};
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float s : {-1.0F, 1.0F}) {
      // A face across the axis, turned outwards.
      quad(at(axis, s, -in, s * -in), at(axis, s, in, s * -in), at(axis, s, in, s * in),
           at(axis, s, -in, s * in));
      // The bevel between that face and the next axis' face, for both ends of it.
      for (const float t : {-1.0F, 1.0F}) {
        const float turn = s * t;
        quad(at(axis, s, t * in, turn * -in), at(axis, s * in, t, turn * -in),
             at(axis, s * in, t, turn * in), at(axis, s, t * in, turn * in));
      }
    }
  }
  for (const float x : {-1.0F, 1.0F}) {
    for (const float y : {-1.0F, 1.0F}) {
      for (const float z : {-1.0F, 1.0F}) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(),
                              {{x, y * in, z * in}, {x * in, y, z * in}, {x * in, y * in, z}});
        mesh.triangles.push_back(x * y * z > 0 ? Triangle{first, first + 1, first + 2}
                                               : Triangle{first, first + 2, first + 1});
      }
    }
  }
  return mesh;
}

TEST(Curvature, OfFlatFacesIsNothingAndOfEdgesAClosedForm) {
  // A cube of 12 triangles: width 0 leaves faces, and bevels without area.
  const Mesh cube = bevelled_cube(0, false);
  for (const double radius : {0.05, 0.3}) {
    const MeanCurvature curvature(cube.positions, cube.triangles, radius);
    MeanCurvature::Scratch scratch;
    EXPECT_EQ(curvature.at({0, 0, 1}, scratch), 0);
    EXPECT_EQ(curvature.at({0.5, -0.6, 1}, scratch), 0);
    // At d from one edge, the ball holds a chord 2 c of it, the disc but a segment of one face, and half a
    // disc of the other.
    for (const double d : {0.0, 0.3 * radius, 0.9 * radius}) {
      const double c = std::sqrt(radius * radius - d * d);
      const double area = std::numbers::pi * radius * radius -
                          (radius * radius * std::acos(d / radius) - d * c) +
                          std::numbers::pi * c * c / 2;
      EXPECT_NEAR(curvature.at({0, 1 - d, 1}, scratch), std::numbers::pi / 2 * c / area,
                  1e-6 / radius);
    }
    // Three edges of a radius, three quarters of a disc: 1 / radius.
    EXPECT_NEAR(curvature.at({1, 1, 1}, scratch), 1 / radius, 1e-6 / radius);
  }
}

TEST(Curvature, OfABevelIsItsTurnOverItsBall) {
  // A ball on the bevel's middle that reaches past both of its edges: each turns by 45 degrees.
  const float width = 0.1F;
  const Mesh mesh = bevelled_cube(width, false);
  const double radius = 0.2, half = width / std::sqrt(2.0);
  const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
  MeanCurvature::Scratch scratch;
  const double c = std::sqrt(radius * radius - half * half);
  // The part of the bevel's disc between the edges, and of each face, at 45 degrees, the disc beyond its edge: its
  // centre is half * cos 45 in from the edge.
  const auto segment = [](double r, double d) {
    return r * r * std::acos(d / r) - d * std::sqrt(r * r - d * d);
  };
  const double of_bevel = std::numbers::pi * radius * radius - 2 * segment(radius, half);
  const double off = half * std::sqrt(0.5);
  const double of_face = segment(std::sqrt(radius * radius - off * off), off);
  const double exact = 2 * (std::numbers::pi / 4) * c / (of_bevel + 2 * of_face);
  EXPECT_NEAR(curvature.at({0, 0.95, 0.95}, scratch), exact, 1e-5 * exact);
  EXPECT_EQ(curvature.at({0, 0, 1}, scratch), 0);
}

TEST(Curvature, IsTheSameHoweverTheSurfaceIsCut) {
  const std::vector<Mesh> cuts = {bevelled_cube(0.25F, false), bevelled_cube(0.25F, true),
                                  cut_in_four(bevelled_cube(0.25F, false), 2),
                                  cut_in_four(bevelled_cube(0.25F, true), 4)};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> along(-0.99, 0.99);
  std::vector<Vec3d> points;
  for (int i = 0; i < 300; ++i) {
    double x = along(random), y = along(random);
    points.push_back({x, y, std::min(1.0, 1.75 - std::max(std::abs(x), std::abs(y)))});
  }
  for (const double radius : {0.02, 0.1, 0.4}) {
    std::vector<double> first;
    for (const Mesh& mesh : cuts) {
      const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
      MeanCurvature::Scratch scratch;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double found = curvature.at(points[i], scratch);
        if (first.size() < points.size()) {
          first.push_back(found);
        } else {
          // Areas and lengths of pieces are single precision.
          EXPECT_NEAR(found, first[i], 2e-6 / radius) << i << " within " << radius;
        }
      }
    }
  }
}

TEST(Curvature, InterpolatesWithinItsBounds) {
  // Triangles of 1/16 of a radius round sharp edges, and on a smooth shape.
  for (const Mesh& mesh : {cut_in_four(bevelled_cube(0.25F, false), 6), test::icosphere(6)}) {
    const double radius = 0.5;
    const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
    MeanCurvature::Scratch scratch;
    double sum = 0, most = 0;
    std::size_t count = 0;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 97) {
      const Triangle& c = mesh.triangles[t];
      const Vec3d middle = (to_double(mesh.positions[c[0]]) + to_double(mesh.positions[c[1]]) +
                            to_double(mesh.positions[c[2]])) *
                           (1.0 / 3);
      const double apart =
          std::abs(curvature.on(t, 1.0 / 3, 1.0 / 3, scratch) - curvature.at(middle, scratch));
      sum += apart;
      most = std::max(most, apart);
      ++count;
    }
    EXPECT_LT(sum / static_cast<double>(count) * radius, 1.0 / 1024);
    EXPECT_LT(most * radius, 1.0 / 128);
  }
}

TEST(Curvature, DoesNotDependOnWhatWasAskedBefore) {
  const Mesh mesh = test::BumpySphere::dense(32000);
  for (const double radius : {0.03, 0.2, 0.8}) {
    const MeanCurvature one(mesh.positions, mesh.triangles, radius),
        other(mesh.positions, mesh.triangles, radius);
    MeanCurvature::Scratch scratch;
    std::vector<double> forth, back;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 503) {
      forth.push_back(one.on(t, 0.2, 0.5, scratch));
    }
    for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 503) {
      MeanCurvature::Scratch fresh;
      back.push_back(other.on(t, 0.2, 0.5, fresh));
    }
    EXPECT_EQ(forth, back);
  }
}

TEST(Curvature, WeldsPlaces) {
  const Mesh mesh = crumpled(2, 0.1);
  Mesh split;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(split.positions.size());
    for (const std::uint32_t corner : t) split.positions.push_back(mesh.positions[corner]);
    split.triangles.push_back({first, first + 1, first + 2});
  }
  const std::vector<double> whole = mean_curvature(mesh.positions, mesh.triangles, 0.4);
  const std::vector<double> parts = mean_curvature(split.positions, split.triangles, 0.4);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(parts[3 * t + k], whole[mesh.triangles[t][k]], 1e-12);
    }
  }
}

/// A cylinder of n sides and its caps, radius and half height 1.
Mesh cylinder(std::uint32_t n, std::uint32_t rows) {
  Mesh mesh;
  const auto at = [&](std::uint32_t side, double z, double away = 1) {
    const double turn = 2 * std::numbers::pi * (side % n) / n;
    mesh.positions.push_back({static_cast<float>(away * std::cos(turn)),
                              static_cast<float>(away * std::sin(turn)), static_cast<float>(z)});
  };
  const auto triangle = [&] {
    const auto last = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.triangles.push_back({last - 3, last - 2, last - 1});
  };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t r = 0; r < rows; ++r) {
      const double low = -1 + 2.0 * r / rows, high = -1 + 2.0 * (r + 1) / rows;
      at(i, low), at(i + 1, low), at(i + 1, high), triangle();
      at(i, low), at(i + 1, high), at(i, high), triangle();
    }
    for (const double z : {-1.0, 1.0}) {
      at(z > 0 ? i : i + 1, z), at(z > 0 ? i + 1 : i, z), at(0, z, 0), triangle();
    }
  }
  return mesh;
}

/// The triangle with area whose middle is nearest.
std::uint32_t nearest_triangle(const Mesh& mesh, const Vec3d& point) {
  double least = std::numeric_limits<double>::infinity();
  std::uint32_t nearest = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3d, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) c[k] = to_double(mesh.positions[mesh.triangles[t][k]]);
    const double away = length((c[0] + c[1] + c[2]) * (1.0 / 3) - point);
    if (!(length(cross(c[1] - c[0], c[2] - c[0])) > 0) || away >= least) continue;
    least = away;
    nearest = t;
  }
  return nearest;
}

/// A ball of radius 1 with a ball of nothing in it: each wall of its own triangles, facing away from the other.
Mesh hollow_ball(std::uint32_t levels, double wall) {
  Mesh mesh = test::icosphere(levels);
  const Mesh inner = test::icosphere(levels, 1 - wall);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), inner.positions.begin(), inner.positions.end());
  for (const Triangle& t : inner.triangles) {
    mesh.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
  }
  return mesh;
}

/// What a map and its check hold in the middles of triangles, which must be the closed form's within a share.
template <typename Exact>
void expect_on_sheets(const Mesh& mesh, double radius, double share, const Exact& exact,
                      std::size_t step) {
  const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
  const CurvatureCheck check(mesh.positions, mesh.triangles, radius);
  MeanCurvature::Scratch scratch;
  CurvatureCheck::Scratch other;
  std::size_t count = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); t += static_cast<std::uint32_t>(step)) {
    const Triangle& c = mesh.triangles[t];
    const Vec3d middle = (to_double(mesh.positions[c[0]]) + to_double(mesh.positions[c[1]]) +
                          to_double(mesh.positions[c[2]])) *
                         (1.0 / 3);
    const std::optional<double> wanted = exact(middle, t);
    if (!wanted) continue;
    const double third = 1.0 / 3;
    ASSERT_NEAR(curvature.on(t, third, third, scratch), *wanted, share * std::abs(*wanted)) << t;
    ASSERT_NEAR(check.at(middle, t, other), *wanted, share * std::abs(*wanted)) << t;
    ++count;
  }
  EXPECT_GT(count, 20U);
}

// All of the surface in a ball has next to no curvature where the ball holds both walls: outside bends one way, inside
// the other. Balls of some 8 facets show these by some percents.
TEST(Curvature, OfAThinWallIsThatOfItsOwnSide) {
  for (const double wall : {0.05, 0.01, 0.001}) {
    const Mesh mesh = hollow_ball(5, wall);
    const std::size_t outside = mesh.triangles.size() / 2;
    expect_on_sheets(
        mesh, 0.25, 0.06,
        [&](const Vec3d&, std::size_t t) -> std::optional<double> {
          return t < outside ? 1 : -1 / (1 - wall);
        },
        211);
    const MeanCurvature all(mesh.positions, mesh.triangles, 0.25);
    MeanCurvature::Scratch scratch;
    EXPECT_LT(std::abs(all.at({0, 0, 1}, scratch)), 0.1) << "of both walls";
  }
}

TEST(Curvature, AndConvexityAreMapsOfAThinWallsOwnSide) {
  KILN_REQUIRE_DEVICE();
  constexpr double kFacets = 0.06;  // what facets of the two balls may differ by
  for (const double wall : {0.05, 0.01, 0.001}) {
    SCOPED_TRACE(wall);
    BakeOptions options;
    options.width = options.height = 48;
    options.maps = {MapKind{"curvature"}, MapKind{"convexity"}};
    options.curvature_radius = Length::absolute(0.25);
    options.match.max_distance = Length::absolute(0.2);
    options.encoding.raw = true;
    const BakeResult baked = bake(Source(*test::device(), hollow_ball(5, wall)),
                                  test::BumpySphere::light(32, 16), options);
    const std::vector<float>& bend = baked.map(MapKind{"curvature"}).image.pixels;
    const std::vector<float>& apart = baked.map(MapKind{"convexity"}).image.pixels;
    std::size_t count = 0;
    for (std::size_t i = 0; i < bend.size(); ++i) {
      if (TexelState{baked.coverage[i]} != TexelState::baked) continue;
      ASSERT_NEAR(bend[i], 1, kFacets) << i;
      ASSERT_NEAR(apart[3 * i], 1, kFacets) << i;
      ASSERT_EQ(apart[3 * i + 1], 0) << i;
      ++count;
    }
    EXPECT_GT(count, 1000U);
  }
}

// 30 thousand triangles of each wall in a ball: more than a patch is followed over, or leaves are opened for.
TEST(Curvature, OfAThinWallOfVerySmallTrianglesToo) {
  const Mesh mesh = hollow_ball(7, 0.002);
  const std::size_t outside = mesh.triangles.size() / 2;
  for (const double radius : {0.3, 0.6}) {
    const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
    MeanCurvature::Scratch scratch;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 36007) {
      const double wanted = t < outside ? 1 : -1 / 0.998;
      EXPECT_NEAR(curvature.on(t, 0.3, 0.3, scratch), wanted, 0.03) << t << " within " << radius;
    }
  }
}

// A cup: at its rim the ball reaches round, and both sides are one convex edge; away from it each has its own.
TEST(Curvature, OfAThinCupGoesRoundItsRim) {
  constexpr std::uint32_t kSlices = 128, kStacks = 64;
  constexpr double kWall = 0.01, kBall = 0.2;
  Mesh mesh;
  const auto ring = [&](std::uint32_t row, double radius) {
    const double down = std::numbers::pi / 2 * row / kStacks;
    for (std::uint32_t i = 0; i < kSlices; ++i) {
      const double turn = 2 * std::numbers::pi * i / kSlices;
      mesh.positions.push_back({static_cast<float>(radius * std::cos(down) * std::cos(turn)),
                                static_cast<float>(radius * std::cos(down) * std::sin(turn)),
                                static_cast<float>(-radius * std::sin(down))});
    }
  };
  // From the outer wall's lowest row up to the rim, and down the inner wall.
  for (std::uint32_t row = kStacks; row-- > 0;) ring(row, 1);
  for (std::uint32_t row = 0; row < kStacks; ++row) ring(row, 1 - kWall);
  for (std::uint32_t r = 0; r + 1 < 2 * kStacks; ++r) {
    for (std::uint32_t i = 0; i < kSlices; ++i) {
      const std::uint32_t a = r * kSlices + i, b = r * kSlices + (i + 1) % kSlices;
      mesh.triangles.push_back({a, b, b + kSlices});
      mesh.triangles.push_back({a, b + kSlices, a + kSlices});
    }
  }
  expect_on_sheets(
      mesh, kBall, 0.06,
      [&](const Vec3d& p, std::size_t) -> std::optional<double> {
        const double away = length(p);
        if (p.z > -1.2 * kBall || p.z < -0.9) return std::nullopt;
        return away > 1 - kWall / 2 ? 1 : -1 / (1 - kWall);
      },
      31);
  const MeanCurvature curvature(mesh.positions, mesh.triangles, kBall);
  const CurvatureCheck check(mesh.positions, mesh.triangles, kBall);
  MeanCurvature::Scratch scratch;
  CurvatureCheck::Scratch other;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 17) {
    const Triangle& c = mesh.triangles[t];
    if (mesh.positions[c[0]].z < -0.02F * kBall || mesh.positions[c[2]].z < -0.02F * kBall)
      continue;
    // Half a turn along a chord of two radii, over two half discs: 1 / radius.
    EXPECT_NEAR(curvature.on(t, 0.3, 0.3, scratch), 1 / kBall, 0.15 / kBall) << t;
    const Vec3d at = to_double(mesh.positions[c[0]]) * 0.4 + to_double(mesh.positions[c[1]]) * 0.3 +
                     to_double(mesh.positions[c[2]]) * 0.3;
    EXPECT_NEAR(check.at(at, t, other), 1 / kBall, 0.15 / kBall) << t;
  }
}

// A sheet counts to the bit as all of the surface where there is no other: one patch, however it folds, and patches
// that look alike, whether or not they are connected.
TEST(Curvature, IsThatOfAllSurfaceWhereThereIsOneSheet) {
  Mesh torn = test::icosphere(4);  // two halves with a gap, welded nowhere
  for (std::size_t t = 0; t < torn.triangles.size(); ++t) {
    Triangle& c = torn.triangles[t];
    const Vec3d middle = to_double(torn.positions[c[0]]) + to_double(torn.positions[c[1]]) +
                         to_double(torn.positions[c[2]]);
    if (middle.x < 0) continue;
    for (std::uint32_t& corner : c) {
      Vec3 p = torn.positions[corner];
      p.x += 1e-3F;
      corner = static_cast<std::uint32_t>(torn.positions.size());
      torn.positions.push_back(p);
    }
  }
  const std::pair<Mesh, double> cases[] = {
      {crumpled(2, 0.1), 3.0},   {needles(900), 0.6},           {torn, 0.2},
      {test::icosphere(3), 1.9}, {bevelled_cube(0, true), 0.3}, {cylinder(24, 3), 0.4}};
  for (const auto& [mesh, radius] : cases) {
    const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
    MeanCurvature::Scratch scratch;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); t += 7) {
      const Triangle& c = mesh.triangles[t];
      const Vec3d p[3] = {to_double(mesh.positions[c[0]]), to_double(mesh.positions[c[1]]),
                          to_double(mesh.positions[c[2]])};
      const double longest =
          std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
      if (longest <= radius / 4) {  // values of corners, which are interpolated
        EXPECT_EQ(curvature.on(t, 0, 0, scratch), curvature.at(p[0], scratch)) << t;
        continue;
      }
      const Vec3d at = p[0] * (1.0 - 0.25 - 0.5) + p[1] * 0.25 + p[2] * 0.5;
      EXPECT_EQ(curvature.on(t, 0.25, 0.5, scratch), curvature.at(at, scratch)) << t;
    }
  }
}

TEST(CurvatureCheck, IsTheDefinitionInOtherCode) {
  // 64 strips across a border: 0.1% of the area.
  constexpr double kStrips = 1e-3;
  const Mesh cube = bevelled_cube(0, false);
  for (const double radius : {0.05, 0.3}) {
    const CurvatureCheck check(cube.positions, cube.triangles, radius);
    CurvatureCheck::Scratch scratch;
    const auto at = [&](const Vec3d& p) { return check.at(p, nearest_triangle(cube, p), scratch); };
    EXPECT_EQ(at({0, 0, 1}), 0);
    EXPECT_NEAR(at({1, 1, 1}), 1 / radius, kStrips / radius);
    EXPECT_NEAR(at({0, 1, 1}), 0.5 / radius, kStrips / radius);
    EXPECT_EQ(at({5, 5, 5}), 0);
  }
  // Small triangles and long ones, borders, both signs; points near each other and not.
  for (const Mesh& mesh : {crumpled(2, 0.1), bevelled_cube(0.25F, true), test::icosphere(4),
                           cylinder(24, 3), test::torus(48, 16)}) {
    for (const double radius : {0.1, 0.5}) {
      const CurvatureCheck check(mesh.positions, mesh.triangles, radius);
      const MeanCurvature curvature(mesh.positions, mesh.triangles, radius);
      CurvatureCheck::Scratch scratch;
      MeanCurvature::Scratch other;
      for (std::size_t t = 0; t < mesh.triangles.size(); t += 1 + mesh.triangles.size() / 60) {
        const Triangle& c = mesh.triangles[t];
        const Vec3d a = to_double(mesh.positions[c[0]]), b = to_double(mesh.positions[c[1]]),
                    d = to_double(mesh.positions[c[2]]);
        for (const Vec3d& at : {a, a * 0.9 + b * 0.1, (a + b + d) * (1.0 / 3)}) {
          const double found = curvature.at(at, other);
          EXPECT_NEAR(check.at(at, static_cast<std::uint32_t>(t), scratch), found,
                      kStrips * (1 / radius + std::abs(found)))
              << t;
        }
      }
    }
  }
}

TEST(FacetSize, IsOfWhatWasSmooth) {
  // Sides of a cylinder, cut across or not; not its caps, nor their sharp rims.
  for (const std::uint32_t n : {24U, 64U}) {
    const double width = 2 * std::sin(std::numbers::pi / n);
    for (const std::uint32_t rows : {1U, 7U}) {
      const Mesh mesh = cylinder(n, rows);
      EXPECT_NEAR(facet_size(mesh.positions, mesh.triangles), width, 1e-5) << n;
    }
  }
  // Heights of even triangles. Those of an icosphere differ by some 18%.
  const Mesh sphere = test::icosphere(4);
  double edges = 0;
  for (const Triangle& t : sphere.triangles) {
    edges += length(to_double(sphere.positions[t[1]]) - to_double(sphere.positions[t[0]]));
  }
  edges /= static_cast<double>(sphere.triangles.size());
  EXPECT_NEAR(facet_size(sphere.positions, sphere.triangles), std::sqrt(0.75) * edges,
              0.05 * edges);
  // Nothing was smooth: a cube, a plane, a cylinder of 12 sides, nothing.
  for (const Mesh& mesh : {bevelled_cube(0, false), bevelled_cube(0.25F, true), test::plane(3, 3),
                           cylinder(12, 1), Mesh{}}) {
    EXPECT_EQ(facet_size(mesh.positions, mesh.triangles), 0);
  }
}

TEST(Curvature, IsFlatWhereASurfaceIsNone) {
  // Two pages at a right angle; a third one at their spine; the second one turned.
  const std::vector<Vec3> positions = {{0, 0, 0},    {0, 1, 0},     {1, 0.5F, 0},
                                       {0, 0.5F, 1}, {-1, 0.5F, 0}, {5, 5, 5}};
  const std::vector<Triangle> two = {{0, 1, 2}, {1, 0, 3}};
  const std::vector<Triangle> three = {{0, 1, 2}, {1, 0, 3}, {1, 0, 4}};
  const std::vector<Triangle> turned = {{0, 1, 2}, {0, 1, 3}};
  EXPECT_NE(mean_curvature(positions, two, 0.5)[0], 0);
  EXPECT_EQ(mean_curvature(positions, three, 0.5)[0], 0);
  EXPECT_EQ(mean_curvature(positions, turned, 0.5)[0], 0);
  EXPECT_EQ(mean_curvature(positions, two, 0.5)[5], 0);  // of no triangle
  std::vector<Vec3> broken = positions;
  broken[3].x = std::numeric_limits<float>::quiet_NaN();
  for (const double found : mean_curvature(broken, two, 0.5)) EXPECT_EQ(found, 0);
  EXPECT_TRUE(mean_curvature({}, {}, 1).empty());
}

}  // namespace
}  // namespace kiln

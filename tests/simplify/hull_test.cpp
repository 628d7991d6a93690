// Hulls: what is enclosed stays enclosed, held against winding numbers by brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/simplify.h"
#include "reference/closest.h"
#include "simplify/enclosing_hull_constraint.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Winding number of a closed surface around a point: the sum of its triangles' solid angles (van Oosterom and Strackee
/// 1983).
double winding_number(const Mesh& mesh, const Vec3d& at) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    std::array<Vec3d, 3> p{};
    std::array<double, 3> size{};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = to_double(mesh.positions[t[k]]) - at;
      size[k] = length(p[k]);
    }
    const double above = dot(p[0], cross(p[1], p[2]));
    const double below = size[0] * size[1] * size[2] + dot(p[0], p[1]) * size[2] +
                         dot(p[1], p[2]) * size[0] + dot(p[2], p[0]) * size[1];
    sum += 2 * std::atan2(above, below);
  }
  return sum / (4 * kPi);
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                c = to_double(mesh.positions[t[2]]);
    sum += dot(a, cross(b, c)) / 6;
  }
  return sum;
}

/// Vertices that the surface neither winds around nor touches.
std::size_t count_outside(const Mesh& high, const Mesh& low, double touching) {
  std::size_t count = 0;
  for (const Vec3& p : high.positions) {
    if (winding_number(low, to_double(p)) > 0.999) continue;
    bool touched = false;
    for (const Triangle& t : low.triangles) {
      touched =
          touched || reference::triangle_distance(low.positions, t, {p.x, p.y, p.z}) <= touching;
    }
    count += !touched;
  }
  return count;
}

void append(Mesh& mesh, const Mesh& part, const Vec3& at) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : part.positions)
    mesh.positions.push_back({p.x + at.x, p.y + at.y, p.z + at.z});
  for (const Triangle& t : part.triangles) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

/// A shell 0.02 thick, its inner side turned inwards.
Mesh thin_shell() {
  Mesh mesh;
  append(mesh, test::icosphere(4), {});
  Mesh inner = test::icosphere(4, 0.98);
  for (Triangle& t : inner.triangles) std::swap(t[1], t[2]);
  append(mesh, inner, {});
  return mesh;
}

struct Case {
  std::string name;
  Mesh high;
  std::uint32_t faces;
};

std::vector<Case> cases() {
  std::vector<Case> all = {{"bumps", test::BumpySphere::dense(6000), 400},
                           {"torus", test::BumpyTorus::dense(6000), 600},
                           {"sphere", test::icosphere(4), 100},
                           {"shell", thin_shell(), 300}};
  Mesh crossing;
  append(crossing, test::icosphere(4), {});
  append(crossing, test::icosphere(4), {0.8F, 0.1F, 0});
  all.push_back({"crossing", crossing, 200});
  Mesh far = test::BumpySphere::dense(4000);
  for (Vec3& p : far.positions) p = {p.x + 1000, p.y - 300, p.z + 50};
  all.push_back({"far", far, 300});
  return all;
}

TEST(Hull, EnclosesEveryVertexOfTheHighPoly) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    SimplifyReport report;
    const Mesh low = simplify(c.high, {.faces = c.faces, .hull = true}, &report);
    EXPECT_LE(low.triangles.size(), 2 * c.faces);
    EXPECT_EQ(report.folded + report.without_area + report.holes, 0U);
    EXPECT_EQ(count_outside(c.high, low, 1e-9), 0U);
    EXPECT_GE(volume(low), volume(c.high) * (1 - 1e-9));
    // The oracle sees what pokes through.
    EXPECT_GT(count_outside(c.high, simplify(c.high, {.faces = c.faces}), 1e-9),
              c.high.positions.size() / 10);
  }
}

TEST(Hull, ABoundHolds) {
  const Mesh high = test::BumpySphere::dense(6000);
  SimplifyReport report;
  const Mesh low = simplify(high, {.max_error = 0.01, .hull = true}, &report);
  EXPECT_LT(low.triangles.size(), 1500U);
  EXPECT_LE(report.error, 0.01);
  EXPECT_EQ(count_outside(high, low, 1e-9), 0U);
}

/// Flat sides stay where they are, to the last bit.
TEST(Hull, ABoxOfManyTrianglesIsABoxAgain) {
  Mesh high;
  const std::uint32_t n = 8;
  for (int side = 0; side < 6; ++side) {
    Mesh plane = test::plane(n, n, 2, 2);
    for (Vec3& p : plane.positions) {
      p.z = 1;
      for (int turn = 0; turn < side && side < 4; ++turn) p = {p.z, p.y, -p.x};
      if (side == 4) p = {p.x, p.z, -p.y};
      if (side == 5) p = {p.x, -p.z, p.y};
    }
    append(high, plane, {});
  }
  const Mesh low = simplify(high, {.faces = 12, .hull = true});
  EXPECT_EQ(low.triangles.size(), 12U);
  EXPECT_NEAR(volume(low), 8, 1e-6);
  EXPECT_EQ(count_outside(high, low, 1e-7), 0U);
}

/// Without what lies above and below.
Mesh cut(const Mesh& mesh, float height) {
  Mesh result = mesh;
  std::erase_if(result.triangles, [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(),
                       [&](std::uint32_t v) { return std::abs(mesh.positions[v].z) > height; });
  });
  return result;
}

/// Vertices that lie above the nearest triangle, but near where the mesh was cut: there the nearest one ends.
std::size_t count_above(const Mesh& high, const Mesh& low, float height) {
  std::size_t count = 0;
  std::vector<std::uint8_t> used(high.positions.size(), 0);
  for (const Triangle& t : high.triangles) {
    for (const std::uint32_t v : t) used[v] = 1;
  }
  for (std::size_t v = 0; v < used.size(); ++v) {
    const Vec3& p = high.positions[v];
    if (used[v] == 0 || std::abs(p.z) > height) continue;
    double nearest = 1e9, above = 0;
    for (const Triangle& t : low.triangles) {
      const double distance = reference::triangle_distance(low.positions, t, {p.x, p.y, p.z});
      if (!(distance < nearest)) continue;
      nearest = distance;
      const Vec3d a = to_double(low.positions[t[0]]), b = to_double(low.positions[t[1]]),
                  c = to_double(low.positions[t[2]]);
      above = dot(to_double(p) - a, cross(b - a, c - a));
    }
    count += nearest > 1e-6 && above > 0;
  }
  return count;
}

/// If borders stay as they were, their edges are all that is left.
TEST(Hull, OpenMeshesHaveHullsAsTightAsClosedOnes) {
  const Mesh closed = test::BumpySphere::dense(20000);
  const Mesh open = cut(closed, 0.75F);
  SimplifyReport of_closed, of_open;
  simplify(closed, {.faces = 150, .hull = true}, &of_closed);
  const Mesh low = simplify(open, {.faces = 150, .hull = true}, &of_open);
  EXPECT_LE(low.triangles.size(), 150U);
  EXPECT_EQ(of_open.folded + of_open.without_area + of_open.holes, 0U);
  EXPECT_LT(of_open.error, 1.5 * of_closed.error);
  EXPECT_EQ(count_above(open, low, 0.55F), 0U);
  // A low poly that may cut corners does.
  EXPECT_GT(count_above(open, simplify(open, {.faces = 150}), 0.55F), 100U);
}

/// A flat sheet stays covered: its border moves outwards alone.
TEST(Hull, BordersOfFlatSheetsMoveOutwardsAlone) {
  constexpr int kSides = 64;
  Mesh disc;
  disc.positions.push_back({0, 0, 0});
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * kPi * i / kSides;
    disc.positions.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
    const auto at = static_cast<std::uint32_t>(i);
    disc.triangles.push_back({0, at + 1, (at + 1) % kSides + 1});
  }
  SimplifyReport report;
  const Mesh low = simplify(disc, {.faces = 12, .hull = true}, &report);
  EXPECT_LE(low.triangles.size(), 12U);
  double area = 0;
  for (const Triangle& t : low.triangles) {
    const Vec3 &a = low.positions[t[0]], &b = low.positions[t[1]], &c = low.positions[t[2]];
    area +=
        ((double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x)) / 2;
  }
  EXPECT_GE(area, kPi * 0.998);
  EXPECT_LT(area, kPi * 1.15);
  EXPECT_LT(report.error, 1e-5);
}

std::uint64_t inside_out(const Mesh& high) {
  SimplifyReport report;
  simplify(high, {.faces = 100, .hull = true}, &report);
  for (const Warning& warning : report.warnings) {
    if (warning.code == "inside-out") return warning.count;
  }
  return 0;
}

TEST(Hull, SaysWhatIsInsideOut) {
  Mesh turned = test::icosphere(3);
  EXPECT_EQ(inside_out(turned), 0U);
  for (Triangle& t : turned.triangles) std::swap(t[1], t[2]);
  EXPECT_EQ(inside_out(turned), 1U);
  Mesh two = test::icosphere(3);
  append(two, turned, {3, 0, 0});
  EXPECT_EQ(inside_out(two), 1U);
  // The inner side of a shell faces inwards rightly, and what is open has no inside.
  EXPECT_EQ(inside_out(thin_shell()), 0U);
  EXPECT_EQ(inside_out(cut(turned, 0.8F)), 0U);
}

TEST(Hull, ExcludesWhatElseSaysWhereVerticesGo) {
  EXPECT_THROW(simplify(test::uv_sphere(8, 8), {.faces = 20, .keep_uvs = true, .hull = true}),
               Error);
  EXPECT_THROW(simplify(test::plane(4, 4), {.faces = 4, .height_field = true, .hull = true}),
               Error);
}

/// Repeatable numbers in [-1, 1).
struct Random {
  std::uint64_t state = 88172645463325252U;
  double operator()() {
    state ^= state << 13U;
    state ^= state >> 7U;
    state ^= state << 17U;
    return static_cast<double>(state >> 11U) / 4503599627370496.0 - 1;
  }
  Vec3d vector() {
    const double x = (*this)(), y = (*this)();
    return {x, y, (*this)()};
  }
};

/// No point within that is better: many are tried around the answer, ever nearer.
TEST(LeastWithin, NothingWithinIsBetter) {
  Random random;
  std::size_t found = 0;
  for (int round = 0; round < 400; ++round) {
    Quadric quadric;
    for (int i = 0; i < 4; ++i) {
      const Vec3d n = random.vector();
      quadric.add_plane(n * (1 / length(n)), random.vector() * 0.3, 1);
    }
    std::vector<HalfSpace> spaces;
    for (int i = 0; i < round % 12; ++i) {
      const Vec3d n = random.vector();
      spaces.push_back({n * (1 / length(n)), 0.4 * random()});
    }
    const Vec3d a{-1, 0, 0}, b{1, 0.5, 0};
    const std::optional<Vec3d> best = minimum_within(quadric, a, b, spaces, 0.01);
    const auto within = [&](const Vec3d& p, double slack) {
      for (const HalfSpace& space : spaces) {
        if (dot(space.normal, p) < space.offset + slack) return false;
      }
      return true;
    };
    const Vec3d middle = (a + b) * 0.5;
    const double pull = 1e-3 * (quadric.xx + quadric.yy + quadric.zz);
    const auto cost = [&](const Vec3d& p) {
      return quadric.at(p) + pull * dot(p - middle, p - middle);
    };
    if (best) {
      ++found;
      EXPECT_TRUE(within(*best, 0.01 - 1e-9));
    }
    for (int i = 0; best && i < 3000; ++i) {
      const Vec3d p = *best + random.vector() * std::pow(0.5, i % 20);
      if (within(p, 0.01)) {
        ASSERT_GE(cost(p), cost(*best) - 1e-9) << round;
      }
    }
  }
  EXPECT_GT(found, 250U);
}

}  // namespace
}  // namespace kiln

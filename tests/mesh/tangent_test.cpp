#include "mesh/tangent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

namespace kiln {
namespace {

struct Soup {
  std::vector<Vec3> positions, normals;
  std::vector<Vec2> uvs;
  void corner(const Vec3& p, const Vec3& n, const Vec2& uv) {
    positions.push_back(p);
    normals.push_back(n);
    uvs.push_back(uv);
  }
  std::vector<CornerTangent> tangents() const { return mikk_tangents(positions, normals, uvs); }
};

float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

constexpr Vec3 kUp{0, 0, 1};
// Inputs and result are floats: a unit vector's component is off by at most a few 2^-24.
constexpr float kTolerance = 1e-6F;

void expect_tangent(const CornerTangent& actual, const Vec3& tangent, float sign,
                    float tolerance = kTolerance) {
  EXPECT_NEAR(actual.tangent.x, tangent.x, tolerance);
  EXPECT_NEAR(actual.tangent.y, tangent.y, tolerance);
  EXPECT_NEAR(actual.tangent.z, tangent.z, tolerance);
  EXPECT_EQ(actual.sign, sign);
}

/// A flat square [x, x + 1] x [0, 1] of two triangles, with UVs that a function gives.
template <typename Uv>
void add_square(Soup& soup, float x, const Uv& uv) {
  const Vec3 p[4] = {{x, 0, 0}, {x + 1, 0, 0}, {x + 1, 1, 0}, {x, 1, 0}};
  for (std::size_t k : {0U, 1U, 2U, 0U, 2U, 3U}) soup.corner(p[k], kUp, uv(p[k]));
}

TEST(Tangent, PlaneFollowsU) {
  for (int turn = 0; turn < 8; ++turn) {
    const float angle = static_cast<float>(turn) * 0.785398F;
    const float c = std::cos(angle);
    const float s = std::sin(angle);
    Soup soup;
    add_square(soup, 0, [&](const Vec3& p) { return Vec2{c * p.x + s * p.y, -s * p.x + c * p.y}; });
    for (const CornerTangent& t : soup.tangents()) expect_tangent(t, {c, s, 0}, 1);
  }
}

TEST(Tangent, ShearedUvsGiveTheDirectionOfUAlone) {
  // u = x + y / 2, v = y: P = (u - v / 2, v), so dP/du is +x and dP/dv = (-1/2, 1) plays no part.
  Soup soup;
  add_square(soup, 0, [](const Vec3& p) { return Vec2{p.x + p.y / 2, p.y}; });
  for (const CornerTangent& t : soup.tangents()) expect_tangent(t, {1, 0, 0}, 1);
}

TEST(Tangent, MirroredUvsTurnTheSign) {
  Soup soup;
  add_square(soup, 0, [](const Vec3& p) { return Vec2{-p.x, p.y}; });
  for (const CornerTangent& t : soup.tangents()) expect_tangent(t, {-1, 0, 0}, -1);
}

// Handedness against the surface itself: every UV of a corner's triangle, moved along +u and +v, moves the point along
// the tangent and along sign * cross(normal, tangent). For both windings of the surface with their normals, both
// windings of the layout, and all turns of it. The derivatives are solved for here, by Cramer's rule.
TEST(Tangent, TurnsWithTheWindingOfSurfaceAndLayout) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> place(-1, 1);
  int signs[2] = {0, 0};
  for (int i = 0; i < 400; ++i) {
    Vec3 p[3];
    Vec2 uv[3];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = {place(random), place(random), place(random)};
      uv[k] = {place(random), place(random)};
    }
    const Vec3 e{p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z},
        f{p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
    Vec3 n{e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x};
    const float size = std::sqrt(dot(n, n));
    const float a = uv[1].x - uv[0].x, b = uv[1].y - uv[0].y, c = uv[2].x - uv[0].x,
                d = uv[2].y - uv[0].y, area = a * d - b * c;
    if (size < 0.2F || std::abs(area) < 0.05F) continue;
    // Wound the other way: seen from its other side, where its normal is.
    const bool turned = i % 2 != 0;
    n = {n.x / size, n.y / size, n.z / size};
    if (turned) n = {-n.x, -n.y, -n.z};
    Soup soup;
    for (const std::size_t k :
         turned ? std::array<std::size_t, 3>{0, 2, 1} : std::array<std::size_t, 3>{0, 1, 2}) {
      soup.corner(p[k], n, uv[k]);
    }
    const Vec3 along_u{(e.x * d - f.x * b) / area, (e.y * d - f.y * b) / area,
                       (e.z * d - f.z * b) / area};
    const Vec3 along_v{(f.x * a - e.x * c) / area, (f.y * a - e.y * c) / area,
                       (f.z * a - e.z * c) / area};
    for (const CornerTangent& t : soup.tangents()) {
      const Vec3& x = t.tangent;
      const Vec3 up{t.sign * (n.y * x.z - n.z * x.y), t.sign * (n.z * x.x - n.x * x.z),
                    t.sign * (n.x * x.y - n.y * x.x)};
      // The tangent is the direction of u; the bitangent is square to it, on the side of v.
      EXPECT_NEAR(dot(x, along_u), std::sqrt(dot(along_u, along_u)), 1e-4F) << i;
      EXPECT_GT(dot(up, along_v), 0) << i;
      ++signs[t.sign > 0 ? 1 : 0];
    }
  }
  EXPECT_GT(signs[0], 200);
  EXPECT_GT(signs[1], 200);
}

TEST(Tangent, NothingIsSharedAcrossAMirrorSeam) {
  // Two squares that meet at x = 1 with u = |x - 1|: equal position, normal and UV along the seam.
  Soup soup;
  const auto uv = [](const Vec3& p) { return Vec2{std::abs(p.x - 1), p.y}; };
  add_square(soup, 0, uv);
  add_square(soup, 1, uv);
  const std::vector<CornerTangent> tangents = soup.tangents();
  for (std::size_t i = 0; i < 6; ++i) expect_tangent(tangents[i], {-1, 0, 0}, -1);
  for (std::size_t i = 6; i < 12; ++i) expect_tangent(tangents[i], {1, 0, 0}, 1);
}

TEST(Tangent, UvSeamsSplitAndSmoothUvsShare) {
  // Left: u along +x. Right: u along the diagonal. Joined at x = 1 in space.
  const auto left = [](const Vec3& p) { return Vec2{p.x, p.y}; };
  Soup split;
  add_square(split, 0, left);
  add_square(split, 1, [](const Vec3& p) { return Vec2{5 + p.x + p.y, p.y - p.x}; });
  const float h = std::sqrt(0.5F);
  const std::vector<CornerTangent> apart = split.tangents();
  for (std::size_t i = 0; i < 6; ++i) expect_tangent(apart[i], {1, 0, 0}, 1);
  for (std::size_t i = 6; i < 12; ++i) expect_tangent(apart[i], {h, h, 0}, 1);

  // Now continuous over x = 1: u = x on the left, u = x + y (x - 1) on the right.
  Soup joined;
  const auto right = [](const Vec3& p) { return Vec2{p.x + p.y * (p.x - 1), p.y}; };
  add_square(joined, 0, left);
  add_square(joined, 1, right);
  const std::vector<CornerTangent> shared = joined.tangents();
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 6; j < 12; ++j) {
      if (!(joined.positions[i] == joined.positions[j])) continue;
      ++pairs;
      EXPECT_EQ(shared[i].tangent, shared[j].tangent);
    }
  }
  EXPECT_EQ(pairs,
            4U);  // two corners at (1, 0), one at (1, 1) on the left; one and two on the right
}

TEST(Tangent, CornersAreWeightedByTheirAngle) {
  // Two triangles that share the edge from the origin to (0, 1) and its UVs. At the origin:
  //   A: 90 degrees, UVs = position: dP/du = (1, 0)
  //   B: 45 degrees, edges (0, 1) with uv (0, 1) and (-1, 1) with uv (-1, 0): dP/du = (1, -1)
  Soup fan;
  const auto put = [&](const Vec3& p, const Vec2& uv) { fan.corner(p, kUp, uv); };
  put({0, 0, 0}, {0, 0});
  put({1, 0, 0}, {1, 0});
  put({0, 1, 0}, {0, 1});
  put({0, 0, 0}, {0, 0});
  put({0, 1, 0}, {0, 1});
  put({-1, 1, 0}, {-1, 0});
  const double quarter = std::numbers::pi / 2;
  const double h = std::sqrt(0.5);
  const double x = quarter * 1 + quarter / 2 * h;
  const double y = -quarter / 2 * h;
  const double size = std::hypot(x, y);
  const Vec3 expected{static_cast<float>(x / size), static_cast<float>(y / size), 0};
  const std::vector<CornerTangent> result = fan.tangents();
  expect_tangent(result[0], expected, 1);
  expect_tangent(result[3], expected, 1);
  expect_tangent(result[1], {1, 0, 0}, 1);
  expect_tangent(result[5], {static_cast<float>(h), static_cast<float>(-h), 0}, 1);
}

/// A latitude-longitude sphere without its caps, u along the longitude.
Soup sphere(int rings, int segments, float u_sign) {
  const auto point = [&](int ring, int segment) {
    const double latitude = (static_cast<double>(ring) / rings - 0.5) * 2.4;
    const double longitude = 2 * std::numbers::pi * (segment % segments) / segments;
    return Vec3{static_cast<float>(std::cos(latitude) * std::cos(longitude)),
                static_cast<float>(std::cos(latitude) * std::sin(longitude)),
                static_cast<float>(std::sin(latitude))};
  };
  Soup soup;
  for (int ring = 0; ring < rings; ++ring) {
    for (int segment = 0; segment < segments; ++segment) {
      const int corners[6][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}};
      for (const auto& c : corners) {
        const Vec3 p = point(ring + c[0], segment + c[1]);
        const float u = static_cast<float>(segment + c[1]) / static_cast<float>(segments);
        soup.corner(p, p,
                    {u_sign * u, static_cast<float>(ring + c[0]) / static_cast<float>(rings)});
      }
    }
  }
  return soup;
}

TEST(Tangent, SphereTangentsRunAlongParallels) {
  for (float u_sign : {1.0F, -1.0F}) {
    const Soup soup = sphere(24, 48, u_sign);
    const std::vector<CornerTangent> tangents = soup.tangents();
    for (std::size_t i = 0; i < tangents.size(); ++i) {
      const Vec3& p = soup.positions[i];
      const float radius = std::hypot(p.x, p.y);
      const Vec3 east{-p.y / radius * u_sign, p.x / radius * u_sign, 0};
      // Inside a chart the facets' errors cancel by symmetry up to the diagonals; on the seam at u = 0
      // only one side counts: off by half a segment, 3.75 degrees, and the diagonals' share.
      EXPECT_GT(dot(tangents[i].tangent, east), std::cos(5 * std::numbers::pi / 180));
      EXPECT_NEAR(dot(tangents[i].tangent, p), 0, kTolerance);
      EXPECT_NEAR(dot(tangents[i].tangent, tangents[i].tangent), 1, kTolerance);
      EXPECT_EQ(tangents[i].sign, u_sign);
    }
  }
}

TEST(Tangent, HardEdgesKeepTangentsApart) {
  // Two squares at a right angle along x = 1 with continuous UVs but split normals.
  Soup soup;
  add_square(soup, 0, [](const Vec3& p) { return Vec2{p.x, p.y}; });
  const Vec3 q[4] = {{1, 0, 0}, {1, 0, -1}, {1, 1, -1}, {1, 1, 0}};
  for (std::size_t k : {0U, 1U, 2U, 0U, 2U, 3U}) {
    soup.corner(q[k], {1, 0, 0}, {1 - q[k].z, q[k].y});
  }
  const std::vector<CornerTangent> tangents = soup.tangents();
  for (std::size_t i = 0; i < 6; ++i) expect_tangent(tangents[i], {1, 0, 0}, 1);
  for (std::size_t i = 6; i < 12; ++i) expect_tangent(tangents[i], {0, 0, -1}, 1);
}

TEST(Tangent, SmoothNormalsProjectTheTangent) {
  // One triangle whose normals lean: each corner's tangent lies in its own normal plane.
  Soup soup;
  const float h = std::sqrt(0.5F);
  soup.corner({0, 0, 0}, {h, 0, h}, {0, 0});
  soup.corner({1, 0, 0}, {-h, 0, h}, {1, 0});
  soup.corner({0, 1, 0}, {0, 0, 1}, {0, 1});
  const std::vector<CornerTangent> tangents = soup.tangents();
  expect_tangent(tangents[0], {h, 0, -h}, 1);
  expect_tangent(tangents[1], {h, 0, h}, 1);
  expect_tangent(tangents[2], {1, 0, 0}, 1);
}

TEST(Tangent, DegenerateUvsTakeTheirNeighboursTangent) {
  // The second triangle of the square has the UVs of a line; it shares an edge with the first.
  Soup soup;
  soup.corner({0, 0, 0}, kUp, {0, 0});
  soup.corner({1, 0, 0}, kUp, {0, 1});
  soup.corner({1, 1, 0}, kUp, {-1, 1});  // u runs along -y: tangent (0, -1, 0)
  soup.corner({0, 0, 0}, kUp, {0, 0});
  soup.corner({1, 1, 0}, kUp, {-1, 1});
  soup.corner({0, 1, 0}, kUp, {-0.5F, 0.5F});
  const std::vector<CornerTangent> tangents = soup.tangents();
  for (std::size_t i = 0; i < 5; ++i) expect_tangent(tangents[i], {0, -1, 0}, 1);
  // The far corner has no good neighbour at its place: any unit tangent.
  EXPECT_NEAR(dot(tangents[5].tangent, tangents[5].tangent), 1, kTolerance);
  EXPECT_NEAR(dot(tangents[5].tangent, kUp), 0, kTolerance);
}

TEST(Tangent, DegenerateTrianglesBorrowAndNothingIsNan) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Soup soup;
  add_square(soup, 0, [](const Vec3& p) { return Vec2{p.y, -p.x}; });  // tangent +y
  // Two corners coincide; two of the three places are the square's, with other UVs.
  soup.corner({0, 0, 0}, kUp, {7, 7});
  soup.corner({0, 0, 0}, kUp, {7, 7});
  soup.corner({1, 0, 0}, kUp, {8, 7});
  // Not finite, in each of the inputs; all zero.
  soup.corner({nan, 0, 0}, kUp, {0, 0});
  soup.corner({1, 0, 0}, {nan, nan, nan}, {0, 0});
  soup.corner({1, 0, 0}, {0, 0, 0}, {nan, 0});
  for (int i = 0; i < 3; ++i) soup.corner({0, 0, 0}, {0, 0, 0}, {0, 0});
  const std::vector<CornerTangent> tangents = soup.tangents();
  ASSERT_EQ(tangents.size(), soup.positions.size());
  for (std::size_t i = 0; i < 9; ++i) expect_tangent(tangents[i], {0, 1, 0}, 1);
  for (const CornerTangent& t : tangents) {
    EXPECT_NEAR(dot(t.tangent, t.tangent), 1, kTolerance);
    EXPECT_EQ(std::abs(t.sign), 1);
  }
}

TEST(Tangent, EmptyInEmptyOut) { EXPECT_TRUE(mikk_tangents({}, {}, {}).empty()); }

TEST(Tangent, TriangleOrderAndFirstCornerHardlyMatter) {
  const Soup soup = sphere(10, 20, 1);
  const std::vector<CornerTangent> expected = soup.tangents();
  std::vector<std::size_t> order(soup.positions.size() / 3);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937 random(1);
  std::shuffle(order.begin(), order.end(), random);
  Soup shuffled;
  std::vector<std::size_t> from;
  for (std::size_t t : order) {
    const std::size_t turn = random() % 3;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = 3 * t + (k + turn) % 3;
      from.push_back(i);
      shuffled.corner(soup.positions[i], soup.normals[i], soup.uvs[i]);
    }
  }
  const std::vector<CornerTangent> result = shuffled.tangents();
  for (std::size_t i = 0; i < result.size(); ++i) {
    // Only the order of summing differs.
    expect_tangent(result[i], expected[from[i]].tangent, expected[from[i]].sign, 2e-7F);
  }
}

}  // namespace
}  // namespace kiln

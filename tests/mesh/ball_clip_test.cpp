// Triangles clipped by balls: against an oracle in extended precision, and eight at a time against one.
#include "mesh/ball_clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

namespace kiln {
namespace {

using Corners = std::array<Vec3d, 3>;

/// Triangles of all sizes around a ball of radius 1: within it, around it, across it, far, and without area.
std::vector<Corners> triangles() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(-1, 1);
  const auto point = [&](double size) {
    return Vec3d{size * part(random), size * part(random), size * part(random)};
  };
  std::vector<Corners> all;
  for (int i = 0; i < 4000; ++i) {
    const Vec3d middle = point(i % 3 == 0 ? 0.1 : 1.2);
    const double size = std::exp2(part(random) * 5 - 1);
    Corners corners{middle + point(size), middle + point(size), middle + point(size)};
    if (i % 4 == 0) {
      for (Vec3d& corner : corners) corner.z = 0;  // the plane passes through the ball's centre
    }
    if (i % 50 == 0) corners[1] = corners[0];
    if (i % 70 == 0) corners[2] = (corners[0] + corners[1]) * 0.5;
    all.push_back(corners);
  }
  all.push_back({Vec3d{9, 9, 0}, Vec3d{-9, 9, 0}, Vec3d{0, -20, 0}});  // holds the whole circle
  all.push_back({Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}});     // corners on the sphere
  all.push_back({Vec3d{0, 0, 0}, Vec3d{2, 0, 0}, Vec3d{0, 2, 0}});     // a corner at the centre
  all.push_back({Vec3d{}, Vec3d{}, Vec3d{}});
  return all;
}

/// The area by the sum over edges of the signed area between edge, circle and the circle's centre, in long double.
double clipped_area(const Corners& corners) {
  using Number = long double;
  using Vector = glm::vec<3, Number>;
  const Vector a(corners[0]), b(corners[1]), c(corners[2]);
  const Vector across = glm::cross(b - a, c - a);
  const Number size = glm::length(across);
  if (!(size > 0)) return 0;
  const Vector normal = across / size;
  const Number away = glm::dot(normal, a), squared = 1 - away * away;
  if (!(squared > 0)) return 0;
  const Vector right = glm::normalize(b - a), up = glm::cross(normal, right);
  const auto flat = [&](const Vector& p) {
    return std::complex<Number>(glm::dot(p, right), glm::dot(p, up));
  };
  const std::array<std::complex<Number>, 3> corner = {flat(a), flat(b), flat(c)};
  const auto sector = [&](std::complex<Number> p, std::complex<Number> q) {
    return squared / 2 * std::arg(q * std::conj(p));
  };
  Number area = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::complex<Number> p = corner[k], q = corner[(k + 1) % 3], way = q - p;
    const Number whole = std::norm(way), half = (p * std::conj(way)).real();
    const Number root = half * half - whole * (std::norm(p) - squared);
    const Number reach = root > 0 ? std::sqrt(root) : 0;
    const Number begin = std::clamp((-half - reach) / whole, Number{0}, Number{1}),
                 end = std::clamp((-half + reach) / whole, Number{0}, Number{1});
    if (!(root > 0) || !(begin < end)) {
      area += sector(p, q);
      continue;
    }
    const std::complex<Number> in = p + way * begin, out = p + way * end;
    area += sector(p, in) + (std::conj(in) * out).imag() / 2 + sector(out, q);
  }
  return static_cast<double>(area);
}

TEST(BallClip, AreasAndSharesOfEdgesAreThoseOfTheOracle) {
  for (const Corners& corners : triangles()) {
    const BallClip clip = clip_by_ball(corners, 1);
    const double size = length(cross(corners[1] - corners[0], corners[2] - corners[0])) / 2;
    EXPECT_NEAR(clip.area, std::clamp(clipped_area(corners), 0.0, size),
                1e-13 * std::max(1.0, size));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d way = corners[(k + 1) % 3] - corners[k];
      int inside = 0;
      constexpr int kSteps = 2000;
      for (int i = 0; i < kSteps; ++i) {
        const Vec3d at = corners[k] + way * ((i + 0.5) / kSteps);
        inside += dot(at, at) < 1 ? 1 : 0;
      }
      if (dot(way, way) > 0) {
        EXPECT_NEAR(clip.edge_share[k], inside / double{kSteps}, 2.0 / kSteps);
      }
    }
  }
}

TEST(BallClip, EightTrianglesAtATimeHaveTheBitsOfOne) {
  std::vector<Corners> all = triangles();
  while (all.size() % BallBatch::kLanes != 0) all.push_back(all.front());
  constexpr std::array<double, 3> kAngles = {0.5, -0.25, 0.125};
  constexpr double kArea = 77, kBend = -5;
  int within = 0, outside = 0;
  for (std::size_t first = 0; first < all.size(); first += BallBatch::kLanes) {
    BallBatch batch;
    batch.area.fill(kArea);
    batch.bend.fill(kBend);
    for (std::size_t i = 0; i < BallBatch::kLanes; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d& corner = all[first + i][k];
        batch.corner[3 * k][i] = corner.x;
        batch.corner[3 * k + 1][i] = corner.y;
        batch.corner[3 * k + 2][i] = corner.z;
        batch.angle[k][i] = kAngles[k];
      }
    }
    sum_in_ball(batch, 1);
    for (std::size_t i = 0; i < BallBatch::kLanes; ++i) {
      const Corners& corners = all[first + i];
      if (std::ranges::all_of(corners, [](const Vec3d& p) { return dot(p, p) <= 1; })) {
        ++within;
        EXPECT_EQ(batch.area[i], kArea);
        EXPECT_EQ(batch.bend[i], kBend);
        continue;
      }
      const BallClip clip = clip_by_ball(corners, 1);
      double bend = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        bend += kAngles[k] * clip.edge_share[k] * length(corners[(k + 1) % 3] - corners[k]) / 4;
      }
      outside += clip.area == 0 ? 1 : 0;
      // A triangle whose box lies outside of the ball counts nothing, where clipping may leave a rounding error.
      if (batch.area[i] == 0) {
        EXPECT_LT(clip.area, 1e-15);
        continue;
      }
      EXPECT_EQ(batch.area[i], clip.area);
      EXPECT_EQ(batch.bend[i], bend);
    }
  }
  EXPECT_GT(within, 100);
  EXPECT_GT(outside, 100);
}

}  // namespace
}  // namespace kiln

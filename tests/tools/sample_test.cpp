// The sample scenes that the quick start bakes: closed, as dense as asked for, the same every time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kiln/mesh.h"
#include "scenes.h"

namespace kiln::sample {
namespace {

void expect_closed_and_finite(const Mesh& mesh) {
  for (const Vec3& p : mesh.positions) {
    ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) << mesh.name;
    ASSERT_LT(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 1.3f) << mesh.name;
  }
  std::vector<std::uint64_t> forward, backward;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = t[i], b = t[(i + 1) % 3];
      ASSERT_LT(a, mesh.positions.size());
      ASSERT_NE(a, b) << mesh.name;
      forward.push_back(a << 32 | b);
      backward.push_back(b << 32 | a);
    }
  }
  std::sort(forward.begin(), forward.end());
  std::sort(backward.begin(), backward.end());
  EXPECT_EQ(std::adjacent_find(forward.begin(), forward.end()), forward.end()) << mesh.name;
  EXPECT_EQ(forward, backward) << mesh.name;
  // Euler: a closed surface without handles.
  EXPECT_EQ(mesh.positions.size(), mesh.triangles.size() / 2 + 2) << mesh.name;
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
    sum += p.x * (double{q.y} * r.z - double{q.z} * r.y) +
           p.y * (double{q.z} * r.x - double{q.x} * r.z) +
           p.z * (double{q.x} * r.y - double{q.y} * r.x);
  }
  return sum / 6;
}

TEST(Sample, IsClosedAndOutwardAndAsDenseAsAsked) {
  for (const std::uint64_t faces : {1000u, 5000u, 60000u}) {
    for (const Mesh& mesh : {urn(faces), rock(faces)}) {
      expect_closed_and_finite(mesh);
      EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), static_cast<double>(faces),
                  0.04 * static_cast<double>(faces))
          << mesh.name;
      EXPECT_GT(volume(mesh), 1.0) << mesh.name;
    }
  }
}

TEST(Sample, IsTheSameEveryTime) {
  EXPECT_EQ(urn(20000).positions, urn(20000).positions);
  EXPECT_EQ(rock(20000).positions, rock(20000).positions);
}

}  // namespace
}  // namespace kiln::sample

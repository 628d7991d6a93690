// Which triangles lie back to back, and which of them are backs.
#include "mesh/two_sided.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "support/shapes.h"

namespace kiln {
namespace {

Triangle turned(const Triangle& t) { return {t[0], t[2], t[1]}; }

float height_of_normal(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
  return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
}

TEST(TwoSided, FindsNoneInSingleSheetsAndSolids) {
  EXPECT_TRUE(TwoSided::of(test::plane(9, 7)).empty());
  EXPECT_TRUE(TwoSided::of(test::cube()).empty());
}

TEST(TwoSided, PairsAllInAnyOrderAndTurnsFrontsToOneSide) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Mesh mesh = test::plane(8, 6);
    std::vector<Triangle> all = mesh.triangles;
    for (const Triangle& t : mesh.triangles) all.push_back(turned(t));
    std::mt19937 random(seed);
    std::shuffle(all.begin(), all.end(), random);
    mesh.triangles = all;
    for (Triangle& t : mesh.triangles) std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    const TwoSided sides = TwoSided::of(mesh);
    ASSERT_EQ(sides.twins.size(), mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      ASSERT_NE(sides.twins[t], TwoSided::kNone);
      EXPECT_EQ(sides.twins[sides.twins[t]], t);
      const bool as_first = height_of_normal(mesh, t) > 0 == height_of_normal(mesh, 0) > 0;
      EXPECT_EQ(sides.backs[t] != 0, !as_first) << seed << ": " << t;
      EXPECT_EQ(sides.has_only_pairs.at(t), 1);
    }
  }
}

TEST(TwoSided, PairsByPositionsNotByIndices) {
  Mesh mesh = test::plane(3, 3);
  const std::size_t front = mesh.triangles.size();
  const auto shift = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), mesh.positions.begin(), mesh.positions.end());
  for (std::size_t t = 0; t < front; ++t) {
    Triangle back = turned(mesh.triangles[t]);
    for (std::uint32_t& v : back) v += shift;
    mesh.triangles.push_back(back);
  }
  const TwoSided sides = TwoSided::of(mesh);
  for (std::uint32_t t = 0; t < front; ++t) EXPECT_EQ(sides.twins.at(t), t + front);
}

TEST(TwoSided, LeavesOutWhatLiesThereThrice) {
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 1}, {1, 2, 0}, {2, 3, 0}, {3, 2, 0}};
  const TwoSided sides = TwoSided::of(triangles, 4);
  EXPECT_EQ(sides.twins,
            (std::vector<std::uint32_t>{TwoSided::kNone, TwoSided::kNone, TwoSided::kNone, 4, 3}));
  EXPECT_EQ(sides.backs, (std::vector<std::uint8_t>{0, 0, 0, 0, 1}));
  EXPECT_TRUE(TwoSided::of(std::vector<Triangle>{{0, 1, 2}, {1, 2, 0}}, 3).empty());
}

TEST(TwoSided, FrontsGoOnAsTheSurfaceAround) {
  Mesh mesh = test::plane(5, 5);
  // Backs of some in the middle, before all others.
  const std::vector<Triangle> backs{turned(mesh.triangles[24]), turned(mesh.triangles[25]),
                                    turned(mesh.triangles[11])};
  mesh.triangles.insert(mesh.triangles.begin(), backs.begin(), backs.end());
  const TwoSided sides = TwoSided::of(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    EXPECT_EQ(sides.backs.at(t) != 0, t < backs.size()) << t;
    EXPECT_EQ(sides.has_only_pairs.at(t), 0);
  }
}

TEST(TwoSided, AMoebiusBandHasOneBackAPair) {
  constexpr std::uint32_t kSteps = 12;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const std::uint32_t a = 2 * i, b = a + 1;
    const bool last = i + 1 == kSteps;  // The ends are joined the other way round.
    const std::uint32_t c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    for (const Triangle& t : {Triangle{a, b, c}, Triangle{b, d, c}}) {
      triangles.push_back(t);
      triangles.push_back(turned(t));
    }
  }
  const TwoSided sides = TwoSided::of(triangles, 2 * std::size_t{kSteps});
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    ASSERT_NE(sides.twins.at(t), TwoSided::kNone);
    EXPECT_NE(sides.backs[t], sides.backs[sides.twins[t]]);
  }
}

}  // namespace
}  // namespace kiln

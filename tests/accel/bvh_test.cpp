#include "accel/bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "kiln/error.h"

namespace kiln {
namespace {

struct Soup {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  void add(Vec3 a, Vec3 b, Vec3 c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
};

Soup random_soup(std::size_t count, unsigned seed, float size = 0.02f) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.5f, 0.5f);
  std::uniform_real_distribution<float> step(-size, size);
  Soup soup;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 a{place(random), place(random), place(random)};
    soup.add(a, {a.x + step(random), a.y + step(random), a.z + step(random)},
             {a.x + step(random), a.y + step(random), a.z + step(random)});
  }
  return soup;
}

/// Walks the tree: each usable triangle in exactly one leaf, each box around what hangs below it.
struct Walk {
  const Bvh& bvh;
  const Soup& soup;
  std::vector<int> seen = std::vector<int>(soup.triangles.size());
  std::uint32_t depth = 0;

  void leaf(std::uint32_t index, const kiln_bvh_node& node, int child) {
    ASSERT_LT(index, bvh.block_count);
    const kiln_bvh_block& block = bvh.blocks()[index];
    for (int lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
      if (block.triangle[lane] == KILN_NO_TRIANGLE) {
        EXPECT_GT(lane, 0);
        continue;
      }
      ASSERT_LT(block.triangle[lane], soup.triangles.size());
      ++seen[block.triangle[lane]];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const Vec3& p = soup.positions[soup.triangles[block.triangle[lane]][corner]];
        const float axes[3] = {p.x, p.y, p.z};
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(block.corner[corner][axis][lane], axes[axis]);
          EXPECT_LE(node.planes[axis][0][child], axes[axis] - KILN_BVH_EPSILON);
          EXPECT_GE(node.planes[axis][1][child], axes[axis] + KILN_BVH_EPSILON);
        }
      }
    }
  }

  void node(std::uint32_t index, std::uint32_t level) {
    ASSERT_LT(index, bvh.node_count);
    depth = std::max(depth, level);
    const kiln_bvh_node& node = bvh.nodes()[index];
    for (int i = 0; i < KILN_BVH_WIDTH; ++i) {
      if (node.planes[0][0][i] > node.planes[0][1][i]) continue;  // unused
      const std::uint32_t child = node.child[i];
      if ((child & KILN_BVH_LEAF) != 0) {
        leaf(child & ~KILN_BVH_LEAF, node, i);
        continue;
      }
      const std::uint32_t next = node_of_child(child);
      ASSERT_GT(next, index);
      ASSERT_LT(next, bvh.node_count);
      const kiln_bvh_node& below = bvh.nodes()[next];
      for (int j = 0; j < KILN_BVH_WIDTH; ++j) {
        if (below.planes[0][0][j] > below.planes[0][1][j]) continue;
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_LE(node.planes[axis][0][i], below.planes[axis][0][j]);
          EXPECT_GE(node.planes[axis][1][i], below.planes[axis][1][j]);
        }
      }
      this->node(next, level + 1);
    }
  }
};

void check(const Soup& soup) {
  const Bvh bvh = build_bvh(soup.positions, soup.triangles);
  EXPECT_EQ(bvh.triangles + bvh.skipped + bvh.duplicates, soup.triangles.size());
  EXPECT_LE(bvh.depth, static_cast<std::uint32_t>(KILN_BVH_MAX_DEPTH));
  Walk walk{bvh, soup};
  walk.node(0, 1);
  EXPECT_EQ(walk.depth, bvh.depth);
  std::uint64_t once = 0;
  for (int times : walk.seen) {
    EXPECT_LE(times, 1);
    once += static_cast<std::uint64_t>(times);
  }
  EXPECT_EQ(once, bvh.triangles);
}

TEST(Bvh, HoldsEachTriangleOnceWithinItsBoxes) {
  for (std::size_t count : {1u, 2u, 4u, 5u, 8u, 31u, 33u, 1000u, 20000u}) {
    SCOPED_TRACE(count);
    check(random_soup(count, static_cast<unsigned>(count)));
  }
}

TEST(Bvh, EmptyMeshHasARootThatNothingMeets) {
  const Bvh bvh = build_bvh({}, {});
  ASSERT_EQ(bvh.node_count, 1u);
  EXPECT_EQ(bvh.block_count, 0u);
  for (int i = 0; i < KILN_BVH_WIDTH; ++i) {
    EXPECT_GT(bvh.nodes()[0].planes[1][0][i], bvh.nodes()[0].planes[1][1][i]);
  }
}

TEST(Bvh, SkipsAndCountsWhatCannotBeHit) {
  Soup soup = random_soup(100, 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  soup.add({0, 0, 0}, {1, 0, 0}, {nan, 1, 0});
  soup.add({0, 0, 0}, {1, infinity, 0}, {0, 1, 0});
  soup.add({0, 0, 0}, {0, 0, 0}, {0, 1, 0});
  soup.add({0.1f, 0.1f, 0.1f}, {0.2f, 0.2f, 0.2f}, {0.3f, 0.3f, 0.3f});
  const Bvh bvh = build_bvh(soup.positions, soup.triangles);
  EXPECT_EQ(bvh.skipped, 4u);
  check(soup);
}

TEST(Bvh, BadIndexIsAnInputErrorThatNamesTheTriangle) {
  Soup soup = random_soup(3, 1);
  soup.triangles[1][2] = 77;
  try {
    build_bvh(soup.positions, soup.triangles);
    FAIL() << "accepted an index out of range";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_NE(std::string(error.what()).find("Triangle 1 "), std::string::npos);
  }
}

TEST(Bvh, DepthIsBoundedForIdenticalTriangles) {
  Soup soup;
  for (int i = 0; i < 50000; ++i) soup.add({0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0});
  check(soup);
}

TEST(Bvh, OneOfEachKindOfTheSameTrianglesStays) {
  Soup soup = random_soup(500, 3);
  const Vec3 a{0, 0, 0}, b{0.5f, 0, 0}, c{0, 0.5f, 0};
  for (int i = 0; i < 3000; ++i) {
    soup.add(a, b, c);
    soup.add(b, c, a);  // other numbers for what is found, and so another one
    soup.add(a, c, b);  // looks the other way
  }
  for (std::size_t i = 0; i < 100; ++i) soup.triangles.push_back(soup.triangles[7 * i]);
  check(soup);
  const Bvh bvh = build_bvh(soup.positions, soup.triangles);
  // Those of the 100 that were copied from beyond the first 500 are of the three kinds.
  const std::uint64_t copies = 3 * 2999 + 100;
  EXPECT_EQ(bvh.duplicates, copies);
  EXPECT_EQ(bvh.triangles, 503u);
  for (const kiln_bvh_block& block : bvh.blocks()) {
    for (const kiln_uint triangle : block.triangle) {
      EXPECT_TRUE(triangle < 503u || triangle == KILN_NO_TRIANGLE) << "not the lowest";
    }
  }
  // A mesh that will move keeps all triangles.
  const Bvh all = build_bvh(soup.positions, soup.triangles, false);
  EXPECT_EQ(all.duplicates, 0u);
  EXPECT_EQ(all.triangles, soup.triangles.size());
}

TEST(Bvh, DepthIsBoundedForConcentricTriangles) {
  Soup soup;
  for (int i = 0; i < 20000; ++i) {
    const float r = 1e-5f * static_cast<float>(i + 1);
    soup.add({-r, -r, 0}, {r, -r, 0}, {0, 2 * r, 0});
  }
  check(soup);
}

TEST(Bvh, DepthIsBoundedForGeometricSeries) {
  Soup soup;
  for (int i = 0; i < 120; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const float r = std::ldexp(1.0f, -i);
      soup.add({axis == 0 ? r : 0, axis == 1 ? r : 0, axis == 2 ? r : 0},
               {axis == 0 ? r : r / 4, axis == 1 ? r : 0, axis == 2 ? r : 0},
               {axis == 0 ? r : 0, axis == 1 ? r : r / 4, axis == 2 ? r : r / 4});
    }
  }
  check(soup);
}

TEST(Bvh, SurvivesHugeCoordinates) {
  Soup soup = random_soup(200, 5);
  soup.add({-3e38f, 0, 0}, {3e38f, 1, 0}, {0, 3e38f, 3e38f});
  soup.add({3e38f, 3e38f, 3e38f}, {3e38f, 1, 3e38f}, {0, 3e38f, 3e38f});
  const Bvh bvh = build_bvh(soup.positions, soup.triangles);
  EXPECT_EQ(bvh.triangles + bvh.skipped, soup.triangles.size());
}

TEST(Bvh, TwoBuildsAreTheSameBytes) {
  const Soup soup = random_soup(60000, 9);
  const Bvh a = build_bvh(soup.positions, soup.triangles);
  const Bvh b = build_bvh(soup.positions, soup.triangles);
  ASSERT_EQ(a.node_count, b.node_count);
  ASSERT_EQ(a.block_count, b.block_count);
  EXPECT_EQ(0, std::memcmp(a.nodes().data(), b.nodes().data(), a.nodes().size_bytes()));
  EXPECT_EQ(0, std::memcmp(a.blocks().data(), b.blocks().data(), a.blocks().size_bytes()));
}

}  // namespace
}  // namespace kiln

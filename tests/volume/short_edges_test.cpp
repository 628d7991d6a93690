// Removal of zero-length edges: which are collapsed, and which are kept since the topology would change.
#include "volume/short_edges.h"

#include <gtest/gtest.h>

#include <vector>

namespace kiln {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

/// Vertices 0 and 1 are at one place, all others apart.
Vec3 place_of(std::uint32_t vertex) {
  return vertex < 2 ? Vec3{1, 2, 3} : Vec3{static_cast<float>(10 + vertex), 0, 1};
}

using Polygons = std::vector<PolygonCorners>;
using Merged = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Closed fans around 0 and 1, which two triangles join: 2 and 3 are their apexes.
Polygons joined_fans() {
  return {{0, 1, 2, kNone}, {1, 0, 3, kNone}, {1, 4, 2, kNone},
          {1, 3, 4, kNone}, {0, 2, 5, kNone}, {0, 5, 3, kNone}};
}

TEST(ShortEdges, AnEdgeBetweenTwoFansIsCollapsed) {
  Polygons polygons = joined_fans();
  EXPECT_EQ(collapse_short_edges(polygons, place_of), (Merged{{1, 0}}));
  EXPECT_EQ(polygons,
            (Polygons{{0, 4, 2, kNone}, {0, 3, 4, kNone}, {0, 2, 5, kNone}, {0, 5, 3, kNone}}));
}

/// Vertices from `count` on stay.
TEST(ShortEdges, OnlyTheFirstVerticesAreMerged) {
  Polygons polygons = joined_fans();
  EXPECT_TRUE(collapse_short_edges(polygons, place_of, 1).empty());
  EXPECT_EQ(polygons, joined_fans());
}

/// Two triangles back to back have one apex: without them, the fan around the other end would hang by a vertex alone.
TEST(ShortEdges, TrianglesBackToBackStay) {
  const Polygons before = {{0, 1, 2, kNone}, {1, 0, 2, kNone}, {1, 4, 5, kNone}, {1, 5, 6, kNone},
                           {1, 6, 4, kNone}, {0, 7, 8, kNone}, {0, 8, 9, kNone}, {0, 9, 7, kNone}};
  Polygons polygons = before;
  EXPECT_TRUE(collapse_short_edges(polygons, place_of).empty());
  EXPECT_EQ(polygons, before);
}

/// A common neighbour beside the apexes, an edge of three polygons, and an edge between two borders stay, too.
TEST(ShortEdges, WhatWouldChangeTheTopologyStays) {
  Polygons common = joined_fans();
  common[2] = {1, 5, 2, kNone};  // 5 is around 0 as well
  common[3] = {1, 3, 5, kNone};
  Polygons thrice = joined_fans();
  thrice.push_back({0, 1, 6, kNone});
  const Polygons borders = {{0, 1, 2, kNone}, {1, 0, 3, kNone}, {1, 4, 2, kNone}, {0, 2, 5, kNone}};
  for (const Polygons& before : {common, thrice, borders}) {
    Polygons polygons = before;
    EXPECT_TRUE(collapse_short_edges(polygons, place_of).empty());
    EXPECT_EQ(polygons, before);
  }
}

/// A quad at the edge becomes a triangle.
TEST(ShortEdges, QuadsLoseACorner) {
  Polygons polygons = {{0, 1, 6, 2},     {1, 0, 3, kNone}, {1, 4, 6, kNone},
                       {1, 3, 4, kNone}, {0, 2, 5, kNone}, {0, 5, 3, kNone}};
  EXPECT_EQ(collapse_short_edges(polygons, place_of), (Merged{{1, 0}}));
  ASSERT_EQ(polygons.size(), 5U);
  EXPECT_EQ(polygons[0][3], kNone);
  EXPECT_EQ((Triangle{polygons[0][0], polygons[0][1], polygons[0][2]}), (Triangle{0, 6, 2}));
}

}  // namespace
}  // namespace kiln

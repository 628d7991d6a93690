// What a cage must enclose and what it must not, of sheets at known heights.
#include "match/cage_search.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <vector>

#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Sheet {
  double z;
  bool up;
};

Mesh sheets(const std::vector<Sheet>& list) {
  Mesh mesh;
  for (const auto& [z, up] : list) {
    const Mesh plane = test::plane(2, 2);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3& p : plane.positions)
      mesh.positions.push_back({p.x, p.y, static_cast<float>(z)});
    for (const Triangle& t : plane.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[up ? 1 : 2], first + t[up ? 2 : 1]});
    }
  }
  return mesh;
}

/// Heights of all points of the lowest sheet of LOW, which must be the same; in units of the meshes.
struct Heights {
  double outward, outward_most, inward, inward_most;
};

/// \param distance  the search distance
std::optional<Heights> heights(const std::vector<Sheet>& high, const std::vector<Sheet>& low,
                               double distance = 0.03) {
  const Source source(*test::device(), sheets(high));
  const Source::Impl& impl = impl_of(source);
  const LowSurface surface = LowSurface::without_uvs(sheets(low), impl.frame);
  MatchRequest request{.source = impl, .surface = surface};
  request.width = request.height = 16;
  request.distance = distance * impl.frame.scale;
  const CageNeeds needs = find_cage_needs(request, {}, nullptr);
  std::optional<Heights> result;
  const double unit = 1 / impl.frame.scale;
  for (std::size_t i = 0; i < needs.points.list.size(); ++i) {
    if (needs.points.list[i].triangle >= 8) continue;  // the first sheet's come first
    EXPECT_EQ(needs.counts[i], 1);
    EXPECT_EQ(needs.found[i], 1);
    const Heights own{needs.min_outward_height[i] * unit, needs.max_outward_height[i] * unit,
                      needs.min_inward_depth[i] * unit, needs.max_inward_depth[i] * unit};
    if (!result) result = own;
    EXPECT_NEAR(own.outward, result->outward, 1e-4);
    EXPECT_NEAR(own.inward, result->inward, 1e-4);
  }
  EXPECT_TRUE(result.has_value());
  return result;
}

constexpr double kFree = std::numeric_limits<double>::infinity();

/// Faces up to 0.25% of the diagonal above the low poly may be the outer side of a wall, whose inner side bounds the cage.
TEST(CageSearch, InnerSidesBoundWhatLiesCloseToTheLowPoly) {
  KILN_REQUIRE_DEVICE();
  for (const double face : {0.002, 0.006}) {
    const auto found = heights({{face, true}, {-0.05, false}}, {{0, true}});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->outward, face, 1e-5);
    EXPECT_NEAR(found->inward, 0, 1e-5);
    if (face < 0.0025 * 1.4) {
      EXPECT_NEAR(found->inward_most, 0.05, 1e-5);
    } else {
      EXPECT_EQ(found->inward_most, kFree);
    }
  }
}

/// The next face outward is sought from the low poly on where the point's face lies below it.
TEST(CageSearch, WhatLiesBelowTheLowPolyDoesNotBoundTheCageAboveIt) {
  KILN_REQUIRE_DEVICE();
  const auto found = heights({{-0.025, true}, {-0.01, false}, {0.2, false}}, {{0, true}});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->outward, 0, 1e-5);
  EXPECT_NEAR(found->inward, 0.025, 1e-5);
  EXPECT_NEAR(found->outward_most, 0.2, 1e-5);
}

/// The low poly's own next face bounds the cage as well.
TEST(CageSearch, TheLowPolyBoundsTheCage) {
  KILN_REQUIRE_DEVICE();
  const auto found = heights({{0.01, true}}, {{0, true}, {0.15, false}});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->outward, 0.01, 1e-5);
  EXPECT_NEAR(found->outward_most, 0.15, 1e-5);
}

}  // namespace
}  // namespace kiln

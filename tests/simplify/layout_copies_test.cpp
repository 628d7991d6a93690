// Copies within a UV layout: shifted by whole numbers, mirrored or not, and nothing else.
#include "simplify/layout_copies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace kiln {
namespace {

struct Layout {
  std::vector<Vec2> uvs;
  std::vector<Triangle> corners;

  /// Adds a triangle with UVs of its own.
  void add(const Vec2& a, const Vec2& b, const Vec2& c) {
    const auto first = static_cast<std::uint32_t>(uvs.size());
    uvs.insert(uvs.end(), {a, b, c});
    corners.push_back({first, first + 1, first + 2});
  }
};

TEST(LayoutCopies, LieWholeNumbersApart) {
  const Vec2 a{0.25F, 0.125F}, b{0.75F, 0.125F}, c{0.5F, 0.875F};
  for (const Vec2 shift : {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{-1, 2}, Vec2{3, -2}}) {
    Layout layout;
    layout.add({0.5F, 0.5F}, {0.6F, 0.5F}, {0.5F, 0.7F});  // another one
    layout.add(a, b, c);
    layout.add({c.x + shift.x, c.y + shift.y}, {b.x + shift.x, b.y + shift.y},
               {a.x + shift.x, a.y + shift.y});
    const LayoutCopies copies(layout.uvs, layout.corners);
    EXPECT_TRUE(copies.any()) << shift.x << ", " << shift.y;
    EXPECT_TRUE(copies.are_triangle_copies(1, 2));
    EXPECT_FALSE(copies.are_triangle_copies(0, 1));
    EXPECT_EQ(copies.first_triangle_copy(2), 1U);
    for (const auto& [one, other] : {std::pair(3U, 8U), std::pair(4U, 7U), std::pair(5U, 6U)}) {
      EXPECT_TRUE(copies.has_copies(one));
      EXPECT_EQ(copies.first_copy(other), one);
      std::vector<std::uint32_t> seen;
      EXPECT_TRUE(copies.all_of(one, [&](std::uint32_t uv) { return seen.push_back(uv), true; }));
      EXPECT_EQ(seen, std::vector<std::uint32_t>{other});
      EXPECT_FALSE(copies.is_on_fold(one));
    }
    EXPECT_FALSE(copies.has_copies(0));
  }
}

TEST(LayoutCopies, OthersAreNone) {
  const Vec2 a{0.25F, 0.125F}, b{0.75F, 0.125F}, c{0.5F, 0.875F};
  for (const Vec2 shift : {Vec2{0.5F, 0}, Vec2{0, 0.5F}, Vec2{2e-5F, 0}, Vec2{0, 2e-5F}}) {
    Layout layout;
    layout.add(a, b, c);
    layout.add({a.x + shift.x, a.y + shift.y}, {b.x + shift.x, b.y + shift.y},
               {c.x + shift.x, c.y + shift.y});
    EXPECT_FALSE(LayoutCopies(layout.uvs, layout.corners).any()) << shift.x << ", " << shift.y;
  }
  // Two corners alike are not enough; and what has no area, or no place, is no copy.
  Layout layout;
  layout.add(a, b, c);
  layout.add(a, b, {0.5F, 0.75F});
  for (int twice = 0; twice < 2; ++twice) {
    layout.add(a, a, b);
    layout.add(a, a, a);
    layout.add(a, b, {std::nanf(""), 0});
  }
  EXPECT_FALSE(LayoutCopies(layout.uvs, layout.corners).any());
}

/// Three copies are one ring; corners on the axis of a mirrored mesh are their own copies.
TEST(LayoutCopies, MayBeManyAndFolded) {
  Layout layout;
  layout.uvs = {{0.5F, 0.25F}, {0.5F, 0.75F}, {0.75F, 0.5F}, {0.75F, 0.5F},
                {1.75F, 0.5F}, {1.5F, 0.25F}, {1.5F, 0.75F}};
  layout.corners = {{0, 2, 1}, {1, 3, 0}, {5, 4, 6}};
  const LayoutCopies copies(layout.uvs, layout.corners);
  EXPECT_TRUE(copies.are_triangle_copies(0, 1));
  EXPECT_TRUE(copies.are_triangle_copies(1, 2));
  for (const std::uint32_t uv : {0U, 1U}) EXPECT_TRUE(copies.is_on_fold(uv));
  for (const std::uint32_t uv : {2U, 3U, 4U, 5U, 6U}) EXPECT_FALSE(copies.is_on_fold(uv));
  std::vector<std::uint32_t> seen;
  copies.all_of(3, [&](std::uint32_t uv) { return seen.push_back(uv), true; });
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{2, 4}));
  EXPECT_EQ(copies.first_copy(4), 2U);
  EXPECT_EQ(copies.first_copy(5), 0U);
}

}  // namespace
}  // namespace kiln

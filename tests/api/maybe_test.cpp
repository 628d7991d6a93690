// Parts of results that are there or not.
#include <gtest/gtest.h>

#include <optional>
#include <type_traits>
#include <utility>

#include "kiln/kiln.h"

namespace kiln {
namespace {

struct Part {
  int count = 0;
  double share = 0;
};

static_assert(std::is_nothrow_move_constructible_v<BakeReport>);
static_assert(std::is_copy_assignable_v<BakeResult>);

TEST(Maybe, IsReadAsAnOptional) {
  Maybe<Part> part;
  EXPECT_FALSE(part);
  EXPECT_FALSE(part.has_value());
  EXPECT_THROW(part.value(), std::bad_optional_access);
  EXPECT_EQ(part.value_or({9, 0}).count, 9);
  part = {3, 0.5};
  ASSERT_TRUE(part);
  EXPECT_EQ(part->count, 3);
  EXPECT_EQ((*part).share, 0.5);
  EXPECT_EQ(part.value().count, 3);
  EXPECT_EQ(part.value_or({}).count, 3);
}

TEST(Maybe, IsAssignedAndForgotten) {
  Maybe<Part> part = Part{1, 2};
  Maybe<Part> other = part;
  other->count = 7;
  EXPECT_EQ(part->count, 1);
  part = other;
  EXPECT_EQ(part->count, 7);
  part = {};
  EXPECT_FALSE(part);
  EXPECT_EQ(part.emplace().count, 0);
  EXPECT_TRUE(part);
  part = std::nullopt;
  EXPECT_FALSE(part);
  const Part known{5, 6};
  part = known;
  EXPECT_EQ(part->count, 5);
  part.reset();
  EXPECT_FALSE(part);
}

TEST(Maybe, TurnsIntoTheStandardLibrarys) {
  BakeResult result;
  std::optional<Match> none = result.match;
  EXPECT_FALSE(none);
  result.match = Match{.width = 4};
  const std::optional<Match> match = result.match;
  ASSERT_TRUE(match);
  EXPECT_EQ(match->width, 4U);
  EXPECT_EQ(std::move(*result.match).width, 4U);
}

}  // namespace
}  // namespace kiln

// Facts of matches' rows that the rest of Kiln reads: plans their turns, messages their names, checks their properties.
#include "match/registry.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "kiln/bake.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

TEST(MatchRows, PlansTryThemInTheirTurns) {
  using Methods = std::vector<MatchMethod>;
  EXPECT_EQ(planned_matches(&MatchRow::plan_order),
            (Methods{MatchMethod::ray, MatchMethod::hybrid, MatchMethod::visibility,
                     MatchMethod::closest, MatchMethod::views}));
  EXPECT_EQ(planned_matches(&MatchRow::low_poly_order),
            (Methods{MatchMethod::ray, MatchMethod::hybrid, MatchMethod::closest}));
  EXPECT_EQ(match_at_uvs(), MatchMethod::uv);
}

TEST(MatchRows, AreJoinedInWords) {
  EXPECT_EQ(match_names([](const MatchRow& row) { return obeys(row.info, "match.uv"); }), "uv");
  EXPECT_EQ(match_names([](const MatchRow& row) { return row.is_good_fallback; }),
            "ray or closest");
  EXPECT_EQ(match_names([](const MatchRow& row) { return row.plan_order != 0; }),
            "ray, views, closest, visibility or hybrid");
  EXPECT_EQ(match_names([](const MatchRow&) { return false; }), "");
}

bool is_taken(const BakeOptions& options) {
  try {
    validate(options);
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage) << error.what();
    return false;
  }
}

/// Each check takes what a row says, and refuses all else.
TEST(MatchRows, ChecksGoByTheirProperties) {
  for (const MatchRow& row : match_rows()) {
    const std::string name(row.info.method.name);
    BakeOptions options;
    options.match.method = row.info.method;
    if (needs_direction(row.info)) options.match.views = {.count = 0, .directions = {{0, 0, 1}}};
    EXPECT_TRUE(is_taken(options)) << name;
    BakeOptions clusters = options;
    clusters.match.visibility.clusters = 2;
    EXPECT_EQ(is_taken(clusters), obeys(row.info, "match.visibility.clusters")) << name;
    BakeOptions cage = options;
    cage.match.cage = Length::share(0.02);
    EXPECT_EQ(is_taken(cage), obeys(row.info, "match.cage")) << name;
    BakeOptions directions = options;
    directions.maps = {MapKind{"visibility"}};
    EXPECT_EQ(is_taken(directions), obeys(row.info, "match.visibility")) << name;
    BakeOptions fallback;
    fallback.match.method = MatchMethod::uv;
    fallback.match.fallback = {row.info.method};
    fallback.match.views = options.match.views;
    EXPECT_EQ(is_taken(fallback), !obeys(row.info, "match.uv")) << name;
  }
}

}  // namespace
}  // namespace kiln

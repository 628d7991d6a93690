// Bakes by depth views, and what holds of each of their matches.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "shared/common.h"
#include "shared/match.h"
#include "support/environment.h"

namespace kiln::test {

inline BakeOptions view_options(std::uint32_t size, double max_distance) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.method = MatchMethod::views;
  options.match.max_distance = Length::absolute(max_distance);
  options.report.keep_match = true;
  options.encoding.gutter = 0;
  return options;
}

inline BakeResult bake_pair(const Mesh& high, const Mesh& low, const BakeOptions& options) {
  return bake(Source(*device(), high), low, options);
}

inline ImageDifference difference(const BakeResult& a, const BakeResult& b) {
  Image mask{a.maps[0].image.width, a.maps[0].image.height, 1, {}};
  for (std::size_t i = 0; i < a.coverage.size(); ++i) {
    mask.pixels.push_back(a.coverage[i] == 1 && b.coverage[i] == 1 ? 1.0F : 0.0F);
  }
  return compare_images(a.maps[0].image, b.maps[0].image, &mask);
}

/// Checks of every match: a found point lies on its triangle, within the distance.
inline void expect_sound(const Match& match, double max_distance) {
  for (std::size_t i = 0; i < match.status.size(); ++i) {
    if (match.status[i] == KILN_STATUS_NONE || match.status[i] == KILN_STATUS_MISS) {
      ASSERT_EQ(match.triangle[i], KILN_NO_TRIANGLE);
      continue;
    }
    ASSERT_LT(match.triangle[i], match.source_triangles);
    ASSERT_GE(match.u[i], 0);
    ASSERT_GE(match.v[i], 0);
    ASSERT_LE(match.u[i] + match.v[i], 1.000001F);
    ASSERT_LE(std::abs(match.distance[i]), max_distance * 1.00001);
  }
}

}  // namespace kiln::test

// Search distances are doubled while too much is missed, as long as that helps.
#include "plan/widen_search.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

namespace kiln {
namespace {

/// Shares that attempts miss, one after the other; the result of an attempt is its number.
struct Attempts {
  std::vector<double> missed;
  std::vector<double> distances = {};  ///< As shares of the diagonal; 0 for the default

  std::size_t run(BakeOptions& options) {
    return widen_search(
        options,
        [&](const BakeOptions& tried) {
          distances.push_back(tried.match.max_distance ? tried.match.max_distance->value : 0);
          return distances.size() - 1;
        },
        [&](std::size_t attempt) { return missed[attempt]; });
  }
};

TEST(WidenSearch, StopsOnceOneInTwoHundredIsMissedAtMost) {
  for (const auto& [shares, tried, chosen] :
       {std::tuple(std::vector<double>{0.005}, 1U, 0U),
        std::tuple(std::vector<double>{0.0051, 0.0038}, 2U, 1U),
        std::tuple(std::vector<double>{0.5, 0.3, 0.005}, 3U, 2U),
        std::tuple(std::vector<double>{1, 0.7, 0.5, 0.3}, 4U, 3U),
        // Each doubling resolves at least a quarter, or is dropped.
        std::tuple(std::vector<double>{0.4, 0.3}, 3U, 1U),
        std::tuple(std::vector<double>{0.4, 0.301}, 2U, 0U),
        std::tuple(std::vector<double>{1, 0.5, 0.4}, 3U, 1U)}) {
    Attempts attempts{shares};
    attempts.missed.resize(5, 1);
    BakeOptions options;
    EXPECT_EQ(attempts.run(options), chosen);
    ASSERT_EQ(attempts.distances.size(), tried);
    for (std::size_t i = 0; i < tried; ++i) {
      EXPECT_DOUBLE_EQ(attempts.distances[i],
                       i == 0 ? 0 : kSearchDistance * static_cast<double>(1U << i));
    }
    EXPECT_EQ(options.match.max_distance.has_value(), chosen > 0);
    if (chosen > 0) {
      EXPECT_DOUBLE_EQ(options.match.max_distance->value, attempts.distances[chosen]);
    }
  }
}

TEST(WidenSearch, KeepsWhatTheCallerSet) {
  const Mesh cage;
  for (int set = 0; set < 3; ++set) {
    BakeOptions options;
    if (set == 0) options.match.max_distance = Length::share(0.01);
    if (set == 1) options.match.cage = Length::share(0.01);
    if (set == 2) options.match.cage_mesh = &cage;
    Attempts attempts{{1, 0}};
    EXPECT_EQ(attempts.run(options), 0U) << set;
    EXPECT_EQ(attempts.distances.size(), 1U) << set;
    EXPECT_EQ(options.match.max_distance.has_value(), set == 0) << set;
  }
}

}  // namespace
}  // namespace kiln

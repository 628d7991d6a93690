// Settings that kiln chart compares.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "lab/chart.h"

namespace kiln::cli {
namespace {

bool has(const std::vector<ChartSetting>& settings, const std::string& name) {
  return std::any_of(settings.begin(), settings.end(),
                     [&](const ChartSetting& setting) { return setting.name == name; });
}

TEST(ChartSettings, HaveEveryMatchThatNeedsNoDirection) {
  const std::vector<ChartSetting> settings = chart_settings();
  for (const MatchInfo& row : matches()) {
    const auto uses = [&](const ChartSetting& setting) {
      return setting.bake.match.method == row.method;
    };
    EXPECT_EQ(std::any_of(settings.begin(), settings.end(), uses), !needs_direction(row))
        << row.method.name;
  }
}

TEST(ChartSettings, TakeAMatchThatIsAddedFromItsRow) {
  MatchInfo added, aimed;
  added.method = MatchMethod{"spiral"};
  aimed.method = MatchMethod{"compass"};
  aimed.options = "match.views.directions";
  std::vector<ChartSetting> settings = chart_settings();
  const std::size_t before = settings.size();
  const std::vector<MatchInfo> rows = {MatchInfo{.method = MatchMethod::ray}, added, aimed};
  add_other_matches(rows, settings);
  ASSERT_EQ(settings.size(), before + 1);
  EXPECT_TRUE(has(settings, "spiral"));
  EXPECT_EQ(settings.back().bake.match.method, added.method);
  EXPECT_EQ(settings.back().family, "others");
  add_other_matches(rows, settings);
  EXPECT_EQ(settings.size(), before + 1);
}

}  // namespace
}  // namespace kiln::cli

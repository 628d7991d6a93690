// Settings that kiln chart compares.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "kiln/match.h"
#include "lab/chart.h"

namespace kiln::cli {
namespace {

bool has(const std::vector<ChartSetting>& settings, const std::string& name) {
  return std::any_of(settings.begin(), settings.end(),
                     [&](const ChartSetting& setting) { return setting.name == name; });
}

TEST(ChartSettings, AreWhatTheirNamesSay) {
  const std::vector<ChartSetting> settings = chart_settings();
  std::vector<std::string> names;
  for (const ChartSetting& setting : settings) names.push_back(setting.name);
  EXPECT_EQ(names, (std::vector<std::string>{"ray",
                                             "ray_2x2",
                                             "ray_4x4",
                                             "views_6",
                                             "views_12",
                                             "views_24",
                                             "views_48",
                                             "views_auto",
                                             "views_12_512",
                                             "views_12_1024",
                                             "views_12_2048",
                                             "views_12_4096",
                                             "paper_12",
                                             "views_12_ray",
                                             "closest",
                                             "visibility_texel",
                                             "visibility_vertex",
                                             "visibility_face",
                                             "hybrid",
                                             "uv"}));
  const auto views_of = [&](const char* name) {
    const auto at = std::find(names.begin(), names.end(), name) - names.begin();
    return settings.at(static_cast<std::size_t>(at)).bake.match.views;
  };
  EXPECT_EQ(views_of("views_6").count, 6U);
  EXPECT_EQ(views_of("views_24").count, 24U);
  EXPECT_EQ(views_of("views_48").count, 48U);
  EXPECT_EQ(views_of("views_12_512").size, 512U);
  EXPECT_EQ(views_of("views_12_1024").size, 1024U);
  EXPECT_EQ(views_of("views_12_2048").size, 2048U);
  EXPECT_EQ(views_of("views_12_4096").size, 4096U);
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

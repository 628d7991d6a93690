// Files of kiln chart, read again.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"

namespace kiln::test::chart_files {

namespace fs = std::filesystem;
using nlohmann::json;

inline std::vector<std::string> read_lines(const fs::path& path) {
  std::ifstream stream(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The picture of so many groups of panels. No script lies beside it: that is for where there is no picture.
inline void expect_picture(const fs::path& out, std::uint32_t groups,
                           std::uint32_t lines_of_panels) {
  EXPECT_EQ(fs::exists(out / "kiln_plot.py"), !test::has_matplotlib());
  if (!test::has_matplotlib()) return;
  const Image picture = read_picture(out / "chart.png");
  EXPECT_EQ(picture.width, 1900U);
  EXPECT_EQ(picture.height, 176 + groups * (106 + lines_of_panels * 632));
}

inline std::size_t count_warnings(const json& report, const std::string& code,
                                  const std::string& words) {
  std::size_t count = 0;
  for (const json& warning : report["warnings"]) {
    const std::string text = warning.dump();
    count += warning["code"] == code && text.find(words) != std::string::npos ? 1U : 0U;
  }
  return count;
}

inline json find(const json& pair, const std::string& name) {
  for (const json& setting : pair["settings"]) {
    if (setting["name"] == name) return setting;
  }
  ADD_FAILURE() << "no setting " << name;
  return {};
}

inline double seconds_of(const json& setting) {
  return setting["seconds"]["correspondence"].get<double>();
}

inline double error_of(const json& setting, const std::string& measure) {
  if (measure == "object_space" || measure == "uniformity") {
    return setting[measure + "_percent"].get<double>();
  }
  if (measure == "normalised_image_space") return setting[measure].get<double>();
  return setting[measure]["mean_angle_degrees"].get<double>();
}

/// The front by its meaning: walking up the seconds, each that is better than all before it. (By sorting,
/// where the command compares all with all.)
inline std::vector<std::string> front_of(const json& pair, const std::string& measure) {
  std::vector<json> settings = pair["settings"];
  std::sort(settings.begin(), settings.end(), [&](const json& a, const json& b) {
    return std::pair(seconds_of(a), error_of(a, measure)) <
           std::pair(seconds_of(b), error_of(b, measure));
  });
  std::vector<std::string> names;
  double best = INFINITY;
  for (const json& setting : settings) {
    if (error_of(setting, measure) >= best) continue;
    best = error_of(setting, measure);
    names.push_back(setting["name"]);
  }
  return names;
}

inline void expect_finite(const json& value, const std::string& where) {
  if (value.is_number()) {
    EXPECT_TRUE(std::isfinite(value.get<double>())) << where;
  } else if (value.is_structured()) {
    for (const auto& [key, item] : value.items()) {
      std::string inside = where;
      inside.append(".").append(key);
      expect_finite(item, inside);
    }
  } else if (value.is_null()) {
    ADD_FAILURE() << where << " is null, as numbers that are not finite are written";
  }
}

inline void expect_pair(const json& pair, const std::vector<std::string>& names, int repeat) {
  ASSERT_EQ(pair["settings"].size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const json& setting = pair["settings"][i];
    EXPECT_EQ(setting["name"], names[i]);
    expect_finite(setting, names[i]);
    EXPECT_GT(seconds_of(setting), 0);
    EXPECT_GT(setting["seconds"]["total"].get<double>(), seconds_of(setting));
    ASSERT_EQ(setting["runs"].size(), static_cast<std::size_t>(repeat));
    std::vector<double> runs;
    for (const json& run : setting["runs"]) runs.push_back(run["correspondence"]);
    std::sort(runs.begin(), runs.end());
    EXPECT_EQ(seconds_of(setting), runs[(runs.size() - 1) / 2]);
    const json& t = setting["texels"];
    EXPECT_EQ(t["samples"].get<int>(), t["outward"].get<int>() + t["inward"].get<int>() +
                                           t["cage"].get<int>() + t["views"].get<int>() +
                                           t["closest"].get<int>() + t["uv"].get<int>() +
                                           t["missed"].get<int>());
    EXPECT_GT(setting["matched_share"].get<double>(), 0.9) << names[i];
    EXPECT_GT(setting["map_error"]["texels"].get<int>(), 1000);
    EXPECT_GT(error_of(setting, "normal_error"), 0);
    EXPECT_LT(error_of(setting, "normal_error"),
              0.5 * pair["normal_error_without_map"]["mean_angle_degrees"].get<double>());
  }
  for (const char* measure :
       {"map_error", "normal_error", "object_space", "normalised_image_space", "uniformity"}) {
    const std::vector<std::string> front = front_of(pair, measure);
    EXPECT_EQ(pair["front"][measure].get<std::vector<std::string>>(), front);
    for (const json& setting : pair["settings"]) {
      const bool on_front =
          std::count(front.begin(), front.end(), setting["name"].get<std::string>()) != 0;
      EXPECT_EQ(setting["on_front"][measure].get<bool>(), on_front) << setting["name"];
    }
  }
}

}  // namespace kiln::test::chart_files

// Files of kiln measure, read again.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"

namespace kiln::test::measure_files {

namespace fs = std::filesystem;
using nlohmann::json;

/// Pixels of a picture's colours from dark to light, which show values: no greys.
inline std::size_t coloured_pixels(const Image& picture) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); i += picture.channels) {
    const float* rgb = &picture.pixels[i];
    count += std::max({rgb[0], rgb[1], rgb[2]}) - std::min({rgb[0], rgb[1], rgb[2]}) > 0.15F;
  }
  return count;
}

/// The folder's files are those of a whole study, and its pictures were drawn where they were to be.
inline void expect_files(const fs::path& out, const std::string& name, std::size_t panels,
                         bool drawn = test::has_matplotlib()) {
  EXPECT_TRUE(fs::exists(out / (name + ".csv")));
  const json plot = read_json(out / (name + "_plot.json"));
  EXPECT_EQ(plot["kind"], "study");
  ASSERT_EQ(plot["panels"].size(), panels);
  EXPECT_EQ(fs::exists(out / (name + ".png")), drawn);
  if (!drawn) return;
  EXPECT_EQ(read_picture(out / (name + ".png")).width, 930 * panels);
}

/// The settings of a curve.
inline std::vector<json> select(const json& report, const std::string& curve) {
  std::vector<json> result;
  for (const json& setting : report["settings"]) {
    if (setting["curve"] == curve) result.push_back(setting);
  }
  return result;
}

inline double mean_of(const json& setting) {
  return setting["normal_error"]["mean_angle_degrees"].get<double>();
}

}  // namespace kiln::test::measure_files

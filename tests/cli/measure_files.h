// Files of kiln measure, read again.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/process.h"

namespace kiln::test::measure_files {

namespace fs = std::filesystem;
using nlohmann::json;

inline std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// The data and the pixels of a picture of tiles belong together.
inline void expect_tiles(const fs::path& out, const std::string& name, std::size_t tiles) {
  const json plot = read_json(out / (name + "_plot.json"));
  EXPECT_EQ(plot["kind"], "pictures");
  const Image image = load_image(out / plot["image"].get<std::string>());
  EXPECT_EQ(image.channels, 1U);
  EXPECT_EQ(image.width, plot["tile"][0]);
  EXPECT_EQ(image.height, plot["tile"][1].get<std::size_t>() * tiles);
}

/// The folder's files are those of a whole study, and its pictures were drawn where they were to be.
inline void expect_files(const fs::path& out, const std::string& name, std::size_t panels,
                         bool drawn = test::has_matplotlib()) {
  EXPECT_TRUE(fs::exists(out / (name + ".csv")));
  expect_tiles(out, name + "_error", 3);
  const json plot = read_json(out / (name + "_plot.json"));
  EXPECT_EQ(plot["kind"], "study");
  ASSERT_EQ(plot["panels"].size(), panels);
  EXPECT_EQ(fs::exists(out / (name + ".png")), drawn);
  if (!drawn) return;
  EXPECT_EQ(load_image(out / (name + ".png")).width, 930 * panels);
  EXPECT_GE(load_image(out / (name + "_error.png")).width, 820U);
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

// kiln chart --plan: the grid, its front, the plans, files, exit codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "cli/call.h"
#include "cli/chart_files.h"
#include "cli/lab_scene.h"
#include "kiln/plan.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::make_scene;
using test::ProcessResult;
using test::read_json;
using namespace test::chart_files;

/// Nothing else has fewer bytes and less error: by brute force.
bool on_front(const json& point, const json& points) {
  return std::none_of(points.begin(), points.end(), [&](const json& other) {
    if (other == point) return false;
    return other["bytes"]["total"] <= point["bytes"]["total"] &&
           other["mean_degrees"] <= point["mean_degrees"];
  });
}

/// A chart of two plans, made once.
struct TwoPlans {
  fs::path scene = make_scene(4000);
  fs::path out = scene / "out";
  ProcessResult result = call_kiln({"chart", scene / "high.obj", "--plan", "--max-error",
                                    "6,normal=3", "--size", "64", "--out", out},
                                   test::without_python().environment);
  static const TwoPlans& made() {
    static const TwoPlans plans;
    return plans;
  }
};

TEST(PlanChart, ShowsTheFrontAndWherePlansStand) {
  KILN_REQUIRE_DEVICE();
  const fs::path& out = TwoPlans::made().out;
  const ProcessResult& result = TwoPlans::made().result;
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  ASSERT_EQ(report["meshes"].size(), 1U);
  const json& points = report["meshes"][0]["points"];
  std::vector<std::uint64_t> faces;
  std::size_t on_front_of_all = 0;
  for (const json& p : points) {
    faces.push_back(p["faces"].get<std::uint64_t>());
    EXPECT_EQ(p["front"].get<bool>(), on_front(p, points)) << p;
    on_front_of_all += p["front"].get<bool>();
    const LowPolyBytes bytes =
        low_poly_bytes(p["vertices"], p["faces"], p["size"].get<std::uint32_t>(), {3}, 8);
    EXPECT_EQ(p["bytes"]["total"], bytes.total());
    EXPECT_EQ(p["bytes"]["texels"], bytes.texels);
  }
  // 125 to 4,000 faces, without a map and with those of 16 to 128 texels that are not far too large or small.
  EXPECT_GT(points.size(), 12U);
  EXPECT_GE(*std::min_element(faces.begin(), faces.end()), 120U);
  EXPECT_LE(*std::max_element(faces.begin(), faces.end()), 4000U);
  EXPECT_GE(on_front_of_all, 4U);

  const json& plans = report["meshes"][0]["plans"];
  ASSERT_EQ(plans.size(), 2U);
  EXPECT_EQ(plans[0]["wanted_degrees"], 6);
  EXPECT_EQ(plans[1]["wanted_degrees"], 3);
  for (const json& plan : plans) {
    EXPECT_TRUE(plan["reached"].get<bool>());
    // Other pictures than the plan's own say about the same.
    EXPECT_LT(plan["mean_degrees"], 1.25 * plan["wanted_degrees"].get<double>());
    // The front is of a coarse grid: a plan may be lighter, and must not be far heavier.
    const double over = plan["bytes"]["total"].get<double>() / plan["front_bytes"].get<double>();
    EXPECT_GT(over, 0.5);
    EXPECT_LT(over, 1.3);
  }
  EXPECT_LT(plans[0]["bytes"]["total"], plans[1]["bytes"]["total"]);
  const std::vector<std::string> data = read_lines(out / "chart.csv");
  EXPECT_EQ(data.size(), 1 + points.size() + plans.size());
  for (const std::string& line : data) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','),
              std::count(data[0].begin(), data[0].end(), ','))
        << line;
  }
  for (const char* file : {"chart.md", "chart_plot.json", "kiln_plot.py"}) {
    EXPECT_TRUE(fs::exists(out / file)) << file;
  }
  const json shown = read_json(out / "chart_plot.json");
  EXPECT_EQ(shown["panels"][0]["rings"]["x"].size(), 2U);
}

TEST(PlanChart, NamesTheBitsOfMaps) {
  KILN_REQUIRE_DEVICE();
  const fs::path& out = TwoPlans::made().out;
  const ProcessResult& result = TwoPlans::made().result;
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json mesh = read_json(out / "chart.json")["meshes"][0];
  for (const json& p : mesh["points"]) {
    EXPECT_EQ(p["bits"], p["size"] == 0 ? json() : json(8)) << p;
  }
  const json panel = read_json(out / "chart_plot.json")["panels"][0];
  std::string table;
  for (const std::string& line : read_lines(out / "chart.md")) table += line + "\n";
  const std::vector<std::string> data = read_lines(out / "chart.csv");
  EXPECT_NE(table.find("whose maps have 8 bits a channel."), std::string::npos) << table;
  std::vector<int> seen;
  for (std::size_t i = 0; i < mesh["plans"].size(); ++i) {
    const json& plan = mesh["plans"][i];
    const std::string label = panel["rings"]["labels"][i];
    if (plan["size"] == 0) {
      EXPECT_NE(label.find("no map"), std::string::npos) << label;
      continue;
    }
    const int bits = plan["bits"];
    seen.push_back(bits);
    const std::string size = std::to_string(plan["size"].get<int>());
    const std::string words = size + "², " + std::to_string(bits) + " bits";
    EXPECT_NE(label.find(words), std::string::npos) << label;
    const std::regex row("\\| +" + size + " \\| +" + std::to_string(bits) + " \\|");
    EXPECT_TRUE(std::regex_search(table, row)) << table;
    EXPECT_TRUE(std::regex_search(result.output, row)) << result.output;
    const std::string& line = data[1 + mesh["points"].size() + i];
    const std::string cells = "," + std::to_string(plan["size"].get<int>()) + "," +
                              std::to_string(bits) + "," +
                              std::to_string(plan["bytes"]["vertices"].get<int>()) + ",";
    EXPECT_NE(line.find(cells), std::string::npos) << line;
  }
  EXPECT_FALSE(seen.empty());
  // The picture has room for the plans.
  const json shown = read_json(out / "chart_plot.json");
  const double heaviest = panel["rings"]["x"].back();
  EXPECT_GE(shown["x_ticks"].back(), heaviest);
}

TEST(PlanChart, LooksAtTheSizeOnScreen) {
  KILN_REQUIRE_DEVICE();
  const TwoPlans& made = TwoPlans::made();
  ASSERT_EQ(made.result.exit_code, 0) << made.result.errors;
  const fs::path out = made.scene / "far";
  const ProcessResult result = call_kiln({"chart", made.scene / "high.obj", "--plan", "--max-error",
                                          "6", "--screen", "16px", "--size", "64", "--out", out},
                                         test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  EXPECT_EQ(report["options"]["screen"], 16);
  const json far = report["meshes"][0], near = read_json(made.out / "chart.json")["meshes"][0];
  const json& plan = far["plans"][0];
  EXPECT_TRUE(plan["reached"].get<bool>());
  EXPECT_LT(plan["mean_degrees"], 1.3 * plan["wanted_degrees"].get<double>());
  EXPECT_NE(read_json(out / "chart_plot.json")["panels"][0]["title"].get<std::string>().find(
                "pixels on screen"),
            std::string::npos);
  // The same grid. Pixels of the far one hide what is finer, so its errors are less.
  ASSERT_EQ(near["points"].size(), far["points"].size());
  double errors_near = 0, errors_far = 0;
  for (std::size_t i = 0; i < near["points"].size(); ++i) {
    EXPECT_EQ(near["points"][i]["faces"], far["points"][i]["faces"]);
    EXPECT_EQ(near["points"][i]["size"], far["points"][i]["size"]);
    errors_near += near["points"][i]["mean_degrees"].get<double>();
    errors_far += far["points"][i]["mean_degrees"].get<double>();
  }
  EXPECT_LT(errors_far, 0.9 * errors_near);
  EXPECT_LE(plan["bytes"]["total"], near["plans"][0]["bytes"]["total"]);
}

TEST(PlanChart, RefusesBadUsage) {
  const fs::path scene = make_scene(1000);
  const std::string high = scene / "high.obj", low = scene / "low.obj", out = scene / "out";
  struct Bad {
    std::vector<std::string> words;
    const char* says;
  };
  for (const Bad& bad : std::vector<Bad>{
           {{high, low, "--max-error", "2"}, "add --plan"},
           {{high, low, "--screen", "600px"}, "add --plan"},
           {{high, "--plan", "--screen", "4px"}, "--screen"},
           {{high, "--plan", "--repeat", "2"}, "--repeat is for charts of matches"},
           {{high, "--plan", "--ao"}, "--ao is for charts of matches"},
           {{high, "--plan", "--pixels", "64"}, "--pixels is for charts of matches"},
           {{high, "--plan", "--settings", "ray"}, "--settings is for charts of matches"},
           {{high, "--plan", "--iso", "2"}, "--iso is for volumes"},
           {{"x.nrrd", "--plan"}, "is a volume"},
           {{high, "--plan", "--height", "2"}, "height field"},
           {{high, "--plan", "--max-error", "nothing"}, "--max-error"},
           {{high, "--plan", "--max-error", "normal="}, "degrees after normal="},
           {{high, "--plan", "--max-error", "-1"}, "--max-error"}}) {
    std::vector<std::string> words = {"chart", "--out", out};
    words.insert(words.begin() + 1, bad.words.begin(), bad.words.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 2) << bad.says;
    EXPECT_NE(result.errors.find(bad.says), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(out));
  }
}

TEST(PlanChart, AMeshOfFewFacesHasNoGrid) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(100);
  const ProcessResult result =
      call_kiln({"chart", scene / "high.obj", "--plan", "--out", scene / "out"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.errors.find("needs 250 or more"), std::string::npos) << result.errors;
}

}  // namespace
}  // namespace kiln

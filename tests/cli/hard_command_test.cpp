// Hard surfaces at the command line: the defaults, parts by name, recall, boxes that do not fit.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/call.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::ProcessResult;
using test::read_json;

/// Two plates that cross: X at z = 0, Y a little above its right half. The low poly has both at z = 0.05.
Mesh crossing(const std::string& suffix, float x, float y) {
  Mesh mesh = test::plane(2, 1, 2, 1);
  mesh.group_names = {"X" + suffix, "Y" + suffix};
  mesh.groups = {0, 0, 1, 1};
  const Mesh flat = mesh;
  mesh.positions.clear();
  for (std::uint32_t t = 0; t < 4; ++t) {
    for (std::uint32_t& corner : mesh.triangles[t]) {
      Vec3 p = flat.positions[corner];
      p.z = t < 2 ? x : y;
      corner = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(p);
    }
  }
  return mesh;
}

TEST(HardCommand, MatchesPartsByName) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(crossing("_high", 0.02F, 0), folder / "high.obj");
  save_obj(crossing("_low", 0, 0), folder / "low.obj");
  const ProcessResult named =
      call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--out", folder / "named",
                 "--size", "32", "--match-by", "name", "--json", folder / "named.json"});
  ASSERT_EQ(named.exit_code, 0) << named.errors;
  const nlohmann::json report = read_json(folder / "named.json");
  EXPECT_EQ(report["parts"], (nlohmann::json{"X", "Y"}));
  EXPECT_EQ(report["options"]["match_by"], "name");
  EXPECT_EQ(report["recall"]["lost"], 0);
  EXPECT_NE(named.output.find("2 pairs of parts"), std::string::npos) << named.output;

  // Other patterns pair nothing: the message has the nearest name.
  const ProcessResult none =
      call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--out", folder / "none",
                 "--size", "32", "--match-by", "name", "--low-names", "*_lp"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.errors.find("'X_low' is nearest to 'X_high'"), std::string::npos) << none.errors;
  const ProcessResult lone = call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--out",
                                        folder / "none", "--low-names", "*_lp"});
  EXPECT_EQ(lone.exit_code, 2);
}

TEST(HardCommand, MatchesPartsByAList) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(crossing("_a", 0, 0.01F), folder / "high.obj");
  save_obj(crossing("_b", 0.005F, 0.005F), folder / "low.obj");
  std::ofstream(folder / "parts.txt") << "# pairs\nX_b = X_a\n\nY_b = nothing, Y_*\n";
  std::ofstream(folder / "bad.txt") << "X_b = X_a\nY_b\n";
  const auto bake = [&](std::vector<std::string> flags) {
    std::vector<std::string> line = {"bake",
                                     folder / "high.obj",
                                     folder / "low.obj",
                                     "--out",
                                     folder / "listed",
                                     "--size",
                                     "32",
                                     "--json",
                                     folder / "listed.json"};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  };
  const ProcessResult listed = bake({"--match-by", "list", "--match-list", folder / "parts.txt"});
  ASSERT_EQ(listed.exit_code, 0) << listed.errors;
  EXPECT_EQ(read_json(folder / "listed.json")["parts"], (nlohmann::json{"X_b", "Y_b"}));
  const ProcessResult bad = bake({"--match-by", "list", "--match-list", folder / "bad.txt"});
  EXPECT_EQ(bad.exit_code, 3);
  EXPECT_NE(bad.errors.find("line 2, is 'Y_b'"), std::string::npos) << bad.errors;
  EXPECT_EQ(bake({"--match-by", "list"}).exit_code, 2);
  EXPECT_EQ(bake({"--match-list", folder / "parts.txt"}).exit_code, 2);
  EXPECT_EQ(bake({"--match-by", "group"}).exit_code, 3);
}

/// --cage auto, its file, and the same bytes from it; what is refused; the picture.
TEST(HardCommand, SaysWhyTexelsAreMissed) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh high = test::plane(1, 1);
  for (Vec3& p : high.positions) p.z = 0.2F + 0.1F * p.x;
  save_obj(high, folder / "high.obj");
  save_obj(test::plane(1, 1), folder / "low.obj");
  const auto bake = [&](std::vector<std::string> flags) {
    std::vector<std::string> line = {
        "bake",   folder / "high.obj", folder / "low.obj", "--out", folder / "out", "--size", "16",
        "--json", folder / "out.json", "--reasons"};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  };
  const ProcessResult result = bake({"--max-distance", "0.2"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.output.find("far: "), std::string::npos) << result.output;
  const nlohmann::json reasons = read_json(folder / "out.json")["reasons"];
  ASSERT_EQ(reasons.size(), 2U);
  EXPECT_EQ(reasons[1]["reason"], "far");
  EXPECT_NE(reasons[1]["words"].get<std::string>().find("raise --max-distance"), std::string::npos);
  EXPECT_EQ(reasons[0]["samples"].get<int>() + reasons[1]["samples"].get<int>(), 256);
  const Image picture = test::read_picture(folder / "out" / "low_reasons.png");
  const std::size_t texel =
      reasons[1]["texel"][1].get<std::size_t>() * 16 + reasons[1]["texel"][0].get<std::size_t>();
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(picture.pixels[3 * texel + k] * 255, reasons[1]["color"][k].get<double>(), 0.5);
  }
  EXPECT_EQ(bake({"--fallback", "closest"}).exit_code, 2);
  EXPECT_EQ(bake({"--match", "closest"}).exit_code, 2);
}

TEST(HardCommand, SaysThatGreenPointsTheOtherWay) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh high = test::plane(32, 32);
  for (Vec3& p : high.positions) p.z = 0.05F * std::sin(12 * p.y);
  high.normals.clear();
  high.normal_triangles.clear();
  save_obj(high, folder / "high.obj");
  save_obj(test::plane(1, 1), folder / "low.obj");
  ASSERT_EQ(call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--out", folder / "out",
                       "--size", "64", "--max-distance", "0.1", "--flip-y"})
                .exit_code,
            0);
  const auto render = [&](std::vector<std::string> flags) {
    std::vector<std::string> line = {"render",
                                     folder / "low.obj",
                                     "--ambient-rays",
                                     "0",
                                     "--normal",
                                     folder / "out" / "low_normal.png",
                                     "--reference",
                                     folder / "high.obj",
                                     "--out",
                                     folder / "out.png",
                                     "--quiet",
                                     "--size",
                                     "64"};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  };
  const ProcessResult wrong = render({}), right = render({"--flip-y"});
  ASSERT_EQ(wrong.exit_code, 0) << wrong.errors;
  EXPECT_NE(wrong.errors.find("green down (DirectX)"), std::string::npos) << wrong.errors;
  EXPECT_NE(wrong.errors.find("Add --flip-y"), std::string::npos) << wrong.errors;
  EXPECT_EQ(right.errors, "");
}

TEST(HardCommand, WarnsOfWhatIsLostAndWhere) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh high = crossing("", 1e-3F, 1e-3F);
  const Mesh above = crossing("", 0.011F, 0.011F);
  for (std::size_t t = 2; t < 4; ++t) {
    Triangle corners = above.triangles[t];
    for (std::uint32_t& corner : corners) {
      high.positions.push_back(above.positions[corner]);
      corner = static_cast<std::uint32_t>(high.positions.size() - 1);
    }
    high.triangles.push_back(corners);
    high.uv_triangles.push_back(high.uv_triangles[t]);
    high.normal_triangles.push_back(high.normal_triangles[t]);
    high.groups.push_back(1);
  }
  save_obj(high, folder / "high.obj");
  save_obj(test::plane(1, 1, 2, 1), folder / "low.obj");
  const auto bake = [&](const std::string& rule) {
    return call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--out", folder / rule,
                      "--size", "512", "--ray", rule, "--json", folder / (rule + ".json")});
  };
  // From aslant, views show some of what lies under the rim: h / 2 = 0.005 of 3 units of rim, 0.7% of 2.
  const ProcessResult nearest = bake("nearest"), outermost = bake("outermost");
  ASSERT_EQ(nearest.exit_code, 0) << nearest.errors;
  EXPECT_NE(nearest.errors.find("use --ray outermost"), std::string::npos) << nearest.errors;
  EXPECT_EQ(outermost.errors.find("has no texel"), std::string::npos) << outermost.errors;
  const nlohmann::json lost = read_json(folder / "nearest.json")["recall"];
  EXPECT_NEAR(lost["lost"].get<double>(), 0.5, 0.04);
  EXPECT_NEAR(lost["largest"]["where"][0].get<double>(), 0.5, 0.1);
  EXPECT_NEAR(lost["largest"]["where"][2].get<double>(), 0.011, 1e-5);
}

/// Edges of a cube without bevels are sharp: rays turn over the least width, 0.05% of the diagonal.
TEST(HardCommand, FindsEdgeWidthsAndTakesPaint) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh low = test::cube(1);
  save_obj(low, folder / "high.obj");
  save_obj(low, folder / "low.obj");
  const auto bake = [&](const std::string& name, std::vector<std::string> flags) {
    std::vector<std::string> line = {"bake",
                                     folder / "high.obj",
                                     folder / "low.obj",
                                     "--out",
                                     folder / name,
                                     "--size",
                                     "32",
                                     "--json",
                                     folder / (name + ".json")};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln({line.begin(), line.end()});
  };
  const ProcessResult found = bake("found", {});
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_NE(found.output.find("HIGH's bevels at 12 of 12 hard edges"), std::string::npos)
      << found.output;
  const nlohmann::json edges = read_json(folder / "found.json")["hard_edges"];
  EXPECT_EQ(edges["found"], 12);
  EXPECT_NEAR(edges["width"]["most"].get<double>(), 0.0005 * std::sqrt(3.0), 1e-6);
  ASSERT_EQ(bake("given", {"--edge-width", "0.1"}).exit_code, 0);
  const nlohmann::json given = read_json(folder / "given.json")["hard_edges"];
  EXPECT_EQ(given["found"], 0);
  EXPECT_NEAR(given["width"]["median"].get<double>(), 0.1, 1e-6);

  const ProcessResult bare = bake("bare", {"--direction", "painted"});
  EXPECT_EQ(bare.exit_code, 3);
  EXPECT_NE(bare.errors.find("no vertex colours"), std::string::npos) << bare.errors;
  low.colors.assign(low.positions.size(), {255, 0, 0, 255});
  save_obj(low, folder / "low.obj");
  EXPECT_EQ(bake("painted", {"--direction", "painted"}).exit_code, 0);
}

TEST(HardCommand, SaysThatBoxesFitWithAxesSwapped) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh high = test::cube(1);
  for (Vec3& p : high.positions) p = {p.x, p.y * 0.5F, p.z * 2};
  Mesh low = high;
  for (Vec3& p : low.positions) p = {p.x, -p.z, p.y};
  save_obj(high, folder / "high.obj");
  save_obj(low, folder / "low.obj");
  const ProcessResult result = call_kiln(
      {"bake", folder / "high.obj", folder / "low.obj", "--out", folder / "out", "--size", "64"});
  EXPECT_NE(result.errors.find("swapping Y and Z"), std::string::npos) << result.errors;
}

}  // namespace
}  // namespace kiln

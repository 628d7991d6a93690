// kiln simplify: layouts and hulls.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/call.h"
#include "cli/chart_files.h"
#include "cli/command_scene.h"
#include "kiln/plan.h"
#include "mesh/fans.h"
#include "source/streamed_files.h"
#include "support/json_file.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::make_scene;
using test::ProcessResult;
using test::read_json;

/// The report.
json simplify_to(const fs::path& scene, const std::vector<std::string>& flags) {
  std::vector<std::string> words = {"simplify", scene / "high.obj", "--faces", "300",
                                    "--out",    scene / "made.obj", "--json",  scene / "made.json"};
  words.insert(words.end(), flags.begin(), flags.end());
  const ProcessResult result = call_kiln(words);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  return read_json(scene / "made.json");
}

TEST(SimplifyCommand, PairsAreManyChartsAndChartsFew) {
  const fs::path scene = make_scene(4000);
  EXPECT_LT(simplify_to(scene, {})["charts"], 60);
  const json pairs = simplify_to(scene, {"--unwrap", "pairs"});
  EXPECT_EQ(pairs["unwrap"], "pairs");
  // Two triangles each, and some left over.
  EXPECT_GE(pairs["charts"], 150);
  EXPECT_EQ(pairs["border_texels"], 2);
}

TEST(SimplifyCommand, WhatNeedsTheWholeMeshIsRefusedWhereItIsLargerThanMemory) {
  const fs::path scene = make_scene(4000);
  const fs::path high = test::save_ply(test::BumpySphere::dense(600000), scene);
  const std::vector<std::vector<std::string>> all = {
      {"--faces", "300", "--hull"},
      {"--faces", "300", "--keep-uvs"},
      {"--faces", "300", "--fill-holes", "all"},
      {"--faces", "300", "--clean", "all"},
      {"--faces", "300", "--up", "z"},
      {"--faces", "300", "--unit", "mm"},
      {"--faces", "300", "--high-normals", "flat"},
  };
  for (const std::vector<std::string>& flags : all) {
    std::vector<std::string> words = {"simplify",       high, "--out", scene / "made.obj",
                                      "--memory-limit", "64M"};
    words.insert(words.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(words);
    const std::string& culprit = flags[2];
    EXPECT_EQ(result.exit_code, 2) << culprit;
    EXPECT_NE(result.errors.find("is larger than memory, and "), std::string::npos)
        << result.errors;
    EXPECT_NE(result.errors.find(culprit), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find("--memory-limit"), std::string::npos) << result.errors;
  }
  EXPECT_FALSE(fs::exists(scene / "made.obj"));
}

TEST(SimplifyCommand, ADeviationBoundsLowPolysOfMeshesLargerThanMemory) {
  const fs::path scene = make_scene(4000);
  const fs::path high = test::save_ply(test::BumpySphere::dense(1500000), scene);
  // In a process of its own, whose memory is known: all triangles would take 630 MB, a chunk takes 250.
  const ProcessResult result =
      test::run_kiln({"simplify", high, "--max-error", "0.5%", "--out", scene / "made.obj",
                      "--json", scene / "made.json", "--memory-limit", "340M"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "made.json");
  EXPECT_EQ(report["inputs"][0]["streamed"], true);
  EXPECT_LE(report["error"], 0.005);
  EXPECT_GT(report["error"], 0.002);
  EXPECT_GT(report["back_error"], 0);
}

TEST(SimplifyCommand, PolygonsAreCutAsAsked) {
  const fs::path scene = test::make_kite();
  for (const auto& [rule, middle] : {std::pair("shortest", 0.0), std::pair("fan", 0.2)}) {
    const ProcessResult result =
        call_kiln({"simplify", scene / "kite.obj", "--faces", "2", "--triangulate", rule, "--out",
                   scene / "made.obj", "--json", scene / "made.json"});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(read_json(scene / "made.json")["triangulate"], rule);
    const Mesh made = load_mesh(scene / "made.obj");
    ASSERT_EQ(made.triangles.size(), 2U);
    // The diagonal is the side that both triangles have: the middle of its ends is that of the quad.
    std::size_t shared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = made.positions[made.triangles[0][k]],
                 &b = made.positions[made.triangles[0][(k + 1) % 3]];
      if (std::abs(a.x + b.x) > 1e-5F || std::abs(a.y + b.y) > 1e-5F) continue;
      EXPECT_NEAR((a.z + b.z) / 2, middle, 1e-6) << rule;
      ++shared;
    }
    EXPECT_EQ(shared, 1U) << rule;
  }
}

TEST(SimplifyCommand, TrianglesThatFaceAgainstOthersAreTurned) {
  const fs::path scene = make_scene(4000);
  Mesh high = load_mesh(scene / "high.obj");
  simplify_to(scene, {});
  const Mesh as_it_was = load_mesh(scene / "made.obj");
  for (const std::size_t t : {7, 100, 3000}) {
    for (std::vector<Triangle>* corners :
         {&high.triangles, &high.uv_triangles, &high.normal_triangles}) {
      if (!corners->empty()) std::swap((*corners)[t][0], (*corners)[t][2]);
    }
  }
  save_obj(high, scene / "high.obj");
  const json report = simplify_to(scene, {});
  EXPECT_EQ(test::chart_files::count_warnings(report, "turned-triangles", "3 of"), 1U);
  // Corners begin elsewhere, so bytes may differ.
  EXPECT_EQ(load_mesh(scene / "made.obj").triangles.size(), as_it_was.triangles.size());
  EXPECT_EQ(report["flaws"]["folded"], 0);
}

TEST(SimplifyCommand, TexelsGoByAreaOrDetail) {
  const fs::path scene = make_scene(4000);
  const json area = simplify_to(scene, {"--size", "128"});
  EXPECT_EQ(area["density"], "area");
  const Mesh as_before = load_mesh(scene / "made.obj");
  EXPECT_EQ(simplify_to(scene, {"--size", "128", "--density", "area"})["charts"], area["charts"]);
  EXPECT_EQ(load_mesh(scene / "made.obj").uvs, as_before.uvs);
  EXPECT_EQ(simplify_to(scene, {"--size", "128", "--density", "detail"})["density"], "detail");
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--unwrap", "pairs", "--density", "area"},
        {"--keep-uvs", "--density", "detail"},
        {"--density", "most"}}) {
    std::vector<std::string> words = {"simplify", scene / "high.obj", "--faces", "99",
                                      "--out",    scene / "bad.obj"};
    words.insert(words.end(), flags.begin(), flags.end());
    const ProcessResult bad = call_kiln(words);
    EXPECT_EQ(bad.exit_code, 2);
    EXPECT_NE(bad.errors.find("--density"), std::string::npos) << bad.errors;
    EXPECT_FALSE(fs::exists(scene / "bad.obj"));
  }
}

TEST(SimplifyCommand, HardEdgesForShadingAreCountedAsVertices) {
  const fs::path scene = test::scratch_folder();
  save_obj(test::cube(), scene / "cube.obj");
  const auto made = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> words = {
        "simplify",         scene / "cube.obj", "--faces",           "12",     "--out",
        scene / "made.obj", "--json",           scene / "made.json", "--force"};
    words.insert(words.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const json report = read_json(scene / "made.json");
    EXPECT_NE(result.output.find(std::to_string(report["vertices"].get<int>()) + " vertices"),
              std::string::npos)
        << result.output;
    EXPECT_EQ(split_vertices(load_mesh(scene / "made.obj")), report["vertices"]);
    return report;
  };
  const json hard = made({"--normals", "shading"}), map = made({});
  EXPECT_EQ(hard["vertices"], 24);
  EXPECT_EQ(hard["hard_edges"], 12);
  // The cube's own normals part at its edges, so that those of a map do, too.
  EXPECT_EQ(map["vertices"], 24);
  EXPECT_LT(made({"--hard-angle", "180"})["vertices"], 24);
  EXPECT_EQ(made({"--normals", "shading", "--hard-angle", "180"})["hard_edges"], 0);
}

TEST(SimplifyCommand, NormalsAreForAMapOrForShading) {
  const fs::path scene = make_scene(4000);
  EXPECT_EQ(simplify_to(scene, {})["normals"], "map");
  const Mesh mapped = load_mesh(scene / "made.obj");
  EXPECT_EQ(simplify_to(scene, {"--normals", "shading"})["normals"], "shading");
  const Mesh shaded = load_mesh(scene / "made.obj");
  EXPECT_EQ(shaded.positions, mapped.positions);
  EXPECT_EQ(shaded.uvs, mapped.uvs);
  EXPECT_NE(shaded.normals, mapped.normals);
  // Kept UVs are no reason to do else.
  const auto kept = [&](const char* purpose) {
    const ProcessResult result =
        call_kiln({"simplify", scene / "low.obj", "--keep-uvs", "--faces", "200", "--normals",
                   purpose, "--out", scene / "kept.obj", "--force"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return load_mesh(scene / "kept.obj").normals;
  };
  EXPECT_NE(kept("map"), kept("shading"));
  const ProcessResult bad = call_kiln({"simplify", scene / "high.obj", "--faces", "99", "--normals",
                                       "flat", "--out", scene / "bad.obj"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.errors.find("--normals"), std::string::npos) << bad.errors;
}

/// A rough ball, and a tetrahedron beside it that is smaller than 100 faces are off by.
fs::path with_crumb() {
  fs::path scene = make_scene(4000);
  Mesh high = load_mesh(scene / "high.obj");
  high.normals.clear(), high.normal_triangles.clear();
  high.uvs.clear(), high.uv_triangles.clear();
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  const Vec3 p = high.positions[0];
  constexpr float kSmall = 1e-4F;
  high.positions.push_back({p.x * 1.05F, p.y * 1.05F, p.z * 1.05F});
  for (const Vec3& d : {Vec3{kSmall, 0, 0}, Vec3{0, kSmall, 0}, Vec3{0, 0, kSmall}}) {
    const Vec3& q = high.positions[first];
    high.positions.push_back({q.x + d.x, q.y + d.y, q.z + d.z});
  }
  for (const Triangle& t : {Triangle{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    high.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  save_obj(high, scene / "crumb.obj");
  return scene;
}

std::uint64_t parts_in(const fs::path& path) {
  const Mesh mesh = load_mesh(path);
  return count_components(mesh.triangles, mesh.positions.size());
}

TEST(SimplifyCommand, PartsAreKeptWhereAskedFor) {
  const fs::path scene = with_crumb();
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin() + 1, scene / "crumb.obj");
    for (const std::string& word : {std::string("--json"), (scene / "parts.json").string()}) {
      words.push_back(word);
    }
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const json report = read_json(scene / "parts.json");
    if (!report.contains("dropped_parts")) return -1;  // of a bake
    return report["dropped_parts"].get<int>() + report["clean"]["dropped_floaters"].get<int>();
  };
  const std::string out = scene / "parts.obj";
  EXPECT_EQ(run({"simplify", "--faces", "100", "--out", out}), 1);
  EXPECT_EQ(parts_in(out), 1u);
  EXPECT_EQ(run({"simplify", "--faces", "100", "--out", out, "--keep-parts"}), 0);
  EXPECT_EQ(parts_in(out), 2u);
  for (const bool keeps : {false, true}) {
    std::vector<std::string> words = {"bake", "--faces", "100",           "--size",
                                      "64",   "--out",   scene / "baked", "--force"};
    if (keeps) words.emplace_back("--keep-parts");
    run(words);
    EXPECT_EQ(parts_in(scene / "baked" / "crumb_low.obj"), keeps ? 2u : 1u);
  }
  const ProcessResult bad = call_kiln(
      {"bake", scene / "high.obj", scene / "low.obj", "--keep-parts", "--out", scene / "bad"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.errors.find("--keep-parts"), std::string::npos) << bad.errors;
}

/// The bytes of a map, of a bake with nearest points.
std::string bytes_of_map(const fs::path& scene, const char* high, const char* clean,
                         const char* expected) {
  const fs::path out = scene / (std::string(high) + clean);
  const ProcessResult result =
      call_kiln({"bake", scene / (std::string(high) + ".obj"), scene / "low.obj", "--match",
                 "closest", "--size", "64", "--clean", clean, "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.errors.find("faced against") != std::string::npos, *expected != 0)
      << result.errors;
  EXPECT_NE(result.errors.find(expected), std::string::npos) << result.errors;
  return test::read_file(out / "low_normal.png");
}

TEST(SimplifyCommand, FlippedPatchesOfHighBakeAsSoundOnes) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(4000);
  Mesh high = load_mesh(scene / "high.obj");
  for (std::size_t t = 0; t < high.triangles.size(); ++t) {
    if (high.positions[high.triangles[t][0]].y > 0.3F) {
      std::swap(high.triangles[t][1], high.triangles[t][2]);
    }
  }
  save_obj(high, scene / "flipped.obj");
  const std::string sound = bytes_of_map(scene, "high", "auto", "");
  EXPECT_EQ(bytes_of_map(scene, "high", "none", ""), sound);
  EXPECT_EQ(bytes_of_map(scene, "flipped", "auto", "--clean none leaves HIGH as it is"), sound);
  EXPECT_NE(bytes_of_map(scene, "flipped", "none", ""), sound);
  // If a saved match is loaded, its corners may be counted otherwise.
  const auto bake = [&](const char* flag) {
    return call_kiln({"bake", scene / "flipped.obj", scene / "low.obj", "--size", "32", "--out",
                      scene / "match", flag, scene / "match.exr"});
  };
  expect_exit(bake("--save-match"), 0, {});
  expect_exit(bake("--load-match"), 0, {"the same --clean"});
}

TEST(SimplifyCommand, FarMoreFacesThanAskedForAreBeyondTheLimit) {
  const fs::path scene = make_scene(4000);
  const ProcessResult result =
      call_kiln({"simplify", scene / "high.obj", "--faces", "2", "--out", scene / "made.obj"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("--faces 2 was not reached: the low poly has 4"), std::string::npos)
      << result.errors;
  EXPECT_EQ(load_mesh(scene / "made.obj").triangles.size(), 4U);
}

TEST(SimplifyCommand, AHullEnclosesMore) {
  const fs::path scene = make_scene(4000);
  const auto volume = [&](const fs::path& path) {
    const Mesh mesh = load_mesh(path);
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
      sum += double{a.x} * (double{b.y} * c.z - double{b.z} * c.y) +
             double{a.y} * (double{b.z} * c.x - double{b.x} * c.z) +
             double{a.z} * (double{b.x} * c.y - double{b.y} * c.x);
    }
    return sum / 6;
  };
  EXPECT_FALSE(simplify_to(scene, {})["hull"].get<bool>());
  const double plain = volume(scene / "made.obj"), high = volume(scene / "high.obj");
  EXPECT_TRUE(simplify_to(scene, {"--hull"})["hull"].get<bool>());
  EXPECT_LT(plain, high);
  EXPECT_GT(volume(scene / "made.obj"), high);
  const ProcessResult both = call_kiln({"simplify", scene / "high.obj", "--hull", "--keep-uvs",
                                        "--faces", "99", "--out", scene / "both.obj"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.errors.find("--keep-uvs"), std::string::npos) << both.errors;
}

}  // namespace
}  // namespace kiln

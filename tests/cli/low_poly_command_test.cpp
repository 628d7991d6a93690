// A low poly, its map and the match, planned together at the command line.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/call.h"
#include "job/stages.h"
#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/files.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::ProcessResult;
using test::read_json;

/// A bumpy sphere as a file.
struct Dense {
  fs::path folder = test::scratch_folder();
  fs::path high = folder / "high.ply";
  Mesh mesh;
  explicit Dense(std::uint32_t faces = 3000) : mesh(test::BumpySphere::dense(faces, true)) {
    save_obj(mesh, high.replace_extension(".obj"));
  }

  ProcessResult bake(const std::string& out, std::vector<std::string> more,
                     const std::map<std::string, std::string>& environment =
                         test::without_python().environment) const {
    std::vector<std::string> words = {"bake",   high, "--out",  folder / out,
                                      "--size", "64", "--json", folder / (out + ".json")};
    words.insert(words.end(), more.begin(), more.end());
    return call_kiln(words, environment);
  }
  nlohmann::json report(const std::string& out) const {
    return read_json(folder / (out + ".json"));
  }
};

/// The plan for 2 degrees and its picture, made once.
struct NearPlan : Dense {
  ProcessResult done = bake("near", {"--max-error", "normal=2"}, {});
  static const NearPlan& made() {
    static const NearPlan plan;
    return plan;
  }
};

TEST(LowPolyCommand, PlansFacesAndTexelsTogether) {
  KILN_REQUIRE_DEVICE();
  const NearPlan& dense = NearPlan::made();
  const ProcessResult& done = dense.done;
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  EXPECT_NE(done.output.find("<- chosen"), std::string::npos) << done.output;
  EXPECT_NE(done.output.find("expected"), std::string::npos) << done.output;
  const nlohmann::json report = dense.report("near");
  const nlohmann::json& plan = report["plan"];
  EXPECT_TRUE(plan["reached"].get<bool>());
  EXPECT_EQ(plan["wanted_degrees"], 2);
  EXPECT_LE(plan["chosen"]["measured_degrees"].get<double>(), 2);
  EXPECT_GT(plan["chosen"]["standard_error_degrees"].get<double>(), 0);
  EXPECT_LT(plan["chosen"]["standard_error_degrees"].get<double>(), 0.5);
  EXPECT_NE(done.output.find("measured, ± "), std::string::npos) << done.output;
  EXPECT_FALSE(plan["trials"].empty());
  EXPECT_FALSE(plan["trade"].empty());
  const Mesh low = load_mesh(dense.folder / "near" / "high_low.obj");
  EXPECT_EQ(low.triangles.size(), plan["chosen"]["faces"].get<std::size_t>());
  const Image map = test::read_picture(dense.folder / "near" / "high_low_normal.png");
  EXPECT_EQ(map.width, plan["chosen"]["size"].get<std::uint32_t>());
  EXPECT_TRUE(fs::exists(dense.folder / "near" / "high_low_plan_plot.json"));
  EXPECT_EQ(fs::exists(dense.folder / "near" / "high_low_plan.png"), test::has_matplotlib());
  EXPECT_EQ(report["inputs"]["low"]["triangles"], plan["chosen"]["faces"]);

  // The older words ask for the same, and the same comes out.
  const ProcessResult older = dense.bake("older", {"--match", "auto", "--max-error", "2"});
  ASSERT_EQ(older.exit_code, 0) << older.errors;
  EXPECT_EQ(dense.report("older")["plan"]["chosen"], plan["chosen"]);
}

TEST(LowPolyCommand, TakesTheSizeOnScreenAndLeavesTheMapOut) {
  KILN_REQUIRE_DEVICE();
  const NearPlan& dense = NearPlan::made();
  ASSERT_EQ(dense.done.exit_code, 0) << dense.done.errors;
  ASSERT_EQ(dense.bake("far", {"--max-error", "normal=2", "--screen", "16px"}).exit_code, 0);
  EXPECT_EQ(dense.report("far")["plan"]["screen"], 16);
  const auto bytes = [&](const char* out) {
    return dense.report(out)["plan"]["chosen"]["bytes"]["total"].get<int>();
  };
  EXPECT_LT(bytes("far"), bytes("near"));

  const ProcessResult none = dense.bake("none", {"--max-error", "normal=60"});
  ASSERT_EQ(none.exit_code, 0) << none.errors;
  EXPECT_EQ(dense.report("none")["plan"]["chosen"]["size"], 0);
  EXPECT_NE(none.output.find("no map needed"), std::string::npos) << none.output;
  EXPECT_GT(dense.report("none")["plan"]["chosen"]["one_sided_share"].get<double>(), 0.05);
  EXPECT_NE(none.errors.find("--max-outline"), std::string::npos) << none.errors;
  const ProcessResult bound =
      dense.bake("bound", {"--max-error", "normal=60", "--max-outline", "2%"});
  ASSERT_EQ(bound.exit_code, 0) << bound.errors;
  EXPECT_LE(dense.report("bound")["plan"]["chosen"]["one_sided_share"].get<double>(), 0.02);
  EXPECT_EQ(dense.report("bound")["plan"]["max_outline"], 0.02);
  EXPECT_NE(bound.output.find("outlines differ by"), std::string::npos) << bound.output;
  EXPECT_EQ(dense.done.errors.find("outlines"), std::string::npos) << dense.done.errors;
  EXPECT_TRUE(fs::exists(dense.folder / "none" / "high_low.obj"));
  EXPECT_FALSE(fs::exists(dense.folder / "none" / "high_low_normal.png"));
}

/// Near first where Kiln makes LOW, but where a distance, or a LOW, is given.
TEST(LowPolyCommand, RaysOntoMadeOnesLookNearFirst) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const auto near = [&](const std::string& out, const std::vector<std::string>& more) {
    EXPECT_EQ(dense.bake(out, more).exit_code, 0);
    return dense.report(out)["options"]["near_distance"];
  };
  EXPECT_FALSE(near("made", {"--faces", "500"}).is_null());
  EXPECT_TRUE(near("told", {"--faces", "500", "--max-distance", "3%"}).is_null());
  EXPECT_TRUE(near("given", {(dense.folder / "made" / "high_low.obj").string()}).is_null());
}

TEST(LowPolyCommand, WarnsOfHeavyLightMeshes) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const ProcessResult heavy = dense.bake("heavy", {"--faces", "4500", "--unwrap=pairs"});
  ASSERT_EQ(heavy.exit_code, 0) << heavy.errors;
  EXPECT_NE(heavy.errors.find("more than half"), std::string::npos) << heavy.errors;
  const ProcessResult light = dense.bake("light", {"--faces", "500"});
  ASSERT_EQ(light.exit_code, 0) << light.errors;
  EXPECT_EQ(light.errors.find("more than half"), std::string::npos) << light.errors;
}

TEST(LowPolyCommand, RefusesWhatContradictsThePlan) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const auto refuses = [&](const std::vector<std::string>& more, const std::string& word) {
    const ProcessResult done = dense.bake("bad", more);
    EXPECT_EQ(done.exit_code, 2) << done.errors;
    EXPECT_NE(done.errors.find(word), std::string::npos) << done.errors;
    EXPECT_FALSE(fs::exists(dense.folder / "bad"));
  };
  refuses({"--max-error", "normal=0"}, "--max-error");
  refuses({"--max-error", "normal=few"}, "--max-error");
  refuses({"--max-error", "normal="}, "degrees after normal=");
  refuses({"--screen", "600px"}, "normal=DEGREES");
  refuses({"--max-error", "normal=6", "--screen", "8px"}, "--screen");
  refuses({"--max-error", "normal=6", "--screen", "600em"}, "600px");
  refuses({"--max-error", "normal=6", "--match", "uv"}, "--match uv");
  refuses({"--max-error", "normal=6", "--maps", "mask"}, "normal");
  refuses({"--max-error", "normal=6", "--faces", "100", "--match", "ray"}, "--match auto");
}

/// A sphere with waves that only near views show.
struct Wavy : Dense {
  explicit Wavy(std::uint32_t faces = 3000) : Dense(faces) {
    for (Vec3& p : mesh.positions) {
      const float scale =
          1 + 0.01F * (std::sin(30 * p.x) + std::sin(30 * p.y) + std::sin(30 * p.z));
      p = {p.x * scale, p.y * scale, p.z * scale};
    }
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    save_obj(mesh, high);
  }
};

TEST(LowPolyCommand, WritesALevelForEachSizeOnScreen) {
  KILN_REQUIRE_DEVICE();
  const Wavy dense(6000);
  const ProcessResult done =
      dense.bake("own", {"--max-error", "normal=3", "--screen", "96px", "--lod", "3", "--mips"});
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  EXPECT_NE(done.output.find("from px"), std::string::npos) << done.output;
  const fs::path folder = dense.folder / "own";
  const nlohmann::json chain = read_json(folder / "high_lods.json");
  const nlohmann::json& levels = chain["levels"];
  EXPECT_EQ(dense.report("own")["lods"], levels);
  ASSERT_GE(levels.size(), 2U);
  int last = 193;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const nlohmann::json& level = levels[k];
    EXPECT_LE(2 * level["screen"].get<int>(), last);
    last = level["screen"];
    EXPECT_LE(level["measured_degrees"].get<double>(), 3);
    const Mesh low = load_mesh(folder / level["mesh"].get<std::string>());
    EXPECT_EQ(low.triangles.size(), level["faces"].get<std::size_t>());
    EXPECT_EQ(level["mesh"], "high_lod" + std::to_string(k) + ".obj");
    if (level["size"] == 0) continue;
    EXPECT_EQ(level["maps_of_level"], k);
    const Image map = test::read_picture(folder / level["maps"][0].get<std::string>());
    EXPECT_EQ(map.width, level["size"].get<std::uint32_t>());
    for (const auto& file : level["maps"]) EXPECT_TRUE(fs::exists(folder / file));
  }
  EXPECT_EQ(levels[0]["screen"], 96);
}

TEST(LowPolyCommand, OneMapServesAllLevelsWhereAsked) {
  KILN_REQUIRE_DEVICE();
  const Wavy dense;
  const ProcessResult done =
      dense.bake("shared", {"--max-error", "normal=5", "--screen", "192px", "--lod", "4",
                            "--lod-uvs", "shared", "--space", "object", "--lod-growth", "1.25"});
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  const fs::path folder = dense.folder / "shared";
  const nlohmann::json levels = read_json(folder / "high_lods.json")["levels"];
  ASSERT_GE(levels.size(), 2U);
  for (const nlohmann::json& level : levels) {
    EXPECT_EQ(level["maps_of_level"], 0);
    EXPECT_EQ(level["maps"], levels[0]["maps"]);
    EXPECT_LE(level["measured_degrees"].get<double>(), level["wanted_degrees"].get<double>());
  }
  EXPECT_EQ(levels[0]["wanted_degrees"], 5);
  EXPECT_EQ(levels[1]["wanted_degrees"],
            5 * std::pow(1.25, std::log2(192 / levels[1]["screen"].get<int>())));
  EXPECT_EQ(levels[1]["bytes"]["texels"], 0);
  EXPECT_FALSE(fs::exists(folder / "high_lod1_normal.png"));
  EXPECT_LT(levels[1]["faces"], levels[0]["faces"]);
}

/// Beside a GLB they are a file each, with maps of their own or the first one's.
TEST(LowPolyCommand, LevelsOfAGlbAreFilesOfTheirOwn) {
  KILN_REQUIRE_DEVICE();
  const Wavy dense;
  for (const std::string uvs : {"own", "shared"}) {
    const ProcessResult done =
        dense.bake(uvs + "/low.glb", {"--max-error", "normal=5", "--screen", "192px", "--lod", "3",
                                      "--lod-uvs", uvs, "--lod-growth", "1.5", "--maps", "normal"});
    ASSERT_EQ(done.exit_code, 0) << done.errors;
    const fs::path folder = dense.folder / uvs;
    const nlohmann::json levels = read_json(folder / "low_lods.json")["levels"];
    ASSERT_GE(levels.size(), 2U);
    std::vector<Asset> assets;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const std::string name = k == 0 ? "low.glb" : "low_lod" + std::to_string(k) + ".glb";
      EXPECT_EQ(levels[k]["mesh"], name);
      assets.push_back(load_asset(folder / name));
      EXPECT_EQ(assets[k].mesh.triangles.size(), levels[k]["faces"]);
      ASSERT_EQ(assets[k].materials.size(), 1U);
      const auto picture = assets[k].materials[0].normal_map.bytes;
      ASSERT_EQ(picture != nullptr, levels[k]["size"] != 0);
      if (k == 0 || picture == nullptr) continue;
      EXPECT_EQ(*picture == *assets[0].materials[0].normal_map.bytes, uvs == "shared");
      EXPECT_LT(assets[k].mesh.triangles.size(), assets[k - 1].mesh.triangles.size());
    }
  }
}

/// Or all are in one file, which shows the first to readers without MSFT_lod.
TEST(LowPolyCommand, LevelsOfAGlbAreOneFile) {
  KILN_REQUIRE_DEVICE();
  const Wavy dense;
  for (const std::string uvs : {"own", "shared"}) {
    const ProcessResult done =
        dense.bake(uvs + "/one.glb",
                   {"--max-error", "normal=5", "--screen", "192px", "--lod", "3", "--lod-files",
                    "one", "--lod-uvs", uvs, "--lod-growth", "1.5", "--maps", "normal"});
    ASSERT_EQ(done.exit_code, 0) << done.errors;
    const fs::path folder = dense.folder / uvs, file = folder / "one.glb";
    EXPECT_FALSE(fs::exists(folder / "one_lod1.glb"));
    const nlohmann::json levels = read_json(folder / "one_lods.json")["levels"];
    ASSERT_GE(levels.size(), 2U);
    const std::string glb = test::read_file(file);
    std::uint32_t length = 0;
    std::memcpy(&length, &glb[12], 4);
    const nlohmann::json head = nlohmann::json::parse(glb.substr(20, length));
    const nlohmann::json& root = head["nodes"].at(head["scenes"][0]["nodes"][0].get<std::size_t>());
    const nlohmann::json& coverages = root["extras"]["MSFT_screencoverage"];
    ASSERT_EQ(root["extensions"]["MSFT_lod"]["ids"].size(), levels.size() - 1);
    ASSERT_EQ(coverages.size(), levels.size());
    EXPECT_EQ(coverages.back(), 0);
    std::size_t maps = 0;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      EXPECT_EQ(levels[k]["mesh"], "one.glb");
      const double screen = levels[k]["screen"], coverage = levels[k]["coverage"];
      EXPECT_NEAR(coverage, k == 0 ? 1 : screen / 1080, 1e-9) << "all levels reach their error";
      if (k > 0) EXPECT_EQ(coverages[k - 1], coverage);
      if (k > 0) EXPECT_LE(coverages[k].get<double>(), coverages[k - 1].get<double>());
      const std::size_t id = k == 0
                                 ? head["scenes"][0]["nodes"][0].get<std::size_t>()
                                 : root["extensions"]["MSFT_lod"]["ids"][k - 1].get<std::size_t>();
      const std::size_t mesh = head["nodes"].at(id)["mesh"];
      const std::size_t indices = head["meshes"].at(mesh)["primitives"][0]["indices"];
      EXPECT_EQ(head["accessors"].at(indices)["count"], 3 * levels[k]["faces"].get<std::size_t>());
      if (levels[k]["size"] != 0 && (k == 0 || uvs == "own")) ++maps;
    }
    EXPECT_EQ(head["images"].size(), maps);
    EXPECT_EQ(load_asset(file).mesh.triangles.size(), levels[0]["faces"]);
  }
}

/// A level that misses its error takes over where the asset is that much smaller on screen; none before a finer one.
TEST(LowPolyCommand, CoveragesFollowMeasuredErrors) {
  const auto chain_of = [](const std::vector<std::uint32_t>& screens,
                           const std::vector<double>& measured) {
    LodChain chain;
    for (std::size_t k = 0; k < screens.size(); ++k) {
      LodLevel& level = chain.levels.emplace_back();
      level.screen = screens[k];
      level.plan.wanted = 4;
      level.plan.chosen.measured = measured[k];
    }
    return chain;
  };
  const std::vector<double> near = lod_coverages(chain_of({600, 300, 150}, {4, 6, 3}));
  ASSERT_EQ(near.size(), 3U);
  EXPECT_EQ(near[0], 1);
  EXPECT_NEAR(near[1], 300.0 / 1080 * 4 / 6, 1e-12);
  EXPECT_NEAR(near[2], 150.0 / 1080, 1e-12);
  const std::vector<double> large = lod_coverages(chain_of({2160, 1080}, {1, 1}));
  EXPECT_NEAR(large[1], 0.5, 1e-12) << "a view is as high as the first level at least";
  const std::vector<double> rising = lod_coverages(chain_of({600, 300, 150}, {4, 40, 4}));
  EXPECT_EQ(rising[2], rising[1]);
}

TEST(LowPolyCommand, LevelsAppearTogetherOrNotAtAll) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const fs::path folder = dense.folder / "there";
  fs::create_directory(folder);
  save_text(folder / "high_lod1.obj", "v 0 0 0\n");  // not Kiln's
  const std::vector<std::string> lods = {"--max-error", "normal=6", "--screen",
                                         "96px",        "--lod",    "3"};
  const ProcessResult foreign = dense.bake("there", lods);
  EXPECT_NE(foreign.exit_code, 0);
  EXPECT_NE(foreign.errors.find("high_lod1.obj"), std::string::npos) << foreign.errors;
  EXPECT_FALSE(fs::exists(folder / "high_lod0.obj"));

  const auto refuses = [&](std::vector<std::string> more, const std::string& word) {
    const ProcessResult done = dense.bake("bad", std::move(more));
    EXPECT_EQ(done.exit_code, 2) << done.errors;
    EXPECT_NE(done.errors.find(word), std::string::npos) << done.errors;
    EXPECT_FALSE(fs::exists(dense.folder / "bad"));
  };
  refuses({"--lod", "3"}, "--screen");
  refuses({"--max-error", "normal=6", "--lod", "3"}, "--screen");
  refuses({"--max-error", "normal=6", "--screen", "60px", "--lod", "3"}, "64px");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod", "1"}, "--lod");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod-files", "one"}, "--lod N");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod", "2", "--lod-files", "one"},
          "--out NAME.glb");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod-uvs", "shared"}, "--lod N");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod-growth", "2"}, "--lod N");
  refuses({"--max-error", "normal=6", "--max-outline", "60%"}, "--max-outline");
  refuses({"--faces", "100", "--max-outline", "2%"}, "--max-outline");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod", "2", "--lod-growth", "0.5"},
          "--lod-growth");
  refuses({"--max-error", "normal=6", "--screen", "600px", "--lod", "2", "--reasons"}, "--reasons");
}

TEST(LowPolyCommand, BoundsErrorsOfSeveralMaps) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const ProcessResult done = dense.bake(
      "several", {"--max-error", "ao=128/255,normal=12", "--maps", "normal,ao", "--ao-rays", "16"});
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  const auto plan = dense.report("several")["plan"];
  EXPECT_EQ(plan["wanted_degrees"], 12);
  ASSERT_EQ(plan["bounds"].size(), 1U);
  EXPECT_EQ(plan["bounds"][0]["map"], "ao");
  EXPECT_DOUBLE_EQ(plan["bounds"][0]["wanted"], 128.0 / 255);
  EXPECT_LE(plan["bounds"][0]["rms"], 128.0 / 255);
  const ProcessResult not_reached = dense.bake(
      "beyond", {"--max-error", "normal=12,ao=1e-9", "--maps", "normal,ao", "--ao-rays", "4"});
  EXPECT_EQ(not_reached.exit_code, 1);
  for (const auto& [bound, word] :
       std::vector<std::pair<std::string, std::string>>{{"ao=2/255", "normal=DEGREES"},
                                                        {"normal=12,ao", "has no map"},
                                                        {"normal=12,ao=few", "2/255"},
                                                        {"normal=12,ao=-1", "2/255"},
                                                        {"normal=12,ao=1/0", "2/255"},
                                                        {"normal=12,ao=1,ao=2", "two errors"},
                                                        {"normal=12,height=1", "'height'"},
                                                        {"normal=12,", "has no map"}}) {
    const ProcessResult bad = dense.bake("bad", {"--max-error", bound, "--maps", "normal,ao"});
    EXPECT_EQ(bad.exit_code, 2) << bound;
    EXPECT_NE(bad.errors.find(word), std::string::npos) << bad.errors;
  }
}

TEST(LowPolyCommand, GathersLightByViews) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const std::vector<std::string> plain = {"--faces", "200", "--maps", "ao"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), plain.begin(), plain.end());
    return more;
  };
  const ProcessResult done = dense.bake("views", with({"--ao-by", "views", "--ao-views", "32"}));
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  EXPECT_EQ(dense.report("views")["options"]["ao_by"], "views");
  EXPECT_EQ(dense.report("views")["options"]["ao_views"], 32);
  ASSERT_EQ(dense.bake("auto", with({"--ao-by", "auto"})).exit_code, 0);
  EXPECT_EQ(dense.report("auto")["options"]["ao_by"], "rays");
  const auto refuses = [&](const std::vector<std::string>& more, const std::string& word) {
    const ProcessResult bad = dense.bake("bad", with(more));
    EXPECT_EQ(bad.exit_code, 2) << bad.errors;
    EXPECT_NE(bad.errors.find(word), std::string::npos) << bad.errors;
  };
  refuses({"--ao-views", "32"}, "--ao-by views");
  refuses({"--ao-by", "views", "--ao-distance", "1%"}, "--ao-distance");
  refuses({"--ao-by", "views", "--ao-falloff", "linear"}, "--ao-falloff");
  refuses({"--ao-by", "views", "--ao-error", "0.01"}, "--ao-error");
  refuses({"--ao-by", "views", "--ao-ignore-back-faces"}, "--ao-ignore-back-faces");
  refuses({"--ao-by", "views", "--ao-rays", "8"}, "--ao-rays");
  refuses({"--ao-by", "views", "--ao-views", "8"}, "--ao-views");
  const ProcessResult other =
      dense.bake("bad", {"--faces", "200", "--maps", "height", "--ao-by", "views"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.errors.find("ao or bent_normal"), std::string::npos) << other.errors;
}

TEST(LowPolyCommand, DarkensLessWithDistance) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const auto with = [&](const char* name, std::vector<std::string> more) {
    more.insert(more.begin(), {"--faces", "200", "--ao-rays", "16", "--maps"});
    return dense.bake(name, more);
  };
  ASSERT_EQ(with("far", {"ao"}).exit_code, 0);
  EXPECT_EQ(dense.report("far")["options"]["ao_falloff"], "none");
  const ProcessResult done = with("near", {"ao", "--ao-falloff", "smooth", "--ao-distance", "20%",
                                           "--report-error", "--ao-error", "0.02"});
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  EXPECT_EQ(dense.report("near")["options"]["ao_falloff"], "smooth");
  EXPECT_LT(dense.report("near")["errors"][0]["rms"].get<double>(), 0.02 * 255);
  ASSERT_EQ(dense.bake("none", {"--faces", "200", "--maps", "height"}).exit_code, 0);
  EXPECT_TRUE(dense.report("none")["options"]["ao_falloff"].is_null());
  const ProcessResult other = with("bad", {"thickness,shadow", "--ao-falloff", "linear"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.errors.find("ao or bent_normal"), std::string::npos) << other.errors;
  const ProcessResult word = with("bad", {"ao", "--ao-falloff", "cubic"});
  EXPECT_EQ(word.exit_code, 2);
  EXPECT_NE(word.errors.find("linear"), std::string::npos) << word.errors;
}

TEST(LowPolyCommand, SearchesAsFarAsTheLowPolyStrays) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const auto searched = [&](const char* name, const char* faces, std::vector<std::string> more) {
    more.insert(more.begin(), {"--match", "ray", "--faces", faces});
    const ProcessResult done = dense.bake(name, more);
    EXPECT_EQ(done.exit_code, 0) << done.errors;
    return done.output;
  };
  const std::string wide = searched("wide", "40", {});
  const double strays = dense.report("wide")["low"]["error"].get<double>();
  ASSERT_GT(strays, 0.01);
  char text[32];
  std::snprintf(text, sizeof text, "(%.3f%% of the diagonal)", 250 * strays);
  EXPECT_NE(wide.find(text), std::string::npos) << wide;
  EXPECT_NE(searched("asked", "40", {"--max-distance", "2%"}).find("(2.000% of the diagonal)"),
            std::string::npos);
  EXPECT_NE(searched("fine", "3000", {}).find("(2.000% of the diagonal)"), std::string::npos);
}

TEST(LowPolyCommand, NamesTheFlagOfAMapThatIsTooSmall) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const ProcessResult small = dense.bake("small", {"--max-error", "normal=5", "--size", "8"});
  EXPECT_EQ(small.exit_code, 2);
  EXPECT_NE(small.errors.find("--size"), std::string::npos) << small.errors;
}

TEST(LowPolyCommand, ExitsWith1WhereTheErrorIsOutOfReach) {
  KILN_REQUIRE_DEVICE();
  const Dense dense;
  const ProcessResult done =
      dense.bake("bad", {"--max-error", "normal=0.00001", "--match", "closest"});
  EXPECT_EQ(done.exit_code, 1);
  EXPECT_NE(done.errors.find("not reached"), std::string::npos) << done.errors;
  EXPECT_EQ(dense.report("bad")["plan"]["chosen"]["match"], "closest");
}

}  // namespace
}  // namespace kiln

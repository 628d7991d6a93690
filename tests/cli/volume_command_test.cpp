// kiln volume: files, figures, options, exit codes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/volumes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::ProcessResult;
using test::read_json;

fs::path make_scene() {
  const fs::path folder = test::scratch_folder();
  const Volume volume = test::make_volume<std::uint8_t>(
      {40, 40, 40}, VoxelType::u8, [](double x, double y, double z) {
        return std::clamp(128 + 8 * test::sphere_field(x - 19.5, y - 19.5, z - 19.5, 14) +
                              6 * std::sin(x * 0.8) * std::sin(y * 0.8) * std::sin(z * 0.8),
                          0.0, 255.0);
      });
  save_nrrd(volume, folder / "ball.nrrd");
  std::ofstream raw(folder / "ball.raw", std::ios::binary);
  raw.write(reinterpret_cast<const char*>(volume.voxels.data()),
            static_cast<std::streamsize>(volume.voxels.size()));
  return folder;
}

TEST(VolumeCommand, WritesMeshAndMap) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult result =
      call_kiln({"volume", scene / "ball.nrrd", "--iso", "127.5", "--faces", "500", "--size", "256",
                 "--out", scene / "out", "--full", scene / "full.obj", "--json", scene / "r.json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Mesh low = load_mesh(scene / "out" / "ball_low.obj");
  const json report = read_json(scene / "r.json");
  EXPECT_LE(low.triangles.size(), 500U);
  EXPECT_EQ(report["low"]["faces"], low.triangles.size());
  EXPECT_EQ(report["low"]["non_manifold_edges"], 0);
  EXPECT_EQ(low.uv_triangles.size(), low.triangles.size());
  EXPECT_EQ(test::read_picture(scene / "out" / "ball_low_normal.png").width, 256U);
  // Edges without length are taken out, of which there are few.
  const auto quads = report["contour"]["quads"].get<std::size_t>();
  EXPECT_LE(load_mesh(scene / "full.obj").triangles.size(), 2 * quads);
  EXPECT_GT(load_mesh(scene / "full.obj").triangles.size(), 2 * quads - quads / 50);
  for (const char* stage : {"scan", "hermite", "vertices", "quads", "simplify", "atlas", "map"}) {
    EXPECT_GT(report["seconds"][stage].get<double>(), 0) << stage;
  }
  // The same from the bare voxels, to the byte.
  const ProcessResult raw =
      call_kiln({"volume", scene / "ball.raw", "--raw-size", "40x40x40", "--iso", "127.5",
                 "--faces", "500", "--size", "256", "--out", scene / "raw", "--quiet"});
  ASSERT_EQ(raw.exit_code, 0) << raw.errors;
  EXPECT_EQ(raw.output, "");
  EXPECT_EQ(test::read_file(scene / "out" / "ball_low_normal.png"),
            test::read_file(scene / "raw" / "ball_low_normal.png"));
}

TEST(VolumeCommand, MakesSeveralLevels) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto run = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"volume", scene / "ball.nrrd", "--iso", "127.5",
                                      "--json", scene / "r.json",    "--out", scene / "out"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result;
  };
  run({"--faces", "1600", "--size", "256", "--lod", "3"});
  const json levels = read_json(scene / "out" / "ball_lods.json")["levels"];
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_EQ(read_json(scene / "r.json")["levels"], levels);
  std::size_t most = 1600;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::string stem = "ball_lod" + std::to_string(k);
    EXPECT_EQ(levels[k]["mesh"], stem + ".obj");
    EXPECT_EQ(levels[k]["maps"], json::array({stem + "_normal.png"}));
    const Mesh mesh = load_mesh(scene / "out" / (stem + ".obj"));
    EXPECT_EQ(levels[k]["faces"], mesh.triangles.size());
    EXPECT_LE(mesh.triangles.size(), most);
    most = mesh.triangles.size() / 4;
    EXPECT_EQ(test::read_picture(scene / "out" / (stem + "_normal.png")).width, 256U >> k);
    EXPECT_EQ(test::topology(mesh).parts, 1U);
  }
  // Each level is what the command makes with the same faces and map.
  run({"--faces", std::to_string(levels[0]["faces"].get<int>() / 4), "--size", "128"});
  EXPECT_EQ(test::read_file(scene / "out" / "ball_low_normal.png"),
            test::read_file(scene / "out" / "ball_lod1_normal.png"));
  // A level that the topology allows no fewer faces is left out.
  const ProcessResult few =
      run({"--faces", "8", "--size", "64", "--topology", "keep", "--lod", "4", "--force"});
  EXPECT_NE(few.errors.find("left out"), std::string::npos) << few.errors;
  EXPECT_LT(read_json(scene / "out" / "ball_lods.json")["levels"].size(), 4U);
}

TEST(VolumeCommand, BakesTheLongWay) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  for (const std::string match : {"ray", "closest"}) {
    const fs::path out = scene / match;
    const ProcessResult result = call_kiln({"volume",         scene / "ball.nrrd",
                                            "--iso",          "127.5",
                                            "--faces",        "400",
                                            "--size",         "256",
                                            "--match",        match,
                                            "--max-distance", "3",
                                            "--space",        "object",
                                            "--format",       "exr",
                                            "--out",          out,
                                            "--json",         out.string() + ".json"});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_TRUE(fs::exists(out / "ball_low_normal.exr"));
    const json report = read_json(out.string() + ".json");
    EXPECT_GT(report["bake"]["dense_triangles"], 4000);
    EXPECT_NE(result.output.find(" samples missed ("), std::string::npos) << result.output;
    // The map is fine, but holds no normals between fine vertices.
    for (const json& warning : report["warnings"]) EXPECT_NE(warning["code"], "map-too-fine");
  }
}

/// Options of the bake from the full contour reach it: each changes the map or its report as the help says.
TEST(VolumeCommand, BakesWithItsOptions) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  Image map;
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"volume",   scene / "ball.nrrd",
                                      "--iso",    "127.5",
                                      "--faces",  "400",
                                      "--size",   "128",
                                      "--out",    scene / "out",
                                      "--json",   scene / "r.json",
                                      "--format", "exr32",
                                      "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    map = load_image(scene / "out" / "ball_low_normal.exr");
    return read_json(scene / "r.json");
  };
  const json direct = run({});
  EXPECT_FALSE(direct.contains("bake"));
  EXPECT_GT(direct["map"]["splatted_texels"], 0);
  const json baked = run({"--match", "ray", "--max-distance", "3", "--chart-border", "4"});
  EXPECT_TRUE(baked["map"]["splatted_texels"].is_null());
  EXPECT_GT(baked["bake"]["texels"]["gutter"], 0);
  EXPECT_EQ(baked["bake"]["texels"]["samples"], baked["bake"]["texels"]["covered"]);
  const Image up = map;
  run({"--match", "ray", "--max-distance", "3", "--chart-border", "4", "--flip-y"});
  ASSERT_EQ(up.pixels.size(), map.pixels.size());
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    ASSERT_NEAR(map.pixels[i], i % 3 == 1 ? 1 - up.pixels[i] : up.pixels[i], 1e-6) << i;
  }
  const json fine = run({"--match", "ray", "--max-distance", "3", "--samples", "3"});
  EXPECT_GT(fine["bake"]["texels"]["samples"].get<int>(),
            4 * fine["bake"]["texels"]["covered"].get<int>());
  const json near = run({"--match", "ray", "--max-distance", "0.01"});
  EXPECT_GT(near["bake"]["texels"]["missed"].get<int>(),
            baked["bake"]["texels"]["missed"].get<int>() + 100);
}

/// Levels share what was chosen for the first one: the parts that are left out, and whether handles may be lost.
TEST(VolumeCommand, LevelsShareWhatWasChosen) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  // A ball, and 216 specks in the opposite corner
  save_nrrd(test::make_volume<std::uint8_t>(
                {48, 48, 48}, VoxelType::u8,
                [](double x, double y, double z) {
                  const bool speck = x < 24 && y < 24 && z < 24 && std::fmod(x, 4) == 2 &&
                                     std::fmod(y, 4) == 2 && std::fmod(z, 4) == 2;
                  const double ball = test::sphere_field(x - 34, y - 34, z - 34, 11);
                  return speck ? 255.0 : std::clamp(128 + 20 * ball, 0.0, 255.0);
                }),
            scene / "specks.nrrd");
  save_nrrd(test::make_volume<std::uint8_t>({48, 48, 48}, VoxelType::u8,
                                            [](double x, double y, double z) {
                                              const double v = test::gyroid_field(x, y, z, 12);
                                              return std::clamp(128 + 60 * v, 0.0, 255.0);
                                            }),
            scene / "gyroid.nrrd");
  const auto levels = [&](const std::string& name) {
    const ProcessResult result = call_kiln(
        {"volume", scene / (name + ".nrrd"), "--iso", "128", "--faces", "600", "--size", "128",
         "--lod", "2", "--out", scene / "out", "--json", scene / "r.json", "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return read_json(scene / "out" / (name + "_lods.json"))["levels"];
  };
  ASSERT_EQ(levels("specks").size(), 2U);
  EXPECT_GT(read_json(scene / "r.json")["contour"]["parts"], 100);
  for (const char* level : {"specks_lod0.obj", "specks_lod1.obj"})
    EXPECT_EQ(test::topology(load_mesh(scene / "out" / level)).parts, 1U) << level;
  const json free = levels("gyroid");
  EXPECT_EQ(read_json(scene / "r.json")["used"]["topology"], "free");
  ASSERT_EQ(free.size(), 2U);
  EXPECT_LE(free[1]["faces"], 150);
}

TEST(VolumeCommand, OuterSurfaceAlone) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  save_nrrd(test::make_volume<std::uint8_t>({32, 32, 32}, VoxelType::u8,
                                            [](double x, double y, double z) {
                                              const double r =
                                                  std::hypot(x - 15.5, y - 15.5, z - 15.5);
                                              return r < 13 && r > 6 ? 200 : 10;
                                            }),
            scene / "shell.nrrd");
  for (const bool outer : {false, true}) {
    std::vector<std::string> words = {
        "volume", scene / "shell.nrrd", "--iso", "100",         "--size", "256",
        "--json", scene / "r.json",     "--out", scene / "out", "--quiet"};
    if (outer) words.insert(words.end(), {"--outer", "--outer-gap", "1"});
    const ProcessResult result = call_kiln(words);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const json report = read_json(scene / "r.json");
    EXPECT_EQ(report["contour"]["parts"], outer ? 1 : 2);
    EXPECT_EQ(report["options"]["outer_gap"], outer ? json(1) : json());
    if (!outer) {
      EXPECT_TRUE(report["contour"]["filled_voxels"].is_null());
      continue;
    }
    EXPECT_NEAR(report["contour"]["filled_voxels"].get<double>(), 905, 60);  // 4/3 pi 6^3
    EXPECT_GT(report["seconds"]["outer"].get<double>(), 0);
  }
}

TEST(VolumeCommand, ChoosesWhatNoFlagSays) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"volume", scene / "ball.nrrd", "--iso", "127.5",
                                      "--json", scene / "r.json",    "--out", scene / "out"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result;
  };
  const ProcessResult chosen = run({});
  json report = read_json(scene / "r.json");
  EXPECT_LE(report["low"]["faces"], report["contour"]["quads"].get<int>() / 10 + 1);
  EXPECT_EQ(report["used"]["topology"], "keep");
  EXPECT_EQ(report["used"]["size"],
            test::read_picture(scene / "out" / "ball_low_normal.png").width);
  EXPECT_NEAR(report["map"]["texels_per_cell"].get<double>(), 1, 0.2);
  EXPECT_EQ(report["options"]["size"], "auto");
  EXPECT_EQ(report["options"]["error"], "auto");
  for (const char* words : {"chosen: error ", "chosen: topology kept", "chosen: map of "}) {
    EXPECT_NE(chosen.output.find(words), std::string::npos) << chosen.output;
  }
  // The same, said.
  const std::string map = test::read_file(scene / "out" / "ball_low_normal.png");
  char error[32];
  std::snprintf(error, sizeof error, "%.17g", report["used"]["error"].get<double>());
  const ProcessResult said = run({"--size", std::to_string(report["used"]["size"].get<int>()),
                                  "--topology", "keep", "--min-part", "0", "--error", error});
  EXPECT_EQ(said.output.find("chosen:"), std::string::npos) << said.output;
  EXPECT_EQ(test::read_file(scene / "out" / "ball_low_normal.png"), map);
  report = read_json(scene / "r.json");
  EXPECT_TRUE(report["used"]["aimed_faces"].is_null());
}

TEST(VolumeCommand, FacesAskedForAreReached) {
  // Tunnels through a cube: keeping them takes more than twice the faces.
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  save_nrrd(test::make_volume<std::uint8_t>({48, 48, 48}, VoxelType::u8,
                                            [](double x, double y, double z) {
                                              const double v = test::gyroid_field(x, y, z, 12);
                                              return std::clamp(128 + 60 * v, 0.0, 255.0);
                                            }),
            scene / "gyroid.nrrd");
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"volume", scene / "gyroid.nrrd", "--iso",   "128",
                                      "--json", scene / "r.json",      "--faces", "500",
                                      "--out",  scene / "out"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return read_json(scene / "r.json");
  };
  const json chosen = run({});
  EXPECT_EQ(chosen["used"]["topology"], "free");
  EXPECT_LE(chosen["low"]["faces"], 500);
  EXPECT_EQ(chosen["warnings"][0]["code"], "topology-changed");
  const json kept = run({"--topology", "keep"});
  EXPECT_EQ(kept["used"]["topology"], "keep");
  EXPECT_GT(kept["low"]["faces"], 1000);
  EXPECT_EQ(chosen["used"]["faces_with_topology"], kept["low"]["faces"]);
  EXPECT_EQ(kept["warnings"][0]["code"], "faces-not-reached");
}

TEST(VolumeCommand, RefusesWhatCannotBe) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {"volume", scene / "ball.nrrd", "--out", scene / "out"};
    words.insert(words.end(), more.begin(), more.end());
    return call_kiln(words);
  };
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "high"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "nan"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--faces", "10", "--error", "1"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--size", "64x32"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--raw-type", "u16"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--raw-type", "u8"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--raw-order", "little"}).exit_code, 2);
  const ProcessResult not_raw = run({"--iso", "100", "--raw-size", "40x40x40"});
  EXPECT_EQ(not_raw.exit_code, 2);
  EXPECT_NE(not_raw.errors.find("header"), std::string::npos) << not_raw.errors;
  EXPECT_EQ(run({"--iso", "100", "--max-distance", "1"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--topology", "free"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--raw-size", "40x40"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--min-part", "101"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--min-part", "few"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--outer-gap", "1"}).exit_code, 2);
  EXPECT_EQ(run({"--iso", "100", "--outer", "--outer-gap", "65"}).exit_code, 2);
  // The ball is the outside here, and nothing leads into it.
  EXPECT_EQ(run({"--iso", "127.5", "--inside", "below", "--outer"}).exit_code, 3);
  EXPECT_EQ(run({"--iso", "100", "--full", scene / "full.ply"}).exit_code, 2);
  const ProcessResult out_of_range = run({"--iso", "999"});
  EXPECT_EQ(out_of_range.exit_code, 3);
  EXPECT_NE(out_of_range.errors.find("range"), std::string::npos) << out_of_range.errors;
  const ProcessResult at_end = run({"--iso", "0"});
  EXPECT_EQ(at_end.exit_code, 3);
  EXPECT_NE(at_end.errors.find("at the end of the range"), std::string::npos) << at_end.errors;
  EXPECT_NE(at_end.errors.find("strictly between"), std::string::npos) << at_end.errors;
  EXPECT_EQ(run({"--iso", "127.5", "--error", "0.001", "--size", "16"}).exit_code, 2);
  EXPECT_FALSE(fs::exists(scene / "out" / "ball_low.obj"));
}

}  // namespace
}  // namespace kiln

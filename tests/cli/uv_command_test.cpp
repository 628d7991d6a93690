// kiln bake --match uv, and height fields: files, figures, exit codes.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/process.h"
#include "support/shapes.h"
#include "support/tiff_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::ProcessResult;
using test::read_json;

/// A bumpy plane and a low poly of the same layout, but for a shift of the high poly's.
fs::path make_scene(float shift) {
  const fs::path folder = test::scratch_folder();
  Mesh dense = test::plane(60, 60);
  dense.normals.clear();
  dense.normal_triangles.clear();
  for (Vec3& p : dense.positions) p.z = 0.01F * std::sin(20 * p.x);
  for (Vec2& uv : dense.uvs) uv.x += shift;
  save_obj(dense, folder / "high.obj");
  save_obj(test::plane(2, 2), folder / "low.obj");
  return folder;
}

std::vector<std::string> bake_command(const fs::path& scene) {
  return {"bake",  scene / "high.obj", scene / "low.obj", "--match",       "uv", "--size", "64",
          "--out", scene / "out",      "--json",          scene / "r.json"};
}

TEST(UvCommand, SaysWhyNoSampleHasAPoint) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(3);
  std::vector<std::string> command = bake_command(scene);
  const ProcessResult outside = call_kiln(command);
  EXPECT_EQ(outside.exit_code, 3);
  EXPECT_NE(outside.errors.find("outside the unit square"), std::string::npos) << outside.errors;
  EXPECT_EQ(outside.errors.find("--max-distance"), std::string::npos) << outside.errors;
  Mesh flat = test::plane(4, 4);
  for (Vec2& uv : flat.uvs) uv = {0.5F, 0.5F};
  save_obj(flat, scene / "high.obj");
  const ProcessResult none = call_kiln(command);
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.errors.find("no area"), std::string::npos) << none.errors;
  EXPECT_FALSE(fs::exists(scene / "out"));
}

// Texels that are next to nothing in the world once made a grid of cells without end.
TEST(UvCommand, VastOnesEnd) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(0);
  const Mesh flat = test::plane(2, 2);
  for (const float scale : {1e6F, 1e12F, 1e30F}) {
    Mesh low = flat;
    for (Vec2& uv : low.uvs) uv = {uv.x * scale, uv.y * scale};
    save_obj(low, scene / "low.obj");
    const ProcessResult result = call_kiln(
        {"bake", scene / "high.obj", scene / "low.obj", "--size", "16", "--out", scene / "out"});
    EXPECT_NE((result.output + result.errors).find("unit square"), std::string::npos)
        << result.exit_code << result.errors;
    const ProcessResult tiles = call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size",
                                           "16", "--out", scene / "out", "--sets", "udim"});
    EXPECT_EQ(tiles.exit_code, 3);
    EXPECT_NE(tiles.errors.find("from 0 to 900"), std::string::npos) << tiles.errors;
  }
}

TEST(UvCommand, ANameTooLongIsToldAsSuch) {
  const fs::path scene = make_scene(0);
  for (const char* ending : {".glb", "/"}) {
    const std::string name = std::string(300, 'a');
    const ProcessResult result = call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size",
                                            "16", "--out", scene / (name + ending)});
    EXPECT_EQ(result.exit_code, 5) << result.errors;
    EXPECT_NE(result.errors.find("too long"), std::string::npos) << result.errors;
  }
}

TEST(UvCommand, AReportOnStandardOutputIsAlone) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(0);
  std::vector<std::string> command = bake_command(scene);
  command.back() = "-";
  const ProcessResult result = call_kiln(command);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(json::parse(result.output)["options"]["match"], "uv");
  EXPECT_NE(result.errors.find("covered twice"), std::string::npos) << result.errors;
}

TEST(UvCommand, RefusesAFolderInTheMapsPlaceBeforeAnyWork) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(0);
  fs::create_directories(scene / "out" / "low_normal.png");
  const ProcessResult result = call_kiln(bake_command(scene));
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_NE(result.errors.find("low_normal.png' is a folder"), std::string::npos) << result.errors;
  EXPECT_FALSE(fs::exists(scene / "r.json"));
}

TEST(UvCommand, AHeightFieldOfAnotherExtentIsToldSo) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Image heights{33, 33, 1, std::vector<float>(33 * 33)};
  for (std::size_t i = 0; i < heights.pixels.size(); ++i) {
    heights.pixels[i] = 0.5F + 0.5F * std::sin(0.3F * static_cast<float>(i % 33));
  }
  save_image(heights, scene / "h.exr", {});
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> command = {"bake", scene / "h.exr", "--size",
                                        "64",   "--out",         scene / "out"};
    command.insert(command.begin() + 2, more.begin(), more.end());
    return call_kiln(command);
  };
  ASSERT_EQ(run({"--height", "4", "--extent", "100", "--faces", "60"}).exit_code, 0);
  const ProcessResult result = run({scene / "out" / "h_low.obj", "--height", "4"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.errors.find("--extent"), std::string::npos) << result.errors;
}

TEST(UvCommand, BakesAndReports) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(0);
  const ProcessResult result = call_kiln(bake_command(scene));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_TRUE(fs::exists(scene / "out" / "low_normal.png"));
  EXPECT_NE((result.output + result.errors).find("covered twice"), std::string::npos);
  const json report = read_json(scene / "r.json");
  EXPECT_EQ(report["options"]["match"], "uv");
  EXPECT_EQ(report["texels"]["uv"], 64 * 64);
  EXPECT_EQ(report["uv"]["overlapping"], 0);
  EXPECT_TRUE(report["uv"]["overlap"].is_null());
  // The mean of 0.01 |sin| is 0.0064.
  EXPECT_NEAR(report["uv"]["distance"]["mean"].get<double>(), 0.0064, 1e-3);
  EXPECT_NEAR(report["uv"]["distance"]["p95"].get<double>(), 0.01, 1e-3);
}

TEST(UvCommand, RefusesLayoutsThatDisagreeUnlessForced) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(0.2F);
  std::vector<std::string> command = bake_command(scene);
  const ProcessResult refused = call_kiln(command);
  EXPECT_EQ(refused.exit_code, 3) << refused.errors;
  EXPECT_NE(refused.errors.find("layouts"), std::string::npos) << refused.errors;
  EXPECT_NE(refused.errors.find("--force-uv"), std::string::npos);
  EXPECT_FALSE(fs::exists(scene / "out" / "low_normal.png"));
  command.emplace_back("--force-uv");
  const ProcessResult forced = call_kiln(command);
  EXPECT_EQ(forced.exit_code, 0) << forced.errors;
  EXPECT_NE(forced.errors.find("layouts"), std::string::npos) << forced.errors;
}

TEST(UvCommand, RefusesContradictions) {
  const fs::path scene = make_scene(0);
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--max-distance", "1"}, {"--height", "2"}, {"--extent", "3"}}) {
    std::vector<std::string> command = bake_command(scene);
    command.insert(command.end(), more.begin(), more.end());
    EXPECT_EQ(call_kiln(command).exit_code, 2) << more[0];
  }
  EXPECT_EQ(call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--force-uv", "--out",
                       scene / "out"})
                .exit_code,
            2);
}

class HeightFieldCommand : public ::testing::TestWithParam<std::string> {};

TEST_P(HeightFieldCommand, BakesOntoAPlaneOrASimplifiedTerrain) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Image image{65, 33, 1, std::vector<float>(65 * 33)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = 0.5F + 0.4F * std::sin(0.25F * static_cast<float>(i % 65)) *
                                 std::cos(0.3F * static_cast<float>(i / 65));
  }
  const fs::path field = scene / ("field." + GetParam());
  SaveImageOptions save;
  save.format = GetParam() == "png" ? ImageFormat::png16 : ImageFormat::exr_float;
  save_image(image, field, save);
  std::vector<std::string> command = {
      "bake",  field,      "--height", "4",     "--extent",      "64",     "--size",
      "64x32", "--format", "exr",      "--out", scene / "plane", "--json", scene / "r.json"};
  const ProcessResult plane = call_kiln(command);
  ASSERT_EQ(plane.exit_code, 0) << plane.errors;
  json report = read_json(scene / "r.json");
  EXPECT_EQ(report["options"]["match"], "uv");
  EXPECT_EQ(report["texels"]["missed"], 0);
  EXPECT_EQ(report["inputs"]["high"]["triangles"], 2 * 64 * 32);
  const Mesh low = load_mesh(scene / "plane" / "field_low.obj");
  EXPECT_EQ(low.triangles.size(), 2U);
  // The slopes of the sum, in the middle of a cell.
  const Image map = load_image(scene / "plane" / "field_low_normal.exr");
  const double i = 20.5;
  const double j = 10.5;
  const double dx = 4 * 0.4 * 0.25 * std::cos(0.25 * i) * std::cos(0.3 * j);
  const double dy = 4 * 0.4 * 0.3 * std::sin(0.25 * i) * std::sin(0.3 * j);
  const double size = std::sqrt(dx * dx + dy * dy + 1);
  EXPECT_NEAR(map.at(20, 10)[0] * 2 - 1, -dx / size, 0.02);
  EXPECT_NEAR(map.at(20, 10)[1] * 2 - 1, -dy / size, 0.02);

  // A match that searches would look for heights near the plane.
  for (const char* match : {"ray", "views", "closest", "visibility", "hybrid"}) {
    std::vector<std::string> searching = command;
    searching.insert(searching.end(), {"--match", match});
    const ProcessResult refused = call_kiln(searching);
    EXPECT_EQ(refused.exit_code, 2) << match;
    for (const char* remedy : {"leave --match out", "--faces", "LOW", "--max-distance"}) {
      EXPECT_NE(refused.errors.find(remedy), std::string::npos) << refused.errors;
    }
  }
  std::vector<std::string> far = command;
  far.insert(far.end(), {"--match", "ray", "--max-distance", "50%"});
  EXPECT_EQ(call_kiln(far).exit_code, 0);
  std::vector<std::string> automatic = command;
  automatic.insert(automatic.end(), {"--match", "auto", "--max-angle", "12"});
  const ProcessResult chosen = call_kiln(automatic);
  ASSERT_EQ(chosen.exit_code, 0) << chosen.errors;
  report = read_json(scene / "r.json");
  EXPECT_EQ(report["plan"]["reached"], true);
  const Mesh planned = load_mesh(scene / "plane" / "field_low.obj");
  EXPECT_EQ(planned.triangles.size(), report["plan"]["chosen"]["faces"]);
  EXPECT_GT(planned.triangles.size(), 2U);

  command[11] = scene / "terrain";
  command.insert(command.end(), {"--faces", "300"});
  const ProcessResult terrain = call_kiln(command);
  ASSERT_EQ(terrain.exit_code, 0) << terrain.errors;
  report = read_json(scene / "r.json");
  EXPECT_LE(report["low"]["faces"], 300);  // or one fewer, where a collapse takes two
  EXPECT_LT(report["uv"]["distance"]["p95"].get<double>(), 1.0);
  const Mesh simple = load_mesh(scene / "terrain" / "field_low.obj");
  EXPECT_GE(simple.triangles.size(), 299U);
  EXPECT_EQ(simple.uv_triangles.size(), simple.triangles.size());
}

INSTANTIATE_TEST_SUITE_P(Formats, HeightFieldCommand, ::testing::Values("png", "exr"));

#ifdef KILN_HAS_TIFF
/// A GeoTIFF's pixels need not be squares: 5 x 3 of them, 2 by 7 metres apart, cover 8 by 14 metres.
TEST(UvCommand, PixelsOfHeightsHaveTwoDistances) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  constexpr std::uint16_t kFloats = 3;
  test::TiffFile field(5, 3, kFloats, std::vector<float>(15, 1));
  std::ofstream(scene / "field.tif", std::ios::binary) << field.scale(2, 7).bytes();
  const ProcessResult baked = call_kiln(
      {"bake", scene / "field.tif", "--size", "16", "--maps", "normal", "--out", scene / "out"});
  ASSERT_EQ(baked.exit_code, 0) << baked.errors;
  const Mesh low = load_mesh(scene / "out" / "field_low.obj");
  ASSERT_FALSE(low.positions.empty());
  for (const Vec3& p : low.positions) {
    EXPECT_EQ(std::abs(p.x), 4);
    EXPECT_EQ(std::abs(p.y), 7);
  }
}
#endif

TEST(UvCommand, MakesALightMeshWithTheDenseLayout) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(0);
  const ProcessResult baked =
      call_kiln({"bake", scene / "high.obj", "--match", "uv", "--faces", "400", "--size", "64",
                 "--out", scene / "out", "--json", scene / "r.json"});
  ASSERT_EQ(baked.exit_code, 0) << baked.errors;
  const json report = read_json(scene / "r.json");
  EXPECT_LE(report["low"]["faces"].get<int>(), 400);
  EXPECT_EQ(report["low"]["flaws"]["folded"], 0);
  EXPECT_EQ(report["texels"]["missed"], 0);
  const Mesh low = load_mesh(scene / "out" / "high_low.obj");
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {  // The plane's layout follows its place.
      const Vec3& p = low.positions[low.triangles[t][k]];
      const Vec2& uv = low.uvs[low.uv_triangles[t][k]];
      EXPECT_NEAR(uv.x, p.x + 0.5, 0.02);
      EXPECT_NEAR(uv.y, p.y + 0.5, 0.02);
    }
  }
}

TEST(UvCommand, SimplifyKeepsUvsWhereAsked) {
  const fs::path scene = make_scene(0);
  const ProcessResult kept =
      call_kiln({"simplify", scene / "high.obj", "--keep-uvs", "--faces", "300", "--out",
                 scene / "kept.obj", "--json", scene / "s.json"});
  ASSERT_EQ(kept.exit_code, 0) << kept.errors;
  const json report = read_json(scene / "s.json");
  EXPECT_EQ(report["charts"], 1);
  EXPECT_NEAR(report["coverage"].get<double>(), 1, 1e-3);
  EXPECT_EQ(report["unwrap"], "kept");
  const ProcessResult both = call_kiln(
      {"simplify", scene / "high.obj", "--keep-uvs", "--size", "512", "--out", scene / "both.obj"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.errors.find("--size"), std::string::npos);
  Mesh bare = test::icosphere(3);
  save_obj(bare, scene / "bare.obj");
  const ProcessResult none = call_kiln(
      {"simplify", scene / "bare.obj", "--keep-uvs", "--faces", "99", "--out", scene / "n.obj"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.errors.find("no UVs to keep"), std::string::npos) << none.errors;
}

}  // namespace
}  // namespace kiln

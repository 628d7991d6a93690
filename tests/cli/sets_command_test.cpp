// kiln bake --sets: files, sizes, reports and refusals.
#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <set>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/asset.h"
#include "support/json_file.h"
#include "support/pictures.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_exit;
using test::expect_failure;
using test::low_of_halves;
using test::make_scene;
using test::names;
using test::ProcessResult;
using test::read_json;

fs::path make_scene_of_sets(float tile) {
  const fs::path folder = make_scene();
  save_obj(low_of_halves(tile, "Glass pane/1"), folder / "low.obj");
  return folder;
}

std::vector<std::string> command(const fs::path& scene) {
  return {"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "o", "--size", "64"};
}

std::vector<std::string> with(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(SetsCommand, MaterialsThatOverlapGetMapsOfTheirOwn) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  const ProcessResult result =
      call_kiln(with(command(scene), {"--size", "body=32x16", "--json", scene / "r.json"}));
  expect_exit(result, 0, {});
  EXPECT_EQ(names(scene / "o"),
            (std::vector<std::string>{"low_Glass_pane_1_normal.png", "low_body_normal.png"}));
  EXPECT_EQ(test::read_picture(scene / "o/low_body_normal.png").width, 32U);
  EXPECT_EQ(test::read_picture(scene / "o/low_Glass_pane_1_normal.png").width, 64U);
  const auto report = read_json(scene / "r.json");
  EXPECT_EQ(report["options"]["sets"], "material");
  ASSERT_EQ(report["sets"].size(), 2U);
  EXPECT_EQ(report["sets"][0]["name"], "Glass pane/1");
  EXPECT_EQ(report["sets"][1]["height"], 16);
  EXPECT_EQ(report["texels"]["samples"], report["sets"][0]["texels"]["samples"].get<int>() +
                                             report["sets"][1]["texels"]["samples"].get<int>());
}

/// A LOW that Kiln makes or unwraps is one atlas, or has a square a material.
TEST(SetsCommand, LayoutsOfKilnsOwnHaveSets) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  // Of few triangles: each is a chart here.
  save_obj(low_of_halves(0, "Glass pane/1", test::BumpySphere::light(12, 6)), scene / "low.obj");
  const std::vector<std::string> made = {
      "bake",  scene / "low.obj", "--faces", "100000", "--size",      "128",
      "--out", scene / "m/a.glb", "--maps",  "normal", "--keep-inner"};
  for (const bool given : {false, true}) {
    std::vector<std::string> words = made;
    if (given) words = with(command(scene), {"--unwrap", "--maps", "normal"});
    expect_exit(call_kiln(with(words, {"--sets", "one", "--json", scene / "one.json"})), 0, {});
    EXPECT_FALSE(read_json(scene / "one.json").contains("sets"));
    if (!given) {  // the source's own, where nobody says
      const ProcessResult result = call_kiln(with(words, {"--json", scene / "r.json"}));
      expect_exit(result, 0, {});
      EXPECT_NE(result.output.find("--sets one"), std::string::npos) << result.output;
      EXPECT_EQ(read_json(scene / "r.json")["sets"].size(), 2U);
    }
    expect_exit(call_kiln(with(words, {"--sets", "material", "--size", "body=64", "--json",
                                       scene / "r.json"})),
                0, {});
    const auto report = read_json(scene / "r.json");
    ASSERT_EQ(report["sets"].size(), 2U);
    EXPECT_EQ(report["sets"][1]["width"], 64);
    for (const auto& set : report["sets"]) {
      const double texels = set["width"].get<double>() * set["height"].get<double>();
      EXPECT_GT(set["texels"]["samples"].get<double>(),
                0.2 * texels);  // a square each: in one for both, it would be half of 0.28
    }
    for (const auto& warning : report["warnings"]) EXPECT_NE(warning["code"], "uv-overlap");
  }
  const Asset asset = load_asset(scene / "m/a.glb");
  EXPECT_EQ(asset.mesh.material_names.size(), 2U);
  EXPECT_EQ(asset.materials[0].normal_map.bytes == asset.materials[1].normal_map.bytes, false);
}

TEST(SetsCommand, TilesAreNumbered) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(1);
  expect_exit(call_kiln(with(command(scene), {"--mips"})), 0, {});
  const std::vector<std::string> files = names(scene / "o");
  for (const char* name :
       {"low_normal.1001.png", "low_normal.1002.png", "low_normal.1002.mip01.png"}) {
    EXPECT_TRUE(std::find(files.begin(), files.end(), name) != files.end()) << name;
  }
}

/// Two materials over the same tiles, both of which each spans.
TEST(SetsCommand, MaterialsSpanTiles) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(1);
  Mesh low = load_mesh(scene / "low.obj");
  low.materials.clear();
  for (const Triangle& t : low.triangles) {
    low.materials.push_back(low.positions[t[0]].z > 0 ? 0 : 1);
  }
  low.material_names = {"a", "b"};
  save_obj(low, scene / "low.obj");
  const std::vector<std::string> by_material =
      with(command(scene), {"--sets", "material", "--size", "b=32"});
  expect_exit(call_kiln(with(by_material, {"--json", scene / "r.json"})), 0, {});
  EXPECT_EQ(names(scene / "o"),
            (std::vector<std::string>{"low_a_normal.1001.png", "low_a_normal.1002.png",
                                      "low_b_normal.1001.png", "low_b_normal.1002.png"}));
  EXPECT_EQ(test::read_picture(scene / "o/low_b_normal.1002.png").width, 32U);
  EXPECT_EQ(read_json(scene / "r.json")["sets"][1]["tile"], "1002");
  std::vector<std::string> glb = by_material;
  glb[4] = scene / "low.glb";
  expect_exit(call_kiln(glb), 0, {});
  const Mesh read = load_mesh(scene / "low.glb");
  EXPECT_EQ(std::set<std::string>(read.material_names.begin(), read.material_names.end()),
            (std::set<std::string>{"a.1001", "a.1002", "b.1001", "b.1002"}));
  for (const Vec2& uv : read.uvs) EXPECT_TRUE(uv.x >= 0 && uv.x <= 1) << uv.x;
}

/// Pictures and measures of a map that is baked for them have one map.
TEST(SetsCommand, OneMapForSeveralSetsIsRefused) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  expect_failure({"render", scene / "low.obj", "--reference", scene / "high.obj", "--map-size",
                  "64", "--out", scene / "r.png"},
                 3, {"several texture sets", "kiln bake"}, scene / "r.png");
  expect_exit(call_kiln(command(scene)), 0, {});
  expect_exit(call_kiln({"render", scene / "low.obj", "--normal", scene / "o/low_body_normal.png",
                         "--size", "64", "--out", scene / "r.png"}),
              0, {"several texture sets"});
}

/// A folder of that name is not what was asked for.
TEST(SetsCommand, OutIsAFolderOrAnAsset) {
  const fs::path scene = make_scene();
  for (const char* name : {"low.fbx", "low.usdz", "map.PNG"}) {
    expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / name}, 2,
                   {name, "NAME.glb"}, scene / name);
  }
  for (const char* name : {".glb", "new/.GLTF", ".obj", ".png"}) {
    expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / name}, 2,
                   {name, "NAME."}, scene / name);
  }
  const fs::path folder = scene / "there.glb";
  fs::create_directory(folder);
  expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", folder}, 2,
                 {"is an existing folder", "slash"}, folder / "low_normal.png");
  KILN_REQUIRE_DEVICE();
  expect_exit(call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size", "16", "--out",
                         folder.string() + "/"}),
              0, {});
  EXPECT_EQ(names(folder), std::vector<std::string>{"low_normal.png"});
}

TEST(SetsCommand, RefusesWhatHasNoSets) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  const fs::path out = scene / "o";
  expect_failure(with(command(scene), {"--size", "wood=64"}), 2, {"wood", "'body'"}, out);
  expect_failure(with(command(scene), {"--size", "64"}), 2, {"--size", "twice"}, out);
  expect_failure(with(command(scene), {"--sets", "none", "--size", "body=64"}), 2, {"--sets none"},
                 out);
  expect_failure({"bake", scene / "high.obj", "--faces", "500", "--sets", "udim", "--out", out}, 2,
                 {"--sets udim", "atlas"}, out);
}

/// A saved match, and what it tells, are a set's own, named as its maps are.
TEST(SetsCommand, MatchesAndReasonsAreOfASet) {
  KILN_REQUIRE_DEVICE();
  for (const bool tiles : {false, true}) {
    const fs::path scene = make_scene_of_sets(tiles ? 1 : 0);
    expect_exit(call_kiln(with(command(scene), {"--reasons", "--save-match", scene / "m/m.exr",
                                                "--json", scene / "r.json"})),
                0, {});
    EXPECT_EQ(names(scene / "m"),
              tiles ? (std::vector<std::string>{"m.1001.exr", "m.1002.exr"})
                    : (std::vector<std::string>{"m_Glass_pane_1.exr", "m_body.exr"}));
    EXPECT_EQ(names(scene / "o"),
              tiles ? (std::vector<std::string>{"low_normal.1001.png", "low_normal.1002.png",
                                                "low_reasons.1001.png", "low_reasons.1002.png"})
                    : (std::vector<std::string>{"low_Glass_pane_1_normal.png",
                                                "low_Glass_pane_1_reasons.png",
                                                "low_body_normal.png", "low_body_reasons.png"}));
    const auto report = read_json(scene / "r.json");
    double weight = 0;
    for (const auto& set : report["sets"]) {
      EXPECT_EQ(set["reasons"][0]["reason"], "found");
      EXPECT_GT(set["recall"]["places"], 1000);
      weight += set["recall"]["places"].get<double>();
    }
    EXPECT_EQ(report["recall"]["places"], weight);

    std::vector<std::string> again = command(scene);
    again[4] = scene / "again";
    expect_exit(call_kiln(with(again, {"--load-match", scene / "m/m.exr"})), 0, {});
    for (const std::string& name : names(scene / "again")) {
      EXPECT_EQ(test::read_picture(scene / "o" / name).pixels,
                test::read_picture(scene / "again" / name).pixels)
          << name;
    }
    EXPECT_EQ(names(scene / "again").size(), 2U);
    fs::remove(scene / "m" / (tiles ? "m.1002.exr" : "m_body.exr"));
    expect_exit(call_kiln(with(again, {"--load-match", scene / "m/m.exr"})), 3,
                {tiles ? "m.1002.exr" : "m_body.exr", tiles ? "'1002'" : "'body'"});
  }
}

/// Each set has the size that it needs: pictures of the others do not count.
TEST(SetsCommand, ArePlannedOneByOne) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  std::vector<std::string> words = command(scene);
  words.pop_back();
  expect_exit(call_kiln(with(words, {"512", "--match", "auto", "--max-angle", "8", "--json",
                                     scene / "r.json"})),
              0, {});
  const auto report = read_json(scene / "r.json");
  ASSERT_EQ(report["sets"].size(), 2U);
  for (const auto& set : report["sets"]) {
    EXPECT_TRUE(set["auto"]["reached"]);
    EXPECT_LE(set["auto"]["chosen"]["mean_angle_degrees"], 8);
    EXPECT_LT(set["width"], 512);
    EXPECT_EQ(test::read_picture(set["files"][0].get<std::string>()).width, set["width"]);
  }
}

TEST(SetsCommand, ClustersAreOfASet) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(1);
  expect_exit(call_kiln(with(command(scene), {"--match", "visibility", "--visibility-clusters", "2",
                                              "--visibility-at", "texel"})),
              0, {});
  EXPECT_EQ(names(scene / "o"),
            (std::vector<std::string>{"low_clusters.1001.exr", "low_clusters.1002.exr",
                                      "low_normal.1001.png", "low_normal.1002.png",
                                      "low_normal_1.1001.png", "low_normal_1.1002.png"}));
}

/// Ten unit squares beside each other, each over all of a tile, under a surface that waves.
TEST(SetsCommand, CopiesInOtherTilesAreTilesWhereHighDiffers) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  const auto grid = [](std::uint32_t squares, std::uint32_t cells, float waves) {
    Mesh mesh;
    for (std::uint32_t y = 0; y <= cells; ++y) {
      for (std::uint32_t x = 0; x <= squares * cells; ++x) {
        const float u = static_cast<float>(x) / static_cast<float>(cells);
        const float v = static_cast<float>(y) / static_cast<float>(cells);
        mesh.positions.push_back({u, v, 0.02F * std::sin(waves * u) * std::sin(5 * v)});
        mesh.uvs.push_back({u, v});
      }
    }
    const std::uint32_t row = squares * cells + 1;
    for (std::uint32_t y = 0; y < cells; ++y) {
      for (std::uint32_t x = 0; x + 1 < row; ++x) {
        const std::uint32_t a = y * row + x;
        mesh.triangles.push_back({a, a + 1, a + row + 1});
        mesh.triangles.push_back({a, a + row + 1, a + row});
      }
    }
    mesh.uv_triangles = mesh.triangles;
    return mesh;
  };
  save_obj(grid(10, 1, 0), scene / "low.obj");
  constexpr float kTurn = 6.2831853F;
  for (const bool repeats : {false, true}) {
    save_obj(grid(10, 20, repeats ? kTurn : 4), scene / "high.obj");
    expect_exit(call_kiln(with(command(scene), {"--json", scene / "r.json"})), 0, {});
    const auto report = read_json(scene / "r.json");
    EXPECT_EQ(report["options"]["sets"], repeats ? "none" : "udim");
    EXPECT_LT(report["recall"]["lost"], 0.01);
    EXPECT_TRUE(report["warnings"].empty()) << report["warnings"];
  }
}

/// Whatever sets are called, each has a file of its own in the folder.
TEST(SetsCommand, FilesAreSafeAndDistinct) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  Mesh low = low_of_halves(0);
  const std::string longest(100000, 'x');
  low.material_names = {"wood",     "wood_bent", "a/b",        "a\\b",        "A_B",
                        "../../up", "..",        "q\"u'o#t%e", longest + "1", longest + "2"};
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    low.materials[t] = static_cast<std::uint32_t>(t % low.material_names.size());
  }
  save_obj(low, scene / "low.obj");
  std::vector<std::string> words = with(
      command(scene), {"--sets", "material", "--maps", "normal,bent_normal", "--ao-rays", "4"});
  expect_exit(call_kiln(words), 0, {});
  std::vector<std::string> files = names(scene / "o");
  EXPECT_EQ(files.size(), 2 * low.material_names.size());
  for (std::string& file : files) {
    EXPECT_EQ(file.find_first_of("\"'#%\\"), std::string::npos) << file;
    EXPECT_LT(file.size(), 200U);
    for (char& c : file) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  std::sort(files.begin(), files.end());
  EXPECT_TRUE(std::adjacent_find(files.begin(), files.end()) == files.end());
}

/// Two low polys of one name do not write over each other's sets.
TEST(SetsCommand, OtherLowsMapsStay) {
  KILN_REQUIRE_DEVICE();
  for (const float tile : {0.F, 1.F}) {
    const fs::path scene = make_scene_of_sets(tile);
    expect_exit(call_kiln(command(scene)), 0, {});
    fs::create_directory(scene / "b");
    save_obj(low_of_halves(tile), scene / "b/low.obj");
    save_obj(test::BumpySphere::light(), scene / "b/low_body.obj");
    for (const char* name : {"low.obj", "low_body.obj"}) {
      if (tile == 1 && name == std::string("low_body.obj")) continue;
      std::vector<std::string> other = command(scene);
      other[2] = scene / "b" / name;
      expect_exit(call_kiln(other), 2, {"--force"});
    }
  }
}

/// Two squares of LOW, each a material with the whole unit square, 3 apart along x. HIGH lies 0.01 above the first, with
/// a sheet 0.2 above half of that; 0.03 above one half of the second, and nowhere near the other half.
fs::path make_scene_of_two_squares() {
  const auto square = [](double x, double width, float z, const char* material) {
    Mesh mesh = test::plane(4, 4, width, 1);
    for (Vec3& p : mesh.positions) p = {p.x + static_cast<float>(x), p.y, z};
    mesh.material_names = {material};
    mesh.materials.assign(mesh.triangles.size(), 0);
    return mesh;
  };
  const fs::path scene = make_scene();
  save_obj(join_meshes(std::vector<Mesh>{square(0, 1, 0, "near"), square(3, 1, 0, "far")}),
           scene / "low.obj");
  save_obj(join_meshes(std::vector<Mesh>{square(0, 1, 0.01F, "a"), square(-0.25, 0.5, 0.2F, "b"),
                                         square(2.75, 0.5, 0.03F, "c")}),
           scene / "high.obj");
  return scene;
}

/// Figures of a bake are those of all its sets together: means by what each found, sums, and the larger loss.
TEST(SetsCommand, FiguresOfAllSetsAreWeighted) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_two_squares();
  expect_exit(
      call_kiln(with(command(scene), {"--match", "ray", "--ray", "nearest", "--max-distance", "0.4",
                                      "--json", scene / "r.json"})),
      0, {});
  const auto report = read_json(scene / "r.json");
  ASSERT_EQ(report["sets"].size(), 2U);
  const auto& far = report["sets"][1];
  ASSERT_EQ(far["name"], "far");
  const double samples = far["texels"]["samples"], missed = far["texels"]["missed"];
  EXPECT_NEAR(missed / samples, 0.5, 0.02);
  EXPECT_EQ(report["texels"]["missed"], far["texels"]["missed"]);
  // A whole square at 0.01 and half of one at 0.03: a mean of sets would be 0.02, one of samples 0.0125.
  EXPECT_NEAR(report["distance"]["mean"].get<double>(), (0.01 + 0.5 * 0.03) / 1.5, 2e-4);

  // The nearest rule loses the sheet above the first square: its loss counts by the area of both sets.
  const double own = report["sets"][0]["recall"]["lost"], other = far["recall"]["lost"];
  const double lost = report["recall"]["lost"];
  EXPECT_GT(own, other + 0.1);
  EXPECT_GT(lost, other + 0.02);
  EXPECT_LT(lost, own - 0.02);
  EXPECT_EQ(report["recall"]["largest"]["where"], report["sets"][0]["recall"]["largest"]["where"]);
  EXPECT_LT(report["recall"]["largest"]["where"][0].get<double>(), 1);
  EXPECT_LT(report["recall"]["largest"]["lost"], report["sets"][0]["recall"]["largest"]["lost"]);
}

/// --max-missed is a share of samples, of which a texel may have several.
TEST(SetsCommand, MissesAreSharesOfSamples) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_two_squares();
  std::vector<std::string> words =
      with(command(scene), {"--max-distance", "0.4", "--samples", "4"});
  expect_exit(call_kiln(with(words, {"--max-missed", "30"})), 0, {});  // 25% of both squares
  expect_exit(call_kiln(with(words, {"--max-missed", "20"})), 1, {"--max-missed is 20"});
}

/// Two squares of one set share their UVs, and HIGH lies 0.01 above one and 0.03 above the other: what the map shows of
/// them is lost for one. The share of all sets is weighted by their areas.
TEST(SetsCommand, LossesByCopiesAreWeighted) {
  KILN_REQUIRE_DEVICE();
  const auto square = [](float x, float slope, float z, const char* material) {
    Mesh mesh = test::plane(4, 4, 1, 1);
    for (Vec3& p : mesh.positions) p = {p.x + x, p.y, z + slope * p.x};
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    mesh.material_names = {material};
    mesh.materials.assign(mesh.triangles.size(), 0);
    return mesh;
  };
  const fs::path scene = make_scene();
  save_obj(join_meshes(std::vector<Mesh>{square(0, 0, 0, "twice"), square(2, 0, 0, "twice"),
                                         square(4, 0, 0, "once")}),
           scene / "low.obj");
  save_obj(join_meshes(std::vector<Mesh>{square(0, 0.3F, 0.2F, "a"), square(2, -0.3F, 0.2F, "b"),
                                         square(4, 0, 0.2F, "c")}),
           scene / "high.obj");
  expect_exit(call_kiln(with(command(scene), {"--max-distance", "0.5", "--sets", "material",
                                              "--json", scene / "r.json"})),
              0, {});
  const auto report = read_json(scene / "r.json");
  ASSERT_EQ(report["sets"].size(), 2U);
  const double lost = report["sets"][0]["recall"]["by_copies"];
  EXPECT_GT(lost, 0.3);
  EXPECT_NEAR(report["recall"]["by_copies"].get<double>(), lost * 2 / 3, 0.01);
}

/// A row of squares, each with a material and the unit square of its own, over a plain one of the same shape.
fs::path make_scene_of_squares(std::uint32_t count) {
  const fs::path scene = make_scene();
  Mesh low = test::plane(count, 1, count, 1), high = low;
  low.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (std::uint32_t i = 0; i < count; ++i) {
    low.material_names.push_back("m" + std::to_string(i));
    low.materials.insert(low.materials.end(), 2, i);
    low.uv_triangles[std::size_t{2} * i] = {0, 1, 2};
    low.uv_triangles[std::size_t{2} * i + 1] = {0, 2, 3};
  }
  save_obj(low, scene / "low.obj");
  save_obj(high, scene / "high.obj");
  return scene;
}

TEST(SetsCommand, MoreThanCanBeBakedAreRefused) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_squares(20001);
  expect_exit(call_kiln(command(scene)), 2, {"20,001 texture sets", "at most 20,000", "--sets"});
  EXPECT_TRUE(names(scene / "o").empty());
}

/// Many small sets: each is baked, in names of its own.
TEST(SetsCommand, SeveralHundredSetsAreBakedAndNamed) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSets = 300;
  const fs::path scene = make_scene_of_squares(kSets);
  std::vector<std::string> words = with(command(scene), {"--json", scene / "r.json"});
  words[6] = "8";
  expect_exit(call_kiln(words), 0, {});
  EXPECT_EQ(names(scene / "o").size(), kSets);
  EXPECT_EQ(read_json(scene / "r.json")["texels"]["samples"], kSets * 64);
  expect_exit(call_kiln(words), 0, {});  // over what is there
}

}  // namespace
}  // namespace kiln

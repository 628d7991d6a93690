// Several files of the high and of the low poly in one bake.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "cli/call.h"
#include "kiln/bake.h"
#include "kiln/material.h"
#include "kiln/normals.h"
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

/// A quad of side 1 at x and z, which takes UVs from u on.
void write_plate(const fs::path& file, double x, double z, double u, const char* names = "") {
  std::ofstream out(file);
  out << names;
  for (const auto& [a, b] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
    out << "v " << x + a << " " << b << " " << z << "\nvt " << u + 0.45 * a << " " << 0.05 + 0.9 * b
        << "\n";
  }
  out << "f 1/1 2/2 3/3 4/4\n";
}

/// Two plates that cross as seen from above: the second one lies over half of the first.
struct Plates {
  fs::path folder = test::scratch_folder();

  Plates() {
    write_plate(folder / "lower_low.obj", 0, 0, 0.02);
    write_plate(folder / "upper_low.obj", 0.5, 0.02, 0.52);
    write_plate(folder / "lower_high.obj", 0, 0.012, 0);
    write_plate(folder / "upper_high.obj", 0.5, 0.005, 0);
    write_plate(folder / "over_low.obj", 0.5, 0.02, 0.3);
  }

  ProcessResult bake(const std::string& low, const std::string& out,
                     const std::vector<std::string>& flags) const {
    std::vector<std::string> line = {"bake",
                                     folder / "lower_high.obj",
                                     folder / "lower_low.obj",
                                     "--out",
                                     folder / out,
                                     "--size",
                                     "32",
                                     "--json",
                                     folder / (out + ".json")};
    line.insert(line.end(), {"--high", folder / "upper_high.obj"});
    if (!low.empty()) line.insert(line.end(), {"--low", folder / low});
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  }
};

TEST(FilesCommand, MatchesPartsOfSeveralFilesByTheirNames) {
  KILN_REQUIRE_DEVICE();
  const Plates plates;
  const ProcessResult result = plates.bake(
      "upper_low.obj", "out",
      {"--match-by", "name", "--maps", "distance,id", "--id-by", "group", "--format", "exr32"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_TRUE(result.errors.empty()) << result.errors;
  const nlohmann::json report = read_json(plates.folder / "out.json");
  EXPECT_EQ(report["parts"], (nlohmann::json{"lower", "upper"}));
  EXPECT_EQ(report["inputs"]["high"]["files"].size(), 2U);
  EXPECT_EQ(report["inputs"]["low"]["files"].size(), 2U);
  EXPECT_EQ(report["inputs"]["low"]["quads"], 2);
  EXPECT_EQ(report["ids"][1]["name"], "upper_high");
  // The upper plate's high poly lies between the lower plate and its own.
  const Image image = test::read_picture(plates.folder / "out" / "lower_low_distance.exr");
  EXPECT_NEAR(*image.at(8, 16), 0.012, 1e-5);
  EXPECT_NEAR(*image.at(14, 16), 0.012, 1e-5);
  EXPECT_NEAR(*image.at(24, 16), 0.015, 1e-5);
  const ProcessResult all = plates.bake(
      "upper_low.obj", "all", {"--maps", "distance", "--format", "exr32", "--ray", "nearest"});
  ASSERT_EQ(all.exit_code, 0) << all.errors;
  EXPECT_NEAR(*test::read_picture(plates.folder / "all" / "lower_low_distance.exr").at(14, 16),
              0.005, 1e-5);
}

TEST(FilesCommand, OwnPartsAloneDarkenWhereThatIsAsked) {
  KILN_REQUIRE_DEVICE();
  const Plates plates;
  const auto ao = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> flags = {"--match-by", "name", "--maps", "ao", "--format", "exr32"};
    flags.insert(flags.end(), more.begin(), more.end());
    const ProcessResult result = plates.bake("upper_low.obj", out, flags);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return test::read_picture(plates.folder / out / "lower_low_ao.exr");
  };
  EXPECT_LT(*ao("all", {}).at(19, 16), 0.2F);
  EXPECT_EQ(*ao("own", {"--part-occlusion", "own"}).at(19, 16), 1.0F);
  EXPECT_EQ(read_json(plates.folder / "own.json")["options"]["part_occlusion"], "own");
  const ProcessResult lone = plates.bake("", "lone", {"--maps", "ao", "--part-occlusion", "own"});
  EXPECT_EQ(lone.exit_code, 2);
  EXPECT_NE(lone.errors.find("--match-by"), std::string::npos) << lone.errors;
}

TEST(FilesCommand, SaysWhichFilesOverlapAndWhichAreNotThere) {
  KILN_REQUIRE_DEVICE();
  const Plates plates;
  const ProcessResult over = plates.bake("over_low.obj", "over", {});
  EXPECT_EQ(over.exit_code, 0) << over.errors;
  EXPECT_NE(over.errors.find("lower_low.obj' and '"), std::string::npos) << over.errors;
  // u from 0.3 to 0.47, v from 0.05 to 0.95.
  EXPECT_NE(over.errors.find("over_low.obj' overlap on 15% of"), std::string::npos) << over.errors;
  // A place counts once, however many triangles of a file lie there: u from 0.3 to 0.47, ten times.
  std::ofstream many(plates.folder / "many_low.obj");
  for (int copy = 0; copy < 10; ++copy) {
    for (const auto& [a, b] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
      many << "v " << 0.5 + a << " " << b << " " << 0.02 << "\nvt " << 0.3 + 0.45 * a + 1e-5 * copy
           << " " << 0.05 + 0.9 * b << "\n";
    }
    many << "f -4/-4 -3/-3 -2/-2 -1/-1\n";
  }
  many.close();
  const ProcessResult heap = plates.bake("many_low.obj", "many", {});
  EXPECT_NE(heap.errors.find("many_low.obj' overlap on 15% of"), std::string::npos) << heap.errors;
  const ProcessResult gone = plates.bake("gone.obj", "gone", {});
  EXPECT_EQ(gone.exit_code, 3);
  EXPECT_NE(gone.errors.find("gone.obj"), std::string::npos) << gone.errors;
  // Unwrapped, all have places of their own, and the file that is written keeps the parts.
  const ProcessResult anew = plates.bake("over_low.obj", "anew", {"--unwrap"});
  ASSERT_EQ(anew.exit_code, 0) << anew.errors;
  EXPECT_EQ(anew.errors.find("overlap"), std::string::npos) << anew.errors;
  const Mesh written = load_mesh(plates.folder / "anew" / "lower_low_unwrapped.obj");
  EXPECT_EQ(written.object_names, (std::vector<std::string>{"lower_low", "over_low"}));
  // An input is never written over.
  const ProcessResult same = call_kiln(
      {"bake", plates.folder / "lower_high.obj", plates.folder / "lower_low.obj", "--high",
       plates.folder / "x.json", "--out", plates.folder / "s", "--json", plates.folder / "x.json"});
  EXPECT_NE(same.exit_code, 0);
}

/// A quad of HIGH with one corner up: cut from its first corner it rises along a diagonal, to half the height in the
/// middle; cut along the shorter one, the middle stays down. The cage's quad is bent otherwise, and cut as LOW's.
TEST(FilesCommand, CutsHighAndCagesByTheSameRule) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "high.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0.1\nv 0 1 0\nf 1 2 3 4\n";
  std::ofstream(folder / "low.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                       "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  std::ofstream(folder / "cage.obj") << "v 0 0 0.5\nv 1 0 0.3\nv 1 1 0.2\nv 0 1 0.3\nf 1 2 3 4\n";
  // Height in the middle of the map, as a share of the corner's height.
  const auto middle = [&](const std::string& out, std::vector<std::string> flags) {
    std::vector<std::string> line = {"bake",
                                     folder / "high.obj",
                                     folder / "low.obj",
                                     "--out",
                                     folder / out,
                                     "--size",
                                     "16",
                                     "--maps",
                                     "height",
                                     "--format",
                                     "exr32",
                                     "--max-distance",
                                     "100%"};
    line.insert(line.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(line);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(result.errors, "") << out;
    return test::read_picture(folder / out / "low_height.exr").pixels[8 * 16 + 8] / 0.1F;
  };
  for (const std::string cage : {"", "cage"}) {
    std::vector<std::string> with;
    if (!cage.empty()) with = {"--cage-mesh", folder / "cage.obj"};
    const auto by = [&](const std::string& rule) {
      std::vector<std::string> flags = with;
      flags.insert(flags.end(), {"--triangulate", rule});
      return middle(rule + cage, flags);
    };
    // Half a texel off the middle, less than a texel of slope 1.
    EXPECT_NEAR(middle("default" + cage, with), 0.5, 0.07);
    EXPECT_NEAR(by("fan"), 0.5, 0.07);
    EXPECT_NEAR(by("blender"), 0.5, 0.07);
    EXPECT_NEAR(by("shortest"), 0, 0.07);
  }
  // Without a LOW, the flag is for HIGH.
  EXPECT_EQ(call_kiln({"bake", folder / "high.obj", "--out", folder / "made", "--faces", "8",
                       "--size", "16", "--triangulate", "shortest"})
                .exit_code,
            0);
}

TEST(FilesCommand, SaysHowPolygonsAreCutAndSplitsSeams) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  // A right angle of two quads, each a chart, and smooth.
  std::ofstream(folder / "corner.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\n"
                                          "vt 0.05 0.1\nvt 0.45 0.1\nvt 0.45 0.9\nvt 0.05 0.9\n"
                                          "vt 0.55 0.1\nvt 0.95 0.1\nvt 0.95 0.9\nvt 0.55 0.9\n"
                                          "f 1/1 2/2 3/3 4/4\nf 1/5 4/6 6/7 5/8\n";
  // HIGH has a hard edge there; or it is as smooth as LOW, whose normals then need no map at all.
  std::ofstream(folder / "hard.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\n"
                                        "vn 0 0 1\nvn 1 0 0\n"
                                        "f 1//1 2//1 3//1 4//1\nf 1//2 4//2 6//2 5//2\n";
  std::string high = "hard.obj";
  const auto bake = [&](const std::string& out, const std::vector<std::string>& flags) {
    std::vector<std::string> line = {"bake",  folder / high, folder / "corner.obj",
                                     "--out", folder / out,  "--size",
                                     "16",    "--json",      folder / (out + ".json")};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  };
  const ProcessResult soft = bake("soft", {"--triangulate", "shortest"});
  EXPECT_EQ(soft.exit_code, 0) << soft.errors;
  EXPECT_NE(soft.errors.find(
                "1 UV seam with smooth normals between flat faces, for example at (0, 0.5, 0)"),
            std::string::npos)
      << soft.errors;
  EXPECT_NE(soft.errors.find("90 degrees"), std::string::npos) << soft.errors;
  EXPECT_NE(soft.output.find("2 quads"), std::string::npos) << soft.output;
  const nlohmann::json report = read_json(folder / "soft.json");
  EXPECT_EQ(report["inputs"]["low"]["triangulation"], "shortest");
  EXPECT_EQ(report["inputs"]["low"]["soft_seams"], 1);
  const ProcessResult split = bake("split", {"--split-at-seams"});
  EXPECT_EQ(split.exit_code, 0) << split.errors;
  EXPECT_EQ(split.errors.find("seams"), std::string::npos) << split.errors;
  const Mesh written = load_mesh(folder / "split" / "corner_split.obj");
  EXPECT_EQ(soft_seams(written).edges, 0U);
  EXPECT_EQ(soft_seams(written).seams, 1U);
  EXPECT_TRUE(fs::exists(folder / "split" / "corner_split_normal.png"));
  high = "corner.obj";
  const ProcessResult smooth = bake("smooth", {"--high-normals", "smooth"});
  EXPECT_EQ(smooth.exit_code, 0) << smooth.errors;
  EXPECT_EQ(smooth.errors.find("seam"), std::string::npos) << smooth.errors;
  const ProcessResult kept = bake("kept", {"--split-at-seams", "--high-normals", "smooth"});
  EXPECT_EQ(kept.exit_code, 0) << kept.errors;
  EXPECT_NE(kept.errors.find("Its normals were left as they are"), std::string::npos)
      << kept.errors;
  EXPECT_EQ(soft_seams(load_mesh(folder / "kept" / "corner_split.obj")).edges, 1U);
  EXPECT_EQ(call_kiln({"bake", folder / "corner.obj", "--out", folder / "none", "--split-at-seams"})
                .exit_code,
            2);
}

/// A picture with a map that was baked, with its saved match, and with the flags of the bake: the same bytes.
TEST(FilesCommand, RenderTakesTheMatchOfABake) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(4000), folder / "high.obj");
  save_obj(test::BumpySphere::light(24, 12), folder / "low.obj");
  const ProcessResult baked = call_kiln(
      {"bake", folder / "high.obj", folder / "low.obj", "--out", folder / "maps", "--size", "128",
       "--cage", "4%", "--format", "exr32", "--save-match", folder / "match.exr"});
  ASSERT_EQ(baked.exit_code, 0) << baked.errors;
  const auto picture = [&](const std::string& name, const std::vector<std::string>& flags) {
    std::vector<std::string> line = {"render",
                                     folder / "low.obj",
                                     "--reference",
                                     folder / "high.obj",
                                     "--size",
                                     "96",
                                     "--ambient-rays",
                                     "0",
                                     "--quiet",
                                     "--out",
                                     folder / (name + ".png")};
    line.insert(line.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(line);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return test::read_file(folder / (name + ".png"));
  };
  const std::string wanted = picture("map", {"--normal", folder / "maps" / "low_normal.exr"});
  EXPECT_TRUE(picture("match", {"--load-match", folder / "match.exr"}) == wanted);
  EXPECT_TRUE(picture("flags", {"--cage", "4%", "--map-size", "128"}) == wanted);
  const ProcessResult alone =
      call_kiln({"render", folder / "low.obj", "--cage", "4%", "--out", folder / "alone.png"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.errors.find("--reference"), std::string::npos) << alone.errors;
}

TEST(FilesCommand, MeasureTakesTheMatchOfABake) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(4000), folder / "high.obj");
  save_obj(test::BumpySphere::light(24, 12), folder / "low.obj");
  const ProcessResult baked =
      call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--out", folder / "maps",
                 "--size", "128", "--cage", "4%", "--save-match", folder / "match.exr"});
  ASSERT_EQ(baked.exit_code, 0) << baked.errors;
  const auto rated = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> line = {
        "measure", folder / "high.obj",  folder / "low.obj", "--directions", "32", "--pixels", "64",
        "--json",  folder / "rated.json"};
    line.insert(line.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(line, test::without_python().environment);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return read_json(folder / "rated.json");
  };
  const nlohmann::json caged = rated({"--match", "ray", "--cage", "4%", "--size", "128"});
  const nlohmann::json loaded = rated({"--load-match", folder / "match.exr", "--out",
                                       folder / "pictures", "--picture-size", "100"});
  const nlohmann::json plain = rated({"--match", "ray", "--size", "128"});
  EXPECT_EQ(loaded["methods"][0]["method"], "loaded");
  EXPECT_EQ(caged["methods"][0]["object_space"], loaded["methods"][0]["object_space"]);
  EXPECT_EQ(caged["methods"][0]["rendered_normals"], loaded["methods"][0]["rendered_normals"]);
  EXPECT_NE(caged["methods"][0]["object_space"], plain["methods"][0]["object_space"]);
  // The error as a texture: its mean is near that of the pictures.
  const Image error = test::read_picture(folder / "pictures" / "low_loaded_normal_error.exr");
  double sum = 0, count = 0;
  for (const float value : error.pixels) {
    if (value >= 0) sum += value, ++count;
  }
  ASSERT_GT(count, 3000);
  const double mean = loaded["methods"][0]["rendered_normals"]["mean_angle_degrees"];
  EXPECT_NEAR(sum / count, mean, 0.5 * mean);
  // Matches that a flag does not serve are left out, or refused by name.
  const nlohmann::json some = rated({"--cage", "4%", "--size", "32"});
  EXPECT_EQ(some["methods"].size(), 1U);
  const ProcessResult refused = call_kiln(
      {"measure", folder / "high.obj", folder / "low.obj", "--match", "closest", "--cage", "4%"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.errors.find("--cage"), std::string::npos) << refused.errors;
  const ProcessResult study = call_kiln({"measure", folder / "high.obj", "--study", "views",
                                         "--cage", "4%", "--out", folder / "study"});
  EXPECT_EQ(study.exit_code, 2);
}

/// Materials of HIGH's file are found from where LOW is written.
TEST(FilesCommand, WrittenMeshesNameTheirMaterials) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  fs::create_directories(folder / "art" / "paint");
  Mesh high = test::BumpySphere::dense(2000);
  high.material_files = {"paint/all.mtl"};
  high.material_names = {"upper", "lower"};
  for (const Triangle& t : high.triangles) high.materials.push_back(high.positions[t[0]].y < 0);
  save_obj(high, folder / "art" / "high.obj");
  std::ofstream(folder / "art" / "paint" / "all.mtl")
      << "newmtl upper\nKd 1 0 0\nnewmtl lower\nKd 0 0 1\n";
  const auto survives = [&](const fs::path& low) {
    const Mesh mesh = load_mesh(low);
    EXPECT_EQ(mesh.material_names, high.material_names) << low;
    const std::vector<Material> materials = load_materials(mesh, low);
    ASSERT_EQ(materials.size(), 2U) << low;
    EXPECT_EQ(materials[0].color, (std::array<float, 3>{1, 0, 0})) << low;
    EXPECT_EQ(materials[1].color, (std::array<float, 3>{0, 0, 1})) << low;
  };
  const std::string source = folder / "art" / "high.obj";
  fs::create_directories(folder / "lows");
  const ProcessResult simple = call_kiln({"simplify", source, "--faces", "200", "--size", "64",
                                          "--out", folder / "lows" / "simple.obj"});
  ASSERT_EQ(simple.exit_code, 0) << simple.errors;
  survives(folder / "lows" / "simple.obj");
  fs::create_directories(folder / "deep");
  const ProcessResult baked = call_kiln(
      {"bake", source, "--faces", "200", "--size", "64", "--out", folder / "deep" / "maps"});
  ASSERT_EQ(baked.exit_code, 0) << baked.errors;
  survives(folder / "deep" / "maps" / "high_low.obj");
}

/// Boxes that fit once axes are swapped, or sizes are made alike.
TEST(FilesCommand, SaysWhatMakesBoxesFit) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  Mesh high = test::cube(), low = test::cube();
  for (Vec3& p : high.positions) p = {4 * p.x, 2 * p.y, p.z};
  const auto says = [&](const std::string& words, double scale, auto order) {
    Mesh turned = low;
    for (Vec3& p : turned.positions) {
      const Vec3 own{4 * p.x, 2 * p.y, p.z};
      const Vec3 other = order(own);
      const auto s = static_cast<float>(scale);
      p = {s * other.x, s * other.y, s * other.z};
    }
    save_obj(high, folder / "high.obj");
    save_obj(turned, folder / "low.obj");
    const ProcessResult result = call_kiln(
        {"bake", folder / "high.obj", folder / "low.obj", "--size", "32", "--out", folder / "out"});
    EXPECT_NE(result.errors.find(words), std::string::npos) << words << ": " << result.errors;
  };
  says("after swapping X and Z", 1, [](Vec3 p) { return Vec3{p.z, p.y, p.x}; });
  says("after swapping X and Y", 1, [](Vec3 p) { return Vec3{p.y, p.x, p.z}; });
  says("LOW is 100 times as large as HIGH; scale one of them", 100, [](Vec3 p) { return p; });
  says("LOW is about 100 times as large as HIGH", 99.5, [](Vec3 p) { return p; });
  says("LOW is 12 times as large as HIGH", 12, [](Vec3 p) { return p; });
  says("LOW is 0.01 times as large as HIGH; scale one of them, and swap Y and Z", 0.01, [](Vec3 p) {
    return Vec3{p.x, p.z, p.y};
  });
  const ProcessResult drawn =
      call_kiln({"render", folder / "low.obj", "--reference", folder / "high.obj", "--size", "16",
                 "--ambient-rays", "0", "--quiet", "--out", folder / "look.png"});
  EXPECT_NE(drawn.errors.find("scale one of them, and swap Y and Z"), std::string::npos)
      << drawn.errors;
}

/// A sphere of 48 x 24 cells with normals. \param normals, faces  -1: turned
void write_ball(const fs::path& file, int normals, int faces, bool with_uvs) {
  std::ofstream out(file);
  constexpr int kAround = 48, kUp = 24;
  for (int i = 0; i <= kUp; ++i) {
    for (int j = 0; j <= kAround; ++j) {
      const double t = std::numbers::pi * i / kUp, p = 2 * std::numbers::pi * j / kAround;
      const double x = std::sin(t) * std::cos(p), y = std::sin(t) * std::sin(p), z = std::cos(t);
      out << "v " << x << " " << y << " " << z << "\nvn " << normals * x << " " << normals * y
          << " " << normals * z << "\nvt " << static_cast<double>(j) / kAround << " "
          << 1 - static_cast<double>(i) / kUp << "\n";
    }
  }
  const auto corner = [&](int i, int j) {
    const std::string v = std::to_string(i * (kAround + 1) + j + 1);
    return " " + v + "/" + (with_uvs ? v : "") + "/" + v;
  };
  for (int i = 1; i < kUp - 1; ++i) {
    for (int j = 0; j < kAround; ++j) {
      const std::string a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1),
                        d = corner(i, j + 1);
      out << "f" << (faces > 0 ? a + b + c + d : d + c + b + a) << "\n";
    }
  }
}

TEST(FilesCommand, NormalsThatOpposeTheirFacesAreTurned) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const auto bake = [&](const std::string& high, const std::string& low,
                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"bake",
                                     folder / high,
                                     folder / low,
                                     "--size",
                                     "64",
                                     "--maps",
                                     "normal,ao",
                                     "--format",
                                     "exr32",
                                     "--out",
                                     folder / (high + low + ".maps")};
    line.insert(line.end(), more.begin(), more.end());
    return call_kiln(line);
  };
  for (const int normals : {1, -1}) {
    for (const int faces : {1, -1}) {
      const std::string name = std::to_string(normals) + std::to_string(faces);
      write_ball(folder / ("high" + name + ".obj"), normals, faces, false);
      write_ball(folder / ("low" + name + ".obj"), normals, faces, true);
    }
  }
  const auto expect_flat = [&](const std::string& high, const std::string& low) {
    SCOPED_TRACE(high + " " + low);
    const fs::path maps = folder / (high + low + ".maps");
    const std::string stem = fs::path(low).stem().string();
    // The same surface, whose normals are its own: straight up, and open to all sides.
    for (const std::uint32_t row : {16U, 32U, 48U}) {
      EXPECT_NEAR(test::read_picture(maps / (stem + "_normal.exr")).at(20, row)[2], 1.0F, 1e-3F);
      EXPECT_NEAR(*test::read_picture(maps / (stem + "_ao.exr")).at(20, row), 1.0F, 1e-2F);
    }
  };
  ASSERT_EQ(bake("high11.obj", "low11.obj").exit_code, 0);
  expect_flat("high11.obj", "low11.obj");
  for (const std::string wrong : {"1-1", "-11"}) {
    const ProcessResult high = bake("high" + wrong + ".obj", "low11.obj");
    EXPECT_EQ(high.exit_code, 0) << high.errors;
    EXPECT_NE(high.errors.find("HIGH 'high" + wrong), std::string::npos) << high.errors;
    EXPECT_NE(high.errors.find("flipped"), std::string::npos) << high.errors;
    expect_flat("high" + wrong + ".obj", "low11.obj");
    const ProcessResult low = bake("high11.obj", "low" + wrong + ".obj");
    EXPECT_EQ(low.exit_code, 0) << low.errors;
    EXPECT_NE(low.errors.find("LOW 'low" + wrong), std::string::npos) << low.errors;
    expect_flat("high11.obj", "low" + wrong + ".obj");
  }
  // Inside out as a whole, a mesh may be a room: the message says what is the matter, with whom, and the remedy.
  const ProcessResult room = bake("high-1-1.obj", "low11.obj");
  EXPECT_EQ(room.exit_code, 3);
  EXPECT_NE(room.errors.find("HIGH 'high-1-1'"), std::string::npos) << room.errors;
  EXPECT_NE(room.errors.find("--two-sided"), std::string::npos) << room.errors;
  EXPECT_EQ(room.errors.find("LOW"), std::string::npos) << room.errors;
  EXPECT_EQ(bake("high-1-1.obj", "low11.obj", {"--two-sided"}).exit_code, 0);
}

}  // namespace
}  // namespace kiln

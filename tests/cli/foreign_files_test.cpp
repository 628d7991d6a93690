// Files as other programs write them, through the command: pictures of PLY, colours of faces, collision hulls, holes in
// heights, transparency of MTL.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>
#include <vector>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "support/json_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_exit;
using test::names;
using Color = std::array<float, 3>;

const std::string kSquare =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
    "f 1/1/1 2/2/1 3/3/1 4/4/1\n";
constexpr Color kRed{1, 0, 0}, kGreen{0, 1, 0}, kBlue{0, 0, 1}, kYellow{1, 1, 0}, kCyan{0, 1, 1},
    kMagenta{1, 0, 1};

/// Four squares of one colour each, from the lower left; no texel of them is blended but at their borders.
void save_quarters(const fs::path& file, const std::array<Color, 4>& colors) {
  Image image{32, 32, 3, {}};
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      const Color& color = colors[(y < 16 ? 2U : 0U) + (x < 16 ? 0U : 1U)];
      image.pixels.insert(image.pixels.end(), color.begin(), color.end());
    }
  }
  save_image(image, file, {.format = ImageFormat::png8});
}

/// Expects a colour at a place of a map, from the lower left.
void expect_color(const Image& map, double u, double v, const Color& wanted) {
  const float* texel = map.at(static_cast<std::uint32_t>(u * map.width),
                              static_cast<std::uint32_t>((1 - v) * map.height));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(texel[c], wanted[c], 0.01) << u << " " << v;
}

/// The map of LOW, baked from HIGH.
Image baked(const fs::path& high, const fs::path& low, const std::string& map,
            const std::vector<std::string>& flags = {}, std::string* errors = nullptr) {
  const fs::path out = test::scratch_folder();
  std::vector<std::string> line = {"bake", high,    low, "--maps=" + map, "--size=64", "--format",
                                   "png8", "--out", out};
  line.insert(line.end(), flags.begin(), flags.end());
  const test::ProcessResult result = call_kiln(line);
  expect_exit(result, 0, {});
  if (errors != nullptr) *errors = result.errors;
  return load_image(out / (low.stem().string() + "_" + map + ".png"));
}

/// Two squares side by side, each over all of its picture.
fs::path make_scan(const std::string& pictures) {
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "low.obj") << kSquare;
  std::ofstream(folder / "scan.ply")
      << "ply\nformat ascii 1.0\n" + pictures +
             "element vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face "
             "2\nproperty list uchar int vertex_indices\nproperty list uchar float "
             "texcoord\nproperty uchar texnumber\nend_header\n0 0 0\n0.5 0 0\n1 0 0\n0 1 0\n0.5 1 "
             "0\n1 1 0\n4 0 1 4 3 8 0 0 1 0 1 1 0 1 0\n4 1 2 5 4 8 0 0 1 0 1 1 0 1 1\n";
  save_quarters(folder / "tex_0.png", {kRed, kGreen, kBlue, kYellow});
  save_quarters(folder / "tex 1.png", {kCyan, kMagenta, kYellow, kBlue});
  return folder;
}

TEST(ForeignFiles, PicturesOfAPlyAreItsColours) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder =
      make_scan("comment TextureFile tex_0.png\ncomment TextureFile tex 1.png\n");
  const auto check = [](const Image& map) {
    const std::array<std::array<Color, 2>, 4> columns{
        {{kRed, kBlue}, {kGreen, kYellow}, {kCyan, kYellow}, {kMagenta, kBlue}}};
    for (std::size_t k = 0; k < 4; ++k) {
      expect_color(map, 0.125 + 0.25 * static_cast<double>(k), 0.25, columns[k][0]);
      expect_color(map, 0.125 + 0.25 * static_cast<double>(k), 0.75, columns[k][1]);
    }
  };
  check(baked(folder / "scan.ply", folder / "low.obj", "color"));
  // They come by themselves into a file that engines open.
  expect_exit(call_kiln({"bake", folder / "scan.ply", folder / "low.obj", "--size=64", "--out",
                         folder / "out.glb"}),
              0, {});
  const Asset asset = load_asset(folder / "out.glb");
  ASSERT_EQ(asset.materials.size(), 1U);
  ASSERT_FALSE(asset.materials[0].color_map.empty());
  check(load_image(*asset.materials[0].color_map.bytes));
  // A picture that is not there is said, and the rest is baked.
  fs::remove(folder / "tex 1.png");
  std::string errors;
  const Image half = baked(folder / "scan.ply", folder / "low.obj", "color", {}, &errors);
  expect_color(half, 0.125, 0.25, kRed);
  expect_color(half, 0.875, 0.25, {1, 1, 1});
  EXPECT_NE(errors.find("tex 1.png"), std::string::npos) << errors;
}

TEST(ForeignFiles, TheCasesOfPlyTextures) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases");
  const fs::path cases = *test::shared_data("cases/ply_textures");
  for (const char* name : {"a_wedge", "b_texnumber", "c_openmvs"}) {
    SCOPED_TRACE(name);
    const Image map = baked(cases / (std::string(name) + ".ply"), cases / "low.obj", "color");
    expect_color(map, 0.125, 0.75, kRed);
    expect_color(map, 0.375, 0.75, kGreen);
    expect_color(map, 0.125, 0.25, kBlue);
    expect_color(map, 0.375, 0.25, kYellow);
    const bool two = std::string(name) != "a_wedge";
    expect_color(map, 0.625, 0.75, two ? kCyan : kRed);
    expect_color(map, 0.875, 0.75, two ? kMagenta : kGreen);
    expect_color(map, 0.625, 0.25, two ? kYellow : kBlue);
    expect_color(map, 0.875, 0.25, two ? kBlue : kYellow);
  }
}

TEST(ForeignFiles, TheCasesOfFaceColours) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases");
  const fs::path cases = *test::shared_data("cases/face_colours");
  for (const char* name : {"e_facecolor.ply", "scad.off"}) {
    for (const char* map : {"color", "id"}) {
      SCOPED_TRACE(std::string(name) + " " + map);
      std::vector<std::string> flags;
      if (std::string(map) == "id") flags = {"--id-by", "color"};
      const Image image = baked(cases / name, cases / "low.obj", map, flags);
      for (const double v : {0.02, 0.5, 0.98}) {
        expect_color(image, 0.48, v, kRed);
        expect_color(image, 0.52, v, kGreen);
      }
    }
  }
}

TEST(ForeignFiles, IdsOfColoursHaveALegend) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "low.obj") << kSquare;
  std::ofstream(folder / "high.off")
      << "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 200 100 50\n"
         "3 0 2 3 1 2 3\n";
  baked(folder / "high.off", folder / "low.obj", "id",
        {"--id-by", "color", "--json", folder / "report.json"});
  const auto ids = test::read_json(folder / "report.json")["ids"];
  ASSERT_EQ(ids.size(), 2U);
  EXPECT_EQ(ids[0]["name"], "#c86432");
  EXPECT_EQ(ids[1]["name"], "#010203");
  // Without colours it is an error that says so.
  expect_exit(call_kiln({"bake", folder / "low.obj", folder / "low.obj", "--maps=id",
                         "--id-by=color", "--size=16", "--out", folder / "none"}),
              3, {"colours"});
}

/// An OpenMVS material is opaque in the file that engines open.
TEST(ForeignFiles, TransparencyOfOneIsOpaqueInAGlb) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "low.obj") << kSquare;
  save_quarters(folder / "tex.png", {kRed, kGreen, kBlue, kYellow});
  const auto alpha_of = [&](const std::string& lines) {
    std::ofstream(folder / "scan.mtl") << "newmtl m\nKd 1 1 1\n" + lines;
    std::ofstream(folder / "scan.obj") << "mtllib scan.mtl\n" +
                                              kSquare.substr(0, kSquare.find("f ")) + "usemtl m\n" +
                                              kSquare.substr(kSquare.find("f "));
    expect_exit(call_kiln({"bake", folder / "scan.obj", folder / "low.obj", "--size=16", "--out",
                           folder / "out.glb", "--force"}),
                0, {});
    const Material material = load_asset(folder / "out.glb").materials.at(0);
    const Image picture = load_image(*material.color_map.bytes);
    const float alpha = picture.channels == 4 ? picture.at(2, 2)[3] : 1;
    return std::pair(material.alpha_mode, alpha);
  };
  EXPECT_EQ(alpha_of("Tr 1.000000\nillum 1\nmap_Kd tex.png\n").first, AlphaMode::opaque);
  EXPECT_EQ(alpha_of("Tr 1.000000\n").first, AlphaMode::opaque);
  const auto half = alpha_of("Tr 1\nd 0.5\n");
  EXPECT_NE(half.first, AlphaMode::opaque);
  EXPECT_NEAR(half.second, 0.5, 0.01);
}

/// A bumpy sphere with hulls around it, as OBJ or as glTF. \param hulls  names; none: without
fs::path with_hulls(const fs::path& folder, const std::string& name,
                    const std::vector<std::string>& hulls, bool groups) {
  Mesh low = test::BumpySphere::light();
  low.uvs.resize(low.uvs.size());
  std::vector<std::string>& list = groups ? low.group_names : low.object_names;
  std::vector<std::uint32_t>& of = groups ? low.groups : low.objects;
  list = {"body"};
  of.assign(low.triangles.size(), 0);
  const Mesh plain = low;
  for (std::size_t h = 0; h < hulls.size(); ++h) {
    list.push_back(hulls[h]);
    const auto first = static_cast<std::uint32_t>(low.positions.size());
    for (const Vec3& p : plain.positions)
      low.positions.push_back({p.x * 1.1F, p.y * 1.1F, p.z * 1.1F});
    for (std::size_t t = 0; t < plain.triangles.size(); ++t) {
      const auto& [a, b, c] = plain.triangles[t];
      low.triangles.push_back({first + a, first + b, first + c});
      low.uv_triangles.push_back(plain.uv_triangles[t]);
      if (!plain.normal_triangles.empty())
        low.normal_triangles.push_back(plain.normal_triangles[t]);
      of.push_back(static_cast<std::uint32_t>(h + 1));
    }
  }
  const fs::path path = folder / name;
  if (path.extension() == ".obj") {
    save_obj(low, path);
  } else {
    AssetMaterial material;
    material.name = "m";
    save_asset(low, std::span(&material, 1), path);
  }
  return path;
}

TEST(ForeignFiles, CollisionHullsAreLeftOutOfTheBake) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(6000), folder / "high.obj");
  const std::vector<std::string> hulls = {"UCX_body_01", "body-colonly"};
  for (const auto& [name, groups] : std::vector<std::pair<std::string, bool>>{
           {"low.obj", true}, {"low.obj", false}, {"low.glb", false}}) {
    SCOPED_TRACE(name + (groups ? " groups" : ""));
    const fs::path plain = test::scratch_folder(), hulled = test::scratch_folder();
    const Image wanted = baked(folder / "high.obj", with_hulls(plain, name, {}, groups), "normal");
    std::string errors;
    const fs::path low = with_hulls(hulled, name, hulls, groups);
    EXPECT_EQ(baked(folder / "high.obj", low, "normal", {}, &errors).pixels, wanted.pixels);
    for (const std::string& hull : hulls) EXPECT_NE(errors.find(hull), std::string::npos) << errors;
    EXPECT_EQ(errors.find("overlap"), std::string::npos) << errors;
    // The files that are written keep them, with no map's material.
    expect_exit(
        call_kiln({"bake", folder / "high.obj", low, "--size=64", "--out", hulled / "out.glb"}), 0,
        {});
    const Asset asset = load_asset(hulled / "out.glb");
    const Mesh before = load_mesh(low);
    std::vector<std::string> names = asset.mesh.object_names;
    for (const std::string& hull : hulls) {
      const auto at = std::find(names.begin(), names.end(), hull);
      ASSERT_NE(at, names.end()) << hull;
      const auto number = static_cast<std::uint32_t>(at - names.begin());
      EXPECT_EQ(static_cast<std::size_t>(
                    std::count(asset.mesh.objects.begin(), asset.mesh.objects.end(), number)),
                before.triangles.size() / 3);
    }
    EXPECT_EQ(asset.mesh.triangles.size(), before.triangles.size());
    expect_exit(
        call_kiln({"bake", folder / "high.obj", low, "--size=64", "--out", hulled / "out.obj"}), 0,
        {});
    const Mesh written = load_mesh(hulled / "out.obj");
    EXPECT_EQ(written.triangles.size(), before.triangles.size());
    for (const std::string& hull : hulls) {
      EXPECT_NE(std::find(written.object_names.begin(), written.object_names.end(), hull),
                written.object_names.end());
    }
    // And unwrapped, beside its map.
    expect_exit(
        call_kiln({"bake", folder / "high.obj", low, "--unwrap", "--size=64", "--out", hulled}), 0,
        {});
    EXPECT_EQ(load_mesh(hulled / "low_unwrapped.obj").triangles.size(), before.triangles.size());
  }
}

TEST(ForeignFiles, CollisionHullsOfHighAreNotBaked) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::light(), folder / "low.obj");
  // with_hulls() puts each hull 10% outside of the body: rays that start outside meet it first.
  const auto bake = [&](const fs::path& high, const std::vector<std::string>& more,
                        std::string* errors) {
    std::vector<std::string> arguments = {"--max-distance=20%"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return baked(high, folder / "low.obj", "height", arguments, errors).pixels;
  };
  std::string errors;
  const auto plain = bake(with_hulls(folder, "plain.obj", {}, false), {}, &errors);
  EXPECT_EQ(errors.find("collision"), std::string::npos) << errors;
  const fs::path hulled = with_hulls(folder, "hulled.obj", {"UBX_body", "x-colonly"}, true);
  EXPECT_EQ(bake(hulled, {}, &errors), plain);
  for (const char* word :
       {"'hulled': 2 collision hulls", "UBX_body", "x-colonly", "--keep-hulls"}) {
    EXPECT_NE(errors.find(word), std::string::npos) << errors;
  }
  EXPECT_NE(bake(hulled, {"--keep-hulls"}, &errors), plain);
  // Godot draws -col.
  const fs::path drawn = with_hulls(folder, "drawn.obj", {"body-col"}, false);
  EXPECT_NE(bake(drawn, {}, &errors), plain);
  EXPECT_EQ(errors.find("collision"), std::string::npos) << errors;
}

TEST(ForeignFiles, CollisionHullsCanBeKept) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(6000), folder / "high.obj");
  const fs::path low = with_hulls(folder, "low.obj", {"UCX_body"}, false);
  std::string errors;
  baked(folder / "high.obj", low, "normal", {"--keep-hulls"}, &errors);
  EXPECT_EQ(errors.find("collision"), std::string::npos) << errors;
  // All of it a hull.
  Mesh alone = test::BumpySphere::light();
  alone.objects.assign(alone.triangles.size(), 0);
  alone.object_names = {"UBX_alone"};
  save_obj(alone, folder / "alone.obj");
  expect_exit(call_kiln({"bake", folder / "high.obj", folder / "alone.obj", "--size=16", "--out",
                         folder / "out"}),
              3, {"UBX_alone", "--keep-hulls"});
  EXPECT_FALSE(fs::exists(folder / "out"));
  expect_exit(call_kiln({"bake", folder / "high.obj", folder / "alone.obj", "--size=16",
                         "--keep-hulls", "--out", folder / "out"}),
              0, {});
}

/// A slope along x of 100 to 131 m, 1 m a pixel, with a hole of 8 by 8 pixels.
Image slope_with_hole(float none) {
  Image image{32, 32, 1, std::vector<float>(1024)};
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      const bool hole = x >= 12 && x < 20 && y >= 12 && y < 20;
      *image.at(x, y) = hole ? none : 100 + static_cast<float>(x);
    }
  }
  return image;
}

TEST(ForeignFiles, HeightsWithoutDataAreHoles) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const auto bake = [&](float none, std::vector<std::string> flags) {
    save_image(slope_with_hole(none), folder / "h.exr", {.format = ImageFormat::exr_float});
    std::vector<std::string> line = {
        "bake",           folder / "h.exr", "--extent=31", "--size=64", "--maps=normal,height",
        "--format=exr32", "--raw",          "--force",     "--json",    folder / "report.json",
        "--out",          folder / "out"};
    line.insert(line.end(), flags.begin(), flags.end());
    const test::ProcessResult result = call_kiln(line);
    expect_exit(result, 0, {});
    return result.errors;
  };
  for (const float none : {-9999.0F, std::nanf(""), -32768.0F}) {
    const std::string errors = bake(none, {});
    EXPECT_NE(errors.find("64 of 1,024 pixels"), std::string::npos) << errors;
    const Image normals = load_image(folder / "out" / "h_low_normal.exr");
    const Image heights = load_image(folder / "out" / "h_low_height.exr");
    // Everywhere the slope's normal, nowhere a wall of ten kilometres; and nothing is below the lowest height.
    std::size_t missed = 0;
    for (std::size_t i = 0; i < heights.pixels.size(); ++i) {
      const float *const n = &normals.pixels[3 * i], height = heights.pixels[i];
      const std::size_t x = i % 64, y = i / 64;
      if (n[0] == 0 && n[2] == 1 &&
          height == 0) {  // nothing is found there: LOW's own normal, and no height
        ++missed;
        EXPECT_TRUE(x >= 21 && x < 43 && y >= 21 && y < 43) << x << ", " << y;
        continue;
      }
      EXPECT_NEAR(n[0], -std::sqrt(0.5), 1e-3) << x << ", " << y;
      EXPECT_NEAR(n[2], std::sqrt(0.5), 1e-3) << x << ", " << y;
      EXPECT_GE(height, 99.9F);
    }
    // The hole's 8 pixels, and the cells beside them that have three corners, of 31 by 31 cells on 64 by 64 texels.
    EXPECT_NEAR(static_cast<double>(missed), 81 * (64.0 / 31) * (64.0 / 31), 40);
    const auto report = test::read_json(folder / "report.json");
    bool said = false;
    for (const auto& warning : report["warnings"]) {
      if (warning["code"] == "no-data") said = warning["count"] == 64;
    }
    EXPECT_TRUE(said);
  }
  // Any number, where it is given; and none.
  EXPECT_NE(bake(0, {"--no-data", "0"}).find("64 of 1,024 pixels"), std::string::npos);
  EXPECT_EQ(bake(0, {}).find("no valid height"), std::string::npos);
  EXPECT_EQ(bake(-9999, {"--no-data", "none"}).find("no valid height"), std::string::npos);
  EXPECT_NE(bake(0, {"--no-data", "-1"}).find("contains no pixel of -1"), std::string::npos);
  // A low poly of few faces, too.
  EXPECT_NE(bake(-9999, {"--faces", "200"}).find("64 of 1,024 pixels"), std::string::npos);
  const Mesh low = load_mesh(folder / "out" / "h_low.obj");
  for (const Vec3& p : low.positions) EXPECT_GE(p.z + low.origin[2], 99.9);
  expect_exit(call_kiln({"bake", folder / "h.exr", "--no-data", "much", "--out", folder / "out"}),
              2, {"--no-data", "none"});
  save_obj(test::BumpySphere::light(), folder / "mesh.obj");
  expect_exit(call_kiln({"bake", folder / "mesh.obj", folder / "mesh.obj", "--no-data", "0",
                         "--out", folder / "out"}),
              2, {"--no-data", "height field"});
}

TEST(ForeignFiles, TheCaseOfNoData) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases");
  const fs::path out = test::scratch_folder();
  const test::ProcessResult result =
      call_kiln({"bake", *test::shared_data("cases/nodata/nodata.exr"), "--size=64",
                 "--maps=height", "--format=exr32", "--out", out});
  expect_exit(result, 0, {"-9999"});
  for (const float height : load_image(out / "nodata_low_height.exr").pixels) {
    EXPECT_GT(height, -9000);
  }
}

/// A ball of a red material inside a hull of a blue one, which comes first.
fs::path ball_in_hull(const fs::path& folder) {
  std::ofstream(folder / "two.mtl") << "newmtl hull\nKd 0 0 1\nnewmtl body\nKd 1 0 0\n";
  std::ofstream file(folder / "two.obj");
  file << "mtllib two.mtl\n";
  std::size_t first = 1;
  for (const auto& [name, material, radius] :
       {std::tuple("UCX_ball", "hull", 1.2), std::tuple("ball", "body", 1.0)}) {
    const Mesh ball = test::icosphere(3, radius);
    file << "o " << name << "\nusemtl " << material << "\n";
    for (const Vec3& p : ball.positions) file << "v " << p.x << " " << p.y << " " << p.z << "\n";
    for (const auto& [a, b, c] : ball.triangles) {
      file << "f " << first + a << " " << first + b << " " << first + c << "\n";
    }
    first += ball.positions.size();
  }
  return folder / "two.obj";
}

double farthest(const Mesh& mesh) {
  double most = 0;
  for (const Vec3& p : mesh.positions) {
    most = std::max(most, std::sqrt(double{p.x} * p.x + double{p.y} * p.y + double{p.z} * p.z));
  }
  return most;
}

TEST(ForeignFiles, HullsOfHighGoFromEveryCommandWithTheirMaterials) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder(), high = ball_in_hull(folder);
  expect_exit(call_kiln({"bake", high, "--faces=300", "--size=64", "--out", folder / "out.glb"}), 0,
              {"1 collision hull", "UCX_ball"});
  const Asset asset = load_asset(folder / "out.glb");
  EXPECT_LT(farthest(asset.mesh), 1.1);
  ASSERT_EQ(asset.materials.size(), 1U);
  ASSERT_FALSE(asset.materials[0].color_map.empty());
  expect_color(load_image(*asset.materials[0].color_map.bytes), 0.5, 0.5, kRed);
  EXPECT_EQ(std::count(asset.mesh.object_names.begin(), asset.mesh.object_names.end(), "UCX_ball"),
            0);
  expect_exit(call_kiln({"simplify", high, "--faces=300", "--size=64", "--out", folder / "s.obj"}),
              0, {"1 collision hull"});
  EXPECT_LT(farthest(load_mesh(folder / "s.obj")), 1.1);
  expect_exit(call_kiln({"simplify", high, "--faces=300", "--size=64", "--keep-hulls", "--force",
                         "--out", folder / "s.obj"}),
              0, {});
  EXPECT_GT(farthest(load_mesh(folder / "s.obj")), 1.1);
  expect_exit(call_kiln({"render", folder / "out.glb", "--reference", high, "--size=64", "--out",
                         folder / "r.png"}),
              0, {"1 collision hull"});
}

// An OBJ may name several files of materials. Blender reads those that are there.
TEST(ForeignFiles, AMissingFileOfMaterialsLeavesTheOthers) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "there.mtl") << "newmtl m\nKd 0 1 0\n";
  std::ofstream(folder / "low.obj") << kSquare;
  for (const char* lines : {"mtllib gone.mtl\nmtllib there.mtl\n", "mtllib there.mtl gone.mtl\n"}) {
    SCOPED_TRACE(lines);
    std::ofstream(folder / "high.obj") << lines << "usemtl m\n" << kSquare;
    std::string errors;
    expect_color(baked(folder / "high.obj", folder / "low.obj", "color", {}, &errors), 0.5, 0.5,
                 kGreen);
    for (const char* word : {"'gone.mtl'", "which does not exist", "'there.mtl'"}) {
      EXPECT_NE(errors.find(word), std::string::npos) << errors;
    }
    expect_exit(call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--size=64", "--force",
                           "--out", folder / "out.glb"}),
                0, {"gone.mtl"});
    const Asset asset = load_asset(folder / "out.glb");
    ASSERT_EQ(asset.materials.size(), 1U);
    ASSERT_FALSE(asset.materials[0].color_map.empty());
    expect_color(load_image(*asset.materials[0].color_map.bytes), 0.5, 0.5, kGreen);
  }
  std::ofstream(folder / "high.obj") << "mtllib gone.mtl\nusemtl m\n" << kSquare;
  expect_exit(call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--maps=color",
                         "--size=64", "--out", folder}),
              3, {"gone.mtl"});
}

// MeshLab writes white for all vertices of a mesh whose faces have materials.
TEST(ForeignFiles, WhiteVertexColoursDoNotHideMaterials) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "m.mtl") << "newmtl m\nKd 0 1 0\n";
  std::ofstream(folder / "low.obj") << kSquare;
  const auto color_of = [&](const std::string& colors) {
    std::ofstream(folder / "high.obj")
        << "mtllib m.mtl\nv 0 0 0 " << colors << "\nv 1 0 0 " << colors << "\nv 1 1 0 " << colors
        << "\nv 0 1 0 " << colors << "\nusemtl m\nf 1 2 3 4\n";
    return baked(folder / "high.obj", folder / "low.obj", "color");
  };
  expect_color(color_of("1 1 1"), 0.5, 0.5, kGreen);
  expect_color(color_of("1 0 0"), 0.5, 0.5, kRed);
}

TEST(ForeignFiles, PartsOfLowWithoutUvsStayInAGlb) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::ofstream(folder / "high.obj") << kSquare;
  std::ofstream(folder / "low.obj")
      << "o painted\n" + kSquare + "o plain\nv 2 0 0\nv 3 0 0\nv 2 1 0\nf 5 6 7\n";
  expect_exit(call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--size=64",
                         "--max-distance=0.1", "--out", folder / "out.glb"}),
              0, {});
  const Asset asset = load_asset(folder / "out.glb");
  EXPECT_EQ(asset.mesh.object_names, (std::vector<std::string>{"painted", "plain"}));
  ASSERT_EQ(asset.mesh.triangles.size(), 3U);
  EXPECT_EQ(asset.mesh.objects, (std::vector<std::uint32_t>{0, 0, 1}));
  ASSERT_EQ(asset.materials.size(), 2U);
  EXPECT_FALSE(asset.materials[asset.mesh.materials[0]].normal_map.empty());
  EXPECT_TRUE(asset.materials[asset.mesh.materials[2]].normal_map.empty());
}

TEST(ForeignFiles, AMapOfAnotherHighIsTold) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(20000), folder / "high.obj");
  save_obj(test::BumpySphere::light(), folder / "low.obj");
  save_obj(test::icosphere(5), folder / "smooth.obj");
  expect_exit(
      call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--size=256", "--out", folder}),
      0, {});
  const auto told = [&](const char* reference) {
    const test::ProcessResult result =
        call_kiln({"render", folder / "low.obj", "--normal", folder / "low_normal.png",
                   "--reference", folder / reference, "--size=64", "--out", folder / "r.png"});
    expect_exit(result, 0, {});
    return result.errors;
  };
  EXPECT_NE(told("smooth.obj").find("does not fit HIGH's normals"), std::string::npos);
  EXPECT_EQ(told("high.obj"), "");
}

// The bake that judges the split makes no map but its own, whatever ranges the maps asked for have.
TEST(ForeignFiles, SplitSeamsAndRangesGoTogether) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(6000), folder / "high.obj");
  Mesh low = test::BumpySphere::light();
  low.normals.clear();
  low.normal_triangles.clear();
  save_obj(low, folder / "low.obj");
  expect_exit(
      call_kiln({"bake", folder / "high.obj", folder / "low.obj", "--split-at-seams",
                 "--maps=height", "--range", "height=-0.5,0.5", "--size=64", "--out", folder}),
      0, {});
  EXPECT_TRUE(fs::exists(folder / "low_split_height.png"));
}

}  // namespace
}  // namespace kiln

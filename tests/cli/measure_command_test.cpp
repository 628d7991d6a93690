// kiln measure: ratings: figures and files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "cli/lab_scene.h"
#include "cli/measure_files.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::make_scene;
using test::ProcessResult;
using test::read_json;
using namespace test::measure_files;

TEST(MeasureCommand, RatesWaysToMatch) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(8000);
  const std::vector<std::string> arguments = {"measure",
                                              scene / "high.obj",
                                              scene / "low.obj",
                                              "--match",
                                              "ray",
                                              "--match",
                                              "closest",
                                              "--size",
                                              "128",
                                              "--directions",
                                              "32",
                                              "--pixels",
                                              "64",
                                              "--max-distance",
                                              "10%",
                                              "--json",
                                              scene / "r.json",
                                              "--out",
                                              scene / "out"};
  const ProcessResult result = call_kiln(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "r.json");
  ASSERT_EQ(report["methods"].size(), 2U);
  const json& ray = report["methods"][0];
  const json& closest = report["methods"][1];
  EXPECT_EQ(ray["method"], "ray");
  EXPECT_EQ(ray["directions"], 32);
  EXPECT_EQ(ray["miss_rate"], 0);
  const auto mean = [](const json& of) { return of["mean"].get<double>(); };
  // Heights of the bumps are some hundredths; nearest points are nearer than where normals lead.
  EXPECT_GT(mean(closest["match_distance"]), 0.005);
  EXPECT_LT(mean(closest["match_distance"]), mean(ray["match_distance"]));
  EXPECT_LT(mean(ray["match_distance"]), 0.04);
  for (const json& row : {ray, closest}) {
    // Pictures show a distance shorter or as it is; a ray that is aslant meets the bumps farther off.
    EXPECT_LT(mean(row["image_space"]), mean(row["match_distance"]));
    EXPECT_GT(mean(row["object_space"]), mean(row["image_space"]));
    EXPECT_GT(row["object_space"]["rms"], row["object_space"]["mean"]);
    EXPECT_GT(row["object_space"]["share_of_rays"], 0.95);
    EXPECT_NEAR(mean(row["normalised_image_space"]), 2.0 / 3, 0.05);
    EXPECT_GT(row["uniformity"]["pairs"], 20000);
    EXPECT_GT(row["uniformity"]["across_seams"]["pairs"], 100);
  }
  EXPECT_GT(closest["uniformity"]["mean_percent"], ray["uniformity"]["mean_percent"]);
  EXPECT_LT(ray["rendered_normals"]["mean_angle_degrees"].get<double>(),
            report["without_map"]["mean_angle_degrees"].get<double>() / 3);
  EXPECT_GE(ray["rendered_normals"]["rms_angle_degrees"].get<double>(),
            ray["rendered_normals"]["mean_angle_degrees"].get<double>());

  ASSERT_EQ(report["outputs"].size(), 2U * 8 + 1);  // recall among them
  for (const json& output : report["outputs"]) EXPECT_TRUE(fs::exists(output.get<std::string>()));
  const Image field = load_image(scene / "out" / "low_ray_match_distance.exr");
  EXPECT_EQ(field.width, 128U);
  double sum = 0;
  int known = 0;
  for (const float value : field.pixels) {
    if (value < 0) continue;
    sum += value;
    ++known;
  }
  EXPECT_EQ(known, ray["samples"].get<int>());
  // Texels of the sphere's map weigh alike here and by their area there.
  EXPECT_NEAR(sum / known, mean(ray["match_distance"]), 0.2 * mean(ray["match_distance"]));

  // measure.png: four blocks of a ball a method, each of which covers three quarters of its square of some 370. About
  // half of what they show is dark, and so counts as grey.
  const Image picture = load_image(scene / "out" / "measure.png");
  EXPECT_GE(picture.width, 2U * 330);
  EXPECT_GE(picture.height, 4U * 330);
  const double balls = static_cast<double>(coloured_pixels(picture)) / (0.785 * 372 * 372);
  EXPECT_GT(balls, 3);
  EXPECT_LT(balls, 8.5);

  EXPECT_EQ(call_kiln({"measure", scene / "high.obj"}).exit_code, 2);
  EXPECT_EQ(
      call_kiln({"measure", scene / "high.obj", scene / "low.obj", "--faces", "300"}).exit_code, 2);
  EXPECT_EQ(call_kiln({"measure", scene / "high.obj", scene / "none.obj"}).exit_code, 3);
}

TEST(MeasureCommand, RatesTheUvsOfOneMesh) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  save_obj(test::cube(2), scene / "cube.obj");
  const ProcessResult result =
      call_kiln({"measure", scene / "cube.obj", "--size", "256", "--json", scene / "layout.json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.output.find("12 edges, 24 units"), std::string::npos) << result.output;
  const json layout = read_json(scene / "layout.json")["layout"];
  EXPECT_EQ(layout["charts"], 6);
  EXPECT_EQ(layout["seams"], 12);
  EXPECT_NEAR(layout["seam_length"].get<double>(), 24, 1e-4);
  EXPECT_NEAR(layout["area"].get<double>(), 24, 1e-4);
  // Six rectangles of (1/3 - 0.02) x (1/2 - 0.02).
  const double used = 6 * (1 / 3.0 - 0.02) * 0.48;
  EXPECT_NEAR(layout["used"].get<double>(), used, 0.01);
  EXPECT_NEAR(layout["texels_per_unit"]["mean"].get<double>(), 256 * std::sqrt(used / 24), 1e-3);
  // Flags of matches need two meshes.
  const ProcessResult refused = call_kiln({"measure", scene / "cube.obj", "--directions", "12"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.errors.find("give both meshes"), std::string::npos) << refused.errors;
}

TEST(MeasureCommand, ShowsAThinModelLarge) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Mesh high = test::BumpySphere::dense(2000), low = test::BumpySphere::light(24, 12);
  for (Mesh* mesh : {&high, &low}) {
    for (Vec3& p : mesh->positions) p.y *= 20;
    mesh->normals.clear();
    mesh->normal_triangles.clear();
  }
  save_obj(high, scene / "high.obj");
  save_obj(low, scene / "low.obj");
  const ProcessResult result = call_kiln(
      {"measure", scene / "high.obj", scene / "low.obj", "--match", "closest", "--size", "64",
       "--directions", "12", "--pixels", "64", "--max-distance", "10%", "--out", scene / "out"},
      test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Image picture = load_image(scene / "out" / "measure.png");
  EXPECT_GE(picture.height, 4 * 900U);
  EXPECT_LE(picture.height, 4 * (960U + 100));
}

TEST(MeasureCommand, PicturesAreTakenFromTheViewAskedFor) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Mesh high = test::BumpySphere::dense(2000), low = test::BumpySphere::light(24, 12);
  for (Mesh* mesh : {&high, &low}) {
    for (Vec3& p : mesh->positions) p.y *= 20;
    mesh->normals.clear();
    mesh->normal_triangles.clear();
  }
  save_obj(high, scene / "high.obj");
  save_obj(low, scene / "low.obj");
  const auto shown = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"measure",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          "--match",
                                          "closest",
                                          "--size",
                                          "32",
                                          "--directions",
                                          "12",
                                          "--out",
                                          scene / name,
                                          "--max-distance",
                                          "10%",
                                          "--picture-size",
                                          "200",
                                          "--pixels",
                                          "64"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(arguments, test::without_python().environment);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const Image picture = load_image(scene / name / "measure.png");
    return std::pair(picture.height, coloured_pixels(picture));
  };
  // All show the low poly 200 pixels high, or what there is of it.
  const auto [tall, thin] = shown("front", {"--view", "0,0"});
  EXPECT_GE(tall, 4 * 200U);
  const auto [round, wide] = shown("above", {"--view", "0,90"});
  EXPECT_NEAR(round, tall, 4 * 12) << "from above it is round";
  EXPECT_GT(wide, 2 * thin);
  const auto [near, large] = shown("near", {"--view", "0,0", "--zoom", "4", "--square"});
  EXPECT_NEAR(near, tall, 4 * 12);
  EXPECT_GT(large, thin);
}

TEST(MeasureCommand, RatesPlacesOfVisibilityApart) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const auto measure = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"measure", scene / "high.obj", scene / "low.obj", "--size", "64",
                               "--directions", "12", "--pixels", "64", "--max-distance", "10%"});
    return call_kiln(more, test::without_python().environment);
  };
  const ProcessResult result = measure({"--match", "ray", "--match", "hybrid", "--visibility-at",
                                        "vertex", "--visibility-at", "texel", "--json",
                                        scene / "r.json", "--out", scene, "--picture-size", "64"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "r.json");
  std::vector<std::string> names;
  for (const json& row : report["methods"]) {
    names.push_back(row["name"]);
    EXPECT_EQ(row.contains("visibility_at"), row["method"] != "ray");
  }
  EXPECT_EQ(names, (std::vector<std::string>{"ray", "hybrid_vertex", "hybrid_texel"}));
  EXPECT_EQ(report["methods"][1]["visibility_at"], "vertex");
  EXPECT_NE(report["methods"][1]["object_space"], report["methods"][2]["object_space"]);
  EXPECT_TRUE(fs::exists(scene / "low_hybrid_vertex_uniformity.exr"));
  for (const std::string& name : names) {
    EXPECT_NE(result.output.find("| " + name + " "), std::string::npos) << result.output;
  }
  EXPECT_EQ(measure({"--match", "ray", "--visibility-at", "face"}).exit_code, 2);
  EXPECT_EQ(measure({"--visibility-at", "edge"}).exit_code, 2);
  EXPECT_EQ(measure({"--study", "views", "--out", scene, "--visibility-at", "face"}).exit_code, 2);
}

/// Waves on a plane with UVs, a plane under them with the same layout, and one whose layout is turned.
fs::path make_layouts() {
  const fs::path scene = test::scratch_folder();
  Mesh high = test::plane(40, 40);
  for (Vec3& p : high.positions) p.z = 0.01F * std::sin(20 * p.x) * std::cos(17 * p.y);
  high.normals.clear();
  high.normal_triangles.clear();
  save_obj(high, scene / "high.obj");
  save_obj(test::plane(2, 2), scene / "low.obj");
  Mesh turned = test::plane(2, 2);
  for (Vec2& uv : turned.uvs) uv = {uv.y, 1 - uv.x};
  save_obj(turned, scene / "turned.obj");
  return scene;
}

TEST(MeasureCommand, RatesUvsWhereLayoutsAgree) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_layouts();
  const auto measure = [&](const fs::path& low, std::vector<std::string> more) {
    more.insert(more.begin(),
                {"measure", scene / "high.obj", low, "--size", "64", "--directions", "12",
                 "--pixels", "64", "--max-distance", "10%", "--json", scene / "r.json"});
    return call_kiln(more);
  };
  const auto methods = [](const json& report) {
    std::vector<std::string> names;
    for (const json& row : report["methods"]) names.push_back(row["method"]);
    return names;
  };
  const auto named = [](const json& report, const std::string& name) {
    for (const json& row : report["methods"]) {
      if (row["method"] == name) return row;
    }
    return json();
  };
  // In the order of `kiln bake --match`.
  const std::vector<std::string> all = {"ray", "views", "closest", "visibility", "hybrid", "uv"};
  std::vector<std::string> searching = all;
  std::erase(searching, "uv");
  const ProcessResult agree = measure(scene / "low.obj", {});
  ASSERT_EQ(agree.exit_code, 0) << agree.errors;
  json report = read_json(scene / "r.json");
  EXPECT_EQ(methods(report), all);
  EXPECT_TRUE(report["left_out"].empty());
  // Over a plane, the normals' lines and the UVs say the same.
  const json ray = named(report, "ray"), uv = named(report, "uv");
  EXPECT_NEAR(uv["match_distance"]["mean"].get<double>(),
              ray["match_distance"]["mean"].get<double>(), 1e-5);
  EXPECT_NEAR(uv["rendered_normals"]["mean_angle_degrees"].get<double>(),
              ray["rendered_normals"]["mean_angle_degrees"].get<double>(), 0.01);

  const ProcessResult disagree = measure(scene / "turned.obj", {});
  ASSERT_EQ(disagree.exit_code, 0) << disagree.errors;
  report = read_json(scene / "r.json");
  EXPECT_EQ(methods(report), searching);
  ASSERT_EQ(report["left_out"].size(), 1U);
  EXPECT_EQ(report["left_out"][0]["method"], "uv");
  EXPECT_NE(report["left_out"][0]["reason"].get<std::string>().find("UV layouts do not correspond"),
            std::string::npos);
  EXPECT_NE((disagree.output + disagree.errors).find("left out: uv"), std::string::npos);

  EXPECT_EQ(measure(scene / "low.obj", {"--match", "uv"}).exit_code, 0);
  const ProcessResult refused = measure(scene / "turned.obj", {"--match", "ray", "--match", "uv"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.errors.find("--match uv"), std::string::npos) << refused.errors;
  const ProcessResult none = call_kiln({"measure", scene / "turned.obj", scene / "low.obj",
                                        "--match", "uv", "--max-distance", "10%"});
  EXPECT_EQ(none.exit_code, 3);
}

TEST(MeasureCommand, LeavesOutWhatFindsNothing) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_layouts();
  // Half of the low poly's layout lies beside the unit square, and the dense one's beside the rest.
  Mesh low = load_mesh(scene / "low.obj"), high = load_mesh(scene / "high.obj");
  for (Vec2& uv : low.uvs) uv.x += 0.5F;
  for (Vec2& uv : high.uvs) uv.x *= 0.4F;
  save_obj(low, scene / "outside.obj");
  save_obj(high, scene / "left.obj");
  const auto measure = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"measure", scene / "left.obj", scene / "outside.obj", "--size", "64",
                               "--directions", "12", "--pixels", "64", "--max-distance", "10%",
                               "--json", scene / "r.json"});
    return call_kiln(more);
  };
  const ProcessResult refused = measure({"--match", "uv"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.errors.find("do not overlap those of LOW"), std::string::npos)
      << refused.errors;
  // Rays reach what the same UVs cannot.
  const ProcessResult baked = call_kiln({"bake", scene / "left.obj", scene / "outside.obj",
                                         "--match", "auto", "--max-error", "30", "--size", "128",
                                         "--out", scene / "auto", "--json", scene / "b.json"});
  EXPECT_EQ(baked.exit_code, 0) << baked.errors;
  EXPECT_NE(baked.output.find("ray"), std::string::npos) << baked.output;
}

TEST(MeasureCommand, TakesAHeightField) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_layouts();
  Image image{33, 33, 1, std::vector<float>(33 * 33)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = 0.5F + 0.4F * std::sin(0.5F * static_cast<float>(i % 33));
  }
  save_image(image, scene / "field.exr", {ImageFormat::exr_float});
  // A fifth of the diagonal off the plane, far beyond what layouts of meshes may be apart.
  const auto measure = [&](const std::string& high, std::vector<std::string> more) {
    more.insert(more.begin(), {"measure", scene / high, scene / "low.obj", "--size", "64",
                               "--directions", "12", "--pixels", "64", "--max-distance", "40%",
                               "--height", "0.3", "--json", scene / "r.json"});
    return call_kiln(more);
  };
  const ProcessResult result = measure("field.exr", {"--match", "uv", "--match", "ray"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "r.json");
  EXPECT_EQ(report["inputs"]["high"]["triangles"], 2 * 32 * 32);
  EXPECT_EQ(report["options"]["height"], 0.3);
  for (const json& row : report["methods"]) {
    EXPECT_EQ(row["miss_rate"], 0);
    EXPECT_NEAR(row["match_distance"]["mean"].get<double>(), 0.3 * 0.5, 0.02);
    for (const json& warning : row["warnings"]) EXPECT_NE(warning["code"], "uv-disagreement");
  }
  EXPECT_EQ(measure("high.obj", {"--match", "ray"}).exit_code, 2);
}

}  // namespace
}  // namespace kiln

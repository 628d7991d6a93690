// Pictures from the command line: render's views, zoom, errors and frames; gallery; diff's picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/image.h"
#include "support/json_file.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::expect_exit;
using test::ProcessResult;
using test::read_json;
using test::run_kiln;

fs::path make_pictures_scene() {
  fs::path folder = test::scratch_folder();
  save_obj(test::BumpyTorus::dense(8000), folder / "high.obj");
  save_obj(test::BumpyTorus::light(36, 12), folder / "low.obj");
  return folder;
}

TEST(RenderCommand, ZoomsTimesFramesAndShowsErrors) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_pictures_scene();
  const std::string high = scene / "high.obj", low = scene / "low.obj";
  ASSERT_EQ(call_kiln({"bake", high, low, "--size", "128", "--max-distance", "10%", "--out",
                       scene / "maps"})
                .exit_code,
            0);
  const std::string map = scene / "maps" / "low_normal.png";
  const std::vector<std::string> arguments = {"render",         low,  "--normal",  map,
                                              "--reference",    high, "--size",    "120",
                                              "--ambient-rays", "0",  "--samples", "1"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), arguments.begin(), arguments.end());
    return more;
  };
  ProcessResult result =
      call_kiln(with({"--out", scene / "plain.png", "--json", scene / "r.json", "--frames", "3"}));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "r.json");
  const json& frames = report["frames"];
  for (const char* key : {"reference", "mesh", "with_map"}) {
    EXPECT_EQ(frames[key]["frames"], 3) << key;
    EXPECT_GT(frames[key]["seconds_median"].get<double>(), 0) << key;
  }
  // The line lists them by commas, the first one after a colon.
  const std::size_t first = result.output.find(": high poly "),
                    second = result.output.find(", low poly ");
  EXPECT_NE(first, std::string::npos) << result.output;
  EXPECT_NE(second, std::string::npos) << result.output;
  EXPECT_LT(first, second);
  EXPECT_EQ(frames["mesh"]["triangles"], 36 * 12 * 2);
  EXPECT_GT(frames["reference"]["bytes"], frames["mesh"]["bytes"]);
  EXPECT_GE(frames["with_map"]["bytes"].get<int>(), 128 * 128 * 6);
  // A torus seen from 15 degrees above is wider than high, and so is its picture.
  const Image plain = load_image(scene / "plain.png");
  EXPECT_GT(plain.width, 3 * 115U);
  EXPECT_LT(plain.height, 100U);
  ASSERT_EQ(call_kiln({"render", low, "--size", "120", "--ambient-rays", "0", "--samples", "1",
                       "--out", scene / "square.png", "--square"})
                .exit_code,
            0);
  EXPECT_EQ(load_image(scene / "square.png").height, 120U);
  // With the error: one more panel and a scale below.
  ASSERT_EQ(call_kiln(with({"--out", scene / "error.png", "--error", "--quiet"})).exit_code, 0);
  const Image error = load_image(scene / "error.png");
  EXPECT_GT(error.width, 4 * 120U);
  EXPECT_GT(error.height, plain.height + 40);
  // Close up, the picture is another one.
  ASSERT_EQ(
      call_kiln(with({"--out", scene / "close.png", "--zoom", "4", "--at", "1,0,0.3", "--quiet"}))
          .exit_code,
      0);
  const Image close = load_image(scene / "close.png");
  ASSERT_EQ(close.width, plain.width);
  EXPECT_GT(compare_images(plain, close).max_error, 0.2);
}

TEST(RenderCommand, PutsViewsOnASheet) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_pictures_scene();
  const std::string high = scene / "high.obj";
  ASSERT_EQ(call_kiln({"render", high, "--views", "12", "--normals", "--size", "64", "--samples",
                       "1", "--out", scene / "views.png"})
                .exit_code,
            0);
  const Image sheet = load_image(scene / "views.png");
  EXPECT_GT(std::size_t{sheet.width} * sheet.height, std::size_t{12} * 64 * 64);
  expect_exit(
      call_kiln({"render", high, "--views", "12", "--view", "0,0", "--out", scene / "a.png"}), 2,
      {"--views"});
  expect_exit(call_kiln({"render", high, "--error", "--out", scene / "a.png"}), 2, {"--reference"});
  expect_exit(call_kiln({"render", high, "--frames", "3", "--out", scene / "a.png"}), 2,
              {"--json"});
  expect_exit(call_kiln({"render", high, "--at", "1,2", "--out", scene / "a.png"}), 2, {"X,Y,Z"});
  expect_exit(call_kiln({"render", high, "--at", "1,2,3,4", "--out", scene / "a.png"}), 2,
              {"X,Y,Z"});
  expect_exit(call_kiln({"render", high, "--zoom", "0", "--out", scene / "a.png"}), 2, {"--zoom"});
}

/// A HIGH with Z up, in centimetres, is the same as one as LOW is.
TEST(GalleryCommand, FilesMayBeTurnedAndScaled) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_pictures_scene();
  Mesh high = load_mesh(scene / "high.obj");
  for (Vec3& p : high.positions) p = {100 * p.x, -100 * p.z, 100 * p.y};
  high.normals.clear();
  high.normal_triangles.clear();
  Mesh plain = load_mesh(scene / "high.obj");
  plain.normals.clear();
  plain.normal_triangles.clear();
  save_obj(plain, scene / "plain.obj");
  save_obj(high, scene / "turned.obj");
  const std::vector<std::string> frame = {"--up", "high=z", "--unit", "high=cm"};
  const auto degrees = [&](std::vector<std::string> words, const char* high_file,
                           const std::vector<std::string>& more, const char* list) {
    words.insert(words.begin() + 1, {scene / high_file, scene / "low.obj"});
    words.insert(words.end(), {"--size", "64", "--pixels", "64", "--json", scene / "f.json"});
    words.insert(words.end(), more.begin(), more.end());
    test::expect_exit(call_kiln(words), 0, {});
    return test::read_json(scene / "f.json")[list][0].dump();
  };
  const std::vector<std::string> gallery = {
      "gallery", "--match", "ray", "--picture-size", "64", "--out", scene / "pictures"};
  const auto mean = [](const std::string& text) {
    return nlohmann::json::parse(text)["mean_angle_degrees"].get<double>();
  };
  EXPECT_NEAR(mean(degrees(gallery, "turned.obj", frame, "methods")),
              mean(degrees(gallery, "plain.obj", {}, "methods")), 0.02);
  test::expect_exit(call_kiln({"gallery", scene / "high.obj", scene / "low.obj", "--up", "down",
                               "--out", scene / "pictures"}),
                    2, {"--up 'down'"});
  test::expect_exit(call_kiln({"chart", scene / "high.obj", scene / "low.obj", "--unit", "mile",
                               "--out", scene / "pictures"}),
                    2, {"--unit 'mile'"});
  test::expect_exit(
      call_kiln({"measure", scene / "low.obj", "--uv-set", "1", "--json", scene / "f.json"}), 3,
      {"low.obj"});
}

TEST(GalleryCommand, ShowsEveryMatch) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_pictures_scene();
  const fs::path out = scene / "pictures";
  const std::vector<std::string> arguments = {"gallery",
                                              scene / "high.obj",
                                              scene / "low.obj",
                                              "--match",
                                              "ray",
                                              "--match",
                                              "closest",
                                              "--size",
                                              "64",
                                              "--max-distance",
                                              "10%",
                                              "--picture-size",
                                              "160",
                                              "--out",
                                              out,
                                              "--pixels",
                                              "64",
                                              "--json",
                                              scene / "g.json"};
  const ProcessResult result = call_kiln(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "g.json");
  ASSERT_EQ(report["methods"].size(), 2U);
  EXPECT_EQ(report["methods"][0]["method"], "ray");
  for (const char* name : {"matches.png", "error.png"}) {
    const Image picture = load_image(out / name);
    EXPECT_GT(picture.width, 320U) << name;
  }
  // The error's texture: where it is seen, its mean is about that of the one view.
  const Image error = load_image(out / "low_ray_normal_error.exr");
  ASSERT_EQ(error.width, 64U);
  ASSERT_EQ(error.channels, 1U);
  double sum = 0, count = 0, unseen = 0;
  for (const float value : error.pixels) {
    if (value < 0) {
      ASSERT_EQ(value, -1);
      ++unseen;
    } else {
      sum += value;
      ++count;
    }
  }
  EXPECT_GT(count, 0.9 * 64 * 64);
  const double mean = report["methods"][0]["mean_angle_degrees"].get<double>();
  EXPECT_NEAR(sum / count, mean, 0.5 * mean);
  // The same bytes on one thread.
  test::ProcessOptions one;
  one.environment = {{"KILN_THREADS", "1"}, {"POCL_MAX_PTHREAD_COUNT", "1"}};
  std::vector<std::string> again = arguments;
  again[14] = scene / "again";
  ASSERT_EQ(run_kiln(again, one).exit_code, 0);
  for (const char* name : {"matches.png", "error.png", "low_closest_normal_error.exr"}) {
    const auto bytes = [&](const fs::path& folder) { return test::read_file(folder / name); };
    EXPECT_EQ(bytes(out), bytes(scene / "again")) << name;
  }
}

TEST(DiffCommand, DrawsTheDifference) {
  const fs::path folder = test::scratch_folder();
  // Normals that turn by 2 degrees a column against a flat map.
  Image flat{16, 8, 3, {}}, turned = flat;
  for (int i = 0; i < 16 * 8; ++i) {
    const double angle = (i % 16) * 2 * 3.14159265358979 / 180;
    flat.pixels.insert(flat.pixels.end(), {0.5F, 0.5F, 1.0F});
    turned.pixels.insert(turned.pixels.end(), {static_cast<float>(std::sin(angle) / 2 + 0.5), 0.5F,
                                               static_cast<float>(std::cos(angle) / 2 + 0.5)});
  }
  Image mask{16, 8, 1, std::vector<float>(std::size_t{16} * 8, 1.0F)};
  mask.pixels[5] = 0;
  save_image(flat, folder / "a.exr", {ImageFormat::exr_float});
  save_image(turned, folder / "b.exr", {ImageFormat::exr_float});
  save_image(mask, folder / "mask.exr", {ImageFormat::exr_float});
  ASSERT_EQ(call_kiln({"diff", folder / "a.exr", folder / "b.exr", "--mask", folder / "mask.exr",
                       "--out", folder / "d.exr"})
                .exit_code,
            1);
  const Image difference = load_image(folder / "d.exr");
  ASSERT_EQ(difference.channels, 1U);
  for (std::size_t i = 0; i < difference.pixels.size(); ++i) {
    // Halves of a sine in floats: 2^-25 of an angle's sine at 0.
    EXPECT_NEAR(difference.pixels[i], i == 5 ? -1 : 2.0 * static_cast<double>(i % 16), 2e-5) << i;
  }
  ASSERT_EQ(call_kiln({"diff", folder / "a.exr", folder / "b.exr", "--max-error", "1", "--out",
                       folder / "channels.exr"})
                .exit_code,
            0);
  const Image channels = load_image(folder / "channels.exr");
  EXPECT_NEAR(channels.pixels[15], std::sin(30 * 3.14159265358979 / 180) / 2, 1e-6);
  ASSERT_EQ(
      call_kiln({"diff", folder / "a.exr", folder / "b.exr", "--out", folder / "d.png"}).exit_code,
      1);
  EXPECT_GT(load_image(folder / "d.png").width, 260U) << "the scale is wider than the maps";
  expect_exit(call_kiln({"diff", folder / "a.exr", folder / "b.exr", "--out", folder / "d.jpg"}), 2,
              {".png"});
  expect_exit(call_kiln({"diff", folder / "a.exr", folder / "b.exr", "--out", folder / "a.exr"}), 2,
              {"a.exr"});
}

}  // namespace
}  // namespace kiln

// kiln diff: maps within and beyond a limit, and what it cannot compare.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/process.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_failure;
using test::make_scene;
using test::ProcessResult;
using test::read_json;

TEST(Command, DiffTellsWithinFromBeyond) {
  const fs::path folder = test::scratch_folder();
  Image a{8, 8, 3, std::vector<float>(192, 0.5F)};
  for (std::size_t i = 2; i < a.pixels.size(); i += 3) a.pixels[i] = 1;
  Image b = a;
  b.at(3, 4)[0] = 0.6F;  // 2 * 0.1 over 1: atan(0.2) = 11.3 degrees
  save_image(a, folder / "a.png", {ImageFormat::png16});
  save_image(b, folder / "b.png", {ImageFormat::png16});
  EXPECT_EQ(call_kiln({"diff", folder / "a.png", folder / "a.png"}).exit_code, 0);
  EXPECT_EQ(call_kiln({"diff", folder / "a.png", folder / "b.png"}).exit_code, 1);
  EXPECT_EQ(
      call_kiln({"diff", folder / "a.png", folder / "b.png", "--max-angle", "11.4"}).exit_code, 0);
  EXPECT_EQ(
      call_kiln({"diff", folder / "a.png", folder / "b.png", "--max-angle", "11.2"}).exit_code, 1);
  EXPECT_EQ(
      call_kiln({"diff", folder / "a.png", folder / "b.png", "--max-error", "0.11"}).exit_code, 0);
  EXPECT_EQ(
      call_kiln({"diff", folder / "a.png", folder / "b.png", "--max-mean-angle", "0.1"}).exit_code,
      1);
  EXPECT_EQ(call_kiln({"diff", folder / "a.png", folder / "b.png", "--max-mean-angle", "0.2",
                       "--json", folder / "d.json"})
                .exit_code,
            0);
  const nlohmann::json report = read_json(folder / "d.json");
  EXPECT_NEAR(report["max_angle_degrees"].get<double>(), 11.31, 0.01);
  EXPECT_EQ(report["worst"], (std::vector<int>{3, 4}));
  expect_failure({"diff", folder / "a.png", folder / "none.png"}, 3, {"none.png"});
}

TEST(Command, ReadsItsOwnFormsOfMapsAndMasks) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(20000);
  const auto bake = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bake",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          "--out",
                                          scene / name,
                                          "--size",
                                          "128",
                                          "--max-distance",
                                          "10%",
                                          "--format",
                                          "exr32"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ASSERT_EQ(call_kiln(arguments).exit_code, 0);
  };
  bake("plain", {"--maps", "normal,mask", "--save-match", scene / "match.exr"});
  bake("raw", {"--raw"});
  bake("two", {"--two-component"});
  bake("both", {"--raw", "--two-component"});
  bake("gutterless", {"--gutter", "0"});
  const std::string plain = scene / "plain/low_normal.exr";
  for (const char* name : {"raw", "two", "both"}) {
    EXPECT_EQ(call_kiln({"diff", plain, scene / name / "low_normal.exr", "--max-angle", "0.05"})
                  .exit_code,
              0)
        << name;
  }
  const std::string gutterless = scene / "gutterless/low_normal.exr";
  EXPECT_EQ(call_kiln({"diff", plain, gutterless}).exit_code, 1);
  EXPECT_EQ(
      call_kiln({"diff", plain, gutterless, "--mask", scene / "plain/low_mask.exr"}).exit_code, 0);
  EXPECT_EQ(call_kiln({"diff", plain, gutterless, "--mask", scene / "match.exr"}).exit_code, 0);
  const ProcessResult json = call_kiln({"diff", plain, plain, "--json", "-"});
  EXPECT_EQ(nlohmann::json::parse(json.output)["within"], true);
}

TEST(Command, DiffPassesNothingThatItDidNotCompare) {
  const fs::path folder = test::scratch_folder();
  const auto flat = [](std::uint32_t channels, float value) {
    return Image{4, 4, channels, std::vector<float>(std::size_t{16} * channels, value)};
  };
  save_image(flat(1, 0.2F), folder / "grey.png", {ImageFormat::png16});
  save_image(flat(3, 0.7F), folder / "a.png", {ImageFormat::png16});
  save_image(flat(3, 0.2F), folder / "b.png", {ImageFormat::png16});
  save_image(flat(1, 0), folder / "none.png", {ImageFormat::png16});
  const std::string a = folder / "a.png", b = folder / "b.png", grey = folder / "grey.png";
  expect_failure({"diff", grey, grey, "--max-angle", "0"}, 2, {"--max-error"});
  expect_failure({"diff", a, b, "--max-angle", "nan"}, 2, {"nan"});
  expect_failure({"diff", a, b, "--max-error", "-1"}, 2, {"'-1'"});
  expect_failure({"diff", a, b, "--mask", folder / "none.png"}, 3, {"none.png"});
  expect_failure({"diff", a, grey}, 3, {"channels"});
  expect_failure({"diff", a, b, "--mask", ""}, 2, {"--mask"});
}

}  // namespace
}  // namespace kiln

// Command lines that are refused: exit codes, and messages that name the remedy.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_failure;
using test::make_scene;
using test::ProcessOptions;
using test::ProcessResult;
using test::run_kiln;

TEST(Command, NamesTheLineOfABadListOfViews) {
  const fs::path scene = make_scene(500);
  for (const auto& [text, line] :
       {std::pair{"0 0 1 1\n0 0 0 1\n", "line 2"}, std::pair{"1 2 3\n", "line 1"},
        std::pair{"1 2 3 -4\n", "line 1"}, std::pair{"1 2 3 4 5\n", "line 1"},
        std::pair{"\n# nothing\n", "no line"}}) {
    std::ofstream(scene / "views.txt") << text;
    expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out",
                    "--match", "hybrid", "--view-weight", scene / "views.txt"},
                   3, {"views.txt", line}, scene / "out");
  }
  // Sums of large weights stay in range, and a list that says nothing is remarked.
  std::ofstream(scene / "views.txt") << "0 0 1 1e38\n0 1 0 1e38\n";
  const ProcessResult equal =
      call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size", "64", "--out",
                 scene / "equal", "--match", "visibility", "--view-weight", scene / "views.txt"});
  EXPECT_EQ(equal.exit_code, 0) << equal.errors;
  EXPECT_NE(equal.errors.find("same weight"), std::string::npos) << equal.errors;
  EXPECT_EQ((equal.output + equal.errors).find("standard deviation 0.000"), std::string::npos);
}

TEST(Command, SaysBetweenWhichNumbersAValueMustLie) {
  for (const char* value : {"200", "-1", "nan"}) {
    test::expect_exit(call_kiln({"simplify", "a", "--out", "b.obj", "--hard-angle", value}), 2,
                      {std::string("--hard-angle is '") + value + "': give 0 to 180\n"});
  }
  test::expect_exit(call_kiln({"bake", "a", "--lod", "2", "--lod-growth", "0.5", "--out", "b"}), 2,
                    {"--lod-growth is '0.5': give 1 to 4\n"});
}

TEST(Command, ProgramsSayWhatTheirCodeSaysWithinTests) {
  int number = 0;
  for (const auto& [words, code] : std::vector<std::pair<std::vector<std::string>, int>>{
           {{"--help"}, 0},
           {{"help", "measure"}, 0},
           {{"chart", "--help"}, 0},
           {{}, 2},
           {{"bake", "a", "b", "--sise", "64"}, 2},
           {{"gallery", "a", "b", "--sise", "64"}, 2},
           {{"diff", "none.png", "none.png"}, 3},
           {{"measure", "none.obj", "none.obj"}, 3}}) {
    SCOPED_TRACE(number++);
    const ProcessResult program = run_kiln(words), called = call_kiln(words);
    EXPECT_EQ(program.exit_code, code);
    EXPECT_EQ(called.exit_code, code);
    EXPECT_EQ(called.output, program.output);
    EXPECT_EQ(called.errors, program.errors);
  }
}

TEST(Command, RefusesBadUsage) {
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const fs::path out = scene / "out";
  const auto bake = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"bake", high, low, "--out", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  expect_failure({}, 2, {"help"});
  expect_failure({"fry"}, 2, {"fry"});
  expect_failure({"bake"}, 2, {"HIGH"});
  expect_failure({"bake", high, low}, 2, {"--out"});
  expect_failure(bake({"--size", "0"}), 2, {"--size", "16384"}, out);
  expect_failure(bake({"--size", "100000"}), 2, {"--size", "16384"}, out);
  expect_failure(bake({"--size", "12x"}), 2, {"--size"}, out);
  expect_failure(bake({"--size", "-5"}), 2, {"--size"}, out);
  expect_failure(bake({"--maps", "normal,smell"}), 2, {"smell", "normal"}, out);
  expect_failure(bake({"--maps", "x=ao:samples=3"}), 2, {"x=ao:samples=3", "cannot be set"}, out);
  expect_failure(bake({"--maps", "x=ao:ao-rays=0"}), 2, {"x=ao:ao-rays=0", "1 to 4096"}, out);
  expect_failure(bake({"--maps", "x=ao:ao-rays"}), 2, {"ao-rays=VALUE"}, out);
  expect_failure(bake({"--maps", "x=normal:ao-rays=4"}), 2, {"ao-rays=4", "normal"}, out);
  expect_failure(bake({"--maps", "ao=ao:ao-rays=4"}), 2, {"another map's name"}, out);
  expect_failure(bake({"--curvature-radius", "1%"}), 2, {"--curvature-radius", "--maps"}, out);
  expect_failure(bake({"--maps", "curvature", "--curvature-radius", "0"}), 2,
                 {"--curvature-radius"}, out);
  expect_failure(bake({"--range", "height=0,1"}), 2, {"height", "which is not baked"}, out);
  expect_failure(bake({"--maps", "height", "--range", "height=1,0"}), 2, {"range", "below"}, out);
  expect_failure(bake({"--maps", "height", "--range", "height=1"}), 2, {"--range", "MAP=LO,HI"},
                 out);
  expect_failure(bake({"--range", "normal=0,1"}), 2, {"normal", "no range"}, out);
  expect_failure(bake({"--match", "guess"}), 2, {"guess", "ray"}, out);
  expect_failure(bake({"--max-distance", "0"}), 2, {"--max-distance"}, out);
  expect_failure(bake({"--max-distance", "nan"}), 2, {"--max-distance"}, out);
  expect_failure(bake({"--max-distance", "-1%"}), 2, {"--max-distance"}, out);
  expect_failure(bake({"--samples", "0"}), 2, {"--samples"}, out);
  expect_failure(bake({"--samples", "17"}), 2, {"--samples"}, out);
  expect_failure(bake({"--gutter", "wide"}), 2, {"--gutter", "inf"}, out);
  expect_failure(bake({"--raw"}), 2, {"--raw", "exr"}, out);
  expect_failure(bake({"--dither"}), 2, {"--dither", "png8"}, out);
  expect_failure(bake({"--faces", "100"}), 2, {"--faces", "LOW"}, out);
  expect_failure(bake({"--cage", "1%", "--cage-mesh", low}), 2, {"--cage"}, out);
  expect_failure(bake({"--save-match", "a.exr", "--load-match", "a.exr"}), 2, {"--load-match"},
                 out);
  expect_failure(bake({"--space", "object", "--two-component"}), 2, {"Two components"}, out);
  expect_failure({"bake", high, "--out", out, "--unwrap"}, 2, {"--unwrap"}, out);
  expect_failure(bake({"--density", "detail"}), 2, {"--density", "--unwrap"}, out);
  expect_failure(bake({"--unwrap=pairs", "--density", "area"}), 2, {"--density", "charts"}, out);
  expect_failure({"bake", high, "--out", out, "--unwrap=pairs", "--density", "detail"}, 2,
                 {"--density", "charts"}, out);
  expect_failure({"bake", high, "--out", out, "--density", "finest"}, 2, {"--density"}, out);
  expect_failure({"bake", high, "--out", out, "--faces", "0"}, 2, {"--faces"}, out);
  expect_failure({"bake", high, "", "--out", out}, 2, {"LOW"}, out);
  expect_failure(bake({"--max-error", "nan"}), 2, {"--max-error"}, out);
  expect_failure(bake({"--max-angle", "2"}), 2, {"--max-angle", "--match auto"}, out);
  expect_failure(bake({"--match", "auto", "--max-angle", "2%"}), 2, {"--max-angle"}, out);
  expect_failure(bake({"--views", "12"}), 2, {"--match views"}, out);
  expect_failure(bake({"--match", "views", "--views", "many"}), 2, {"--views", "auto"}, out);
  expect_failure(bake({"--match", "views", "--view", "0,0,0"}), 2, {"--view"}, out);
  expect_failure(bake({"--match", "views", "--cage", "2%"}), 2, {"--fallback ray"}, out);
  expect_failure(bake({"--match", "closest", "--cage", "2%"}), 2, {"--fallback ray"}, out);
  expect_failure(bake({"--match", "nearest"}), 2, {"--match", "closest"}, out);
  expect_failure(bake({"--fallback", "uv"}), 2, {"--fallback", "closest"}, out);
  expect_failure(bake({"--miss", "mark"}), 2, {"--fallback closest,fill", "mark"}, out);
  expect_failure(bake({"--fallback", "none"}), 2, {"--fallback", "mark"}, out);
  expect_failure(bake({"--fallback", "fill,mark"}), 2, {"--fallback fill", "nothing can"}, out);
  expect_failure(bake({"--maps", "ao", "--ao-error", "4/3"}), 2, {"--ao-error", "2/255"}, out);
  expect_failure(bake({"--maps", "ao", "--ao-error", "1/0"}), 2, {"--ao-error", "2/255"}, out);
  expect_failure(bake({"--match", "views", "--fallback", "views"}), 2, {"same samples"}, out);
  expect_failure(bake({"--directions", "100"}), 2, {"--directions", "--match visibility"}, out);
  expect_failure(bake({"--match", "hybrid", "--directions", "0"}), 2, {"--directions", "4096"},
                 out);
  expect_failure(bake({"--match", "visibility", "--visibility-at", "edge"}), 2,
                 {"--visibility-at", "texel"}, out);
  expect_failure(bake({"--match", "visibility", "--view-weight", "nowhere.txt"}), 3,
                 {"nowhere.txt", "horizon"}, out);
  expect_failure(bake({"--match", "visibility", "--cage", "2%"}), 2, {"--fallback ray"}, out);
  expect_failure(bake({"--fallback", "ray"}), 2, {"--fallback ray", "repeats a match"}, out);
  expect_failure(bake({"--match", "closest", "--fallback", "closest"}), 2,
                 {"--fallback closest", "repeats a match"}, out);
  expect_failure(bake({"--load-match", "a.exr", "--match", "closest"}), 2, {"--match"}, out);
  expect_failure(bake({"--match", "visibility", "--visibility-deviation", "0.5"}), 2,
                 {"--visibility-clusters"}, out);
  expect_failure(
      bake({"--match", "visibility", "--visibility-at", "vertex", "--visibility-smooth", "9"}), 2,
      {"--visibility-smooth"}, out);
  expect_failure(
      bake({"--match", "visibility", "--visibility-test", "rays", "--visibility-size", "64"}), 2,
      {"--visibility-size"}, out);
  expect_failure(bake({"--load-match", "a.exr", "--fallback", "closest"}), 2, {"--load-match"},
                 out);
  expect_failure({"simplify", high, "--out", scene / "low.ply"}, 2, {".obj"});
}

TEST(Command, NamesTheFileAndTheRemedyForBadInput) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const fs::path out = scene / "out";
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(scene / name, std::ios::binary) << text;
    return (scene / name).string();
  };
  const auto expect_bad_high = [&](const std::string& path, const std::vector<std::string>& words) {
    expect_failure({"bake", path, low, "--out", out}, 3, words, out);
  };
  expect_bad_high(scene / "none.ply", {"none.ply"});
  expect_bad_high(scene, {scene.filename()});
  expect_bad_high(write("empty.ply", ""), {"empty.ply", "empty"});
  expect_bad_high(write("a.xyz", "1 2 3"), {"a.xyz", ".obj"});
  expect_bad_high(write("garbage.ply", std::string(2000, '\x93')), {"garbage.ply"});
  expect_bad_high(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), {"points.obj", "face"});
  expect_bad_high(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), {"flat"});
  expect_bad_high(write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), {"range.obj", "9"});
  expect_bad_high(write("nan.obj", "v nan 0 0\nv nan 0 0\nv 0 nan 0\nf 1 2 3\n"), {"nan"});

  // The low poly.
  const std::string plain = write("plain.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_failure({"bake", high, plain, "--out", out}, 3, {"plain", "UV", "--unwrap"}, out);
  const std::string zero =
      write("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 0 0\nvt 0 0\nf 1/1 2/2 3/3\n");
  expect_failure({"bake", high, zero, "--out", out}, 3, {"zero", "UV"}, out);
  expect_failure({"bake", high, low, "--out", out, "--cage-mesh", plain}, 3, {"cage"}, out);
  expect_failure({"bake", high, low, "--out", out, "--load-match", plain}, 3, {"plain.obj"}, out);
}

TEST(Command, SuggestsTheOptionThatWasMeant) {
  const ProcessResult typo = call_kiln({"bake", "a", "b", "--out", "c", "--sise", "64"});
  EXPECT_EQ(typo.exit_code, 2);
  EXPECT_NE(typo.errors.find("'--sise'"), std::string::npos) << typo.errors;
  EXPECT_NE(typo.errors.find("--size?"), std::string::npos) << typo.errors;
  const ProcessResult help = call_kiln({"help", "bake"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.output.find("--max-distance"), std::string::npos);
}

TEST(Command, AnEmptyResultIsAnErrorThatSaysWhy) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const auto expect = [&](const std::string& name, const std::function<void(Mesh&)>& change,
                          const std::string& word) {
    Mesh low = test::BumpySphere::light();
    change(low);
    save_obj(low, scene / (name + ".obj"));
    expect_failure({"bake", scene / "high.obj", scene / (name + ".obj"), "--out", scene / "out",
                    "--size", "64"},
                   3, {name, word}, scene / "out");
  };
  expect(
      "large",
      [](Mesh& m) {
        for (Vec3& p : m.positions) p = {p.x * 100, p.y * 100, p.z * 100};
      },
      "times as large");
  expect(
      "away",
      [](Mesh& m) {
        for (Vec3& p : m.positions) p.x += 10;
      },
      "units away");
  expect(
      "outside",
      [](Mesh& m) {
        for (Vec2& uv : m.uvs) uv.x += 2;
      },
      "unit square");
}

TEST(Command, MissesBeyondTheLimitFail) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const std::vector<std::string> arguments = {"bake",        scene / "high.obj", scene / "low.obj",
                                              "--out",       scene / "out",      "--size",
                                              "64",          "--max-distance",   "0.5%",
                                              "--max-missed"};
  const auto with = [&](const std::string& limit) {
    std::vector<std::string> all = arguments;
    all.push_back(limit);
    return call_kiln(all).exit_code;
  };
  EXPECT_EQ(with("99.9"), 0);
  EXPECT_EQ(with("1"), 1);
  EXPECT_EQ(with("101"), 2);
}

TEST(Command, ASavedMatchBelongsToItsMeshes) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const std::string match = scene / "match.exr";
  const auto bake = [&](const std::string& low, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bake",        scene / "high.obj", low, "--out",
                                          scene / "out", "--size",           "64"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  ASSERT_EQ(call_kiln(bake(scene / "low.obj", {"--save-match", match, "--max-distance", "10%"}))
                .exit_code,
            0);
  EXPECT_EQ(call_kiln(bake(scene / "low.obj", {"--load-match", match})).exit_code, 0);
  // The value of misses is no question of the match.
  EXPECT_EQ(
      call_kiln(bake(scene / "low.obj", {"--load-match", match, "--fallback", "mark"})).exit_code,
      0);
  // A forged distance is printed in a few digits.
  Match forged = load_match(match);
  const auto hit = std::find(forged.status.begin(), forged.status.end(), 1) - forged.status.begin();
  forged.distance.at(static_cast<std::size_t>(hit)) = 3e38F;
  save_match(forged, scene / "forged.exr");
  const ProcessResult far = call_kiln(
      bake(scene / "low.obj", {"--load-match", scene / "forged.exr", "--maps", "height"}));
  EXPECT_FALSE(std::regex_search(far.output + far.errors, std::regex("[0-9]{12}"))) << far.output;
  EXPECT_NE((far.output + far.errors).find("e+3"), std::string::npos) << far.output << far.errors;

  Mesh other = test::BumpySphere::light();
  other.positions[5].x += 0.001F;
  save_obj(other, scene / "other.obj");
  expect_failure(bake(scene / "other.obj", {"--load-match", match}), 3, {"another low poly"});
}

TEST(Command, SaysHowToGetADeviceWhereThereIsNone) {
  ProcessOptions options;
  options.environment = {{"OCL_ICD_VENDORS", test::scratch_folder()}};
  const fs::path scene = make_scene(500);
  const ProcessResult result =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out"}, options);
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_NE(result.errors.find("pocl-opencl-icd"), std::string::npos) << result.errors;
  EXPECT_EQ(run_kiln({"devices"}, options).exit_code, 4);
}

}  // namespace
}  // namespace kiln

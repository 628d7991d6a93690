// Meshes far from the world's origin, and such as reach far: maps are right, or the command says why not.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "support/pictures.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;
using test::call_kiln;
using test::ProcessResult;
using Words = std::vector<std::string>;

struct Baked {
  ProcessResult result;
  json report;
  fs::path out;

  Image map(const std::string& file) const { return test::read_picture(out / file); }
};

Baked bake_files(const std::string& high, const std::string& low, const Words& more) {
  const fs::path folder = test::scratch_folder();
  Words words = {"bake",     high, low, "--out", folder / "out", "--json", folder / "r.json",
                 "--recall", "0"};
  words.insert(words.end(), more.begin(), more.end());
  if (std::find(more.begin(), more.end(), "--size") == more.end()) {
    words.insert(words.end(), {"--size", "16"});
  }
  Baked baked{call_kiln(words), {}, folder / "out"};
  EXPECT_EQ(baked.result.exit_code, 0) << baked.result.errors;
  if (baked.result.exit_code == 0) baked.report = json::parse(std::ifstream(folder / "r.json"));
  return baked;
}

std::array<double, 3> normal_at(const Image& map, std::uint32_t x, std::uint32_t y) {
  std::array<double, 3> normal{};
  for (std::size_t k = 0; k < 3; ++k) normal[k] = 2 * double{map.at(x, y)[k]} - 1;
  return normal;
}

double degrees_apart(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const double size = std::hypot(a[0], a[1], a[2]) * std::hypot(b[0], b[1], b[2]);
  return std::acos(std::min(1.0, dot / size)) * 180 / 3.14159265358979323846;
}

TEST(FarCommand, UnusedVerticesChangeNothing) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases/far");
  const fs::path folder = *test::shared_data("cases/far");
  Image plain;
  for (const char* high :
       {"hi.obj", "hi.ply", "hi_dummy.obj", "hi_dummy.ply", "hi_point.obj", "hi_degen.obj"}) {
    for (const char* low : {"lo.obj", "lo_dummy.obj"}) {
      const Baked baked = bake_files(folder / high, folder / low,
                                     {"--maps", "normal,position", "--space", "object"});
      EXPECT_EQ(baked.report["texels"]["missed"], 0) << high << low;
      EXPECT_EQ(baked.result.errors.find("coarse"), std::string::npos) << baked.result.errors;
      EXPECT_EQ(baked.report["origin"], (json{500000.0, 4500000.0, 300.0})) << high << low;
      const Image map = baked.map(std::string(fs::path(low).stem()) + "_normal.png");
      const std::array<double, 3> right = {0, -1 / std::sqrt(17.0), 4 / std::sqrt(17.0)};
      // Sixteen bits a channel; the file's corners have two decimals.
      EXPECT_LT(degrees_apart(normal_at(map, 8, 8), right), 0.01) << high << low;
      if (plain.pixels.empty()) plain = map;
      EXPECT_EQ(map.pixels, plain.pixels) << high << low;
    }
  }
}

TEST(FarCommand, LengthsAreSharesOfWhatIsUsed) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases/far");
  const fs::path folder = *test::shared_data("cases/far"), out = test::scratch_folder();
  const auto run = [&](const Words& words) {
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
  };
  for (const char* kind : {"", "_dummy"}) {
    const std::string high = folder / ("hi" + std::string(kind) + ".obj"),
                      low = folder / ("lo" + std::string(kind) + ".obj");
    run({"render", low, "--size", "64", "--out", out / ("r" + std::string(kind) + ".png")});
    run({"bake", high, low, "--size", "16", "--cage", "auto", "--save-cage",
         out / ("c" + std::string(kind) + ".obj"), "--out", out / ("o" + std::string(kind))});
  }
  EXPECT_EQ(test::read_file(out / "r.png"), test::read_file(out / "r_dummy.png"));
  EXPECT_EQ(test::read_file(out / "o" / "lo_normal.png"),
            test::read_file(out / "o_dummy" / "lo_dummy_normal.png"));
  const Mesh cage = load_mesh(out / "c.obj"), other = load_mesh(out / "c_dummy.obj");
  EXPECT_EQ(cage.origin, other.origin);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(cage.positions[i], other.positions[i]);
}

/// A wavy sheet of 24 x 24 cells of a side, and a flat one of a cell below it with UVs.
struct Sheets {
  fs::path folder = test::scratch_folder();

  Sheets(const std::array<double, 3>& at, double side, const std::string& more) {
    std::ofstream high(folder / "high.obj"), low(folder / "low.obj");
    const auto vertex = [](std::ofstream& file, double x, double y, double z) {
      char text[96];
      std::snprintf(text, sizeof text, "v %.12g %.12g %.12g\n", x, y, z);
      file << text;
    };
    for (int y = 0; y <= 24; ++y) {
      for (int x = 0; x <= 24; ++x) {
        vertex(high, at[0] + side * x, at[1] + side * y,
               at[2] + side * std::sin(0.7 * x) * std::cos(0.5 * y));
      }
    }
    for (int y = 0; y < 24; ++y) {
      for (int x = 1; x <= 24; ++x) {
        const int a = 25 * y + x;
        high << "f " << a << ' ' << a + 1 << ' ' << a + 26 << ' ' << a + 25 << '\n';
      }
    }
    high << more;
    for (int i = 0; i < 4; ++i) {
      vertex(low, at[0] + (i == 1 || i == 2 ? 24 * side : 0), at[1] + (i > 1 ? 24 * side : 0),
             at[2]);
    }
    low << "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  }
  Baked bake(const Words& more) const {
    return bake_files(folder / "high.obj", folder / "low.obj", more);
  }
};

TEST(FarCommand, NamesOutliers) {
  KILN_REQUIRE_DEVICE();
  for (const char* far : {"1e4", "1e6", "1e7"}) {
    const Sheets scene({0, 0, 0}, 0.04, "v " + std::string(far) + " 0 0\nf 1 2 626\n");
    const ProcessResult result =
        call_kiln({"bake", scene.folder / "high.obj", scene.folder / "low.obj", "--size", "16",
                   "--max-distance", "0.2", "--out", scene.folder / "out"});
    EXPECT_NE(result.errors.find("Vertex 625 at (1"), std::string::npos)
        << far << ": " << result.errors;
    EXPECT_NE(result.errors.find("high"), std::string::npos) << result.errors;
  }
  // The low poly is not blamed for what the high poly's vertex does.
  const Sheets scene({0, 0, 0}, 0.04, "v 1e12 0 0\nf 1 2 626\n");
  test::expect_failure({"bake", scene.folder / "high.obj", scene.folder / "low.obj", "--size", "16",
                        "--out", scene.folder / "out"},
                       static_cast<int>(ErrorCode::input),
                       {"the high poly, whose diagonal is 1e+12", "outlying vertices"});
  // Within the rounding of doubles, this one is a line: it stretches nothing.
  const Baked line = Sheets({0, 0, 0}, 0.04, "v 1e20 0 0\nf 1 2 626\n").bake({});
  EXPECT_NE(line.result.errors.find("1 triangle has no area in the file"), std::string::npos)
      << line.result.errors;
  EXPECT_EQ(line.map("low_normal.png").pixels,
            Sheets({0, 0, 0}, 0.04, "").bake({}).map("low_normal.png").pixels);
  // Nothing to say of ordinary ones.
  const Baked plain = Sheets({0, 0, 0}, 0.04, "").bake({});
  EXPECT_TRUE(plain.report["warnings"].empty()) << plain.report["warnings"];
}

TEST(FarCommand, WhatLiesFarOutChangesNoOtherTexel) {
  KILN_REQUIRE_DEVICE();
  const Sheets plain({0, 0, 0}, 0.04, "");
  for (const char* match : {"ray", "closest", "visibility"}) {
    const Words words = {"--match", match, "--maps", "normal,ao,curvature", "--size", "32"};
    const Baked expected = plain.bake(words);
    for (const std::string x : {"1e6", "-1e10"}) {
      const std::string far = "v " + x + " 0 0\nv " + x + " 1 0\nv " + x + " 0 1\nf 626 627 628\n";
      const Baked baked = Sheets({0, 0, 0}, 0.04, far).bake(words);
      EXPECT_NE(baked.result.errors.find("move or remove"), std::string::npos)
          << baked.result.errors;
      EXPECT_EQ(baked.report["texels"], expected.report["texels"]) << match;
      for (const char* map : {"low_normal.png", "low_ao.png", "low_curvature.png"}) {
        EXPECT_EQ(baked.map(map).pixels, expected.map(map).pixels) << match << x << map;
      }
    }
  }
}

Words codes(const Baked& baked) {
  Words found;
  for (const json& warning : baked.report["warnings"]) found.push_back(warning["code"]);
  return found;
}

bool has(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

TEST(FarCommand, FormatsOfPositions) {
  KILN_REQUIRE_DEVICE();
  const std::array<double, 3> at = {500000.3, 4500000.3, 300};
  const Sheets scene(at, 0.8, "");
  const auto position = [&](const Baked& baked, const std::string& file, std::uint32_t x,
                            std::uint32_t y) {
    const Image map = baked.map(file);
    std::array<double, 3> place{};
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] = double{map.at(x, y)[k]};
      if (baked.report.contains("ranges")) {
        const double low = baked.report["ranges"]["position"][k][0],
                     high = baked.report["ranges"]["position"][k][1];
        place[k] = low + place[k] * (high - low);
      }
      place[k] += double{baked.report["origin"][k]};
    }
    return place;
  };
  struct Case {
    const char* format;
    const char* file;
    double step;  // at 32, or of a range of 19.2
  };
  for (const Case& c :
       {Case{"exr", "low_position.exr", 1.0 / 64}, Case{"exr32", "low_position.exr", 1e-5},
        Case{"png16", "low_position.png", 0.001}}) {
    const Baked baked = scene.bake({"--maps", "position", "--format", c.format});
    // The diagonal of 27.2 is rounded up to 32: multiples of it.
    EXPECT_EQ(baked.report["origin"], (json{500000.0, 4500000.0, 288.0})) << c.format;
    EXPECT_EQ(codes(baked), Words{}) << c.format;
    const auto place = position(baked, c.file, 3, 4);
    EXPECT_NEAR(place[0], at[0] + 19.2 * 3.5 / 16, c.step) << c.format;
    EXPECT_NEAR(place[1], at[1] + 19.2 * (1 - 4.5 / 16), c.step) << c.format;
  }
  // From 0 as asked: half precision ends at 65504; floats have steps of half a metre, as texels of 1.2 metres can
  // bear, but not those of 0.3.
  EXPECT_TRUE(has(codes(scene.bake({"--maps", "position", "--format", "exr", "--origin", "0,0,0"})),
                  "map-overflow"));
  EXPECT_FALSE(
      has(codes(scene.bake({"--maps", "position", "--format", "exr32", "--origin", "0,0,0"})),
          "map-steps"));
  EXPECT_TRUE(has(codes(scene.bake({"--maps", "position", "--format", "exr32", "--origin", "0,0,0",
                                    "--size", "64"})),
                  "map-steps"));
  // Two maps of parts agree where they are given one origin.
  const Baked given =
      scene.bake({"--maps", "position", "--format", "exr32", "--origin", "500010,4500010,300"});
  EXPECT_EQ(given.report["origin"], (json{500010.0, 4500010.0, 300.0}));
  EXPECT_NEAR(position(given, "low_position.exr", 3, 4)[0], at[0] + 19.2 * 3.5 / 16, 1e-5);
  test::expect_failure({"bake", scene.folder / "high.obj", scene.folder / "low.obj", "--maps",
                        "position", "--origin", "1,2", "--out", scene.folder / "no"},
                       static_cast<int>(ErrorCode::usage), {"--origin", "X,Y,Z"});
}

/// Of a range of 19.2: 16 bits have steps of 0.0003, eight bits of 0.0784 (of 20), which is more than texels of 0.0375 (512 of
/// them) can bear, but not more than texels of 0.1 (192).
TEST(FarCommand, StepsOfPositionsAreComparedWithTexels) {
  KILN_REQUIRE_DEVICE();
  const Sheets scene({0, 0, 0}, 0.8, "");
  const auto bake = [&](const char* format, const char* size) {
    return scene.bake({"--maps", "position", "--format", format, "--size", size});
  };
  EXPECT_FALSE(has(codes(bake("png16", "512")), "map-steps"));
  EXPECT_FALSE(has(codes(bake("png8", "192")), "map-steps"));
  const Baked coarse = bake("png8", "512");
  EXPECT_TRUE(has(codes(coarse), "map-steps"));
  EXPECT_NE(coarse.result.errors.find("steps of 0.0784, but its texels are 0.0375 apart"),
            std::string::npos)
      << coarse.result.errors;
}

TEST(FarCommand, HalfPrecisionOfHeights) {
  KILN_REQUIRE_DEVICE();
  // Waves of 0.8 of a side, beyond 65504 or below 2^-14.
  for (const auto& [side, code] :
       {std::pair(2e5, "map-overflow"), std::pair(5e-5, "map-steps"), std::pair(1.0, "")}) {
    const Sheets scene({0, 0, 0}, side, "");
    const auto found = [&](const char* format) {
      return codes(scene.bake(
          {"--maps", "height,distance,displacement", "--format", format, "--max-distance", "50%"}));
    };
    EXPECT_EQ(found("exr"), Words(*code != 0 ? 3 : 0, code)) << side;  // one a map
    EXPECT_FALSE(has(found("exr32"), code)) << side;
  }
}

}  // namespace
}  // namespace kiln

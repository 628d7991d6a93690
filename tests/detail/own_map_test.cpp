// Maps of the caller's own: the examples, and what can be wrong with one.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include "image/gutter.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

OwnMap example(const std::string& name) {
  const std::filesystem::path path = test::test_data("").parent_path().parent_path().parent_path() /
                                     "tools" / "examples" / "maps" / (name + ".cl");
  EXPECT_TRUE(std::filesystem::exists(path)) << path;
  OwnMap map;
  map.name = name;
  map.file = path.string();
  map.source = test::read_file(path);
  return map;
}

BakeResult bake_own(const Mesh& high, const Mesh& low, OwnMap map,
                    std::vector<MapKind> others = {MapKind::mask}) {
  BakeOptions options;
  options.width = options.height = 48;
  options.encoding.gutter = 0;
  options.maps = std::move(others);
  options.match.max_distance = Length::absolute(0.25);
  options.own_maps = {std::move(map)};
  return bake(Source(*test::device(), high), low, options);
}

TEST(OwnMaps, ContoursFollowThePosition) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::BumpySphere::dense(20000, true);
  high.origin = {3, 0.25, -7};
  Mesh low = test::BumpySphere::light(24, 12);
  low.origin = high.origin;
  const BakeResult baked = bake_own(high, low, example("contours"), {MapKind{"position"}});
  const Image &position = baked.maps[0].image, &contours = baked.maps[1].image;
  EXPECT_EQ(baked.maps[1].kind.name, "contours");
  int dark = 0, checked = 0;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    if (baked.coverage[i] != kCoverageBaked) continue;
    const double y = position.pixels[3 * i + 1], lines = y * 10;
    const double away = std::abs(lines - std::rint(lines));
    if (std::abs(away - 0.1) < 1e-4) continue;  // either, by rounding
    const double high_share = std::clamp(y * 0.5 + 0.5, 0.0, 1.0);
    EXPECT_NEAR(contours.pixels[3 * i], away < 0.1 ? 0 : high_share, 1e-5);
    EXPECT_EQ(contours.pixels[3 * i + 1], away < 0.1 ? 0 : 0.5F);
    dark += away < 0.1 ? 1 : 0;
    ++checked;
  }
  EXPECT_GT(checked, 1500);
  EXPECT_GT(dark, 100);
}

TEST(OwnMaps, TheCheckerIsThatOfTheHighPolysUvs) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(5, 3);
  for (Vec2& uv : high.uvs) uv = {uv.y * 2, uv.x};
  const BakeResult baked = bake_own(high, test::plane(1, 1), example("checker"), {MapKind{"uv"}});
  const Image &uv = baked.maps[0].image, &checker = baked.maps[1].image;
  for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
    const double u = uv.pixels[3 * i] * 8, v = uv.pixels[3 * i + 1] * 8;
    if (std::abs(u - std::rint(u)) < 1e-3 || std::abs(v - std::rint(v)) < 1e-3) continue;
    const bool even = std::fmod(std::floor(u) + std::floor(v), 2) == 0;
    EXPECT_NEAR(checker.pixels[3 * i], even ? 0.2 : 0.8, 1e-6) << i;
  }
}

TEST(OwnMaps, ClearanceIsTheWayToTheLid) {
  KILN_REQUIRE_DEVICE();
  // A lid over the left half, 0.4 above the floor, far from the world's origin.
  Mesh high = test::plane(4, 4);
  const std::size_t first = high.positions.size();
  for (const Vec3& p : {Vec3{-0.5F, -0.5F, 0.4F}, Vec3{0, -0.5F, 0.4F}, Vec3{0, 0.5F, 0.4F},
                        Vec3{-0.5F, 0.5F, 0.4F}}) {
    high.positions.push_back(p);
  }
  const auto corner = static_cast<std::uint32_t>(first);
  high.triangles.push_back({corner, corner + 1, corner + 2});
  high.triangles.push_back({corner, corner + 2, corner + 3});
  high.uv_triangles.resize(high.triangles.size());
  high.normal_triangles.resize(high.triangles.size());
  high.origin = {1000, 2000, -3000};
  Mesh low = test::plane(1, 1);
  low.origin = high.origin;
  const BakeResult baked = bake_own(high, low, example("clearance"));
  const Image& map = baked.maps[1].image;
  for (std::uint32_t x = 0; x < 48; ++x) {
    // Floats around 3,000 hold 1/4096.
    EXPECT_NEAR(map.at(x, 20)[0], x < 24 ? 0.4 : 1, 2e-3) << x;
  }
}

TEST(OwnMaps, MixedWithOthersTheyAreAveragedAndFilled) {
  KILN_REQUIRE_DEVICE();
  OwnMap map;
  map.name = "mine";
  map.channels = 4;
  map.source =
      "float4 kiln_map(const kiln_point* p) {\n"
      "  return (float4)(p->position.x > 0.0f ? 1.0f : 0.0f, p->distance, 0.5f, 2.0f);\n}\n";
  BakeOptions options;
  options.width = 3;
  options.height = 2;
  options.samples = 4;
  options.encoding.gutter = 0;
  options.own_maps = {map};
  options.match.max_distance = Length::absolute(0.25);
  Mesh high = test::plane(1, 1);
  for (Vec3& p : high.positions) p.z = 0.125F;
  const BakeResult baked = bake(Source(*test::device(), high), test::plane(1, 1), options);
  const float* middle = baked.maps[1].image.at(1, 0);
  EXPECT_FLOAT_EQ(middle[0], 0.5F);
  EXPECT_NEAR(middle[1], 0.125, 1e-6);
  EXPECT_EQ(middle[3], 2);
  // If nothing is found, neighbours fill.
  const BakeResult part = bake_own(test::plane(1, 1, 0.5, 1), test::plane(1, 1), map);
  EXPECT_EQ(part.maps[1].image.at(0, 5)[3], 2);
}

TEST(OwnMaps, SayWhatIsWrongWithTheirSource) {
  KILN_REQUIRE_DEVICE();
  OwnMap map;
  map.name = "broken";
  map.file = "my/broken.cl";
  map.source = "// fine\nfloat4 kiln_map(const kiln_point* p) {\n  return p->nonsense;\n}\n";
  try {
    bake_own(test::plane(1, 1), test::plane(1, 1), map);
    ADD_FAILURE() << "it was built";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    const std::string text = error.what();
    EXPECT_NE(text.find("my/broken.cl"), std::string::npos) << text;
    EXPECT_NE(text.find("broken.cl:3"), std::string::npos) << text;
  }
  const auto refused = [&](const std::string& source, const std::string& says) {
    map.source = source;
    try {
      bake_own(test::plane(1, 1), test::plane(1, 1), map);
      ADD_FAILURE() << "taken: " << source;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      const std::string text = error.what();
      EXPECT_NE(text.find("my/broken.cl"), std::string::npos) << text;
      EXPECT_NE(text.find(says), std::string::npos) << text;
    }
  };
  refused("float4 some_other(const kiln_point* p) { return (float4)(0.0f); }\n",
          "no function kiln_map()");
  const std::string sound = "float4 kiln_map(const kiln_point* p) { return (float4)(0.0f); }\n";
  refused("\n # include <stdio.h>\n" + sound, "in line 2");
  for (const char* spelling : {"/* \n */ #include", "# /**/ include", "%:include", "#\\\ninclude",
                               "#\\ \r\ninc\\\nlude", "?\?=include", "#import", "#include_next"}) {
    refused(std::string("\"/*\";\n'\"';\n") + spelling + " \"a.h\"\n" + sound,
            "includes another file");
  }
  for (const char* word : {"asm", "__asm", "__asm__"}) {
    refused("\n" + sound + "void f(void) { " + word + "(\"nop\"); }\n", "assembly in line 3");
  }
  map.source = "// asm\n" + sound + "int asm_of(int plasma) { return plasma; } // \"asm\"\n";
  EXPECT_NO_THROW(bake_own(test::plane(1, 1), test::plane(1, 1), map));
  refused("/* kiln_map", "has no function kiln_map()");
  refused("// float4 kiln_map(\nfloat4 other(void) { return 1; }\n", "has no function kiln_map()");
  // Standard output is the command's.
  refused("float4 kiln_map(const kiln_point* p) {\n  printf(\"x\");\n  return (float4)(0.0f);\n}\n",
          "must_not_print");
  map.source = "float4 kiln_map(const kiln_point* p) { return (float4)(NAN); }\n";
  const BakeResult nothing = bake_own(test::plane(1, 1), test::plane(1, 1), map);
  EXPECT_EQ(nothing.maps[1].image.pixels[0], 0);
  ASSERT_EQ(nothing.report.warnings.size(), 1U);
  EXPECT_EQ(nothing.report.warnings[0].code, "own-map-non-finite");
  map.channels = 2;
  EXPECT_THROW(bake_own(test::plane(1, 1), test::plane(1, 1), map), Error);
  map.channels = 3;
  map.name = "ao";
  EXPECT_THROW(bake_own(test::plane(1, 1), test::plane(1, 1), map), Error);
}

/// Where two matches blend, an own map is mixed by the same shares as the maps that come with Kiln: here it is one of them.
TEST(OwnMaps, BlendWhereMatchesDo) {
  KILN_REQUIRE_DEVICE();
  OwnMap map;
  map.name = "place";
  map.channels = 4;
  map.source =
      "float4 kiln_map(const kiln_point* p) {\n"
      "  return (float4)(p->position.x, p->position.y, p->position.z, p->position.y * 3.0f);\n}\n";
  // A sheet over the left third, leaning along x and y; beside it the nearest points are found.
  Mesh high = test::plane(4, 3);
  for (Vec3& p : high.positions) {
    p = {(p.x - 1) / 3, p.y, 0.125F + 0.1F * p.x + 0.05F * p.y};
  }
  high.normals.clear();
  high.normal_triangles.clear();
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = 40;
  options.height = 24;
  options.encoding.gutter = 0;
  options.maps = {MapKind{"position"}, MapKind::mask};
  options.match.max_distance = Length::absolute(0.5);
  options.match.fallback = {MatchMethod::closest};
  options.own_maps = {map};
  std::size_t differ = 0;
  std::vector<float> plain;
  for (const double blend : {0.0, 6.0}) {
    options.match.fallback_blend = static_cast<decltype(options.match.fallback_blend)>(blend);
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    const Image &position = baked.maps[0].image, &mask = baked.maps[1].image,
                &own = baked.maps[2].image;
    std::size_t checked = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      EXPECT_EQ(mask.pixels[i] > 0, baked.coverage[i] == kCoverageBaked) << i;
      if (baked.coverage[i] != kCoverageBaked) continue;
      ++checked;
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(own.pixels[4 * i + c], position.pixels[3 * i + c], 1e-5) << blend << " " << i;
      }
      EXPECT_NEAR(own.pixels[4 * i + 3], 3 * position.pixels[3 * i + 1], 3e-5);
      if (blend > 0) differ += std::abs(own.pixels[4 * i] - plain[4 * i]) > 1e-3 ? 1 : 0;
    }
    EXPECT_GT(checked, 400U);
    plain = own.pixels;
  }
  EXPECT_GT(differ, 20U);
}

}  // namespace
}  // namespace kiln

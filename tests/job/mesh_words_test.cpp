// Words of a job about meshes: options of their frame and shading, and what the summary and warnings say.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "job/describe.h"
#include "job/high_poly_input.h"
#include "job/map_file.h"
#include "job/mesh_files.h"
#include "kiln/image.h"
#include "kiln/option_error.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

std::string refusal(const std::function<void()>& parse, ErrorCode code = ErrorCode::usage) {
  try {
    parse();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    return error.message().text();
  }
  return {};
}

TEST(MeshWords, FramesAreOfOneSideOrBoth) {
  MeshFrameArguments frame;
  frame.up = {"Y", "low=-x"};
  frame.unit = {"high=CM", "0.5"};
  frame.uv_set = {"2", "low=second set"};
  const LoadMeshOptions high = load_options(frame, MeshSide::high),
                        low = load_options(frame, MeshSide::low),
                        other = load_options(frame, MeshSide::other);
  EXPECT_EQ(high.up, UpAxis::y);
  EXPECT_FALSE(high.override_up);
  EXPECT_EQ(low.up, UpAxis::minus_x);
  EXPECT_TRUE(low.override_up);
  EXPECT_EQ(other.up, UpAxis::y);
  EXPECT_EQ(high.metres, 0.01);
  EXPECT_TRUE(high.override_unit);
  EXPECT_EQ(low.metres, 0.5);
  EXPECT_FALSE(low.override_unit);
  EXPECT_EQ(high.uv_set, 2U);
  EXPECT_EQ(high.uv_set_name, "");
  EXPECT_EQ(low.uv_set, 0U);
  EXPECT_EQ(low.uv_set_name, "second set");
  EXPECT_EQ(other.uv_set, 0U);
}

TEST(MeshWords, FramesAreRefusedWithTheirWord) {
  const auto said = [](auto change) {
    return refusal([&] {
      MeshFrameArguments frame;
      change(frame);
      load_options(frame, MeshSide::low);
    });
  };
  for (const char* text : {"", "0", "-1", "1e-10", "2e9", "inf", "nan", "1 m", "1m", "mile"}) {
    EXPECT_EQ(said([&](MeshFrameArguments& f) { f.unit = {text}; }),
              "`unit` '" + std::string(text) +
                  "': write mm, cm, m, in, ft, or a number of metres from 1e-9 to 1e9, such as "
                  "0.01.");
  }
  for (const char* text : {"", "w", "--x", "xy"}) {
    EXPECT_EQ(said([&](MeshFrameArguments& f) { f.up = {text}; }),
              "`up` '" + std::string(text) + "': write x, y, z, -x, -y or -z.");
  }
  EXPECT_EQ(said([](MeshFrameArguments& f) { f.uv_set = {""}; }),
            "`uv_set`: write a number from 0 on, or the set's name.");
  for (const std::vector<std::string>& texts :
       {std::vector<std::string>{"x", "y"}, std::vector<std::string>{"low=x", "z", "low=y"}}) {
    EXPECT_EQ(said([&](MeshFrameArguments& f) { f.up = texts; }),
              "`up` '" + texts.back() + "' is given twice: leave one out.");
  }
  for (const auto& [unit, metres] : {std::pair{"1e-9", 1e-9}, std::pair{"1e9", 1e9},
                                     std::pair{"ft", 0.3048}, std::pair{"in", 0.0254}}) {
    MeshFrameArguments frame;
    frame.unit = {unit};
    EXPECT_EQ(load_options(frame, MeshSide::low).metres, metres);
  }
}

TEST(MeshWords, ShadingIsARuleOrAnAngle) {
  EXPECT_EQ(parse_shading("smooth").rule, ShadingRule::smooth);
  EXPECT_EQ(parse_shading("flat").rule, ShadingRule::flat);
  EXPECT_EQ(parse_shading("file").rule, ShadingRule::file);
  EXPECT_EQ(parse_shading("auto").rule, ShadingRule::automatic);
  EXPECT_EQ(parse_shading("180").rule, ShadingRule::angle);
  EXPECT_EQ(parse_shading("+32.5").angle_degrees, 32.5);
  for (const char* text : {"smooth", "flat", "file", "auto", "32.5"})
    EXPECT_EQ(shading_rule_name(parse_shading(text)), text);
  for (const char* text : {"", "0", "-1", "180.5", "nan", "inf", "30x", "Flat "}) {
    EXPECT_EQ(refusal([&] { parse_shading(text); }),
              "`high_normals` is '" + std::string(text) +
                  "': give auto, file, smooth, flat, or an angle above 0 and up to 180 degrees.");
  }
}

TEST(MeshWords, ShadingIsSaidWithItsNumbers) {
  const auto line = [](const ShadingReport& shading, const char* rule) {
    return shading_line(shading, parse_shading(rule)).text();
  };
  ShadingReport shading;
  EXPECT_EQ(line(shading, "auto"), "") << "what has all its normals is not worth a line";
  EXPECT_EQ(line(shading, "file"), "HIGH's normals: smooth (`high_normals` file)");
  shading.given = 7;
  EXPECT_EQ(line(shading, "file"), "HIGH's normals: the file's (`high_normals` file)");
  shading.chosen = ShadingRule::flat;
  EXPECT_EQ(line(shading, "flat"), "HIGH's normals: flat (`high_normals` flat)");
  shading.chosen = ShadingRule::smooth;
  EXPECT_EQ(line(shading, "smooth"), "HIGH's normals: smooth (`high_normals` smooth)");
  shading.missing = 1;
  EXPECT_EQ(line(shading, "auto"),
            "HIGH's normals: smooth; 1 triangle has none, and no edge bends by 20 degrees "
            "(`high_normals` auto)");
  shading.missing = 2000;
  shading.parts = 3;
  EXPECT_EQ(line(shading, "auto"),
            "HIGH's normals: smooth; 2,000 triangles have none, and its edges bend like those of "
            "a scan (`high_normals` auto)");
  shading.given = 0;
  EXPECT_EQ(line(shading, "auto"),
            "HIGH's normals: smooth; the file has none, and its edges bend like those of a scan "
            "(`high_normals` auto)");
  shading.chosen = ShadingRule::angle;
  shading.hard_edges = 1234;
  shading.hard_parts = 2;
  shading.least_degrees = 31.25;
  shading.most_degrees = 12;
  const std::string edges =
      "HIGH's normals: 1,234 hard edges in 2 of 3 parts, of 31.2 degrees or more; edges up to 12 "
      "degrees are smooth";
  EXPECT_EQ(line(shading, "31.25"), edges + " (`high_normals` 31.25)");
  shading.split_parts = 2;
  EXPECT_EQ(line(shading, "auto"),
            edges +
                "; 2 parts follow the split vertices of the file; the file has none "
                "(`high_normals` auto)");
  shading.split_parts = 1;
  EXPECT_EQ(line(shading, "30"),
            edges + "; 1 part follows the split vertices of the file (`high_normals` 30)");
}

TEST(MeshWords, SharesAndFlawsHaveTheirNumbers) {
  UvReport uv;
  EXPECT_EQ(describe(uv)["overlap_share"].dump(), "0.0");
  uv.covered = 8;
  uv.overlapping = 2;
  uv.overlap = {.lower = 3, .upper = 5, .column = 7, .row = 9};
  EXPECT_EQ(describe(uv)["overlap_share"].dump(), "0.25");
  EXPECT_EQ(describe(uv)["overlap"].dump(), R"({"triangles":[3,5],"column":7,"row":9})");
  SimplifyReport low;
  low.faces = 110;
  EXPECT_FALSE(misses_faces(low, 100));
  EXPECT_FALSE(misses_faces(low, 0));
  low.faces = 111;
  EXPECT_TRUE(misses_faces(low, 100));
  EXPECT_EQ(too_many_faces(low, 100).text(), "`faces` 100 was not reached: the low poly has 111.");
  std::vector<Warning> warnings;
  low.error = 0.05;
  warn_of_lost_shape(low, "Do this.", warnings);
  EXPECT_TRUE(warnings.empty());
  low.error = 0.0512;
  warn_of_lost_shape(low, "Do this.", warnings);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "low-strays");
  EXPECT_EQ(warnings[0].message.text(),
            "The low poly deviates by up to 5.1% of the diagonal from the high poly: thin or small "
            "parts are lost. Do this.");
  ExtractReport extract;
  EXPECT_TRUE(flaw_lines(extract).empty());
  extract.mended = 1;
  extract.left_out = 2000;
  EXPECT_EQ(flaw_lines(extract),
            (std::vector<std::string>{"repaired 1 triangle that folded over or had no area",
                                      "left out 2,000 triangles of closed gaps"}));
}

/// Parts that are inside out are counted among the closed ones, with a place of the first in the file's coordinates.
TEST(MeshWords, PartsInsideOutAreCounted) {
  const auto high = [](int inward, int outward) {
    std::vector<Mesh> parts;
    for (int i = 0; i < inward + outward; ++i) {
      Mesh part = test::icosphere(2);
      for (Vec3& p : part.positions) p.y += 4 * static_cast<float>(i);
      part.normals.clear();
      part.normal_triangles.clear();
      for (Triangle& t : part.triangles) {
        if (i < inward) std::swap(t[1], t[2]);
      }
      parts.push_back(std::move(part));
    }
    Mesh mesh = join_meshes(parts);
    mesh.name = "balls";
    mesh.origin = {1000, 0, 0};
    return mesh;
  };
  const Mesh low = test::icosphere(1);
  EXPECT_EQ(explain_inside_out(high(0, 2), low).text(), "");
  const std::string one = explain_inside_out(high(1, 0), low).text();
  EXPECT_TRUE(
      one.starts_with("HIGH 'balls': 1 of 1 part that has a closed surface is inside out, "
                      "for example at ("))
      << one;
  const std::string two = explain_inside_out(high(2, 1), low).text();
  EXPECT_TRUE(
      two.starts_with("HIGH 'balls': 2 of 3 parts that have a closed surface are inside "
                      "out, for example at ("))
      << two;
  const double x = std::stod(two.substr(two.find("at (") + 4));
  EXPECT_NEAR(x, 1000, 1.1);
  Mesh inside_out = low;
  for (Triangle& t : inside_out.triangles) std::swap(t[1], t[2]);
  inside_out.normals.clear();
  inside_out.normal_triangles.clear();
  EXPECT_EQ(explain_inside_out(high(1, 0), inside_out).text(), "");
}

/// Normals whose stored values are signed, and those of two components, become what is drawn.
TEST(MeshWords, NormalMapsOfEveryEncodingAreRead) {
  const std::filesystem::path path = test::scratch_folder() / "normal.exr";
  const auto read = [&](std::vector<float> pixels) {
    const auto width = static_cast<std::uint32_t>(pixels.size() / 3);
    save_image(Image{width, 1, 3, std::move(pixels)}, path, {.format = ImageFormat::exr_float});
    return load_normal_map(path).pixels;
  };
  const std::vector<float> plain = {0.25F, 0.5F, 0.75F, 0.5F, 0.125F, 1};
  EXPECT_EQ(read(plain), plain);
  const std::vector<float> signed_two = read({-0.5F, 0.5F, 0, 0, 1, 0});
  EXPECT_EQ(signed_two[0], 0.25F);
  EXPECT_EQ(signed_two[1], 0.75F);
  EXPECT_NEAR(signed_two[2], 0.5 + std::sqrt(0.5) / 2, 1e-6) << "z of x and y";
  EXPECT_NEAR(signed_two[5], 0.5, 1e-6);
  EXPECT_EQ(read({0.5F, -0.5F, 1, 0, 0, 1})[1], 0.25F);
  EXPECT_EQ(read({0.5F, 0, -0.5F, 0, 0, 1})[2], 0.25F);
  const std::vector<float> two = read({0.8F, 0.5F, 0, 0.5F, 0.5F, 0});
  EXPECT_NEAR(two[2], 0.9, 1e-5) << "x 0.6 and y 0 leave z 0.8";
  EXPECT_NEAR(two[5], 1, 1e-6);
}

/// Curvature is scaled by what 95% of its places do not exceed; colours are no curvature.
TEST(MeshWords, CurvatureIsGreyAndScaled) {
  const std::filesystem::path path = test::scratch_folder() / "curvature.exr";
  std::vector<float> values(40, 2);
  values[3] = -2;
  values[7] = 40;
  values[11] = std::nanf("");
  values[13] = 0;
  save_image(Image{8, 5, 1, values}, path, {.format = ImageFormat::exr_float});
  const Image read = load_curvature(path);
  EXPECT_EQ(read.channels, 1U);
  EXPECT_EQ(read.pixels[0], 1);
  EXPECT_EQ(read.pixels[3], 0);
  EXPECT_EQ(read.pixels[7], 1);
  EXPECT_EQ(read.pixels[11], 0.5F);
  EXPECT_EQ(read.pixels[13], 0.5F);
  for (const std::size_t channel : {0U, 1U, 2U}) {
    Image color{2, 1, 3, {0.5F, 0.5F, 0.5F, 0.25F, 0.25F, 0.25F}};
    color.pixels[3 + channel] = 0.75F;
    save_image(color, path, {.format = ImageFormat::exr_float});
    EXPECT_EQ(refusal([&] { load_curvature(path); }, ErrorCode::input),
              "'" + path.string() +
                  "' has colours, but a curvature map is grey: give the map of `maps` curvature.");
  }
}

}  // namespace
}  // namespace kiln

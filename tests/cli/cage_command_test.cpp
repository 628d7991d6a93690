// Cages at the command line: found, saved as meshes and images, corrected, drawn.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/call.h"
#include "kiln/bake.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::ProcessResult;
using test::read_json;

TEST(CageCommand, FindsSavesAndDrawsOne) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(2000), folder / "high.obj");
  save_obj(test::BumpySphere::light(), folder / "low.obj");
  const auto bake = [&](const std::string& out, std::vector<std::string> flags) {
    std::vector<std::string> line = {"bake",
                                     folder / "high.obj",
                                     folder / "low.obj",
                                     "--out",
                                     folder / out,
                                     "--size",
                                     "64",
                                     "--json",
                                     folder / (out + ".json")};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  };
  const ProcessResult found = bake("a", {"--cage", "auto", "--save-cage", folder / "cage.obj"});
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_NE(found.output.find("of the diagonal out"), std::string::npos) << found.output;
  const nlohmann::json report = read_json(folder / "a.json");
  EXPECT_EQ(report["cage"]["kind"], "shells");
  EXPECT_GT(report["cage"]["outward"]["least"], 0);
  EXPECT_GT(report["cage"]["inward"]["least"], 0);
  EXPECT_GT(report["cage"]["samples"], 0);
  EXPECT_EQ(report["options"]["cage"], "auto");
  const ProcessResult again = bake("b", {"--cage-mesh", folder / "cage.obj"});
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  const auto bytes = [&](const std::string& out) {
    return test::read_file(folder / out / "low_normal.png");
  };
  EXPECT_TRUE(!bytes("a").empty() && bytes("a") == bytes("b"));

  EXPECT_EQ(bake("c", {"--save-cage", folder / "c.obj"}).exit_code, 2);
  EXPECT_EQ(bake("c", {"--cage", "auto", "--save-cage", folder / "c.ply"}).exit_code, 2);
  EXPECT_EQ(bake("c", {"--cage", "auto", "--match", "closest"}).exit_code, 2);
  const ProcessResult directed =
      bake("c", {"--cage-mesh", folder / "low.obj", "--direction", "face"});
  EXPECT_EQ(directed.exit_code, 2);
  EXPECT_NE(directed.errors.find("--direction"), std::string::npos) << directed.errors;
  EXPECT_FALSE(fs::exists(folder / "c" / "low_normal.png"));
  save_obj(test::cube(0.1), folder / "small.obj");
  const ProcessResult small = bake("c", {"--cage-mesh", folder / "small.obj"});
  EXPECT_EQ(small.exit_code, 3);
  EXPECT_NE(small.errors.find("does not enclose"), std::string::npos) << small.errors;

  save_obj(test::cube(12), folder / "far.obj");
  const ProcessResult far = bake("f", {"--cage-mesh", folder / "far.obj"});
  EXPECT_EQ(far.exit_code, 0) << far.errors;
  EXPECT_NE(far.errors.find("The distance from the cage to the low poly is"), std::string::npos)
      << far.errors;

  const auto draw = [&](std::vector<std::string> flags) {
    std::vector<std::string> line = {
        "render", folder / "low.obj", "--out", folder / "p.png", "--size",
        "64",     "--ambient-rays",   "0",     "--quiet"};
    line.insert(line.end(), flags.begin(), flags.end());
    const ProcessResult result = call_kiln(line);
    return std::pair(result.exit_code, result.errors);
  };
  const std::string high = folder / "high.obj";
  EXPECT_EQ(draw({"--draw-cage", "--cage", "auto", "--reference", high}).first, 0);
  for (const char* cage : {"auto", "3%"}) {
    EXPECT_EQ(draw({"--draw-cage", "--cage", cage}).first, 2) << cage;
  }
  EXPECT_EQ(draw({"--draw-cage", "--cage-mesh", folder / "cage.obj"}).first, 0);
  EXPECT_EQ(draw({"--draw-cage", "--cage", "0.1", "--normals"}).first, 2);
  // Of two shells the outer one is drawn. Edges are the same lines from either end: the shell by itself, whose vertices
  // are numbered the other way round, is the same picture, but for rounding.
  Mesh outer = load_mesh(folder / "cage.obj");
  const auto group = std::find(outer.group_names.begin(), outer.group_names.end(), "outer");
  ASSERT_NE(group, outer.group_names.end());
  const auto number = static_cast<std::uint32_t>(group - outer.group_names.begin());
  std::vector<Triangle> triangles;
  const auto last = static_cast<std::uint32_t>(outer.positions.size() - 1);
  for (std::size_t t = 0; t < outer.triangles.size(); ++t) {
    const Triangle& corners = outer.triangles[t];
    if (outer.groups[t] != number) continue;
    triangles.push_back({last - corners[0], last - corners[1], last - corners[2]});
  }
  EXPECT_EQ(2 * triangles.size(), outer.triangles.size());
  Mesh shell;
  shell.positions.assign(outer.positions.rbegin(), outer.positions.rend());
  shell.triangles = std::move(triangles);
  save_obj(shell, folder / "shell.obj");
  const auto picture = [&](std::vector<std::string> flags) {
    flags.insert(flags.end(), {"--square", "--samples", "1"});
    EXPECT_EQ(draw(std::move(flags)).first, 0);
    return load_image(folder / "p.png");
  };
  const Image both = picture({"--draw-cage", "--cage-mesh", folder / "cage.obj"});
  const Image alone = picture({"--draw-cage", "--cage-mesh", folder / "shell.obj"});
  const Image without = picture({});
  const auto differing = [](const Image& a, const Image& b) {
    std::size_t count = 0;
    for (std::uint32_t y = 0; y < a.height; ++y) {
      for (std::uint32_t x = 0; x < a.width; ++x)
        count += std::equal(a.at(x, y), a.at(x, y) + a.channels, b.at(x, y)) ? 0 : 1;
    }
    return count;
  };
  ASSERT_EQ(both.pixels.size(), alone.pixels.size());
  ASSERT_EQ(both.pixels.size(), without.pixels.size());
  EXPECT_LT(differing(both, alone), 40U);
  shell.triangles.resize(1);
  save_obj(shell, folder / "one.obj");
  EXPECT_GT(differing(alone, picture({"--draw-cage", "--cage-mesh", folder / "one.obj"})), 500U);
  EXPECT_GT(differing(both, without), 1000U);
  // Without the flag a cage is for a map, which needs HIGH; with it, what has no say in a cage is refused.
  EXPECT_NE(draw({"--cage", "0.1"}).second.find("--draw-cage"), std::string::npos);
  EXPECT_EQ(draw({"--draw-cage"}).first, 2);
  EXPECT_EQ(draw({"--draw-cage", "--cage", "0.1", "--direction", "face"}).first, 2);
  EXPECT_EQ(draw({"--draw-cage", "--cage", "4%", "--reference", high, "--map-size", "32"}).first,
            0);
  EXPECT_EQ(draw({"--draw-cage", "--cage", "0.2"}).first, 0);
  const Image caged = load_image(folder / "p.png");
  // The tint lies over the sphere's middle, and over what lies between it and the cage.
  const float* middle = caged.at(caged.width / 2, caged.height / 2);
  EXPECT_GT(middle[0] - middle[2], 0.1F);
}

/// Distances and directions as an image: the same cage, of which one vertex can be corrected.
TEST(CageCommand, SaysWhereACopyServesAsAHull) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  const Mesh low = test::BumpySphere::light();
  save_obj(test::BumpySphere::dense(2000), folder / "high.obj");
  save_obj(low, folder / "low.obj");
  Mesh cage;
  cage.positions = low.positions;
  for (Vec3& p : cage.positions) p = {1.2F * p.x, 1.2F * p.y, 1.2F * p.z};
  cage.triangles.assign(low.triangles.rbegin(), low.triangles.rend());
  save_obj(cage, folder / "cage.obj");
  const ProcessResult result = call_kiln(
      {"bake", folder / "high.obj", folder / "low.obj", "--cage-mesh", folder / "cage.obj", "--out",
       folder / "out", "--size", "64", "--json", folder / "r.json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(
      result.errors.find("is used as a closed hull, not as a copy of the low poly: the faces of"),
      std::string::npos)
      << result.errors;
  const nlohmann::json report = read_json(folder / "r.json");
  EXPECT_EQ(report["cage"]["kind"], "hull");
  EXPECT_EQ(report["texels"]["missed"], 0);
}

TEST(CageCommand, OneIsAnImageToo) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(1.06), folder / "high.obj");
  save_obj(test::cube(1), folder / "low.obj");
  const auto bake = [&](const std::string& out, std::vector<std::string> flags) {
    std::vector<std::string> line = {"bake",
                                     folder / "high.obj",
                                     folder / "low.obj",
                                     "--out",
                                     folder / out,
                                     "--size",
                                     "64",
                                     "--maps",
                                     "height",
                                     "--format",
                                     "exr32",
                                     "--json",
                                     folder / "j.json"};
    line.insert(line.end(), flags.begin(), flags.end());
    return call_kiln(line);
  };
  const fs::path image = folder / "cage.exr";
  ASSERT_EQ(bake("a", {"--cage", "auto", "--save-cage", image}).exit_code, 0);
  ASSERT_EQ(bake("o", {"--cage", "auto", "--save-cage", folder / "cage.obj"}).exit_code, 0);
  Image cage = load_image(image);
  const std::size_t count = load_mesh(folder / "low.obj").positions.size();
  ASSERT_EQ(cage.width, count);
  ASSERT_EQ(cage.height, 2U);
  const Mesh shells = load_mesh(folder / "cage.obj"), low = load_mesh(folder / "low.obj");
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t shell = 0; shell < 2; ++shell) {
      const float* p = cage.at(v, shell);
      const double by = shell == 0 ? double{p[3]} : -double{p[3]};
      const Vec3 &at = low.positions[v], &there = shells.positions[shell * count + v];
      EXPECT_NEAR(at.x + p[0] * by, there.x, 1e-7) << v;
      EXPECT_NEAR(at.y + p[1] * by, there.y, 1e-7) << v;
      EXPECT_NEAR(at.z + p[2] * by, there.z, 1e-7) << v;
      EXPECT_GT(p[3], 0.0F);
    }
  }
  const auto heights = [&](const std::string& out) {
    return load_image(folder / out / "low_height.exr").pixels;
  };
  const ProcessResult again = bake("b", {"--cage-mesh", image});
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(read_json(folder / "j.json")["cage"]["kind"], "shells");
  const auto a = heights("a"), b = heights("b");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-6F) << i;
  // One vertex pulled in below HIGH's face: rays there start inside of it and miss it.
  cage.pixels[3] = 0.001F;
  save_image(cage, image, {ImageFormat::exr_float});
  ASSERT_EQ(bake("c", {"--cage-mesh", image}).exit_code, 0);
  EXPECT_GT(read_json(folder / "j.json")["texels"]["missed"].get<int>(), 20);

  // The mark of pixels that stand for no vertex, at the first vertex, at one between and at the last.
  for (const std::size_t shell : {std::size_t{0}, std::size_t{1}}) {
    for (const std::size_t v : {std::size_t{0}, std::size_t{3}, count - 1}) {
      Image forged = cage;
      forged.at(v, shell)[3] = -1;
      save_image(forged, image, {ImageFormat::exr_float});
      const ProcessResult result = bake("d", {"--cage-mesh", image});
      EXPECT_EQ(result.exit_code, 3);
      const std::string named = std::string(shell == 0 ? "outer" : "inner") + " pixel of vertex " +
                                std::to_string(v) + " has alpha -1";
      EXPECT_NE(result.errors.find(named), std::string::npos) << result.errors;
    }
  }

  cage.pixels[0] = std::nanf("");
  save_image(cage, image, {ImageFormat::exr_float});
  const ProcessResult bad = bake("d", {"--cage-mesh", image});
  EXPECT_EQ(bad.exit_code, 3);
  EXPECT_NE(bad.errors.find("vertex 0 is NaN"), std::string::npos) << bad.errors;
  cage.width /= 2;
  cage.height *= 2;
  save_image(cage, image, {ImageFormat::exr_float});
  const ProcessResult other = bake("d", {"--cage-mesh", image});
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_NE(other.errors.find("8 vertices need 8 x 2"), std::string::npos) << other.errors;
}

TEST(CageCommand, ADrawnOneObeysFlagsOfTheMatch) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(1.06), folder / "high.obj");  // 1.6% of the diagonal away
  save_obj(test::cube(1), folder / "low.obj");
  std::vector<std::vector<float>> pictures;
  for (const char* far : {"1%", "10%"}) {
    const ProcessResult result =
        call_kiln({"render", folder / "low.obj", "--reference", folder / "high.obj", "--draw-cage",
                   "--cage", "auto", "--max-distance", far, "--size", "64", "--ambient-rays", "0",
                   "--quiet", "--out", folder / "p.png"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    pictures.push_back(load_image(folder / "p.png").pixels);
  }
  EXPECT_TRUE(pictures[0] != pictures[1]);
}

/// A picture by `kiln render` of a file in a folder, without shadows.
Image render(const fs::path& folder, const std::string& mesh, std::vector<std::string> flags) {
  std::vector<std::string> line = {"render",    folder / mesh,
                                   "--out",     folder / "picture.png",
                                   "--quiet",   "--ambient-rays",
                                   "0",         "--square",
                                   "--size",    "128",
                                   "--samples", "1"};
  line.insert(line.end(), flags.begin(), flags.end());
  const ProcessResult result = call_kiln(line);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  return load_image(folder / "picture.png");
}

std::size_t differing_pixels(const Image& a, const Image& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.pixels.size() && i < b.pixels.size(); i += 3)
    count += std::equal(&a.pixels[i], &a.pixels[i] + 3, &b.pixels[i]) ? 0 : 1;
  return count;
}

/// A box seen from the front is 30% of its colour over what lies behind it, within four edges without a gap.
TEST(DrawnCage, IsTintedWithinItsEdges) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(0.4), folder / "low.obj");
  save_obj(test::cube(1), folder / "box.obj");
  const Image picture = render(folder, "low.obj",
                               {"--draw-cage", "--cage-mesh", folder / "box.obj", "--view", "0,0"});
  // The same background, with all meshes in a few pixels of its middle
  const Image background = render(folder, "low.obj", {"--view", "0,0", "--zoom", "0.01"});
  const auto is_edge = [&](std::size_t x, std::size_t y) { return picture.at(x, y)[2] < 0.4F; };
  std::size_t first = picture.width, last = 0;
  for (std::size_t i = 0; i < picture.width; ++i) {
    if (!is_edge(i, picture.height / 2)) continue;
    first = std::min(first, i);
    last = i;
  }
  // The box fills most of the picture, in its middle.
  ASSERT_GT(last, first + picture.width / 2);
  EXPECT_NEAR(static_cast<double>(first + last), picture.width - 1, 1.5);
  for (std::size_t i = first; i <= last; ++i) {
    for (const std::size_t side : {first, last}) {
      const std::size_t inner = side == first ? side + 1 : side - 1;
      EXPECT_TRUE(is_edge(side, i) || is_edge(inner, i)) << side << ", " << i;
      EXPECT_TRUE(is_edge(i, side) || is_edge(i, inner)) << i << ", " << side;
    }
  }
  // Beside the low poly and off the edges of both triangulations of a face
  const std::size_t x = (first + last) / 2, y = first + (last - first) / 8;
  const std::array<float, 3> tint = {0.98F, 0.62F, 0.16F};
  for (std::size_t c = 0; c < 3; ++c) {
    const float behind = background.at(x, y)[c];
    EXPECT_NEAR(picture.at(x, y)[c], behind + 0.3F * (tint[c] - behind), 1.5 / 255);
    EXPECT_EQ(picture.at(x, first - 3)[c], background.at(x, first - 3)[c]);
  }
}

/// Edges that the box hides are not drawn: it looks as do the three faces that are seen.
TEST(DrawnCage, HidesItsOwnEdges) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(0.4), folder / "low.obj");
  Mesh box = test::cube(1);
  save_obj(box, folder / "box.obj");
  std::erase_if(box.triangles, [&](const Triangle& t) {
    const auto lies_at_one = [&](auto member) {
      return std::all_of(t.begin(), t.end(),
                         [&](std::uint32_t v) { return box.positions[v].*member > 0; });
    };
    return !lies_at_one(&Vec3::x) && !lies_at_one(&Vec3::y) && !lies_at_one(&Vec3::z);
  });
  ASSERT_EQ(box.triangles.size(), 6U);
  box.uvs.clear();
  box.uv_triangles.clear();
  box.normals.clear();
  box.normal_triangles.clear();
  save_obj(box, folder / "seen.obj");
  const auto draw = [&](const std::string& cage) {
    return render(folder, "low.obj",
                  {"--draw-cage", "--cage-mesh", folder / cage, "--view", "35,25"});
  };
  const Image whole = draw("box.obj"), seen = draw("seen.obj");
  // Each of the three hidden edges would add some 50.
  EXPECT_LT(differing_pixels(whole, seen), 80U);
}

/// A cage within the low poly leaves the low poly's colour, but for the lines of its edges.
TEST(DrawnCage, DoesNotTintWhatIsInFrontOfIt) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(1), folder / "low.obj");
  save_obj(test::cube(0.5), folder / "inner.obj");
  const Image plain = render(folder, "low.obj", {"--view", "0,0"});
  const Image caged = render(folder, "low.obj",
                             {"--draw-cage", "--cage-mesh", folder / "inner.obj", "--view", "0,0"});
  // Each face has one colour.
  const std::size_t middle = plain.width / 2, off = plain.width / 4;
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(caged.at(middle, off)[c], plain.at(middle, off)[c], 1.5 / 255);
}

/// Far from the origin, where files state positions from a point of their own, the picture stays the same.
TEST(DrawnCage, LiesOverTheLowPolyFarFromTheOrigin) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  std::vector<Image> pictures;
  for (const float far : {0.0F, 4096.0F}) {
    for (const auto& [side, name] : {std::pair(0.4, "low.obj"), std::pair(1.0, "box.obj")}) {
      Mesh cube = test::cube(side);
      for (Vec3& p : cube.positions) p = {p.x + far, p.y - far, p.z + 2 * far};
      save_obj(cube, folder / name);
    }
    pictures.push_back(render(
        folder, "low.obj", {"--draw-cage", "--cage-mesh", folder / "box.obj", "--view", "35,25"}));
  }
  EXPECT_LT(differing_pixels(pictures[0], pictures[1]), 30U);
}

/// A length in percent is a share of HIGH's diagonal.
TEST(DrawnCage, LengthInPercentIsOfTheDiagonal) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(0.9), folder / "low.obj");
  save_obj(test::cube(1), folder / "high.obj");  // a diagonal of sqrt(3)
  std::vector<Image> pictures;
  for (const char* length : {"10%", "0.17320508"}) {
    pictures.push_back(render(
        folder, "low.obj",
        {"--draw-cage", "--cage", length, "--reference", folder / "high.obj", "--view", "35,25"}));
  }
  EXPECT_LT(differing_pixels(pictures[0], pictures[1]), 10U);
}

/// Pictures side by side: equal meshes give equal panels, with a white gap of 1/256 of a panel's width between them.
TEST(RenderCommand, PanelsStandSideBySide) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = test::scratch_folder();
  save_obj(test::cube(1), folder / "mesh.obj");
  const ProcessResult result = call_kiln(
      {"render", folder / "mesh.obj", "--reference", folder / "mesh.obj", "--out", folder / "p.png",
       "--quiet", "--ambient-rays", "0", "--square", "--size", "512", "--samples", "1"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Image picture = load_image(folder / "p.png");
  ASSERT_EQ(picture.width, 512U + 2 + 512);
  ASSERT_EQ(picture.height, 512U);
  for (std::uint32_t y = 0; y < 512; ++y) {
    ASSERT_TRUE(std::equal(picture.at(0, y), picture.at(512, y), picture.at(514, y))) << y;
    for (std::size_t i = 0; i < 6; ++i) ASSERT_EQ(picture.at(512, y)[i], 1.0F) << y;
  }
}

}  // namespace
}  // namespace kiln

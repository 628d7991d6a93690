// One scene as Blender exports it in four formats gives one map.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "support/pictures.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_exit;

struct Apart {
  double most = 0;        // in 1/255
  std::size_t over = 0;   // numbers that differ by more than 1/255
  std::size_t count = 0;  // of all
};

Apart compare(const fs::path& a, const fs::path& b) {
  const Image one = test::read_picture(a), other = test::read_picture(b);
  Apart apart;
  if (one.pixels.size() != other.pixels.size()) throw std::runtime_error("maps of two sizes");
  for (std::size_t i = 0; i < one.pixels.size(); ++i) {
    const double by = 255 * std::abs(double{one.pixels[i]} - other.pixels[i]);
    apart.most = std::max(apart.most, by);
    apart.over += by > 1 ? 1 : 0;
    ++apart.count;
  }
  return apart;
}

/// Differences between the files: OBJ writes normals in four digits, FBX is in centimetres, and its transforms are three
/// angles; Draco rounds to 18, 14 and 16 bits of places, normals and UVs. All are far below 1/255; but a ray within that of an edge of HIGH may meet the triangle beside it, whose
/// colours go on where its UVs do, and not at their seam.
TEST(Twins, OneSceneInFourFormatsGivesOneMap) {
  KILN_REQUIRE_DEVICE();
  const fs::path twins = test::test_data("twins"), out = test::scratch_folder();
  struct Twin {
    const char *high, *low;
    std::vector<std::string> flags;
    std::string needs = {};  // a format that is optional
  };
  const Twin kTwins[] = {
      {"high.glb", "low.glb", {}},        {"high.gltf", "low.glb", {}},
      {"high.obj", "low.glb", {}},        {"high_z.obj", "low.glb", {"--up", "z", "--unit", "cm"}},
      {"high.glb", "low.obj", {}},        {"high_draco.glb", "low.glb", {}, "Draco in glTF"},
      {"high.fbx", "low.glb", {}, "FBX"}, {"high_z.fbx", "low.glb", {}, "FBX"},
      {"high.fbx", "low.obj", {}, "FBX"}};
  const std::vector<std::string> formats = mesh_formats();
  for (const Twin& twin : kTwins) {
    if (!twin.needs.empty() &&
        std::find(formats.begin(), formats.end(), twin.needs) == formats.end()) {
      continue;
    }
    SCOPED_TRACE(std::string(twin.high) + " " + twin.low);
    std::vector<std::string> arguments{
        "bake",   twins / twin.high,       twins / twin.low, "--out", out / "twin", "--size", "128",
        "--maps", "normal,color,position", "--max-distance", "0.1",   "--recall",   "0"};
    arguments.insert(arguments.end(), twin.flags.begin(), twin.flags.end());
    fs::remove_all(out / "twin");
    expect_exit(call_kiln(arguments), 0, {});
    if (!fs::exists(out / "first")) {
      fs::rename(out / "twin", out / "first");
      continue;
    }
    for (const char* map : {"low_normal.png", "low_color.png"}) {
      const Apart apart = compare(out / "first" / map, out / "twin" / map);
      EXPECT_LE(apart.over, apart.count / 2000) << map << ", up to " << apart.most << "/255";
      RecordProperty(std::string(map) + twin.high, std::to_string(apart.over));
    }
  }
}

}  // namespace
}  // namespace kiln

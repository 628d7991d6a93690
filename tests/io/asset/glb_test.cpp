// GLBs that are written: the format's rules, and what comes back.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A GLB's parts; ends the test where they do not hold together as the format asks.
struct Parsed {
  json head;
  std::string bytes;

  explicit Parsed(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string all((std::istreambuf_iterator<char>(file)), {});
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, all.data() + at, 4);
      return value;
    };
    EXPECT_EQ(all.substr(0, 4), "glTF");
    EXPECT_EQ(word(4), 2U);
    EXPECT_EQ(word(8), all.size());
    const std::size_t length = word(12);
    EXPECT_EQ(length % 4, 0U);
    EXPECT_EQ(all.substr(16, 4), "JSON");
    head = json::parse(all.substr(20, length));
    EXPECT_EQ(word(20 + length) % 4, 0U);
    bytes = all.substr(28 + length);
    EXPECT_EQ(word(20 + length), bytes.size());
    EXPECT_EQ(head["buffers"][0]["byteLength"], bytes.size());
  }

  /// An accessor's numbers, checked against its view.
  template <typename T>
  std::vector<T> values(std::size_t accessor, std::size_t width) const {
    const json& a = head["accessors"].at(accessor);
    const json& view = head["bufferViews"].at(a["bufferView"].get<std::size_t>());
    const std::size_t begin = view["byteOffset"], size = view["byteLength"];
    EXPECT_EQ(begin % 4, 0U);
    EXPECT_LE(begin + size, bytes.size());
    std::vector<T> result(a["count"].get<std::size_t>() * width);
    EXPECT_LE(result.size() * sizeof(T), size);
    std::memcpy(result.data(), bytes.data() + begin, result.size() * sizeof(T));
    return result;
  }
};

/// The format's rules for all primitives and pictures.
void expect_valid(const Parsed& glb) {
  EXPECT_EQ(glb.head["asset"]["version"], "2.0");
  for (const json& mesh : glb.head["meshes"]) {
    for (const json& primitive : mesh["primitives"]) {
      const json& of = primitive["attributes"];
      const auto positions = glb.values<float>(of["POSITION"], 3);
      const auto normals = glb.values<float>(of["NORMAL"], 3);
      const auto tangents = glb.values<float>(of["TANGENT"], 4);
      const auto uvs = glb.values<float>(of["TEXCOORD_0"], 2);
      const std::size_t count = positions.size() / 3;
      ASSERT_EQ(normals.size(), 3 * count);
      ASSERT_EQ(tangents.size(), 4 * count);
      ASSERT_EQ(uvs.size(), 2 * count);
      const json& bounds = glb.head["accessors"].at(of["POSITION"].get<std::size_t>());
      for (std::size_t k = 0; k < 3; ++k) {
        float low = positions[k], high = low;
        for (std::size_t i = k; i < positions.size(); i += 3) {
          low = std::min(low, positions[i]);
          high = std::max(high, positions[i]);
        }
        EXPECT_EQ(bounds["min"][k].get<float>(), low);
        EXPECT_EQ(bounds["max"][k].get<float>(), high);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const auto length = [](const float* v) { return std::hypot(v[0], v[1], v[2]); };
        ASSERT_NEAR(length(&normals[3 * i]), 1, 1e-5);
        ASSERT_NEAR(length(&tangents[4 * i]), 1, 1e-5);
        ASSERT_EQ(std::abs(tangents[4 * i + 3]), 1);
      }
      for (const std::uint32_t index : glb.values<std::uint32_t>(primitive["indices"], 1)) {
        ASSERT_LT(index, count);
      }
    }
  }
  for (const json& image : glb.head.value("images", json::array())) {
    const json& view = glb.head["bufferViews"].at(image["bufferView"].get<std::size_t>());
    const std::string png = glb.bytes.substr(view["byteOffset"], view["byteLength"]);
    EXPECT_NO_THROW(load_image(std::as_bytes(std::span(png)), "picture"));
  }
}

TEST(SaveGlb, IsValidAndComesBack) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  low.name = "ball";
  low.object_names = {"left", "right"};
  for (const Triangle& t : low.triangles) low.objects.push_back(low.positions[t[0]].x > 0 ? 1 : 0);
  const Image normal{4, 4, 3, std::vector<float>(48, 0.5F)};
  const Image grey{4, 4, 1, std::vector<float>(16, 0.25F)};
  AssetMaps maps;
  maps.normal = &normal;
  maps.occlusion = maps.opacity = &grey;
  save_glb(low, maps, path, {.extras = R"({"version":"x"})"});
  const Parsed glb(path);
  expect_valid(glb);
  EXPECT_EQ(glb.head["asset"]["extras"]["kiln"]["version"], "x");
  EXPECT_EQ(glb.head["materials"][0]["alphaMode"], "MASK");
  EXPECT_TRUE(glb.head["materials"][0].contains("occlusionTexture"));
  const Mesh back = load_mesh(path);
  EXPECT_EQ(back.triangles.size(), low.triangles.size());
  EXPECT_EQ(back.object_names, low.object_names);
  EXPECT_EQ(back.tangents.size(), 3 * low.triangles.size());
}

/// A mesh far away keeps its shape, by the root's translation.
TEST(SaveGlb, OriginsAreTheRootsTranslation) {
  const fs::path path = test::scratch_folder() / "a.glb";
  Mesh low = test::BumpySphere::light();
  low.origin = {500000.25, 4000000.5, 100};
  save_glb(low, {}, path, {.metres = 0.01});
  const Mesh small = load_mesh(path);
  const Vec3& p = low.positions[low.triangles[0][0]];
  EXPECT_NEAR(small.origin[0] + small.positions[small.triangles[0][0]].x,
              0.01 * (low.origin[0] + p.x), 1e-6);
  save_glb(low, {}, path);
  const Parsed glb(path);
  EXPECT_EQ(glb.head["nodes"][0]["translation"], json(low.origin));
  const Mesh back = load_mesh(path);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto at = [&](const Mesh& mesh) {
      const Vec3& p = mesh.positions[mesh.triangles[0][0]];
      return mesh.origin[k] + (k == 0 ? p.x : k == 1 ? p.y : p.z);
    };
    EXPECT_NEAR(at(back), at(low), 1e-6);
  }
}

TEST(SaveGlb, RefusesWhatItCannotHold) {
  const fs::path path = test::scratch_folder() / "a.glb";
  const Mesh low = test::BumpySphere::light();
  const Image grey{4, 4, 1, std::vector<float>(16, 1)}, small{2, 2, 1, std::vector<float>(4, 1)};
  AssetMaps maps;
  maps.normal = &grey;
  EXPECT_THROW(save_glb(low, maps, path), Error);
  maps = {};
  maps.roughness = &grey;
  maps.metallic = &small;
  EXPECT_THROW(save_glb(low, maps, path), Error);
  EXPECT_THROW(save_glb(low, {}, path, {.extras = "{"}), Error);
  Mesh bare = low;
  bare.uvs.clear();
  bare.uv_triangles.clear();
  EXPECT_THROW(save_glb(bare, {}, path), Error);
  EXPECT_FALSE(fs::exists(path));
}

/// A square whose UVs lie in one of eight ways: turned by quarters, mirrored or not.
Mesh turned_square(int way) {
  Mesh mesh;
  mesh.name = "square";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const Vec3& p : mesh.positions) {
    Vec2 uv = {way >= 4 ? 1 - p.x : p.x, p.y};
    for (int k = 0; k < way % 4; ++k) uv = {1 - uv.y, uv.x};
    mesh.uvs.push_back(uv);
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// The normal map, read through the file's own tangents as engines do, gives HIGH's normals, whichever way UVs lie.
TEST(SaveGlb, TangentsFitTheMapInAllEightOrientations) {
  KILN_REQUIRE_DEVICE();
  const fs::path path = test::scratch_folder() / "a.glb";
  // A roof that leans along +x and a little along +y: its normal is (-0.3, -0.1, 1), made unit.
  Mesh high = turned_square(0);
  for (Vec3& p : high.positions) p.z = 0.001F * (0.3F * p.x + 0.1F * p.y);
  high.normals = {{-0.3F, -0.1F, 1}};
  high.normal_triangles = {{0, 0, 0}, {0, 0, 0}};
  const double length = std::sqrt(1 + 0.09 + 0.01);
  const Source source(*test::device(), high);
  for (int way = 0; way < 8; ++way) {
    const Mesh low = turned_square(way);
    BakeOptions options;
    options.width = options.height = 16;
    options.match.max_distance = Length::share(0.1);
    const BakeResult result = bake(source, low, options);
    AssetMaps maps;
    maps.normal = &result.maps[0].image;
    save_glb(low, maps, path);
    const Parsed glb(path);
    expect_valid(glb);
    const json& of = glb.head["meshes"][0]["primitives"][0]["attributes"];
    const auto n = glb.values<float>(of["NORMAL"], 3), t = glb.values<float>(of["TANGENT"], 4);
    const json& view =
        glb.head["bufferViews"].at(glb.head["images"][0]["bufferView"].get<std::size_t>());
    const std::string png = glb.bytes.substr(view["byteOffset"], view["byteLength"]);
    const Image map = load_image(std::as_bytes(std::span(png)), "map");
    const float* const texel = map.at(8, 8);
    const Vec3 normal{n[0], n[1], n[2]}, tangent{t[0], t[1], t[2]};
    // glTF 2.0, 3.7.2.1: bitangent = cross(normal, tangent.xyz) * tangent.w
    const Vec3 bitangent = {t[3] * (normal.y * tangent.z - normal.z * tangent.y),
                            t[3] * (normal.z * tangent.x - normal.x * tangent.z),
                            t[3] * (normal.x * tangent.y - normal.y * tangent.x)};
    const double x = 2 * texel[0] - 1, y = 2 * texel[1] - 1, z = 2 * texel[2] - 1;
    // Half a step of 8 bits either way, and what dithering adds.
    constexpr double kStep = 2.0 / 255;
    EXPECT_NEAR(x * tangent.x + y * bitangent.x + z * normal.x, -0.3 / length, 1.5 * kStep) << way;
    EXPECT_NEAR(x * tangent.y + y * bitangent.y + z * normal.y, -0.1 / length, 1.5 * kStep) << way;
  }
}

}  // namespace
}  // namespace kiln

// GLBs whose pictures and triangles are packed: what the formats ask, and that what comes back is what went in.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/image/picture.h"
#include "kiln/asset.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/map.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using nlohmann::json;

json head_of(const std::vector<std::byte>& glb) {
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, 4);
  return json::parse(std::string(reinterpret_cast<const char*>(glb.data()) + 20, length));
}

bool reads(const char* format) {
  const std::vector<std::string> formats = picture_formats();
  return std::find(formats.begin(), formats.end(), format) != formats.end();
}

/// A ball with a layout, in two materials, away from 0.
Mesh ball() {
  Mesh low = test::BumpySphere::light();
  low.name = "ball";
  for (Vec3& p : low.positions) p.x += 3;
  low.material_names = {"stone", "glass"};
  for (const Triangle& t : low.triangles)
    low.materials.push_back(low.positions[t[0]].y > 0 ? 1 : 0);
  for (std::size_t i = 0; i < low.positions.size(); ++i) {
    const auto share = static_cast<std::uint8_t>(i % 256);
    low.colors.push_back({share, static_cast<std::uint8_t>(255 - share), 7, 255});
  }
  return low;
}

/// A corner of a triangle, all that a renderer reads.
struct Corner {
  Vec3 position, normal;
  Vec2 uv;
  std::array<std::uint8_t, 4> color;
};

Vec3 subtract(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double length_of(const Vec3& v) { return std::hypot(v.x, v.y, v.z); }
double angle(const Vec3& a, const Vec3& b) {
  const double dot = double{a.x} * b.x + double{a.y} * b.y + double{a.z} * b.z;
  const double across =
      std::hypot(double{a.y} * b.z - double{a.z} * b.y, double{a.z} * b.x - double{a.x} * b.z,
                 double{a.x} * b.y - double{a.y} * b.x);
  return std::atan2(across, dot) * 180 / 3.14159265358979323846;
}

std::vector<Corner> corners_of(const Mesh& mesh) {
  std::vector<Corner> corners;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh.triangles[t][k];
      Corner& corner = corners.emplace_back();
      const Vec3& p = mesh.positions[vertex];
      corner.position = {static_cast<float>(p.x + mesh.origin[0]),
                         static_cast<float>(p.y + mesh.origin[1]),
                         static_cast<float>(p.z + mesh.origin[2])};
      corner.normal =
          mesh.normals[mesh.normal_triangles.empty() ? vertex : mesh.normal_triangles[t][k]];
      corner.uv = mesh.uvs[mesh.uv_triangles[t][k]];
      if (!mesh.colors.empty()) corner.color = mesh.colors[vertex];
    }
  }
  return corners;
}

/// Each corner of one file, beside the nearest by position and UV of the other, which may have another order.
void expect_alike(const Mesh& plain, const Mesh& packed, double place, double degrees, double uv) {
  ASSERT_EQ(packed.triangles.size(), plain.triangles.size());
  EXPECT_EQ(packed.material_names, plain.material_names);
  EXPECT_EQ(std::count(packed.materials.begin(), packed.materials.end(), 1U),
            std::count(plain.materials.begin(), plain.materials.end(), 1U));
  ASSERT_EQ(packed.colors.empty(), plain.colors.empty());
  ASSERT_EQ(packed.tangents.size(), plain.tangents.size());
  std::vector<Corner> a = corners_of(plain);
  const std::vector<Corner> b = corners_of(packed);
  // Triangles are those of before, in another order: their middles, and the sides they show.
  const auto middles = [](const std::vector<Corner>& corners) {
    std::vector<std::array<double, 6>> all;
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      const Vec3 &p = corners[i].position, &q = corners[i + 1].position,
                 &r = corners[i + 2].position;
      const Vec3 u = subtract(q, p), v = subtract(r, p);
      all.push_back({(double{p.x} + q.x + r.x) / 3, (double{p.y} + q.y + r.y) / 3,
                     (double{p.z} + q.z + r.z) / 3, double{u.y} * v.z - double{u.z} * v.y,
                     double{u.z} * v.x - double{u.x} * v.z, double{u.x} * v.y - double{u.y} * v.x});
    }
    return all;
  };
  std::vector<std::array<double, 6>> before = middles(a);
  const std::vector<std::array<double, 6>> after = middles(b);
  // In order of x, so that only those near enough are compared.
  std::sort(before.begin(), before.end());
  std::stable_sort(a.begin(), a.end(), [](const Corner& one, const Corner& other) {
    return one.position.x < other.position.x;
  });
  for (const std::array<double, 6>& triangle : after) {
    double least = 1e9;
    for (auto at = std::lower_bound(before.begin(), before.end(),
                                    std::array<double, 6>{triangle[0] - 5 * place});
         at != before.end() && (*at)[0] <= triangle[0] + 5 * place; ++at) {
      const std::array<double, 6>& other = *at;
      double most = 0;
      for (std::size_t k = 0; k < 6; ++k) most = std::max(most, std::abs(triangle[k] - other[k]));
      least = std::min(least, most);
    }
    ASSERT_LE(least,
              4 * place);  // an edge of 1 at most turns by twice the ends' error, on both sides
  }
  for (const Corner& corner : b) {
    double best = 1e9;
    const Corner* nearest = nullptr;
    const auto from = std::partition_point(a.begin(), a.end(), [&](const Corner& other) {
      return other.position.x < corner.position.x - 2 * place;
    });
    for (auto at = from; at != a.end() && at->position.x <= corner.position.x + 2 * place; ++at) {
      const Corner& other = *at;
      const double off = length_of(subtract(corner.position, other.position)) +
                         std::hypot(corner.uv.x - other.uv.x, corner.uv.y - other.uv.y);
      if (off < best) {
        best = off;
        nearest = &other;
      }
    }
    ASSERT_NE(nearest, nullptr) << "no corner is as near as twice the bound";
    ASSERT_LE(length_of(subtract(corner.position, nearest->position)), place);
    ASSERT_LE(angle(corner.normal, nearest->normal), degrees);
    ASSERT_NEAR(corner.uv.x, nearest->uv.x, uv);
    ASSERT_NEAR(corner.uv.y, nearest->uv.y, uv);
    for (std::size_t k = 0; k < 4 && !plain.colors.empty(); ++k) {
      ASSERT_EQ(corner.color[k], nearest->color[k]);
    }
  }
}

Mesh read_back(const std::vector<std::byte>& glb, const char* name) {
  const std::filesystem::path path = test::scratch_folder() / name;
  save_text(path, {reinterpret_cast<const char*>(glb.data()), glb.size()});
  return load_asset(path).mesh;
}

std::vector<std::byte> packed_ball(const Mesh& low, MeshCompression compression) {
  const std::vector<AssetMaterial> materials = {{.name = "stone"}, {.name = "glass"}};
  SaveAssetOptions options;
  options.compression = compression;
  return encode_glb(low, materials, options);
}

TEST(MeshPacking, MeshoptComesBackWithinItsGrid) {
  const Mesh low = ball();
  const std::vector<std::byte> plain = packed_ball(low, MeshCompression::none);
  const std::vector<std::byte> glb = packed_ball(low, MeshCompression::meshopt);
  EXPECT_LT(2 * glb.size(), plain.size());
  const json head = head_of(glb);
  EXPECT_EQ(head["extensionsRequired"], json({"EXT_meshopt_compression", "KHR_mesh_quantization"}));
  EXPECT_EQ(head["extensionsUsed"], head["extensionsRequired"]);
  // As the extension asks: unpacked bytes lie in a buffer that no file has, one view after the other.
  ASSERT_EQ(head["buffers"].size(), 2U);
  EXPECT_TRUE(head["buffers"][1]["extensions"]["EXT_meshopt_compression"]["fallback"]);
  EXPECT_FALSE(head["buffers"][1].contains("uri"));
  for (const json& view : head["bufferViews"]) {
    const json& packed = view["extensions"]["EXT_meshopt_compression"];
    EXPECT_EQ(packed["buffer"], 0);
    EXPECT_EQ(view["byteLength"], packed["count"].get<int>() * packed["byteStride"].get<int>());
    EXPECT_LE(view["byteOffset"].get<int>() + view["byteLength"].get<int>(),
              head["buffers"][1]["byteLength"].get<int>());
    EXPECT_LE(packed["byteOffset"].get<int>() + packed["byteLength"].get<int>(),
              head["buffers"][0]["byteLength"].get<int>());
  }
  const Mesh before = read_back(plain, "plain.glb"), after = read_back(glb, "packed.glb");
  EXPECT_EQ(after.object_names, before.object_names);
  // Half a step of a grid of 65535 along each axis; the ball is at most 2.5 wide. Rounding to floats is less.
  const double place = std::sqrt(3) / 2 * 2.5 / 65535 + 1e-6;
  expect_alike(before, after, place, 0.04, 0.51 / 65535);
  // Floats where UVs leave the unit square.
  Mesh tiled = low;
  for (Vec2& uv : tiled.uvs) uv.x += 1.25F;
  expect_alike(read_back(packed_ball(tiled, MeshCompression::none), "plain.glb"),
               read_back(packed_ball(tiled, MeshCompression::meshopt), "packed.glb"), place, 0.04,
               1e-6);
}

TEST(MeshPacking, DracoComesBackWithinItsBits) {
  const Mesh low = ball();
  std::vector<std::byte> glb;
  try {
    glb = packed_ball(low, MeshCompression::draco);
  } catch (const Error& error) {
    ASSERT_EQ(error.code(), ErrorCode::usage);
    GTEST_SKIP() << "built without Draco";
  }
  const std::vector<std::byte> plain = packed_ball(low, MeshCompression::none);
  EXPECT_LT(3 * glb.size(), plain.size());
  const json head = head_of(glb);
  EXPECT_EQ(head["extensionsRequired"], json({"KHR_draco_mesh_compression"}));
  for (const json& accessor : head["accessors"]) EXPECT_FALSE(accessor.contains("bufferView"));
  const Mesh before = read_back(plain, "plain.glb"), after = read_back(glb, "packed.glb");
  std::size_t corners = 0;
  for (const json& primitive : head["meshes"][0]["primitives"]) {
    const json& indices = head["accessors"].at(primitive["indices"].get<std::size_t>());
    corners += indices["count"].get<std::size_t>();
  }
  EXPECT_EQ(corners, 3 * after.triangles.size());
  // A step of 16 bits of the widest range, along each axis; octahedra of 12 bits.
  expect_alike(before, after, std::sqrt(3) * 2.5 / 65535, 0.08, 1.01 / 65535);
}

/// Bytes of one element of an accessor.
std::size_t element_bytes(const json& accessor) {
  static const std::map<int, std::size_t> kComponents = {{5120, 1}, {5121, 1}, {5122, 2},
                                                         {5123, 2}, {5125, 4}, {5126, 4}};
  static const std::map<std::string, std::size_t> kTypes = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  return kComponents.at(accessor["componentType"].get<int>()) *
         kTypes.at(accessor["type"].get<std::string>());
}

/// A strip of triangles, split into two objects and two materials; their counts are odd if `triangles` is.
Mesh strip(std::uint32_t triangles) {
  Mesh mesh;
  mesh.name = "strip";
  for (std::uint32_t i = 0; i < 2 * triangles + 4; ++i) {
    const auto x = static_cast<float>(i / 2), y = static_cast<float>(i % 2);
    mesh.positions.push_back({x, y, 0.1F * x * y});
    mesh.uvs.push_back({x / static_cast<float>(triangles + 2), y});
    mesh.colors.push_back({static_cast<std::uint8_t>(i), 9, 7, 255});
  }
  mesh.object_names = {"left", "right"};
  mesh.material_names = {"stone", "glass"};
  for (std::uint32_t i = 0; i < 2 * triangles; ++i) {
    mesh.triangles.push_back(i % 2 == 0 ? Triangle{i, i + 2, i + 1} : Triangle{i, i + 1, i + 2});
    mesh.objects.push_back(i < triangles ? 0 : 1);
    mesh.materials.push_back(i % 3 == 0 ? 1 : 0);
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// The rules of glTF for views and accessors, whatever the packing, the number of primitives and of their triangles:
/// views begin at multiples of 4, do not overlap and end within their buffer, attributes are aligned to 4 bytes, an
/// accessor's elements fit in its view, and indices address vertices.
TEST(MeshPacking, ViewsAndAccessorsKeepTheFormatsRules) {
  for (const std::uint32_t triangles : {2U, 3U, 5U, 6U, 31U}) {
    for (const bool colored : {false, true}) {
      for (const MeshCompression compression :
           {MeshCompression::none, MeshCompression::meshopt, MeshCompression::draco}) {
        Mesh low = strip(triangles);
        if (!colored) low.colors.clear();
        std::vector<std::byte> glb;
        try {
          glb = packed_ball(low, compression);
        } catch (const Error&) {
          continue;  // without Draco
        }
        SCOPED_TRACE(std::to_string(triangles) + " triangles, compression " +
                     std::to_string(static_cast<int>(compression)));
        const json head = head_of(glb);
        // The ranges that views take in each buffer; those of packed bytes lie in the first.
        std::map<std::size_t, std::vector<std::pair<std::size_t, std::size_t>>> taken;
        const auto take = [&](const json& range) {
          const std::size_t begin = range["byteOffset"], size = range["byteLength"];
          EXPECT_EQ(begin % 4, 0U);
          taken[range["buffer"].get<std::size_t>()].push_back({begin, begin + size});
        };
        for (const json& view : head["bufferViews"]) {
          take(view);
          if (view.contains("extensions")) {
            take(view["extensions"]["EXT_meshopt_compression"]);
          }
        }
        for (auto& [buffer, ranges] : taken) {
          std::sort(ranges.begin(), ranges.end());
          for (std::size_t i = 1; i < ranges.size(); ++i) {
            EXPECT_GE(ranges[i].first, ranges[i - 1].second);
          }
          EXPECT_LE(ranges.back().second, head["buffers"][buffer]["byteLength"].get<std::size_t>());
        }
        for (const json& accessor : head["accessors"]) {
          if (!accessor.contains("bufferView")) continue;  // Draco's
          const json& view = head["bufferViews"].at(accessor["bufferView"].get<std::size_t>());
          const std::size_t element = element_bytes(accessor),
                            step = view.value("byteStride", element), count = accessor["count"];
          EXPECT_GE(step, element);
          EXPECT_LE((count - 1) * step + element, view["byteLength"].get<std::size_t>());
          if (view["target"] == 34962) EXPECT_EQ(step % 4, 0U);
          if (view.contains("extensions")) {
            const json& packed = view["extensions"]["EXT_meshopt_compression"];
            EXPECT_EQ(packed["count"], count);
            EXPECT_EQ(packed["byteStride"], step);
          }
        }
        std::size_t corners = 0;
        for (const json& mesh : head["meshes"]) {
          for (const json& primitive : mesh["primitives"]) {
            const json& indices = head["accessors"].at(primitive["indices"].get<std::size_t>());
            corners += indices["count"].get<std::size_t>();
            std::optional<std::size_t> vertices;
            for (const auto& [name, accessor] : primitive["attributes"].items()) {
              const std::size_t count = head["accessors"].at(accessor.get<std::size_t>())["count"];
              EXPECT_EQ(vertices.value_or(count), count) << name;
              vertices = count;
            }
            EXPECT_EQ(primitive["attributes"].contains("COLOR_0"), colored);
          }
        }
        EXPECT_EQ(corners, 3 * low.triangles.size());
        EXPECT_EQ(read_back(glb, "strip.glb").triangles.size(), low.triangles.size());
      }
    }
  }
}

/// Tangents keep their sign, and their direction within the octahedron's 12 bits.
TEST(MeshPacking, TangentsKeepTheirSides) {
  Mesh low = test::torus(24, 12);
  low.name = "ring";
  for (std::size_t i = 0; i < low.uvs.size(); ++i) low.uvs[i].x = 1 - low.uvs[i].x;  // mirrored
  const AssetMaterial material{.name = "m"};
  for (const MeshCompression compression : {MeshCompression::meshopt, MeshCompression::draco}) {
    SaveAssetOptions options;
    options.compression = compression;
    std::vector<std::byte> glb;
    try {
      glb = encode_glb(low, std::span(&material, 1), options);
    } catch (const Error&) {
      continue;  // without Draco
    }
    const Mesh before = read_back(encode_glb(low, std::span(&material, 1)), "plain.glb");
    const Mesh after = read_back(glb, "packed.glb");
    ASSERT_EQ(after.tangents.size(), before.tangents.size());
    std::size_t left = 0;
    for (const auto& tangent : after.tangents) left += tangent.sign < 0 ? 1 : 0;
    std::size_t were = 0;
    for (const auto& tangent : before.tangents) were += tangent.sign < 0 ? 1 : 0;
    EXPECT_EQ(left, were);
  }
}

/// A soft gradient with some detail in it, as maps have.
Image waves(std::uint32_t size, std::uint32_t channels) {
  Image image{size, size, channels, {}};
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      for (std::uint32_t c = 0; c < channels; ++c) {
        const double at = 0.11 * x + 0.07 * y + 2.1 * c;
        image.pixels.push_back(
            static_cast<float>(0.5 + 0.3 * std::sin(at) + 0.1 * std::sin(5.3 * at)));
      }
    }
  }
  return image;
}

/// Unit normals that lean by some degrees, as n/2 + 1/2.
Image leaning(std::uint32_t size) {
  Image image{size, size, 3, {}};
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      const double a = 0.3 * std::sin(0.2 * x), b = 0.3 * std::cos(0.15 * y);
      const double z = std::sqrt(1 - a * a - b * b);
      for (const double n : {a, b, z}) image.pixels.push_back(static_cast<float>(n / 2 + 0.5));
    }
  }
  return image;
}

double worst(const Image& a, const Image& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    most = std::max(most, std::abs(double{a.pixels[i]} - b.pixels[i]));
  }
  return most;
}

struct Maps {
  Image normal = leaning(64), grey = waves(64, 1), color = waves(64, 3);
  AssetMaps maps;
  Maps() {
    maps.normal = &normal;
    maps.occlusion = &grey;
    maps.color = &color;
    maps.emission = &color;
  }
};

/// Pictures of a quality are smaller, as far off as is said, and normals are exact all the same.
TEST(AssetPictures, LossyPicturesSayHowFarTheyAreOff) {
  const Maps all;
  for (const PictureFormat format : {PictureFormat::webp, PictureFormat::jpeg}) {
    if (!reads(format == PictureFormat::webp ? "WebP" : "JPEG")) continue;
    std::size_t before = 0;
    for (const std::uint32_t quality : {95U, 80U, 40U}) {
      const AssetPictures pictures =
          encode_maps(all.maps, {.format = format, .quality = quality, .dither = Dither::off});
      const std::size_t size = pictures.color.size() + pictures.surface.size();
      if (before != 0) EXPECT_LT(size, before);
      before = size;
      const Image normal = load_image(pictures.normal);
      EXPECT_LE(worst(normal, all.normal), 0.5001 / 255);
      for (const AssetError& error : pictures.errors) {
        if (error.map != "color" && error.map != "normal") continue;
        if (error.map == "normal") {
          EXPECT_LT(error.error.max, 0.5);
          continue;
        }
        EXPECT_NEAR(error.error.max, 255 * worst(load_image(pictures.color), all.color), 1e-3);
        EXPECT_GT(error.error.mean, 0.5);
      }
    }
  }
}

/// A picture whose channels change independently, from texel to texel. \param channels  4: with clear texels
Image speckles(std::uint32_t channels) {
  constexpr std::uint32_t kSide = 64;
  Image image{kSide, kSide, channels, {}};
  std::uint32_t random = 1;
  for (std::uint32_t i = 0; i < kSide * kSide * channels; ++i) {
    random = random * 1664525U + 1013904223U;
    const bool is_alpha = channels == 4 && i % 4 == 3;
    image.pixels.push_back(static_cast<float>(is_alpha ? (random >> 30U) * 85 : random >> 24U) /
                           255);
  }
  return image;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += std::abs(a.pixels[i] - b.pixels[i]);
  return 255 * sum / static_cast<double>(a.pixels.size());
}

/// Lossless WebP keeps colours of clear texels, and lossy WebP keeps alpha.
TEST(AssetPictures, WebpKeepsAlphaAndWhatItHides) {
  if (!reads("WebP")) GTEST_SKIP() << "built without WebP";
  const Image image = speckles(4);
  const Image exact = load_image(encode_picture(image, {.format = PictureFormat::webp}));
  EXPECT_EQ(exact.channels, 4U);
  EXPECT_LE(mean_difference(exact, image), 1e-4);
  const Image lossy =
      load_image(encode_picture(image, {.format = PictureFormat::webp, .quality = 40}));
  EXPECT_GT(mean_difference(lossy, image), 1);
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
    ASSERT_NEAR(lossy.pixels[i], image.pixels[i], 1e-6) << i;
  }
}

/// Chroma is halved for colours alone: channels of other pictures are independent.
TEST(AssetPictures, ChromaIsHalvedForColoursAlone) {
  if (!reads("JPEG")) GTEST_SKIP() << "built without JPEG";
  const Image image = speckles(3);
  const auto encode = [&](TextureUse use, std::uint32_t quality) {
    return encode_picture(image, {.format = PictureFormat::jpeg, .quality = quality, .use = use});
  };
  const std::vector<std::byte> color = encode(TextureUse::color, 80),
                               values = encode(TextureUse::values, 80);
  EXPECT_LT(10 * color.size(), 7 * values.size());
  EXPECT_LT(2 * mean_difference(load_image(values), image),
            mean_difference(load_image(color), image));
  EXPECT_EQ(encode(TextureUse::color, 95).size(), encode(TextureUse::values, 95).size());
  EXPECT_THROW(encode_picture(speckles(4), {.format = PictureFormat::jpeg}), Error);
}

TEST(AssetPictures, NormalsAreLossyWithinTheirError) {
  const Maps all;
  for (const PictureFormat format : {PictureFormat::webp, PictureFormat::jpeg}) {
    if (!reads(format == PictureFormat::webp ? "WebP" : "JPEG")) continue;
    const AssetPictures exact = encode_maps(all.maps, {.format = format});
    const AssetPictures pictures = encode_maps(all.maps, {.format = format, .max_normal_error = 2});
    ASSERT_GT(pictures.normal_quality, 0U);
    EXPECT_LT(pictures.normal.size(), exact.normal.size());
    const Image back = load_image(pictures.normal);
    double sum = 0;
    for (std::size_t i = 0; i < back.pixels.size(); i += 3) {
      const auto normal = [&](const Image& image) {
        return Vec3{2 * image.pixels[i] - 1, 2 * image.pixels[i + 1] - 1,
                    2 * image.pixels[i + 2] - 1};
      };
      sum += angle(normal(back), normal(all.normal));
    }
    const double mean = sum / (64 * 64);
    EXPECT_LE(mean, 2);
    EXPECT_GT(mean, 0.2);  // the bound is made use of
    // What no quality reaches stays lossless.
    const AssetPictures fine = encode_maps(all.maps, {.format = format, .max_normal_error = 1e-4});
    EXPECT_EQ(fine.normal_quality, 0U);
    EXPECT_LE(worst(load_image(fine.normal), all.normal), 1.001 / 255);
  }
}

/// The quality of normals is the lowest at which baked texels are within the error: neither gutters nor empty texels
/// raise it by their noise, nor lower it by being smooth.
TEST(AssetPictures, QualityOfNormalsIsThatOfBakedTexels) {
  constexpr std::uint32_t kSide = 64, kSmoothColumns = 16;  // whole blocks of both formats
  constexpr double kMost = 1.75;
  Image normal = leaning(kSide);
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = kSmoothColumns; x < kSide; ++x) {
      const double a = 0.3 * std::sin(0.6 * x + 0.2 * y), b = 0.3 * std::cos(0.5 * y - 0.1 * x);
      const double z = std::sqrt(1 - a * a - b * b);
      float* const texel = normal.at(x, y);
      texel[0] = static_cast<float>(a / 2 + 0.5);
      texel[1] = static_cast<float>(b / 2 + 0.5);
      texel[2] = static_cast<float>(z / 2 + 0.5);
    }
  }
  for (const PictureFormat format : {PictureFormat::webp, PictureFormat::jpeg}) {
    if (!reads(format == PictureFormat::webp ? "WebP" : "JPEG")) continue;
    std::array<std::uint32_t, 2> qualities{};
    for (const bool smooth_is_baked : {false, true}) {
      SCOPED_TRACE(smooth_is_baked);
      std::vector<std::uint8_t> coverage;
      for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        const bool is_baked = (i % kSide < kSmoothColumns) == smooth_is_baked;
        coverage.push_back(static_cast<std::uint8_t>(is_baked                ? TexelState::baked
                                                     : i < kSide * kSide / 2 ? TexelState::padding
                                                                             : TexelState::empty));
      }
      const auto mean_of = [&](const Image& back) {
        double sum = 0;
        std::size_t count = 0;
        for (std::size_t i = 0; i < coverage.size(); ++i) {
          if (coverage[i] != static_cast<std::uint8_t>(TexelState::baked)) continue;
          const auto at = [i](const Image& image) {
            const float* const n = &image.pixels[3 * i];
            return Vec3{2 * n[0] - 1, 2 * n[1] - 1, 2 * n[2] - 1};
          };
          sum += angle(at(back), at(normal));
          ++count;
        }
        return sum / static_cast<double>(count);
      };
      AssetMaps maps;
      maps.normal = &normal;
      maps.coverage = coverage;
      const AssetPictures pictures =
          encode_maps(maps, {.format = format, .max_normal_error = kMost});
      ASSERT_GT(pictures.normal_quality, 30U);
      EXPECT_LE(mean_of(load_image(pictures.normal)), kMost);
      const Image worse = load_image(encode_picture(
          normal,
          {.format = format, .quality = pictures.normal_quality - 1, .use = TextureUse::normal}));
      EXPECT_GT(mean_of(worse), kMost);
      qualities[smooth_is_baked ? 1 : 0] = pictures.normal_quality;
    }
    EXPECT_LT(qualities[1], qualities[0]);
  }
}

TEST(AssetPictures, JpegKeepsAlphaInAPng) {
  if (!reads("JPEG")) GTEST_SKIP() << "built without libjpeg";
  Maps all;
  all.maps.opacity = &all.grey;
  const AssetPictures pictures =
      encode_maps(all.maps, {.format = PictureFormat::jpeg, .dither = Dither::off});
  EXPECT_EQ(pictures.color.front(), std::byte{0x89});
  EXPECT_EQ(pictures.surface.front(), std::byte{0xFF});
  const Image color = load_image(pictures.color);
  ASSERT_EQ(color.channels, 4U);
  EXPECT_NEAR(color.at(5, 9)[3], all.grey.at(5, 9)[0], 0.51 / 255);
  AssetMaterial material{.name = "m", .pictures = std::make_shared<const AssetPictures>(pictures)};
  const json head = head_of(encode_glb(test::BumpySphere::light(), std::span(&material, 1)));
  EXPECT_FALSE(head.contains("extensionsUsed"));
  std::vector<std::string> kinds;
  for (const json& image : head["images"]) kinds.push_back(image["mimeType"]);
  EXPECT_EQ(kinds,
            (std::vector<std::string>{"image/png", "image/jpeg", "image/png", "image/jpeg"}));
}

/// Both pictures are there, and no reader is asked for WebP.
TEST(AssetPictures, FallbacksStandBesideWebp) {
  if (!reads("WebP")) GTEST_SKIP() << "built without libwebp";
  const Maps all;
  AssetMaterial material{.name = "m"};
  material.pictures = std::make_shared<const AssetPictures>(
      encode_maps(all.maps, {.format = PictureFormat::webp, .quality = 60, .fallback = true}));
  const json head = head_of(encode_glb(test::BumpySphere::light(), std::span(&material, 1)));
  EXPECT_EQ(head["extensionsUsed"], json({"EXT_texture_webp"}));
  EXPECT_FALSE(head.contains("extensionsRequired"));
  EXPECT_EQ(head["images"].size(), 2 * head["textures"].size());
  for (const json& texture : head["textures"]) {
    const std::size_t webp = texture["extensions"]["EXT_texture_webp"]["source"];
    EXPECT_EQ(head["images"][webp]["mimeType"], "image/webp");
    const json& plain = head["images"].at(texture["source"].get<std::size_t>());
    EXPECT_EQ(plain["mimeType"], "image/png");
    EXPECT_EQ(plain["name"], head["images"][webp]["name"]);
  }
}

/// A map as its file holds it.
BakedMap stored_map(MapKind kind, Image image) {
  BakedMap map;
  map.kind = kind;
  map.image = std::move(image);
  map.stored = true;
  return map;
}

TEST(AssetMaps, OcclusionIsTheLesserOfRaysAndOfHighsPicture) {
  std::vector<BakedMap> maps;
  maps.push_back(stored_map(MapKind{"ao"}, {2, 1, 1, {0.25F, 0.75F}}));
  maps.push_back(stored_map(MapKind{"occlusion"}, {2, 1, 3, {0.5F, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F}}));
  const AssetMaps places = asset_maps(maps);
  ASSERT_EQ(places.occlusion, &maps[0].image);
  EXPECT_EQ(places.occlusion->pixels, (std::vector<float>{0.25F, 0.5F}));
}

TEST(AssetMaps, EmissionIsScaledAndWhatEmitsNothingHasNoPlace) {
  for (const auto& [value, strength] : {std::pair{0.0F, 0.0F}, {0.5F, 1.0F}, {4.0F, 4.0F}}) {
    std::vector<BakedMap> maps;
    maps.push_back(stored_map(MapKind{"emission"}, {1, 1, 3, {0, value, 0}}));
    const AssetMaps places = asset_maps(maps);
    EXPECT_EQ(places.emission_strength, strength);
    EXPECT_EQ(places.emission != nullptr, value > 0);
    EXPECT_EQ(maps[0].image.pixels[1], value > 1 ? 1 : value);
  }
}

}  // namespace
}  // namespace kiln

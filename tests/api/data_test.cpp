// Data in and out: strided views, pixels in the caller's memory, files in memory.
#include <gtest/gtest.h>
#include <half.h>
#include <rapidcheck.h>

#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/mesh_view.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

std::string id_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.id();
  }
  return {};
}

/// A vertex buffer as engines have it, with a byte of disorder: nothing is aligned.
#pragma pack(push, 1)
struct Vertex {
  std::uint8_t flags;
  std::array<float, 3> position;
  std::array<float, 3> normal;
  std::array<float, 2> uv;
  std::array<float, 4> tangent;
};
#pragma pack(pop)

struct Buffers {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<std::uint16_t> narrow;

  MeshView view() const {
    const auto count = vertices.size();
    const auto* const first = reinterpret_cast<const std::byte*>(vertices.data());
    return {.positions = {first + 1, count, sizeof(Vertex)},
            .indices = indices,
            .normals = {first + 13, count, sizeof(Vertex)},
            .uvs = {first + 25, count, sizeof(Vertex)},
            .tangents = {first + 33, count, sizeof(Vertex)}};
  }
};

/// A vertex for every corner.
Buffers buffers_of(const Mesh& mesh) {
  Buffers buffers;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.positions[mesh.triangles[t][k]];
      const Vec3& n = mesh.normals[mesh.normal_triangles[t][k]];
      const Vec2& uv = mesh.uvs[mesh.uv_triangles[t][k]];
      buffers.indices.push_back(static_cast<std::uint32_t>(buffers.vertices.size()));
      buffers.vertices.push_back(
          {0xFF, {p.x, p.y, p.z}, {n.x, n.y, n.z}, {uv.x, uv.y}, {1, 0, 0, 1}});
    }
  }
  buffers.narrow.assign(buffers.indices.begin(), buffers.indices.end());
  return buffers;
}

TEST(MeshView, AnyLayoutBakesTheSameMap) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(2000, true);
  const Mesh low = test::BumpySphere::light(12, 8);
  const Source source(*test::device(), high);
  const BakeOptions options{.width = 48, .height = 48};
  const std::vector<float> expected = bake(source, low, options).maps[0].image.pixels;
  const Buffers buffers = buffers_of(low);
  MeshView view = buffers.view();
  view.tangents = {};  // MikkTSpace's, as of the mesh
  EXPECT_EQ(bake(source, to_mesh(view), options).maps[0].image.pixels, expected);
  view.indices = {};
  EXPECT_EQ(bake(source, to_mesh(view), options).maps[0].image.pixels, expected);
  view.indices_16 = buffers.narrow;
  EXPECT_EQ(bake(source, to_mesh(view), options).maps[0].image.pixels, expected);
}

TEST(MeshView, TheHighPolyMayBeInterleavedToo) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::uv_sphere(12, 8);
  const BakeOptions options{.width = 32, .height = 32};
  const Source own(*test::device(), low);
  const Source viewed(*test::device(), to_mesh(buffers_of(low).view()));
  EXPECT_EQ(bake(viewed, low, options).maps[0].image.pixels,
            bake(own, low, options).maps[0].image.pixels);
}

TEST(MeshView, EveryAttributeArrives) {
  const Buffers buffers = buffers_of(test::cube());
  MeshView view = buffers.view();
  view.name = "box";
  view.flip_v = true;
  view.origin = {1, 2, 3};
  const std::array<std::uint8_t, 4> color{5, 6, 7, 8};
  const std::vector<std::array<std::uint8_t, 4>> colors(view.positions.size(), color);
  view.colors = std::span(colors);
  const Mesh mesh = to_mesh(view);
  EXPECT_EQ(mesh.name, "box");
  EXPECT_EQ(mesh.origin[2], 3);
  ASSERT_EQ(mesh.positions.size(), 36U);
  EXPECT_EQ(mesh.colors[35], color);
  EXPECT_EQ(mesh.triangles[11], (Triangle{33, 34, 35}));
  // Copies, since members of what is not aligned have no functions to call.
  const std::array<float, 2> uv = buffers.vertices[7].uv;
  const std::array<float, 3> normal = buffers.vertices[9].normal;
  EXPECT_EQ(mesh.uvs[7].y, 1 - uv[1]);
  EXPECT_EQ(mesh.normals[9].z, normal[2]);
  ASSERT_EQ(mesh.tangents.size(), 36U);
  EXPECT_EQ(mesh.tangents[20].direction, (Vec3{1, 0, 0}));
}

/// Normal of a plane that faces +Z, whose high poly leans to +X: along the caller's own tangent.
TEST(MeshView, OwnTangentsTurnTheMap) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1);
  const float lean = std::sqrt(0.5F);
  high.normals = {{lean, 0, lean}};
  const Source source(*test::device(), high);
  const auto baked = [&](const std::array<float, 4>& tangent) {
    Buffers buffers = buffers_of(test::plane(1, 1));
    for (Vertex& vertex : buffers.vertices) vertex.tangent = tangent;
    const BakeOptions options{.width = 4, .height = 4, .encoding = {.raw = true}};
    const Image image = bake(source, to_mesh(buffers.view()), options).maps[0].image;
    const float* n = image.at(1, 1);
    return std::array<float, 3>{n[0], n[1], n[2]};
  };
  const auto expect = [](const std::array<float, 3>& n, double x, double y) {
    EXPECT_NEAR(n[0], x, 1e-6);
    EXPECT_NEAR(n[1], y, 1e-6);
    EXPECT_NEAR(n[2], std::sqrt(0.5), 1e-6);
  };
  const double part = std::sqrt(0.5);
  expect(baked({1, 0, 0, 1}), part, 0);
  expect(baked({5, 0, 0, 1}), part, 0);   // of any length
  expect(baked({0, 1, 0, 1}), 0, -part);  // bitangent: -X
  expect(baked({0, 1, 0, -1}), 0, part);
  expect(baked({0, 0, 0, -1}), part, 0);  // without direction: MikkTSpace's
}

TEST(MeshView, WhatDoesNotFitIsNamed) {
  const Buffers buffers = buffers_of(test::cube());
  const auto with = [&](const std::function<void(MeshView&)>& change) {
    return id_of([&] {
      MeshView view = buffers.view();
      change(view);
      to_mesh(view);
    });
  };
  EXPECT_EQ(with([](MeshView&) {}), "");
  EXPECT_EQ(with([](MeshView& v) {
              v.normals = {v.normals.data(), 35, sizeof(Vertex)};
            }),
            "mesh-size");
  EXPECT_EQ(with([](MeshView& v) { v.uvs = {v.uvs.data(), 1, sizeof(Vertex)}; }), "mesh-size");
  EXPECT_EQ(with([](MeshView& v) { v.indices = v.indices.first(35); }), "mesh-size");
  EXPECT_EQ(with([&](MeshView& v) { v.indices_16 = buffers.narrow; }), "mesh-size");
  // Corners are counted where they are: in the narrow list, or in that of positions.
  EXPECT_EQ(with([&](MeshView& v) {
              v.indices = {};
              v.indices_16 = std::span(buffers.narrow).first(33);
            }),
            "");
  EXPECT_EQ(with([&](MeshView& v) {
              v.indices = {};
              v.indices_16 = std::span(buffers.narrow).first(35);
            }),
            "mesh-size");
  for (const std::size_t count : {33U, 34U}) {
    EXPECT_EQ(with([&](MeshView& v) {
                v.indices = {};
                v.positions = {v.positions.data(), count, sizeof(Vertex)};
                v.normals = {}, v.uvs = {}, v.tangents = {};
              }),
              count == 33 ? "" : "mesh-size");
  }
  EXPECT_EQ(with([](MeshView& v) {
              v.positions = {v.positions.data(), 35, sizeof(Vertex)};
              v.normals = {}, v.uvs = {}, v.tangents = {};
            }),
            "mesh-index");
  EXPECT_EQ(with([](MeshView& v) { v.origin[1] = std::nan(""); }), "mesh-origin");
}

TEST(Convert, WritesWhatPngHolds) {
  const std::vector<float> values = {0,    1, 0.5F, -1,    2,      std::nanf(""),
                                     0.2F, 1, 0.1F, 1e-9F, 0.999F, 0.7F};
  const Image image{2, 2, 3, values};
  std::vector<std::byte> bytes(2 * 2 * 8);
  convert(image, PixelFormat::rgba16, bytes);
  const Image png = load_image(encode(image, {.format = ImageFormat::png16}));
  for (std::size_t t = 0; t < 4; ++t) {
    std::array<std::uint16_t, 4> pixel{};
    std::memcpy(pixel.data(), &bytes[8 * t], 8);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(pixel[c], std::lround(png.pixels[3 * t + c] * 65535.0F));
    }
    EXPECT_EQ(pixel[3], 65535);
  }
}

TEST(Convert, CoverageIsAlphaAndRowsLieWhereTheyAreWanted) {
  const Image image{2, 2, 1, {0.0F, 0.25F, 0.5F, 1.0F}};
  const std::vector<std::uint8_t> coverage = {1, 3, 2, 0};
  std::vector<std::byte> bytes(12 + 8, std::byte{0xAB});
  convert(image, PixelFormat::bgra8, bytes,
          {.coverage = coverage, .row_bytes = 12, .bottom_up = true});
  const auto at = [&](std::size_t i) { return std::to_integer<int>(bytes[i]); };
  EXPECT_EQ(at(12), 0);    // the uppermost row comes last
  EXPECT_EQ(at(15), 255);  // baked
  EXPECT_EQ(at(16), 64);   // 63.75
  EXPECT_EQ(at(19), 0);    // padding
  EXPECT_EQ(at(0), 128);   // 127.5, to even
  EXPECT_EQ(at(3), 0);     // missed
  EXPECT_EQ(at(4), 255);
  EXPECT_EQ(at(8), 0xAB);  // between rows nothing is written
  EXPECT_EQ(at(11), 0xAB);
}

TEST(Convert, ChannelsAreSpreadAndOrdered) {
  const auto pixel = [](const std::vector<float>& channels, PixelFormat format) {
    std::array<float, 4> out{};
    std::array<std::byte, 16> bytes{};
    convert({1, 1, static_cast<std::uint32_t>(channels.size()), channels}, format, bytes);
    std::memcpy(out.data(), bytes.data(), 16);
    return out;
  };
  using Four = std::array<float, 4>;
  EXPECT_EQ(pixel({3}, PixelFormat::rgba32_float), (Four{3, 3, 3, 1}));
  EXPECT_EQ(pixel({3, 4}, PixelFormat::rgba32_float), (Four{3, 4, 0, 1}));
  EXPECT_EQ(pixel({3, 4, -5}, PixelFormat::rgba32_float), (Four{3, 4, -5, 1}));
  EXPECT_EQ(pixel({3, 4, -5, 6}, PixelFormat::rgba32_float), (Four{3, 4, -5, 6}));
}

/// OpenEXR's half is the oracle, for every half, what lies between two, and beyond.
TEST(Convert, HalvesAreRoundedToNearestEven) {
  std::vector<float> values;
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    half h;
    h.setBits(static_cast<unsigned short>(bits));
    const float value = h;
    if (!(value == value)) continue;
    half next;
    next.setBits(static_cast<unsigned short>(bits + 1));
    const float middle = value + (static_cast<float>(next) - value) / 2;
    for (const float v : {value, middle, std::nextafter(middle, 1e9F),
                          std::nextafter(middle, -1e9F), std::nextafter(value, 1e9F)}) {
      if (v == v) values.push_back(v);
    }
  }
  for (const float v : {65519.996F, 65520.0F, 1e6F, 1e-8F, 2.98e-8F, 1e-40F}) values.push_back(v);
  values.resize(values.size() / 4 * 4);
  const auto count = static_cast<std::uint32_t>(values.size() / 4);
  std::vector<std::byte> bytes(values.size() * 2);
  convert({count, 1, 4, values}, PixelFormat::rgba16_float, bytes);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::uint16_t bits = 0;
    std::memcpy(&bits, &bytes[2 * i], 2);
    ASSERT_EQ(bits, half(values[i]).bits()) << values[i];
  }
}

TEST(Convert, WhatDoesNotFitIsNamed) {
  const Image image{3, 2, 3, std::vector<float>(18)};
  std::vector<std::byte> bytes(24);
  const auto id = [&](PixelFormat format, const ConvertOptions& options) {
    return id_of([&] { convert(image, format, bytes, options); });
  };
  EXPECT_EQ(id(PixelFormat::rgba8, {}), "");
  EXPECT_EQ(id(PixelFormat::rgba16, {}), "pixel-size");
  // The last row needs no padding: 12 bytes follow a first row of any length.
  EXPECT_EQ(id(PixelFormat::rgba8, {.row_bytes = 12}), "");
  EXPECT_EQ(id_of([&] { convert(image, PixelFormat::rgba8, std::span(bytes).first(23)); }),
            "pixel-size");
  bytes.resize(28);
  EXPECT_EQ(id(PixelFormat::rgba8, {.row_bytes = 16}), "");
  EXPECT_EQ(id(PixelFormat::rgba8, {.row_bytes = 17}), "pixel-size");
  bytes.resize(24);
  EXPECT_EQ(id(PixelFormat::rgba8, {.row_bytes = 11}), "pixel-size");
  EXPECT_EQ(id(PixelFormat::rgba8, {.row_bytes = 13}), "pixel-size");
  const std::vector<std::uint8_t> coverage(5);
  EXPECT_EQ(id(PixelFormat::rgba8, {.coverage = coverage}), "pixel-size");
  EXPECT_EQ(id(static_cast<PixelFormat>(9), {}), "pixel-format");
  EXPECT_EQ(id_of([&] { convert({3, 2, 3, {}}, PixelFormat::rgba8, bytes); }), "image-size");
  for (const std::uint32_t channels : {0U, 1U, 2U, 3U, 4U, 5U}) {
    const Image other{3, 2, channels, std::vector<float>(6 * channels)};
    EXPECT_EQ(id_of([&] { convert(other, PixelFormat::rgba8, bytes); }),
              channels >= 1 && channels <= 4 ? "" : "image-size")
        << channels;
  }
  EXPECT_EQ(id_of([&] { convert({0, 2, 3, {}}, PixelFormat::rgba8, bytes); }), "image-size");
}

std::vector<std::byte> bytes_of(const std::filesystem::path& path) {
  const std::string text = test::read_file(path);
  std::vector<std::byte> bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

TEST(InMemory, EncodeGivesTheFileOfSaveImage) {
  const std::filesystem::path folder = test::scratch_folder();
  Image image{37, 29, 3, {}};
  for (std::size_t i = 0; i < 37 * 29 * 3; ++i) {
    image.pixels.push_back(static_cast<float>(i % 101) / 101);
  }
  for (const ImageFormat format :
       {ImageFormat::exr_half, ImageFormat::exr_float, ImageFormat::png16, ImageFormat::png8}) {
    const bool exr = format == ImageFormat::exr_half || format == ImageFormat::exr_float;
    const SaveImageOptions options{.format = format, .dither = format == ImageFormat::png8};
    const auto path = folder / (exr ? "a.exr" : "a.png");
    save_image(image, path, options);
    const std::vector<std::byte> bytes = encode(image, options);
    EXPECT_EQ(bytes, bytes_of(path));
    EXPECT_EQ(load_image(bytes).pixels, load_image(path).pixels);
  }
}

TEST(InMemory, AMeshIsReadAsFromItsFile) {
  const std::filesystem::path path = test::scratch_folder() / "box.obj";
  save_obj(test::cube(), path);
  const std::vector<std::byte> bytes = bytes_of(path);
  const Mesh file = load_mesh(path);
  const Mesh memory = load_mesh(bytes, "box.obj");
  EXPECT_EQ(memory.name, "box");
  EXPECT_EQ(memory.positions, file.positions);
  EXPECT_EQ(memory.triangles, file.triangles);
  EXPECT_EQ(memory.uvs, file.uvs);
  EXPECT_EQ(memory.normals, file.normals);
  EXPECT_THROW(load_mesh(bytes, "box.fbx"), Error);
  EXPECT_THROW(load_mesh(bytes, "box.ply"), Error);
  EXPECT_THROW(load_mesh(std::span<const std::byte>(), "box.obj"), Error);
}

}  // namespace
}  // namespace kiln

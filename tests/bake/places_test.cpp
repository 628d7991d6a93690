// Places of meshes: vertices that no triangle uses change nothing, places keep their digits far from 0, and coordinates that
// are too coarse are told.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/mesh_view.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Place = std::array<float, 3>;

constexpr std::array<double, 3> kUtm = {500000, 4500000, 300};

BakeOptions asking(std::vector<MapKind> maps) {
  BakeOptions options;
  options.width = options.height = 32;
  options.maps = std::move(maps);
  return options;
}

std::uint64_t count(const std::vector<Warning>& warnings, std::string_view code) {
  for (const Warning& warning : warnings) {
    if (warning.code == code) return warning.count;
  }
  return 0;
}

std::string message(const std::vector<Warning>& warnings, std::string_view code) {
  for (const Warning& warning : warnings) {
    if (warning.code == code) return warning.message.text();
  }
  return {};
}

/// A plane that rises by a quarter along y, and one under it, in the caller's own memory.
struct Buffers {
  std::vector<Place> high = {
      {-0.4F, -0.4F, -0.1F}, {0.4F, -0.4F, -0.1F}, {0.4F, 0.4F, 0.1F}, {-0.4F, 0.4F, 0.1F}};
  std::vector<Place> low = {{-0.4F, -0.4F, 0}, {0.4F, -0.4F, 0}, {0.4F, 0.4F, 0}, {-0.4F, 0.4F, 0}};
  std::vector<std::array<float, 2>> uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::vector<std::uint32_t> of_high = {0, 1, 2, 0, 2, 3}, of_low = of_high;

  BakeResult bake(const BakeOptions& options) const {
    MeshView of{.positions = std::span(high), .indices = of_high, .name = "high"};
    MeshView onto{
        .positions = std::span(low), .indices = of_low, .uvs = std::span(uvs), .name = "low"};
    of.origin = onto.origin = kUtm;
    return kiln::bake(Source(*test::device(), to_mesh(of)), to_mesh(onto), options);
  }
};

TEST(Places, WhatNoTriangleUsesChangesNothing) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = asking({MapKind::normal, MapKind{"position"}, MapKind{"ao"}});
  options.encoding.space = NormalMapSpace::object;
  options.encoding.raw = true;
  const BakeResult plain = Buffers().bake(options);
  EXPECT_EQ(plain.report.missed, 0U);
  const float* normal = plain.maps[0].image.at(16, 16);
  EXPECT_NEAR(normal[0], 0, 1e-6);
  EXPECT_NEAR(normal[1], -1 / std::sqrt(17.0), 1e-6);
  EXPECT_NEAR(normal[2], 4 / std::sqrt(17.0), 1e-6);

  Buffers more;
  const Place zero = {-500000, -4500000, -300};
  for (const Place& p : {zero, Place{-1e6F, -1e6F, -3e6F}, Place{-2e6F, -2e6F, -6e6F}}) {
    more.high.push_back(p);
    more.low.push_back(p);
    more.uvs.push_back({0.5F, 0.5F});
  }
  const Place on_line = {-3e6F, -3e6F, -9e6F};
  more.high.push_back(on_line);
  more.low.push_back(on_line);
  more.uvs.push_back({0.5F, 0.5F});
  for (auto* indices : {&more.of_high, &more.of_low}) {
    indices->insert(indices->end(), {4, 4, 4, 0, 1, 0, 5, 6, 7});
  }
  const BakeResult same = more.bake(options);
  for (std::size_t m = 0; m < plain.maps.size(); ++m) {
    EXPECT_EQ(same.maps[m].image.pixels, plain.maps[m].image.pixels) << m;
    EXPECT_EQ(same.maps[m].origin, plain.maps[m].origin) << m;
  }
  EXPECT_EQ(same.report.missed, 0U);
  EXPECT_EQ(same.report.max_distance, plain.report.max_distance);  // a share of the diagonal
  EXPECT_EQ(count(same.report.warnings, "coarse-low"), 0U);
}

TEST(Places, PositionsAreMeasuredFromAnOriginThatIsTold) {
  KILN_REQUIRE_DEVICE();
  const auto check = [](const BakeResult& baked, const std::array<double, 3>& origin,
                        double tolerance) {
    const BakedMap& map = baked.map(MapKind{"position"});
    EXPECT_EQ(map.origin, origin);
    for (std::uint32_t y = 0; y < 32; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) {
        const double u = (x + 0.5) / 32 - 0.5, v = 0.5 - (y + 0.5) / 32;
        const std::array<double, 3> at = {500000 + 0.8 * u, 4500000 + 0.8 * v, 300 + 0.2 * v};
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_NEAR(map.origin[k] + double{map.image.at(x, y)[k]}, at[k], tolerance);
        }
      }
    }
  };
  BakeOptions options = asking({MapKind{"position"}});
  // Half of the last place of 0.5 in the frame, of a float around 0.5, and of the corners' floats.
  check(Buffers().bake(options), kUtm, 1.5e-7);
  options.encoding.origin = {499900, 4500100, 0};
  check(Buffers().bake(options), *options.encoding.origin, 2e-5);  // floats of 300
  options.encoding.origin = {0, 0, 0};
  check(Buffers().bake(options), {}, 0.25);  // of 4,500,000
  options.encoding.origin = {NAN, 0, 0};
  EXPECT_THROW(Buffers().bake(options), Error);
}

TEST(Places, NearMeshesHaveNoOrigin) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(5000);
  const BakeResult baked = bake(Source(*test::device(), high), test::BumpySphere::light(),
                                asking({MapKind{"position"}, MapKind::normal}));
  EXPECT_EQ(baked.maps[0].origin, (std::array<double, 3>{}));
  EXPECT_EQ(baked.maps[1].origin, (std::array<double, 3>{}));
}

/// A wavy sheet in floats at a place, without an origin.
Mesh sheet(const Place& at, float side) {
  Mesh mesh = test::plane(24, 24);
  for (Vec3& p : mesh.positions) {
    p = {at[0] + 24 * side * p.x, at[1] + 24 * side * p.y,
         at[2] + side * std::sin(170 * p.x) * std::cos(130 * p.y)};
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(Places, CoarseCoordinatesAreTold) {
  KILN_REQUIRE_DEVICE();
  const Place utm = {500000, 4500000, 300};
  const Mesh coarse = sheet(utm, 0.8F);
  const Source source(*test::device(), coarse);
  EXPECT_NE(message(source.warnings(), "coarse-source").find("steps of 0.5"), std::string::npos);
  const BakeResult baked = bake(source, coarse, asking({MapKind::normal}));
  EXPECT_EQ(count(baked.report.warnings, "coarse-low"), 1U);
  const Mesh fine = sheet({0, 0, 0}, 0.8F);
  EXPECT_EQ(message(Source(*test::device(), fine).warnings(), "coarse-source"), "");
}

TEST(Places, OutliersAreNamed) {
  KILN_REQUIRE_DEVICE();
  for (const float far : {1e6F, 1e7F}) {
    Mesh mesh = sheet({0, 0, 0}, 0.04F);
    mesh.positions.push_back({far, 0, 0});
    mesh.triangles.push_back({0, 1, 625});
    mesh.uvs.clear();
    mesh.uv_triangles.clear();
    const Source source(*test::device(), mesh);
    const std::string said = message(source.warnings(), "coarse-source");
    EXPECT_NE(said.find("Vertex 625"), std::string::npos) << said;
  }
}

TEST(Places, WhatIsRoundedAwayIsNotBlamedOnTheMesh) {
  KILN_REQUIRE_DEVICE();
  Mesh high = sheet({0, 0, 0}, 0.04F);
  const Mesh low = high;
  high.uvs.clear();
  high.uv_triangles.clear();
  high.positions.push_back({1e20F, 1e20F, 1e20F});
  high.triangles.push_back({0, 1, 625});
  try {
    const Source source(*test::device(), high);
    ADD_FAILURE() << "rounding leaves nothing of it";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("Vertex 625"), std::string::npos) << text;
  }
  high.positions.push_back({0, 1e20F, 0});
  high.triangles.back() = {0, 625, 626};
  const Source source(*test::device(), high);
  EXPECT_NE(message(source.warnings(), "source-rounded").find("1152 of them"), std::string::npos)
      << message(source.warnings(), "source-rounded");
  try {
    bake(source, low, asking({MapKind::normal}));
    ADD_FAILURE() << "rounding leaves nothing of the low poly";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("high poly, whose diagonal is 1.73e+20"), std::string::npos) << text;
  }
}

TEST(Places, FilesTellTheOrigin) {
  const std::array<double, 3> origin = {500000.25, -4500000, 0.1};
  const Image image{2, 1, 3, {0, 1, 1, 0, 0, 0}};
  const auto text_of = [&](ImageFormat format, bool with) {
    SaveImageOptions options{format};
    if (with) options.origin = origin;
    const std::vector<std::byte> bytes = encode(image, options);
    EXPECT_EQ(load_image(bytes, "image").pixels, image.pixels);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::string png = text_of(ImageFormat::png16, true);
  EXPECT_NE(png.find(std::string("tEXtOrigin") + '\0' + "500000.25 -4500000 0.10000000000000001"),
            std::string::npos);
  const std::string exr = text_of(ImageFormat::exr_half, true);
  const std::size_t at = exr.find(std::string("origin\0v3d\0\x18\0\0\0", 15));
  ASSERT_NE(at, std::string::npos);
  std::array<double, 3> back{};
  std::memcpy(back.data(), &exr[at + 15], sizeof back);
  EXPECT_EQ(back, origin);
  for (const ImageFormat format : {ImageFormat::png16, ImageFormat::exr_half}) {
    const std::string plain = text_of(format, false);
    EXPECT_EQ(plain.find("rigin"), std::string::npos);
  }
}

/// The texts (tEXt) of a PNG, keyword and text.
std::map<std::string, std::string> texts_of_png(const std::string& file) {
  std::map<std::string, std::string> texts;
  for (std::size_t at = 8; at + 8 <= file.size();) {  // chunks: length, name, data, checksum
    std::size_t size = 0;
    for (std::size_t k = 0; k < 4; ++k) size = size << 8 | static_cast<unsigned char>(file[at + k]);
    const std::string data = file.substr(at + 8, size);
    const std::size_t end = data.find('\0');
    if (file.substr(at + 4, 4) == "tEXt") texts[data.substr(0, end)] = data.substr(end + 1);
    at += 12 + size;
  }
  return texts;
}

TEST(Places, FilesTellTexts) {
  const Image image{2, 1, 1, {0, 1}};
  SaveImageOptions options{ImageFormat::png8};
  options.texts = {{"Range", "-0.5 0.5"}, {"Unit", "1 / world unit"}};
  options.origin = {1, 2, 3};
  const auto bytes_of = [&] {
    const std::vector<std::byte> bytes = encode(image, options);
    EXPECT_EQ(load_image(bytes, "image").pixels, image.pixels);
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  EXPECT_EQ(texts_of_png(bytes_of()),
            (std::map<std::string, std::string>{
                {"Origin", "1 2 3"}, {"Range", "-0.5 0.5"}, {"Unit", "1 / world unit"}}));
  options.format = ImageFormat::exr_float;
  const std::string exr = bytes_of();
  EXPECT_NE(exr.find(std::string("Unit\0string\0\x0e\0\0\0", 16) + "1 / world unit"),
            std::string::npos);
  const auto refuse = [&](ImageFormat format, const std::string& keyword, const std::string& text) {
    options.format = format;
    options.texts = {{keyword, text}};
    EXPECT_THROW(encode(image, options), Error) << keyword;
  };
  for (const ImageFormat format : {ImageFormat::png16, ImageFormat::exr_half}) {
    for (const char* keyword : {"", " Unit", "Unit ", "Un\nit"}) refuse(format, keyword, "m");
    refuse(format, std::string(80, 'a'), "m");
    refuse(format, "Unit", "\xc2\xb5m");
  }
  refuse(ImageFormat::exr_half, "channels", "m");  // OpenEXR's own
}

}  // namespace
}  // namespace kiln

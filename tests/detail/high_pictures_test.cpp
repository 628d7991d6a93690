// The high poly's pictures as they come: UDIM sets, two-channel normals, alpha, atlases without padding.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "base/srgb.h"
#include "image/gutter.h"
#include "kiln/bake.h"
#include "kiln/material.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

const Image& image_of(const BakeResult& result, std::string_view name) {
  for (const BakedMap& map : result.maps) {
    if (map.kind.name == name) return map.image;
  }
  throw std::runtime_error("no such map");
}

const Warning* warning_of(const BakeResult& result, std::string_view code) {
  for (const Warning& warning : result.report.warnings) {
    if (warning.code == code) return &warning;
  }
  return nullptr;
}

std::shared_ptr<const Image> plain(std::uint32_t side, std::vector<float> texel) {
  Image image{side, side, static_cast<std::uint32_t>(texel.size()), {}};
  for (std::size_t i = 0; i < std::size_t{side} * side; ++i) {
    image.pixels.insert(image.pixels.end(), texel.begin(), texel.end());
  }
  return std::make_shared<const Image>(std::move(image));
}

BakeOptions options_of(std::uint32_t side, std::vector<MapKind> maps = {MapKind::mask}) {
  BakeOptions options;
  options.width = options.height = side;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.5);
  options.encoding.gutter = 0;
  return options;
}

/// A square of two by one quads, the left one's UVs over the first square, the right one's over the next.
Mesh two_tiles() {
  Mesh mesh = test::plane(2, 1);
  for (Vec2& uv : mesh.uvs) uv.x *= 2;
  return mesh;
}

TEST(HighPictures, TilesShowOnTheirOwnSquares) {
  KILN_REQUIRE_DEVICE();
  Texture texture;
  texture.kind = TextureKind::linear;
  // Of different sizes; the set's own number is its second picture's.
  texture.images = {plain(16, {0.25F}), plain(64, {0.75F})};
  texture.tiles = {{0, 1002, 1}, {0, 1001, 0}};
  BakeOptions options = options_of(64);
  options.transfers = {{"tiles", texture}};
  const Mesh low = test::plane(1, 1);
  const BakeResult baked = bake(Source(*test::device(), two_tiles()), low, options);
  const Image& map = image_of(baked, "tiles");
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      // Up to the border: tiles do not repeat, nor do neighbours mix.
      ASSERT_EQ(map.at(x, y)[0], x < 32 ? 0.25F : 0.75F) << x << " " << y;
    }
  }
  EXPECT_EQ(warning_of(baked, "tile-missing"), nullptr);
  // Without the set the picture repeats.
  texture.tiles.clear();
  texture.images.resize(1);
  options.transfers = {{"tiles", texture}};
  EXPECT_EQ(
      image_of(bake(Source(*test::device(), two_tiles()), low, options), "tiles").at(60, 5)[0],
      0.25F);
}

/// Two materials with a picture each: of an atlas the dark half is background, of the other picture it is not.
TEST(HighPictures, EachPictureHasItsOwnBackground) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 1);
  high.material_names = {"left", "right"};
  high.materials = {0, 0, 1, 1};
  for (const std::uint32_t atlas : {0U, 1U}) {
    // Its material uses the left half of its picture, the other one all of it.
    Mesh mesh = high;
    mesh.uvs.clear();
    for (std::size_t t = 0; t < 4; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2& uv = high.uvs[high.uv_triangles[t][k]];
        const float u = 2 * uv.x - (t < 2 ? 0.0F : 1.0F);
        mesh.uvs.push_back({high.materials[t] == atlas ? u / 2 : u, uv.y});
        mesh.uv_triangles[t][k] = static_cast<std::uint32_t>(mesh.uvs.size() - 1);
      }
    }
    Image image{64, 64, 3, std::vector<float>(std::size_t{64} * 64 * 3)};
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) std::fill_n(image.at(x, y), 3, 0.8F);
    }
    Texture texture;
    texture.kind = TextureKind::linear;
    // Equal pictures, but not the same.
    texture.images = {std::make_shared<const Image>(image), std::make_shared<const Image>(image)};
    texture.image_of = {0, 1};
    BakeOptions options = options_of(32, {MapKind{"color"}});
    options.color = texture;
    const BakeResult baked = bake(Source(*test::device(), mesh), test::plane(1, 1), options);
    const Image& map = image_of(baked, "color");
    for (std::uint32_t x = 0; x < 32; ++x) {
      const bool is_atlas = (x < 16) == (atlas == 0);
      const std::uint32_t column = x % 16;
      if (!is_atlas && (column < 1 || column > 14 || (column > 6 && column < 9))) continue;
      EXPECT_NEAR(map.at(x, 9)[0], is_atlas || column < 8 ? 0.8F : 0, 1e-4) << atlas << " " << x;
    }
  }
}

TEST(HighPictures, TilesThatAreMissingAreNamed) {
  KILN_REQUIRE_DEVICE();
  Mesh high = two_tiles();
  high.material_names = {"skin"};
  high.materials.assign(high.triangles.size(), 0);
  Texture texture;
  texture.kind = TextureKind::linear;
  texture.images = {plain(8, {0.25F, 0, 0})};
  texture.tiles = {{0, 1001, 0}};
  texture.image_of = {0};
  texture.plain = {{0.5F, 0.5F, 0.5F, 1}};
  BakeOptions options = options_of(32);
  options.transfers = {{"tiles", texture}};
  const BakeResult baked = bake(Source(*test::device(), high), test::plane(1, 1), options);
  EXPECT_EQ(image_of(baked, "tiles").at(10, 10)[0], 0.25F);
  EXPECT_EQ(image_of(baked, "tiles").at(20, 10)[0], 0.5F);
  const Warning* const warning = warning_of(baked, "tile-missing");
  ASSERT_NE(warning, nullptr);
  EXPECT_EQ(warning->count, 2U);
  EXPECT_NE(warning->message.text().find("1002"), std::string::npos) << warning->message.text();
  EXPECT_EQ(warning->message.text().find("1001"), std::string::npos) << warning->message.text();
  // Beyond ten columns there is no tile.
  for (Vec2& uv : high.uvs) uv.x -= 3;
  const BakeResult beyond = bake(Source(*test::device(), high), test::plane(1, 1), options);
  EXPECT_NE(warning_of(beyond, "tile-missing")->message.text().find("beyond"), std::string::npos);
  texture.tiles.push_back({0, 1002, 7});
  options.transfers = {{"tiles", texture}};
  EXPECT_THROW(bake(Source(*test::device(), high), test::plane(1, 1), options), Error);
}

// (0.5, 0.3, 0.812), as decoders of BC5 leave it, and as DXT5nm has it.
TEST(HighPictures, NormalsOfTwoChannelsAreRebuilt) {
  KILN_REQUIRE_DEVICE();
  const double z = std::sqrt(1 - 0.25 - 0.09);
  const std::vector<std::vector<float>> kinds = {
      {0.75F, 0.65F, 0},    {0.75F, 0.65F, 1},
      {1, 0.65F, 1, 0.75F}, {0.65F, 0.65F, 0.65F, 0.75F},
      {0.75F, 0.65F},       {0.75F, 0.65F, static_cast<float>(z / 2 + 0.5)}};
  const Source source(*test::device(), test::plane(1, 1));
  for (const std::vector<float>& kind : kinds) {
    Texture texture;
    texture.kind = TextureKind::normal;
    texture.images = {plain(8, kind)};
    BakeOptions options = options_of(8);
    options.encoding.raw = true;
    options.transfers = {{"bumps", texture}};
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    const float* const n = image_of(baked, "bumps").at(3, 3);
    EXPECT_NEAR(n[0], 0.5, 1e-6);
    EXPECT_NEAR(n[1], 0.3, 1e-6);
    EXPECT_NEAR(n[2], z, 1e-6);
    EXPECT_EQ(warning_of(baked, "two-channel-normals") != nullptr, kind != kinds.back());
    options.transfers[0].texture.normal_format = NormalTextureFormat::two_channel_directx;
    const BakeResult down = bake(source, test::plane(1, 1), options);
    EXPECT_NEAR(image_of(down, "bumps").at(3, 3)[1], -0.3, 1e-6);
    EXPECT_EQ(warning_of(down, "two-channel-normals"), nullptr);  // it was said
    if (kind != kinds[1]) continue;
    options.transfers[0].texture.normal_format = NormalTextureFormat::opengl;
    const BakeResult as_is = bake(source, test::plane(1, 1), options);
    EXPECT_NEAR(image_of(as_is, "bumps").at(3, 3)[2], 1 / std::sqrt(1.34), 1e-6);
    EXPECT_NE(warning_of(as_is, "normal-map-channels"), nullptr);
  }
}

TEST(HighPictures, GreenThatPointsDownIsWarnedOf) {
  KILN_REQUIRE_DEVICE();
  Image image{64, 64, 3, {}};
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      const double u = x * 0.2, v = -0.15 * y;
      const double p = 0.8 * std::cos(u) * std::cos(v), q = -0.8 * std::sin(u) * std::sin(v);
      const double size = std::sqrt(1 + p * p + q * q);
      for (const double n : {-p / size, q / size, 1 / size}) {  // -y
        image.pixels.push_back(static_cast<float>(n / 2 + 0.5));
      }
    }
  }
  Texture texture;
  texture.kind = TextureKind::normal;
  texture.images = {std::make_shared<const Image>(image)};
  BakeOptions options = options_of(8);
  options.transfers = {{"bumps", texture}};
  const Source source(*test::device(), test::plane(1, 1));
  EXPECT_NE(warning_of(bake(source, test::plane(1, 1), options), "normal-map-green"), nullptr);
  options.transfers[0].texture.normal_format = NormalTextureFormat::directx;
  EXPECT_EQ(warning_of(bake(source, test::plane(1, 1), options), "normal-map-green"), nullptr);
}

/// Red stripes of one texel among transparent black ones.
Texture fence(bool weighted) {
  Image image{64, 64, 4, {}};
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const float is_there = i % 2 == 0 ? 1.0F : 0.0F;
    image.pixels.insert(image.pixels.end(), {is_there, 0.25F * is_there, 0, is_there});
  }
  Texture texture;
  texture.images = {std::make_shared<const Image>(image)};
  if (weighted) texture.weighted_by_alpha = {true};
  return texture;
}

TEST(HighPictures, TransparentTexelsHaveNoColour) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(1, 1));
  // Texels of the map on two, four and a third of the picture's.
  for (const std::uint32_t side : {32U, 16U, 192U}) {
    BakeOptions options = options_of(side, {MapKind{"color"}, MapKind{"opacity"}});
    options.color = fence(true);
    options.opacity = fence(false);
    options.opacity->kind = TextureKind::linear;
    options.opacity->channel = 3;
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    const float green = static_cast<float>(from_srgb(0.25));
    std::size_t seen = 0;
    for (std::size_t i = 0; i < baked.coverage.size(); ++i) {
      const float* const color = &image_of(baked, "color").pixels[3 * i];
      // What lies on a transparent texel alone, but for rounding, keeps that one's own colour.
      if (image_of(baked, "opacity").pixels[i] < 1e-3F) continue;
      ++seen;
      ASSERT_NEAR(color[0], 1, 1e-5) << side;
      ASSERT_NEAR(color[1], green, 1e-5) << side;  // linear light, until it is written
      if (side < 64) ASSERT_NEAR(image_of(baked, "opacity").pixels[i], 0.5, 0.01);
    }
    EXPECT_GT(seen, baked.coverage.size() / 3) << side;
    options.samples = 3;
    EXPECT_NEAR(image_of(bake(source, test::plane(1, 1), options), "color").at(4, 3)[0], 1, 1e-4);
    options.samples = 1;
    options.color = fence(false);
    const BakeResult mixed = bake(source, test::plane(1, 1), options);
    EXPECT_LT(image_of(mixed, "color").at(side / 2, side / 2)[0], 0.99F);
  }
}

/// A bright chart in the left half of an atlas, with `outside` beyond it.
Texture atlas(float outside, TextureKind kind, std::uint32_t channels = 3) {
  Image image{64, 64, channels, {}};
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    for (std::uint32_t c = 0; c < channels; ++c) {
      image.pixels.push_back(i % 64 < 32 ? 0.8F : c == 3 && outside > 0 ? 1.0F : outside);
    }
  }
  Texture texture;
  texture.kind = kind;
  texture.images = {std::make_shared<const Image>(image)};
  return texture;
}

TEST(HighPictures, AtlasesWithoutPaddingLeaveNoSeams) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1);
  for (Vec2& uv : high.uvs) uv.x /= 2;
  const Source source(*test::device(), high);
  const Mesh low = test::plane(1, 1);
  for (const std::uint32_t side : {8U, 64U, 256U}) {
    for (const float outside : {0.0F, 1.0F}) {
      BakeOptions options = options_of(side, {MapKind{"color"}, MapKind{"opacity"}});
      options.color = atlas(outside, TextureKind::linear);
      options.opacity = atlas(0, TextureKind::linear, 4);
      options.opacity->channel = 3;
      options.transfers = {{"rough", atlas(outside, TextureKind::linear, 1)}};
      const BakeResult baked = bake(source, low, options);
      for (const char* const name : {"color", "opacity", "rough"}) {
        for (const float value : image_of(baked, name).pixels) {
          ASSERT_NEAR(value, 0.8F, 1e-5) << name << side << outside;
        }
      }
      options.fill_high = false;
      const BakeResult bare = bake(source, low, options);
      const float edge = image_of(bare, "color").at(side - 1, side / 2)[0];
      // Texels of four of the picture's end where the chart does: no filter reaches beyond it.
      if (side > 8) EXPECT_GT(std::abs(edge - 0.8F), 0.01F) << side << outside;
    }
  }
  // Used whole: the dark half is no background.
  const Source tiled(*test::device(), test::plane(1, 1));
  BakeOptions options = options_of(64, {MapKind{"color"}});
  options.color = atlas(0, TextureKind::linear);
  const BakeResult with = bake(tiled, low, options);
  options.fill_high = false;
  EXPECT_EQ(image_of(with, "color").pixels, image_of(bake(tiled, low, options), "color").pixels);
  EXPECT_EQ(image_of(with, "color").at(60, 5)[0], 0);
}

// Faces on cells of a palette, each chart a point or less than a texel: black cells that no face uses are around black
// ones that some do.
TEST(HighPictures, CellsOfAPaletteAreNoBackground) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 1);
  Image palette{8, 8, 3, std::vector<float>(8 * 8 * 3)};
  for (std::size_t c = 0; c < 3; ++c) palette.at(3, 3)[c] = 0.8F;
  high.uvs.clear();
  for (std::size_t t = 0; t < high.triangles.size(); ++t) {
    // The left half on the bright cell's centre, the right one on the black cell beside it, off its centre.
    float x = 0;
    for (const std::uint32_t v : high.triangles[t]) x += high.positions[v].x / 3;
    for (std::size_t k = 0; k < 3; ++k) {
      high.uv_triangles[t][k] = static_cast<std::uint32_t>(high.uvs.size());
      high.uvs.push_back(x < 0 ? Vec2{3.5F / 8, 1 - 3.5F / 8} : Vec2{4.3F / 8, 1 - 3.5F / 8});
    }
  }
  Texture texture;
  texture.kind = TextureKind::linear;
  texture.images = {std::make_shared<const Image>(palette)};
  BakeOptions options = options_of(32);
  options.transfers = {{"cells", texture}};
  const Source source(*test::device(), high);
  const BakeResult baked = bake(source, test::plane(1, 1), options);
  EXPECT_NEAR(image_of(baked, "cells").at(5, 15)[0], 0.8F, 1e-4);
  // 0.8 texels from the bright cell's centre.
  EXPECT_NEAR(image_of(baked, "cells").at(25, 15)[0], 0.2 * 0.8, 1e-4);
}

TEST(HighPictures, AnAtlasOfNormalsKeepsItsTilts) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1);
  for (Vec2& uv : high.uvs) uv.x /= 2;
  Image image{64, 64, 3, {}};
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const bool in = i % 64 < 32;
    image.pixels.insert(image.pixels.end(), {in ? 0.8F : 0.5F, 0.5F, in ? 0.9F : 1.0F});
  }
  Texture texture;
  texture.kind = TextureKind::normal;
  texture.images = {std::make_shared<const Image>(image)};
  BakeOptions options = options_of(64);
  options.encoding.raw = true;
  options.transfers = {{"bumps", texture}};
  const BakeResult baked = bake(Source(*test::device(), high), test::plane(1, 1), options);
  for (std::uint32_t x = 0; x < 64; ++x) {
    EXPECT_NEAR(image_of(baked, "bumps").at(x, 30)[0], 0.6, 1e-5) << x;
  }
}

TEST(HighPictures, TransparentPartsOfTilesAreCutOff) {
  const Mesh high = two_tiles();
  Texture opacity;
  opacity.kind = TextureKind::linear;
  opacity.images = {plain(16, {1.0F}), plain(16, {0.0F})};
  opacity.tiles = {{0, 1001, 0}, {0, 1002, 1}};
  CutOutReport report;
  const Mesh cut = cut_out(high, opacity, 0.5, &report);
  EXPECT_EQ(report.whole, 2U);
  EXPECT_EQ(report.gone, 2U);
  for (const Triangle& triangle : cut.triangles) {
    for (const std::uint32_t v : triangle) EXPECT_LE(cut.positions[v].x, 1e-6F);
  }
  // One triangle over both squares is cut along the line between them.
  Mesh wide = test::plane(1, 1);
  for (Vec2& uv : wide.uvs) uv.x *= 2;
  const Mesh half = cut_out(wide, opacity, 0.5, &report);
  EXPECT_EQ(report.cut, 2U);
  for (const Triangle& triangle : half.triangles) {
    for (const std::uint32_t v : triangle) EXPECT_LE(half.positions[v].x, 1.0F / 1024);
  }
}

/// Up to eight missing tiles are named, the others counted, and UVs that no tile can hold stand apart.
TEST(HighPictures, ManyMissingTilesAreCounted) {
  KILN_REQUIRE_DEVICE();
  const auto message_of = [](std::uint32_t columns, bool one_beyond, std::uint64_t* count) {
    Mesh high = test::plane(columns, 1);
    // One square each; none of their UVs is shared.
    std::vector<Vec2> uvs;
    for (std::size_t t = 0; t < high.triangles.size(); ++t) {
      const auto tile = static_cast<float>(t / 2);
      for (std::size_t k = 0; k < 3; ++k) {
        Vec2 uv{tile + 0.25F + 0.25F * static_cast<float>(k % 2),
                0.25F + 0.25F * static_cast<float>(k / 2)};
        if (one_beyond && t + 1 == high.triangles.size()) uv.y -= 3;
        high.uv_triangles[t][k] = static_cast<std::uint32_t>(uvs.size());
        uvs.push_back(uv);
      }
    }
    high.uvs = uvs;
    high.material_names = {"skin"};
    high.materials.assign(high.triangles.size(), 0);
    Texture texture;
    texture.kind = TextureKind::linear;
    texture.images = {plain(2, {0.25F})};
    texture.tiles = {{0, 1001, 0}};
    texture.image_of = {0};
    BakeOptions options = options_of(16);
    options.transfers = {{"tiles", texture}};
    const BakeResult baked = bake(Source(*test::device(), high), test::plane(1, 1), options);
    const Warning* const warning = warning_of(baked, "tile-missing");
    if (warning == nullptr) return std::string();
    *count = warning->count;
    return warning->message.text();
  };
  std::uint64_t count = 0;
  EXPECT_EQ(message_of(1, false, &count), "");
  EXPECT_EQ(message_of(1, true, &count),
            "The texture of the map tiles has no picture for 1 triangle of the high poly (UVs "
            "beyond all tiles): it gets its material's constant value there, or 0. Put the missing "
            "pictures beside the others.");
  EXPECT_EQ(count, 1U);
  EXPECT_NE(message_of(9, false, &count)
                .find("for 16 triangles of the high poly (UDIM 1002, 1003, 1004, 1005, 1006, 1007, "
                      "1008, 1009): these get their material's"),
            std::string::npos);
  EXPECT_EQ(count, 16U);
  EXPECT_NE(message_of(10, true, &count)
                .find("for 18 triangles of the high poly (UDIM 1002, 1003, 1004, 1005, 1006, 1007, "
                      "1008, 1009 and 1 more, and UVs beyond all tiles): these"),
            std::string::npos)
      << message_of(10, true, &count);
}

}  // namespace
}  // namespace kiln

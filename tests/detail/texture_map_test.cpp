// Maps of colours and textures of the high poly.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/memory.h"
#include "base/srgb.h"
#include "image/gutter.h"
#include "kiln/bake.h"
#include "kiln/limits.h"
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

BakeOptions options_of(std::uint32_t width, std::uint32_t height, std::vector<MapKind> maps) {
  BakeOptions options;
  options.width = width;
  options.height = height;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.5);
  options.encoding.gutter = 0;
  return options;
}

Texture texture_of(Image image, TextureKind kind) {
  Texture texture;
  texture.kind = kind;
  texture.images = {std::make_shared<const Image>(std::move(image))};
  return texture;
}

Image checkerboard(std::uint32_t side, std::uint32_t cell) {
  Image image{side, side, 3, std::vector<float>(std::size_t{side} * side * 3)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const std::size_t x = i / 3 % side, y = i / 3 / side;
    image.pixels[i] = static_cast<float>((x / cell + y / cell) % 2);
  }
  return image;
}

/// The mean of the square wave that is -1 on [0, 1), 1 on [1, 2) and so on, over [begin, end].
double wave(double begin, double end) {
  const auto integral = [](double x) {
    const double turn = x - 2 * std::floor(x / 2);
    return turn < 1 ? -turn : turn - 2;
  };
  return (integral(end) - integral(begin)) / (end - begin);
}

/// Root of the mean square against the integrals of a checkerboard of `cells` by `cells` squares, which the high
/// poly's UVs repeat `repeats` times along u.
double error_of(const Image& map, double cells, double repeats) {
  double squares = 0;
  for (std::uint32_t y = 0; y < map.height; ++y) {
    for (std::uint32_t x = 0; x < map.width; ++x) {
      const double across =
          wave(x * cells * repeats / map.width, (x + 1) * cells * repeats / map.width);
      const double down = wave(y * cells / map.height, (y + 1) * cells / map.height);
      const double error = map.at(x, y)[0] - (0.5 - 0.5 * across * down);
      squares += error * error;
    }
  }
  return std::sqrt(squares / map.width / map.height);
}

// A file's picture decides what that takes: it is no stage of the bake that ran out.
TEST(TextureMaps, WhoseFilteringTakesTooMuchIsAnInputError) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = options_of(16, 16, {MapKind::mask});
  options.transfers = {{"picture", texture_of(checkerboard(2048, 8), TextureKind::srgb)}};
  const Source source(*test::device(), test::plane(1, 1));
  EXPECT_NO_THROW(bake(source, test::plane(1, 1), options));
  memory_fits(
      std::numeric_limits<std::uint64_t>::max());  // gives back what earlier tests have freed
  // 48 MiB of floats are copied, and a third of them more are the levels.
  for (std::uint64_t limit = 1U << 26U;; limit += 1U << 22U) {
    set_memory_limit(limit);
    if (memory_left() >= std::uint64_t{40} << 20U) break;
  }
  try {
    bake(source, test::plane(1, 1), options);
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_NE(std::string(error.what()).find("texture of the map picture would take 64 MiB"),
              std::string::npos)
        << error.what();
  }
  set_memory_limit(0);
}

TEST(TextureMaps, ACheckerboardIsIntegratedOverEachTexel) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::plane(3, 3);
  for (const double repeats : {1.0, 6.0}) {
    Mesh high = test::plane(8, 5);
    for (Vec2& uv : high.uvs) uv.x *= static_cast<float>(repeats);
    const Source source(*test::device(), high);
    BakeOptions options = options_of(45, 60, {MapKind::mask});
    options.transfers = {{"board", texture_of(checkerboard(512, 32), TextureKind::linear)}};
    const BakeResult baked = bake(source, low, options);
    const Image& map = image_of(baked, "board");
    ASSERT_EQ(map.channels, 1U);  // of a grey picture
    EXPECT_EQ(std::count(baked.coverage.begin(), baked.coverage.end(), kCoverageBaked), 45 * 60);
    EXPECT_LT(error_of(map, 16, repeats), 0.02) << repeats;
    // It tells right from wrong: where squares are as wide as texels, points are black or white.
    options.samples = 3;
    EXPECT_LT(error_of(image_of(bake(source, low, options), "board"), 16, repeats), 0.02);
  }
}

TEST(TextureMaps, ATextureMayHaveAPictureForEachMaterial) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 1);
  high.material_names = {"left", "right", "plain"};
  high.materials = {0, 0, 1, 2};
  const Source source(*test::device(), high);
  Image half{1, 1, 4, {0.25F, 0.5F, 0.75F, 0.5F}}, full{1, 1, 3, {1, 0, 0}};
  BakeOptions options = options_of(8, 8, {MapKind{"color"}, MapKind{"opacity"}});
  Texture texture;
  texture.kind = TextureKind::linear;
  texture.images = {std::make_shared<const Image>(half), std::make_shared<const Image>(full)};
  texture.image_of = {0, 1, Texture::kNone};
  texture.plain = {{}, {}, {0.1F, 0.2F, 0.3F, 0.4F}};
  options.color = texture;
  options.opacity = texture;
  options.opacity->channel = 3;
  const BakeResult baked = bake(source, test::plane(1, 1), options);
  const Image &color = image_of(baked, "color"), &opacity = image_of(baked, "opacity");
  EXPECT_NEAR(color.at(0, 7)[2], 0.75F, 1e-6F);
  EXPECT_NEAR(*opacity.at(0, 7), 0.5F, 1e-6F);
  // The right square is cut from its lower left to its upper right; below it is the first triangle.
  EXPECT_NEAR(color.at(7, 6)[0], 1, 1e-6F);
  EXPECT_NEAR(*opacity.at(7, 6), 1, 1e-6F);
  EXPECT_NEAR(color.at(4, 0)[1], 0.2F, 1e-6F);
  EXPECT_NEAR(*opacity.at(4, 0), 0.4F, 1e-6F);
  options.color->image_of = {0, 1};
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
}

/// One picture, dark on the left, over the square beside the picture's own.
TEST(TextureMaps, EachMaterialWrapsByItself) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 1);
  for (Vec2& uv : high.uvs) uv.x = 2 * uv.x + 1;
  high.material_names = {"left", "right"};
  high.materials = {0, 0, 1, 1};
  Image halves{32, 32, 3, std::vector<float>(std::size_t{32} * 32 * 3)};
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 16; x < 32; ++x) std::fill_n(halves.at(x, y), 3, 1.0F);
  }
  Texture texture = texture_of(std::move(halves), TextureKind::linear);
  texture.image_of = {0, 0};
  using Wraps = std::array<TextureWrap, 2>;
  const Wraps wraps[] = {{TextureWrap::repeat, TextureWrap::repeat},
                         {TextureWrap::clamp, TextureWrap::repeat},
                         {TextureWrap::mirror, TextureWrap::repeat}};
  // What the three show at the quarter and at three quarters of the first square beside, and of the second.
  const float shown[3][4] = {{0, 1, 0, 1}, {1, 1, 1, 1}, {1, 0, 0, 1}};
  for (std::size_t left = 0; left < 3; ++left) {
    const std::size_t right = (left + 1) % 3;
    texture.wraps = {wraps[left], wraps[right]};
    BakeOptions options = options_of(16, 16, {MapKind{"color"}});
    options.color = texture;
    const Image map =
        image_of(bake(Source(*test::device(), high), test::plane(1, 1), options), "color");
    for (std::uint32_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(map.at(4 * i + 1, 8)[0], shown[i < 2 ? left : right][i], 1e-3) << left << i;
      EXPECT_NEAR(map.at(4 * i + 2, 8)[0], shown[i < 2 ? left : right][i], 1e-3) << left << i;
    }
  }
}

/// Plain materials need no layout, and where a part has none, its material's number stands for the picture.
TEST(TextureMaps, PlainMaterialsNeedNoUvs) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 1);
  high.uvs.clear();
  high.uv_triangles.clear();
  high.material_names = {"a", "b"};
  high.materials = {0, 0, 1, 1};
  BakeOptions options = options_of(8, 8, {MapKind{"color"}});
  Texture texture;
  texture.image_of = {Texture::kNone, Texture::kNone};
  texture.plain = {{0.1F, 0.2F, 0.3F, 1}, {0.5F, 0.6F, 0.7F, 1}};
  options.color = texture;
  const auto color = [&] {
    return image_of(bake(Source(*test::device(), high), test::plane(1, 1), options), "color");
  };
  EXPECT_NEAR(color().at(0, 4)[1], 0.2F, 1e-6F);
  EXPECT_NEAR(color().at(7, 4)[1], 0.6F, 1e-6F);
  options.color->images = {std::make_shared<const Image>(Image{1, 1, 3, {1, 0, 0}})};
  options.color->image_of = {0, 0};
  EXPECT_THROW(color(), Error);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  high.uvs = {{0.5F, 0.5F}, {kNaN, kNaN}};
  high.uv_triangles = {{0, 0, 0}, {0, 0, 0}, {1, 1, 1}, {1, 1, 1}};
  EXPECT_NEAR(color().at(0, 4)[0], 1, 1e-6F);
  EXPECT_NEAR(color().at(7, 4)[1], 0.6F, 1e-6F);
}

TEST(TextureMaps, APictureMayLieMovedOnTheUvs) {
  KILN_REQUIRE_DEVICE();
  // The same as UVs that are moved themselves, which rounding to float tells apart alone.
  const std::array<float, 6> m{0.5F, -0.75F, 0.25F, 1.5F, 0.25F, -0.5F};
  Mesh plain = test::plane(8, 5), moved = plain;
  for (Mesh* mesh : {&plain, &moved}) {
    mesh->material_names = {"all"};
    mesh->materials.assign(mesh->triangles.size(), 0);
  }
  for (Vec2& uv : moved.uvs) {
    uv = {m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]};
  }
  Texture texture = texture_of(checkerboard(512, 32), TextureKind::linear);
  texture.image_of = {0};
  const auto board = [](const Mesh& high, const Texture& picture) {
    const Source source(*test::device(), high);
    BakeOptions options = options_of(45, 60, {MapKind::mask});
    options.transfers = {{"board", picture}};
    return image_of(bake(source, test::plane(3, 3), options), "board").pixels;
  };
  const std::vector<float> wanted = board(moved, texture), unmoved = board(plain, texture);
  texture.uv_transforms = {m};
  const std::vector<float> got = board(plain, texture);
  // Squares are 3 texels wide or more: a UV off by 1e-6 moves 1e-4 of a texel over an edge. Filters' levels and
  // probes may change with the last bit: 1e-2 is left for them.
  double most = 0, apart = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    most = std::max(most, std::abs(double{got[i]} - wanted[i]));
    apart = std::max(apart, std::abs(double{unmoved[i]} - wanted[i]));
  }
  EXPECT_LT(most, 1e-2);
  EXPECT_GT(apart, 0.5);
  texture.uv_transforms = {m, m};
  EXPECT_THROW(board(plain, texture), Error);
}

/// Two materials whose pictures lie on two sets of UVs, beside a mesh whose only UVs are those of each.
TEST(TextureMaps, APictureLiesOnTheSetOfUvsThatItNames) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(3, 2);
  high.material_names = {"first", "second"};
  for (std::size_t t = 0; t < high.triangles.size(); ++t) high.materials.push_back(t % 2);
  // The other set is sheared, mirrored and moved.
  std::vector<Vec2> other = high.uvs;
  for (Vec2& uv : other) uv = {0.25F - 0.75F * uv.x + 0.5F * uv.y, 0.5F * uv.x + 0.875F * uv.y};
  Mesh merged = high;  // each triangle with the UVs that its material's picture lies on
  merged.uvs.clear();
  for (std::size_t t = 0; t < high.triangles.size(); ++t) {
    for (std::uint32_t& corner : merged.uv_triangles[t]) {
      merged.uvs.push_back((high.materials[t] == 0 ? high.uvs : other)[corner]);
      corner = static_cast<std::uint32_t>(merged.uvs.size() - 1);
    }
  }
  Mesh both = high;
  both.other_uvs = {{7, std::vector<Vec2>(3)}, {2, other}};
  const auto baked = [&](const Mesh& mesh, TextureKind kind, std::vector<std::uint32_t> sets) {
    Texture texture = texture_of(checkerboard(256, 16), kind);
    if (kind == TextureKind::normal) texture = texture_of({1, 1, 3, {0.8F, 0.5F, 0.9F}}, kind);
    texture.image_of = {0, 0};
    texture.uv_sets = std::move(sets);
    const Source source(*test::device(), mesh);
    BakeOptions options = options_of(45, 60, {MapKind{"color"}});
    options.encoding.space = NormalMapSpace::object;
    options.color = texture;
    options.color->kind = TextureKind::srgb;
    options.transfers = {{"board", texture}};
    const BakeResult result = bake(source, test::plane(3, 3), options);
    std::vector<float> values = image_of(result, "board").pixels;
    const std::vector<float>& colors = image_of(result, "color").pixels;
    values.insert(values.end(), colors.begin(), colors.end());
    return values;
  };
  for (const TextureKind kind : {TextureKind::linear, TextureKind::normal}) {
    const std::vector<float> wanted = baked(merged, kind, {});
    const std::vector<float> got = baked(both, kind, {0, 2}), own = baked(both, kind, {});
    double most = 0, apart = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      most = std::max(most, std::abs(double{got[i]} - wanted[i]));
      apart = std::max(apart, std::abs(double{own[i]} - wanted[i]));
    }
    // As above: a UV off by its last bits may change levels and probes of a filter.
    EXPECT_LT(most, 1e-2);
    EXPECT_GT(apart, 0.3);
  }
  EXPECT_THROW(baked(both, TextureKind::linear, {0, 3}), Error) << "no such set";
  EXPECT_THROW(baked(both, TextureKind::linear, {0, 7}), Error) << "one that does not fit";
  EXPECT_THROW(baked(both, TextureKind::linear, {0}), Error);
}

/// A normal map's tangents are those of the UVs that it lies on: turned UVs turn the normals.
TEST(TextureMaps, ANormalMapOnTurnedUvsTurnsItsTangents) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 2);
  high.material_names = {"all"};
  high.materials.assign(high.triangles.size(), 0);
  const Source source(*test::device(), high);
  // Leans to +u of the picture by 0.6 of its length, in all texels.
  Texture texture = texture_of({1, 1, 3, {0.8F, 0.5F, 0.9F}}, TextureKind::normal);
  texture.image_of = {0};
  const auto lean = [&](const std::array<float, 6>& m) {
    texture.uv_transforms = {m};
    BakeOptions options = options_of(4, 4, {MapKind::mask});
    options.encoding.space = NormalMapSpace::object;
    options.transfers = {{"normals", texture}};
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    const float* const n = image_of(baked, "normals").at(2, 1);
    return std::array<float, 3>{2 * n[0] - 1, 2 * n[1] - 1, 2 * n[2] - 1};
  };
  const auto expect = [&](const std::array<float, 6>& m, double x, double y) {
    const std::array<float, 3> found = lean(m);
    EXPECT_NEAR(found[0], x, 1e-5);
    EXPECT_NEAR(found[1], y, 1e-5);
    EXPECT_NEAR(found[2], 0.8, 1e-5);
  };
  // The plane's u runs along x, its v along y. The picture's u' = m[0] u + m[1] v grows along (m[0], m[1]) where
  // its other axis stands still: along the first column of the inverse.
  expect({1, 0, 0, 0, 1, 0}, 0.6, 0);
  expect({0, 1, 0, -1, 0, 1}, 0, 0.6);
  expect({0, -1, 0, 1, 0, 0}, 0, -0.6);
  expect({-1, 0, 1, 0, 1, 0}, -0.6, 0);
  expect({3, 0, 0, 0, 7, 0}, 0.6, 0);
  const float half = 0.5F, root = std::sqrt(0.75F);  // 60 degrees
  expect({half, -root, 0, root, half, 0}, 0.3, -0.6 * std::sqrt(0.75));
}

/// A material's factor counts after the filter, in linear light; of normals, as glTF's scale.
TEST(TextureMaps, MaterialsTintOnePicture) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1);
  high.material_names = {"tinted", "turned"};
  high.materials = {0, 1};
  const Source source(*test::device(), high);
  BakeOptions options = options_of(8, 8, {MapKind{"color"}});
  options.encoding.space = NormalMapSpace::object;
  Texture texture = texture_of({1, 1, 3, {0.2F, 0.6F, 0.8F}}, TextureKind::srgb);
  texture.image_of = {0, 0};
  texture.factors = {{{0.5F, 0.25F, 3, 1}, 0}, {{-0.5F, -0.5F, -0.5F, 1}, 1}};
  options.color = texture;
  Texture normals = texture_of({1, 1, 3, {0.8F, 0.5F, 0.9F}}, TextureKind::normal);
  normals.image_of = {0, 0};
  normals.factors = {{{2, 2, 1, 1}, 0}, {}};
  options.transfers = {{"normals", normals}};
  const BakeResult baked = bake(source, test::plane(1, 1), options);
  const Image &color = image_of(baked, "color"), &normal = image_of(baked, "normals");
  EXPECT_NEAR(color.at(7, 6)[0], 0.5 * from_srgb(0.2), 1e-6);
  EXPECT_NEAR(color.at(7, 6)[1], 0.25 * from_srgb(0.6), 1e-6);
  EXPECT_NEAR(color.at(7, 6)[2], 3 * from_srgb(0.8), 1e-6);
  EXPECT_NEAR(color.at(0, 1)[1], 1 - 0.5 * from_srgb(0.6), 1e-6);
  // (0.6, 0, 0.8) becomes (1.2, 0, 0.8), of length sqrt(2.08).
  EXPECT_NEAR(2 * normal.at(7, 6)[0] - 1, 1.2 / std::sqrt(2.08), 1e-5);
  EXPECT_NEAR(2 * normal.at(0, 1)[0] - 1, 0.6, 1e-5);
  options.color->factors.pop_back();
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
}

TEST(TextureMaps, ColoursAreMultipliedWithThoseOfVerticesWhereAsked) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1);
  high.material_names = {"tinted", "plain"};
  high.materials = {0, 1};
  high.colors.assign(high.positions.size(), {128, 255, 0, 51});
  const Source source(*test::device(), high);
  BakeOptions options = options_of(8, 8, {MapKind{"color"}, MapKind{"opacity"}});
  Texture texture;
  texture.image_of = {Texture::kNone, Texture::kNone};
  texture.plain = {{0.5F, 0.25F, 1, 0.5F}, {0.5F, 0.25F, 1, 0.5F}};
  texture.times_vertex_colors = {true, false};
  options.color = texture;
  texture.kind = TextureKind::linear;
  texture.channel = 3;
  options.opacity = texture;
  const BakeResult baked = bake(source, test::plane(1, 1), options);
  const Image &color = image_of(baked, "color"), &opacity = image_of(baked, "opacity");
  const double light = from_srgb(128 / 255.0);
  EXPECT_NEAR(color.at(7, 6)[0], 0.5 * light, 1e-6);
  EXPECT_NEAR(color.at(7, 6)[1], 0.25, 1e-6);
  EXPECT_EQ(color.at(7, 6)[2], 0);
  EXPECT_NEAR(*opacity.at(7, 6), 0.1, 1e-6);
  EXPECT_NEAR(color.at(0, 1)[0], 0.5, 1e-6);
  EXPECT_NEAR(*opacity.at(0, 1), 0.5, 1e-6);
  options.color->times_vertex_colors = {true};
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
}

TEST(TextureMaps, VertexColoursAreInterpolatedInLinearLight) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1);
  for (const Vec3& p : high.positions) {
    const auto byte = static_cast<std::uint8_t>(p.x > 0 ? 255 : 64);
    high.colors.push_back({byte, byte, 0, p.y > 0 ? std::uint8_t{255} : std::uint8_t{0}});
  }
  const Source source(*test::device(), high);
  const BakeResult baked =
      bake(source, test::plane(1, 1),
           options_of(32, 32, {MapKind{"vertex_color"}, MapKind{"color"}, MapKind{"opacity"}}));
  const double dark = linear_values_of_bytes()[64];
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x) {
      const double right = (x + 0.5) / 32, up = 1 - (y + 0.5) / 32;
      EXPECT_NEAR(image_of(baked, "vertex_color").at(x, y)[1], dark + (1 - dark) * right, 1e-6);
      EXPECT_NEAR(*image_of(baked, "opacity").at(x, y), up, 1e-6);
    }
  }
  EXPECT_EQ(image_of(baked, "vertex_color").pixels, image_of(baked, "color").pixels);
  EXPECT_EQ(find_map("color").type, MapType::color);
  EXPECT_THROW(bake(Source(*test::device(), test::plane(1, 1)), test::plane(1, 1),
                    options_of(8, 8, {MapKind{"vertex_color"}})),
               Error);
}

TEST(TextureMaps, WhatWasMissedIsFilled) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(1, 1, 0.5, 1);  // the middle half
  high.colors.assign(high.positions.size(), {255, 255, 255, 255});
  const Source source(*test::device(), high);
  BakeOptions options = options_of(32, 32, {MapKind{"vertex_color"}});
  const BakeResult baked = bake(source, test::plane(1, 1), options);
  EXPECT_GT(std::count(baked.coverage.begin(), baked.coverage.end(), kCoverageMissed), 400);
  for (const float value : image_of(baked, "vertex_color").pixels) EXPECT_EQ(value, 1);
  options.encoding.miss = MissPolicy::mark;
  EXPECT_EQ(image_of(bake(source, test::plane(1, 1), options), "vertex_color").at(0, 0)[1], 0);
}

/// A card with leaves over and under it: rectangles, in texels of 32 from the upper left, and how opaque each is.
struct Leaf {
  double left, top, right, bottom;
  float height;
  std::uint8_t alpha;
};
constexpr Leaf kLeaves[] = {{3.25, 2.5, 17.75, 9.25, 0.05F, 255},
                            {11.5, 14.0, 29.25, 21.75, -0.03F, 102},
                            {20.5, 25.75, 20.75, 30.0, 0.2F, 255}};

Mesh leaves() {
  Mesh mesh;
  mesh.name = "leaves";
  for (const Leaf& leaf : kLeaves) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const auto at = [](double texels) { return static_cast<float>(texels / 32 - 0.5); };
    mesh.positions.insert(mesh.positions.end(), {{at(leaf.left), -at(leaf.bottom), leaf.height},
                                                 {at(leaf.right), -at(leaf.bottom), leaf.height},
                                                 {at(leaf.right), -at(leaf.top), leaf.height},
                                                 {at(leaf.left), -at(leaf.top), leaf.height}});
    mesh.colors.resize(mesh.positions.size(), {200, 100, 50, leaf.alpha});
    mesh.triangles.insert(mesh.triangles.end(),
                          {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  }
  return mesh;
}

/// Opacity over a texel's square: exact, since borders lie between samples of a quarter texel.
double opacity_of_leaves(std::uint32_t x, std::uint32_t y) {
  double sum = 0;
  for (const Leaf& leaf : kLeaves) {
    const double across = std::min(leaf.right, x + 1.0) - std::max(leaf.left, x + 0.0);
    const double down = std::min(leaf.bottom, y + 1.0) - std::max(leaf.top, y + 0.0);
    sum += std::max(across, 0.0) * std::max(down, 0.0) * leaf.alpha / 255.0;
  }
  return sum;
}

/// A card is transparent beside its leaf, whatever becomes of other maps there; at borders it is by the share.
TEST(TextureMaps, OpacityIsNoneWhereNothingIs) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), leaves());
  BakeOptions options = options_of(32, 32, {MapKind{"opacity"}, MapKind{"color"}, MapKind::mask});
  options.samples = 4;
  options.encoding.mips = true;
  for (const MissPolicy miss : {MissPolicy::keep, MissPolicy::fill, MissPolicy::mark}) {
    for (const std::int32_t gutter : {0, 16, -1}) {
      options.encoding.miss = miss;
      options.encoding.gutter = gutter;
      const BakeResult baked = bake(source, test::plane(1, 1), options);
      const Image& map = image_of(baked, "opacity");
      const Image& half = baked.map(MapKind{"opacity"}).mips[0];
      for (std::uint32_t y = 0; y < 32; ++y) {
        for (std::uint32_t x = 0; x < 32; ++x) {
          EXPECT_NEAR(*map.at(x, y), opacity_of_leaves(x, y), 1e-6) << x << " " << y;
          if (opacity_of_leaves(x, y) == 0) {
            EXPECT_EQ(*map.at(x, y), 0);
          }
          double below = 0;
          for (std::uint32_t k = 0; k < 4; ++k) {
            below += opacity_of_leaves(x / 2 * 2 + k % 2, y / 2 * 2 + k / 2) / 4;
          }
          EXPECT_NEAR(*half.at(x / 2, y / 2), below, 1e-6) << x / 2 << " " << y / 2;
        }
      }
      if (miss == MissPolicy::mark) continue;
      // Colours still run on under what is transparent.
      EXPECT_NEAR(image_of(baked, "color").at(0, 31)[0], linear_values_of_bytes()[200], 1e-3);
    }
  }
}

/// Texels of padding copy the card's border: transparent where that is.
TEST(TextureMaps, OpacityIsPaddedAsItIs) {
  KILN_REQUIRE_DEVICE();
  Mesh card = test::plane(1, 1);
  for (Vec2& uv : card.uvs) uv = {0.25F + uv.x / 2, 0.25F + uv.y / 2};
  Mesh high = test::plane(1, 1, 0.5, 1);  // the middle half
  high.colors.assign(high.positions.size(), {255, 255, 255, 255});
  BakeOptions options = options_of(64, 64, {MapKind{"opacity"}});
  options.encoding.gutter = 16;
  const Image map = image_of(bake(Source(*test::device(), high), card, options), "opacity");
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      const bool reached = std::hypot(std::max({16.0 - x, x - 47.0, 0.0}),
                                      std::max({16.0 - y, y - 47.0, 0.0})) <= 16;
      EXPECT_EQ(*map.at(x, y), x >= 24 && x < 40 && reached ? 1 : 0) << x << " " << y;
    }
  }
}

/// The same of cards with holes: cut out, or read where the texture is transparent.
TEST(TextureMaps, OpacityOfCutOutLeavesIsTheirs) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 128;
  Image picture{kSide, kSide, 4, std::vector<float>(std::size_t{kSide} * kSide * 4, 1.0F)};
  const auto inside = [](double u, double v) { return std::hypot(u - 0.5, v - 0.5) < 0.3; };
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      picture.at(x, y)[3] = inside((x + 0.5) / kSide, (y + 0.5) / kSide) ? 1 : 0;
    }
  }
  Texture texture = texture_of(std::move(picture), TextureKind::linear);
  texture.channel = 3;
  Mesh card = test::plane(1, 1);
  for (Vec3& p : card.positions) p.z = 0.1F;
  BakeOptions options = options_of(64, 64, {MapKind{"opacity"}});
  options.opacity = texture;
  options.encoding.gutter = 16;
  for (const bool cut : {false, true}) {
    for (const std::uint32_t samples : {1U, 4U}) {
      options.samples = samples;
      const Source source(*test::device(), cut ? cut_out(card, texture, 0.5) : card);
      const Image map = image_of(bake(source, test::plane(1, 1), options), "opacity");
      for (std::uint32_t y = 0; y < 64; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
          const double away = std::hypot((x + 0.5) / 64 - 0.5, (y + 0.5) / 64 - 0.5);
          // A texel's half diagonal, and a texel of the picture, beside the border.
          if (std::abs(away - 0.3) < 0.7072 / 64 + 1.5 / kSide) continue;
          EXPECT_NEAR(*map.at(x, y), away < 0.3 ? 1 : 0, 1e-6) << cut << " " << x << " " << y;
        }
      }
    }
  }
}

/// A transparent texel leaves its colour out of the mip chain.
TEST(TextureMaps, MipsOfColorsCountByOpacity) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 64,
                          kShown = 24;  // columns of red; the rest is blue that does not show
  Image color{kSide, kSide, 4, {}};
  for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
    const float red = i % kSide < kShown ? 1.0F : 0.0F;
    color.pixels.insert(color.pixels.end(), {red, 0, 1 - red, red});
  }
  for (const bool with : {false, true}) {
    BakeOptions options = options_of(8, 8, {MapKind{"color"}});
    options.color = texture_of(color, TextureKind::linear);
    if (with) {
      options.maps.emplace_back("opacity");
      options.opacity = texture_of(color, TextureKind::linear);
      options.opacity->channel = 3;
    }
    options.encoding.mips = true;
    const Source source(*test::device(), test::plane(1, 1));
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    const BakedMap& map = baked.map(MapKind{"color"});
    ASSERT_EQ(map.mips.size(), 3U);
    // 3 of 8 columns, each of weight 255 beside 1; filters of the picture reach over the border a little.
    const double shown = with ? 3.0 * 255 / (3 * 255 + 5) : 3.0 / 8;
    EXPECT_NEAR(map.mips[2].pixels[0], shown, 0.02);
    EXPECT_NEAR(map.mips[2].pixels[2], 1 - shown, 0.02);
    if (with) EXPECT_NEAR(baked.map(MapKind{"opacity"}).mips[2].pixels[0], 3.0 / 8, 0.02);
  }
}

/// The recipe for leaf cards: tilted leaves of either winding, near the card and far from it. Mask and opacity are the
/// leaves' silhouettes along the card's normal, sample by sample.
TEST(TextureMaps, LeafCardsHaveTheirSilhouettes) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 64, kSamples = 4, kAcross = kSide * kSamples;
  for (const float far : {0.02F, 0.5F}) {
    Mesh high;
    std::vector<std::uint8_t> covered(std::size_t{kAcross} * kAcross);
    std::uint32_t state = 7;
    const auto random = [&](float least, float most) {
      state = state * 1664525U + 1013904223U;
      return least + (most - least) * static_cast<float>(state >> 8) / 16777216.0F;
    };
    for (int leaf = 0; leaf < 25; ++leaf) {
      const auto first = static_cast<std::uint32_t>(high.positions.size());
      const Vec3 at{random(-0.4F, 0.4F), random(-0.4F, 0.4F), random(-far, far)};
      const float angle = random(0, 6.28F), tilt = far * random(-1, 1), size = 0.09F;
      std::array<std::array<double, 2>, 4> outline{};
      for (std::uint32_t k = 0; k < 4; ++k) {
        const float along = k == 0 || k == 3 ? -size : size, across = k < 2 ? -size / 3 : size / 3;
        const Vec3 p{at.x + along * std::cos(angle) - across * std::sin(angle),
                     at.y + along * std::sin(angle) + across * std::cos(angle),
                     at.z + tilt * along};
        high.positions.push_back(p);
        outline[k] = {double{p.x}, double{p.y}};
      }
      Triangle a{first, first + 1, first + 2}, b{first, first + 2, first + 3};
      if (leaf % 2 == 0) {
        std::swap(a[1], a[2]);
        std::swap(b[1], b[2]);
      }
      high.triangles.insert(high.triangles.end(), {a, b});
      for (std::uint32_t j = 0; j < kAcross; ++j) {
        for (std::uint32_t i = 0; i < kAcross; ++i) {
          const double x = (i + 0.5) / kAcross - 0.5, y = 0.5 - (j + 0.5) / kAcross;
          bool inside = true;
          for (std::size_t k = 0; k < 4; ++k) {
            const auto &p = outline[k], &q = outline[(k + 1) % 4];
            inside = inside && (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) > 0;
          }
          if (inside) covered[std::size_t{j} * kAcross + i] = 1;
        }
      }
    }
    high.colors.assign(high.positions.size(), {255, 255, 255, 255});
    BakeOptions options;
    options.width = options.height = kSide;
    options.samples = kSamples;
    options.maps = {MapKind::mask, MapKind{"opacity"}};
    options.match.two_sided = true;
    const BakeResult baked = bake(Source(*test::device(), high), test::plane(1, 1), options);
    std::size_t beside = 0;
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t x = 0; x < kSide; ++x) {
        double wanted = 0;
        for (std::uint32_t s = 0; s < kSamples * kSamples; ++s) {
          const std::size_t row = y * kSamples + s / kSamples, column = x * kSamples + s % kSamples;
          wanted += covered[row * kAcross + column] / double{kSamples * kSamples};
        }
        const float mask = *baked.map(MapKind::mask).image.at(x, y);
        EXPECT_NEAR(*baked.map(MapKind{"opacity"}).image.at(x, y), mask, 1e-6);
        // A sample's ray may go by an edge on either side.
        EXPECT_NEAR(mask, wanted, 1.01 / (kSamples * kSamples)) << x << " " << y;
        beside += std::abs(mask - wanted) > 1e-6 ? 1 : 0;
      }
    }
    EXPECT_LE(beside, 8U) << far;
  }
}

TEST(TextureMaps, AFlatNormalMapIsTheNormals) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::uv_sphere(64, 32);
  const Source source(*test::device(), high);
  for (const NormalMapSpace space :
       {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
    BakeOptions options = options_of(64, 64, {MapKind::normal});
    options.encoding.space = space;
    options.encoding.raw = true;
    options.transfers = {{"flat", texture_of({1, 1, 3, {0.5F, 0.5F, 1}}, TextureKind::normal)}};
    const BakeResult baked = bake(source, test::BumpySphere::light(24, 12), options);
    const Image &normal = image_of(baked, "normal"), &flat = image_of(baked, "flat");
    for (std::size_t i = 0; i < normal.pixels.size(); ++i) {
      EXPECT_NEAR(flat.pixels[i], normal.pixels[i], 2e-5) << i;
    }
  }
}

TEST(TextureMaps, ANormalMapTurnsWithTheLayout) {
  KILN_REQUIRE_DEVICE();
  // A quarter turn of the high poly's UVs: its +U is the low poly's +V.
  Mesh high = test::plane(2, 2);
  for (Vec2& uv : high.uvs) uv = {uv.y, 1 - uv.x};
  const Source source(*test::device(), high);
  const std::array<float, 3> stored{0.6F * 0.5F + 0.5F, 0.5F, 0.8F * 0.5F + 0.5F};
  BakeOptions options = options_of(16, 16, {MapKind::normal});
  options.encoding.raw = true;
  options.transfers = {
      {"bumps", texture_of({1, 1, 3, {stored[0], stored[1], stored[2]}}, TextureKind::normal)}};
  const Image map = image_of(bake(source, test::plane(1, 1), options), "bumps");
  EXPECT_NEAR(map.at(8, 8)[0], 0, 1e-6);
  EXPECT_NEAR(map.at(8, 8)[1], 0.6, 1e-6);
  EXPECT_NEAR(map.at(8, 8)[2], 0.8, 1e-6);
  options.encoding.flip_y = true;
  EXPECT_NEAR(image_of(bake(source, test::plane(1, 1), options), "bumps").at(8, 8)[1], -0.6, 1e-6);
  options.encoding.raw = options.encoding.flip_y = false;
  EXPECT_NEAR(image_of(bake(source, test::plane(1, 1), options), "bumps").at(8, 8)[1], 0.8, 1e-6);
}

/// On a face that looks away, which a match of both sides finds, a normal map's vectors are on the side that is seen.
TEST(TextureMaps, ANormalMapOnABackIsTurnedToItsSide) {
  KILN_REQUIRE_DEVICE();
  for (const bool away : {false, true}) {
    Mesh high = test::plane(2, 2);
    high.normals = {{0, 0, away ? -1.0F : 1.0F}};
    high.normal_triangles.assign(high.triangles.size(), {0, 0, 0});
    for (auto* const corners : {&high.triangles, &high.uv_triangles}) {
      for (Triangle& t : *corners) {
        if (away) std::swap(t[1], t[2]);
      }
    }
    const Source source(*test::device(), high);
    BakeOptions options = options_of(4, 4, {MapKind::normal});
    options.encoding.space = NormalMapSpace::object;
    options.encoding.raw = true;
    options.match.two_sided = true;
    // Leans to +u, along x, by 0.6 of its length: the back of a slope is one to the other side.
    options.transfers = {{"lean", texture_of({1, 1, 3, {0.8F, 0.5F, 0.9F}}, TextureKind::normal)}};
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    EXPECT_NEAR(image_of(baked, "normal").at(2, 1)[2], 1, 1e-6) << away;
    const float* const n = image_of(baked, "lean").at(2, 1);
    EXPECT_NEAR(n[0], away ? -0.6 : 0.6, 1e-5) << away;
    EXPECT_NEAR(n[1], 0, 1e-5) << away;
    EXPECT_NEAR(n[2], 0.8, 1e-5) << away;
  }
}

TEST(TextureMaps, NamesAndPicturesAreChecked) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(1, 1));
  const Texture grey = texture_of({1, 1, 1, {0.5F}}, TextureKind::linear);
  const auto code_of = [&](std::vector<Transfer> transfers) {
    BakeOptions options = options_of(8, 8, {MapKind::normal});
    options.transfers = std::move(transfers);
    try {
      bake(source, test::plane(1, 1), options);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code_of({{"normal", grey}}), ErrorCode::usage);
  EXPECT_EQ(code_of({{"a/b", grey}}), ErrorCode::usage);
  EXPECT_EQ(code_of({{"", grey}}), ErrorCode::usage);
  EXPECT_EQ(code_of({{"twice", grey}, {"twice", grey}}), ErrorCode::usage);
  EXPECT_EQ(code_of({{"none", Texture{}}}), ErrorCode::input);
  EXPECT_EQ(code_of({{"fine", grey}}), ErrorCode::internal);
  Mesh bare = test::plane(1, 1);
  bare.uvs.clear();
  bare.uv_triangles.clear();
  BakeOptions options = options_of(8, 8, {MapKind::normal});
  options.transfers = {{"grey", grey}};
  EXPECT_THROW(bake(Source(*test::device(), bare), test::plane(1, 1), options), Error);
}

/// A letter, then up to 63 letters, digits and _: characters on either side of these ranges are refused.
TEST(TextureMaps, NamesAreOfLettersDigitsAndUnderscores) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(1, 1));
  const Texture grey = texture_of({1, 1, 1, {0.5F}}, TextureKind::linear);
  const auto error_of = [&](const std::string& name) -> std::string {
    BakeOptions options = options_of(4, 4, {MapKind::mask});
    options.transfers = {{"first", grey}, {name, grey}};
    try {
      bake(source, test::plane(1, 1), options);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  for (const std::string& name :
       {std::string("a"), std::string("zA9_0Z"), "Z" + std::string(63, 'a')}) {
    EXPECT_EQ(error_of(name), "") << name;
  }
  for (const std::string& name :
       {std::string("9a"), std::string("_a"), std::string("[a"), std::string("@a"),
        std::string("`a"), std::string("{a"), std::string("a["), std::string("a/"),
        std::string("a:"), std::string("a`"), std::string("a-b"), "Z" + std::string(64, 'a')}) {
    EXPECT_EQ(error_of(name),
              "A map cannot be called '" + name + "': use a letter, then letters, digits and _.");
  }
  EXPECT_EQ(error_of("first"),
            "A map cannot be called 'first', since two maps have this name: rename one of them.");
  EXPECT_EQ(
      error_of("height"),
      "A map cannot be called 'height', which is another map's name: choose a different one.");
}

/// A map has one channel only where no picture, constant or factor has a colour, whichever channel it differs in.
TEST(TextureMaps, AnyColourMakesThreeChannels) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(3, 1);
  high.material_names = {"plain", "picture", "tinted"};
  for (std::uint32_t t = 0; t < 6; ++t) high.materials.push_back(t / 2);
  const Source source(*test::device(), high);
  Texture grey;
  grey.kind = TextureKind::linear;
  grey.images = {std::make_shared<const Image>(Image{1, 1, 3, {0.5F, 0.5F, 0.5F}}),
                 std::make_shared<const Image>(Image{1, 1, 1, {0.25F}})};
  grey.image_of = {Texture::kNone, 0, 1};
  grey.plain = {{0.75F, 0.75F, 0.75F, 1}, {0, 0, 0, 1}, {0, 0, 0, 1}};
  grey.factors.resize(3);
  grey.factors[2].times = {0.5F, 0.5F, 0.5F, 1};
  const auto bake_with = [&](const Texture& texture) {
    BakeOptions options = options_of(6, 2, {MapKind::mask});
    options.transfers = {{"first", texture_of({1, 1, 1, {0.125F}}, TextureKind::linear)},
                         {"made", texture}};
    return bake(source, test::plane(1, 1), options);
  };
  const auto expect_texels = [&](const BakeResult& baked,
                                 const std::vector<std::vector<float>>& wanted) {
    const Image& map = image_of(baked, "made");
    ASSERT_EQ(map.channels, wanted[0].size());
    for (std::uint32_t x = 0; x < 6; ++x) {
      for (std::uint32_t c = 0; c < map.channels; ++c) {
        EXPECT_NEAR(map.at(x, 1)[c], wanted[x / 2][c], 1e-6) << x << " " << c;
      }
    }
  };
  expect_texels(bake_with(grey), {{0.75F}, {0.5F}, {0.125F}});
  for (const std::size_t channel : {0U, 1U, 2U}) {
    const auto changed = [&](float value, float to) {
      std::vector<float> color(3, value);
      color[channel] = to;
      return color;
    };
    Texture constant = grey;
    constant.plain[0][channel] = 0.25F;
    expect_texels(bake_with(constant),
                  {changed(0.75F, 0.25F), {0.5F, 0.5F, 0.5F}, {0.125F, 0.125F, 0.125F}});
    Texture pixels = grey;
    Image image{1, 1, 3, {0.5F, 0.5F, 0.5F}};
    image.pixels[channel] = 1;
    pixels.images[0] = std::make_shared<const Image>(image);
    expect_texels(bake_with(pixels),
                  {{0.75F, 0.75F, 0.75F}, changed(0.5F, 1), {0.125F, 0.125F, 0.125F}});
    Texture tinted = grey;
    tinted.factors[2].times[channel] = 1;
    expect_texels(bake_with(tinted),
                  {{0.75F, 0.75F, 0.75F}, {0.5F, 0.5F, 0.5F}, changed(0.125F, 0.25F)});
  }
  // No constant: 0 where a material has no picture.
  Texture none = grey;
  none.plain.clear();
  expect_texels(bake_with(none), {{0}, {0.5F}, {0.125F}});
}

/// Each picture is checked, also the last, and a number that is no number is counted by itself.
TEST(TextureMaps, PicturesThatAreBrokenAreRefused) {
  KILN_REQUIRE_DEVICE();
  Mesh high = test::plane(2, 1);
  high.material_names = {"one", "two"};
  high.materials = {0, 0, 1, 1};
  const Source source(*test::device(), high);
  const auto warnings_of = [&](std::shared_ptr<const Image> last) {
    Texture texture;
    texture.kind = TextureKind::linear;
    texture.images = {std::make_shared<const Image>(Image{1, 1, 1, {0.5F}}), std::move(last)};
    texture.image_of = {0, 1};
    BakeOptions options = options_of(4, 4, {MapKind::mask});
    options.transfers = {{"rough", texture}};
    return bake(source, test::plane(1, 1), options).report.warnings;
  };
  const auto error_of = [&](std::shared_ptr<const Image> last) -> std::string {
    try {
      warnings_of(std::move(last));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of(nullptr), "A picture of the texture of the map rough is missing.");
  for (const Image& image :
       {Image{0, 2, 1, {}}, Image{2, 0, 1, {}}, Image{1, 1, 0, {}}, Image{1, 1, 5, {1, 1, 1, 1, 1}},
        Image{2, 3, 1, {1, 1, 1, 1, 1}}, Image{2, 3, 1, {1, 1, 1, 1, 1, 1, 1}}}) {
    EXPECT_EQ(error_of(std::make_shared<const Image>(image)),
              "A picture of the texture of the map rough has no pixels, or their number does not "
              "match its size.");
  }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const bool several : {false, true}) {
    const std::vector<Warning> warnings = warnings_of(std::make_shared<const Image>(
        Image{3, 1, 1, {0.5F, several ? std::numeric_limits<float>::infinity() : 0.5F, nan}}));
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].code, "texture-non-finite");
    EXPECT_EQ(warnings[0].count, several ? 2U : 1U);
    EXPECT_EQ(warnings[0].message.text(),
              several ? "The texture of the map rough has 2 numbers that are NaN or infinite; they "
                        "count as 0."
                      : "The texture of the map rough has 1 number that is NaN or infinite; it "
                        "counts as 0.");
  }
}

}  // namespace
}  // namespace kiln

// Transparent parts taken off meshes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "image/gutter.h"
#include "image/value_range.h"
#include "kiln/bake.h"
#include "kiln/material.h"
#include "mesh/vector.h"
#include "support/environment.h"
#include "support/mesh_check.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr std::uint32_t kSide = 128;
constexpr double kRadius = 0.3;  // of the disc that is opaque, UV

/// A soft disc in the middle: 1/2 at its border.
Texture leaf() {
  Image image{kSide, kSide, 4, std::vector<float>(std::size_t{kSide} * kSide * 4, 1.0F)};
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const double away = std::hypot((x + 0.5) / kSide - 0.5, (y + 0.5) / kSide - 0.5);
      image.at(x, y)[3] = static_cast<float>(std::clamp(0.5 + (kRadius - away) * 20, 0.0, 1.0));
    }
  }
  Texture texture;
  texture.kind = TextureKind::linear;
  texture.channel = 3;
  texture.images = {std::make_shared<const Image>(std::move(image))};
  return texture;
}

double area_of(const Mesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]);
    area +=
        length(cross(to_double(mesh.positions[t[1]]) - a, to_double(mesh.positions[t[2]]) - a)) / 2;
  }
  return area;
}

TEST(CutOut, LeavesTheDiscOfACard) {
  CutOutReport report;
  const Mesh cut = cut_out(test::plane(1, 1), leaf(), 0.5, &report);
  EXPECT_EQ(test::broken_promise(cut), "");
  EXPECT_EQ(report.cut, 2U);
  EXPECT_EQ(report.whole + report.gone, 0U);
  const double disc = std::numbers::pi * kRadius * kRadius;
  EXPECT_NEAR(area_of(cut), disc, 1e-3 * disc);
  for (std::size_t t = 0; t < cut.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = cut.positions[cut.triangles[t][k]];
      const Vec2& uv = cut.uvs[cut.uv_triangles[t][k]];
      EXPECT_LT(std::hypot(p.x, p.y), kRadius + 0.2 / kSide);
      EXPECT_NEAR(uv.x, p.x + 0.5F, 1e-6F);
      EXPECT_EQ(cut.normals[cut.normal_triangles[t][k]].z, 1);
    }
  }
  // Finer only along the border: 2 pi r texels long, a few triangles each.
  EXPECT_LT(cut.triangles.size(), 12 * 2 * std::numbers::pi * kRadius * kSide);
}

TEST(CutOut, APictureMayLieMovedOnTheUvs) {
  Mesh mesh = test::plane(1, 1);
  mesh.material_names = {"leaf"};
  mesh.materials.assign(mesh.triangles.size(), 0);
  Texture opacity = leaf();
  opacity.image_of = {0};
  opacity.uv_transforms = {{2, 0, 0, 0, 1, 0}};  // two discs, each half as wide
  const Mesh cut = cut_out(mesh, opacity, 0.5);
  const double disc = std::numbers::pi * kRadius * kRadius;
  EXPECT_NEAR(area_of(cut), disc, 1e-3 * disc);
  for (const Triangle& t : cut.triangles) {
    for (const std::uint32_t corner : t) {
      const Vec3& p = cut.positions[corner];
      EXPECT_LT(std::hypot(2 * (std::abs(p.x) - 0.25), double{p.y}), kRadius + 0.2 / kSide);
    }
  }
  opacity.uv_transforms.push_back({});
  EXPECT_THROW(cut_out(mesh, opacity, 0.5), Error);
}

/// A picture on another set of UVs cuts there, and all sets stay on the surface.
TEST(CutOut, APictureMayLieOnAnotherSetOfUvs) {
  Mesh mesh = test::plane(1, 1);
  mesh.material_names = {"leaf"};
  mesh.materials.assign(mesh.triangles.size(), 0);
  const Mesh wanted = cut_out(mesh, leaf(), 0.5);
  mesh.other_uvs = {{3, mesh.uvs}};
  for (Vec2& uv : mesh.uvs) uv = {5 * uv.x, 7 * uv.y};
  Texture opacity = leaf();
  opacity.image_of = {0};
  opacity.uv_sets = {3};
  const Mesh cut = cut_out(mesh, opacity, 0.5);
  EXPECT_EQ(cut.positions, wanted.positions);
  EXPECT_EQ(cut.triangles, wanted.triangles);
  ASSERT_EQ(cut.other_uvs.size(), 1U);
  EXPECT_EQ(cut.other_uvs[0].uvs, wanted.uvs);
  ASSERT_EQ(cut.uvs.size(), wanted.uvs.size());
  for (std::size_t i = 0; i < cut.uvs.size(); ++i) {
    EXPECT_NEAR(cut.uvs[i].x, 5 * wanted.uvs[i].x, 1e-5);
    EXPECT_NEAR(cut.uvs[i].y, 7 * wanted.uvs[i].y, 1e-5);
  }
  opacity.uv_sets = {4};
  EXPECT_THROW(cut_out(mesh, opacity, 0.5), Error);
  opacity.uv_sets = {3, 3};
  EXPECT_THROW(cut_out(mesh, opacity, 0.5), Error);
}

TEST(CutOut, PicturesMayClampOrMirror) {
  // UVs from -1 to 2 both ways, of which a picture shows the left half of a disc at its right border.
  Mesh mesh = test::plane(1, 1);
  for (Vec2& uv : mesh.uvs) uv = {3 * uv.x - 1, 3 * uv.y - 1};
  mesh.material_names = {"leaf"};
  mesh.materials.assign(mesh.triangles.size(), 0);
  Texture opacity = leaf();
  opacity.image_of = {0};
  opacity.uv_transforms = {{1, 0, -0.5F, 0, 1, 0}};
  const double disc = std::numbers::pi * kRadius * kRadius / 9;
  const auto area = [&](TextureWrap across, TextureWrap down) {
    opacity.wraps = {{across, down}};
    return area_of(cut_out(mesh, opacity, 0.5));
  };
  EXPECT_NEAR(area(TextureWrap::repeat, TextureWrap::repeat), 9 * disc, 1e-2 * disc);
  EXPECT_NEAR(area(TextureWrap::mirror, TextureWrap::mirror), 9 * disc, 1e-2 * disc);
  // Outside, the disc's border texels are empty.
  EXPECT_NEAR(area(TextureWrap::clamp, TextureWrap::clamp), disc, 1e-2 * disc);
  EXPECT_NEAR(area(TextureWrap::repeat, TextureWrap::clamp), 3 * disc, 1e-2 * disc);
  opacity.wraps.push_back({});
  EXPECT_THROW(cut_out(mesh, opacity, 0.5), Error);
}

/// Half as opaque at half the threshold is the same cut; 1 minus a disc is what is around it.
TEST(CutOut, FactorsCountAsInMaps) {
  Mesh mesh = test::plane(1, 1);
  mesh.material_names = {"leaf"};
  mesh.materials.assign(mesh.triangles.size(), 0);
  Texture opacity = leaf();
  opacity.image_of = {0};
  const double disc = area_of(cut_out(mesh, opacity, 0.5));
  opacity.factors = {{{0.5F, 0.5F, 0.5F, 0.5F}, 0}};
  EXPECT_NEAR(area_of(cut_out(mesh, opacity, 0.25)), disc, 1e-6);
  EXPECT_THROW(cut_out(mesh, opacity, 0.75), Error);
  Image image = *opacity.images[0];
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) image.pixels[i] = image.pixels[i + 3];
  opacity.images = {std::make_shared<const Image>(std::move(image))};
  opacity.channel = 0;
  opacity.factors = {{{-1, -1, -1, -1}, 1}};
  EXPECT_NEAR(area_of(cut_out(mesh, opacity, 0.5)), 1 - disc, 1e-3);
  opacity.factors.push_back({});
  EXPECT_THROW(cut_out(mesh, opacity, 0.5), Error);
}

TEST(CutOut, AlphaOfVerticesIsMultiplied) {
  Mesh mesh = test::plane(1, 1);
  for (const Vec3& p : mesh.positions) {
    mesh.colors.push_back({255, 255, 255, p.x < 0 ? std::uint8_t{0} : std::uint8_t{255}});
  }
  mesh.material_names = {"fading"};
  mesh.materials.assign(mesh.triangles.size(), 0);
  Texture opacity;
  opacity.kind = TextureKind::linear;
  opacity.image_of = {Texture::kNone};
  opacity.plain = {{0.8F, 0.8F, 0.8F, 0.8F}};
  opacity.times_vertex_colors = {true};
  // 0.8 times the share of the way from left to right is at least 0.5 in 3/8 of it.
  EXPECT_NEAR(area_of(cut_out(mesh, opacity, 0.5)), 3.0 / 8, 1e-4);
  opacity.times_vertex_colors.clear();
  EXPECT_NEAR(area_of(cut_out(mesh, opacity, 0.5)), 1, 1e-6);
}

TEST(CutOut, RepeatsAndKeepsWhatIsWhole) {
  Mesh mesh = test::plane(8, 8);
  for (Vec2& uv : mesh.uvs) uv = {uv.x * 2 - 3.25F, uv.y * 2 + 1.5F};
  mesh.colors.assign(mesh.positions.size(), {10, 20, 30, 40});
  mesh.group_names = {"leaves"};
  mesh.groups.assign(mesh.triangles.size(), 0);
  CutOutReport report;
  const Mesh cut = cut_out(mesh, leaf(), 0.5, &report);
  EXPECT_EQ(test::broken_promise(cut), "");
  // Four discs' worth on a sheet half as far across each.
  EXPECT_NEAR(area_of(cut), std::numbers::pi * kRadius * kRadius, 1e-3);
  EXPECT_GT(report.whole, 0U);
  EXPECT_GT(report.gone, 0U);
  EXPECT_EQ(report.whole + report.cut + report.gone, mesh.triangles.size());
  EXPECT_EQ(cut.groups.size(), cut.triangles.size());
  EXPECT_EQ(cut.colors.back(), (std::array<std::uint8_t, 4>{10, 20, 30, 40}));
  const Mesh whole = cut_out(mesh, leaf(), 1e-9);
  EXPECT_GT(area_of(whole), 0.99 * area_of(cut));
}

TEST(CutOut, LeavesNoPartsWithoutArea) {
  KILN_REQUIRE_DEVICE();
  // A disc whose values are those of the threshold on whole rows, so that cuts run through corners; far from the
  // origin, where parts of a texel are a few roundings wide. One triangle of the mesh has no area itself.
  Image picture{64, 64, 1, std::vector<float>(64 * 64)};
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      picture.pixels[y * 64 + x] = static_cast<float>((x / 3 + y / 5) % 3) / 2;
    }
  }
  Texture opacity;
  opacity.images = {std::make_shared<const Image>(picture)};
  Mesh mesh = test::plane(4, 4);
  for (Vec3& p : mesh.positions) p = {p.x * 0.01F + 30, p.y * 0.01F + 40, p.z};
  mesh.triangles.push_back({0, 0, 1});
  mesh.uv_triangles.push_back({0, 0, 1});
  if (!mesh.normal_triangles.empty()) mesh.normal_triangles.push_back({0, 0, 1});
  const Mesh cut = cut_out(mesh, opacity, 0.5);
  EXPECT_GT(cut.triangles.size(), 1000U);
  EXPECT_LE(Source(*test::device(), cut).stats().skipped_triangles, 1U);
}

TEST(CutOut, RaysPassWhereItIsTransparent) {
  KILN_REQUIRE_DEVICE();
  // A card over a floor: seen from the card, all that is not leaf is floor.
  Mesh high = cut_out(test::plane(1, 1), leaf(), 0.5);
  for (Vec3& p : high.positions) p.z = 0.05F;
  const Mesh floor = test::plane(1, 1);
  const auto first = static_cast<std::uint32_t>(high.positions.size());
  high.positions.insert(high.positions.end(), floor.positions.begin(), floor.positions.end());
  for (Triangle t : floor.triangles) {
    for (std::uint32_t& corner : t) corner += first;
    high.triangles.push_back(t);
    high.uv_triangles.push_back({0, 0, 0});
    high.normal_triangles.push_back({0, 0, 0});
  }
  BakeOptions options;
  options.width = options.height = 64;
  options.maps = {MapKind{"height"}};
  options.encoding.gutter = 0;
  options.match.max_distance = Length::absolute(0.2);
  options.match.cage = Length::absolute(0.1);
  const Image map = bake(Source(*test::device(), high), floor, options).maps[0].image;
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      const double away = std::hypot((x + 0.5) / 64 - 0.5, (y + 0.5) / 64 - 0.5);
      if (std::abs(away - kRadius) < 0.005) continue;
      EXPECT_NEAR(*map.at(x, y), away < kRadius ? 0.05 : 0, 1e-5) << x << " " << y;
    }
  }
}

TEST(CutOut, RefusesWhatItCannotCut) {
  const Mesh card = test::plane(1, 1);
  EXPECT_THROW(cut_out(card, leaf(), 0), Error);
  EXPECT_THROW(cut_out(card, leaf(), 1.5), Error);
  EXPECT_THROW(cut_out(card, Texture{}, 0.5), Error);
  Mesh bare = card;
  bare.uvs.clear();
  bare.uv_triangles.clear();
  EXPECT_THROW(cut_out(bare, leaf(), 0.5), Error);
  Texture clear = leaf();
  clear.images = {std::make_shared<const Image>(Image{1, 1, 4, {1, 1, 1, 0}})};
  EXPECT_THROW(cut_out(card, clear, 0.5), Error);
  clear.image_of = {0, 0};
  EXPECT_THROW(cut_out(card, clear, 0.5), Error);
  // Tiles name pictures that are there.
  Texture tiled = leaf();
  tiled.tiles = {{0, 1001, 0}};
  EXPECT_NO_THROW(cut_out(card, tiled, 0.5));
  tiled.tiles = {{1, 1001, 0}};
  EXPECT_THROW(cut_out(card, tiled, 0.5), Error);
  tiled.tiles = {{0, 1001, 0}, {0, 1002, 1}};
  EXPECT_THROW(cut_out(card, tiled, 0.5), Error);
}

TEST(BoundedChannel, BoundsWhatIsReadAnywhere) {
  Image image{37, 21, 1, {}};
  for (std::size_t i = 0; i < std::size_t{37} * 21; ++i) {
    image.pixels.push_back(static_cast<float>((i * 7919) % 101));
  }
  const BoundedChannel channel(image, 0);
  constexpr TextureWrap kWraps[] = {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirror};
  std::uint32_t state = 1;
  const auto random = [&] {
    state = state * 1664525U + 1013904223U;
    return state / 4294967296.0;
  };
  for (int i = 0; i < 300; ++i) {
    const double u0 = 4 * random() - 2, v0 = 4 * random() - 2;
    const double u1 = u0 + random() * random(), v1 = v0 + random() * random();
    const BoundedChannel::Wraps wraps{kWraps[i % 3], kWraps[i / 3 % 3]};
    const BoundedChannel::Range range = channel.over(u0, v0, u1, v1, wraps);
    for (int k = 0; k < 50; ++k) {
      const double value = channel.at(u0 + (u1 - u0) * random(), v0 + (v1 - v0) * random(), wraps);
      EXPECT_LE(range.least, value + 1e-5);
      EXPECT_GE(range.most, value - 1e-5);
    }
  }
}

/// On a picture of few texels, every place of a rectangle's ends among texels, folds and borders occurs.
TEST(BoundedChannel, BoundsWhatIsReadAtEveryFold) {
  constexpr double kRounding = 1e-12;  // of a weight where a sample lies on a texel's centre
  constexpr TextureWrap kWraps[] = {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirror};
  for (const std::uint32_t size : {1U, 2U, 3U, 5U, 8U}) {
    // Four equal rows or columns: over one that is as high as the rectangle, the range is that of the whole picture.
    constexpr std::uint32_t kSame = 4;
    Image rows{size, kSame, 1, {}}, columns{kSame, size, 1, {}};
    for (std::uint32_t i = 0; i < size * kSame; ++i) {
      rows.pixels.push_back(static_cast<float>((i % size) * 3 % 7));
      columns.pixels.push_back(static_cast<float>((i / kSame) * 3 % 7));
    }
    const BoundedChannel across(rows, 0), down(columns, 0);
    const double step = 1.0 / (4 * size);
    for (const TextureWrap wrap : kWraps) {
      for (int first = -static_cast<int>(10 * size); first < static_cast<int>(10 * size); ++first) {
        for (int length = 0; length < static_cast<int>(4 * size); ++length) {
          const double begin = first * step, end = (first + length) * step;
          const BoundedChannel::Wraps wraps{wrap, wrap};
          const BoundedChannel::Range of_row = across.over(begin, 0.5, end, 0.5, wraps),
                                      of_column = down.over(0.5, begin, 0.5, end, wraps);
          for (int k = first; k <= first + length; ++k) {
            const double x = across.at(k * step, 0.5, wraps), y = down.at(0.5, k * step, wraps);
            ASSERT_TRUE(of_row.least - kRounding <= x && x <= of_row.most + kRounding)
                << size << " " << static_cast<int>(wrap) << " " << begin << " to " << end;
            ASSERT_TRUE(of_column.least - kRounding <= y && y <= of_column.most + kRounding)
                << size << " " << static_cast<int>(wrap) << " " << begin << " to " << end;
          }
        }
      }
    }
  }
}

/// Every list of the texture must be as long as the materials, and every picture whole, also the last one.
TEST(CutOut, TexturesThatDoNotFitAreRefused) {
  Mesh card = test::plane(3, 1);
  card.name = "fern.obj";
  card.material_names = {"stem", "leaf"};
  card.materials = {0, 0, 1, 1, 0, 1};
  const Image half{1, 2, 4, {1, 1, 1, 1, 1, 1, 1, 0}};
  Texture fits;
  fits.kind = TextureKind::linear;
  fits.channel = 3;
  fits.images = {std::make_shared<const Image>(half), std::make_shared<const Image>(half)};
  fits.image_of = {1, 0};
  fits.uv_transforms.assign(2, {1, 0, 0, 0, 1, 0});
  fits.wraps.resize(2);
  fits.uv_sets.assign(2, card.uv_set);
  fits.factors.resize(2);
  fits.times_vertex_colors.assign(2, false);
  EXPECT_NO_THROW(cut_out(card, fits, 0.5));
  const auto refused = [&](const char* what, const std::function<void(Texture&)>& change,
                           const Mesh& mesh) {
    Texture texture = fits;
    change(texture);
    try {
      (void)cut_out(mesh, texture, 0.5);
      ADD_FAILURE() << what;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      EXPECT_STREQ(error.what(),
                   "The opacity texture does not fit the mesh 'fern.obj': it needs one picture, or "
                   "one for each material.")
          << what;
    }
  };
  refused(
      "transforms", [](Texture& t) { t.uv_transforms.pop_back(); }, card);
  refused(
      "wraps", [](Texture& t) { t.wraps.resize(3); }, card);
  refused(
      "sets", [](Texture& t) { t.uv_sets.pop_back(); }, card);
  refused(
      "factors", [](Texture& t) { t.factors.resize(3); }, card);
  refused(
      "vertices", [](Texture& t) { t.times_vertex_colors.pop_back(); }, card);
  refused(
      "pictures",
      [](Texture& t) {
        t.image_of = {1, 2};
      },
      card);
  refused(
      "materials",
      [](Texture& t) {
        t.image_of = {1, 0, 0};
      },
      card);
  refused(
      "another set", [&](Texture& t) { t.uv_sets[1] = card.uv_set + 1; }, card);
  refused(
      "no picture", [](Texture& t) { t.images[1] = nullptr; }, card);
  refused(
      "channel", [](Texture& t) { t.channel = 4; }, card);
  for (const Image& image : {Image{1, 2, 0, {}}, Image{0, 2, 4, {}}, Image{1, 0, 4, {}},
                             Image{1, 2, 4, {1, 1, 1, 1, 1, 1, 1}}}) {
    refused(
        "pixels", [&](Texture& t) { t.images[1] = std::make_shared<const Image>(image); }, card);
  }
  Mesh bare = card;
  bare.materials.clear();
  refused(
      "no materials", [](Texture&) {}, bare);
  Mesh short_set = card;
  short_set.other_uvs = {{card.uv_set + 1, {}}};
  refused(
      "a set of another length", [&](Texture& t) { t.uv_sets[1] = card.uv_set + 1; }, short_set);
  short_set.other_uvs[0].uvs = card.uvs;
  Texture other = fits;
  other.uv_sets[1] = card.uv_set + 1;
  EXPECT_NO_THROW(cut_out(short_set, other, 0.5));
}

}  // namespace
}  // namespace kiln

// The map id by names, and its legend.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "detail/id_colors.h"
#include "image/gutter.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Color = std::array<float, 3>;

double apart(const Color& a, const Color& b) {
  double squared = 0;
  for (std::size_t c = 0; c < 3; ++c) squared += (a[c] - b[c]) * (a[c] - b[c]);
  return 255 * std::sqrt(squared);
}

TEST(IdColors, AreFarApartAndExactInEightBits) {
  const std::vector<std::string> names = {"body",    "glass",  "tyre", "rim",
                                          "leather", "chrome", "lamp", "badge"};
  const std::vector<Color> colors = name_colors(names);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    for (const float channel : colors[i]) {
      EXPECT_EQ(channel, std::round(channel * 255) / 255.0F);
    }
    EXPECT_GT(apart(colors[i], {0, 0, 0}), 90) << "no background";
    for (std::size_t j = 0; j < i; ++j) EXPECT_GE(apart(colors[i], colors[j]), 80) << i << j;
  }
}

TEST(IdColors, BelongToNames) {
  const std::vector<std::string> one = {"wood", "steel"}, other = {"brass", "steel", "wood"};
  EXPECT_EQ(name_colors(one)[0], name_colors(other)[2]);
  EXPECT_EQ(name_colors(one)[1], name_colors(other)[1]);
}

TEST(IdColors, ManyAreAllDifferent) {
  std::vector<std::string> names;
  for (int i = 0; i < 3000; ++i) names.push_back("material " + std::to_string(i));
  const std::vector<Color> colors = name_colors(names);
  EXPECT_EQ(std::set<Color>(colors.begin(), colors.end()).size(), names.size());
  // None is dark as the background: the brightest channel is 96 of 255 at least.
  for (const Color& color : colors) {
    EXPECT_GE(*std::max_element(color.begin(), color.end()), 96 / 255.0F);
  }
}

/// Hundreds are apart by less than a few are, but by what an eye can tell.
TEST(IdColors, FewerAreFartherApart) {
  std::vector<std::string> names;
  for (int i = 0; i < 200; ++i) names.push_back("part " + std::to_string(i));
  for (const auto& [count, least] :
       {std::pair(std::size_t{16}, 80.0), std::pair(std::size_t{40}, 40.0),
        std::pair(std::size_t{200}, 20.0)}) {
    const std::vector<Color> colors = name_colors(std::span(names).first(count));
    double nearest = 1000;
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_GE(*std::max_element(colors[i].begin(), colors[i].end()), 96 / 255.0F);
      for (std::size_t j = 0; j < i; ++j) nearest = std::min(nearest, apart(colors[i], colors[j]));
    }
    EXPECT_GE(nearest, least - 1e-3) << count;
  }
}

/// Turns of the golden angle at three brightnesses.
TEST(IdColors, OfNumberedPartsAreFarApart) {
  std::vector<Color> colors;
  for (std::uint32_t part = 0; part < 24; ++part) {
    colors.push_back(part_color(part));
    const auto [low, high] = std::minmax_element(colors[part].begin(), colors[part].end());
    const float brightness = 1 - 0.25F * static_cast<float>(part % 3);
    EXPECT_NEAR(*high, brightness, 1e-6) << part;
    EXPECT_NEAR(*low, 0.15F * brightness, 1e-6) << part;
    for (std::uint32_t other = part < 4 ? 0 : part - 4; other < part; ++other) {
      EXPECT_GT(apart(colors[part], colors[other]), 60) << part << " " << other;
    }
  }
  EXPECT_NEAR(colors[0][0], 1, 1e-6);  // red is the first
  EXPECT_NEAR(colors[0][1], 0.15F, 1e-6);
}

/// Columns of squares; materials change between them, groups between its halves.
Mesh named() {
  Mesh mesh = test::plane(3, 2);
  mesh.material_names = {"left", "middle", "right"};
  mesh.group_names = {"low", "high"};
  for (const Triangle& t : mesh.triangles) {
    const float x = (mesh.positions[t[0]].x + mesh.positions[t[1]].x + mesh.positions[t[2]].x) / 3;
    const float y = (mesh.positions[t[0]].y + mesh.positions[t[1]].y + mesh.positions[t[2]].y) / 3;
    mesh.materials.push_back(x < -1 / 6.0F ? 0 : x < 1 / 6.0F ? 1 : 2);
    mesh.groups.push_back(y < 0 ? 0 : 1);
  }
  return mesh;
}

TEST(IdMap, HasTheLegendsColoursAlone) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), named());
  BakeOptions options;
  options.width = 31;
  options.height = 16;
  options.samples = 3;  // edges run through texels
  options.maps = {MapKind{"id"}};
  for (const IdBy by : {IdBy::material, IdBy::group}) {
    options.id_by = by;
    const BakeResult baked = bake(source, test::plane(1, 1), options);
    const std::vector<IdEntry>& ids = baked.report.ids;
    ASSERT_EQ(ids.size(), by == IdBy::material ? 3U : 2U);
    EXPECT_EQ(ids[0].name, by == IdBy::material ? "left" : "low");
    EXPECT_EQ(ids[0].triangles, by == IdBy::material ? 4U : 6U);
    const Image& map = baked.maps[0].image;
    for (std::uint32_t y = 0; y < map.height; ++y) {
      for (std::uint32_t x = 0; x < map.width; ++x) {
        const double right = (x + 0.5) / map.width, up = 1 - (y + 0.5) / map.height;
        const std::size_t wanted = by == IdBy::material ? static_cast<std::size_t>(right * 3)
                                                        : static_cast<std::size_t>(up * 2);
        const float* texel = map.at(x, y);
        EXPECT_EQ((Color{texel[0], texel[1], texel[2]}), ids[wanted].color) << x << " " << y;
      }
    }
  }
  options.id_by = IdBy::object;
  EXPECT_THROW(bake(source, test::plane(1, 1), options), Error);
  options.id_by = IdBy::part;
  EXPECT_EQ(bake(source, test::plane(1, 1), options).report.ids.size(), 1U);
}

/// Colours as they are, from the nearest corner: none is blended, also between corners of several colours.
TEST(IdMap, TellsColoursApart) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh = test::plane(2, 1);
  const std::array<std::array<std::uint8_t, 4>, 2> colors{{{250, 128, 3, 255}, {0, 77, 255, 9}}};
  for (const Vec3& p : mesh.positions) mesh.colors.push_back(colors[p.x > 0.25F ? 1 : 0]);
  BakeOptions options;
  options.width = 32;
  options.height = 8;
  options.samples = 2;
  options.maps = {MapKind{"id"}};
  options.id_by = IdBy::color;
  const BakeResult baked = bake(Source(*test::device(), mesh), test::plane(1, 1), options);
  const std::vector<IdEntry>& ids = baked.report.ids;
  ASSERT_EQ(ids.size(), 2U);
  EXPECT_EQ(ids[0].name, "#fa8003");
  EXPECT_EQ(ids[1].name, "#004dff");
  EXPECT_EQ(ids[0].triangles + ids[1].triangles, mesh.triangles.size());
  const Image& map = baked.maps[0].image;
  for (std::uint32_t x = 0; x < map.width; ++x) {
    // Columns of corners stand at 0, 0.5 and 1: those at 1 are blue, and nearest from 0.75 on.
    const double right = (x + 0.5) / map.width;
    if (std::abs(right - 0.75) < 0.2) continue;
    const std::size_t wanted = right > 0.75 ? 1 : 0;
    for (std::uint32_t y = 0; y < map.height; ++y) {
      const float* texel = map.at(x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(texel[c], static_cast<float>(colors[wanted][c]) / 255) << x << " " << y;
      }
    }
  }
  for (std::size_t i = 0; i < map.pixels.size(); i += 3) {
    const Color texel{map.pixels[i], map.pixels[i + 1], map.pixels[i + 2]};
    EXPECT_TRUE(texel == ids[0].color || texel == ids[1].color) << i / 3;
  }
  EXPECT_THROW(bake(Source(*test::device(), test::plane(1, 1)), test::plane(1, 1), options), Error);
}

/// A legend of up to 4,096 entries is whole; of more, the warning counts all of them.
TEST(IdMap, ALegendThatIsCutSaysHowManyThereAre) {
  KILN_REQUIRE_DEVICE();
  for (const std::uint32_t parts : {4096U, 4097U, 4500U}) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < parts; ++i) {
      const auto x = static_cast<float>(i % 70) / 70 - 0.5F,
                 y = static_cast<float>(i / 70) / 70 - 0.5F;
      mesh.positions.insert(mesh.positions.end(),
                            {{x, y, 0}, {x + 0.01F, y, 0}, {x, y + 0.01F, 0}});
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    BakeOptions options;
    options.width = options.height = 8;
    options.maps = {MapKind{"id"}};
    const BakeResult baked = bake(Source(*test::device(), mesh), test::plane(1, 1), options);
    EXPECT_EQ(baked.report.ids.size(), std::min(parts, 4096U));
    const auto warning = std::find_if(baked.report.warnings.begin(), baked.report.warnings.end(),
                                      [](const Warning& one) { return one.code == "id-legend"; });
    ASSERT_EQ(warning != baked.report.warnings.end(), parts > 4096);
    if (parts == 4096) continue;
    EXPECT_EQ(warning->count, parts);
    EXPECT_NE(warning->message.text().find(std::to_string(parts)), std::string::npos);
  }
}

/// The error says which names are missing, and the legend of colours does not say that they repeat.
TEST(IdMap, SaysWhatIsMissing) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::plane(1, 1));
  BakeOptions options;
  options.width = options.height = 8;
  options.maps = {MapKind{"id"}};
  for (const auto& [by, kind] : {std::pair{IdBy::material, "materials"},
                                 {IdBy::group, "groups"},
                                 {IdBy::object, "objects"}}) {
    options.id_by = by;
    try {
      bake(source, test::plane(1, 1), options);
      ADD_FAILURE() << kind;
    } catch (const Error& error) {
      EXPECT_EQ(error.what(), std::string("The high poly has no ") + kind +
                                  ", to which the map id assigns colours: give an OBJ that has "
                                  "them, or assign colours to connected parts.");
    }
  }
  // 66 x 64 corners, each of a colour of its own.
  Mesh colours = test::plane(65, 63);
  for (std::uint32_t v = 0; v < colours.positions.size(); ++v) {
    colours.colors.push_back(
        {static_cast<std::uint8_t>(v % 251), static_cast<std::uint8_t>(v / 251), 7, 255});
  }
  options.id_by = IdBy::color;
  const BakeResult baked = bake(Source(*test::device(), colours), test::plane(1, 1), options);
  ASSERT_EQ(baked.report.ids.size(), 4096U);
  const auto warning = std::find_if(baked.report.warnings.begin(), baked.report.warnings.end(),
                                    [](const Warning& one) { return one.code == "id-legend"; });
  ASSERT_NE(warning, baked.report.warnings.end());
  EXPECT_EQ(warning->count, 4224U);
  EXPECT_EQ(warning->message.text(),
            "The map id has 4224 ids; its legend lists only the first 4096.");
}

}  // namespace
}  // namespace kiln

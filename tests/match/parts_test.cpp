// Parts by name: which groups pair, and that no sample finds a point of another part.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hard_scenes.h"
#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/hard_scene.h"
#include "support/shapes.h"

namespace kiln {
namespace {

Mesh named(const std::vector<std::string>& names) {
  Mesh mesh = test::plane(static_cast<std::uint32_t>(names.size()), 1);
  mesh.group_names = names;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) mesh.groups.push_back(t / 2);
  return mesh;
}

TEST(PairParts, TakesNamesByTheirPatterns) {
  const Parts parts = pair_parts(named({"bolt_high", "bolt_high_rim", "nut_high", "washer"}),
                                 named({"nut_low", "bolt_low", "washer"}));
  EXPECT_EQ(parts.names, (std::vector<std::string>{"bolt", "nut", "washer"}));
  EXPECT_EQ(parts.high, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{1, 1, 0, 0, 2, 2}));
  EXPECT_TRUE(parts.warnings.empty());
}

/// A low poly that was made of the high poly keeps its names.
TEST(PairParts, TakesTheHighPolysOwnNames) {
  const Parts parts = pair_parts(named({"bolt_high", "bolt_high_rim", "nut_high"}),
                                 named({"nut_high", "bolt_high_rim", "bolt_high"}));
  EXPECT_EQ(parts.names, (std::vector<std::string>{"bolt", "nut"}));
  EXPECT_EQ(parts.high, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1}));
  EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{1, 1, 0, 0, 0, 0}));
  EXPECT_TRUE(parts.warnings.empty());
}

TEST(PairParts, TakesOtherPatterns) {
  const PartNames names{{"LP_*"}, {"HP_*_x*", "HP_*"}};
  const Parts parts = pair_parts(named({"HP_a", "HP_b"}), named({"LP_b", "LP_a"}), names);
  EXPECT_EQ(parts.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_THROW(pair_parts(named({"a"}), named({"a"}), {{"low"}, {"*_high"}}), Error);
}

TEST(PairParts, TakesGroupsObjectsAndMaterialsOfTheSameName) {
  PartNames names;
  names.by = PartsBy::group;
  const Mesh high = named({"a_high", "b"}), low = named({"b", "a_high"});
  EXPECT_EQ(pair_parts(high, low, names).names, (std::vector<std::string>{"a_high", "b"}));
  EXPECT_EQ(pair_parts(high, low, names).low, (std::vector<std::uint32_t>{1, 1, 0, 0}));
  for (const PartsBy by : {PartsBy::object, PartsBy::material}) {
    names.by = by;
    Mesh painted_high = named({"x", "y"}), painted_low = named({"y", "x"});
    // The groups must not be looked at.
    EXPECT_THROW(pair_parts(painted_high, painted_low, names), Error);
    for (Mesh* mesh : {&painted_high, &painted_low}) {
      (by == PartsBy::object ? mesh->objects : mesh->materials) = {1, 1, 0, 0};
      (by == PartsBy::object ? mesh->object_names : mesh->material_names) = {"steel", "wood"};
    }
    const Parts parts = pair_parts(painted_high, painted_low, names);
    EXPECT_EQ(parts.names, (std::vector<std::string>{"steel", "wood"}));
    EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{1, 1, 0, 0}));
  }
}

TEST(PairParts, TakesAList) {
  PartNames names;
  names.by = PartsBy::list;
  EXPECT_THROW(pair_parts(named({"a"}), named({"a"}), names), Error);
  names.list = {{"frame*", {"hull", "bolt_?*", "bolt_*"}}, {"lamp", {"glass"}}};
  const Parts parts = pair_parts(named({"hull", "bolt_1", "glass", "lamp"}),
                                 named({"lamp", "frame_2", "other"}), names);
  EXPECT_EQ(parts.names, (std::vector<std::string>{"frame*", "lamp", ""}));
  EXPECT_EQ(parts.high, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{1, 1, 0, 0, 2, 2}));
  ASSERT_EQ(parts.warnings.size(), 2U);
  EXPECT_NE(parts.warnings[0].message.find("without a pair in the list: 'other'"),
            std::string::npos)
      << parts.warnings[0].message;
}

TEST(PairParts, NamesWhatHasNoPairAndTheNearest) {
  const Parts parts = pair_parts(named({"bolt_high", "nutt_high"}), named({"bolt_low", "nut_low"}));
  EXPECT_EQ(parts.count, 2U);
  EXPECT_EQ(parts.names.back(), "");
  EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  ASSERT_EQ(parts.warnings.size(), 2U);
  EXPECT_NE(parts.warnings[0].message.find("'nut_low' (nearest: 'nutt_high')"), std::string::npos)
      << parts.warnings[0].message;
  EXPECT_NE(parts.warnings[1].message.find("'nutt_high' (nearest: 'nut_low')"), std::string::npos);
}

TEST(PairParts, RefusesMeshesWithoutAnyPair) {
  EXPECT_THROW(pair_parts(named({"a"}), named({"b"})), Error);
  EXPECT_THROW(pair_parts(test::plane(1, 1), named({"b"})), Error);
  EXPECT_THROW(pair_parts(named({"a"}), test::plane(1, 1)), Error);
}

/// Samples of the assembly whose point is of another part's group.
std::size_t strangers(const Source& source, const sample::HardScene& scene, const Parts& own,
                      BakeOptions options) {
  const test::HardBake bake(source, scene.low, std::move(options));
  std::size_t count = 0;
  for (std::size_t i = 0; i < bake.samples.size(); ++i) {
    if (bake.samples.found[i] == 0) continue;
    count += own.high[bake.triangle(i)] != own.low[bake.samples.triangle[i]] ? 1 : 0;
  }
  return count;
}

/// The assembly's 14 parts sink into each other, so without names some samples find a neighbour's surface.
TEST(Parts, FindNotOnePointOfAnotherPart) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("assembly");
  const Source source(*test::device(), scene.high);
  const Parts parts = pair_parts(scene.high, scene.low);
  ASSERT_EQ(parts.count, 14U);
  EXPECT_TRUE(parts.warnings.empty());
  BakeOptions options;
  options.width = options.height = 256;
  EXPECT_GT(strangers(source, scene, parts, options), 100U);
  options.parts = &parts;
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
  options.cage = Length::share(0.05);
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
  options.cage.reset();
  options.fallback = {MatchMethod::closest};
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
  options.fallback = {};
  options.method = MatchMethod::closest;
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
}

/// One part of all is no parts at all, to the bit.
TEST(Parts, OfOneNameChangeNothing) {
  KILN_REQUIRE_DEVICE();
  const sample::HardScene scene = sample::hard_scene("cube");
  const Source source(*test::device(), scene.high);
  Parts parts;
  parts.count = 1;
  parts.names = {"all"};
  parts.low.resize(scene.low.triangles.size());
  parts.high.resize(scene.high.triangles.size());
  BakeOptions options;
  options.width = options.height = 96;
  options.maps = {MapKind{"normal"}, MapKind{"height"}, MapKind{"provenance"}};
  const BakeResult all = bake(source, scene.low, options);
  options.parts = &parts;
  const BakeResult apart = bake(source, scene.low, options);
  for (std::size_t k = 0; k < all.maps.size(); ++k) {
    EXPECT_EQ(all.maps[k].image.pixels, apart.maps[k].image.pixels) << k;
  }
}

TEST(Parts, RefuseOtherMeshesAndMatchesThatLookElsewhere) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::plane(2, 2), low = test::plane(1, 1);
  const Source source(*test::device(), high);
  Parts parts;
  parts.count = 1;
  parts.names = {"all"};
  parts.low.resize(low.triangles.size());
  parts.high.resize(high.triangles.size() + 1);
  BakeOptions options;
  options.width = options.height = 16;
  options.parts = &parts;
  EXPECT_THROW(bake(source, low, options), Error);
  parts.high.resize(high.triangles.size());
  EXPECT_EQ(bake(source, low, options).report.missed, 0U);
  options.method = MatchMethod::views;
  EXPECT_THROW(bake(source, low, options), Error);
}

}  // namespace
}  // namespace kiln

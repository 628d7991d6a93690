// Parts by name: which groups pair, and that no sample finds a point of another part.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cl/context.h"
#include "hard_scenes.h"
#include "kiln/bake.h"
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

/// Endings of the trade, in upper and lower case, and the numbers that Blender gives to copies.
TEST(PairParts, TakesUsualNames) {
  for (const auto& [low, high] :
       std::vector<std::pair<std::string, std::string>>{{"gun_low", "gun_high"},
                                                        {"gun_lp", "gun_hp"},
                                                        {"gun_lo", "gun_hi"},
                                                        {"gun_lowpoly", "gun_highpoly"},
                                                        {"gun_LOW", "gun_High"},
                                                        {"gun_LP", "gun_HP_2"},
                                                        {"gun_low", "gun_high.001"},
                                                        {"gun_low.002", "gun_high"},
                                                        {"gun_low", "gun_high_bolt.001"},
                                                        {"gun", "gun_high.012"}}) {
    const Parts parts = pair_parts(named({high, "lamp_high"}), named({"lamp_low", low}));
    EXPECT_EQ(parts.names, (std::vector<std::string>{"gun", "lamp"})) << low << ", " << high;
    EXPECT_TRUE(parts.warnings.empty()) << low << ", " << high;
  }
  const Parts copies = pair_parts(named({"gun_high", "gun_high.001", "Cube.001", "Cube.002"}),
                                  named({"Cube.002", "gun_low", "Cube.001"}));
  EXPECT_EQ(copies.names, (std::vector<std::string>{"Cube.001", "Cube.002", "gun"}));
  EXPECT_EQ(copies.high, (std::vector<std::uint32_t>{2, 2, 2, 2, 0, 0, 1, 1}));
  // Names of parts, unlike their endings, differ by case. Two digits are no copy's number.
  EXPECT_EQ(pair_parts(named({"Gun_high", "gun_high", "x"}), named({"gun_low", "x"})).high,
            (std::vector<std::uint32_t>{2, 2, 0, 0, 1, 1}));
  EXPECT_EQ(pair_parts(named({"gun_high.01", "x"}), named({"gun_low", "x"})).names,
            (std::vector<std::string>{"x", ""}));
}

std::string refusal(const Mesh& high, const Mesh& low) {
  try {
    pair_parts(high, low);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    return error.what();
  }
  return "";
}

TEST(PairParts, ProposesThePatternsThatFit) {
  const auto says = [](const std::string& text, const std::string& low, const std::string& high) {
    return text.find("With `part_names.low` '" + low + "' and `part_names.high` '" + high + "'") !=
           std::string::npos;
  };
  EXPECT_TRUE(says(refusal(named({"gun_sculpt", "lamp_sculpt"}), named({"lamp_game", "gun_game"})),
                   "*_game", "*_sculpt"));
  EXPECT_TRUE(
      says(refusal(named({"hd-gun", "hd-lamp"}), named({"ld-lamp", "ld-gun"})), "ld-*", "hd-*"));
  EXPECT_TRUE(says(refusal(named({"GunScan", "LampScan"}), named({"LampGame", "GunGame"})), "*Game",
                   "*Scan"));
  const Parts parts = pair_parts(named({"a_gun_sculpt", "b_lamp_sculpt", "box"}),
                                 named({"b_lamp_game", "a_gun_game", "box"}));
  ASSERT_EQ(parts.warnings.size(), 2U);
  EXPECT_TRUE(says(parts.warnings[0].message.text(), "*_game", "*_sculpt"))
      << parts.warnings[0].message.text();
  // The remedies they propose work.
  const PartNames names{{"*_game"}, {"*_sculpt"}};
  EXPECT_EQ(pair_parts(named({"gun_sculpt"}), named({"gun_game"}), names).names,
            (std::vector<std::string>{"gun"}));
  // Nothing in common: nothing is proposed.
  const std::string none = refusal(named({"x"}), named({"gun"}));
  EXPECT_EQ(none.find("With PartNames"), std::string::npos) << none;
  EXPECT_NE(none.find("`part_names.low` and `part_names.high` say which belong"),
            std::string::npos);
}

/// By the rule of what fits, tried in every way.
bool fits_in_some_way(std::string_view text, std::string_view pattern) {
  if (pattern.empty()) return text.empty();
  if (pattern[0] != '*') {
    return !text.empty() && text[0] == pattern[0] &&
           fits_in_some_way(text.substr(1), pattern.substr(1));
  }
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (fits_in_some_way(text.substr(i), pattern.substr(1))) return true;
  }
  return false;
}

TEST(PairParts, PatternsFitAsTriedInEveryWay) {
  const auto words = [](std::string letters, std::size_t longest) {
    std::vector<std::string> all = {""};
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (const char c : all[i].size() < longest ? letters : std::string()) {
        all.push_back(all[i] + c);
      }
    }
    return all;
  };
  const std::vector<std::string> texts = words("ab", 5);
  for (const std::string& pattern : words("ab*", 5)) {
    const std::size_t star = pattern.find('*');
    // A pattern of stars alone: 'x' fits it, too.
    if (star == std::string::npos || pattern.find_first_not_of('*') == std::string::npos) continue;
    PartNames names;
    names.by = PartsBy::list;
    names.list = {{pattern, {pattern}}, {"x", {"x"}}};
    for (const std::string& text : texts) {
      if (text.empty()) continue;
      const Parts parts = pair_parts(named({"x", text}), named({"x", text}), names);
      EXPECT_EQ(parts.low[2] == parts.low[0] || parts.names[parts.low[2]].empty(),
                !fits_in_some_way(text, pattern))
          << text << ", " << pattern;
      // By name, the part is the shortest text that fits.
      std::string part = text;
      for (std::size_t end = star + 1; end <= text.size(); ++end) {
        if (text.substr(0, star) != pattern.substr(0, star)) break;
        if (!fits_in_some_way(text.substr(end), pattern.substr(star + 1))) continue;
        // The shortest is no text at all, which is no name.
        if (!fits_in_some_way(text.substr(star), pattern.substr(star + 1))) {
          part = text.substr(star, end - star);
        }
        break;
      }
      const Parts by_name = pair_parts(named({text}), named({text}), {{pattern}, {pattern}});
      EXPECT_EQ(by_name.names, (std::vector<std::string>{part})) << text << ", " << pattern;
    }
  }
}

/// These took 17 s, minutes and hours; Counted of tests/mesh counts what like ones do.
TEST(PairParts, EndsWithHostileNames) {
  std::string pattern;
  for (int i = 0; i < 20; ++i) pattern += "*a";
  PartNames names;
  names.by = PartsBy::list;
  names.list = {{pattern + "b", {pattern + "b"}}, {"x", {"x"}}};
  EXPECT_EQ(pair_parts(named({std::string(40, 'a'), "x"}), named({"x"}), names).names,
            (std::vector<std::string>{"x", ""}));
  // Names of 200 KB.
  const std::string large(200'000, 'a');
  const Parts parts =
      pair_parts(named({"x", large + "b", large + "c"}), named({"x", "b" + large, "c" + large}));
  EXPECT_EQ(parts.names, (std::vector<std::string>{"x", ""}));
  EXPECT_LT(parts.warnings[0].message.text().size(), 2000U);
  // 20,000 names that match nothing.
  std::vector<std::string> low = {"x"}, high = {"x"};
  for (int i = 0; i < 20'000; ++i) {
    low.push_back("one" + std::to_string(7 * i));
    high.push_back("other" + std::to_string(3 * i));
  }
  EXPECT_EQ(pair_parts(named(high), named(low)).count, 2U);
  // As many patterns, and names that only the last of them fit.
  names.list.clear();
  for (int i = 0; i < 20'000; ++i) {
    const std::string number = std::to_string(i);
    names.list.push_back({i % 2 == 0 ? "one" + number + "_*" : "*_one" + number, {"x*" + number}});
  }
  names.list.push_back({"one*", {"other*"}});
  EXPECT_EQ(pair_parts(named(high), named(low), names).names,
            (std::vector<std::string>{"one*", ""}));
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
  EXPECT_NE(parts.warnings[0].message.text().find("without a pair in the list: 'other'"),
            std::string::npos)
      << parts.warnings[0].message.text();
}

/// A name that no line has is not the left side of a line, whatever that is called.
TEST(PairParts, TakesNoNameForALineOfAList) {
  PartNames names;
  names.by = PartsBy::list;
  names.list = {{"frame", {"hull"}}, {"low other", {"glass"}}, {"high other", {"glass"}}};
  const Parts parts =
      pair_parts(named({"hull", "glass", "other"}), named({"frame", "other"}), names);
  EXPECT_EQ(parts.names, (std::vector<std::string>{"frame", ""}));
  EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{0, 0, 1, 1}));
}

// `g head_high skin` of an OBJ: two names of a group.
TEST(PairParts, GroupsOfSeveralNamesPairByAny) {
  const auto names_of = [](const std::vector<std::string>& high,
                           const std::vector<std::string>& low, PartsBy by = PartsBy::name) {
    PartNames names;
    names.by = by;
    const Parts parts = pair_parts(named(high), named(low), names);
    EXPECT_TRUE(parts.warnings.empty()) << parts.warnings[0].message.text();
    return parts.names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names_of({"head_high skin", "arm_high skin"}, {"arm_low", "head_low"}),
            (Names{"arm", "head"}));
  EXPECT_EQ(names_of({"head_high", "arm_high"}, {"skin arm_low", "skin  head_low"}),
            (Names{"arm", "head"}));
  // What a pattern knows goes before what all of them have.
  EXPECT_EQ(names_of({"head_high skin", "arm_high skin"}, {"head_low skin", "arm_low skin"}),
            (Names{"arm", "head"}));
  // Whole names go first, as exporters write blanks.
  EXPECT_EQ(names_of({"Part 1", "Part 2"}, {"Part 2", "Part 1"}), (Names{"Part 1", "Part 2"}));
}

TEST(PairParts, WordsThatNoPatternKnowsAreSaid) {
  PartNames names;
  for (const PartsBy by : {PartsBy::name, PartsBy::group}) {
    names.by = by;
    // By the name that the fewest have, whatever its place.
    const Parts parts =
        pair_parts(named({"skin head", "skin arm"}), named({"arm skin", "head skin"}), names);
    EXPECT_EQ(parts.names, (std::vector<std::string>{"arm", "head"}));
    EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{0, 0, 1, 1}));
    EXPECT_EQ(parts.high, (std::vector<std::uint32_t>{1, 1, 0, 0}));
    ASSERT_EQ(parts.warnings.size(), 1U);
    EXPECT_EQ(parts.warnings[0].code, "parts-by-word");
    EXPECT_EQ(parts.warnings[0].count, 4U);
  }
  // Both sides choose alike where two names do.
  names.by = PartsBy::group;
  EXPECT_EQ(pair_parts(named({"b a"}), named({"a b"}), names).names,
            (std::vector<std::string>{"a"}));
  // A list knows what it knows.
  names.by = PartsBy::list;
  names.list = {{"frame", {"hull"}}};
  EXPECT_EQ(
      pair_parts(named({"hull steel", "steel"}), named({"steel frame", "steel"}), names).names,
      (std::vector<std::string>{"frame", ""}));
}

/// Blanks in names of objects part nothing: an object has one name.
TEST(PairParts, NamesOfObjectsAreWhole) {
  Mesh high = named({"Wheel left"}), low = named({"Wheel right"});
  EXPECT_EQ(pair_parts(high, low).names, std::vector<std::string>{"Wheel"});
  for (Mesh* mesh : {&high, &low}) {
    mesh->objects = mesh->groups;
    mesh->object_names = mesh->group_names;
  }
  EXPECT_THROW(pair_parts(high, low), Error);
  for (Mesh* mesh : {&high, &low}) mesh->groups.clear();
  EXPECT_THROW(pair_parts(high, low), Error);
}

TEST(PairParts, NamesWhatHasNoPairAndTheNearest) {
  const Parts parts = pair_parts(named({"bolt_high", "nutt_high"}), named({"bolt_low", "nut_low"}));
  EXPECT_EQ(parts.count, 2U);
  EXPECT_EQ(parts.names.back(), "");
  EXPECT_EQ(parts.low, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  ASSERT_EQ(parts.warnings.size(), 2U);
  EXPECT_NE(parts.warnings[0].message.text().find("'nut_low' (nearest: 'nutt_high')"),
            std::string::npos)
      << parts.warnings[0].message.text();
  EXPECT_NE(parts.warnings[1].message.text().find("'nutt_high' (nearest: 'nut_low')"),
            std::string::npos);
}

TEST(PairParts, RefusesMeshesWithoutAnyPair) {
  EXPECT_THROW(pair_parts(named({"a"}), named({"b"})), Error);
  EXPECT_THROW(pair_parts(test::plane(1, 1), named({"b"})), Error);
  EXPECT_THROW(pair_parts(named({"a"}), test::plane(1, 1)), Error);
  EXPECT_THROW(pair_parts(named({"a"}), Mesh()), Error);
  EXPECT_THROW(pair_parts(Mesh(), named({"a"})), Error);
}

/// Samples of the assembly whose point is of another part's group.
std::size_t strangers(const Source& source, const sample::HardScene& scene, const Parts& own,
                      BakeOptions options) {
  const test::HardBake bake(source, scene.low, std::move(options));
  std::size_t count = 0;
  for (std::size_t i = 0; i < bake.samples.size(); ++i) {
    if (bake.samples.found[i] == 0) continue;
    if (bake.triangle(i) >= own.high.size() || bake.samples.triangle[i] >= own.low.size()) {
      ADD_FAILURE() << "sample " << i << " has no triangle of the meshes";
      return bake.samples.size();
    }
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
  options.match.parts = &parts;
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
  options.match.cage = Length::share(0.05);
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
  options.match.cage.reset();
  options.match.fallback = {MatchMethod::closest};
  EXPECT_EQ(strangers(source, scene, parts, options), 0U);
  options.match.fallback = {};
  options.match.method = MatchMethod::closest;
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
  options.match.parts = &parts;
  const BakeResult apart = bake(source, scene.low, options);
  for (std::size_t k = 0; k < all.maps.size(); ++k) {
    EXPECT_EQ(all.maps[k].image.pixels, apart.maps[k].image.pixels) << k;
  }
}

/// The same faces in more parts: each costs a fixed number of commands of the device, few of which are waited for.
TEST(Parts, CostGrowsNoFasterThanTheirNumber) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::plane(80, 80), low = test::plane(50, 50);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 128;
  const ocl::Context& context = context_of(*test::device());
  const auto commands = [&](std::uint32_t count) {
    Parts parts;
    parts.count = count;
    parts.names.resize(count);
    for (std::uint32_t t = 0; t < low.triangles.size(); ++t) {
      parts.low.push_back(
          static_cast<std::uint32_t>(std::size_t{t} * count / low.triangles.size()));
    }
    for (std::uint32_t t = 0; t < high.triangles.size(); ++t) {
      parts.high.push_back(
          static_cast<std::uint32_t>(std::size_t{t} * count / high.triangles.size()));
    }
    options.match.parts = &parts;
    const std::uint64_t before = context.commands();
    EXPECT_EQ(bake(source, low, options).report.samples, 128U * 128U);
    return static_cast<double>(context.commands() - before);
  };
  constexpr std::uint32_t kFew = 10, kMany = 5000;
  const double few = commands(kFew), many = commands(kMany);
  EXPECT_LT(std::log(many / few) / std::log(double{kMany} / kFew), 1.1) << few << ", " << many;
  EXPECT_LT(many / kMany, 16);
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
  options.match.parts = &parts;
  EXPECT_THROW(bake(source, low, options), Error);
  parts.high.resize(high.triangles.size());
  EXPECT_EQ(bake(source, low, options).report.missed, 0U);
  options.match.method = MatchMethod::views;
  EXPECT_THROW(bake(source, low, options), Error);
}

}  // namespace
}  // namespace kiln

// Texture sets: each bakes what one map of the same layout has on its triangles.
#include "kiln/texture_sets.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kiln/plan.h"
#include "kiln/session.h"
#include "match/match_array.h"
#include "mesh/low_surface.h"
#include "source/set_layouts.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A sphere in two materials, its UVs on a grid that shifts by whole numbers leave exact.
Mesh two_materials() {
  Mesh low = test::BumpySphere::light();
  for (Vec2& uv : low.uvs) {
    uv = {std::round(uv.x * 4096) / 4096, std::round(uv.y * 4096) / 4096};
  }
  low.material_names = {"top", "bottom"};
  low.materials.clear();
  for (const Triangle& t : low.triangles) {
    const float z = low.positions[t[0]].z + low.positions[t[1]].z + low.positions[t[2]].z;
    low.materials.push_back(z > 0 ? 0 : 1);
  }
  return low;
}

/// Moves one material's UVs, which gives it corners of its own.
Mesh moved(const Mesh& low, std::uint32_t material, float u, float v) {
  Mesh mesh = low;
  mesh.uvs.clear();
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      Vec2 uv = low.uvs[low.uv_triangles[t][k]];
      if (low.materials[t] == material) uv = {uv.x + u, uv.y + v};
      mesh.uv_triangles[t][k] = static_cast<std::uint32_t>(mesh.uvs.size());
      mesh.uvs.push_back(uv);
    }
  }
  return mesh;
}

BakeOptions options_of_sets() {
  BakeOptions options;
  options.width = options.height = 128;
  options.maps = {MapKind::normal, MapKind{"ao"}};
  options.encoding.gutter = 0;
  return options;
}

/// Each texel of the whole bake is that of one of the sets, and of one alone: to the bit, but for tangents that are made
/// unit once more.
void expect_whole(const BakeResult& whole, const std::vector<BakeResult>& sets, float most) {
  for (std::size_t i = 0; i < whole.coverage.size(); ++i) {
    std::size_t baked = 0;
    for (const BakeResult& set : sets) {
      if (TexelState{set.coverage[i]} != TexelState::baked) continue;
      ++baked;
      for (std::size_t m = 0; m < whole.maps.size(); ++m) {
        const Image &a = whole.maps[m].image, &b = set.maps[m].image;
        for (std::size_t c = 0; c < a.channels; ++c) {
          ASSERT_NEAR(a.pixels[i * a.channels + c], b.pixels[i * a.channels + c], most)
              << "texel " << i;
        }
      }
    }
    ASSERT_EQ(baked, TexelState{whole.coverage[i]} == TexelState::baked ? 1U : 0U);
  }
}

TEST(TextureSets, MaterialsBakeWhatOneMapHas) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = two_materials();
  const Source source(*test::device(), test::BumpySphere::dense(20000));
  const BakeResult whole = bake(source, low, options_of_sets());
  const std::vector<TextureSet> sets = find_texture_sets(low, SetsBy::material);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[0].name, "top");
  std::vector<BakeResult> baked;
  for (const TextureSet& set : sets) {
    baked.push_back(bake(source, low_of_set(low, set), options_of_sets()));
  }
  expect_whole(whole, baked, 0x1p-22F);
}

// A set's triangles need not stand together: each second one makes hundreds of runs, each 20th below 64.
TEST(TextureSets, AreTheSameHoweverTheirTrianglesStand) {
  KILN_REQUIRE_DEVICE();
  const Source source(*test::device(), test::BumpySphere::dense(20000));
  Mesh low = two_materials();
  const BakeResult whole = bake(source, low, options_of_sets());
  for (const std::size_t step : {2U, 20U}) {
    ASSERT_GT(low.triangles.size(), 128 * 2);
    for (std::size_t t = 0; t < low.materials.size(); ++t) low.materials[t] = t % step == 0 ? 1 : 0;
    const std::vector<TextureSet> sets = find_texture_sets(low, SetsBy::material);
    ASSERT_EQ(sets.size(), 2U);
    // One mesh for all sets, from the second to the first and back.
    std::vector<BakeResult> baked;
    Mesh part = low_of_set(low, sets[1]);
    for (const std::size_t set : {0U, 1U}) {
      lay_out_set(low, sets[set], part);
      baked.push_back(bake(source, part, options_of_sets()));
    }
    expect_whole(whole, baked, 0x1p-22F);
  }
}

// SetLayouts tells the source what changed; a layout that it does not know would be baked as the one before.
TEST(TextureSets, LayoutsInPlaceBakeWhatCopiesDo) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::BumpySphere::dense(20000);
  const Source source(*test::device(), high);
  BakeOptions options = options_of_sets();
  options.encoding.mips = true;  // by charts
  options.width = options.height = 64;
  options.maps = {MapKind::normal};
  for (const SetsBy by : {SetsBy::material, SetsBy::udim}) {
    Mesh low = by == SetsBy::material ? two_materials() : moved(two_materials(), 1, 2, 3);
    // Each second mesh has the shape of the one before, and other UVs.
    for (int turn = 0; turn < 2; ++turn) {
      const std::vector<TextureSet> sets = find_texture_sets(low, by);
      ASSERT_GE(sets.size(), 2U);
      Mesh part = low;
      part.tangents = tangents_of(low);
      SetLayouts layouts(source, low, part);
      for (const std::size_t set : {0U, 1U, 0U}) {
        layouts.lay_out(sets[set]);
        const Mesh copy = low_of_set(low, sets[set]);
        EXPECT_EQ(part.uv_triangles, copy.uv_triangles);
        EXPECT_EQ(hash_low(part), hash_low(copy));
        const BakeResult in_place = bake(source, part, options);
        const BakeResult expected = bake(Source(*test::device(), high), copy, options);
        ASSERT_EQ(in_place.maps.size(), expected.maps.size());
        EXPECT_EQ(in_place.coverage, expected.coverage);
        for (std::size_t m = 0; m < expected.maps.size(); ++m) {
          EXPECT_EQ(in_place.maps[m].image.pixels, expected.maps[m].image.pixels);
          for (std::size_t level = 0; level < expected.maps[m].mips.size(); ++level) {
            EXPECT_EQ(in_place.maps[m].mips[level].pixels, expected.maps[m].mips[level].pixels);
          }
        }
        ASSERT_EQ(in_place.report.warnings.size(), expected.report.warnings.size());
        for (std::size_t w = 0; w < expected.report.warnings.size(); ++w) {
          EXPECT_EQ(in_place.report.warnings[w].message, expected.report.warnings[w].message);
        }
      }
      for (Vec2& uv : low.uvs) uv = {std::floor(uv.x) * 2 + 1 - uv.x, uv.y};
    }
  }
}

TEST(TextureSets, TilesBakeWhatOneMapHas) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = two_materials(), tiled = moved(low, 1, 2, 3);
  const Source source(*test::device(), test::BumpySphere::dense(20000));
  BakeOptions options = options_of_sets();
  options.encoding.space = NormalMapSpace::object;  // MikkTSpace parts where UVs do
  const BakeResult whole = bake(source, low, options);
  const std::vector<TextureSet> sets = find_texture_sets(tiled, SetsBy::udim);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[0].name, "1001");
  EXPECT_EQ(sets[1].name, "1033");
  std::vector<BakeResult> baked;
  for (const TextureSet& set : sets) {
    baked.push_back(bake(source, low_of_set(tiled, set), options));
  }
  expect_whole(whole, baked, 0);
}

/// A unit square of two triangles at a place in UV space.
void add_square(Mesh& mesh, Vec2 at, std::uint32_t material, bool turned = false) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const float z = static_cast<float>(first);
  for (const auto& [u, v] : {std::pair{0.F, 0.F}, {1.F, 0.F}, {1.F, 1.F}, {0.F, 1.F}}) {
    mesh.positions.push_back({u, v, z});
    mesh.uvs.push_back(turned ? Vec2{at.x + v * 0.7F, at.y + u * 0.9F} : Vec2{at.x + u, at.y + v});
  }
  for (const Triangle& t : {Triangle{first, first + 1, first + 2}, {first, first + 2, first + 3}}) {
    mesh.triangles.push_back(t);
    mesh.uv_triangles.push_back(t);
    mesh.materials.push_back(material);
  }
}

TEST(TextureSets, AreChosenWhereOneMapWouldHoldTwoSurfaces) {
  Mesh mesh;
  mesh.material_names = {"a", "b"};
  add_square(mesh, {0, 0}, 0);
  EXPECT_EQ(choose_texture_sets(mesh), SetsBy::none);
  Mesh overlapping = mesh;
  add_square(overlapping, {0, 0}, 1);
  EXPECT_EQ(choose_texture_sets(overlapping), SetsBy::material);
  Mesh copies = mesh;  // A copy moved along by a whole number shares the texels on purpose.
  add_square(copies, {1, 0}, 0);
  EXPECT_EQ(choose_texture_sets(copies), SetsBy::none);
  Mesh tiles = mesh;
  add_square(tiles, {1, 0}, 0, /*turned=*/true);
  EXPECT_EQ(choose_texture_sets(tiles), SetsBy::udim);
  Mesh below = mesh;  // no tile of UDIM's
  add_square(below, {0, -1}, 0, /*turned=*/true);
  EXPECT_EQ(choose_texture_sets(below), SetsBy::none);
  EXPECT_THROW(find_texture_sets(below, SetsBy::udim), Error);
  EXPECT_THROW(find_texture_sets(below, SetsBy::object), Error);
}

TEST(TextureSets, MaterialsHaveTilesOfTheirOwn) {
  Mesh mesh;
  mesh.material_names = {"a", "b", "c"};
  add_square(mesh, {0, 0}, 0);
  add_square(mesh, {1, 0}, 0, /*turned=*/true);
  add_square(mesh, {2, 1}, 1);  // one tile, wherever it is
  add_square(mesh, {0, 0}, 2);
  add_square(mesh, {1, 0}, 2);  // a copy, which shares its texels
  const std::vector<TextureSet> sets = find_texture_sets(mesh, SetsBy::material);
  std::vector<std::string> names, tiles;
  for (const TextureSet& set : sets) {
    names.push_back(set.name);
    tiles.push_back(set.tile);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"a", "a", "b", "c"}));
  EXPECT_EQ(tiles, (std::vector<std::string>{"1001", "1002", "", ""}));
  EXPECT_EQ(sets[1].tile_u, 1U);
  EXPECT_EQ(sets[2].tile_u, 2U);
  EXPECT_EQ(sets[2].tile_v, 1U);
  EXPECT_EQ(sets[3].triangles, 4U);
  EXPECT_EQ(low_of_set(mesh, sets[2]).uvs[8], (Vec2{0, 0}));
}

/// A session of a set, and its saved match, are those of any low poly.
TEST(TextureSets, SessionsAndSavedMatchesBakeTheSame) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = moved(two_materials(), 1, 1, 0), high = test::BumpySphere::dense(20000);
  const Source source(*test::device(), high);
  BakeOptions options = options_of_sets();
  options.report.recall = 1024;
  const TextureSet tile = find_texture_sets(low, SetsBy::udim)[1];
  const Mesh set = low_of_set(low, tile);
  options.report.keep_match = true;
  const BakeResult fresh = bake(source, set, options);
  EXPECT_LT(fresh.report.recall->lost, 0.01);
  options.report.keep_match = false;
  const BakeResult again = bake(*fresh.match, source, set, options);
  BakeSession session(*test::device(), high, set, options);
  for (std::size_t m = 0; m < fresh.maps.size(); ++m) {
    EXPECT_EQ(fresh.maps[m].image.pixels, again.maps[m].image.pixels);
    EXPECT_EQ(fresh.maps[m].image.pixels, session.bake().maps[m].image.pixels);
  }
  const Mesh other = low_of_set(low, find_texture_sets(low, SetsBy::udim)[0]);
  EXPECT_THROW(bake(*fresh.match, source, other, options), Error);
}

/// Pictures of what other sets show do not count: they have maps of their own.
TEST(TextureSets, PlansMeasureTheirOwnTriangles) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = two_materials();
  const Source source(*test::device(), test::BumpySphere::dense(20000));
  const Mesh set = low_of_set(low, find_texture_sets(low, SetsBy::material)[0]);
  PlanOptions plan;
  plan.bake = options_of_sets();
  plan.bake.maps = {MapKind::normal};
  plan.max_error = 90;
  const PlannedBake all = bake_planned(source, low, plan), one = bake_planned(source, set, plan);
  // The upper half of a sphere, from directions all around: half of the pixels.
  EXPECT_NEAR(static_cast<double>(one.without_map.pixels),
              0.5 * static_cast<double>(all.without_map.pixels),
              0.02 * static_cast<double>(all.without_map.pixels));
  // Both halves are alike, so its map is as good as all of the map.
  EXPECT_NEAR(one.chosen.error.mean_degrees, all.chosen.error.mean_degrees,
              0.2 * all.chosen.error.mean_degrees);
}

TEST(TextureSets, WithoutAreaThereIsNone) {
  Mesh mesh;
  mesh.material_names = {"a", "b", "c"};
  add_square(mesh, {0, 0}, 0);
  add_square(mesh, {0, 0}, 2);
  for (std::size_t i = 4; i < 8; ++i) mesh.uvs[i] = {0.5F, 0.5F};
  const std::vector<TextureSet> sets = find_texture_sets(mesh, SetsBy::material);
  ASSERT_EQ(sets.size(), 1U);
  EXPECT_EQ(sets[0].name, "a");
  EXPECT_EQ(sets[0].triangles, 2U);
}

}  // namespace
}  // namespace kiln

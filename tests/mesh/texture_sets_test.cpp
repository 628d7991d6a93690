// Which triangles form which texture set, and what is said where they cannot.
#include "kiln/texture_sets.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "kiln/validate.h"

namespace kiln {
namespace {

using Ids = std::vector<std::uint32_t>;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A mesh whose triangles have these UVs, and corners of their own.
Mesh laid_out(const std::vector<std::array<Vec2, 3>>& uvs) {
  Mesh mesh;
  mesh.name = "crate.obj";
  for (std::uint32_t t = 0; t < uvs.size(); ++t) {
    const auto x = static_cast<float>(t);
    mesh.positions.insert(mesh.positions.end(), {{x, 0, 1}, {x + 1, 0, 2}, {x, 3, 0}});
    mesh.uvs.insert(mesh.uvs.end(), uvs[t].begin(), uvs[t].end());
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// A right triangle with its right angle at (u, v).
std::array<Vec2, 3> at(float u, float v, float width = 0.5F, float height = 0.25F) {
  return {{{u, v}, {u + width, v}, {u, v + height}}};
}

/// Three points on a line: no texel is theirs.
std::array<Vec2, 3> flat(float u, float v) {
  return {{{u, v}, {u + 0.25F, v + 0.125F}, {u + 0.5F, v + 0.25F}}};
}

std::string error_of(const Mesh& mesh, SetsBy by) {
  try {
    (void)find_texture_sets(mesh, by);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    return error.what();
  }
  return "";
}

TEST(TextureSetsOf, TilesHaveNoFlatTriangles) {
  const Mesh mesh = laid_out(
      {at(2.25F, 1.25F), flat(4.5F, 3.5F), at(1.25F, 0.25F), at(1.5F, 0.5F), flat(1.25F, 0.25F)});
  const std::vector<TextureSet> sets = find_texture_sets(mesh, SetsBy::udim);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[0].name, "1002");
  EXPECT_EQ(sets[0].members, (Ids{2, 3}));
  EXPECT_EQ(sets[0].triangles, 2U);
  EXPECT_EQ(sets[1].name, "1013");
  EXPECT_EQ(sets[1].members, Ids{0});
  EXPECT_EQ(std::pair(sets[1].tile_u, sets[1].tile_v), std::pair(2U, 1U));
}

// A flat triangle of a material that lies in another tile does not tear the material in two.
TEST(TextureSetsOf, FlatTrianglesAreOfTheirMaterialsOneTile) {
  Mesh mesh = laid_out({at(0.25F, 0.25F),
                        at(2.25F, 1.25F),
                        flat(4.5F, 3.5F),
                        at(2.5F, 1.5F),
                        {{{kNaN, 0}, {1, 1}, {0, 1}}},
                        at(0.5F, 0.5F)});
  mesh.material_names = {"unused", "wood", "iron"};
  mesh.materials = {1, 2, 2, 2, 2, 1};
  const std::vector<TextureSet> sets = find_texture_sets(mesh, SetsBy::material);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[0].name, "wood");
  EXPECT_EQ(sets[0].members, (Ids{0, 5}));
  EXPECT_EQ(std::pair(sets[0].tile_u, sets[0].tile_v), std::pair(0U, 0U));
  EXPECT_EQ(sets[1].name, "iron");
  EXPECT_EQ(sets[1].tile, "");
  EXPECT_EQ(sets[1].members, (Ids{1, 2, 3})) << "those without UVs are of no set";
  EXPECT_EQ(sets[1].triangles, 2U) << "those with an area";
  EXPECT_EQ(std::pair(sets[1].tile_u, sets[1].tile_v), std::pair(2U, 1U));
  // Its own layout is that of its tile, moved to the unit square.
  mesh.tangents.assign(3 * mesh.triangles.size(), Tangent{{0, 0, 1}, -1});
  const Mesh iron = low_of_set(mesh, sets[1]);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 uv = iron.uvs[iron.uv_triangles[t][k]];
      const Vec2 own = mesh.uvs[mesh.uv_triangles[t][k]];
      EXPECT_EQ(std::isnan(uv.x), t == 0 || t == 4 || t == 5) << t;
      if (t >= 1 && t <= 3) EXPECT_EQ(std::pair(uv.x, uv.y), std::pair(own.x - 2, own.y - 1)) << t;
      EXPECT_EQ(iron.tangents[3 * t + k].sign, -1) << "tangents of the file stay";
    }
  }
}

TEST(TextureSetsOf, MaterialsOfTilesThatOverlapAreSplitByTile) {
  Mesh mesh = laid_out({at(0.25F, 0.25F), at(1.125F, 0.25F), at(1.25F, 2.25F), flat(3.5F, 0.5F)});
  mesh.material_names = {"wood", "iron"};
  mesh.materials = {0, 1, 1, 1};
  std::vector<TextureSet> sets = find_texture_sets(mesh, SetsBy::material);
  ASSERT_EQ(sets.size(), 3U);
  EXPECT_EQ(sets[1].name, "iron");
  EXPECT_EQ(sets[1].tile, "1002");
  EXPECT_EQ(sets[1].members, Ids{1});
  EXPECT_EQ(sets[2].tile, "1022");
  EXPECT_EQ(sets[2].members, Ids{2});
  EXPECT_EQ(std::pair(sets[2].tile_u, sets[2].tile_v), std::pair(1U, 2U));
  // Apart from each other they share one map, which repeats.
  for (std::uint32_t k = 6; k < 9; ++k) mesh.uvs[k].y += 0.375F;
  sets = find_texture_sets(mesh, SetsBy::material);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[1].tile, "");
  EXPECT_EQ(sets[1].members, (Ids{1, 2, 3}));
  EXPECT_EQ(std::pair(sets[1].tile_u, sets[1].tile_v), std::pair(0U, 0U));
}

TEST(TextureSetsOf, TrianglesBeyondAllTilesAreNamed) {
  for (const auto& [u, v] :
       {std::pair{-0.75F, 0.25F}, {10.25F, 0.5F}, {3.25F, -0.75F}, {0.25F, 900.5F}}) {
    const Mesh mesh = laid_out({at(0.25F, 0.25F), flat(-4, 0), at(9.25F, 899.5F), at(u, v)});
    const std::string error = error_of(mesh, SetsBy::udim);
    EXPECT_NE(error.find("Mesh 'crate.obj': triangle 3 lies at UV ("), std::string::npos) << error;
    EXPECT_NE(error.find("u goes from 0 to 10, v from 0 to 900. Move its chart into a tile."),
              std::string::npos)
        << error;
    EXPECT_EQ(choose_texture_sets(mesh), SetsBy::none);
  }
  const Mesh inside = laid_out({at(9.25F, 899.5F), at(0.25F, 0.25F)});
  const std::vector<TextureSet> sets = find_texture_sets(inside, SetsBy::udim);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[1].name, "10000");
  EXPECT_EQ(sets[1].members, Ids{0});
}

TEST(TextureSetsOf, AMeshWithoutThemSaysWhatIsMissing) {
  Mesh mesh = laid_out({at(0.25F, 0.25F), at(0.5F, 0.5F)});
  EXPECT_EQ(
      error_of(mesh, SetsBy::material),
      "Mesh 'crate.obj' has no materials, by which texture sets could be formed. Choose other "
      "sets, or none.");
  EXPECT_EQ(error_of(mesh, SetsBy::object),
            "Mesh 'crate.obj' has no objects, by which texture sets could be formed. Choose other "
            "sets, or none.");
  mesh.object_names = {"lid", "body"};
  mesh.objects = {1, 0};
  const std::vector<TextureSet> sets = find_texture_sets(mesh, SetsBy::object);
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[0].name, "lid");
  EXPECT_EQ(sets[0].members, Ids{1});
  EXPECT_EQ(sets[1].members, Ids{0});
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  for (const SetsBy by : {SetsBy::none, SetsBy::object, SetsBy::udim}) {
    const std::vector<TextureSet> whole = find_texture_sets(mesh, by);
    ASSERT_EQ(whole.size(), 1U);
    EXPECT_EQ(whole[0].members, (Ids{0, 1}));
    EXPECT_EQ(whole[0].triangles, 2U);
    EXPECT_EQ(whole[0].name, "");
  }
  EXPECT_EQ(choose_texture_sets(mesh), SetsBy::none);
  try {
    (void)low_of_set(mesh, sets[0]);
    ADD_FAILURE() << "no UVs, no sets";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "Mesh 'crate.obj' has no UVs, so it has no texture sets.");
  }
}

// The copy's centre lies under another chart: each of its cells is compared with the triangle that it copies.
TEST(TextureSetsOf, CopiesUnderOtherChartsAreCopies) {
  const std::array<Vec2, 3> small = at(0.4F, 0.3F, 0.0625F, 0.0625F);
  const std::array<Vec2, 3> large = at(0.125F, 0.125F, 0.75F, 0.5F);
  std::array<Vec2, 3> copy{}, other{};
  for (std::size_t k = 0; k < 3; ++k) {
    copy[k] = {large[(k + 1) % 3].x + 2, large[(k + 1) % 3].y + 1};
    other[k] = {copy[k].x + 0.03125F, copy[k].y};
  }
  // The cell of the large triangle's centre, (0.375, 0.2917), must be the small one's.
  const std::array<Vec2, 3> at_centre = at(0.37F, 0.28F, 0.0625F, 0.0625F);
  EXPECT_EQ(choose_texture_sets(laid_out({at_centre, small, large, copy})), SetsBy::none);
  EXPECT_EQ(choose_texture_sets(laid_out({at_centre, small, large, other})), SetsBy::udim);
}

}  // namespace
}  // namespace kiln

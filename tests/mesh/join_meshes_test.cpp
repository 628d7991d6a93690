// Several meshes made one.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "kiln/validate.h"
#include "support/shapes.h"

namespace kiln {
namespace {

TEST(JoinMeshes, KeepsNamesAndNamesThoseWithoutByTheirFile) {
  Mesh bolt = test::plane(1, 1), plate = test::plane(1, 1), nut = test::plane(1, 1);
  bolt.name = "bolt_low";
  plate.name = "plates";
  plate.group_names = {"left", "right"};
  plate.groups = {1, 0};
  plate.material_names = {"steel"};
  plate.materials = {0, 0};
  nut.name = "nut";
  nut.group_names = nut.object_names = {"right"};
  nut.groups = nut.objects = {0, 0};
  const std::vector<Mesh> meshes = {bolt, plate, nut};
  const Mesh whole = join_meshes(meshes);
  EXPECT_EQ(whole.name, "bolt_low + plates + nut");
  EXPECT_EQ(whole.group_names, (std::vector<std::string>{"bolt_low", "left", "right"}));
  EXPECT_EQ(whole.groups, (std::vector<std::uint32_t>{0, 0, 2, 1, 2, 2}));
  EXPECT_EQ(whole.object_names, (std::vector<std::string>{"bolt_low", "plates", "right"}));
  EXPECT_EQ(whole.materials, (std::vector<std::uint32_t>{0, 0, 1, 1, 0, 0}));
  EXPECT_EQ(whole.material_names, (std::vector<std::string>{"default", "steel"}));
  for (std::size_t t = 0; t < whole.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Mesh& own = meshes[t / 2];
      EXPECT_EQ(whole.positions[whole.triangles[t][k]], own.positions[own.triangles[t % 2][k]]);
      EXPECT_EQ(whole.uvs[whole.uv_triangles[t][k]].x, own.uvs[own.uv_triangles[t % 2][k]].x);
    }
  }
  EXPECT_NO_THROW(validate(whole));
  const std::vector<Mesh> many(5, bolt);
  EXPECT_EQ(join_meshes(many).name, "bolt_low + 4 more");
  EXPECT_THROW(join_meshes({}), Error);
}

TEST(JoinMeshes, OtherSetsOfUvsKeepToTheirMeshes) {
  Mesh first = test::plane(1, 1), second = test::plane(1, 1), bare = test::plane(1, 1);
  first.name = "first", second.name = "second", bare.name = "bare";
  bare.uvs.clear(), bare.uv_triangles.clear();
  const auto moved = [](const Mesh& mesh, float by) {
    std::vector<Vec2> uvs = mesh.uvs;
    for (Vec2& uv : uvs) uv.x += by;
    return uvs;
  };
  first.other_uvs = {{2, moved(first, 2)}};
  second.other_uvs = {{1, moved(second, 1)},
                      {2, {}}};  // a set that does not fit counts for nothing
  const std::vector<Mesh> meshes = {first, bare, second};
  const Mesh whole = join_meshes(meshes);
  ASSERT_EQ(whole.other_uvs.size(), 2U);
  for (const UvSet& set : whole.other_uvs) {
    ASSERT_EQ(set.uvs.size(), whole.uvs.size());
    for (std::size_t t = 0; t < whole.triangles.size(); ++t) {
      const std::uint32_t corner = whole.uv_triangles[t][0];
      const bool has = set.set == 2 ? t < 2 : t >= 4;
      EXPECT_EQ(std::isnan(set.uvs[corner].x), !has) << set.set << " of " << t;
      if (has) {
        EXPECT_EQ(set.uvs[corner].x, whole.uvs[corner].x + static_cast<float>(set.set));
      }
    }
  }
}

TEST(JoinMeshes, FillsWhatSomeLack) {
  Mesh full = test::cube(), bare;
  full.name = "full";
  full.colors.assign(full.positions.size(), {1, 2, 3, 255});
  full.polygons = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5};
  bare.name = "bare";
  bare.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  bare.triangles = {{0, 1, 2}};
  std::vector<Warning> warnings;
  const std::vector<Mesh> meshes = {bare, full, bare};
  const Mesh whole = join_meshes(meshes, &warnings);
  EXPECT_NO_THROW(validate(whole));
  ASSERT_EQ(whole.uv_triangles.size(), whole.triangles.size());
  EXPECT_TRUE(std::isnan(whole.uvs[whole.uv_triangles[0][1]].x));
  EXPECT_FALSE(std::isnan(whole.uvs[whole.uv_triangles[1][1]].x));
  EXPECT_EQ(whole.colors.front()[0], 255);
  EXPECT_EQ(whole.colors[4][0], 1);
  EXPECT_EQ(whole.polygons.back(), 7U);
  EXPECT_EQ(whole.polygons[1], 1U);
  ASSERT_EQ(warnings.size(), 4U);
  EXPECT_EQ(warnings[0].code, "missing-uvs");
  EXPECT_NE(warnings[0].message.text().find("'bare'"), std::string::npos);
}

/// Far from the world's origin, in files that chose origins of their own.
TEST(JoinMeshes, KeepsPlacesInTheWorld) {
  Mesh near = test::plane(1, 1), far = test::plane(1, 1);
  near.origin = {1 << 20, 0, -3};
  far.origin = {(1 << 20) + 8, 0.5, -3};
  const std::vector<Mesh> meshes = {near, far};
  const Mesh whole = join_meshes(meshes);
  EXPECT_EQ(whole.origin, near.origin);
  for (std::size_t v = 0; v < far.positions.size(); ++v) {
    const Vec3& moved = whole.positions[near.positions.size() + v];
    EXPECT_EQ(moved.x, far.positions[v].x + 8);
    EXPECT_EQ(moved.y, far.positions[v].y + 0.5F);
    EXPECT_EQ(moved.z, far.positions[v].z);
  }
}

TEST(JoinMeshes, SetsUnitsAndTangentsOfSeveralMeshes) {
  Mesh first = test::plane(1, 1), second = test::plane(2, 1), third = test::plane(1, 1);
  first.name = "first", second.name = "second", third.name = "third";
  first.metres = second.metres = third.metres = 0.01;
  first.other_uvs = {{3, first.uvs}};
  third.other_uvs = {{3, third.uvs}};
  for (Vec2& uv : third.other_uvs[0].uvs) uv = {uv.y + 5, uv.x - 7};
  second.tangents.assign(3 * second.triangles.size(), Tangent{{0, 1, 0}, -1});
  std::vector<Mesh> meshes = {first, second, third};
  const Mesh whole = join_meshes(meshes);
  EXPECT_EQ(whole.metres, 0.01);
  // One set of that number, of both that have it.
  ASSERT_EQ(whole.other_uvs.size(), 1U);
  EXPECT_EQ(whole.other_uvs[0].set, 3U);
  for (std::size_t t = 0; t < whole.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 uv = whole.uvs[whole.uv_triangles[t][k]];
      const Vec2 other = whole.other_uvs[0].uvs[whole.uv_triangles[t][k]];
      if (t < 2) EXPECT_EQ(std::pair(other.x, other.y), std::pair(uv.x, uv.y));
      if (t >= 2 && t < 6) EXPECT_TRUE(std::isnan(other.x) && std::isnan(other.y));
      if (t >= 6) EXPECT_EQ(std::pair(other.x, other.y), std::pair(uv.y + 5, uv.x - 7));
      const Tangent& tangent = whole.tangents[3 * t + k];
      EXPECT_EQ(tangent.sign, t >= 2 && t < 6 ? -1 : 1) << t;
      EXPECT_EQ(tangent.direction.y, t >= 2 && t < 6 ? 1 : 0) << t;
    }
  }
  // Of one other unit, in the middle or last, there is none.
  meshes[1].metres = 1;
  EXPECT_EQ(join_meshes(meshes).metres, 0);
  meshes[1].metres = 0.01, meshes[2].metres = 1;
  EXPECT_EQ(join_meshes(meshes).metres, 0);
}

}  // namespace
}  // namespace kiln

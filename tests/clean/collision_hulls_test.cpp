// Collision hulls by their names.
#include "kiln/collision_hulls.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/mesh_check.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Names = std::vector<std::string>;

/// A square of two triangles a name, side by side, with UVs, normals and colours of its own.
Mesh squares(const Names& names, bool as_objects) {
  Mesh mesh;
  mesh.name = "low";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto x = static_cast<float>(i);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec2& uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
      mesh.positions.push_back({x + uv.x, uv.y, 0});
      mesh.uvs.push_back({x + uv.x, uv.y});
      mesh.colors.push_back({static_cast<std::uint8_t>(i), 0, 0, 255});
    }
    mesh.normals.push_back({0, 0, 1});
    const auto normal = static_cast<std::uint32_t>(i);
    for (const Triangle& t :
         {Triangle{first, first + 1, first + 2}, Triangle{first, first + 2, first + 3}}) {
      mesh.triangles.push_back(t);
      mesh.uv_triangles.push_back(t);
      mesh.normal_triangles.push_back({normal, normal, normal});
      mesh.materials.push_back(normal);
      (as_objects ? mesh.objects : mesh.groups).push_back(normal);
    }
    mesh.material_names.push_back("material " + names[i]);
  }
  (as_objects ? mesh.object_names : mesh.group_names) = names;
  return mesh;
}

/// 1 for each name that is a hull.
std::vector<int> hulls_of(const Names& names, bool as_objects = true) {
  const std::vector<std::uint8_t> found = collision_hulls(squares(names, as_objects));
  std::vector<int> result;
  for (std::size_t t = 0; t < found.size(); t += 2) {
    EXPECT_EQ(found[t], found[t + 1]);
    result.push_back(found[t]);
  }
  return result;
}

TEST(CollisionHulls, AreToldByTheirNames) {
  for (const bool as_objects : {true, false}) {
    EXPECT_EQ(
        hulls_of({"crate", "UCX_crate_01", "UBX_crate", "USP_crate", "UCP_crate", "ucx_crate"},
                 as_objects),
        (std::vector<int>{0, 1, 1, 1, 1, 1}));
    EXPECT_EQ(hulls_of({"crate", "a-col", "a-colonly", "a-convcol", "a-convcolonly", "a-col.001",
                        "A-COLONLY", "a-col2"},
                       as_objects),
              (std::vector<int>{0, 1, 1, 1, 1, 1, 1, 1}));
  }
  EXPECT_EQ(hulls_of({"UCX", "my_UCX_crate", "protocol", "a-color", "col", "a-column", "a_col", "",
                      "123", "-colonly-not"}),
            std::vector<int>(10, 0));
}

// A group of OBJ lists its names; an object of FBX or glTF has one, which may hold spaces.
TEST(CollisionHulls, AreToldByAnyNameOfAGroup) {
  const Names names{"crate", "skin UCX_crate", "crate door-colonly", "skin my_UCX_crate"};
  EXPECT_EQ(hulls_of(names, false), (std::vector<int>{0, 1, 1, 0}));
  EXPECT_EQ(hulls_of(names, true), (std::vector<int>{0, 0, 1, 0}));
}

TEST(CollisionHulls, WhatGodotDrawsStaysWhereNothingElseIsDrawn) {
  EXPECT_EQ(hulls_of({"floor-col", "wall-convcol"}), (std::vector<int>{0, 0}));
  EXPECT_EQ(hulls_of({"floor-col", "hull-colonly", "UCX_x"}), (std::vector<int>{0, 1, 1}));
}

TEST(CollisionHulls, AreTakenOffWithAllThatIsTheirs) {
  for (const bool as_objects : {true, false}) {
    Mesh low = squares({"UCX_a", "crate", "lid", "UCX_b"}, as_objects);
    std::vector<Warning> warnings;
    const Mesh hulls = take_collision_hulls(low, &warnings);
    EXPECT_EQ(test::broken_promise(low), "");
    EXPECT_EQ(test::broken_promise(hulls), "");
    EXPECT_EQ(low.triangles.size(), 4U);
    EXPECT_EQ(low.positions.size(), 8U);
    EXPECT_EQ(low.positions[0], (Vec3{1, 0, 0}));
    EXPECT_EQ(low.uvs.size(), 8U);
    EXPECT_EQ(low.uvs[low.uv_triangles[2][0]], (Vec2{2, 0}));
    EXPECT_EQ(low.normals.size(), 2U);
    EXPECT_EQ(low.colors[low.triangles[2][0]][0], 2);
    EXPECT_EQ(as_objects ? low.object_names : low.group_names, (Names{"crate", "lid"}));
    EXPECT_EQ(low.material_names, (Names{"material crate", "material lid"}));
    EXPECT_EQ(hulls.object_names, (Names{"UCX_a", "UCX_b"}));
    EXPECT_EQ(hulls.objects, (std::vector<std::uint32_t>{0, 0, 1, 1}));
    EXPECT_EQ(hulls.positions[hulls.triangles[2][0]], (Vec3{3, 0, 0}));
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_EQ(warnings[0].code, "collision-hulls");
    EXPECT_EQ(warnings[0].count, 2U);
    for (const char* word : {"'UCX_a'", "'UCX_b'", "4 triangles", "`keep_hulls`"}) {
      EXPECT_NE(warnings[0].message.text().find(word), std::string::npos)
          << warnings[0].message.text();
    }
  }
}

/// A warning lists five names, and counts the others.
TEST(CollisionHulls, FiveAreNamed) {
  for (const std::size_t count : {1U, 5U, 6U, 9U}) {
    Names names{"crate"};
    for (std::size_t i = 0; i < count; ++i) names.push_back("UCX_" + std::to_string(i));
    Mesh low = squares(names, true);
    std::vector<Warning> warnings;
    take_collision_hulls(low, &warnings);
    ASSERT_EQ(warnings.size(), 1U);
    const std::string message = warnings[0].message.text();
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(message.find("'UCX_" + std::to_string(i) + "'") != std::string::npos, i < 5)
          << message;
    }
    EXPECT_EQ(message.find(" more;") != std::string::npos, count > 5) << message;
    if (count > 5) {
      EXPECT_NE(message.find(" and " + std::to_string(count - 5) + " more;"), std::string::npos);
    }
    EXPECT_EQ(warnings[0].count, count);
  }
}

TEST(CollisionHulls, AreGroupsOfObjectsAsWell) {
  Mesh low = squares({"crate", "UCX_crate"}, /*as_objects=*/false);
  low.objects.assign(4, 0);
  low.object_names = {"scene"};
  const Mesh hulls = take_collision_hulls(low);
  EXPECT_EQ(low.triangles.size(), 2U);
  EXPECT_EQ(hulls.object_names, Names{"UCX_crate"});
}

TEST(CollisionHulls, AMeshWithoutAnyStaysToTheBit) {
  Mesh low = squares({"crate", "lid"}, true);
  low.object_names.emplace_back("without triangles");
  low.uvs.push_back({9, 9});
  const Mesh before = low;
  EXPECT_TRUE(take_collision_hulls(low).triangles.empty());
  EXPECT_EQ(low.triangles, before.triangles);
  EXPECT_EQ(low.uvs, before.uvs);
  EXPECT_EQ(low.object_names, before.object_names);
  Mesh bare = test::plane(1, 1);
  EXPECT_TRUE(take_collision_hulls(bare).triangles.empty());
}

TEST(CollisionHulls, AloneTheyAreAnError) {
  Mesh low = squares({"UCX_a", "b-colonly"}, true);
  try {
    take_collision_hulls(low);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    const std::string message = error.what();
    for (const char* word : {"'UCX_a'", "'b-colonly'", "`keep_hulls`"}) {
      EXPECT_NE(message.find(word), std::string::npos) << message;
    }
  }
  EXPECT_EQ(low.triangles.size(), 4U);
}

}  // namespace
}  // namespace kiln

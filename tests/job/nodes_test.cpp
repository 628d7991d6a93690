// Nodes of LOW's objects in the asset, found by their names.
#include <algorithm>
#include <cmath>

#include "job/job_scene.h"
#include "job/mesh_files.h"

namespace kiln::test {
namespace {

using nlohmann::json;

/// LOW of two squares, an object and a node each, under a root; HIGH lies above both.
Job job_of(const std::array<std::string, 2>& objects, const std::array<std::string, 2>& nodes) {
  Asset low;
  low.mesh = join_meshes(std::vector<Mesh>{square_at(0, 0, "m"), square_at(2, 0, "m")});
  low.mesh.object_names = {objects[0], objects[1]};
  low.mesh.objects.clear();
  for (std::size_t t = 0; t < low.mesh.triangles.size(); ++t) {
    low.mesh.objects.push_back(2 * t < low.mesh.triangles.size() ? 0 : 1);
  }
  for (std::size_t t = 0; t < low.mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = low.mesh.positions[low.mesh.triangles[t][k]];
      low.mesh.uvs[low.mesh.uv_triangles[t][k]] = {(p.x + 0.5F) / 4, p.y + 0.5F};
    }
  }
  low.materials.resize(low.mesh.material_names.size());
  low.nodes.resize(3);
  low.nodes[0].name = "root";
  for (std::uint32_t i = 0; i < 2; ++i) {
    low.nodes[i + 1].name = nodes[i];
    low.nodes[i + 1].parent = 0;
    low.nodes[i + 1].transform[12] = i == 0 ? 5 : 9;
  }
  low.object_nodes = {1, 2};
  Job job;
  job.high = {JobInput(
      join_meshes(std::vector<Mesh>{square_at(0, 0.01F, "h"), square_at(2, 0.01F, "h")}), "high")};
  job.low = JobLow(JobInput(std::move(low), "low"));
  job.out = "a.glb";
  job.bake.width = job.bake.height = 16;
  job.bake.maps = {MapKind::normal};
  return job;
}

/// Index of the node above a mesh that stands in the source's hierarchy: of its own node, or of the parent where the
/// object got a node of its own.
std::size_t place_of_mesh(const json& nodes, std::size_t mesh, std::size_t depth) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i].contains("mesh") || nodes[i]["mesh"] != mesh) continue;
    if (depth == 0) return i;
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      const json children = nodes[p].value("children", json::array());
      if (std::find(children.begin(), children.end(), i) != children.end()) return p;
    }
  }
  return nodes.size();
}

/// Of several files nodes and materials follow one another, and the first one that states what belongs to the whole
/// scene does so.
TEST(JobNodes, OfSeveralFilesFollowOneAnother) {
  const auto file_of = [](const std::string& name, bool states) {
    Asset asset;
    asset.mesh = square_at(0, 0, "m of " + name);
    asset.mesh.object_names = {name};
    asset.mesh.objects.assign(asset.mesh.triangles.size(), 0);
    asset.materials.resize(1);
    asset.nodes.resize(2);
    asset.nodes[0].name = "root of " + name;
    asset.nodes[1].name = name;
    asset.nodes[1].parent = 0;
    asset.object_nodes = {1};
    if (states) asset.extras = asset.copyright = asset.scene = name;
    return JobInput(asset, name);
  };
  std::vector<Warning> warnings;
  const MeshFiles files = load_meshes({file_of("a", false), file_of("b", true), file_of("c", true)},
                                      {}, true, warnings, true);
  const Asset& all = files.nodes_and_materials;
  ASSERT_EQ(all.nodes.size(), 6U);
  for (std::uint32_t i = 0; i < 6; ++i) {
    EXPECT_EQ(all.nodes[i].parent, i % 2 == 0 ? AssetNode::kNone : i - 1);
  }
  EXPECT_EQ(all.object_nodes, (std::vector<std::uint32_t>{1, 3, 5}));
  EXPECT_EQ(all.mesh.object_names, (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_EQ(all.materials.size(), 3U);
  for (const std::string* text : {&all.extras, &all.copyright, &all.scene}) EXPECT_EQ(*text, "b");
  // Each triangle is of its file, the first and the last of each included.
  ASSERT_EQ(files.first.size(), 4U);
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(files.file_of(files.first[f]), files.files[f]);
    EXPECT_EQ(files.file_of(files.first[f + 1] - 1), files.files[f]);
  }
}

/// Groups that share UVs get UVs of their own, each moved by its group.
TEST(JobNodes, MovedUvsAreOfTheirGroup) {
  Mesh mesh = square_at(0, 0, "m");
  const Mesh before = mesh;
  std::vector<std::size_t> groups;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) groups.push_back(t % 3);
  move_uvs(
      groups,
      [](std::size_t group, const Vec2& uv) {
        return Vec2{uv.x + static_cast<float>(group), uv.y};
      },
      mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 &uv = mesh.uvs[mesh.uv_triangles[t][k]],
                 &was = before.uvs[before.uv_triangles[t][k]];
      EXPECT_EQ(uv.x, was.x + static_cast<float>(groups[t]));
      EXPECT_EQ(uv.y, was.y);
    }
  }
}

TEST(JobNodes, AreThoseOfTheObjectsNames) {
  KILN_REQUIRE_DEVICE();
  const std::vector<std::byte> glb = run_in_memory(job_of({"a", "b"}, {"a", "b"})).glb;
  const json head = head_of(glb);
  for (std::size_t mesh = 0; mesh < 2; ++mesh) {
    const std::size_t node = place_of_mesh(head["nodes"], mesh, 0);
    ASSERT_LT(node, head["nodes"].size());
    EXPECT_EQ(head["nodes"][node]["name"], head["meshes"][mesh]["name"]);
    EXPECT_EQ(head["nodes"][node]["matrix"][12], head["meshes"][mesh]["name"] == "a" ? 5 : 9);
  }
}

/// Of two objects of one name, which a file cannot have and a caller may, the first one's node takes both. They stay
/// where they were.
TEST(JobNodes, OfEqualNamesAreTheFirst) {
  KILN_REQUIRE_DEVICE();
  const std::vector<std::byte> glb = run_in_memory(job_of({"a", "a"}, {"a", "a"})).glb;
  const json head = head_of(glb);
  const std::size_t first = place_of_mesh(head["nodes"], 0, 0);
  ASSERT_LT(first, head["nodes"].size());
  EXPECT_EQ(head["nodes"][first]["matrix"][12], 5);
  EXPECT_EQ(place_of_mesh(head["nodes"], 1, 1), first);
  float least = 1e9F, most = -1e9F;
  for (const Vec3& p : load_asset(glb, "a.glb").mesh.positions) {
    least = std::min(least, p.x);
    most = std::max(most, p.x);
  }
  EXPECT_NEAR(least, -0.5F, 1e-6);
  EXPECT_NEAR(most, 2.5F, 1e-6);
}

/// What a file says of itself stays: its copyright, its extras, and its scene's name and extras.
TEST(JobNodes, WhatAFileSaysOfItselfStays) {
  KILN_REQUIRE_DEVICE();
  Job job = job_of({"a", "b"}, {"a", "b"});
  Asset low = *job.low.given[0].asset;
  low.copyright = "(c) A. Maker";
  low.extras = R"({"part": 7})";
  low.scene = R"({"name": "Stage", "extras": {"act": 2}})";
  job.low = JobLow(JobInput(std::move(low), "low"));
  const json head = head_of(run_in_memory(job).glb);
  EXPECT_EQ(head["asset"].value("copyright", ""), "(c) A. Maker");
  EXPECT_EQ(head["asset"]["extras"].value("part", 0), 7);
  ASSERT_EQ(head["scenes"].size(), 1U);
  EXPECT_EQ(head["scenes"][0].value("name", ""), "Stage");
  EXPECT_EQ(head["scenes"][0]["extras"].value("act", 0), 2);
}

}  // namespace
}  // namespace kiln::test

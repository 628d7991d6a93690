// Nodes of LOW's objects in the asset, found by their names.
#include <algorithm>
#include <cmath>

#include "job/job_scene.h"

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

// glTF at rest: skins, morph targets and instances, beside the specification's formulas in double precision.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "asset/gltf_files.h"
#include "asset/mesh_files.h"
#include "kiln/asset.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

using mesh_files::expect_bad_text;
using mesh_files::load;
using mesh_files::load_text;
using mesh_files::Loaded;
using mesh_files::write_file;
using nlohmann::json;

using Place = std::array<double, 3>;
using Matrix = std::array<std::array<double, 4>, 4>;  // rows

json& primitive_of(GltfMaker& maker) { return maker.json["meshes"][0]["primitives"][0]; }

Matrix times(const Matrix& a, const Matrix& b) {
  Matrix result{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t j = 0; j < 4; ++j) result[i][k] += a[i][j] * b[j][k];
    }
  }
  return result;
}

Place times(const Matrix& m, const Place& p, double w = 1) {
  Place result{};
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + m[i][3] * w;
  }
  return result;
}

/// A plain matrix of some turn, stretch and move, by a seed.
Matrix some_matrix(int seed, bool mirrored = false) {
  const double a = 0.7 * seed + 0.3, c = std::cos(a), s = std::sin(a);
  const double m = mirrored ? -1 : 1;
  const Matrix turn{{{c, -s, 0, 0.5 * seed}, {s, c, 0, -0.25 * seed}, {0, 0, 1, 1}, {0, 0, 0, 1}}};
  const Matrix stretch{
      {{m * 1.5, 0.2, 0, 0}, {0, 0.75, 0.1 * seed, 0}, {0, 0, 2, 0}, {0, 0, 0, 1}}};
  return times(turn, stretch);
}

json columns(const Matrix& m) {
  json list;
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < 4; ++i) list.push_back(m[i][k]);
  }
  return list;
}

std::vector<float> floats(const std::vector<Matrix>& matrices) {
  std::vector<float> values;
  for (const Matrix& m : matrices) {
    for (const double value : columns(m)) values.push_back(static_cast<float>(value));
  }
  return values;
}

/// As many joints as the matrices say, in a chain of nodes below a moved root. \returns their transforms to the world
std::vector<Matrix> add_joints(GltfMaker& maker, const std::vector<Matrix>& local) {
  std::vector<Matrix> worlds;
  json skin;
  const std::size_t first = maker.json["nodes"].size();
  for (std::size_t i = 0; i < local.size(); ++i) {
    json node{{"matrix", columns(local[i])}};
    if (i + 1 < local.size()) node["children"] = json::array({first + i + 1});
    maker.json["nodes"].push_back(node);
    skin["joints"].push_back(first + i);
    worlds.push_back(i == 0 ? local[0] : times(worlds[i - 1], local[i]));
  }
  maker.json["skins"].push_back(skin);
  return worlds;
}

void expect_place(const std::array<double, 3>& got, const Place& wanted, const std::string& what) {
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(got[k], wanted[k], 2e-6 * 16) << what << " " << k;
}

/// glTF 2.0, 3.7.3.3: sum of w * J * B * v, whatever the mesh's own node says.
TEST(GltfPose, VerticesLieWhereTheirJointsPutThem) {
  for (const bool two_sets : {false, true}) {
    for (const bool has_binds : {false, true}) {
      GltfMaker maker = gltf_square();
      maker.json["nodes"][0]["skin"] = 0;
      maker.json["nodes"][0]["translation"] = {7, 8, 9};
      maker.json["nodes"][0]["scale"] = {3, 3, 3};
      const std::vector<Matrix> worlds =
          add_joints(maker, {some_matrix(1), some_matrix(2), some_matrix(3)});
      const std::vector<Matrix> binds{some_matrix(4), some_matrix(5), some_matrix(6)};
      if (has_binds) {
        maker.json["skins"][0]["inverseBindMatrices"] = maker.add<float>("MAT4", floats(binds));
      }
      const std::vector<std::uint8_t> joints{0, 1, 2, 0, 1, 0, 0, 0, 2, 1, 0, 2, 1, 2, 0, 1};
      // Dyadic, so that floats hold them: sums are 1, of two sets together.
      const std::vector<float> weights{0.5F, 0.25F, 0.25F, 0, 1,     0, 0, 0,
                                       0.5F, 0.5F,  0,     0, 0.25F, 0, 0, 0.75F};
      std::vector<float> first = weights;
      std::vector<float> second(16);
      json& attributes = primitive_of(maker)["attributes"];
      if (two_sets) {
        for (std::size_t i = 0; i < 16; ++i) {
          first[i] = weights[i] * 0.75F;
          second[i] = weights[15 - i] * 0.25F;
        }
        attributes["JOINTS_1"] = maker.add<std::uint16_t>(
            "VEC4", std::vector<std::uint16_t>(joints.rbegin(), joints.rend()));
        attributes["WEIGHTS_1"] = maker.add<float>("VEC4", second);
      }
      attributes["JOINTS_0"] = maker.add<std::uint8_t>("VEC4", joints);
      attributes["WEIGHTS_0"] = maker.add<float>("VEC4", first);
      const Loaded loaded = load_text("skin.glb", maker.glb());
      ASSERT_EQ(loaded.mesh.positions.size(), 4U);
      EXPECT_EQ(loaded.count("rest-pose"), 1U);
      const std::array<Place, 4> square{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
      for (std::size_t v = 0; v < 4; ++v) {
        Place wanted{};
        const auto add = [&](std::size_t joint, double weight) {
          const Matrix m = has_binds ? times(worlds[joint], binds[joint]) : worlds[joint];
          const Place moved = times(m, square[v]);
          for (std::size_t k = 0; k < 3; ++k) wanted[k] += weight * moved[k];
        };
        for (std::size_t i = 4 * v; i < 4 * v + 4; ++i) {
          add(joints[i], double{first[i]});
          if (two_sets) add(joints[15 - i], double{second[i]});
        }
        expect_place(loaded.world(v), wanted, "vertex " + std::to_string(v));
      }
    }
  }
}

/// Normals go by the inverse transposed: they stay at right angles to what is moved. Mirroring joints keep the outside.
TEST(GltfPose, NormalsAndTangentsFollowTheJoints) {
  for (const bool mirrored : {false, true}) {
    GltfMaker maker = gltf_square();
    maker.json["nodes"][0]["skin"] = 0;
    const std::vector<Matrix> worlds = add_joints(maker, {some_matrix(2, mirrored)});
    json& attributes = primitive_of(maker)["attributes"];
    const auto all = [](std::vector<float> one) {
      std::vector<float> four;
      for (int i = 0; i < 4; ++i) four.insert(four.end(), one.begin(), one.end());
      return four;
    };
    attributes["NORMAL"] = maker.add<float>("VEC3", all({0, 0, 1}));
    attributes["TANGENT"] = maker.add<float>("VEC4", all({1, 0, 0, 1}));
    attributes["JOINTS_0"] = maker.add<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16));
    attributes["WEIGHTS_0"] = maker.add<std::uint8_t>(
        "VEC4", {255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, true);
    const Mesh mesh = load_text("normals.glb", maker.glb()).mesh;
    const Place u = times(worlds[0], {1, 0, 0}, 0), v = times(worlds[0], {0, 1, 0}, 0);
    Place n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    const double size = std::hypot(n[0], n[1], n[2]) * (mirrored ? -1 : 1);
    for (double& value : n) value /= size;
    const double along = std::hypot(u[0], u[1], u[2]);
    for (std::size_t t = 0; t < 2; ++t) {
      const Vec3& normal = mesh.normals[mesh.normal_triangles[t][0]];
      EXPECT_NEAR(normal.x, n[0], 1e-6);
      EXPECT_NEAR(normal.y, n[1], 1e-6);
      EXPECT_NEAR(normal.z, n[2], 1e-6);
      const Tangent& tangent = mesh.tangents[3 * t];
      EXPECT_NEAR(tangent.direction.x, u[0] / along, 1e-6);
      EXPECT_NEAR(tangent.direction.y, u[1] / along, 1e-6);
      EXPECT_EQ(tangent.sign, mirrored ? -1 : 1);
      const auto [a, b, c] = mesh.triangles[t];
      const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
      const Vec3 s{q.x - p.x, q.y - p.y, q.z - p.z}, w{r.x - p.x, r.y - p.y, r.z - p.z};
      const double side = n[0] * (double{s.y} * w.z - double{s.z} * w.y) +
                          n[1] * (double{s.z} * w.x - double{s.x} * w.z) +
                          n[2] * (double{s.x} * w.y - double{s.y} * w.x);
      EXPECT_GT(side, 0) << "turned inside out";
    }
  }
}

/// As the Khronos viewer has it: without weights a vertex lies where the mesh's node puts it.
TEST(GltfPose, VerticesWithoutWeightsAreTold) {
  GltfMaker maker = gltf_square();
  maker.json["nodes"][0]["skin"] = 0;
  maker.json["nodes"][0]["translation"] = {0, 0, 5};
  add_joints(maker, {some_matrix(1)});
  json& attributes = primitive_of(maker)["attributes"];
  // Joint 9 is not there, but weighs nothing.
  attributes["JOINTS_0"] =
      maker.add<std::uint8_t>("VEC4", {0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9, 9, 9, 9});
  attributes["WEIGHTS_0"] =
      maker.add<float>("VEC4", {1, 0, 0, 0, 0.5F, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0});
  const Loaded loaded = load_text("free.glb", maker.glb());
  EXPECT_EQ(loaded.count("unweighted-vertices"), 1U);
  expect_place(loaded.world(3), {0, 1, 5}, "free");
  expect_place(loaded.world(0), times(some_matrix(1), Place{0, 0, 0}), "bound");
  expect_place(loaded.world(1), times(some_matrix(1), Place{1, 0, 0}), "of weights below 1");
}

TEST(GltfPose, SkinsThatLie) {
  const auto bad = [](const std::vector<std::string>& words, const auto& change) {
    GltfMaker maker = gltf_square();
    maker.json["nodes"][0]["skin"] = 0;
    add_joints(maker, {some_matrix(1), some_matrix(2)});
    maker.json["skins"][0]["inverseBindMatrices"] =
        maker.add<float>("MAT4", floats({some_matrix(3), some_matrix(4)}));
    json& attributes = primitive_of(maker)["attributes"];
    attributes["JOINTS_0"] = maker.add<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16, 1));
    attributes["WEIGHTS_0"] = maker.add<float>("VEC4", std::vector<float>(16, 0.25F));
    change(maker);
    expect_bad_text("skin.glb", maker.glb(), words);
  };
  bad({"JOINTS_0", "vertex 0", "only 2"}, [](GltfMaker& maker) {
    primitive_of(maker)["attributes"]["JOINTS_0"] =
        maker.add<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16, 2));
  });
  bad({"JOINTS_0", "without weights"},
      [](GltfMaker& maker) { primitive_of(maker)["attributes"].erase("WEIGHTS_0"); });
  bad({"WEIGHTS_0", "positions"}, [](GltfMaker& maker) {
    primitive_of(maker)["attributes"]["WEIGHTS_0"] =
        maker.add<float>("VEC4", std::vector<float>(12, 0.25F));
  });
  bad({"inverseBindMatrices", "1 matrix"}, [](GltfMaker& maker) {
    maker.json["skins"][0]["inverseBindMatrices"] =
        maker.add<float>("MAT4", floats({some_matrix(3)}));
  });
  bad({"inverseBindMatrices", "affine"}, [](GltfMaker& maker) {
    Matrix m = some_matrix(3);
    m[3][1] = 0.5;
    maker.json["skins"][0]["inverseBindMatrices"] =
        maker.add<float>("MAT4", floats({m, some_matrix(4)}));
  });
  bad({"skins[0]", "no joints"},
      [](GltfMaker& maker) { maker.json["skins"][0]["joints"] = json::array(); });
  bad({"skins[0].joints[0]"}, [](GltfMaker& maker) { maker.json["skins"][0]["joints"][0] = 99; });
  bad({"nodes[0].skin"}, [](GltfMaker& maker) { maker.json["nodes"][0]["skin"] = 4; });
}

/// A low poly comes back at rest: its file has no skin, and stands where it was baked.
TEST(GltfPose, WhatIsWrittenHoldsThePoseAtRest) {
  GltfMaker maker = gltf_square();
  maker.json["nodes"][0]["skin"] = 0;
  maker.json["nodes"][0]["translation"] = {1, 2, 3};
  add_joints(maker, {some_matrix(1)});
  json& attributes = primitive_of(maker)["attributes"];
  attributes["JOINTS_0"] = maker.add<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16));
  attributes["WEIGHTS_0"] = maker.add<float>("VEC4", std::vector<float>(16, 0.25F));
  const Asset asset = load_asset(write_file("low.glb", maker.glb()));
  SaveAssetOptions options;
  options.nodes = asset.nodes;
  options.object_nodes = asset.object_nodes;
  const AssetMaterial material;
  const std::filesystem::path out = scratch_folder() / "out.glb";
  save_asset(asset.mesh, std::span(&material, 1), out, options);
  const Loaded back = load(out);
  EXPECT_EQ(back.count("rest-pose"), 0U);
  ASSERT_EQ(back.mesh.triangles.size(), asset.mesh.triangles.size());
  for (std::size_t t = 0; t < 2; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = asset.mesh.positions[asset.mesh.triangles[t][k]];
      expect_place(
          back.world(back.mesh.triangles[t][k]),
          {asset.mesh.origin[0] + p.x, asset.mesh.origin[1] + p.y, asset.mesh.origin[2] + p.z},
          "corner");
    }
  }
}

/// glTF 2.0, 3.7.2.2: weights of the node, else of the mesh, else 0; before the skin.
TEST(GltfPose, MorphTargetsAreAddedByTheirDefaultWeights) {
  GltfMaker maker = gltf_square();
  json& attributes = primitive_of(maker)["attributes"];
  attributes["NORMAL"] = maker.add<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  attributes["TANGENT"] =
      maker.add<float>("VEC4", {1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1});
  // The first is sparse and counts from zeros: vertex 2 alone moves. The second is quantised.
  const std::size_t places = maker.add_view<std::uint8_t>({2});
  const std::size_t values = maker.add_view<float>({0, 4, 8});
  maker.json["accessors"].push_back(
      {{"componentType", 5126},
       {"count", 4},
       {"type", "VEC3"},
       {"sparse",
        {{"count", 1},
         {"indices", {{"bufferView", places}, {"componentType", 5121}}},
         {"values", {{"bufferView", values}}}}}});
  const json first{{"POSITION", maker.json["accessors"].size() - 1}};
  const json second{
      {"POSITION",
       maker.add<std::int16_t>("VEC3", {32767, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -32767}, true)},
      {"NORMAL", maker.add<std::int8_t>("VEC3", {127, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, true)},
      {"TANGENT", maker.add<float>("VEC3", {0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})},
      {"TEXCOORD_0", maker.add<float>("VEC2", {0.5F, -0.25F, 0, 0, 0, 0, 0, 0})}};
  primitive_of(maker)["targets"] = {first, second};
  const std::string still = maker.glb();
  maker.json["meshes"][0]["weights"] = {0.25, 0.5};
  const std::string of_mesh = maker.glb();
  maker.json["nodes"][0]["weights"] = {0, 1};
  const std::string of_node = maker.glb();

  EXPECT_EQ(load_text("still.glb", still).mesh.positions,
            load_text("plain.glb", gltf_square().glb()).mesh.positions);
  const Loaded mesh = load_text("mesh.glb", of_mesh);
  EXPECT_EQ(mesh.count("rest-pose"), 1U);
  expect_place(mesh.world(2), {1, 1 + 0.25 * 4, 0.25 * 8}, "sparse");
  expect_place(mesh.world(0), {0.5, 0, 0}, "quantised");
  expect_place(mesh.world(3), {0, 1, -0.5}, "quantised");
  const Vec3& n = mesh.mesh.normals[mesh.mesh.normal_triangles[0][0]];
  EXPECT_NEAR(n.x, 0.5 / std::hypot(0.5, 1), 1e-6);
  EXPECT_NEAR(n.z, 1 / std::hypot(0.5, 1), 1e-6);
  const Tangent& t = mesh.mesh.tangents[0];
  EXPECT_NEAR(t.direction.y, t.direction.x, 1e-6) << "(1, 0) + 0.5 (0, 2)";
  EXPECT_EQ(t.sign, -1);
  EXPECT_EQ(mesh.mesh.uvs[0], (Vec2{0.25F, 0.125F})) << "v runs up: 1 - (1 - 0.125)";
  const Loaded node = load_text("node.glb", of_node);
  expect_place(node.world(2), {1, 1, 0}, "the node's weights");
  expect_place(node.world(0), {1, 0, 0}, "the node's weights");

  maker.json["nodes"][0]["skin"] = 0;
  add_joints(maker, {some_matrix(1)});
  primitive_of(maker)["attributes"]["JOINTS_0"] =
      maker.add<std::uint8_t>("VEC4", std::vector<std::uint8_t>(16));
  primitive_of(maker)["attributes"]["WEIGHTS_0"] =
      maker.add<float>("VEC4", std::vector<float>(16, 0.25F));
  expect_place(load_text("both.glb", maker.glb()).world(0), times(some_matrix(1), Place{1, 0, 0}),
               "morphed, then skinned");
}

TEST(GltfPose, TwoNodesMayMorphOneMesh) {
  GltfMaker maker = gltf_square();
  primitive_of(maker)["targets"] = {
      {{"POSITION", maker.add<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1})}}};
  maker.json["nodes"] = {
      {{"mesh", 0}}, {{"mesh", 0}, {"weights", {2}}}, {{"mesh", 0}, {"weights", {3}}}};
  const Loaded loaded = load_text("nodes.glb", maker.glb());
  EXPECT_EQ(loaded.mesh.positions.at(0).z, 0);
  EXPECT_EQ(loaded.mesh.positions.at(4).z, 2);
  EXPECT_EQ(loaded.mesh.positions.at(8).z, 3);
}

TEST(GltfPose, InstancesArePlacedEach) {
  GltfMaker maker = gltf_square();
  maker.json["meshes"][0]["name"] = "leaf";
  const std::size_t at = maker.add<float>("VEC3", {10, 0, 0, 0, 20, 0});
  // A quarter turn about z, and none; quantised as the extension allows.
  const std::size_t turns =
      maker.add<std::int16_t>("VEC4", {0, 0, 23170, 23170, 0, 0, 0, 32767}, true);
  const std::size_t sizes = maker.add<float>("VEC3", {1, 1, 1, -2, 2, 2});
  maker.json["nodes"][0]["translation"] = {0, 0, 3};
  maker.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", at}, {"ROTATION", turns}, {"SCALE", sizes}};
  maker.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const std::filesystem::path path = write_file("instances.glb", maker.glb());
  const Loaded loaded = load(path);
  ASSERT_EQ(loaded.mesh.triangles.size(), 4U);
  EXPECT_EQ(loaded.mesh.object_names, (std::vector<std::string>{"leaf", "leaf.001"}));
  expect_place(loaded.world(1), {10, 1, 3}, "(1, 0) turned to (0, 1)");
  expect_place(loaded.world(5), {-2, 20, 3}, "mirrored and doubled");
  for (std::size_t t = 0; t < 4; ++t) {
    EXPECT_EQ(loaded.mesh.normals[loaded.mesh.normal_triangles[t][0]].z, 1) << "outside stays";
  }
  // Written, each is a node of its own at its place.
  const Asset asset = load_asset(path);
  SaveAssetOptions options;
  options.nodes = asset.nodes;
  options.object_nodes = asset.object_nodes;
  const AssetMaterial material;
  const std::filesystem::path out = scratch_folder() / "out.glb";
  save_asset(asset.mesh, std::span(&material, 1), out, options);
  const Loaded back = load(out);
  ASSERT_EQ(back.mesh.triangles.size(), 4U);
  double most = 0;
  for (std::size_t v = 0; v < back.mesh.positions.size(); ++v)
    most = std::max(most, back.world(v)[1]);
  EXPECT_NEAR(most, 22, 1e-4);

  json& attributes = maker.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes.erase("ROTATION");
  attributes["TRANSLATION"] = maker.add<float>("VEC3", {1, 2, 3});
  expect_bad_text("odd.glb", maker.glb(), {"EXT_mesh_gpu_instancing.attributes", "1 element"});
  attributes["SCALE"] = attributes["TRANSLATION"];
  EXPECT_EQ(load_text("one.glb", maker.glb()).mesh.triangles.size(), 2U);
  attributes["ROTATION"] = maker.add<float>("VEC4", {0, 0, 0, 0});
  expect_bad_text("turn.glb", maker.glb(), {"ROTATION", "does not define a rotation"});
}

/// Kenney's kits list nodes beside their parents.
TEST(GltfPose, AChildBesideItsParentIsReadOnce) {
  GltfMaker maker = gltf_square();
  maker.json["nodes"] = {
      {{"children", {1}}, {"translation", {0, 0, 5}}}, {{"children", {2}}}, {{"mesh", 0}}};
  for (const json& listed : {json{0, 1, 2}, json{2, 0}, json{1, 2, 0}}) {
    maker.json["scenes"] = {{{"nodes", listed}}};
    const Loaded loaded = load_text("beside.glb", maker.glb());
    EXPECT_EQ(loaded.mesh.triangles.size(), 2U);
    EXPECT_EQ(loaded.count("scene-child"), listed.size() - 1);
    expect_place(loaded.world(0), {0, 0, 5}, "where its parent puts it");
  }
  // Without its root, no one says where it is.
  maker.json["scenes"] = {{{"nodes", {2}}}};
  expect_bad_text("alone.glb", maker.glb(), {"nodes[2]", "not a root"});
}

/// The values of the cases' README.
TEST(GltfPose, TheCases) {
  const std::string folder = "cases/gltf_skin";
  KILN_REQUIRE_DATA(folder);
  for (const char* const name : {"beside", "node", "rest", "under"}) {
    const Loaded low = load(*shared_data(folder) / (std::string("low_") + name + ".glb"));
    ASSERT_EQ(low.mesh.positions.size(), 4U) << name;
    const std::array<Place, 4> square{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
    std::size_t corners = 0;
    for (std::size_t v = 0; v < 4; ++v) {
      for (const Place& corner : square) {
        const Place p = low.world(v);
        if (std::hypot(p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]) < 1e-6) ++corners;
      }
    }
    EXPECT_EQ(corners, 4U) << name;
  }
  const Loaded character = load(*shared_data(folder) / "character.glb");
  Place least{HUGE_VAL, HUGE_VAL, HUGE_VAL}, most{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (std::size_t t = 0; t < character.mesh.triangles.size(); ++t) {
    if (character.mesh.object_names[character.mesh.objects[t]] != "sword") continue;
    for (const std::uint32_t v : character.mesh.triangles[t]) {
      const Place p = character.world(v);
      for (std::size_t k = 0; k < 3; ++k) {
        least[k] = std::min(least[k], p[k]);
        most[k] = std::max(most[k], p[k]);
      }
    }
  }
  expect_place(least, {0.5, 0.4, -0.1}, "sword");
  expect_place(most, {2.5, 0.6, 0.1}, "sword");
}

}  // namespace
}  // namespace kiln::test

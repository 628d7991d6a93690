// DAE, 3DS and X: small files against their own numbers.
#include "asset/assimp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "io/image/image_samples.h"
#include "io/image/picture.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "support/environment.h"

#ifdef KILN_HAS_ASSIMP

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// A unit square, its second instance mirrored in x and 10 to the right.
const std::string kSquares = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g" name="square"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="n"><float_array id="na" count="3">0 0 1</float_array><technique_common>
<accessor source="#na" count="1" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="t"><float_array id="ta" count="8">0 0 0.25 0 0.25 0.5 0 0.5</float_array><technique_common>
<accessor source="#ta" count="4" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/><input semantic="TEXCOORD" source="#t" offset="2" set="0"/>
<vcount>4</vcount><p>0 0 0 1 0 1 2 0 2 3 0 3</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s">
<node id="a" name="part"><instance_geometry url="#g"/></node>
<node id="b" name="part"><matrix>-1 0 0 10 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";

TEST(Assimp, InstancesMirroredOnesFaceTheSameWay) {
  const Asset asset = read_by_assimp({"squares.dae", kSquares});
  const Mesh& mesh = asset.mesh;
  EXPECT_EQ(asset.mesh.metres, 1);
  EXPECT_EQ(mesh.object_names, (std::vector<std::string>{"part", "part.001"}));
  ASSERT_EQ(asset.object_nodes.size(), 2u);
  EXPECT_EQ(asset.nodes[asset.object_nodes[1]].name, "part");
  EXPECT_EQ(asset.nodes[asset.object_nodes[1]].transform[12], 10);
  ASSERT_EQ(mesh.triangles.size(), 4u);
  ASSERT_EQ(mesh.positions.size(), 8u);
  EXPECT_EQ(mesh.polygons, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  for (std::size_t t = 0; t < 4; ++t) {
    const auto corner = [&](std::size_t k) { return mesh.positions[mesh.triangles[t][k]]; };
    const double area = (corner(1).x - corner(0).x) * (corner(2).y - corner(0).y) -
                        (corner(2).x - corner(0).x) * (corner(1).y - corner(0).y);
    EXPECT_EQ(area, 1) << "the winding agrees with the normal, +z";
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = corner(k).x + mesh.origin[0], y = corner(k).y;
      const Vec2 uv = mesh.uvs[mesh.uv_triangles[t][k]];
      EXPECT_EQ(uv.x, (t < 2 ? x : 10 - x) / 4);
      EXPECT_EQ(uv.y, y / 2);
      EXPECT_EQ(mesh.normals[mesh.normal_triangles[t][k]].z, 1);
    }
  }
}

/// The text with the first place of `from` replaced.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// Blender and the manual cut a polygon as its mesh has it, whatever the node does.
TEST(Assimp, MirroredPolygonsAreCutAsTheOthers) {
  const std::string bent = replaced(kSquares, "0 0 0 1 0 0 1 1 0 0 1 0", "0 0 0 1 0 1 1 1 0 0 1 1");
  const Mesh mesh = read_by_assimp({"squares.dae", bent}).mesh;
  ASSERT_EQ(mesh.triangles.size(), 4U);
  for (std::size_t t = 0; t < 4; ++t) {
    std::size_t on_ground = 0;
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (mesh.positions[v].z + mesh.origin[2] < 0.5) ++on_ground;
    }
    EXPECT_EQ(on_ground, 2U) << "triangle " << t << " is cut along corners 0 and 2";
  }
}

// A picture of the second set, or of the first where the second is read. Assimp 5.2 goes by the number in the channel's name.
TEST(Assimp, PicturesLieOnTheSetTheyAreBoundTo) {
  const fs::path folder = test::scratch_folder();
  save_image({1, 1, 3, {1, 0, 0}}, folder / "p.png", {.format = ImageFormat::png8});
  std::string text = replaced(
      kSquares, "<vertices id",
      R"(<source id="u"><float_array id="ua" count="8">0 0 0 0.5 0.5 0.5 0.5 0</float_array><technique_common>
<accessor source="#ua" count="4" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor></technique_common></source>
<vertices id)");
  text = replaced(text, "<polylist count=\"1\">", "<polylist count=\"1\" material=\"m\">");
  text = replaced(text, "<vcount>4",
                  "<input semantic=\"TEXCOORD\" source=\"#u\" offset=\"2\" set=\"1\"/><vcount>4");
  text = replaced(
      text, "<library_geometries>",
      R"(<library_images><image id="i"><init_from>p.png</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>
<technique sid="t"><lambert><diffuse><texture texture="s" texcoord="CHANNEL_TWO"/></diffuse></lambert></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="mm" name="skin"><instance_effect url="#e"/></material></library_materials>
<library_geometries>)");
  for (const int set : {0, 1}) {
    const std::string channel = "CHANNEL" + std::to_string(set);
    std::string bound = replaced(text, "CHANNEL_TWO", channel);
    for (int node = 0; node < 2; ++node) {
      bound = replaced(bound, "<instance_geometry url=\"#g\"/>",
                       "<instance_geometry url=\"#g\" ><bind_material><technique_common>"
                       "<instance_material symbol=\"m\" target=\"#mm\"><bind_vertex_input "
                       "semantic=\"" +
                           channel + "\" input_semantic=\"TEXCOORD\" input_set=\"" +
                           std::to_string(set) +
                           "\"/></instance_material></technique_common></bind_material>"
                           "</instance_geometry>");
    }
    for (const std::uint32_t read : {0U, 1U}) {
      LoadMeshOptions options;
      options.uv_set = read;
      const Asset asset = read_by_assimp({(folder / "a.dae").string(), bound, nullptr, options});
      const Mesh& mesh = asset.mesh;
      ASSERT_EQ(asset.materials.size(), 1U);
      const MaterialPicture& picture = asset.materials[0].color_map;
      ASSERT_FALSE(picture.empty());
      EXPECT_EQ(picture.uv_set, static_cast<std::uint32_t>(set));
      EXPECT_EQ(mesh.uv_set, read);
      ASSERT_EQ(mesh.other_uvs.size(), static_cast<std::uint32_t>(set) == read ? 0U : 1U);
      const std::vector<Vec2>& uvs = mesh.other_uvs.empty() ? mesh.uvs : mesh.other_uvs[0].uvs;
      ASSERT_EQ(uvs.size(), mesh.uvs.size());
      for (std::size_t t = 0; t < 4; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3& p = mesh.positions[mesh.triangles[t][k]];
          const double across = p.x + mesh.origin[0], x = t < 2 ? across : 10 - across, y = p.y;
          const Vec2 uv = uvs[mesh.uv_triangles[t][k]];
          EXPECT_EQ(uv.x, set == 0 ? x / 4 : y / 2);
          EXPECT_EQ(uv.y, set == 0 ? y / 2 : x / 2);
        }
      }
    }
  }
}

/// A square in the xy plane on two joints: the first is moved by (0, 0, 5) and bound at the origin, the second stands
/// 2 along x of it, is turned by 90 degrees about z, and was bound at (2, 0, 0). The bind shape doubles all, the mesh's own
/// node is moved far away.
std::string skinned_square(const std::string& second) {
  const auto source = [](const char* id, const char* list, int count, const char* values,
                         int stride, const char* kind) {
    const std::string name = id, number = std::to_string(count);
    return "<source id=\"" + name + "\"><" + list + "_array id=\"" + name + "a\" count=\"" +
           number + "\">" + values + "</" + list + "_array><technique_common><accessor source=\"#" +
           name + "a\" count=\"" + std::to_string(count / stride) + "\" stride=\"" +
           std::to_string(stride) + "\">" + kind + "</accessor></technique_common></source>\n";
  };
  const char* const xyz =
      "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" "
      "type=\"float\"/>";
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g" name="square"><mesh>
)" + source("p", "float", 12, "0 0 0 1 0 0 1 1 0 0 1 0", 3, xyz) +
         source("n", "float", 3, "0 0 1", 3, xyz) +
         R"(<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/>
<vcount>4</vcount><p>0 0 1 0 2 0 3 0</p></polylist></mesh></geometry></library_geometries>
<library_controllers><controller id="c"><skin source="#g">
<bind_shape_matrix>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1</bind_shape_matrix>
)" + source("j", "Name", 2, "one two", 1, "<param name=\"JOINT\" type=\"name\"/>") +
         source("b", "float", 32,
                "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 1 0 0 -2 0 1 0 0 0 0 1 0 0 0 0 1", 16,
                "<param name=\"TRANSFORM\" type=\"float4x4\"/>") +
         source("w", "float", 3, "1 0.25 0.75", 1, "<param name=\"WEIGHT\" type=\"float\"/>") +
         R"(<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#b"/></joints>
<vertex_weights count="4"><input semantic="JOINT" source="#j" offset="0"/><input semantic="WEIGHT" source="#w" offset="1"/>
<vcount>1 1 2 1</vcount><v>0 0 1 0 0 1 1 2 0 0</v></vertex_weights></skin></controller></library_controllers>
<library_visual_scenes><visual_scene id="s">
<node id="one" sid="one" name="one" type="JOINT"><translate>0 0 5</translate>
<node id="two" sid="two" name=")" +
         second + R"(" type="JOINT"><matrix>0 -1 0 2 1 0 0 0 0 0 1 0 0 0 0 1</matrix></node></node>
<node id="a" name="part"><translate>100 200 300</translate><instance_controller url="#c"><skeleton>#one</skeleton></instance_controller></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST(Assimp, SkinsStandAsTheirJointsDo) {
  const std::string dae = skinned_square("two");
  std::vector<Warning> warnings;
  const Mesh mesh = read_by_assimp({"a.dae", dae, &warnings}).mesh;
  EXPECT_TRUE(warnings.empty()) << warnings.at(0).message.text();
  // Doubled corners (x, y, 0). By the first joint: (x, y, 5); by the second: (2 - y, x - 2, 5).
  const std::array<std::array<double, 3>, 4> wanted{
      {{0, 0, 5}, {2, 0, 5}, {0.25 * 2 + 0.75 * 0, 0.25 * 2 + 0.75 * 0, 5}, {0, 2, 5}}};
  ASSERT_EQ(mesh.positions.size(), 4U);
  for (const auto& p : wanted) {
    EXPECT_TRUE(std::any_of(mesh.positions.begin(), mesh.positions.end(),
                            [&](const Vec3& q) {
                              return std::hypot(p[0] - q.x - mesh.origin[0],
                                                p[1] - q.y - mesh.origin[1],
                                                p[2] - q.z - mesh.origin[2]) < 1e-5;
                            }))
        << p[0] << " " << p[1] << " " << p[2];
  }
  for (const Vec3& n : mesh.normals) EXPECT_NEAR(n.z, 1, 1e-6);
}

/// Two nodes of a joint's name: which of them it is cannot be known.
TEST(Assimp, SkinsWhoseJointsShareANameAreTold) {
  const std::string dae = skinned_square("part");
  std::vector<Warning> warnings;
  const Mesh mesh = read_by_assimp({"a.dae", dae, &warnings}).mesh;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "skinned");
  EXPECT_NEAR(mesh.positions[0].x + mesh.origin[0], 100, 1e-3) << "as its node has it";
}

/// The corner of a cube in 3DS, whose faces have smoothing groups and no normals.
TEST(Assimp, SmoothingGroupsOf3dsGiveNormals) {
  const auto chunk = [](std::uint16_t id, const std::string& content) {
    std::string bytes(reinterpret_cast<const char*>(&id), 2);
    const auto size = static_cast<std::uint32_t>(6 + content.size());
    bytes.append(reinterpret_cast<const char*>(&size), 4);
    return bytes + content;
  };
  const auto list = [](const auto& values) {
    std::string bytes;
    for (const auto value : values)
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    return bytes;
  };
  constexpr std::uint16_t kFaces[] = {0, 2, 1, 0, 0, 1,
                                      3, 0, 0, 3, 2, 0};  // the last of four: flags
  constexpr float kVertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const auto file = [&](const std::array<std::uint32_t, 3>& groups) {
    const std::string faces = chunk(
        0x4120, list(std::array<std::uint16_t, 1>{3}) + list(kFaces) + chunk(0x4150, list(groups)));
    const std::string mesh = chunk(
        0x4100, chunk(0x4110, list(std::array<std::uint16_t, 1>{4}) + list(kVertices)) + faces);
    return chunk(0x4D4D, chunk(0x3D3D, chunk(0x4000, std::string("cube\0", 5) + mesh)));
  };
  for (const bool joined : {true, false}) {
    const std::string bytes = file(joined ? std::array<std::uint32_t, 3>{1, 1, 1}
                                          : std::array<std::uint32_t, 3>{1, 2, 4});
    const Mesh mesh = read_by_assimp({"a.3ds", bytes}).mesh;
    ASSERT_EQ(mesh.triangles.size(), 3U);
    ASSERT_FALSE(mesh.normals.empty());
    for (std::size_t t = 0; t < 3; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 n = mesh.normals[mesh.normal_triangles[t][k]];
        const double most = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
        if (joined) {
          EXPECT_LT(most, 0.99) << "no corner is flat";
        } else {
          EXPECT_NEAR(most, 1, 1e-6) << "all corners are";
        }
      }
    }
  }
}

TEST(Assimp, RefusalsNameTheFileAndTheRemedy) {
  for (const char* name : {"bad.dae", "bad.3ds", "bad.x"}) {
    for (const std::string& bytes : {std::string("nothing"), std::string(1000, '\0'),
                                     std::string("Kaydara FBX Binary  \0\x1a\0", 23)}) {
      try {
        read_by_assimp({name, bytes});
        ADD_FAILURE() << name << " was read";
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
        const std::string text = error.what();
        EXPECT_TRUE(text.starts_with(name)) << text;
        EXPECT_TRUE(text.ends_with(".")) << text;
      }
    }
  }
}

}  // namespace
}  // namespace kiln
#endif

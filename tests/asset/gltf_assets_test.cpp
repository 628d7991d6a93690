// Files of other programs: each is read with as many triangles as trimesh 4 counts, or refused with words that name
// the flaw. Of strips with indices and of fans, which trimesh leaves out, the counts are by the format.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "kiln/asset.h"
#include "kiln/error.h"
#include "support/environment.h"
#include "support/mesh_check.h"

namespace kiln::test {
namespace {

struct Row {
  const char* file;
  std::size_t triangles;  // 0: refused
  const char* words;      // that the error has
};

constexpr Row kTable[] = {
    {"AnimatedMorphCube/glTF/AnimatedMorphCube.gltf", 12, ""},
    {"AnimatedMorphSphere/glTF/AnimatedMorphSphere.gltf", 960, ""},
    {"BoxBadNormals-glTF-Binary/BoxBadNormals.glb", 12, ""},
    {"BoxTexcoords-glTF/boxTexcoords.gltf", 12, ""},
    {"BoxTextured-glTF-Binary/BoxTextured.glb", 12, ""},
    {"BoxTextured-glTF-Embedded/BoxTextured.gltf", 12, ""},
    {"BoxTextured-glTF-pbrSpecularGlossiness/BoxTextured.gltf", 12, ""},
    {"BoxTextured-glTF-techniqueWebGL/BoxTextured.gltf", 0, "KHR_technique_webgl"},
    {"BoxTextured-glTF/BoxTextured.gltf", 12, ""},
    {"BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb", 0, "NaN or infinite"},
    {"ClearCoat-glTF/ClearCoatTest.gltf", 37116, ""},
    {"IncorrectVertexArrays/Cube.gltf", 46, ""},
    {"IndexOutOfRange/AllIndicesOutOfRange.gltf", 0, "accessors[0]"},
    {"IndexOutOfRange/IndexOutOfRange.gltf", 0, "accessors[0]"},
    {"MissingBin/BoxTextured.gltf", 0, "BoxTextured0.bin"},
    {"MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf", 32, ""},
    {"MorphStressTest/glTF/MorphStressTest.gltf", 2412, ""},
    {"RecursiveNodes/RecursiveNodes.gltf", 0, "nodes"},
    {"SchemaFailures/sceneWrongType.gltf", 0, "scene"},
    {"SimpleMorph/glTF/SimpleMorph.gltf", 1, ""},
    {"TestNoRootNode/NoScene.gltf", 0, "no meshes"},
    {"TestNoRootNode/SceneWithoutNodes.gltf", 0, "no meshes"},
    {"cameras/Cameras.gltf", 2, ""},
#ifdef KILN_HAS_DRACO
    {"draco/2CylinderEngine.gltf", 110336, ""},  // as its accessors say
#else
    {"draco/2CylinderEngine.gltf", 0, "KHR_draco_mesh_compression"},
#endif
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_00.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_01.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_02.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_03.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_04.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_05.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_06.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_07.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_08.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_09.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_10.gltf", 0, "no triangles"},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_11.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_12.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_13.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_14.gltf", 2, ""},
    {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_15.gltf", 2, ""},
    {"glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf", 12, ""},
    {"issue_3269/texcoord_crash.gltf", 10, ""},
    {"simple_skin/quad_skin.glb", 2, ""},
    {"simple_skin/simple_skin.gltf", 8, ""},
    {"textureTransform/TextureTransformTest.gltf", 24, ""},
    {"wrongTypes/badArray.gltf", 0, "primitives"},
    {"wrongTypes/badExtension.gltf", 0, "KHR_texture_transform"},
    {"wrongTypes/badNumber.gltf", 0, "normalTexture"},
    {"wrongTypes/badObject.gltf", 0, "pbrMetallicRoughness"},
    {"wrongTypes/badString.gltf", 12, ""},
    {"wrongTypes/badUint.gltf", 0, "index"},
};

TEST(GltfAssets, EachIsReadOrRefusedWithTheFlaw) {
  const std::string folder = "assets/glTF2";
  KILN_REQUIRE_DATA(folder);
  std::set<std::filesystem::path> known;
  for (const Row& row : kTable) {
    const std::filesystem::path path = *shared_data(folder) / row.file;
    known.insert(path);
    if (!std::filesystem::exists(path)) continue;
    try {
      const Asset asset = load_asset(path);
      EXPECT_EQ(asset.mesh.triangles.size(), row.triangles) << row.file;
      EXPECT_EQ(broken_promise(asset.mesh), "") << row.file;
      EXPECT_EQ(asset.materials.size(), asset.mesh.material_names.size()) << row.file;
      EXPECT_EQ(asset.object_nodes.size(), asset.mesh.object_names.size()) << row.file;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      EXPECT_EQ(row.triangles, 0U) << error.what();
      EXPECT_NE(std::string(error.what()).find(row.words), std::string::npos) << error.what();
    }
  }
  for (const auto& entry : std::filesystem::recursive_directory_iterator(*shared_data(folder))) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".glb" || ending == ".gltf") {
      EXPECT_TRUE(known.contains(entry.path())) << entry.path() << " is not in the table";
    }
  }
}

/// Boxes of what is skinned or morphed, by a script of the specification's formulas that shares no code with Kiln.
TEST(GltfAssets, StandAtRest) {
  const std::string folder = "assets/glTF2";
  KILN_REQUIRE_DATA(folder);
  struct Box {
    const char* file;
    std::array<double, 3> least, most;
  };
  const Box boxes[] = {
      {"SimpleMorph/glTF/SimpleMorph.gltf", {0, 0, 0}, {1, 1.5, 0}},
      {"MorphStressTest/glTF/MorphStressTest.gltf", {-2, -0.1, -0.5}, {2, 0.5, 0.5}},
      {"MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf", {-0.5, 0, -0.5}, {0.5, 0.1, 0.5}},
      {"simple_skin/simple_skin.gltf", {-0.5, 0, 0}, {0.5, 2, 0}},
      {"simple_skin/quad_skin.glb", {-100, -4.602e-5, -100}, {100, 4.602e-5, 100}},
  };
  for (const Box& box : boxes) {
    const Mesh mesh = load_asset(*shared_data(folder) / box.file).mesh;
    std::array<double, 3> least{HUGE_VAL, HUGE_VAL, HUGE_VAL};
    std::array<double, 3> most{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (const Triangle& t : mesh.triangles) {
      for (const std::uint32_t v : t) {
        const Vec3& p = mesh.positions[v];
        const std::array<float, 3> at{p.x, p.y, p.z};
        for (std::size_t k = 0; k < 3; ++k) {
          least[k] = std::min(least[k], mesh.origin[k] + double{at[k]});
          most[k] = std::max(most[k], mesh.origin[k] + double{at[k]});
        }
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(least[k], box.least[k], 1e-6 * 200) << box.file << " " << k;
      EXPECT_NEAR(most[k], box.most[k], 1e-6 * 200) << box.file << " " << k;
    }
  }
}

}  // namespace
}  // namespace kiln::test

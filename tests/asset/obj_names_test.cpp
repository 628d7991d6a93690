// Names of objects, groups and materials, written and read again.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "support/environment.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

Mesh read_text(const std::string& text) {
  return load_mesh(std::as_bytes(std::span(text)), "names.obj");
}

/// The name of each triangle.
std::vector<std::string> names(const std::vector<std::uint32_t>& of,
                               const std::vector<std::string>& list) {
  std::vector<std::string> result;
  for (const std::uint32_t name : of) result.push_back(list[name]);
  return result;
}

void expect_same_names(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(names(a.groups, a.group_names), names(b.groups, b.group_names));
  EXPECT_EQ(names(a.objects, a.object_names), names(b.objects, b.object_names));
  EXPECT_EQ(names(a.materials, a.material_names), names(b.materials, b.material_names));
}

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

TEST(ObjNames, SurviveWritingAndReading) {
  for (const std::string& faces : {
           std::string("o a\nf 1 2 3\no b\nusemtl m\nf 1 2 4\nf 1 3 4\no a\nf 2 3 4\n"),
           std::string("o a\ng lid\nf 1 2 3\ng rim\nf 1 2 4\no b\nf 1 3 4\ng lid\nf 2 3 4\n"),
           std::string("g one\nf 1 2 3\ng two\nf 1 2 4\ng one\nf 1 3 4\n"),
           std::string("usemtl x\nf 1 2 3\nusemtl y\no late\nf 1 2 4\nusemtl x\nf 1 3 4\n"),
           // A group named as the object, and back to it.
           std::string("o a\nf 1 2 3\ng b\nf 1 2 4\ng a\nf 1 3 4\no b\nf 2 3 4\n"),
       }) {
    SCOPED_TRACE(faces);
    const Mesh mesh = read_text(kVertices + faces);
    const std::filesystem::path file = test::scratch_folder() / "written.obj";
    save_obj(mesh, file);
    const Mesh again = load_mesh(file);
    expect_same_names(again, mesh);
    // A second time nothing changes any more.
    const std::filesystem::path twice = test::scratch_folder() / "written.obj";
    save_obj(again, twice);
    expect_same_names(load_mesh(twice), mesh);
  }
}

TEST(ObjNames, FilesOfMaterialsAreNamed) {
  const Mesh mesh =
      read_text("mtllib my paint.mtl\nmtllib b\\c.mtl\n" + kVertices + "usemtl m\nf 1 2 3\n");
  const std::filesystem::path file = test::scratch_folder() / "painted.obj";
  save_obj(mesh, file);
  const std::vector<std::string> wanted = {"my paint.mtl", "b/c.mtl"};
  EXPECT_EQ(load_mesh(file).material_files, wanted);
}

/// Objects stay objects: `o` lines, and no groups beside them that were not there.
TEST(ObjNames, OfObjectsAloneAreObjectsAlone) {
  const std::filesystem::path file = test::scratch_folder() / "objects.obj";
  save_obj(read_text(kVertices + "o left\nf 1 2 3\no right\nf 1 2 4\n"), file);
  const std::string text = test::read_file(file);
  EXPECT_NE(text.find("\no left\nf 1 2 3\no right\nf 1 2 4\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("\ng "), std::string::npos) << text;
}

/// Names of a mesh that no file had: objects whose names are no groups', one of them unused.
TEST(ObjNames, OfMeshesOfTheCallersOwn) {
  Mesh mesh = test::plane(2, 2);
  mesh.group_names = {"unused", "top"};
  mesh.groups.assign(mesh.triangles.size(), 1);
  mesh.object_names = {"second", "gone", "first"};
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) mesh.objects.push_back(t % 2 * 2);
  const std::filesystem::path file = test::scratch_folder() / "own.obj";
  save_obj(mesh, file);
  const Mesh again = load_mesh(file);
  expect_same_names(again, mesh);
  EXPECT_EQ(again.object_names, mesh.object_names);
  mesh.objects.pop_back();
  EXPECT_THROW(save_obj(mesh, file), Error);
}

TEST(ObjNames, AreKeptBySimplifyingToAFile) {
  Mesh high = test::BumpySphere::dense(3000);
  high.object_names = high.group_names = {"upper", "lower"};
  high.material_names = {"steel"};
  for (const Triangle& t : high.triangles) {
    high.objects.push_back(high.positions[t[0]].z > 0 ? 0 : 1);
    high.materials.push_back(0);
  }
  high.groups = high.objects;
  const Mesh low = unwrap(simplify(high, {.faces = 300}));
  const std::filesystem::path file = test::scratch_folder() / "low.obj";
  save_obj(low, file);
  const Mesh again = load_mesh(file);
  expect_same_names(again, low);
  ASSERT_EQ(again.objects.size(), low.triangles.size());
  for (std::size_t t = 0; t < again.triangles.size(); ++t) {
    float middle = 0;
    for (const std::uint32_t v : again.triangles[t]) middle += again.positions[v].z / 3;
    if (std::abs(middle) < 0.2F) continue;  // triangles across the border go either way
    EXPECT_EQ(again.object_names[again.objects[t]], middle > 0 ? "upper" : "lower") << t;
  }
}

}  // namespace
}  // namespace kiln

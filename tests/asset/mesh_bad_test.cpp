// Reading meshes: every way a file can be bad.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <string>

#include "asset/mesh_files.h"
#include "asset/mesh_reader.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/mesh_check.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::mesh_files::binary_stl;
using test::mesh_files::expect_bad;
using test::mesh_files::expect_bad_text;
using test::mesh_files::hard_edge;
using test::mesh_files::load_text;
using test::mesh_files::PlyText;
using test::mesh_files::pyramid_ply;
using test::mesh_files::write_file;

TEST(MeshIo, RefusesPathsThatAreNotFiles) {
  const fs::path folder = test::scratch_folder();
  expect_bad(folder / "none.ply", {"no such file", "Check"});
  fs::create_directory(folder / "folder.obj");
  expect_bad(folder / "folder.obj", {"directory", "Name"});
  ASSERT_EQ(mkfifo((folder / "pipe.ply").c_str(), 0600), 0);
  expect_bad(folder / "pipe.ply", {"regular file", "Copy"});
  if (geteuid() != 0) {  // root may read everything
    const fs::path locked = write_file("locked.ply", "ply\n");
    fs::permissions(locked, fs::perms::none);
    expect_bad(locked, {"cannot be opened", "permission"});
  }
}

TEST(MeshIo, RefusesWrongAndUnknownExtensions) {
  const std::string ply = pyramid_ply<float, std::uint8_t, std::int32_t>("binary_little_endian",
                                                                         "float", "uchar", "int");
  expect_bad_text("a.obj", ply, {"OBJ", "looks like PLY", "Rename", ".ply"});
  expect_bad_text("a.stl", ply, {"looks like PLY", "Rename"});
  expect_bad_text("a.ply", hard_edge, {"looks like OBJ", "Rename", ".obj"});
  expect_bad_text("a.ply", binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}}),
                  {"looks like STL"});
  expect_bad_text("a.obj", "OFF\n3 1 0\n", {"looks like OFF"});
  expect_bad_text("a.obj", "glTF\2", {"glTF", "Rename", ".glb"});
  expect_bad_text("a.max", "Kaydara FBX Binary",
                  {".max", "FBX", ".ply", ".obj", ".stl", ".off", ".glb", ".fbx"});
  expect_bad_text("mesh", ply, {"no extension", "PLY", ".obj"});
  EXPECT_EQ(load_text("UPPER.PLY", ply).mesh.triangles.size(), 6u);
}

TEST(MeshIo, RefusesEmptyFilesAndGarbage) {
  std::string garbage;
  std::uint32_t state = 1;
  for (int i = 0; i < 5000; ++i) {
    state = state * 1664525u + 1013904223u;
    garbage += static_cast<char>(state >> 24);
  }
  for (const std::string extension : {"ply", "obj", "stl", "off", "glb", "gltf"}) {
    expect_bad_text("e." + extension, "", {"empty", "Export"});
    expect_bad_text("g." + extension, garbage, {"xport"});
    expect_bad_text("w." + extension, " \n\n", {"xport"});
  }
}

TEST(MeshIo, RefusesTruncatedFiles) {
  // Cut anywhere, a file gives an error or, where only the last line's end is missing, the mesh.
  const auto cut = [](const std::string& name, const std::string& text, std::size_t tail) {
    for (std::size_t size = 0; size + tail < text.size(); ++size) {
      const MeshInput input{name, std::string_view(text).substr(0, size)};
      const MeshFormat format = name.ends_with("ply")   ? MeshFormat::ply
                                : name.ends_with("stl") ? MeshFormat::stl
                                                        : MeshFormat::off;
      try {
        parse_mesh(input, format);
        ADD_FAILURE() << name << " cut to " << size << " bytes was read";
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
        EXPECT_EQ(std::string(error.what()).find(name), 0u);
      }
    }
  };
  for (const std::string encoding : {"binary_little_endian", "binary_big_endian"}) {
    cut("f.ply", pyramid_ply<float, std::uint8_t, std::int32_t>(encoding, "float", "uchar", "int"),
        0);
    cut("d.ply",
        pyramid_ply<double, std::uint8_t, std::int32_t>(encoding, "double", "uchar", "int"), 0);
  }
  cut("a.ply", pyramid_ply<float, std::uint8_t, std::int32_t>("ascii", "float", "uchar", "int"), 1);
  cut("b.stl", binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}}), 0);
  cut("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", 1);
  expect_bad_text("t.ply",
                  pyramid_ply<float, std::uint8_t, std::int32_t>("binary_little_endian", "float",
                                                                 "uchar", "int")
                      .substr(0, 260),
                  {"truncated", "Copy"});
  expect_bad_text("t.obj", "v 0 0 0\nv 1 0\n", {"line 2", "missing", "export"});
  expect_bad_text("t.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
                  {"line 5", "truncated", "Copy"});
}

TEST(MeshIo, RefusesCountsThatTheFileCannotHold) {
  const std::string tail = "\nproperty float x\nproperty float y\nproperty float z\nelement face ";
  const std::string list =
      "\nproperty list uchar int vertex_indices\nend_header\n0 0 0 12345678901234567890\n";
  for (const std::string format : {"ascii", "binary_little_endian"}) {
    const std::string start = "ply\nformat " + format + " 1.0\nelement vertex ";
    expect_bad_text("c.ply", start + "4000000000" + tail + "1" + list,
                    {"4000000000", "vertex", "truncated"});
    expect_bad_text("c.ply", start + "1" + tail + "4000000000" + list,
                    {"4000000000", "face", "truncated"});
    expect_bad_text("c.ply", start + "9223372036854775807" + tail + "1" + list, {"truncated"});
    expect_bad_text("c.ply", start + "99999999999999999999" + tail + "1" + list,
                    {"count", "line 3"});
    expect_bad_text("c.ply", start + "-1" + tail + "1" + list, {"count", "line 3"});
  }
  std::string stl = binary_stl({{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}});
  stl[83] = '\x7f';
  expect_bad_text("c.stl", stl, {"declares", "truncated", "again"});
  expect_bad_text("c.off", "OFF\n4000000000 1 0\n0 0 0\n", {"4000000000", "truncated"});
  expect_bad_text("c.off", "OFF\n1 4000000000 0\n0 0 0\n", {"4000000000", "truncated"});
  expect_bad_text("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n",
                  {"face 0", "line 6"});
}

TEST(MeshIo, RefusesIndicesOutOfRange) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1 2 3\n";
  expect_bad_text("i.obj", obj + "f 1 2 9\n", {"line 7", "vertex 9", "are 3"});
  expect_bad_text("i.obj", obj + "f 0 1 2\n", {"line 7", "face 1", "vertex 0", "start at 1"});
  expect_bad_text("i.obj", obj + "f -4 1 2\n", {"line 7", "vertex -4"});
  expect_bad_text("i.obj", obj + "f 1/2 2/1 3/1\n", {"line 7", "texture coordinate 2"});
  expect_bad_text("i.obj", obj + "f 1//7 2//1 3//1\n", {"line 7", "normal 7"});
  expect_bad_text("i.obj", obj + "f 1 x 3\n", {"line 7", "\"x\"", "export"});
  expect_bad_text("i.obj", obj + "f 1 99999999999999999999 3\n", {"line 7"});
  expect_bad_text("i.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n",
                  {"line 7", "face 1", "vertex 3", "are 3", "export"});
  for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const std::int32_t bad : {3, -1, 2147483647}) {
      PlyText ply(encoding,
                  "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 2\nproperty list uchar int vertex_indices\n");
      for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) ply.put(value);
      ply.put(std::uint8_t{3}).put(0).put(1).put(2).put(std::uint8_t{3}).put(0).put(1).put(bad);
      expect_bad_text("i.ply", ply.text(), {"face 1", std::to_string(bad), "are 3", "xport"});
    }
  }
}

TEST(MeshIo, RefusesMeshesWithoutASurface) {
  const std::string points =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string body = "0 0 0\n1 1 1\n";
  expect_bad_text("p.ply", PlyText("ascii", points).text() + body,
                  {"no faces", "2 points", "surface"});
  expect_bad_text(
      "p.ply",
      PlyText("ascii", points + "element face 0\nproperty list uchar int vertex_indices\n").text() +
          body,
      {"no faces", "surface"});
  expect_bad_text(
      "p.ply",
      PlyText("ascii", points + "element tristrips 1\nproperty list int int vertex_indices\n")
              .text() +
          body + "0\n",
      {"no faces", "surface"});
  expect_bad_text("p.obj", "v 0 0 0\nv 1 0 0\n", {"no faces", "surface"});
  expect_bad_text("p.off", "OFF\n2 0 0\n0 0 0\n1 0 0\n", {"no faces", "surface"});
  expect_bad_text("p.stl", "solid x\nendsolid x\n", {"no faces"});
  expect_bad_text("p.stl", binary_stl({}), {"no faces"});
  expect_bad_text("d.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n",
                  {"line 4", "degenerate", "xport"});
  expect_bad_text("d.obj", "v nan 0 0\nv inf 0 0\nv 0 0 -inf\nf 1 2 3\n", {"NaN", "xport"});
  expect_bad_text("d.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"degenerate", "xport"});
}

TEST(MeshIo, RefusesBadWordsWithTheirLine) {
  expect_bad_text("w.ply",
                  "ply\nformat ascii 1.0\nelement vertex 1\nproperty floaty x\nend_header\n",
                  {"line 4", "floaty", "xport"});
  expect_bad_text("w.ply", "ply\nformat text 1.0\nend_header\n", {"line 2", "text"});
  for (const char* type : {"property float\n", "property list uchar int\n"}) {
    expect_bad_text(
        "w.ply",
        std::string("ply\nformat ascii 1.0\nelement vertex 1\n") + type + "end_header\n0\n",
        {"line 4", "no name"});
  }
  // Lines are those of the file, after headers of any length.
  for (std::size_t comments = 0; comments < 3; ++comments) {
    std::string text = "ply\nformat ascii 1.0\n";
    for (std::size_t i = 0; i < comments; ++i) text += "comment no statement\n";
    text +=
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 zero 0\n3 0 1 2\n";
    expect_bad_text("w.ply", text, {"line " + std::to_string(12 + comments), "zero"});
    text.replace(text.find("zero"), 4, "1");
    text.replace(text.rfind("2\n"), 1, "7");
    expect_bad_text("w.ply", text, {"line " + std::to_string(13 + comments), "vertex 7"});
  }
  expect_bad_text("w.ply", "ply\nformat ascii 1.0\nelement face 1\nend_header\n", {"vertex"});
  expect_bad_text("w.ply",
                  pyramid_ply<float, std::uint8_t, std::int32_t>("ascii", "float", "uchar", "int")
                      .replace(200, 1, "?"),
                  {"line", "?", "xport"});
  expect_bad_text("w.off", "OFF BINARY\n", {"binary", "Convert"});
  expect_bad_text("w.off", "nOFF 4\n3 1 0\n", {"\"4\" dimensions"});
  expect_bad_text("w.off", "OFF\n3 1 0\n0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n",
                  {"line 4", "vertex 1", "zero"});
  expect_bad_text("w.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 zero 0\n",
                  {"line 4", "zero"});
  expect_bad_text("w.obj", "v 0 zero 0\n", {"line 1", "zero", "Correct"});
}

TEST(MeshIo, SurvivesWhatFuzzersFound) {
  const std::array<std::pair<const char*, MeshFormat>, 5> formats{{{"ply", MeshFormat::ply},
                                                                   {"obj", MeshFormat::obj},
                                                                   {"stl", MeshFormat::stl},
                                                                   {"off", MeshFormat::off},
                                                                   {"fbx", MeshFormat::fbx}}};
  int files = 0;
  for (const auto& [name, format] : formats) {
    for (const auto& entry : fs::directory_iterator(test::test_data("fuzz") / name)) {
      SCOPED_TRACE(entry.path());
      const std::string bytes = test::read_file(entry.path());
      try {
        EXPECT_EQ(test::broken_promise(parse_mesh({entry.path().string(), bytes}, format)), "");
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
      }
      ++files;
    }
  }
  EXPECT_GE(files, 4);
}

}  // namespace
}  // namespace kiln

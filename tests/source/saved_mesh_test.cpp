// The mesh of a saved source: every member comes back, and files that no writer makes are refused for what is wrong
// with them.
#include "asset/saved_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/byte_hash.h"
#include "io/file/atomic_file.h"
#include "kiln/error.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadBytes = 32, kByteOrderAt = 8, kLengthAt = 16, kHashAt = 24;

/// Two triangles whose every member differs from its default, and whose elements differ from each other.
Mesh full_mesh() {
  Mesh mesh;
  mesh.origin = {1000.5, -2000.25, 3000.125};
  mesh.metres = 0.0254;
  mesh.uv_set = 2;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.5F}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  mesh.uvs = {{0, 0}, {0.5F, 0}, {0, 0.5F}, {0.75F, 1}};
  mesh.uv_triangles = {{1, 2, 3}, {3, 0, 1}};
  mesh.normals = {{0, 0, 1}, {0, 1, 0}, {0, 0, 0}};
  mesh.normal_triangles = {{0, 1, 2}, {2, 1, 0}};
  mesh.colors = {{1, 2, 3, 4}, {5, 6, 7, 8}, {9, 10, 11, 12}, {13, 14, 15, 16}};
  mesh.groups = {1, 0};
  mesh.group_names = {"first group", "second"};
  mesh.objects = {0, 1};
  mesh.object_names = {"body", ""};
  mesh.materials = {2, 1};
  mesh.material_names = {"unused", "paint", "rust"};
  mesh.polygons = {0, 0};
  mesh.other_uvs = {{0, {{0.1F, 0}, {0.2F, 0}, {0.3F, 0}, {0.4F, 1}}},
                    {1, {{0, 0.6F}, {0, 0.7F}, {0, 0.8F}, {0, 0.9F}}}};
  return mesh;
}

std::string saved_bytes(const Mesh& mesh) {
  const fs::path path = test::scratch_folder() / "mesh.kilnsrc";
  AtomicFile file(path);
  write_saved_mesh(mesh, file);
  file.commit();
  return test::read_file(path);
}

Mesh read_bytes(const std::string& bytes) {
  return load_mesh(std::as_bytes(std::span(bytes)), "mesh.kilnsrc");
}

/// The message of the error; empty if the file is read.
std::string error_of(const std::string& bytes) {
  try {
    read_bytes(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
    return error.what();
  }
  return {};
}
std::string error_of(const Mesh& mesh) { return error_of(saved_bytes(mesh)); }

template <typename T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(&bytes.at(at + sizeof value - 1) - (sizeof value - 1), &value, sizeof value);
}

TEST(SavedMesh, EveryMemberComesBack) {
  const Mesh mesh = full_mesh();
  const Mesh saved = read_bytes(saved_bytes(mesh));
  EXPECT_EQ(saved.name, "mesh");
  EXPECT_EQ(saved.origin, mesh.origin);
  EXPECT_EQ(saved.metres, mesh.metres);
  EXPECT_EQ(saved.uv_set, mesh.uv_set);
  EXPECT_EQ(saved.positions, mesh.positions);
  EXPECT_EQ(saved.triangles, mesh.triangles);
  EXPECT_EQ(saved.uvs, mesh.uvs);
  EXPECT_EQ(saved.uv_triangles, mesh.uv_triangles);
  EXPECT_EQ(saved.normals, mesh.normals);
  EXPECT_EQ(saved.normal_triangles, mesh.normal_triangles);
  EXPECT_EQ(saved.colors, mesh.colors);
  EXPECT_EQ(saved.groups, mesh.groups);
  EXPECT_EQ(saved.group_names, mesh.group_names);
  EXPECT_EQ(saved.objects, mesh.objects);
  EXPECT_EQ(saved.object_names, mesh.object_names);
  EXPECT_EQ(saved.materials, mesh.materials);
  EXPECT_EQ(saved.material_names, mesh.material_names);
  EXPECT_EQ(saved.polygons, mesh.polygons);
  EXPECT_EQ(saved.other_uvs, mesh.other_uvs);
}

/// Lists at the end of a file may be of many short elements.
TEST(SavedMesh, ShortNamesAndEmptySetsComeBack) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  for (std::size_t i = 0; i < 64; ++i) mesh.material_names.push_back(i % 2 == 0 ? "" : "m");
  mesh.materials = {63};
  EXPECT_EQ(read_bytes(saved_bytes(mesh)).material_names, mesh.material_names);
}

TEST(SavedMesh, EmptyMembersComeBackEmpty) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  const Mesh saved = read_bytes(saved_bytes(mesh));
  EXPECT_EQ(saved.positions, mesh.positions);
  EXPECT_TRUE(saved.uvs.empty() && saved.normals.empty() && saved.colors.empty());
  EXPECT_TRUE(saved.groups.empty() && saved.objects.empty() && saved.materials.empty());
  EXPECT_TRUE(saved.polygons.empty() && saved.other_uvs.empty());
  EXPECT_EQ(saved.metres, 0);
}

TEST(SavedMesh, HeadIsChecked) {
  const std::string whole = saved_bytes(full_mesh());
  std::uint64_t length = 0, hash = 0;
  std::memcpy(&length, &whole[kLengthAt], sizeof length);
  std::memcpy(&hash, &whole[kHashAt], sizeof hash);
  EXPECT_EQ(whole.substr(0, 8), "kilnsrc1");
  EXPECT_EQ(length, whole.size() - kHeadBytes);
  EXPECT_EQ(hash, hash_bytes(std::string_view(whole).substr(kHeadBytes)));
  EXPECT_EQ(error_of(whole), "");
  const auto problem = [&](const std::function<void(std::string&)>& change) {
    std::string bytes = whole;
    change(bytes);
    return error_of(bytes);
  };
  const auto expect = [](const std::string& message, const char* words) {
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  expect(problem([](std::string& b) { b[7] = '2'; }), "no saved source of this version");
  expect(problem([](std::string& b) { b.resize(kHeadBytes - 1); }), "no saved source");
  expect(problem([](std::string& b) { put(b, kByteOrderAt, 0x04030201U); }), "another byte order");
  expect(problem([&](std::string& b) { put(b, kLengthAt, length + 1); }), "cut short");
  expect(problem([&](std::string& b) { b.pop_back(); }), "cut short");
  expect(problem([&](std::string& b) { put(b, kHashAt, hash ^ 1); }), "damaged");
  expect(problem([](std::string& b) { b.back() = static_cast<char>(b.back() ^ 1); }), "damaged");
  // One byte less or more in the arrays, with the right length and hash.
  for (const bool longer : {false, true}) {
    const std::string message = problem([&](std::string& b) {
      b.resize(longer ? b.size() + 1 : b.size() - 1);
      put(b, kLengthAt, std::uint64_t{b.size() - kHeadBytes});
      put(b, kHashAt, hash_bytes(std::string_view(b).substr(kHeadBytes)));
    });
    EXPECT_TRUE(message.find(longer ? "followed by other bytes" : "longer than the file") !=
                    std::string::npos ||
                (!longer && message.find("cut short") != std::string::npos))
        << message;
  }
}

/// Meshes whose bytes are intact, but which no reader returns.
TEST(SavedMesh, ContentsAreChecked) {
  ASSERT_EQ(error_of(full_mesh()), "");
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<const char*, std::function<void(Mesh&)>>> changes = {
      {"no triangles", [](Mesh& m) { m = {}; }},
      {"group beyond names", [](Mesh& m) { m.groups[1] = 2; }},
      {"object beyond names", [](Mesh& m) { m.objects[1] = 2; }},
      {"material beyond names", [](Mesh& m) { m.materials[1] = 3; }},
      {"too few groups", [](Mesh& m) { m.groups.pop_back(); }},
      {"too few objects", [](Mesh& m) { m.objects.pop_back(); }},
      {"too many materials", [](Mesh& m) { m.materials.push_back(0); }},
      {"long normal", [](Mesh& m) { m.normals[1].y = 1.0001F; }},
      {"short normal", [](Mesh& m) { m.normals[1].y = 0.9999F; }},
      {"negative unit", [](Mesh& m) { m.metres = -1; }},
      {"infinite unit", [](Mesh& m) { m.metres = kInfinity; }},
      {"unit that is no number", [](Mesh& m) { m.metres = std::nan(""); }},
      {"vertex beyond positions", [](Mesh& m) { m.triangles[1][2] = 4; }},
      {"corner beyond UVs", [](Mesh& m) { m.uv_triangles[1][2] = 4; }},
      {"corner beyond normals", [](Mesh& m) { m.normal_triangles[1][2] = 3; }},
      {"too few colours", [](Mesh& m) { m.colors.pop_back(); }},
      {"too few polygons", [](Mesh& m) { m.polygons.pop_back(); }},
  };
  for (const auto& [what, change] : changes) {
    Mesh mesh = full_mesh();
    change(mesh);
    EXPECT_NE(error_of(mesh), "") << what;
  }
  // The greatest legal index of each.
  Mesh mesh = full_mesh();
  mesh.groups = mesh.objects = {1, 1};
  mesh.materials = {2, 2};
  EXPECT_EQ(error_of(mesh), "");
}

TEST(SavedMesh, IsToldByItsContent) {
  const std::string bytes = saved_bytes(full_mesh());
  for (const char* name : {"mesh", "mesh.abc"}) {
    try {
      load_mesh(std::as_bytes(std::span(bytes)), name);
      ADD_FAILURE() << name << " was read";
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("its content looks like saved source"), std::string::npos) << message;
    }
  }
}

TEST(SavedMesh, AxesAndUnitsAreThoseOfTheRunThatSavedIt) {
  const std::string bytes = saved_bytes(full_mesh());
  const fs::path path = test::scratch_folder() / "again.kilnsrc";
  std::ofstream(path, std::ios::binary) << bytes;
  LoadMeshOptions up, metres;
  up.up = UpAxis::z;
  metres.metres = 0.01;
  for (const LoadMeshOptions& options : {up, metres}) EXPECT_THROW(load_mesh(path, options), Error);
  EXPECT_EQ(load_mesh(path, LoadMeshOptions{}).metres, full_mesh().metres);
}

}  // namespace
}  // namespace kiln

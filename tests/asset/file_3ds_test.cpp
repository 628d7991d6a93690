// 3DS and X: small files by formula, their smoothing groups and axes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asset/assimp.h"
#include "asset/mesh_reader.h"
#include "asset/smoothing_3ds.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

struct Face3ds {
  std::array<std::uint16_t, 3> corners;
  std::uint32_t mask = 0;
  std::string material = {};
};

/// A mesh as a chunk of 3DS.
struct Object3ds {
  std::string name = "part";
  std::vector<std::array<float, 3>> vertices;
  std::vector<Face3ds> faces;
  bool has_groups = true;
};

template <typename T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string chunk(std::uint16_t id, const std::string& content) {
  std::string bytes;
  put(bytes, id);
  put(bytes, static_cast<std::uint32_t>(6 + content.size()));
  return bytes + content;
}

std::string chunk_of(const Object3ds& object) {
  std::string vertices, faces, masks;
  put(vertices, static_cast<std::uint16_t>(object.vertices.size()));
  for (const auto& v : object.vertices) put(vertices, v);
  put(faces, static_cast<std::uint16_t>(object.faces.size()));
  std::vector<std::pair<std::string, std::string>> materials;  // with the faces' numbers
  for (std::size_t f = 0; f < object.faces.size(); ++f) {
    const Face3ds& face = object.faces[f];
    put(faces, face.corners);
    put(faces, std::uint16_t{7});
    put(masks, face.mask);
    if (face.material.empty()) continue;
    auto found = std::find_if(materials.begin(), materials.end(),
                              [&](const auto& entry) { return entry.first == face.material; });
    if (found == materials.end()) found = materials.insert(found, {face.material, ""});
    put(found->second, static_cast<std::uint16_t>(f));
  }
  for (const auto& [name, list] : materials) {
    std::string content(name.c_str(), name.size() + 1);
    put(content, static_cast<std::uint16_t>(list.size() / 2));
    faces += chunk(0x4130, content + list);
  }
  if (object.has_groups) faces += chunk(0x4150, masks);
  const std::string mesh = chunk(0x4100, chunk(0x4110, vertices) + chunk(0x4120, faces));
  return chunk(0x4000, std::string(object.name.c_str(), object.name.size() + 1) + mesh);
}

std::string file_3ds(const std::vector<Object3ds>& objects,
                     const std::vector<std::string>& materials = {}) {
  std::string content;
  for (const std::string& name : materials) {
    content += chunk(0xAFFF, chunk(0xA000, std::string(name.c_str(), name.size() + 1)));
  }
  for (const Object3ds& object : objects) content += chunk_of(object);
  return chunk(0x4D4D, chunk(0x3D3D, content));
}

constexpr std::size_t kSides = 12;

/// A prism along Z: the sides have one mask, the caps another. Vertices of the sides lie at unit distance from the axis.
Object3ds prism(std::uint32_t of_sides, std::uint32_t of_caps) {
  Object3ds object;
  for (const float z : {0.0F, 1.0F}) {
    for (std::size_t i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / kSides;
      object.vertices.push_back(
          {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), z});
    }
  }
  const auto at = [](std::size_t i) { return static_cast<std::uint16_t>(i); };
  for (std::size_t i = 0; i < kSides; ++i) {
    const std::size_t next = (i + 1) % kSides;
    object.faces.push_back({{at(i), at(next), at(kSides + next)}, of_sides});
    object.faces.push_back({{at(i), at(kSides + next), at(kSides + i)}, of_sides});
  }
  for (std::size_t i = 1; i + 1 < kSides; ++i) {
    object.faces.push_back({{0, at(i + 1), at(i)}, of_caps});
    object.faces.push_back({{at(kSides), at(kSides + i), at(kSides + i + 1)}, of_caps});
  }
  return object;
}

double degrees_between(const Vec3& a, const Vec3& b) {
  const Vec3d u = to_double(a), v = to_double(b);
  return std::atan2(length(cross(u, v)), dot(u, v)) * 180 / std::numbers::pi;
}

#ifdef KILN_HAS_ASSIMP

/// The corners of a prism that Kiln turned to Y up: its normals against those of the cylinder, and of the caps.
void expect_cylinder(const Mesh& mesh) {
  ASSERT_EQ(mesh.normal_triangles.size(), mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = mesh.positions[mesh.triangles[t][k]];
    const bool is_cap = at[0].y == at[1].y && at[1].y == at[2].y;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto x = static_cast<float>(at[k].x + mesh.origin[0]),
                 y = static_cast<float>(at[k].y + mesh.origin[1]),
                 z = static_cast<float>(at[k].z + mesh.origin[2]);
      const Vec3 wanted = is_cap ? Vec3{0, y > 0.5F ? 1.0F : -1.0F, 0} : Vec3{x, 0, z};
      // Angle-weighted, where Assimp's weights by area are some degrees off.
      EXPECT_LT(degrees_between(mesh.normals[mesh.normal_triangles[t][k]], wanted), 0.01)
          << "triangle " << t << " corner " << k;
    }
  }
}

Mesh read_3ds(const std::string& bytes, std::vector<Warning>* warnings = nullptr) {
  return read_by_assimp({"a.3ds", bytes, warnings}).mesh;
}

TEST(File3ds, GroupsMakeNormalsOfACylinder) {
  for (const auto& [sides, caps] : {std::pair(1U, 2U), {2U, 0U}, {6U, 8U}, {0x80000000U, 1U}}) {
    SCOPED_TRACE(sides);
    expect_cylinder(read_3ds(file_3ds({prism(sides, caps)})));
  }
}

// Faces of one bit and of another are joined where a third between them has both.
TEST(File3ds, GroupsJoinThroughOthers) {
  Object3ds object = prism(1, 8);
  for (std::size_t i = 0; i < 2 * kSides; ++i) {
    object.faces[i].mask = i % 2 == 0 ? 3U : i / 2 % 2 == 0 ? 1U : 2U;
  }
  expect_cylinder(read_3ds(file_3ds({object})));
}

TEST(File3ds, WithoutGroupsItHasNoNormals) {
  Object3ds none = prism(0, 0);
  none.has_groups = false;
  // MeshLab writes 10 into every face.
  for (const Object3ds& object : {none, prism(0, 0), prism(10, 10)}) {
    std::vector<Warning> warnings;
    const Mesh mesh = read_3ds(file_3ds({object}), &warnings);
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_TRUE(mesh.normal_triangles.empty());
    EXPECT_TRUE(warnings.empty());
  }
  // One group for all is a word of the file's: all is smooth.
  const Mesh smooth = read_3ds(file_3ds({prism(1, 1)}));
  ASSERT_EQ(smooth.normals.size(), 2 * kSides);
  for (const Vec3& n : smooth.normals) EXPECT_GT(std::abs(n.y), 0.1F);
  expect_cylinder(read_3ds(file_3ds({prism(10, 1)})));
}

// Mask 10 in every face of one mesh is a group like others where another mesh of the file has other groups.
TEST(File3ds, OnlyFilesOfOneMaskAreMeshLabs) {
  const auto masks_of = [](const std::vector<Object3ds>& objects) {
    std::vector<std::set<std::uint32_t>> masks;
    for (const Smoothing3ds& mesh : read_smoothing_3ds(file_3ds(objects))) {
      masks.emplace_back(mesh.masks.begin(), mesh.masks.end());
    }
    return masks;
  };
  using Masks = std::vector<std::set<std::uint32_t>>;
  EXPECT_EQ(masks_of({prism(10, 10), prism(10, 10)}), (Masks{{0}, {0}}));
  EXPECT_EQ(masks_of({prism(10, 10), prism(1, 2)}), (Masks{{10}, {1, 2}}));
}

// Assimp splits a mesh by its materials; a face without one may be among those of a material "default".
TEST(File3ds, GroupsHoldAcrossMaterials) {
  for (const bool with_default : {false, true}) {
    Object3ds object = prism(1, 2);
    for (std::size_t f = 0; f < object.faces.size(); ++f) {
      object.faces[f].material = std::array<const char*, 4>{"red", "Blue", "", "unknown"}[f % 4];
    }
    std::vector<std::string> materials = {"blue", "green", "RED"};
    if (with_default) materials.emplace_back("My Default");
    std::vector<Warning> warnings;
    const Mesh mesh = read_3ds(file_3ds({object}, materials), &warnings);
    EXPECT_EQ(mesh.material_names.size(), 3U);
    EXPECT_TRUE(warnings.empty());
    expect_cylinder(mesh);
  }
}

// Two meshes at one place are two surfaces, and one without groups has no normals of the file's.
TEST(File3ds, MeshesAreApart) {
  Object3ds upper = prism(1, 2), bare = prism(0, 0);
  upper.name = "upper";
  for (auto& v : upper.vertices) v[2] += 1;
  std::reverse(upper.faces.begin(), upper.faces.end());  // no corner is like the lower one's
  Object3ds lower = prism(1, 2);
  const Mesh two = read_3ds(file_3ds({lower, upper}));
  std::size_t caps = 0;
  for (std::size_t t = 0; t < two.triangles.size(); ++t) {
    const Vec3d a = to_double(two.positions[two.triangles[t][0]]),
                b = to_double(two.positions[two.triangles[t][1]]),
                c = to_double(two.positions[two.triangles[t][2]]);
    const Vec3 plane = to_float(cross(b - a, c - a));
    if (std::abs(plane.y) < 0.9F * length(to_double(plane))) continue;
    ++caps;
    for (const std::uint32_t n : two.normal_triangles[t]) {
      EXPECT_LT(degrees_between(two.normals[n], plane), 0.01);
    }
  }
  EXPECT_EQ(caps, 4 * (kSides - 2));
  bare.name = "bare";
  for (auto& v : bare.vertices) v[0] += 3;
  std::vector<Warning> warnings;
  const Mesh mixed = read_3ds(file_3ds({lower, bare}), &warnings);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "missing-normals");
  EXPECT_EQ(warnings[0].count, lower.faces.size());
  for (std::size_t t = 0; t < mixed.triangles.size(); ++t) {
    const Vec3 n = mixed.normals[mixed.normal_triangles[t][0]];
    EXPECT_EQ(n == Vec3{}, t >= lower.faces.size());
  }
}

/// A tetrahedron in 3DS or X whose corners are the origin and a step along each axis.
constexpr std::array<std::array<float, 3>, 4> kCorners{
    {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}}};
constexpr std::array<std::array<std::uint16_t, 3>, 4> kOutward{
    {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};

struct Up {
  UpAxis axis;
  std::size_t coordinate;
  double sign;
};
constexpr Up kUps[] = {{UpAxis::x, 0, 1},        {UpAxis::y, 1, 1},
                       {UpAxis::z, 2, 1},        {UpAxis::minus_x, 0, -1},
                       {UpAxis::minus_y, 1, -1}, {UpAxis::minus_z, 2, -1}};

std::array<double, 3> world(const Mesh& mesh, std::uint32_t v) {
  const Vec3& p = mesh.positions[v];
  return {p.x + mesh.origin[0], p.y + mesh.origin[1], p.z + mesh.origin[2]};
}

/// Heights are those along the axis of the file, edges as long as in it, and faces look outwards.
void expect_up(const Mesh& mesh, const Up& up) {
  ASSERT_EQ(mesh.positions.size(), 4U);
  std::array<std::array<double, 3>, 4> at{};  // by the length of the step: 0, 1, 2, 3
  std::array<bool, 4> seen{};
  for (std::uint32_t v = 0; v < 4; ++v) {
    const auto p = world(mesh, v);
    const auto i =
        static_cast<std::size_t>(std::lround(std::hypot(p[0], p[1], p[2])));  // it lies at 0
    ASSERT_LT(i, 4U);
    at[i] = p;
    seen[i] = true;
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 4);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_NEAR(at[i][1], kCorners[i][up.coordinate] * up.sign, 1e-5) << "corner " << i;
  }
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto a = world(mesh, t[0]), b = world(mesh, t[1]), c = world(mesh, t[2]);
    volume +=
        dot(Vec3d(a[0], a[1], a[2]), cross(Vec3d(b[0], b[1], b[2]), Vec3d(c[0], c[1], c[2]))) / 6;
  }
  EXPECT_NEAR(volume, 1, 1e-5);
}

Mesh read_up(const char* file, const std::string& bytes, std::optional<UpAxis> up) {
  LoadMeshOptions options;
  if (up) options.up = *up;
  options.override_up = up.has_value();
  return read_by_assimp({file, bytes, nullptr, options}).mesh;
}

TEST(File3ds, UpSaysWhatTheFilesOwnAxisIs) {
  Object3ds object;
  object.vertices.assign(kCorners.begin(), kCorners.end());
  for (const auto& corners : kOutward) object.faces.push_back({corners, 0});
  const std::string bytes = file_3ds({object});
  expect_up(read_up("a.3ds", bytes, std::nullopt), kUps[2]);
  for (const Up& up : kUps) {
    SCOPED_TRACE(static_cast<int>(up.axis));
    expect_up(read_up("a.3ds", bytes, up.axis), up);
  }
  // What is not to be overridden is for files that do not say theirs: 3DS is Z up.
  LoadMeshOptions options;
  options.up = UpAxis::y;
  expect_up(read_by_assimp({"a.3ds", bytes, nullptr, options}).mesh, kUps[2]);
}

// X is left-handed, its faces are clockwise seen from outside.
TEST(FileX, UpSaysWhatTheFilesOwnAxisIs) {
  std::string text = "xof 0303txt 0032\nMesh m {\n4;\n";
  char line[64];
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& p = kCorners[i];
    std::snprintf(line, sizeof line, "%g;%g;%g;%s\n", p[0], p[1], p[2], i < 3 ? "," : ";");
    text += line;
  }
  text += "4;\n";
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& t = kOutward[i];  // in a left-handed frame these are clockwise
    std::snprintf(line, sizeof line, "3;%d,%d,%d;%s\n", t[0], t[1], t[2], i < 3 ? "," : ";");
    text += line;
  }
  text += "}\n";
  expect_up(read_up("a.x", text, std::nullopt), kUps[1]);
  for (const Up& up : kUps) {
    SCOPED_TRACE(static_cast<int>(up.axis));
    expect_up(read_up("a.x", text, up.axis), up);
  }
}

#endif

TEST(Smoothing3ds, MasksFollowTheFacesIntoParts) {
  Smoothing3ds mesh;
  mesh.masks = {1, 2, 3, 4, 5};
  mesh.material_names = {"", "red", "lost"};
  mesh.materials = {1, 0, 2, 1, 0};
  using Masks = std::vector<std::vector<std::uint32_t>>;
  const std::vector<Part3ds> apart = {{"DEFAULT", 3}, {"Red", 2}};
  EXPECT_EQ(masks_of_parts(mesh, apart), (Masks{{2, 3, 5}, {1, 4}}));
  const std::vector<Part3ds> joined = {{"Red", 5}};
  EXPECT_EQ(masks_of_parts(mesh, joined), (Masks{{1, 2, 3, 4, 5}}));
  // Numbers of faces that do not fit.
  for (const std::vector<Part3ds>& parts : {std::vector<Part3ds>{{"red", 2}},
                                            {{"red", 2}, {"a", 2}},
                                            {{"red", 2}, {"a", 1}, {"b", 2}},
                                            {{"red", 1}, {"a", 4}},
                                            {}}) {
    EXPECT_EQ(masks_of_parts(mesh, parts), std::nullopt);
  }
}

TEST(Smoothing3ds, DamagedFilesAreReadAsFarAsTheyAreWhole) {
  Object3ds object = prism(1, 2);
  object.faces[3].material = "a";
  const std::string whole = file_3ds({object, prism(4, 8)});
  ASSERT_EQ(read_smoothing_3ds(whole).size(), 2U);
  EXPECT_EQ(read_smoothing_3ds(whole)[1].masks.back(), 8U);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto meshes = read_smoothing_3ds(std::string_view(whole).substr(0, size));
    for (const Smoothing3ds& mesh : meshes) {
      EXPECT_EQ(mesh.masks.size(), mesh.materials.size());
      for (const std::uint32_t m : mesh.materials) EXPECT_LT(m, mesh.material_names.size());
    }
  }
  // A chunk that says that it is smaller than its head, before and between the others.
  for (const char size : {'\0', '\1', '\5'}) {
    const std::string odd = std::string("\x34\x12", 2) + size + std::string(3, '\0');
    const std::string objects = chunk_of(object) + odd + chunk_of(prism(4, 8));
    const auto meshes = read_smoothing_3ds(chunk(0x4D4D, odd + chunk(0x3D3D, odd + objects)));
    ASSERT_EQ(meshes.size(), 2U) << int{size};
    EXPECT_EQ(meshes[0].masks.size(), read_smoothing_3ds(whole)[0].masks.size());
    EXPECT_EQ(meshes[1].masks.back(), 8U);
  }
  // Sizes of chunks that lie, one by one.
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = '\xff';
    read_smoothing_3ds(bytes);
    bytes[at] = '\0';
    read_smoothing_3ds(bytes);
  }
}

}  // namespace
}  // namespace kiln

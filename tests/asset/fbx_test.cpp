// FBX: other people's files with their counts, and scenes made here against FBX's own formulas.
#include "asset/fbx.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "asset/fbx_scene.h"
#include "io/image/image_samples.h"
#include "io/image/picture.h"
#include "kiln/image.h"
#include "kiln/limits.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln {
namespace {

#ifndef KILN_HAS_UFBX

TEST(Fbx, IsBuiltIn) {
  const char* const why = "this build has no ufbx: tools/install-packages fetches it";
  if (std::getenv("CI") != nullptr) FAIL() << why;
  GTEST_SKIP() << why;
}

TEST(Fbx, WithoutUfbxTheRemedyIsNamed) {
  try {
    read_fbx({"a.fbx", "; FBX 7.4.0"});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_NE(std::string(error.what()).find("tools/install-packages"), std::string::npos);
  }
}

#else

using test::FbxRecord;
using test::FbxScene;
namespace fs = std::filesystem;

// ---- FBX's formulas, in double precision, apart from the reader's -------------------------------

/// A matrix of four by four, by rows; it moves columns.
struct Matrix {
  std::array<std::array<double, 4>, 4> row{
      {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
  friend Matrix operator*(const Matrix& a, const Matrix& b) {
    Matrix m;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        m.row[i][j] = 0;
        for (std::size_t k = 0; k < 4; ++k) m.row[i][j] += a.row[i][k] * b.row[k][j];
      }
    }
    return m;
  }
  std::array<double, 3> operator()(const std::array<double, 3>& p) const {
    std::array<double, 3> result{};
    for (std::size_t i = 0; i < 3; ++i) {
      result[i] = row[i][0] * p[0] + row[i][1] * p[1] + row[i][2] * p[2] + row[i][3];
    }
    return result;
  }
};
using Vector = std::array<double, 3>;

Matrix moved(const Vector& by) {
  Matrix m;
  for (std::size_t i = 0; i < 3; ++i) m.row[i][3] = by[i];
  return m;
}
Matrix scaled(const Vector& by) {
  Matrix m;
  for (std::size_t i = 0; i < 3; ++i) m.row[i][i] = by[i];
  return m;
}
Matrix turned(std::size_t axis, double degrees) {
  const double angle = degrees * std::acos(-1.0) / 180;
  const std::size_t i = (axis + 1) % 3, j = (axis + 2) % 3;
  Matrix m;
  m.row[i][i] = m.row[j][j] = std::cos(angle);
  m.row[j][i] = std::sin(angle), m.row[i][j] = -std::sin(angle);
  return m;
}
/// \param order  axes, the first one applied first
Matrix turned(const Vector& degrees, const std::array<std::size_t, 3>& order = {0, 1, 2}) {
  return turned(order[2], degrees[order[2]]) * turned(order[1], degrees[order[1]]) *
         turned(order[0], degrees[order[0]]);
}
Vector minus(const Vector& v) { return {-v[0], -v[1], -v[2]}; }
/// Of a rotation.
Matrix transposed(const Matrix& m) {
  Matrix t;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) t.row[i][j] = m.row[j][i];
  }
  return t;
}
/// Of an affine map, by cofactors.
Matrix inverse(const Matrix& m) {
  Matrix r;
  double determinant = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      r.row[i][j] = m.row[a][c] * m.row[b][d] - m.row[a][d] * m.row[b][c];
      if (i == 0) determinant += m.row[j][0] * r.row[0][j];
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) r.row[i][j] /= determinant;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    r.row[i][3] = 0;
    for (std::size_t j = 0; j < 3; ++j) r.row[i][3] -= r.row[i][j] * m.row[j][3];
  }
  return r;
}

/// A node's properties, and what the FBX SDK makes of them.
struct Node {
  Vector translation{}, rotation{}, scaling{1, 1, 1}, rotation_offset{}, rotation_pivot{},
      pre_rotation{}, post_rotation{}, scaling_offset{}, scaling_pivot{}, geometric_translation{},
      geometric_rotation{}, geometric_scaling{1, 1, 1};
  int order = 0;     // XYZ XZY YZX YXZ ZXY ZYX: the first axis turns first
  int inherit = -1;  // 0: RrSs, 1: RSrs, 2: Rrs; -1: the file does not say, RSrs

  std::vector<FbxRecord> properties() const {
    const auto vector = [](const char* name, const Vector& v) {
      return FbxScene::vector(name, v[0], v[1], v[2]);
    };
    std::vector<FbxRecord> result = {
        vector("Lcl Translation", translation),
        vector("Lcl Rotation", rotation),
        vector("Lcl Scaling", scaling),
        vector("RotationOffset", rotation_offset),
        vector("RotationPivot", rotation_pivot),
        vector("PreRotation", pre_rotation),
        vector("PostRotation", post_rotation),
        vector("ScalingOffset", scaling_offset),
        vector("ScalingPivot", scaling_pivot),
        vector("GeometricTranslation", geometric_translation),
        vector("GeometricRotation", geometric_rotation),
        vector("GeometricScaling", geometric_scaling),
        FbxScene::property("RotationActive", "bool", {1}),
        FbxScene::property("RotationOrder", "enum", {static_cast<double>(order)})};
    if (inherit >= 0) {
      result.push_back(FbxScene::property("InheritType", "enum", {static_cast<double>(inherit)}));
    }
    return result;
  }
  Matrix rotations() const {
    constexpr std::array<std::size_t, 3> kOrders[] = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0},
                                                      {1, 0, 2}, {2, 0, 1}, {2, 1, 0}};
    return turned(pre_rotation) * turned(rotation, kOrders[order]) *
           transposed(turned(post_rotation));
  }
  /// T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1
  Matrix local() const {
    return moved(translation) * moved(rotation_offset) * moved(rotation_pivot) * rotations() *
           moved(minus(rotation_pivot)) * moved(scaling_offset) * moved(scaling_pivot) *
           scaled(scaling) * moved(minus(scaling_pivot));
  }
  Matrix geometric() const {
    return moved(geometric_translation) * turned(geometric_rotation) * scaled(geometric_scaling);
  }
};

/// The scene's objects, each with the corners of its triangles, in order.
std::vector<std::vector<Vector> > corners_of(const Mesh& mesh) {
  std::vector<std::vector<Vector> > result(mesh.object_names.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t corner : mesh.triangles[t]) {
      const Vec3& p = mesh.positions[corner];
      result[mesh.objects[t]].push_back(
          {p.x + mesh.origin[0], p.y + mesh.origin[1], p.z + mesh.origin[2]});
    }
  }
  return result;
}

/// The corners of FbxScene::square() as it is cut.
const std::array<Vector, 6> kSquare{
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}};

void expect_square(const std::vector<Vector>& found, const Matrix& world) {
  ASSERT_EQ(found.size(), 6U);
  // Mirrored ones are turned round: corners are compared as sets.
  std::vector<Vector> wanted, given = found;
  double reach = 1;
  for (const Vector& p : kSquare) wanted.push_back(world(p));
  for (const Vector& p : wanted) {
    for (const double value : p) reach = std::max(reach, std::abs(value));
    const auto is_near = [&](const Vector& q) {
      return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) <= 1e-6 * reach;  // floats
    };
    EXPECT_TRUE(std::any_of(given.begin(), given.end(), is_near))
        << p[0] << " " << p[1] << " " << p[2];
  }
}

/// Values that differ in each place, for node number n.
Node odd_node(int n) {
  const auto odd = [n](double a) { return Vector{a + n, 2 * a - 0.5 * n, 0.75 * a + 0.25 * n}; };
  Node node;
  node.translation = odd(3), node.rotation = odd(20), node.scaling = {1.5, 0.5 + n, 2};
  node.rotation_offset = odd(-1), node.rotation_pivot = odd(0.5), node.pre_rotation = odd(-33);
  node.post_rotation = odd(47), node.scaling_offset = odd(0.3), node.scaling_pivot = odd(-0.7);
  node.geometric_translation = odd(1.25), node.geometric_rotation = odd(-58);
  node.geometric_scaling = {2, 0.75, 1.25};
  return node;
}

TEST(Fbx, NodesStandAsTheFormulaOfTheSdkHasThem) {
  for (int order = 0; order < 6; ++order) {
    SCOPED_TRACE("order " + std::to_string(order));
    std::array<Node, 3> nodes{odd_node(0), odd_node(1), odd_node(2)};
    nodes[1].order = order, nodes[2].order = 5 - order;
    FbxScene scene;
    Matrix parent;
    std::array<Matrix, 3> worlds;
    for (std::int64_t i = 0; i < 3; ++i) {
      const Node& node = nodes[static_cast<std::size_t>(i)];
      scene.model(100 + i, "n" + std::to_string(i), i == 0 ? 0 : 99 + i, node.properties());
      scene.square(10 + i, 100 + i);
      parent = parent * node.local();
      // Geometric transforms move the node's own mesh, and no child.
      worlds[static_cast<std::size_t>(i)] = parent * node.geometric();
    }
    for (const std::string& bytes :
         {scene.text(), scene.binary(7400, true), scene.binary(7500, false)}) {
      const Asset asset = read_fbx({"a.fbx", bytes});
      EXPECT_EQ(asset.mesh.object_names, (std::vector<std::string>{"n0", "n1", "n2"}));
      const auto corners = corners_of(asset.mesh);
      ASSERT_EQ(corners.size(), 3U);
      for (std::size_t i = 0; i < 3; ++i) expect_square(corners[i], worlds[i]);
    }
  }
}

TEST(Fbx, EachPartOfATransformByItself) {
  const Vector v{10, 20, 30};
  const std::array<Vector Node::*, 9> parts{
      &Node::translation,    &Node::rotation,       &Node::pre_rotation,
      &Node::post_rotation,  &Node::rotation_pivot, &Node::rotation_offset,
      &Node::scaling_offset, &Node::scaling_pivot,  &Node::geometric_rotation};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    SCOPED_TRACE(k);
    Node node;
    node.rotation = {0, 0, 40}, node.scaling = {2, 3, 1};
    node.*parts[k] = v;
    FbxScene scene;
    scene.model(100, "n", 0, node.properties());
    scene.square(10, 100);
    const std::string bytes = scene.text();
    expect_square(corners_of(read_fbx({"a.fbx", bytes}).mesh).at(0),
                  node.local() * node.geometric());
  }
}

/// FBX SDK: RrSs scales after both rotations, Rrs leaves the parent's own scale out.
TEST(Fbx, ScalesAreInheritedInThreeWays) {
  for (int inherit = 0; inherit < 3; ++inherit) {
    SCOPED_TRACE(inherit);
    Node up, down;
    up.rotation = {30, 0, 0}, up.scaling = {1, 2, 3}, up.translation = {1, 2, 3};
    down.rotation = {0, 40, 10}, down.scaling = {2, 1, 0.5}, down.translation = {4, 5, 6};
    down.inherit = inherit;
    FbxScene scene;
    scene.model(100, "up", 0, up.properties());
    scene.model(101, "down", 100, down.properties());
    scene.square(10, 101);
    const Matrix turns = up.rotations() * down.rotations();
    Matrix world = inherit == 1   ? up.local() * down.local()
                   : inherit == 0 ? up.rotations() * down.rotations() * scaled(up.scaling) *
                                        scaled(down.scaling)
                                  : turns * scaled(down.scaling);
    const Vector at = up.local()(down.translation);
    for (std::size_t i = 0; i < 3; ++i) world.row[i][3] = at[i];
    const std::string bytes = scene.text();
    const Asset asset = read_fbx({"a.fbx", bytes});
    expect_square(corners_of(asset.mesh).at(0), world);
    // The hierarchy's products are the same places.
    Matrix chain;
    for (std::uint32_t node = asset.object_nodes.at(0); node != AssetNode::kNone;
         node = asset.nodes[node].parent) {
      Matrix own;
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = 0; j < 4; ++j) own.row[i][j] = asset.nodes[node].transform[4 * j + i];
      }
      chain = own * chain;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 4; ++j) EXPECT_NEAR(chain.row[i][j], world.row[i][j], 1e-9);
    }
  }
}

TEST(Fbx, TheCaseOfPivots) {
  KILN_REQUIRE_DATA("cases/fbx_pivots/pivot.fbx");
  const fs::path file = *test::shared_data("cases/fbx_pivots/pivot.fbx");
  const std::string bytes = test::read_file(file);
  const Asset asset = read_fbx({file.string(), bytes});
  ASSERT_EQ(asset.mesh.object_names, (std::vector<std::string>{"parent", "child"}));
  const Vector child = corners_of(asset.mesh).at(1).at(0);
  const Vector wanted{6, 2, 3};
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(child[k], wanted[k], 1e-6);
}

// ---- skins and blend shapes ---------------------------------------------------------------------

std::vector<double> columns(const Matrix& m) {
  std::vector<double> result;
  for (std::size_t j = 0; j < 4; ++j) {
    for (std::size_t i = 0; i < 4; ++i) result.push_back(m.row[i][j]);
  }
  return result;
}

/// A square whose corners hang on two bones; the fourth on none.
struct Skinned {
  Node mesh, root, tip;
  Matrix bind_mesh, bind_root, bind_tip;
  std::array<std::array<double, 2>, 4> weights{{{1, 0}, {0.25, 0.75}, {0, 3}, {0, 0}}};

  FbxScene scene() const {
    FbxScene scene;
    scene.model(100, "skin", 0, mesh.properties());
    scene.square(10, 100);
    scene.model(200, "root", 0, root.properties(), "LimbNode");
    scene.model(201, "tip", 200, tip.properties(), "LimbNode");
    scene.add("Deformer", 300, "Deformer::", "Skin");
    scene.connect(300, 10);
    for (std::int64_t bone = 0; bone < 2; ++bone) {
      std::vector<std::int32_t> indices;
      std::vector<double> values;
      for (std::int32_t v = 0; v < 4; ++v) {
        const double weight = weights[static_cast<std::size_t>(v)][static_cast<std::size_t>(bone)];
        if (weight == 0) continue;
        indices.push_back(v);
        values.push_back(weight);
      }
      FbxRecord& cluster = scene.add("Deformer", 301 + bone, "SubDeformer::", "Cluster");
      cluster.children.push_back({"Indexes", {indices}});
      cluster.children.push_back({"Weights", {values}});
      const Matrix& link = bone == 0 ? bind_root : bind_tip;
      cluster.children.push_back({"Transform", {columns(inverse(link) * bind_mesh)}});
      cluster.children.push_back({"TransformLink", {columns(link)}});
      scene.connect(301 + bone, 300);
      scene.connect(200 + bone, 301 + bone);
      scene.add("NodeAttribute", 400 + bone, "NodeAttribute::", "LimbNode")
          .children.push_back({"TypeFlags", {std::string("Skeleton")}});
      scene.connect(400 + bone, 200 + bone);
    }
    return scene;
  }
};

Skinned bent() {
  Skinned s;
  s.mesh.translation = {50, 60, 70};  // ignored, but for the vertex without weights
  s.mesh.geometric_translation = {0.5, 0, 0};
  s.root.translation = {1, 0, 0}, s.root.rotation = {0, 0, 90};
  s.tip.translation = {0, 2, 0}, s.tip.rotation = {45, 0, 0}, s.tip.scaling = {1, 2, 1};
  s.bind_mesh = moved({0, 0, 1}) * turned({0, 90, 0});
  s.bind_root = moved({1, 0, 0});
  s.bind_tip = moved({1, 1, 0}) * turned({0, 10, 0});
  return s;
}

TEST(Fbx, SkinsStandAsTheirBonesDo) {
  const Skinned s = bent();
  const Matrix root = s.root.local(), tip = root * s.tip.local();
  const std::array<Matrix, 2> maps{root * inverse(s.bind_root) * s.bind_mesh * s.mesh.geometric(),
                                   tip * inverse(s.bind_tip) * s.bind_mesh * s.mesh.geometric()};
  std::array<Vector, 4> wanted{};
  const std::array<Vector, 4> vertices{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
  for (std::size_t v = 0; v < 4; ++v) {
    const double total = s.weights[v][0] + s.weights[v][1];
    if (total == 0) wanted[v] = (s.mesh.local() * s.mesh.geometric())(vertices[v]);
    for (std::size_t b = 0; b < 2 && total != 0; ++b) {
      const Vector p = maps[b](vertices[v]);
      for (std::size_t k = 0; k < 3; ++k) wanted[v][k] += s.weights[v][b] / total * p[k];
    }
  }
  const FbxScene scene = s.scene();
  for (const std::string& bytes : {scene.text(), scene.binary(7400, false)}) {
    std::vector<Warning> warnings;
    const Asset asset = read_fbx({"a.fbx", bytes, &warnings});
    EXPECT_TRUE(warnings.empty()) << warnings.at(0).message.text();
    const auto corners = corners_of(asset.mesh);
    ASSERT_EQ(corners.size(), 1U);
    ASSERT_EQ(corners[0].size(), 6U);
    for (const Vector& p : wanted) {
      EXPECT_TRUE(std::any_of(corners[0].begin(), corners[0].end(),
                              [&](const Vector& q) {
                                return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) < 1e-5;
                              }))
          << p[0] << " " << p[1] << " " << p[2];
    }
  }
}

FbxRecord normals_by_corner(const std::vector<double>& values) {
  return {"LayerElementNormal",
          {std::int64_t{0}},
          {{"MappingInformationType", {std::string("ByPolygonVertex")}},
           {"ReferenceInformationType", {std::string("Direct")}},
           {"Normals", {values}}}};
}

/// Normals turn with the bones, a mirrored bone keeps the outside out.
TEST(Fbx, NormalsOfSkinsTurnWithTheBones) {
  for (const double mirror : {1.0, -1.0}) {
    Skinned s;
    s.weights = {{{1, 0}, {1, 0}, {1, 0}, {1, 0}}};
    s.root.rotation = {0, 90, 0}, s.root.scaling = {mirror, 2, 4};
    FbxScene scene = s.scene();
    for (FbxRecord& object : scene.objects) {
      if (object.name == "Geometry") {
        object.children.push_back(normals_by_corner({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
      }
    }
    const std::string bytes = scene.text();
    const Mesh mesh = read_fbx({"a.fbx", bytes}).mesh;
    const auto corners = corners_of(mesh).at(0);
    for (std::size_t t = 0; t < 2; ++t) {
      const Vector &a = corners[3 * t], &b = corners[3 * t + 1], &c = corners[3 * t + 2];
      const double area = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
      EXPECT_GT(area, 0) << "the winding agrees with the normal, +x";
      for (const std::uint32_t n : mesh.normal_triangles[t])
        EXPECT_NEAR(mesh.normals[n].x, 1, 1e-6);
    }
  }
}

/// Each corner's own normal turns with its own vertex: two hang on one bone, two on another.
TEST(Fbx, NormalsOfSkinsTurnWithTheirOwnVertices) {
  Skinned s;
  s.weights = {{{1, 0}, {1, 0}, {0, 1}, {0, 1}}};
  s.root.rotation = {0, 90, 0};
  s.tip.rotation = {0, 90, 0};
  FbxScene scene = s.scene();
  for (FbxRecord& object : scene.objects) {
    if (object.name == "Geometry") {
      object.children.push_back(normals_by_corner({0, 0, 1, 0, 1, 0, 0, 1, 0, 0, 0, 1}));
    }
  }
  const std::string bytes = scene.text();
  const Mesh mesh = read_fbx({"a.fbx", bytes}).mesh;
  // The root turns (x, y, z) to (z, y, -x), the tip on it to (-x, y, -z). So the square's corners come to (0, 0, 0),
  // (0, 0, -1), (-1, 1, 0) and (0, 1, 0).
  std::array<int, 4> found{};
  for (std::size_t t = 0; t < 2; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.positions[mesh.triangles[t][k]];
      const Vec3 n = mesh.normals[mesh.normal_triangles[t][k]];
      const std::array<double, 3> at{p.x + mesh.origin[0], p.y + mesh.origin[1],
                                     p.z + mesh.origin[2]};
      const bool is_tip = at[1] > 0.5, is_far = std::abs(at[0]) + std::abs(at[2]) > 0.5;
      ++found[(is_tip ? 2 : 0) + (is_far ? 1 : 0)];
      EXPECT_NEAR(n.x, is_far || is_tip ? 0 : 1, 1e-6) << t << ' ' << k;
      EXPECT_NEAR(n.y, is_far ? 1 : 0, 1e-6) << t << ' ' << k;
      EXPECT_NEAR(n.z, is_far || !is_tip ? 0 : -1, 1e-6) << t << ' ' << k;
    }
  }
  for (const int count : found) EXPECT_GE(count, 1);
}

/// Normals follow a shape whatever the face's size, and stay the file's where a shape leaves a face no area.
TEST(Fbx, NormalsFollowBlendShapesOfAnySize) {
  for (const double size : {0.25, 1.0, 5.0}) {
    for (const bool is_flat : {false, true}) {
      SCOPED_TRACE(size);
      FbxScene scene;
      scene.model(100, "n", 0);
      // Another square stands 10 beside it, out of the shape's reach.
      const double far = size + 10;
      FbxRecord& square = scene.mesh(10, {0,  0, 0, size, 0, 0, size, size, 0, 0,  size, 0,
                                          10, 0, 0, far,  0, 0, far,  size, 0, 10, size, 0},
                                     {0, 1, 2, -4, 4, 5, 6, -8});
      square.children.push_back(normals_by_corner(
          {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
      scene.connect(10, 100);
      FbxRecord& shape = scene.add("Geometry", 20, "Geometry::up", "Shape");
      shape.children.push_back({"Indexes", {std::vector<std::int32_t>{1, 2}}});
      // Up to 45 degrees, or onto the other side of the square.
      shape.children.push_back({"Vertices",
                                {is_flat ? std::vector<double>{-size, 0, 0, -size, 0, 0}
                                         : std::vector<double>{0, 0, size, 0, 0, size}}});
      scene.add("Deformer", 30, "Deformer::", "BlendShape");
      FbxRecord& channel = scene.add("Deformer", 31, "SubDeformer::up", "BlendShapeChannel",
                                     {FbxScene::property("DeformPercent", "Number", {100.0})});
      channel.children.push_back({"FullWeights", {std::vector<double>{100}}});
      scene.connect(30, 10);
      scene.connect(31, 30);
      scene.connect(20, 31);
      const std::string bytes = scene.text();
      const Mesh mesh = read_fbx({"a.fbx", bytes}).mesh;
      ASSERT_EQ(mesh.triangles.size(), 4U);
      for (std::size_t i = 0; i < 4; ++i) {
        const double wanted = is_flat || i >= 2 ? 0 : std::sqrt(0.5);
        for (const std::uint32_t n : mesh.normal_triangles[i]) {
          EXPECT_NEAR(mesh.normals[n].x, -wanted, 1e-6) << is_flat << ' ' << i;
          EXPECT_NEAR(mesh.normals[n].z, wanted == 0 ? 1 : wanted, 1e-6) << is_flat << ' ' << i;
        }
      }
    }
  }
}

TEST(Fbx, BlendShapesCountByTheirPercentage) {
  // The second half of the square is lifted, up to 45 degrees.
  for (const double percent : {0.0, 50.0, 100.0, -25.0}) {
    SCOPED_TRACE(percent);
    FbxScene scene;
    scene.model(100, "n", 0);
    FbxRecord& square = scene.mesh(10, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, -4});
    square.children.push_back(normals_by_corner({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
    scene.connect(10, 100);
    FbxRecord& shape = scene.add("Geometry", 20, "Geometry::up", "Shape");
    shape.children.push_back({"Indexes", {std::vector<std::int32_t>{1, 2}}});
    shape.children.push_back({"Vertices", {std::vector<double>{0, 0, 1, 0, 0, 1}}});
    scene.add("Deformer", 30, "Deformer::", "BlendShape");
    FbxRecord& channel = scene.add("Deformer", 31, "SubDeformer::up", "BlendShapeChannel",
                                   {FbxScene::property("DeformPercent", "Number", {percent})});
    channel.children.push_back({"FullWeights", {std::vector<double>{100}}});
    scene.connect(30, 10);
    scene.connect(31, 30);
    scene.connect(20, 31);
    const std::string bytes = scene.text();
    const Mesh mesh = read_fbx({"a.fbx", bytes}).mesh;
    // A lone shape at 100 stands for all weights above 0; below 0 it fades out as it fades in.
    const double height = percent / 100, length = std::hypot(1.0, height);
    for (std::size_t t = 0; t < 2; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 p = mesh.positions[mesh.triangles[t][k]];
        EXPECT_NEAR(p.z + mesh.origin[2], height * (p.x + mesh.origin[0]), 1e-6);
        const Vec3 n = mesh.normals[mesh.normal_triangles[t][k]];
        EXPECT_NEAR(n.x, -height / length, 1e-6) << "normals follow";
        EXPECT_NEAR(n.z, 1 / length, 1e-6);
      }
    }
  }
}

// ---- smoothing ----------------------------------------------------------------------------------

/// Three faces of a cube about the vertex at the origin: in the planes z = 0, y = 0 and x = 0, turned outwards.
FbxRecord& corner_of_cube(FbxScene& scene) {
  scene.model(100, "n", 0);
  scene.connect(10, 100);
  return scene.mesh(10, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1},
                    {0, 2, 4, -2, 0, 1, 5, -4, 0, 3, 6, -3});
}

FbxRecord smoothing(const char* mapping, const std::vector<std::int32_t>& values) {
  return {"LayerElementSmoothing",
          {std::int64_t{0}},
          {{"Version", {std::int64_t{102}}},
           {"Name", {std::string("a: {")}},
           {"MappingInformationType", {std::string(mapping)}},
           {"ReferenceInformationType", {std::string("Direct")}},
           {"Smoothing", {values}}}};
}

/// The normals of the three faces at the origin.
std::array<Vec3, 3> normals_at_origin(const Mesh& mesh) {
  std::array<Vec3, 3> result{};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.positions[mesh.triangles[t][k]];
      const Vector at{p.x + mesh.origin[0], p.y + mesh.origin[1], p.z + mesh.origin[2]};
      if (at != Vector{0, 0, 0} || mesh.normals.empty()) continue;
      result.at(mesh.polygons[t]) = mesh.normals[mesh.normal_triangles[t][k]];
    }
  }
  return result;
}

void expect_normal(const Vec3& found, const Vector& wanted) {
  const double length = std::hypot(wanted[0], wanted[1], wanted[2]);
  EXPECT_NEAR(found.x, wanted[0] / length, 1e-6);
  EXPECT_NEAR(found.y, wanted[1] / length, 1e-6);
  EXPECT_NEAR(found.z, wanted[2] / length, 1e-6);
}

TEST(Fbx, SmoothingGroupsGiveNormals) {
  constexpr Vector kDown{0, 0, -1}, kFront{0, -1, 0}, kLeft{-1, 0, 0};
  constexpr Vector kDownFront{0, -1, -1}, kAll{-1, -1, -1}, kFrontLeft{-1, -1, 0};
  struct Case {
    std::vector<std::int32_t> masks;
    std::array<Vector, 3> normals;
  };
  const Case cases[] = {{{1, 1, 1}, {kAll, kAll, kAll}},
                        {{1, 1, 2}, {kDownFront, kDownFront, kLeft}},
                        {{1, 2, 4}, {kDown, kFront, kLeft}},
                        {{0, 0, 0}, {kDown, kFront, kLeft}},
                        {{0, 6, 4}, {kDown, kFrontLeft, kFrontLeft}},
                        {{1, 3, 2}, {kAll, kAll, kAll}},
                        {{std::int32_t{1} << 30, -1, 0}, {kDownFront, kDownFront, kLeft}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(std::to_string(c.masks[0]) + " " + std::to_string(c.masks[1]) + " " +
                 std::to_string(c.masks[2]));
    FbxScene scene;
    // A geometry before it with masks of its own, and one without.
    scene.mesh(8, {0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 1, -3})
        .children.push_back(smoothing("ByPolygon", {7}));
    scene.mesh(9, {0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 1, -3});
    FbxRecord& cube = corner_of_cube(scene);
    cube.children.push_back(
        smoothing("ByEdge", {1, 1, 1}));  // of edges that the file does not list
    cube.children.push_back(smoothing("ByPolygon", c.masks));
    for (const std::string& bytes : {scene.text(), scene.binary(7400, true),
                                     scene.binary(7400, false), scene.binary(7500, true)}) {
      std::vector<Warning> warnings;
      const auto found = normals_at_origin(read_fbx({"a.fbx", bytes, &warnings}).mesh);
      for (std::size_t f = 0; f < 3; ++f) expect_normal(found[f], c.normals[f]);
      EXPECT_TRUE(warnings.empty()) << warnings.at(0).message.text();
    }
  }
}

TEST(Fbx, SmoothEdgesGiveNormals) {
  // Edges as FBX lists them: by the corner at which they begin.
  struct Case {
    std::vector<std::int32_t> smooth;  // of the edges 0-2, 0-1, 0-3
    std::array<Vector, 3> normals;
  };
  const Case cases[] = {{{1, 1, 1}, {{{-1, -1, -1}, {-1, -1, -1}, {-1, -1, -1}}}},
                        {{0, 1, 0}, {{{0, -1, -1}, {0, -1, -1}, {-1, 0, 0}}}},
                        {{1, 0, 0}, {{{-1, 0, -1}, {0, -1, 0}, {-1, 0, -1}}}},
                        {{0, 0, 0}, {{{0, 0, -1}, {0, -1, 0}, {-1, 0, 0}}}}};
  for (const Case& c : cases) {
    FbxScene scene;
    FbxRecord& mesh = corner_of_cube(scene);
    mesh.children.push_back({"Edges", {std::vector<std::int32_t>{0, 3, 7}}});
    mesh.children.push_back(smoothing("ByEdge", c.smooth));
    const std::string bytes = scene.text();
    const auto found = normals_at_origin(read_fbx({"a.fbx", bytes}).mesh);
    for (std::size_t f = 0; f < 3; ++f) expect_normal(found[f], c.normals[f]);
  }
}

/// Normals of the file stand, whatever its groups say; a mesh that says nothing leaves them to the bake.
TEST(Fbx, SmoothingGroupsGiveWayToNormals) {
  FbxScene scene;
  FbxRecord& mesh = corner_of_cube(scene);
  std::vector<double> up;
  for (int i = 0; i < 12; ++i) up.insert(up.end(), {0, 0, 1});
  mesh.children.push_back(normals_by_corner(up));
  mesh.children.push_back(smoothing("ByPolygon", {1, 2, 4}));
  const std::string bytes = scene.text();
  for (const Vec3& n : normals_at_origin(read_fbx({"a.fbx", bytes}).mesh))
    expect_normal(n, {0, 0, 1});
  FbxScene bare;
  corner_of_cube(bare);
  const std::string without = bare.text();
  EXPECT_TRUE(read_fbx({"a.fbx", without}).mesh.normals.empty());
}

// ---- other attributes ---------------------------------------------------------------------------

TEST(Fbx, InstancesMirroredOnesFaceTheSameWay) {
  FbxScene scene;
  FbxRecord& square = scene.mesh(10, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, -4});
  square.children.push_back(normals_by_corner({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
  square.children.push_back({"LayerElementUV",
                             {std::int64_t{0}},
                             {{"Name", {std::string("map")}},
                              {"MappingInformationType", {std::string("ByPolygonVertex")}},
                              {"ReferenceInformationType", {std::string("IndexToDirect")}},
                              {"UV", {std::vector<double>{0, 0, 0.25, 0, 0.25, 0.5, 0, 0.5}}},
                              {"UVIndex", {std::vector<std::int32_t>{0, 1, 2, 3}}}}});
  scene.model(100, "part", 0);
  scene.model(
      101, "part", 0,
      {FbxScene::vector("Lcl Translation", 10, 0, 0), FbxScene::vector("Lcl Scaling", -1, 1, 1)});
  scene.connect(10, 100);
  scene.connect(10, 101);
  const std::string bytes = scene.text();
  const Asset asset = read_fbx({"a.fbx", bytes});
  const Mesh& mesh = asset.mesh;
  EXPECT_EQ(mesh.object_names, (std::vector<std::string>{"part", "part.001"}));
  ASSERT_EQ(mesh.positions.size(), 8U);
  EXPECT_EQ(mesh.uvs.size(), 4U) << "instances share their UVs";
  for (std::size_t t = 0; t < 4; ++t) {
    const auto corner = [&](std::size_t k) { return mesh.positions[mesh.triangles[t][k]]; };
    const double area = (corner(1).x - corner(0).x) * (corner(2).y - corner(0).y) -
                        (corner(2).x - corner(0).x) * (corner(1).y - corner(0).y);
    EXPECT_NEAR(area, 1, 1e-6) << "the winding agrees with the normal, +z";
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = corner(k).x + mesh.origin[0], y = corner(k).y + mesh.origin[1];
      const Vec2 uv = mesh.uvs[mesh.uv_triangles[t][k]];
      EXPECT_NEAR(uv.x, (t < 2 ? x : 10 - x) / 4, 1e-6);
      EXPECT_NEAR(uv.y, y / 2, 1e-6);
      EXPECT_EQ(mesh.normals[mesh.normal_triangles[t][k]].z, 1);
    }
  }
}

/// Triangles by the numbers of their corners in the polygon, each beginning with the least; in order.
std::vector<Triangle> cuts(const Mesh& mesh, std::uint32_t first, bool turned_back) {
  std::vector<Triangle> result;
  for (const Triangle& t : mesh.triangles) {
    Triangle corners{t[0] - first, t[1] - first, t[2] - first};
    if (turned_back) std::swap(corners[1], corners[2]);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.push_back(corners);
  }
  std::sort(result.begin(), result.end());
  return result;
}

// Blender and the manual cut polygons as their mesh has them, whatever a node does: a fold that is a ridge in the one is no
// valley in its mirror image.
TEST(Fbx, MirroredPolygonsAreCutAsTheOthers) {
  std::vector<double> bent_quad = {0, 0, 0, 2, 0, 0.5, 2.25, 1, 0, 0, 1, 0.5}, heptagon, arrow;
  for (int i = 0; i < 7; ++i) {
    const double angle = 0.9 * i + 0.05 * i * i / 7, away = 1 + 0.1 * (i % 3);
    heptagon.insert(heptagon.end(), {away * std::cos(angle), away * std::sin(angle), 0.02 * i});
  }
  arrow = {0, 0, 0, 3, -1, 0, 1, 0.25, 0, 2.5, 2, 0, 0.25, 1.5, 0};
  const std::vector<double> triangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (const std::vector<double>& shape : {triangle, bent_quad, heptagon, arrow}) {
    const std::size_t count = shape.size() / 3;
    for (const Triangulation rule : {Triangulation::automatic, Triangulation::blender,
                                     Triangulation::fan, Triangulation::shortest}) {
      for (const auto& scale : {std::array<double, 3>{-1, 1, 1}, {2, -2, 2}, {1, 1, -1}}) {
        FbxScene scene;
        std::vector<std::int32_t> corners;
        for (std::size_t i = 0; i < count; ++i) corners.push_back(static_cast<std::int32_t>(i));
        corners.back() = -corners.back() - 1;
        scene.mesh(10, shape, corners);
        scene.model(100, "plain", 0);
        scene.model(101, "mirrored", 0,
                    {FbxScene::vector("Lcl Scaling", scale[0], scale[1], scale[2])});
        scene.connect(10, 100);
        scene.connect(10, 101);
        LoadMeshOptions options;
        options.triangulation = rule;
        const std::string bytes = scene.text();
        const Mesh mesh = read_fbx({"a.fbx", bytes, nullptr, options}).mesh;
        ASSERT_EQ(mesh.positions.size(), 2 * count);
        ASSERT_EQ(mesh.triangles.size(), 2 * (count - 2));
        const auto half = static_cast<std::ptrdiff_t>(count - 2);
        Mesh plain, mirrored;
        plain.triangles.assign(mesh.triangles.begin(), mesh.triangles.begin() + half);
        mirrored.triangles.assign(mesh.triangles.begin() + half, mesh.triangles.end());
        EXPECT_EQ(cuts(plain, 0, false), cuts(mirrored, static_cast<std::uint32_t>(count), true))
            << count << " corners, rule " << static_cast<int>(rule) << ", scale " << scale[0] << ' '
            << scale[1] << ' ' << scale[2];
      }
    }
  }
}

/// A layer of UVs, one for each corner.
FbxRecord uv_layer(std::int64_t index, const std::string& name, const std::vector<double>& uvs) {
  return {"LayerElementUV",
          {index},
          {{"Name", {name}},
           {"MappingInformationType", {std::string("ByPolygonVertex")}},
           {"ReferenceInformationType", {std::string("Direct")}},
           {"UV", {uvs}}}};
}

/// Which UVs of `mesh` a picture lies on, at a corner of a triangle.
Vec2 uv_of_picture(const Mesh& mesh, const MaterialPicture& picture, std::size_t t,
                   std::size_t corner) {
  const std::uint32_t uv = mesh.uv_triangles[t][corner];
  if (picture.uv_set == mesh.uv_set) return mesh.uvs[uv];
  for (const UvSet& set : mesh.other_uvs) {
    if (set.set == picture.uv_set) return set.uvs.at(uv);
  }
  ADD_FAILURE() << "no set " << picture.uv_set;
  return {};
}

// FBX names the set of a picture; of two meshes of one material each may have it at another number.
TEST(Fbx, PicturesLieOnTheSetTheyName) {
  const std::vector<double> one = {0, 0, 1, 0, 1, 1, 0, 1}, two = {0, 0, 0, 0.5, 0.5, 0.5, 0.5, 0},
                            three = {0.25, 0, 0.25, 0, 0.25, 0, 0.25, 0};
  const fs::path folder = test::scratch_folder();
  save_image({1, 1, 3, {1, 0, 0}}, folder / "p.png", {.format = ImageFormat::png8});
  FbxScene scene;
  for (std::int64_t m = 0; m < 3; ++m) {
    FbxRecord& mesh = scene.mesh(10 + m, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, -4});
    // The first has "base" and "Tex", the second the same the other way round, the third "base" alone.
    mesh.children.push_back(uv_layer(0, m == 1 ? "Tex" : "base", m == 1 ? two : one));
    if (m < 2) mesh.children.push_back(uv_layer(1, m == 1 ? "base" : "Tex", m == 1 ? one : two));
    if (m == 0) mesh.children.push_back(uv_layer(2, "third", three));
    scene.model(100 + m, "n" + std::to_string(m), 0);
    scene.connect(10 + m, 100 + m);
    scene.connect(50, 100 + m);
  }
  scene.add("Material", 50, "Material::skin", "");
  const std::pair<const char*, const char*> slots[] = {
      {"DiffuseColor", "Tex"}, {"NormalMap", ""}, {"EmissiveColor", "third"}};
  for (std::int64_t i = 0; i < 3; ++i) {
    FbxRecord& texture = scene.add("Texture", 60 + i, "Texture::t", "",
                                   {{"P",
                                     {std::string("UVSet"), std::string("KString"), std::string(),
                                      std::string(), std::string(slots[i].second)}}});
    texture.children.push_back({"FileName", {std::string("p.png")}});
    texture.children.push_back({"RelativeFilename", {std::string("p.png")}});
    scene.connections.push_back(
        {"C", {std::string("OP"), 60 + i, std::int64_t{50}, std::string(slots[i].first)}});
  }
  const std::string bytes = scene.text();
  const std::string file = (folder / "a.fbx").string();
  for (const std::uint32_t read : {0U, 1U}) {
    SCOPED_TRACE(read);
    LoadMeshOptions options;
    options.uv_set = read;
    const Asset asset = read_fbx({file, bytes, nullptr, options});
    const Mesh& mesh = asset.mesh;
    EXPECT_EQ(mesh.uv_set, read);
    ASSERT_EQ(asset.materials.size(), 1U);
    const Material& skin = asset.materials[0];
    ASSERT_FALSE(skin.color_map.empty() || skin.normal_map.empty() || skin.emission_map.empty());
    for (std::size_t t = 0; t < 6; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = mesh.positions[mesh.triangles[t][k]];
        const auto x = static_cast<float>(p.x + mesh.origin[0]),
                   y = static_cast<float>(p.y + mesh.origin[1]);
        const Vec2 base{x, y}, tex{y / 2, x / 2};
        const std::size_t m = t / 2;
        EXPECT_EQ(uv_of_picture(mesh, skin.color_map, t, k), m == 2 ? base : tex) << "mesh " << m;
        // Without a name it is the first set.
        EXPECT_EQ(uv_of_picture(mesh, skin.normal_map, t, k), m == 1 ? tex : base);
        EXPECT_EQ(uv_of_picture(mesh, skin.emission_map, t, k), m == 0   ? (Vec2{0.25F, 0})
                                                                : m == 1 ? tex
                                                                         : base);
        if (m == 2 && read == 1) continue;  // it has none at this number
        EXPECT_EQ(mesh.uvs[mesh.uv_triangles[t][k]], (m == 1) == (read == 1) ? base : tex);
      }
    }
    // The materials alone, as a bake reads them.
    std::ofstream(file, std::ios::binary) << bytes;
    const std::vector<Material> alone = load_materials(mesh, file);
    ASSERT_EQ(alone.size(), 1U);
    EXPECT_EQ(alone[0].color_map.uv_set, skin.color_map.uv_set);
    EXPECT_EQ(alone[0].emission_map.uv_set, skin.emission_map.uv_set);
    const Texture texture = load_material_texture(alone, MaterialSlot::color, mesh);
    EXPECT_EQ(texture.uv_sets, std::vector<std::uint32_t>{skin.color_map.uv_set});
  }
}

TEST(Fbx, PicturesOnTheSetThatIsReadNeedNoOther) {
  FbxScene scene;
  FbxRecord& mesh = scene.mesh(10, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, -4});
  mesh.children.push_back(uv_layer(0, "base", {0, 0, 1, 0, 1, 1, 0, 1}));
  mesh.children.push_back(uv_layer(1, "Tex", {0, 0, 0, 1, 1, 1, 1, 0}));
  scene.model(100, "n", 0);
  scene.connect(10, 100);
  const std::string bytes = scene.text();
  EXPECT_TRUE(read_fbx({"a.fbx", bytes}).mesh.other_uvs.empty());
}

TEST(Fbx, ColorsAndMaterialsOfFaces) {
  FbxScene scene;
  FbxRecord& mesh = scene.mesh(10, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, -3, 0, 2, -4});
  mesh.children.push_back({"LayerElementColor",
                           {std::int64_t{0}},
                           {{"MappingInformationType", {std::string("ByPolygonVertex")}},
                            {"ReferenceInformationType", {std::string("IndexToDirect")}},
                            {"Colors", {std::vector<double>{1, 0, 0, 1, 0, 0.5, 0, 0.25}}},
                            {"ColorIndex", {std::vector<std::int32_t>{0, 0, 0, 1, 1, 1}}}}});
  mesh.children.push_back({"LayerElementMaterial",
                           {std::int64_t{0}},
                           {{"MappingInformationType", {std::string("ByPolygon")}},
                            {"ReferenceInformationType", {std::string("IndexToDirect")}},
                            {"Materials", {std::vector<std::int32_t>{1, 0}}}}});
  scene.model(100, "n", 0);
  scene.connect(10, 100);
  for (std::int64_t i = 0; i < 2; ++i) {
    FbxRecord& material = scene.add(
        "Material", 50 + i, i == 0 ? "Material::red" : "Material::blue", "",
        {FbxScene::property("DiffuseColor", "Color", {i == 0 ? 1.0 : 0.0, 0, i == 0 ? 0.0 : 1.0}),
         FbxScene::property("DiffuseFactor", "Number", {0.5}),
         FbxScene::property("Shininess", "Number", {25}),
         FbxScene::property("Opacity", "Number", {0.75})});
    material.children.push_back({"ShadingModel", {std::string("phong")}});
    scene.connect(50 + i, 100);
  }
  const std::string bytes = scene.text();
  const Asset asset = read_fbx({"a.fbx", bytes});
  const Mesh& read = asset.mesh;
  EXPECT_EQ(read.material_names, (std::vector<std::string>{"blue", "red"}));
  EXPECT_EQ(read.materials, (std::vector<std::uint32_t>{0, 1}));
  ASSERT_EQ(read.positions.size(), 6U) << "two vertices have two colours";
  EXPECT_EQ(read.colors[read.triangles[0][0]], (std::array<std::uint8_t, 4>{255, 0, 0, 255}));
  EXPECT_EQ(read.colors[read.triangles[1][0]], (std::array<std::uint8_t, 4>{0, 128, 0, 64}));
  const Material& blue = asset.materials.at(0);
  EXPECT_EQ(blue.color, (std::array<float, 3>{0, 0, 0.5F}));
  EXPECT_FLOAT_EQ(blue.roughness, 0.5F) << "1 - sqrt(25) / 10";
  EXPECT_EQ(blue.roughness_from, MaterialNumber::converted);
  EXPECT_FLOAT_EQ(blue.opacity, 0.75F);
}

TEST(Fbx, WhatIsLeftOutIsTold) {
  const auto codes = [](const FbxScene& scene) {
    std::vector<Warning> warnings;
    const std::string bytes = scene.text();
    read_fbx({"a.fbx", bytes, &warnings});
    std::vector<std::string> result;
    for (const Warning& warning : warnings) result.push_back(warning.code);
    return result;
  };
  FbxScene hidden;
  hidden.model(100, "n", 0, {FbxScene::property("Visibility", "double", {0})});
  hidden.square(10, 100);
  EXPECT_EQ(codes(hidden), (std::vector<std::string>{"hidden-meshes"}));
  FbxScene levels;
  levels.model(100, "lods", 0, {}, "LodGroup");
  levels.add("NodeAttribute", 90, "NodeAttribute::", "LodGroup");
  levels.connect(90, 100);
  levels.model(101, "lod0", 100);
  levels.square(10, 101);
  EXPECT_EQ(codes(levels), (std::vector<std::string>{"levels-of-detail"}));
  FbxScene smooth;
  smooth.model(100, "n", 0);
  smooth.square(10, 100);
  for (FbxRecord& object : smooth.objects) {
    if (object.name != "Geometry") continue;
    object.children.push_back({"Smoothness", {std::int64_t{2}}});
    object.children.push_back({"PreviewDivisionLevels", {std::int64_t{2}}});
    object.children.push_back({"RenderDivisionLevels", {std::int64_t{2}}});
  }
  EXPECT_EQ(codes(smooth), (std::vector<std::string>{"subdivision"}));
}

/// A corner of a vertex that is not there is an error; one without a UV has none.
TEST(Fbx, IndicesOutOfRange) {
  FbxScene scene;
  scene.model(100, "n", 0);
  scene.mesh(10, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 9, -4});
  scene.connect(10, 100);
  const std::string bytes = scene.text();
  try {
    read_fbx({"a.fbx", bytes});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("refers to a vertex that does not exist"),
              std::string::npos)
        << error.what();
  }
  FbxScene bare;
  bare.model(100, "n", 0);
  bare.square(10, 100);
  for (FbxRecord& object : bare.objects) {
    if (object.name != "Geometry") continue;
    object.children.push_back({"LayerElementUV",
                               {std::int64_t{0}},
                               {{"MappingInformationType", {std::string("ByPolygonVertex")}},
                                {"ReferenceInformationType", {std::string("IndexToDirect")}},
                                {"UV", {std::vector<double>{0, 0, 1, 0, 1, 1}}},
                                {"UVIndex", {std::vector<std::int32_t>{0, 1, 2, -1}}}}});
  }
  const std::string text = bare.text();
  std::vector<Warning> warnings;
  read_fbx({"a.fbx", text, &warnings});
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "missing-uvs");
}

/// Text that is not UTF-8 harms no mesh, so that it is no news.
TEST(Fbx, WhatTheReaderRepairsIsCounted) {
  const auto read = [](int materials, const std::string& name) {
    FbxScene scene;
    scene.model(100, name, 0);
    scene.square(10, 100);
    // Ids are to be unique.
    for (int i = 0; i < materials; ++i) scene.add("Material", 50, "Material::skin", "");
    scene.connect(50, 100);
    const std::string bytes = scene.text();
    std::vector<Warning> warnings;
    EXPECT_EQ(read_fbx({"a.fbx", bytes, &warnings}).mesh.triangles.size(), 2U);
    std::uint64_t count = 0;
    for (const Warning& warning : warnings) {
      if (warning.code != "damaged-file") continue;
      EXPECT_NE(warning.message.text().find("does not conform to FBX"), std::string::npos);
      count += warning.count;
    }
    return count;
  };
  EXPECT_EQ(read(1, "n"), 0U);
  EXPECT_EQ(read(2, "n"), 1U);
  EXPECT_EQ(read(4, "n"), 3U);
  EXPECT_EQ(read(1, "n\xff"), 0U);
}

/// One mesh, placed by ever more nodes, is more than memory can hold: refused before it is taken.
TEST(Fbx, InstancesAreCountedBeforeMemoryIsTaken) {
  FbxScene scene;
  std::vector<double> vertices;
  std::vector<std::int32_t> corners;
  for (std::int32_t i = 0; i < 30000; ++i) {
    vertices.insert(vertices.end(), {1.0 * i, 0, 0, 1.0 * i, 1, 0, i + 1.0, 0, 0});
    corners.insert(corners.end(), {3 * i, 3 * i + 1, -(3 * i + 2) - 1});
  }
  scene.mesh(10, vertices, corners);
  for (std::int64_t i = 0; i < 500; ++i) {
    scene.model(100 + i, "n", 0);
    scene.connect(10, 100 + i);
  }
  const std::string bytes = scene.binary(7400, true);
  set_memory_limit(memory_limit() - memory_left() + (std::uint64_t{1} << 30));
  try {
    read_fbx({"a.fbx", bytes});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("counted once per instance"), std::string::npos)
        << error.what();
  }
  set_memory_limit(0);
}

/// What an instance of a mesh takes depends on what its corners hold.
TEST(Fbx, MemoryOfInstancesIsThatOfTheirCorners) {
  constexpr std::uint64_t kFaces = 4000, kInstances = 2000;
  const auto needed_mebibytes = [&](std::size_t sides, bool normals, bool colors) {
    FbxScene scene;
    std::vector<std::int32_t> corners;
    for (std::uint64_t i = 0; i < kFaces; ++i) {
      for (std::size_t k = 0; k < sides; ++k) {
        const auto corner = static_cast<std::int32_t>(k);
        corners.push_back(k + 1 == sides ? -corner - 1 : corner);
      }
    }
    FbxRecord& mesh = scene.mesh(10, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, corners);
    if (normals) {
      mesh.children.push_back(normals_by_corner(std::vector<double>(3 * corners.size(), 0.5)));
    }
    if (colors) {
      mesh.children.push_back({"LayerElementColor",
                               {std::int64_t{0}},
                               {{"MappingInformationType", {std::string("ByPolygonVertex")}},
                                {"ReferenceInformationType", {std::string("Direct")}},
                                {"Colors", {std::vector<double>(4 * corners.size(), 0.5)}}}});
    }
    for (std::uint64_t i = 0; i < kInstances; ++i) {
      const auto id = static_cast<std::int64_t>(100 + i);
      scene.model(id, "n", 0);
      scene.connect(10, id);
    }
    const std::string bytes = scene.binary(7400, true);
    set_memory_limit(memory_limit() - memory_left() + (std::uint64_t{1} << 28));
    std::string text;
    try {
      read_fbx({"a.fbx", bytes});
    } catch (const Error& error) {
      text = error.what();
    }
    set_memory_limit(0);
    const std::size_t at = text.find("would take ");
    EXPECT_NE(at, std::string::npos) << text;
    return at == std::string::npos ? 0 : std::stod(text.substr(at + 11));
  };
  const auto expected = [&](std::uint64_t sides, std::uint64_t bytes) {
    return static_cast<double>(kFaces * kInstances * sides * bytes) / (1 << 20);
  };
  EXPECT_NEAR(needed_mebibytes(3, false, false), expected(3, 20), 1);
  EXPECT_NEAR(needed_mebibytes(4, false, false), expected(4, 44), 1);
  EXPECT_NEAR(needed_mebibytes(3, true, false), expected(3, 44), 1);
  EXPECT_NEAR(needed_mebibytes(3, false, true), expected(3, 62), 1);
  EXPECT_NEAR(needed_mebibytes(4, true, true), expected(4, 110), 1);
}

// ---- other people's files -----------------------------------------------------------------------

// The counts are those that Blender 5.0 reads (bpy, wm.fbx_import without animations), and so are the boxes, turned to Y up.
TEST(Fbx, FilesOfOthers) {
  struct Expected {
    const char* file;
    std::size_t triangles, polygons, objects, materials;
    std::array<double, 6> box;  // low and high, metres
  };
  constexpr Expected kFiles[] = {
      {"animation_with_skeleton.fbx",
       2112,
       1056,
       1,
       1,
       {-36.42, -2.0008, -0.91666, 34.791, 4.385, 0.91671}},
      {"box.fbx", 12, 12, 1, 1, {-0.2261, -0.16186, -0.064646, 0.28446, 0.24435, 0.46466}},
      {"boxWithCompressedCTypeArray.FBX",
       12,
       6,
       1,
       1,
       {-0.005, -0.005, -0.005, 0.005, 0.005, 0.005}},
      {"boxWithUncompressedCTypeArray.FBX",
       12,
       6,
       1,
       1,
       {-0.005, -0.005, -0.005, 0.005, 0.005, 0.005}},
      {"box_orphant_embedded_texture.fbx", 12, 6, 1, 1, {-0.5, 0, -0.5, 0.5, 1, 0.5}},
      {"close_to_identity_transforms.fbx",
       420,
       210,
       4,
       2,
       {-0.082137, -0.061239, -0.060438, 0.14362, 0.15981, 0.16537}},
      {"cubes_nonames.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.059983, 0.26727}},
      {"cubes_with_mirroring_and_pivot.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.15981, 0.26727}},
      {"cubes_with_names.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.059983, 0.26727}},
      {"cubes_with_outofrange_float.fbx",
       420,
       210,
       4,
       2,
       {-0.060671, -0.14515, -0.060438, 0.14866, 0.059983, 0.26727}},
      {"embedded_ascii/box.FBX", 12, 6, 1, 1, {-0.59989, 0, -0.6, 0.60011, 1.2, 0.6}},
      {"global_settings.fbx", 1352, 848, 2, 2, {-20.349, -21.949, -19.447, 36.717, 35.116, 37.618}},
      {"maxPbrMaterial_metalRough.fbx", 12, 6, 1, 1, {-8.3407, 0, -11.653, 9.482, 16.788, 10.311}},
      {"maxPbrMaterial_specGloss.fbx", 12, 6, 1, 1, {-8.3407, 0, -11.653, 9.482, 16.788, 10.311}},
      {"phong_cube.fbx", 12, 6, 1, 1, {-0.005, -0.005, -0.005, 0.005, 0.005, 0.005}}};
  KILN_REQUIRE_DATA("assets/FBX/box.fbx");
  const fs::path folder = test::shared_data("assets/FBX/box.fbx")->parent_path();
  for (const Expected& expected : kFiles) {
    SCOPED_TRACE(expected.file);
    const std::string bytes = test::read_file(folder / expected.file);
    const Asset asset = read_fbx({(folder / expected.file).string(), bytes});
    const Mesh& mesh = asset.mesh;
    EXPECT_EQ(mesh.triangles.size(), expected.triangles);
    EXPECT_EQ(mesh.polygons.empty() ? mesh.triangles.size() : mesh.polygons.back() + 1,
              expected.polygons);
    EXPECT_EQ(mesh.object_names.size(), expected.objects);
    EXPECT_EQ(asset.object_nodes.size(), expected.objects);
    EXPECT_EQ(asset.materials.size(), expected.materials);
    EXPECT_EQ(asset.mesh.metres, 1);
    std::array<double, 6> box{HUGE_VAL, HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (const Vec3& p : mesh.positions) {
      const std::array<double, 3> at{p.x + mesh.origin[0], p.y + mesh.origin[1],
                                     p.z + mesh.origin[2]};
      for (std::size_t k = 0; k < 3; ++k) {
        box[k] = std::min(box[k], at[k]);
        box[3 + k] = std::max(box[3 + k], at[k]);
      }
    }
    const double size = expected.box[3] - expected.box[0];
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(box[k], expected.box[k], 1e-4 * size) << k;
    for (const Material& material : asset.materials) {
      EXPECT_TRUE(material.roughness >= 0 && material.roughness <= 1) << material.roughness;
    }
    // The command's way.
    EXPECT_EQ(load_mesh(folder / expected.file).triangles.size(), expected.triangles);
    // Cut short, it is an error or a mesh, never a crash.
    for (const std::size_t share : {1, 2, 3}) {
      try {
        read_fbx({"cut.fbx", std::string_view(bytes).substr(0, bytes.size() * share / 4)});
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      }
    }
  }
}

TEST(Fbx, EmbeddedPicturesAndFactors) {
  KILN_REQUIRE_DATA("assets/FBX/box.fbx");
  const fs::path folder = test::shared_data("assets/FBX/box.fbx")->parent_path();
  const auto read = [&](const char* file) {
    const std::string bytes = test::read_file(folder / file);
    return read_fbx({(folder / file).string(), bytes});
  };
  for (const char* file : {"box_orphant_embedded_texture.fbx", "embedded_ascii/box.FBX"}) {
    const MaterialPicture picture = read(file).materials.at(0).color_map;
    ASSERT_NE(picture.bytes, nullptr) << file;
    const Image image = load_image(*picture.bytes, picture.file.string());
    EXPECT_GT(image.width, 1u);
  }
  // Pictures that are there are found; others are told, and the numbers stand.
  const char* const pbr = "maxPbrMaterial_metalRough.fbx";
  const std::string bytes = test::read_file(folder / pbr);
  const fs::path scratch = test::scratch_folder();
  std::vector<Warning> warnings;
  const auto read_here = [&] {
    return read_fbx({(scratch / pbr).string(), bytes, &warnings}).materials.at(0);
  };
  EXPECT_TRUE(read_here().color_map.empty());
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(),
                          [](const Warning& w) { return w.code == "picture-missing"; }));
  for (const char* name : {"albedo", "normal", "roughness", "metalness", "emission"}) {
    fs::create_directories(scratch / "Textures");
    save_image({1, 1, 3, {1, 0, 0}}, scratch / "Textures" / (std::string(name) + ".png"),
               {.format = ImageFormat::png8});
  }
  const Material material = read_here();
  EXPECT_EQ(material.name, "PBR Material");
  EXPECT_EQ(material.color_map.file.filename(), "albedo.png");
  EXPECT_EQ(material.normal_map.file.filename(), "normal.png");
  EXPECT_EQ(material.roughness_map.file.filename(), "roughness.png");
  EXPECT_EQ(material.metallic_map.file.filename(), "metalness.png");
  EXPECT_EQ(material.emission_map.file.filename(), "emission.png");
}

TEST(Fbx, DamagedFilesAreErrorsOrMeshes) {
  KILN_REQUIRE_DATA("assets/FBX/box.fbx");
  const fs::path folder = test::shared_data("assets/FBX/box.fbx")->parent_path();
  for (const char* file : {"box_orphant_embedded_texture.fbx", "embedded_ascii/box.FBX"}) {
    const std::string bytes = test::read_file(folder / file);
    for (std::size_t i = 0; i < 60; ++i) {
      std::string damaged = bytes;
      damaged[bytes.size() * (2 * i + 1) / 120] = "!\n\"5"[i % 4];
      try {
        read_fbx({"damaged.fbx", damaged});
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
      }
    }
  }
}

TEST(Fbx, RefusalsNameTheFileAndTheRemedy) {
  for (const std::string& bytes : {std::string("nothing"), std::string(1000, '\0'),
                                   std::string("Kaydara FBX Binary  \0\x1a\0", 23),
                                   std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")}) {
    try {
      read_fbx({"bad.fbx", bytes});
      ADD_FAILURE() << bytes.substr(0, 20) << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      const std::string text = error.what();
      EXPECT_TRUE(text.starts_with("bad.fbx")) << text;
      EXPECT_TRUE(text.ends_with(".")) << text;
    }
  }
}

/// The refusal of a version keeps its number, by which it can be looked up.
TEST(Fbx, RefusalsKeepTheDetailOfTheReason) {
  for (const std::uint32_t version : {1234U, 2718U}) {
    std::string bytes("Kaydara FBX Binary  \0\x1a\0", 23);
    for (int k = 0; k < 4; ++k) bytes += static_cast<char>(version >> (8 * k) & 255U);
    // A node of one value, whose type is none, and bytes enough for all that its header promises.
    for (const char of_header : {60, 1, 1}) bytes += std::string{of_header, 0, 0, 0};
    bytes += "\x01n?" + std::string(1000, '!');
    try {
      read_fbx({"old.fbx", bytes});
      ADD_FAILURE() << version << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      const std::string text = error.what();
      EXPECT_TRUE(text.starts_with("old.fbx")) << text;
      EXPECT_NE(text.find("Unsupported version (" + std::to_string(version) + ")"),
                std::string::npos)
          << text;
    }
  }
}

#endif

}  // namespace
}  // namespace kiln

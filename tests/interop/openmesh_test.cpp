// Meshes of OpenMesh become Kiln's and come back: with polygons, deleted elements, attributes of corners and vertices, in
// single and double precision.
#include "kiln/interop/openmesh.h"

#include <gtest/gtest.h>

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"
#include "kiln/normals.h"
#include "kiln/validate.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  using TexCoord2D = OpenMesh::Vec2d;
  using Color = OpenMesh::Vec4f;
  VertexAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Color);
  FaceAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
};
using TriMesh = OpenMesh::TriMesh_ArrayKernelT<>;
using PolyMesh = OpenMesh::PolyMesh_ArrayKernelT<>;
using DoublePolyMesh = OpenMesh::PolyMesh_ArrayKernelT<DoubleTraits>;

/// A cube's six quads, wound outwards.
constexpr std::array<std::array<int, 4>, 6> kCube = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};

template <typename OpenMeshT>
OpenMeshT cube(const std::array<double, 3>& at = {}) {
  OpenMeshT mesh;
  std::vector<typename OpenMeshT::VertexHandle> v;
  for (const auto& [x, y, z] : std::vector<std::array<double, 3>>{{0, 0, 0},
                                                                  {1, 0, 0},
                                                                  {1, 1, 0},
                                                                  {0, 1, 0},
                                                                  {0, 0, 1},
                                                                  {1, 0, 1},
                                                                  {1, 1, 1},
                                                                  {0, 1, 1}}) {
    using Scalar = typename OpenMesh::vector_traits<typename OpenMeshT::Point>::value_type;
    v.push_back(mesh.add_vertex({static_cast<Scalar>(x + at[0]), static_cast<Scalar>(y + at[1]),
                                 static_cast<Scalar>(z + at[2])}));
  }
  for (const auto& quad : kCube) {
    std::vector<typename OpenMeshT::VertexHandle> face;
    for (const int i : quad) face.push_back(v[static_cast<std::size_t>(i)]);
    mesh.add_face(face);
  }
  return mesh;
}

TEST(OpenMesh, PolygonsBecomeTrianglesThatKnowThem) {
  const Mesh mesh = from_openmesh(cube<PolyMesh>(), "cube");
  EXPECT_EQ(mesh.name, "cube");
  EXPECT_EQ(mesh.positions.size(), 8U);
  ASSERT_EQ(mesh.triangles.size(), 12U);
  EXPECT_EQ(mesh.polygons, (std::vector<std::uint32_t>{0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5}));
  EXPECT_TRUE(mesh.uvs.empty() && mesh.normals.empty() && mesh.colors.empty());
  EXPECT_NO_THROW(validate(mesh));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      const auto& quad = kCube[t / 2];
      EXPECT_NE(std::find(quad.begin(), quad.end(), static_cast<int>(vertex)), quad.end());
    }
  }
  EXPECT_TRUE(from_openmesh(cube<TriMesh>()).polygons.empty());
  EXPECT_EQ(from_openmesh(cube<TriMesh>()).triangles.size(), 12U);
}

TEST(OpenMesh, AttributesOfCornersAreThoseOfTheirHalfedges) {
  PolyMesh mesh = cube<PolyMesh>();
  mesh.request_halfedge_texcoords2D();
  mesh.request_halfedge_normals();
  mesh.request_vertex_texcoords2D();  // go unread, since corners have their own
  const auto uv_of = [](int face, int vertex) {
    return OpenMesh::Vec2f(static_cast<float>(face) / 8, static_cast<float>(vertex) / 16);
  };
  for (const auto face : mesh.faces()) {
    for (auto h = mesh.fh_begin(face); h != mesh.fh_end(face); ++h) {
      const int vertex = mesh.to_vertex_handle(*h).idx();
      mesh.set_texcoord2D(*h, uv_of(face.idx(), vertex));
      mesh.set_normal(*h, OpenMesh::Vec3f(0, 0, 1 + static_cast<float>(vertex)));
    }
  }
  const Mesh taken = from_openmesh(mesh);
  ASSERT_EQ(taken.uv_triangles.size(), 12U);
  ASSERT_EQ(taken.normal_triangles.size(), 12U);
  for (std::size_t t = 0; t < 12; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2& uv = taken.uvs[taken.uv_triangles[t][k]];
      EXPECT_EQ(uv.x, static_cast<float>(t / 2) / 8);
      EXPECT_EQ(uv.y, static_cast<float>(taken.triangles[t][k]) / 16);
      EXPECT_EQ(taken.normals[taken.normal_triangles[t][k]].z, 1);
    }
  }
  const PolyMesh back = to_openmesh<PolyMesh>(taken);
  ASSERT_EQ(back.n_faces(), 6U);
  for (const auto face : back.faces()) {
    EXPECT_EQ(back.valence(face), 4U);
    for (auto h = back.cfh_begin(face); h != back.cfh_end(face); ++h) {
      EXPECT_EQ(back.texcoord2D(*h), uv_of(face.idx(), back.to_vertex_handle(*h).idx()));
      EXPECT_EQ(back.normal(*h), OpenMesh::Vec3f(0, 0, 1));
    }
  }
}

TEST(OpenMesh, AttributesOfVerticesAndDeletedElements) {
  TriMesh mesh = cube<TriMesh>();
  mesh.request_vertex_texcoords2D();
  mesh.request_vertex_normals();
  mesh.request_vertex_colors();
  mesh.request_vertex_status();
  mesh.request_edge_status();
  mesh.request_face_status();
  for (const auto v : mesh.vertices()) {
    mesh.set_texcoord2D(v, {static_cast<float>(v.idx()), 0});
    mesh.set_normal(v, {0, 2, 0});
    mesh.set_color(v, {static_cast<unsigned char>(10 * v.idx()), 1, 2});
  }
  mesh.set_normal(OpenMesh::VertexHandle(7), {0, 0, 0});
  mesh.delete_vertex(OpenMesh::VertexHandle(2));  // and what is around it; nothing is collected
  std::size_t left = 0;
  for ([[maybe_unused]] const auto face : mesh.faces()) ++left;
  ASSERT_LT(left, 12U);
  const Mesh taken = from_openmesh(mesh);
  EXPECT_EQ(taken.triangles.size(), left);
  ASSERT_EQ(taken.positions.size(), 7U);
  EXPECT_EQ(taken.uv_triangles, taken.triangles);
  EXPECT_EQ(taken.uvs[2].x, 3) << "vertex 3 comes third";
  EXPECT_EQ(taken.colors[2], (std::array<std::uint8_t, 4>{30, 1, 2, 255}));
  EXPECT_EQ(taken.normals[2].y, 1) << "unit";
  EXPECT_EQ(taken.normals[6].y, 0) << "none";
  EXPECT_NO_THROW(validate(taken));
}

TEST(OpenMesh, DoublesFarAwayKeepTheirDigitsAndFractionsAreColors) {
  DoublePolyMesh mesh = cube<DoublePolyMesh>({512345.125, 5412345.0625, -3});
  for (const auto v : mesh.vertices()) {
    mesh.set_color(v, {0.2F, 1.5F, -1, 0.5F});
  }
  const Mesh taken = from_openmesh(mesh);
  EXPECT_NE(taken.origin[0], 0);
  EXPECT_EQ(taken.colors[0], (std::array<std::uint8_t, 4>{51, 255, 0, 128}));
  const DoublePolyMesh back = to_openmesh<DoublePolyMesh>(taken);
  ASSERT_EQ(back.n_vertices(), 8U);
  for (const auto v : mesh.vertices()) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(back.point(v)[k], mesh.point(v)[k], 1e-7);
  }
  EXPECT_FLOAT_EQ(back.color(OpenMesh::VertexHandle(0))[0], 0.2F);
  EXPECT_EQ(from_openmesh(cube<DoublePolyMesh>()).origin, (std::array<double, 3>{}));
}

// An arrow's head: its middle corner is concave, and the fan of its first corner would turn one triangle over.
TEST(OpenMesh, ConcavePolygonsComeBackWhole) {
  PolyMesh mesh;
  std::vector<PolyMesh::VertexHandle> v;
  for (const auto& [x, y] :
       std::vector<std::array<float, 2>>{{0, 0}, {1, -1}, {0.25F, 0}, {1, 1}, {0.1F, 0.05F}}) {
    v.push_back(mesh.add_vertex({x, y, 0}));
  }
  mesh.add_face(v);
  const Mesh taken = from_openmesh(mesh);
  ASSERT_EQ(taken.triangles.size(), 3U);
  for (const Triangle& t : taken.triangles) {
    const Vec3 &a = taken.positions[t[0]], &b = taken.positions[t[1]], &c = taken.positions[t[2]];
    EXPECT_GT((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x), 0);
  }
  const PolyMesh back = to_openmesh<PolyMesh>(taken);
  ASSERT_EQ(back.n_faces(), 1U);
  std::vector<int> loop;
  for (auto i = back.cfv_begin(OpenMesh::FaceHandle(0)); i.is_valid(); ++i) {
    loop.push_back(i->idx());
  }
  std::rotate(loop.begin(), std::find(loop.begin(), loop.end(), 0), loop.end());
  EXPECT_EQ(loop, (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(to_openmesh<TriMesh>(taken).n_faces(), 3U);
}

TEST(OpenMesh, WhatHalfEdgesCannotHoldIsAnErrorThatNamesIt) {
  const auto message_of = [](const Mesh& mesh) -> std::string {
    testing::internal::CaptureStderr();
    std::string text;
    try {
      to_openmesh<TriMesh>(mesh);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      text = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    return text;
  };
  Mesh fins;  // three triangles at one edge
  fins.name = "fins";
  fins.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  fins.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_NE(message_of(fins).find("'fins': triangle 2 meets"), std::string::npos);
  fins.triangles = {{0, 1, 2}, {0, 1, 3}};  // wound against each other
  EXPECT_NE(message_of(fins).find("triangle 1 meets"), std::string::npos);
  fins.triangles = {{0, 1, 2}, {2, 3, 2}};
  EXPECT_NE(message_of(fins).find("triangle 1 has a vertex twice"), std::string::npos);
  EXPECT_TRUE(omerr().is_enabled());
}

TEST(OpenMesh, ASphereComesBackByteForByte) {
  const Mesh ball = test::icosphere(3);
  const Mesh back = from_openmesh(to_openmesh<TriMesh>(ball));
  EXPECT_EQ(back.triangles.size(), ball.triangles.size());
  for (std::size_t i = 0; i < ball.positions.size(); ++i) {
    EXPECT_EQ(back.positions[i].x, ball.positions[i].x);
    EXPECT_EQ(back.positions[i].y, ball.positions[i].y);
    EXPECT_EQ(back.positions[i].z, ball.positions[i].z);
  }
  for (std::size_t t = 0; t < ball.triangles.size(); ++t) {  // a corner may come first that did not
    const std::set<std::uint32_t> one(ball.triangles[t].begin(), ball.triangles[t].end());
    const std::set<std::uint32_t> other(back.triangles[t].begin(), back.triangles[t].end());
    EXPECT_EQ(one, other);
  }
}

}  // namespace
}  // namespace kiln

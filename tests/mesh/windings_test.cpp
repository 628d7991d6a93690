// Triangles that face against those beside them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "kiln/mesh.h"
#include "support/shapes.h"

namespace kiln {
namespace {

void turn(Mesh& mesh, std::size_t t) {
  for (std::vector<Triangle>* corners :
       {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
    if (!corners->empty()) std::swap((*corners)[t][1], (*corners)[t][2]);
  }
}

/// Turns a share of a mesh's triangles. \returns how many
std::size_t turn_some(Mesh& mesh, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (random() > share * 4294967295.0) continue;
    turn(mesh, t);
    ++count;
  }
  return count;
}

TEST(Windings, FewTrianglesAreTurnedBack) {
  for (const Mesh& right : {test::torus(40, 20), test::plane(30, 20), test::icosphere(3)}) {
    for (const double share : {0.001, 0.02, 0.2}) {
      Mesh mesh = right;
      const std::size_t count = turn_some(mesh, share, 7);
      const TurnedTriangles turned = agree_windings(mesh);
      EXPECT_EQ(turned.count, count);
      EXPECT_EQ(mesh.triangles, right.triangles);
      EXPECT_EQ(mesh.uv_triangles, right.uv_triangles);
    }
  }
}

TEST(Windings, WhatAgreesStaysWhicheverWayItFaces) {
  Mesh sphere = test::icosphere(3);
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) turn(sphere, t);  // As a room is seen.
  const Mesh before = sphere;
  EXPECT_EQ(agree_windings(sphere).count, 0U);
  EXPECT_EQ(sphere.triangles, before.triangles);
  // A few of a room are turned to the others, inwards.
  turn_some(sphere, 0.05, 3);
  EXPECT_GT(agree_windings(sphere).count, 0U);
  EXPECT_EQ(sphere.triangles, before.triangles);
}

TEST(Windings, HalfOfAClosedPartFacesOutwards) {
  const Mesh right = test::torus(40, 20);
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    Mesh mesh = right;
    turn_some(mesh, 0.5, seed);
    agree_windings(mesh);
    EXPECT_EQ(mesh.triangles, right.triangles);
  }
}

TEST(Windings, PartsAreJudgedEachByItself) {
  Mesh one = test::icosphere(2);
  Mesh inside_out = test::icosphere(2);
  for (Vec3& p : inside_out.positions) p.x += 5;
  for (std::size_t t = 0; t < inside_out.triangles.size(); ++t) turn(inside_out, t);
  turn(one, 17);
  const Mesh both[] = {one, inside_out};
  Mesh joined = join_meshes(both);
  const TurnedTriangles turned = agree_windings(joined);
  EXPECT_EQ(turned.count, 1U);
  EXPECT_EQ(turned.first, 17U);
}

/// A strip of quads whose last joins the first, turned over or not.
Mesh strip(bool moebius) {
  constexpr std::uint32_t kCount = 24;
  Mesh mesh;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const double angle = 2 * 3.14159265358979 * i / kCount;
    for (const double across : {-0.3, 0.3}) {
      const double tilt = moebius ? angle / 2 : 0.4;
      const double r = 1 + across * std::cos(tilt);
      mesh.positions.push_back({static_cast<float>(r * std::cos(angle)),
                                static_cast<float>(r * std::sin(angle)),
                                static_cast<float>(across * std::sin(tilt))});
    }
    const std::uint32_t a = 2 * i, b = a + 1;
    const bool last = i + 1 == kCount;
    std::uint32_t c = last ? 0 : a + 2, d = last ? 1 : a + 3;
    if (last && moebius) std::swap(c, d);
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({b, c, d});
  }
  return mesh;
}

TEST(Windings, AStripWithOneSideStays) {
  Mesh ring = strip(false);
  turn(ring, 5);
  EXPECT_EQ(agree_windings(ring).count, 1U);
  EXPECT_EQ(ring.triangles, strip(false).triangles);
  Mesh moebius = strip(true);
  EXPECT_EQ(agree_windings(moebius).count, 0U);
  EXPECT_EQ(moebius.triangles, strip(true).triangles);
}

TEST(Windings, TwoSidedSheetsAndRepeatedTrianglesStay) {
  Mesh sheet = test::plane(10, 10);
  const std::size_t front = sheet.triangles.size();
  for (std::size_t t = 0; t < front; ++t) {
    for (std::vector<Triangle>* corners :
         {&sheet.triangles, &sheet.uv_triangles, &sheet.normal_triangles}) {
      if (corners->empty()) continue;
      const Triangle v = (*corners)[t];
      corners->push_back({v[0], v[2], v[1]});
    }
  }
  const std::vector<Triangle> before = sheet.triangles;
  EXPECT_EQ(agree_windings(sheet).count, 0U);
  EXPECT_EQ(sheet.triangles, before);
  Mesh twice = test::tetrahedron();
  twice.triangles = {twice.triangles[0], twice.triangles[0]};
  twice.uv_triangles.clear();
  twice.normal_triangles.clear();
  EXPECT_EQ(agree_windings(twice).count, 0U);
}

TEST(Windings, VerticesOfOnePlaceAreOne) {
  const Mesh right = test::torus(20, 10);
  Mesh apart = right;
  apart.positions.clear();
  apart.uvs.clear();
  apart.uv_triangles.clear();
  for (Triangle& v : apart.triangles) {
    for (std::uint32_t& corner : v) {
      apart.positions.push_back(right.positions[corner]);
      corner = static_cast<std::uint32_t>(apart.positions.size() - 1);
    }
  }
  apart.normals.clear();
  apart.normal_triangles.clear();
  turn(apart, 3);
  EXPECT_EQ(agree_windings(apart).count, 1U);
}

TEST(Windings, OwnNormalsFaceAsTheTrianglesDo) {
  for (const bool normals_too : {false, true}) {
    Mesh mesh = test::BumpySphere::dense(2000, true);
    const Mesh right = mesh;
    ASSERT_FALSE(mesh.normal_triangles.empty());
    for (const std::size_t t : {std::size_t{10}, std::size_t{500}}) {
      turn(mesh, t);
      if (!normals_too) continue;
      for (std::uint32_t& n : mesh.normal_triangles[t]) {
        const Vec3 own = mesh.normals[n];
        n = static_cast<std::uint32_t>(mesh.normals.size());
        mesh.normals.push_back({-own.x, -own.y, -own.z});
      }
    }
    EXPECT_EQ(agree_windings(mesh).count, 2U);
    EXPECT_EQ(mesh.triangles, right.triangles);
    for (const std::size_t t : {std::size_t{10}, std::size_t{500}}) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 a = mesh.normals[mesh.normal_triangles[t][k]];
        const Vec3 b = right.normals[right.normal_triangles[t][k]];
        EXPECT_EQ(a, b);
      }
    }
  }
}

/// Normals and tangents that turn with their triangle keep its bitangent, so that its UVs are read as before.
TEST(Windings, TangentsOfTurnedNormalsKeepTheirBitangent) {
  for (const float sign : {1.0F, -1.0F}) {
    Mesh mesh = test::plane(3, 3);
    mesh.normals = {{0, 0, 1}, {0, 0, -1}};
    mesh.normal_triangles.assign(mesh.triangles.size(), {0, 0, 0});
    mesh.tangents.assign(3 * mesh.triangles.size(), Tangent{{1, 0, 0}, sign});
    const Mesh right = mesh;
    constexpr std::size_t kTurned = 7;
    turn(mesh, kTurned);
    mesh.normal_triangles[kTurned] = {1, 1, 1};
    for (std::size_t k = 0; k < 3; ++k) mesh.tangents[3 * kTurned + k].sign = -sign;
    ASSERT_EQ(agree_windings(mesh).count, 1U);
    EXPECT_EQ(mesh.triangles, right.triangles);
    for (std::size_t corner = 0; corner < mesh.tangents.size(); ++corner) {
      EXPECT_EQ(mesh.normals[mesh.normal_triangles[corner / 3][corner % 3]].z, 1) << corner;
      EXPECT_EQ(mesh.tangents[corner].sign, sign) << corner;
    }
  }
}

TEST(Windings, RefuseWhatDoesNotHoldTogether) {
  Mesh mesh = test::tetrahedron();
  mesh.triangles[0][0] = 99;
  EXPECT_THROW(agree_windings(mesh), Error);
}

/// The vertex in the middle starts more sides than are compared pairwise; that two run alike shows at it alone.
TEST(Windings, OneTriangleOfALargeFanIsTurnedBack) {
  for (const std::uint32_t triangles : {15U, 17U, 40U}) {
    Mesh right;
    right.positions.push_back({0.5F, 0.25F, 0});
    for (std::uint32_t i = 0; i <= triangles; ++i) {
      const double angle = 3.0 * i / triangles;
      right.positions.push_back(
          {static_cast<float>(2 * std::cos(angle)), static_cast<float>(std::sin(angle)), 0.125F});
    }
    for (std::uint32_t i = 1; i <= triangles; ++i) right.triangles.push_back({i, i + 1, 0});
    Mesh mesh = right;
    turn(mesh, 0);
    const TurnedTriangles turned = agree_windings(mesh);
    EXPECT_EQ(turned.count, 1U) << triangles;
    EXPECT_EQ(turned.first, 0U);
    EXPECT_EQ(mesh.triangles, right.triangles);
  }
}

}  // namespace
}  // namespace kiln

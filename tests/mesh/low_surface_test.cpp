#include "mesh/low_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "mesh/vector.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// A cube of side 2 with hard normals and a chart a side (all charts alike); 8 vertices.
Mesh cube() {
  Mesh mesh;
  mesh.name = "cube";
  for (unsigned i = 0; i < 8; ++i) {
    mesh.positions.push_back({i & 1U ? 1.0F : -1.0F, i & 2U ? 1.0F : -1.0F, i & 4U ? 1.0F : -1.0F});
  }
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const std::array<std::array<std::uint32_t, 4>, 6> sides{
      {{1, 3, 7, 5}, {2, 0, 4, 6}, {3, 2, 6, 7}, {0, 1, 5, 4}, {4, 5, 7, 6}, {2, 3, 1, 0}}};
  mesh.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t s = 0; s < 6; ++s) {
    const auto& q = sides[s];
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
    mesh.uv_triangles.push_back({0, 1, 2});
    mesh.uv_triangles.push_back({0, 2, 3});
    mesh.normal_triangles.push_back({s, s, s});
    mesh.normal_triangles.push_back({s, s, s});
  }
  return mesh;
}

template <typename Body>
std::string message_of(const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(LowSurface, KeepsHardNormalsAndJoinsDirections) {
  const Mesh mesh = cube();
  const Frame frame = Frame::of(mesh);
  const LowSurface surface = LowSurface::of(mesh, frame);
  ASSERT_EQ(surface.triangles.size(), 12U);
  EXPECT_FALSE(surface.has_cage_mesh);
  for (std::size_t t = 0; t < 12; ++t) {
    EXPECT_EQ(surface.usable[t], 1);
    for (std::size_t k = 0; k < 3; ++k) {
      const LowSurface::Corner& corner = surface.triangles[t][k];
      EXPECT_EQ(corner.position, frame.to_frame(mesh, mesh.triangles[t][k]));
      EXPECT_EQ(corner.normal, mesh.normals[t / 2]);
      EXPECT_EQ(corner.uv, mesh.uvs[mesh.uv_triangles[t][k]]);
      const Vec3d outward = to_double(corner.position) * (1 / length(to_double(corner.position)));
      EXPECT_NEAR(dot(to_double(corner.direction), outward), 1, 1e-6)
          << "the diagonal, by symmetry";
      // u runs from the side's first corner to its second.
      const Vec3d along = to_double(surface.triangles[t / 2 * 2][1].position) -
                          to_double(surface.triangles[t / 2 * 2][0].position);
      EXPECT_NEAR(dot(to_double(corner.tangent), along) / length(along), 1, 1e-6);
      EXPECT_EQ(corner.sign, 1);
    }
  }
}

/// The red of a vertex's own colour says how straight its rays are.
TEST(LowSurface, ColoursStraightenEachCornerByItself) {
  Mesh mesh = cube();
  for (const auto& corners : LowSurface::of(mesh, Frame::of(mesh)).triangles) {
    for (const LowSurface::Corner& corner : corners) EXPECT_EQ(corner.straight, 0);
  }
  for (std::size_t v = 0; v < 8; ++v) {
    mesh.colors.push_back({static_cast<std::uint8_t>(36 * v), 255, 7, 255});
  }
  const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
  for (std::size_t t = 0; t < 12; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(surface.triangles[t][k].straight,
                36.0F * static_cast<float>(mesh.triangles[t][k]) / 255.0F);
    }
  }
}

TEST(LowSurface, ACageGivesOffsets) {
  const Mesh mesh = cube();
  Mesh cage = mesh;
  for (Vec3& p : cage.positions) p = {p.x * 1.5F, p.y * 1.25F, p.z};
  const Frame frame = Frame::of(mesh);
  const LowSurface surface = LowSurface::of(mesh, frame, &cage);
  EXPECT_TRUE(surface.has_cage_mesh);
  for (std::size_t t = 0; t < 12; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.positions[mesh.triangles[t][k]];
      const auto scale = static_cast<float>(frame.scale);
      const Vec3 expected{p.x * 0.5F * scale, p.y * 0.25F * scale, 0};
      EXPECT_EQ(surface.triangles[t][k].direction, expected);
    }
  }
}

/// Positions and triangles alone.
Mesh bare_of(Mesh mesh) {
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(LowSurface, ACageOfAnotherTopologyIsAHull) {
  const Mesh mesh = cube();
  const Frame frame = Frame::of(mesh);
  const auto kind = [&](const Mesh& cage) { return LowSurface::of(mesh, frame, &cage).cage_kind; };
  Mesh fewer = bare_of(mesh);
  fewer.triangles.pop_back();
  EXPECT_EQ(kind(fewer), CageKind::hull);

  Mesh reordered = mesh;
  std::swap(reordered.triangles[3], reordered.triangles[8]);
  EXPECT_EQ(kind(reordered), CageKind::hull);

  Mesh torn = mesh;  // a vertex split in two that stay together is fine, apart is not
  torn.positions.push_back(torn.positions[torn.triangles[0][0]]);
  torn.triangles[0][0] = 8;
  EXPECT_EQ(kind(torn), CageKind::offsets);
  torn.positions.back().x += 1;
  EXPECT_EQ(kind(torn), CageKind::hull);
}

TEST(LowSurface, TwoShellsGiveWaysOutAndIn) {
  const Mesh mesh = cube();
  Mesh shells = bare_of(mesh);
  for (const Vec3& p : mesh.positions) shells.positions.push_back({p.x / 2, p.y / 2, p.z / 2});
  for (Vec3& p : std::span(shells.positions).first(8)) p = {2 * p.x, 2 * p.y, 2 * p.z};
  for (const Triangle& t : mesh.triangles) {
    shells.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  }
  const Frame frame = Frame::of(mesh);
  const LowSurface surface = LowSurface::of(mesh, frame, &shells);
  ASSERT_EQ(surface.cage_kind, CageKind::shells);
  for (const auto& corners : surface.triangles) {
    for (const LowSurface::Corner& corner : corners) {
      const double size = length(to_double(corner.position));
      EXPECT_NEAR(corner.outward, size, 1e-6);
      EXPECT_NEAR(corner.inward, size / 2, 1e-6);
      EXPECT_NEAR(dot(to_double(corner.direction), to_double(corner.position)), size, 1e-6);
    }
  }
  const std::vector<float> outer = surface.shell(false), inner = surface.shell(true);
  for (std::size_t i = 3; i < outer.size(); i += 6) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double half = frame.scale * std::abs(mesh.positions[0].x);
      EXPECT_NEAR(outer[i + k], half, 1e-6);
      EXPECT_NEAR(inner[i + k], half / 2, 1e-6);
    }
  }
}

TEST(LowSurface, SaysWhatIsMissing) {
  const Mesh mesh = cube();
  const Frame frame = Frame::of(mesh);
  Mesh bare = mesh;
  bare.uvs.clear();
  bare.uv_triangles.clear();
  const std::string no_uvs = message_of([&] { LowSurface::of(bare, frame); });
  EXPECT_NE(no_uvs.find("'cube'"), std::string::npos);
  EXPECT_NE(no_uvs.find("unwrap()"), std::string::npos);

  Mesh flat = mesh;
  for (Vec2& uv : flat.uvs) uv = {0, 0};
  EXPECT_NE(message_of([&] { LowSurface::of(flat, frame); }).find("degenerate"), std::string::npos);

  Mesh broken = mesh;
  broken.uv_triangles[4][2] = 99;
  const std::string index = message_of([&] { LowSurface::of(broken, frame); });
  EXPECT_NE(index.find("Triangle 4"), std::string::npos) << index;

  Mesh nowhere = mesh;
  for (Vec3& p : nowhere.positions) p.x = std::numeric_limits<float>::quiet_NaN();
  message_of([&] { LowSurface::of(nowhere, frame); });
}

TEST(LowSurface, MarksUnusableTriangles) {
  Mesh mesh = cube();
  mesh.positions.push_back({std::numeric_limits<float>::infinity(), 0, 0});
  mesh.triangles[2][1] = 8;
  mesh.triangles[5] = {3, 3, 6};
  mesh.triangles[7] = {0, 0, 0};
  const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
  for (std::size_t t = 0; t < 12; ++t) {
    EXPECT_EQ(surface.usable[t], t == 2 || t == 5 || t == 7 ? 0 : 1) << t;
    for (const LowSurface::Corner& corner : surface.triangles[t]) {
      EXPECT_TRUE(is_finite(corner.tangent));
      EXPECT_TRUE(is_finite(corner.normal));
    }
  }
}

TEST(LowSurface, TheBunnyIsWhole) {
  KILN_REQUIRE_DATA("bunny_low.obj");
  const Mesh mesh = load_mesh(*test::shared_data("bunny_low.obj"));
  const LowSurface surface = LowSurface::of(mesh, Frame::of(mesh));
  ASSERT_EQ(surface.triangles.size(), 2083U);
  for (const auto& triangle : surface.triangles) {
    for (const LowSurface::Corner& corner : triangle) {
      EXPECT_NEAR(length(to_double(corner.normal)), 1, 1e-6);
      EXPECT_NEAR(length(to_double(corner.tangent)), 1, 1e-6);
      EXPECT_NEAR(dot(to_double(corner.normal), to_double(corner.tangent)), 0, 1e-6);
      EXPECT_NEAR(length(to_double(corner.direction)), 1, 1e-6);
    }
  }
}

}  // namespace
}  // namespace kiln

// Writing meshes: what was written is read again, and files are whole or absent.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <limits>

#include "asset/mesh_files.h"
#include "kiln/mesh.h"
#include "support/environment.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::mesh_files::hard_edge;
using test::mesh_files::load;
using test::mesh_files::load_text;

TEST(MeshIo, WritesWhatItReads) {
  Mesh mesh = load_text("edge.obj", hard_edge).mesh;
  mesh.positions[1] = {0.1f, -3.4e38f, 1e-30f};
  mesh.positions[2] = {1.0f / 3, 16777217.0f, 1.17549435e-38f};
  mesh.normals[0] = {0.6f, 0, -0.8f};
  mesh.uvs[1] = {0.1f, 1.0f / 7};
  mesh.colors.assign(mesh.positions.size(), {1, 127, 254, 255});
  const fs::path path = test::scratch_folder() / "out.obj";
  save_obj(mesh, path);
  const Mesh again = load(path).mesh;
  EXPECT_EQ(again.name, "out");
  EXPECT_EQ(again.origin, mesh.origin);
  EXPECT_EQ(again.positions, mesh.positions);
  EXPECT_EQ(again.triangles, mesh.triangles);
  EXPECT_EQ(again.uvs, mesh.uvs);
  EXPECT_EQ(again.uv_triangles, mesh.uv_triangles);
  EXPECT_EQ(again.normals, mesh.normals);
  EXPECT_EQ(again.normal_triangles, mesh.normal_triangles);
  EXPECT_EQ(again.colors, mesh.colors);
  EXPECT_EQ(again.groups, mesh.groups);
  EXPECT_EQ(again.group_names, mesh.group_names);
  EXPECT_EQ(again.materials, mesh.materials);
  EXPECT_EQ(again.material_names, mesh.material_names);
}

TEST(MeshIo, WritesAndReadsAnyFiniteMesh) {
  const fs::path path = test::scratch_folder() / "any.obj";
  EXPECT_TRUE(rc::check("positions and triangles come back bit by bit", [&path] {
    Mesh mesh;
    // Any finite float that is not too large beside the others to keep the mesh near its origin.
    const auto any_float =
        rc::gen::map(rc::gen::arbitrary<std::uint32_t>(), [](std::uint32_t bits) {
          const float value = std::bit_cast<float>(bits);
          return std::isfinite(value) && std::abs(value) < 1e30f ? value : 0.5f;
        });
    for (int i = *rc::gen::inRange(0, 20); i > 0; --i) {
      mesh.positions.push_back({*any_float, *any_float, *any_float});
    }
    // A triangle around all of them: some area, and a box around the world's origin.
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{-1e31f, -1e31f, 0}, {1e31f, 0, 0}, {0, 1e31f, 1}});
    mesh.triangles.push_back({n, n + 1, n + 2});
    for (int i = *rc::gen::inRange(0, 20); i > 0; --i) {
      const auto index = rc::gen::inRange<std::uint32_t>(0, n + 3);
      mesh.triangles.push_back({*index, *index, *index});
    }
    save_obj(mesh, path);
    const Mesh again = load_mesh(path);
    RC_ASSERT(again.positions == mesh.positions);
    RC_ASSERT(again.triangles == mesh.triangles);
  }));
}

TEST(MeshIo, WritesNothingOrAll) {
  Mesh mesh = load_text("edge.obj", hard_edge).mesh;
  const fs::path folder = test::scratch_folder(), path = folder / "out.obj";
  save_obj(mesh, path);
  mesh.triangles[0][0] = 99;
  EXPECT_THROW(save_obj(mesh, path), Error);
  EXPECT_EQ(load(path).mesh.triangles.size(), 3u);  // the old file is still there
  mesh.triangles[0][0] = 0;
  mesh.group_names[1] = "two\nlines # and \\";
  save_obj(mesh, path);
  EXPECT_EQ(load(path).mesh.group_names[1], "two_lines # and _");
  try {
    save_obj(mesh, folder / "missing" / "out.obj");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::output);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

/// A UV that is not finite says that a corner has none; text has no number for it.
TEST(MeshIo, WritesNoUvsWhereThereAreNone) {
  Mesh mesh = load_text("edge.obj", hard_edge).mesh;
  ASSERT_GT(mesh.triangles.size(), 1U);
  const Vec2 kept = mesh.uvs[mesh.uv_triangles[1][0]];
  const auto none = static_cast<std::uint32_t>(mesh.uvs.size());
  mesh.uvs.insert(mesh.uvs.begin(), {std::numeric_limits<float>::quiet_NaN(), 0});
  for (Triangle& t : mesh.uv_triangles) {
    for (std::uint32_t& v : t) ++v;
  }
  mesh.uvs.push_back({0, std::numeric_limits<float>::infinity()});
  mesh.uv_triangles[0].fill(none + 1);
  const fs::path path = test::scratch_folder() / "none.obj";
  save_obj(mesh, path);
  const auto [again, warnings] = load(path);
  ASSERT_EQ(again.uv_triangles.size(), mesh.triangles.size());
  EXPECT_EQ(again.uvs[again.uv_triangles[1][0]], kept);
  EXPECT_TRUE(std::isnan(again.uvs[again.uv_triangles[0][0]].x));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].code, "missing-uvs");
}

/// A face is written without UVs if any of its corners has none, whichever that is and however many others.
TEST(MeshIo, WritesNoUvsWhereOneCornerHasNone) {
  const Mesh plain = load_text("edge.obj", hard_edge).mesh;
  for (unsigned corners = 0; corners < 8; ++corners) {
    Mesh mesh = plain;
    const auto none = static_cast<std::uint32_t>(mesh.uvs.size());
    mesh.uvs.push_back({0, std::numeric_limits<float>::quiet_NaN()});
    for (std::size_t k = 0; k < 3; ++k) {
      if ((corners >> k & 1U) != 0) mesh.uv_triangles[0][k] = none;
    }
    const fs::path path = test::scratch_folder() / "some.obj";
    save_obj(mesh, path);
    const Mesh again = load(path).mesh;
    ASSERT_EQ(again.uv_triangles.size(), mesh.triangles.size());
    for (std::size_t t = 0; t < 2; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2 uv = again.uvs[again.uv_triangles[t][k]];
        if (t == 0 && corners != 0) {
          EXPECT_FALSE(std::isfinite(uv.x) && std::isfinite(uv.y)) << corners << " " << k;
        } else {
          EXPECT_EQ(uv, plain.uvs[plain.uv_triangles[t][k]]) << corners << " " << t;
        }
      }
    }
  }
}

}  // namespace
}  // namespace kiln

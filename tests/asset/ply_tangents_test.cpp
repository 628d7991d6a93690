// Tangents of PLY vertices: both signs, names, what is wrong with them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "asset/mesh_reader.h"

namespace kiln {
namespace {

struct Parsed {
  Mesh mesh;
  std::vector<Warning> warnings;
};

/// A unit square in z = 0 whose UVs run along x, backwards where mirrored, and along y.
Parsed square(const std::string& properties, const std::vector<std::string>& tangents,
              bool mirrored = false) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 4\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "s", "t"}) {
    text += std::string("property float ") + name + "\n";
  }
  text += properties + "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string corners[] = {"0 0", "1 0", "1 1", "0 1"};
  const std::string other[] = {"1 0", "0 0", "0 1", "1 1"};
  for (std::size_t i = 0; i < 4; ++i) {
    text +=
        corners[i] + " 0 0 0 1 " + (mirrored ? other[i] : corners[i]) + " " + tangents[i] + "\n";
  }
  text += "4 0 1 2 3\n";
  Parsed parsed;
  parsed.mesh = parse_mesh({"square.ply", text, &parsed.warnings}, MeshFormat::ply);
  return parsed;
}

std::string four(const std::string& prefix) {
  std::string text;
  for (const char* axis : {"x", "y", "z", "w"}) {
    text += "property float " + prefix + axis + "\n";
  }
  return text;
}

const std::string kThree = "property float tx\nproperty float ty\nproperty float tz\n";

TEST(PlyTangents, EveryCornerHasItsVertexs) {
  for (const char* prefix : {"t", "tangent_"}) {
    const Parsed parsed = square(four(prefix), {"0 1 0 -1", "1 0 0 1", "0 -1 0 1", "-1 0 0 -1"});
    EXPECT_TRUE(parsed.warnings.empty());
    ASSERT_EQ(parsed.mesh.tangents.size(), 6U);
    const Tangent wanted[] = {{{0, 1, 0}, -1}, {{1, 0, 0}, 1}, {{0, -1, 0}, 1}, {{-1, 0, 0}, -1}};
    for (std::size_t i = 0; i < 6; ++i) {
      const Tangent& tangent = parsed.mesh.tangents[i];
      const Tangent& want = wanted[parsed.mesh.triangles[i / 3][i % 3]];
      EXPECT_EQ(tangent.direction, want.direction) << i;
      EXPECT_EQ(tangent.sign, want.sign) << i;
    }
  }
}

TEST(PlyTangents, WithoutASignTheUvsSayIt) {
  const std::vector<std::string> along(4, "1 0 0");
  for (const bool mirrored : {false, true}) {
    const Parsed parsed = square(kThree, along, mirrored);
    ASSERT_EQ(parsed.mesh.tangents.size(), 6U);
    for (const Tangent& tangent : parsed.mesh.tangents) {
      EXPECT_EQ(tangent.sign, mirrored ? -1 : 1);
    }
  }
}

TEST(PlyTangents, AnIncompleteSetIsNone) {
  const Parsed parsed = square("property float tx\nproperty float ty\nproperty float tw\n",
                               std::vector<std::string>(4, "1 0 1"));
  EXPECT_TRUE(parsed.mesh.tangents.empty());
}

TEST(PlyTangents, WhatIsWrongIsCountedWithTheFirst) {
  const Parsed parsed = square(
      four("t"), {"0 1 0 1", "nan 1 0 1", "0 0 2 1", "0 3 0 0.5"});  // the third is the normal
  ASSERT_EQ(parsed.warnings.size(), 3U);
  EXPECT_EQ(parsed.warnings[0].code, "bad-tangents");
  EXPECT_EQ(parsed.warnings[0].count, 2U);
  EXPECT_NE(parsed.warnings[0].message.text().find("vertex 1 "), std::string::npos);
  EXPECT_EQ(parsed.warnings[1].code, "long-tangents");
  EXPECT_NE(parsed.warnings[1].message.text().find("vertex 3: 3"), std::string::npos);
  EXPECT_EQ(parsed.warnings[2].code, "tangent-signs");
  EXPECT_NE(parsed.warnings[2].message.text().find("vertex 3: 0.5"), std::string::npos);
  for (std::size_t i = 0; i < 6; ++i) {
    const std::uint32_t vertex = parsed.mesh.triangles[i / 3][i % 3];
    const Vec3 none{}, given = parsed.mesh.tangents[i].direction;
    EXPECT_EQ(given == none, vertex == 1 || vertex == 2) << i;
  }
}

}  // namespace
}  // namespace kiln

// Low polys of many numbers of faces, from one run of collapses.
#include "simplify/simplify_levels.h"

#include <gtest/gtest.h>

#include <vector>

#include "kiln/simplify.h"
#include "support/shapes.h"

namespace kiln {
namespace {

TEST(SimplifyLevels, AreWhatSimplifyMakes) {
  const Mesh high = test::BumpySphere::dense(6000);
  const std::vector<std::uint32_t> faces = {2000, 700, 240};
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  ASSERT_EQ(levels.count(), 3U);
  for (const std::size_t i : {2U, 0U, 1U}) {
    SimplifyReport report, direct_report;
    const Mesh level = levels.mesh(i, &report);
    const Mesh direct = simplify(high, {.faces = faces[i]}, &direct_report);
    EXPECT_EQ(level.positions, direct.positions);
    EXPECT_EQ(level.triangles, direct.triangles);
    EXPECT_EQ(level.normals, direct.normals);
    EXPECT_EQ(levels.faces(i), direct.triangles.size());
    EXPECT_EQ(levels.vertices(i), direct.positions.size());
    EXPECT_EQ(report.faces, direct_report.faces);
    EXPECT_EQ(report.error, direct_report.error);
    EXPECT_EQ(report.warnings.size(), direct_report.warnings.size());
  }
}

TEST(SimplifyLevels, EndWhereTheShapeNeedsItsFaces) {
  const std::vector<std::uint32_t> faces = {8, 6, 4, 3, 2};
  const Mesh high = test::icosphere(1);
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  ASSERT_GE(levels.count(), 1U);
  for (std::size_t i = 1; i < levels.count(); ++i) EXPECT_LT(levels.faces(i), levels.faces(i - 1));
  EXPECT_GE(levels.faces(levels.count() - 1), 4U);
}

/// A collapse takes two faces: of goals one apart, each second gives a mesh of its own.
TEST(SimplifyLevels, GoOnWhereAGoalGivesNoMeshOfItsOwn) {
  std::vector<std::uint32_t> faces;
  for (std::uint32_t goal = 60; goal >= 8; --goal) faces.push_back(goal);
  const Mesh high = test::icosphere(2);
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  EXPECT_GE(levels.count(), 20U);
  EXPECT_LE(levels.faces(levels.count() - 1), 10U);
  for (std::size_t i = 0; i < levels.count(); ++i) {
    EXPECT_LE(levels.faces(i), levels.requested_faces_of(i));
    if (i > 0) EXPECT_LT(levels.faces(i), levels.faces(i - 1));
  }
}

TEST(SimplifyLevels, OfTheFunctionAreWhatSimplifyMakes) {
  Mesh high = test::BumpySphere::dense(6000);
  for (const Vec3& p : high.positions) {
    const auto byte = [](float x) { return static_cast<std::uint8_t>(127.5F + 100 * x); };
    high.colors.push_back({byte(p.x), byte(p.y), byte(p.z), 255});
  }
  const std::vector<std::uint32_t> faces = {2000, 700, 240, 3, 2};
  const std::vector<SimplifiedLevel> levels = simplify_levels(high, faces);
  ASSERT_EQ(levels.size(), faces.size());
  for (std::size_t i = 0; i < 3; ++i) {
    SimplifyReport report;
    const Mesh direct = simplify(high, {.faces = faces[i]}, &report);
    EXPECT_EQ(levels[i].mesh.positions, direct.positions);
    EXPECT_EQ(levels[i].mesh.triangles, direct.triangles);
    EXPECT_EQ(levels[i].mesh.normals, direct.normals);
    EXPECT_EQ(levels[i].mesh.colors, direct.colors);
    EXPECT_EQ(levels[i].report.faces, report.faces);
    EXPECT_EQ(levels[i].report.error, report.error);
  }
  // Fewer than a closed mesh keeps: the coarsest level.
  EXPECT_EQ(levels[3].mesh.triangles, levels[4].mesh.triangles);
  EXPECT_GE(levels[4].mesh.triangles.size(), 4U);
}

TEST(SimplifyLevels, RefuseOtherOptionsAndOrders) {
  const Mesh high = test::icosphere(2);
  const auto refused = [&](std::vector<std::uint32_t> faces, const SimplifyOptions& options) {
    try {
      simplify_levels(high, faces, options);
    } catch (const Error& error) {
      return error.code() == ErrorCode::usage;
    }
    return false;
  };
  EXPECT_TRUE(refused({}, {}));
  EXPECT_TRUE(refused({100, 100}, {}));
  EXPECT_TRUE(refused({100, 200}, {}));
  EXPECT_TRUE(refused({100}, {.max_error = 0.01}));
  EXPECT_TRUE(refused({100}, {.hull = true}));
  EXPECT_TRUE(refused({100}, {.height_field = true, .keep_uvs = true}));
  EXPECT_FALSE(refused({100, 50}, {}));
}

}  // namespace
}  // namespace kiln

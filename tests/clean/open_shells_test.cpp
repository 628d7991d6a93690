// What views from outside see of the backs of open meshes.
#include "clean/open_shells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "clean/triangle_list.h"
#include "kiln/mesh.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// A sphere without its triangles above a height.
Mesh cut_sphere(double height) {
  Mesh mesh = test::icosphere(4);
  std::vector<std::uint8_t> dropped(mesh.triangles.size());
  for (std::size_t t = 0; t < dropped.size(); ++t) {
    float sum = 0;
    for (const std::uint32_t v : mesh.triangles[t]) sum += mesh.positions[v].y;
    dropped[t] = sum / 3 > height ? 1 : 0;
  }
  drop_triangles(mesh, dropped);
  return mesh;
}

Mesh turned(Mesh mesh) {
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

TEST(OpenShells, ClosedMeshesHaveNone) {
  EXPECT_TRUE(find_open_shells(test::icosphere(3)).empty());
  EXPECT_TRUE(find_open_shells(test::torus(24, 12)).empty());
}

/// Of a half sphere, views from above see the inside, those from below the outside, and those from the side both.
TEST(OpenShells, BowlsShowTheirBacks) {
  const std::vector<OpenShells> bowl = find_open_shells(cut_sphere(0));
  ASSERT_EQ(bowl.size(), 1U);
  EXPECT_TRUE(bowl[0].shows_backs());
  // At an angle whose cosine is c, the opening covers pi c from above and nothing from below, and the whole pi/2 (1 + c):
  // in the mean pi/4 of 3 pi/4.
  const double share = double(bowl[0].back) / double(bowl[0].front + bowl[0].back);
  EXPECT_NEAR(share, 1.0 / 3, 0.05);
  EXPECT_NEAR(std::hypot(bowl[0].example.x, bowl[0].example.y, bowl[0].example.z), 1, 1e-3);
}

/// A hem: the lower tenth of a sphere's height is open. A hole of a scan: a hundredth of the radius.
TEST(OpenShells, HemsCountAndSmallHolesDoNot) {
  EXPECT_TRUE(find_open_shells(cut_sphere(0.8))[0].shows_backs());
  const std::vector<OpenShells> hole = find_open_shells(cut_sphere(0.997));
  ASSERT_EQ(hole.size(), 1U);  // it is open
  EXPECT_FALSE(hole[0].shows_backs());
}

TEST(OpenShells, SheetsShowHalfAndTwoSidedOnesNoBacks) {
  const Mesh sheet = test::plane(8, 8);
  const OpenShells one = find_open_shells(sheet)[0];
  EXPECT_NEAR(double(one.back) / double(one.front + one.back), 0.5, 0.02);
  const std::vector<Mesh> both = {sheet, turned(sheet)};
  for (const OpenShells& shell : find_open_shells(join_meshes(both)))
    EXPECT_FALSE(shell.shows_backs());
}

/// A room whose front wall is missing: its faces look inwards, and their backs are hidden on purpose.
TEST(OpenShells, RoomsAreLeftAlone) {
  EXPECT_TRUE(find_open_shells(turned(cut_sphere(0.6))).empty());
}

/// A small part that faces inwards makes no room of a mesh whose closed parts face outwards.
TEST(OpenShells, ClosedPartsShowThatAMeshIsNoRoom) {
  Mesh inward = turned(cut_sphere(0.6)), ball = test::icosphere(4);
  for (Vec3& p : ball.positions) p = {3 * p.x + 5, 3 * p.y, 3 * p.z};
  const std::vector<Mesh> meshes = {ball, inward};
  const std::vector<OpenShells> shells = find_open_shells(join_meshes(meshes));
  ASSERT_EQ(shells.size(), 1U);
  EXPECT_GT(shells[0].back, 2 * shells[0].front);
  EXPECT_TRUE(shells[0].shows_backs());
}

TEST(OpenShells, BacksThatNobodySeesDoNotCount) {
  Mesh inner = cut_sphere(0);
  for (Vec3& p : inner.positions) p = {p.x / 2, p.y / 2, p.z / 2};
  const std::vector<Mesh> meshes = {test::icosphere(4), inner};
  const std::vector<OpenShells> shells = find_open_shells(join_meshes(meshes));
  ASSERT_EQ(shells.size(), 1U);
  EXPECT_EQ(shells[0].front + shells[0].back, 0U);
  EXPECT_FALSE(shells[0].shows_backs());
}

TEST(OpenShells, MaterialsAreJudgedByThemselves) {
  Mesh bowl = cut_sphere(0), ball = test::icosphere(4), hole = cut_sphere(0.997);
  for (Vec3& p : ball.positions) p.x += 3;
  for (Vec3& p : hole.positions) p.x -= 3;
  const std::size_t of_bowl = bowl.triangles.size(), of_ball = ball.triangles.size();
  const std::vector<Mesh> meshes = {bowl, ball, hole};
  Mesh all = join_meshes(meshes);
  all.material_names = {"bowl", "ball", "hole"};
  all.materials.assign(all.triangles.size(), 2);
  std::fill_n(all.materials.begin(), of_bowl, 0);
  std::fill_n(all.materials.begin() + std::ptrdiff_t(of_bowl), of_ball, 1);
  const std::vector<OpenShells> shells = find_open_shells(all);
  ASSERT_EQ(shells.size(), 3U);
  EXPECT_TRUE(shells[0].shows_backs());
  EXPECT_EQ(shells[1].front + shells[1].back, 0U);
  EXPECT_GT(shells[2].front, 0U);
  EXPECT_FALSE(shells[2].shows_backs());
}

/// Backs count from 16 pixels on, and from a share of all that are seen on.
TEST(OpenShells, ShowBacksFromALimitOn) {
  const auto shows = [](std::uint64_t front, std::uint64_t back) {
    OpenShells shells;
    shells.front = front;
    shells.back = back;
    return shells.shows_backs();
  };
  EXPECT_TRUE(shows(0, 16));
  EXPECT_FALSE(shows(0, 15));
  const auto enough = static_cast<std::uint64_t>(std::ceil(OpenShells::kMinBackShare * 1e6));
  EXPECT_TRUE(shows(1000000 - enough, enough));
  EXPECT_FALSE(shows(1000000 - enough + 1, enough - 1));
}

}  // namespace
}  // namespace kiln

// Groups, objects and materials that a simplified mesh keeps.
#include "simplify/transfer_labels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// Two bumpy spheres apart, the second one's right half of another material.
Mesh two_spheres() {
  const Mesh one = test::BumpySphere::dense(4000);
  Mesh mesh;
  mesh.name = "spheres";
  mesh.group_names = {"empty", "left", "right"};
  mesh.material_names = {"steel", "wood"};
  mesh.object_names = {"all"};
  mesh.material_files = {"paint.mtl"};
  for (std::uint32_t side = 0; side < 2; ++side) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3& p : one.positions) {
      mesh.positions.push_back({p.x + 4 * static_cast<float>(side), p.y, p.z});
    }
    for (const Triangle& t : one.triangles) {
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      mesh.groups.push_back(1 + side);
      mesh.objects.push_back(0);
      const float middle =
          (one.positions[t[0]].x + one.positions[t[1]].x + one.positions[t[2]].x) / 3;
      mesh.materials.push_back(side == 1 && middle > 0 ? 1 : 0);
    }
  }
  return mesh;
}

float middle_x(const Mesh& mesh, std::size_t t) {
  float sum = 0;
  for (const std::uint32_t corner : mesh.triangles[t]) sum += mesh.positions[corner].x / 3;
  return sum;
}

TEST(KeepNames, OfGroupsObjectsAndMaterials) {
  const Mesh high = two_spheres();
  Mesh low = simplify(high, {.faces = 600});
  for (const UnwrapMethod method : {UnwrapMethod::charts, UnwrapMethod::pairs}) {
    SCOPED_TRACE(static_cast<int>(method));
    UnwrapOptions options;
    options.method = method;
    const Mesh laid_out = unwrap(low, options);
    ASSERT_EQ(laid_out.groups.size(), laid_out.triangles.size());
    ASSERT_EQ(laid_out.materials.size(), laid_out.triangles.size());
    ASSERT_EQ(laid_out.objects.size(), laid_out.triangles.size());
    EXPECT_EQ(laid_out.group_names, high.group_names);
    EXPECT_EQ(laid_out.object_names, high.object_names);
    EXPECT_EQ(laid_out.material_files, high.material_files);
    for (std::size_t t = 0; t < laid_out.triangles.size(); ++t) {
      const float x = middle_x(laid_out, t);
      EXPECT_EQ(laid_out.groups[t], x > 2 ? 2U : 1U) << t;
      // Triangles that the border crosses may go either way: they are a few hundredths long.
      if (std::abs(x - 4) > 0.15F) {
        EXPECT_EQ(laid_out.materials[t], x > 4 ? 1U : 0U) << t;
      }
    }
  }
}

/// Of several names, all triangles may have one that is not the first.
TEST(KeepNames, AreTheOneThatIsUsed) {
  Mesh high = test::BumpySphere::dense(2000);
  high.group_names = {"unused", "used"};
  high.groups.assign(high.triangles.size(), 1);
  const Mesh low = simplify(high, {.faces = 300});
  EXPECT_EQ(low.group_names, high.group_names);
  EXPECT_EQ(low.groups, std::vector<std::uint32_t>(low.triangles.size(), 1));
}

TEST(KeepNames, AreNoneWhereThereAreNone) {
  const Mesh low = simplify(test::BumpySphere::dense(2000), {.faces = 300});
  EXPECT_TRUE(low.groups.empty());
  EXPECT_TRUE(low.objects.empty());
  EXPECT_TRUE(low.materials.empty());
}

/// Against all triangles one by one, by the distance that squared() gives.
TEST(KeepNames, NearestTriangleIsTheNearest) {
  const Mesh mesh = test::BumpySphere::dense(300);
  const SurfaceDistance all(mesh.positions, mesh.triangles);
  for (int i = 0; i < 50; ++i) {
    const auto at = [&](int k) { return static_cast<float>((i * (7 + 4 * k)) % 50) / 25 - 1; };
    const Vec3 point{at(0), at(1), at(2)};
    const std::uint32_t found = all.nearest(point);
    const SurfaceDistance alone(mesh.positions, std::vector<Triangle>{mesh.triangles[found]});
    EXPECT_EQ(alone.squared(point), all.squared(point)) << i;
  }
}

/// The high poly's triangles in another order and from another corner on. Each has a group and a normal of its own.
TEST(KeepNames, OfTrianglesThatAreKept) {
  Mesh high;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const float x = 2 * static_cast<float>(i);
    high.positions.insert(high.positions.end(), {{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}});
    high.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    high.groups.push_back(i);
    high.group_names.push_back("group " + std::to_string(i));
    high.normals.push_back({std::cos(x), std::sin(x), 2});
    high.normal_triangles.push_back({i, i, i});
  }
  Mesh low;
  low.positions = high.positions;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const Triangle& corners = high.triangles[59 - i];
    low.triangles.push_back({corners[1], corners[2], corners[0]});
  }
  transfer_labels(high, low);
  const Mesh fitted = fit_normals(low, high, {.purpose = NormalPurpose::shading});
  for (std::uint32_t t = 0; t < low.triangles.size(); ++t) {
    const std::uint32_t same = 59 - t;
    EXPECT_EQ(low.groups[t], same);
    const Vec3d own = to_double(high.normals[same]);
    for (const std::uint32_t n : fitted.normal_triangles[t]) {
      const Vec3d normal = to_double(fitted.normals[n]);
      EXPECT_GT(dot(normal, own), 0.999 * length(normal) * length(own)) << same;
    }
  }
}

}  // namespace
}  // namespace kiln

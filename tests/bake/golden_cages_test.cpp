// Golden hashes of cages: found ones, and bakes with shells and with a closed hull. See golden_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>

#include "bake/golden_scene.h"
#include "bake/golden_table.h"
#include "kiln/cage.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using test::golden_high;
using test::golden_low;
using test::GoldenGroup;
using test::GoldenRow;
using test::sized;
using test::with_face_normals;

/// A box around a mesh, a quarter larger than the mesh's.
Mesh hull_of(const Mesh& low) {
  Vec3 least = low.positions[0], most = least;
  for (const Vec3& p : low.positions) {
    least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
    most = {std::max(most.x, p.x), std::max(most.y, p.y), std::max(most.z, p.z)};
  }
  Mesh hull = test::cube(1);
  const auto stretch = [](float c, float from, float to) {
    return 0.5F * (from + to) + 1.25F * c * (to - from);
  };
  for (Vec3& p : hull.positions) {
    p = {stretch(p.x, least.x, most.x), stretch(p.y, least.y, most.y),
         stretch(p.z, least.z - 0.1F, most.z + 0.1F)};
  }
  return hull;
}

TEST(Golden, Cages) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("cages");
  const Mesh low = with_face_normals(golden_low());
  const Source source(*test::device(), golden_high());
  static const GoldenRow rows[] = {
      {"auto", [](BakeOptions&) {}},
      {"averaged", [](BakeOptions& o) { o.match.ray.direction = RayDirection::averaged; }},
      {"face", [](BakeOptions& o) { o.match.ray.direction = RayDirection::face; }},
      {"far", [](BakeOptions& o) { o.match.max_distance = Length::share(0.1); }},
      {"two-sided", [](BakeOptions& o) { o.match.two_sided = true; }},
  };
  BakeOptions start = sized(96, 64);
  start.report.keep_match = true;
  for (const GoldenRow& row : rows) {
    BakeOptions options = start;
    row.set(options);
    const Mesh cage = find_cage(source, low, options).mesh;
    group.check(std::string("found-") + row.name, cage);
    options.match.cage_mesh = &cage;
    options.match.max_distance.reset();
    group.check(std::string("shells-") + row.name, bake(source, low, options));
  }
  const Mesh hull = hull_of(low);
  BakeOptions options = start;
  options.match.cage_mesh = &hull;
  group.check("hull", bake(source, low, options));
  options.match.ray.direction = RayDirection::face;
  group.check("hull-face", bake(source, low, options));
  KILN_FINISH_GROUP(group);
}

}  // namespace
}  // namespace kiln

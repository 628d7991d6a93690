// unwrap() by charts over random meshes: one to one, padding kept, the same on one and two threads.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "kiln/limits.h"
#include "kiln/unwrap.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"
#include "unwrap/unwrap_charts.h"

namespace kiln {
namespace {

/// The same numbers with every standard library.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(engine_() % count); }
  float unit() { return static_cast<float>(engine_() % 65536) / 65536; }

 private:
  std::mt19937 engine_;
};

/// Corners on a coarse lattice: shared edges, edges of many triangles, triangles twice or without area.
Mesh lattice_soup(Dice& dice) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  const std::uint32_t vertices = 4 + dice.below(20), triangles = 1 + dice.below(60);
  while (mesh.positions.size() < vertices) {
    const auto x = static_cast<float>(dice.below(4)), y = static_cast<float>(dice.below(4));
    mesh.positions.push_back({x, y, static_cast<float>(dice.below(4))});
  }
  while (mesh.triangles.size() < triangles) {
    const std::uint32_t a = dice.below(vertices), b = dice.below(vertices);
    mesh.triangles.push_back({a, b, dice.below(vertices)});
  }
  return mesh;
}

/// A sheet, sphere or torus with noise and holes: folded, stretched, open.
Mesh crumpled(Dice& dice) {
  Mesh mesh;
  switch (dice.below(3)) {
    case 0:
      mesh = test::plane(4 + dice.below(6), 4 + dice.below(6));
      break;
    case 1:
      mesh = test::uv_sphere(5 + dice.below(6), 4 + dice.below(4));
      break;
    default:
      mesh = test::torus(5 + dice.below(8), 4 + dice.below(4));
      break;
  }
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  const float noise = 0.3F * dice.unit(), flat = dice.below(4) == 0 ? 1e-4F : 1.0F;
  for (Vec3& p : mesh.positions) {
    p = {p.x + noise * dice.unit(), p.y + noise * dice.unit(), flat * (p.z + noise * dice.unit())};
  }
  const std::uint32_t holes = dice.below(4);
  for (std::uint32_t i = 0; i < holes && mesh.triangles.size() > 4; ++i) {
    mesh.triangles.erase(mesh.triangles.begin() +
                         dice.below(static_cast<std::uint32_t>(mesh.triangles.size())));
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

TEST(ChartsProperty, RandomMeshesGiveValidLayouts) {
  const std::uint32_t meshes = std::getenv("KILN_SMALL_CASES") == nullptr ? 30 : 20;
  for (std::uint32_t seed = 0; seed < meshes && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Dice dice(seed);
    const Mesh mesh = seed % 2 == 0 ? lattice_soup(dice) : crumpled(dice);
    UnwrapOptions options{.method = UnwrapMethod::charts};
    // Above 256 there is a last step on finer cells.
    options.size = seed % 10 == 9 ? 257 + dice.below(16) : 36 + dice.below(29);
    options.border_texels = 1 + dice.below(4);
    UnwrapReport report;
    Mesh once;
    set_thread_limit(2);
    test::check_charts(mesh, options, report, &once);
    set_thread_limit(0);
    EXPECT_EQ(unwrap_charts(mesh, options, nullptr, 1).uvs, once.uvs);
  }
}

}  // namespace
}  // namespace kiln

// Two-sided sheets: one side is simplified, both come back, each with what was its own.
#include "simplify/two_sided_sheets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "kiln/limits.h"
#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "simplify/simplify_levels.h"
#include "support/mesh_check.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"

namespace kiln {
namespace {

using test::beside;
using test::Corners;
using test::corners_of;
using test::doubled;
using test::face;
using test::flat;
using test::twins_of;
using test::wave;

bool warns(const SimplifyReport& report, const std::string& code) {
  return std::any_of(report.warnings.begin(), report.warnings.end(),
                     [&](const Warning& w) { return w.code == code; });
}

/// True if fronts and backs are twins of their own materials, with vertices of their own, and bodies have no twin.
void expect_two_sided(const Mesh& low) {
  EXPECT_EQ(test::broken_promise(low), "");
  const std::vector<std::ptrdiff_t> twins = twins_of(low);
  std::set<Triangle> vertices;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    ASSERT_EQ(twins[t] < 0, low.materials.at(t) == 2) << t;
    if (twins[t] < 0) continue;
    EXPECT_NE(low.materials[t], low.materials[static_cast<std::size_t>(twins[t])]);
    EXPECT_EQ(face(low, t).z > 0, low.materials[t] == 0);
    Triangle own = low.triangles[t];
    std::sort(own.begin(), own.end());
    EXPECT_TRUE(vertices.insert(own).second) << "of the same vertices";
  }
}

TEST(TwoSidedSheets, AreAsNearAsOneSideOfHalfTheFaces) {
  for (const std::uint32_t faces : {100U, 700U}) {
    SimplifyReport single, both;
    const Mesh one = simplify(wave(60), {.faces = faces}, &single);
    const Mesh low = simplify(doubled(wave(60)), {.faces = 2 * faces}, &both);
    EXPECT_EQ(both.faces, 2 * single.faces);
    EXPECT_EQ(both.faces, low.triangles.size());
    EXPECT_EQ(low.positions.size(), 2 * one.positions.size());
    EXPECT_EQ(both.error, single.error);
    EXPECT_EQ(both.mean_error, single.mean_error);
    EXPECT_TRUE(both.warnings.empty());
    expect_two_sided(low);
  }
}

TEST(TwoSidedSheets, KeepTwinsAndNamesWhateverTheOrder) {
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    Mesh high = doubled(wave(24 + random() % 20, seed), seed % 2 == 0);
    if (seed % 3 == 0) high = beside(std::move(high), test::icosphere(4, 0.5), {3, 0, 0});
    std::vector<std::size_t> order(high.triangles.size());
    for (std::size_t t = 0; t < order.size(); ++t) order[t] = t;
    std::shuffle(order.begin(), order.end(), random);
    const Mesh given = high;
    for (std::size_t t = 0; t < order.size(); ++t) {
      high.triangles[t] = given.triangles[order[t]];
      high.materials[t] = given.materials[order[t]];
    }
    const std::uint32_t faces = 80 + random() % 400;
    SimplifyReport report;
    const Mesh low = simplify(high, {.faces = faces}, &report);
    EXPECT_LE(low.triangles.size(), faces);
    EXPECT_GE(low.triangles.size() + 4, faces);
    EXPECT_EQ(report.faces, low.triangles.size());
    EXPECT_EQ(report.input_faces, high.triangles.size());
    expect_two_sided(low);
  }
}

TEST(TwoSidedSheets, StayWithinABound) {
  const Mesh high = beside(doubled(wave(50)), test::icosphere(4, 0.5), {3, 0, 0});
  const double diagonal = length(Vec3d{4, 1, 1.1});  // About that
  for (const double bound : {0.002, 0.01}) {
    SimplifyReport report;
    const Mesh low = simplify(high, {.max_error = bound}, &report);
    EXPECT_LT(low.triangles.size(), high.triangles.size() / 10);
    EXPECT_LE(report.error, bound);
    EXPECT_LE(report.back_error, bound);
    EXPECT_GT(report.back_error, 0);
    const SurfaceDistance surface(low.positions, low.triangles);
    for (const Vec3& p : high.positions) {
      ASSERT_LE(std::sqrt(surface.squared(p)), 1.1 * bound * diagonal);
    }
    expect_two_sided(low);
  }
}

TEST(TwoSidedSheets, MeanDeviationCountsBothSides) {
  // The sphere has faces enough; the sheet is off. It has more samples with its back.
  const Mesh body = test::icosphere(3, 0.5);
  const Mesh high = beside(doubled(wave(40)), body, {3, 0, 0});
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 900}, &report);
  const SurfaceDistance surface(low.positions, low.triangles);
  double sum = 0, count = 0;
  for (const Triangle& t : high.triangles) {
    for (std::size_t k = 0; k < 4; ++k, ++count) {
      sum += std::sqrt(surface.squared(distance_point(high.positions, t, k)));
    }
  }
  double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9, low_z = 1e9, high_z = -1e9;
  for (const Vec3& p : high.positions) {
    low_x = std::min<double>(low_x, p.x), high_x = std::max<double>(high_x, p.x);
    low_y = std::min<double>(low_y, p.y), high_y = std::max<double>(high_y, p.y);
    low_z = std::min<double>(low_z, p.z), high_z = std::max<double>(high_z, p.z);
  }
  const double diagonal = length(Vec3d{high_x - low_x, high_y - low_y, high_z - low_z});
  EXPECT_NEAR(report.mean_error, sum / count / diagonal, 1e-3 * report.mean_error);
}

TEST(TwoSidedSheets, HaveNormalsAndColorsOfEachSide) {
  const Mesh plain = doubled(wave(60));
  Mesh high = plain;
  const std::size_t half = high.positions.size() / 2;
  // The front shades as it is, the back as if it were flat.
  for (std::size_t v = 0; v < high.positions.size(); ++v) {
    const Vec3& p = high.positions[v];
    const double c = 0.06 * std::cos(9 * p.x + 2 * p.y), s = 0.04 * std::sin(11 * p.y - 3 * p.x);
    const Vec3d up{-(9 * c + 3 * s), -(2 * c - 11 * s), 1};
    high.normals.push_back(v < half ? to_float(up * (1 / length(up))) : Vec3{0, 0, -1});
    const auto grey = static_cast<std::uint8_t>(127 + 120 * p.x);
    high.colors.push_back(v < half ? std::array<std::uint8_t, 4>{grey, 0, 0, 255}
                                   : std::array<std::uint8_t, 4>{0, 0, grey, 100});
  }
  high.normal_triangles = high.triangles;
  const Mesh low = simplify(high, {.faces = 1200});
  double level = 0, bent = 0;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const bool back = low.materials.at(t) == 1;
    const Vec3d own = face(low, t) * (1 / length(face(low, t)));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d n = to_double(low.normals[low.normal_triangles[t][k]]);
      if (back) level += n.z + 1;
      if (!back) bent += 1 - dot(n, own);
      const auto& [red, green, blue, alpha] = low.colors.at(low.triangles[t][k]);
      EXPECT_EQ(green, 0);
      EXPECT_EQ(back ? red : blue, 0);
      EXPECT_EQ(alpha, back ? 100 : 255);
    }
  }
  const double corners = 1.5 * static_cast<double>(low.triangles.size());
  EXPECT_LT(level / corners, 0.005);  // 6 degrees
  EXPECT_LT(bent / corners, 0.02);
}

TEST(TwoSidedSheets, BacksTurnFrontsNormalsRound) {
  // With UVs and without: the sides share no normal.
  const Mesh high = doubled(wave(60));
  const Mesh low = simplify(high, {.faces = 600});
  const Mesh laid_out = fit_normals(unwrap(low, {.size = 256}), high);
  const Mesh shaded = fit_normals(low, high, {.crease_degrees = 60});
  for (const Mesh* mesh : {&low, &laid_out, &shaded}) {
    const std::vector<std::ptrdiff_t> twins = twins_of(*mesh);
    double apart = 0;
    for (std::size_t t = 0; t < twins.size(); ++t) {
      const auto other = static_cast<std::size_t>(twins[t]);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& at = mesh->positions[mesh->triangles[t][k]];
        for (std::size_t i = 0; i < 3; ++i) {
          if (mesh->positions[mesh->triangles[other][i]] != at) continue;
          apart += 1 + dot(to_double(mesh->normals[mesh->normal_triangles[t][k]]),
                           to_double(mesh->normals[mesh->normal_triangles[other][i]]));
        }
      }
    }
    EXPECT_LT(apart / (3.0 * static_cast<double>(twins.size())), 0.001);  // 2.6 degrees
  }
  // Every corner of a side shares its normal: no crease parts a smooth sheet.
  EXPECT_EQ(shaded.normals.size(), shaded.positions.size());
}

TEST(TwoSidedSheets, GoOnWhereTheyTouchABody) {
  // A sheet stands on a line of the ground.
  constexpr std::uint32_t n = 40;
  Mesh ground = wave(n);
  Mesh fin = wave(n);
  for (std::uint32_t i = 0; i < fin.positions.size(); ++i) {
    const Vec3& base = ground.positions[(n / 2) * (n + 1) + i % (n + 1)];
    const float up = static_cast<float>(i / (n + 1)) / n;
    fin.positions[i] = {base.x, base.y + 0.2F * up * up, base.z + up};
  }
  const Mesh high = beside(doubled(fin), ground, {0, 0, 0});
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 500}, &report);
  EXPECT_LE(low.triangles.size(), 500U);
  EXPECT_LT(report.error, 0.01);
  EXPECT_TRUE(report.warnings.empty());
  const std::vector<std::ptrdiff_t> twins = twins_of(low);
  std::size_t paired = 0, roots = 0;
  std::set<std::array<float, 3>> of_ground;
  for (std::size_t t = 0; t < twins.size(); ++t) {
    EXPECT_EQ(twins[t] >= 0, low.materials[t] != 2);
    paired += twins[t] >= 0;
    if (low.materials[t] != 2) continue;
    for (const auto& p : corners_of(low, t)) of_ground.insert(p);
  }
  EXPECT_GT(paired, 50U);
  for (std::size_t t = 0; t < twins.size(); ++t) {
    if (low.materials[t] == 2) continue;
    for (const auto& p : corners_of(low, t)) roots += of_ground.count(p);
  }
  EXPECT_GT(roots, 8U);  // They still share vertices.
}

TEST(TwoSidedSheets, GoOnSmoothlyAsOneSide) {
  // The left half alone has a back, which comes first.
  const Mesh one = wave(60);
  Mesh high = one;
  std::vector<Triangle> backs;
  for (const Triangle& t : one.triangles) {
    if (one.positions[t[0]].x < 0 && one.positions[t[1]].x < 0 && one.positions[t[2]].x < 0) {
      backs.push_back({t[0], t[2], t[1]});
    }
  }
  high.triangles.insert(high.triangles.begin(), backs.begin(), backs.end());
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = 600}, &report);
  EXPECT_LE(low.triangles.size(), 600U);
  EXPECT_LT(report.error, 0.004);
  std::map<Corners, std::size_t> fronts;
  std::map<std::array<float, 3>, std::set<std::uint32_t>> normals;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    if (face(low, t).z < 0) continue;
    fronts.emplace(corners_of(low, t), t);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = low.positions[low.triangles[t][k]];
      normals[{p.x, p.y, p.z}].insert(low.normal_triangles[t][k]);
    }
  }
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    if (face(low, t).z > 0) continue;
    EXPECT_EQ(fronts.count(corners_of(low, t, true)), 1U);
    for (const std::uint32_t v : low.triangles[t]) EXPECT_LT(low.positions[v].x, 0.05);
  }
  for (const auto& [place, own] : normals) EXPECT_EQ(own.size(), 1U);
}

TEST(TwoSidedSheets, ChartsOfBothSidesAreApart) {
  const Mesh low = simplify(doubled(wave(60)), {.faces = 400});
  UnwrapReport report;
  test::check_charts(low, {.size = 256}, report);
  EXPECT_LE(report.charts, 12U);
}

TEST(TwoSidedSheets, LevelsCountBothSides) {
  const Mesh high = beside(doubled(wave(40)), test::icosphere(3, 0.5), {3, 0, 0});
  const std::array<std::uint32_t, 3> asked{1000, 300, 80};
  const SimplifyLevels levels(high, asked, LevelRule::shape);
  ASSERT_EQ(levels.count(), asked.size());
  for (std::size_t i = 0; i < asked.size(); ++i) {
    EXPECT_LE(levels.faces(i), asked[i]);
    SimplifyReport report;
    const Mesh low = levels.mesh(i, &report);
    EXPECT_EQ(levels.faces(i), low.triangles.size());
    EXPECT_EQ(levels.vertices(i), low.positions.size());
    EXPECT_EQ(report.faces, low.triangles.size());
    EXPECT_EQ(levels.draft_meshes(i)[0].triangles.size(), levels.faces(i));
    expect_two_sided(low);
  }
}

TEST(TwoSidedSheets, OfManyNamesComeThroughPresimplification) {
  // Labels meet nearly everywhere, and say which triangles have two sides.
  Mesh high = beside(doubled(wave(230)), test::icosphere(3, 0.5), {3, 0, 0});
  ASSERT_GT(high.triangles.size() / 2, 100'000U);
  std::mt19937 random(5);
  for (std::uint32_t t = 0; t < high.triangles.size(); ++t) high.objects.push_back(random() % 5);
  high.object_names = {"a", "b", "c", "d", "e"};
  const Mesh low = simplify(high, {.faces = 3000, .fit_normals = false});
  EXPECT_LE(low.triangles.size(), 3000U);
  EXPECT_GE(low.triangles.size(), 2996U);
  EXPECT_EQ(test::broken_promise(low), "");
  const std::vector<std::ptrdiff_t> twins = twins_of(low);
  std::size_t wrong = 0;
  for (std::size_t t = 0; t < twins.size(); ++t) {
    EXPECT_EQ(twins[t] >= 0, low.positions[low.triangles[t][0]].x < 2);
    wrong += low.materials[t] != (twins[t] < 0 ? 2U : face(low, t).z > 0 ? 0U : 1U);
  }
  EXPECT_EQ(wrong, 0U);
}

TEST(TwoSidedSheets, SayWhatCannotBe) {
  SimplifyReport report;
  EXPECT_EQ(simplify(doubled(flat(4)), {.faces = 100}, &report).triangles.size(), 64U);
  EXPECT_TRUE(warns(report, "faces-above-input"));
  const Mesh one = simplify(doubled(flat(4)), {.max_error = 1}, &report);
  EXPECT_EQ(one.triangles.size(), 2U);
  EXPECT_TRUE(warns(report, "one-triangle"));
  EXPECT_EQ(simplify(doubled(flat(4)), {.faces = 1}, &report).triangles.size(), 2U);
  EXPECT_TRUE(warns(report, "faces-not-reached"));
}

TEST(TwoSidedSheets, StayWhereOtherRulesHold) {
  // Hulls and kept UVs part the sides as they did.
  const Mesh high = doubled(wave(12));
  EXPECT_EQ(simplify(high, {.faces = 50, .hull = true}).triangles.size(), high.triangles.size());
}

TEST(TwoSidedSheets, AreTheSameOnAnyThreads) {
  const Mesh high = beside(doubled(wave(50)), test::icosphere(4, 0.5), {3, 0, 0});
  set_thread_limit(1);
  const Mesh first = simplify(high, {.faces = 700});
  set_thread_limit(3);
  const Mesh next = simplify(high, {.faces = 700});
  set_thread_limit(0);
  EXPECT_EQ(next.triangles, first.triangles);
  EXPECT_EQ(next.positions, first.positions);
  EXPECT_EQ(next.normals, first.normals);
}

}  // namespace
}  // namespace kiln

// Normals fitted to a high poly: nearer than those of the faces, hard where seams part them, the same on any threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "kiln/limits.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "mesh/normals.h"
#include "mesh/vector.h"
#include "simplify/grid_cube.h"
#include "simplify/normal_fans.h"
#include "simplify/prism_tube.h"
#include "simplify/simplify_levels.h"
#include "support/shapes.h"

namespace kiln {
namespace {

Vec3d unit(const Vec3d& v) { return v * (1 / length(v)); }

double degrees(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * 57.29577951308232;
}

Vec3d corner_normal(const Mesh& mesh, std::size_t t, std::size_t k) {
  return to_double(mesh.normals[mesh.normal_triangles[t][k]]);
}

/// Mean angle between a high poly's normals and those interpolated at the nearest point of a low poly. Found by
/// looking at all of its triangles, at places on both.
/// \param steps  of places along a side: close enough that one round an edge is not nearer
double off(const Mesh& low, const Mesh& high, int steps = 8) {
  struct Place {
    Vec3d at{}, normal{};
  };
  std::vector<Place> places;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (int i = 0; i < steps; ++i) {
      for (int k = 0; i + k < steps; ++k) {
        const double u = (i + 1.0 / 3) / steps, v = (k + 1.0 / 3) / steps;
        Place& place = places.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
          const double share = c == 0 ? 1 - u - v : c == 1 ? u : v;
          place.at += to_double(low.positions[low.triangles[t][c]]) * share;
          place.normal += corner_normal(low, t, c) * share;
        }
      }
    }
  }
  double sum = 0, area = 0;
  for (std::size_t t = 0; t < high.triangles.size(); t += 7) {
    const Triangle& c = high.triangles[t];
    const Vec3d a = to_double(high.positions[c[0]]), b = to_double(high.positions[c[1]]),
                d = to_double(high.positions[c[2]]);
    const Vec3d middle = (a + b + d) * (1.0 / 3), face = cross(b - a, d - a);
    const auto nearest =
        std::min_element(places.begin(), places.end(), [&](const Place& x, const Place& y) {
          return dot(x.at - middle, x.at - middle) < dot(y.at - middle, y.at - middle);
        });
    sum += length(face) * degrees(nearest->normal, face);
    area += length(face);
  }
  return sum / area;
}

/// A box with rounded edges: flats, fillets and corners.
Mesh rounded_box() {
  Mesh mesh = test::icosphere(6);
  const auto pushed = [](float x) { return 0.15F * x + 0.8F * std::clamp(6 * x, -1.0F, 1.0F); };
  for (Vec3& p : mesh.positions) p = {pushed(p.x), pushed(p.y), pushed(p.z)};
  return mesh;
}

Mesh with_face_normals(Mesh mesh) {
  mesh.normals = vertex_normals(mesh.positions, mesh.triangles);
  mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh flat_shaded(Mesh mesh) {
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    mesh.normals.push_back(to_float(corner_weights(mesh.positions, mesh.triangles[t]).normal));
    mesh.normal_triangles.push_back({t, t, t});
  }
  return mesh;
}

std::size_t distinct(const Mesh& mesh, bool with_normals) {
  std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> corners;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      corners.insert({mesh.triangles[t][k], mesh.uv_triangles[t][k],
                      with_normals ? mesh.normal_triangles[t][k] : 0});
    }
  }
  return corners.size();
}

TEST(NormalFit, ComesNearerThanNormalsOfTheFaces) {
  const Mesh high = rounded_box();
  const Mesh low = simplify(high, {.faces = 300, .fit_normals = false});
  const double before = off(with_face_normals(low), high),
               after = off(fit_normals(low, high), high);
  EXPECT_LT(after, 0.6 * before) << before;
}

TEST(NormalFit, IsAsGoodAsTheFacesOnABall) {
  const Mesh high = test::icosphere(5);
  const Mesh low = simplify(high, {.faces = 300, .fit_normals = false});
  // A facet of 300 looks up to 6 degrees elsewhere than the ball does.
  EXPECT_LT(off(fit_normals(low, high), high), off(with_face_normals(low), high) + 0.3);
}

TEST(NormalFit, FlatsLookFlatOnlyWhereNoMapIsToBendThem) {
  const Mesh high = rounded_box();
  const Mesh low = simplify(high, {.faces = 100, .fit_normals = false});
  const Mesh seen = fit_normals(low, high, {.purpose = NormalPurpose::shading});
  const Mesh mapped = fit_normals(low, high, {.purpose = NormalPurpose::map});
  EXPECT_LT(off(seen, high), 0.9 * off(mapped, high));
  // The default purpose.
  EXPECT_EQ(fit_normals(low, high).normals, seen.normals);
  const Mesh laid_out = unwrap(low);
  EXPECT_EQ(fit_normals(laid_out, high).normals,
            fit_normals(laid_out, high, {.purpose = NormalPurpose::map}).normals);
}

TEST(NormalFit, IsWhatSimplifyGives) {
  const Mesh high = test::icosphere(5);
  const Mesh plain = simplify(high, {.faces = 400, .fit_normals = false});
  const Mesh fitted = simplify(high, {.faces = 400});
  EXPECT_EQ(fitted.positions, plain.positions);
  EXPECT_EQ(fitted.triangles, plain.triangles);
  const Mesh after = fit_normals(plain, high);
  EXPECT_EQ(fitted.normals, after.normals);
  EXPECT_EQ(fitted.normal_triangles, after.normal_triangles);
  EXPECT_NE(fitted.normals, plain.normals);
}

TEST(NormalFit, FlatsOfACubeAreFlatWhereSeamsPartThem) {
  const Mesh high = flat_shaded(test::grid_cube(24));
  const Mesh low = unwrap(simplify(high, {.faces = 12, .fit_normals = false}));
  FitNormalsReport report;
  const Mesh fitted = fit_normals(low, high, {}, &report);
  EXPECT_GE(report.hard_edges, 7U);  // Six sides in a net have five edges that are none.
  EXPECT_EQ(report.normals, fitted.normals.size());
  // A side whose whole border is seam has its own normal exactly.
  const Mesh apart = fit_normals(unwrap(low, {.method = UnwrapMethod::pairs}), high);
  for (std::size_t t = 0; t < apart.triangles.size(); ++t) {
    const Triangle& c = apart.triangles[t];
    const Vec3d a = to_double(apart.positions[c[0]]);
    const Vec3d face =
        cross(to_double(apart.positions[c[1]]) - a, to_double(apart.positions[c[2]]) - a);
    for (const std::uint32_t corner : apart.normal_triangles[t]) {
      EXPECT_LT(degrees(face, to_double(apart.normals[corner])), 0.01) << t;
    }
  }
}

TEST(NormalFit, HardAngleDecidesAndCostsNoVertices) {
  const Mesh high = rounded_box();
  const Mesh low = unwrap(simplify(high, {.faces = 200, .fit_normals = false}));
  FitNormalsReport all, some, none;
  const Mesh hard = fit_normals(low, high, {0}, &all);
  const Mesh usual = fit_normals(low, high, {}, &some);
  const Mesh smooth = fit_normals(low, high, {180}, &none);
  EXPECT_EQ(none.hard_edges, 0U);
  EXPECT_EQ(smooth.normals.size(), low.positions.size());
  EXPECT_GT(some.hard_edges, 0U);
  EXPECT_GT(all.hard_edges, some.hard_edges);
  for (const Mesh* mesh : {&hard, &usual, &smooth}) {
    EXPECT_EQ(distinct(*mesh, true), distinct(low, false));
    EXPECT_EQ(mesh->uvs, low.uvs);
    EXPECT_EQ(mesh->positions, low.positions);
  }
}

TEST(NormalFit, LooksWhereItsFacesLook) {
  // Two sheets back to back, nearer to each other than the low poly's triangles are long.
  Mesh high = test::icosphere(5);
  for (Vec3& p : high.positions) p.z *= 0.002F;
  const Mesh low = simplify(high, {.faces = 40, .fit_normals = false});
  const Mesh fitted = fit_normals(low, high);
  ASSERT_EQ(fitted.normal_triangles, low.triangles);
  std::vector<double> facing(low.positions.size(), 1);
  for (std::size_t t = 0; t < fitted.triangles.size(); ++t) {
    const Triangle& c = fitted.triangles[t];
    const Vec3d a = to_double(fitted.positions[c[0]]);
    const Vec3d face =
        cross(to_double(fitted.positions[c[1]]) - a, to_double(fitted.positions[c[2]]) - a);
    for (const std::uint32_t corner : fitted.normal_triangles[t]) {
      const Vec3d n = to_double(fitted.normals[corner]);
      EXPECT_NEAR(length(n), 1, 1e-5);
      facing[corner] = std::min(facing[corner], dot(n, unit(face)));
    }
  }
  // At the rim no normal looks the way of all faces: the fitted one is as good as the angle-weighted.
  const Mesh plain = with_face_normals(low);
  std::vector<double> before(low.positions.size(), 1);
  for (const Triangle& c : plain.triangles) {
    const Vec3d a = to_double(plain.positions[c[0]]);
    const Vec3d face =
        cross(to_double(plain.positions[c[1]]) - a, to_double(plain.positions[c[2]]) - a);
    for (const std::uint32_t v : c) {
      before[v] = std::min(before[v], dot(to_double(plain.normals[v]), unit(face)));
    }
  }
  for (std::size_t v = 0; v < before.size(); ++v) {
    EXPECT_GT(facing[v], std::min(0.05, before[v]) - 1e-5) << v;
  }
}

TEST(NormalFit, TakesTheHighPolysOwnNormals) {
  Mesh high = test::grid_cube(8);
  high.normals = {{0, 0.6F, 0.8F}};
  high.normal_triangles.assign(high.triangles.size(), Triangle{0, 0, 0});
  const Mesh low = test::grid_cube(1);
  const Mesh fitted = fit_normals(low, high);
  // If the sides look that way, all samples say the same, and faces only a little else.
  const std::vector<Vec3> faces = vertex_normals(low.positions, low.triangles);
  for (std::size_t t = 0; t < fitted.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = fitted.positions[fitted.triangles[t][k]];
      if (p.y < 0 || p.z < 0) continue;
      const Vec3d n = to_double(fitted.normals[fitted.normal_triangles[t][k]]);
      EXPECT_LT(degrees(n, {0, 0.6, 0.8}),
                degrees(to_double(faces[fitted.triangles[t][k]]), {0, 0.6, 0.8}));
    }
  }
}

TEST(NormalFit, IsTheSameOnAnyNumberOfThreads) {
  const Mesh high = test::icosphere(5);
  const Mesh low = unwrap(simplify(high, {.faces = 500}));
  Mesh one, three;
  set_thread_limit(1);
  one = fit_normals(low, high);
  set_thread_limit(3);
  three = fit_normals(low, high);
  set_thread_limit(0);
  EXPECT_EQ(one.normals, three.normals);
  EXPECT_EQ(one.normal_triangles, three.normal_triangles);
}

TEST(NormalFit, RefusesWhatItCannotUse) {
  const Mesh ball = test::icosphere(2);
  const auto code = [](const Mesh& low, const Mesh& high, double angle) {
    try {
      fit_normals(low, high, {angle});
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code(ball, ball, -1), ErrorCode::usage);
  EXPECT_EQ(code(ball, ball, 181), ErrorCode::usage);
  EXPECT_EQ(code(ball, ball, std::numeric_limits<double>::quiet_NaN()), ErrorCode::usage);
  Mesh line = ball;
  for (Vec3& p : line.positions) p = {p.x, 0, 0};
  EXPECT_EQ(code(ball, line, 20), ErrorCode::input);
  // A corner that is not finite takes part in nothing.
  Mesh torn = ball;
  torn.positions[0].x = std::numeric_limits<float>::quiet_NaN();
  const Mesh fitted = fit_normals(torn, ball);
  for (const Vec3& n : fitted.normals) EXPECT_NEAR(length(to_double(n)), 1, 1e-5);
}

/// The normals of the faces at both sides of a crease inside a chart.
TEST(NormalFit, CreasesInsideChartsAreHardForShading) {
  const Mesh high = flat_shaded(test::grid_cube(24));
  const Mesh low = unwrap(simplify(high, {.faces = 12, .fit_normals = false}));
  const FitNormalsOptions shaded{.crease_degrees = kShadingCreaseDegrees,
                                 .purpose = NormalPurpose::shading};
  FitNormalsReport report;
  const Mesh hard = fit_normals(low, high, shaded, &report);
  EXPECT_LT(off(hard, high, 64), 0.01);
  EXPECT_EQ(report.hard_edges, 12U);
  EXPECT_EQ(split_vertices(hard), 24U);
  // Not by default where the high poly is smooth, nor where a map bends normals.
  Mesh smooth = high;
  smooth.normals.clear();
  smooth.normal_triangles.clear();
  EXPECT_EQ(fit_normals(low, smooth, shaded).normals.size(), 24U);
  EXPECT_GT(off(fit_normals(low, smooth, {.purpose = NormalPurpose::shading}), high), 5);
  const FitNormalsOptions mapped{.crease_degrees = kShadingCreaseDegrees,
                                 .purpose = NormalPurpose::map};
  EXPECT_EQ(fit_normals(low, high, mapped).normals, fit_normals(low, high).normals);
}

/// Where the high poly's normals part, smooth normals would leave a step that texels cannot hold.
TEST(NormalFit, EdgesAlongHardEdgesAreHardUnderAMap) {
  const Mesh high = flat_shaded(test::grid_cube(24));
  const Mesh low = unwrap(simplify(high, {.faces = 12, .fit_normals = false}));
  ASSERT_LT(distinct(low, false), 24U);  // Charts have edges of the cube inside.
  FitNormalsReport report;
  const Mesh hard = fit_normals(low, high, {}, &report);
  EXPECT_EQ(report.hard_edges, 12U);
  EXPECT_EQ(report.normals, 24U);
  EXPECT_EQ(hard.uv_triangles, low.uv_triangles);
  EXPECT_EQ(hard.uvs, low.uvs);
  for (std::size_t t = 0; t < hard.triangles.size(); ++t) {
    const Vec3d face = corner_weights(hard.positions, hard.triangles[t]).normal;
    for (std::size_t k = 0; k < 3; ++k) EXPECT_LT(degrees(face, corner_normal(hard, t, k)), 0.1);
  }
  // A limit of 180 degrees makes no edge hard.
  EXPECT_EQ(fit_normals(low, high, {180}, &report).normals.size(), 8U);
  EXPECT_EQ(report.hard_edges, 0U);
  // What simplify() makes has the same normals.
  EXPECT_EQ(simplify(high, {.faces = 12}).normals.size(), 24U);
}

/// Two slopes that meet in a ridge along y; their normals are 53 degrees apart.
Mesh roof(std::uint32_t nx, std::uint32_t ny, float top) {
  Mesh mesh = test::plane(nx, ny, 4, 4);
  for (Vec3& p : mesh.positions) p.z = top - 0.5F * std::abs(p.x);
  return mesh;
}

/// How far a hard edge may be from an edge of the low poly is a share of that edge's length, which is 0.5 here.
TEST(NormalFit, HardEdgesBelongToEdgesWithinAShareOfTheirLength) {
  const Mesh low = with_face_normals(roof(16, 8, 0));
  const FitNormalsOptions shaded{.purpose = NormalPurpose::shading};
  FitNormalsReport report;
  fit_normals(low, flat_shaded(roof(12, 40, 0.2F * 0.5F)), shaded, &report);
  EXPECT_EQ(report.hard_edges, 8U);
  fit_normals(low, flat_shaded(roof(12, 40, 0.4F * 0.5F)), shaded, &report);
  EXPECT_EQ(report.hard_edges, 0U);
}

/// Hard edges are found by position: the file may split all vertices, or share them all.
TEST(NormalFit, SmoothHighPolysHaveNoHardEdges) {
  const Mesh high = with_face_normals(test::BumpySphere::dense(20000));
  const Mesh low = unwrap(simplify(high, {.faces = 800, .fit_normals = false}));
  Mesh torn = high;
  torn.positions.clear();
  torn.normals.clear();
  for (std::uint32_t t = 0; t < high.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      torn.positions.push_back(high.positions[high.triangles[t][k]]);
      torn.normals.push_back(to_float(corner_normal(high, t, k)));
    }
    torn.triangles[t] = torn.normal_triangles[t] = {3 * t, 3 * t + 1, 3 * t + 2};
  }
  EXPECT_EQ(fit_normals(low, high).normals, fit_normals(low, torn).normals);
  const Mesh all_split = flat_shaded(test::grid_cube(24));
  Mesh torn_cube = all_split;
  torn_cube.positions.clear();
  for (std::uint32_t t = 0; t < all_split.triangles.size(); ++t) {
    for (const std::uint32_t v : all_split.triangles[t])
      torn_cube.positions.push_back(all_split.positions[v]);
    torn_cube.triangles[t] = {3 * t, 3 * t + 1, 3 * t + 2};
  }
  const Mesh box = unwrap(simplify(all_split, {.faces = 12, .fit_normals = false}));
  EXPECT_EQ(fit_normals(box, torn_cube).normals.size(), 24U);
}

/// The sides of a prism turn by less than creases do of a high poly whose normals do not tell. Its own normals are
/// known
/// to a formula, and a low poly's are theirs, with a map and without.
TEST(NormalFit, LevelsAreHardWhereTheHighPolyIs) {
  const Mesh prism = test::prism_tube(9);
  const Mesh high = flat_shaded(prism);
  const std::vector<std::uint32_t> faces = {60};
  const SimplifyLevels levels(high, faces, LevelRule::shape);
  EXPECT_LT(off(levels.mesh(0), high), 0.5);
  Mesh mapped = unwrap(levels.mesh(0));
  levels.fit_normals(mapped);
  EXPECT_LT(off(mapped, high), 0.5);
  for (const Mesh& rough : levels.draft_meshes(0)) EXPECT_LT(off(rough, high), 0.5);
  // Sides of 15 turn by 24 degrees.
  const Mesh finer = flat_shaded(test::prism_tube(15));
  EXPECT_LT(off(fit_normals(unwrap(test::prism_tube(15)), finer), finer), 0.5);
  // Not where it is smooth: each place has one normal.
  Mesh smooth = fit_normals(prism, prism, {.purpose = NormalPurpose::shading});
  const SimplifyLevels round(smooth, faces, LevelRule::shape);
  const Mesh level = round.mesh(0);
  EXPECT_EQ(split_vertices(level), level.positions.size());
}

TEST(NormalFit, SmoothShapesHaveNoCreases) {
  const Mesh high = test::BumpySphere::dense(20000);
  const Mesh low = unwrap(simplify(high, {.faces = 800, .fit_normals = false}));
  const Mesh usual = fit_normals(low, high, {.purpose = NormalPurpose::shading});
  const Mesh creased = fit_normals(
      low, high, {.crease_degrees = kShadingCreaseDegrees, .purpose = NormalPurpose::shading});
  EXPECT_EQ(creased.normals, usual.normals);
  EXPECT_EQ(creased.normal_triangles, usual.normal_triangles);
}

TEST(NormalFans, RowsWithoutADirectionPointUp) {
  Normals normals(5, 3);
  normals << 0, -3, 4, 0, 0, 0, NAN, 1, 0, HUGE_VAL, 0, 0, 1e-200, 0, 0;
  normalize(normals);
  const Normals up = (Normals(1, 3) << 0, 0, 1).finished();
  EXPECT_NEAR(normals(0, 1), -0.6, 1e-15);
  EXPECT_NEAR(normals(0, 2), 0.8, 1e-15);
  for (const Eigen::Index row : {1, 2, 3}) EXPECT_EQ(normals.row(row), up.row(0)) << row;
  EXPECT_TRUE(normals.row(4).norm() == 1);
}

// Two triangles that are one chart at one end of their common edge, and part at the other, as a dart does.
TEST(NormalFans, AnEdgeWhoseUvsDifferAtOneEndIsASeam) {
  Mesh low;
  low.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  low.triangles = {{0, 1, 2}, {0, 2, 3}};
  low.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.9F, 1}};
  const Normals same = Normals::Constant(6, 3, 1.0).rowwise().normalized();
  const auto fans_of = [&](const std::vector<Triangle>& uvs) {
    low.uv_triangles = uvs;
    return NormalFans(low, {});
  };
  EXPECT_EQ(fans_of({{0, 1, 2}, {0, 2, 3}}).count_split_edges(), 0U);
  for (const bool at_second : {true, false}) {
    SCOPED_TRACE(at_second);
    const std::vector<Triangle> uvs = at_second ? std::vector<Triangle>{{0, 1, 2}, {0, 4, 3}}
                                                : std::vector<Triangle>{{0, 1, 2}, {4, 2, 3}};
    NormalFans fans = fans_of(uvs);
    const std::vector<std::uint32_t> slots = fans.normal_of_corner();
    EXPECT_EQ(fans.count_split_edges(), 1U);
    EXPECT_EQ(fans.count(), 5U) << "they share the normal of the other end";
    EXPECT_EQ(slots[0] == slots[3], at_second);
    EXPECT_EQ(slots[2] == slots[4], !at_second);
    // It is a seam of UVs and no crease: creases' angle does not join it, that of seams does.
    constexpr double kNever = 2, kAlways = -2;
    fans.soften(same, slots, kNever, kAlways);
    EXPECT_EQ(fans.count_split_edges(), 1U);
    fans.soften(same, slots, kAlways, kNever);
    EXPECT_EQ(fans.count_split_edges(), 0U);
    fans.normal_of_corner();
    EXPECT_EQ(fans.count(), 4U);
    // Normals that part at the open end alone keep it.
    NormalFans open = fans_of(uvs);
    Normals parted = same;
    parted.row(slots[at_second ? 4 : 3]) *= -1;
    open.soften(parted, open.normal_of_corner(), 0.5, 0.5);
    EXPECT_EQ(open.count_split_edges(), 1U);
  }
}

/// The option, its value and its range are said.
TEST(FitNormals, SaysWhatIsOutOfRange) {
  const Mesh mesh = test::plane(1, 1);
  const auto error_of = [&](double hard, double crease, const Mesh& high) -> std::string {
    FitNormalsOptions options;
    options.hard_degrees = hard;
    options.crease_degrees = crease;
    try {
      (void)fit_normals(mesh, high, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::string rule = "; it must be between 0 and 180";
  EXPECT_EQ(error_of(-1, 30, mesh), "fit_normals: hard_degrees is -1" + rule);
  EXPECT_EQ(error_of(181, 30, mesh), "fit_normals: hard_degrees is 181" + rule);
  EXPECT_EQ(error_of(30, -2, mesh), "fit_normals: crease_degrees is -2" + rule);
  EXPECT_EQ(error_of(30, 182, mesh), "fit_normals: crease_degrees is 182" + rule);
  EXPECT_EQ(error_of(0, 180, mesh), "");
  EXPECT_EQ(error_of(180, 0, mesh), "");
}

}  // namespace
}  // namespace kiln

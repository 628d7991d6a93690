// Holes of many edges, filled up to a size.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "clean/triangle_list.h"
#include "kiln/clean.h"
#include "mesh/weld.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();

/// Keeps triangles whose middle a function accepts.
template <typename Keep>
Mesh cut(Mesh mesh, const Keep& keep) {
  std::vector<std::uint8_t> dropped;
  for (const Triangle& t : mesh.triangles) {
    Vec3d middle{};
    for (const std::uint32_t v : t) middle += point_of(mesh, v) * (1.0 / 3);
    dropped.push_back(keep(middle) ? 0 : 1);
  }
  drop_triangles(mesh, dropped);
  return mesh;
}

std::size_t open_edges(const Mesh& mesh) {
  return open_sides(welded_triangles(mesh), mesh.positions.size()).size();
}

/// Each edge has two triangles, which face alike.
void expect_closed(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : welded_triangles(mesh)) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1) << side.first << " " << side.second;
    EXPECT_EQ(sides.count({side.second, side.first}), 1U) << side.first << " " << side.second;
  }
}

/// Only repairs of holes, so that nothing else changes the count of triangles.
CleanOptions holes_up_to(double size) {
  CleanOptions options;
  options.windings_alone = true;
  options.fill_holes = size;
  return options;
}

/// A ball of radius 1 without its cap around +Z. \param degrees  from the cap's middle to its rim
Mesh open_ball(double degrees, std::uint32_t levels = 5) {
  const double height = std::cos(degrees * std::numbers::pi / 180);
  return cut(test::icosphere(levels), [&](const Vec3d& p) { return p.z < height; });
}

/// Largest distance of a patch's vertices from the unit ball.
double distance_from_ball(const Mesh& mesh, std::size_t first) {
  double most = 0;
  for (std::size_t v = first; v < mesh.positions.size(); ++v) {
    most = std::max(most, std::abs(length(point_of(mesh, static_cast<std::uint32_t>(v))) - 1));
  }
  return most;
}

TEST(LargeHoles, PatchesContinueABall) {
  // Degrees, and the largest distance from the ball, a share of its radius.
  const std::vector<std::pair<double, double>> cases = {
      {10, 0.005}, {20, 0.01}, {30, 0.015}, {45, 0.035}, {60, 0.065}};
  for (const auto& [degrees, most] : cases) {
    Mesh ball = open_ball(degrees);
    const std::size_t before = ball.positions.size();
    const CleanReport report = clean_mesh(ball, holes_up_to(1));
    EXPECT_EQ(report.large_holes.count, 1U);
    EXPECT_EQ(report.flat_holes, 0U);
    EXPECT_EQ(report.open_rims.count, 0U);
    EXPECT_EQ(report.open_edges.count, 0U);
    EXPECT_GT(ball.positions.size(), before);
    EXPECT_LE(distance_from_ball(ball, before), most) << degrees;
    expect_closed(ball);
  }
}

/// Edges of a patch are as long as the rim's, plus 0.3 of their distance from it: within a disc of radius 1, whose rim has
/// edges of length h, about the integral of 1 / (sqrt(3) / 2 (h + 0.3 d)^2) vertices.
TEST(LargeHoles, EdgesGrowWithTheDistanceFromTheRim) {
  constexpr std::uint32_t kSides = 100;
  const double edge = 2 * std::sin(std::numbers::pi / kSides), growth = 0.3;
  Mesh sheet;
  for (const double radius : {1.0, 1 + edge, 1 + 2 * edge}) {
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      sheet.positions.push_back(
          to_float(Vec3d{radius * std::cos(angle), radius * std::sin(angle), 0}));
    }
  }
  for (std::uint32_t i = 0; i < 2 * kSides; ++i) {
    const std::uint32_t next = i % kSides + 1 == kSides ? i + 1 - kSides : i + 1;
    sheet.triangles.push_back({i, i + kSides, next + kSides});
    sheet.triangles.push_back({i, next + kSides, next});
  }
  const std::size_t triangles = sheet.triangles.size(), vertices = sheet.positions.size();
  ASSERT_EQ(clean_mesh(sheet, holes_up_to(1)).large_holes.count, 1U);
  const double sum = edge + growth;
  const double integral =
      ((1 + edge / growth) * (1 / edge - 1 / sum) - std::log(sum / edge) / growth) / growth;
  const double expected = 2 * std::numbers::pi * integral / (std::sqrt(3.0) / 2);
  EXPECT_NEAR(static_cast<double>(sheet.positions.size() - vertices), expected, 0.3 * expected);
  double mean = 0;
  for (std::size_t t = triangles; t < sheet.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = point_of(sheet, sheet.triangles[t][k]),
                  b = point_of(sheet, sheet.triangles[t][(k + 1) % 3]);
      const double wanted = edge + growth * (1 - length((a + b) * 0.5));
      mean +=
          length(b - a) / wanted / (3.0 * static_cast<double>(sheet.triangles.size() - triangles));
    }
  }
  EXPECT_NEAR(mean, 1, 0.2);
}

/// Noise of a scan, a tenth of an edge, does not tear the patch out of shape.
TEST(LargeHoles, PatchesContinueANoisyScan) {
  Mesh ball = open_ball(35);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> off(-0.004F, 0.004F);
  for (Vec3& p : ball.positions) p = {p.x + off(random), p.y + off(random), p.z + off(random)};
  const std::size_t before = ball.positions.size();
  clean_mesh(ball, holes_up_to(1));
  EXPECT_LE(distance_from_ball(ball, before), 0.04);
  expect_closed(ball);
}

/// The values of a linear function on the rim are those of the patch, too: colours follow what is around.
TEST(LargeHoles, ColoursComeFromTheRim) {
  Mesh ball = open_ball(40);
  for (const Vec3& p : ball.positions) {
    ball.colors.push_back({static_cast<std::uint8_t>(127 + 100 * p.x),
                           static_cast<std::uint8_t>(127 + 100 * p.y), 60, 200});
  }
  const std::size_t before = ball.positions.size();
  clean_mesh(ball, holes_up_to(1));
  ASSERT_GT(ball.positions.size(), before);
  ASSERT_EQ(ball.colors.size(), ball.positions.size());
  for (std::size_t v = before; v < ball.positions.size(); ++v) {
    EXPECT_NEAR(ball.colors[v][0], 127 + 100 * ball.positions[v].x, 12);
    EXPECT_NEAR(ball.colors[v][1], 127 + 100 * ball.positions[v].y, 12);
    EXPECT_NEAR(ball.colors[v][2], 60, 1);
    EXPECT_EQ(ball.colors[v][3], 200);
  }
}

/// Materials, groups, UVs and normals are complete; UVs are those of the rim.
TEST(LargeHoles, AttributesComeFromTheRim) {
  Mesh ball = test::uv_sphere(48, 24);
  ball = cut(ball, [](const Vec3d& p) { return !(p.x > 0.8); });
  ball.material_names = {"left", "right"};
  for (const Triangle& t : ball.triangles) {
    ball.materials.push_back(ball.positions[t[0]].y > 0 ? 1 : 0);
  }
  ASSERT_FALSE(ball.uvs.empty());
  const std::size_t triangles = ball.triangles.size(), uvs = ball.uvs.size();
  std::set<std::uint32_t> rim;
  const std::vector<Triangle> corners = welded_triangles(ball);
  for (const std::uint32_t side : open_sides(corners, ball.positions.size())) {
    rim.insert(ball.uv_triangles[side / 3][side % 3]);
  }
  clean_mesh(ball, holes_up_to(1));
  ASSERT_GT(ball.triangles.size(), triangles);
  EXPECT_EQ(ball.uvs.size(), uvs);
  EXPECT_EQ(ball.uv_triangles.size(), ball.triangles.size());
  EXPECT_EQ(ball.materials.size(), ball.triangles.size());
  if (!ball.normal_triangles.empty()) {
    EXPECT_EQ(ball.normal_triangles.size(), ball.triangles.size());
  }
  for (std::size_t t = triangles; t < ball.triangles.size(); ++t) {
    for (const std::uint32_t uv : ball.uv_triangles[t]) EXPECT_TRUE(rim.contains(uv));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 &from = ball.uvs[ball.uv_triangles[t][k]],
                 &to = ball.uvs[ball.uv_triangles[t][(k + 1) % 3]];
      // Opposite sides of the rim are 0.2 apart or more, and the texture's seam crosses it.
      EXPECT_LT(std::hypot(from.x - to.x, from.y - to.y), 0.18);
    }
    double y = 0;
    for (const std::uint32_t v : ball.triangles[t]) y += ball.positions[v].y;
    if (std::abs(y) > 0.6) EXPECT_EQ(ball.materials[t], y > 0 ? 1U : 0U);
  }
}

/// For each vertex of the patches that follow the first `triangles` triangles, the corner of the rim that is nearest along
/// their edges.
std::map<std::uint32_t, std::uint32_t> nearest_rim_corners(const Mesh& mesh, std::size_t triangles,
                                                           std::size_t vertices) {
  std::map<std::uint32_t, std::pair<double, std::uint32_t>> reached;
  for (std::size_t t = triangles; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v < vertices) reached[v] = {0, v};
    }
  }
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (std::size_t t = triangles; t < mesh.triangles.size(); ++t) {
      for (const std::uint32_t a : mesh.triangles[t]) {
        if (!reached.contains(a)) continue;
        for (const std::uint32_t b : mesh.triangles[t]) {
          const double way = reached[a].first + length(point_of(mesh, b) - point_of(mesh, a));
          const auto found = reached.find(b);
          if (found != reached.end() && found->second.first <= way) continue;
          reached[b] = {way, reached[a].second};
          has_changed = true;
        }
      }
    }
  }
  std::map<std::uint32_t, std::uint32_t> nearest;
  for (const auto& [v, from] : reached) nearest[v] = from.second;
  return nearest;
}

/// A triangle has the attributes of the face at a corner of the rim that one of its vertices is nearest to, whatever list
/// holds them, and a vertex the alpha of its corner.
TEST(LargeHoles, AttributesAreThoseOfTheNearestCorner) {
  Mesh ball = open_ball(40, 4);
  std::mt19937 random(2);  // no two corners are as near
  std::uniform_real_distribution<float> off(-0.004F, 0.004F);
  for (Vec3& p : ball.positions) p = {p.x + off(random), p.y + off(random), p.z + off(random)};
  const std::size_t triangles = ball.triangles.size(), vertices = ball.positions.size();
  for (std::uint32_t t = 0; t < triangles; ++t) {
    for (auto* list : {&ball.groups, &ball.objects, &ball.materials, &ball.polygons})
      list->push_back(t);
    ball.tangents.insert(ball.tangents.end(), 3, {.direction = {1, 0, 0}});
  }
  for (auto* names : {&ball.group_names, &ball.object_names, &ball.material_names})
    names->resize(triangles);
  for (std::uint32_t v = 0; v < vertices; ++v)
    ball.colors.push_back({0, 0, 0, static_cast<std::uint8_t>(v % 251)});
  std::map<std::uint32_t, std::uint32_t> face_at;
  for (const std::uint32_t side : open_sides(ball.triangles, vertices))
    face_at[ball.triangles[side / 3][side % 3]] = side / 3;
  clean_mesh(ball, holes_up_to(1));
  ASSERT_GT(ball.triangles.size(), triangles);
  ASSERT_EQ(ball.positions.size(), ball.colors.size());
  const auto nearest = nearest_rim_corners(ball, triangles, vertices);
  for (std::size_t t = triangles; t < ball.triangles.size(); ++t) {
    const Triangle& v = ball.triangles[t];
    const std::uint32_t a = nearest.at(v[0]), b = nearest.at(v[1]), c = nearest.at(v[2]);
    const std::set<std::uint32_t> faces{face_at.at(a), face_at.at(b), face_at.at(c)};
    EXPECT_TRUE(faces.contains(ball.groups[t])) << t;
    EXPECT_EQ(ball.objects[t], ball.groups[t]);
    EXPECT_EQ(ball.materials[t], ball.groups[t]);
    EXPECT_EQ(ball.polygons[t], t) << "each is a polygon of its own";
  }
  EXPECT_EQ(ball.tangents.size(), 3 * ball.triangles.size());
  for (auto v = static_cast<std::uint32_t>(vertices); v < ball.positions.size(); ++v)
    EXPECT_EQ(ball.colors[v][3], nearest.at(v) % 251) << v;
}

/// Wherever a rim begins, no triangle spans a seam of UVs.
TEST(LargeHoles, UVsEndAtSeamsWhereverARimBegins) {
  const Mesh given = cut(test::uv_sphere(32, 16), [](const Vec3d& p) { return !(p.x > 0.8); });
  const std::size_t triangles = given.triangles.size();
  const std::vector<Triangle> corners = welded_triangles(given);
  const auto vertices = static_cast<std::uint32_t>(given.positions.size());
  for (const std::uint32_t side : open_sides(corners, vertices)) {
    // This vertex is the first one.
    const std::uint32_t first = corners[side / 3][side % 3];
    Mesh ball = given;
    std::rotate(ball.positions.begin(), ball.positions.begin() + first, ball.positions.end());
    for (Triangle& t : ball.triangles) {
      for (std::uint32_t& v : t) v = (v + vertices - first) % vertices;
    }
    clean_mesh(ball, holes_up_to(1));
    ASSERT_GT(ball.triangles.size(), triangles);
    for (std::size_t t = triangles; t < ball.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2 &from = ball.uvs[ball.uv_triangles[t][k]],
                   &to = ball.uvs[ball.uv_triangles[t][(k + 1) % 3]];
        EXPECT_LT(std::hypot(from.x - to.x, from.y - to.y), 0.25) << side;
      }
    }
  }
}

/// Walls at a right angle get a lid within their plane.
TEST(LargeHoles, ABoxGetsAFlatLid) {
  Mesh box = test::plane(8, 8);
  const auto place = [](Mesh side, const auto& to) {
    for (Vec3& p : side.positions) p = to(p);
    side.uvs.clear();
    side.uv_triangles.clear();
    side.normals.clear();
    side.normal_triangles.clear();
    return side;
  };
  // The plane lies in x and y around 0, and faces +Z.
  const std::vector<Mesh> sides = {place(box,
                                         [](const Vec3& p) {
                                           return Vec3{-p.x, p.y, -0.5F};
                                         }),
                                   place(box,
                                         [](const Vec3& p) {
                                           return Vec3{0.5F, p.x, p.y};
                                         }),
                                   place(box,
                                         [](const Vec3& p) {
                                           return Vec3{-0.5F, -p.x, p.y};
                                         }),
                                   place(box,
                                         [](const Vec3& p) {
                                           return Vec3{-p.x, 0.5F, p.y};
                                         }),
                                   place(box, [](const Vec3& p) {
                                     return Vec3{p.x, -0.5F, p.y};
                                   })};
  Mesh open = join_meshes(sides);
  ASSERT_EQ(open_edges(open), 32U);
  const std::size_t triangles = open.triangles.size();
  const CleanReport report = clean_mesh(open, holes_up_to(1));
  EXPECT_EQ(report.large_holes.count, 1U);
  EXPECT_EQ(report.flat_holes, 1U);
  EXPECT_EQ(open_edges(open), 0U);
  expect_closed(open);
  double area = 0;
  for (std::size_t t = triangles; t < open.triangles.size(); ++t) {
    area += area_of(open, open.triangles[t]);
    for (const std::uint32_t v : open.triangles[t]) EXPECT_EQ(open.positions[v].z, 0.5F);
  }
  EXPECT_NEAR(area, 1, 1e-6);
}

/// A rim of 1 by 0.1, with the sheet going on at one pair of its sides and walls at the other: the longer pair decides
/// whether its patch is a lid.
TEST(LargeHoles, FacesCountByTheEdgesTheyHaveAtTheRim) {
  for (const bool long_sides_go_on : {true, false}) {
    const float x = long_sides_go_on ? 1 : 0.1F, y = long_sides_go_on ? 0.1F : 1;
    Mesh mesh;
    const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.triangles.push_back({first, first + 2, first + 3});
    };
    add({0, -1, 0}, {x, -1, 0}, {x, 0, 0}, {0, 0, 0});
    add({0, y, 0}, {x, y, 0}, {x, y + 1, 0}, {0, y + 1, 0});
    add({x, 0, 0}, {x, 0, -1}, {x, y, -1}, {x, y, 0});
    add({0, y, 0}, {0, y, -1}, {0, 0, -1}, {0, 0, 0});
    const CleanReport report = clean_mesh(mesh, holes_up_to(0.5));
    EXPECT_EQ(report.large_holes.count, 1U);
    EXPECT_EQ(report.flat_holes, long_sides_go_on ? 0U : 1U);
  }
}

/// A ring of four faces, whose upper and lower hole have two corners in common: both patches would have an edge between
/// them, of which one is split.
TEST(LargeHoles, PatchesDoNotShareEdges) {
  Mesh ring;
  ring.positions = {{-0.5F, 0, 0}, {0.5F, 0, 0},  {0, 1, 0.3F},
                    {0, -1, 0.3F}, {0, 1, -0.3F}, {0, -1, -0.3F}};
  ring.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 5}, {3, 0, 5}};
  EXPECT_EQ(clean_mesh(ring, holes_up_to(1)).large_holes.count, 2U);
  expect_closed(ring);
}

TEST(LargeHoles, LargerOnesStayOpen) {
  const Mesh ball = cut(test::icosphere(5), [](const Vec3d& p) {
    return p.z < 0.9 && p.x < 0.97;  // boxes of 36% and 20% of the diagonal
  });
  Mesh both = ball, smaller = ball, none = ball;
  const CleanReport of_both = clean_mesh(both, holes_up_to(0.4));
  EXPECT_EQ(of_both.large_holes.count, 2U);
  EXPECT_NEAR(of_both.largest_hole, 0.36, 0.02);
  // The largest one is reported, whichever is filled first.
  for (const bool mirrored : {false, true}) {
    for (const bool reversed : {false, true}) {
      Mesh other = ball;
      if (reversed) std::reverse(other.triangles.begin(), other.triangles.end());
      if (mirrored) {
        std::reverse(other.positions.begin(), other.positions.end());
        const auto last = static_cast<std::uint32_t>(other.positions.size() - 1);
        for (Triangle& t : other.triangles) t = {last - t[0], last - t[1], last - t[2]};
      }
      EXPECT_NEAR(clean_mesh(other, holes_up_to(0.4)).largest_hole, 0.36, 0.02);
    }
  }
  const CleanReport report = clean_mesh(smaller, holes_up_to(0.25));
  EXPECT_EQ(report.large_holes.count, 1U);
  EXPECT_EQ(report.open_rims.count, 1U);
  EXPECT_EQ(report.open_edges.count, open_edges(smaller));
  EXPECT_GT(report.open_edges.count, 12U);
  ASSERT_EQ(report.warnings.size(), 2U);
  EXPECT_EQ(report.warnings[0].code, "filled-large-holes");
  EXPECT_EQ(report.warnings[1].code, "open-holes");
  EXPECT_NEAR(report.largest_hole, 0.2, 0.02);
  EXPECT_EQ(clean_mesh(none, holes_up_to(0.05)).large_holes.count, 0U);
  EXPECT_EQ(none.triangles.size(), ball.triangles.size());
}

/// Two holes that share a vertex are two holes.
TEST(LargeHoles, RimsThatTouchAreParted) {
  const Mesh grid = test::plane(24, 24);
  // Two squares of 6 x 6 cells, corner to corner in the middle.
  Mesh eight = cut(grid, [](const Vec3d& p) {
    const bool low = p.x < 0 && p.x > -0.25 && p.y < 0 && p.y > -0.25;
    const bool high = p.x > 0 && p.x < 0.25 && p.y > 0 && p.y < 0.25;
    return !low && !high;
  });
  const CleanReport report = clean_mesh(eight, holes_up_to(0.5));
  EXPECT_EQ(report.large_holes.count, 2U);
  EXPECT_EQ(report.open_rims.count, 1U) << "the outline of the sheet";
  EXPECT_EQ(open_edges(eight), 96U);
  double area = 0;
  for (const Triangle& t : eight.triangles) area += area_of(eight, t);
  EXPECT_NEAR(area, 1, 1e-6);
}

/// Two holes that touch at two vertices, a hook and a square in its mouth, are told apart by the way round the vertex.
TEST(LargeHoles, RimsThatTouchTwiceAreParted) {
  const std::set<std::pair<int, int>> hook = {{0, 0}, {0, -1}, {1, -1}, {2, -1}, {3, -1},
                                              {3, 0}, {3, 1},  {3, 2},  {2, 2}};
  Mesh touching = cut(test::plane(24, 24), [&](const Vec3d& p) {
    const std::pair<int, int> cell{static_cast<int>(std::floor(8 * (p.x + 0.25))),
                                   static_cast<int>(std::floor(8 * (p.y + 0.25))) - 1};
    return !hook.contains(cell) && cell != std::pair(1, 1);
  });
  EXPECT_EQ(clean_mesh(touching, holes_up_to(0.5)).large_holes.count, 2U);
  EXPECT_EQ(open_edges(touching), 96U);
  double area = 0;
  for (const Triangle& t : touching.triangles) area += area_of(touching, t);
  EXPECT_NEAR(area, 1, 1e-6);
}

/// A face that sticks into a hole has two open edges: a patch beside its third one would double it.
TEST(LargeHoles, FacesThatStickIntoAHoleAreNotDoubled) {
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U, 5U}) {
    std::mt19937 random(seed);
    Mesh ball = cut(test::icosphere(4),
                    [&](const Vec3d& p) { return p.z < 0.75 || (p.z < 0.9 && random() % 2 == 0); });
    const CleanReport report = clean_mesh(ball, holes_up_to(kAll));
    EXPECT_EQ(report.open_edges.count, open_edges(ball));
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Triangle& t : welded_triangles(ball)) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax({t[k], t[(k + 1) % 3]});
        ++edges[{low, high}];
      }
    }
    for (const auto& [edge, count] : edges) EXPECT_LE(count, 2) << seed;
  }
}

/// Outlines of sheets are no holes; "all" closes those that enclose a volume.
TEST(LargeHoles, OutlinesOfSheetsStay) {
  Mesh leaf = test::plane(16, 16);
  for (Vec3& p : leaf.positions) p.z = 0.2F * (p.x * p.x + p.y * p.y);
  Mesh flat = test::plane(16, 16), closed = leaf;
  const std::size_t triangles = leaf.triangles.size();
  EXPECT_EQ(clean_mesh(leaf, holes_up_to(1)).open_rims.count, 1U);
  EXPECT_EQ(leaf.triangles.size(), triangles);
  EXPECT_EQ(clean_mesh(flat, holes_up_to(kAll)).open_rims.count, 1U);
  EXPECT_EQ(flat.triangles.size(), triangles);
  const CleanReport report = clean_mesh(closed, holes_up_to(kAll));
  EXPECT_EQ(report.open_edges.count, 0U);
  EXPECT_EQ(report.flat_holes, 1U);
  expect_closed(closed);
}

/// Holes of soups, whose vertices are split, are closed at their places.
TEST(LargeHoles, SoupsAreFilled) {
  const Mesh ball = open_ball(30, 4);
  Mesh soup;
  for (const Triangle& t : ball.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.positions.size());
    for (const std::uint32_t v : t) soup.positions.push_back(ball.positions[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const CleanReport report = clean_mesh(soup, holes_up_to(1));
  EXPECT_EQ(report.large_holes.count, 1U);
  EXPECT_EQ(open_edges(soup), 0U);
}

TEST(LargeHoles, NothingChangesWithoutHoles) {
  Mesh ball = test::icosphere(3);
  const Mesh before = ball;
  EXPECT_TRUE(clean_mesh(ball, holes_up_to(kAll)).warnings.empty());
  EXPECT_EQ(ball.triangles, before.triangles);
  EXPECT_THROW(clean_mesh(ball, holes_up_to(-0.1)), Error);
  EXPECT_THROW(clean_mesh(ball, holes_up_to(1.5)), Error);
}

}  // namespace
}  // namespace kiln

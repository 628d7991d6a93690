// Repairs of meshes as generators and scanners leave them.
#include "kiln/clean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "clean/outside_views.h"
#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "kiln/limits.h"
#include "kiln/simplify.h"
#include "kiln/validate.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"
#include "support/shapes.h"

namespace kiln {
namespace {

void move(Mesh& mesh, const Vec3& by) {
  for (Vec3& p : mesh.positions) p = {p.x + by.x, p.y + by.y, p.z + by.z};
}

void turn(Mesh& mesh, std::size_t t) {
  for (std::vector<Triangle>* corners :
       {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
    if (!corners->empty()) std::swap((*corners)[t][1], (*corners)[t][2]);
  }
}
Mesh turned(Mesh mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) turn(mesh, t);
  return mesh;
}

Mesh join(std::vector<Mesh> meshes) { return join_meshes(meshes); }

std::size_t open_edges(const Mesh& mesh) {
  return open_sides(welded_triangles(mesh), mesh.positions.size()).size();
}

/// Three vertices a triangle, each moved by up to so much along each axis.
Mesh soup(const Mesh& mesh, double noise) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-noise, noise);
  Mesh result = mesh;
  result.positions.clear();
  result.colors.clear();
  for (Triangle& t : result.triangles) {
    for (std::uint32_t& v : t) {
      const Vec3 p = mesh.positions[v];
      v = static_cast<std::uint32_t>(result.positions.size());
      const double x = p.x + off(random), y = p.y + off(random), z = p.z + off(random);
      result.positions.push_back(
          {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  }
  return result;
}

Mesh without(const Mesh& mesh, const std::vector<std::size_t>& triangles) {
  std::vector<std::uint8_t> dropped(mesh.triangles.size(), 0);
  for (const std::size_t t : triangles) dropped[t] = 1;
  Mesh result = mesh;
  drop_triangles(result, dropped);
  return result;
}

void expect_same(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.uvs, b.uvs);
  EXPECT_EQ(a.uv_triangles, b.uv_triangles);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.normal_triangles, b.normal_triangles);
  EXPECT_EQ(a.groups, b.groups);
  EXPECT_EQ(a.polygons, b.polygons);
}

TEST(Clean, SoundMeshesStayToTheBit) {
  Mesh beside = test::icosphere(3);
  move(beside, {2.5F, 0, 0});
  Mesh two_sides = test::plane(6, 6);
  const std::vector<Mesh> sound = {test::tetrahedron(),
                                   test::cube(),
                                   test::plane(9, 5),
                                   test::icosphere(4),
                                   test::uv_sphere(24, 12),
                                   test::torus(40, 20),
                                   join({test::icosphere(3), beside}),
                                   join({two_sides, turned(two_sides)})};
  for (const Mesh& mesh : sound) {
    Mesh cleaned = mesh;
    const CleanReport report = clean_mesh(cleaned);
    expect_same(mesh, cleaned);
    EXPECT_TRUE(report.warnings.empty());
  }
}

/// Triangles of a point each: alone, and on all sides of a sound mesh.
TEST(Clean, PartsOfNoExtentAreNoFloaters) {
  for (const bool sound : {false, true}) {
    Mesh mesh = sound ? test::BumpySphere::light() : Mesh();
    mesh.uvs.clear();
    mesh.uv_triangles.clear();
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    const std::size_t before = mesh.triangles.size();
    for (const float at : {-9.F, 9.F}) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.insert(mesh.positions.end(), 3, {at, at, at});
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
    EXPECT_NO_THROW(clean_mesh(mesh));
    EXPECT_GE(mesh.triangles.size(), before);
  }
}

TEST(Clean, NoiseOfRoundingIsWelded) {
  const Mesh sphere = test::icosphere(5);  // Edges of about 0.03, a diagonal of 3.5.
  Mesh mesh = soup(sphere, 3e-7);
  EXPECT_EQ(open_edges(mesh), 3 * sphere.triangles.size());
  const CleanReport report = clean_mesh(mesh);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(mesh.triangles.size(), sphere.triangles.size());
  // All but one vertex of each place, but for those that rounding left in place.
  EXPECT_GT(report.welded.count, 3 * sphere.triangles.size() / 2);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_EQ(report.warnings[0].code, "welded-vertices");
  EXPECT_EQ(report.warnings[0].count, report.welded.count);
}

TEST(Clean, SeamsKeepBothOfTheirUVs) {
  const Mesh sphere = test::uv_sphere(32, 16);
  Mesh mesh = soup(sphere, 3e-7);
  clean_mesh(mesh);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(mesh.uvs, sphere.uvs);
  EXPECT_EQ(mesh.uv_triangles, sphere.uv_triangles);
}

TEST(Clean, FineDetailIsNotWelded) {
  // A strip of edges below the tolerance: a quarter of them is the most that a vertex may move.
  Mesh strip = test::plane(1000, 1, 1, 1e-6);
  const Mesh before = strip;
  EXPECT_EQ(clean_mesh(strip).welded.count, 0U);
  expect_same(before, strip);
}

TEST(Clean, RepeatedAndFlatTrianglesAreLeftOut) {
  const Mesh sphere = test::icosphere(3);
  Mesh mesh = sphere;
  for (std::size_t t = 100; t < 140; ++t) {
    const Triangle& v = sphere.triangles[t];
    mesh.triangles.push_back({v[1], v[2], v[0]});
  }
  mesh.triangles.push_back({7, 7, 9});
  for (auto* list : {&mesh.uv_triangles, &mesh.normal_triangles}) {
    if (!list->empty()) list->resize(mesh.triangles.size(), {0, 0, 0});
  }
  const CleanReport report = clean_mesh(mesh);
  EXPECT_EQ(report.duplicates.count, 40U);
  EXPECT_EQ(report.degenerate.count, 1U);
  EXPECT_EQ(mesh.triangles, sphere.triangles);
}

TEST(Clean, FinsGoAndWallsStay) {
  const Mesh sphere = test::icosphere(5);
  Mesh mesh = sphere;
  for (std::size_t t = 0; t < 200; t += 10) {
    const auto tip = static_cast<std::uint32_t>(mesh.positions.size());
    const Triangle& v = sphere.triangles[t];
    const Vec3& p = sphere.positions[v[0]];
    mesh.positions.push_back({p.x * 1.005F, p.y * 1.005F, p.z * 1.005F});
    mesh.triangles.push_back({v[1], v[2], tip});
  }
  const CleanReport report = clean_mesh(mesh, {.floater = 0.03});
  EXPECT_EQ(report.fins.count, 20U);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_EQ(report.warnings[0].code, "dropped-fins");
  EXPECT_EQ(mesh.triangles, sphere.triangles);
  EXPECT_EQ(mesh.positions, sphere.positions);
  // Two sheets that meet in a line of a third one.
  Mesh walls = test::plane(10, 10);
  const std::size_t count = walls.triangles.size();
  for (std::size_t t = 0; t < count; ++t) {
    Triangle corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = walls.positions[walls.triangles[t][k]];
      corners[k] = static_cast<std::uint32_t>(walls.positions.size());
      walls.positions.push_back({0, p.y, p.x + 0.5F});
    }
    walls.triangles.push_back(corners);
  }
  walls.uvs.clear(), walls.uv_triangles.clear();
  walls.normals.clear(), walls.normal_triangles.clear();
  const Mesh before = walls;
  EXPECT_EQ(clean_mesh(walls).fins.count, 0U);
  EXPECT_EQ(walls.triangles.size(), before.triangles.size());
}

/// A face at an edge of two others is no fin where more than three faces share another of its edges: what is crowded
/// there is intended.
TEST(Clean, FacesOfCrowdedEdgesAreNoFins) {
  for (const std::uint32_t others : {0U, 1U, 2U, 3U, 4U}) {
    const Mesh sphere = test::icosphere(5);
    Mesh mesh = sphere;
    const Triangle& v = sphere.triangles[0];
    const auto raised = [&](const Vec3& p, float by) {
      mesh.positions.push_back({p.x * (1 + by), p.y * (1 + by), p.z * (1 + by)});
      return static_cast<std::uint32_t>(mesh.positions.size() - 1);
    };
    const std::uint32_t tip = raised(sphere.positions[v[0]], 0.005F);
    mesh.triangles.push_back({v[1], v[2], tip});
    for (std::uint32_t i = 0; i < others; ++i) {
      const std::uint32_t end =
          raised(sphere.positions[v[1]], 0.004F + 0.002F * static_cast<float>(i));
      mesh.triangles.push_back({v[2], tip, end});
    }
    const CleanReport report = clean_mesh(mesh, {.floater = 0.03});
    // Two faces at the edge join to one part; three hang from it; of four or more it is crowded.
    const bool crowded = others >= 3;
    EXPECT_EQ(report.fins.count == 0, crowded) << others;
    if (crowded) EXPECT_EQ(mesh.triangles.size(), sphere.triangles.size() + 1 + others);
  }
}

/// Wavy sheets from a common line, at angles around it.
/// \param apart  the last one has vertices of its own beside the line's
Mesh leaves(const std::vector<double>& angles, float apart = 0) {
  constexpr std::uint32_t kAlong = 60, kAcross = 30;
  Mesh mesh;
  const auto add = [&](double angle, double along, double across) {
    const double bend = 0.05 * std::sin(7 * along) * across;
    const double x = across * std::cos(angle) - bend * std::sin(angle);
    const double y = across * std::sin(angle) + bend * std::cos(angle);
    mesh.positions.push_back({static_cast<float>(x + 0.02 * std::sin(5 * along)),
                              static_cast<float>(y + 0.02 * std::cos(9 * along)),
                              static_cast<float>(along)});
  };
  for (std::uint32_t i = 0; i <= kAlong; ++i) add(0, 2.0 * i / kAlong, 0);
  for (const double& angle : angles) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t j = 1; j <= kAcross; ++j) {
      for (std::uint32_t i = 0; i <= kAlong; ++i) add(angle, 2.0 * i / kAlong, 1.0 * j / kAcross);
    }
    std::uint32_t line = 0;
    if (apart > 0 && &angle == &angles.back()) {
      line = static_cast<std::uint32_t>(mesh.positions.size());
      for (std::uint32_t i = 0; i <= kAlong; ++i) {
        mesh.positions.push_back(mesh.positions[i]);
        mesh.positions.back().x += apart;
      }
    }
    const auto at = [&](std::uint32_t i, std::uint32_t j) {
      return j == 0 ? line + i : first + (j - 1) * (kAlong + 1) + i;
    };
    for (std::uint32_t j = 0; j < kAcross; ++j) {
      for (std::uint32_t i = 0; i < kAlong; ++i) {
        mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    }
  }
  return mesh;
}

/// Length of the edges that so many triangles share.
double shared_length(const Mesh& mesh, std::size_t count) {
  double sum = 0;
  SideLists(welded_triangles(mesh), mesh.positions.size())
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        if (sides.size() != count) return;
        const Triangle& corners = mesh.triangles[sides[0].index / 3];
        const std::uint32_t k = sides[0].index % 3;
        sum += length(point_of(mesh, corners[(k + 1) % 3]) - point_of(mesh, corners[k]));
      });
  return sum;
}

/// They are not split: collapses hold the edges that several sheets share as one line, and sheets with edges of their
/// own there would part.
TEST(Clean, SheetsThatMeetInALineStayJoinedWhenSimplified) {
  const double right = std::acos(0.0);
  for (const std::vector<double>& angles : {std::vector<double>{0, 2.1, 4.2},
                                            {0, right, 2 * right},
                                            {0, right, 2 * right, 3 * right}}) {
    const Mesh high = leaves(angles);
    const double line = shared_length(high, angles.size());
    EXPECT_GT(line, 2);
    Mesh cleaned = high;
    clean_mesh(cleaned, {.orient = false});
    expect_same(high, cleaned);
    const Mesh apart = leaves(angles, 1e-6F);
    for (const std::uint32_t faces : {1000U, 200U, 50U}) {
      SimplifyReport report;
      const Mesh low = simplify(cleaned, {.faces = faces}, &report);
      EXPECT_LE(low.triangles.size(), faces);
      EXPECT_GT(shared_length(low, angles.size()), 0.97 * line) << faces;
      EXPECT_EQ(report.folded + report.holes + report.without_area, 0U);
      EXPECT_LT(shared_length(simplify(apart, {.faces = faces}), angles.size()), 0.1 * line);
    }
  }
}

TEST(Clean, PatchesFaceWhereTheyAreSeen) {
  const Mesh right = test::icosphere(4);
  // Most of the sphere is flipped, so that a majority would turn the rest. (All but one patch in three.)
  for (const double share : {0.1, 0.45, 0.6}) {
    Mesh mesh = right;
    std::size_t flipped = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Vec3& p = mesh.positions[mesh.triangles[t][0]];
      if (p.z > 2 * share - 1) continue;
      turn(mesh, t);
      ++flipped;
    }
    const CleanReport report = clean_mesh(mesh);
    EXPECT_EQ(report.turned.count, flipped);
    EXPECT_EQ(mesh.triangles, right.triangles);
  }
}

/// A flap larger than all else in one piece with a body, which lacks the face that the flap hangs on.
TEST(Clean, ALargeFlapDoesNotOutweighItsBody) {
  Mesh right = test::icosphere(1);
  right.triangles[0][2] = static_cast<std::uint32_t>(right.positions.size());
  right.positions.push_back({0, 0, 80});
  Mesh mesh = right;
  turn(mesh, 0);
  EXPECT_EQ(clean_mesh(mesh, {.weld = 0, .max_hole = 0}).turned.count, 1U);
  EXPECT_EQ(mesh.triangles, right.triangles);
}

TEST(Clean, ATornPatchIsTurnedByViewsAlone) {
  // A cap that shares no vertex with the rest, and lies a little out of place.
  const Mesh sphere = test::icosphere(4);
  std::vector<std::size_t> cap, rest;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    (sphere.positions[sphere.triangles[t][0]].z > 0.8F ? cap : rest).push_back(t);
  }
  Mesh patch = without(sphere, rest);
  move(patch, {0, 0, 0.003F});
  for (const bool alone : {false, true}) {
    Mesh mesh = join({without(sphere, cap), turned(patch)});
    const CleanReport report = clean_mesh(mesh, {.windings_alone = alone});
    EXPECT_EQ(report.turned.count, cap.size());
    EXPECT_EQ(mesh.triangles, join({without(sphere, cap), patch}).triangles);
  }
  Mesh kept = join({without(sphere, cap), turned(patch)});
  EXPECT_EQ(clean_mesh(kept, {.orient = false, .weld = 0, .max_hole = 0}).turned.count, 0U);
  EXPECT_EQ(kept.triangles, join({without(sphere, cap), turned(patch)}).triangles);
}

TEST(Clean, ARoomFacesInwards) {
  Mesh room = turned(test::icosphere(4));
  Mesh chair = test::icosphere(1, 0.3);
  move(chair, {0.1F, 0.1F, 0});
  Mesh mesh = join({room, chair});
  const Mesh before = mesh;
  turn(mesh, 5);
  const CleanReport report = clean_mesh(mesh);
  EXPECT_EQ(report.turned.count, 1U);
  EXPECT_EQ(report.inward.count, 1U);
  EXPECT_EQ(report.inner.count, 0U);  // Views look through the backs of walls.
  expect_same(before, mesh);
}

/// A mesh of one part may be a room, or exported inside out: it stays, and that is told.
TEST(Clean, OnePartThatFacesInwardsIsTold) {
  const Mesh ball = test::icosphere(3);
  std::vector<std::size_t> bottom;
  for (std::size_t t = 0; t < ball.triangles.size(); ++t) {
    if (ball.positions[ball.triangles[t][0]].z < -0.8F) bottom.push_back(t);
  }
  for (const Mesh& outward : {ball, without(ball, bottom)}) {
    const Mesh inside_out = turned(outward);
    Mesh mesh = inside_out;
    const CleanReport report = clean_mesh(mesh);
    expect_same(inside_out, mesh);
    EXPECT_EQ(report.inward.count, 1U);
    ASSERT_EQ(report.warnings.size(), 1U);
    EXPECT_EQ(report.warnings[0].code, "faces-inwards");
    mesh = outward;
    EXPECT_TRUE(clean_mesh(mesh).warnings.empty());
    // With a low poly given, that the high poly faces inwards is told of both.
    mesh = inside_out;
    EXPECT_TRUE(clean_mesh(mesh, {.windings_alone = true}).warnings.empty());
  }
}

TEST(Clean, OpenSheetsSeenFromBothSidesStay) {
  Mesh other = test::plane(8, 8);
  move(other, {0, 0, 3});
  Mesh mesh = join({test::plane(8, 8), turned(other)});
  const Mesh before = mesh;
  EXPECT_EQ(clean_mesh(mesh).turned.count, 0U);
  expect_same(before, mesh);
}

/// A tube around z, open at both ends, whose faces look outwards.
void add_tube(Mesh& mesh, float radius, float half_length) {
  constexpr std::uint32_t kSides = 48;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double turn = 2 * std::numbers::pi * i / kSides;
    const auto x = static_cast<float>(radius * std::cos(turn)),
               y = static_cast<float>(radius * std::sin(turn));
    mesh.positions.push_back({x, y, -half_length});
    mesh.positions.push_back({x, y, half_length});
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = first + 2 * i, b = first + 2 * ((i + 1) % kSides);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
}

// Clothes in layers: of a shirt below a jacket nothing but the inside is seen, through the openings.
TEST(Clean, SheetsBelowOthersKeepTheirSides) {
  for (const float longer : {0.95F, 1.0F, 1.02F, 1.2F}) {
    SCOPED_TRACE(longer);
    Mesh layers;
    add_tube(layers, 1, longer);
    const std::size_t shirt = layers.triangles.size();
    add_tube(layers, 1.05F, 1);
    const std::vector<Triangle> before = layers.triangles;
    const CleanOptions options{.windings_alone = true};
    clean_mesh(layers, options);
    EXPECT_EQ(layers.triangles, before);
    // A jacket that is inside out shows it, beside a body by which all is no room seen from inside.
    Mesh body = test::icosphere(3, 3);
    for (Vec3& p : body.positions) p.x += 6;
    Mesh turned = join({layers, body});
    for (std::size_t t = shirt; t < before.size(); ++t) {
      std::swap(turned.triangles[t][1], turned.triangles[t][2]);
    }
    const std::vector<Triangle> inside_out = turned.triangles;
    clean_mesh(turned, options);
    EXPECT_EQ(turned.triangles[0], before[0]);
    EXPECT_NE(turned.triangles[shirt], inside_out[shirt]);
  }
}

TEST(Clean, InnerShellsAreDroppedUnlessTheyAreKept) {
  const Mesh outer = test::icosphere(4);
  const Mesh inner = test::icosphere(3, 0.7);
  for (const Mesh& shell : {inner, turned(inner)}) {
    Mesh mesh = join({outer, shell});
    Mesh kept = mesh;
    const CleanReport report = clean_mesh(mesh);
    EXPECT_EQ(report.inner.count, 1U);
    EXPECT_EQ(mesh.triangles, outer.triangles);
    EXPECT_EQ(mesh.positions, outer.positions);
    const CleanReport all = clean_mesh(kept, {.keep_inner = true});
    EXPECT_EQ(all.inner.count, 0U);
    EXPECT_EQ(kept.triangles.size(), outer.triangles.size() + shell.triangles.size());
  }
}

TEST(Clean, WhatShowsThroughAnOpeningStays) {
  const Mesh sphere = test::icosphere(4);
  std::vector<std::size_t> cap;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    if (sphere.positions[sphere.triangles[t][0]].z > 0.9F) cap.push_back(t);
  }
  Mesh mesh = join({without(sphere, cap), test::icosphere(3, 0.5)});
  const Mesh before = mesh;
  clean_mesh(mesh);
  expect_same(before, mesh);
}

TEST(Clean, LeavesSeenFromBehindStay) {
  // A sheet that faces a wall: views see but its back.
  Mesh leaf = test::plane(4, 4, 0.3, 0.3), wall = test::plane(4, 4, 20, 20);
  move(leaf, {0, 0, 0.1F});
  Mesh mesh = join({wall, turned(leaf), test::icosphere(3, 0.02)});
  const std::size_t count = mesh.triangles.size();
  clean_mesh(mesh, {.floater = 0});
  EXPECT_EQ(mesh.triangles.size(), count);
}

/// An answer asked of some groups alone is the one that all pictures of all groups give.
TEST(Clean, ViewsOfSomeGroupsAreThoseOfAll) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1, 1), size(0.02F, 0.3F);
  Mesh crowd;
  std::vector<std::uint32_t> group;
  for (std::uint32_t sheet = 0; sheet < 600; ++sheet) {
    const Vec3 at{place(random), place(random), place(random)};
    const auto first = static_cast<std::uint32_t>(crowd.positions.size());
    for (int corner = 0; corner < 4; ++corner) {
      const float reach = size(random);
      crowd.positions.push_back({at.x + reach * place(random), at.y + reach * place(random),
                                 at.z + reach * place(random)});
    }
    for (std::uint32_t t = 0; t < 2; ++t) {
      crowd.triangles.push_back({first, first + 1 + t, first + 2 + t});
      group.push_back(sheet / 3);
    }
  }
  std::vector<std::uint8_t> asked(200);
  for (std::size_t g = 0; g < asked.size(); ++g) asked[g] = g % 7 == 0;
  for (const bool backs : {false, true}) {
    // Sides of whole tiles, and of a broken one at the end.
    const OutsideViews views{.count = 8, .pixels = backs ? 128U : 126U, .backs = backs};
    const auto all = count_seen_pixels(crowd, group, asked.size(), views);
    const auto some = count_seen_pixels(crowd, group, asked.size(), views, asked);
    std::uint64_t hidden = 0;
    for (std::size_t g = 0; g < asked.size(); ++g) {
      if (asked[g] == 0) continue;
      EXPECT_EQ(some[g].drawn, all[g].drawn);
      EXPECT_EQ(some[g].front, all[g].front) << g;
      EXPECT_EQ(some[g].back, all[g].back) << g;
      hidden += all[g].drawn - all[g].front - all[g].back;
    }
    EXPECT_GT(hidden, 1000U);
    // Rounds of some of the views make up all of them.
    std::vector<SeenPixels> sum(asked.size());
    for (const auto& [step, first] : {std::pair{4U, 0U}, {4U, 2U}, {2U, 1U}}) {
      OutsideViews round = views;
      round.step = step;
      round.first = first;
      const auto part = count_seen_pixels(crowd, group, asked.size(), round);
      for (std::size_t g = 0; g < sum.size(); ++g) {
        sum[g].drawn += part[g].drawn;
        sum[g].front += part[g].front;
      }
    }
    for (std::size_t g = 0; g < sum.size(); ++g) {
      EXPECT_EQ(sum[g].drawn, all[g].drawn);
      EXPECT_EQ(sum[g].front, all[g].front);
    }
  }
}

/// Of two sheets in one place views show the one that faces them, else the first, whichever of them are asked for.
TEST(Clean, ViewsOfSheetsInOnePlaceShowFrontsThenTheFirst) {
  for (const bool first_up : {true, false}) {
    for (const bool second_up : {true, false}) {
      const Mesh sheet = test::plane(1, 1);
      const Mesh both = join({first_up ? sheet : turned(sheet), second_up ? sheet : turned(sheet)});
      const std::vector<std::uint32_t> group = {0, 0, 1, 1};
      const OutsideViews views{.count = 8, .pixels = 64, .backs = true};
      const auto all = count_seen_pixels(both, group, 2, views);
      const bool alike = first_up == second_up;
      EXPECT_GT(all[0].front, 1000U);
      EXPECT_EQ(all[0].back > 1000, alike);
      EXPECT_EQ(all[1].front > 1000, !alike);
      EXPECT_EQ(all[1].back, 0U);
      for (const std::size_t asked : {0U, 1U}) {
        std::vector<std::uint8_t> counted(2, 0);
        counted[asked] = 1;
        const auto some = count_seen_pixels(both, group, 2, views, counted);
        EXPECT_EQ(some[asked].front, all[asked].front) << asked;
        EXPECT_EQ(some[asked].back, all[asked].back) << asked;
      }
    }
  }
}

/// A part of few pixels in all views may be too small to be seen: it stays.
TEST(Clean, InnerPartsOfAFewPixelsStay) {
  for (const double radius : {0.004, 0.03}) {
    const Mesh outer = test::icosphere(4);
    Mesh inner = test::icosphere(1, radius);
    move(inner, {0.1F, 0.07F, 0.03F});
    Mesh mesh = join({outer, inner});
    EXPECT_EQ(clean_mesh(mesh, {.floater = 0}).inner.count, radius > 0.01 ? 1U : 0U) << radius;
  }
}

TEST(Clean, FloatersGoAndSmallPartsOfTheBodyStay) {
  const Mesh body = test::icosphere(4);  // A diagonal of 3.46
  Mesh floater = test::icosphere(1, 0.005), rivet = floater, stray = test::icosphere(1, 0.3);
  move(floater, {1.5F, 0, 0});
  move(rivet, {0, 1, 0});
  move(stray,
       {900, 0,
        0});  // Far away, and larger than the floater: it stays, and nothing else goes for it.
  Mesh mesh = join({body, rivet, floater, stray});
  const CleanReport report = clean_mesh(mesh);
  EXPECT_EQ(report.floaters.count, 1U);
  EXPECT_EQ(mesh.triangles.size(),
            body.triangles.size() + rivet.triangles.size() + stray.triangles.size());
}

TEST(Clean, PinholesAreFilledAndOpeningsAreNot) {
  const Mesh sphere = test::icosphere(5);
  std::vector<std::size_t> holes;  // Of one face each, some of which touch.
  for (std::size_t t = 0; t < sphere.triangles.size(); t += 40) holes.push_back(t);
  Mesh mesh = without(sphere, holes);
  EXPECT_GT(open_edges(mesh), 2 * holes.size());
  const CleanReport report = clean_mesh(mesh, {.max_hole = 0.1});
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(mesh.triangles.size(), sphere.triangles.size());
  EXPECT_GT(report.holes.count, holes.size() * 9 / 10);  // Two side by side are one.
  EXPECT_LE(report.holes.count, holes.size());
  EXPECT_EQ(report.turned.count, 0U);

  // A tube of 8 sides whose ends are small.
  const Mesh ring = test::torus(64, 8, 1, 0.01);
  std::vector<std::size_t> cut;
  for (std::size_t t = 0; t < ring.triangles.size(); ++t) {
    const Vec3& p = ring.positions[ring.triangles[t][0]];
    if (p.x > 0 && std::abs(p.z) < 0.2F) cut.push_back(t);
  }
  Mesh tube = without(ring, cut);
  const Mesh before = tube;
  EXPECT_GE(open_edges(tube), 16U);
  clean_mesh(tube, {.max_hole = 0.1});
  expect_same(before, tube);
}

TEST(Clean, OpenEdgesAreCutWhereOthersEnd) {
  // Two sheets side by side, of which one has twice as many vertices at the edge between them.
  Mesh left = test::plane(4, 4), right = test::plane(4, 8);
  float most = -1e9F, least = 1e9F;
  for (const Vec3& p : left.positions) {
    most = std::max(most, p.x);
    least = std::min(least, p.x);
  }
  move(right, {most - least, 0, 0});
  Mesh mesh = join({left, right});
  mesh.other_uvs = {{1, mesh.uvs}};
  for (Vec2& uv : mesh.other_uvs[0].uvs) uv = {2 * uv.x, 4 * uv.y};
  const std::size_t before = open_edges(mesh);
  const CleanReport report = clean_mesh(mesh);
  ASSERT_EQ(mesh.other_uvs[0].uvs.size(), mesh.uvs.size());
  for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
    EXPECT_EQ(mesh.other_uvs[0].uvs[i], (Vec2{2 * mesh.uvs[i].x, 4 * mesh.uvs[i].y})) << i;
  }
  EXPECT_EQ(report.junctions.count, 4U);
  EXPECT_EQ(mesh.triangles.size(), left.triangles.size() + right.triangles.size() + 4);
  EXPECT_EQ(open_edges(mesh), before - 4 - 8);
  validate(mesh);
  // A cut changes neither the surface nor its UVs: areas are the same.
  const auto area = [](const Mesh& m) {
    double sum = 0;
    for (const Triangle& t : m.triangles) {
      const Vec3d a = point_of(m, t[0]);
      sum += 0.5 * length(cross(point_of(m, t[1]) - a, point_of(m, t[2]) - a));
    }
    return sum;
  };
  EXPECT_NEAR(area(mesh), area(left) + area(right), 1e-6);
}

TEST(Clean, DoubledPatchesApartAreJoined) {
  // Two halves that share no vertex, a rounding apart, one of them twice.
  const Mesh sphere = test::icosphere(4);
  std::vector<std::size_t> upper, lower;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    (sphere.positions[sphere.triangles[t][0]].z > 0 ? upper : lower).push_back(t);
  }
  Mesh half = without(sphere, upper);
  move(half, {2e-6F, 0, 0});
  Mesh mesh = join({without(sphere, lower), half, half});
  const CleanReport report = clean_mesh(mesh);
  EXPECT_EQ(report.duplicates.count, lower.size());
  EXPECT_GT(report.welded.count, 0U);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(mesh.triangles.size(), sphere.triangles.size());
}

TEST(Clean, WhatIsDoneIsTold) {
  // All faults at once: each has its warning, with the count.
  const Mesh sphere = test::icosphere(5);
  Mesh ball = test::icosphere(1, 0.004), far = ball;
  move(far, {2, 0, 0});
  Mesh broken = without(sphere, {3000});
  broken.triangles.push_back(broken.triangles[100]);
  for (std::size_t t = 0; t < 40; ++t) turn(broken, t);
  Mesh mesh = join({soup(broken, 3e-7), far, test::icosphere(3, 0.5)});
  mesh.groups = mesh.objects = mesh.materials = {};
  mesh.triangles.push_back({5, 5, 6});
  const CleanReport report = clean_mesh(mesh, {.max_hole = 0.1});
  std::map<std::string, std::uint64_t> told;
  for (const Warning& warning : report.warnings) {
    told[warning.code] = warning.count;
    EXPECT_NE(warning.message.text().find("one at ("), std::string::npos) << warning.message.text();
  }
  const std::map<std::string, std::uint64_t> done = {
      {"welded-vertices", report.welded.count},
      {"degenerate-triangles", 1},
      {"duplicate-triangles", 1},
      {"turned-triangles", 40},
      {"filled-holes", 1},
      {"dropped-floaters", 1},
      {"dropped-inner", 1},
  };
  EXPECT_EQ(told, done);
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(mesh.triangles.size(), sphere.triangles.size());
}

TEST(Clean, WhatCannotBeUsedIsNoHarm) {
  Mesh none, flat, strange = soup(test::icosphere(3), 3e-7), far = test::icosphere(2);
  flat.positions = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  flat.triangles = {{0, 1, 2}, {0, 0, 0}};
  for (std::size_t v = 0; v < strange.positions.size(); v += 50) {
    strange.positions[v].x = v % 100 == 0 ? std::nanf("") : HUGE_VALF;
  }
  far.positions[3] = {3e38F, -3e38F, 1};
  for (Mesh* mesh : {&none, &flat, &strange, &far}) {
    for (const bool alone : {false, true}) {
      clean_mesh(*mesh, {.windings_alone = alone});
      validate(*mesh);
    }
  }
  EXPECT_EQ(flat.triangles.size(), 2U);  // Something is left to say what is wrong with it.
}

TEST(Clean, SameOnAnyNumberOfThreads) {
  Mesh far = test::icosphere(1, 0.004);
  move(far, {2, 0, 0});
  const Mesh broken = join({soup(test::icosphere(5), 3e-7), far, test::icosphere(3, 0.5)});
  Mesh one = broken, many = broken;
  set_thread_limit(1);
  clean_mesh(one);
  set_thread_limit(7);
  clean_mesh(many);
  set_thread_limit(0);
  EXPECT_EQ(one.positions, many.positions);
  EXPECT_EQ(one.triangles, many.triangles);
}

TEST(Clean, OptionsOutOfRangeAreRefused) {
  Mesh mesh = test::icosphere(1);
  EXPECT_THROW(clean_mesh(mesh, {.weld = 0.5}), Error);
  EXPECT_THROW(clean_mesh(mesh, {.floater = -1}), Error);
}

/// Copies of a box in one place cover pictures so often that these are smaller, and the box is drawn once.
TEST(OutsideViews, RepeatedTrianglesCountAsTheFirstOfThemAlone) {
  constexpr std::uint32_t kCopies = 200;
  const Mesh box = test::cube();
  Mesh copies = join(std::vector<Mesh>(kCopies, box));
  std::vector<std::uint32_t> group(copies.triangles.size());
  for (std::size_t t = 0; t < group.size(); ++t) {
    group[t] = static_cast<std::uint32_t>(t / box.triangles.size());
  }
  for (std::size_t t = box.triangles.size(); t < 3 * box.triangles.size(); ++t) turn(copies, t);
  const std::vector<SeenPixels> seen = count_seen_pixels(copies, group, kCopies, {});
  // Half of a box's area, 6, in a picture of twice its radius, sqrt(3) / 2: covered once by a box.
  OutsideViews views;
  views.pixels = static_cast<std::uint32_t>(views.pixels * std::sqrt(32.0 / kCopies));
  const SeenPixels alone =
      count_seen_pixels(box, std::vector<std::uint32_t>(box.triangles.size()), 1, views)[0];
  EXPECT_GT(alone.front, 10000);
  for (std::uint32_t copy = 0; copy < kCopies; ++copy) {
    EXPECT_EQ(seen[copy].drawn, alone.drawn) << copy;
    EXPECT_EQ(seen[copy].front, copy == 0 ? alone.front : 0) << copy;
    EXPECT_EQ(seen[copy].back, copy == 0 ? alone.back : 0) << copy;
  }
}

TEST(Clean, SaysWhetherAllPartsFaceOutwards) {
  const Mesh one = test::cube();
  Mesh other = one;
  move(other, {3, 0, 0});
  const auto outwards = [](Mesh mesh) {
    CleanOptions options;
    options.windings_alone = true;
    return clean_mesh(mesh, options).faces_outwards;
  };
  EXPECT_TRUE(outwards(one));
  EXPECT_TRUE(outwards(join({one, other})));
  EXPECT_FALSE(outwards(turned(one)));
  EXPECT_FALSE(outwards(join({one, turned(other)})));
  EXPECT_FALSE(outwards(without(one, {0})));
  Mesh wrong = one;
  turn(wrong, 3);
  EXPECT_FALSE(outwards(wrong));
}

/// Vertices are welded within a quarter of the shortest edge of both, whichever comes first.
TEST(Clean, NearVerticesWeldWithinTheShorterEdgesLimit) {
  // Triangles with legs of 0.25 and of 8 on either side of a gap: a quarter of the shorter one is 0.0625.
  for (const bool short_first : {true, false}) {
    for (const double gap : {0.05, 0.07}) {
      const auto g = static_cast<float>(gap / std::sqrt(14.0));
      const std::vector<Vec3> small = {{0, 0, 0}, {-0.25F, 0, 0}, {0, -0.25F, 0.125F}};
      const std::vector<Vec3> large = {{g, 2 * g, 3 * g}, {8, 0, 1}, {0, 8, 2}};
      Mesh mesh;
      mesh.positions = short_first ? small : large;
      const std::vector<Vec3>& last = short_first ? large : small;
      mesh.positions.insert(mesh.positions.end(), last.begin(), last.end());
      mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
      const Mesh before = mesh;
      const Cleaned welded = weld_near(mesh, 0.1);
      EXPECT_EQ(welded.count, gap < 0.0625 ? 1U : 0U) << short_first << " " << gap;
      EXPECT_EQ(mesh.positions[0] == mesh.positions[3], gap < 0.0625);
      for (const std::size_t v : {1U, 2U, 4U, 5U}) {
        EXPECT_EQ(mesh.positions[v], before.positions[v]);
      }
      if (gap < 0.0625)
        EXPECT_TRUE(welded.example == before.positions[0] || welded.example == before.positions[3]);
    }
  }
}

}  // namespace
}  // namespace kiln

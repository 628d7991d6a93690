// The parts of contouring that need no device: sheets of cells, error functions; and with one, the tree of
// vertices.
#include "kiln/contour.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <random>

#include "kiln/volume.h"
#include "support/environment.h"
#include "support/volumes.h"
#include "volume/fine_surface.h"
#include "volume/patches.h"
#include "volume/qef.h"
#include "volume/simplified_isosurface.h"
#include "volume/vertex_tree.h"

namespace kiln {
namespace {

using test::Topology;
using test::topology;

TEST(SheetTable, KnowsTheKnownCases) {
  const SheetTable& table = SheetTable::get();
  constexpr std::uint32_t kNone = SheetTable::kNoFace;
  EXPECT_EQ(table.sheet_count(0, kNone), 0U);
  EXPECT_EQ(table.sheet_count(255, kNone), 0U);
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    EXPECT_EQ(table.sheet_count(1U << corner, kNone), 1U);
    EXPECT_EQ(std::popcount(table.crossed_edges(1U << corner)), 3);
    EXPECT_EQ(table.sheet_count(1U << corner | 1U << (corner ^ 7), kNone), 2U);  // opposite corners
    EXPECT_EQ(table.sheet_count(1U << corner | 1U << (corner ^ 3), kNone), 2U);  // parted on a face
    // Two outside corners on a face: what is inside is joined around them.
    EXPECT_EQ(table.sheet_count(255U ^ (1U << corner | 1U << (corner ^ 3)), kNone), 1U);
  }
  EXPECT_EQ(table.sheet_count(0b01101001, kNone), 4U);  // every other corner
  EXPECT_EQ(table.sheet_count(0b00001111, kNone), 1U);
}

TEST(SheetTable, SheetsAreWhole) {
  // Every sheet crosses three edges or more, all crossed edges have a sheet, and flipping the doubled
  // face parts its sheet in two.
  const SheetTable& table = SheetTable::get();
  for (std::uint32_t signs = 0; signs < 256; ++signs) {
    for (std::uint32_t flipped = 0; flipped < SheetTable::kFlipChoices; ++flipped) {
      std::array<int, 4> sizes{};
      for (std::uint32_t edge = 0; edge < 12; ++edge) {
        if ((table.crossed_edges(signs) >> edge & 1) != 0)
          ++sizes[table.sheet_of_edge(signs, flipped, edge)];
      }
      for (std::size_t k = 0; k < 4; ++k) {
        if (k < table.sheet_count(signs, flipped)) {
          EXPECT_GE(sizes[k], 3);
        } else {
          EXPECT_EQ(sizes[k], 0);
        }
      }
    }
    const std::uint32_t face = table.doubled_face(signs);
    if (face != SheetTable::kNoFace) {
      EXPECT_EQ(table.sheet_count(signs, face), table.sheet_count(signs, SheetTable::kNoFace) + 1);
    }
  }
}

kiln_volume_qef planes(const std::vector<std::array<Vec3d, 2>>& list) {
  kiln_volume_qef q{};
  for (const auto& [p, n] : list) {
    const double d = dot(p, n);
    const double values[6] = {n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z};
    for (int k = 0; k < 6; ++k) q.a[k] += static_cast<float>(values[k]);
    const double side[3] = {n.x * d, n.y * d, n.z * d}, mass[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
      q.b[k] += static_cast<float>(side[k]);
      q.mass[k] += static_cast<float>(mass[k]);
    }
    q.c += static_cast<float>(d * d);
    q.count += 1;
  }
  return q;
}

void expect_place(const Qef::Minimum& minimum, double x, double y, double z) {
  EXPECT_NEAR(minimum.place.x, x, 1e-4);
  EXPECT_NEAR(minimum.place.y, y, 1e-4);
  EXPECT_NEAR(minimum.place.z, z, 1e-4);
}

TEST(Qef, PlaneKeepsTheMean) {
  Qef qef;
  qef.add(planes({{Vec3d(0.25, 0, 0.5), Vec3d(0, 0, 1)},
                  {Vec3d(0.75, 0, 0.5), Vec3d(0, 0, 1)},
                  {Vec3d(0.5, 1, 0.5), Vec3d(0, 0, 1)}}),
          {400, 2, 300});
  const auto minimum = qef.find_minimum(Vec3d(400, 2, 300), Vec3d(401, 3, 301));
  expect_place(minimum, 400.5, 2 + 1.0 / 3, 300.5);
  EXPECT_LT(minimum.error, 1e-4);
}

TEST(Qef, EdgeAndCornerAreFound) {
  const Vec3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  Qef edge;
  edge.add(planes({{Vec3d(0.3, 0.1, 0), x}, {Vec3d(0.3, 0.2, 1), x}, {Vec3d(0, 0.8, 0.5), y}}),
           {10, 10, 10});
  expect_place(edge.find_minimum(Vec3d(10, 10, 10), Vec3d(11, 11, 11)), 10.3, 10.8, 10.5);
  Qef corner;
  corner.add(planes({{Vec3d(0.3, 0.1, 0), x}, {Vec3d(0, 0.8, 0.5), y}, {Vec3d(0.1, 0.1, 0.9), z}}),
             {10, 10, 10});
  const auto minimum = corner.find_minimum(Vec3d(10, 10, 10), Vec3d(11, 11, 11));
  expect_place(minimum, 10.3, 10.8, 10.9);
  EXPECT_LT(minimum.error, 1e-4);
}

TEST(Qef, MinimumWithinTheBoxIsTheLeast) {
  // Against a search over the box.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1), all(-1, 1);
  for (int round = 0; round < 50; ++round) {
    std::vector<std::array<Vec3d, 2>> list;
    for (int k = 0; k < 5; ++k) {
      Vec3d n(all(random), all(random), all(random));
      list.push_back({Vec3d(unit(random), unit(random), unit(random)), n * (1 / length(n))});
    }
    Qef qef;
    qef.add(planes(list), {0, 0, 0});
    const double high = 0.6;
    const auto minimum = qef.find_minimum(Vec3d(0, 0, 0), Vec3d(high, high, high));
    const auto error = [&](const Vec3d& at) {
      double sum = 0;
      for (const auto& [p, n] : list) sum += std::pow(dot(n, at - p), 2);
      return std::sqrt(sum / static_cast<double>(list.size()));
    };
    double least = 1e9;
    constexpr int kSteps = 30;
    for (int i = 0; i <= kSteps * kSteps * kSteps + 3 * kSteps * kSteps; ++i) {
      const Vec3d at(high * (i % (kSteps + 1)) / kSteps,
                     high * (i / (kSteps + 1) % (kSteps + 1)) / kSteps,
                     high * (i / (kSteps + 1) / (kSteps + 1) % (kSteps + 1)) / kSteps);
      least = std::min(least, error(at));
    }
    EXPECT_NEAR(minimum.error, error(minimum.place), 1e-4);
    // Directions that hardly count keep the mean, which costs little.
    EXPECT_LT(minimum.error, least + 0.06);
    EXPECT_LE(std::max({minimum.place.x, minimum.place.y, minimum.place.z}), high);
    EXPECT_GE(std::min({minimum.place.x, minimum.place.y, minimum.place.z}), 0);
  }
}

Mesh to_mesh(const SimplifiedIsosurface& light) {
  Mesh mesh;
  mesh.positions = light.positions;
  for (const auto& polygon : light.polygons) {
    const auto& c = polygon.corners;
    mesh.triangles.push_back({c[0], c[1], c[2]});
    if (polygon.is_quad()) mesh.triangles.push_back({c[0], c[2], c[3]});
  }
  return mesh;
}

struct Simplified {
  FineSurface fine;
  SimplifiedIsosurface light;
  Mesh mesh;
  Topology before, after;
};

Simplified simplified(const Volume& volume, std::uint32_t faces, double error,
                      bool keep_topology = true, bool open = false, double iso = 0) {
  ContourReport report;
  ContourOptions options;
  options.iso = iso;
  options.border = open ? VolumeBorder::open : VolumeBorder::closed;
  Simplified result;
  result.fine = fine_surface(context_of(*test::device()), volume, options, true, report);
  const VertexTree tree(result.fine, volume.size, open);
  result.before = topology(to_mesh(simplify_isosurface(result.fine, tree, volume, {.error = -1})));
  result.light = simplify_isosurface(
      result.fine, tree, volume, {.faces = faces, .error = error, .keep_topology = keep_topology});
  result.mesh = to_mesh(result.light);
  result.after = topology(result.mesh);
  return result;
}

Volume gyroid(std::uint32_t side, double period) {
  return test::make_float_volume({side, side, side}, [=](double x, double y, double z) {
    return test::gyroid_field(x, y, z, period);
  });
}

TEST(VertexTree, KeepsTheTopologyOfKnownShapes) {
  KILN_REQUIRE_DEVICE();
  const Volume sphere = test::make_float_volume({45, 45, 45}, [](double x, double y, double z) {
    return test::sphere_field(x - 21.6, y - 22.3, z - 22.1, 18.4);
  });
  const Volume torus = test::make_float_volume({70, 30, 67}, [](double x, double y, double z) {
    return test::torus_field(x - 34.1, y - 14.7, z - 33.2, 22, 7.5);
  });
  for (const double error : {0.001, 0.01, 0.1, 0.5, 2.0}) {
    const Simplified a = simplified(sphere, 0, error);
    EXPECT_TRUE(a.after.is_closed_manifold()) << error;
    EXPECT_EQ(a.after.euler, 2) << error;
    EXPECT_LE(a.light.error, error + 1e-6);
    const Simplified b = simplified(torus, 0, error);
    EXPECT_TRUE(b.after.is_closed_manifold()) << error;
    EXPECT_EQ(b.after.euler, 0) << error;
    RecordProperty("faces" + std::to_string(error), std::to_string(b.light.faces));
  }
}

TEST(VertexTree, KeepsTheTopologyOfAGyroid) {
  KILN_REQUIRE_DEVICE();
  for (const double error : {0.01, 0.05, 0.2, 1.0, 100.0}) {
    const Simplified s = simplified(gyroid(48, 21.3), 0, error);
    EXPECT_TRUE(s.before.is_closed_manifold());
    EXPECT_EQ(s.after.euler, s.before.euler);
    EXPECT_EQ(s.after.parts, s.before.parts);
    EXPECT_EQ(s.after.border_edges, 0U);
    EXPECT_EQ(s.after.inconsistent_edges, 0U);
    EXPECT_EQ(s.after.crowded_edges, 0U);
    EXPECT_EQ(s.after.pinched_vertices, 0U);
  }
}

TEST(VertexTree, KeepsTheTopologyOfNoise) {
  // Blobs with ambiguous cells, thin sheets and specks everywhere.
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(11);
  for (int round = 0; round < 12; ++round) {
    const Volume volume = test::make_float_volume({19, 22, 17}, [&](double x, double y, double z) {
      return 600 * std::sin(x * 0.7 + round) * std::cos(y * 0.6) * std::sin(z * 0.5 + 1) +
             (static_cast<int>(random() % 601) - 300);
    });
    for (const double error : {0.1, 0.4, 100.0}) {
      const Simplified s = simplified(volume, 0, error, true, false, 20.5);
      EXPECT_TRUE(s.before.is_closed_manifold());
      EXPECT_EQ(s.after.euler, s.before.euler);
      EXPECT_EQ(s.after.parts, s.before.parts);
      EXPECT_TRUE(s.after.is_closed_manifold())
          << s.after.border_edges << " " << s.after.inconsistent_edges << " "
          << s.after.crowded_edges << " " << s.after.pinched_vertices;
    }
  }
}

TEST(VertexTree, OpenBordersStayOpen) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = test::make_float_volume({40, 30, 29}, [](double x, double y, double z) {
    return 14.3 - x * 0.5 - 0.1 * y + std::sin(z * 0.2) + std::cos(y * 0.3);
  });
  for (const double error : {0.01, 0.1, 0.5}) {
    const Simplified s = simplified(volume, 0, error, true, true);
    EXPECT_EQ(s.before.euler, 1);
    EXPECT_EQ(s.after.euler, 1);
    EXPECT_EQ(s.after.inconsistent_edges, 0U);
    EXPECT_EQ(s.after.crowded_edges, 0U);
    EXPECT_LT(s.light.faces, s.fine.quads * (error < 0.05 ? 2 : 1));
  }
}

/// Balls and tubes, many of which the border cuts: near its planes, edges and corners.
Volume droplets(std::array<std::uint32_t, 3> size, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  struct Ball {
    std::array<double, 3> at;
    double radius;
    std::size_t along;  // 3: a ball, else a tube
  };
  std::vector<Ball> balls;
  for (int i = 0; i < 40; ++i) {
    Ball ball{{}, 1.2 + 3 * unit(random), static_cast<std::size_t>(random() % 6)};
    for (std::size_t k = 0; k < 3; ++k) {
      const double last = size[k] - 1;
      const std::uint32_t where = random() % 3;
      ball.at[k] = where == 0   ? 3 * unit(random) - 1
                   : where == 1 ? last + 1 - 3 * unit(random)
                                : last * unit(random);
    }
    balls.push_back(ball);
  }
  return test::make_float_volume(size, [=](double x, double y, double z) {
    const double at[3] = {x, y, z};
    double best = -1e9;
    for (const Ball& ball : balls) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        if (k != ball.along) square += (at[k] - ball.at[k]) * (at[k] - ball.at[k]);
      }
      best = std::max(best, ball.radius - std::sqrt(square));
    }
    return best;
  });
}

TEST(VertexTree, OpenBordersKeepPartsAndLoops) {
  KILN_REQUIRE_DEVICE();
  std::uint64_t parts = 0, loops = 0;
  for (std::uint32_t seed = 0; seed < 24; ++seed) {
    // Planes of voxels at the border that are sides of the octree's nodes, and others.
    const std::uint32_t side = 30 + seed % 5;
    const Volume volume = droplets({side, 32, 33}, seed);
    for (const double error : {0.05, 0.3, 100.0}) {
      const Simplified s = simplified(volume, 0, error, true, true);
      EXPECT_EQ(s.after.parts, s.before.parts) << seed << " " << error;
      EXPECT_EQ(s.after.border_loops, s.before.border_loops) << seed << " " << error;
      EXPECT_EQ(s.after.euler, s.before.euler) << seed << " " << error;
      EXPECT_EQ(s.after.inconsistent_edges, 0U) << seed << " " << error;
      EXPECT_EQ(s.after.crowded_edges, 0U) << seed << " " << error;
      EXPECT_LE(s.after.pinched_vertices, s.before.pinched_vertices) << seed << " " << error;
      EXPECT_LT(s.mesh.triangles.size(), 2 * s.fine.quads);
      parts += s.before.parts;
      loops += s.before.border_loops;
    }
  }
  EXPECT_GT(parts, 300U);
  EXPECT_GT(loops, 500U);
}

TEST(VertexTree, OpenBordersKeepPartsAndLoopsOfNoise) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(12);
  for (int round = 0; round < 12; ++round) {
    const Volume volume = test::make_float_volume({17, 22, 16}, [&](double x, double y, double z) {
      return 600 * std::sin(x * 0.7 + round) * std::cos(y * 0.6) * std::sin(z * 0.5 + 1) +
             (static_cast<int>(random() % 601) - 300);
    });
    for (const double error : {0.1, 0.4, 100.0}) {
      const Simplified s = simplified(volume, 0, error, true, true, 20.5);
      EXPECT_EQ(s.after.euler, s.before.euler) << round << " " << error;
      EXPECT_EQ(s.after.parts, s.before.parts) << round << " " << error;
      EXPECT_EQ(s.after.border_loops, s.before.border_loops) << round << " " << error;
      EXPECT_LE(s.after.pinched_vertices, s.before.pinched_vertices) << round << " " << error;
    }
  }
}

TEST(VertexTree, OpenRimsStayWhereTheyAre) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = test::make_float_volume(
      {24, 24, 24}, [](double x, double y, double) { return 8 - std::hypot(x - 11.5, y - 11.5); });
  for (const std::uint32_t faces : {400U, 120U, 60U}) {
    const Simplified s = simplified(volume, faces, 0, true, true);
    EXPECT_EQ(s.after.euler, 0);  // a tube
    EXPECT_LE(s.light.faces, faces);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Triangle& t : s.mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
        ++edges[{low, high}];
      }
    }
    std::size_t rims[2] = {};
    for (const auto& [edge, count] : edges) {
      if (count != 1) continue;
      for (const std::uint32_t vertex : {edge.first, edge.second}) {
        const double z = s.mesh.positions[vertex].z;
        // In the middle of the outermost cells, as in the full contour.
        EXPECT_NEAR(std::abs(z - 11.5), 11, 1e-3) << faces;
        ++rims[z > 11.5 ? 1 : 0];
      }
    }
    EXPECT_GT(rims[0], 0U);
    EXPECT_GT(rims[1], 0U);
  }
}

TEST(VertexTree, ReachesTheFacesAskedFor) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = gyroid(60, 40);
  std::uint64_t fine = 0;
  for (const std::uint32_t faces : {100000000U, 8000U, 4000U}) {
    const Simplified s = simplified(volume, faces, 0);
    EXPECT_TRUE(s.light.is_goal_reached);
    EXPECT_LE(s.light.faces, faces);
    if (fine == 0) {
      fine = s.light.faces;
      // All but those at edges without length, where cells' vertices meet.
      EXPECT_LE(fine, 2 * s.fine.quads);
      EXPECT_GT(fine, 2 * s.fine.quads - 40);
    } else {
      EXPECT_GT(s.light.faces, faces * 0.95);
    }
    EXPECT_TRUE(s.after.is_closed_manifold());
  }
  // Fewer than the topology needs.
  const Simplified kept = simplified(volume, 10, 0);
  EXPECT_FALSE(kept.light.is_goal_reached);
  EXPECT_TRUE(kept.after.is_closed_manifold());
  EXPECT_EQ(kept.after.euler, kept.before.euler);
  const Simplified freed = simplified(volume, 40, 0, false);
  EXPECT_TRUE(freed.light.is_goal_reached);
  EXPECT_GT(freed.light.changed_topology, 0U);
  EXPECT_EQ(freed.after.border_edges, 0U);
  EXPECT_EQ(freed.after.inconsistent_edges, 0U);
}

TEST(VertexTree, BoxKeepsItsCorners) {
  KILN_REQUIRE_DEVICE();
  const Volume volume = test::make_float_volume({40, 40, 40}, [](double x, double y, double z) {
    return test::box_field(x - 19.3, y - 19.4, z - 19.6, 13.2, 11.3, 9.1);
  });
  const Simplified s = simplified(volume, 0, 0.3);
  EXPECT_EQ(s.after.euler, 2);
  EXPECT_LT(s.light.faces, 50U);
  double sum = test::enclosed_volume(s.mesh);
  EXPECT_NEAR(sum, 8 * 13.2 * 11.3 * 9.1, 8 * 13.2 * 11.3 * 9.1 * 0.02);
}

}  // namespace
}  // namespace kiln

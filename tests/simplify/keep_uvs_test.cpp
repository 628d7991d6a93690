// simplify() with keep_uvs: seams, layout, groups, and the same place at the same UV.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "kiln/simplify.h"
#include "simplify/simplify_uvs.h"
#include "support/shapes.h"

namespace kiln {
namespace {

double doubled(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
}

/// Surface at the points of a grid over the layout, by trying every triangle: positions, and how many
/// triangles there are.
struct Probes {
  static constexpr int kSide = 300;
  std::vector<std::array<double, 3>> position;
  std::vector<int> count;

  explicit Probes(const Mesh& mesh) : position(kSide * kSide), count(kSide * kSide, 0) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Triangle& uv = mesh.uv_triangles[t];
      const Vec2 &a = mesh.uvs[uv[0]], &b = mesh.uvs[uv[1]], &c = mesh.uvs[uv[2]];
      const double area = doubled(a, b, c);
      if (area == 0) continue;
      const auto first = [](float x) {
        return std::clamp(static_cast<int>(std::floor(x * kSide)) - 1, 0, kSide);
      };
      const auto [left, right] = std::minmax({a.x, b.x, c.x});
      const auto [bottom, top] = std::minmax({a.y, b.y, c.y});
      for (int y = first(bottom); y < std::min(first(top) + 3, kSide); ++y) {
        for (int x = first(left); x < std::min(first(right) + 3, kSide); ++x) {
          const Vec2 p{(static_cast<float>(x) + 0.4142F) / kSide,
                       (static_cast<float>(y) + 0.7321F) / kSide};
          const double wa = doubled(b, c, p) / area, wb = doubled(c, a, p) / area;
          if (!(wa > 0 && wb > 0 && wa + wb < 1)) continue;
          const auto i = static_cast<std::size_t>(y * kSide + x);
          ++count[i];
          const Triangle& v = mesh.triangles[t];
          const Vec3 &pa = mesh.positions[v[0]], &pb = mesh.positions[v[1]],
                     &pc = mesh.positions[v[2]];
          const double wc = 1 - wa - wb;
          position[i] = {wa * pa.x + wb * pb.x + wc * pc.x, wa * pa.y + wb * pb.y + wc * pc.y,
                         wa * pa.z + wb * pb.z + wc * pc.z};
        }
      }
    }
  }
};

double diagonal(const Mesh& mesh) {
  Vec3 low = mesh.positions[0], high = low;
  for (const Vec3& p : mesh.positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return std::hypot(high.x - low.x, high.y - low.y, high.z - low.z);
}

/// A cube of n x n cells a side, bulged; each side with its own cell of the layout and its own group, and
/// the layout of two sides mirrored.
Mesh sided_cube(std::uint32_t n) {
  Mesh mesh;
  mesh.name = "cube";
  for (std::uint32_t side = 0; side < 6; ++side) {
    mesh.group_names.push_back("side" + std::to_string(side));
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t j = 0; j <= n; ++j) {
      for (std::uint32_t i = 0; i <= n; ++i) {
        const double s = 2.0 * i / n - 1, t = 2.0 * j / n - 1;
        std::array<double, 3> p{};
        const std::uint32_t axis = side / 2;
        const double sign = side % 2 == 0 ? 1 : -1;
        p[axis] = sign;
        p[(axis + 1) % 3] = sign * s;
        p[(axis + 2) % 3] = t;
        const double bump = 1 + 0.05 * std::cos(2 * p[0]) * std::cos(3 * p[1]) * std::cos(p[2]);
        mesh.positions.push_back({static_cast<float>(bump * p[0]), static_cast<float>(bump * p[1]),
                                  static_cast<float>(bump * p[2])});
        const double u = side >= 4 ? -s : s;
        mesh.uvs.push_back({static_cast<float>((side % 3 + 0.5 + 0.45 * u) / 3),
                            static_cast<float>((side / 3 + 0.5 + 0.45 * t) / 2)});
      }
    }
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = first + j * (n + 1) + i, c = a + n + 1;
        mesh.triangles.push_back({a, a + 1, c + 1});
        mesh.triangles.push_back({a, c + 1, c});
        mesh.groups.insert(mesh.groups.end(), 2, side);
      }
    }
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// A sphere with bumps in the layout of uv_sphere(): one seam, split poles.
Mesh bumpy_uv_sphere(std::uint32_t slices, std::uint32_t stacks) {
  Mesh mesh = test::uv_sphere(slices, stacks);
  for (Vec3& p : mesh.positions) {
    const double r = test::BumpySphere::radius({p.x, p.y, p.z});
    p = {static_cast<float>(p.x * r), static_cast<float>(p.y * r), static_cast<float>(p.z * r)};
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

std::size_t open_edges(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> number;
  std::vector<std::uint32_t> welded;
  for (const Vec3& p : mesh.positions) {
    const auto next = static_cast<std::uint32_t>(number.size());
    welded.push_back(number.emplace(std::array{p.x, p.y, p.z}, next).first->second);
  }
  std::set<std::array<std::uint32_t, 2>> sides;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) sides.insert({welded[t[k]], welded[t[(k + 1) % 3]]});
  }
  return static_cast<std::size_t>(std::count_if(sides.begin(), sides.end(), [&](const auto& s) {
    return !sides.contains({s[1], s[0]});
  }));
}

void expect_layout_kept(const Mesh& high, std::uint32_t faces) {
  SCOPED_TRACE(high.name + " to " + std::to_string(faces));
  SimplifyReport report;
  const Mesh low = simplify(high, {.faces = faces, .keep_uvs = true}, &report);
  EXPECT_LE(low.triangles.size(), faces);
  ASSERT_EQ(low.uv_triangles.size(), low.triangles.size());
  EXPECT_EQ(report.folded + report.without_area + report.holes, 0U);

  // The dense layouts have triangles of either sense, none without area; the share is kept.
  const auto turned = [](const Mesh& mesh) {
    double positive = 0, negative = 0;
    for (const Triangle& t : mesh.uv_triangles) {
      const double area = doubled(mesh.uvs[t[0]], mesh.uvs[t[1]], mesh.uvs[t[2]]);
      EXPECT_NE(area, 0);
      (area > 0 ? positive : negative) += area;
    }
    return std::array{positive, negative};
  };
  const auto before = turned(high), after = turned(low);
  EXPECT_NEAR(before[0], after[0], 0.02);
  EXPECT_NEAR(before[1], after[1], 0.02);

  const Probes dense(high), light(low);
  EXPECT_EQ(*std::max_element(dense.count.begin(), dense.count.end()), 1);
  EXPECT_EQ(*std::max_element(light.count.begin(), light.count.end()), 1) << "overlap";
  std::vector<double> distances;
  for (std::size_t i = 0; i < dense.count.size(); ++i) {
    if (dense.count[i] == 0 || light.count[i] == 0) continue;
    const auto &p = dense.position[i], &q = light.position[i];
    distances.push_back(std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) / diagonal(high));
  }
  ASSERT_GT(distances.size(), 1000U);
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() * 95 / 100], 0.01);

  // Vertices of seams stay vertices of seams: position and UV of each are the high poly's.
  std::set<std::array<float, 5>> corners;
  const auto key = [](const Mesh& mesh, std::size_t t, std::size_t k) {
    const Vec3& p = mesh.positions[mesh.triangles[t][k]];
    const Vec2& uv = mesh.uvs[mesh.uv_triangles[t][k]];
    return std::array{p.x, p.y, p.z, uv.x, uv.y};
  };
  for (std::size_t t = 0; t < high.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) corners.insert(key(high, t, k));
  }
  std::map<std::uint32_t, std::set<std::uint32_t>> uvs_at;
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      uvs_at[low.triangles[t][k]].insert(low.uv_triangles[t][k]);
    }
  }
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (uvs_at[low.triangles[t][k]].size() < 2) continue;
      EXPECT_TRUE(corners.contains(key(low, t, k))) << t << ' ' << k;
    }
  }
  EXPECT_EQ(open_edges(low), open_edges(high));
}

TEST(KeepUvs, SphereWithASeamAndSplitPoles) {
  const Mesh high = bumpy_uv_sphere(90, 45);
  for (const std::uint32_t faces : {3000U, 600U}) expect_layout_kept(high, faces);
}

TEST(KeepUvs, TorusWithTwoSeams) {
  const Mesh high = test::torus(96, 48);
  for (const std::uint32_t faces : {2000U, 700U}) expect_layout_kept(high, faces);
}

TEST(KeepUvs, CubeOfSixChartsKeepsGroupsAndCorners) {
  const Mesh high = sided_cube(16);
  for (const std::uint32_t faces : {2000U, 400U}) {
    expect_layout_kept(high, faces);
    const Mesh low = simplify(high, {.faces = faces, .keep_uvs = true});
    EXPECT_EQ(low.group_names, high.group_names);
    ASSERT_EQ(low.groups.size(), low.triangles.size());
    // Every side is whole: its area in the layout is what it was.
    std::array<double, 6> area{};
    for (std::size_t t = 0; t < low.triangles.size(); ++t) {
      const Triangle& c = low.uv_triangles[t];
      area[low.groups[t]] += std::abs(doubled(low.uvs[c[0]], low.uvs[c[1]], low.uvs[c[2]])) / 2;
    }
    for (const double one : area) EXPECT_NEAR(one, 0.9 * 0.9 / 6, 1e-5);
  }
}

TEST(KeepUvs, NamesWithoutASeamKeepTheirBorders) {
  using Names = std::vector<std::uint32_t> Mesh::*;
  for (const Names names : {&Mesh::groups, &Mesh::objects, &Mesh::materials}) {
    Mesh high = test::plane(40, 40);
    high.groups.assign(high.triangles.size(), 0);
    (high.*names).resize(high.triangles.size());
    high.group_names = high.object_names = high.material_names = {"left", "right"};
    for (std::size_t t = 0; t < high.triangles.size(); ++t) {
      const Triangle& v = high.triangles[t];
      (high.*names)[t] =
          high.positions[v[0]].x + high.positions[v[1]].x + high.positions[v[2]].x > 0.3F ? 1 : 0;
    }
    std::array<double, 2> expected{}, found{};
    const auto sum = [names](const Mesh& mesh, std::array<double, 2>& area) {
      ASSERT_EQ((mesh.*names).size(), mesh.triangles.size());
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& c = mesh.uv_triangles[t];
        area[(mesh.*names)[t]] += doubled(mesh.uvs[c[0]], mesh.uvs[c[1]], mesh.uvs[c[2]]) / 2;
      }
    };
    const Mesh low = simplify(high, {.faces = 60, .keep_uvs = true});
    EXPECT_LE(low.triangles.size(), 60U);
    EXPECT_EQ(low.groups.size(), low.triangles.size());
    sum(high, expected);
    sum(low, found);
    EXPECT_NEAR(found[0], expected[0], 0.02);
    EXPECT_NEAR(found[1], expected[1], 0.02);
    EXPECT_NEAR(found[0] + found[1], 1, 1e-5);
  }
}

TEST(KeepUvs, ChartsThatLieCloseDoNotComeToOverlap) {
  // Two combs that reach into each other, one unit of the layout apart: straight teeth would cross.
  Mesh high;
  constexpr std::uint32_t n = 120;
  for (std::uint32_t comb = 0; comb < 2; ++comb) {
    const auto first = static_cast<std::uint32_t>(high.positions.size());
    for (std::uint32_t j = 0; j <= 8; ++j) {
      for (std::uint32_t i = 0; i <= n; ++i) {
        const double x = static_cast<double>(i) / n, wave = 0.1 * std::sin(40 * x);
        const double y = comb == 0 ? (0.49 + wave) * j / 8 : 0.51 + wave + (0.49 - wave) * j / 8;
        high.positions.push_back({static_cast<float>(x), static_cast<float>(y),
                                  static_cast<float>(comb + 0.02 * std::sin(9 * x))});
        high.uvs.push_back({static_cast<float>(x), static_cast<float>(y)});
      }
    }
    for (std::uint32_t j = 0; j < 8; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = first + j * (n + 1) + i, c = a + n + 1;
        high.triangles.push_back({a, a + 1, c + 1});
        high.triangles.push_back({a, c + 1, c});
      }
    }
  }
  high.uv_triangles = high.triangles;
  for (const std::uint32_t faces : {400U, 120U}) {
    const Mesh low = simplify(high, {.faces = faces, .keep_uvs = true});
    const Probes light(low);
    EXPECT_EQ(*std::max_element(light.count.begin(), light.count.end()), 1) << faces;
  }
}

TEST(KeepUvs, RefusesWhatHasNone) {
  const auto code = [](const Mesh& mesh, const SimplifyOptions& options) {
    try {
      simplify(mesh, options);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::internal;
  };
  EXPECT_EQ(code(test::icosphere(2), {.faces = 50, .keep_uvs = true}), ErrorCode::input);
  EXPECT_EQ(code(test::plane(9, 9), {.faces = 50, .height_field = true, .keep_uvs = true}),
            ErrorCode::usage);
}

TEST(KeepUvs, BoundIsKept) {
  const Mesh high = bumpy_uv_sphere(60, 30);
  SimplifyReport report;
  const Mesh low = simplify(high, {.max_error = 0.004, .keep_uvs = true}, &report);
  EXPECT_LE(report.error, 0.004);
  EXPECT_LT(low.triangles.size(), high.triangles.size() / 2);
  EXPECT_EQ(report.charts, 1U);
  EXPECT_NEAR(report.coverage, 1, 0.05);  // Half the poles' rows have no triangle.
}

TEST(KeepUvs, MissingUvsAndOnePointOfTheLayoutStayWhatTheyAre) {
  Mesh high = test::plane(30, 30);
  for (std::size_t t = 0; t < high.triangles.size(); ++t) {
    const float x = high.positions[high.triangles[t][0]].x;
    if (x < -0.2F) {
      high.uv_triangles[t].fill(static_cast<std::uint32_t>(high.uvs.size()));  // All at one point
    } else if (x > 0.3F) {
      high.uv_triangles[t].fill(static_cast<std::uint32_t>(high.uvs.size() + 1));  // None
    }
  }
  high.uvs.push_back({0.25F, 0.5F});
  const float none = std::numeric_limits<float>::quiet_NaN();
  high.uvs.push_back({none, none});
  const Mesh low = simplify(high, {.faces = 300, .keep_uvs = true});
  EXPECT_LE(low.triangles.size(), 300U);
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    const Triangle& v = low.triangles[t];
    const Triangle& c = low.uv_triangles[t];
    const float x = (low.positions[v[0]].x + low.positions[v[1]].x + low.positions[v[2]].x) / 3;
    if (x < -0.25F) {
      for (const std::uint32_t uv : c) EXPECT_EQ(low.uvs[uv], (Vec2{0.25F, 0.5F}));
    } else if (x > 0.35F) {
      for (const std::uint32_t uv : c) EXPECT_TRUE(std::isnan(low.uvs[uv].x));
    } else if (x > -0.15F && x < 0.25F) {
      EXPECT_GT(doubled(low.uvs[c[0]], low.uvs[c[1]], low.uvs[c[2]]), 0);
    }
  }
}

/// A grid over [x0, x1] x [0, 1] whose vertices and UVs are given; the cells left of 0 are cut the other way.
void add_grid(Mesh& mesh, int x0, int x1, int n, const auto& position, const auto& uv) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const auto width = static_cast<std::uint32_t>((x1 - x0) * n + 1);
  for (int j = 0; j <= n; ++j) {
    for (int i = x0 * n; i <= x1 * n; ++i) {
      const double x = static_cast<double>(i) / n, y = static_cast<double>(j) / n;
      mesh.positions.push_back(position(x, y));
      mesh.uvs.push_back(uv(x, y));
    }
  }
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(n); ++j) {
    for (std::uint32_t i = 0; i + 1 < width; ++i) {
      const std::uint32_t a = first + j * width + i, b = a + 1, d = a + width, c = d + 1;
      const bool left = static_cast<int>(i) + x0 * n < 0;
      mesh.triangles.push_back(left ? Triangle{a, b, d} : Triangle{a, b, c});
      mesh.triangles.push_back(left ? Triangle{b, c, d} : Triangle{a, c, d});
    }
  }
  mesh.uv_triangles = mesh.triangles;
}

Vec2 in_layout(double u, double v) {
  return {static_cast<float>(0.05 + 0.44 * u), static_cast<float>(0.05 + 0.9 * v)};
}

/// Triangles up to `most_u` by the places of their corners in the layout: how many there are at each.
std::map<std::array<std::array<float, 2>, 3>, int> places(const Mesh& mesh, float most_u) {
  std::map<std::array<std::array<float, 2>, 3>, int> found;
  for (const Triangle& t : mesh.uv_triangles) {
    std::array<std::array<float, 2>, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      // UVs of copies may part by rounding.
      corners[k] = {std::round(mesh.uvs[t[k]].x * 1e5F), std::round(mesh.uvs[t[k]].y * 1e5F)};
    }
    if (std::max({corners[0][0], corners[1][0], corners[2][0]}) / 1e5F > most_u) continue;
    std::sort(corners.begin(), corners.end());
    ++found[corners];
  }
  return found;
}

TEST(KeepUvs, MirroredHalvesStayCopies) {
  // Folded at x = 0. The halves are not mirror images on the surface, so that each by itself would go its own way.
  Mesh high;
  add_grid(
      high, -1, 1, 40,
      [](double x, double y) {
        return Vec3{static_cast<float>(x), static_cast<float>(y),
                    static_cast<float>(0.1 * std::sin(5 * x + 1) * std::cos(4 * y + x))};
      },
      [](double x, double y) { return in_layout(std::abs(x), y); });
  for (const std::uint32_t faces : {2000U, 400U, 100U}) {
    const Mesh low = simplify(high, {.faces = faces, .keep_uvs = true});
    EXPECT_LE(low.triangles.size(), faces);
    EXPECT_GT(low.triangles.size(), faces * 9 / 10);
    for (const auto& [place, count] : places(low, 1)) EXPECT_EQ(count, 2) << faces;
    const Probes probes(low);
    EXPECT_LE(*std::max_element(probes.count.begin(), probes.count.end()), 2) << faces;
  }
}

TEST(KeepUvs, RepeatedPartsStayCopiesBesideOthers) {
  // A patch, and one at the same UVs that goes on beyond them.
  Mesh high;
  const auto uv = [](double x, double y) { return in_layout(x, y); };
  add_grid(
      high, 0, 1, 30,
      [](double x, double y) {
        return Vec3{static_cast<float>(x), static_cast<float>(y),
                    static_cast<float>(0.05 * std::sin(9 * x) * std::cos(4 * y))};
      },
      uv);
  add_grid(
      high, 0, 2, 30,
      [](double x, double y) {
        return Vec3{static_cast<float>(5 + x), static_cast<float>(y),
                    static_cast<float>(0.08 * std::sin(3 * x + 2) * std::cos(7 * y))};
      },
      uv);
  for (const std::uint32_t faces : {2000U, 500U, 200U}) {
    const Mesh low = simplify(high, {.faces = faces, .keep_uvs = true});
    EXPECT_LE(low.triangles.size(), faces);
    for (const auto& [place, count] : places(low, 0.4901F)) EXPECT_EQ(count, 2) << faces;
    const Probes probes(low);
    for (int i = 0; i < Probes::kSide * Probes::kSide; ++i) {
      const double u = (i % Probes::kSide + 0.4142) / Probes::kSide;
      if (probes.count[static_cast<std::size_t>(i)] > (u < 0.49 ? 2 : 1)) {
        FAIL() << "overlap at " << i << " of " << faces;
      }
    }
  }
}

/// Thousands of cards over one picture, each a grid of cells turned some way: all are simplified alike, and stay copies.
/// (Were each step to look at all pairs of copies, this would take hours.)
TEST(KeepUvs, ThousandsOfCopiesStayCopies) {
  constexpr std::uint32_t kCards = 3000;
  const Mesh card = test::plane(2, 2);
  Mesh cards;
  cards.name = "cards";
  cards.uvs = card.uvs;
  for (std::uint32_t i = 0; i < kCards; ++i) {
    const double angle = 0.7 * i, c = std::cos(angle), s = std::sin(angle);
    const auto first = static_cast<std::uint32_t>(cards.positions.size());
    for (const Vec3& p : card.positions) {
      cards.positions.push_back({static_cast<float>(2.0 * (i % 60) + c * p.x),
                                 static_cast<float>(2.0 * (i / 60) + s * p.x), p.y});
    }
    for (std::size_t t = 0; t < card.triangles.size(); ++t) {
      const Triangle& v = card.triangles[t];
      cards.triangles.push_back({first + v[0], first + v[1], first + v[2]});
      cards.uv_triangles.push_back(card.uv_triangles[t]);
    }
  }
  SimplifyOptions options;
  options.faces = 2 * kCards;
  options.keep_uvs = true;
  const Mesh low = simplify(cards, options);
  EXPECT_EQ(low.triangles.size(), 2 * kCards);
  std::map<std::set<std::pair<float, float>>, std::size_t> layouts;
  for (const Triangle& t : low.uv_triangles) {
    std::set<std::pair<float, float>> corners;
    for (const std::uint32_t v : t) corners.insert({low.uvs[v].x, low.uvs[v].y});
    ++layouts[corners];
  }
  EXPECT_EQ(layouts.size(), 2U);
  for (const auto& [corners, count] : layouts) EXPECT_EQ(count, kCards);
}

/// A triangle of a layout by its corners' UVs.
void add_uv_triangle(Mesh& mesh, const std::array<Vec2, 3>& uvs) {
  const auto first = static_cast<std::uint32_t>(mesh.uvs.size());
  mesh.uvs.insert(mesh.uvs.end(), uvs.begin(), uvs.end());
  mesh.uv_triangles.push_back({first, first + 1, first + 2});
}

/// Triangles that share places, or two of their corners, with others: those of the layout that differ all count.
TEST(KeepUvs, CopiesStrayAsFarAsTheOneThatStraysMost) {
  Mesh high, low;
  for (int copy = 0; copy < 3; ++copy) add_uv_triangle(high, {{{0, 0}, {1, 0}, {0, 1}}});
  add_uv_triangle(high, {{{0, 0}, {1, 0}, {0, -1}}});
  for (int copy = 0; copy < 3; ++copy) add_uv_triangle(low, {{{0, 0}, {1, 0}, {0, 1}}});
  add_uv_triangle(low, {{{0, 0}, {1, 0}, {0, -0.5F}}});  // inside HIGH's fourth
  EXPECT_EQ(uv_deviation(low, high), 0);
  add_uv_triangle(low, {{{0, 0}, {1, 0}, {0, 1.25F}}});
  EXPECT_FLOAT_EQ(static_cast<float>(uv_deviation(low, high)), 0.25F);
  add_uv_triangle(low, {{{-0.5F, 0}, {1, 0}, {0, 1}}});
  EXPECT_FLOAT_EQ(static_cast<float>(uv_deviation(low, high)), 0.5F);
  add_uv_triangle(low, {{{0, 0}, {1, -1}, {0, 1}}});
  // Its corner lies beside the side from (1, 0) to (0, -1).
  EXPECT_FLOAT_EQ(static_cast<float>(uv_deviation(low, high)), std::sqrt(0.5F));
}

}  // namespace
}  // namespace kiln

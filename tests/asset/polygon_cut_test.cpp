// Polygons of every shape cut into triangles: all area, every corner, wherever they begin.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/polygon.h"
#include "support/environment.h"

namespace kiln {
namespace {

using Corner = std::array<double, 3>;
using Corners = std::vector<Corner>;
using Triples = std::vector<std::array<std::uint32_t, 3>>;

constexpr double kTurn = 6.283185307179586;

Corners flat(const std::vector<std::array<double, 2>>& points) {
  Corners corners;
  for (const auto& [x, y] : points) corners.push_back({x, y, 0});
  return corners;
}

/// A polygon with so many more corners on each side, evenly spaced.
Corners with_more(const Corners& corners, int more) {
  Corners result;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Corner &a = corners[i], &b = corners[(i + 1) % corners.size()];
    for (int k = 0; k <= more; ++k) {
      const double t = static_cast<double>(k) / (more + 1);
      result.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), 0});
    }
  }
  return result;
}

/// Turned in space, and rounded to floats as files are: corners on straight edges leave them by rounding.
Corners in_space(const Corners& corners) {
  Corners result;
  for (const Corner& p : corners) {
    const double u[] = {0.36, 0.48, -0.8}, v[] = {-0.8, 0.6, 0};
    Corner& q = result.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      q[k] = static_cast<double>(static_cast<float>(3.7 + p[0] * u[k] + p[1] * v[k]));
    }
  }
  return result;
}

Corner crossed(const Corner& a, const Corner& b, const Corner& c) {
  Corner n{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
  }
  return n;
}

double dot(const Corner& a, const Corner& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Twice the polygon's area along its normal: the sum of cross products.
Corner area_vector(const Corners& corners) {
  Corner sum{};
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Corner n = crossed(corners[0], corners[i], corners[i + 1]);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += n[k];
  }
  return sum;
}

struct Shape {
  std::string name;
  Corners corners;
  double area;              // by formula
  std::size_t without = 0;  // triangles that cannot have area, where the polygon touches itself
};

/// Rectangle with notches from above.
Corners comb(int teeth) {
  Corners corners = {{0, -1, 0}, {double(teeth), -1, 0}};
  for (int i = teeth - 1; i >= 0; --i) {
    corners.push_back({i + 1.0, 1, 0});
    corners.push_back({i + 0.75, 1, 0});
    corners.push_back({i + 0.5, 0, 0});
    corners.push_back({i + 0.25, 1, 0});
  }
  corners.push_back({0, 1, 0});
  return corners;
}

Corners star(int points, double inner) {
  Corners corners;
  for (int i = 0; i < 2 * points; ++i) {
    const double r = i % 2 == 0 ? 1 : inner, angle = kTurn * i / (2 * points);
    corners.push_back({r * std::cos(angle), r * std::sin(angle), 0});
  }
  return corners;
}

/// A square of side 10 with square holes of side 1, each reached by a bridge that is walked there and back.
Corners keyholes(int holes) {
  Corners corners = {{0, 0, 0}};
  for (int i = 0; i < holes; ++i) {
    const double x = 10.0 * (i + 0.5) / holes - 0.5, y = 4;
    corners.push_back({x, 0, 0});
    corners.insert(corners.end(), {{x, y, 0}, {x, y + 1, 0}, {x + 1, y + 1, 0}, {x + 1, y, 0}});
    corners.push_back({x, y, 0});
    corners.push_back({x, 0, 0});
  }
  corners.insert(corners.end(), {{10, 0, 0}, {10, 10, 0}, {0, 10, 0}});
  return corners;
}

std::vector<Shape> shapes() {
  const Corners square = flat({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  const Corners ell = flat({{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}});
  const Corners triangle = flat({{0, 0}, {4, 0}, {0, 3}});
  std::vector<Shape> all = {
      {"ell", ell, 5},
      {"triangle with a corner on one side", flat({{0, 0}, {2, 0}, {4, 0}, {0, 3}}), 6},
      {"quad with a corner on a side", flat({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {0, 1}}), 2},
      {"two squares that touch",
       flat({{0, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}}), 2, 2},
      {"repeated corners", flat({{0, 0}, {1, 0}, {1, 0}, {1, 1}, {1, 1}, {0, 1}}), 1, 2},
      {"a spur", flat({{0, 0}, {1, 0}, {1, 1}, {0.5, 1}, {0.5, 2}, {0.5, 1}, {0, 1}}), 1, 2},
  };
  for (const int more : {1, 2, 3, 8, 40}) {
    const std::string runs = " with " + std::to_string(more) + " more corners a side";
    all.push_back({"square" + runs, with_more(square, more), 1});
    all.push_back({"ell" + runs, with_more(ell, more), 5});
    all.push_back({"triangle" + runs, with_more(triangle, more), 6});
    all.push_back({"comb" + runs, with_more(comb(5), more), 10 - 5 * 0.25});
  }
  for (const int teeth : {2, 20, 100}) {
    all.push_back({"comb " + std::to_string(teeth), comb(teeth), 2.0 * teeth - teeth * 0.25});
  }
  for (const int points : {3, 7, 50, 500}) {
    all.push_back({"star " + std::to_string(points), star(points, 0.3),
                   points * 0.3 * std::sin(kTurn / (2 * points))});
    all.push_back({"disc " + std::to_string(2 * points), star(points, 1),
                   points * std::sin(kTurn / (2 * points))});
  }
  for (const int holes : {1, 2, 5, 8}) {
    all.push_back({"holes " + std::to_string(holes), keyholes(holes), 100.0 - holes});
  }
  const std::size_t count = all.size();
  for (std::size_t i = 0; i < count; ++i) {
    all.push_back(
        {all[i].name + ", in space", in_space(all[i].corners), all[i].area, all[i].without});
  }
  return all;
}

/// Sides of triangles: every one of the polygon's once, as it runs, and each cut once each way.
void expect_whole(const Shape& shape, const Triples& triangles) {
  const auto n = static_cast<std::uint32_t>(shape.corners.size());
  ASSERT_EQ(triangles.size(), n - 2) << shape.name;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    EXPECT_EQ(sides.erase({i, (i + 1) % n}), 1U) << shape.name << ", side " << i;
  }
  for (const auto& [side, times] : sides) {
    EXPECT_EQ(times, 1) << shape.name;
    EXPECT_TRUE(sides.contains({side.second, side.first})) << shape.name;
  }
}

/// \param rounding  of coordinates
void expect_area(const Shape& shape, const Triples& triangles, double rounding) {
  const Corner normal = area_vector(shape.corners);
  const double size = std::sqrt(dot(normal, normal));
  double area = 0;
  std::size_t without = 0;
  std::set<Corner> met;
  for (const auto& [a, b, c] : triangles) {
    const Corner own = crossed(shape.corners[a], shape.corners[b], shape.corners[c]);
    const double along = dot(own, normal) / size;
    area += along / 2;
    double longest = 0;
    for (const auto& [i, j] : {std::pair(a, b), {b, c}, {c, a}}) {
      Corner side{};
      for (std::size_t k = 0; k < 3; ++k) side[k] = shape.corners[j][k] - shape.corners[i][k];
      longest = std::max(longest, std::sqrt(dot(side, side)));
    }
    EXPECT_GE(along, -4 * rounding * longest) << shape.name << ": turned over";
    // A triangle no higher than corners are off by rounding is a needle, and has any normal.
    if (along > 4 * rounding * longest) {
      for (const std::uint32_t corner : {a, b, c}) met.insert(shape.corners[corner]);
    } else {
      ++without;
    }
    // Corners leave the plane by rounding, so triangles turn by it over their height.
    if (along > 40 * rounding * longest) {
      EXPECT_GT(along, 0.99 * std::sqrt(dot(own, own))) << shape.name;
    }
  }
  EXPECT_LE(without, shape.without) << shape.name;
  double around = 0;  // each side sweeps as far as its ends are off
  for (std::size_t i = 0; i < shape.corners.size(); ++i) {
    const Corner &a = shape.corners[i], &b = shape.corners[(i + 1) % shape.corners.size()];
    around += std::sqrt(dot(a, a) + dot(b, b) - 2 * dot(a, b));
  }
  EXPECT_NEAR(area, shape.area, 1e-12 * shape.area + around * rounding) << shape.name;
  if (shape.without != 0) return;
  for (const Corner& corner : shape.corners) {
    EXPECT_TRUE(met.contains(corner))
        << shape.name << ": (" << corner[0] << ", " << corner[1] << ")";
  }
}

TEST(PolygonCut, HasAllAreaAndEveryCorner) {
  for (const Shape& shape : shapes()) {
    Triples triangles;
    EXPECT_TRUE(triangulate(shape.corners, triangles)) << shape.name;
    expect_whole(shape, triangles);
    double largest = 1;
    for (const Corner& corner : shape.corners) {
      for (const double x : corner) largest = std::max(largest, std::abs(x));
    }
    // Floats are rounded to 24 bits; in the plane, only the sums above are.
    const bool rounded = shape.name.ends_with(", in space");
    expect_area(shape, triangles, largest * (rounded ? 0x1p-24 : 0x1p-50));
  }
}

TEST(PolygonCut, IsTheSameFromEveryCorner) {
  for (const Shape& shape : shapes()) {
    const std::size_t n = shape.corners.size();
    if (n == 4) continue;  // along corners 0 and 2, as elsewhere, unless the shape forbids it
    Triples first;
    triangulate(shape.corners, first);
    const std::size_t step = std::max<std::size_t>(1, n / 30);
    for (std::size_t start = 1; start < n; start += step) {
      Corners turned = shape.corners;
      std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(start),
                  turned.end());
      Triples triangles;
      triangulate(turned, triangles);
      ASSERT_EQ(triangles.size(), first.size());
      for (std::size_t t = 0; t < first.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          ASSERT_EQ(turned[triangles[t][k]], shape.corners[first[t][k]])
              << shape.name << " from corner " << start;
        }
      }
    }
  }
}

/// A triangle with a corner on one side is a quad; either way through that corner is right, the other is not.
TEST(PolygonCut, QuadsSpareNeedles) {
  const Corners corners = flat({{0, 0}, {2, 0}, {4, 0}, {0, 3}});
  for (std::size_t start = 0; start < 4; ++start) {
    Corners turned = corners;
    std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(start), turned.end());
    for (const Corners& quad : {turned, in_space(turned)}) {
      Triples triangles;
      EXPECT_TRUE(triangulate(quad, triangles));
      for (const auto& [a, b, c] : triangles) {
        const Corner n = crossed(quad[a], quad[b], quad[c]);
        EXPECT_NEAR(std::sqrt(dot(n, n)), 6, 1e-5);
      }
    }
  }
}

/// A cap bent out of its plane by a hundredth of its size: no triangle turns from it by more than its slope.
TEST(PolygonCut, OfNearlyFlatPolygonsIsNearlyFlat) {
  Corners corners = with_more(flat({{0, 0}, {4, 0}, {4, 2}, {2, 1}, {0, 2}}), 6);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i][2] = 0.01 * std::sin(0.8 * corners[i][0]) * std::cos(corners[i][1]);
  }
  Triples triangles;
  EXPECT_TRUE(triangulate(corners, triangles));
  expect_whole({"bent", corners, 6}, triangles);
  for (const auto& [a, b, c] : triangles) {
    const Corner n = crossed(corners[a], corners[b], corners[c]);
    // The slope is at most 0.01; a triangle's own may be so many times that as it is thin: by up to 10 here.
    EXPECT_GT(n[2], 0.99 * std::sqrt(dot(n, n)));
  }
}

/// Time may not grow as the square: 4,000 and 64,000 corners, most of them on straight edges.
TEST(PolygonCut, OfManyCornersOnStraightEdgesIsWholeAndQuick) {
  for (const int more : {999, 15'999}) {
    const Shape shape{"square", with_more(flat({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), more), 1};
    Triples triangles;
    EXPECT_TRUE(triangulate(shape.corners, triangles));
    expect_whole(shape, triangles);
    double area = 0;
    for (const auto& [a, b, c] : triangles) {
      const Corner n = crossed(shape.corners[a], shape.corners[b], shape.corners[c]);
      EXPECT_GT(n[2], 0);
      area += n[2] / 2;
    }
    EXPECT_NEAR(area, 1, 1e-9);
  }
}

/// Positions of the triangles that have area, sorted.
std::vector<std::array<Corner, 3>> places(const Mesh& mesh) {
  std::vector<std::array<Corner, 3>> all;
  for (const Triangle& t : mesh.triangles) {
    std::array<Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.positions[t[k]];
      corners[k] = {p.x, p.y, p.z};
    }
    const Corner n = crossed(corners[0], corners[1], corners[2]);
    if (!(dot(n, n) > 0)) continue;
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.push_back(corners);
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::size_t open_edges(const Mesh& mesh) {
  std::map<std::pair<Corner, Corner>, int> sides;
  for (const auto& t : places(mesh)) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++sides[{t[k], t[(k + 1) % 3]}];
      --sides[{t[(k + 1) % 3], t[k]}];
    }
  }
  return static_cast<std::size_t>(std::count_if(sides.begin(), sides.end(),
                                                [](const auto& s) { return s.second != 0; })) /
         2;
}

/// A box whose top is a grid of quads, so that its four walls have corners on their upper edges.
/// \param first  the corner that walls begin at
std::string box(int cells, int first) {
  std::string text;
  const auto vertex = [&](double x, double y, double z) {
    text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  };
  for (int y = 0; y <= cells; ++y) {
    for (int x = 0; x <= cells; ++x) vertex(double(x) / cells, double(y) / cells, 1);
  }
  const int below = (cells + 1) * (cells + 1) + 1;
  for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) vertex(x, y, 0);
  const auto face = [&](const std::vector<int>& corners, int from) {
    text += "f";
    for (std::size_t i = 0; i < corners.size(); ++i) {
      text += " " + std::to_string(corners[(i + static_cast<std::size_t>(from)) % corners.size()]);
    }
    text += "\n";
  };
  const auto top = [&](int x, int y) { return 1 + y * (cells + 1) + x; };
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      face({top(x, y), top(x + 1, y), top(x + 1, y + 1), top(x, y + 1)}, 0);
    }
  }
  face({below + 3, below + 2, below + 1, below}, 0);
  for (int side = 0; side < 4; ++side) {
    std::vector<int> wall = {below + side, below + (side + 1) % 4};
    for (int i = cells; i >= 0; --i) {
      const std::array<std::pair<int, int>, 4> along = {
          {{i, 0}, {cells, i}, {cells - i, cells}, {0, cells - i}}};
      wall.push_back(top(along[static_cast<std::size_t>(side)].first,
                         along[static_cast<std::size_t>(side)].second));
    }
    face(wall, first);
  }
  return text;
}

TEST(PolygonCut, LeavesClosedBoxesClosedFromEveryFirstCorner) {
  const std::filesystem::path file = test::scratch_folder() / "box.obj";
  for (const int cells : {1, 2, 3, 8, 70}) {
    std::vector<std::array<Corner, 3>> first;
    for (int from = 0; from < cells + 3; from += 1 + cells / 10) {
      std::ofstream(file) << box(cells, from);
      const Mesh mesh = load_mesh(file);
      EXPECT_EQ(open_edges(mesh), 0U) << cells << " cells, from " << from;
      if (cells == 1) continue;  // walls are quads
      if (first.empty()) first = places(mesh);
      EXPECT_EQ(places(mesh), first) << cells << " cells, from " << from;
    }
  }
}

TEST(PolygonCut, LeavesTheCasesClosed) {
  const auto folder = test::shared_data("cases/collinear");
  if (!folder) GTEST_SKIP();
  const Mesh one = load_mesh(*folder / "box0.obj"), other = load_mesh(*folder / "box2.obj");
  EXPECT_EQ(open_edges(one), 0U);
  EXPECT_EQ(open_edges(other), 0U);
  EXPECT_EQ(places(one), places(other));
}

}  // namespace
}  // namespace kiln

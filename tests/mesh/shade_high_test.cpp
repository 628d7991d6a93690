// Normals of high polys that have none: scans stay smooth, hard surfaces keep their edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "mesh/crease_rule.h"
#include "mesh/face_edges.h"
#include "mesh/smoothing_groups.h"
#include "mesh/weld.h"
#include "support/shapes.h"

namespace kiln {
namespace {

using Point = std::array<double, 3>;
using std::numbers::pi;

/// Triangles with the exact normal of the surface at each corner. Corners at one place are one vertex, unless told
/// else.
struct Shape {
  Mesh mesh;
  std::vector<Point> exact;  ///< Three a triangle; empty: nothing is known
  std::map<Point, std::uint32_t> known;

  std::uint32_t vertex(const Point& p) {
    const auto [at, added] =
        known.try_emplace(p, static_cast<std::uint32_t>(mesh.positions.size()));
    if (added)
      mesh.positions.push_back(
          {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    return at->second;
  }
  void triangle(const std::array<Point, 3>& p, const std::array<Point, 3>& n) {
    mesh.triangles.push_back({vertex(p[0]), vertex(p[1]), vertex(p[2])});
    exact.insert(exact.end(), n.begin(), n.end());
  }
  void quad(const std::array<Point, 4>& p, const std::array<Point, 4>& n) {
    triangle({p[0], p[1], p[2]}, {n[0], n[1], n[2]});
    triangle({p[0], p[2], p[3]}, {n[0], n[2], n[3]});
  }
  void flat(const std::array<Point, 4>& p, const Point& n) { quad(p, {n, n, n, n}); }
};

Point unit(Point p) {
  const double size = std::hypot(p[0], p[1], p[2]);
  return {p[0] / size, p[1] / size, p[2] / size};
}

double rounded(double x) { return std::round(x * 1e9) / 1e9 + 0.0; }

/// Of an outline in the plane of x and z, counter-clockwise seen from above (y), and the normals of its sides at both
/// ends.
struct Outline {
  struct Side {
    double x, z;          ///< Where it begins
    Point first, second;  ///< Normals at its ends
  };
  std::vector<Side> sides;
};

/// A ring of n sides, seen as a round. \param hole  its outside lies within
Outline ring(std::size_t n, double radius, bool hole = false) {
  const double way = hole ? -1 : 1;
  const auto normal = [&](std::size_t i) {
    const double a = -2 * pi * way * static_cast<double>(i % n) / static_cast<double>(n);
    return Point{way * std::cos(a), 0, way * std::sin(a)};
  };
  Outline outline;
  for (std::size_t i = 0; i < n; ++i) {
    const Point at = normal(i);
    outline.sides.push_back(
        {rounded(way * radius * at[0]), rounded(way * radius * at[2]), at, normal(i + 1)});
  }
  return outline;
}

/// A polygon whose sides are flat.
Outline corners(const std::vector<std::array<double, 2>>& points) {
  Outline outline;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& a = points[i];
    const auto& b = points[(i + 1) % points.size()];
    const Point n = unit({-(b[1] - a[1]), 0, b[0] - a[0]});
    outline.sides.push_back({a[0], a[1], n, n});
  }
  return outline;
}

void walls(Shape& shape, const Outline& outline, double low, double high, std::size_t rows = 1) {
  const std::size_t n = outline.sides.size();
  for (std::size_t i = 0; i < n; ++i) {
    const auto& a = outline.sides[i];
    const auto& b = outline.sides[(i + 1) % n];
    for (std::size_t r = 0; r < rows; ++r) {
      const double y0 = low + (high - low) * double(r) / double(rows);
      const double y1 = low + (high - low) * double(r + 1) / double(rows);
      shape.quad(
          {Point{a.x, y0, a.z}, Point{b.x, y0, b.z}, Point{b.x, y1, b.z}, Point{a.x, y1, a.z}},
          {a.first, a.second, a.second, a.first});
    }
  }
}

/// A lid of triangles around a point in the middle.
void lid(Shape& shape, const Outline& outline, double y, bool up, double x = 0, double z = 0) {
  const Point n = {0, up ? 1.0 : -1.0, 0};
  for (std::size_t i = 0; i < outline.sides.size(); ++i) {
    const auto& a = outline.sides[i];
    const auto& b = outline.sides[(i + 1) % outline.sides.size()];
    Point p = {a.x, y, a.z}, q = {b.x, y, b.z};
    if (!up) std::swap(p, q);
    shape.triangle({p, q, Point{x, y, z}}, {n, n, n});
  }
}

/// A lid between an outline and a hole of as many sides.
void ring_lid(Shape& shape, const Outline& outer, const Outline& inner, double y, bool up) {
  const Point normal = {0, up ? 1.0 : -1.0, 0};
  const std::size_t n = outer.sides.size();
  for (std::size_t i = 0; i < n; ++i) {
    const auto& a = outer.sides[i];
    const auto& b = outer.sides[(i + 1) % n];
    // The hole runs the other way round.
    const auto& d = inner.sides[(n - i) % n];
    const auto& e = inner.sides[(n - i - 1) % n];
    std::array<Point, 4> p = {Point{a.x, y, a.z}, Point{b.x, y, b.z}, Point{e.x, y, e.z},
                              Point{d.x, y, d.z}};
    if (!up) std::swap(p[1], p[3]);
    shape.flat(p, normal);
  }
}

Shape prism(const Outline& outline, double low = 0, double high = 1, std::size_t rows = 1) {
  Shape shape;
  walls(shape, outline, low, high, rows);
  lid(shape, outline, high, true);
  lid(shape, outline, low, false);
  return shape;
}

Shape box(double x, double y, double z) {
  Shape s;
  walls(s, corners({{-x, -z}, {-x, z}, {x, z}, {x, -z}}), -y, y);
  s.flat({Point{-x, y, -z}, Point{-x, y, z}, Point{x, y, z}, Point{x, y, -z}}, {0, 1, 0});
  s.flat({Point{-x, -y, -z}, Point{x, -y, -z}, Point{x, -y, z}, Point{-x, -y, z}}, {0, -1, 0});
  return s;
}

Shape tube(std::size_t n, double inner, double outer, double height) {
  Shape shape;
  const Outline out = ring(n, outer), in = ring(n, inner, true);
  walls(shape, out, 0, height);
  walls(shape, in, 0, height);
  ring_lid(shape, out, in, height, true);
  ring_lid(shape, out, in, 0, false);
  return shape;
}

/// A square plate with a hole of n sides (a multiple of 4), as drilled parts are.
Shape drilled_plate(std::size_t n, double radius, double thick) {
  Shape shape;
  std::vector<std::array<double, 2>> square;
  for (const auto& side : ring(n, 1).sides) {
    const double most = std::max(std::abs(side.x), std::abs(side.z));
    square.push_back({rounded(side.x / most), rounded(side.z / most)});
  }
  const Outline out = corners(square), in = ring(n, radius, true);
  walls(shape, out, 0, thick);
  walls(shape, in, 0, thick);
  ring_lid(shape, out, in, thick, true);
  ring_lid(shape, out, in, 0, false);
  return shape;
}

Shape cone(std::size_t n, double radius, double height) {
  Shape shape;
  const Outline out = ring(n, radius);
  lid(shape, out, 0, false);
  for (std::size_t i = 0; i < n; ++i) {
    const auto& a = out.sides[i];
    const auto& b = out.sides[(i + 1) % n];
    const auto lean = [&](const Point& p) { return unit({p[0] * height, radius, p[2] * height}); };
    const Point middle = unit({a.first[0] + a.second[0], 0, a.first[2] + a.second[2]});
    shape.triangle({Point{a.x, 0, a.z}, Point{b.x, 0, b.z}, Point{0, height, 0}},
                   {lean(a.first), lean(a.second), lean(middle)});
  }
  return shape;
}

/// A surface turned around y, from a profile of radius, height, and the normal's angle above the horizon at either end
/// of each step.
struct Turned {
  double radius, height;
  double before, after;  ///< Degrees, of the step that ends here and of the one that begins
};
Shape turned(std::size_t n, const std::vector<Turned>& profile) {
  Shape shape;
  const auto place = [&](std::size_t i, const Turned& t) {
    const double a = -2 * pi * double(i % n) / double(n);
    return Point{rounded(t.radius * std::cos(a)), rounded(t.height),
                 rounded(t.radius * std::sin(a))};
  };
  const auto normal = [&](double i, double degrees) {
    const double a = -2 * pi * i / double(n), up = degrees * pi / 180;
    return Point{std::cos(up) * std::cos(a), std::sin(up), std::cos(up) * std::sin(a)};
  };
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const Turned &p = profile[k], &q = profile[k + 1];
    for (std::size_t i = 0; i < n; ++i) {
      const double at = double(i);
      if (p.radius == 0) {
        shape.triangle({place(i, p), place(i + 1, q), place(i, q)},
                       {normal(at + 0.5, p.after), normal(at + 1, q.before), normal(at, q.before)});
      } else if (q.radius == 0) {
        shape.triangle({place(i, p), place(i + 1, p), place(i, q)},
                       {normal(at, p.after), normal(at + 1, p.after), normal(at + 0.5, q.before)});
      } else {
        shape.quad({place(i, p), place(i + 1, p), place(i + 1, q), place(i, q)},
                   {normal(at, p.after), normal(at + 1, p.after), normal(at + 1, q.before),
                    normal(at, q.before)});
      }
    }
  }
  return shape;
}

/// A disc whose upper rim is rounded by some steps.
Shape rounded_disc(std::size_t n, std::size_t steps) {
  std::vector<Turned> profile = {{0, 0, -90, -90}, {1, 0, -90, 0}};
  for (std::size_t i = 0; i <= steps; ++i) {
    const double a = 90 * double(i) / double(steps);
    profile.push_back(
        {0.8 + 0.2 * std::cos(a * pi / 180), 0.8 + 0.2 * std::sin(a * pi / 180), a, a});
  }
  profile.push_back({0, 1, 90, 90});
  return turned(n, profile);
}

Shape gear(std::size_t teeth) {
  std::vector<std::array<double, 2>> points;
  for (std::size_t i = 0; i < teeth; ++i) {
    const double step = -2 * pi / double(teeth), at = step * double(i);
    const double radii[4] = {0.8, 1, 1, 0.8}, shares[4] = {0, 0.2, 0.4, 0.6};
    for (std::size_t k = 0; k < 4; ++k) {
      points.push_back({rounded(radii[k] * std::cos(at + step * shares[k])),
                        rounded(radii[k] * std::sin(at + step * shares[k]))});
    }
  }
  return prism(corners(points), 0, 0.4);
}

/// The same shape with every flat triangle cut into four, some times.
Shape finer(const Shape& shape, int times) {
  if (times == 0) return shape;
  Shape result;
  const auto at = [&](std::size_t t, std::size_t k) {
    const Vec3& p = shape.mesh.positions[shape.mesh.triangles[t][k]];
    return Point{p.x, p.y, p.z};
  };
  const auto middle = [](const Point& a, const Point& b) {
    return Point{(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
  };
  for (std::size_t t = 0; t < shape.mesh.triangles.size(); ++t) {
    const Point p[3] = {at(t, 0), at(t, 1), at(t, 2)};
    const Point* n = &shape.exact[3 * t];
    const Point m[3] = {middle(p[0], p[1]), middle(p[1], p[2]), middle(p[2], p[0])};
    const Point v[3] = {unit(middle(n[0], n[1])), unit(middle(n[1], n[2])),
                        unit(middle(n[2], n[0]))};
    result.triangle({p[0], m[0], m[2]}, {n[0], v[0], v[2]});
    result.triangle({m[0], p[1], m[1]}, {v[0], n[1], v[1]});
    result.triangle({m[2], m[1], p[2]}, {v[2], v[1], n[2]});
    result.triangle({m[0], m[1], m[2]}, {v[0], v[1], v[2]});
  }
  return finer(result, times - 1);
}

/// Every corner its own vertex, as in STL.
Mesh soup(const Mesh& mesh) {
  Mesh result;
  result.name = mesh.name;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(result.positions.size());
    for (const std::uint32_t v : t) result.positions.push_back(mesh.positions[v]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

/// Numbers that only look random, in [-1, 1).
class Noise {
 public:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(static_cast<std::int64_t>(state_ >> 11) - (std::int64_t{1} << 52)) /
           static_cast<double>(std::int64_t{1} << 52);
  }
  double bell() { return next() + next() + next(); }  // of variance 1

 private:
  std::uint64_t state_ = 12345;
};

double mean_edge(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]];
    sum += std::hypot(double{a.x} - b.x, double{a.y} - b.y, double{a.z} - b.z);
  }
  return sum / static_cast<double>(mesh.triangles.size());
}

/// \param share  of the mean edge
Mesh noisy(Mesh mesh, double share) {
  Noise noise;
  const double size = share * mean_edge(mesh);
  for (Vec3& p : mesh.positions) {
    p.x += static_cast<float>(size * noise.bell());
    p.y += static_cast<float>(size * noise.bell());
    p.z += static_cast<float>(size * noise.bell());
  }
  return mesh;
}

/// Terrain over a grid. \param rough  heights that only look random, per cell
Mesh terrain(std::size_t n, double rough, double step = 0) {
  Mesh mesh;
  Noise noise;
  for (std::size_t j = 0; j <= n; ++j) {
    for (std::size_t i = 0; i <= n; ++i) {
      const double x = double(i), z = double(j);
      double y = 0.15 * double(n) * std::sin(6 * x / double(n)) * std::cos(5 * z / double(n)) +
                 0.03 * double(n) * std::sin(31 * x / double(n) + 17 * z / double(n)) +
                 rough * noise.next();
      if (step > 0) y = std::round(y / step) * step;
      mesh.positions.push_back({float(x), float(y), float(z)});
    }
  }
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const auto w = static_cast<std::uint32_t>(n + 1);
      const std::uint32_t a = j * w + i;
      mesh.triangles.push_back({a, a + w, a + 1});
      mesh.triangles.push_back({a + 1, a + w, a + w + 1});
    }
  }
  return mesh;
}

Mesh without_normals(Mesh mesh) {
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  return mesh;
}

/// What decimation leaves of a scan: vertices of a bumpy sphere at uneven distances.
Mesh decimated(std::uint64_t faces) {
  const Mesh fine = test::BumpySphere::dense(40 * faces, false);
  SimplifyOptions options;
  options.faces = static_cast<std::uint32_t>(faces);
  options.fit_normals = false;
  return without_normals(simplify(noisy(fine, 0.3), options));
}

/// Boundaries of cells of a grid, each a square. \param own  whether each has four vertices of its own
Mesh voxels(std::size_t n, bool own, const std::function<bool(int, int, int)>& solid) {
  Mesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const int directions[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  const auto inside = [&](int x, int y, int z) {
    const int m = static_cast<int>(n);
    return x >= 0 && y >= 0 && z >= 0 && x < m && y < m && z < m && solid(x, y, z);
  };
  for (int x = 0; x < int(n); ++x)
    for (int y = 0; y < int(n); ++y)
      for (int z = 0; z < int(n); ++z) {
        if (!inside(x, y, z)) continue;
        for (const auto& d : directions) {
          if (inside(x + d[0], y + d[1], z + d[2])) continue;
          const int axis = d[0] != 0 ? 0 : d[1] != 0 ? 1 : 2, sign = d[axis];
          const int u = (axis + 1) % 3, v = (axis + 2) % 3;
          std::array<std::uint32_t, 4> quad{};
          const int order[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
          for (int k = 0; k < 4; ++k) {
            std::array<int, 3> p = {x, y, z};
            p[std::size_t(axis)] += sign > 0 ? 1 : 0;
            p[std::size_t(u)] += order[sign > 0 ? k : 3 - k][0];
            p[std::size_t(v)] += order[sign > 0 ? k : 3 - k][1];
            const auto next = static_cast<std::uint32_t>(mesh.positions.size());
            if (!own && known.contains(p)) {
              quad[std::size_t(k)] = known[p];
              continue;
            }
            known[p] = quad[std::size_t(k)] = next;
            mesh.positions.push_back({float(p[0]), float(p[1]), float(p[2])});
          }
          mesh.triangles.push_back({quad[0], quad[1], quad[2]});
          mesh.triangles.push_back({quad[0], quad[2], quad[3]});
        }
      }
  return mesh;
}

/// The surface of a field by marching tetrahedra: six to a cell, vertices where the field is 0, or in the middle of
/// edges.
Mesh marched(int n, bool labels, const std::function<double(double, double, double)>& field) {
  Mesh mesh;
  std::map<std::pair<int, int>, std::uint32_t> known;
  const auto id = [&](int x, int y, int z) { return (x * (n + 1) + y) * (n + 1) + z; };
  const auto at = [&](int i) {
    return Point{double(i / ((n + 1) * (n + 1))), double(i / (n + 1) % (n + 1)),
                 double(i % (n + 1))};
  };
  const auto value = [&](int i) {
    const Point p = at(i);
    const double f = field(p[0], p[1], p[2]);
    return labels ? (f < 0 ? -1.0 : 1.0) : f == 0 ? 1e-6 : f;
  };
  const auto cut = [&](int a, int b) {
    if (a > b) std::swap(a, b);
    const auto [found, added] = known.try_emplace({a, b}, std::uint32_t(mesh.positions.size()));
    if (added) {
      const double s = value(a) / (value(a) - value(b));
      const Point p = at(a), q = at(b);
      mesh.positions.push_back({float(p[0] + s * (q[0] - p[0])), float(p[1] + s * (q[1] - p[1])),
                                float(p[2] + s * (q[2] - p[2]))});
    }
    return found->second;
  };
  const int tets[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                          {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z)
        for (const auto& tet : tets) {
          std::vector<int> in, out;
          for (const int c : tet) {
            const int i = id(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
            (value(i) < 0 ? in : out).push_back(i);
          }
          const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            // Outwards: away from a corner inside.
            const auto v = [&](std::uint32_t k) {
              const Vec3& p = mesh.positions[k];
              return Point{p.x, p.y, p.z};
            };
            const Point p = v(a), q = v(b), r = v(c), o = at(in[0]);
            const Point e = {q[0] - p[0], q[1] - p[1], q[2] - p[2]},
                        f = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
            const Point m = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                             e[0] * f[1] - e[1] * f[0]};
            const double side = m[0] * (p[0] - o[0]) + m[1] * (p[1] - o[1]) + m[2] * (p[2] - o[2]);
            mesh.triangles.push_back(side > 0 ? Triangle{a, b, c} : Triangle{a, c, b});
          };
          if (in.size() == 1) add(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]));
          if (in.size() == 3) add(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]));
          if (in.size() == 2) {
            const std::uint32_t a = cut(in[0], out[0]), b = cut(in[0], out[1]),
                                c = cut(in[1], out[1]), d = cut(in[1], out[0]);
            add(a, b, c);
            add(a, c, d);
          }
        }
  return mesh;
}

/// Mean and greatest angle between the corners' normals and the exact ones, degrees, by area.
std::pair<double, double> off(const Mesh& mesh, const std::vector<Point>& exact) {
  double sum = 0, all = 0, most = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto p = [&](std::size_t k) { return mesh.positions[mesh.triangles[t][k]]; };
    const Point e = {double{p(1).x} - p(0).x, double{p(1).y} - p(0).y, double{p(1).z} - p(0).z};
    const Point f = {double{p(2).x} - p(0).x, double{p(2).y} - p(0).y, double{p(2).z} - p(0).z};
    const double area =
        std::hypot(e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]);
    if (!(area > 0)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& n = mesh.normals[mesh.normal_triangles[t][k]];
      const Point& m = exact[3 * t + k];
      const double cosine = n.x * m[0] + n.y * m[1] + n.z * m[2];
      const double sine =
          std::hypot(n.y * m[2] - n.z * m[1], n.z * m[0] - n.x * m[2], n.x * m[1] - n.y * m[0]);
      const double degrees = std::atan2(sine, cosine) * 180 / pi;
      sum += area * degrees;
      all += area;
      most = std::max(most, degrees);
    }
  }
  return {sum / all, most};
}

struct Hard {
  const char* name;
  std::function<Shape()> make;
  double most = 0.1;  ///< Degrees off the exact normals, at any corner
};

Outline profile_l() { return corners({{0, 0}, {0, 1}, {0.2, 1}, {0.2, 0.2}, {1, 0.2}, {1, 0}}); }
Outline chamfered() {
  return corners(
      {{-1, -0.8}, {-1, 0.8}, {-0.8, 1}, {0.8, 1}, {1, 0.8}, {1, -0.8}, {0.8, -1}, {-0.8, -1}});
}

const std::vector<Hard>& hard_shapes() {
  static const std::vector<Hard> shapes = {
      {"box", [] { return box(1, 1, 1); }},
      {"flat box", [] { return box(3, 0.1, 2); }},
      {"box, fine", [] { return finer(box(1, 2, 1), 4); }},
      {"plate, hole of 8", [] { return drilled_plate(8, 0.4, 0.5); }},
      {"plate, hole of 16", [] { return drilled_plate(16, 0.4, 0.5); }},
      {"plate, hole of 48", [] { return drilled_plate(48, 0.3, 0.5); }},
      {"plate, hole of 128, fine", [] { return finer(drilled_plate(128, 0.7, 0.2), 1); }},
      {"cylinder of 8", [] { return prism(ring(8, 0.5)); }},
      {"cylinder of 12", [] { return prism(ring(12, 0.5)); }},
      {"cylinder of 16", [] { return prism(ring(16, 0.5)); }},
      {"cylinder of 32", [] { return prism(ring(32, 0.5), 0, 3, 5); }},
      {"cylinder of 128", [] { return prism(ring(128, 0.5)); }},
      {"hexagon",
       [] {
         return prism(corners(
             {{1, 0}, {0.5, -0.866}, {-0.5, -0.866}, {-1, 0}, {-0.5, 0.866}, {0.5, 0.866}}));
       }},
      {"chamfered bar", [] { return prism(chamfered(), 0, 2); }},
      {"L profile", [] { return prism(profile_l(), 0, 3); }},
      {"gear of 12", [] { return gear(12); }},
      {"gear of 40", [] { return gear(40); }},
      {"tube of 10", [] { return tube(10, 0.4, 0.5, 2); }},
      {"tube of 64", [] { return tube(64, 0.3, 0.5, 2); }},
      {"cone of 16", [] { return cone(16, 0.5, 1.5); }, 0.35},
      {"cone of 64", [] { return cone(64, 1, 1); }},
      {"rounded disc, 3 steps", [] { return rounded_disc(48, 3); }, 2.5},
      {"rounded disc, 8 steps", [] { return rounded_disc(64, 8); }, 0.5},
      {"ridged roof",
       [] {
         return prism(corners({{-2, 0}, {0, 0.4}, {2, 0}, {2, -1}, {-2, -1}}), 0, 5);
       }},
      {"wedge",
       [] {
         return prism(corners({{0, 0}, {0, 0.5}, {3, 0}}), 0, 2);
       }},
  };
  return shapes;
}

struct Smooth {
  const char* name;
  std::function<Mesh()> make;
};

double blob(double x, double y, double z) {
  const double u = x - 12.1, v = y - 11.9, w = z - 12.2;
  return std::sqrt(u * u + v * v + w * w) - 8 - 1.2 * std::sin(0.7 * u) * std::cos(0.6 * v) -
         std::sin(0.5 * w);
}

const std::vector<Smooth>& smooth_shapes() {
  static const std::vector<Smooth> shapes = {
      {"bumpy sphere", [] { return test::BumpySphere::dense(20000); }},
      {"bumpy sphere, noise 1%", [] { return noisy(test::BumpySphere::dense(20000), 0.01); }},
      {"bumpy sphere, noise 5%", [] { return noisy(test::BumpySphere::dense(20000), 0.05); }},
      {"bumpy sphere, noise 10%", [] { return noisy(test::BumpySphere::dense(20000), 0.1); }},
      {"bumpy sphere, noise 20%", [] { return noisy(test::BumpySphere::dense(20000), 0.2); }},
      {"bumpy sphere, noise 40%", [] { return noisy(test::BumpySphere::dense(20000), 0.4); }},
      {"coarse bumpy sphere", [] { return test::BumpySphere::dense(300); }},
      {"coarse bumpy sphere, noise", [] { return noisy(test::BumpySphere::dense(300), 0.1); }},
      {"icosphere 0", [] { return test::icosphere(0); }},
      {"icosphere 1", [] { return test::icosphere(1); }},
      {"icosphere 2", [] { return test::icosphere(2); }},
      {"icosphere 4", [] { return test::icosphere(4); }},
      {"sphere of 8 x 6", [] { return without_normals(test::uv_sphere(8, 6)); }},
      {"sphere of 12 x 6", [] { return without_normals(test::uv_sphere(12, 6)); }},
      {"sphere of 16 x 8", [] { return without_normals(test::uv_sphere(16, 8)); }},
      {"sphere of 48 x 24", [] { return without_normals(test::uv_sphere(48, 24)); }},
      {"torus of 24 x 12", [] { return without_normals(test::torus(24, 12)); }},
      {"torus of 64 x 32, noise", [] { return noisy(without_normals(test::torus(64, 32)), 0.1); }},
      {"terrain", [] { return terrain(80, 0); }},
      {"rough terrain", [] { return terrain(80, 0.3); }},
      {"very rough terrain", [] { return terrain(80, 1.5); }},
      {"terrain of 256 steps", [] { return terrain(80, 0, 0.1); }},
      {"decimated to 500", [] { return decimated(500); }},
      {"decimated to 3000", [] { return decimated(3000); }},
      {"marched field", [] { return marched(24, false, blob); }},
      {"marched labels", [] { return marched(24, true, blob); }},
  };
  return shapes;
}

TEST(ShadeHigh, HardSurfacesKeepTheirEdgesAndRoundsAreSmooth) {
  for (const Hard& hard : hard_shapes()) {
    const Shape shape = hard.make();
    for (const bool apart : {false, true}) {
      Mesh mesh = apart ? soup(shape.mesh) : shape.mesh;
      const ShadingReport report = shade_high(mesh);
      EXPECT_EQ(report.chosen, ShadingRule::angle) << hard.name << apart;
      if (mesh.normals.empty()) continue;
      const auto [mean, most] = off(mesh, shape.exact);
      EXPECT_LT(most, hard.most) << hard.name << apart << " mean " << mean << " hard "
                                 << report.hard_edges << " from " << report.least_degrees
                                 << " smooth to " << report.most_degrees;
    }
  }
}

TEST(ShadeHigh, ScansStaySmooth) {
  for (const Smooth& smooth : smooth_shapes()) {
    const Mesh shape = smooth.make();
    for (const bool apart : {false, true}) {
      Mesh mesh = apart ? soup(shape) : shape;
      const ShadingReport report = shade_high(mesh);
      EXPECT_EQ(report.chosen, ShadingRule::smooth)
          << smooth.name << apart << " hard " << report.hard_edges << " of "
          << mesh.triangles.size() * 3 / 2 << " from " << report.least_degrees;
      EXPECT_TRUE(mesh.normals.empty());
    }
  }
}

/// Angle of a triangle's corner normals off its face, the greatest of a mesh, degrees.
double most_off_faces(const Mesh& mesh) {
  std::vector<Point> faces;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
    const Point e = {double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
    const Point f = {double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z};
    const Point n =
        unit({e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]});
    faces.insert(faces.end(), {n, n, n});
  }
  return off(mesh, faces).second;
}

/// Six grids, each with vertices of its own.
Mesh grid_cube(std::size_t n) {
  Mesh mesh;
  for (int side = 0; side < 6; ++side) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const int axis = side / 2;
    for (std::size_t j = 0; j <= n; ++j) {
      for (std::size_t i = 0; i <= n; ++i) {
        const double u = 2 * double(i) / double(n) - 1, v = 2 * double(j) / double(n) - 1;
        std::array<float, 3> p{};
        p[std::size_t(axis)] = side % 2 == 0 ? 1.0F : -1.0F;
        p[std::size_t(axis + 1) % 3] = float(side % 2 == 0 ? u : -u);
        p[std::size_t(axis + 2) % 3] = float(v);
        mesh.positions.push_back({p[0], p[1], p[2]});
      }
    }
    const auto w = static_cast<std::uint32_t>(n + 1);
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = first + j * w + i;
        mesh.triangles.push_back({a, a + 1, a + w + 1});
        mesh.triangles.push_back({a, a + w + 1, a + w});
      }
    }
  }
  return mesh;
}

TEST(ShadeHigh, VerticesThatTheFileSplitsAreHardEdges) {
  Mesh cube = grid_cube(12);
  EXPECT_EQ(shade_high(cube).split_parts, 1U);
  EXPECT_LT(most_off_faces(cube), 1e-3);
  const auto ball = [](int x, int y, int z) {
    return (x - 8) * (x - 8) + (y - 8) * (y - 8) + (z - 8) * (z - 8) < 50;
  };
  for (const bool own : {false, true}) {
    Mesh terraces = voxels(16, own, ball);
    shade_high(terraces);
    EXPECT_LT(most_off_faces(terraces), 1e-3) << own;
  }
}

/// A blade whose four flats are grids of their own: two edges are sharp, two ridges turn by 17 degrees, which are edges
/// where the file splits them. With shared vertices nothing says so.
TEST(ShadeHigh, RidgesOfABladeThatTheFileSplitsAreHardEdges) {
  const auto blade = [](bool split) {
    constexpr std::uint32_t kRows = 20, kColumns = 5;
    const std::array<std::array<double, 2>, 4> profile{{{1, 0}, {0, 0.15}, {-1, 0}, {0, -0.15}}};
    Mesh mesh;
    for (std::size_t side = 0; side < 4; ++side) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      const auto &a = profile[side], &b = profile[(side + 1) % 4];
      for (std::uint32_t j = 0; j <= kRows; ++j) {
        for (std::uint32_t i = 0; i <= kColumns; ++i) {
          const double t = double(i) / kColumns;
          mesh.positions.push_back({float(a[0] + t * (b[0] - a[0])),
                                    float(a[1] + t * (b[1] - a[1])), float(10.0 * j / kRows)});
        }
      }
      for (std::uint32_t j = 0; j < kRows; ++j) {
        for (std::uint32_t i = 0; i < kColumns; ++i) {
          const std::uint32_t v = first + j * (kColumns + 1) + i, w = v + kColumns + 1;
          mesh.triangles.push_back({v, v + 1, w + 1});
          mesh.triangles.push_back({v, w + 1, w});
        }
      }
    }
    if (!split) mesh.triangles = welded_triangles(mesh);
    return mesh;
  };
  Mesh sharp = blade(true);
  const ShadingReport report = shade_high(sharp);
  EXPECT_EQ(report.split_parts, 1U);
  EXPECT_LT(most_off_faces(sharp), 1e-3);
  EXPECT_NEAR(report.least_degrees, 2 * std::atan(0.15) * 180 / pi, 0.01);
  Mesh shared = blade(false);
  EXPECT_EQ(shade_high(shared).split_parts, 0U);
}

/// A seam of UVs splits vertices of a tube, whose faces turn by 12 degrees there as everywhere: it is no edge.
TEST(ShadeHigh, SeamsOfUvsStaySmooth) {
  constexpr std::uint32_t kAround = 30, kAlong = 4;
  Mesh tube;
  for (std::uint32_t j = 0; j <= kAlong; ++j) {
    for (std::uint32_t i = 0; i <= kAround; ++i) {
      const double a = 2 * pi * (i % kAround) / kAround;
      tube.positions.push_back({float(std::cos(a)), float(std::sin(a)), float(j)});
    }
  }
  for (std::uint32_t j = 0; j < kAlong; ++j) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t v = j * (kAround + 1) + i, w = v + kAround + 1;
      tube.triangles.push_back({v, v + 1, w + 1});
      tube.triangles.push_back({v, w + 1, w});
    }
  }
  // Beside it a cube, so that edges are looked for at all.
  const std::vector<Mesh> both = {tube, grid_cube(4)};
  Mesh mesh = join_meshes(both);
  EXPECT_EQ(shade_high(mesh).hard_parts, 1U);
}

/// A bend of 40 degrees in twelve sheets that share their vertices but along one line: the file says where it is hard.
TEST(ShadeHigh, TheFileDecidesWhereItSharesAndSplits) {
  Shape left, right;
  const auto strip = [](Shape& shape, double from, double step, int count) {
    double x = 0, y = 0, angle = from;
    for (int i = 0; i < count; ++i, angle += step) {
      const double a = angle * pi / 180, u = x + std::cos(a), v = y + std::sin(a);
      const Point n = {-std::sin(a), std::cos(a), 0};
      shape.flat({Point{rounded(x), rounded(v * 0 + y), 1}, Point{rounded(u), rounded(v), 1},
                  Point{rounded(u), rounded(v), 0}, Point{rounded(x), rounded(y), 0}},
                 n);
      x = u;
      y = v;
    }
  };
  strip(left, 180, 5, 6);    // from the middle line to the left, bending by 5 degrees a step
  strip(right, -40, -5, 6);  // and to the right, 40 degrees off
  Mesh mesh = right.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), left.mesh.positions.begin(),
                        left.mesh.positions.end());
  for (const Triangle& t : left.mesh.triangles)
    mesh.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
  Mesh split = mesh;
  const ShadingReport report = shade_high(split);
  EXPECT_EQ(report.split_parts, 1U);
  EXPECT_EQ(report.hard_edges, 1U);
  EXPECT_NEAR(report.least_degrees, 40, 0.01);
  EXPECT_NEAR(report.most_degrees, 5, 0.01);
}

/// Corrugated sheet: strips of one size that bend by 45 degrees to one side and to the other. No round bends both ways.
TEST(ShadeHigh, FoldsThatBendBothWaysAreNoRound) {
  constexpr int kStrips = 20;
  const double half = 22.5 * pi / 180;
  for (const bool alternates : {true, false}) {
    Shape sheet;
    double x = 0, z = 0;
    for (int i = 0; i < kStrips; ++i) {
      // Seven that bend to one side are a round, but for its ends, which have no third strip.
      if (!alternates && i == 7) break;
      const double slope = alternates ? (i % 2 == 0 ? half : -half) : (3 - i) * 2 * half;
      const double u = x + std::cos(slope), v = z + std::sin(slope);
      sheet.flat({Point{rounded(x), 0, rounded(z)}, Point{rounded(u), 0, rounded(v)},
                  Point{rounded(u), 4, rounded(v)}, Point{rounded(x), 4, rounded(z)}},
                 {-std::sin(slope), 0, std::cos(slope)});
      x = u;
      z = v;
    }
    const ShadingReport report = shade_high(sheet.mesh);
    EXPECT_EQ(report.hard_edges, alternates ? kStrips - 1U : 2U);
  }
}

TEST(ShadeHigh, SplitsOfUvSeamsOnAScanSayNothing) {
  Mesh mesh = without_normals(test::torus(16, 10));
  Mesh halves;
  for (const bool right : {false, true}) {
    std::map<std::uint32_t, std::uint32_t> own;
    for (const Triangle& t : mesh.triangles) {
      if ((mesh.positions[t[0]].x > 0.3F) != right) continue;
      Triangle made{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [at, added] = own.try_emplace(t[k], std::uint32_t(halves.positions.size()));
        if (added) halves.positions.push_back(mesh.positions[t[k]]);
        made[k] = at->second;
      }
      halves.triangles.push_back(made);
    }
  }
  EXPECT_EQ(shade_high(halves).chosen, ShadingRule::smooth);
}

TEST(ShadeHigh, EachPartIsJudgedByItself) {
  Shape shape = prism(ring(16, 0.1), 0, 0.2);  // hardly any of the whole
  Mesh mesh = shape.mesh;
  const Mesh scan = noisy(test::BumpySphere::dense(3000), 0.4);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : scan.positions) mesh.positions.push_back({p.x + 5, p.y, p.z});
  for (const Triangle& t : scan.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  const ShadingReport report = shade_high(mesh);
  EXPECT_EQ(report.parts, 2U);
  EXPECT_EQ(report.hard_parts, 1U);
  EXPECT_EQ(report.hard_edges, 32U);
  // The scan has the normals that it has alone, to rounding.
  Mesh alone = scan;
  shade_high(alone, {.rule = ShadingRule::angle, .angle_degrees = 180});
  double most = 0;
  for (std::size_t t = 0; t < scan.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& a = alone.normals[alone.normal_triangles[t][k]];
      const Vec3& b = mesh.normals[mesh.normal_triangles[shape.mesh.triangles.size() + t][k]];
      most = std::max(most, std::hypot(double{a.x} - b.x, double{a.y} - b.y, double{a.z} - b.z));
    }
  }
  EXPECT_LT(most, 1e-3);  // 5 moves it by a rounding of 4e-7 beside edges of 0.05
}

TEST(ShadeHigh, CrumbsOfAScanStaySmooth) {
  const Mesh scan = noisy(test::BumpySphere::dense(20000), 0.25);
  Mesh crumbs;
  std::map<std::pair<std::size_t, std::uint32_t>, std::uint32_t> own;
  for (std::size_t t = 0; t < scan.triangles.size(); ++t) {
    Triangle made{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [at, added] =
          own.try_emplace({t / 24, scan.triangles[t][k]}, std::uint32_t(crumbs.positions.size()));
      if (added) {
        Vec3 p = scan.positions[scan.triangles[t][k]];
        p.y += 3 * static_cast<float>(t / 24);
        crumbs.positions.push_back(p);
      }
      made[k] = at->second;
    }
    crumbs.triangles.push_back(made);
  }
  const ShadingReport report = shade_high(crumbs);
  EXPECT_GT(report.parts, 800U);
  EXPECT_LE(report.hard_parts, report.parts / 100);
}

/// What scanners and isosurfaces leave: triangles a thousandth as high as they are long, at any angle to those beside.
TEST(ShadeHigh, NeedlesOfAScanAreNoEdges) {
  Mesh mesh = test::BumpySphere::dense(3000);
  const std::size_t count = mesh.triangles.size();
  for (std::size_t t = 0; t < count; t += 60) {
    const Triangle at = mesh.triangles[t];
    const Vec3 a = mesh.positions[at[0]], b = mesh.positions[at[1]], c = mesh.positions[at[2]];
    const auto between = [&](float x, float y, float z) {
      const float near = 1e-3F, out = 1 + 2e-4F;  // towards the third corner, and outwards
      return out * ((x + y) / 2 * (1 - near) + z * near);
    };
    const auto m = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(
        {between(a.x, b.x, c.x), between(a.y, b.y, c.y), between(a.z, b.z, c.z)});
    mesh.triangles[t] = {at[0], at[1], m};
    mesh.triangles.push_back({at[1], at[2], m});
    mesh.triangles.push_back({at[2], at[0], m});
  }
  const FaceEdges faces = FaceEdges::of(mesh);
  EXPECT_GT(std::count_if(faces.edges.begin(), faces.edges.end(),
                          [](const FaceEdge& e) { return e.degrees > 20; }),
            100);
  EXPECT_EQ(shade_high(mesh).chosen, ShadingRule::smooth);
}

TEST(ShadeHigh, RulesOverTheFilesNormals) {
  const Shape shape = box(1, 1, 1);
  Mesh smooth = shape.mesh;
  shade_high(smooth, {.rule = ShadingRule::angle, .angle_degrees = 120});
  ASSERT_FALSE(smooth.normals.empty());
  EXPECT_GT(off(smooth, shape.exact).second, 50);
  // The file's normals are kept, with a warning where flats are shaded round.
  Mesh kept = smooth;
  const ShadingReport by_file = shade_high(kept);
  EXPECT_EQ(by_file.chosen, ShadingRule::file);
  EXPECT_EQ(kept.normals, smooth.normals);
  ASSERT_EQ(by_file.warnings.size(), 1U);
  EXPECT_EQ(by_file.warnings[0].code, "bent-planes");
  EXPECT_NEAR(by_file.bent_planes, 1, 1e-6);
  for (const ShadingOptions& rule :
       {ShadingOptions{ShadingRule::angle, 90}, ShadingOptions{ShadingRule::flat, 30}}) {
    Mesh mesh = smooth;
    EXPECT_TRUE(shade_high(mesh, rule).warnings.empty());
    EXPECT_LT(off(mesh, shape.exact).second, 1e-3);
  }
  Mesh none = smooth;
  const ShadingReport report = shade_high(none, {.rule = ShadingRule::smooth});
  EXPECT_TRUE(none.normals.empty() && none.normal_triangles.empty());
  EXPECT_EQ(report.warnings.size(), 1U);
  for (const double angle : {0.0, -1.0, 180.5, double{NAN}}) {
    Mesh mesh = smooth;
    EXPECT_THROW(shade_high(mesh, {.rule = ShadingRule::angle, .angle_degrees = angle}), Error)
        << angle;
  }
}

TEST(ShadeHigh, RightNormalsOfAFileAreNoWarning) {
  for (const Hard& hard : hard_shapes()) {
    Shape shape = hard.make();
    for (std::size_t i = 0; i < shape.exact.size(); ++i) {
      const Point& n = shape.exact[i];
      shape.mesh.normals.push_back({float(n[0]), float(n[1]), float(n[2])});
      if (i % 3 == 2) {
        const auto at = static_cast<std::uint32_t>(i);
        shape.mesh.normal_triangles.push_back({at - 2, at - 1, at});
      }
    }
    Mesh mesh = shape.mesh;
    const ShadingReport report = shade_high(mesh);
    EXPECT_TRUE(report.warnings.empty()) << hard.name;
    EXPECT_EQ(mesh.normals, shape.mesh.normals);
  }
}

/// Two files joined, one of them with normals: the other's edges are hard all the same.
TEST(ShadeHigh, TrianglesWithoutNormalsBesideOthers) {
  Shape first = box(1, 1, 1), second = box(1, 1, 1);
  Mesh with = first.mesh;
  shade_high(with, {.rule = ShadingRule::angle, .angle_degrees = 100});  // smooth, on purpose
  for (Vec3& p : second.mesh.positions) p.x += 10;
  const std::vector<Mesh> both = {with, second.mesh};
  Mesh mesh = join_meshes(both);
  const ShadingReport report = shade_high(mesh);
  EXPECT_EQ(report.given, 12U);
  EXPECT_EQ(report.missing, 12U);
  first.exact.insert(first.exact.end(), second.exact.begin(), second.exact.end());
  Mesh right = mesh;
  right.triangles.erase(right.triangles.begin(), right.triangles.begin() + 12);
  right.normal_triangles.erase(right.normal_triangles.begin(), right.normal_triangles.begin() + 12);
  EXPECT_LT(off(right, second.exact).second, 1e-3);
  for (std::size_t t = 0; t < 12; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(mesh.normals[mesh.normal_triangles[t][k]],
                with.normals[with.normal_triangles[t][k]]);
    }
  }
}

/// Faces of two smoothing groups at once join what belongs to either, as in 3DS and FBX.
TEST(ShadeHigh, SmoothingGroupsOfSeveralBits) {
  // A gutter of three long faces, 60 degrees each: groups 1, 1 and 2, 2.
  Shape shape;
  double x = 0, y = 0;
  for (int i = 0; i < 3; ++i) {
    const double a = (60 - 60 * i) * pi / 180, u = x + std::cos(a), v = y + std::sin(a);
    shape.flat({Point{rounded(x), rounded(y), 1}, Point{rounded(u), rounded(v), 1},
                Point{rounded(u), rounded(v), 0}, Point{rounded(x), rounded(y), 0}},
               {-std::sin(a), std::cos(a), 0});
    x = u;
    y = v;
  }
  const auto between = [&](const std::vector<std::uint32_t>& masks) {
    Mesh mesh = shape.mesh;
    give_group_normals(mesh, masks);
    return off(mesh, shape.exact).second;
  };
  EXPECT_NEAR(between({1, 1, 3, 3, 2, 2}), 30, 0.01);  // smooth on both sides
  EXPECT_LT(between({1, 1, 2, 2, 4, 4}), 0.01);        // all apart
  EXPECT_LT(between({0, 0, 0, 0, 0, 0}), 0.01);        // none: flat
  Mesh mesh = shape.mesh;
  give_group_normals(mesh, std::vector<std::uint32_t>{1, 1, 3, 3, 4, 4});
  const auto z = [&](std::size_t t) { return mesh.normals[mesh.normal_triangles[t][0]]; };
  EXPECT_NEAR(z(4).y, shape.exact[12][1], 1e-6);  // the third face stands alone
}

TEST(ShadeHigh, PolygonsAreOneFaceEach) {
  Shape shape = prism(ring(16, 0.5));
  for (std::uint32_t t = 0; t < shape.mesh.triangles.size(); ++t) {
    shape.mesh.polygons.push_back(t < 32 ? t / 2 : t - 16);
  }
  Mesh mesh = shape.mesh;
  EXPECT_EQ(shade_high(mesh).hard_edges, 32U);
  EXPECT_LT(off(mesh, shape.exact).second, 0.1);
}

TEST(ShadeHigh, FlatFacesNeedNoNormalsOfTheFile) {
  const Shape shape = box(1, 2, 3);
  Mesh mesh = shape.mesh;
  ASSERT_TRUE(mesh.normal_triangles.empty());
  EXPECT_EQ(shade_high(mesh, {.rule = ShadingRule::flat}).chosen, ShadingRule::flat);
  ASSERT_EQ(mesh.normal_triangles.size(), mesh.triangles.size());
  EXPECT_LT(off(mesh, shape.exact).second, 1e-3);
}

/// A roof along z, of faces (0, 1, 2) and (1, 0, 3), and a third one beyond.
TEST(ShadeHigh, FaceEdgesAreDescribed) {
  Mesh roof;
  roof.positions = {{0, 0, 0}, {0, 0, 1}, {-1, -1, 0}, {1, -1, 0}};
  roof.triangles = {{1, 0, 2}, {0, 1, 3}};
  const auto only = [](const Mesh& mesh) {
    const FaceEdges faces = FaceEdges::of(mesh);
    EXPECT_EQ(faces.edges.size(), 1U);
    EXPECT_FALSE(faces.left_out);
    return faces.edges.empty() ? FaceEdge{} : faces.edges[0];
  };
  const FaceEdge ridge = only(roof);
  EXPECT_NEAR(ridge.degrees, 90, 1e-4);
  EXPECT_TRUE(ridge.convex);
  EXPECT_FALSE(ridge.split);
  EXPECT_FALSE(ridge.inner);
  for (const std::uint32_t side : ridge.sides) EXPECT_EQ(side % 3, 0U);
  EXPECT_NE(ridge.sides[0] / 3, ridge.sides[1] / 3);
  // Open all around but for the ridge, whose ends are ends of open edges, too.
  const FaceEdges faces = FaceEdges::of(roof);
  EXPECT_EQ(faces.borders, std::vector<bool>(4, true));
  EXPECT_NEAR(faces.areas[0], std::sqrt(2) / 2, 1e-6);
  Mesh valley = roof;
  for (Vec3& p : valley.positions) p.y = -p.y;
  for (Triangle& t : valley.triangles) std::swap(t[0], t[1]);
  // Turned round as well, it looks down again: a ridge from below is a valley from above.
  EXPECT_TRUE(only(valley).convex);
  for (Triangle& t : valley.triangles) std::swap(t[0], t[1]);
  EXPECT_FALSE(only(valley).convex);
  Mesh split = roof;
  split.positions.push_back(split.positions[1]);
  split.triangles[1] = {0, 4, 3};
  EXPECT_TRUE(only(split).split);
  split.triangles[1] = {0, 1, 3};
  EXPECT_FALSE(only(split).split);
  Mesh bent = roof;
  bent.polygons = {0, 0};
  EXPECT_TRUE(only(bent).inner);
  EXPECT_EQ(only(bent).degrees, 0);
  bent.polygons = {0, 1};
  EXPECT_FALSE(only(bent).inner);
  // Faces of opposite orientation have no edge in common.
  Mesh turned = roof;
  std::swap(turned.triangles[1][0], turned.triangles[1][1]);
  EXPECT_TRUE(FaceEdges::of(turned).edges.empty());
}

TEST(ShadeHigh, PolygonsDoNotPartWithin) {
  Mesh folded;
  folded.positions = {{0, 0, 0}, {1, 0.5F, 0}, {1, 0, 1}, {0, 0.5F, 1}};
  folded.triangles = {{0, 2, 1}, {0, 3, 2}};
  const ShadingOptions rule = {.rule = ShadingRule::angle, .angle_degrees = 10};
  Mesh apart = folded;
  EXPECT_EQ(shade_high(apart, rule).hard_edges, 1U);
  folded.polygons = {0, 0};
  EXPECT_EQ(shade_high(folded, rule).hard_edges, 0U);
  for (const auto& corners : folded.normal_triangles) {
    for (const std::uint32_t n : corners) EXPECT_GT(folded.normals[n].y, 0.99F);
  }
}

TEST(ShadeHigh, TheSameFromAnyScaleAndPlace) {
  for (const double scale : {1e-3, 25.4, 1e4}) {
    const Shape shape = drilled_plate(24, 0.4, 0.3);
    Mesh mesh = shape.mesh;
    for (Vec3& p : mesh.positions) {
      p = {float(scale * (0.8 * p.x + 0.6 * p.z + 3)), float(scale * (p.y - 2)),
           float(scale * (0.8 * p.z - 0.6 * p.x))};
    }
    EXPECT_EQ(shade_high(mesh).hard_edges, 4 + 2 * (24 + 24U)) << scale;
  }
}

/// Edges are left out of meshes that turn gently everywhere, and of no others.
TEST(ShadeHigh, EdgesThatTurnEnoughAreFound) {
  for (const auto& [degrees, left_out] :
       {std::pair(14.0, true), std::pair(20.5, false), std::pair(39.0, false)}) {
    const double a = degrees / 2 * pi / 180;
    Shape hinge;
    hinge.flat({Point{-std::cos(a), -std::sin(a), 0}, Point{-std::cos(a), -std::sin(a), 1},
                Point{0, 0, 1}, Point{0, 0, 0}},
               {});
    hinge.flat({Point{0, 0, 0}, Point{0, 0, 1}, Point{std::cos(a), -std::sin(a), 1},
                Point{std::cos(a), -std::sin(a), 0}},
               {});
    const FaceEdges faces = FaceEdges::of(hinge.mesh, 20);
    EXPECT_EQ(faces.left_out, left_out) << degrees;
    EXPECT_EQ(FaceEdges::of(hinge.mesh).edges.size(), 3U);
  }
}

/// Turns set by hand on the edges of a flat grid: what goes on as a line is an edge, what has loose ends is noise.
TEST(ShadeHigh, HardEdgesAreLines) {
  Mesh mesh = terrain(40, 0);
  for (Vec3& p : mesh.positions) p.y = 0;
  const FaceEdges flat = FaceEdges::of(mesh);
  const auto hard_edges =
      [&](const std::function<bool(const Vec3&, const Vec3&, std::size_t)>& turns) {
        FaceEdges faces = flat;
        std::size_t strong = 0;
        for (std::size_t e = 0; e < faces.edges.size(); ++e) {
          const std::uint32_t side = faces.edges[e].sides[0];
          const Triangle& t = mesh.triangles[side / 3];
          const bool turned =
              turns(mesh.positions[t[side % 3]], mesh.positions[t[(side + 1) % 3]], e);
          faces.edges[e].degrees = turned ? 60 : 5;
          strong += turned ? 1 : 0;
        }
        const Creases creases = find_creases(mesh, faces);
        return std::pair(std::count(creases.hard.begin(), creases.hard.end(), true),
                         static_cast<std::ptrdiff_t>(strong));
      };
  const auto line =
      hard_edges([](const Vec3& a, const Vec3& b, std::size_t) { return a.z == 20 && b.z == 20; });
  EXPECT_EQ(line.first, 40);
  EXPECT_EQ(line.second, 40);
  const auto loose =
      hard_edges([](const Vec3&, const Vec3&, std::size_t e) { return e % 97 == 0; });
  EXPECT_EQ(loose.first, 0);
  EXPECT_GT(loose.second, 40);
}

/// The wings of a spindle from (0, 0, 0) to (0, 2, 0), each at an angle about it; those that run up it, and those that run
/// down.
Mesh spindle(const std::vector<std::pair<double, bool>>& wings) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 2, 0}};
  for (const auto& [degrees, up] : wings) {
    const double angle = degrees * std::numbers::pi / 180;
    const auto at = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(
        {static_cast<float>(std::cos(angle)), 0.5F, static_cast<float>(std::sin(angle))});
    mesh.triangles.push_back(up ? Triangle{0, 1, at} : Triangle{1, 0, at});
  }
  return mesh;
}

/// Where more than two faces meet, those pair that bend least, whatever their order. Faces that run up and down the edge, at
/// angles a and b about it, bend by 180 - |a - b| degrees.
TEST(ShadeHigh, FacesOfACrossingPairByTheLeastBend) {
  const FaceEdges faces =
      FaceEdges::of(spindle({{100, true}, {170, false}, {0, true}, {310, false}, {40, true}}));
  ASSERT_EQ(faces.edges.size(), 2U);
  EXPECT_EQ(faces.edges[0].sides[0] / 3, 2U);
  EXPECT_EQ(faces.edges[0].sides[1] / 3, 1U);
  EXPECT_NEAR(faces.edges[0].degrees, 10, 1e-3);
  EXPECT_TRUE(faces.edges[0].convex);
  EXPECT_EQ(faces.edges[1].sides[0] / 3, 0U);
  EXPECT_EQ(faces.edges[1].sides[1] / 3, 3U);
  EXPECT_NEAR(faces.edges[1].degrees, 30, 1e-3);
  EXPECT_FALSE(faces.edges[1].convex);
  EXPECT_EQ(faces.borders, std::vector<bool>(7, true));
  // 16 faces pair, 17 do not.
  std::vector<std::pair<double, bool>> many;
  for (int i = 0; i < 8; ++i) {
    many.push_back({10.0 * i, true});
    many.push_back({10.0 * i + 180 - 0.5 * i, false});
  }
  const FaceEdges full = FaceEdges::of(spindle(many));
  ASSERT_EQ(full.edges.size(), 8U);
  for (std::uint32_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(full.edges[i].degrees, 0.5 * i, 1e-3);
    EXPECT_EQ(full.edges[i].sides[0] / 3, 2 * i);
    EXPECT_EQ(full.edges[i].sides[1] / 3, 2 * i + 1);
  }
  many.push_back({90, true});
  EXPECT_TRUE(FaceEdges::of(spindle(many)).edges.empty());
}

}  // namespace
}  // namespace kiln

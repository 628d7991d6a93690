#include "bake/golden_scene.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <string>

#include "kiln/volume.h"
#include "support/volumes.h"

namespace kiln::test {
namespace {

struct Point {
  double x = 0, y = 0, z = 0;
};
Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Point operator*(double s, const Point& a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Point unit(const Point& a) {
  const double size = std::sqrt(dot(a, a));
  return size > 0 ? (1 / size) * a : a;
}
Point to_point(const Vec3& v) { return {v.x, v.y, v.z}; }
Vec3 to_float(const Point& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

/// Much like a sine of period 1, from parabolas.
double wave(double t) {
  const double x = 2 * (t - std::floor(t)) - 1;
  return 4 * x * (1 - std::abs(x));
}

double relief(const Point& p) {
  return 0.025 * wave(2.1 * p.x + 0.7 * p.y + 0.3) + 0.02 * wave(1.3 * p.y - 2.7 * p.z) +
         0.012 * wave(5.1 * p.z + 3.3 * p.x + 0.1) +
         0.006 * wave(9.7 * p.y + 4.3 * p.x - 6.1 * p.z);
}

/// From 1 at the centre to 0 at a distance.
double mound(const Point& p, const Point& centre, double radius) {
  const Point way = p - centre;
  return std::max(0.0, 1 - dot(way, way) / (radius * radius));
}

const Point kPit = unit({0.25, 0.1, 1});
const Point kHorn = unit({1, 0.45, 0.2});
const Point kLean{-0.12, 0.32, -0.1};
const Point kHole = unit({-0.2, 0.3, -1});

Point body(const Point& direction) { return {direction.x, 0.85 * direction.y, 0.95 * direction.z}; }
Point dense_body(const Point& direction) {
  const double pit = std::min(1.0, 2 * mound(direction, kPit, 0.4));
  const double horn = mound(direction, kHorn, 0.38);
  const double height = relief(direction) - 0.32 * pit * pit * (3 - 2 * pit) + 0.14 * horn * horn;
  return body((1 + height) * direction) + horn * horn * kLean;
}
bool in_hole(const Point& direction) { return mound(direction, kHole, 0.22) > 0; }

Point floor_at(double u, double v) { return {-1.1 + 2.4 * u, -1.1, 1.0 - 2.2 * v}; }
Point dense_floor_at(double u, double v) {
  Point p = floor_at(u, v);
  p.y += relief(1.3 * p) - (p.x > 0.9 ? 0.4 : 0.0);
  return p;
}

/// Place of a chart in the layout of 4 x 2 cells.
struct Cell {
  int column = 0, row = 0;
  bool mirrored = false, turned = false;
};

/// Patches of n x n quadrilaterals, each a chart; vertices of the body's patches are shared.
class Patches {
 public:
  explicit Patches(std::string name) { mesh_.name = std::move(name); }

  template <typename Position>
  void add(std::uint32_t n, const Cell& cell, const Position& vertex) {
    const auto first_uv = static_cast<std::uint32_t>(mesh_.uvs.size());
    std::vector<std::uint32_t> corners;
    for (std::uint32_t j = 0; j <= n; ++j) {
      for (std::uint32_t i = 0; i <= n; ++i) {
        corners.push_back(vertex(i, j));
        add_uv(cell, double(i) / n, double(j) / n);
      }
    }
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
        // Cut along alternating diagonals.
        const bool even = (i + j) % 2 == 0;
        add_triangle(corners, first_uv, {a, b, even ? c : d});
        add_triangle(corners, first_uv, {even ? a : b, c, d});
      }
    }
  }

  std::uint32_t add_position(const Point& p) {
    mesh_.positions.push_back(to_float(p));
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  Mesh take() { return std::move(mesh_); }

 private:
  void add_uv(const Cell& cell, double u, double v) {
    if (cell.mirrored) u = 1 - u;
    if (cell.turned) {
      const double before = u;
      u = 1 - v;
      v = before;
    }
    constexpr double kBorder = 0.04;
    mesh_.uvs.push_back({static_cast<float>((cell.column + kBorder + (1 - 2 * kBorder) * u) / 4),
                         static_cast<float>((cell.row + kBorder + (1 - 2 * kBorder) * v) / 2)});
  }
  void add_triangle(const std::vector<std::uint32_t>& corners, std::uint32_t first_uv,
                    const Triangle& t) {
    mesh_.triangles.push_back({corners[t[0]], corners[t[1]], corners[t[2]]});
    mesh_.uv_triangles.push_back({first_uv + t[0], first_uv + t[1], first_uv + t[2]});
  }

  Mesh mesh_;
};

/// A cube's surface blown up to the body, and the floor under it.
template <typename Body, typename Floor>
Mesh make_mesh(std::string name, std::uint32_t body_cells, std::uint32_t floor_cells,
               const Body& body_of, const Floor& floor_of) {
  Patches patches(std::move(name));
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> shared;
  for (std::uint32_t face = 0; face < 6; ++face) {
    const std::size_t axis = face / 2;
    const bool positive = face % 2 == 0;
    const Cell cell{static_cast<int>(face % 4), static_cast<int>(face / 4), face == 3, face == 5};
    patches.add(body_cells, cell, [&](std::uint32_t i, std::uint32_t j) {
      std::array<std::uint32_t, 3> place{};
      place[axis] = positive ? body_cells : 0;
      place[(axis + 1) % 3] = positive ? i : j;
      place[(axis + 2) % 3] = positive ? j : i;
      const auto [at, is_new] = shared.try_emplace(place, 0);
      if (is_new) {
        const auto side = [&](std::size_t k) { return 2.0 * place[k] / body_cells - 1; };
        at->second = patches.add_position(body_of(unit({side(0), side(1), side(2)})));
      }
      return at->second;
    });
  }
  patches.add(floor_cells, {2, 1}, [&](std::uint32_t i, std::uint32_t j) {
    return patches.add_position(floor_of(double(i) / floor_cells, double(j) / floor_cells));
  });
  return patches.take();
}

}  // namespace

Mesh golden_low() { return make_mesh("golden_low", 5, 3, body, floor_at); }

Mesh golden_high() {
  constexpr std::uint32_t kCells = 40;
  Mesh mesh = make_mesh("golden_high", kCells, 36, dense_body, dense_floor_at);
  // The hole is where the body without relief would have its place: looked up in a mesh of the same grid.
  const Mesh smooth = make_mesh(
      "", kCells, 36, [](const Point& d) { return d; }, floor_at);
  Mesh open = mesh;
  open.triangles.clear();
  open.uv_triangles.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (in_hole(to_point(smooth.positions[mesh.triangles[t][0]]))) continue;
    open.triangles.push_back(mesh.triangles[t]);
    open.uv_triangles.push_back(mesh.uv_triangles[t]);
  }
  return open;
}

Mesh golden_cage() {
  return make_mesh(
      "golden_cage", 5, 3,
      [](const Point& d) { return body((1.1 + 0.05 * wave(d.x + 2 * d.y)) * d); },
      [](double u, double v) {
        return floor_at(u, v) + Point{0, 0.06 + 0.05 * u * v, 0};
      });
}

Mesh with_bent_normals(Mesh mesh) {
  mesh.normals.clear();
  for (const Vec3& position : mesh.positions) {
    const Point p = to_point(position);
    const Point up = p.y < -0.95 ? Point{0, 1, 0} : unit(p);
    const Point bend{wave(3.1 * p.y + p.z), wave(2.3 * p.z + p.x), wave(1.7 * p.x + p.y)};
    mesh.normals.push_back(to_float(unit(up + 0.2 * bend)));
  }
  mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh with_face_normals(Mesh mesh) {
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (const Triangle& t : mesh.triangles) {
    const Point a = to_point(mesh.positions[t[0]]);
    const Point b = to_point(mesh.positions[t[1]]);
    const Point c = to_point(mesh.positions[t[2]]);
    const auto index = static_cast<std::uint32_t>(mesh.normals.size());
    mesh.normals.push_back(to_float(unit(cross(b - a, c - a))));
    mesh.normal_triangles.push_back({index, index, index});
  }
  return mesh;
}

Mesh with_flaws(Mesh mesh) {
  const std::size_t count = mesh.triangles.size();
  mesh.positions.push_back({0.3F, 0.2F, 0.1F});
  for (std::size_t t = 11; t < count; t += count / 5) {
    mesh.triangles[t][2] = mesh.triangles[t][1];
    mesh.triangles[t + 2] = mesh.triangles[t + 1];
    mesh.uv_triangles[t + 2] = mesh.uv_triangles[t + 1];
  }
  mesh.positions[mesh.triangles[count / 7][0]].y = std::numeric_limits<float>::quiet_NaN();
  mesh.positions[mesh.triangles[count / 3][1]].x = std::numeric_limits<float>::infinity();
  return mesh;
}

Mesh moved_far(Mesh mesh) {
  mesh.origin = {1.0e6 + 0.125, -2.5e5, 3.0e6};
  return mesh;
}

void write_quads(const std::filesystem::path& path) {
  // In thousandths, so that no digit depends on how floats are written.
  constexpr int kColumns = 7, kRows = 5;
  std::ofstream file(path);
  const auto number = [](int thousandths) { return ' ' + std::to_string(thousandths) + "e-3"; };
  const auto height = [](int i, int j) { return 40 * ((i * i + 3 * j) % 5) - 10 * i * j; };
  for (int j = 0; j <= kRows; ++j) {
    for (int i = 0; i <= kColumns; ++i) {
      file << 'v' << number(100 * i) << number(110 * j + 13 * (i % 2)) << number(height(i, j))
           << "\nvt" << number(20 + 130 * i) << number(30 + 180 * j)  //
           << "\nvn" << number(20 * (i - 3)) << number(30 * (j - 2)) << number(1000) << '\n';
    }
  }
  const auto corner = [](int i, int j) {
    const std::string index = std::to_string(1 + j * (kColumns + 1) + i);
    return ' ' + index + '/' + index + '/' + index;
  };
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      if (i == 3 && j == 2) {  // with the next one a polygon of six corners
        file << 'f' << corner(3, 2) << corner(4, 2) << corner(5, 2) << corner(5, 3) << corner(4, 3)
             << corner(3, 3) << '\n';
      } else if (i != 4 || j != 2) {
        file << 'f' << corner(i, j) << corner(i + 1, j) << corner(i + 1, j + 1) << corner(i, j + 1)
             << '\n';
      }
    }
  }
}

Image golden_terrain(std::uint32_t width, std::uint32_t height) {
  Image image{width, height, 1, {}};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const Point p{double(x) / 40, double(y) / 40, 0.4};
      image.pixels.push_back(
          static_cast<float>(0.5 + 4 * relief(0.5 * p) + 1.5 * relief({p.y, 0, p.x})));
    }
  }
  return image;
}

namespace {

double volume_field(double x, double y, double z) {
  const double ring = std::sqrt(x * x + z * z) - 11;
  const double tube = std::sqrt(ring * ring + y * y);
  const double bumps = 0.7 * wave(0.11 * x + 0.07 * y) + 0.5 * wave(0.13 * z - 0.05 * x + 0.2);
  const auto ball = [&](const Point& centre, double radius) {
    const Point way = Point{x, y, z} - centre;
    return radius - std::sqrt(dot(way, way));
  };
  const double cavity = -ball({11, 0.3, 0.2}, 2.4);
  const double solid = std::min(5.3 + bumps - tube, cavity);
  return std::max(solid, ball({1.2, 6.4, -0.7}, 3.6));
}

}  // namespace

Volume golden_volume() {
  Volume volume = make_float_volume({36, 24, 33}, [](double x, double y, double z) {
    return volume_field(x - 15.2, y - 11.3, z - 15.8);
  });
  volume.origin = {3, -20, 7.5};
  volume.axes = {{{0.5, 0.0625, 0}, {0, 0.5, 0}, {0, 0.03125, 0.5}}};
  return volume;
}

Volume golden_volume_of_bytes() {
  Volume volume =
      make_volume<std::uint8_t>({33, 27, 37}, VoxelType::u8, [](double x, double y, double z) {
        const double value = 128 + 24 * volume_field(x - 16.1, y - 13.2, z - 18.4);
        return std::clamp(std::floor(value), 0.0, 255.0);
      });
  volume.axes = {{{1, 0, 0}, {0, 1.25, 0}, {0, 0, 0.75}}};
  return volume;
}

}  // namespace kiln::test

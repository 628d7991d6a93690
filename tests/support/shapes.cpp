#include "support/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>

#include "support/shape_parts.h"

namespace kiln::test {
namespace {

using namespace shape_parts;

/// SplitMix64 (Steele, Lea, Flood 2014). Unlike the standard library's distributions, it gives equal results on all
/// platforms.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// A uniform number in [low, high).
  double between(double low, double high) {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return low + (high - low) * (static_cast<double>(z >> 11) * 0x1p-53);
  }

 private:
  std::uint64_t state_;
};

}  // namespace

Mesh tetrahedron() {
  Mesh mesh;
  mesh.name = "tetrahedron";
  const auto s = static_cast<float>(1 / std::sqrt(3.0));
  mesh.positions = {{s, s, s}, {s, -s, -s}, {-s, s, -s}, {-s, -s, s}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return mesh;
}

Mesh cube(double side, double border) {
  Mesh mesh;
  mesh.name = "cube";
  const double h = side / 2;
  for (std::uint32_t i = 0; i < 8; ++i) {
    mesh.positions.push_back(
        to_float(Vec3d{(i & 1) != 0 ? h : -h, (i & 2) != 0 ? h : -h, (i & 4) != 0 ? h : -h}));
  }
  // Corners of each face in the order lower left, lower right, upper right, upper left, as seen from outside.
  constexpr std::array<std::array<std::uint32_t, 4>, 6> faces = {{{4, 5, 7, 6},    // +Z
                                                                  {5, 1, 3, 7},    // +X
                                                                  {1, 0, 2, 3},    // -Z
                                                                  {0, 4, 6, 2},    // -X
                                                                  {6, 7, 3, 2},    // +Y
                                                                  {0, 1, 5, 4}}};  // -Y
  mesh.normals = {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  for (std::uint32_t f = 0; f < 6; ++f) {
    const double left = (f % 3) / 3.0 + border, right = (f % 3 + 1) / 3.0 - border;
    const double low = (f / 3) / 2.0 + border, high = (f / 3 + 1) / 2.0 - border;
    const std::uint32_t uv = 4 * f;
    mesh.uvs.insert(mesh.uvs.end(), {to_float(left, low), to_float(right, low),
                                     to_float(right, high), to_float(left, high)});
    for (const auto& [i, j, k] : {Triangle{0, 1, 2}, Triangle{0, 2, 3}}) {
      mesh.triangles.push_back({faces[f][i], faces[f][j], faces[f][k]});
      mesh.uv_triangles.push_back({uv + i, uv + j, uv + k});
      mesh.normal_triangles.push_back({f, f, f});
    }
  }
  return mesh;
}

Mesh plane(std::uint32_t nx, std::uint32_t ny, double width, double height) {
  Mesh mesh;
  mesh.name = "plane";
  for (std::uint32_t y = 0; y <= ny; ++y) {
    for (std::uint32_t x = 0; x <= nx; ++x) {
      const double u = static_cast<double>(x) / nx, v = static_cast<double>(y) / ny;
      mesh.positions.push_back(to_float(Vec3d{(u - 0.5) * width, (v - 0.5) * height, 0}));
      mesh.uvs.push_back(to_float(u, v));
    }
  }
  for (std::uint32_t y = 0; y < ny; ++y) {
    for (std::uint32_t x = 0; x < nx; ++x) {
      const std::uint32_t a = cell(x, y, nx + 1), b = a + 1, d = cell(x, y + 1, nx + 1), c = d + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  mesh.uv_triangles = mesh.triangles;
  mesh.normals = {{0, 0, 1}};
  mesh.normal_triangles.assign(mesh.triangles.size(), {0, 0, 0});
  return mesh;
}

Mesh icosphere(std::uint32_t levels, double radius) {
  const double golden = std::numbers::phi;
  std::vector<Vec3d> points = {{-1, golden, 0}, {1, golden, 0}, {-1, -golden, 0}, {1, -golden, 0},
                               {0, -1, golden}, {0, 1, golden}, {0, -1, -golden}, {0, 1, -golden},
                               {golden, 0, -1}, {golden, 0, 1}, {-golden, 0, -1}, {-golden, 0, 1}};
  for (Vec3d& p : points) p = unit(p);
  Mesh mesh;
  mesh.name = "icosphere";
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (std::uint32_t level = 0; level < levels; ++level) {
    std::unordered_map<std::uint64_t, std::uint32_t> middles;
    middles.reserve(mesh.triangles.size() * 3 / 2);
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const std::uint64_t key = (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
      const auto [place, added] =
          middles.try_emplace(key, static_cast<std::uint32_t>(points.size()));
      if (added) points.push_back(unit(points[std::min(a, b)] + points[std::max(a, b)]));
      return place->second;
    };
    std::vector<Triangle> split;
    split.reserve(mesh.triangles.size() * 4);
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      split.insert(split.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(split);
  }
  for (const Vec3d& p : points) mesh.positions.push_back(to_float(radius * p));
  return mesh;
}

Mesh uv_sphere(std::uint32_t slices, std::uint32_t stacks, double radius) {
  Mesh mesh;
  mesh.name = "uv_sphere";
  // Positions: the south pole, stacks - 1 rings of `slices` points, the north pole. UVs: rings of slices + 1 points;
  // then, for each pole, one per slice, at the middle of the base of its triangle.
  mesh.normals.push_back({0, -1, 0});
  for (std::uint32_t j = 1; j < stacks; ++j) {
    const double latitude = pi * (static_cast<double>(j) / stacks - 0.5);
    for (std::uint32_t i = 0; i < slices; ++i) {
      const double longitude = 2 * pi * i / slices;
      mesh.normals.push_back(
          to_float(Vec3d{std::cos(latitude) * std::cos(longitude), std::sin(latitude),
                         -std::cos(latitude) * std::sin(longitude)}));
    }
    for (std::uint32_t i = 0; i <= slices; ++i) {
      mesh.uvs.push_back(
          to_float(static_cast<double>(i) / slices, static_cast<double>(j) / stacks));
    }
  }
  mesh.normals.push_back({0, 1, 0});
  for (const Vec3& n : mesh.normals) {
    mesh.positions.push_back(to_float(radius * Vec3d{n.x, n.y, n.z}));
  }
  const auto south_uv = static_cast<std::uint32_t>(mesh.uvs.size());
  const std::uint32_t north_uv = south_uv + slices;
  for (const double v : {0.0, 1.0}) {
    for (std::uint32_t i = 0; i < slices; ++i) mesh.uvs.push_back(to_float((i + 0.5) / slices, v));
  }
  const auto north = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (std::uint32_t j = 0; j < stacks;
       ++j) {  // triangles between the rings j and j + 1; the rings 0 and `stacks` are the poles
    for (std::uint32_t i = 0; i < slices; ++i) {
      const std::uint32_t next = (i + 1) % slices;
      const std::uint32_t low = 1 + (j - 1) * slices, high = 1 + j * slices;
      const std::uint32_t low_uv = (j - 1) * (slices + 1) + i, high_uv = j * (slices + 1) + i;
      if (j != 0) {
        const bool top = j + 1 == stacks;
        mesh.triangles.push_back({low + i, low + next, top ? north : high + next});
        mesh.uv_triangles.push_back({low_uv, low_uv + 1, top ? north_uv + i : high_uv + 1});
      }
      if (j + 1 != stacks) {
        mesh.triangles.push_back({j == 0 ? 0 : low + i, high + next, high + i});
        mesh.uv_triangles.push_back({j == 0 ? south_uv + i : low_uv, high_uv + 1, high_uv});
      }
    }
  }
  mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh torus(std::uint32_t slices, std::uint32_t rings, double major_radius, double minor_radius) {
  Mesh mesh;
  mesh.name = "torus";
  for (std::uint32_t j = 0; j < rings; ++j) {
    for (std::uint32_t i = 0; i < slices; ++i) {
      const double u = 2 * pi * i / slices, v = 2 * pi * j / rings;
      const Vec3d normal = torus_normal(u, v);
      mesh.positions.push_back(to_float(major_radius * torus_outward(u) + minor_radius * normal));
      mesh.normals.push_back(to_float(normal));
    }
  }
  write_torus_triangles(slices, rings, mesh);
  mesh.normal_triangles = mesh.triangles;
  for (std::uint32_t j = 0; j <= rings; ++j) {
    for (std::uint32_t i = 0; i <= slices; ++i) {
      mesh.uvs.push_back(to_float(static_cast<double>(i) / slices, static_cast<double>(j) / rings));
    }
  }
  for (std::uint32_t j = 0; j < rings; ++j) {
    for (std::uint32_t i = 0; i < slices; ++i) {
      const std::uint32_t a = cell(i, j, slices + 1), b = a + 1;
      const std::uint32_t d = cell(i, j + 1, slices + 1), c = d + 1;
      mesh.uv_triangles.push_back({a, b, c});
      mesh.uv_triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

Mesh random_soup(std::uint32_t count, std::uint64_t seed, double size) {
  Mesh mesh;
  mesh.name = "soup" + std::to_string(seed);
  Random random(seed);
  const double reach = 1 - size / 2;
  for (std::uint32_t i = 0; i < count; ++i) {
    Vec3d middle{}, offset{};
    for (double* c : {&middle.x, &middle.y, &middle.z}) *c = random.between(-reach, reach);
    for (int corner = 0; corner < 3; ++corner) {
      for (double* c : {&offset.x, &offset.y, &offset.z}) *c = random.between(-size / 2, size / 2);
      mesh.positions.push_back(to_float(middle + offset));
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

}  // namespace kiln::test

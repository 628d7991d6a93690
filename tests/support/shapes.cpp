#include "support/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/parallel.h"

namespace kiln::test {
namespace {

constexpr double pi = std::numbers::pi;

Vec3d operator+(const Vec3d& a, const Vec3d& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec3d operator-(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec3d operator*(double s, const Vec3d& a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec3d unit(const Vec3d& a) { return (1 / std::sqrt(dot(a, a))) * a; }
Vec3 to_float(const Vec3d& a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}
Vec2 to_float(double u, double v) { return {static_cast<float>(u), static_cast<float>(v)}; }

/// Row-major index in a grid that is `width` wide.
std::uint32_t cell(std::uint32_t x, std::uint32_t y, std::uint32_t width) { return y * width + x; }

/// SplitMix64 (Steele, Lea, Flood 2014): small, and the same everywhere, unlike the standard
/// library's distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// Uniform in [low, high).
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

/// A closed sphere of directions in 2n + 1 rings, ring i of 4 min(i, 2n - i) points and each pole of
/// one. z = 1 - (i/n)^2 makes all zones of the octant's triangles equal in area (the concentric map of
/// Shirley and Chiu 1997, seen from the pole), so triangles are even in size.
struct OctahedralGrid {
  std::uint32_t n;

  std::uint32_t rings() const { return 2 * n + 1; }
  std::uint32_t points(std::uint32_t ring) const {
    return std::max(1u, 4 * std::min(ring, 2 * n - ring));
  }
  std::uint32_t vertices() const { return 4 * n * n + 2; }
  std::uint32_t triangles() const { return 8 * n * n; }
  std::uint32_t first_vertex(std::uint32_t ring) const {
    if (ring == 0) return 0;
    if (ring <= n) return 1 + 2 * ring * (ring - 1);
    const std::uint32_t left = 2 * n - ring + 1;  // rings from here to the pole
    return vertices() - 1 - 2 * left * (left - 1);
  }
  /// Triangles of the band between `ring` and the next: 4 (2i + 1), i the lesser ring's number.
  std::uint32_t first_triangle(std::uint32_t ring) const {
    if (ring <= n) return 4 * ring * ring;
    return triangles() - 4 * (2 * n - ring) * (2 * n - ring);
  }

  Vec3d direction(std::uint32_t ring, std::uint32_t k) const {
    const std::uint32_t step = std::min(ring, 2 * n - ring);
    const double t = static_cast<double>(step) / n;
    const double height = ring <= n ? 1 - t * t : t * t - 1;
    const double flat = t * std::sqrt(2 - t * t);  // sqrt(1 - height^2) without cancellation
    const double angle = step == 0 ? 0 : 2 * pi * k / (4.0 * step);
    return {flat * std::cos(angle), height, -flat * std::sin(angle)};
  }

  /// Writes the band below `ring` to out[first_triangle(ring)...].
  void write_band(std::uint32_t ring, std::vector<Triangle>& out) const {
    std::uint32_t at = first_triangle(ring);
    const bool upper = ring < n;
    const std::uint32_t small_ring = upper ? ring : ring + 1;
    const std::uint32_t large_ring = upper ? ring + 1 : ring;
    const std::uint32_t small = points(small_ring), large = points(large_ring);
    const std::uint32_t small_base = first_vertex(small_ring);
    const std::uint32_t large_base = first_vertex(large_ring);
    const std::uint32_t step =
        large / 4;  // large ring's steps a quadrant; the small one has one less
    for (std::uint32_t quadrant = 0; quadrant < 4; ++quadrant) {
      for (std::uint32_t j = 0; j < step; ++j) {
        const std::uint32_t inner = small_base + (quadrant * (step - 1) + j) % small;
        const std::uint32_t outer = large_base + quadrant * step + j;
        const std::uint32_t outer_next = large_base + (quadrant * step + j + 1) % large;
        out[at++] = upper ? Triangle{inner, outer, outer_next} : Triangle{inner, outer_next, outer};
        if (j + 1 == step) continue;
        const std::uint32_t inner_next = small_base + (quadrant * (step - 1) + j + 1) % small;
        out[at++] = upper ? Triangle{inner, outer_next, inner_next}
                          : Triangle{inner, inner_next, outer_next};
      }
    }
  }
};

struct Wave {
  double amplitude;
  Vec3d k;
  double phase;
};
constexpr std::array<Wave, 3> sphere_waves = {
    Wave{0.020, {7, 3, -2}, 0.3}, Wave{0.012, {-4, 9, 5}, 1.1}, Wave{0.008, {6, -8, 11}, 2.0}};

/// The torus's frame at angle u around the axis: outward, and the direction of growing u.
Vec3d torus_outward(double u) { return {std::cos(u), 0, -std::sin(u)}; }
Vec3d torus_along(double u) { return {-std::sin(u), 0, -std::cos(u)}; }
Vec3d torus_normal(double u, double v) {
  return std::cos(v) * torus_outward(u) + Vec3d{0, std::sin(v), 0};
}

void write_torus_triangles(std::uint32_t slices, std::uint32_t rings, Mesh& mesh) {
  mesh.triangles.resize(std::size_t{2} * slices * rings);
  parallel_for(rings, 64, [&](std::size_t begin, std::size_t end) {
    for (auto j = static_cast<std::uint32_t>(begin); j < end; ++j) {
      const std::uint32_t next_j = (j + 1) % rings;
      for (std::uint32_t i = 0; i < slices; ++i) {
        const std::uint32_t next_i = (i + 1) % slices;
        const std::uint32_t a = cell(i, j, slices), b = cell(next_i, j, slices);
        const std::uint32_t c = cell(next_i, next_j, slices), d = cell(i, next_j, slices);
        mesh.triangles[std::size_t{2} * a] = {a, b, c};
        mesh.triangles[std::size_t{2} * a + 1] = {a, c, d};
      }
    }
  });
}

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
  // Lower left, lower right, upper right, upper left of each face seen from outside.
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
  // Positions: south pole, stacks - 1 rings of `slices`, north pole. UVs: rings of slices + 1, then
  // one a slice for either pole, in the middle of its triangle's base.
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
       ++j) {  // rings j and j + 1 in stacks; 0 and `stacks`: poles
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
    Vec3d middle, offset;
    for (double* c : {&middle.x, &middle.y, &middle.z}) *c = random.between(-reach, reach);
    for (int corner = 0; corner < 3; ++corner) {
      for (double* c : {&offset.x, &offset.y, &offset.z}) *c = random.between(-size / 2, size / 2);
      mesh.positions.push_back(to_float(middle + offset));
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

double BumpySphere::radius(const Vec3d& direction) {
  double r = 1;
  for (const Wave& w : sphere_waves) r += w.amplitude * std::sin(dot(w.k, direction) + w.phase);
  return r;
}

// The surface is the zero set of f(p) = |p| - r(p / |p|), whose gradient on the surface is
// d - (g - (g . d) d) / r with d the direction and g the gradient of r as a function of space.
Vec3d BumpySphere::exact_normal(const Vec3d& point) {
  const Vec3d d = unit(point);
  Vec3d g;
  for (const Wave& w : sphere_waves) {
    g = g + (w.amplitude * std::cos(dot(w.k, d) + w.phase)) * w.k;
  }
  return unit(d - (1 / radius(d)) * (g - dot(g, d) * d));
}

Mesh BumpySphere::dense(std::uint64_t faces, bool with_normals) {
  const double side = std::round(std::sqrt(static_cast<double>(faces) / 8));
  const OctahedralGrid grid{static_cast<std::uint32_t>(std::max(1.0, side))};
  Mesh mesh;
  mesh.name = "bumpy_sphere";
  mesh.positions.resize(grid.vertices());
  mesh.normals.resize(with_normals ? grid.vertices() : 0);
  mesh.triangles.resize(grid.triangles());
  parallel_for(grid.rings(), 16, [&](std::size_t begin, std::size_t end) {
    for (auto ring = static_cast<std::uint32_t>(begin); ring < end; ++ring) {
      for (std::uint32_t k = 0; k < grid.points(ring); ++k) {
        const Vec3d direction = grid.direction(ring, k);
        const std::uint32_t vertex = grid.first_vertex(ring) + k;
        mesh.positions[vertex] = to_float(radius(direction) * direction);
        if (with_normals) mesh.normals[vertex] = to_float(exact_normal(direction));
      }
      if (ring + 1 < grid.rings()) grid.write_band(ring, mesh.triangles);
    }
  });
  if (with_normals) mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh BumpySphere::light(std::uint32_t slices, std::uint32_t stacks) {
  return uv_sphere(slices, stacks);
}

double BumpyTorus::height(double u, double v) {
  return 0.015 * std::sin(9 * u) * std::cos(3 * v) + 0.010 * std::sin(14 * u + 4 * v);
}

// S(u, v) = R e(u) + (r + h) n(u, v); the normal is the cross product of the two partial derivatives.
Vec3d BumpyTorus::exact_normal(const Vec3d& point) {
  const double u = std::atan2(-point.z, point.x);
  const double v = std::atan2(point.y, std::hypot(point.x, point.z) - major_radius);
  const double h_u = 0.135 * std::cos(9 * u) * std::cos(3 * v) + 0.140 * std::cos(14 * u + 4 * v);
  const double h_v = -0.045 * std::sin(9 * u) * std::sin(3 * v) + 0.040 * std::cos(14 * u + 4 * v);
  const double tube = minor_radius + height(u, v);
  const Vec3d n = torus_normal(u, v);
  const Vec3d n_v = -std::sin(v) * torus_outward(u) + Vec3d{0, std::cos(v), 0};
  const Vec3d s_u = (major_radius + tube * std::cos(v)) * torus_along(u) + h_u * n;
  const Vec3d s_v = tube * n_v + h_v * n;
  return unit(cross(s_u, s_v));
}

Mesh BumpyTorus::dense(std::uint64_t faces, bool with_normals) {
  const double side = std::round(std::sqrt(static_cast<double>(faces) / 6));
  const auto rings = static_cast<std::uint32_t>(std::max(3.0, side));
  const std::uint32_t slices = 3 * rings;
  Mesh mesh;
  mesh.name = "bumpy_torus";
  mesh.positions.resize(std::size_t{slices} * rings);
  mesh.normals.resize(with_normals ? mesh.positions.size() : 0);
  parallel_for(rings, 16, [&](std::size_t begin, std::size_t end) {
    for (auto j = static_cast<std::uint32_t>(begin); j < end; ++j) {
      for (std::uint32_t i = 0; i < slices; ++i) {
        const double u = 2 * pi * i / slices, v = 2 * pi * j / rings;
        const Vec3d point =
            major_radius * torus_outward(u) + (minor_radius + height(u, v)) * torus_normal(u, v);
        mesh.positions[cell(i, j, slices)] = to_float(point);
        if (with_normals) mesh.normals[cell(i, j, slices)] = to_float(exact_normal(point));
      }
    }
  });
  write_torus_triangles(slices, rings, mesh);
  if (with_normals) mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh BumpyTorus::light(std::uint32_t slices, std::uint32_t rings) {
  return torus(slices, rings, major_radius, minor_radius);
}

}  // namespace kiln::test

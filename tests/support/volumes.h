// Generates volumes by formula, and checks surfaces that were contoured in them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "kiln/mesh.h"
#include "kiln/volume.h"

namespace kiln::test {

/// Converts a number to a voxel; integer types are rounded to the nearest value.
template <typename T>
T as_voxel(double value) {
  if constexpr (std::is_integral_v<T>) {
    value = std::clamp(value, double(std::numeric_limits<T>::lowest()),
                       double(std::numeric_limits<T>::max()));
  }
  return static_cast<T>(value);
}

/// Returns a volume with every second voxel along each axis.
inline Volume halved(const Volume& volume) {
  Volume half = volume;
  half.voxels.clear();
  for (std::uint32_t& side : half.size) side = (side + 1) / 2;
  for (auto& axis : half.axes) axis = {2 * axis[0], 2 * axis[1], 2 * axis[2]};
  const std::size_t row = volume.size[0], slice = row * volume.size[1],
                    bytes = volume.voxels.size() / (slice * volume.size[2]);
  for (std::size_t z = 0; z < volume.size[2]; z += 2) {
    for (std::size_t y = 0; y < volume.size[1]; y += 2) {
      for (std::size_t x = 0; x < volume.size[0]; x += 2) {
        const std::byte* const voxel = &volume.voxels[bytes * (z * slice + y * row + x)];
        half.voxels.insert(half.voxels.end(), voxel, voxel + bytes);
      }
    }
  }
  return half;
}

/// Samples f(x, y, z) at the indices of the voxels, which have the type T.
template <typename T, typename Function>
Volume make_volume(std::array<std::uint32_t, 3> size, VoxelType type, const Function& f) {
  Volume volume;
  volume.name = "test";
  volume.size = size;
  volume.type = type;
  std::vector<T> values;
  values.reserve(std::size_t{size[0]} * size[1] * size[2]);
  for (std::uint32_t z = 0; z < size[2]; ++z) {
    for (std::uint32_t y = 0; y < size[1]; ++y) {
      for (std::uint32_t x = 0; x < size[0]; ++x) {
        values.push_back(as_voxel<T>(f(double(x), double(y), double(z))));
      }
    }
  }
  volume.voxels.resize(values.size() * sizeof(T));
  std::memcpy(volume.voxels.data(), values.data(), volume.voxels.size());
  return volume;
}
template <typename Function>
Volume make_float_volume(std::array<std::uint32_t, 3> size, const Function& f) {
  return make_volume<float>(size, VoxelType::f32, f);
}

/// Signed distance to a sphere, positive inside: level 0 is the surface.
inline double sphere_field(double x, double y, double z, double radius) {
  return radius - std::sqrt(x * x + y * y + z * z);
}
inline double torus_field(double x, double y, double z, double major, double minor) {
  return minor - std::hypot(std::hypot(x, z) - major, y);
}
/// A gyroid, whose values are not distances; the period is in voxels.
inline double gyroid_field(double x, double y, double z, double period) {
  const double k = 2 * std::numbers::pi / period;
  return std::sin(k * x) * std::cos(k * y) + std::sin(k * y) * std::cos(k * z) +
         std::sin(k * z) * std::cos(k * x);
}
inline double box_field(double x, double y, double z, double hx, double hy, double hz) {
  return std::min({hx - std::abs(x), hy - std::abs(y), hz - std::abs(z)});
}

struct Topology {
  std::uint64_t border_edges = 0;  ///< Edges with a triangle on only one side
  /// Edges that unequal numbers of triangles use in the two directions
  std::uint64_t inconsistent_edges = 0;
  std::uint64_t crowded_edges = 0;     ///< Edges with more than two triangles
  std::uint64_t pinched_vertices = 0;  ///< Vertices whose triangles form more than one fan
  std::uint64_t degenerate = 0;        ///< Triangles with a repeated vertex
  std::int64_t euler = 0;              ///< Euler characteristic V - E + F of the used vertices
  std::uint64_t parts = 0;             ///< Number of parts that edges connect
  std::uint64_t border_loops = 0;      ///< Loops of border edges

  bool is_closed_manifold() const {
    return border_edges == 0 && inconsistent_edges == 0 && crowded_edges == 0 &&
           pinched_vertices == 0 && degenerate == 0;
  }
};

inline Topology topology(const Mesh& mesh) {
  Topology result;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::array<std::int32_t, 2>> edges;
  std::vector<std::uint32_t> part(mesh.positions.size());
  for (std::uint32_t i = 0; i < part.size(); ++i) part[i] = i;
  const auto find = [&](std::uint32_t v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  std::vector<std::vector<std::array<std::uint32_t, 2>>> links(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) ++result.degenerate;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      ++edges[{std::min(a, b), std::max(a, b)}][a < b ? 0 : 1];
      part[find(a)] = find(b);
      links[t[k]].push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
    }
  }
  std::int64_t vertices = 0;
  for (std::uint32_t v = 0; v < links.size(); ++v) {
    if (links[v].empty()) continue;
    ++vertices;
    if (find(v) == v) ++result.parts;
    // Walks the fan of triangles from one of them; it must reach all.
    std::map<std::uint32_t, std::uint32_t> next;
    for (const auto& link : links[v]) next[link[0]] = link[1];
    std::uint32_t start = links[v][0][0];
    // starts at the first triangle of an open fan
    for (std::size_t back = 0; back < links[v].size(); ++back) {
      const auto before = std::find_if(links[v].begin(), links[v].end(),
                                       [&](const auto& link) { return link[1] == start; });
      if (before == links[v].end()) break;
      start = (*before)[0];
    }
    std::size_t met = 0;
    for (std::uint32_t at = start; met < links[v].size() && next.count(at) != 0;) {
      at = next[at];
      ++met;
      if (at == start) break;
    }
    if (met != links[v].size()) ++result.pinched_vertices;
  }
  for (std::uint32_t i = 0; i < part.size(); ++i) part[i] = i;
  for (const auto& [ends, count] : edges) {
    if (count[0] + count[1] == 1) {
      ++result.border_edges;
      part[find(ends.first)] = find(ends.second);
    } else if (count[0] != count[1]) {
      ++result.inconsistent_edges;
    }
    if (count[0] + count[1] > 2) ++result.crowded_edges;
  }
  std::set<std::uint32_t> loops;
  for (const auto& [ends, count] : edges) {
    if (count[0] + count[1] == 1) loops.insert(find(ends.first));
  }
  result.border_loops = loops.size();
  result.euler = vertices - static_cast<std::int64_t>(edges.size()) +
                 static_cast<std::int64_t>(mesh.triangles.size());
  return result;
}

/// The enclosed volume by the divergence theorem: positive if triangles wind counter-clockwise seen from outside.
inline double enclosed_volume(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    sum += double{a.x} * (double{b.y} * c.z - double{b.z} * c.y) +
           double{a.y} * (double{b.z} * c.x - double{b.x} * c.z) +
           double{a.z} * (double{b.x} * c.y - double{b.y} * c.x);
  }
  return sum / 6;
}

}  // namespace kiln::test

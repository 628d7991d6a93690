// Two-sided sheets, and what their triangles are.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/vector.h"
#include "support/shapes.h"

namespace kiln::test {

using Corners = std::array<std::array<float, 3>, 3>;

/// A triangle's positions, the least first, in its sense.
inline Corners corners_of(const Mesh& mesh, std::size_t t, bool turned = false) {
  Corners p;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& at = mesh.positions[mesh.triangles[t][turned ? 2 - k : k]];
    p[k] = {at.x, at.y, at.z};
  }
  std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());
  return p;
}

/// For each triangle, the one that is the same the other way round, or -1.
inline std::vector<std::ptrdiff_t> twins_of(const Mesh& mesh) {
  std::map<Corners, std::size_t> known;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    EXPECT_TRUE(known.emplace(corners_of(mesh, t), t).second) << "twice";
  }
  std::vector<std::ptrdiff_t> twins;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto found = known.find(corners_of(mesh, t, true));
    twins.push_back(found == known.end() ? -1 : static_cast<std::ptrdiff_t>(found->second));
  }
  return twins;
}

inline kiln::Vec3d face(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  const kiln::Vec3d p = to_double(mesh.positions[a]);
  return cross(kiln::to_double(mesh.positions[b]) - p, kiln::to_double(mesh.positions[c]) - p);
}

/// A flat sheet of n by n cells. Looks up.
inline Mesh flat(std::uint32_t n) {
  Mesh mesh = plane(n, n);
  mesh.uvs = {};
  mesh.uv_triangles = {};
  mesh.normals = {};
  mesh.normal_triangles = {};
  return mesh;
}

/// One that waves.
inline Mesh wave(std::uint32_t n, double phase = 0) {
  Mesh mesh = flat(n);
  for (Vec3& p : mesh.positions) {
    p.z = static_cast<float>(0.06 * std::sin(9 * p.x + 2 * p.y + phase) +
                             0.04 * std::cos(11 * p.y - 3 * p.x));
  }
  return mesh;
}

/// Adds the other side, with vertices of its own or those of the front. Its material is another.
inline Mesh doubled(Mesh mesh, bool own_vertices = true) {
  const std::size_t front = mesh.triangles.size(), vertices = mesh.positions.size();
  mesh.material_names = {"front", "back"};
  mesh.materials.assign(front, 0);
  mesh.materials.resize(2 * front, 1);
  if (own_vertices) mesh.positions.resize(2 * vertices);
  for (std::size_t t = 0; t < front; ++t) {
    Triangle back{mesh.triangles[t][0], mesh.triangles[t][2], mesh.triangles[t][1]};
    for (std::uint32_t& v : back) {
      if (!own_vertices) break;
      mesh.positions[v + vertices] = Vec3(mesh.positions[v]);
      v += static_cast<std::uint32_t>(vertices);
    }
    mesh.triangles.push_back(back);
  }
  return mesh;
}

/// Both in one mesh. The other's material is "body".
inline Mesh beside(Mesh mesh, const Mesh& body, const Vec3& place) {
  const auto shift = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : body.positions) {
    mesh.positions.push_back({p.x + place.x, p.y + place.y, p.z + place.z});
  }
  for (const Triangle& t : body.triangles) {
    mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    mesh.materials.push_back(2);
  }
  mesh.material_names.emplace_back("body");
  return mesh;
}

}  // namespace kiln::test

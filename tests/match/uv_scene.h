// Meshes and options for tests of matching by UVs.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "kiln/bake.h"
#include "support/shapes.h"

namespace kiln::test {

/// A plane of n x n cells, bent out of z = 0, its layout left as it was.
inline Mesh bent_plane(std::uint32_t n, double amplitude) {
  Mesh mesh = plane(n, n);
  for (Vec3& p : mesh.positions) {
    p.z = static_cast<float>(amplitude * std::sin(9.0 * p.x) * std::cos(7.0 * p.y));
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

/// Triangles anywhere around the unit square, each with its own corners and normals.
inline Mesh random_layout(std::uint32_t count, std::uint32_t seed, double size, bool far) {
  Mesh mesh;
  mesh.name = "layout";
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  for (std::uint32_t t = 0; t < count; ++t) {
    const double reach = far ? 4 : 1.2;
    const double u = uniform(far ? -3 : -0.2, reach);
    const double v = uniform(far ? -3 : -0.2, reach);
    for (std::uint32_t k = 0; k < 3; ++k) {
      mesh.positions.push_back({static_cast<float>(uniform(-1, 1)),
                                static_cast<float>(uniform(-1, 1)),
                                static_cast<float>(uniform(-1, 1))});
      mesh.uvs.push_back({static_cast<float>(u + uniform(-size, size)),
                          static_cast<float>(v + uniform(-size, size))});
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

inline BakeOptions by_uv(std::uint32_t size) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.method = MatchMethod::uv;
  options.report.keep_match = true;
  options.encoding.gutter = 0;
  options.encoding.space = NormalMapSpace::object;
  options.encoding.raw = true;
  return options;
}

inline BakeOptions trusting(BakeOptions options) {
  options.match.uv.max_overlap = options.match.uv.max_distance =
      std::numeric_limits<double>::infinity();
  return options;
}

}  // namespace kiln::test

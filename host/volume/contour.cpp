// The full-resolution contour as a mesh.
#include "kiln/contour.h"

#include <utility>

#include "parallel.h"
#include "volume/fine_surface.h"

namespace kiln {
namespace {

double squared_distance(const kiln_volume_vertex& a, const kiln_volume_vertex& b) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    const double d = double{a.position[c]} - double{b.position[c]};
    sum += d * d;
  }
  return sum;
}

}  // namespace

Mesh contour(const Device& device, const Volume& volume, const ContourOptions& options,
             ContourReport* report) {
  ContourReport local;
  ContourReport& out = report != nullptr ? *report : local;
  out = {};
  const FineSurface surface = fine_surface(device.context(), volume, options, false, out);
  Mesh mesh;
  mesh.name = volume.name;
  mesh.origin = volume.origin;
  const std::size_t count = surface.vertices.size();
  mesh.positions.resize(count);
  mesh.normals.resize(count);
  parallel_for(count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const kiln_volume_vertex& v = surface.vertices[i];
      mesh.positions[i] = {v.position[0], v.position[1], v.position[2]};
      mesh.normals[i] = {v.normal[0], v.normal[1], v.normal[2]};
    }
  });
  mesh.triangles.reserve(2 * surface.quads);
  for (const FineEdge& edge : surface.edges) {
    if (!edge.is_quad()) continue;
    auto [a, b, c, d] = edge.vertices;
    if ((edge.rises != 0) == surface.mirrored) std::swap(b, d);
    // Along the shorter diagonal.
    const auto at = [&](std::uint32_t v) -> const kiln_volume_vertex& {
      return surface.vertices[v];
    };
    if (squared_distance(at(a), at(c)) <= squared_distance(at(b), at(d))) {
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    } else {
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({b, c, d});
    }
  }
  mesh.normal_triangles = mesh.triangles;
  if (mesh.triangles.empty()) {
    throw Error(ErrorCode::input, "The surface of volume '" + volume.name +
                                      "' lies at its border alone: use a closed border, or another "
                                      "iso value.");
  }
  return mesh;
}

}  // namespace kiln

#include "volume/fine_mesh.h"

#include <utility>
#include <vector>

#include "base/parallel.h"
#include "volume/short_edges.h"
#include "volume/vertex_tree.h"

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

/// Removes vertices without triangles.
void drop_vertices(Mesh& mesh,
                   const std::vector<std::pair<std::uint32_t, std::uint32_t>>& removed_vertices) {
  std::vector<std::uint32_t> number(mesh.positions.size());
  std::uint32_t count = 0;
  auto next = removed_vertices.begin();  // The list is sorted by the removed vertex
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (next != removed_vertices.end() && next->first == v) {
      ++next;
      continue;
    }
    mesh.positions[count] = mesh.positions[v];
    mesh.normals[count] = mesh.normals[v];
    number[v] = count++;
  }
  mesh.positions.resize(count);
  mesh.normals.resize(count);
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) corner = number[corner];
  }
}

}  // namespace

Mesh make_fine_mesh(const FineSurface& surface, const Volume& volume) {
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
  const auto vertex = [&](std::uint32_t v) -> const kiln_volume_vertex& {
    return surface.vertices[v];
  };
  const auto place = [&](std::uint32_t v) { return mesh.positions[v]; };
  std::vector<PolygonCorners> polygons;
  polygons.reserve(surface.quads);
  bool short_edges = false;
  for (const FineEdge& edge : surface.edges) {
    if (!edge.is_quad()) continue;
    auto [a, b, c, d] = edge.vertices;
    if ((edge.solid_at_lower_end != 0) == surface.is_left_handed) std::swap(b, d);
    polygons.push_back({a, b, c, d});
    short_edges = short_edges || same_place(place(a), place(b)) || same_place(place(b), place(c)) ||
                  same_place(place(c), place(d)) || same_place(place(d), place(a));
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> removed_vertices;
  if (short_edges) removed_vertices = collapse_short_edges(polygons, place);
  mesh.triangles.reserve(2 * surface.quads);
  for (const auto& [a, b, c, d] : polygons) {
    if (d == VertexTree::kNone) {
      mesh.triangles.push_back({a, b, c});
      continue;
    }
    // Splits a quad along its shorter diagonal, or along the longer one if the shorter one has zero
    // length.
    const double ac = squared_distance(vertex(a), vertex(c));
    const double bd = squared_distance(vertex(b), vertex(d));
    const bool second =
        same_place(place(a), place(c)) || (bd < ac && !same_place(place(b), place(d)));
    if (!second) {
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    } else {
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({b, c, d});
    }
  }
  if (!removed_vertices.empty()) drop_vertices(mesh, removed_vertices);
  mesh.normal_triangles = mesh.triangles;
  if (mesh.triangles.empty()) {
    throw Error(ErrorCode::input, "The surface of volume '" + volume.name +
                                      "' lies only on its border: use a closed border, or another "
                                      "iso value.");
  }
  return mesh;
}

}  // namespace kiln

#include "clean/triangle_list.h"

#include <limits>

#include "mesh/vertex_lists.h"

namespace kiln {
namespace {

/// Removes items from a list that has `size` items per triangle.
template <typename T>
void keep_items(std::vector<T>& list, std::size_t size, std::span<const std::uint8_t> dropped) {
  if (list.empty()) return;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < dropped.size(); ++t) {
    if (dropped[t] != 0) continue;
    for (std::size_t k = 0; k < size; ++k) list[kept++] = list[size * t + k];
  }
  list.resize(kept);
}

/// Renumbers polygons in order, from 0 on.
void renumber_polygons(std::vector<std::uint32_t>& polygons) {
  std::uint32_t next = 0, last = polygons.empty() ? 0 : polygons[0];
  for (std::uint32_t& polygon : polygons) {
    if (polygon != last) ++next;
    last = polygon;
    polygon = next;
  }
}

void add_copy(std::vector<std::uint32_t>& list, std::uint32_t of) {
  if (!list.empty()) list.push_back(list[of]);
}

}  // namespace

void drop_triangles(Mesh& mesh, std::span<const std::uint8_t> dropped) {
  keep_items(mesh.triangles, 1, dropped);
  keep_items(mesh.uv_triangles, 1, dropped);
  keep_items(mesh.normal_triangles, 1, dropped);
  keep_items(mesh.tangents, 3, dropped);
  for (std::vector<std::uint32_t>* list :
       {&mesh.groups, &mesh.objects, &mesh.materials, &mesh.polygons}) {
    keep_items(*list, 1, dropped);
  }
  renumber_polygons(mesh.polygons);
  constexpr std::uint32_t kUnusedVertex = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.positions.size(), kUnusedVertex);
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) number[v] = 0;
  }
  std::uint32_t next = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnusedVertex) continue;
    mesh.positions[next] = mesh.positions[v];
    if (!mesh.colors.empty()) mesh.colors[next] = mesh.colors[v];
    number[v] = next++;
  }
  mesh.positions.resize(next);
  if (!mesh.colors.empty()) mesh.colors.resize(next);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = number[v];
  }
}

void add_triangle(Mesh& mesh, const std::array<CornerOf, 3>& corners) {
  for (std::vector<Triangle>* list :
       {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
    if (list->empty()) continue;
    Triangle t;
    for (std::size_t k = 0; k < 3; ++k) t[k] = (*list)[corners[k].triangle][corners[k].k];
    list->push_back(t);
  }
  if (!mesh.tangents.empty()) {
    for (const CornerOf& corner : corners) {
      mesh.tangents.push_back(Tangent(mesh.tangents[3 * corner.triangle + corner.k]));
    }
  }
  const std::uint32_t first = corners[0].triangle;
  for (std::vector<std::uint32_t>* list : {&mesh.groups, &mesh.objects, &mesh.materials}) {
    add_copy(*list, first);
  }
  if (!mesh.polygons.empty()) mesh.polygons.push_back(mesh.polygons.back() + 1);
}

void cut_triangle(Mesh& mesh, std::uint32_t t, std::uint32_t k,
                  std::span<const VertexOnEdge> points) {
  double previous_share = 0;
  for (const VertexOnEdge& point : points) {
    const std::uint32_t b = (k + 1) % 3, c = (k + 2) % 3;
    const auto rest_triangle = static_cast<std::uint32_t>(mesh.triangles.size());
    add_triangle(mesh, {CornerOf{t, k}, CornerOf{t, b}, CornerOf{t, c}});
    // The new point replaces corner b in the first piece, and corner k in the second piece.
    mesh.triangles[t][b] = mesh.triangles[rest_triangle][0] = point.vertex;
    const double share = (point.share - previous_share) / (1 - previous_share);
    if (!mesh.uv_triangles.empty()) {
      const auto w = static_cast<float>(share);
      const Triangle& uvs = mesh.uv_triangles[rest_triangle];
      const auto add_between = [w, from = uvs[0], to = uvs[1]](std::vector<Vec2>& pool) {
        const Vec2 p = pool[from], q = pool[to];
        pool.push_back({p.x + w * (q.x - p.x), p.y + w * (q.y - p.y)});
      };
      for (UvSet& set : mesh.other_uvs) {
        if (set.uvs.size() == mesh.uvs.size()) add_between(set.uvs);
      }
      mesh.uv_triangles[t][b] = mesh.uv_triangles[rest_triangle][0] =
          static_cast<std::uint32_t>(mesh.uvs.size());
      add_between(mesh.uvs);
    }
    if (!mesh.normal_triangles.empty()) {
      const Triangle& normals = mesh.normal_triangles[rest_triangle];
      const Vec3d p = to_double(mesh.normals[normals[0]]), q = to_double(mesh.normals[normals[1]]);
      const Vec3d n = p + (q - p) * share;
      const double size = length(n);
      mesh.normal_triangles[t][b] = mesh.normal_triangles[rest_triangle][0] =
          static_cast<std::uint32_t>(mesh.normals.size());
      mesh.normals.push_back(to_float(size > 0 ? n * (1 / size) : Vec3d{}));
    }
    t = rest_triangle;
    k = 0;
    previous_share = point.share;
  }
}

std::vector<std::uint32_t> open_sides(std::span<const Triangle> corners, std::size_t vertices) {
  std::vector<std::uint32_t> open;
  SideLists(corners, vertices)
      .each_edge([&](std::uint32_t v, std::span<const SideLists::Item> sides) {
        if (sides.size() == 1 && SideLists::higher(sides[0]) != v) open.push_back(sides[0].index);
      });
  return open;
}

}  // namespace kiln

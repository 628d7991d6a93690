#include "volume/isosurface_patch.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "mesh/box.h"
#include "mesh/vertex_lists.h"

namespace kiln {
namespace {

/// Root-mean-square distance of a vertex to the tangent planes at the crossings of the fine
/// vertices that it represents, in cells.
double vertex_error(const FineSurface& surface, const Volume& volume,
                    const SimplifiedIsosurface& low_poly, std::uint32_t vertex) {
  const auto axis = [&](std::size_t k) {
    return Vec3d(volume.axes[k][0], volume.axes[k][1], volume.axes[k][2]);
  };
  const Vec3d x = axis(0), y = axis(1), z = axis(2), p = to_double(low_poly.positions[vertex]);
  const double volume_of_cell = dot(x, cross(y, z));
  const Vec3d padded =
      Vec3d(dot(p, cross(y, z)), dot(p, cross(z, x)), dot(p, cross(x, y))) * (1 / volume_of_cell) +
      Vec3d(1, 1, 1);
  Qef qef;
  for (std::uint32_t i = low_poly.leaf_begins[vertex]; i < low_poly.leaf_begins[vertex + 1]; ++i) {
    const std::uint32_t leaf = low_poly.leaves[i];
    qef.add(surface.qefs[leaf], unpack_cell_place(surface.keys[leaf]));
  }
  return qef.error_at(padded);
}

}  // namespace

IsosurfaceFaces::IsosurfaceFaces(const SimplifiedIsosurface& low_poly) {
  triangles.reserve(low_poly.faces);
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    const auto& c = polygon.corners;
    triangles.push_back({c[0], c[1], c[2]});
    if (polygon.is_quad()) triangles.push_back({c[0], c[2], c[3]});
  }
}

IsosurfaceChange::IsosurfaceChange(const SimplifiedIsosurface& low_poly,
                                   const IsosurfaceFaces& faces)
    : triangles(faces.triangles),
      is_remaining(faces.triangles.size(), 1),
      merged_into(low_poly.positions.size()) {
  std::iota(merged_into.begin(), merged_into.end(), 0U);
}

void IsosurfaceChange::make_polygons(SimplifiedIsosurface& low_poly) const {
  std::vector<SimplifiedIsosurface::Polygon> polygons;
  polygons.reserve(low_poly.polygons.size());
  const auto add = [&](const Triangle& t) { polygons.push_back({{t[0], t[1], t[2], kNoVertex}}); };
  std::size_t next = 0;
  low_poly.faces = 0;
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    const std::size_t first = next, count = polygon.is_quad() ? 2 : 1;
    next += count;
    for (std::size_t t = first; t < next; ++t) low_poly.faces += is_remaining[t];
    if (count == 2 && is_remaining[first] != 0 && is_remaining[first + 1] != 0) {
      const Triangle &a = triangles[first], &b = triangles[first + 1];
      if (a[1] != b[2]) {
        polygons.push_back({{a[0], a[1], a[2], b[2]}});
      } else {
        add(a);
        add(b);
      }
      continue;
    }
    for (std::size_t t = first; t < next; ++t) {
      if (is_remaining[t] != 0) add(triangles[t]);
    }
  }
  low_poly.polygons = std::move(polygons);
}

/// Renumbers the used vertices and removes unused ones.
/// \returns new numbers by old vertex
std::vector<std::uint32_t> IsosurfaceChange::renumber_vertices(
    SimplifiedIsosurface& low_poly) const {
  std::vector<std::uint32_t> number(low_poly.positions.size(), kNoVertex);
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    for (const std::uint32_t corner : polygon.corners) {
      if (corner != kNoVertex) number[corner] = 0;
    }
  }
  std::uint32_t used_count = 0;
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] == kNoVertex) continue;
    low_poly.positions[used_count] = low_poly.positions[v];
    low_poly.normals[used_count] = low_poly.normals[v];
    number[v] = used_count++;
  }
  low_poly.positions.resize(used_count);
  low_poly.normals.resize(used_count);
  for (SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    for (std::uint32_t& corner : polygon.corners) {
      if (corner != kNoVertex) corner = number[corner];
    }
  }
  for (std::uint32_t v = 0; v < number.size(); ++v) number[v] = number[merged_into[v]];
  return number;
}

/// Lists for each vertex the fine vertices that were represented by it or by a vertex merged into
/// it.
void IsosurfaceChange::assign_leaves(const std::vector<std::uint32_t>& number,
                                     SimplifiedIsosurface& low_poly) const {
  std::vector<std::uint32_t> leaf_begins(low_poly.positions.size() + 1, 0);
  const std::vector<std::uint32_t>& old = low_poly.leaf_begins;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] != kNoVertex) leaf_begins[number[v] + 1] += old[v + 1] - old[v];
  }
  std::partial_sum(leaf_begins.begin(), leaf_begins.end(), leaf_begins.begin());
  RawVector<std::uint32_t> leaves(leaf_begins.back());
  std::vector<std::uint32_t> at(leaf_begins.begin(), leaf_begins.end() - 1);
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kNoVertex) continue;
    std::copy(low_poly.leaves.begin() + old[v], low_poly.leaves.begin() + old[v + 1],
              leaves.begin() + at[number[v]]);
    at[number[v]] += old[v + 1] - old[v];
  }
  low_poly.leaf_begins = std::move(leaf_begins);
  low_poly.leaves = std::move(leaves);
}

std::vector<std::uint32_t> IsosurfaceChange::apply_to_low_poly(const FineSurface& surface,
                                                               SimplifiedIsosurface& low_poly) {
  for (std::uint32_t& to : merged_into) {
    while (merged_into[to] != to) to = merged_into[to];
  }
  for (Triangle& t : triangles) {
    for (std::uint32_t& v : t) v = merged_into[v];
  }
  make_polygons(low_poly);
  std::vector<std::uint32_t> number = renumber_vertices(low_poly);
  assign_leaves(number, low_poly);
  std::vector<std::uint8_t> has_new_leaves(low_poly.positions.size(), 0);
  for (std::uint32_t v = 0; v < merged_into.size(); ++v) {
    if (merged_into[v] == v || number[v] == kNoVertex) continue;
    has_new_leaves[number[v]] = 1;
  }
  for (std::uint32_t v = 0; v < has_new_leaves.size(); ++v) {
    if (has_new_leaves[v] == 0) continue;
    std::sort(low_poly.leaves.begin() + low_poly.leaf_begins[v],
              low_poly.leaves.begin() + low_poly.leaf_begins[v + 1]);
    low_poly.normals[v] = low_poly.mean_normal(surface, v);
  }
  return number;
}

IsosurfacePatch::IsosurfacePatch(const FineSurface& surface, const SimplifiedIsosurface& low_poly,
                                 const IsosurfaceFaces& faces,
                                 std::span<const std::uint32_t> seeds_in)
    : faces_(faces) {
  Box<Vec3> box;
  for (const Vec3& p : low_poly.positions) box.add(p);
  box_center_ = box.center();
  size_ = std::max(box.diagonal(), std::numeric_limits<double>::min());

  std::vector<std::uint8_t> is_free(low_poly.positions.size(), 0);
  for (const std::uint32_t t : seeds_in) {
    for (const std::uint32_t v : faces.triangles[t]) is_free[v] = 1;
  }
  const std::vector<std::uint8_t> is_inner = is_free;
  const auto has_marked_corner = [](const std::vector<std::uint8_t>& marks, const Triangle& t) {
    return (marks[t[0]] | marks[t[1]] | marks[t[2]]) != 0;
  };
  for (const Triangle& t : faces.triangles) {
    if (!has_marked_corner(is_inner, t)) continue;
    for (const std::uint32_t v : t) is_free[v] = 1;
  }
  std::vector<std::uint32_t> number(low_poly.positions.size(), kNoVertex);
  std::vector<std::uint8_t> is_free_in_patch;
  for (std::uint32_t i = 0; i < faces.triangles.size(); ++i) {
    if (!has_marked_corner(is_free, faces.triangles[i])) continue;
    replaced_triangles_.push_back(i);
    Triangle t = faces.triangles[i];
    for (std::uint32_t& v : t) {
      if (number[v] == kNoVertex) {
        number[v] = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back(v);
        points.push_back(to_unit(low_poly.positions[v]));
        is_free_in_patch.push_back(is_free[v]);
      }
      v = number[v];
    }
    triangles.push_back(t);
  }
  find_fixed_vertices(is_free_in_patch);
  remove_duplicates();
  for (std::uint32_t t = 0; t < low_poly_triangles_.size(); ++t) {
    if (std::binary_search(seeds_in.begin(), seeds_in.end(), low_poly_triangles_[t]))
      seeds.push_back(t);
  }
  collect_fine_quads(surface, low_poly, is_free_in_patch);
}

void IsosurfacePatch::find_fixed_vertices(std::span<const std::uint8_t> free) {
  is_fixed.resize(points.size());
  for (std::size_t v = 0; v < is_fixed.size(); ++v) is_fixed[v] = free[v] == 0;
  SideLists(triangles, points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        if (sides.size() != 1) return;
        is_fixed[a] = is_fixed[SideLists::higher(sides[0])] = 1;
      });
}

/// Removes all but one of several triangles with the same corners and the same orientation, since
/// EdgeCollapser does not accept them.
void IsosurfacePatch::remove_duplicates() {
  std::vector<std::pair<Triangle, std::uint32_t>> sorted_triangles;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    sorted_triangles.emplace_back(lowest_first(triangles[i]), i);
  }
  std::sort(sorted_triangles.begin(), sorted_triangles.end());
  std::vector<std::uint8_t> is_repeated(triangles.size(), 0);
  for (std::size_t i = 1; i < sorted_triangles.size(); ++i) {
    if (sorted_triangles[i].first != sorted_triangles[i - 1].first) continue;
    is_repeated[sorted_triangles[i].second] = 1;
    for (const std::uint32_t v : sorted_triangles[i].first) is_fixed[v] = 1;
  }
  std::vector<Triangle> other_triangles;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (is_repeated[i] != 0) continue;
    other_triangles.push_back(triangles[i]);
    low_poly_triangles_.push_back(replaced_triangles_[i]);
  }
  triangles = std::move(other_triangles);
  replaced_triangles_ = low_poly_triangles_;
}

/// Collects the quads of the fine surface whose corners are represented by vertices of the patch.
void IsosurfacePatch::collect_fine_quads(const FineSurface& surface,
                                         const SimplifiedIsosurface& low_poly,
                                         std::span<const std::uint8_t> free) {
  std::vector<std::uint32_t> number(surface.vertices.size(), kNoVertex);
  for (std::size_t at = 0; at < vertices_.size(); ++at) {
    if (free[at] == 0) continue;  // This vertex is fixed and keeps its position
    const std::uint32_t v = vertices_[at];
    for (std::uint32_t i = low_poly.leaf_begins[v]; i < low_poly.leaf_begins[v + 1]; ++i) {
      const std::uint32_t leaf = low_poly.leaves[i];
      const float* p = surface.vertices[leaf].position;
      number[leaf] = static_cast<std::uint32_t>(fine_points.size());
      fine_points.push_back(to_float(to_unit({p[0], p[1], p[2]})));
    }
  }
  constexpr std::size_t kEdgesPerPart = 1 << 15;
  std::vector<std::vector<Triangle>> triangles_by_part((surface.edges.size() + kEdgesPerPart - 1) /
                                                       kEdgesPerPart);
  parallel_for(triangles_by_part.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      const std::size_t last = std::min(surface.edges.size(), (part + 1) * kEdgesPerPart);
      for (std::size_t i = part * kEdgesPerPart; i < last; ++i) {
        const FineEdge& edge = surface.edges[i];
        if (!edge.is_quad()) continue;
        std::array<std::uint32_t, 4> c{};
        for (std::size_t k = 0; k < 4; ++k) c[k] = number[edge.vertices[k]];
        if (std::find(c.begin(), c.end(), kNoVertex) != c.end()) continue;
        if ((edge.solid_at_lower_end != 0) == surface.is_left_handed) std::swap(c[1], c[3]);
        triangles_by_part[part].push_back({c[0], c[1], c[2]});
        triangles_by_part[part].push_back({c[0], c[2], c[3]});
      }
    }
  });
  for (const auto& part : triangles_by_part) {
    fine_triangles.insert(fine_triangles.end(), part.begin(), part.end());
  }
}

void IsosurfacePatch::apply_collapses(
    const CollapseMesh& mesh, std::span<const std::pair<std::uint32_t, std::uint32_t>> merges) {
  points = mesh.points;
  std::vector<std::uint8_t> seed(triangles.size(), 0);
  for (const std::uint32_t t : seeds) seed[t] = 1;
  seeds.clear();
  std::uint32_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.alive[t] == 0) continue;
    if (seed[t] != 0) seeds.push_back(kept);
    triangles[kept] = mesh.triangles[t];
    low_poly_triangles_[kept++] = low_poly_triangles_[t];
  }
  triangles.resize(kept);
  low_poly_triangles_.resize(kept);
  for (const auto& [kept_vertex, removed_vertex] : merges) {
    is_fixed[kept_vertex] = is_fixed[kept_vertex] | is_fixed[removed_vertex];
    merged_vertices_.emplace_back(kept_vertex, removed_vertex);
  }
}

void IsosurfacePatch::apply_to_low_poly(const FineSurface& surface, const Volume& volume,
                                        SimplifiedIsosurface& low_poly) const {
  IsosurfaceChange change(low_poly, faces_);
  for (const std::uint32_t t : replaced_triangles_) change.is_remaining[t] = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    change.is_remaining[low_poly_triangles_[i]] = 1;
    for (std::size_t k = 0; k < 3; ++k)
      change.triangles[low_poly_triangles_[i]][k] = vertices_[triangles[i][k]];
  }
  for (const auto& [kept_vertex, removed_vertex] : merged_vertices_)
    change.merged_into[vertices_[removed_vertex]] = vertices_[kept_vertex];
  std::vector<std::uint32_t> changed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec3& at = low_poly.positions[vertices_[i]];
    if (length(to_unit(at) - points[i]) == 0) continue;
    at = to_world(points[i]);
    changed.push_back(vertices_[i]);
  }
  for (const auto& [kept_vertex, removed_vertex] : merged_vertices_)
    changed.push_back(vertices_[kept_vertex]);
  const std::vector<std::uint32_t> number = change.apply_to_low_poly(surface, low_poly);
  for (const std::uint32_t v : changed) {
    if (number[v] == kNoVertex) continue;
    low_poly.error = std::max(low_poly.error, vertex_error(surface, volume, low_poly, number[v]));
  }
}

}  // namespace kiln

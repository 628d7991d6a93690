#include "volume/simplified_isosurface.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "mesh/vector.h"
#include "volume/short_edges.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = VertexTree::kNone;
constexpr float kNoLimit = std::numeric_limits<float>::infinity();

/// Connected parts of the fine surface. A part consists of the fine vertices below one root of the
/// vertex tree.
struct SurfaceParts {
  std::vector<std::uint32_t> part_root;  ///< Root above each node of the tree
  /// Number of fine vertices of each part, indexed by the part's root
  std::vector<std::uint32_t> part_sizes;
  std::uint32_t largest = 0;

  explicit SurfaceParts(const VertexTree& tree)
      : part_root(tree.count()), part_sizes(tree.count()) {
    for (std::uint32_t node = tree.count(); node-- > 0;) {
      part_root[node] = tree.parent(node) == kNone ? node : part_root[tree.parent(node)];
      if (node < tree.leaves()) ++part_sizes[part_root[node]];
    }
    for (const std::uint32_t size : part_sizes) largest = std::max(largest, size);
  }
};

/// For each fine vertex, 1 if its part is small and is removed; empty if no part is removed.
std::vector<std::uint8_t> find_small_parts(const VertexTree& tree, double min_part,
                                           SimplifiedIsosurface& low_poly) {
  const SurfaceParts parts(tree);
  for (const std::uint32_t size : parts.part_sizes) {
    if (size == 0) continue;
    ++low_poly.parts;
    if (size < min_part * parts.largest) ++low_poly.dropped_parts;
  }
  std::vector<std::uint8_t> result;
  if (low_poly.dropped_parts == 0) return result;
  result.resize(tree.leaves());
  for (std::uint32_t leaf = 0; leaf < tree.leaves(); ++leaf) {
    result[leaf] = parts.part_sizes[parts.part_root[leaf]] < min_part * parts.largest ? 1 : 0;
  }
  return result;
}

/// For each cluster, the lowest error limit at which its fine vertices are merged into one vertex,
/// which represents the cluster itself or one of its ancestors.
std::vector<float> find_merge_limits(const VertexTree& tree, bool keep_topology) {
  const std::uint32_t leaves = tree.leaves();
  std::vector<float> merge_limits(tree.count() - leaves);
  for (std::uint32_t node = tree.count(); node-- > leaves;) {
    const VertexTree::Cluster& cluster = tree.cluster(node);
    float merge_limit = cluster.is_one_sheet || !keep_topology ? cluster.error : kNoLimit;
    const std::uint32_t parent = tree.parent(node);
    if (parent != kNone) merge_limit = std::min(merge_limit, merge_limits[parent - leaves]);
    merge_limits[node - leaves] = merge_limit;
  }
  return merge_limits;
}

/// Finds the error limit at which at most `faces` triangles remain. A quad loses one of its
/// triangles when the ends of one of its sides are merged, and the other when the ends of a second
/// side are merged.
float limit_for_faces(const FineSurface& surface, const VertexTree& tree,
                      const std::vector<std::uint8_t>& small, const std::vector<float>& limits,
                      std::size_t faces) {
  RawVector<float> loss_limits(2 * surface.edges.size());
  parallel_for(surface.edges.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const FineEdge& edge = surface.edges[i];
      // If an edge has no quad, both triangles count as lost at any limit
      float first = -1, second = -1;
      if (edge.is_quad() && (small.empty() || small[edge.vertices[0]] == 0)) {
        first = second = kNoLimit;
        for (std::size_t k = 0; k < 4; ++k) {
          std::uint32_t a = edge.vertices[k], b = edge.vertices[(k + 1) % 4];
          while (a != b) {
            std::uint32_t& lower = a < b ? a : b;
            if (lower == kNone) break;
            lower = tree.parent(lower);
            if (lower == kNone) break;
          }
          if (a != b) continue;
          const float limit = limits[a - tree.leaves()];
          second = std::min(second, std::max(first, limit));
          first = std::min(first, limit);
        }
      }
      loss_limits[2 * i] = first;
      loss_limits[2 * i + 1] = second;
    }
  });
  if (loss_limits.size() <= faces) return -1;
  // Selects the error limit at which just enough triangles vanish to leave the requested number of
  // faces.
  const auto last =
      loss_limits.begin() + static_cast<std::ptrdiff_t>(loss_limits.size() - faces - 1);
  std::nth_element(loss_limits.begin(), last, loss_limits.end());
  if (*last != kNoLimit) return *last;
  float max_loss_limit = -1;
  for (auto at = loss_limits.begin(); at != last; ++at) {
    if (*at != kNoLimit) max_loss_limit = std::max(max_loss_limit, *at);
  }
  return max_loss_limit;
}

Vec3d to_world(const Volume& volume, const Vec3d& padded) {
  const double at[3] = {padded.x - 1, padded.y - 1, padded.z - 1};
  Vec3d result{};
  for (std::size_t k = 0; k < 3; ++k) {
    result += Vec3d(volume.axes[k][0], volume.axes[k][1], volume.axes[k][2]) * at[k];
  }
  return result;
}

Vec3d normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  return cross(to_double(b) - to_double(a), to_double(c) - to_double(a));
}

/// True if a quad's triangles agree better with the vertex normals if the quad is split along the
/// diagonal from corner 1 to 3 than along that from 0 to 2. The measure is the smallest cosine
/// between a triangle's normal and a vertex normal.
bool prefers_other_diagonal(const SimplifiedIsosurface& low_poly,
                            const SimplifiedIsosurface::Polygon& polygon) {
  const auto& c = polygon.corners;
  const auto position = [&](std::size_t k) { return low_poly.positions[c[k % 4]]; };
  const auto min_normal_cosine = [&](std::size_t first) {
    double min_agreement = 1;
    for (std::size_t half = 0; half < 2; ++half) {
      const std::size_t k0 = first, k1 = first + 1 + half, k2 = first + 2 + half;
      const Vec3d normal = normal_of(position(k0), position(k1), position(k2));
      const Vec3d target_normal = to_double(low_poly.normals[c[k0 % 4]]) +
                                  to_double(low_poly.normals[c[k1 % 4]]) +
                                  to_double(low_poly.normals[c[k2 % 4]]);
      const double size = length(normal) * length(target_normal);
      min_agreement = std::min(min_agreement, size > 0 ? dot(normal, target_normal) / size : -1.0);
    }
    return min_agreement;
  };
  return min_normal_cosine(1) > min_normal_cosine(0);
}

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

/// Rotates the corners of quads so that the better diagonal runs from corner 0 to 2. The other
/// diagonal is used where another polygon already has the better one as an edge, which would
/// otherwise get more than two triangles.
void choose_diagonals(SimplifiedIsosurface& low_poly) {
  std::unordered_set<std::uint64_t> used_diagonals;
  used_diagonals.reserve(3 * low_poly.polygons.size());
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    const std::size_t count = polygon.is_quad() ? 4 : 3;
    for (std::size_t k = 0; k < count; ++k) {
      used_diagonals.insert(edge_key(polygon.corners[k], polygon.corners[(k + 1) % count]));
    }
  }
  for (SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    if (!polygon.is_quad()) continue;
    auto& c = polygon.corners;
    const std::uint64_t diagonals[2] = {edge_key(c[0], c[2]), edge_key(c[1], c[3])};
    std::size_t chosen = prefers_other_diagonal(low_poly, polygon) ? 1 : 0;
    if (used_diagonals.count(diagonals[chosen]) != 0 &&
        used_diagonals.count(diagonals[1 - chosen]) == 0) {
      chosen = 1 - chosen;
    }
    used_diagonals.insert(diagonals[chosen]);
    if (chosen == 1) std::rotate(c.begin(), c.begin() + 1, c.end());
  }
}

/// Collapses edges of zero length between vertices that represent a single fine vertex, and updates
/// `representative` for the removed ones. Vertices that represent larger clusters are not merged,
/// even at the same position: each represents a larger piece of the surface, and one chart could
/// not hold both.
void merge_zero_length_edges(SimplifiedIsosurface& low_poly,
                             std::vector<std::uint32_t>& representative, std::uint32_t leaves,
                             const std::function<Vec3(std::uint32_t)>& place) {
  std::vector<PolygonCorners> polygons;
  polygons.reserve(low_poly.polygons.size());
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons)
    polygons.push_back(polygon.corners);
  const auto gone = collapse_short_edges(polygons, place, leaves);
  if (gone.empty()) return;
  low_poly.polygons.clear();
  for (const PolygonCorners& corners : polygons) low_poly.polygons.push_back({corners});
  const std::unordered_map<std::uint32_t, std::uint32_t> by(gone.begin(), gone.end());
  for (std::uint32_t& node : representative) {
    const auto at = by.find(node);
    if (at != by.end()) node = at->second;
  }
}

/// Counts the sets that contain at least one joined element.
std::uint64_t count_joined_sets(DisjointSets& sets, const std::vector<std::uint8_t>& joined) {
  std::uint64_t count = 0;
  for (std::uint32_t v = 0; v < joined.size(); ++v) count += joined[v] != 0 && sets.find(v) == v;
  return count;
}

/// \param at_border  for each vertex, 1 if border edges may end there; empty: they may end at all
///   vertices
SimplifiedIsosurface::Pieces count_pieces(const std::vector<PolygonCorners>& polygons,
                                          std::size_t vertices,
                                          const std::vector<std::uint8_t>& at_border) {
  DisjointSets parts(vertices), border_loops(vertices);
  std::vector<std::uint8_t> is_in_part(vertices), is_in_loop(vertices);
  std::vector<std::uint64_t> edges;
  for (const PolygonCorners& c : polygons) {
    const std::size_t count = c[3] == kNone ? 3 : 4;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t a = c[k], b = c[(k + 1) % count];
      parts.join(a, b);
      is_in_part[a] = is_in_part[b] = 1;
      if (at_border.empty() || (at_border[a] != 0 && at_border[b] != 0)) {
        edges.push_back(edge_key(a, b));
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    if (end - i == 1) {
      const auto a = static_cast<std::uint32_t>(edges[i] >> 32);
      const auto b = static_cast<std::uint32_t>(edges[i]);
      border_loops.join(a, b);
      is_in_loop[a] = is_in_loop[b] = 1;
    }
    i = end;
  }
  return {count_joined_sets(parts, is_in_part), count_joined_sets(border_loops, is_in_loop)};
}

SimplifiedIsosurface::Pieces count_fine_pieces(const FineSurface& surface,
                                               const std::vector<std::uint8_t>& small) {
  std::vector<PolygonCorners> polygons;
  std::vector<std::uint8_t> at_border(surface.keys.size(), 0);
  for (const FineEdge& edge : surface.edges) {
    if (edge.is_quad()) {
      if (small.empty() || small[edge.vertices[0]] == 0) polygons.push_back(edge.vertices);
      continue;
    }
    for (const std::uint32_t vertex : edge.vertices) {
      if (vertex != kNone) at_border[vertex] = 1;
    }
  }
  return count_pieces(polygons, surface.keys.size(), at_border);
}

std::uint64_t count_remaining_quads(const FineSurface& surface,
                                    const std::vector<std::uint8_t>& small) {
  if (small.empty()) return surface.quads;
  return static_cast<std::uint64_t>(std::count_if(
      surface.edges.begin(), surface.edges.end(),
      [&](const FineEdge& edge) { return edge.is_quad() && small[edge.vertices[0]] == 0; }));
}

}  // namespace

Vec3 SimplifiedIsosurface::mean_normal(const FineSurface& surface, std::uint32_t vertex) const {
  Vec3d sum{};
  for (std::uint32_t k = leaf_begins[vertex]; k < leaf_begins[vertex + 1]; ++k) {
    const float* n = surface.vertices[leaves[k]].normal;
    sum += Vec3d(n[0], n[1], n[2]);
  }
  if (!(length(sum) > 1e-9)) {
    const float* n = surface.vertices[leaves[leaf_begins[vertex]]].normal;
    sum = Vec3d(n[0], n[1], n[2]);
  }
  return to_float(sum * (1 / length(sum)));
}

std::uint64_t count_small_parts(const VertexTree& tree, double share) {
  const SurfaceParts parts(tree);
  return static_cast<std::uint64_t>(
      std::count_if(parts.part_sizes.begin(), parts.part_sizes.end(),
                    [&](std::uint32_t size) { return size != 0 && size < share * parts.largest; }));
}

SimplifiedIsosurface simplify_isosurface(const FineSurface& surface, const VertexTree& tree,
                                         const Volume& volume, const IsosurfaceOptions& options) {
  const std::uint32_t leaves = tree.leaves();
  SimplifiedIsosurface low_poly;
  const std::vector<std::uint8_t> is_small = find_small_parts(tree, options.min_part, low_poly);
  const std::vector<float> limits = find_merge_limits(tree, options.keep_topology);
  low_poly.aimed_faces = options.faces;
  if (options.faces == 0 && options.share < 1) {
    const double initial_faces = 2 * static_cast<double>(count_remaining_quads(surface, is_small));
    low_poly.aimed_faces = static_cast<std::uint64_t>(std::ceil(initial_faces * options.share));
  }
  float limit = static_cast<float>(options.error);
  if (low_poly.aimed_faces != 0) {
    const float min_limit = limit_for_faces(surface, tree, is_small, limits,
                                            static_cast<std::size_t>(low_poly.aimed_faces));
    limit = options.faces != 0 ? min_limit : std::max(limit, min_limit);
  }
  if (options.faces == 0) low_poly.error_limit = double{limit};
  // The topmost cluster within the limit represents all its descendants.
  std::vector<std::uint32_t> representative(tree.count());
  for (std::uint32_t node = tree.count(); node-- > 0;) {
    const std::uint32_t parent = tree.parent(node);
    const std::uint32_t parent_representative = parent == kNone ? kNone : representative[parent];
    if (parent_representative != kNone) {
      representative[node] = parent_representative;
    } else if (node < leaves) {
      representative[node] = node;
    } else {
      const VertexTree::Cluster& cluster = tree.cluster(node);
      const bool is_within_limit =
          (cluster.is_one_sheet || !options.keep_topology) && cluster.error <= limit;
      representative[node] = is_within_limit ? node : kNone;
    }
  }

  // Collects the polygons whose corners remain distinct, in parallel and in the order of the edges.
  constexpr std::size_t kEdgesPerPart = 1 << 15;
  std::vector<std::vector<SimplifiedIsosurface::Polygon>> parts(
      (surface.edges.size() + kEdgesPerPart - 1) / kEdgesPerPart);
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      const std::size_t last = std::min(surface.edges.size(), (part + 1) * kEdgesPerPart);
      for (std::size_t i = part * kEdgesPerPart; i < last; ++i) {
        const FineEdge& edge = surface.edges[i];
        if (!edge.is_quad() || (!is_small.empty() && is_small[edge.vertices[0]] != 0)) continue;
        SimplifiedIsosurface::Polygon polygon{{kNone, kNone, kNone, kNone}};
        std::size_t corners = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          const std::uint32_t vertex = representative[edge.vertices[k]];
          if (vertex != representative[edge.vertices[(k + 1) % 4]])
            polygon.corners[corners++] = vertex;
        }
        if (corners < 3) continue;
        if ((edge.solid_at_lower_end != 0) == surface.is_left_handed) {
          std::reverse(polygon.corners.begin(),
                       polygon.corners.begin() + static_cast<std::ptrdiff_t>(corners));
        }
        parts[part].push_back(polygon);
      }
    }
  });
  for (const auto& part : parts) {
    low_poly.polygons.insert(low_poly.polygons.end(), part.begin(), part.end());
  }

  const auto place = [&](std::uint32_t node) {
    if (node >= leaves) return to_float(to_world(volume, tree.cluster(node).place));
    const float* p = surface.vertices[node].position;
    return Vec3{p[0], p[1], p[2]};
  };
  merge_zero_length_edges(low_poly, representative, leaves, place);

  // Numbers the used vertices in the order of their nodes in the tree.
  std::vector<std::uint32_t> number(tree.count(), kNone);
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    for (const std::uint32_t corner : polygon.corners) {
      if (corner != kNone) number[corner] = 0;
    }
  }
  std::uint32_t count = 0;
  for (std::uint32_t node = 0; node < tree.count(); ++node) {
    if (number[node] == kNone) continue;
    number[node] = count++;
    low_poly.positions.push_back(place(node));
    if (node < leaves) continue;
    const VertexTree::Cluster& cluster = tree.cluster(node);
    low_poly.error = std::max(low_poly.error, double{cluster.error});
    if (!cluster.is_one_sheet) ++low_poly.changed_topology;
  }
  // Lists the fine vertices that each vertex represents.
  low_poly.leaf_begins.assign(count + 1, 0);
  for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
    const std::uint32_t vertex = number[representative[leaf]];
    if (vertex != kNone) ++low_poly.leaf_begins[vertex + 1];
  }
  for (std::uint32_t i = 0; i < count; ++i) low_poly.leaf_begins[i + 1] += low_poly.leaf_begins[i];
  low_poly.leaves.resize(low_poly.leaf_begins[count]);
  {
    std::vector<std::uint32_t> next(low_poly.leaf_begins.begin(), low_poly.leaf_begins.end() - 1);
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
      const std::uint32_t vertex = number[representative[leaf]];
      if (vertex != kNone) low_poly.leaves[next[vertex]++] = leaf;
    }
  }
  low_poly.normals.resize(count);
  parallel_for(count, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      low_poly.normals[i] = low_poly.mean_normal(surface, static_cast<std::uint32_t>(i));
    }
  });
  for (SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    for (std::uint32_t& corner : polygon.corners) {
      if (corner != kNone) corner = number[corner];
    }
    low_poly.faces += polygon.is_quad() ? 2 : 1;
  }
  if (tree.open() && options.keep_topology) {
    std::vector<PolygonCorners> polygons;
    for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons)
      polygons.push_back(polygon.corners);
    low_poly.fine_pieces = count_fine_pieces(surface, is_small);
    low_poly.pieces = count_pieces(polygons, count, {});
  }
  choose_diagonals(low_poly);
  low_poly.is_goal_reached = options.faces == 0 || low_poly.faces <= options.faces;
  return low_poly;
}

}  // namespace kiln

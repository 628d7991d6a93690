#include "volume/vertex_tree.h"

#include <algorithm>
#include <bit>
#include <span>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "base/progress_guard.h"

namespace kiln {
namespace {

/// Topological invariants that decide whether a cluster is one sheet.
struct ClusterTopology {
  std::int32_t doubled_euler = 0;  ///< Twice the Euler characteristic of the cluster's surface
  std::uint16_t crossed = 0;       ///< Mask of the node's edges that the surface crosses
  /// Mask of the node's edges that the surface crosses more than once
  std::uint16_t crossed_repeatedly = 0;
  /// For each face of the node (2 * axis + side), the number of lines of the surface on it that end
  /// at the volume's open border; counted up to 3.
  std::array<std::uint8_t, 6> border_line_ends{};
};

/// For each face of a node (2 * axis + side), the mask of its four edges.
constexpr std::array<std::uint16_t, 6> make_face_edges() {
  std::array<std::uint16_t, 6> result{};
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t side = 0; side < 2; ++side) {
      const std::uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      const std::uint32_t bits = 1U << (4 * u + 2 * side) | 1U << (4 * u + 1 + 2 * side) |
                                 1U << (4 * v + side) | 1U << (4 * v + 2 + side);
      result[2 * axis + side] = static_cast<std::uint16_t>(bits);
    }
  }
  return result;
}

/// True for a disk that crosses each edge of the node at most once, and each face and the volume's open border in at
/// most one line. A vertex that replaces the disk then has one ring of polygons, or one fan at the border.
bool is_one_sheet(const ClusterTopology& topology) {
  constexpr std::array<std::uint16_t, 6> kFaceEdges = make_face_edges();
  if (topology.doubled_euler != 2 || topology.crossed_repeatedly != 0) return false;
  int ends = 0;
  for (std::size_t face = 0; face < kFaceEdges.size(); ++face) {
    const int crossed_edge_count =
        std::popcount(static_cast<std::uint16_t>(topology.crossed & kFaceEdges[face]));
    // A line on a face connects two of the face's crossings, or a crossing with the open border.
    if (crossed_edge_count + topology.border_line_ends[face] != 0 &&
        crossed_edge_count + topology.border_line_ends[face] != 2)
      return false;
    ends += topology.border_line_ends[face];
  }
  return ends <= 2 && std::popcount(topology.crossed) >= (ends == 0 ? 3 : 1);
}

/// Sums over those fine vertices of a cluster at which the surface ends at the volume's open
/// border. They are indexed by the side of the volume: 2 * axis, plus 1 for the far side. They keep
/// the vertex on the border plane. Without them, where the surface is perpendicular to the border,
/// the error function would have the same value at every distance from the border, and the vertex
/// would move to the cluster's mean.
struct BorderSums {
  std::array<double, 6> sum{};  ///< Sums of the fine vertices' coordinates along the axis
  std::array<std::uint32_t, 6> count{};

  void add(const BorderSums& other) {
    for (std::size_t k = 0; k < 6; ++k) {
      sum[k] += other.sum[k];
      count[k] += other.count[k];
    }
  }
  /// Restricts a box to the border planes that the cluster touches.
  /// \returns half the distance between two opposite border planes if the cluster touches both,
  ///   since a vertex cannot lie on both; otherwise 0
  double restrict_to_border(std::array<double, 3>& low, std::array<double, 3>& high) const {
    double border_plane_gap = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t near = 2 * axis, far = near + 1;
      const auto at = [&](std::size_t side) { return sum[side] / count[side]; };
      if (count[near] == 0 && count[far] == 0) continue;
      double place = 0;
      if (count[near] != 0 && count[far] != 0) {
        place = (at(near) + at(far)) / 2;
        border_plane_gap = std::max(border_plane_gap, (at(far) - at(near)) / 2);
      } else {
        place = at(count[near] != 0 ? near : far);
      }
      low[axis] = high[axis] = std::clamp(place, low[axis], high[axis]);
    }
    return border_plane_gap;
  }
};

/// Computes the border sums of each fine vertex whose cell has a crossed edge in an outermost plane
/// of voxels.
std::vector<BorderSums> find_border_sums(const FineSurface& surface) {
  std::vector<BorderSums> border_sums(surface.keys.size());
  for (const FineEdge& edge : surface.edges) {
    if (edge.is_quad()) continue;
    const auto& at = edge.vertices;
    const auto gone = [&](std::size_t a, std::size_t b) {
      return at[a] == CellGrid::kNone && at[b] == CellGrid::kNone;
    };
    const std::size_t u = (edge.axis + 1U) % 3, v = (edge.axis + 2U) % 3;
    const std::array<std::pair<std::size_t, bool>, 4> sides = {{{2 * u, gone(0, 3)},
                                                                {2 * u + 1, gone(1, 2)},
                                                                {2 * v, gone(0, 1)},
                                                                {2 * v + 1, gone(2, 3)}}};
    for (const std::uint32_t vertex : at) {
      if (vertex == CellGrid::kNone) continue;
      for (const auto& [side, ends] : sides) {
        if (!ends || border_sums[vertex].count[side] != 0) continue;
        const CellPlace cell = unpack_cell_place(surface.keys[vertex]);
        Qef qef;
        qef.add(surface.qefs[vertex], cell);
        const Vec3d low(cell[0], cell[1], cell[2]);
        const Vec3d place = qef.find_minimum(low, low + Vec3d(1, 1, 1)).place;
        const double along[3] = {place.x, place.y, place.z};
        border_sums[vertex].sum[side] = along[side / 2];
        border_sums[vertex].count[side] = 1;
      }
    }
  }
  return border_sums;
}

/// Of the four cells around an edge, the two pairs that are adjacent along u, and the two that are
/// adjacent along v.
constexpr std::array<std::array<std::uint32_t, 2>, 2> kCellPairsAcrossU = {{{0, 1}, {3, 2}}};
constexpr std::array<std::array<std::uint32_t, 2>, 2> kCellPairsAcrossV = {{{1, 2}, {0, 3}}};

/// Two of the cells at an edge in the open border share a face. The surface crosses this face along a line, which ends at
/// the edge.
struct BorderLineAcross {
  std::uint32_t axis;  ///< Axis along which the cells are adjacent
  std::uint8_t level;  ///< The cells lie in the same node from this level + 1 upwards
  /// Indices of the lower and the upper cell among the edge's four cells
  std::array<std::uint32_t, 2> sides;
};

BorderLineAcross find_border_line(const FineEdge& edge) {
  const auto both = [&](const std::array<std::uint32_t, 2>& sides) {
    return edge.vertices[sides[0]] != CellGrid::kNone && edge.vertices[sides[1]] != CellGrid::kNone;
  };
  for (const auto& sides : kCellPairsAcrossU) {
    if (both(sides)) return {(edge.axis + 1U) % 3, edge.u_level, sides};
  }
  return {(edge.axis + 2U) % 3, edge.v_level,
          both(kCellPairsAcrossV[0]) ? kCellPairsAcrossV[0] : kCellPairsAcrossV[1]};
}

/// Finds the edges in the open border at which the line between two cells ends (BorderLineAcross).
/// Such a line is the dual of a polygon's side. If both of its ends lie in the border, no polygon
/// has that side, so the line connects no vertices and is skipped.
std::vector<std::uint32_t> find_border_line_ends(const FineSurface& surface) {
  struct BorderLineEnd {
    std::uint64_t cells;
    std::uint32_t edge;
  };
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  };
  std::vector<BorderLineEnd> border_line_ends;
  std::vector<std::uint8_t> ends(surface.keys.size(), 0);
  for (std::uint32_t i = 0; i < surface.edges.size(); ++i) {
    const FineEdge& edge = surface.edges[i];
    if (edge.is_quad() ||
        std::count(edge.vertices.begin(), edge.vertices.end(), CellGrid::kNone) != 2) {
      continue;
    }
    const BorderLineAcross line = find_border_line(edge);
    const std::uint32_t a = edge.vertices[line.sides[0]], b = edge.vertices[line.sides[1]];
    border_line_ends.push_back({key(a, b), i});
    ends[a] = ends[b] = 1;
  }
  const auto is_before = [](const BorderLineEnd& a, const BorderLineEnd& b) {
    return a.cells < b.cells;
  };
  std::stable_sort(border_line_ends.begin(), border_line_ends.end(), is_before);
  std::vector<std::uint8_t> is_polygon_side(border_line_ends.size(), 0);
  for (const FineEdge& edge : surface.edges) {
    if (!edge.is_quad()) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = edge.vertices[k], b = edge.vertices[(k + 1) % 4];
      if (ends[a] == 0 || ends[b] == 0) continue;
      const auto [first, last] = std::equal_range(border_line_ends.begin(), border_line_ends.end(),
                                                  BorderLineEnd{key(a, b), 0}, is_before);
      for (auto at = first; at != last; ++at)
        is_polygon_side[static_cast<std::size_t>(at - border_line_ends.begin())] = 1;
    }
  }
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < border_line_ends.size(); ++i) {
    if (is_polygon_side[i] != 0) result.push_back(border_line_ends[i].edge);
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// For each of the four cells around an edge: which of the cell's four edges along that axis it is,
/// as u + 2 v (shared/volume.h).
constexpr std::array<std::uint32_t, 4> kEdgeOfCell = {3, 2, 0, 1};

}  // namespace

const VertexTree::Cluster* VertexTree::find_earlier_cluster(const EarlierTree& earlier,
                                                            std::uint32_t leaf,
                                                            std::uint32_t level) {
  const UnchangedVertices& kept = earlier.kept;
  if (leaf >= kept.prefix_end && leaf < kept.new_suffix_begin) return nullptr;
  const VertexTree& tree = *earlier.tree;
  std::uint32_t node =
      leaf < kept.prefix_end ? leaf : leaf - kept.new_suffix_begin + kept.old_suffix_begin;
  do {
    node = tree.parent(node);
    if (node == kNone) return nullptr;
  } while (tree.cluster(node).level < level);
  const Cluster& cluster = tree.cluster(node);
  return cluster.level == level ? &cluster : nullptr;
}

VertexTree::VertexTree(const FineSurface& surface, const std::array<std::uint32_t, 3>& size,
                       bool open, const EarlierTree& earlier)
    : has_open_border_(open), leaves_(static_cast<std::uint32_t>(surface.keys.size())) {
  std::vector<BorderSums> border_sums;  // Border sums of each node
  if (open) border_sums = find_border_sums(surface);
  DisjointSets sets(leaves_);
  parents_.assign(leaves_, kNone);
  RawVector<std::uint32_t> node_of_set(leaves_);  // Node of each set, at the current level
  for (std::uint32_t i = 0; i < leaves_; ++i) node_of_set[i] = i;
  std::vector<ClusterTopology> cluster_topologies;  // Topological invariants of each cluster
  const auto is_there = [](std::uint32_t vertex) { return vertex != CellGrid::kNone; };

  // Indices of edges in ascending order. `joining`: their cells are not all in one node yet, so
  // they may still connect sets. `framing`: they lie on edges of nodes at this level.
  const auto edge_count = static_cast<std::uint32_t>(surface.edges.size());
  std::vector<std::uint32_t> joining(edge_count), framing, border_line_ends;
  for (std::uint32_t i = 0; i < edge_count; ++i) joining[i] = i;
  framing = joining;
  if (open) {
    border_line_ends = find_border_line_ends(surface);
    std::erase_if(framing, [&](std::uint32_t i) { return !surface.edges[i].is_quad(); });
    std::erase_if(joining, [&](std::uint32_t i) {
      return !surface.edges[i].is_quad() &&
             !std::binary_search(border_line_ends.begin(), border_line_ends.end(), i);
    });
  }
  const std::uint32_t side = std::max({size[0], size[1], size[2]}) + 1;

  struct GrowingChild {
    std::uint32_t set, node;
  };
  std::vector<GrowingChild> growing_children;
  std::vector<std::uint32_t> lowest;  // Lowest index of a fine vertex in each new cluster
  for (std::uint32_t level = 1; (side - 1) >> (level - 1) != 0; ++level) {
    ProgressGuard::poll();
    const std::uint32_t plane = level - 1;
    growing_children.clear();
    lowest.clear();
    const std::uint32_t first = count();
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
      if (!is_there(a) || !is_there(b)) return;
      a = sets.find(a);
      b = sets.find(b);
      if (a == b) return;
      // A set that was enlarged at this level gets its node only when the level is complete.
      for (const std::uint32_t set : {a, b}) {
        if (node_of_set[set] != kNone) growing_children.push_back({set, node_of_set[set]});
      }
      sets.join(a, b);
      node_of_set[sets.find(a)] = kNone;
    };
    for (const std::uint32_t index : joining) {
      const FineEdge& edge = surface.edges[index];
      if (edge.u_level == plane) {
        for (const auto& [a, b] : kCellPairsAcrossU) join(edge.vertices[a], edge.vertices[b]);
      }
      if (edge.v_level == plane) {
        for (const auto& [a, b] : kCellPairsAcrossV) join(edge.vertices[a], edge.vertices[b]);
      }
    }
    // Creates a cluster for each set that grew, in the order of the unions.
    for (const GrowingChild& child : growing_children) {
      const std::uint32_t set = sets.find(child.set);
      if (node_of_set[set] == kNone) {
        node_of_set[set] = count();
        lowest.push_back(set);
        parents_.push_back(kNone);
        cluster_topologies.emplace_back();
      }
      parents_[child.node] = node_of_set[set];
      cluster_topologies[node_of_set[set] - leaves_].doubled_euler +=
          child.node < leaves_ ? 2 : cluster_topologies[child.node - leaves_].doubled_euler;
    }
    const auto topology_at = [&](std::uint32_t vertex) -> ClusterTopology* {
      const std::uint32_t node = node_of_set[sets.find(vertex)];
      return node < first ? nullptr : &cluster_topologies[node - leaves_];
    };
    // Computes the Euler characteristic V - E + F. Each child has counted its own crossings and
    // lines. A crossing that two children share, and a line on the face between them, must be
    // counted only once in their parent. A line is corrected in two halves, one at each of the
    // crossings at its ends.
    for (const std::uint32_t index : joining) {
      const FineEdge& edge = surface.edges[index];
      const bool u = edge.u_level == plane, v = edge.v_level == plane;
      if (!u && !v) continue;
      const auto& at = edge.vertices;
      const auto lines = [&](const auto& sides, bool apart) {
        for (const auto& [a, b] : sides) {
          if (!is_there(at[a]) || !is_there(at[b])) continue;
          // If the other two cells lie in another node, or have no vertex, only these two share the
          // crossing.
          topology_at(at[a])->doubled_euler += apart ? 1 - 2 : 1;
        }
      };
      if (u) lines(kCellPairsAcrossU, edge.v_level > plane);
      if (v) lines(kCellPairsAcrossV, edge.u_level > plane);
      if (u && v) {
        // All four cells lie in one node, and each has counted the crossing, which must be counted
        // only once.
        int cells_in_node = 0;
        std::uint32_t cell_of_node = 0;
        for (const std::uint32_t vertex : at) {
          if (is_there(vertex)) {
            ++cells_in_node;
            cell_of_node = vertex;
          }
        }
        if (cells_in_node > 1) topology_at(cell_of_node)->doubled_euler -= 2 * (cells_in_node - 1);
      } else if ((u && edge.v_level < plane) || (v && edge.u_level < plane)) {
        // Two pairs of cells meet here, and each pair has already counted the crossing once.
        const auto& [near, far] = u ? kCellPairsAcrossU : kCellPairsAcrossV;
        const bool one = is_there(at[near[0]]) || is_there(at[far[0]]);
        const bool other = is_there(at[near[1]]) || is_there(at[far[1]]);
        if (one && other)
          topology_at(is_there(at[near[0]]) ? at[near[0]] : at[far[0]])->doubled_euler -= 2;
      }
    }
    std::erase_if(framing, [&](std::uint32_t index) {
      const FineEdge& edge = surface.edges[index];
      return edge.u_level < level || edge.v_level < level;
    });
    for (const std::uint32_t index : framing) {
      const FineEdge& edge = surface.edges[index];
      for (std::size_t k = 0; k < 4; ++k) {
        if (!is_there(edge.vertices[k])) continue;
        ClusterTopology* topology = topology_at(edge.vertices[k]);
        if (topology == nullptr) continue;
        const auto bit = static_cast<std::uint16_t>(1U << (4 * edge.axis + kEdgeOfCell[k]));
        topology->crossed_repeatedly =
            static_cast<std::uint16_t>(topology->crossed_repeatedly | (topology->crossed & bit));
        topology->crossed = static_cast<std::uint16_t>(topology->crossed | bit);
      }
    }
    std::erase_if(border_line_ends, [&](std::uint32_t index) {
      return find_border_line(surface.edges[index]).level < level;
    });
    for (const std::uint32_t index : border_line_ends) {
      const FineEdge& edge = surface.edges[index];
      const BorderLineAcross line = find_border_line(edge);
      for (const std::uint32_t upper : {0U, 1U}) {
        ClusterTopology* topology = topology_at(edge.vertices[line.sides[upper]]);
        if (topology == nullptr) continue;
        std::uint8_t& ends = topology->border_line_ends[2 * line.axis + 1 - upper];
        ends = static_cast<std::uint8_t>(std::min(ends + 1, 3));
      }
    }
    std::erase_if(joining, [&](std::uint32_t index) {
      const FineEdge& edge = surface.edges[index];
      const auto later = [&](std::uint32_t at) { return at != 31 && at > plane; };
      return !later(edge.u_level) && !later(edge.v_level);
    });

    // Sorts the children by cluster with a stable sort, so that the order of sums does not depend
    // on the number of threads.
    const std::uint32_t new_cluster_count = count() - first;
    std::vector<std::uint32_t> begins(new_cluster_count + 1), children(growing_children.size());
    for (const GrowingChild& child : growing_children) ++begins[parents_[child.node] - first + 1];
    for (std::uint32_t i = 0; i < new_cluster_count; ++i) begins[i + 1] += begins[i];
    {
      std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
      for (const GrowingChild& child : growing_children)
        children[next[parents_[child.node] - first]++] = child.node;
    }
    clusters_.resize(count() - leaves_);
    if (open) border_sums.resize(count());
    parallel_for(new_cluster_count, 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Cluster& cluster = clusters_[first - leaves_ + i];
        cluster = {};
        std::uint32_t leaf = children[begins[i]];
        const auto own_plane = leaf < leaves_ ? unpack_cell_place(surface.keys[leaf])[2]
                                              : clusters_[leaf - leaves_].node[2];
        const std::uint32_t node_low_plane = own_plane >> level << level;
        const PlaneRange& changed = earlier.kept.planes;
        const bool unchanged =
            node_low_plane >= changed.last || node_low_plane + (1U << level) <= changed.first;
        const Cluster* old = earlier.tree != nullptr && unchanged
                                 ? find_earlier_cluster(earlier, lowest[i], level)
                                 : nullptr;
        for (std::uint32_t c = begins[i]; c < begins[i + 1]; ++c) {
          const std::uint32_t child = children[c];
          if (open) border_sums[first + i].add(border_sums[child]);
          if (old != nullptr) continue;
          if (child < leaves_) {
            cluster.qef.add(surface.qefs[child], unpack_cell_place(surface.keys[child]));
          } else {
            const Cluster& child_cluster = clusters_[child - leaves_];
            cluster.qef.add(child_cluster.qef);
            cluster.error = std::max(cluster.error, child_cluster.error);
          }
        }
        // Computes the node's box from any cell within the node.
        CellPlace node;
        if (leaf < leaves_) {
          node = unpack_cell_place(surface.keys[leaf]);
        } else {
          const Cluster& child_cluster = clusters_[leaf - leaves_];
          node = child_cluster.node;
        }
        std::array<double, 3> low{}, high{};
        for (std::size_t k = 0; k < 3; ++k) {
          node[k] = node[k] >> level << level;
          const std::uint32_t last = node[k] + (1U << level);
          low[k] = open ? std::max(node[k], 1U) : node[k];
          high[k] = std::min(last, open ? size[k] : size[k] + 1);
        }
        if (old != nullptr) {
          cluster = *old;
          cluster.is_one_sheet = is_one_sheet(cluster_topologies[first - leaves_ + i]);
          continue;
        }
        cluster.node = node;
        cluster.level = static_cast<std::uint8_t>(level);
        const double border_plane_gap =
            open ? border_sums[first + i].restrict_to_border(low, high) : 0;
        const Qef::Minimum minimum = cluster.qef.find_minimum(Vec3d(low[0], low[1], low[2]),
                                                              Vec3d(high[0], high[1], high[2]));
        cluster.place = minimum.place;
        cluster.error = std::max({cluster.error, static_cast<float>(minimum.error),
                                  static_cast<float>(border_plane_gap)});
        cluster.is_one_sheet = is_one_sheet(cluster_topologies[first - leaves_ + i]);
      }
    });
  }
  const auto common = [&](std::uint32_t a, std::uint32_t b) {
    while (a != b) {
      std::uint32_t& lower = a < b ? a : b;
      if (lower == kNone) return kNone;
      lower = parents_[lower];
    }
    return a;
  };
  for (const DoubledFaceVertex& doubled : surface.doubled_face_vertices) {
    std::uint32_t node = common(doubled.neighbours[0], doubled.neighbours[1]);
    const std::uint32_t end = node == kNone ? kNone : common(node, doubled.vertex);
    for (; node != end && node != kNone; node = parents_[node]) {
      clusters_[node - leaves_].is_one_sheet = false;
    }
  }
}

}  // namespace kiln

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
struct Shape {
  std::int32_t euler2 = 0;       ///< Twice the Euler characteristic of its surface
  std::uint16_t once = 0;        ///< Bits of the node's edges that are crossed
  std::uint16_t repeatedly = 0;  ///< Bits of the node's edges that are crossed more than once
  /// Number of lines on each face of the node (2 axis + side) that end at the volume's open border, at most
  /// 3.
  std::array<std::uint8_t, 6> ends{};
};

/// Bits of the four edges of each face. Faces are 2 axis + side.
constexpr std::array<std::uint16_t, 6> face_edges() {
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
/// most one line. The vertex that replaces it then has one ring of polygons, or one fan at the border.
bool is_one_sheet(const Shape& shape) {
  constexpr std::array<std::uint16_t, 6> kFaceEdges = face_edges();
  if (shape.euler2 != 2 || shape.repeatedly != 0) return false;
  int ends = 0;
  for (std::size_t face = 0; face < kFaceEdges.size(); ++face) {
    const int met = std::popcount(static_cast<std::uint16_t>(shape.once & kFaceEdges[face]));
    // A line connects two crossings or ends.
    if (met + shape.ends[face] != 0 && met + shape.ends[face] != 2) return false;
    ends += shape.ends[face];
  }
  return ends <= 2 && std::popcount(shape.once) >= (ends == 0 ? 3 : 1);
}

/// Sums over the fine vertices of a cluster at which the surface ends at the volume's open border, by side: 2 axis,
/// + 1 for the far one. They keep the surface on the border: along a wall perpendicular to the border, all heights
/// fit the crossings equally, and the crossings' mean would be that of the whole cluster.
struct Rim {
  std::array<double, 6> sum{};  ///< Sums of coordinates along the axis
  std::array<std::uint32_t, 6> count{};

  void add(const Rim& other) {
    for (std::size_t k = 0; k < 6; ++k) {
      sum[k] += other.sum[k];
      count[k] += other.count[k];
    }
  }
  /// Restricts a box to the rims.
  /// \returns half the distance between two opposite rims if both cannot be kept
  double restrict_to_rims(std::array<double, 3>& low, std::array<double, 3>& high) const {
    double apart = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t near = 2 * axis, far = near + 1;
      const auto at = [&](std::size_t side) { return sum[side] / count[side]; };
      if (count[near] == 0 && count[far] == 0) continue;
      double place = 0;
      if (count[near] != 0 && count[far] != 0) {
        place = (at(near) + at(far)) / 2;
        apart = std::max(apart, (at(far) - at(near)) / 2);
      } else {
        place = at(count[near] != 0 ? near : far);
      }
      low[axis] = high[axis] = std::clamp(place, low[axis], high[axis]);
    }
    return apart;
  }
};

/// Rims of the fine vertices at crossed edges in the outermost voxel planes.
std::vector<Rim> find_rims(const FineSurface& surface) {
  std::vector<Rim> rims(surface.keys.size());
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
        if (!ends || rims[vertex].count[side] != 0) continue;
        const CellPlace cell = unpack_place(surface.keys[vertex]);
        Qef qef;
        qef.add(surface.qefs[vertex], cell);
        const Vec3d low(cell[0], cell[1], cell[2]);
        const Vec3d place = qef.minimum(low, low + Vec3d(1, 1, 1)).place;
        const double along[3] = {place.x, place.y, place.z};
        rims[vertex].sum[side] = along[side / 2];
        rims[vertex].count[side] = 1;
      }
    }
  }
  return rims;
}

/// Sides of an edge's quad that cross the plane of constant u, and of constant v.
constexpr std::array<std::array<std::uint32_t, 2>, 2> kAcrossU = {{{0, 1}, {3, 2}}};
constexpr std::array<std::array<std::uint32_t, 2>, 2> kAcrossV = {{{1, 2}, {0, 3}}};

/// The line between the two cells at an edge in the open border.
struct BorderLine {
  std::uint32_t axis;  ///< Axis along which the cells are adjacent
  std::uint8_t level;  ///< the cells share a node from this level + 1 on
  /// The lower and the upper cell: indices among the edge's four cells
  std::array<std::uint32_t, 2> sides;
};

BorderLine line_at_border(const FineEdge& edge) {
  const auto both = [&](const std::array<std::uint32_t, 2>& sides) {
    return edge.vertices[sides[0]] != CellGrid::kNone && edge.vertices[sides[1]] != CellGrid::kNone;
  };
  for (const auto& sides : kAcrossU) {
    if (both(sides)) return {(edge.axis + 1U) % 3, edge.u_level, sides};
  }
  return {(edge.axis + 2U) % 3, edge.v_level, both(kAcrossV[0]) ? kAcrossV[0] : kAcrossV[1]};
}

/// Edges in the open border at which a line between two cells ends. Lines with both ends at one edge are skipped:
/// no polygon has them as a side, so they connect nothing.
std::vector<std::uint32_t> ending_edges(const FineSurface& surface) {
  struct Ending {
    std::uint64_t cells;
    std::uint32_t edge;
  };
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  };
  std::vector<Ending> endings;
  std::vector<std::uint8_t> ends(surface.keys.size(), 0);
  for (std::uint32_t i = 0; i < surface.edges.size(); ++i) {
    const FineEdge& edge = surface.edges[i];
    if (edge.is_quad() ||
        std::count(edge.vertices.begin(), edge.vertices.end(), CellGrid::kNone) != 2) {
      continue;
    }
    const BorderLine line = line_at_border(edge);
    const std::uint32_t a = edge.vertices[line.sides[0]], b = edge.vertices[line.sides[1]];
    endings.push_back({key(a, b), i});
    ends[a] = ends[b] = 1;
  }
  const auto before = [](const Ending& a, const Ending& b) { return a.cells < b.cells; };
  std::stable_sort(endings.begin(), endings.end(), before);
  std::vector<std::uint8_t> is_side(endings.size(), 0);
  for (const FineEdge& edge : surface.edges) {
    if (!edge.is_quad()) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = edge.vertices[k], b = edge.vertices[(k + 1) % 4];
      if (ends[a] == 0 || ends[b] == 0) continue;
      const auto [first, last] =
          std::equal_range(endings.begin(), endings.end(), Ending{key(a, b), 0}, before);
      for (auto at = first; at != last; ++at)
        is_side[static_cast<std::size_t>(at - endings.begin())] = 1;
    }
  }
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < endings.size(); ++i) {
    if (is_side[i] != 0) result.push_back(endings[i].edge);
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// For each of the four cells at an edge, which of the cell's edges along the axis it is: u + 2 v (shared/volume.h).
constexpr std::array<std::uint32_t, 4> kEdgeOfCell = {3, 2, 0, 1};

}  // namespace

const VertexTree::Cluster* VertexTree::find_earlier(const Earlier& earlier, std::uint32_t leaf,
                                                    std::uint32_t level) {
  const KeptVertices& kept = earlier.kept;
  if (leaf >= kept.before && leaf < kept.new_after) return nullptr;
  const VertexTree& tree = *earlier.tree;
  std::uint32_t node = leaf < kept.before ? leaf : leaf - kept.new_after + kept.old_after;
  do {
    node = tree.parent(node);
    if (node == kNone) return nullptr;
  } while (tree.cluster(node).level < level);
  const Cluster& cluster = tree.cluster(node);
  return cluster.level == level ? &cluster : nullptr;
}

VertexTree::VertexTree(const FineSurface& surface, const std::array<std::uint32_t, 3>& size,
                       bool open, const Earlier& earlier)
    : open_(open), leaves_(static_cast<std::uint32_t>(surface.keys.size())) {
  std::vector<Rim> rims;  // Rim sums by node
  if (open) rims = find_rims(surface);
  DisjointSets sets(leaves_);
  parent_.assign(leaves_, kNone);
  RawVector<std::uint32_t> node_of(leaves_);  // Node of each set, at the current level
  for (std::uint32_t i = 0; i < leaves_; ++i) node_of[i] = i;
  std::vector<Shape> shapes;  // Topological invariants by cluster
  const auto is_there = [](std::uint32_t vertex) { return vertex != CellGrid::kNone; };

  // Edges that can still connect sets, and edges that lie on nodes' edges; both ascending.
  const auto edge_count = static_cast<std::uint32_t>(surface.edges.size());
  std::vector<std::uint32_t> joining(edge_count), framing, ending;
  for (std::uint32_t i = 0; i < edge_count; ++i) joining[i] = i;
  framing = joining;
  if (open) {
    ending = ending_edges(surface);
    std::erase_if(framing, [&](std::uint32_t i) { return !surface.edges[i].is_quad(); });
    std::erase_if(joining, [&](std::uint32_t i) {
      return !surface.edges[i].is_quad() && !std::binary_search(ending.begin(), ending.end(), i);
    });
  }
  const std::uint32_t side = std::max({size[0], size[1], size[2]}) + 1;

  struct Touched {
    std::uint32_t set, node;
  };
  std::vector<Touched> touched;
  std::vector<std::uint32_t> lowest;  // By new cluster, its lowest fine vertex
  for (std::uint32_t level = 1; (side - 1) >> (level - 1) != 0; ++level) {
    ProgressGuard::poll();
    const std::uint32_t plane = level - 1;
    touched.clear();
    lowest.clear();
    const std::uint32_t first = count();
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
      if (!is_there(a) || !is_there(b)) return;
      a = sets.find(a);
      b = sets.find(b);
      if (a == b) return;
      // A set that was already united at this level has no node yet.
      for (const std::uint32_t set : {a, b}) {
        if (node_of[set] != kNone) touched.push_back({set, node_of[set]});
      }
      sets.join(a, b);
      node_of[sets.find(a)] = kNone;
    };
    for (const std::uint32_t index : joining) {
      const FineEdge& edge = surface.edges[index];
      if (edge.u_level == plane) {
        for (const auto& [a, b] : kAcrossU) join(edge.vertices[a], edge.vertices[b]);
      }
      if (edge.v_level == plane) {
        for (const auto& [a, b] : kAcrossV) join(edge.vertices[a], edge.vertices[b]);
      }
    }
    // Creates a cluster for each set that grew, in the order of the unions.
    for (const Touched& child : touched) {
      const std::uint32_t set = sets.find(child.set);
      if (node_of[set] == kNone) {
        node_of[set] = count();
        lowest.push_back(set);
        parent_.push_back(kNone);
        shapes.emplace_back();
      }
      parent_[child.node] = node_of[set];
      shapes[node_of[set] - leaves_].euler2 +=
          child.node < leaves_ ? 2 : shapes[child.node - leaves_].euler2;
    }
    const auto shape_at = [&](std::uint32_t vertex) -> Shape* {
      const std::uint32_t node = node_of[sets.find(vertex)];
      return node < first ? nullptr : &shapes[node - leaves_];
    };
    // Euler characteristic V - E + F: each child has counted its own crossings and lines; a crossing that two
    // children share, and a line on the face between them, must be counted once. A line has a crossing at both
    // ends, each of which contributes half.
    for (const std::uint32_t index : joining) {
      const FineEdge& edge = surface.edges[index];
      const bool u = edge.u_level == plane, v = edge.v_level == plane;
      if (!u && !v) continue;
      const auto& at = edge.vertices;
      const auto lines = [&](const auto& sides, bool apart) {
        for (const auto& [a, b] : sides) {
          if (!is_there(at[a]) || !is_there(at[b])) continue;
          // If the other pair of cells lies in another node, or is removed, these two share the crossing.
          shape_at(at[a])->euler2 += apart ? 1 - 2 : 1;
        }
      };
      if (u) lines(kAcrossU, edge.v_level > plane);
      if (v) lines(kAcrossV, edge.u_level > plane);
      if (u && v) {
        // All four lie in one node: each has counted the crossing, which must be counted once.
        int present = 0;
        std::uint32_t any_cell = 0;
        for (const std::uint32_t vertex : at) {
          if (is_there(vertex)) {
            ++present;
            any_cell = vertex;
          }
        }
        if (present > 1) shape_at(any_cell)->euler2 -= 2 * (present - 1);
      } else if ((u && edge.v_level < plane) || (v && edge.u_level < plane)) {
        // Two pairs that were counted separately.
        const auto& [near, far] = u ? kAcrossU : kAcrossV;
        const bool one = is_there(at[near[0]]) || is_there(at[far[0]]);
        const bool other = is_there(at[near[1]]) || is_there(at[far[1]]);
        if (one && other) shape_at(is_there(at[near[0]]) ? at[near[0]] : at[far[0]])->euler2 -= 2;
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
        Shape* shape = shape_at(edge.vertices[k]);
        if (shape == nullptr) continue;
        const auto bit = static_cast<std::uint16_t>(1U << (4 * edge.axis + kEdgeOfCell[k]));
        shape->repeatedly = static_cast<std::uint16_t>(shape->repeatedly | (shape->once & bit));
        shape->once = static_cast<std::uint16_t>(shape->once | bit);
      }
    }
    std::erase_if(ending, [&](std::uint32_t index) {
      return line_at_border(surface.edges[index]).level < level;
    });
    for (const std::uint32_t index : ending) {
      const FineEdge& edge = surface.edges[index];
      const BorderLine line = line_at_border(edge);
      for (const std::uint32_t upper : {0U, 1U}) {
        Shape* shape = shape_at(edge.vertices[line.sides[upper]]);
        if (shape == nullptr) continue;
        std::uint8_t& ends = shape->ends[2 * line.axis + 1 - upper];
        ends = static_cast<std::uint8_t>(std::min(ends + 1, 3));
      }
    }
    std::erase_if(joining, [&](std::uint32_t index) {
      const FineEdge& edge = surface.edges[index];
      const auto later = [&](std::uint32_t at) { return at != 31 && at > plane; };
      return !later(edge.u_level) && !later(edge.v_level);
    });

    // Sorts the children by cluster, stably, so that sums do not depend on the number of threads.
    const std::uint32_t fresh = count() - first;
    std::vector<std::uint32_t> begins(fresh + 1), children(touched.size());
    for (const Touched& child : touched) ++begins[parent_[child.node] - first + 1];
    for (std::uint32_t i = 0; i < fresh; ++i) begins[i + 1] += begins[i];
    {
      std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
      for (const Touched& child : touched)
        children[next[parent_[child.node] - first]++] = child.node;
    }
    clusters_.resize(count() - leaves_);
    if (open) rims.resize(count());
    parallel_for(fresh, 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Cluster& cluster = clusters_[first - leaves_ + i];
        cluster = {};
        std::uint32_t leaf = children[begins[i]];
        const auto own_plane = leaf < leaves_ ? unpack_place(surface.keys[leaf])[2]
                                              : clusters_[leaf - leaves_].node[2];
        const std::uint32_t low_plane = own_plane >> level << level;
        const Planes& changed = earlier.kept.planes;
        const bool unchanged =
            low_plane >= changed.last || low_plane + (1U << level) <= changed.first;
        const Cluster* old = earlier.tree != nullptr && unchanged
                                 ? find_earlier(earlier, lowest[i], level)
                                 : nullptr;
        for (std::uint32_t c = begins[i]; c < begins[i + 1]; ++c) {
          const std::uint32_t child = children[c];
          if (open) rims[first + i].add(rims[child]);
          if (old != nullptr) continue;
          if (child < leaves_) {
            cluster.qef.add(surface.qefs[child], unpack_place(surface.keys[child]));
          } else {
            const Cluster& child_cluster = clusters_[child - leaves_];
            cluster.qef.add(child_cluster.qef);
            cluster.error = std::max(cluster.error, child_cluster.error);
          }
        }
        // The node's box, from any cell within it.
        CellPlace node;
        if (leaf < leaves_) {
          node = unpack_place(surface.keys[leaf]);
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
          cluster.is_one_sheet = is_one_sheet(shapes[first - leaves_ + i]);
          continue;
        }
        cluster.node = node;
        cluster.level = static_cast<std::uint8_t>(level);
        const double apart = open ? rims[first + i].restrict_to_rims(low, high) : 0;
        const Qef::Minimum minimum =
            cluster.qef.minimum(Vec3d(low[0], low[1], low[2]), Vec3d(high[0], high[1], high[2]));
        cluster.place = minimum.place;
        cluster.error =
            std::max({cluster.error, static_cast<float>(minimum.error), static_cast<float>(apart)});
        cluster.is_one_sheet = is_one_sheet(shapes[first - leaves_ + i]);
      }
    });
  }
  const auto common = [&](std::uint32_t a, std::uint32_t b) {
    while (a != b) {
      std::uint32_t& lower = a < b ? a : b;
      if (lower == kNone) return kNone;
      lower = parent_[lower];
    }
    return a;
  };
  for (const FineFork& fork : surface.forks) {
    std::uint32_t node = common(fork.branches[0], fork.branches[1]);
    const std::uint32_t end = node == kNone ? kNone : common(node, fork.stem);
    for (; node != end && node != kNone; node = parent_[node]) {
      clusters_[node - leaves_].is_one_sheet = false;
    }
  }
}

}  // namespace kiln

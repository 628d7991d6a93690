// A triangle mesh with a list of triangles for each vertex, for edge collapses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "base/vectors.h"
#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

inline constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

/// A triangle mesh whose vertices can be merged. Visiting a vertex takes one step per triangle of it; merging takes one
/// step per triangle of the removed vertex. `visits` counts these steps, so that tests can measure how the cost grows
/// without a clock.
class CollapseMesh {
 public:
  struct Neighbour {
    std::uint32_t vertex, triangles;
  };
  /// A vertex with more triangles than this is a hub. No collapse may visit all triangles of a hub.
  static constexpr std::uint32_t kMaxValence = 256;

  /// Triangles must have three different vertices.
  /// \param labels  label of each triangle; empty if the mesh has no labels
  CollapseMesh(std::span<const Vec3d> positions, std::span<const Triangle> given,
               std::span<const std::uint32_t> labels = {});

  bool contains(std::uint32_t triangle, std::uint32_t vertex) const {
    const Triangle& t = triangles[triangle];
    return t[0] == vertex || t[1] == vertex || t[2] == vertex;
  }
  bool is_hub(std::uint32_t vertex) const { return valence[vertex] > kMaxValence; }
  /// Calls `body` for each triangle at an edge, in the order of the triangle list of the edge's vertex that has fewer
  /// triangles.
  template <class Body>
  void each_triangle_on_edge(std::uint32_t a, std::uint32_t b, const Body& body) const {
    if (valence[b] < valence[a]) std::swap(a, b);
    for (const std::uint32_t t : around(a)) {
      if (alive[t] != 0 && contains(t, b)) body(t);
    }
  }
  /// True if `test` holds for all triangles on an edge. Stops at the first for which it does not.
  template <class Test>
  bool all_triangles_on_edge(std::uint32_t a, std::uint32_t b, const Test& test) const {
    if (valence[b] < valence[a]) std::swap(a, b);
    for (const std::uint32_t t : around(a)) {
      if (alive[t] != 0 && contains(t, b) && !test(t)) return false;
    }
    return true;
  }
  template <class Body>
  void each_triangle_around(std::uint32_t vertex, const Body& body) const {
    for (const std::uint32_t t : around(vertex)) {
      if (alive[t] != 0) body(t);
    }
  }
  /// The triangle list of a vertex, which may contain removed (dead) triangles.
  std::span<const std::uint32_t> around(std::uint32_t vertex) const {
    const List& list = triangle_lists_[vertex];
    return {triangle_pool_.data() + list.first, list.size};
  }
  /// Prefetches the data of a vertex into the processor's cache. There are four functions, to be called in this order,
  /// because each needs the data that the one before has loaded: the vertex's record, its list, the triangles in the
  /// list, and their corners.
  void prefetch_vertex(std::uint32_t vertex) const {
    prefetch(&triangle_lists_[vertex]);
    prefetch(&points[vertex]);
  }
  void prefetch_list(std::uint32_t vertex) const { prefetch(around(vertex).data()); }
  void prefetch_triangles(std::uint32_t vertex) const {
    if (is_hub(vertex)) return;
    for (const std::uint32_t t : around(vertex)) {
      prefetch(&triangles[t]);
      prefetch(&alive[t]);
    }
  }
  void prefetch_corners(std::uint32_t vertex) const {
    if (is_hub(vertex)) return;
    for (const std::uint32_t t : around(vertex)) {
      for (const std::uint32_t v : triangles[t]) prefetch(&points[v]);
    }
  }
  /// Collects the neighbours of a vertex in ascending order, each with the number of triangles at the edge to it.
  void gather(std::uint32_t vertex, std::vector<Neighbour>& neighbours);
  /// Faster variant of gather(): the neighbours are in no particular order.
  void gather_unordered(std::uint32_t vertex, std::vector<Neighbour>& neighbours);
  /// Finds the vertices that are in both lists of neighbours.
  void find_common_neighbours(const std::vector<Neighbour>& one,
                              const std::vector<Neighbour>& other,
                              std::vector<std::uint32_t>& common);
  /// All edges, each once, as (lower vertex << 32 | higher vertex), in ascending order.
  std::vector<std::uint64_t> edges() const;
  /// Replaces vertex `gone` by `kept` in all triangles. Triangles that contain both are removed.
  void merge(std::uint32_t kept, std::uint32_t gone);
  /// Sets which triangles are two-sided. face_count_with_back_faces() counts these twice.
  void set_two_sided(std::vector<std::uint8_t> of_triangles);
  /// Number of triangles; each two-sided triangle counts twice.
  std::size_t face_count_with_back_faces() const { return faces + back_face_count; }
  /// Removes dead triangles and unused vertices from the arrays. The remaining ones keep their order.
  /// \returns the new index of each vertex; kNoVertex for removed ones
  std::vector<std::uint32_t> compact();
  /// The index that a triangle (or a vertex, below) had in the mesh that the constructor received.
  std::uint32_t given_triangle(std::uint32_t triangle) const {
    return given_triangles_.empty() ? triangle : given_triangles_[triangle];
  }
  std::uint32_t given_vertex(std::uint32_t vertex) const {
    return given_vertices_.empty() ? vertex : given_vertices_[vertex];
  }
  /// Returns the remaining mesh. It only contains the vertices that are still used, in their original order.
  /// \param sources  [out] for each remaining triangle, its index in the mesh that the constructor received
  void extract(std::vector<Vec3d>& positions, std::vector<Triangle>& left,
               std::vector<std::uint32_t>& sources) const;

  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> labels;  ///< Label of each triangle; empty if there are no labels
  std::vector<std::uint8_t> alive;    ///< 1 for each triangle that still exists.
  std::vector<std::uint32_t> valence;
  std::vector<std::uint8_t> two_sided;  ///< 1 for each two-sided triangle; empty if there are none
  std::size_t faces = 0, back_face_count = 0;
  std::uint64_t visits = 0;

 private:
  /// The range of a vertex's triangles in triangle_pool_.
  struct List {
    std::uint32_t first = 0, size = 0, capacity = 0;
  };
  void remove_dead(std::uint32_t vertex);
  void make_room(std::uint32_t vertex, std::uint32_t more);

  std::vector<List> triangle_lists_;
  std::vector<std::uint32_t> triangle_pool_;
  /// Scratch memory of gather(): a count for each vertex; all 0 between calls
  std::vector<std::uint32_t> triangle_counts_;
  /// Indices in the mesh that the constructor received; empty until compact() renumbers
  std::vector<std::uint32_t> given_triangles_, given_vertices_;
};

/// Moves per-vertex values to the new indices of their vertices, which keep their order.
template <class Value>
void renumber_values(std::vector<Value>& values, const std::vector<std::uint32_t>& number) {
  if (values.empty()) return;
  std::size_t count = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] != kNoVertex) values[count++] = values[v];
  }
  values.resize(count);
}

}  // namespace kiln

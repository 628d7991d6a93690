// The mesh that edge collapses work on: which triangles lie around which vertex.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

inline constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

/// A triangle mesh whose vertices can be merged. Looking at a vertex costs as many steps as it has
/// triangles; merging costs as many as the one that goes has. `visits` counts these steps, so that
/// tests can tell how cost grows without a clock.
class CollapseMesh {
 public:
  struct Neighbour {
    std::uint32_t vertex, triangles;
  };
  /// Vertices of more triangles are hubs: no step may look at all of these.
  static constexpr std::uint32_t kMostAround = 256;

  /// Triangles must have three different vertices.
  /// \param labels  by triangle; empty: none
  CollapseMesh(std::span<const Vec3d> positions, std::span<const Triangle> given,
               std::span<const std::uint32_t> labels = {});

  bool contains(std::uint32_t triangle, std::uint32_t vertex) const {
    const Triangle& t = triangles[triangle];
    return t[0] == vertex || t[1] == vertex || t[2] == vertex;
  }
  bool is_hub(std::uint32_t vertex) const { return valence[vertex] > kMostAround; }
  /// Triangles of an edge, in order of the list of the end with fewer triangles.
  template <class Body>
  void each_on_edge(std::uint32_t a, std::uint32_t b, const Body& body) const {
    if (valence[b] < valence[a]) std::swap(a, b);
    for (const std::uint32_t t : around[a]) {
      if (alive[t] != 0 && contains(t, b)) body(t);
    }
  }
  template <class Body>
  void each_around(std::uint32_t vertex, const Body& body) const {
    for (const std::uint32_t t : around[vertex]) {
      if (alive[t] != 0) body(t);
    }
  }
  /// Neighbours with the number of triangles on the edge to each, by vertex.
  void gather(std::uint32_t vertex, std::vector<Neighbour>& neighbours);
  /// All edges, each once, as lower vertex << 32 | higher vertex, in order.
  std::vector<std::uint64_t> edges() const;
  /// `gone` becomes `kept`; triangles with both vanish.
  void merge(std::uint32_t kept, std::uint32_t gone);
  /// From now on some triangles count for two: those of two-sided sheets.
  void count_sides(std::vector<std::uint8_t> of_triangles);
  /// Triangles with those on backs.
  std::size_t all_faces() const { return faces + backs; }
  /// What is left, with only the vertices in use, in the order they came.
  /// \param sources  the index that each triangle had
  void extract(std::vector<Vec3d>& positions, std::vector<Triangle>& left,
               std::vector<std::uint32_t>& sources) const;

  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> labels;  ///< Per triangle; empty: none.
  std::vector<std::uint8_t> alive;    ///< Per triangle.
  std::vector<std::uint32_t> valence;
  std::vector<std::vector<std::uint32_t>> around;  ///< Triangles of a vertex, some no longer alive.
  std::vector<std::uint8_t> two_sided;  ///< Per triangle, whether it has a back; empty: none has.
  std::size_t faces = 0, backs = 0;
  std::uint64_t visits = 0;

 private:
  void tidy(std::uint32_t vertex);
};

}  // namespace kiln

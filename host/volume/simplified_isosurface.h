// The low poly's polygons, extracted from the vertex tree.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volume/vertex_tree.h"

namespace kiln {

struct SimplifiedIsosurface {
  struct Polygon {
    /// Counter-clockwise as seen from outside, with the diagonal from corner 0 to 2; a triangle's last one is kNone.
    std::array<std::uint32_t, 4> corners;
    bool is_quad() const { return corners[3] != VertexTree::kNone; }
  };
  std::vector<Vec3> positions;  ///< World units, relative to the volume's origin
  std::vector<Vec3> normals;    ///< Mean normals of the fine vertices
  std::vector<Polygon> polygons;
  /// Fine vertices that vertex v represents: leaves[leaf_begins[v]] to leaves[leaf_begins[v + 1] - 1].
  std::vector<std::uint32_t> leaf_begins;
  RawVector<std::uint32_t> leaves;

  /// Mean normal of the fine vertices that a vertex represents.
  Vec3 mean_normal(const FineSurface& surface, std::uint32_t vertex) const;

  std::uint64_t faces = 0;  ///< Number of triangles
  double error = 0;         ///< Largest error of a cluster, in cells
  /// Number of clusters whose surface is not a single sheet: merging them changes the topology
  std::uint64_t changed_topology = 0;
  std::uint64_t parts = 0;          ///< Number of connected parts of the fine surface
  std::uint64_t dropped_parts = 0;  ///< Number of parts removed because they are small
  /// Topology of the fine surface without small parts, and of the low poly; computed only if the topology is kept and
  /// the volume's border is open.
  struct Pieces {
    std::uint64_t parts = 0;         ///< Number of parts, connected over polygons
    std::uint64_t border_loops = 0;  ///< Number of loops of border edges
    bool operator==(const Pieces&) const = default;
  };
  Pieces fine_pieces, pieces;
  bool is_goal_reached = true;    ///< False if more faces remain than requested
  double error_limit = 0;         ///< Error limit in effect, in cells; 0 for a goal of faces
  std::uint64_t aimed_faces = 0;  ///< Goal of faces, requested or from a share of the fine surface
};

struct IsosurfaceOptions {
  std::uint32_t faces = 0;
  double error = 0;  ///< Largest error in cells, if `faces` is 0
  /// Maximum share of the fine triangles that remains; the error limit is raised until it is met
  double share = 1;
  bool keep_topology = true;
  double min_part =
      0;  ///< Parts with fewer fine vertices than this share of the largest part's are removed
};

/// Number of parts of the fine surface with fewer vertices than a share of the largest part's.
std::uint64_t count_small_parts(const VertexTree& tree, double share);

SimplifiedIsosurface simplify_isosurface(const FineSurface& surface, const VertexTree& tree,
                                         const Volume& volume, const IsosurfaceOptions& options);

}  // namespace kiln

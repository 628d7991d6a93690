// The low poly's polygons, extracted from the vertex tree.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volume/vertex_tree.h"

namespace kiln {

struct SimplifiedIsosurface {
  struct Polygon {
    /// Corners in counter-clockwise order as seen from outside. A quad is split along the diagonal
    /// from corner 0 to corner 2; the last corner of a triangle is kNone.
    std::array<std::uint32_t, 4> corners;
    bool is_quad() const { return corners[3] != VertexTree::kNone; }
  };
  std::vector<Vec3> positions;  ///< World units, relative to the volume's origin
  std::vector<Vec3> normals;    ///< Mean normals of the fine vertices that each vertex represents
  std::vector<Polygon> polygons;
  /// Fine vertices that vertex v represents: leaves[leaf_begins[v]] to leaves[leaf_begins[v + 1] - 1].
  std::vector<std::uint32_t> leaf_begins;
  RawVector<std::uint32_t> leaves;

  /// Mean normal of the fine vertices that a vertex represents.
  Vec3 mean_normal(const FineSurface& surface, std::uint32_t vertex) const;

  std::uint64_t faces = 0;  ///< Number of triangles
  double error = 0;         ///< Largest error of a cluster, in cells
  /// Number of clusters that were replaced by one vertex although their surface is not a single
  /// sheet, which changed the topology
  std::uint64_t changed_topology = 0;
  std::uint64_t parts = 0;          ///< Number of connected parts of the fine surface
  std::uint64_t dropped_parts = 0;  ///< Number of parts removed because they are small
  /// Numbers of parts and border loops, to compare the fine surface without small parts with the
  /// low poly; computed only if the topology is kept and the volume's border is open.
  struct Pieces {
    std::uint64_t parts = 0;         ///< Number of parts that are connected by polygons
    std::uint64_t border_loops = 0;  ///< Number of loops of border edges
    bool operator==(const Pieces&) const = default;
  };
  Pieces fine_pieces, pieces;
  bool is_goal_reached = true;  ///< False if more faces remain than requested
  /// Error limit that was used, in cells; 0 if a number of faces was the goal
  double error_limit = 0;
  /// Number of faces that was the goal: requested, or computed from the share of the fine surface
  std::uint64_t aimed_faces = 0;
};

struct IsosurfaceOptions {
  std::uint32_t faces = 0;
  double error = 0;  ///< Maximum error in cells; used if `faces` is 0
  /// Maximum number of triangles, as a share of the fine surface's; the error limit is raised until
  /// it is met
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

// The low poly's polygons, chosen from the tree of vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/contour.h"
#include "volume/vertex_tree.h"

namespace kiln {

struct SimplifiedIsosurface {
  struct Polygon {
    std::array<std::uint32_t, 4>
        corners;  ///< Counter-clockwise from outside, from corner 0 to 2 the
                  ///< diagonal; a triangle's last is kNone
    bool is_quad() const { return corners[3] != VertexTree::kNone; }
  };
  std::vector<Vec3> positions;  ///< World, relative to the volume's origin
  std::vector<Vec3> normals;    ///< Mean of the fine vertices'
  std::vector<Polygon> polygons;
  /// Fine vertices that each vertex stands for: leaves[leaf_begins[v]] to leaves[leaf_begins[v + 1] - 1].
  std::vector<std::uint32_t> leaf_begins;
  RawVector<std::uint32_t> leaves;

  /// Mean normal of the fine vertices that a vertex stands for.
  Vec3 mean_normal(const FineSurface& surface, std::uint32_t vertex) const;

  std::uint64_t faces = 0;             ///< Triangles
  double error = 0;                    ///< The greatest that a cluster has, cells
  std::uint64_t changed_topology = 0;  ///< Clusters that are not one sheet
  std::uint64_t parts = 0;             ///< Connected parts of the fine surface
  std::uint64_t dropped_parts = 0;     ///< ... left out for being small
  /// Counted if the topology is to be kept and the volume's border is open: of the fine surface without small
  /// parts, and of the low poly.
  struct Pieces {
    std::uint64_t parts = 0;  ///< Joined by polygons
    std::uint64_t loops = 0;  ///< Loops of border edges
    bool operator==(const Pieces&) const = default;
  };
  Pieces fine_pieces, pieces;
  bool reached = true;            ///< No more faces than asked for
  double error_limit = 0;         ///< Limit that decided, cells; 0 where faces were asked for
  std::uint64_t aimed_faces = 0;  ///< Asked for, or the share of the fine surface's
};

struct IsosurfaceOptions {
  std::uint32_t faces = 0;
  double error = 0;  ///< Greatest, where faces is 0
  double share = 1;  ///< ... but a greater one where this share of the fine triangles takes it
  bool keep_topology = true;
  double min_part =
      0;  ///< Leave out parts with fewer fine vertices than this share of the largest's
};

/// Parts of the fine surface with fewer vertices than a share of the largest one's.
std::uint64_t count_small_parts(const VertexTree& tree, double share);

SimplifiedIsosurface simplify_isosurface(const FineSurface& surface, const VertexTree& tree,
                                         const Volume& volume, const IsosurfaceOptions& options);

}  // namespace kiln

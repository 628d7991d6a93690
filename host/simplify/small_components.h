// Components of a mesh that are too small to be seen.
#pragma once

#include <cstdint>
#include <vector>

#include "base/disjoint_sets.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Sizes of a mesh's components (connected over shared vertices).
class ComponentSizes {
 public:
  explicit ComponentSizes(const Work& work);

  /// True if the mesh has a single component.
  bool is_whole() const { return diagonal_.size() < 2; }
  /// Number of components whose bounding box has a diagonal below `size`; the largest never counts.
  std::uint64_t count_below(double size) const;
  /// For each component, 1 if count_below() counts it.
  std::vector<std::uint8_t> smaller_than(double size) const;
  /// By component, 1 for the smallest ones, which must be removed if `faces` are too few: each remaining component
  /// needs `least` triangles, or all that it has if these are fewer.
  std::vector<std::uint8_t> surplus_components(std::size_t faces, std::uint32_t least) const;
  /// The mesh without some components, vertices renumbered.
  /// \param dropped  by component
  Work without_components(const Work& work, const std::vector<std::uint8_t>& dropped) const;
  /// Triangles of the component with the largest area.
  std::vector<Triangle> body(const Work& work) const;

 private:
  bool is_below(std::uint32_t part, double size) const;

  std::vector<std::uint32_t> faces_;                  ///< Number of triangles of each component
  std::vector<std::uint32_t> component_of_triangle_;  ///< Component of each triangle.
  std::vector<double>
      diagonal_;  ///< Diagonal of each component's box; infinite if there is only one.
  std::uint32_t largest_component_ = 0;
};

/// Unites the vertices of each component.
/// \param parts  [in, out] all vertices
void join_parts(const std::vector<Triangle>& triangles, DisjointSets& parts);

/// Restores the triangles of dense components without any remaining triangle.
/// \param triangles  [in, out] remaining triangles
/// \param origin     dense vertex of each remaining vertex
/// \param parts      dense vertices, united by component
void restore_lost_parts(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                        const std::vector<std::uint32_t>& origin, DisjointSets& parts);

/// Edge length of `faces` equilateral triangles that have the mesh's total area.
double mean_edge(const Work& work, std::size_t faces);

}  // namespace kiln

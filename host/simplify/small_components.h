// Finds components of a mesh that are too small to be seen.
#pragma once

#include <cstdint>
#include <vector>

#include "base/disjoint_sets.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// The sizes of a mesh's components (connected over shared vertices).
class ComponentSizes {
 public:
  explicit ComponentSizes(const Work& work);

  /// True if the mesh has a single component.
  bool is_single_component() const { return diagonal_.size() < 2; }
  /// Number of components whose bounding box has a diagonal below `size`. The component with the largest box never
  /// counts.
  std::uint64_t count_below(double size) const;
  /// For each component, 1 if count_below() counts it.
  std::vector<std::uint8_t> components_below(double size) const;
  /// For each component, 1 if it must be removed because `faces` are too few for all. The smallest components are
  /// removed first. Each component that remains needs `least` triangles, or all of its triangles if it has fewer.
  std::vector<std::uint8_t> surplus_components(std::size_t faces, std::uint32_t least) const;
  /// The mesh without some components, and with its vertices renumbered.
  /// \param dropped  for each component, 1 if it is removed
  Work without_components(const Work& work, const std::vector<std::uint8_t>& dropped) const;
  /// The triangles of the component with the largest area.
  std::vector<Triangle> largest_component(const Work& work) const;

 private:
  bool is_below(std::uint32_t part, double size) const;

  std::vector<std::uint32_t> faces_;                  ///< Number of triangles of each component
  std::vector<std::uint32_t> component_of_triangle_;  ///< Component of each triangle
  std::vector<double>
      diagonal_;  ///< Diagonal of each component's bounding box; infinite if there is one component
  std::uint32_t largest_component_ = 0;
};

/// Unites the vertices of each component.
/// \param parts  [in, out] one element per vertex
void join_parts(const std::vector<Triangle>& triangles, DisjointSets& parts);

/// Restores the triangles of each dense component of which no triangle remains.
/// \param triangles  [in, out] remaining triangles
/// \param origin     for each remaining vertex, the dense vertex
/// \param parts      the dense vertices, united by component
void restore_lost_parts(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                        const std::vector<std::uint32_t>& origin, DisjointSets& parts);

/// Edge length of equilateral triangles, of which `faces` have the total area of the mesh.
double mean_edge(const Work& work, std::size_t faces);

}  // namespace kiln

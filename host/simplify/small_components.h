// Parts of a mesh that are too small to be seen.
#pragma once

#include <cstdint>
#include <vector>

#include "base/disjoint_sets.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// The parts of a mesh, by shared vertices, and how large each is.
class ComponentSizes {
 public:
  explicit ComponentSizes(const Work& work);

  /// True if it is one part alone, of which nothing can be left out.
  bool is_whole() const { return diagonal_.size() < 2; }
  /// Parts whose box has a diagonal below `size`; never the largest.
  std::uint64_t count_below(double size) const;
  /// By part, 1 for these.
  std::vector<std::uint8_t> below(double size) const;
  /// By part, 1 for the smallest, which go first where so many faces are too few for `least` a part, or all that it has.
  std::vector<std::uint8_t> surplus(std::size_t faces, std::uint32_t least) const;
  /// The mesh without some parts, its vertices renumbered. \param dropped  by part
  Work without(const Work& work, const std::vector<std::uint8_t>& dropped) const;
  /// Triangles of the part of the largest area.
  std::vector<Triangle> body(const Work& work) const;

 private:
  bool is_below(std::uint32_t part, double size) const;

  std::vector<std::uint32_t> faces_;  ///< Triangles of each component
  std::vector<std::uint32_t> part_;   ///< Component of each triangle.
  std::vector<double>
      diagonal_;  ///< Diagonal of each component's box; infinite if there is only one.
  std::uint32_t largest_ = 0;
};

/// Joins the vertices of each part.
/// \param parts  [in, out] of all vertices
void join_parts(const std::vector<Triangle>& triangles, DisjointSets& parts);

/// Gives back the triangles of parts of which none is left.
/// \param triangles  [in, out] what is left
/// \param origin     of each of its vertices, the dense one
/// \param parts      of the dense vertices, joined
void restore_lost_parts(std::vector<Triangle>& triangles, const std::vector<Triangle>& dense,
                        const std::vector<std::uint32_t>& origin, DisjointSets& parts);

/// The mean edge of a mesh with this area and as many equilateral triangles.
double mean_edge(const Work& work, std::size_t faces);

}  // namespace kiln

// Connectivity of triangle meshes: halfedges that occur more than once, fans, components.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vertex_lists.h"

namespace kiln {

/// True if two triangles traverse the same edge in the same direction, which never happens on an oriented manifold.
bool has_repeated_sides(std::span<const Triangle> triangles);
/// Variant of has_repeated_sides() for side lists that exist already.
bool has_repeated_sides(const SideLists& sides);

/// Removes each pair of triangles that have the same corners in opposite order. Closed meshes stay closed.
void remove_back_to_back(std::vector<Triangle>& triangles);

/// Splits vertices so that each has a single fan of triangles. Sides of opposite directions along an edge are joined in
/// pairs; a side without a partner becomes a border. Closed meshes stay closed. The result is an oriented manifold,
/// except in rare cases in which a fan meets itself in every pairing.
/// \param vertices  number of vertices; new vertices get indices from this number on
/// \returns for each new vertex, the vertex it was split from
std::vector<std::uint32_t> split_into_fans(std::span<Triangle> triangles, std::size_t vertices);

/// Number of components; triangles of a component are connected over shared vertices.
std::uint64_t count_components(std::span<const Triangle> triangles, std::size_t vertices);

}  // namespace kiln

// Connectivity of triangle meshes: repeated sides, fans, components.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vertex_lists.h"

namespace kiln {

/// True if two triangles traverse an edge in the same direction, which never happens on an oriented manifold.
bool has_repeated_sides(std::span<const Triangle> triangles);
/// has_repeated_sides() for existing side lists.
bool has_repeated_sides(const SideLists& sides);

/// Removes pairs of triangles with the same corners in opposite order. Closed meshes remain closed.
void remove_back_to_back(std::vector<Triangle>& triangles);

/// Splits vertices so that each has a single fan of triangles: sides of opposite directions along an edge are joined
/// in pairs; unpaired sides are cut. Closed meshes remain closed. The result is an oriented manifold, except in rare
/// cases in which a fan meets itself in every pairing.
/// \param vertices  number of vertices; new vertices get indices from this number on
/// \returns for each new vertex, its original vertex
std::vector<std::uint32_t> split_into_fans(std::span<Triangle> triangles, std::size_t vertices);

/// Number of components (connected over shared vertices).
std::uint64_t count_components(std::span<const Triangle> triangles, std::size_t vertices);

}  // namespace kiln

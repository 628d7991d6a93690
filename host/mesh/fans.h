// Connectivity of triangle meshes: repeated sides, fans, connected parts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vertex_lists.h"

namespace kiln {

/// True if two triangles run along an edge in the same sense: never so on an oriented manifold.
bool has_repeated_sides(std::span<const Triangle> triangles);
/// The same where the sides are at hand.
bool has_repeated_sides(const SideLists& sides);

/// Removes pairs of triangles with the same corners and opposite senses. Closed meshes stay closed.
void remove_back_to_back(std::vector<Triangle>& triangles);

/// Gives each fan of triangles around a vertex a vertex of its own: sides of opposite sense along an
/// edge are joined in pairs, and whatever is not joined that way is cut. Closed meshes stay closed. The
/// result is an oriented manifold but in rare cases where a fan meets itself whatever is joined.
/// \param vertices  how many there are; new ones are numbered from there
/// \returns for each new vertex the one that it is a copy of
std::vector<std::uint32_t> split_into_fans(std::span<Triangle> triangles, std::size_t vertices);

/// Number of parts that share no vertex.
std::uint64_t count_components(std::span<const Triangle> triangles, std::size_t vertices);

}  // namespace kiln

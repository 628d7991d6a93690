#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Ways to split a low poly into texture sets, each of which has the unit square of UV space for
/// itself.
enum class SetsBy {
  none,      ///< One set for all triangles
  material,  ///< One set per material (Mesh::materials)
  object,    ///< One set per object (Mesh::objects)
  udim,      ///< One set per tile of UV space: 1001 + u + 10 v, u from 0 to 9, v from 0 to 899
};

/// Triangles of a low poly that share one set of maps.
struct TextureSet {
  /// Name of the material or object; for tiles the number, "1001" and on; empty for a single set of
  /// all triangles
  std::string name = {};
  /// Number of the tile ("1001" and on) if a material or object is split into several tiles; else
  /// empty
  std::string tile = {};
  std::uint32_t tile_u = 0;  ///< Column of the set's UDIM tile, which is moved to the unit square
  std::uint32_t tile_v = 0;  ///< Row of the set's UDIM tile
  std::vector<std::uint32_t> members =
      {};                       ///< Indices into Mesh::triangles of the set's triangles, ascending
  std::uint64_t triangles = 0;  ///< Number of the set's triangles that have an area in UV space
};

/// Splits a low poly into its texture sets, in the order of material_names, object_names or tiles. Sets without a
/// triangle that has an area in UV space are dropped; if none is left, the result is one set of all triangles. A
/// material or object whose charts lie in several tiles, and would overlap in one tile, gets a set per tile; one
/// that lies in a single tile is moved from that tile to the unit square.
/// \throws Error(input) for an invalid mesh, see validate(); for a mesh without the requested materials or
///         objects; for UDIM, if a triangle's centroid lies in no tile
std::vector<TextureSet> find_texture_sets(const Mesh& low, SetsBy by);

/// Guesses the texture sets of a low poly by its UVs: `material` if UVs of several materials overlap on over 1% of
/// the unit square; else `udim` if charts of several tiles would overlap in one and are not UV copies; else `none`.
SetsBy choose_texture_sets(const Mesh& low);

/// Tangents of a low poly for a bake in tangent space: the mesh's own if it has any, else MikkTSpace's. They have
/// unit length and are orthogonal to the normals. Three per triangle, as Mesh::tangents.
/// \throws Error(input) for an invalid mesh, see validate(), or without UVs
std::vector<Tangent> tangents_of(const Mesh& low);

/// The low poly for a bake of one set. Triangles of other sets have no UVs (NaN), so they get no texels, but
/// still affect averaged normals, ray directions and occlusion. Its tangents are those of the whole mesh: assign
/// tangents_of() to Mesh::tangents first, so that they are computed once for all sets. MatchMethod::uv finds
/// points at the moved UVs, so the high poly's UVs must be moved in the same way.
/// \throws Error(input) for a mesh without UVs
Mesh low_of_set(const Mesh& low, const TextureSet& set);

/// Changes `part` to the UVs of another set, without another copy of the mesh. \param part  a copy of the low
/// poly with the tangents of tangents_of(), or a result of low_of_set()
void lay_out_set(const Mesh& low, const TextureSet& set, Mesh& part);

}  // namespace kiln

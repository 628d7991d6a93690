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
  /// Name of the material or object, "1001" and on for tiles; empty for a single set of all
  std::string name = {};
  /// "1001" and on if a material or object has several tiles; else empty
  std::string tile = {};
  std::uint32_t tile_u = 0;  ///< Column of its tile, which is moved to the unit square
  std::uint32_t tile_v = 0;  ///< Row of its tile
  std::vector<std::uint32_t> members =
      {};                       ///< Indices of its triangles in Mesh::triangles, ascending
  std::uint64_t triangles = 0;  ///< Number of its triangles with an area in UV space
};

/// Splits a low poly into its texture sets, in the order of material_names, object_names or tiles. Sets without a
/// triangle that has an area in UV space are dropped; if none is left, the result is one set of all triangles. A
/// material or object whose charts in several tiles would overlap in one gets a set per tile; one that lies in a
/// single tile is moved from there.
/// \throws Error(input) for an invalid mesh, see validate(); without the materials or objects requested; for UDIM,
///         with a triangle whose centroid lies in no tile
std::vector<TextureSet> find_texture_sets(const Mesh& low, SetsBy by);

/// Guesses the texture sets of a low poly by its UVs: `material` if UVs of several materials overlap on over 1% of
/// the unit square; else `udim` if charts of several tiles would overlap in one and are not UV copies; else `none`.
SetsBy choose_texture_sets(const Mesh& low);

/// Tangents of a low poly for a bake in tangent space: its own if it has them, else MikkTSpace's; unit and orthogonal
/// to the normals. Three per triangle, as Mesh::tangents.
/// \throws Error(input) for an invalid mesh, see validate(), or without UVs
std::vector<Tangent> tangents_of(const Mesh& low);

/// The low poly for a bake of one set: triangles of other sets have no UVs (NaN) and so no texels, but count for
/// averaged normals, ray directions and occlusion. Its tangents are those of the whole mesh: assign tangents_of()
/// to Mesh::tangents first, so that they are computed once for all sets. MatchMethod::uv finds points of the high
/// poly at the moved UVs: its own UVs must be moved alike.
/// \throws Error(input) for a mesh without UVs
Mesh low_of_set(const Mesh& low, const TextureSet& set);

/// Changes `part` to the UVs of another set, without another copy of the mesh. \param part  a copy of the low
/// poly with the tangents of tangents_of(), or a result of low_of_set()
void lay_out_set(const Mesh& low, const TextureSet& set, Mesh& part);

}  // namespace kiln

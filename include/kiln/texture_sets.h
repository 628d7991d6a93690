#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Ways to part a low poly into texture sets: each has the unit square of UV space for itself.
enum class SetsBy {
  none,      ///< One set for all
  material,  ///< A set a material (Mesh::materials)
  object,    ///< A set an object (Mesh::objects)
  udim,      ///< A set a tile of UV space: 1001 + u + 10 v, u from 0 to 9, v from 0 to 899
};

/// Triangles of a low poly that share one set of maps.
struct TextureSet {
  std::string name =
      {};  ///< Name of the material or object, "1001" and on for tiles; empty: the one set of all
  std::string tile = {};     ///< "1001" and on where a material or object has several; else empty
  std::uint32_t tile_u = 0;  ///< Whole part of u of the tile that is moved to the unit square
  std::uint32_t tile_v = 0;  ///< Whole part of v
  std::vector<std::uint32_t> members = {};  ///< Its triangles of Mesh::triangles, ascending
  std::uint64_t triangles = 0;              ///< Number of them that have an area in UV space
};

/// Parts a low poly into its texture sets, in the order of material_names, object_names or tiles. Those without a
/// triangle that has an area in UV space are left out; with none left the result is one set of all triangles. A
/// material or object whose charts of several tiles would overlap in one has a set a tile; one that lies in one tile
/// alone is moved from there.
/// \throws Error(input) for a mesh that does not hold together, see validate(); without the materials or objects
///         asked for; for UDIM, with a triangle whose middle lies in no tile
std::vector<TextureSet> find_texture_sets(const Mesh& low, SetsBy by);

/// Guesses by its UVs how a low poly is meant: `material` where UVs of several materials overlap on over 1% of the unit
/// square; else `udim` where charts of several tiles would overlap in one, and are no copies of each other; else
/// `none`.
SetsBy choose_texture_sets(const Mesh& low);

/// MikkTSpace's tangents of a low poly, or its own where it has them, made unit and square to the normals: those that a
/// bake in tangent space takes. Three a triangle, as Mesh::tangents.
/// \throws Error(input) for a mesh that does not hold together, see validate(), or without UVs
std::vector<Tangent> tangents_of(const Mesh& low);

/// The low poly to bake one set with: other sets' triangles have no UVs (NaN) and so no texels, but are there for
/// all else: averaged normals, ray directions, occlusion. Its tangents are those of the whole mesh:
/// give it Mesh::tangents of tangents_of() before, and many sets find them once.
/// MatchMethod::uv finds points of the high poly at the moved UVs: its own must be moved alike.
/// \throws Error(input) for a mesh without UVs
Mesh low_of_set(const Mesh& low, const TextureSet& set);

/// For set after set without copies of all: gives `part` a set's UVs. \param part  a copy of the low poly with
/// tangents_of() it, or what low_of_set() made of it
void lay_out_set(const Mesh& low, const TextureSet& set, Mesh& part);

}  // namespace kiln

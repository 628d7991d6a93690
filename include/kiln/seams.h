#pragma once

#include <cstdint>

#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Edges where a mesh's UVs part and its normals do not, though its faces meet at an angle. Texels on both
/// sides then hold the whole bend, each from its own side: the classic cause of gradients on flat faces.
struct SoftSeams {
  std::uint64_t edges = 0;  ///< How many
  /// Of these, how many lie between two flats: both faces have a neighbour within 1 degree of their own plane.
  /// Elsewhere, as on a coarse scan, a gradient is part of the detail and does not show.
  std::uint64_t between_flats = 0;
  std::uint64_t seams = 0;  ///< Edges where UVs part, soft or hard
  double length = 0;        ///< Of the soft ones together, world units
  /// The middle of the one where faces turn most, between flats where there is one there, as Mesh::positions.
  Vec3 example = {};
  double example_degrees = 0;  ///< How far its faces turn
};

/// Finds soft seams. Vertices of equal position are one; normals that the mesh lacks are computed, smooth
/// everywhere. Edges of one face are borders and no seams. Deterministic; linear time. Thread safety: may be
/// called from several threads.
/// \param mesh         with UVs; without, there are no seams
/// \param least_degrees  edges whose faces turn less are left out, 0 to 180
/// \throws Error(usage) for an angle out of range; Error(input) as validate()
SoftSeams soft_seams(const Mesh& mesh, double least_degrees = 30);

/// Makes each UV seam a hard edge, as most modelling tools can: corners at a seam take the
/// angle-weighted normal of the faces on their own side. Seams, and edges that are hard already, bound
/// a side. All other normals stay to the bit. Tangents that the mesh has are dropped: they belong to
/// the old normals. Deterministic; linear time. Thread safety: may be called from several threads.
/// \returns the mesh with normals
/// \throws Error(input) for a mesh without UVs, or as validate()
Mesh split_at_seams(const Mesh& mesh);

}  // namespace kiln

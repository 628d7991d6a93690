#pragma once

#include <cstdint>

#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/texture.h"

namespace KILN_PUBLIC kiln {

/// What cut_out() did.
struct CutOutReport {
  std::uint64_t whole = 0;  ///< Triangles that stayed as they were
  std::uint64_t cut = 0;    ///< Triangles of which a part stayed
  std::uint64_t gone = 0;   ///< Triangles that are transparent everywhere
};

/// Takes the transparent parts off a mesh (an alpha test), so that no ray, view or nearest point meets them:
/// leaves on cards, fences, hair.
///
/// Where a texture's texels are on both sides of the threshold, triangles are quartered, down to a
/// texel's size. There they are cut along the line between their corners' values. So borders are as
/// smooth as the texture read bilinearly. Parts without area are left out. New triangles lie in the old ones and have their normals,
/// UVs, colours and names. Computed normals are those of the whole mesh. Reads its arguments during
/// the call alone. Thread safety: may be called from several threads.
/// \param opacity    its `channel` is read; must have pictures
/// \param threshold  above 0, to 1: less is transparent
/// \throws Error(input) where the mesh has no UVs, the texture does not fit, or nothing is left;
///         Error(usage) for a threshold out of range
Mesh cut_out(const Mesh& mesh, const Texture& opacity, double threshold,
             CutOutReport* report = nullptr);

}  // namespace kiln

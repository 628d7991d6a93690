#pragma once

#include <cstdint>

#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// What normals of a low poly are for.
enum class NormalPurpose : std::uint8_t {
  by_uvs,  ///< A map where the mesh has UVs, else shading
  map,  ///< A normal map bends them: they turn evenly from face to face, so that coarse maps can follow
  shading,  ///< They are seen as they are: flats look flat
};

/// A turn of faces, degrees, from which on hard edges are worth their vertices where no map bends normals: see
/// FitNormalsOptions::crease_degrees.
inline constexpr double kShadingCreaseDegrees = 55;

/// Where fit_normals() parts normals, and what for.
struct FitNormalsOptions {
  /// UV seams are hard edges where normals fitted to each side alone part by this or more, degrees. 0: all
  /// seams; 180: none.
  double hard_degrees = 10;
  /// Of a mesh without UVs, or for shading: edges whose faces turn by this or more are hard where normals part by 45
  /// degrees. Vertices have several normals there. 180: none. kShadingCreaseDegrees suits hard surfaces, and leaves
  /// scans nearly as they are.
  double crease_degrees = 180;
  NormalPurpose purpose = NormalPurpose::by_uvs;  ///< What they are for
};

/// What fit_normals() came to.
struct FitNormalsReport {
  std::uint64_t normals = 0;     ///< How many the mesh has
  std::uint64_t hard_edges = 0;  ///< UV seams and creases that part them
};

/// Gives a low poly the normals that come nearest to the high poly's, by least squares over the surface.
///
/// Shaded without a map, the low poly then looks as near as its faces allow. With one, the map turns
/// less: flats are flat in it, and coarse maps are nearer. Samples of the high poly, of even area, are
/// matched with the nearest point of the low poly. Where they are few, normals of the faces decide:
/// angle-weighted ones for maps, area-weighted ones for shading (NormalPurpose). No normal turns
/// farther from a face around it than tangent space reaches.
///
/// UV seams are hard edges where that helps: see FitNormalsOptions. Vertices are split at seams in
/// any case, so hard edges cost none. Creases inside charts do, and are made where they are asked for and no map
/// bends normals. Else corners that share a position and UVs share their normal.
///
/// The sides of a two-sided sheet share no normal: each takes the samples that look its way.
///
/// Normals that the mesh had are replaced, and its tangents, which went with them, left out. All else is kept.
/// Deterministic: the same on every run and number of threads. Lifetimes and threads as simplify().
/// \param high  that the low poly stands for; read during the call
/// \param report  where to write what was done; may be null
/// \throws Error(usage) for options out of range, Error(input) where no triangle of `high` has any area
/// Cost: about 0.3 microseconds a sample; 16 a triangle of `low`, 32,768 at least.
Mesh fit_normals(const Mesh& low, const Mesh& high, const FitNormalsOptions& options = {},
                 FitNormalsReport* report = nullptr);

}  // namespace kiln

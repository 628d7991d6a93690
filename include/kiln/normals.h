#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Uses of a low poly's normals.
enum class NormalPurpose : std::uint8_t {
  by_uvs,  ///< A map where the mesh has UVs, else shading
  map,  ///< A normal map bends them: they turn evenly from face to face, so that coarse maps can follow
  shading,  ///< They are seen as they are: flats look flat
};

/// A turn of faces, degrees, from which on hard edges are worth their vertices where no map bends normals: see
/// FitNormalsOptions::crease_degrees.
inline constexpr double kShadingCreaseDegrees = 55;

/// Settings of fit_normals(): where it parts normals, and what for.
struct FitNormalsOptions {
  /// UV seams are hard edges where normals fitted to each side alone part by this or more, degrees. 0: all
  /// seams; 180: none.
  double hard_degrees = 10;
  /// Crease angle of a mesh without UVs, or for shading: edges whose faces turn by this or more are hard where normals part by 45
  /// degrees. Vertices have several normals there. 180: none. kShadingCreaseDegrees suits hard surfaces, and leaves
  /// scans nearly as they are.
  double crease_degrees = 180;
  NormalPurpose purpose = NormalPurpose::by_uvs;  ///< Use of the normals
};

/// Report of fit_normals().
struct FitNormalsReport {
  std::uint64_t normals = 0;     ///< Number of normals of the mesh
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

/// Edges where a mesh's UVs part and its normals do not, though its faces meet at an angle. Texels on both
/// sides then hold the whole bend, each from its own side: the classic cause of gradients on flat faces.
struct SoftSeams {
  std::uint64_t edges = 0;  ///< Number of edges
  /// Edges among these that lie between two flats: both faces have a neighbour within 1 degree of their own plane.
  /// Elsewhere, as on a coarse scan, a gradient is part of the detail and does not show.
  std::uint64_t between_flats = 0;
  std::uint64_t seams = 0;  ///< Edges where UVs part, soft or hard
  double length = 0;        ///< Length of the soft ones together, world units
  /// The middle of the one where faces turn most, between flats where there is one there, as Mesh::positions.
  Vec3 example = {};
  double example_degrees = 0;  ///< Angle by which its faces turn
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

/// Which of both agree_normals() keeps where nothing tells which is wrong.
enum class Trusted { faces, normals };

/// Repairs that agree_normals() made.
struct AgreedNormals {
  std::uint64_t normals = 0;   ///< Triangles whose normals were turned, or mirrored
  std::uint64_t faces = 0;     ///< Triangles that were turned round, as their normals show
  std::uint64_t mirrored = 0;  ///< Triangles among these whose normals were those of a mirror image
  std::uint64_t unclear =
      0;  ///< Triangles among these of open parts, where nothing told which of both was wrong
  std::uint64_t strange =
      0;  ///< Triangles of parts whose normals oppose most faces in no such way: left as they are
  std::uint32_t first = 0;  ///< The lowest of all
};

/// Sets right parts whose own normals oppose their faces, as tools leave meshes that they mirror: normals are turned,
/// or triangles are turned round. A part is what edges of two triangles that face alike connect, by equal positions.
/// A closed part, and one that is nearly so, shall face outwards. One that lies in another such part has the fault
/// of that part. Of an open sheet, neighbours tell, then the other parts, then \p trust. Parts whose
/// normals are those of a mirror image get them mirrored. All other parts stay to the bit: also those that agree and
/// face inwards, as rooms do, and leaves with normals of a rounder shape. Meshes without normals stay.
/// Time: 0.02 s for a million triangles that agree. Thread safety: may be called from several threads, for other meshes.
/// \throws Error(input) for a mesh that does not hold together, see validate(), and for mirrored normals beside tangents
AgreedNormals agree_normals(Mesh& mesh, Trusted trust);

/// Parts that face inwards.
struct InwardParts {
  std::uint64_t count = 0;  ///< Number of parts
  std::uint64_t parts = 0;  ///< Number of parts that have an inside
  Vec3 example = {};        ///< A corner of the first, as Mesh::positions
};

/// Finds parts that are closed or nearly so, face inwards, and lie in no other part that faces outwards, whatever
/// their normals are: rooms, and meshes that are inside out. Time: 0.03 s for a million triangles of which none do.
/// Thread safety: may be called from several threads. \throws Error(input) as validate()
InwardParts inward_parts(const Mesh& mesh);

/// Where the normals of a high poly come from.
enum class ShadingRule : std::uint8_t {
  automatic,  ///< The file's where it has any, else smooth or with hard edges, as the shape shows
  file,       ///< The file's; smooth where it has none
  smooth,     ///< Smooth everywhere, whatever the file has
  flat,       ///< Each polygon its own normal, whatever the file has
  angle,      ///< Smooth but for edges whose faces turn by an angle or more, whatever the file has
};

/// Settings of shade_high().
struct ShadingOptions {
  ShadingRule rule = ShadingRule::automatic;  ///< Source of the normals
  double angle_degrees =
      30;  ///< Of ShadingRule::angle, above 0 and up to 180: edges that turn less are smooth
};

/// Normals that shade_high() found or made.
struct ShadingReport {
  /// ShadingRule::file: the mesh's own; smooth, flat; angle: hard edges were made. Never automatic.
  ShadingRule chosen = ShadingRule::file;
  std::uint64_t given = 0;    ///< Triangles with normals of their own, which were kept
  std::uint64_t missing = 0;  ///< Triangles that had none
  std::uint64_t parts =
      0;  ///< Connected parts that were looked at; 0 where no edge turns by 20 degrees
  std::uint64_t hard_parts = 0;  ///< Parts among these with hard edges
  std::uint64_t split_parts =
      0;  ///< Parts among those whose hard edges are where the file splits vertices
  std::uint64_t hard_edges = 0;  ///< Edges where normals part
  double least_degrees = 0;      ///< Least turn of a hard edge; 0 where there is none
  double most_degrees = 0;       ///< Greatest turn of a smooth edge of parts with hard ones
  /// Share of the area, 0 to 1, where planes of several triangles or of a polygon are shaded as if they were bent: the
  /// normal in the middle of a triangle is more than 20 degrees off its plane's.
  double bent_planes = 0;
  std::vector<Warning> warnings =
      {};  ///< "bent-planes": a tenth of the area or more, with a remedy
};

/// Gives a high poly the normals that all which is baked from it shall see: matches, maps, simplification, pictures.
///
/// STL holds no normals of corners, and many files of other formats have none. Scans and sculptures are smooth then;
/// flats of CAD parts would be shaded round. ShadingRule::automatic tells both apart by the distribution of the
/// angles by which faces turn at edges, for each connected part by itself: scans turn by all angles, with ever fewer
/// edges of greater ones, hard surfaces by small ones in rounds and by great ones at edges, with a gap between.
/// host/mesh/crease_rule.h has the rule. Vertices that the file splits where faces part are hard edges; triangles
/// that share no vertex say nothing. Smoothing groups of files are normals of theirs already: readers make them.
///
/// At a hard edge each side has the angle-weighted normal of its own faces. Planes of several triangles lend their
/// normal to vertices that they share with faces of less than a quarter of their area, so that flats beside rounded
/// edges stay flat. At tips of cones each face has its own.
///
/// A mesh that has no normals and that is smooth stays without: they are computed where they are needed. Triangles
/// whose three normals are zero have none; where others have some, theirs are filled in. Tangents go with the normals
/// that they belong to. Deterministic. Time: 0.3 s for a million triangles without normals. Thread safety: may be
/// called from several threads, for other meshes.
/// \param mesh  changed: normals, normal_triangles, tangents
/// \throws Error(usage) for an angle out of range; Error(input) as validate()
ShadingReport shade_high(Mesh& mesh, const ShadingOptions& options = {});

}  // namespace kiln

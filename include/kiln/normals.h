#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Purposes for which a low poly's normals are fitted.
enum class NormalPurpose : std::uint8_t {
  by_uvs,  ///< `map` if the mesh has UVs, else `shading`
  /// For a normal map: normals change evenly from face to face, so that coarse maps can follow
  map,
  shading,  ///< For shading without a map: flats look flat
};

/// Crease angle, degrees, from which on hard edges are worth their extra vertices if no normal map is used:
/// see FitNormalsOptions::crease_degrees.
inline constexpr double kShadingCreaseDegrees = 55;

/// Settings of fit_normals().
struct FitNormalsOptions {
  /// UV seams become hard edges where normals fitted to each side alone differ by this angle or more,
  /// degrees. 0: all seams; 180: none, nor edges along hard edges of the high poly.
  double hard_degrees = 10;
  /// Crease angle of a mesh without UVs, or for shading: edges whose faces turn by this angle or more become hard if
  /// their normals differ by 45 degrees. Vertices then have several normals. 180: none. kShadingCreaseDegrees suits
  /// hard surfaces, and hardly changes scans.
  double crease_degrees = 180;
  NormalPurpose purpose = NormalPurpose::by_uvs;  ///< Purpose of the normals
};

/// Report of fit_normals().
struct FitNormalsReport {
  std::uint64_t normals = 0;  ///< Number of normals
  /// Edges with different normals on their sides: UV seams, creases, and those along the high poly's hard edges
  std::uint64_t hard_edges = 0;
};

/// Fits a low poly's normals to the high poly's, by least squares over the surface.
///
/// Without a map, the low poly's shading then is as close as its faces allow. With a map, the map's vectors
/// deviate less: flats are flat in it, and coarse maps are more accurate. Samples of the high poly, of even
/// area, are matched with the nearest point of the low poly. Where samples are sparse, normals of the faces are
/// used: angle-weighted ones for maps, area-weighted ones for shading (NormalPurpose). No normal turns farther
/// from a face around it than tangent space reaches.
///
/// UV seams are hard edges where that helps: see FitNormalsOptions. Vertices are split at seams in any case, so
/// hard edges cost none. Inside charts, edges become hard only where the high poly's edges are hard: where its own
/// normals differ by 20 degrees or more. A map cannot hold the step that smooth normals would leave there. Other
/// creases inside charts are made only on request and if there is no normal map. Else corners that share a position
/// and UVs share their normal.
///
/// The sides of a two-sided sheet share no normal: each uses the samples that face its way.
///
/// Existing normals are replaced, and tangents, which belong to them, dropped. All else is kept. Deterministic:
/// the same on every run and number of threads. Lifetimes and threads as simplify().
/// \param high  the high poly; read during the call
/// \param report  receives the report; may be null
/// \throws Error(usage) for options out of range, Error(input) if no triangle of `high` has any area
/// Cost: about 0.3 microseconds per sample; 16 samples per triangle of `low`, at least 32,768.
Mesh fit_normals(const Mesh& low, const Mesh& high, const FitNormalsOptions& options = {},
                 FitNormalsReport* report = nullptr);

/// Edges at which a mesh's UVs are split but its normals are not, though its faces meet at an angle.
/// Texels on both sides then hold the whole bend, each from its own side: the classic cause of gradients
/// on flat faces.
struct SoftSeams {
  std::uint64_t edges = 0;  ///< Number of edges
  /// Edges among these that lie between two flats: both faces have a neighbour within 1 degree of their own plane.
  /// Elsewhere, as on a coarse scan, a gradient is part of the detail and does not show.
  std::uint64_t between_flats = 0;
  std::uint64_t seams = 0;  ///< Edges at which UVs are split, soft or hard
  double length = 0;        ///< Total length of the soft seams, world units
  /// Midpoint of the soft seam with the largest turn, one between flats if there is any; as Mesh::positions.
  Vec3 example = {};
  double example_degrees = 0;  ///< Angle between its faces' normals
};

/// Finds soft seams. Vertices of equal position count as one; missing normals are computed, smooth
/// everywhere. Edges of one face are borders, not seams. Deterministic; linear time. Thread safety: may be
/// called from several threads.
/// \param mesh the mesh; without UVs it has no seams
/// \param least_degrees  edges whose faces turn less are ignored, 0 to 180
/// \throws Error(usage) for an angle out of range; Error(input) as validate()
SoftSeams soft_seams(const Mesh& mesh, double least_degrees = 30);

/// Makes each UV seam a hard edge, as most modelling tools can: corners at a seam take the
/// angle-weighted normal of the faces on their own side. Seams, and edges that are hard already, bound
/// a side. All other normals are unchanged to the bit. Tangents are dropped, since they belong to the
/// old normals. Deterministic; linear time. Thread safety: may be called from several threads.
/// \returns the mesh with normals
/// \throws Error(input) for a mesh without UVs, or as validate()
Mesh split_at_seams(const Mesh& mesh);

/// What agree_normals() keeps if nothing shows which of both is wrong.
enum class Trusted { faces, normals };

/// Repairs that agree_normals() made.
struct AgreedNormals {
  std::uint64_t normals = 0;  ///< Triangles whose normals were flipped or mirrored
  std::uint64_t faces = 0;    ///< Triangles whose winding was reversed to match their normals
  /// Of `normals`, triangles whose normals were those of a mirror image
  std::uint64_t mirrored = 0;
  std::uint64_t unclear = 0;  ///< Of these, triangles of open parts, which `trust` decided
  /// Triangles of parts whose normals oppose most faces for no detectable reason: unchanged
  std::uint64_t strange = 0;
  std::uint32_t first = 0;  ///< Lowest index of all
};

/// Repairs parts whose own normals oppose their faces, as after mirroring in some tools: normals are flipped, or
/// windings are reversed. A part consists of triangles connected by edges of two triangles of equal winding, by equal
/// positions. A closed or nearly closed part is made to face outwards. A part inside another such part is repaired like
/// that one. An open sheet is repaired like its neighbours, else like the other parts, else by \p trust. Normals of a
/// mirror image are mirrored. All other parts are unchanged to the bit, such as consistent parts that face inwards
/// (rooms), and leaves with normals of a rounder shape. Meshes without normals are unchanged. Time: 0.02 s for a
/// million triangles that agree. Thread safety: may be called from several threads, for other meshes.
/// \throws Error(input) for an invalid mesh, see validate(), and for mirrored normals beside tangents
AgreedNormals agree_normals(Mesh& mesh, Trusted trust);

/// Parts of a mesh that face inwards.
struct InwardParts {
  std::uint64_t count = 0;  ///< Number of parts
  std::uint64_t parts = 0;  ///< Number of closed or nearly closed parts
  Vec3 example = {};        ///< A corner of the first, as Mesh::positions
};

/// Finds parts that are closed or nearly so, face inwards, and lie in no other part that faces outwards, regardless
/// of their normals: rooms, and meshes that are inside out. Time: 0.03 s for a million triangles of which none do.
/// Thread safety: may be called from several threads. \throws Error(input) as validate()
InwardParts inward_parts(const Mesh& mesh);

/// Sources of a high poly's normals.
enum class ShadingRule : std::uint8_t {
  /// The file's if it has any, else smooth or with hard edges, by the distribution of edge angles
  automatic,
  file,    ///< The file's; smooth if it has none
  smooth,  ///< Smooth everywhere, ignoring the file's
  flat,    ///< One normal per polygon, ignoring the file's
  angle,   ///< Smooth except at edges whose faces turn by an angle or more, ignoring the file's
};

/// Settings of shade_high().
struct ShadingOptions {
  ShadingRule rule = ShadingRule::automatic;  ///< Source of the normals
  double angle_degrees =
      30;  ///< For ShadingRule::angle, above 0, up to 180: edges that turn less are smooth
};

/// Report of shade_high().
struct ShadingReport {
  /// The rule used, never `automatic`; `file`: the mesh's own normals; `angle`: hard edges were
  /// made.
  ShadingRule chosen = ShadingRule::file;
  std::uint64_t given = 0;    ///< Triangles whose own normals were kept
  std::uint64_t missing = 0;  ///< Triangles without own normals
  std::uint64_t parts =
      0;  ///< Number of examined connected parts; 0 if no edge turns by 20 degrees
  std::uint64_t hard_parts = 0;  ///< Examined parts with hard edges
  std::uint64_t split_parts =
      0;  ///< Of these, parts whose hard edges are where the file splits vertices
  std::uint64_t hard_edges = 0;  ///< Number of hard edges
  double least_degrees = 0;      ///< Smallest turn of a hard edge, degrees; 0 without hard edges
  /// Largest turn of a smooth edge of parts with hard edges, degrees
  double most_degrees = 0;
  /// Share of the area, 0 to 1, where planes of several triangles or of a polygon are shaded as if bent: the normal in
  /// the middle of a triangle deviates by more than 20 degrees from the plane's.
  double bent_planes = 0;
  std::vector<Warning> warnings =
      {};  ///< "bent-planes": a tenth of the area or more, with a remedy
};

/// Sets the normals of a high poly that all later steps use: matches, maps, simplification, pictures.
///
/// STL holds no corner normals, and many files of other formats lack them. Smooth normals then suit scans and
/// sculptures, but make flats of CAD parts look round. ShadingRule::automatic distinguishes both by the distribution
/// of edge angles, for each connected part: scans have all angles, with fewer edges the larger the angle; hard
/// surfaces have small angles in rounds and large ones at edges, with a gap between. host/mesh/crease_rule.h
/// documents the rule. Vertices that the file splits where faces part are hard edges; meshes whose triangles share no
/// vertex give no such hint. Readers convert smoothing groups to normals.
///
/// At a hard edge each side has the angle-weighted normal of its own faces. Vertices between a plane of several
/// triangles and faces of less than a quarter of its area get the plane's normal, so that flats beside rounded edges
/// stay flat. At tips of cones each face has its own normal.
///
/// A smooth mesh without normals is unchanged: they are computed when needed. Triangles whose three normals are zero
/// count as without; if others have normals, theirs are filled in. Tangents are dropped with the normals that they
/// belong to. Deterministic. Time: 0.3 s for a million triangles without normals. Thread safety: may be called from
/// several threads, for other meshes.
/// \param mesh  changed: normals, normal_triangles, tangents
/// \throws Error(usage) for an angle out of range; Error(input) as validate()
ShadingReport shade_high(Mesh& mesh, const ShadingOptions& options = {});

}  // namespace kiln

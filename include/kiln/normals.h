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
  by_uvs,  ///< NormalPurpose::map if the mesh has UVs, else NormalPurpose::shading
  /// For a normal map: normals change evenly from face to face, so that even coarse maps can
  /// compensate them
  map,
  shading,  ///< For shading without a map: flat areas look flat
};

/// Crease angle, degrees, from which on hard edges are worth their extra vertices if no normal map is used:
/// see FitNormalsOptions::crease_degrees.
inline constexpr double kShadingCreaseDegrees = 55;

/// Settings of fit_normals().
struct FitNormalsOptions {
  /// UV seams become hard edges where the normals that are fitted to each side alone differ by this
  /// angle or more, degrees. 0: all seams; 180: no edge becomes hard, not even along hard edges of
  /// the high poly.
  double hard_degrees = 10;
  /// Crease angle of a mesh without UVs, or for NormalPurpose::shading: edges whose faces meet at this angle or more
  /// become hard if the normals on their sides differ by 45 degrees or more. Vertices then have several normals.
  /// 180: no edges become hard. kShadingCreaseDegrees suits hard surfaces, and hardly changes scans.
  double crease_degrees = 180;
  NormalPurpose purpose = NormalPurpose::by_uvs;  ///< Purpose for which the normals are fitted
};

/// Report of fit_normals().
struct FitNormalsReport {
  std::uint64_t normals = 0;  ///< Number of normals
  /// Number of hard edges: UV seams, creases, and edges along the high poly's hard edges
  std::uint64_t hard_edges = 0;
};

/// Fits a low poly's normals to the high poly's, by least squares over the surface.
///
/// Without a map, the low poly's shading then is as close to the high poly's as its faces allow. With a map, the
/// map's vectors deviate less from (0, 0, 1): flat areas are constant in it, and coarse maps are more accurate.
/// Samples of the high poly, each for the same area, are matched with the nearest points of the low poly. Where
/// samples are sparse, normals of the faces are used: angle-weighted ones for maps, area-weighted ones for shading
/// (NormalPurpose). Each normal stays within the range of directions that tangent space can represent on all faces
/// around it.
///
/// UV seams become hard edges where that reduces the error: see FitNormalsOptions. Vertices are split at seams in
/// any case, so hard edges add no vertices there. Inside charts, edges become hard only where the high poly's
/// edges are hard: where its own normals differ by 20 degrees or more. A map cannot represent the discontinuity
/// that smooth normals would leave there. Other creases inside charts are made only on request, and only without a
/// normal map. All other corners that share a position and UVs share their normal.
///
/// The sides of a two-sided sheet share no normal: each uses the samples that face its way.
///
/// Existing normals are replaced, and tangents, which belong to them, dropped. All else is kept. Deterministic:
/// the same on every run and number of threads. Rules for lifetimes and threads are those
/// of simplify().
/// \param high  the high poly; read during the call
/// \param report  receives the report; may be null
/// \throws Error(usage) for options out of range, Error(input) if no triangle of `high` has any area
/// Cost: about 0.3 microseconds per sample; 16 samples per triangle of `low`, at least 32,768.
Mesh fit_normals(const Mesh& low, const Mesh& high, const FitNormalsOptions& options = {},
                 FitNormalsReport* report = nullptr);

/// Soft seams: edges at which UVs are split but normals are not, although the faces meet at an angle.
/// The normal map then has to compensate the shared normal on both sides, which is the classic cause of
/// gradients on flat faces.
struct SoftSeams {
  std::uint64_t edges = 0;  ///< Number of soft seams
  /// Number of soft seams between two flat areas: both faces have a neighbour within 1 degree of their own plane.
  /// On other seams, as on a coarse scan, a gradient is part of the detail and is not visible.
  std::uint64_t between_flats = 0;
  std::uint64_t seams = 0;  ///< Number of all edges at which UVs are split, soft or hard
  double length = 0;        ///< Total length of the soft seams, world units
  /// Midpoint of the soft seam whose faces meet at the largest angle; a seam between flat areas if there is
  /// one. Relative to Mesh::origin.
  Vec3 example = {};
  double example_degrees = 0;  ///< Angle between the faces at `example`, degrees
};

/// Finds soft seams. Vertices of equal position count as one; missing normals are computed, smooth
/// everywhere. Edges of one face are borders, not seams. Deterministic; linear time. Thread safety: may be
/// called from several threads.
/// \param mesh  the mesh; without UVs it has no seams
/// \param least_degrees  edges whose faces turn less are ignored, 0 to 180
/// \throws Error(usage) for an angle out of range; Error(input) as validate()
SoftSeams soft_seams(const Mesh& mesh, double least_degrees = 30);

/// Makes each UV seam a hard edge, as most modelling tools can: corners at a seam take the
/// angle-weighted normal of the faces on their own side. A side ends at seams and at edges that are already
/// hard. All other normals are unchanged to the bit. Tangents are dropped, since they belong to the
/// old normals. Deterministic; linear time. Thread safety: may be called from several threads.
/// \returns the mesh with normals
/// \throws Error(input) for a mesh without UVs, or as validate()
Mesh split_at_seams(const Mesh& mesh);

/// What agree_normals() keeps if it cannot detect which is wrong: the faces' winding or the
/// normals.
enum class Trusted { faces, normals };

/// Repairs that agree_normals() made.
struct AgreedNormals {
  std::uint64_t normals = 0;  ///< Triangles whose normals were flipped or mirrored
  std::uint64_t faces = 0;    ///< Triangles whose winding was reversed to match their normals
  /// Triangles, included in `normals`, whose normals were mirrored
  std::uint64_t mirrored = 0;
  /// Repaired triangles of open parts, for which the argument `trust` decided
  std::uint64_t unclear = 0;
  /// Triangles of parts whose normals oppose most faces for no detectable reason; they are
  /// unchanged
  std::uint64_t unexplained = 0;
  std::uint32_t first = 0;  ///< Lowest index of the triangles counted above
};

/// Repairs parts whose own normals oppose their faces, as after mirroring in some tools: normals are flipped, or
/// windings are reversed. A part consists of triangles connected by edges of two triangles of equal winding, by equal
/// positions. A closed or nearly closed part is made to face outwards. A part inside another closed part is repaired
/// like the enclosing part. An open sheet is repaired like its neighbours; if no neighbour is repaired, like the other
/// parts; if no other part is repaired, by the rule \p trust. Normals of a mirror image are mirrored back. All other
/// parts are unchanged to the bit, such as parts that face inwards with matching normals (rooms), and leaves whose
/// normals are those of a rounder shape. Meshes without normals are unchanged. Time: 0.02 s for a million triangles
/// that agree. Thread safety: may be called from several threads, for different meshes.
/// \throws Error(input) for an invalid mesh, see validate(), and for mirrored normals beside tangents
AgreedNormals agree_normals(Mesh& mesh, Trusted trust);

/// The parts of a mesh that face inwards.
struct InwardParts {
  std::uint64_t count = 0;  ///< Number of parts that face inwards
  std::uint64_t parts = 0;  ///< Number of all closed or nearly closed parts
  Vec3 example = {};  ///< A corner of the first part that faces inwards, relative to Mesh::origin
};

/// Finds closed or nearly closed parts that face inwards and lie in no other part that faces outwards: rooms, and
/// meshes that are inside out. Only windings count, not normals. Time: 0.03 s for a million triangles without such
/// parts. Thread safety: may be called from several threads. \throws Error(input) as validate()
InwardParts inward_parts(const Mesh& mesh);

/// Rules for the normals of a high poly.
enum class ShadingRule : std::uint8_t {
  /// The file's normals if it has any; else smooth normals or hard edges, according to the
  /// distribution of edge angles
  automatic,
  file,    ///< The file's normals; smooth ones if it has none
  smooth,  ///< Smooth normals everywhere; the file's normals are ignored
  flat,    ///< One normal per polygon; the file's normals are ignored
  /// Smooth normals except at edges whose faces meet at ShadingOptions::angle_degrees or more; the
  /// file's normals are ignored
  angle,
};

/// Settings of shade_high().
struct ShadingOptions {
  ShadingRule rule = ShadingRule::automatic;  ///< Rule for the normals
  /// For ShadingRule::angle: edges whose faces meet at a smaller angle are smooth; above 0, at most
  /// 180
  double angle_degrees = 30;
};

/// Report of shade_high().
struct ShadingReport {
  /// The rule that was used, never `automatic`: `file` if the mesh's own normals were kept, `angle`
  /// if hard edges were made.
  ShadingRule chosen = ShadingRule::file;
  std::uint64_t given = 0;    ///< Triangles whose own normals were kept
  std::uint64_t missing = 0;  ///< Triangles for which the file has no normals
  /// Number of connected parts that were examined; 0 if no faces meet at 20 degrees or more
  std::uint64_t parts = 0;
  std::uint64_t hard_parts = 0;  ///< Number of examined parts that got hard edges
  /// Number of parts, included in `hard_parts`, whose hard edges are where the file splits vertices
  std::uint64_t split_parts = 0;
  std::uint64_t hard_edges = 0;  ///< Number of hard edges
  /// Smallest angle between the faces of a hard edge, degrees; 0 without hard edges
  double least_degrees = 0;
  /// Largest angle between the faces of a smooth edge in parts with hard edges, degrees
  double most_degrees = 0;
  /// Share of the area, 0 to 1, that is planar but shaded as if curved: it belongs to planes of several triangles or of
  /// a polygon, and the interpolated normal in the middle of a triangle deviates by more than 20 degrees from the
  /// plane's.
  double bent_planes = 0;
  std::vector<Warning> warnings = {};  ///< "bent-planes", if bent_planes is 0.1 or more
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
/// several threads, for different meshes.
/// \param mesh  changed: normals, normal_triangles, tangents
/// \throws Error(usage) for an angle out of range; Error(input) as validate()
ShadingReport shade_high(Mesh& mesh, const ShadingOptions& options = {});

}  // namespace kiln

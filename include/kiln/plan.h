#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/measure.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// The error to reach, and what to bake.
struct PlanOptions {
  /// The mean angle to reach, degrees, between rendered normals of low poly with map and high poly.
  /// 0: what larger maps would not improve by more than 5%.
  double max_error = 0;
  /// Of other maps that are baked, each once. The map that reaches `max_error` may be too small for
  /// one of them. Then all maps grow until each is within its bound.
  std::vector<MapBound> bounds = {};
  /// For a bound of the map ao without OcclusionOptions::max_error: half of it is left to the rays.
  bool choose_rays = true;
  /// Everything but the method. Its size is the largest that the map may have.
  BakeOptions bake;
};

/// What plans measure with: directions, and pixels a side of the picture from each. `kiln measure`
/// looks from these directions too; nothing is matched from them. Pixels are point samples. So few
/// put the mean within 1% of 256 a side, on the bunny, an urn and a head.
inline constexpr std::uint32_t kPlanViews = 30, kPlanPixels = 64;

/// One bake that was tried and measured.
struct PlanTrial {
  MatchMethod method = MatchMethod::ray;  ///< That was tried
  std::uint32_t width = 0;                ///< Of the map, texels
  std::uint32_t height = 0;               ///< Of the map, texels
  NormalError error;  ///< Over kPlanViews directions of kPlanPixels x kPlanPixels pixels
  double missed = 0;  ///< Share of samples
  /// Share of the high poly that no sample stands for (RecallReport::lost); 0 where that is not known
  double lost = 0;
  double seconds =
      0;  ///< Of the bake; structures of the source that it was the first to need included
};

/// What a way to match would reach with a map of endless size: its matches of the very points that the
/// pictures show.
struct PlanLimit {
  MatchMethod method = MatchMethod::ray;  ///< That was looked at
  NormalError error;                      ///< Over the same pixels
  double missed = 0;                      ///< Share of them
  double seconds = 0;                     ///< That finding it took
};

/// The bake that a plan chose, and what it chose from.
struct PlannedBake {
  BakeResult result;              ///< The maps
  std::vector<PlanTrial> trials;  ///< In order
  std::vector<PlanLimit> limits;  ///< Of the ways to match that were looked at, in order
  /// Where UVs and the first way that searches do not reach the error: the least that any map can
  /// reach, since a place shows one normal to all sides. Behind it the high poly shows another to each.
  double least = 0;
  PlanTrial chosen;         ///< The trial that `result` is of
  NormalError without_map;  ///< The low poly's own normals, measured alike
  double wanted = 0;        ///< Degrees; with max_error 0: what that came to
  bool reached = false;     ///< `chosen` is within `wanted`, and each of `bounds` within its own
  std::vector<MapReached> bounds;  ///< Of PlanOptions::bounds, what `result` reaches
  double seconds_measure = 0;      ///< Of measuring, beside the bakes
};

/// Bakes with the cheapest plan that reaches an error: the way to match that costs least on a mesh of this
/// size, and the smallest map.
///
/// Pictures of both meshes are taken once. The points that they show are matched as texels would
/// be. This tells what a match reaches with a map of endless size, f, without baking one. A small
/// map is baked and measured there. Errors of larger ones follow from e(s) = f + 1 / (1 / (p - f) +
/// r s^2), p being the error without any map. They hold within 4% on low polys of 1,500 to 3,000
/// faces. They are worse where many charts have few texels; then the next map tells more. The next
/// that is baked is the smallest that is expected to reach the error. `reached` is measured on the
/// very map that is returned.
///
/// Matches are looked at in the order of their cost, and only where no earlier one is expected to do. Matching
/// by UVs searches nothing: it comes first where the high poly's UVs are fit for it (BakeOptions::uv), else it
/// is left out. Then views first for meshes of more than two million triangles, for which building the BVH
/// takes longest; else rays first, and views last, where rays miss points or another way gets nearer than they
/// do. None but these is looked at where the error is below what any map could show. Without an error to
/// reach, UVs do unless the first way that searches gets nearer. Where none is expected to reach it, the match
/// that gets nearest is baked. Its size is one that larger maps would not improve on by 5%; what gains less
/// than 3% on those before it does not count as nearer. With a cage, rays alone.
///
/// A trial that loses parts of the high poly is worth less than its error says: the surface below
/// them may look smoother. The lost share counts as without a map, so the error is raised by lost
/// * without_map. This chooses a trial; the reached error is the measured one. Lifetimes,
/// threads, tangents and welding as bake(). BakeOptions::progress comes on the caller's thread:
/// ten times a second within bakes, else between steps; the share done stays 0, since the number
/// of trials is not known. Where it says stop, PlannedBake::result.cancelled is set.
/// \throws as bake(), and Error(usage) for a negative or not finite error, or maps without a normal map
PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options);

}  // namespace kiln

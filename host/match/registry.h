// The registry of matches: each is a file of this folder and a row here.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/bake.h"
#include "kiln/match.h"
#include "match/matcher.h"
#include "match/uv_points.h"
#include "match/visibility.h"
#include "mesh/low_surface.h"
#include "source/high_poly.h"

namespace kiln {

/// Input of a match: the meshes, the search distance, the directions. Lengths are in the working
/// frame.
struct MatchRequest {
  /// Returns a copy of the request for other meshes, whose positions are in the same working frame.
  MatchRequest of(const Source::Impl& other, const LowSurface& low) const {
    MatchRequest request{.source = other, .surface = low};
    request.width = width;
    request.height = height;
    request.samples = samples;
    request.distance = distance;
    request.near_distance = near_distance;
    request.max_sheet_distance = max_sheet_distance;
    request.cage = cage;
    request.cage_mesh = cage_mesh;
    request.two_sided = two_sided;
    request.views = views;
    request.visibility = visibility;
    request.uv = uv;
    request.ray = ray;
    request.blends_directions = blends_directions;
    return request;
  }

  const Source::Impl& source;
  const LowSurface& surface;
  std::uint32_t width = 0, height = 0, samples = 1;  ///< Size and samples of the map
  double distance = 0;  ///< Search distance; if there is a cage, measured from the cage inward
  /// Distance of a first, shorter search; 0: there is only one search
  double near_distance = 0;
  /// Search distance of samples on open sheets; 0: the same as for other samples
  double max_sheet_distance = 0;
  /// Distance outward from the low poly at which rays start; the first hit counts
  std::optional<double> cage = {};
  /// True if rays start on a cage mesh, at the ends of the surface's directions
  bool cage_mesh = false;
  bool two_sided = false;  ///< True if rays also hit back faces of the high poly
  ViewOptions views = {};
  VisibilityOptions visibility = {};
  UvOptions uv = {};
  RayOptions ray = {};
  /// True if directions were blended at hard edges, so that samples that miss may be retried along
  /// averaged directions
  bool blends_directions = false;
  std::uint32_t cluster = 0;  ///< Index of the cluster of visibility directions
  /// The visibility field: created if null, and then shared with the requests for further clusters.
  std::shared_ptr<const VisibilityField>* field = nullptr;
  /// Progress callback of matches with a long preparation: called with the completed share, [0, 1], and the
  /// name of the step.
  /// \returns false to cancel
  Progress progress = {};
};

/// A row of the registry.
struct MatchRow {
  MatchInfo info;
  /// True if the matcher keeps no data of the high poly except data that a BVH refit updates.
  bool is_refittable = false;
  /// True if the match uses MatchRequest::max_sheet_distance when no search distance was given.
  bool uses_sheet_distance = false;
  /// True if the match searches only by Source::Impl::ray_search(), closest_search(), viewed_surface() and
  /// triangle_blocks(), so that the high poly may be larger than memory.
  bool supports_large_high_poly = false;
  /// True if messages recommend the match as a fallback, because it finds nearly all points that matches by
  /// views or by UVs miss.
  bool is_good_fallback = false;
  /// Place of this match in the order in which bake_planned() and plan_low_poly() try matches,
  /// counted from 1; 0: it is not tried.
  std::uint8_t plan_order = 0, low_poly_order = 0;
  /// For matches that depend on UVs alone: finds points at arbitrary UVs, as a map of unlimited
  /// size would.
  UvPoints (*find_at_uvs)(const Source::Impl& source, std::span<const Vec2> uvs) = nullptr;
  std::unique_ptr<Matcher> (*make)(const MatchRequest& request, MatchNotes& notes) = nullptr;
};

/// All rows of the registry, in the order in which users see the matches.
std::span<const MatchRow> match_rows();

/// \throws Error(usage) for an unknown name; the message lists the known ones
const MatchRow& match_row(MatchMethod method);

/// Names of the matches whose rows have a property, for messages: "ray, closest or views".
std::string match_names(bool (*has)(const MatchRow& row));

/// The first match that depends on UVs alone (MatchRow::find_at_uvs).
MatchMethod match_at_uvs();

/// Matches that plans try, in the order of trying.
/// \param order  MatchRow::plan_order or low_poly_order
std::vector<MatchMethod> planned_matches(std::uint8_t MatchRow::*order);

/// True if the match or one of its fallbacks has a property.
/// \param has  predicate of a row
template <typename Has>
bool any_match_or_fallback(const BakeOptions& options, const Has& has) {
  return has(match_row(options.match.method)) ||
         std::any_of(options.match.fallback.begin(), options.match.fallback.end(),
                     [&](MatchMethod next) { return has(match_row(next)); });
}

// The rows of the registry of matches, each defined in the file of its match.
MatchRow ray_match();
MatchRow axis_match();
MatchRow views_match();
MatchRow closest_match();
MatchRow visibility_match();
MatchRow hybrid_match();
MatchRow uv_match();

}  // namespace kiln

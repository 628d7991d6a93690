// The matches there are: each is a file of this folder and a row here.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/match.h"
#include "match/matcher.h"
#include "match/uv_points.h"
#include "match/visibility.h"
#include "mesh/low_surface.h"
#include "source/high_poly.h"

namespace kiln {

/// A request to a match: the samples it will be given, how far to look, along what. Lengths are in the
/// working frame.
struct MatchRequest {
  /// The same of other meshes, in the same frame.
  MatchRequest of(const Source::Impl& other, const LowSurface& low) const {
    MatchRequest request{.source = other, .surface = low};
    request.width = width;
    request.height = height;
    request.samples = samples;
    request.distance = distance;
    request.near = near;
    request.sheet_reach = sheet_reach;
    request.cage = cage;
    request.cage_mesh = cage_mesh;
    request.two_sided = two_sided;
    request.views = views;
    request.visibility = visibility;
    request.uv = uv;
    request.ray = ray;
    request.turned = turned;
    return request;
  }

  const Source::Impl& source;
  const LowSurface& surface;
  std::uint32_t width = 0, height = 0, samples = 1;  ///< Size and samples of the map
  double distance = 0;              ///< Search distance; with a cage, from the cage inward
  double near = 0;                  ///< ... and how far first; 0: at once
  double sheet_reach = 0;           ///< Search distance of samples on open sheets; 0: as others
  std::optional<double> cage = {};  ///< Start rays this far outside, inward, first hit
  bool cage_mesh = false;           ///< ... or where the surface's directions end
  bool two_sided = false;           ///< Back faces of the high poly are hit, too
  ViewOptions views = {};
  VisibilityOptions visibility = {};
  UvOptions uv = {};
  RayOptions ray = {};
  bool turned =
      false;  ///< Samples' directions turned at hard edges: they may look along averaged ones, too
  std::uint32_t cluster = 0;  ///< Index of the cluster of directions of visibility
  /// Their field: made where it is null, for the clusters after this one.
  std::shared_ptr<const VisibilityField>* field = nullptr;
  /// Told the share done, [0, 1], and the work, by matches that prepare for long. \returns false to cancel
  Progress prepares = {};
};

/// One way to match.
struct MatchRow {
  MatchInfo info;
  /// It holds nothing of the high poly but what follows the BVH as the mesh moves.
  bool follows_bvh = false;
  /// It obeys MatchRequest::sheet_reach if nobody says how far to look.
  bool far_on_sheets = false;
  /// It finds nearly all that a match without a search, or by views, misses: messages advise it as a fallback.
  bool finds_the_rest = false;
  /// Its place in the order in which bake_planned() tries matches, and in that of plan_low_poly(); 0: not tried.
  std::uint8_t plan_order = 0, low_poly_order = 0;
  /// Finds points at any UVs, as a map of endless size would: for matches that go by UVs alone.
  UvPoints (*at_uvs)(const Source::Impl& source, std::span<const Vec2> uvs) = nullptr;
  std::unique_ptr<Matcher> (*make)(const MatchRequest& request, MatchNotes& notes) = nullptr;
};

/// All of them, in the order that they are listed to people.
std::span<const MatchRow> match_rows();

/// \throws Error(usage) for a name that no row has; the message lists those there are
const MatchRow& match_row(MatchMethod method);

/// Names of the rows that have a property, for messages: "ray, closest or views".
std::string match_names(bool (*has)(const MatchRow& row));

/// The first that goes by UVs alone (MatchRow::at_uvs).
MatchMethod match_at_uvs();

/// Matches that plans try, in their order.
/// \param order  MatchRow::plan_order or low_poly_order
std::vector<MatchMethod> planned_matches(std::uint8_t MatchRow::*order);

/// True if a method of the chain has a property: the method, or one of its fallbacks.
/// \param has  takes a row
template <typename Has>
bool any_in_chain(const BakeOptions& options, const Has& has) {
  return has(match_row(options.match.method)) ||
         std::any_of(options.match.fallback.begin(), options.match.fallback.end(),
                     [&](MatchMethod next) { return has(match_row(next)); });
}

// The rows, each in the file of its match.
MatchRow ray_match();
MatchRow axis_match();
MatchRow views_match();
MatchRow closest_match();
MatchRow visibility_match();
MatchRow hybrid_match();
MatchRow uv_match();

}  // namespace kiln

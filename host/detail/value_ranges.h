// Ranges of values in integer formats, for maps whose kind alone does not determine them.
#pragma once

#include <cstdint>

#include "kiln/bake.h"
#include "source/high_poly.h"

namespace kiln {

/// What a map's range depends on: the high poly and the options, but not the low poly or the baked
/// values. So all maps of one kind that are baked from one high poly with the same options have the
/// same range, and a grey value stands for the same number in all of them.
struct RangeRequest {
  const Source::Impl& source;
  const BakeOptions& options;
  double reach = 0;  ///< Search distance of the match, in world units
};

/// The functions below are rules for MapRow::range. Ranges are rounded outward; magnitudes are
/// rounded to two digits.
///
/// Range of positions: the bounds of the vertices that triangles use along the channel's axis,
/// relative to the map's origin, rounded to 1/10 to 1/100 of the diagonal.
ValueRange range_of_bounds(const RangeRequest& request, std::uint32_t channel);
/// Range from 0, or from minus the search distance of the match, to the search distance.
ValueRange range_of_reach(const RangeRequest& request, std::uint32_t channel);
ValueRange range_of_reach_signed(const RangeRequest& request, std::uint32_t channel);
/// Range of curvature, whose upper bound is 1 / (radius of the neighbourhood over which curvature
/// is averaged). The corner of a cube reaches this bound. The lower bound is 0, or minus the upper
/// bound for signed curvature.
ValueRange range_of_curvature(const RangeRequest& request, std::uint32_t channel);
ValueRange range_of_curvature_signed(const RangeRequest& request, std::uint32_t channel);

/// BakeOptions::curvature_radius in frame units, or the default if it is not set.
double curvature_radius(const std::optional<Length>& option, const Source::Impl& source);

}  // namespace kiln

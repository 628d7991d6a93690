// Value ranges of maps in integer formats, where the map's kind alone does not fix them.
#pragma once

#include <cstdint>

#include "kiln/bake.h"
#include "source/high_poly.h"

namespace kiln {

/// Input of a map's range: properties of the high poly and of the options, not of the picture or the low poly. So all
/// maps of one kind from one high poly with the same options have the same range, and a grey value means the same
/// number in all of them.
struct RangeRequest {
  const Source::Impl& source;
  const BakeOptions& options;
  double reach = 0;  ///< Search distance of the match, world units
};

/// Rules for MapRow::range. Ranges are rounded outward, magnitudes to two digits. Range of positions: the bounding box
/// of the vertices that triangles use, along the channel's axis and from the map's origin, rounded to 1/10 to 1/100 of
/// its diagonal.
ValueRange range_of_bounds(const RangeRequest& request, std::uint32_t channel);
/// Range up to the match's search distance: from 0, or from minus the search distance.
ValueRange range_of_reach(const RangeRequest& request, std::uint32_t channel);
ValueRange range_of_reach_signed(const RangeRequest& request, std::uint32_t channel);
/// Range of curvature: up to 1 / radius, with the radius of the neighbourhood over which curvature is averaged; the
/// corner of a cube reaches this bound. The range starts at 0, or at minus the bound if it is signed.
ValueRange range_of_curvature(const RangeRequest& request, std::uint32_t channel);
ValueRange range_of_curvature_signed(const RangeRequest& request, std::uint32_t channel);

/// BakeOptions::curvature_radius in frame units, or its default.
double curvature_radius(const std::optional<Length>& option, const Source::Impl& source);

}  // namespace kiln

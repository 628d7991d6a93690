// Which values of a map integer formats put at 0 and at 1, where its kind alone does not say.
#pragma once

#include <cstdint>

#include "kiln/bake.h"
#include "source/high_poly.h"

namespace kiln {

/// Input of a map's ranges: facts of the high poly and of the options, none of the picture or the low poly. So all
/// maps of one kind that are baked from one high poly with the same options have one range, and one grey is one value.
struct RangeRequest {
  const Source::Impl& source;
  const BakeOptions& options;
  double reach = 0;  ///< Search distance of the match, world units
};

/// Rules for rows of maps (MapRow::range): rounded outward, magnitudes to two digits.
/// The bounding box of the vertices that triangles use, along the channel's axis and from
/// the map's origin, to 1/10 to 1/100 of its diagonal.
ValueRange range_of_bounds(const RangeRequest& request, std::uint32_t channel);
/// From 0, or from minus that, to how far the match looks.
ValueRange range_of_reach(const RangeRequest& request, std::uint32_t channel);
ValueRange range_of_reach_signed(const RangeRequest& request, std::uint32_t channel);
/// From 0, or from minus that, to one over the radius that curvature is the mean over: what the corner of a cube has.
ValueRange range_of_curvature(const RangeRequest& request, std::uint32_t channel);
ValueRange range_of_curvature_signed(const RangeRequest& request, std::uint32_t channel);

/// Frame units: BakeOptions::curvature_radius, or what is taken where none is given.
double curvature_radius(const std::optional<Length>& wanted, const Source::Impl& source);

}  // namespace kiln

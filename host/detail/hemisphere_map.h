// Maps that are computed from rays over hemispheres.
#pragma once

#include <span>
#include <vector>

#include "detail/hemispheres.h"
#include "detail/registry.h"

namespace kiln {

/// Averages samples to texels, and sets the texels' coverage.
/// \param reads   the band's arrays on the host
/// \param values values of the samples: one plane, or three planes that are averaged as directions
/// \param plane   elements of a plane
void average_samples(BandReads& reads, const TexelBand& band, const DeviceCorrespondence& match,
                     MissPolicy miss, std::span<const float> values, std::size_t plane,
                     const BandPixels& out);

/// Makes a map of one number a sample. \param read computes the numbers, such as Hemispheres::visibility
std::unique_ptr<MapMaker> make_hemisphere_map(
    const MapRequest& request,
    std::vector<float> (Hemispheres::*read)(const TexelBand&, const DeviceCorrespondence&, bool));

}  // namespace kiln

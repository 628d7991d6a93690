// Maps of what rays over hemispheres meet.
#pragma once

#include <span>
#include <vector>

#include "detail/hemispheres.h"
#include "detail/registry.h"

namespace kiln {

/// Averages samples to texels, and says which are covered.
/// \param reads   of the band
/// \param values  of samples: one plane, or three that are averaged as directions
/// \param plane   elements of one
void average_samples(BandReads& reads, const TexelBand& band, const DeviceCorrespondence& match,
                     MissPolicy miss, std::span<const float> values, std::size_t plane,
                     const BandPixels& out);

/// A map of one number a sample. \param read  gives the numbers: Hemispheres::visibility or the like
std::unique_ptr<MapMaker> make_hemisphere_map(
    const MapRequest& request,
    std::vector<float> (Hemispheres::*read)(const TexelBand&, const DeviceCorrespondence&, bool));

}  // namespace kiln

// Maps that are computed from rays over hemispheres.
#pragma once

#include <span>
#include <vector>

#include "detail/hemispheres.h"
#include "detail/registry.h"

namespace kiln {

/// Averages the samples of each texel, and sets the texels' coverage.
/// \param reads   host copies of the band's arrays
/// \param values  values of the samples: one plane of numbers, or three planes of vectors, which
///   are averaged as directions
/// \param plane   number of elements of a plane
void average_samples(BandReads& reads, const TexelBand& band, const DeviceCorrespondence& match,
                     MissPolicy miss, std::span<const float> values, std::size_t plane,
                     const BandPixels& out);

/// Makes a map with one number per sample.
/// \param read  member function that computes the numbers of all samples, such as
///   Hemispheres::visibility
std::unique_ptr<MapMaker> make_hemisphere_map(
    const MapRequest& request,
    std::vector<float> (Hemispheres::*read)(const TexelBand&, const DeviceCorrespondence&, bool));

}  // namespace kiln

// Some samples of a band: gathered, matched by themselves, and put back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Close together in memory: points alone, of what a band has, unless told of the places, too.
class SampleSubset {
 public:
  SampleSubset(cl::Context& context, const TexelBand& from, std::span<const std::uint32_t> samples)
      : context_(context), indices_(context, samples) {
    band.sample_count = band.capacity = static_cast<std::uint32_t>(samples.size());
    band.points = cl::Array<float>(context, std::size_t{7} * band.capacity);
    context.launch(context.kernel("match", "kiln_match_gather"), band.sample_count, kLocal,
                   band.sample_count, from.capacity, band.capacity, indices_, from.points,
                   band.points);
  }

  /// Takes over the samples' places on the low poly. \param triangle  of all samples of the band
  void take_places(const TexelBand& from, const cl::Array<std::uint32_t>& triangle) {
    band.triangle = cl::Array<std::uint32_t>(context_, band.capacity);
    band.barycentric = cl::Array<float>(context_, std::size_t{2} * band.capacity);
    context_.launch(context_.kernel("match", "kiln_match_places"), band.sample_count, kLocal,
                    band.sample_count, from.capacity, indices_, triangle, from.barycentric,
                    band.triangle, band.barycentric);
  }

  /// Puts what was found for them where the samples came from.
  void put_back(const DeviceCorrespondence& result, const DeviceCorrespondence& match) const {
    context_.launch(context_.kernel("match", "kiln_match_scatter"), band.sample_count, kLocal,
                    band.sample_count, band.capacity, match.capacity, indices_, result.triangle,
                    result.barycentric, result.distance, result.status, match.triangle,
                    match.barycentric, match.distance, match.status);
  }

  TexelBand band;

 private:
  cl::Context& context_;
  cl::Array<std::uint32_t> indices_;
};

}  // namespace kiln

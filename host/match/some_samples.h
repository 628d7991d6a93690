// Some samples of a band: gathered, matched by themselves, and put back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "texel/correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Close together in memory: points alone, of what a band has.
class SomeSamples {
 public:
  SomeSamples(cl::Context& context, const TexelBand& from,
              const std::vector<std::uint32_t>& samples)
      : context_(context), indices_(context, std::span(samples)) {
    band.sample_count = band.capacity = static_cast<std::uint32_t>(samples.size());
    band.points = cl::Array<float>(context, std::size_t{7} * band.capacity);
    context.launch(context.kernel("match", "kiln_match_gather"), band.sample_count, kLocal,
                   band.sample_count, from.capacity, band.capacity, indices_, from.points,
                   band.points);
  }

  /// Puts what was found for them where the samples came from.
  void put_back(const Correspondence& result, const Correspondence& match) const {
    context_.launch(context_.kernel("match", "kiln_match_scatter"), band.sample_count, kLocal,
                    band.sample_count, band.capacity, match.capacity, indices_, result.triangle,
                    result.barycentric, result.distance, result.status, match.triangle,
                    match.barycentric, match.distance, match.status);
    context_.finish();  // the indices go
  }

  TexelBand band;

 private:
  static constexpr std::size_t kLocal = 64;
  cl::Context& context_;
  cl::Array<std::uint32_t> indices_;
};

}  // namespace kiln

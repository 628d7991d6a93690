#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/device.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/match.h"
#include "kiln/source.h"

namespace KILN_PUBLIC kiln {

/// Padding: texels next to charts take values of the chart.
struct PaddingOptions {
  std::int32_t texels =
      kPaddingTexels;  ///< Width, 0 to 16384; -1: everywhere, by push-pull (Gortler et al. 1996)
  bool fill_missed = false;   ///< Also fill TexelState::missed, from baked texels around
  bool unit_vectors = false;  ///< Values are vectors: averaged ones are made unit again
};

/// Fills empty texels near baked ones, as a bake does at its end: each takes the value of the nearest baked
/// texel (Euclidean, ties to the lowest row, then column). The same bytes on every device. Nothing is kept, and
/// no callback comes. Thread safety: several threads may call it, for images of their own.
/// \param device    finds the nearest texels
/// \param image     in and out: values of baked texels never change
/// \param coverage  in and out: one TexelState a texel; what is filled becomes padding
/// \returns how many texels became padding
/// \throws Error(usage), `padding-size` for a coverage of another size than the image, `padding-range`;
///         Error(device)
std::uint64_t fill_padding(const Device& device, Image& image, std::span<std::uint8_t> coverage,
                           const PaddingOptions& options = {});

/// Settings by which bake_attribute() resolves samples to texels.
struct AttributeOptions {
  bool unit_vectors = false;              ///< Three channels whose means are made unit
  std::int32_t padding = kPaddingTexels;  ///< As PaddingOptions::texels
};

/// A map of the caller's own values.
struct BakedAttribute {
  Image image = {};                         ///< As they are: no encoding. 0 where empty or missed
  std::vector<std::uint8_t> coverage = {};  ///< Per texel: values of TexelState
};

/// Resolves the caller's own values at the high poly's vertices to texels: what bake() does for its maps.
///
/// A sample takes the values at its triangle's corners by its barycentric weights, in double precision; a
/// texel the mean of its samples that found a point. Values that are not finite pass through. Nothing is welded:
/// vertices at one place may have values of their own.
/// Lifetimes: all is read during the call. Threads: several may bake from one Source and Match. No callback
/// comes.
/// \param match     of match(), bake() or load_match(); checked by validate()
/// \param source    that the match was made for
/// \param values    [vertices * channels] of the high poly, vertex after vertex; not kept
/// \param channels  1 to 4
/// \throws Error(usage), `attribute-size` for values of another number, `attribute-channels`;
///         Error(input), `match-source` and what validate() names; Error(device)
BakedAttribute bake_attribute(const Match& match, const Source& source,
                              std::span<const float> values, std::uint32_t channels,
                              const AttributeOptions& options = {});

}  // namespace kiln

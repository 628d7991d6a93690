#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/device.h"
#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/match.h"
#include "kiln/source.h"

namespace KILN_PUBLIC kiln {

/// Padding: texels around charts receive values from the chart.
struct PaddingOptions {
  /// Width of the padding, 0 to 16384 texels; -1: fill the whole map by push-pull (Gortler et al.
  /// 1996)
  std::int32_t texels = kPaddingTexels;
  /// Fill missed texels, too (TexelState::missed), from neighbouring baked texels
  bool fill_missed = false;
  bool unit_vectors = false;  ///< Values are unit vectors: averages are normalised
};

/// Fills empty texels near baked ones, as the last step of a bake does: each gets the value of the nearest baked texel
/// (by Euclidean distance; of several, the one in the lowest row, then column). The same bytes on every device. No
/// argument is kept, and no callback is called. Thread safety: several threads may call it, each for an image of its
/// own.
/// \param device    computes the nearest texels
/// \param image     in and out: values of baked texels never change
/// \param coverage  in and out: one TexelState per texel; filled texels become padding
/// \returns number of filled texels
/// \throws Error(usage), `padding-size` if sizes of coverage and image differ, `padding-range`; Error(device)
std::uint64_t fill_padding(const Device& device, Image& image, std::span<std::uint8_t> coverage,
                           const PaddingOptions& options = {});

/// Settings of bake_attribute().
struct AttributeOptions {
  /// Values are unit vectors of three channels: means are normalised
  bool unit_vectors = false;
  /// Width of the padding, 0 to 16384 texels; -1: fill the whole map
  std::int32_t padding = kPaddingTexels;
};

/// A map of the caller's own values.
struct BakedAttribute {
  Image image = {};  ///< Values without encoding, rows from the top; 0 in empty and missed texels
  std::vector<std::uint8_t> coverage = {};  ///< State of each texel: values of TexelState
};

/// Bakes the caller's own values at the high poly's vertices: bake() for an attribute.
///
/// A sample interpolates the values at its triangle's corners by barycentric weights, in double precision. A
/// texel is the mean of its samples with a matched point. Values that are not finite are averaged like
/// others. Nothing is welded: vertices at the same position may have different values. Lifetimes: arguments
/// are read during the call. Threads: several may bake from one Source and Match. No callback is called.
/// \param match     from match(), bake() or load_match(); checked by validate()
/// \param source    the one that the match was made for
/// \param values    [vertices * channels] of the high poly, vertex after vertex; not kept
/// \param channels  1 to 4
/// \throws Error(usage), `attribute-size` for a wrong number of values, `attribute-channels`; Error(input),
///         `match-source` and the errors of validate(); Error(device)
BakedAttribute bake_attribute(const Match& match, const Source& source,
                              std::span<const float> values, std::uint32_t channels,
                              const AttributeOptions& options = {});

}  // namespace kiln

// Blends a match into its fallback, so that the map has no step at the border between them.
//
// A fallback decides samples that the method leaves undecided. So only samples of the method have
// both values, which are blended by smoothstep: at the border they get the fallback's value, and
// farther away the method's value.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "cl/context.h"
#include "detail/band_reads.h"
#include "match/matcher.h"
#include "mesh/low_surface.h"
#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Collects the method that found the point of each texel, band by band, then re-bakes texels near the border with both
/// methods.
///
/// A texel belongs to the fallback if any of its samples does. Distances are lengths of paths over texels whose points
/// the method found, with steps to the eight neighbours on the surface, also across seams. They exceed straight
/// distances by up to 8%.
class FallbackBlend {
 public:
  /// Creates a blend. \param reach  width of the blend in texels, above 0
  FallbackBlend(std::uint32_t width, std::uint32_t height, std::uint32_t reach);

  void record_band(BandReads& reads, const TexelBand& band,
                   std::span<const DecidingMethod> deciding_methods);

  /// Computes the distance of every texel from the border, after all bands.
  void plan(const LowSurface& surface);

  /// Weight of the method's value in a texel: 0 at the border, 1 at a distance of `reach` or more, and 1 in texels
  /// that the method did not decide.
  float share(std::size_t texel) const;

  /// True if a band has texels that are blended.
  bool has_blended_texels(const TexelBand& band) const;

  /// Function that recomputes texels of a band as blends. It receives the fallback's correspondences, and for each
  /// sample the weight of the match.
  using Make =
      std::function<void(const DeviceCorrespondence& other, const cl::Array<float>& shares)>;

  /// Recomputes the texels of a band that lie near the border, as blends of the match and its fallback. Texels for
  /// which the fallback finds no point stay unchanged. \param matcher the last band that it matched must be this
  /// one \param make function that recomputes texels; called once, or not at all if no texel is blended
  /// \returns number of texels that the fallback contributes to
  std::uint64_t run(cl::Context& context, const TexelBand& band, Matcher& matcher,
                    const Make& make);

 private:
  std::uint32_t width_, height_, reach_;
  // Triangle of the low poly in each texel; freed by plan()
  std::vector<std::uint32_t> texel_triangles_;
  std::vector<std::uint8_t> texel_methods_;  // deciding method of each texel
  // distance of each texel from the border, in 1 / kStraightCost texels
  std::vector<std::uint32_t> border_costs_;
  DeviceCorrespondence found_, other_;
};

}  // namespace kiln

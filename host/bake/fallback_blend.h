// No step in the map where a match gives way to its fallback.
//
// A fallback decides what the method leaves undecided, so it is the method's own samples that can take both:
// next to the border they are the fallback's, and from there they become the method's, by smoothstep.
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

/// Collects who decided the texels, band by band; then bakes those near the border again, with both.
///
/// A texel is the fallback's where any of its samples is. Distances are in texels, over steps to the eight
/// neighbours on the surface (so seams are no border), on texels that the method decided: up to 8% more
/// than they are straight on.
class FallbackBlend {
 public:
  /// \param reach  texels, above 0
  FallbackBlend(std::uint32_t width, std::uint32_t height, std::uint32_t reach);

  void store(BandReads& reads, const TexelBand& band, std::span<const Decider> deciders);

  /// After all bands: the distance of every texel from the border.
  void plan(const LowSurface& surface);

  /// Weight of the method's normal in a texel: 0 at the border, 1 from the reach on, and everywhere on
  /// texels that are not the method's.
  float share(std::size_t texel) const;

  /// True if a band has texels that take both.
  bool touches(const TexelBand& band) const;

  /// Makes a band's texels again, blended: told what the fallback found, and how much of the match each
  /// sample keeps.
  using Make =
      std::function<void(const DeviceCorrespondence& other, const cl::Array<float>& shares)>;

  /// Bakes a band again, blended. Texels of which the fallback finds nothing come out as before.
  /// \param matcher  has run the band last
  /// \param make     called once, or not at all where nothing is blended
  /// \returns how many texels took some of the fallback's
  std::uint64_t run(cl::Context& context, const TexelBand& band, Matcher& matcher,
                    const Make& make);

 private:
  std::uint32_t width_, height_, reach_;
  std::vector<std::uint32_t> triangle_;  // of the low poly, of each texel; gone after plan()
  std::vector<std::uint8_t> decider_;    // of each texel
  std::vector<std::uint32_t> cost_;      // from the border, in kStraight a texel
  DeviceCorrespondence found_, other_;
};

}  // namespace kiln

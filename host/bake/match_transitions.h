// Measures jumps in value between neighbouring texels whose points were found by different match methods.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "detail/band_reads.h"
#include "kiln/bake.h"
#include "match/matcher.h"
#include "texel/texels.h"

namespace kiln {

/// Collects the method that found the point of each texel, band by band.
class MethodTransitions {
 public:
  /// Creates an empty collection.
  /// \param low       the low poly, with UVs
  /// \param with_uvs  LowSurface::with_uvs
  MethodTransitions(const Mesh& low, std::span<const std::uint32_t> with_uvs, std::uint32_t width,
                    std::uint32_t height);

  /// Records the method of each texel's first sample.
  /// \param deciding_methods  for each sample of the band, the method that found its point
  void record_band(BandReads& reads, const TexelBand& band,
                   std::span<const DecidingMethod> deciding_methods);

  /// Compares the map's unit vectors between neighbouring texels of one chart. Neighbours of different charts, and
  /// texels across a seam, are not compared.
  TransitionReport measure(const Image& image) const;

 private:
  std::uint32_t width_;
  std::vector<std::uint32_t> chart_of_triangle_;
  // Deciding method of each texel as 1 + DecidingMethod; 0 if not covered
  std::vector<std::uint8_t> texel_methods_;
  std::vector<std::uint32_t> texel_charts_;  // Chart of each texel
};

}  // namespace kiln

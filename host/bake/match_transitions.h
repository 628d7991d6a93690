// Steps in the map between neighbouring texels that different methods decided.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "detail/band_reads.h"
#include "kiln/bake.h"
#include "match/matcher.h"
#include "texel/texels.h"

namespace kiln {

/// Collects which method decided each texel, band by band.
class MatchTransitions {
 public:
  /// \param low  with UVs
  MatchTransitions(const Mesh& low, std::uint32_t width, std::uint32_t height);

  /// A texel counts by its first sample. \param deciders  of the band's samples
  void store(BandReads& reads, const TexelBand& band, std::span<const Decider> deciders);

  /// Compares the map's unit vectors over sides that two texels of one chart share. Texels whose charts lie
  /// edge to edge are not compared, nor are those across a seam.
  TransitionReport measure(const Image& image) const;

 private:
  std::uint32_t width_;
  std::vector<std::uint32_t> chart_of_triangle_;
  std::vector<std::uint8_t> method_;  // of each texel, 0: not covered, else 1 + Decider
  std::vector<std::uint32_t> chart_;  // of each texel
};

}  // namespace kiln

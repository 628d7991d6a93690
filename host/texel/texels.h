// Texel samples: points of the low poly that texels represent.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cl/context.h"
#include "kiln/error.h"
#include "mesh/low_surface.h"
#include "texel/small_charts.h"

namespace kiln {

/// The covered texels of a band of rows, and their samples, on the device.
///
/// Samples are compacted and ordered so that neighbours in the texture are neighbours in memory
/// (blocks of 8x8 samples); the samples of a texel follow each other.
struct TexelBand {
  std::uint32_t first_row = 0;
  std::uint32_t row_count = 0;
  std::uint32_t texel_count = 0;
  std::uint32_t sample_count = 0;
  /// Number of samples along a texel's side: a whole texel has N x N samples
  std::uint32_t samples = 1;
  std::uint32_t capacity = 0;  ///< Number of elements in each plane of the arrays below
  cl::Array<std::uint32_t>
      texel_index;  ///< [texel_count] index in the band: (row - first_row) * width + column
  cl::Array<std::uint32_t> texel_first;  ///< [texel_count + 1] first sample of each texel
  cl::Array<std::uint32_t> sample_slot;  ///< [sample_count] index within the texel: sy * N + sx
  cl::Array<std::uint32_t> triangle;     ///< [sample_count] triangle of the low poly
  /// Two arrays, one after the other: weights of corner 1, then of corner 2
  cl::Array<float> barycentric;
  /// Seven arrays, one per component: position x y z, unit direction x y z, reach (the length of the
  /// direction before it was normalized)
  cl::Array<float> points;
  /// Triangles of small charts, whose samples are not at the texels' centres (SmallCharts), ascending; null
  /// if there are none. Owned by the sampler.
  const std::vector<std::uint32_t>* small_triangles = nullptr;
};

struct TexelOptions {
  std::uint32_t width = 1024;
  std::uint32_t height = 1024;
  /// Number of samples along a texel's side, 1 to 16: N x N samples per texel
  std::uint32_t samples = 1;
  /// Maximum number of samples in a band, which limits device memory
  std::uint32_t max_samples_per_band = 1 << 22;
  /// True: charts that contain no sample's centre are assigned free texels; see SmallCharts
  bool small_charts = true;
};

/// Statistics of the UV layout over all bands.
struct TexelReport {
  std::uint64_t texels = 0;  ///< Number of texels with at least one sample
  std::uint64_t samples = 0;
  std::uint64_t overlapping_samples = 0;  ///< Number of samples that more than one triangle covers
  /// Warnings "uv-overlap", "uv-outside", "uv-degenerate", "uv-missing" and "low-degenerate", each with the
  /// count, the rule that was applied, and an example
  std::vector<Warning> warnings;
};

/// Scan-converts the UV charts of a low poly, band by band.
///
/// A sample is covered if its centre lies inside a UV triangle by the top-left rule, in fixed point. So triangles that
/// share an edge cover each sample once. Where triangles overlap, the lowest index wins and the overlap is counted.
/// Parts outside the unit square have no texels, and are counted. Triangles without UV area cover nothing, and are
/// counted. Winding does not matter (mirrored charts are baked).
///
/// Charts between the centres of samples are then assigned uncovered texels: see SmallCharts. All samples of such a
/// texel are on its triangle (TexelPieces::add_assigned_texels).
class TexelSampler {
 public:
  /// \throws Error(usage) for a size of 0 or above 16384, or samples of 0 or above 16
  TexelSampler(cl::Context& context, const LowSurface& surface, const TexelOptions& options);
  ~TexelSampler();
  TexelSampler(TexelSampler&&) noexcept;

  std::uint32_t band_count() const;
  /// Samples one band. Bands may be sampled in any order; a band that is sampled again is counted
  /// once.
  /// \param recycled a band that is no longer needed; arrays that are large enough are reused (allocating them takes
  ///     a tenth of a second for 10 million samples on a CPU)
  TexelBand sample(std::uint32_t band, TexelBand recycled = {});
  /// The report; complete when every band has been sampled.
  const TexelReport& report() const;
  /// Charts that contain no sample's centre, and their texels. Empty without TexelOptions::small_charts.
  const SmallCharts& small_charts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln

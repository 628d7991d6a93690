// Fills the report of a bake: times, counts and warnings.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "detail/band_reads.h"
#include "kiln/bake.h"
#include "source/high_poly.h"
#include "texel/device_correspondence.h"
#include "texel/small_charts.h"

namespace kiln {

/// Maximum number of samples in a band, which limits device memory.
constexpr std::uint32_t kBandSamples = 1U << 20;

/// Maximum number of samples in a band if the high poly is larger than memory: each band reads all of it, so fewer
/// and larger bands are faster.
constexpr std::uint32_t kStreamedBandSamples = 1U << 22;
/// Maximum number of samples in a band of a bake. Smoothed occlusion depends on where bands end, so its bands are always
/// those of a high poly in memory.
std::uint32_t band_samples(const Source::Impl& high, const BakeOptions& options);

/// Resets counts of samples to 0.
void clear_counts(BakeReport& report);

/// Adds the statistics of a band's correspondence to the report. Distances are summed per block in
/// a fixed order.
/// \param reads  the band's arrays on the host
/// \param unit   world units per frame unit
void count_samples(BandReads& reads, const DeviceCorrespondence& match, double unit,
                   BakeReport& report, double& distance_sum);

/// Raises normals below the surface to the horizon, since encodings without the third component lose its sign, and
/// warns about them. The texel's mean normal decides, not its samples. The count includes texels that an earlier bake
/// of a session raised.
/// \param image  unit vectors before encoding; coverage as in Layers
void flatten_below_surface(std::string_view map, Image& image,
                           std::span<const std::uint8_t> coverage, BakeReport& report);

/// Warns if a layout covers nearly nothing of a map, as UVs in a wrong scale do.
/// \param size number of texels of the map
void warn_about_coverage(std::uint64_t size, BakeReport& report);

/// Warns if no texel is covered, or if many samples were missed.
void warn_about_misses(BakeReport& report);

/// Object, group and material of a triangle, such as "object 'bolt', material 'steel'"; empty without names.
std::string triangle_names(const Mesh& mesh, std::uint32_t triangle);
/// A triangle's name in messages: "triangle 5 (object 'bolt')".
std::string describe_triangle(const Mesh& mesh, std::uint32_t triangle);

/// Adds a warning if charts of the low poly contain no texel's centre.
void warn_about_small_charts(const SmallCharts& small, const Mesh& low,
                             std::vector<Warning>& warnings);

}  // namespace kiln

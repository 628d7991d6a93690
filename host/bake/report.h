// Report of a bake: seconds, counts, warnings.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "detail/band_reads.h"
#include "kiln/bake.h"
#include "texel/device_correspondence.h"
#include "texel/small_charts.h"

namespace kiln {

/// Most samples of a band of a bake: bounds the device's memory.
constexpr std::uint32_t kBandSamples = 1U << 20;

/// Counts of samples start from 0.
void clear_counts(BakeReport& report);

/// Adds a band's correspondences to the report. Distances are added per block in a fixed order.
/// \param reads  of the band
/// \param unit   world length of a frame unit
void count_samples(BandReads& reads, const DeviceCorrespondence& match, double unit,
                   BakeReport& report, double& distance_sum);

/// Pulls texels whose normals point below the surface up to the horizon, and warns of them: where the third
/// component is left out, it has no sign. A texel counts by its own normal, not by its samples'. One that
/// was pulled up before, and not baked anew, counts again.
/// \param image  unit vectors as they are, before encoding; coverage as of Layers
void flatten_below_surface(std::string_view map, Image& image,
                           std::span<const std::uint8_t> coverage, BakeReport& report);

/// Warns where a layout covers next to nothing of a map: UVs in a wrong scale look like that.
/// \param size  texels of the map
void warn_about_coverage(std::uint64_t size, BakeReport& report);

/// Warns where there is nothing to bake to, or much was missed.
void warn_about_misses(BakeReport& report);

/// The object, group and material of a triangle: "object 'bolt', material 'steel'"; empty where it has none.
std::string names_of(const Mesh& mesh, std::uint32_t triangle);
/// A triangle as messages name it: "triangle 5 (object 'bolt')".
std::string name_of(const Mesh& mesh, std::uint32_t triangle);

/// Adds a warning where charts of the low poly hold no texel's centre.
void warn_about_small_charts(const SmallCharts& small, const Mesh& low,
                             std::vector<Warning>& warnings);

}  // namespace kiln

// Speed against accuracy of maps from volumes: straight from the voxels, or the full contour baked.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "lab/chart.h"
#include "picture/plot.h"
#include "report/report.h"

namespace kiln::cli {

/// How a map of a volume's surface comes about.
struct VolumeWay {
  std::string name;    ///< In files, before _SIZE: letters, digits and _
  std::string label;   ///< In the picture
  std::string family;  ///< Marks drawn alike: "none", "direct", "rays", "views", "closest"
  std::optional<BakeOptions> bake;  ///< The full contour baked so; else no bake
  bool every_size = false;          ///< At half and twice the size, too
};
constexpr const char* kNoMap = "none";        ///< The low poly's own normals
constexpr const char* kDirectMap = "direct";  ///< extract()'s map

/// What is compared.
std::vector<VolumeWay> volume_ways();

struct VolumeChartOptions {
  std::vector<VolumeWay> ways = volume_ways();
  ExtractOptions extract;  ///< Surface, faces, charts' border; size and space are the chart's
  std::uint32_t size = 1024;
  Length max_distance = Length::share(0.02);
  std::uint32_t repeat = 3;
  std::uint32_t pixels = 512;  ///< A side of the pictures whose normals are measured
};

/// Of one timed run, from the volume in memory to low poly and map. What several ways share counts for each:
/// the full contour, once; the low poly and its UVs.
struct VolumeSeconds {
  double contour = 0;  ///< The finest contour; for a bake as a mesh, too
  double light = 0;    ///< Simplifying, and UVs where there is a map
  double build = 0;    ///< Putting the high poly on the device, structures
  double map = 0;      ///< Splatting; the rest of the bake
  double total = 0;    ///< Wall clock of all that
};

/// Mean angles.
enum class VolumeMeasure {
  gradient,  ///< Of the map's texels to the field's gradient on the shading normal's line
  picture,   ///< Rendered normals to the full contour's, over views that nothing is matched from
};
constexpr std::array<VolumeMeasure, 2> kVolumeMeasures = {VolumeMeasure::gradient,
                                                          VolumeMeasure::picture};
/// As in the files' columns.
const char* measure_name(VolumeMeasure measure);

struct VolumeRow {
  std::string name, label, family;
  std::uint32_t size = 0;             ///< Texels a side; 0: no map
  std::optional<BakeReport> report;   ///< Of a bake, which is not timed
  GradientError gradient;             ///< GradientLine::shading
  GradientError gradient_along_face;  ///< GradientLine::face
  NormalError picture;
  std::vector<VolumeSeconds> runs;
  VolumeSeconds seconds;  ///< The run whose total is their median
  std::array<bool, kVolumeMeasures.size()> on_front{};

  double error(VolumeMeasure measure) const;
  bool front(VolumeMeasure measure) const { return on_front[static_cast<std::size_t>(measure)]; }
};

/// The low poly's atlas for one size of map, and what could be compared there.
struct VolumeSize {
  std::uint32_t size = 0;
  std::uint64_t covered = 0;                               ///< Texels of the low poly
  std::uint64_t no_surface = 0, cut = 0, no_gradient = 0;  ///< See GradientReference
  double texels_per_cell = 0;
};

struct VolumeChart {
  std::string path, name;
  std::array<std::uint32_t, 3> voxels{};
  ExtractReport light;                ///< At the given size
  std::uint64_t dense_triangles = 0;  ///< Of the full contour
  double diagonal = 0,
         max_distance = 0;  ///< World units; max_distance: also how far the surface is looked for
  std::vector<VolumeSize> sizes;
  std::vector<VolumeRow> rows;
  std::vector<Warning> warnings;
};

/// \returns nothing where progress said stop
/// \throws Error as extract(); Error(input) where nothing can be compared
std::optional<VolumeChart> run_volume_chart(const Device& device, const Volume& volume,
                                            const VolumeChartOptions& options,
                                            const Progress& progress);

/// Of chart.csv, .md and .png.
std::string volume_chart_data(const std::vector<VolumeChart>& charts);
std::string volume_chart_table(const std::vector<VolumeChart>& charts,
                               const VolumeChartOptions& options, const DeviceInfo& device);
Plot volume_chart_plot(const std::vector<VolumeChart>& charts, const VolumeChartOptions& options,
                       const DeviceInfo& device);
/// One line for a person.
std::string summary(const VolumeRow& row);
/// Everything of a volume's chart, for the report.
Json describe(const VolumeChart& chart);

}  // namespace kiln::cli

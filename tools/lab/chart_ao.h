// Ambient occlusion, speed against error: by rays, by rays whose noise is smoothed, and by depth views.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/kiln.h"
#include "report/report.h"

namespace kiln::cli {

/// Ways to gather ambient occlusion that are drawn alike.
enum class AoFamily {
  rays,    ///< So many a texel sample, and nothing is smoothed
  smooth,  ///< So many a texel sample, smoothed over the surface
  views,   ///< Depth views from all around
};
const char* family_name(AoFamily family);

/// One mark of the panel.
struct AoSetting {
  std::string name;   ///< In files: ao_rays_64
  std::string label;  ///< In the picture
  std::string flags;  ///< Of `kiln bake`, which say the same
  AoFamily family = AoFamily::rays;
  OcclusionOptions occlusion;
};

/// 8 to 1024 rays, plain and smoothed; 64 to 512 views.
std::vector<AoSetting> ao_settings();

/// What is timed, and with what.
struct AoChartOptions {
  std::vector<AoSetting> settings;
  std::uint32_t size = 1024;  ///< Texels a side of the map
  Length max_distance = Length::share(0.02);
  std::uint32_t repeat = 3;      ///< Timed runs of each setting
  std::optional<double> budget;  ///< Seconds: which setting is nearest to the truth within them
  std::optional<double> error;   ///< A share of 1: which setting reaches it in the fewest seconds
};

/// One setting, as measured.
struct AoRow {
  AoSetting setting;
  MapError error;            ///< Against 4096 rays from the same points, 1/255
  std::vector<double> runs;  ///< Seconds to gather, in order
  double seconds = 0;        ///< Their median
  bool front = false;        ///< Nothing else is both faster and nearer
};

/// All settings of one pair of meshes.
struct AoChart {
  std::vector<AoRow> rows;
  /// Of rows; none where AoChartOptions does not ask.
  std::optional<std::size_t> for_budget, for_error;
  bool within_budget = false, reaches_error = false;
};

/// Bakes with every setting once for the errors, then `repeat` times in turns for the seconds. The seconds are
/// those of the map alone: the match, the hierarchy of the high poly and files are left out.
/// \returns nothing where progress said stop
std::optional<AoChart> run_ao_chart(const Device& device, const Mesh& high, const Mesh& low,
                                    const AoChartOptions& options, const Progress& progress);

/// The rows that a budget and an error choose. Where none is within: the fastest, or the nearest.
void choose_ao(const AoChartOptions& options, AoChart& chart);

/// Comma-separated values. \param pair  its number, from 1
std::string ao_data_head();
std::string ao_data(std::size_t pair, const AoChart& chart);

/// A table in Markdown.
std::string ao_table(const AoChart& chart, const AoChartOptions& options);

/// A panel for a group of the chart's plot, and the styles of its marks.
Json ao_panel(const AoChart& chart);
Json ao_styles(const AoChart& chart);

/// For the report.
Json describe(const AoChart& chart, const AoChartOptions& options);

/// Lines for a person: each setting, and what is chosen.
std::vector<std::string> summary(const AoChart& chart, const AoChartOptions& options);

}  // namespace kiln::cli

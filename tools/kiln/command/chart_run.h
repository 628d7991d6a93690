// What `kiln chart` over meshes and over volumes share.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "arguments/dense_input.h"
#include "arguments/surface_arguments.h"
#include "kiln/kiln.h"
#include "lab/chart.h"
#include "lab/plot.h"

namespace kiln::cli {

struct ChartArguments {
  std::vector<std::string> meshes;       ///< Or volumes
  HeightArguments heights;               ///< Of all height fields
  SurfaceArguments surface;              ///< Of volumes
  std::vector<std::string> for_volumes;  ///< Options given that meshes have no use for
  std::string out, device;
  std::string max_distance = "2%";
  std::vector<std::string> settings;
  ChartOptions options;
  bool quiet = false;
};

/// What every chart leaves, and what was wrong.
struct ChartFiles {
  std::vector<std::string> outputs;  ///< The report last, which is not written yet
  std::vector<Warning> warnings;
  bool cancelled = false;
};

/// Writes data, table and plot of a chart into a folder.
ChartFiles save_chart_files(const std::filesystem::path& folder, const std::string& data,
                            const Plot& plot, const std::string& table);

/// How far a chart's progress is when files are written.
inline constexpr double kChartAtSave = 0.98;

/// Runs `kiln chart` over volumes, checked. \returns the exit code
int run_volumes_command(const ChartArguments& a);

}  // namespace kiln::cli

// What `kiln chart` over meshes and over volumes share.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "arguments/dense_input.h"
#include "arguments/surface_arguments.h"
#include "kiln/kiln.h"
#include "lab/chart.h"
#include "picture/plot.h"

namespace kiln::cli {

struct ChartArguments {
  std::vector<std::string> meshes;       ///< Or volumes
  HeightArguments heights;               ///< Of all height fields
  SurfaceArguments surface;              ///< Of volumes
  std::vector<std::string> for_volumes;  ///< Options given that meshes have no use for
  std::string out, device;
  std::string max_distance = "2%";
  std::vector<std::string> settings;
  std::optional<std::uint32_t> directions;  ///< Of viewing rays
  bool ao = false;                          ///< Also ambient occlusion
  std::optional<double> ao_error;           ///< A share of 1
  std::optional<double> ao_budget;          ///< Seconds
  bool plan = false;                        ///< Bytes against error of high polys alone
  std::vector<std::string> max_errors;      ///< To plan for, degrees
  std::string screen;                       ///< Of plans: pixels wide; empty: none
  std::vector<std::string> not_for_plans;   ///< Options given that plans have no use for
  ChartOptions options;
  bool quiet = false;
};

/// What every chart leaves, and what was wrong.
struct ChartFiles {
  std::vector<std::string> outputs;  ///< The report last, which is not written yet
  std::vector<Warning> warnings;
  bool cancelled = false;
};

/// Writes data, table and plot of a chart into a folder. \param ao_data  where there is some, a file more
ChartFiles save_chart_files(const std::filesystem::path& folder, const std::string& data,
                            const Plot& plot, const std::string& table,
                            const std::string& ao_data = "");

/// Settings of ambient occlusion: those named; all where it is asked for and none is named.
AoChartOptions ao_options(const ChartArguments& a);
/// Before any work. \throws Error(usage)
void check_ao(const ChartArguments& a);
/// Gathers ambient occlusion of a pair. \returns false where progress said stop
bool add_ao(const Device& device, const Mesh& high, const Mesh& low, const AoChartOptions& options,
            const Progress& progress, ChartPair& pair, Json& json);

/// How far a chart's progress is when files are written.
inline constexpr double kChartAtSave = 0.98;

/// The name that stands for the settings that suit hard surfaces.
inline constexpr const char* kHard = "hard";
/// Every setting of charts of meshes, by name.
std::vector<std::string> mesh_setting_names();
/// The names that `hard` stands for in its place.
void expand_settings(ChartArguments& a);
/// By the first input: all are of one kind.
bool has_volumes(const ChartArguments& a);
/// Among the high polys.
bool has_height_fields(const ChartArguments& a);
/// All but the settings' own values, before any work. \throws Error(usage)
void check_chart(const ChartArguments& a);

/// Adds --plan and --max-error.
void add_plan_options(Command& command, ChartArguments& a);
/// Those that --plan has no use for, of what the command has by now.
std::vector<const Option*> options_not_for_plans(const Command& command);
/// Before any work. \throws Error(usage)
void check_plan(const ChartArguments& a);
/// Runs `kiln chart --plan`, checked. \returns the exit code
int run_plan_command(const ChartArguments& a);

/// Runs `kiln chart` over volumes, checked. \returns the exit code
int run_volumes_command(const ChartArguments& a);

}  // namespace kiln::cli

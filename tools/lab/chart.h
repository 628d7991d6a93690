// Common code of charts that plot speed against accuracy: marks, their plot, and running and saving a chart.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "arguments/surface_arguments.h"
#include "job/describe.h"
#include "job/job_options.h"
#include "lab/lab_arguments.h"
#include "lab/lab_run.h"
#include "lab/table.h"
#include "picture/plot.h"

namespace kiln::cli {

constexpr const char* kChartName = "chart";  ///< Stem of the names of a chart's files

/// A setting that is timed and measured: one mark in the plot.
struct Mark {
  std::string name;               ///< Name in files, of letters, digits and _
  std::string label;              ///< Label of the mark in the plot
  std::string family;             ///< Name of the family; all marks of a family have the same style
  Json figures = Json::object();  ///< The mark's part of the report, which finish_marks() completes
  /// Seconds of each run, in order: an object with the seconds of each stage, or a number
  std::vector<Json> runs = {};
  std::vector<double> run_seconds = {};  ///< For each run, the seconds that are compared
  double seconds = 0;                    ///< Median of the compared seconds
};

/// A measure of errors, for one axis of a plot.
struct Measure {
  std::string name;         ///< Name of the measure in files
  std::string path;         ///< Path of the error in Mark::figures
  std::string title, unit;  ///< Title and unit in the plot
  double scale = 1;         ///< Factor by which drawn errors are multiplied
};

/// The drawing style of a family's marks.
struct MarkStyle {
  const char *family, *title, *mark, *color;
};

/// Times all marks alternately, so that other load on the machine affects all of them equally.
/// \param run  times the mark with an index. The note, such as ", run 2 of 3", is appended to the name of the stage in
///   progress reports. Returns null if cancelled
/// \returns false if cancelled
bool time_in_turns(std::vector<Mark>& marks, std::uint32_t repeat,
                   const std::function<Json(std::size_t mark, const std::string& note)>& run);
/// Sets the seconds of timed marks, and adds to their figures: "seconds" of the median run, "seconds_least",
/// "seconds_most", "runs", and "on_front" by measure (Pareto-optimal: no other mark is both faster and more accurate).
/// \param counted  path of the compared seconds
/// \returns "settings" with the figures of all marks, and "front" with the names on each measure's Pareto front, the
///          fastest first
Json finish_marks(std::vector<Mark>& marks, const char* counted,
                  const std::vector<Measure>& measures);
/// Makes a panel of a chart's plot.
Json chart_panel(const std::vector<Mark>& marks, const Measure& measure);

/// A match with its options, as one setting of a chart.
struct ChartSetting {
  std::string name, label, family;  ///< Name, label and family as in Mark
  BakeOptions bake;  ///< Match and number of samples; size, distance and maps come from the chart
  bool find_cage = false;  ///< Uses --cage auto; finding the cage is timed as a part of the match
};
/// Parses flags of `kiln bake`, each with its value, to a job.
Job bake_job(const std::string& flags);
/// The compared settings, including the reference. Matching by UVs only suits pairs with equal layouts.
std::vector<ChartSetting> chart_settings();
/// Appends a setting for each match that none of `settings` uses, except matches along a given direction.
void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings);
/// All settings, including those for hard surfaces that are only compared if they are named: other directions and
/// cages.
std::vector<ChartSetting> all_chart_settings();
/// Names of the settings that --settings hard selects.
const std::vector<std::string>& hard_settings();
/// Name of the setting whose map is the reference for all others.
constexpr const char* kChartReference = "ray_4x4";
/// Names of the settings in charts of volumes.
std::vector<std::string> volume_setting_names();
/// A setting of ambient occlusion.
struct AoSetting {
  std::string name, label, family;  ///< Name, label and family as in Mark
  std::string flags;                ///< Flags of `kiln bake` that make the setting
};
std::vector<std::string> ao_setting_names();

/// Arguments of `kiln chart`.
struct ChartArguments : LabArguments {
  ChartArguments() { size = 1024, pixels = 512, directions = 512; }

  std::vector<std::string> meshes;  ///< Files of meshes or of volumes
  SurfaceArguments surface;         ///< Options for contouring volumes
  std::vector<std::string> settings;
  std::uint32_t repeat = 3;  ///< Number of timed runs of each setting
  bool ao = false;           ///< True to add a chart of ambient occlusion
  /// Error bound for the choice among settings of ambient occlusion, 0 to 1, where 1 is the range from black to white
  std::optional<double> ao_error;
  /// Time limit in seconds for the choice among settings of ambient occlusion
  std::optional<double> ao_budget;
  bool plan = false;  ///< If true, plans are charted, by bytes and error; no low polys are given
  std::vector<std::string> max_errors;  ///< Error bounds of plans in degrees
  std::string screen;                   ///< Value of --screen for plans; empty: none

  /// True if --settings includes the setting.
  bool names(const std::string& setting) const;
};

/// A table of figures, for the text and for a data file.
struct ChartTable {
  std::string note;  ///< Text above the table
  /// Columns of the table in the text; empty: the rows are only for the data file
  std::vector<Column> columns;
  Json rows;
  /// Suffix of the data file, such as ".csv" or "_ao.csv"; null: no data file
  const char* data = nullptr;
};

/// The measurements of one input.
struct ChartGroup {
  std::string title;
  std::string note;  ///< Text below the title in the picture
  Json report;       ///< The group's part of chart.json
  std::vector<ChartTable> tables;
  std::vector<std::string> lines;  ///< Lines after the tables
  Json panels = Json::array();     ///< Panels of chart.png
};

/// A kind of chart: its inputs and measurements. run_chart() calls the functions in their order, and writes the
/// results.
class ChartKind {
 public:
  virtual ~ChartKind() = default;

  const char *input_key,
      *inputs_key;  ///< Key of an input's number in data, and key of all inputs in the report
  std::vector<std::string> inputs;  ///< Input files, each measured separately
  /// Explanation of the figures, which is printed above all tables
  std::string explanation;
  Json options = Json::object();           ///< Options for the report that differ from the flags
  std::vector<Warning> warnings;           ///< Warnings about the whole run
  std::vector<Warning> settings_warnings;  ///< Warnings about single settings
  // Titles of chart.png if it shows speed. The device and the number of runs are appended to the subtitle.
  std::string title, subtitle;
  const char* seconds_title = "";
  std::span<const MarkStyle> styles;

  /// Checks the inputs for errors that would otherwise stop a long run at a late stage. \returns false if cancelled
  virtual bool check_inputs(const Progress& progress);
  virtual void read(std::size_t input) = 0;
  /// Measures the last input that was read. \returns nullopt if cancelled
  virtual std::optional<ChartGroup> measure(const Device& device, std::size_t input,
                                            const Progress& progress) = 0;
  /// Makes the data of chart.png.
  virtual Json plot(const DeviceInfo& device, const std::vector<ChartGroup>& groups) const;

 protected:
  ChartKind(const ChartArguments& arguments, const char* input, const char* all)
      : input_key(input), inputs_key(all), inputs(arguments.meshes), a_(arguments) {}

  void add_warnings(const std::vector<Warning>& more, std::vector<Warning>& to) const {
    to.insert(to.end(), more.begin(), more.end());
  }

  const ChartArguments& a_;
};
std::unique_ptr<ChartKind> chart_of_matches(const ChartArguments& arguments);
std::unique_ptr<ChartKind> chart_of_volumes(const ChartArguments& arguments);
std::unique_ptr<ChartKind> chart_of_plans(const ChartArguments& arguments);

/// The selected settings of ambient occlusion.
std::vector<AoSetting> ao_settings(const ChartArguments& arguments);
/// Bakes once with every setting to measure the errors, then alternately with all settings to measure the seconds. The
/// seconds are those of the map alone, without the match, the BVH and file access. Errors are root mean squares as
/// shares of 1.
/// \param steps  progress: one step per bake, and one per measurement
/// \returns false if cancelled
bool add_ao(const Device& device, const Mesh& high, const Mesh& low,
            const ChartArguments& arguments, const std::vector<AoSetting>& settings, Steps& steps,
            ChartGroup& group);

/// Reads a mesh or a height field of the inputs.
HighPolyInput read_high(const ChartArguments& arguments, const std::string& path,
                        std::vector<Warning>& warnings);

/// Runs a chart and saves it. \param options  options in the report
/// \returns the exit code
int run_chart(const ChartArguments& arguments, Json options, ChartKind& kind);

}  // namespace kiln::cli

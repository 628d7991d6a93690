// Code that all kinds of charts share: marks and their plot, compared settings, and running and saving a chart.
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
  std::string name;               ///< Name of the setting in files: letters, digits and _
  std::string label;              ///< Label of the mark in the plot
  std::string family;             ///< Name of the family; all marks of a family have the same style
  Json figures = Json::object();  ///< The mark's part of the report, which finish_marks() completes
  /// Seconds of each run, in order: an object with the seconds of each stage, or a number
  std::vector<Json> runs = {};
  std::vector<double> run_seconds = {};  ///< The seconds of each run that the chart compares
  double seconds = 0;                    ///< Median of run_seconds
};

/// A measure of errors, for one axis of a plot.
struct Measure {
  std::string name;         ///< Name of the measure in files
  std::string path;         ///< Path of the error in Mark::figures
  std::string title, unit;  ///< Title and unit in the plot
  double scale = 1;         ///< Factor from the error in Mark::figures to the drawn error
};

/// The drawing style of a family's marks.
struct MarkStyle {
  const char *family, *title, *mark, *color;
};

/// Times all marks alternately, so that other load on the machine affects all of them equally.
/// \param run  function that times the mark with an index, and returns its seconds; null if cancelled. It appends
///   `note`, such as ", run 2 of 3", to the name of the stage in progress reports
/// \returns false if cancelled
bool time_in_turns(std::vector<Mark>& marks, std::uint32_t repeat,
                   const std::function<Json(std::size_t mark, const std::string& note)>& run);
/// Sets the seconds of timed marks, and adds to their figures: "seconds" of the median run, "seconds_least",
/// "seconds_most", "runs", and "on_front" by measure (Pareto-optimal: no other mark is both faster and more accurate).
/// \param compared_path  path of the seconds in a run that are compared
/// \returns "settings" with the figures of all marks, and "front" with the names on each measure's Pareto front, the
///          fastest first
Json finish_marks(std::vector<Mark>& marks, const char* compared_path,
                  const std::vector<Measure>& measures);
/// Makes the data of a panel that plots the marks' seconds against one measure.
Json chart_panel(const std::vector<Mark>& marks, const Measure& measure);

/// A match with its options, as one setting of a chart.
struct ChartSetting {
  std::string name, label, family;  ///< Name, label and family as in Mark
  BakeOptions bake;  ///< Match and number of samples; size, distance and maps come from the chart
  bool find_cage = false;  ///< Uses --cage auto; finding the cage is timed as a part of the match
};
/// Parses a text such as "--match views --views 12", flags of `kiln bake` that each have a value, to a job.
Job parse_bake_job(const std::string& flags);
/// Returns the settings that are compared by default, including the reference. The setting that matches by UVs only
/// suits meshes with equal UV layouts.
std::vector<ChartSetting> chart_settings();
/// Appends a setting for each match that none of `settings` uses, except matches along a given direction.
void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings);
/// Returns chart_settings(), followed by settings for hard surfaces, which use other ray directions or a cage and are
/// only compared if --settings names them.
std::vector<ChartSetting> all_chart_settings();
/// Returns the names of the settings that --settings hard selects.
const std::vector<std::string>& hard_settings();
/// Name of the setting whose map is the reference for all others.
constexpr const char* kChartReference = "ray_4x4";
/// Returns the names of the settings that charts of volumes compare.
std::vector<std::string> volume_setting_names();
/// A way to compute ambient occlusion, as one setting of a chart.
struct AoSetting {
  std::string name, label, family;  ///< Name, label and family as in Mark
  std::string flags;                ///< Flags of `kiln bake` that make the setting
};
/// Returns the names of the settings that charts of ambient occlusion compare.
std::vector<std::string> ao_setting_names();

/// Arguments of `kiln chart`.
struct ChartArguments : LabArguments {
  ChartArguments() { size = 1024, pixels = 512, directions = 512; }

  std::vector<std::string> meshes;  ///< Files of meshes or of volumes
  SurfaceArguments surface;         ///< Options for contouring volumes
  std::vector<std::string> settings;
  std::uint32_t repeat = 3;  ///< Number of timed runs of each setting
  bool ao = false;           ///< True to chart ambient occlusion as well
  /// With --ao-error, the report names the fastest setting of ambient occlusion whose error is at most this bound; 0 to
  /// 1, where 1 is the range from black to white
  std::optional<double> ao_error;
  /// With --ao-budget, the report names the most accurate setting of ambient occlusion that takes at most these seconds
  std::optional<double> ao_budget;
  bool plan =
      false;  ///< True to chart the bytes and errors of plans; all meshes are then high polys
  std::vector<std::string> max_errors;  ///< Maximum errors of the plans in degrees
  std::string screen;                   ///< Value of --screen for plans; empty: none

  /// True if --settings includes the setting.
  bool selects(const std::string& setting) const;
};

/// A table of figures, which is printed, written to a data file, or both.
struct ChartTable {
  std::string note;  ///< Text above the table
  /// Columns of the printed table; empty: the rows are only written to the data file
  std::vector<Column> columns;
  Json rows;
  /// Suffix of the data file, such as ".csv" or "_ao.csv"; null: no data file
  const char* data_suffix = nullptr;
};

/// The measurements of one input.
struct ChartGroup {
  std::string title;
  std::string note;  ///< Text below the title in the picture
  Json report;       ///< The group's part of chart.json
  std::vector<ChartTable> tables;
  std::vector<std::string> lines;  ///< Lines of text after the tables
  Json panels = Json::array();     ///< Panels of chart.png
};

/// A kind of chart: its inputs and measurements. run_chart() calls the functions in their order, and writes the
/// results.
class ChartKind {
 public:
  virtual ~ChartKind() = default;

  /// Key of an input's number in data files, such as "pair"
  const char* input_key;
  /// Key of the list of all inputs in the report, such as "pairs"
  const char* inputs_key;
  std::vector<std::string> inputs;  ///< Input files, each measured separately
  /// Explanation of the figures, which is printed above all tables
  std::string explanation;
  Json options = Json::object();  ///< Options in the report whose values are not those of the flags
  std::vector<Warning> warnings;  ///< Warnings about the whole run
  std::vector<Warning> settings_warnings;  ///< Warnings about single settings
  // Titles of chart.png for charts that show speed. The device and the number of runs are appended to the subtitle.
  std::string title, subtitle;
  const char* seconds_title = "";
  std::span<const MarkStyle> styles;

  /// Finds errors in the inputs that would otherwise end a long run at a late stage. \returns false if cancelled
  virtual bool check_inputs(const Progress& progress);
  /// Reads the input with this index, which the next call of measure() uses.
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

/// Returns the settings of ambient occlusion to compare: those that --settings names, or all with --ao.
std::vector<AoSetting> ao_settings(const ChartArguments& arguments);
/// Charts ambient occlusion: bakes once with every setting to measure the errors, then alternately with all settings to
/// measure the seconds. The seconds are those of the map alone, without the match, the BVH and file access. Errors are
/// root mean squares, where 1 is the range from black to white.
/// \param steps  progress: one step per bake, and one per measurement
/// \returns false if cancelled
bool add_ao(const Device& device, const Mesh& high, const Mesh& low,
            const ChartArguments& arguments, const std::vector<AoSetting>& settings, Steps& steps,
            ChartGroup& group);

/// Reads an input that is a mesh or a height field.
HighPolyInput read_high(const ChartArguments& arguments, const std::string& path,
                        std::vector<Warning>& warnings);

/// Measures all inputs of a chart, and saves its files. \param options  options for the report
/// \returns the exit code
int run_chart(const ChartArguments& arguments, Json options, ChartKind& kind);

}  // namespace kiln::cli

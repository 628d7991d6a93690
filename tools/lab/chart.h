// Shared code of charts of speed against accuracy: marks, their plot, and running and saving a chart.
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
#include "kiln/cage.h"
#include "kiln/kiln.h"
#include "lab/lab_arguments.h"
#include "lab/lab_run.h"
#include "lab/table.h"
#include "picture/plot.h"

namespace kiln::cli {

constexpr const char* kChartName = "chart";  ///< Stem of the files

/// A setting that is timed and measured: one mark in the plot.
struct Mark {
  std::string name;               ///< Name in files: letters, digits and _
  std::string label;              ///< Text in the plot
  std::string family;             ///< Marks of a family have one style
  Json figures = Json::object();  ///< Its part of the report; finish_marks() adds to it
  std::vector<Json> runs = {};  ///< Seconds of each run, in order: an object by stage, or a number
  std::vector<double> run_seconds = {};  ///< The compared seconds of each run
  double seconds = 0;                    ///< Their median
};

/// A measure of errors.
struct Measure {
  std::string name;         ///< Name in files
  std::string path;         ///< Path of the error in Mark::figures
  std::string title, unit;  ///< Text in the plot
  double scale = 1;         ///< Factor of drawn errors
};

/// Style of a family's marks.
struct MarkStyle {
  const char *family, *title, *mark, *color;
};

/// Times marks in turns, so that other load on the machine affects all equally.
/// \param run  times a mark by its index; the note, such as ", run 2 of 3", completes the stage. Returns null if
///             cancelled
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
/// A panel of a chart's plot.
Json chart_panel(const std::vector<Mark>& marks, const Measure& measure);

/// A setting of a chart of matches.
struct ChartSetting {
  std::string name, label, family;  ///< See Mark
  BakeOptions bake;                 ///< Match and samples; size, distance and maps are the chart's
  bool find_cage = false;  ///< With --cage auto; finding the cage is timed as a part of the match
};
/// The job of flags of `kiln bake`, each with its value.
Job bake_job(const std::string& flags);
/// The compared settings, including the reference. Matching by UVs is only for pairs with equal layouts.
std::vector<ChartSetting> chart_settings();
/// Appends a setting for each match that none of `settings` uses, except matches along a direction that must be given.
void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings);
/// All settings, including those that are compared only by name: other directions and cages, for hard surfaces.
std::vector<ChartSetting> all_chart_settings();
/// The settings that --settings hard selects.
const std::vector<std::string>& hard_settings();
/// The setting whose map is the reference for others.
constexpr const char* kChartReference = "ray_4x4";
/// The settings of charts of volumes.
std::vector<std::string> volume_setting_names();
/// A setting of ambient occlusion.
struct AoSetting {
  std::string name, label, family;  ///< See Mark
  std::string flags;                ///< Flags of `kiln bake`
};
std::vector<std::string> ao_setting_names();

/// Arguments of `kiln chart`.
struct ChartArguments : LabArguments {
  ChartArguments() { size = 1024, pixels = 512, directions = 512; }

  std::vector<std::string> meshes;  ///< Files of meshes, or of volumes
  SurfaceArguments surface;         ///< Options of volumes
  std::vector<std::string> settings;
  std::uint32_t repeat = 3;             ///< Timed runs of each setting
  bool ao = false;                      ///< Adds a chart of ambient occlusion
  std::optional<double> ao_error;       ///< Error bound of ambient occlusion, a share of 1
  std::optional<double> ao_budget;      ///< Seconds
  bool plan = false;                    ///< Charts plans: bytes against error, without low polys
  std::vector<std::string> max_errors;  ///< Error bounds of plans, degrees
  std::string screen;                   ///< --screen of plans; empty: none

  /// True if --settings includes the setting.
  bool names(const std::string& setting) const;
};

/// A table of figures, for text and for a data file.
struct ChartTable {
  std::string note;             ///< Text above the table
  std::vector<Column> columns;  ///< Empty: only for the data file
  Json rows;
  const char* data = nullptr;  ///< Suffix of the data file: ".csv", "_ao.csv"; null: none
};

/// The measurements of one input.
struct ChartGroup {
  std::string title;
  std::string note;  ///< Below the title in the picture
  Json report;       ///< Its part of chart.json
  std::vector<ChartTable> tables;
  std::vector<std::string> lines;  ///< After the tables
  Json panels = Json::array();     ///< Panels of chart.png
};

/// A kind of chart: its inputs and measurements. run_chart() calls the functions in their order, and writes the
/// results.
class ChartKind {
 public:
  virtual ~ChartKind() = default;

  const char *input_key,
      *inputs_key;                  ///< Of an input's number, in data; of all inputs, in the report
  std::vector<std::string> inputs;  ///< Input files, each measured separately
  std::string about;                ///< Explains the figures, above all tables
  Json options = Json::object();    ///< Options in the report that differ from the flags
  std::vector<Warning> warnings;    ///< Warnings of the whole run
  std::vector<Warning> of_settings;  ///< Warnings of single settings
  // Titles of chart.png if it shows speed. The device and number of runs are appended to the subtitle.
  std::string title, subtitle;
  const char* seconds_title = "";
  std::span<const MarkStyle> styles;

  /// Checks early for errors that would stop a long run later. \returns false if cancelled
  virtual bool look(const Progress& progress);
  virtual void read(std::size_t input) = 0;
  /// Measures the last input that was read. \returns nullopt if cancelled
  virtual std::optional<ChartGroup> measure(const Device& device, std::size_t input,
                                            const Progress& progress) = 0;
  /// The data of chart.png.
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
/// Bakes with every setting once for the errors, then in turns for the seconds. The seconds are those of the map alone,
/// without the match, the BVH and file access. Errors are root mean squares as shares of 1.
/// \param steps  progress: one step per bake, and one per measurement
/// \returns false if cancelled
bool add_ao(const Device& device, const Mesh& high, const Mesh& low,
            const ChartArguments& arguments, const std::vector<AoSetting>& settings, Steps& steps,
            ChartGroup& group);

/// A mesh or a height field of the inputs.
HighPolyInput read_high(const ChartArguments& arguments, const std::string& path,
                        std::vector<Warning>& warnings);

/// Runs a chart and saves it. \param options  for the report \returns the exit code
int run_chart(const ChartArguments& arguments, Json options, ChartKind& kind);

}  // namespace kiln::cli

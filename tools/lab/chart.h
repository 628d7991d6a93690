// Shared by charts of speed against accuracy: marks, their plot, and how a chart is run and saved.
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

constexpr const char* kChartName = "chart";  ///< Of the files, without their endings

/// Something that is timed and measured.
struct Mark {
  std::string name;                      ///< In files: letters, digits and _
  std::string label;                     ///< In the picture
  std::string family;                    ///< Marks of one are drawn alike
  Json figures = Json::object();         ///< Its part of the report; finish_marks() adds to it
  std::vector<Json> runs = {};           ///< Seconds of each run, in order: by stage, or a number
  std::vector<double> run_seconds = {};  ///< What counts of them
  double seconds = 0;                    ///< Their median
};

/// A measure of errors.
struct Measure {
  std::string name;         ///< In files
  std::string path;         ///< Of the error in Mark::figures
  std::string title, unit;  ///< In the picture
  double scale = 1;         ///< Errors are drawn so many times as large
};

/// Look of the marks of a family.
struct MarkStyle {
  const char *family, *title, *mark, *color;
};

/// Times marks in turns, so that what else the machine does falls on all alike.
/// \param run  times one, by its index: sets the stage with a note such as ", run 2 of 3"; null: progress said stop
/// \returns false where progress said stop
bool time_in_turns(std::vector<Mark>& marks, std::uint32_t repeat,
                   const std::function<Json(std::size_t mark, const std::string& note)>& run);
/// Sets seconds of marks that were timed, and adds to their figures: "seconds" of the median run (its "total" is the
/// median of its own), "seconds_least", "seconds_most", "runs", and "on_front" by measure: nothing else is both faster
/// and closer.
/// \param counted  the path of the seconds that count
/// \returns "settings", the figures of all, and "front", by measure the names of those on it, the fastest first
Json finish_marks(std::vector<Mark>& marks, const char* counted,
                  const std::vector<Measure>& measures);
/// A panel of a chart's plot.
Json chart_panel(const std::vector<Mark>& marks, const Measure& measure);

/// A setting of a chart of matches.
struct ChartSetting {
  std::string name, label, family;  ///< As Mark
  BakeOptions bake;                 ///< Match and samples; size, distance and maps are the chart's
  bool find_cage = false;           ///< As --cage auto, which counts as a part of the match
};
/// A bake with such flags of `kiln bake`, each with its value.
Job bake_job(const std::string& flags);
/// Settings that are compared, a row each. The reference is among them. Matching by UVs is for pairs whose layouts
/// agree.
std::vector<ChartSetting> chart_settings();
/// Appends a setting for each row of a match that none of `settings` uses. Matches along a direction that somebody
/// must choose are left out.
void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings);
/// Those and what is compared where it is asked for by name: other directions and cages, for hard surfaces.
std::vector<ChartSetting> all_chart_settings();
/// The names that --settings hard stands for.
const std::vector<std::string>& hard_settings();
/// Its map is what other maps are compared with.
constexpr const char* kChartReference = "ray_4x4";
/// The settings of charts of volumes.
std::vector<std::string> volume_setting_names();
/// A setting of ambient occlusion.
struct AoSetting {
  std::string name, label, family;  ///< As Mark
  std::string flags;                ///< Of `kiln bake`
};
std::vector<std::string> ao_setting_names();

/// Arguments of `kiln chart`.
struct ChartArguments : LabArguments {
  ChartArguments() { size = 1024, pixels = 512, directions = 512; }

  std::vector<std::string> meshes;  ///< Or volumes
  SurfaceArguments surface;         ///< Of volumes
  std::vector<std::string> settings;
  std::uint32_t repeat = 3;             ///< Timed runs of each setting
  bool ao = false;                      ///< Also ambient occlusion
  std::optional<double> ao_error;       ///< A share of 1
  std::optional<double> ao_budget;      ///< Seconds
  bool plan = false;                    ///< Bytes against error of high polys alone
  std::vector<std::string> max_errors;  ///< To plan for, degrees
  std::string screen;                   ///< Of plans: pixels wide; empty: none

  /// True if --settings names it.
  bool names(const std::string& setting) const;
};

/// Rows of figures for people, and for a file of data.
struct ChartTable {
  std::string note;             ///< Before the table
  std::vector<Column> columns;  ///< None: data alone
  Json rows;
  const char* data = nullptr;  ///< The file's ending: ".csv", "_ao.csv"; null: none
};

/// The measurements of one input.
struct ChartGroup {
  std::string title;
  std::string note;  ///< Below the title in the picture
  Json report;       ///< Its part of chart.json
  std::vector<ChartTable> tables;
  std::vector<std::string> lines;  ///< After the tables
  Json panels = Json::array();     ///< Of chart.png
};

/// A kind of chart: what it reads and measures. run_chart() calls the functions in their order, and writes.
class ChartKind {
 public:
  virtual ~ChartKind() = default;

  const char *input_key,
      *inputs_key;                  ///< Of an input's number, in data; of all inputs, in the report
  std::vector<std::string> inputs;  ///< Files, each measured by itself
  std::string about;                ///< Of figures, above all tables
  Json options = Json::object();    ///< For the report: those that it puts in other words
  std::vector<Warning> warnings;    ///< Of all of the work
  std::vector<Warning> of_settings;  ///< Those of single settings
  // Titles of chart.png, where it shows speed; the device and number of runs are added to the subtitle.
  std::string title, subtitle;
  const char* seconds_title = "";
  std::span<const MarkStyle> styles;

  /// Checks now what could stop a long run later. \returns false where progress said stop
  virtual bool look(const Progress& progress);
  virtual void read(std::size_t input) = 0;
  /// Measures what was read last. \returns nothing where progress said stop
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

/// The settings of ambient occlusion that are asked for.
std::vector<AoSetting> ao_settings(const ChartArguments& arguments);
/// Bakes with every setting once for the errors, then in turns for the seconds. The seconds are those of the map
/// alone: the match, the hierarchy of the high poly and files are left out. Errors: root mean square, a share of 1.
/// \param steps  of which each bake is one, and measuring another
/// \returns false where progress said stop
bool add_ao(const Device& device, const Mesh& high, const Mesh& low,
            const ChartArguments& arguments, const std::vector<AoSetting>& settings, Steps& steps,
            ChartGroup& group);

/// A mesh or a height field of the inputs.
HighPolyInput read_high(const ChartArguments& arguments, const std::string& path,
                        std::vector<Warning>& warnings);

/// Runs a chart and saves it. \param options  for the report \returns the exit code
int run_chart(const ChartArguments& arguments, Json options, ChartKind& kind);

}  // namespace kiln::cli

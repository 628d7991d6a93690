// Shared by charts of speed against accuracy: marks, their plot, and how a chart is run and saved.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arguments/high_poly_input.h"
#include "arguments/mesh_files.h"
#include "arguments/surface_arguments.h"
#include "kiln/cage.h"
#include "kiln/kiln.h"
#include "picture/plot.h"
#include "report/report.h"

namespace kiln::cli {

constexpr const char* kChartName = "chart";  ///< Of the files, without their endings

/// Something that was timed and measured.
struct Mark {
  std::string name;            ///< In files: letters, digits and _
  std::string label;           ///< In the picture
  std::string family;          ///< Marks of one are drawn alike
  std::vector<double> runs;    ///< Seconds, in order
  double seconds = 0;          ///< Their median
  std::vector<double> errors;  ///< By measure
  std::vector<bool> front;     ///< By measure: nothing else is both faster and closer

  /// The fastest run, and the slowest.
  double least() const;
  double most() const;
};

/// A measure of errors.
struct Measure {
  std::string name;  ///< In files
  std::string title, unit;
};

/// Look of the marks of a family.
struct MarkStyle {
  const char *family, *title, *mark, *color;
};

/// The index of the middle one by a key; of an even number the lower of the two.
std::size_t median_index(const std::vector<double>& keys);
/// Sets `front` of marks with seconds and errors.
void mark_fronts(const std::vector<Mark*>& marks);
/// "●" on the front of a measure, for tables.
std::string front_dot(const Mark& mark, std::size_t measure);
/// {"measure": true, ...}
Json describe_front(const Mark& mark, std::span<const Measure> measures);
/// The names of marks on the front of a measure.
Json front_names(const std::vector<const Mark*>& marks, std::size_t measure);
/// A panel of a chart's plot.
Json chart_panel(const std::vector<const Mark*>& marks, std::span<const Measure> measures,
                 std::size_t measure);
/// Adds the styles that occur.
void add_styles(std::span<const MarkStyle> styles, const std::vector<const Mark*>& marks,
                Json& plot);
/// Ends a subtitle: how many runs the seconds come from.
std::string runs_note(unsigned repeat);
/// The same in a table's text.
std::string runs_text(unsigned repeat);
/// "On DEVICE (PLATFORM, driver DRIVER)", in Markdown.
std::string on_device(const DeviceInfo& device);

template <typename Row>
void mark_fronts(std::vector<Row>& rows) {
  std::vector<Mark*> marks;
  for (Row& row : rows) marks.push_back(&row);
  mark_fronts(std::as_const(marks));
}
template <typename Row>
auto marks_of(const std::vector<Row>& rows) {
  std::vector<const Mark*> marks;
  for (const Row& row : rows) marks.push_back(&row);
  return marks;
}

/// A setting of a chart of matches.
struct ChartSetting {
  std::string name, label, family;  ///< As Mark
  BakeOptions bake;                 ///< Match and samples; size, distance and maps are the chart's
  bool find_cage = false;           ///< As --cage auto, which counts as a part of the match
};
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
/// The settings of ambient occlusion.
std::vector<std::string> ao_setting_names();

/// Arguments of `kiln chart`.
struct ChartArguments {
  std::vector<std::string> meshes;       ///< Or volumes
  HeightFieldOptions heights;            ///< Of all height fields
  LoadMeshOptions load;                  ///< Of all meshes
  MeshFrameArguments frame;              ///< Of all meshes
  SurfaceArguments surface;              ///< Of volumes
  std::vector<std::string> for_volumes;  ///< Options given that meshes have no use for
  std::string out, device;
  std::string max_distance = "2%";
  std::vector<std::string> settings;
  std::uint32_t size = 1024;                ///< Texels a side of the maps
  std::uint32_t repeat = 3;                 ///< Timed runs of each setting
  std::optional<std::uint32_t> directions;  ///< Of viewing rays
  std::uint32_t pixels = 512;               ///< A side of the pictures whose normals are measured
  bool ao = false;                          ///< Also ambient occlusion
  std::optional<double> ao_error;           ///< A share of 1
  std::optional<double> ao_budget;          ///< Seconds
  bool plan = false;                        ///< Bytes against error of high polys alone
  std::vector<std::string> max_errors;      ///< To plan for, degrees
  std::string screen;                       ///< Of plans: pixels wide; empty: none
  std::vector<std::string> not_for_plans;   ///< Options given that plans have no use for
  bool quiet = false;

  /// True if --settings names it.
  bool names(const std::string& setting) const;
};

/// A kind of chart: what it reads, measures and writes. run_chart() calls the functions in their order.
class ChartKind {
 public:
  virtual ~ChartKind() = default;

  std::string inputs_key;            ///< Of the inputs, in the report
  std::vector<std::string> inputs;   ///< Files, each measured by itself
  std::vector<Warning> warnings;     ///< Of all of the work
  std::vector<Warning> of_settings;  ///< Those of single settings

  /// Checks now what could stop a long run later. \returns false where progress said stop
  virtual bool look(const Progress& progress) = 0;
  virtual void read(std::size_t input) = 0;
  /// Measures what was read last. \returns its part of the report; nothing where progress said stop
  virtual std::optional<Json> measure(const Device& device, std::size_t input,
                                      const Progress& progress) = 0;
  virtual std::string data() const = 0;                           ///< chart.csv
  virtual std::string table(const DeviceInfo& device) const = 0;  ///< chart.md
  virtual std::string ao_data() const { return {}; }              ///< chart_ao.csv; empty: none
  virtual Json plot(const DeviceInfo& device) const = 0;          ///< Of chart.png
  virtual Json options() const = 0;                               ///< For the report
  virtual std::vector<std::string> lines() const = 0;             ///< For a person
};
std::unique_ptr<ChartKind> chart_of_matches(const ChartArguments& arguments);
std::unique_ptr<ChartKind> chart_of_volumes(const ChartArguments& arguments);
std::unique_ptr<ChartKind> chart_of_plans(const ChartArguments& arguments);

/// Runs a chart and saves it. \returns the exit code
int run_chart(const ChartArguments& arguments, ChartKind& kind);

/// Among the high polys.
bool has_height_fields(const ChartArguments& arguments);

}  // namespace kiln::cli

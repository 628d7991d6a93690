// `kiln chart`: declares and checks its arguments, and selects the kind of chart.
#include <algorithm>
#include <memory>

#include "arguments/command_options.h"
#include "commands.h"
#include "job/files.h"
#include "lab/chart.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

using Arguments = ChartArguments;

/// The value of --settings that selects the settings for hard surfaces.
constexpr const char* kHardSurfaceGroup = "hard";

/// Returns the names of all settings that charts of meshes compare.
std::vector<std::string> mesh_setting_names() {
  std::vector<std::string> names;
  for (const ChartSetting& setting : all_chart_settings()) names.push_back(setting.name);
  for (const std::string& name : ao_setting_names()) names.push_back(name);
  return names;
}

/// Returns the names of the settings of all charts, without duplicates.
std::vector<std::string> setting_names() {
  std::vector<std::string> names = mesh_setting_names();
  for (const std::string& name : volume_setting_names()) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

/// Returns the rows of the options that only `kiln chart` has, without those of volumes.
std::vector<OptionRow> chart_rows() {
  std::vector<std::string> settings = setting_names();
  settings.emplace_back(kHardSurfaceGroup);
  return {
      {"--repeat", "", integer(KILN_MEMBER(Arguments, repeat), 1, 1000),
       "Number of timed runs of each setting; their median is charted. An untimed run before them "
       "compiles the kernels and measures the errors"},
      {"--ao", "", toggle(KILN_MEMBER(Arguments, ao)),
       "Also chart ambient occlusion: 8 to 1024 rays, plain and smoothed, and 64 to 512 views, "
       "compared with 4096 rays; takes minutes at 1024 texels a side",
       "-"},
      {"--ao-error", "", number(KILN_MEMBER(Arguments, ao_error), 0, 1, /*fractions=*/true),
       "With --ao: report the fastest setting with at most this root mean square error, such as "
       "2/255 or 0.01 (1: from black to white)"},
      {"--ao-budget", "", number(KILN_MEMBER(Arguments, ao_budget), 1e-9, 1e9).in("seconds"),
       "With --ao: report the most accurate setting that takes at most so many seconds"},
      {"--plan", "", toggle(KILN_MEMBER(Arguments, plan)),
       "For each HIGH, without LOW: chart bytes against error for numbers of faces and map sizes, "
       "and for plans",
       "-"},
      {"--max-error", "", texts(KILN_MEMBER(Arguments, max_errors), ','),
       "With --plan: maximum errors of the plans in degrees, separated by commas (default: three "
       "between the largest and the smallest error of the charted low polys)"},
      {"--screen", "", text(KILN_MEMBER(Arguments, screen)),
       "With --plan: the largest size at which the mesh will be seen, such as 600px; plans and the "
       "grid are measured at that size, by mean normals of pixels"},
      {"--settings", "", list_option(KILN_MEMBER(Arguments, settings), settings, ','),
       "Settings to compare: their names in chart.csv, separated by commas; for meshes the "
       "reference, " +
           std::string(kChartReference) +
           ", is always included. hard: a choice for hard surfaces, with other ray directions and "
           "cages (default: all settings without other directions and cages)"}};
}

bool is_volume(const Arguments& a, const std::string& path) {
  return a.surface.is_raw() || is_volume_name(path);
}

/// Returns the flags that only apply to volumes.
std::set<std::string> volume_flags() {
  std::set<std::string> flags;
  for (const OptionRow& row : surface_rows(/*iso_required=*/false)) flags.insert(row.flag);
  for (const OptionRow& row : file_and_chart_rows()) flags.insert(row.flag);
  return flags;
}

/// Checks that all names in --settings are among those of the kind of input, such as "meshes". \throws Error(usage)
void check_settings(const Arguments& a, const std::vector<std::string>& names, const char* kind) {
  for (const std::string& name : a.settings) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    fail_usage("--settings " + name + " does not exist for " + kind + ": give some of " +
               join(names, ", ") + ".");
  }
}

/// Checks that either all inputs are volumes or none is. \throws Error(usage)
void check_alike(const Arguments& a, bool volumes) {
  for (const std::string& path : a.meshes) {
    if (is_volume(a, path) == volumes) continue;
    const auto is = [&](bool volume) { return volume ? " is a volume" : " is not a volume"; };
    fail_usage("'" + path + "'" + is(!volumes) + ", but '" + a.meshes.front() + "'" + is(volumes) +
               ": give only volumes, or only meshes.");
  }
}

// ---- Checks of all arguments, before any work. They throw Error(usage). ----

void check_volumes(const Arguments& a) {
  const std::string volume = "'" + a.meshes.front() + "'";
  refuse_if(!a.surface.iso, volume + " is a volume: give the value of its surface by --iso VALUE.");
  refuse_flags(a,
               {"--triangulate", "--up", "--unit", "--uv-set", "--allow-outside", "--high-normals",
                "--height", "--extent", "--ao", "--ao-error", "--ao-budget", "--directions"},
               "is for meshes and height fields, but " + volume + " is a volume.");
  cli::check(a.surface);
  check_settings(a, volume_setting_names(), "volumes");
}

/// Checks the flags that depend on the kinds of files. \param high, low  files of the high and the low polys
void check_files(const Arguments& a, const std::vector<std::string>& high,
                 const std::vector<std::string>& low) {
  refuse_flags(a, volume_flags(),
               "is for volumes, but '" + a.meshes.front() + "' is not a volume.");
  if (std::none_of(high.begin(), high.end(), is_height_field)) {
    refuse_flags(a, {"--height", "--extent", "--no-data"},
                 "is for height fields, but no HIGH is a height field (PNG, EXR or TIFF).");
  }
  check_mesh_frame(a.frame, high, low, {});
}

void check_meshes(const Arguments& a) {
  std::vector<std::string> sides[2];
  for (std::size_t i = 0; i < a.meshes.size(); ++i) sides[i % 2].push_back(a.meshes[i]);
  check_files(a, sides[0], sides[1]);
  check_settings(a, mesh_setting_names(), "meshes");
  if (ao_settings(a).empty()) {
    refuse_flags(a, {"--ao-error", "--ao-budget"},
                 "chooses a setting of ambient occlusion, which is not charted: add --ao.");
  }
  refuse_if(a.ao_error == 0, "--ao-error is 0, but must be above 0, such as 2/255.");
  if (a.meshes.size() % 2 != 0) {
    fail_usage("Meshes come in pairs, HIGH LOW, but '" + a.meshes.back() +
               "' has no LOW: give its low poly, with UVs.");
  }
}

void check_plan(const Arguments& a) {
  refuse_flags(a,
               {"--settings", "--repeat", "--max-distance", "--ao", "--ao-error", "--ao-budget",
                "--directions", "--pixels"},
               "is for charts of matches, but --plan draws a chart of file sizes: leave one of the "
               "two out.");
  if (is_volume(a, a.meshes.front())) {
    fail_usage("'" + a.meshes.front() +
               "' is a volume, but --plan takes only high polys: give meshes.");
  }
  check_files(a, a.meshes, {});
}

/// Rejects inputs that have the name of a setting: in "--settings a b", which lacks a comma, b is parsed as a mesh.
/// \throws Error(usage)
void check_no_settings(const Arguments& a) {
  std::vector<std::string> names = setting_names();
  std::sort(names.begin(), names.end());
  for (const std::string& path : a.meshes) {
    std::error_code ignored;
    if (fs::exists(path, ignored) || !std::binary_search(names.begin(), names.end(), path))
      continue;
    fail_usage("'" + path +
               "' is the name of a setting, not of a file: separate settings by commas, as in "
               "--settings NAME,NAME, of " +
               join(names, ", ") + ".");
  }
}

int run(const Arguments& a, const Json& options) {
  const bool volumes = is_volume(a, a.meshes.front());
  check_no_settings(a);
  check_alike(a, volumes);
  if (!a.plan) refuse_flags(a, {"--screen", "--max-error"}, "is for charts of plans: add --plan.");
  (a.plan ? check_plan : volumes ? check_volumes : check_meshes)(a);
  const std::unique_ptr<ChartKind> kind = (a.plan    ? chart_of_plans
                                           : volumes ? chart_of_volumes
                                                     : chart_of_matches)(a);
  std::vector<fs::path> outputs;
  for (const char* ending : {".json", ".csv", ".md", "_ao.csv"}) {
    outputs.push_back(fs::path(a.out) / (std::string(kChartName) + ending));
  }
  for (const std::string& file : list_plot_files(kChartName))
    outputs.push_back(fs::path(a.out) / file);
  check_paths({a.meshes.begin(), a.meshes.end()}, outputs);
  return run_chart(a, options, *kind);
}

}  // namespace

Run add_chart(Command& app) {
  Command* command = add_lab_command_name(app, "chart");
  auto a = std::make_shared<Arguments>();
  OptionRow files[] = {
      {.flag = "HIGH",
       .value = texts(KILN_MEMBER(Arguments, meshes)),
       .help =
           "High polys (meshes, or height fields: PNG, EXR), each followed by its low poly with "
           "UVs; or volumes, with --iso; or only high polys, with --plan. Each pair, volume or "
           "high poly gets a row of panels",
       .required = true},
      {.flag = "--out",
       .value = text(KILN_MEMBER(Arguments, out)),
       .help =
           "Folder for chart.json, .csv, .md and .png, and for chart_plot.json, the data of the "
           "picture",
       .required = true},
  };
  files[0].value.words = "LOW [HIGH2 LOW2 ...]";
  add_options(*command, files, a.get());
  const std::vector<OptionRow> shared =
      lab_rows({"--size", "--max-distance", "--directions", "--pixels", "--height", "--extent",
                "--triangulate", "--up", "--unit", "--uv-set", "--allow-outside", "--high-normals",
                "--device", "--quiet"});
  LabArguments* const job = a.get();
  add_options(*command, shared, job);
  add_options(*command, chart_rows(), a.get());
  add_options(*command, surface_rows(/*iso_required=*/false), &a->surface);
  add_options(*command, file_and_chart_rows(), &a->surface);
  return [a, job, command, shared] {
    a->given = given_flags(*command);
    const auto hard_setting = std::find(a->settings.begin(), a->settings.end(), kHardSurfaceGroup);
    if (hard_setting != a->settings.end()) {
      const auto position = a->settings.erase(hard_setting);
      a->settings.insert(position, hard_settings().begin(), hard_settings().end());
    }
    Json options = values_json(shared, job);
    if (std::none_of(a->meshes.begin(), a->meshes.end(), is_height_field)) options["height"] = {};
    options.update(values_json(chart_rows(), a.get()));
    return run(*a, options);
  };
}

}  // namespace kiln::cli

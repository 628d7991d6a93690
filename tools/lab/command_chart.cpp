#include <algorithm>
#include <memory>

#include "arguments/files.h"
#include "arguments/parse.h"
#include "commands.h"
#include "lab/chart.h"
#include "lab/measuring.h"
#include "lab/table.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// The name that stands for the settings that suit hard surfaces.
constexpr const char* kHard = "hard";

/// Every setting of charts of meshes, by name.
std::vector<std::string> mesh_setting_names() {
  std::vector<std::string> names;
  for (const ChartSetting& setting : all_chart_settings()) names.push_back(setting.name);
  for (const std::string& name : ao_setting_names()) names.push_back(name);
  return names;
}

bool is_volume(const ChartArguments& a, const std::string& path) {
  return a.surface.is_raw() || is_volume_name(path);
}

/// Settings by name that a kind of input does not have. \throws Error(usage)
void check_settings(const ChartArguments& a, const std::vector<std::string>& names,
                    const char* kind) {
  for (const std::string& name : a.settings) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    fail("--settings " + name + " is not for " + kind + ": give some of " + join(names, ", ") +
         ".");
  }
}

/// Before any work. \throws Error(usage)
void check_volumes(const ChartArguments& a) {
  for (const std::string& path : a.meshes) {
    if (is_volume(a, path)) continue;
    fail("'" + path + "' is no volume, but '" + a.meshes.front() +
         "' is: give volumes alone, or meshes alone, HIGH LOW.");
  }
  if (!a.surface.iso) {
    fail("'" + a.meshes.front() + "' is a volume: say which surface of it by --iso VALUE.");
  }
  if (a.load.triangulation != Triangulation::automatic) {
    fail("--triangulate is for meshes, but '" + a.meshes.front() + "' is a volume.");
  }
  if (a.frame.given()) {
    fail("--up, --unit, --uv-set and --allow-outside are for meshes, but '" + a.meshes.front() +
         "' is a volume.");
  }
  if (stretches(a.heights)) {
    fail("--height and --extent are for height fields, but '" + a.meshes.front() +
         "' is a volume.");
  }
  cli::check(a.surface);
  check_settings(a, volume_setting_names(), "volumes");
  if (a.ao || a.ao_error || a.ao_budget) {
    fail("--ao, --ao-error and --ao-budget are for meshes, but '" + a.meshes.front() +
         "' is a volume.");
  }
  if (a.directions) {
    fail("--directions is for measures of meshes, but '" + a.meshes.front() + "' is a volume.");
  }
}

void check_heights(const ChartArguments& a, bool has_fields) {
  if (!has_fields && stretches(a.heights)) {
    fail("--height and --extent are for a HIGH that is a height field, a PNG or EXR; none is.");
  }
}

/// Before any work. \throws Error(usage)
void check_ao(const ChartArguments& a) {
  const std::vector<std::string> names = ao_setting_names();
  const bool charted = a.ao || std::any_of(names.begin(), names.end(),
                                           [&](const std::string& name) { return a.names(name); });
  for (const auto& [flag, given] : {std::pair("--ao-error", a.ao_error.has_value()),
                                    std::pair("--ao-budget", a.ao_budget.has_value())}) {
    if (given && !charted) {
      fail(std::string(flag) +
           " chooses among ways to gather ambient occlusion, but none is "
           "charted: add --ao.");
    }
  }
  if (a.ao_error == 0) fail("--ao-error is 0, but must be above 0, such as 2/255.");
}

/// Before any work. \throws Error(usage)
void check_meshes(const ChartArguments& a) {
  for (const std::string& path : a.meshes) {
    if (!is_volume_name(path)) continue;
    fail("'" + path + "' is a volume, but '" + a.meshes.front() +
         "' is not: give volumes alone, or meshes alone, HIGH LOW.");
  }
  if (!a.for_volumes.empty()) {
    fail(a.for_volumes.front() + " is for volumes, but '" + a.meshes.front() + "' is none.");
  }
  check_heights(a, has_height_fields(a));
  check_settings(a, mesh_setting_names(), "meshes");
  check_ao(a);
  if (a.meshes.size() % 2 != 0) {
    fail("Meshes come in pairs, HIGH LOW, but '" + a.meshes.back() +
         "' has no LOW: give its low poly, with UVs.");
  }
  std::vector<std::string> sides[2];
  for (std::size_t i = 0; i < a.meshes.size(); ++i) sides[i % 2].push_back(a.meshes[i]);
  check_mesh_frame(a.frame, sides[0], sides[1], {});
}

/// Before any work. \throws Error(usage)
void check_plan(const ChartArguments& a) {
  for (const std::string& flag : a.not_for_plans) {
    fail(flag + " is for charts of matches, but --plan charts bytes: leave it out.");
  }
  if (!a.for_volumes.empty()) {
    fail(a.for_volumes.front() + " is for volumes, but --plan takes meshes.");
  }
  for (const std::string& path : a.meshes) {
    if (is_volume_name(path)) {
      fail("'" + path + "' is a volume, but --plan takes high polys alone.");
    }
  }
  check_heights(a, std::any_of(a.meshes.begin(), a.meshes.end(), is_height_field));
  check_mesh_frame(a.frame, a.meshes, {}, {});
}

/// Settings without the comma between them would be meshes. \throws Error(usage)
void check_no_settings(const ChartArguments& a) {
  std::vector<std::string> names = mesh_setting_names();
  for (const std::string& name : volume_setting_names()) names.push_back(name);
  for (const std::string& path : a.meshes) {
    std::error_code ignored;
    if (fs::exists(path, ignored) || std::find(names.begin(), names.end(), path) == names.end())
      continue;
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    fail("'" + path +
         "' is no file but the name of a setting: give settings "
         "separated by commas, --settings NAME,NAME, of " +
         join(names, ", ") + ".");
  }
}

int run(const ChartArguments& a) {
  const bool volumes = is_volume(a, a.meshes.front());
  check_no_settings(a);
  if (!a.plan && !a.screen.empty()) fail("--screen says at which size --plan looks: add --plan.");
  if (!a.plan && !a.max_errors.empty()) fail("--max-error says what --plan plans for: add --plan.");
  (a.plan ? check_plan : volumes ? check_volumes : check_meshes)(a);
  const std::unique_ptr<ChartKind> kind = (a.plan    ? chart_of_plans
                                           : volumes ? chart_of_volumes
                                                     : chart_of_matches)(a);
  std::vector<fs::path> outputs;
  for (const char* ending : {".json", ".csv", ".md", "_ao.csv"}) {
    outputs.push_back(fs::path(a.out) / (std::string(kChartName) + ending));
  }
  for (const std::string& file : plot_files(kChartName)) outputs.push_back(fs::path(a.out) / file);
  check_paths({a.meshes.begin(), a.meshes.end()}, outputs);
  return run_chart(a, *kind);
}

}  // namespace

Run add_chart(Command& app) {
  Command* command = name_lab_command(app, "chart");
  auto a = std::make_shared<ChartArguments>();
  command
      ->add_option("HIGH", a->meshes,
                   "High polys (meshes, or height fields: PNG, EXR), each with its "
                   "low poly, with UVs: a row of "
                   "panels a pair. Or volumes with --iso, a row of panels each. Or high polys "
                   "alone with --plan")
      ->type_name("LOW [HIGH2 LOW2 ...]")
      ->required();
  command
      ->add_option(
          "--out", a->out,
          "Folder for chart.json, .csv, .md and .png, and chart_plot.json, what the picture "
          "shows")
      ->required();
  command
      ->add_option("--size", a->size,
                   "Texels a side of the maps (of volumes half and twice that, too)")
      ->check(range(16U, 8192U))
      ->capture_default_str();
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  command
      ->add_option("--repeat", a->repeat,
                   "Timed runs of each setting, of which the median counts; one more comes first, "
                   "which compiles the kernels and gives the errors")
      ->check(range(1U, 1000U))
      ->capture_default_str();
  command
      ->add_option("--directions", a->directions,
                   "Of meshes: directions that viewing rays of object space, image space and "
                   "uniformity come from (default 512)")
      ->check(range(12U, 4096U));
  command
      ->add_option("--pixels", a->pixels,
                   "Pixels a side of the pictures that rendered normals are measured in")
      ->check(range(16U, 4096U))
      ->capture_default_str();
  command->add_flag("--ao", a->ao,
                    "Also ambient occlusion: 8 to 1024 rays, plain and smoothed, and 64 to 512 "
                    "views, against 4096 rays; takes minutes at 1024 texels a side");
  command
      ->add_option("--ao-error", a->ao_error,
                   "Of ambient occlusion: say what reaches this root mean square error in the "
                   "fewest seconds; a share of 1, such as 2/255 or 0.01")
      ->check(share_of_1());
  command
      ->add_option("--ao-budget", a->ao_budget,
                   "Of ambient occlusion: say what comes nearest to the truth in so many seconds")
      ->check(positive_number());
  command->add_flag("--plan", a->plan,
                    "Of each HIGH alone: bytes against error of low polys by number of faces and "
                    "map size. Beside them plans, and meshoptimizer with a plain bake");
  command
      ->add_option("--max-error", a->max_errors,
                   "With --plan: errors to plan for, degrees, separated by commas (default: three "
                   "between the best and the worst)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--screen", a->screen,
                      "With --plan: the largest size at which the mesh will be seen, such as "
                      "600px; plans and the grid are measured at that size, by mean normals of "
                      "pixels");
  std::vector<std::string> names = mesh_setting_names();
  names.emplace_back(kHard);
  for (const std::string& name : volume_setting_names()) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  command
      ->add_option("--settings", a->settings,
                   "Some of the settings, by their names in chart.csv, separated by commas; "
                   "for meshes the "
                   "reference, " +
                       std::string(kChartReference) +
                       ", always comes along. hard: directions and cages, for hard surfaces "
                       "(default: all but those)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(one_of(names));
  using Job = ChartArguments;
  const OptionRow rows[] = {triangulate_row<Job>("", "HIGH and LOW"), device_row<Job>(""),
                            quiet_row<Job>("")};
  add_options(*command, rows, a.get());
  add_options(*command, mesh_frame_rows<Job>("Files of meshes", /*low=*/true), a.get());
  add_height_options(*command, *a, "The height fields (HIGH is a PNG or EXR)");
  const auto own = command->get_options();
  add_options(*command, surface_rows(/*iso_required=*/false), &a->surface);
  add_options(*command, file_and_chart_rows(), &a->surface);
  std::vector<const Option*> for_volumes;
  for (const Option* option : command->get_options()) {
    if (std::find(own.begin(), own.end(), option) == own.end()) for_volumes.push_back(option);
  }
  return [a, command, for_volumes] {
    for (const Option* option : for_volumes) {
      if (option->count() != 0) a->for_volumes.push_back(option->get_name());
    }
    for (const char* name : {"--settings", "--repeat", "--max-distance", "--ao", "--ao-error",
                             "--ao-budget", "--directions", "--pixels"}) {
      if (command->find_option(name)->count() != 0) a->not_for_plans.emplace_back(name);
    }
    const auto hard = std::find(a->settings.begin(), a->settings.end(), kHard);
    if (hard != a->settings.end()) {
      const auto at = a->settings.erase(hard);
      a->settings.insert(at, hard_settings().begin(), hard_settings().end());
    }
    return run(*a);
  };
}

}  // namespace kiln::cli

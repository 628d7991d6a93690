// What `kiln chart` is asked for, checked before any work.
#include <algorithm>

#include "arguments/dense_input.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "arguments/surface_arguments.h"
#include "lab/chart_output.h"
#include "lab/chart_run.h"
#include "lab/chart_volume.h"
#include "picture/plot.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

bool is_volume(const ChartArguments& a, const std::string& path) {
  return !a.surface.raw_size.empty() || is_volume_name(path);
}

/// Settings by name that a kind of input does not have. \throws Error(usage)
void check_settings(const ChartArguments& a, const std::vector<std::string>& names,
                    const char* kind) {
  for (const std::string& name : a.settings) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    throw Error(ErrorCode::usage, "--settings " + name + " is not for " + kind + ": give some of " +
                                      join(names, ", ") + ".");
  }
}

/// Before any work. \throws Error(usage)
void check_volumes(const ChartArguments& a) {
  for (const std::string& path : a.meshes) {
    if (is_volume(a, path)) continue;
    throw Error(ErrorCode::usage, "'" + path + "' is no volume, but '" + a.meshes.front() +
                                      "' is: give volumes alone, or meshes alone, HIGH LOW.");
  }
  if (a.surface.iso.empty()) {
    throw Error(ErrorCode::usage,
                "'" + a.meshes.front() + "' is a volume: say which surface of it by --iso VALUE.");
  }
  if (a.heights.given()) {
    throw Error(ErrorCode::usage, "--height and --extent are for height fields, but '" +
                                      a.meshes.front() + "' is a volume.");
  }
  cli::check(a.surface);
  std::vector<std::string> names;
  for (const VolumeWay& way : volume_ways()) names.push_back(way.name);
  check_settings(a, names, "volumes");
  if (a.ao || a.ao_error || a.ao_budget) {
    throw Error(ErrorCode::usage, "--ao, --ao-error and --ao-budget are for meshes, but '" +
                                      a.meshes.front() + "' is a volume.");
  }
  if (a.directions) {
    throw Error(ErrorCode::usage, "--directions is for measures of meshes, but '" +
                                      a.meshes.front() + "' is a volume.");
  }
}

/// Before any work. \throws Error(usage)
void check_meshes(const ChartArguments& a) {
  for (const std::string& path : a.meshes) {
    if (!is_volume_name(path)) continue;
    throw Error(ErrorCode::usage, "'" + path + "' is a volume, but '" + a.meshes.front() +
                                      "' is not: give volumes alone, or meshes alone, HIGH LOW.");
  }
  if (!a.for_volumes.empty()) {
    throw Error(ErrorCode::usage,
                a.for_volumes.front() + " is for volumes, but '" + a.meshes.front() + "' is none.");
  }
  if (!has_height_fields(a) && a.heights.given()) {
    throw Error(ErrorCode::usage,
                "--height and --extent are for a HIGH that is a height field, a PNG or EXR; none "
                "is.");
  }
  height_field_options(a.heights);
  check_settings(a, mesh_setting_names(), "meshes");
  check_ao(a);
  if (a.meshes.size() % 2 != 0) {
    throw Error(ErrorCode::usage, "Meshes come in pairs, HIGH LOW, but '" + a.meshes.back() +
                                      "' has no LOW: give its low poly, with UVs.");
  }
}

/// Settings without the comma between them would be meshes. \throws Error(usage)
void check_no_settings(const ChartArguments& a) {
  std::vector<std::string> names = mesh_setting_names();
  for (const VolumeWay& way : volume_ways()) names.push_back(way.name);
  for (const std::string& path : a.meshes) {
    std::error_code ignored;
    if (fs::exists(path, ignored) || std::find(names.begin(), names.end(), path) == names.end())
      continue;
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    throw Error(ErrorCode::usage, "'" + path +
                                      "' is no file but the name of a setting: give settings "
                                      "separated by commas, --settings NAME,NAME, of " +
                                      join(names, ", ") + ".");
  }
}

}  // namespace

bool has_volumes(const ChartArguments& a) { return is_volume(a, a.meshes.front()); }

bool has_height_fields(const ChartArguments& a) {
  for (std::size_t i = 0; i < a.meshes.size(); i += 2) {
    if (is_height_field(a.meshes[i])) return true;
  }
  return false;
}

std::vector<std::string> mesh_setting_names() {
  std::vector<std::string> names;
  for (const ChartSetting& setting : all_chart_settings()) names.push_back(setting.name);
  for (const AoSetting& setting : ao_settings()) names.push_back(setting.name);
  return names;
}

void expand_settings(ChartArguments& a) {
  const auto hard = std::find(a.settings.begin(), a.settings.end(), kHard);
  if (hard == a.settings.end()) return;
  const auto at = a.settings.erase(hard);
  a.settings.insert(at, hard_settings().begin(), hard_settings().end());
}

void check_chart(const ChartArguments& a) {
  check_no_settings(a);
  check_plan(a);
  if (!a.plan) has_volumes(a) ? check_volumes(a) : check_meshes(a);
  std::vector<fs::path> outputs;
  for (const char* ending : {".json", ".csv", ".md", "_ao.csv"}) {
    outputs.push_back(fs::path(a.out) / (std::string(kChartName) + ending));
  }
  for (const std::string& file : plot_files(kChartName)) outputs.push_back(fs::path(a.out) / file);
  check_paths({a.meshes.begin(), a.meshes.end()}, outputs);
}

}  // namespace kiln::cli

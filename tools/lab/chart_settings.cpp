// Lists the settings that `kiln chart` compares, by name.
#include <algorithm>
#include <sstream>

#include "job/job_options.h"
#include "lab/chart.h"

namespace kiln::cli {
namespace {

/// A setting that charts compare. `flags` are the flags of `kiln bake` that make it.
struct NamedSetting {
  const char *name, *label, *family, *flags;
};

constexpr NamedSetting kSettings[] = {
    {"ray", "rays", "rays", ""},
    {"ray_2x2", "rays, 2×2 samples", "rays", "--samples 2"},
    {"ray_4x4", "rays, 4×4 samples", "rays", "--samples 4"},
    {"views_6", "6 views", "views", "--match views --views 6"},
    {"views_12", "12 views", "views", "--match views --views 12"},
    {"views_24", "24 views", "views", "--match views --views 24"},
    {"views_48", "48 views", "views", "--match views --views 48"},
    {"views_auto", "views chosen", "views", "--match views --views auto"},
    {"views_12_512", "12 views, 512²", "views", "--match views --views 12 --view-size 512"},
    {"views_12_1024", "12 views, 1024²", "views", "--match views --views 12 --view-size 1024"},
    {"views_12_2048", "12 views, 2048²", "views", "--match views --views 12 --view-size 2048"},
    {"views_12_4096", "12 views, 4096²", "views", "--match views --views 12 --view-size 4096"},
    // The method of Wang, Froehlich and Goebel 2003: smallest depth difference, without refinement of points.
    {"paper_12", "12 views as in the paper", "paper",
     "--match views --views 12 --view-criterion depth --no-view-refine true"},
    {"views_12_ray", "12 views, then rays", "views_rays",
     "--match views --views 12 --fallback ray"},
    {"closest", "nearest points", "closest", "--match closest"},
    {"visibility_texel", "visibility, texels", "visibility",
     "--match visibility --visibility-at texel"},
    {"visibility_vertex", "visibility, vertices", "visibility",
     "--match visibility --visibility-at vertex"},
    {"visibility_face", "visibility, faces", "visibility",
     "--match visibility --visibility-at face"},
    {"hybrid", "hybrid, texels", "visibility", "--match hybrid --visibility-at texel"},
    {"uv", "same UVs", "uv", "--match uv"}};

/// Settings for hard surfaces, with other ray directions or a cage, which are only compared if --settings names them.
constexpr NamedSetting kHardOnly[] = {
    {"ray_nearest", "nearest face, averaged", "directions", "--ray nearest --direction averaged"},
    {"ray_averaged", "averaged", "directions", "--direction averaged"},
    {"ray_face", "face", "directions", "--direction face"},
    {"cage_auto", "cage auto", "cages", "--cage auto"},
    {"cage_3", "cage 3%", "cages", "--cage 3%"},
    {"cage_3_averaged", "cage 3%, averaged", "cages", "--cage 3% --direction averaged"}};

ChartSetting setting_of(const NamedSetting& row) {
  const Job job = parse_bake_job(row.flags);
  return {row.name, row.label, row.family, job.bake, job.cage_auto};
}

}  // namespace

Job parse_bake_job(const std::string& flags) {
  Job job;
  std::istringstream flag_words(flags);
  for (std::string flag, value; flag_words >> flag >> value;) {
    find_row(bake_rows(), flag)->value.set(&job, flag, {value});
  }
  job.bake.maps = maps_or_default(job);
  return job;
}

std::vector<ChartSetting> chart_settings() {
  std::vector<ChartSetting> settings;
  for (const NamedSetting& row : kSettings) settings.push_back(setting_of(row));
  add_other_matches(matches(), settings);
  return settings;
}

void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings) {
  for (const MatchInfo& row : rows) {
    const bool used = std::any_of(
        settings.begin(), settings.end(),
        [&](const ChartSetting& setting) { return setting.bake.match.method == row.method; });
    if (used || needs_direction(row)) continue;
    const std::string name(row.method.name);
    settings.push_back({name, name, "others", {}});
    settings.back().bake.match.method = row.method;
  }
}

std::vector<ChartSetting> all_chart_settings() {
  std::vector<ChartSetting> settings = chart_settings();
  for (const NamedSetting& row : kHardOnly) settings.push_back(setting_of(row));
  return settings;
}

const std::vector<std::string>& hard_settings() {
  static const std::vector<std::string> names = {
      "ray",    "ray_2x2",         "ray_nearest", "ray_averaged", "ray_face",        "cage_auto",
      "cage_3", "cage_3_averaged", "views_12",    "closest",      "visibility_texel"};
  return names;
}

}  // namespace kiln::cli

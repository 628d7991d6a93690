#include "lab/chart_ao.h"

#include <algorithm>
#include <array>

#include "lab/table.h"

namespace kiln::cli {
namespace {

/// --ao-error casts a quarter of its rays before anything is smoothed, and more only where the error asks for
/// it: an error of 1 never does.
constexpr std::uint32_t kSmoothedShare = 4;

const std::vector<Measure>& ao_measures() {
  static const std::vector<Measure> all = {
      {"ao_error", "Ambient occlusion: error against 4,096 rays from the same points",
       "Root mean square, of 255"}};
  return all;
}

/// 8 to 1024 rays, plain and smoothed; 64 to 512 views.
std::vector<AoRow> all_rows() {
  std::vector<AoRow> rows;
  const auto add = [&](const char* family, const char* what, std::uint32_t count,
                       const std::string& flags) -> OcclusionOptions& {
    AoRow row;
    row.name = std::string(family) + "_" + std::to_string(count);
    row.label = std::to_string(count) + " " + what;
    row.family = family;
    row.flags = flags;
    return rows.emplace_back(std::move(row)).occlusion;
  };
  for (std::uint32_t rays = 8; rays <= 1024; rays *= 2) {
    add("ao_rays", "rays", rays, "--ao-rays " + std::to_string(rays)).rays = rays;
  }
  for (std::uint32_t rays = 8; rays <= 1024; rays *= 2) {
    const std::uint32_t cast = kSmoothedShare * rays;
    OcclusionOptions& occlusion =
        add("ao_smooth", "smoothed", rays, "--ao-rays " + std::to_string(cast) + " --ao-error 1");
    occlusion.rays = cast;
    occlusion.max_error = 1;
  }
  for (std::uint32_t views = 64; views <= 512; views *= 2) {
    OcclusionOptions& occlusion =
        add("ao_views", "views", views, "--ao-by views --ao-views " + std::to_string(views));
    occlusion.by = OcclusionBy::views;
    occlusion.views = views;
  }
  return rows;
}

/// "64 rays smoothed at 0.93/255 in 0.412 s: --ao-rays 256 --ao-error 1".
std::string reached(const AoRow& row) {
  return row.label + ", " + fixed_text(row.error.rms, 2) + "/255 in " + fixed_text(row.seconds, 3) +
         " s: " + row.flags;
}

}  // namespace

std::vector<std::string> ao_setting_names() {
  std::vector<std::string> names;
  for (const AoRow& row : all_rows()) names.push_back(row.name);
  return names;
}

AoChart::AoChart(const ChartArguments& a)
    : rows(all_rows()), size(a.size), repeat(a.repeat), budget(a.ao_budget), error(a.ao_error) {
  std::vector<AoRow> named = rows;
  std::erase_if(named, [&](const AoRow& row) { return !a.names(row.name); });
  if (!a.ao || !named.empty()) rows = std::move(named);
}

bool AoChart::run(const Device& device, const Mesh& high, const Mesh& low,
                  const Progress& progress) {
  const Source source(device, high);
  // Measuring counts as one more bake.
  double done = 0;
  const double steps = static_cast<double>(rows.size() * (2 + repeat));
  std::string stage;
  BakeOptions bake_with;
  // All settings can be asked of it.
  bake_with.maps = {std::find_if(maps().begin(), maps().end(), [](const MapInfo& map) {
                      return obeys(map, "occlusion.max_error") && obeys(map, "occlusion.views");
                    })->kind};
  bake_with.width = bake_with.height = size;
  bake_with.match.max_distance = max_distance;
  bake_with.report.recall = 0;
  bake_with.progress = [&](double share, std::string_view) {
    return progress((done + share) / steps, stage);
  };
  bake_with.report.errors = true;
  for (AoRow& row : rows) {
    stage = "measuring ambient occlusion, " + row.label;
    bake_with.occlusion = row.occlusion;
    const BakeResult baked = bake(source, low, bake_with);
    if (baked.cancelled) return false;
    if (baked.report.errors.empty()) {
      throw Error(ErrorCode::input, "'" + low.name + "' has no texel at " + std::to_string(size) +
                                        " texels a side that its high poly is found for, so "
                                        "there is no ambient occlusion to compare: use a larger "
                                        "--size.");
    }
    row.error = baked.report.errors.front();  // of rays from the same points; finer points follow
    row.errors = {row.error.rms};
    done += 2;
  }
  // In turns, so that what else the machine does falls on all alike.
  bake_with.report.errors = false;
  for (std::uint32_t run = 0; run < repeat; ++run) {
    for (AoRow& row : rows) {
      stage = "timing ambient occlusion, " + row.label + ", run " + std::to_string(run + 1) +
              " of " + std::to_string(repeat);
      bake_with.occlusion = row.occlusion;
      const BakeResult baked = bake(source, low, bake_with);
      if (baked.cancelled) return false;
      row.runs.push_back(baked.report.seconds_detail);
      done += 1;
    }
  }
  for (AoRow& row : rows) row.seconds = row.runs[median_index(row.runs)];
  mark_fronts(rows);
  return true;
}

AoChart::Choice AoChart::for_budget() const {
  const AoRow *best = nullptr, *fastest = &rows.front();
  for (const AoRow& row : rows) {
    if (row.seconds < fastest->seconds) fastest = &row;
    if (row.seconds > *budget) continue;
    if (best == nullptr || row.error.rms < best->error.rms) best = &row;
  }
  return {best != nullptr ? best : fastest, best != nullptr};
}

AoChart::Choice AoChart::for_error() const {
  const AoRow *best = nullptr, *nearest = &rows.front();
  for (const AoRow& row : rows) {
    if (row.error.rms < nearest->error.rms) nearest = &row;
    if (row.error.rms > *error * 255) continue;
    if (best == nullptr || row.seconds < best->seconds) best = &row;
  }
  return {best != nullptr ? best : nearest, best != nullptr};
}

std::vector<std::string> AoChart::choices() const {
  std::vector<std::string> texts;
  if (budget) {
    const auto [row, within] = for_budget();
    const std::string limit = text_of(*budget) + " s";
    texts.push_back((within ? "nearest to the truth within " + limit + ": "
                            : "nothing gathers within " + limit + "; the fastest: ") +
                    reached(*row));
  }
  if (error) {
    const auto [row, within] = for_error();
    const std::string limit = fixed_text(*error * 255, 2) + "/255";
    texts.push_back((within ? "fastest that reaches " + limit + ": "
                            : "nothing reaches " + limit + "; the nearest: ") +
                    reached(*row));
  }
  return texts;
}

std::string AoChart::csv(const std::vector<AoChart>& charts) {
  if (charts.empty() || !charts.front().asked()) return {};
  Table table(
      "pair|setting|family|seconds|rms_255|mean_255|p95_255|max_255|texels|front|seconds_least|"
      "seconds_most|flags");
  for (std::size_t i = 0; i < charts.size(); ++i) {
    for (const AoRow& row : charts[i].rows) {
      const MapError& e = row.error;
      table.add({i + 1, row.name, row.family, row.seconds, e.rms, e.mean, e.p95, e.max, e.texels,
                 bool{row.front[0]}, row.least(), row.most(), row.flags});
    }
  }
  return table.csv();
}

std::string AoChart::markdown() const {
  if (!asked()) return {};
  Table table("ambient occlusion|flags of bake|>seconds|>root mean square|>95%|>most|^");
  for (const AoRow& row : rows) {
    table.add({markdown_cell(row.label), "`" + row.flags + "`", fixed_text(row.seconds, 4),
               fixed_text(row.error.rms, 2), fixed_text(row.error.p95, 2),
               fixed_text(row.error.max, 2), front_dot(row, 0)});
  }
  std::string text =
      "\nAmbient occlusion. Seconds: to gather it, without the match and files. Errors, of 255, "
      "at " +
      std::to_string(rows.front().error.texels) +
      " texels against 4096 rays from the same points.\n\n" + table.markdown();
  for (const std::string& choice : choices()) text += "\n" + markdown_cell(choice) + "\n";
  return text;
}

Json AoChart::panel() const {
  Json panel = chart_panel(marks_of(rows), ao_measures(), 0);
  panel["seconds_title"] = "Seconds to gather ambient occlusion, without the match";
  return panel;
}

void AoChart::add_styles(Json& plot) const {
  constexpr std::array<MarkStyle, 3> kStyles = {
      {{"ao_rays", "occlusion by rays", ">", "#222222"},
       {"ao_smooth", "rays, smoothed", "D", "#d55e00"},
       {"ao_views", "occlusion by views", "h", "#0072b2"}}};
  cli::add_styles(kStyles, marks_of(rows), plot);
}

Json AoChart::describe() const {
  Json json = fields("settings front chosen", {Json::array(), Json::array(), Json::object()});
  for (const AoRow& row : rows) {
    const MapError& e = row.error;
    json["settings"].push_back(
        fields("name label family flags seconds runs rms mean p95 max texels against on_front",
               {row.name, row.label, row.family, row.flags, row.seconds, row.runs, e.rms / 255,
                e.mean / 255, e.p95 / 255, e.max / 255, e.texels, e.against, bool{row.front[0]}}));
    if (row.front[0]) json["front"].push_back(row.name);
  }
  const auto chosen = [&](const char* key, const Choice& choice, double asked) {
    const AoRow& row = *choice.row;
    json["chosen"][key] =
        fields("setting flags asked reached seconds rms",
               {row.name, row.flags, asked, choice.within, row.seconds, row.error.rms / 255});
  };
  if (budget) chosen("budget", for_budget(), *budget);
  if (error) chosen("error", for_error(), *error);
  return json;
}

std::vector<std::string> AoChart::lines() const {
  std::vector<std::string> lines;
  for (const AoRow& row : rows) {
    lines.push_back(formatted("%-14s %8.4f s; ambient occlusion off by %.2f/255, 95%% %.2f%s",
                              row.name.c_str(), row.seconds, row.error.rms, row.error.p95,
                              row.front[0] ? " *" : ""));
  }
  for (const std::string& choice : choices()) lines.push_back(choice);
  return lines;
}

}  // namespace kiln::cli

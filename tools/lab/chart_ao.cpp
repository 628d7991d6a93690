// Charts the speed and the error of ambient occlusion that is computed by rays, by smoothed rays, and by depth views.
#include <algorithm>
#include <optional>

#include "lab/chart.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

/// With --ao-error, a bake first casts the number of rays in --ao-rays divided by this factor, and casts further rays
/// only if the error bound requires them. With a bound of 1 it casts no further rays, but smooths the result.
constexpr std::uint32_t kRaysPerFirstRay = 4;

const Measure& ao_measure() {
  static const Measure measure = {
      "ao_error", "rms", "Ambient occlusion: error against 4,096 rays from the same points",
      "Root mean square, of 255", 255};
  return measure;
}

/// Returns all settings: 8 to 1024 rays, each with and without smoothing, and 64 to 512 views.
std::vector<AoSetting> list_settings() {
  std::vector<AoSetting> settings;
  const auto add = [&](const std::string& family, const char* what, std::uint32_t count,
                       const std::string& flags) {
    const std::string number = std::to_string(count);
    settings.push_back({family + "_" + number, number + " " + what, family, flags});
  };
  for (std::uint32_t rays = 8; rays <= 1024; rays *= 2) {
    add("ao_rays", "rays", rays, "--ao-rays " + std::to_string(rays));
  }
  for (std::uint32_t rays = 8; rays <= 1024; rays *= 2) {
    add("ao_smooth", "smoothed", rays,
        "--ao-rays " + std::to_string(kRaysPerFirstRay * rays) + " --ao-error 1");
  }
  for (std::uint32_t views = 64; views <= 512; views *= 2) {
    add("ao_views", "views", views, "--ao-by views --ao-views " + std::to_string(views));
  }
  return settings;
}

double rms_of(const Mark& mark) { return mark.figures.at("rms").number(); }

/// Adds the best setting within a limit to the report and to the lines: among the marks for which `bounded` is at most
/// the limit, the one with the smallest value of `minimised`. If there is none, adds the mark with the smallest value
/// of `bounded`.
/// \param key   key in the report
/// \param unit  unit of the limit in the line of text
template <class Bounded, class Minimised>
void add_best_within_limit(const char* key, double limit, const std::string& unit,
                           const Bounded& bounded, const Minimised& minimised,
                           const std::vector<Mark>& marks, ChartGroup& group) {
  const auto is_worse = [&](const Mark& a, const Mark& b) {
    const bool is_a_within = bounded(a) <= limit, is_b_within = bounded(b) <= limit;
    if (is_a_within != is_b_within) return is_b_within;
    return is_a_within ? minimised(a) > minimised(b) : bounded(a) > bounded(b);
  };
  const Mark* best = &marks.front();
  for (const Mark& mark : marks) {
    if (is_worse(*best, mark)) best = &mark;
  }
  const bool reached = bounded(*best) <= limit;
  const std::string& flags = best->figures.at("flags").text();
  group.report["ao"]["chosen"][key] =
      fields("setting flags asked reached seconds rms",
             {best->name, flags, limit, reached, best->seconds, rms_of(*best)});
  group.lines.push_back((reached ? "best within " : "nothing is within ") + text_of(limit) + unit +
                        (reached ? ": " : "; the nearest: ") + best->label + ", " +
                        fixed_text(255 * rms_of(*best), 2) + "/255 in " +
                        fixed_text(best->seconds, 3) + " s: " + flags);
}

}  // namespace

std::vector<std::string> ao_setting_names() {
  std::vector<std::string> names;
  for (const AoSetting& setting : list_settings()) names.push_back(setting.name);
  return names;
}

std::vector<AoSetting> ao_settings(const ChartArguments& a) {
  std::vector<AoSetting> named = list_settings();
  std::erase_if(named, [&](const AoSetting& setting) { return !a.selects(setting.name); });
  return a.ao && named.empty() ? list_settings() : named;
}

bool add_ao(const Device& device, const Mesh& high, const Mesh& low, const ChartArguments& a,
            const std::vector<AoSetting>& settings, Steps& steps, ChartGroup& group) {
  const Source source(device, high);
  BakeOptions bake_with;
  // All settings bake ambient occlusion, the map that uses both options.
  bake_with.maps = {std::find_if(maps().begin(), maps().end(), [](const MapInfo& map) {
                      return obeys(map, "occlusion.max_error") && obeys(map, "occlusion.views");
                    })->kind};
  bake_with.width = bake_with.height = *a.size;
  bake_with.match.max_distance = a.search_distance();
  bake_with.report.recall = 0;
  bake_with.progress = steps.step_progress();
  bake_with.report.errors = true;
  std::vector<Mark> marks;
  for (const AoSetting& setting : settings) {
    if (!steps.start("measuring ambient occlusion, " + setting.label)) return false;
    bake_with.occlusion = parse_bake_job(setting.flags).bake.occlusion;
    const BakeResult baked = bake(source, low, bake_with);
    if (baked.cancelled) return false;
    if (baked.report.errors.empty()) {
      throw Error(ErrorCode::input,
                  "'" + low.name + "' has no texel at " + std::to_string(*a.size) +
                      " texels a side at which a point of the high poly is found, so no ambient "
                      "occlusion can be compared: use a larger --size.");
    }
    // Difference to a map with more rays from the same points
    const MapError& e = baked.report.errors.front();
    marks.push_back({setting.name, setting.label, setting.family});
    marks.back().figures =
        fields("name label family flags rms mean p95 max texels against",
               {setting.name, setting.label, setting.family, setting.flags, e.rms / 255,
                e.mean / 255, e.p95 / 255, e.max / 255, e.texels, e.reference});
    steps.done += 2;
  }
  bake_with.report.errors = false;
  const bool timed = time_in_turns(marks, a.repeat, [&](std::size_t i, const std::string& note) {
    if (!steps.start("timing ambient occlusion, " + marks[i].label + note)) return Json();
    bake_with.occlusion = parse_bake_job(settings[i].flags).bake.occlusion;
    const BakeResult baked = bake(source, low, bake_with);
    steps.done += 1;
    return baked.cancelled ? Json() : Json(baked.report.seconds_detail);
  });
  if (!timed) return false;
  Json& report = group.report["ao"];
  report = finish_marks(marks, "", {ao_measure()});
  report["front"] = Json(report.at("front.ao_error"));
  Json rows = report.at("settings");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i]["on_front"] = Json(rows[i].at("on_front.ao_error"));
  }
  report.update(fields("settings chosen", {rows, Json::object()}));
  const auto seconds_of = [](const Mark& mark) { return mark.seconds; };
  if (a.ao_budget)
    add_best_within_limit("budget", *a.ao_budget, " s", seconds_of, rms_of, marks, group);
  if (a.ao_error)
    add_best_within_limit("error", *a.ao_error, " rms", rms_of, seconds_of, marks, group);
  group.tables.push_back(
      {"Ambient occlusion. Seconds: to gather it, without the match and files. Errors, of 255: "
       "against 4096 rays from the same points, at " +
           count_text(marks.front().figures.at("texels")) + " texels.",
       {{"setting", "name"},
        {"seconds", "seconds", 4},
        {"root mean square", "rms", 2, 255, "on_front"},
        {"95%", "p95", 2, 255},
        {"most", "max", 2, 255},
        {"flags of bake", "flags"}},
       rows,
       "_ao.csv"});
  group.panels.push_back(chart_panel(marks, ao_measure()));
  Json& panel = group.panels[group.panels.size() - 1];
  panel["seconds_title"] = "Seconds to gather ambient occlusion, without the match";
  return true;
}

}  // namespace kiln::cli

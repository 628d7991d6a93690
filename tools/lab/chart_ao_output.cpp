#include <algorithm>
#include <cstdio>

#include "lab/chart_ao.h"
#include "lab/chart_output.h"

namespace kiln::cli {
namespace {

/// "64 rays smoothed at 0.93/255 in 0.412 s: --ao-rays 256 --ao-error 1".
std::string reached(const AoRow& row) {
  return row.setting.label + ", " + fixed_text(row.error.rms, 2) + "/255 in " +
         fixed_text(row.seconds, 3) + " s: " + row.setting.flags;
}

/// A sentence of what a budget chose.
std::string budget_text(const AoChart& chart, double budget) {
  const AoRow& row = chart.rows[*chart.for_budget];
  const std::string within = text_of(budget) + " s";
  return chart.within_budget
             ? "nearest to the truth within " + within + ": " + reached(row)
             : "nothing gathers within " + within + "; the fastest: " + reached(row);
}

/// The same of an error.
std::string error_text(const AoChart& chart, double error) {
  const AoRow& row = chart.rows[*chart.for_error];
  const std::string wanted = fixed_text(error * 255, 2) + "/255";
  return chart.reaches_error ? "fastest that reaches " + wanted + ": " + reached(row)
                             : "nothing reaches " + wanted + "; the nearest: " + reached(row);
}

Json chosen(const AoRow& row, bool within, double asked) {
  return {
      {"setting", row.setting.name}, {"flags", row.setting.flags}, {"asked", asked},
      {"reached", within},           {"seconds", row.seconds},     {"rms", row.error.rms / 255}};
}

}  // namespace

std::string ao_data_head() {
  return "pair,setting,family,seconds,rms_255,mean_255,p95_255,max_255,texels,front,seconds_least,"
         "seconds_most,flags\n";
}

std::string ao_data(std::size_t pair, const AoChart& chart) {
  std::string text;
  for (const AoRow& row : chart.rows) {
    const auto [least, most] = std::minmax_element(row.runs.begin(), row.runs.end());
    const std::vector<std::string> fields = {
        std::to_string(pair),      row.setting.name,          family_name(row.setting.family),
        exact_text(row.seconds),   exact_text(row.error.rms), exact_text(row.error.mean),
        exact_text(row.error.p95), exact_text(row.error.max), std::to_string(row.error.texels),
        row.front ? "1" : "0",     exact_text(*least),        exact_text(*most),
        row.setting.flags};
    text += join(fields, ",") + "\n";
  }
  return text;
}

std::string ao_table(const AoChart& chart, const AoChartOptions& options) {
  std::string text =
      "\nAmbient occlusion. Seconds: to gather it, without the match and files. Errors, of 255, "
      "at " +
      std::to_string(chart.rows.front().error.texels) +
      " texels against 4096 rays from the same points.\n\n"
      "| ambient occlusion | flags of bake | seconds | root mean square | 95% | most | |\n"
      "| --- | --- | --: | --: | --: | --: | :-: |\n";
  for (const AoRow& row : chart.rows) {
    text += "| " + markdown_cell(row.setting.label) + " | `" + row.setting.flags + "` | " +
            fixed_text(row.seconds, 4) + " | " + fixed_text(row.error.rms, 2) + " | " +
            fixed_text(row.error.p95, 2) + " | " + fixed_text(row.error.max, 2) + " | " +
            (row.front ? "●" : "") + " |\n";
  }
  if (chart.for_budget) text += "\n" + markdown_cell(budget_text(chart, *options.budget)) + "\n";
  if (chart.for_error) text += "\n" + markdown_cell(error_text(chart, *options.error)) + "\n";
  return text;
}

Json ao_panel(const AoChart& chart) {
  Json marks = Json::array();
  for (const AoRow& row : chart.rows) {
    marks.push_back({{"label", row.setting.label},
                     {"family", family_name(row.setting.family)},
                     {"seconds", row.seconds},
                     {"error", row.error.rms},
                     {"front", row.front},
                     {"runs", row.runs}});
  }
  return {{"name", "ao_error"},
          {"title", "Ambient occlusion: error against 4,096 rays from the same points"},
          {"seconds_title", "Seconds to gather ambient occlusion, without the match"},
          {"unit", "Root mean square, of 255"},
          {"marks", std::move(marks)}};
}

Json ao_styles(const AoChart& chart) {
  struct Style {
    AoFamily family;
    const char *title, *mark, *color;
  };
  Json styles = Json::array();
  for (const Style& style : {Style{AoFamily::rays, "occlusion by rays", ">", "#222222"},
                             Style{AoFamily::smooth, "rays, smoothed", "D", "#d55e00"},
                             Style{AoFamily::views, "occlusion by views", "h", "#0072b2"}}) {
    if (std::none_of(chart.rows.begin(), chart.rows.end(),
                     [&](const AoRow& row) { return row.setting.family == style.family; })) {
      continue;
    }
    styles.push_back({{"family", family_name(style.family)},
                      {"title", style.title},
                      {"mark", style.mark},
                      {"color", style.color}});
  }
  return styles;
}

Json describe(const AoChart& chart, const AoChartOptions& options) {
  Json json = {{"settings", Json::array()}, {"front", Json::array()}};
  for (const AoRow& row : chart.rows) {
    json["settings"].push_back({{"name", row.setting.name},
                                {"label", row.setting.label},
                                {"family", family_name(row.setting.family)},
                                {"flags", row.setting.flags},
                                {"seconds", row.seconds},
                                {"runs", row.runs},
                                {"rms", row.error.rms / 255},
                                {"mean", row.error.mean / 255},
                                {"p95", row.error.p95 / 255},
                                {"max", row.error.max / 255},
                                {"texels", row.error.texels},
                                {"against", row.error.against},
                                {"on_front", row.front}});
    if (row.front) json["front"].push_back(row.setting.name);
  }
  json["chosen"] = Json::object();
  if (chart.for_budget) {
    json["chosen"]["budget"] =
        chosen(chart.rows[*chart.for_budget], chart.within_budget, *options.budget);
  }
  if (chart.for_error) {
    json["chosen"]["error"] =
        chosen(chart.rows[*chart.for_error], chart.reaches_error, *options.error);
  }
  return json;
}

std::vector<std::string> summary(const AoChart& chart, const AoChartOptions& options) {
  std::vector<std::string> lines;
  for (const AoRow& row : chart.rows) {
    char text[160];
    std::snprintf(
        text, sizeof text, "%-14s %8.4f s; ambient occlusion off by %.2f/255, 95%% %.2f%s",
        row.setting.name.c_str(), row.seconds, row.error.rms, row.error.p95, row.front ? " *" : "");
    lines.emplace_back(text);
  }
  if (chart.for_budget) lines.push_back(budget_text(chart, *options.budget));
  if (chart.for_error) lines.push_back(error_text(chart, *options.error));
  return lines;
}

}  // namespace kiln::cli

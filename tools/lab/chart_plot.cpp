#include <algorithm>
#include <array>
#include <cstdio>

#include "arguments/parse.h"
#include "lab/chart_output.h"

namespace kiln::cli {
namespace {

struct Style {
  ChartFamily family;
  const char* title;
  const char* mark;
  const char* color;
};
// Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr std::array<Style, 10> kStyles = {
    {{ChartFamily::rays, "rays", "^", "#222222"},
     {ChartFamily::views, "depth views", "o", "#0072b2"},
     {ChartFamily::views_rays, "views, then rays", "d", "#009e73"},
     {ChartFamily::paper, "views as in the paper", "s", "#d55e00"},
     {ChartFamily::closest, "nearest points", "v", "#cc79a7"},
     {ChartFamily::visibility, "by visibility", "p", "#8a6d00"},
     {ChartFamily::uv, "same UVs", "x", "#56b4e9"},
     {ChartFamily::directions, "rays, other directions", "<", "#7a7a7a"},
     {ChartFamily::cages, "from a cage", "P", "#e69f00"},
     {ChartFamily::others, "other matches", "*", "#b22222"}}};

/// In the picture: where a number was chosen, it says so.
std::string label_of(const ChartRow& row) {
  std::string text = row.setting.label;
  if (row.report.views && row.setting.bake.views.automatic) {
    text = std::to_string(row.report.views->directions.size()) + " views chosen";
  }
  return text;
}

std::string title_of(const ChartPair& pair, ChartMeasure measure) {
  switch (measure) {
    case ChartMeasure::object_space:
      return "Object space: from what the map shows to what the high poly shows";
    case ChartMeasure::normalised_image_space:
      return "Normalised image space: from a match to its ray, over its distance";
    case ChartMeasure::uniformity:
      return "Uniformity: steps between matches, longer or shorter than the texels'";
    case ChartMeasure::map:  // is not drawn
    case ChartMeasure::picture:
      break;
  }
  char figure[32];
  std::snprintf(figure, sizeof figure, "%.2f", pair.without_map.mean_degrees);
  return "Error of the picture: rendered normals to the high poly's (no map: " +
         std::string(figure) + "°)";
}

const char* unit_of(ChartMeasure measure) {
  switch (measure) {
    case ChartMeasure::object_space:
      return "Mean, % of the diagonal";
    case ChartMeasure::normalised_image_space:
      return "Mean, 0 to 1";
    case ChartMeasure::uniformity:
      return "Mean, %";
    case ChartMeasure::map:  // is not drawn
    case ChartMeasure::picture:
      break;
  }
  return "Mean angle, degrees";
}

Json panel(const ChartPair& pair, ChartMeasure measure) {
  Json marks = Json::array();
  for (const ChartRow& row : pair.rows) {
    Json mark = {{"label", label_of(row)},
                 {"family", family_name(row.setting.family)},
                 {"seconds", row.seconds.correspondence()},
                 {"error", row.error(measure)},
                 {"front", row.front(measure)}};
    for (const ChartSeconds& run : row.runs) mark["runs"].push_back(run.correspondence());
    marks.push_back(std::move(mark));
  }
  return {{"name", measure_name(measure)},
          {"title", title_of(pair, measure)},
          {"unit", unit_of(measure)},
          {"marks", std::move(marks)}};
}

Json group(const ChartPair& pair) {
  Json json = {{"title", pair.high_name + ", " + with_commas(pair.high_faces) + " faces, to " +
                             pair.low_name + ", " + with_commas(pair.low_faces)},
               {"note", ""}};
  for (const ChartRow& row : pair.rows) {
    if (row.report.views && row.setting.bake.views.size == 0) {
      json["note"] =
          "views of " + std::to_string(row.report.views->size) + "² pixels where none are named";
    }
  }
  for (const ChartMeasure measure : kChartPanels) json["panels"].push_back(panel(pair, measure));
  if (pair.ao) json["panels"].push_back(ao_panel(*pair.ao));
  return json;
}

}  // namespace

std::string runs_note(unsigned repeat) {
  return repeat == 1
             ? ", one run"
             : ", median of " + std::to_string(repeat) + " runs (thin lines: fastest to slowest)";
}

Plot chart_plot(const std::vector<ChartPair>& pairs, const ChartOptions& options,
                const DeviceInfo& device) {
  Json data = {
      {"kind", "chart"},
      {"title", pairs.front().ao ? "Speed against accuracy: every match, and ambient occlusion"
                                 : "Normal maps: speed against accuracy of every match"},
      {"subtitle", std::to_string(options.size) + " × " + std::to_string(options.size) + " maps, " +
                       device.name + runs_note(options.repeat)},
      {"seconds_title", "Seconds to match, hierarchy and views included"}};
  for (const Style& style : kStyles) {
    const bool occurs = std::any_of(pairs.begin(), pairs.end(), [&](const ChartPair& pair) {
      return std::any_of(pair.rows.begin(), pair.rows.end(),
                         [&](const ChartRow& row) { return row.setting.family == style.family; });
    });
    if (!occurs) continue;
    data["styles"].push_back({{"family", family_name(style.family)},
                              {"title", style.title},
                              {"mark", style.mark},
                              {"color", style.color}});
  }
  if (pairs.front().ao) {
    const Json styles = ao_styles(*pairs.front().ao);
    for (const Json& style : styles.elements()) data["styles"].push_back(style);
  }
  for (const ChartPair& pair : pairs) data["groups"].push_back(group(pair));
  return {kChartName, std::move(data), std::nullopt};
}

}  // namespace kiln::cli

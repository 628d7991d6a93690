#include <algorithm>
#include <array>
#include <cstdio>

#include "arguments/parse.h"
#include "lab/chart_output.h"
#include "lab/chart_page.h"

namespace kiln::cli {
namespace {

// Columns of chart_data().
constexpr int kFirstErrorColumn = 5, kLeastColumn = 13, kMostColumn = 14;

struct Style {
  ChartFamily family;
  const char* title;
  const char* mark;
};
// Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr std::array<Style, 7> kStyles = {
    {{ChartFamily::rays, "rays", "pt 9 ps 2.3 lc rgb '#222222'"},
     {ChartFamily::views, "depth views", "pt 7 ps 2 lc rgb '#0072b2'"},
     {ChartFamily::views_rays, "views, then rays", "pt 13 ps 2.4 lc rgb '#009e73'"},
     {ChartFamily::paper, "views as in the paper", "pt 5 ps 1.8 lc rgb '#d55e00'"},
     {ChartFamily::closest, "nearest points", "pt 11 ps 2.3 lc rgb '#cc79a7'"},
     {ChartFamily::visibility, "visibility", "pt 15 ps 2.3 lc rgb '#8a6d00'"},
     {ChartFamily::uv, "same UVs", "pt 3 ps 2.3 lw 3 lc rgb '#56b4e9'"}}};

/// In the picture: where a number was chosen or an error is 0, it says so.
std::string label_of(const ChartRow& row, ChartMeasure measure) {
  std::string text = row.setting.label;
  if (row.report.views && row.setting.bake.views.automatic) {
    text = std::to_string(row.report.views->directions.size()) + " views chosen";
  }
  if (measure == ChartMeasure::map && row.setting.name == kChartReference) {
    text += ": the reference itself";
  }
  return text;
}

std::string title_of(const ChartPair& pair, ChartMeasure measure) {
  switch (measure) {
    case ChartMeasure::map:
      return "Error of the map: angle to the reference (rays, 4×4 samples)";
    case ChartMeasure::object_distance:
      return "Distance in space from the light surface to its matches";
    case ChartMeasure::image_distance:
      return "Distance in pictures from all around, normalised";
    case ChartMeasure::picture:
      break;
  }
  char figure[32];
  std::snprintf(figure, sizeof figure, "%.2f", pair.without_map.mean_degrees);
  return "Error of the picture: rendered normals to the dense mesh's (no map: " +
         std::string(figure) + "°)";
}

ChartPanel make_panel(const ChartPair& pair, ChartMeasure measure) {
  const bool is_angle = measure == ChartMeasure::map || measure == ChartMeasure::picture;
  ChartPanel panel{measure_name(measure),
                   title_of(pair, measure),
                   is_angle ? "Mean angle, degrees" : "Mean, % of the diagonal",
                   kFirstErrorColumn + static_cast<int>(measure),
                   {}};
  for (const ChartRow& row : pair.rows) {
    ChartMark mark{label_of(row, measure),
                   row.seconds.correspondence(),
                   {},
                   row.error(measure),
                   row.front(measure)};
    for (const ChartSeconds& run : row.runs) mark.runs.push_back(run.correspondence());
    panel.marks.push_back(std::move(mark));
  }
  return panel;
}

ChartGroup make_group(const ChartPair& pair) {
  ChartGroup group;
  group.title = pair.high_name + ", " + with_commas(pair.high_faces) + " faces, to " +
                pair.low_name + ", " + with_commas(pair.low_faces);
  for (const ChartRow& row : pair.rows) {
    if (row.report.views && row.setting.bake.views.size == 0) {
      group.note =
          "views of " + std::to_string(row.report.views->size) + "² pixels where none are named";
    }
  }
  for (const ChartMeasure measure : kChartMeasures) {
    group.panels.push_back(make_panel(pair, measure));
  }
  return group;
}

}  // namespace

std::string chart_script(const std::vector<ChartPair>& pairs, const ChartOptions& options,
                         const DeviceInfo& device) {
  ChartPage page;
  page.name = kChartName;
  page.title = "Normal maps: speed against accuracy of every way to match";
  page.subtitle = std::to_string(options.size) + " × " + std::to_string(options.size) + " maps, " +
                  device.name + runs_note(options.repeat);
  page.seconds_title = "Seconds to match, hierarchy and views included";
  page.least_column = kLeastColumn;
  page.most_column = kMostColumn;
  for (const Style& style : kStyles) {
    const bool occurs = std::any_of(pairs.begin(), pairs.end(), [&](const ChartPair& pair) {
      return std::any_of(pair.rows.begin(), pair.rows.end(),
                         [&](const ChartRow& row) { return row.setting.family == style.family; });
    });
    if (occurs) {
      page.styles.push_back({family_name(style.family), style.title, style.mark});
    }
  }
  for (const ChartPair& pair : pairs) page.groups.push_back(make_group(pair));
  return page_script(page);
}

}  // namespace kiln::cli

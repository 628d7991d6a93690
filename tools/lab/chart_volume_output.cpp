#include <algorithm>
#include <cstdio>
#include <sstream>

#include "arguments/parse.h"
#include "lab/chart_output.h"
#include "lab/chart_volume.h"
#include "lab/study.h"
#include "picture/plot.h"

namespace kiln::cli {
namespace {

struct Style {
  const char* family;
  const char* title;
  const char* mark;
  const char* color;
};
// Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr std::array<Style, 5> kStyles = {{{"none", "no map", "+", "#777777"},
                                           {"direct", "direct", "s", "#d55e00"},
                                           {"rays", "contour baked by rays", "^", "#222222"},
                                           {"views", "by depth views", "o", "#0072b2"},
                                           {"closest", "by nearest points", "v", "#cc79a7"}}};

std::string missed_text(const VolumeRow& row) {
  if (!row.report || row.report->samples == 0) return "";
  return fixed_text(100 * static_cast<double>(row.report->missed) /
                        static_cast<double>(row.report->samples),
                    2) +
         "%";
}

/// Texels that the map leaves out, although the low poly has them.
std::string empty_text(const VolumeRow& row) {
  if (row.size == 0 || row.gradient.texels == 0) return "";
  return fixed_text(100 * static_cast<double>(row.gradient.empty) /
                        static_cast<double>(row.gradient.texels),
                    2) +
         "%";
}

std::string angles_text(double mean, double rms, double p95) {
  return fixed_text(mean, 3) + " / " + fixed_text(rms, 2) + " / " + fixed_text(p95, 2);
}

Json json_of(const GradientError& error) {
  return {{"texels", error.texels},
          {"empty_texels", error.empty},
          {"mean_angle_degrees", error.mean_degrees},
          {"rms_angle_degrees", error.rms_degrees},
          {"median_angle_degrees", error.median_degrees},
          {"p95_angle_degrees", error.p95_degrees},
          {"p99_angle_degrees", error.p99_degrees},
          {"max_angle_degrees", error.max_degrees}};
}

Json json_of(const VolumeSeconds& s) {
  return {{"total", s.total},
          {"contour", s.contour},
          {"light", s.light},
          {"build", s.build},
          {"map", s.map}};
}

Json json_of(const VolumeRow& row) {
  Json json = {{"name", row.name},
               {"label", row.label},
               {"family", row.family},
               {"size", row.size == 0 ? Json() : Json(row.size)}};
  json["seconds"] = json_of(row.seconds);
  json["runs"] = Json::array();
  for (const VolumeSeconds& run : row.runs) json["runs"].push_back(json_of(run));
  json["gradient_error"] = json_of(row.gradient);
  json["gradient_error_along_face"] = json_of(row.gradient_along_face);
  json["normal_error"] = describe(row.picture);
  for (const VolumeMeasure measure : kVolumeMeasures) {
    json["on_front"][measure_name(measure)] = row.front(measure);
  }
  if (row.report) {
    json["texels"] = describe_texels(*row.report);
    json["warnings"] = describe(row.report->warnings);
  }
  return json;
}

}  // namespace

Json describe(const VolumeChart& chart) {
  Json json = {{"full_contour_triangles", chart.dense_triangles},
               {"diagonal", chart.diagonal},
               {"max_distance_world", chart.max_distance},
               {"light",
                {{"faces", chart.light.faces},
                 {"quads", chart.light.quads},
                 {"triangles", chart.light.triangles},
                 {"error_cells", chart.light.error},
                 {"parts", chart.light.parts}}}};
  json["sizes"] = Json::array();
  for (const VolumeSize& size : chart.sizes) {
    json["sizes"].push_back({{"size", size.size},
                             {"texels_per_cell", size.texels_per_cell},
                             {"covered_texels", size.covered},
                             {"no_surface_texels", size.no_surface},
                             {"border_texels", size.cut},
                             {"flat_texels", size.no_gradient}});
  }
  json["settings"] = Json::array();
  for (const VolumeRow& row : chart.rows) json["settings"].push_back(json_of(row));
  for (const VolumeMeasure measure : kVolumeMeasures) {
    json["front"][measure_name(measure)] = Json::array();
    for (const VolumeRow& row : chart.rows) {
      if (row.front(measure)) json["front"][measure_name(measure)].push_back(row.name);
    }
  }
  return json;
}

std::string volume_chart_data(const std::vector<VolumeChart>& charts) {
  std::string text =
      "volume,setting,family,seconds,gradient_error,normal_error,gradient_front,normal_front,"
      "seconds_least,seconds_most,seconds_contour,seconds_light,seconds_build,seconds_map,size,"
      "gradient_texels,gradient_empty,gradient_rms,gradient_median,gradient_p95,gradient_p99,"
      "gradient_max,"
      "face_gradient_mean,face_gradient_rms,face_gradient_p95,normal_pixels,normal_rms,normal_p95,"
      "samples,missed\n";
  for (std::size_t i = 0; i < charts.size(); ++i) {
    for (const VolumeRow& row : charts[i].rows) {
      const auto [least, most] =
          std::minmax_element(row.runs.begin(), row.runs.end(),
                              [](const auto& a, const auto& b) { return a.total < b.total; });
      std::vector<std::string> fields = {std::to_string(i + 1), row.name, row.family};
      const auto real = [&](double value) { fields.push_back(exact_text(value)); };
      const auto whole = [&](std::uint64_t value) { fields.push_back(std::to_string(value)); };
      real(row.seconds.total);
      for (const VolumeMeasure measure : kVolumeMeasures) real(row.error(measure));
      for (const VolumeMeasure measure : kVolumeMeasures) whole(row.front(measure) ? 1 : 0);
      for (const double value : {least->total, most->total, row.seconds.contour, row.seconds.light,
                                 row.seconds.build, row.seconds.map}) {
        real(value);
      }
      whole(row.size);
      whole(row.gradient.texels);
      whole(row.gradient.empty);
      for (const double value :
           {row.gradient.rms_degrees, row.gradient.median_degrees, row.gradient.p95_degrees,
            row.gradient.p99_degrees, row.gradient.max_degrees,
            row.gradient_along_face.mean_degrees, row.gradient_along_face.rms_degrees,
            row.gradient_along_face.p95_degrees}) {
        real(value);
      }
      whole(row.picture.pixels);
      real(row.picture.rms_degrees);
      real(row.picture.p95_degrees);
      whole(row.report ? row.report->samples : 0);
      whole(row.report ? row.report->missed : 0);
      text += join(fields, ",") + "\n";
    }
  }
  return text;
}

std::string volume_chart_table(const std::vector<VolumeChart>& charts,
                               const VolumeChartOptions& options, const DeviceInfo& device) {
  std::ostringstream text;
  text
      << "# Maps from volumes: speed against accuracy\n\n"
      << "On " << markdown_cell(device.name) << " (" << markdown_cell(device.platform)
      << ", driver " << markdown_cell(device.driver)
      << "). Seconds: from the volume in memory to low poly and object-space map there, "
      << (options.repeat == 1 ? "one run"
                              : "the median of " + std::to_string(options.repeat) + " runs")
      << "; the full contour counts once for each way, also where a high poly is made of it. "
         "Errors are angles in degrees, mean / root of the mean square / 95%: of the map's texels "
         "to the volume's gradient at a place of the surface. A line through the texel's point "
         "meets it: along the shading normal, and along the triangle's. And of rendered normals to "
         "the full contour's from "
      << kHeldOutViews
      << " directions that nothing is matched from. Missed: samples of the bake that found "
         "nothing; "
         "empty: texels compared that the map leaves without a normal, where the low poly's own "
         "counts. ●: nothing else is both faster and closer.\n";
  for (const VolumeChart& chart : charts) {
    text << "\n## " << markdown_cell(chart.name) << ", " << chart.voxels[0] << " × "
         << chart.voxels[1] << " × " << chart.voxels[2] << " voxels: full contour of "
         << with_commas(chart.dense_triangles) << " faces, low poly of "
         << with_commas(chart.light.faces) << " (" << with_commas(chart.light.quads)
         << " quads)\n\n";
    for (const VolumeSize& size : chart.sizes) {
      const std::uint64_t compared = size.covered - size.no_surface - size.cut - size.no_gradient;
      text << "- " << size.size << "²: " << fixed_text(size.texels_per_cell, 2)
           << " texels a cell; of " << with_commas(size.covered) << " texels "
           << with_commas(compared) << " compared, " << with_commas(size.no_surface)
           << " without the surface within " << text_of(chart.max_distance) << " units, "
           << with_commas(size.cut) << " on the volume's border, " << with_commas(size.no_gradient)
           << " where the field is flat\n";
    }
    text << "\n| way | seconds | contour | low poly | build | map | missed | empty | error to the "
            "gradient | | along the faces' normals | picture's error | |\n"
         << "| --- | --: | --: | --: | --: | --: | --: | --: | --: | :-: | --: | --: | :-: |\n";
    for (const VolumeRow& row : chart.rows) {
      const VolumeSeconds& s = row.seconds;
      const auto& g = row.gradient;
      const auto& f = row.gradient_along_face;
      const auto& p = row.picture;
      text << "| " << markdown_cell(row.label) << " | " << fixed_text(s.total, 3) << " | "
           << fixed_text(s.contour, 3) << " | " << fixed_text(s.light, 3) << " | "
           << (row.report ? fixed_text(s.build, 3) : "") << " | "
           << (row.size != 0 ? fixed_text(s.map, 3) : "") << " | " << missed_text(row) << " | "
           << empty_text(row) << " | " << angles_text(g.mean_degrees, g.rms_degrees, g.p95_degrees)
           << " | " << (row.front(VolumeMeasure::gradient) ? "●" : "") << " | "
           << angles_text(f.mean_degrees, f.rms_degrees, f.p95_degrees) << " | "
           << angles_text(p.mean_degrees, p.rms_degrees, p.p95_degrees) << " | "
           << (row.front(VolumeMeasure::picture) ? "●" : "") << " |\n";
    }
  }
  return text.str();
}

Plot volume_chart_plot(const std::vector<VolumeChart>& charts, const VolumeChartOptions& options,
                       const DeviceInfo& device) {
  Json data = {
      {"kind", "chart"},
      {"title", "Normal maps from volumes: straight from the voxels, or the full contour baked"},
      {"subtitle", device.name + runs_note(options.repeat)},
      {"seconds_title", "Seconds from the volume in memory to low poly and map"}};
  for (const Style& style : kStyles) {
    const auto& rows = charts.front().rows;
    if (std::none_of(rows.begin(), rows.end(),
                     [&](const VolumeRow& row) { return row.family == style.family; })) {
      continue;
    }
    data["styles"].push_back({{"family", style.family},
                              {"title", style.title},
                              {"mark", style.mark},
                              {"color", style.color}});
  }
  for (const VolumeChart& chart : charts) {
    Json group = {{"title", chart.name + ", full contour of " + with_commas(chart.dense_triangles) +
                                " faces, to " + with_commas(chart.light.faces)},
                  {"note", ""}};
    for (const VolumeMeasure measure : kVolumeMeasures) {
      Json panel = {{"name", measure_name(measure)},
                    {"title", measure == VolumeMeasure::gradient
                                  ? "Error of the map: angle to the volume's gradient"
                                  : "Error of the picture: rendered normals to the full contour's"},
                    {"unit", "Mean angle, degrees"}};
      for (const VolumeRow& row : chart.rows) {
        Json mark = {{"label", row.label},
                     {"family", row.family},
                     {"seconds", row.seconds.total},
                     {"error", row.error(measure)},
                     {"front", row.front(measure)}};
        for (const VolumeSeconds& run : row.runs) mark["runs"].push_back(run.total);
        panel["marks"].push_back(std::move(mark));
      }
      group["panels"].push_back(std::move(panel));
    }
    data["groups"].push_back(std::move(group));
  }
  return {kChartName, std::move(data), std::nullopt};
}

std::string summary(const VolumeRow& row) {
  char text[320];
  std::snprintf(text, sizeof text,
                "%-14s %8.3f s; to the gradient mean %.3f degrees, rms %.2f, 95%% %.2f%s; picture "
                "mean %.3f, rms %.2f, 95%% %.2f%s",
                row.name.c_str(), row.seconds.total, row.gradient.mean_degrees,
                row.gradient.rms_degrees, row.gradient.p95_degrees,
                row.front(VolumeMeasure::gradient) ? " *" : "", row.picture.mean_degrees,
                row.picture.rms_degrees, row.picture.p95_degrees,
                row.front(VolumeMeasure::picture) ? " *" : "");
  return text;
}

}  // namespace kiln::cli

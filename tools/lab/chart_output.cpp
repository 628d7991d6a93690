#include "lab/chart_output.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "arguments/bake_arguments.h"
#include "arguments/parse.h"
#include "lab/study.h"
#include "picture/plot.h"

namespace kiln::cli {
namespace {

/// Samples found by any way, 0 to 1.
double matched_share(const BakeReport& report) {
  return report.samples == 0 ? 0
                             : static_cast<double>(report.samples - report.missed) /
                                   static_cast<double>(report.samples);
}

Json json_of(const ChartSeconds& s) {
  return {{"correspondence", s.correspondence()},
          {"build", s.build},
          {"match", s.match},
          {"source", s.source},
          {"texels", s.texels},
          {"detail", s.detail},
          {"image", s.image},
          {"total", s.total}};
}

Json describe_match(const ChartRow& row) {
  const BakeOptions& bake = row.setting.bake;
  Json json = {{"samples", bake.samples},
               {"match", match_name(bake.method)},
               {"fallback", chain_name(bake.fallback)}};
  if (!row.report.views) return json;
  json["views_chosen"] = bake.views.automatic;
  json["view_size_given"] = bake.views.size != 0;
  json["view_criterion"] = criterion_name(bake.views.criterion);
  json["view_refine"] = bake.views.refine;
  json["views"] = describe(*row.report.views);
  return json;
}

Json json_of(const ChartRow& row) {
  Json json = {{"name", row.setting.name},
               {"label", row.setting.label},
               {"family", family_name(row.setting.family)}};
  json.update(describe_match(row));
  json["seconds"] = json_of(row.seconds);
  json["runs"] = Json::array();
  for (const ChartSeconds& run : row.runs) json["runs"].push_back(json_of(run));
  json["texels"] = describe_texels(row.report);
  json["matched_share"] = matched_share(row.report);
  json["mean_distance"] = row.report.mean_abs_distance;
  json["map_error"] = {{"mean_angle_degrees", row.map_error.mean_angle_degrees},
                       {"p95_angle_degrees", row.map_error.p95_angle_degrees},
                       {"p99_angle_degrees", row.map_error.p99_angle_degrees},
                       {"max_angle_degrees", row.map_error.max_angle_degrees},
                       {"texels", row.map_error.compared}};
  json["normal_error"] = describe(row.normal_error);
  const MatchAssessment& match = row.match;
  json["object_space_percent"] = row.error(ChartMeasure::object_space);
  json["object_space_rms_percent"] = 100 * match.object_space.rms / match.diagonal;
  json["image_space_percent"] = 100 * match.image_space.mean / match.diagonal;
  json["normalised_image_space"] = row.error(ChartMeasure::normalised_image_space);
  json["uniformity_percent"] = row.error(ChartMeasure::uniformity);
  json["match_distance_percent"] = 100 * match.match_distance.mean / match.diagonal;
  json["stretch_log2_rms"] = match.stretch.rms;
  json["fold_rate"] = match.folded;
  json["largest_jump_percent"] = 100 * match.largest_jump / match.diagonal;
  for (const ChartMeasure measure : kChartMeasures) {
    json["on_front"][measure_name(measure)] = row.front(measure);
  }
  json["warnings"] = describe(row.report.warnings);
  return json;
}

}  // namespace

std::string fixed_text(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string markdown_cell(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|' || c == '\\' || c == '*' || c == '_' || c == '`') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result;
}

const char* measure_name(ChartMeasure measure) {
  switch (measure) {
    case ChartMeasure::map:
      return "map_error";
    case ChartMeasure::picture:
      return "normal_error";
    case ChartMeasure::object_space:
      return "object_space";
    case ChartMeasure::normalised_image_space:
      return "normalised_image_space";
    case ChartMeasure::uniformity:
      break;
  }
  return "uniformity";
}

std::vector<const ChartRow*> front_rows(const ChartPair& pair, ChartMeasure measure) {
  std::vector<const ChartRow*> front;
  for (const ChartRow& row : pair.rows) {
    if (row.front(measure)) front.push_back(&row);
  }
  std::stable_sort(front.begin(), front.end(), [](const ChartRow* a, const ChartRow* b) {
    return a->seconds.correspondence() < b->seconds.correspondence();
  });
  return front;
}

std::string chart_data(const std::vector<ChartPair>& pairs) {
  std::string text =
      "pair,setting,family,seconds,map_error,object_space,normalised_image_space,uniformity,"
      "normal_error,map_front,object_front,normalised_front,uniformity_front,normal_front,"
      "seconds_least,seconds_most,seconds_build,seconds_match,seconds_total,samples_a_side,views,"
      "view_size,"
      "texels,samples,outward,inward,cage,viewed,closest,missed,map_texels,map_p95,map_p99,map_max,"
      "normal_pixels,normal_median,normal_p95,normal_p99,normal_max,normal_mean_8bit\n";
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const ChartRow& row : pairs[i].rows) {
      const BakeReport& r = row.report;
      const auto [least, most] = std::minmax_element(
          row.runs.begin(), row.runs.end(), [](const ChartSeconds& a, const ChartSeconds& b) {
            return a.correspondence() < b.correspondence();
          });
      std::vector<std::string> fields = {std::to_string(i + 1), row.setting.name,
                                         family_name(row.setting.family)};
      const auto real = [&](double value) { fields.push_back(exact_text(value)); };
      const auto whole = [&](std::uint64_t value) { fields.push_back(std::to_string(value)); };
      real(row.seconds.correspondence());
      for (const ChartMeasure measure : kChartMeasures) real(row.error(measure));
      for (const ChartMeasure measure : kChartMeasures) whole(row.front(measure) ? 1 : 0);
      for (const double value : {least->correspondence(), most->correspondence(), row.seconds.build,
                                 row.seconds.match, row.seconds.total}) {
        real(value);
      }
      whole(row.setting.bake.samples);
      whole(r.views ? r.views->directions.size() : 0);
      whole(r.views ? r.views->size : 0);
      for (const std::uint64_t value : {r.texels, r.samples, r.outward, r.inward, r.cage, r.viewed,
                                        r.closest, r.missed, row.map_error.compared}) {
        whole(value);
      }
      for (const double value : {row.map_error.p95_angle_degrees, row.map_error.p99_angle_degrees,
                                 row.map_error.max_angle_degrees}) {
        real(value);
      }
      whole(row.normal_error.pixels);
      for (const double value : {row.normal_error.median_degrees, row.normal_error.p95_degrees,
                                 row.normal_error.p99_degrees, row.normal_error.max_degrees,
                                 row.normal_error.mean_8bit}) {
        real(value);
      }
      text += join(fields, ",") + "\n";
    }
  }
  return text;
}

std::string chart_ao_data(const std::vector<ChartPair>& pairs) {
  std::string text;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i].ao) continue;
    if (text.empty()) text = ao_data_head();
    text += ao_data(i + 1, *pairs[i].ao);
  }
  return text;
}

std::string chart_table(const std::vector<ChartPair>& pairs, const ChartOptions& options,
                        const AoChartOptions& ao, const DeviceInfo& device) {
  std::ostringstream text;
  text << "# Speed against accuracy\n\n"
       << "On " << markdown_cell(device.name) << " (" << markdown_cell(device.platform)
       << ", driver " << markdown_cell(device.driver) << "), " << options.size << " x "
       << options.size
       << " map. Seconds: from the high poly on the device to the correspondence (build and "
          "match), "
       << (options.repeat == 1 ? "one run"
                               : "the median of " + std::to_string(options.repeat) + " runs")
       << "; the bake beside it adds putting the mesh on the device, texels, detail and image, but "
          "no files. Errors are angles in degrees, mean / 95% / 99%: of the map's texels against "
          "the reference, rays with 4×4 samples a texel; and of the rendered normals against the "
          "high poly's from "
       << kHeldOutViews
       << " directions that nothing is matched from. Object space (mean, % of the diagonal), "
          "normalised "
          "image space (mean, 0 to 1) and uniformity (mean, %) are those of Tarini et al. 2003, "
          "sections 4.1, 4.2.1 and 4.3, over viewing rays from "
       << options.directions << " directions, of a map of " << kAssessedSize
       << "²; match distance: the mean from the low poly to its matches, % of the diagonal. ●: "
          "nothing else is both faster and closer.\n";
  for (const ChartPair& pair : pairs) {
    text << "\n## " << markdown_cell(pair.high_name) << " (" << with_commas(pair.high_faces)
         << " faces) to " << markdown_cell(pair.low_name) << " (" << with_commas(pair.low_faces)
         << ")\n\nWithout a map the rendered normals are "
         << fixed_text(pair.without_map.mean_degrees, 3) << " / "
         << fixed_text(pair.without_map.p95_degrees, 2) << " / "
         << fixed_text(pair.without_map.p99_degrees, 2) << " degrees off.\n\n"
         << "| setting | views | pixels | seconds | build | match | bake, s | missed | map error | "
            "| picture's error | | object space | | normalised image space | | uniformity | | "
            "match distance | "
            "folded |\n"
         << "| --- | --: | --: | --: | --: | --: | --: | --: | --: | :-: | --: | :-: | --: | :-: | "
            "--: | :-: | --: | :-: | --: | --: |\n";
    for (const ChartRow& row : pair.rows) {
      const BakeReport& r = row.report;
      text << "| " << markdown_cell(row.setting.label) << " | ";
      if (r.views) {
        text << r.views->directions.size() << " | " << r.views->size << "² | ";
      } else {
        text << "| | ";
      }
      text << fixed_text(row.seconds.correspondence(), 4) << " | "
           << fixed_text(row.seconds.build, 4) << " | " << fixed_text(row.seconds.match, 4) << " | "
           << fixed_text(row.seconds.total, 3) << " | "
           << fixed_text(100 * (1 - matched_share(r)), 2) << "% | "
           << fixed_text(row.map_error.mean_angle_degrees, 3) << " / "
           << fixed_text(row.map_error.p95_angle_degrees, 2) << " / "
           << fixed_text(row.map_error.p99_angle_degrees, 2) << " | "
           << (row.front(ChartMeasure::map) ? "●" : "") << " | "
           << fixed_text(row.normal_error.mean_degrees, 3) << " / "
           << fixed_text(row.normal_error.p95_degrees, 2) << " / "
           << fixed_text(row.normal_error.p99_degrees, 2) << " | "
           << (row.front(ChartMeasure::picture) ? "●" : "") << " | "
           << fixed_text(row.error(ChartMeasure::object_space), 4) << " | "
           << (row.front(ChartMeasure::object_space) ? "●" : "") << " | "
           << fixed_text(row.error(ChartMeasure::normalised_image_space), 4) << " | "
           << (row.front(ChartMeasure::normalised_image_space) ? "●" : "") << " | "
           << fixed_text(row.error(ChartMeasure::uniformity), 2) << "% | "
           << (row.front(ChartMeasure::uniformity) ? "●" : "") << " | "
           << fixed_text(100 * row.match.match_distance.mean / row.match.diagonal, 4) << " | "
           << fixed_text(100 * row.match.folded, 2) << "% |\n";
    }
    if (pair.ao) text << ao_table(*pair.ao, ao);
  }
  return text.str();
}

std::string summary(const ChartRow& row) {
  char text[320];
  std::snprintf(text, sizeof text,
                "%-14s %8.4f s (bake %.3f), %6.2f%% missed; map mean %.3f degrees, 95%% %.2f, 99%% "
                "%.2f%s; picture mean %.3f, 95%% %.2f, 99%% %.2f%s",
                row.setting.name.c_str(), row.seconds.correspondence(), row.seconds.total,
                100 * (1 - matched_share(row.report)), row.map_error.mean_angle_degrees,
                row.map_error.p95_angle_degrees, row.map_error.p99_angle_degrees,
                row.front(ChartMeasure::map) ? " *" : "", row.normal_error.mean_degrees,
                row.normal_error.p95_degrees, row.normal_error.p99_degrees,
                row.front(ChartMeasure::picture) ? " *" : "");
  return text;
}

Json describe(const ChartPair& pair) {
  Json held_out = Json::array();
  for (const Vec3& d : pair.held_out) held_out.push_back({d.x, d.y, d.z});
  Json json = {{"diagonal", pair.diagonal},
               {"max_distance_world", pair.max_distance},
               {"reference", kChartReference},
               {"measured_from",
                {{"views", pair.held_out.size()},
                 {"size", pair.pixels},
                 {"least_angle_to_a_matching_view_degrees", pair.least_angle_degrees},
                 {"directions", held_out}}},
               {"normal_error_without_map", describe(pair.without_map)}};
  json["left_out"] = Json::array();
  for (const LeftOut& left : pair.left_out) {
    json["left_out"].push_back({{"setting", left.name}, {"reason", left.reason}});
  }
  json["settings"] = Json::array();
  for (const ChartRow& row : pair.rows) json["settings"].push_back(json_of(row));
  for (const ChartMeasure measure : kChartMeasures) {
    Json names = Json::array();
    for (const ChartRow* row : front_rows(pair, measure)) names.push_back(row->setting.name);
    json["front"][measure_name(measure)] = names;
  }
  return json;
}

}  // namespace kiln::cli

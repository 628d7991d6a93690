// Ratings as a report and as a table.
#include <algorithm>
#include <cstdio>

#include "arguments/bake_values.h"
#include "arguments/parse.h"
#include "lab/assessment_json.h"
#include "lab/rating.h"

namespace kiln::cli {
namespace {

double miss_rate(const MatchAssessment& a) {
  return a.samples != 0 ? static_cast<double>(a.missed) / static_cast<double>(a.samples) : 0;
}

/// Of HIGH's surface, %; "-" where the match cannot tell.
std::string lost(const Rating& row) {
  if (!row.bake.recall) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", 100 * row.bake.recall->lost);
  return text;
}

/// Of the maps asked for, those without an error: names and coverage, and of a saved match all but those of rays.
std::vector<std::string> without_error(const Rating& row, const std::vector<std::string>& maps) {
  std::vector<std::string> names;
  for (const std::string& map : maps) {
    const bool told = std::any_of(row.bake.errors.begin(), row.bake.errors.end(),
                                  [&](const MapError& error) { return error.kind.name == map; });
    if (!told) names.push_back(map);
  }
  return names;
}

/// A table of the errors of maps.
void add_errors(const Ratings& ratings, std::vector<std::string>& lines) {
  char text[256];
  lines.emplace_back(
      "match             error of             rms       mean        95%       most  unit, against "
      "what (texels)");
  for (const Rating& row : ratings.rows) {
    for (const MapError& error : row.bake.errors) {
      std::snprintf(text, sizeof text, "%-17s %-13s %10.4g %10.4g %10.4g %10.4g  %s, %s (%s)",
                    row.name.c_str(), std::string(error.kind.name).c_str(), error.rms, error.mean,
                    error.p95, error.max, std::string(error.unit).c_str(),
                    std::string(error.against).c_str(), with_commas(error.texels).c_str());
      lines.emplace_back(text);
    }
    for (const std::string& map : without_error(row, ratings.maps)) {
      std::snprintf(text, sizeof text, "%-17s %-13s states no error", row.name.c_str(),
                    map.c_str());
      lines.emplace_back(text);
    }
  }
}

Json json_of(const Rating& row, const std::vector<std::string>& maps) {
  const MatchAssessment& a = row.match;
  Json json = {{"name", row.name},
               {"method", row.method},
               {"samples", a.samples},
               {"miss_rate", miss_rate(a)}};
  if (row.visibility_at)
    json["visibility_at"] = name_of(visibility_at_values(), *row.visibility_at);
  json["texels"] = describe_texels(row.bake);
  json["recall"] = row.bake.recall ? describe(*row.bake.recall) : Json();
  json.update(describe_assessment(a));
  json["rendered_normals"] = describe(row.normal);
  json["seconds"] = {
      {"build", row.bake.seconds_build}, {"match", row.bake.seconds_match}, {"assess", a.seconds}};
  json["warnings"] = describe(row.bake.warnings);
  if (!maps.empty()) {
    json["errors"] = describe(row.bake.errors);
    json["without_error"] = without_error(row, maps);
    json["seconds"]["errors"] = row.bake.seconds_errors;
  }
  return json;
}

}  // namespace

Json describe(const Ratings& ratings) {
  Json rows = Json::array();
  for (const Rating& row : ratings.rows) rows.push_back(json_of(row, ratings.maps));
  Json left_out = Json::array();
  for (const LeftOut& left : ratings.left_out) {
    left_out.push_back({{"method", left.name}, {"reason", left.reason}});
  }
  return {{"diagonal", ratings.diagonal},
          {"left_out", left_out},
          {"rendered_views", ratings.views},
          {"without_map", describe(ratings.without_map)},
          {"methods", rows}};
}

std::vector<std::string> ratings_table(const Ratings& ratings) {
  std::vector<std::string> lines = {
      "match              object space     image   normalised  uniformity  match     missed  "
      "lost     normals            match",
      "                   % of diagonal    space                %           distance  %       "
      "% of HIGH degrees           seconds",
      "                   mean    rms                                                         "
      "         mean   rms    95%"};
  char text[256];
  for (const Rating& row : ratings.rows) {
    const MatchAssessment& a = row.match;
    const double percent = 100 / a.diagonal;
    std::snprintf(text, sizeof text,
                  "%-17s %7.4f %7.4f %8.4f %10.4f %11.2f %10.4f %8.2f %8s %8.2f %6.2f %6.2f %8.3f",
                  row.name.c_str(), a.object_space.mean * percent, a.object_space.rms * percent,
                  a.image_space.mean * percent, a.normalised_image_space.mean,
                  a.uniformity.mean_percent, a.match_distance.mean * percent, 100 * miss_rate(a),
                  lost(row).c_str(), row.normal.mean_degrees, row.normal.rms_degrees,
                  row.normal.p95_degrees, row.bake.seconds_build + row.bake.seconds_match);
    lines.emplace_back(text);
  }
  std::snprintf(text, sizeof text, "%-95s %6.2f %6.2f %6.2f", "(no map)",
                ratings.without_map.mean_degrees, ratings.without_map.rms_degrees,
                ratings.without_map.p95_degrees);
  lines.emplace_back(text);
  if (!ratings.maps.empty()) add_errors(ratings, lines);
  return lines;
}

}  // namespace kiln::cli

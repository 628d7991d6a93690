// Ratings as a report and as a table.
#include <cstdio>

#include "arguments/bake_values.h"
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

Json json_of(const Rating& row) {
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
  return json;
}

}  // namespace

Json describe(const Ratings& ratings) {
  Json rows = Json::array();
  for (const Rating& row : ratings.rows) rows.push_back(json_of(row));
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
  return lines;
}

}  // namespace kiln::cli

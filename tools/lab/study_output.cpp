#include "lab/study_output.h"

#include <algorithm>
#include <cstdio>

#include "arguments/bake_values.h"

namespace kiln::cli {
namespace {

Json json_of(const Setting& setting, double diagonal) {
  Json json = {{"curve", curve_name(setting.curve)}};
  const bool views = setting.views != 0;
  json["match"] = views                         ? Json(first_match(&MatchInfo::takes_views).name)
                  : setting.curve == Curve::ray ? Json(default_match())
                                                : Json();
  json["views"] = views ? Json(setting.views) : Json();
  json["view_size"] = views ? Json(setting.view_size) : Json();
  const bool paper = setting.curve == Curve::paper;
  json["view_criterion"] = views ? Json(paper ? "depth" : "angle") : Json();
  json["view_refine"] = views ? Json(!paper) : Json();
  json["target_faces"] = setting.target_faces;
  json["faces"] = setting.faces;
  json["size"] = setting.size != 0 ? Json(setting.size) : Json();
  json["normal_error"] = describe(setting.normal);
  if (setting.curve != Curve::none) {
    const DistanceError& d = setting.distance;
    const double samples = static_cast<double>(std::max<std::uint64_t>(1, d.samples + d.missed));
    json["matched_share"] = static_cast<double>(d.samples) / samples;
    json["distance_error"] = {{"samples", d.samples},
                              {"missed", d.missed},
                              {"mean", d.mean},
                              {"p95", d.p95},
                              {"max", d.max},
                              {"mean_percent_of_diagonal", 100 * d.mean / diagonal},
                              {"p95_percent_of_diagonal", 100 * d.p95 / diagonal},
                              {"max_percent_of_diagonal", 100 * d.max / diagonal}};
  }
  if (setting.depth.pixels != 0) {
    json["depth_difference"] = {{"pixels", setting.depth.pixels},
                                {"one_sided", setting.depth.one_sided},
                                {"mean", setting.depth.mean},
                                {"rms", setting.depth.rms},
                                {"max", setting.depth.max}};
  }
  json["seconds"] = {{"bake", setting.seconds_bake}, {"measure", setting.seconds_measure}};
  json["warnings"] = describe(setting.warnings);
  return json;
}

/// The number of which a series levels off: views or texels.
std::uint32_t varied(const Setting& setting, StudyKind kind) {
  return kind == StudyKind::views ? setting.views : setting.size;
}

/// Whether the series' last is where it levels off: then it may not have.
bool is_last(const std::vector<const Setting*>& series, const Setting* setting) {
  return !series.empty() && series.back() == setting;
}

std::vector<std::uint32_t> face_counts(const Study& study) {
  std::vector<std::uint32_t> result;
  for (const Setting* setting : select(study, Curve::kiln)) {
    if (result.empty() || result.back() != setting->target_faces) {
      result.push_back(setting->target_faces);
    }
  }
  return result;
}

}  // namespace

const char* study_name(StudyKind kind) {
  return kind == StudyKind::views ? "views" : kind == StudyKind::faces ? "faces" : "size";
}

std::string study_data(const Study& study) {
  std::string text =
      "curve,views,target_faces,faces,size,pixels,mean_degrees,median_degrees,p95_degrees,"
      "p99_degrees,max_degrees,mean_8bit,above_4,above_8,above_16,above_32,above_64,samples,missed,"
      "distance_mean,distance_p95,distance_max,distance_mean_percent,distance_p95_percent,"
      "distance_max_percent,depth_mean,depth_rms,depth_max\n";
  for (const Setting& s : study.settings) {
    text += curve_name(s.curve);
    for (const std::uint64_t value : {std::uint64_t{s.views}, std::uint64_t{s.target_faces},
                                      s.faces, std::uint64_t{s.size}, s.normal.pixels}) {
      text += "," + std::to_string(value);
    }
    for (const double value : {s.normal.mean_degrees, s.normal.median_degrees, s.normal.p95_degrees,
                               s.normal.p99_degrees, s.normal.max_degrees, s.normal.mean_8bit}) {
      text += "," + exact_text(value);
    }
    for (const double share : s.normal.above_8bit) text += "," + exact_text(share);
    const DistanceError& d = s.distance;
    text += "," + std::to_string(d.samples) + "," + std::to_string(d.missed);
    for (const double value : {d.mean, d.p95, d.max}) text += "," + exact_text(value);
    for (const double value : {d.mean, d.p95, d.max}) {
      text += "," + exact_text(100 * value / study.diagonal);
    }
    const bool has_depth = s.depth.pixels != 0;
    for (const double value : {s.depth.mean, s.depth.rms, s.depth.max}) {
      text += "," + (has_depth ? exact_text(value) : std::string());
    }
    text += "\n";
  }
  return text;
}

std::string summary(const Setting& s, double diagonal) {
  char text[320];
  std::string what = curve_name(s.curve);
  if (s.views != 0) what += " " + std::to_string(s.views) + (s.views == 1 ? " view" : " views");
  what += ", " + std::to_string(s.faces) + " faces";
  if (s.size != 0) what += ", " + std::to_string(s.size) + " x " + std::to_string(s.size);
  std::snprintf(text, sizeof text,
                "%-42s mean %.3f degrees, median %.3f, 95%% %.2f, 99%% %.2f; 8-bit %.2f",
                what.c_str(), s.normal.mean_degrees, s.normal.median_degrees, s.normal.p95_degrees,
                s.normal.p99_degrees, s.normal.mean_8bit);
  std::string line = text;
  if (s.curve != Curve::none) {
    std::snprintf(text, sizeof text, "; distance %.4f%%, 95%% %.3f%%, max %.2f%%",
                  100 * s.distance.mean / diagonal, 100 * s.distance.p95 / diagonal,
                  100 * s.distance.max / diagonal);
    line += text;
  }
  if (s.depth.pixels != 0) {
    std::snprintf(text, sizeof text, "; depth difference %.5f", s.depth.mean);
    line += text;
  }
  return line;
}

std::vector<std::string> findings(const Study& study, const StudyOptions& options) {
  std::vector<std::string> lines;
  char text[320];
  if (options.kind == StudyKind::views) {
    for (const Curve curve : {Curve::paper, Curve::kiln}) {
      const auto series = select(study, curve);
      const Setting* enough = levels_off(series);
      const Setting* least =
          *std::min_element(series.begin(), series.end(), [](const Setting* a, const Setting* b) {
            return a->normal.mean_degrees < b->normal.mean_degrees;
          });
      std::snprintf(text, sizeof text,
                    "%s: %u views are within 5%% of the least mean error (%.3f against %.3f "
                    "degrees, at %u views); rays: %.3f",
                    curve == Curve::paper ? "as in the paper" : "Kiln's own matching",
                    enough->views, enough->normal.mean_degrees, least->normal.mean_degrees,
                    least->views, select(study, Curve::ray).front()->normal.mean_degrees);
      lines.emplace_back(text);
    }
  } else if (options.kind == StudyKind::faces) {
    const auto series = select(study, Curve::kiln);
    if (series.size() < 2) return lines;
    const Setting& few = *series.front();
    const Setting& many = *series.back();
    std::snprintf(
        text, sizeof text,
        "%.3g times the faces: the mean distance is %.3g times, the mean normal error %.3g "
        "times what it was",
        static_cast<double>(many.faces) / static_cast<double>(few.faces),
        many.distance.mean / few.distance.mean, many.normal.mean_degrees / few.normal.mean_degrees);
    lines.emplace_back(text);
  } else {
    for (const std::uint32_t faces : face_counts(study)) {
      const auto series = select(study, Curve::kiln, faces);
      const Setting* enough = levels_off(series);
      if (is_last(series, enough)) {
        std::snprintf(text, sizeof text, "%u faces: %u x %u is not too large", faces, enough->size,
                      enough->size);
      } else {
        std::snprintf(
            text, sizeof text,
            "%u faces: maps larger than %u x %u gain less than 5%% (%.3f to %.3f degrees)", faces,
            enough->size, enough->size, enough->normal.mean_degrees,
            series.back()->normal.mean_degrees);
      }
      lines.emplace_back(text);
    }
  }
  return lines;
}

Json describe(const Study& study, const StudyOptions& options) {
  Json settings = Json::array();
  for (const Setting& setting : study.settings) {
    settings.push_back(json_of(setting, study.diagonal));
  }
  Json held_out = Json::array();
  for (const Vec3& d : study.held_out) held_out.push_back({d.x, d.y, d.z});
  Json enough = Json::object();
  if (options.kind == StudyKind::views) {
    for (const Curve curve : {Curve::paper, Curve::kiln}) {
      enough[curve_name(curve)] = varied(*levels_off(select(study, curve)), options.kind);
    }
  } else if (options.kind == StudyKind::size) {
    for (const std::uint32_t faces : face_counts(study)) {
      enough[std::to_string(faces)] =
          varied(*levels_off(select(study, Curve::kiln, faces)), options.kind);
    }
  }
  Json json = {{"study", study_name(options.kind)},
               {"measured_from",
                {{"views", study.held_out.size()},
                 {"size", options.pixels},
                 {"least_angle_to_a_matching_view_degrees", study.least_angle_degrees},
                 {"directions", held_out}}},
               {"diagonal", study.diagonal},
               {"max_distance_world", study.max_distance},
               {"settings", settings},
               {"worst", study.worst.setting},
               {"best", study.best.setting}};
  if (!enough.empty()) json["levels_off_at"] = enough;
  json["findings"] = findings(study, options);
  return json;
}

}  // namespace kiln::cli

// What a study leaves behind: data, plots, the report.
#include <algorithm>

#include "arguments/bake_values.h"
#include "arguments/parse.h"
#include "lab/measuring.h"
#include "lab/study.h"
#include "lab/table.h"
#include "lab/value_tiles.h"

namespace kiln::cli {
namespace {

constexpr double kEnough = 0.05;  // see levels_off

using Series = std::vector<const Setting*>;
using Figure = double (*)(const Setting*);

double mean_degrees(const Setting* s) { return s->normal.mean_degrees; }
double mean_8bit(const Setting* s) { return s->normal.mean_8bit; }
double by_views(const Setting* s) { return s->views; }
double by_faces(const Setting* s) { return s->target_faces; }
double by_size(const Setting* s) { return s->size; }

/// The settings of one curve, and of one low poly where `target_faces` is given, in the study's order.
Series select(const Study& study, Curve curve, std::uint32_t target_faces = 0) {
  Series result;
  for (const Setting& setting : study.settings) {
    if (setting.curve == curve && (target_faces == 0 || setting.target_faces == target_faces)) {
      result.push_back(&setting);
    }
  }
  return result;
}

const Setting& least(const Series& series) {
  return **std::min_element(series.begin(), series.end(), [](const Setting* a, const Setting* b) {
    return mean_degrees(a) < mean_degrees(b);
  });
}

/// The first of an ordered series whose mean angle is within 5% of the series' least: more than that (views,
/// texels) gains little.
const Setting& levels_off(const Series& series) {
  const double enough = mean_degrees(&least(series)) * (1 + kEnough);
  return **std::find_if(series.begin(), series.end(),
                        [&](const Setting* setting) { return mean_degrees(setting) <= enough; });
}

/// Of the low polys that were made, in their order.
std::vector<std::uint32_t> face_counts(const Study& study) {
  std::vector<std::uint32_t> result;
  for (const Setting* setting : select(study, Curve::kiln)) {
    if (result.empty() || result.back() != setting->target_faces) {
      result.push_back(setting->target_faces);
    }
  }
  return result;
}

std::string figure(double value) { return fixed_text(value, 2); }

std::string size_text(std::uint32_t size) {
  return std::to_string(size) + " × " + std::to_string(size) + " map";
}

// ---- plots -------------------------------------------------------------------------------------

Json study_of(const std::string& title, const char* x_title, const Json& x_ticks,
              const Json& panels) {
  return fields("kind title x_title x_ticks panels", {"study", title, x_title, x_ticks, panels});
}

Json paper_and_kiln(const Study& study, Figure x, Figure y) {
  return Json::array(
      {plot_curve("paper: least depth difference", "paper", select(study, Curve::paper), x, y),
       plot_curve("Kiln: best angle, refined", "kiln", select(study, Curve::kiln), x, y)});
}

Json views_plot(const Study& study, const std::string& mesh) {
  const Setting* ray = select(study, Curve::ray).front();
  const Setting* none = select(study, Curve::none).front();
  const auto panel_of = [&](const char* title, Figure y, const char* unit) {
    Json json = plot_panel(title);
    json["curves"] = paper_and_kiln(study, by_views, y);
    json["levels"] = Json::array(
        {fields("title look y",
                {"rays (no views): " + figure(y(ray)) + unit, curve_name(Curve::ray), y(ray)}),
         fields("title look y", {"no map: " + figure(y(none)) + unit, "none", y(none)})});
    return json;
  };
  Json data = study_of(
      "Normal error against the number of views matched from: " + mesh + ", " +
          plural(ray->faces, "face") + ", " + size_text(ray->size),
      "Depth views matched from", kStudyViews,
      Json::array({panel_of("Mean angle between normals, degrees", mean_degrees, " degrees"),
                   panel_of("Mean 8-bit difference of normals, 0 to 255", mean_8bit, "")}));
  data["x_note"] = fields("x text", {12, "12: the paper's choice"});
  return data;
}

Json faces_plot(const Study& study, const StudyOptions& options, const std::string& mesh) {
  const Series own = select(study, Curve::kiln), without = select(study, Curve::none);
  const auto percent = [&](double distance) { return 100 * distance / study.diagonal; };
  Json distances = plot_panel("Distance of the low poly to the high poly, % of the diagonal");
  const auto add = [&](const std::string& title, const char* look, double DistanceError::*value) {
    distances["curves"].push_back(plot_curve(
        title, look, own, by_faces, [&](const Setting* s) { return percent(s->distance.*value); }));
  };
  add("farthest (looked " + figure(percent(study.max_distance)) + "% far)", "max",
      &DistanceError::max);
  add("95% are nearer", "p95", &DistanceError::p95);
  add("mean", "mean", &DistanceError::mean);
  Json angles = plot_panel("Mean angle between normals, degrees");
  angles["curves"] = paper_and_kiln(study, by_faces, mean_degrees);
  angles["curves"].push_back(plot_curve("rays (no views)", curve_name(Curve::ray),
                                        select(study, Curve::ray), by_faces, mean_degrees));
  angles["curves"].push_back(plot_curve("no map", "none", without, by_faces, mean_degrees));
  // Wang et al., figure 3b: of the mesh alone, whatever its map.
  Json depths = plot_panel("Depth difference in pictures, normalised screen units");
  depths["curves"].push_back(plot_curve("mean over 30 views", "mean", without, by_faces,
                                        [](const Setting* s) { return s->depth.mean; }));
  Json ticks = Json::array();
  for (const Setting* setting : own) ticks.push_back(setting->target_faces);
  return study_of("Errors against the low poly's faces: " + mesh + ", " +
                      plural(options.views, "view") + ", " + size_text(options.size),
                  "Faces of the low poly", ticks, Json::array({distances, depths, angles}));
}

Json size_plot(const Study& study, const StudyOptions& options, const std::string& mesh) {
  Json angles = plot_panel("Mean angle between normals, degrees");
  angles["rings"]["title"] = "larger maps gain less than 5%";
  const Series without = select(study, Curve::none);
  for (std::size_t i = 0; i < without.size(); ++i) {
    const Setting& none = *without[i];
    const double last = static_cast<double>(std::max<std::size_t>(2, without.size()) - 1);
    const Series series = select(study, Curve::kiln, none.target_faces);
    angles["curves"].push_back(
        plot_curve(with_commas(none.target_faces) +
                       " faces (no map: " + figure(none.normal.mean_degrees) + ")",
                   static_cast<double>(i) / last, series, by_size, mean_degrees));
    const Setting& enough = levels_off(series);
    if (&enough == series.back()) continue;
    angles["rings"]["x"].push_back(enough.size);
    angles["rings"]["y"].push_back(enough.normal.mean_degrees);
  }
  return study_of(
      "Normal error against map size and faces: " + mesh + ", " + plural(options.views, "view"),
      "Texels a side of the map", kStudySizes, Json::array({angles}));
}

// ---- text --------------------------------------------------------------------------------------

Json json_of(const Setting& s, double diagonal) {
  const bool views = s.views != 0, paper = s.curve == Curve::paper;
  const auto of_views = [&](const Json& value) { return views ? value : Json(); };
  Json json = fields(
      "curve match views view_size view_criterion view_refine target_faces faces size normal_error",
      {curve_name(s.curve),
       views                   ? Json(first_match(&MatchInfo::takes_views).name)
       : s.curve == Curve::ray ? Json(default_match())
                               : Json(),
       of_views(s.views), of_views(s.view_size), of_views(paper ? "depth" : "angle"),
       of_views(!paper), s.target_faces, s.faces, s.size != 0 ? Json(s.size) : Json(),
       describe(s.normal)});
  if (s.curve != Curve::none) {
    const DistanceError& d = s.distance;
    const double samples = static_cast<double>(std::max<std::uint64_t>(1, d.samples + d.missed));
    json["matched_share"] = static_cast<double>(d.samples) / samples;
    json["distance_error"] = fields(
        "samples missed mean p95 max mean_percent_of_diagonal p95_percent_of_diagonal "
        "max_percent_of_diagonal",
        {d.samples, d.missed, d.mean, d.p95, d.max, 100 * d.mean / diagonal, 100 * d.p95 / diagonal,
         100 * d.max / diagonal});
  }
  if (s.depth.pixels != 0) {
    json["depth_difference"] =
        fields("pixels one_sided mean rms max",
               {s.depth.pixels, s.depth.one_sided, s.depth.mean, s.depth.rms, s.depth.max});
  }
  json["seconds"] = fields("bake measure", {s.seconds_bake, s.seconds_measure});
  json["warnings"] = describe(s.warnings);
  return json;
}

std::string line_of(const Setting& s, double diagonal) {
  std::string what = curve_name(s.curve);
  if (s.views != 0) what += " " + plural(s.views, "view");
  what += ", " + std::to_string(s.faces) + " faces";
  if (s.size != 0) what += ", " + std::to_string(s.size) + " x " + std::to_string(s.size);
  const NormalError& n = s.normal;
  std::string line = formatted(
      "%-42s mean %.3f degrees, median %.3f, 95%% %.2f, 99%% %.2f; 8-bit %.2f", what.c_str(),
      n.mean_degrees, n.median_degrees, n.p95_degrees, n.p99_degrees, n.mean_8bit);
  if (s.curve != Curve::none) {
    line +=
        formatted("; distance %.4f%%, 95%% %.3f%%, max %.2f%%", 100 * s.distance.mean / diagonal,
                  100 * s.distance.p95 / diagonal, 100 * s.distance.max / diagonal);
  }
  if (s.depth.pixels != 0) line += formatted("; depth difference %.5f", s.depth.mean);
  return line;
}

std::vector<std::string> findings(const Study& study, const StudyOptions& options) {
  std::vector<std::string> lines;
  if (options.kind == StudyKind::views) {
    for (const Curve curve : {Curve::paper, Curve::kiln}) {
      const Series series = select(study, curve);
      const Setting &enough = levels_off(series), &best = least(series);
      lines.push_back(formatted(
          "%s: %u views are within 5%% of the least mean error (%.3f against %.3f degrees, at %u "
          "views); rays: %.3f",
          curve == Curve::paper ? "as in the paper" : "Kiln's own matching", enough.views,
          enough.normal.mean_degrees, best.normal.mean_degrees, best.views,
          select(study, Curve::ray).front()->normal.mean_degrees));
    }
  } else if (options.kind == StudyKind::faces) {
    const Series series = select(study, Curve::kiln);
    if (series.size() < 2) return lines;
    const Setting &few = *series.front(), &many = *series.back();
    lines.push_back(formatted(
        "%.3g times the faces: the mean distance is %.3g times, the mean normal error %.3g times "
        "what it was",
        static_cast<double>(many.faces) / static_cast<double>(few.faces),
        many.distance.mean / few.distance.mean,
        many.normal.mean_degrees / few.normal.mean_degrees));
  } else {
    for (const std::uint32_t faces : face_counts(study)) {
      const Series series = select(study, Curve::kiln, faces);
      const Setting& enough = levels_off(series);
      // Where it is the last, the series may not have levelled off.
      lines.push_back(
          &enough == series.back()
              ? formatted("%u faces: %u x %u is not too large", faces, enough.size, enough.size)
              : formatted("%u faces: maps larger than %u x %u gain less than 5%% (%.3f to %.3f "
                          "degrees)",
                          faces, enough.size, enough.size, enough.normal.mean_degrees,
                          series.back()->normal.mean_degrees));
    }
  }
  return lines;
}

}  // namespace

const char* study_name(StudyKind kind) {
  return kind == StudyKind::views ? "views" : kind == StudyKind::faces ? "faces" : "size";
}

std::string study_data(const Study& study) {
  Table table(
      "curve|views|target_faces|faces|size|pixels|mean_degrees|median_degrees|p95_degrees|"
      "p99_degrees|max_degrees|mean_8bit|above_4|above_8|above_16|above_32|above_64|samples|missed|"
      "distance_mean|distance_p95|distance_max|distance_mean_percent|distance_p95_percent|"
      "distance_max_percent|depth_mean|depth_rms|depth_max");
  for (const Setting& s : study.settings) {
    const NormalError& n = s.normal;
    const DistanceError& d = s.distance;
    const auto percent = [&](double distance) { return 100 * distance / study.diagonal; };
    const auto depth = [&](double value) { return s.depth.pixels != 0 ? Json(value) : Json(); };
    static_assert(std::tuple_size_v<decltype(n.above_8bit)> == 5);
    table.add({curve_name(s.curve),
               s.views,
               s.target_faces,
               s.faces,
               s.size,
               n.pixels,
               n.mean_degrees,
               n.median_degrees,
               n.p95_degrees,
               n.p99_degrees,
               n.max_degrees,
               n.mean_8bit,
               n.above_8bit[0],
               n.above_8bit[1],
               n.above_8bit[2],
               n.above_8bit[3],
               n.above_8bit[4],
               d.samples,
               d.missed,
               d.mean,
               d.p95,
               d.max,
               percent(d.mean),
               percent(d.p95),
               percent(d.max),
               depth(s.depth.mean),
               depth(s.depth.rms),
               depth(s.depth.max)});
  }
  return table.csv();
}

Plot study_plot(const Study& study, const StudyOptions& options, const std::string& mesh) {
  return {std::string("study_") + study_name(options.kind),
          options.kind == StudyKind::faces  ? faces_plot(study, options, mesh)
          : options.kind == StudyKind::size ? size_plot(study, options, mesh)
                                            : views_plot(study, mesh),
          {}};
}

Plot error_plot(const Study& study, const StudyOptions& options) {
  ValueTiles tiles;
  Json original = tiles.add_gray(gray(study.original));
  original["captions"] =
      Json::array({"the high poly", "the original: its normals are the reference"});
  Json shown = Json::array({original});
  const auto add = [&](const char* rank, const ErrorPicture& picture) {
    // Pixels that neither mesh covers are -1, those that one does below.
    Json tile = tiles.add(picture.degrees, [](float degrees) {
      return degrees >= 0    ? double{degrees}
             : degrees == -1 ? ValueTiles::kBeside
                             : ValueTiles::kNotKnown;
    });
    // What it shows, how its map was made, its figures.
    const Setting& s = study.settings[picture.setting];
    tile["captions"] =
        Json::array({std::string(rank) + ": " +
                         (s.curve == Curve::paper ? "as in the paper, " : "Kiln's own matching, ") +
                         plural(s.views, "view"),
                     plural(s.faces, "face") + ", " + size_text(s.size),
                     formatted("mean %.2f degrees, 95%% under %.1f, over %u views",
                               s.normal.mean_degrees, s.normal.p95_degrees, kHeldOutViews)});
    shown.push_back(std::move(tile));
  };
  add("worst", study.worst);
  add("best", study.best);
  const Json block = fields("title unit tiles", {"error of the normal", "degrees", shown});
  return tiles.plot(std::string("study_") + study_name(options.kind) + "_error",
                    Json::array({block}), "seen of only one of the two meshes: not measured");
}

std::vector<std::string> study_lines(const Study& study, const StudyOptions& options) {
  std::vector<std::string> lines;
  for (const Setting& setting : study.settings) lines.push_back(line_of(setting, study.diagonal));
  for (const std::string& line : findings(study, options)) lines.push_back(line);
  return lines;
}

Json describe(const Study& study, const StudyOptions& options) {
  Json settings = Json::array();
  for (const Setting& setting : study.settings) {
    settings.push_back(json_of(setting, study.diagonal));
  }
  Json enough = Json::object();
  if (options.kind == StudyKind::views) {
    for (const Curve curve : {Curve::paper, Curve::kiln}) {
      enough[curve_name(curve)] = levels_off(select(study, curve)).views;
    }
  } else if (options.kind == StudyKind::size) {
    for (const std::uint32_t faces : face_counts(study)) {
      enough[std::to_string(faces)] = levels_off(select(study, Curve::kiln, faces)).size;
    }
  }
  Json json = fields("study measured_from diagonal max_distance_world settings worst best findings",
                     {study_name(options.kind),
                      describe_views(study.held_out, options.pixels, study.least_angle_degrees),
                      study.diagonal, study.max_distance, settings, study.worst.setting,
                      study.best.setting, findings(study, options)});
  if (!enough.empty()) json["levels_off_at"] = enough;
  return json;
}

}  // namespace kiln::cli

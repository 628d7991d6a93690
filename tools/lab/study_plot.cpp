#include <algorithm>
#include <cstdio>

#include "arguments/parse.h"
#include "lab/study_output.h"
#include "lab/value_tiles.h"

namespace kiln::cli {
namespace {

std::string figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string size_text(std::uint32_t size) {
  return std::to_string(size) + " × " + std::to_string(size) + " map";
}

double mean_degrees(const Setting& s) { return s.normal.mean_degrees; }
double mean_8bit(const Setting& s) { return s.normal.mean_8bit; }
double by_views(const Setting& s) { return s.views; }
double by_faces(const Setting& s) { return s.target_faces; }
double by_size(const Setting& s) { return s.size; }

using Figure = std::function<double(const Setting&)>;

/// \param look  as picture/plot.py knows it: a name, or a share from light to dark
Json curve(const std::string& title, const Json& look, const std::vector<const Setting*>& series,
           const Figure& x, const Figure& y) {
  Json json = {{"title", title}, {"look", look}, {"x", Json::array()}, {"y", Json::array()}};
  for (const Setting* setting : series) {
    json["x"].push_back(x(*setting));
    json["y"].push_back(y(*setting));
  }
  return json;
}

Json panel(const char* title) {
  return {{"y_title", title},
          {"curves", Json::array()},
          {"levels", Json::array()},
          {"rings", {{"title", ""}, {"x", Json::array()}, {"y", Json::array()}}}};
}

Json paper_and_kiln(const Study& study, const Figure& x, const Figure& y) {
  return {curve("paper: least depth difference", "paper", select(study, Curve::paper), x, y),
          curve("Kiln: best angle, refined", "kiln", select(study, Curve::kiln), x, y)};
}

Json views_plot(const Study& study, const StudyOptions&, const std::string& mesh) {
  const Setting& ray = *select(study, Curve::ray).front();
  const Setting& none = *select(study, Curve::none).front();
  const auto panel_of = [&](const char* title, const Figure& y, const char* unit) {
    Json json = panel(title);
    json["curves"] = paper_and_kiln(study, by_views, y);
    json["levels"] = {
        {{"title", "rays (no views): " + figure(y(ray)) + unit},
         {"look", curve_name(Curve::ray)},
         {"y", y(ray)}},
        {{"title", "no map: " + figure(y(none)) + unit}, {"look", "none"}, {"y", y(none)}}};
    return json;
  };
  return {{"title", "Normal error against the number of views matched from: " + mesh + ", " +
                        plural(ray.faces, "face") + ", " + size_text(ray.size)},
          {"x_title", "Depth views matched from"},
          {"x_ticks", kStudyViews},
          {"x_note", {{"x", 12}, {"text", "12: the paper's choice"}}},
          {"panels",
           {panel_of("Mean angle between normals, degrees", mean_degrees, " degrees"),
            panel_of("Mean 8-bit difference of normals, 0 to 255", mean_8bit, "")}}};
}

Json faces_plot(const Study& study, const StudyOptions& options, const std::string& mesh) {
  const std::vector<const Setting*> own = select(study, Curve::kiln);
  const auto percent = [&](double distance) { return 100 * distance / study.diagonal; };
  Json distances = panel("Distance of the low poly to the high poly, % of the diagonal");
  distances["curves"] = {
      curve("farthest (looked " + figure(percent(study.max_distance)) + "% far)", "max", own,
            by_faces, [&](const Setting& s) { return percent(s.distance.max); }),
      curve("95% are nearer", "p95", own, by_faces,
            [&](const Setting& s) { return percent(s.distance.p95); }),
      curve("mean", "mean", own, by_faces,
            [&](const Setting& s) { return percent(s.distance.mean); })};
  Json angles = panel("Mean angle between normals, degrees");
  angles["curves"] = paper_and_kiln(study, by_faces, mean_degrees);
  angles["curves"].push_back(curve("rays (no views)", curve_name(Curve::ray),
                                   select(study, Curve::ray), by_faces, mean_degrees));
  angles["curves"].push_back(
      curve("no map", "none", select(study, Curve::none), by_faces, mean_degrees));
  // Wang et al., figure 3b: of the mesh alone, whatever its map.
  Json depths = panel("Depth difference in pictures, normalised screen units");
  depths["curves"].push_back(curve("mean over 30 views", "mean", select(study, Curve::none),
                                   by_faces, [](const Setting& s) { return s.depth.mean; }));
  Json ticks = Json::array();
  for (const Setting* setting : own) ticks.push_back(setting->target_faces);
  return {{"title", "Errors against the low poly's faces: " + mesh + ", " +
                        plural(options.views, "view") + ", " + size_text(options.size)},
          {"x_title", "Faces of the low poly"},
          {"x_ticks", ticks},
          {"panels", {distances, depths, angles}}};
}

Json size_plot(const Study& study, const StudyOptions& options, const std::string& mesh) {
  Json angles = panel("Mean angle between normals, degrees");
  angles["rings"]["title"] = "larger maps gain less than 5%";
  const std::vector<const Setting*> without = select(study, Curve::none);
  for (std::size_t i = 0; i < without.size(); ++i) {
    const Setting& none = *without[i];
    const double last = static_cast<double>(std::max<std::size_t>(2, without.size()) - 1);
    const auto series = select(study, Curve::kiln, none.target_faces);
    angles["curves"].push_back(curve(with_commas(none.target_faces) + " faces (no map: " +
                                         figure(none.normal.mean_degrees) + ")",
                                     static_cast<double>(i) / last, series, by_size, mean_degrees));
    const Setting* enough = levels_off(series);
    if (enough == series.back()) continue;
    angles["rings"]["x"].push_back(enough->size);
    angles["rings"]["y"].push_back(enough->normal.mean_degrees);
  }
  return {{"title", "Normal error against map size and faces: " + mesh + ", " +
                        plural(options.views, "view")},
          {"x_title", "Texels a side of the map"},
          {"x_ticks", kStudySizes},
          {"panels", Json::array({angles})}};
}

/// What a picture shows, how its map was made, its figures.
Json captions(const char* rank, const Setting& setting) {
  char figures[96];
  std::snprintf(figures, sizeof figures, "mean %.2f degrees, 95%% under %.1f, over %u views",
                setting.normal.mean_degrees, setting.normal.p95_degrees, kHeldOutViews);
  return {std::string(rank) + ": " +
              (setting.curve == Curve::paper ? "as in the paper, " : "Kiln's own matching, ") +
              plural(setting.views, "view"),
          plural(setting.faces, "face") + ", " + size_text(setting.size), figures};
}

}  // namespace

Plot study_plot(const Study& study, const StudyOptions& options, const std::string& mesh) {
  Json data = {{"kind", "study"}};
  data.update(options.kind == StudyKind::faces  ? faces_plot(study, options, mesh)
              : options.kind == StudyKind::size ? size_plot(study, options, mesh)
                                                : views_plot(study, options, mesh));
  return {std::string("study_") + study_name(options.kind), std::move(data), {}};
}

Plot error_plot(const Study& study, const StudyOptions& options) {
  const std::string name = std::string("study_") + study_name(options.kind) + "_error";
  ValueTiles tiles;
  Json original = tiles.add_gray(gray(study.original));
  original["captions"] = {"the high poly", "the original: its normals are the reference"};
  Json shown = Json::array({original});
  const auto add = [&](const char* rank, const ErrorPicture& picture) {
    // Pixels that neither mesh covers are -1, those that one does below.
    Json tile = tiles.add(picture.degrees, [](float degrees) {
      return degrees >= 0    ? double{degrees}
             : degrees == -1 ? ValueTiles::kBeside
                             : ValueTiles::kNotKnown;
    });
    tile["captions"] = captions(rank, study.settings[picture.setting]);
    shown.push_back(std::move(tile));
  };
  add("worst", study.worst);
  add("best", study.best);
  return {
      name,
      {{"kind", "pictures"},
       {"image", name + "_plot.png"},
       {"tile", tiles.size()},
       {"blocks",
        Json::array({{{"title", "error of the normal"}, {"unit", "degrees"}, {"tiles", shown}}})},
       {"legend", Json::array({{{"code", 1},
                                {"text", "seen of only one of the two meshes: not measured"}}})}},
      tiles.image()};
}

}  // namespace kiln::cli

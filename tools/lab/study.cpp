// `kiln measure --study`: the error analysis of Wang, Froehlich and Goebel 2003 ("Fast Normal Map Generation for
// Simplified Meshes", section 5, figure 3): normal and distance errors against views, faces and map size.
#include <algorithm>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "interrupt.h"
#include "kiln/files.h"
#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "lab/value_tiles.h"
#include "report/check_result.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// The setting that varies.
enum class StudyKind { views, faces, size };
const std::map<std::string, StudyKind>& study_kinds() {
  static const std::map<std::string, StudyKind> kinds = {
      {"views", StudyKind::views}, {"faces", StudyKind::faces}, {"size", StudyKind::size}};
  return kinds;
}

const char* study_name(StudyKind kind) {
  return kind == StudyKind::views ? "views" : kind == StudyKind::faces ? "faces" : "size";
}

/// The arguments, with defaults for what they leave open.
struct StudyOptions {
  explicit StudyOptions(const MeasureArguments& a)
      : kind(study_kinds().at(a.study)),
        views(a.views.value_or(12)),
        view_size(a.view_size.value_or(0)),
        size(a.size.value_or(1024)),
        faces(a.faces.value_or(2000)),
        pixels(a.pixels.value_or(512)),
        max_distance(parse_length_above_0("--max-distance", a.max_distance)),
        z_up(a.view.z_up) {}

  StudyKind kind;
  std::uint32_t views;      ///< Matched from, where they do not vary
  std::uint32_t view_size;  ///< Pixels a side of a depth view; 0: by the density of HIGH
  std::uint32_t size;       ///< Texels a side of the map, where it does not vary
  std::uint32_t faces;      ///< Of the low poly, where they do not vary and none is given
  std::uint32_t pixels;     ///< A side of the pictures measured
  Length max_distance;
  bool z_up;  ///< In the error picture
};

constexpr std::array<std::uint32_t, 11> kStudyViews = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48};
constexpr std::array<std::uint32_t, 6> kStudyFaces = {500, 1000, 2000, 4000, 8000, 16000};
constexpr std::array<std::uint32_t, 5> kStudySizes = {128, 256, 512, 1024, 2048};

/// Ways to make a setting's map: one curve of a plot each.
enum class Curve {
  paper,  ///< Depth views by the least depth difference, points left on the view's line
  kiln,  ///< Depth views as Kiln matches them by default: best angle, points moved to the normal's line
  ray,   ///< Rays along the low poly's normals: no views
  none,  ///< No map at all: the low poly's own normals
};
std::string curve_name(Curve curve) {
  switch (curve) {
    case Curve::paper:
      return "paper";
    case Curve::kiln:
      return "kiln";
    case Curve::ray:
      return default_match();
    case Curve::none:
      break;
  }
  return "none";
}

/// One setting with its figures.
struct Setting {
  Curve curve = Curve::kiln;
  std::uint32_t views = 0;         ///< 0: not matched by views
  std::uint32_t target_faces = 0;  ///< As asked; of a given LOW: its own
  std::uint32_t size = 0;          ///< Texels a side; 0: no map

  std::uint64_t faces = 0;      ///< Of the low poly
  std::uint32_t view_size = 0;  ///< Pixels a side; 0: not matched by views
  NormalError normal;           ///< Over the held-out views
  DistanceError distance;       ///< Of the match, low poly to high poly, world units
  DepthError depth;             ///< Of the low poly over the held-out views; of StudyKind::faces
  double seconds_bake = 0, seconds_measure = 0;
  std::vector<Warning> warnings;
};

/// A setting's error where one looks from one held-out view.
struct ErrorPicture {
  std::size_t setting = 0;  ///< Index
  Image degrees;            ///< normal_angles()
};

struct Study {
  std::vector<Setting> settings;   ///< By curve, faces, map size, views
  std::vector<Vec3> held_out;      ///< Directions measured from
  double least_angle_degrees = 0;  ///< Between them and those matched from
  double diagonal = 0;             ///< Of HIGH, world units
  double max_distance = 0;         ///< World units
  Image original;                  ///< HIGH, from the picture's view
  ErrorPicture worst, best;        ///< By mean angle, of the settings matched by views
  std::vector<Warning> warnings;   ///< Of HIGH and of LOW
  double seconds_low = 0;          ///< Making low polys
  bool cancelled = false;
};

// ---- measuring ---------------------------------------------------------------------------------

constexpr std::uint32_t kPictureSize = 640;  // pixels a side of the error picture's panels

/// Settings to measure, in an order that makes each low poly once.
std::vector<Setting> plan(const StudyOptions& options, const Mesh& high, const Mesh* low) {
  std::vector<Setting> settings;
  const auto add = [&](Curve curve, std::uint32_t views, std::uint32_t faces, std::uint32_t size) {
    Setting setting;
    setting.curve = curve;
    setting.views = views;
    setting.target_faces = faces;
    setting.size = size;
    settings.push_back(setting);
  };
  if (options.kind == StudyKind::views) {
    const std::uint32_t faces =
        low != nullptr ? static_cast<std::uint32_t>(low->triangles.size()) : options.faces;
    add(Curve::none, 0, faces, 0);
    add(Curve::ray, 0, faces, options.size);
    for (const std::uint32_t views : kStudyViews) {
      add(Curve::paper, views, faces, options.size);
      add(Curve::kiln, views, faces, options.size);
    }
    return settings;
  }
  for (const std::uint32_t faces : kStudyFaces) {
    if (faces >= high.triangles.size()) break;
    add(Curve::none, 0, faces, 0);
    if (options.kind == StudyKind::size) {
      for (const std::uint32_t size : kStudySizes) add(Curve::kiln, options.views, faces, size);
    } else {
      add(Curve::ray, 0, faces, options.size);
      add(Curve::paper, options.views, faces, options.size);
      add(Curve::kiln, options.views, faces, options.size);
    }
  }
  if (settings.empty()) {
    throw Error(ErrorCode::input, "'" + high.name + "' has " +
                                      std::to_string(high.triangles.size()) +
                                      " triangles: a study of low polys needs more than " +
                                      std::to_string(kStudyFaces[0]) + ".");
  }
  return settings;
}

/// The low polys, each made where it is first needed.
class LowMeshes {
 public:
  LowMeshes(const Mesh& high, const Mesh* given, double& seconds)
      : high_(high), given_(given), seconds_(seconds) {}

  /// With UVs laid out for a map of this size (0: as the last).
  const Mesh& get(std::uint32_t faces, std::uint32_t size, std::vector<Warning>& warnings) {
    if (given_ != nullptr) return *given_;
    Stopwatch watch;
    if (faces != faces_) {
      SimplifyOptions options;
      options.faces = faces;
      SimplifyReport report;
      simple_ = simplify(high_, options, &report);
      warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
      mesh_ = simple_;
    }
    if (size != 0 && (faces != faces_ || size != size_)) {
      UnwrapOptions options;
      options.method = UnwrapMethod::pairs;
      options.size = std::max(size, 16U);
      UnwrapReport report;
      mesh_ = fit_normals(unwrap(simple_, options, &report), high_);
      warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
      size_ = size;
    } else if (faces != faces_) {
      size_ = 0;
    }
    faces_ = faces;
    seconds_ += watch.total();
    return mesh_;
  }

 private:
  const Mesh& high_;
  const Mesh* given_;
  double& seconds_;
  std::uint32_t faces_ = 0, size_ = 0;
  Mesh simple_, mesh_;
};

BakeOptions bake_options(const Setting& setting, const StudyOptions& options) {
  BakeOptions bake;
  bake.width = bake.height = setting.size;
  bake.match.max_distance = options.max_distance;
  bake.report.keep_match = true;
  if (setting.curve == Curve::ray) return bake;
  bake.match.method = first_match("match.views.count");
  bake.match.views.count = setting.views;
  bake.match.views.size = options.view_size;
  if (setting.curve == Curve::paper) {
    bake.match.views.criterion = ViewCriterion::depth;
    bake.match.views.refine = false;
  }
  return bake;
}

/// A look from the front, a little from the side and above, where nothing is matched from there; else the
/// held-out view nearest to it.
RenderOptions picture_options(const Mesh& frame, const std::vector<Vec3>& held_out,
                              const std::vector<Vec3>& used, bool z_up) {
  constexpr Vec3 kFront = {0.4830F, 0.2588F, 0.8365F};  // 30 degrees aside, 15 above
  const std::array<Vec3, 1> front = {z_up ? Vec3{kFront.x, -kFront.z, kFront.y} : kFront};
  const auto angle = [&](const Vec3& view) { return least_angle_degrees({&view, 1}, front); };
  Vec3 toward = front[0];
  if (least_angle_degrees(front, used) < kLeastHeldOutAngle) {
    toward = *std::min_element(held_out.begin(), held_out.end(),
                               [&](const Vec3& a, const Vec3& b) { return angle(a) < angle(b); });
  }
  const ViewAngles view = view_angles(z_up ? Vec3{toward.x, toward.z, -toward.y} : toward);
  RenderOptions options;
  options.size = kPictureSize;
  options.azimuth_degrees = view.azimuth_degrees;
  options.elevation_degrees = view.elevation_degrees;
  options.z_up = z_up;
  options.frame = &frame;
  return options;
}

std::string stage(const Setting& setting) {
  std::string text = std::to_string(setting.target_faces) + " faces";
  if (setting.curve == Curve::none) return text + ", no map";
  text += ", " + std::to_string(setting.size) + " x " + std::to_string(setting.size) + " map, ";
  if (setting.curve == Curve::ray) return text + "rays";
  return text + std::to_string(setting.views) + (setting.views == 1 ? " view" : " views") +
         (setting.curve == Curve::paper ? " as in the paper" : "");
}

/// \param low  null: made from `high`
/// \throws Error(input) where HIGH has too few faces for a study of them
Study measure_study(const Device& device, const Mesh& high, const Mesh* low,
                    const StudyOptions& options, const Progress& progress) {
  Study study;
  study.settings = plan(options, high, low);
  // The same views for all three studies, so that their figures can be compared.
  std::vector<Vec3> used = spread_views(options.views);
  for (const std::uint32_t count : kStudyViews) {
    const std::vector<Vec3> more = spread_views(count);
    used.insert(used.end(), more.begin(), more.end());
  }
  study.held_out = held_out_views(kHeldOutViews, used, kLeastHeldOutAngle);
  study.least_angle_degrees = least_angle_degrees(study.held_out, used);

  study.cancelled = true;  // until all is done
  if (!progress(0, "preparing the high poly")) return study;
  const Source source(device, high);
  study.diagonal = source.stats().diagonal;
  study.warnings = source.warnings();
  const Scene high_scene(device, high);
  const std::vector<ViewAngles> angles = angles_of(study.held_out);
  const NormalReference reference(high_scene, high, angles, options.pixels);
  std::optional<DepthReference> depths;
  if (options.kind == StudyKind::faces) depths.emplace(high_scene, high, angles, options.pixels);
  RenderOptions picture = picture_options(high, study.held_out, used, options.z_up);
  study.original = high_scene.draw(picture);
  picture.show_normals = true;
  picture.samples = 1;
  const Image high_normals = high_scene.draw(picture);

  LowMeshes lows(high, low, study.seconds_low);
  bool first = true;
  double least = 0;
  double most = 0;
  for (std::size_t i = 0; i < study.settings.size(); ++i) {
    Setting& setting = study.settings[i];
    const auto show = [&](double done) {
      return progress((static_cast<double>(i) + done) / static_cast<double>(study.settings.size()),
                      stage(setting));
    };
    if (!show(0)) return study;
    const Mesh& mesh = lows.get(setting.target_faces, setting.size, setting.warnings);
    setting.faces = mesh.triangles.size();
    Stopwatch watch;
    NormalMap map;
    BakeResult result;
    if (setting.curve != Curve::none) {
      BakeOptions bake_with = bake_options(setting, options);
      bake_with.progress = [&](double done, std::string_view) { return show(done / 2); };
      result = bake(source, mesh, bake_with);
      if (result.cancelled) return study;
      const BakeReport& report = result.report;
      setting.warnings.insert(setting.warnings.end(), report.warnings.begin(),
                              report.warnings.end());
      setting.distance = match_distance(*result.match);
      if (report.views) setting.view_size = report.views->size;
      study.max_distance = report.max_distance;
      map.image = &result.maps[0].image;
    }
    setting.seconds_bake = watch.lap();
    if (!show(0.5)) return study;
    const Scene scene(device, mesh, map);
    setting.normal = reference.compare(scene);
    if (depths && setting.curve == Curve::none) setting.depth = depths->compare(scene);
    check_seen(setting.normal, high, mesh);
    setting.seconds_measure = watch.lap();

    if (setting.views == 0) continue;
    const double mean = setting.normal.mean_degrees;
    if (!first && mean >= least && mean <= most) continue;
    const ErrorPicture seen{i, normal_angles(high_normals, scene.draw(picture))};
    if (first || mean > most) study.worst = seen, most = mean;
    if (first || mean < least) study.best = seen, least = mean;
    first = false;
  }

  // By curve, which is how they are read; the pictures' settings move along.
  std::vector<std::size_t> order(study.settings.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto key = [&](std::size_t i) {
    const Setting& s = study.settings[i];
    return std::tuple(s.curve, s.target_faces, s.size, s.views);
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  std::vector<Setting> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(study.settings[i]));
  study.settings = std::move(sorted);
  for (ErrorPicture* seen : {&study.worst, &study.best}) {
    seen->setting = static_cast<std::size_t>(std::find(order.begin(), order.end(), seen->setting) -
                                             order.begin());
  }
  study.cancelled = false;
  return study;
}

// ---- what is written ---------------------------------------------------------------------------

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

/// Numbers of faces of the low polys that were made, in their order.
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

/// All but seconds and warnings.
Json figures_of(const Setting& s, double diagonal) {
  const bool views = s.views != 0, paper = s.curve == Curve::paper;
  const auto of_views = [&](const Json& value) { return views ? value : Json(); };
  Json json = fields(
      "curve match views view_size view_criterion view_refine target_faces faces size normal_error",
      {curve_name(s.curve),
       views                   ? Json(first_match("match.views.count").name)
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
  return json;
}

/// The same of all settings.
Json figures_of(const Study& study) {
  Json rows = Json::array();
  for (const Setting& setting : study.settings) {
    rows.push_back(figures_of(setting, study.diagonal));
  }
  return rows;
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
      // If it is the last, the series may not have levelled off.
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
    // Each label names the picture, the way its map was made, and its figures.
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
  static const std::vector<Column> columns = {
      {"curve", "curve"},
      {"views", "views", 0},
      {"faces", "faces", 0},
      {"size", "size", 0},
      {"mean °", "normal_error.mean_angle_degrees", 3},
      {"median", "normal_error.median_angle_degrees", 3},
      {"95%", "normal_error.p95_angle_degrees", 2},
      {"99%", "normal_error.p99_angle_degrees", 2},
      {"8-bit", "normal_error.mean_8bit_difference", 2},
      {"distance %", "distance_error.mean_percent_of_diagonal", 4},
      {"95%", "distance_error.p95_percent_of_diagonal", 3},
      {"most", "distance_error.max_percent_of_diagonal", 2},
      {"depth", "depth_difference.mean", 5}};
  std::vector<std::string> lines = table_lines(columns, figures_of(study));
  for (const std::string& line : findings(study, options)) lines.push_back(line);
  return lines;
}

Json json_of(const Study& study, const StudyOptions& options) {
  Json settings = figures_of(study);
  for (std::size_t i = 0; i < study.settings.size(); ++i) {
    const Setting& s = study.settings[i];
    settings[i].update(fields(
        "seconds warnings",
        {fields("bake measure", {s.seconds_bake, s.seconds_measure}), describe(s.warnings)}));
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
  Json json = fields(
      "study measured_from diagonal max_distance_world settings worst best",
      {study_name(options.kind),
       describe_views(study.held_out, options.pixels, study.least_angle_degrees), study.diagonal,
       study.max_distance, settings, study.worst.setting, study.best.setting});
  if (!enough.empty()) json["levels_off_at"] = enough;
  json["findings"] = findings(study, options);
  return json;
}

// ---- the command -------------------------------------------------------------------------------

/// Contradictions between several options.
void check_study(const MeasureArguments& a) {
  if (!a.matches.empty() || a.directions || !a.visibility_at.empty()) {
    fail(
        "--match, --directions and --visibility-at are for rating matches: leave out "
        "--study, "
        "or them.");
  }
  if (a.out.empty()) fail("--study needs --out, a folder for its data and pictures.");
  if (!a.low.empty() && a.study != "views") {
    fail("--study " + a.study + " makes its own low polys, but LOW '" + a.low +
         "' was given: leave it out.");
  }
  if (!a.low.empty() && a.faces) {
    fail("--faces is for making a low poly, but LOW '" + a.low +
         "' was given: leave one of them out.");
  }
  const auto varies = [&](bool given, const char* option, bool is_varied) {
    if (given && is_varied) {
      fail("--study " + a.study + " varies " + option + " itself: leave the option out.");
    }
  };
  varies(a.views.has_value(), "--views", a.study == "views");
  varies(a.faces.has_value(), "--faces", a.study != "views");
  varies(a.size.has_value(), "--size", a.study == "size");
  if (a.asks_for_view()) {
    fail(
        "--view, --zoom, --at, --square and --picture-size are for rating matches: --study looks "
        "from a direction that nothing was matched from. Leave them out.");
  }
}

}  // namespace

std::vector<std::string> study_names() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : study_kinds()) names.push_back(name);
  return names;
}

int run_study(const MeasureArguments& a) {
  check_study(a);
  const StudyOptions options(a);
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  prepare_output_folder(folder);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh high =
      load_high(a.high, a.heights, warnings, load_options(a.bake, MeshSide::high)).mesh;
  std::optional<Mesh> low;
  if (!a.low.empty()) {
    low = load_low(a.low, ", or leave LOW out", warnings, load_options(a.bake, MeshSide::low));
  }
  const double seconds_load = watch.lap();

  constexpr double kAtStudy = 0.02;
  constexpr double kAtSave = 0.97;
  const Study study = measure_study(
      device, high, low ? &*low : nullptr, options, [&](double done, std::string_view stage) {
        return console.progress(kAtStudy + (kAtSave - kAtStudy) * done, stage);
      });
  if (study.cancelled) return kExitCancelled;
  warnings.insert(warnings.end(), study.warnings.begin(), study.warnings.end());
  const double seconds_study = watch.lap();

  const Plot plot = study_plot(study, options, high.name);
  if (!console.progress(kAtSave, "writing")) return kExitCancelled;
  const fs::path data = folder / (plot.name + ".csv");
  save_text(data, csv(figures_of(study)));
  std::vector<std::string> outputs = {data.string()};
  if (!save_plots(folder, {plot, error_plot(study, options)}, outputs, warnings)) {
    return kExitCancelled;
  }
  const double seconds_save = watch.lap();

  if (!a.json.empty()) {
    double bake = 0, measure = 0;
    for (const Setting& setting : study.settings) {
      bake += setting.seconds_bake;
      measure += setting.seconds_measure;
    }
    // Options in force; null: varied by the study, or not used.
    const bool views = options.kind == StudyKind::views;
    Json json =
        fields("version device inputs options",
               {version(), describe(device.info()),
                fields("high low", {describe(high, a.high), low ? describe(*low, a.low) : Json()}),
                fields("study max_distance views view_size size faces height extent z_up",
                       {a.study, a.max_distance, views ? Json() : Json(options.views),
                        options.view_size == 0 ? Json("auto") : Json(options.view_size),
                        options.kind == StudyKind::size ? Json() : Json(options.size),
                        views && a.low.empty() ? Json(options.faces) : Json(),
                        is_height_field(a.high) ? Json(a.heights.height) : Json(),
                        extent_json(a.heights), a.view.z_up})});
    json.update(json_of(study, options));
    add_ending(json,
               fields("load low bake measure study save", {seconds_load, study.seconds_low, bake,
                                                           measure, seconds_study, seconds_save}),
               watch, outputs, warnings);
    save_report(a.json, json);
  }
  console.progress(1, "done");
  std::vector<Warning> of_settings;
  for (const Setting& setting : study.settings) {
    of_settings.insert(of_settings.end(), setting.warnings.begin(), setting.warnings.end());
  }
  print_warnings(console, warnings, of_settings, "--json");
  for (const std::string& line : study_lines(study, options)) console.line(line);
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace kiln::cli

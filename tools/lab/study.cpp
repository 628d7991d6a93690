// `kiln measure --study`: the error analysis of Wang, Froehlich and Goebel 2003 ("Fast Normal Map Generation for
// Simplified Meshes", section 5, figure 3): normal and distance errors against views, faces and map size.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "interrupt.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/files.h"
#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "lab/lab_run.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"
#include "picture/plot.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::uint32_t, 11> kStudyViews = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48};
constexpr std::array<std::uint32_t, 6> kStudyFaces = {500, 1000, 2000, 4000, 8000, 16000};
constexpr std::array<std::uint32_t, 5> kStudySizes = {128, 256, 512, 1024, 2048};

// Names of the curves in plots, one for each way of making a map. A further curve, default_match(), stands for rays
// along the low poly's normals.
constexpr const char* kPaperCurve =
    "paper";  ///< Views chosen by the smallest depth difference; points are not refined
constexpr const char* kKilnCurve =
    "kiln";  ///< Views chosen by the best angle; points are refined to the line along the normal
constexpr const char* kNoMapCurve = "none";  ///< No map: the low poly is shown with its own normals

/// Path of the mean angle between rendered normals in a setting's figures.
constexpr const char* kDegreesPath = "normal_error.mean_angle_degrees";

/// A combination of match, views, faces and map size to measure.
struct Setting {
  std::string curve;
  std::uint32_t views;  ///< Number of views; 0: the match uses no views
  std::uint32_t faces;  ///< Requested number of faces; if LOW is given, the number of its faces
  std::uint32_t size;   ///< Texels per side of the map; 0: no map
};

struct Study {
  std::vector<Json> rows;  ///< Figures of all settings, ordered by curve, faces, map size and views
  std::vector<Json> timing_rows;  ///< Seconds and warnings of each row
  /// Indices in `rows` of the settings with the largest and the smallest mean angle, among those that match by views
  std::size_t worst_row = 0, best_row = 0;
  /// Length of HIGH's diagonal, and search distance of the matches, both in world units
  double diagonal = 0, max_distance = 0;
};

// ---- Measuring ----

/// Lists the settings to measure, ordered by curve, faces, map size and views.
std::vector<Setting> plan(const MeasureArguments& a, const Mesh& high, const Mesh* low) {
  const bool views = a.study == "views", sizes = a.study == "size";
  std::vector<std::uint32_t> faces;
  if (views) {
    faces = {low != nullptr ? static_cast<std::uint32_t>(low->triangles.size()) : *a.faces};
  } else {
    faces.assign(kStudyFaces.begin(), kStudyFaces.end());
    std::erase_if(faces, [&](std::uint32_t count) { return count >= high.triangles.size(); });
  }
  if (faces.empty()) {
    throw Error(ErrorCode::input, "'" + high.name + "' has " +
                                      std::to_string(high.triangles.size()) +
                                      " triangles, but a study of low polys needs more than " +
                                      std::to_string(kStudyFaces[0]) + ".");
  }
  using Counts = std::vector<std::uint32_t>;
  const Counts view_counts =
      views ? Counts(kStudyViews.begin(), kStudyViews.end()) : Counts{*a.views};
  const Counts size_counts =
      sizes ? Counts(kStudySizes.begin(), kStudySizes.end()) : Counts{*a.size};
  std::vector<Setting> settings;
  const auto add = [&](const std::string& curve, const Counts& numbers_of_views,
                       const Counts& map_sizes) {
    for (const std::uint32_t count : faces) {
      for (const std::uint32_t size : map_sizes) {
        for (const std::uint32_t views_count : numbers_of_views) {
          settings.push_back({curve, views_count, count, size});
        }
      }
    }
  };
  if (!sizes) add(kPaperCurve, view_counts, size_counts);
  add(kKilnCurve, view_counts, size_counts);
  if (!sizes) add(default_match(), {0}, size_counts);
  add(kNoMapCurve, {0}, {0});
  return settings;
}

/// Makes each low poly when it is first used, and caches it.
class LowMeshes {
 public:
  LowMeshes(const Mesh& high, const Mesh* given) : high_(high), given_(given) {}

  /// Returns the low poly with this number of faces, and UVs for a map of `size` texels per side. If `size` is 0, it
  /// has no UVs. If LOW was given, returns LOW.
  const Mesh& get_low(std::uint32_t faces, std::uint32_t size, std::vector<Warning>& warnings) {
    if (given_ != nullptr) return *given_;
    const auto found = low_by_faces_and_size_.find({faces, size});
    if (found != low_by_faces_and_size_.end()) return found->second;
    const Mesh& high = size == 0 ? high_ : get_low(faces, 0, warnings);
    const Stopwatch watch;
    Mesh& mesh = low_by_faces_and_size_[{faces, size}];
    const auto add_warnings = [&](const auto& report) {
      warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
    };
    if (size == 0) {
      SimplifyOptions options;
      options.faces = faces;
      SimplifyReport report;
      mesh = simplify(high, options, &report);
      add_warnings(report);
    } else {
      UnwrapReport report;
      mesh = fit_normals(unwrap(high, {UnwrapMethod::pairs, std::max(size, 16U)}, &report), high_);
      add_warnings(report);
    }
    seconds += watch.total();
    return mesh;
  }

  double seconds = 0;  ///< Total time in which low polys were simplified and unwrapped

 private:
  const Mesh& high_;
  const Mesh* given_;
  /// The cached low polys by number of faces and map size
  std::map<std::pair<std::uint32_t, std::uint32_t>, Mesh> low_by_faces_and_size_;
};

BakeOptions make_bake_options(const Setting& setting, const MeasureArguments& a) {
  BakeOptions bake;
  bake.width = bake.height = setting.size;
  bake.match.max_distance = a.search_distance();
  bake.report.keep_match = true;
  if (setting.curve == default_match()) return bake;
  bake.match.method = first_match("match.views.count");
  bake.match.views.count = setting.views;
  bake.match.views.size = a.view_size.value_or(0);
  if (setting.curve == kPaperCurve) {
    bake.match.views.criterion = ViewCriterion::depth;
    bake.match.views.refine = false;
  }
  return bake;
}

/// Describes the distances from the low poly to the matched points, with the number of samples without a point.
Json error_json(const DistanceError& d, double diagonal) {
  return fields(
      "samples missed mean p95 max mean_percent_of_diagonal p95_percent_of_diagonal "
      "max_percent_of_diagonal",
      {d.samples, d.missed, d.mean, d.p95, d.max, 100 * d.mean / diagonal, 100 * d.p95 / diagonal,
       100 * d.max / diagonal});
}

Json error_json(const DepthError& d) {
  return fields("pixels one_sided mean rms max", {d.pixels, d.one_sided, d.mean, d.rms, d.max});
}

/// Bakes and measures all settings of a study.
/// \param low  the given low poly; if null, low polys are simplified from `high`
/// \param run  receives the report's data and the warnings that concern all settings
/// \returns nullopt if cancelled
/// \throws Error(input) if HIGH has no more faces than the smallest low poly of a study of faces
std::optional<Study> measure_study(const Device& device, const Mesh& high, const Mesh* low,
                                   const MeasureArguments& a, const Progress& progress,
                                   LabRun& run) {
  Study study;
  const std::vector<Setting> settings = plan(a, high, low);
  // All three studies measure in the same views, which avoid the views of every study's matches, so that figures of
  // different studies are comparable.
  std::vector<Vec3> used_views = spread_views(*a.views);
  for (const std::uint32_t count : kStudyViews) {
    const std::vector<Vec3> views_of_count = spread_views(count);
    used_views.insert(used_views.end(), views_of_count.begin(), views_of_count.end());
  }
  const std::vector<Vec3> held_out = held_out_views(kHeldOutViews, used_views, kMinHeldOutAngle);
  run.report["measured_from"] =
      describe_views(held_out, *a.pixels, least_angle_degrees(held_out, used_views));

  Steps steps(progress);
  if (!steps.start("preparing the high poly")) return std::nullopt;
  steps.count = static_cast<double>(settings.size());
  const Source source(device, high);
  study.diagonal = source.stats().diagonal;
  run.warnings.insert(run.warnings.end(), source.warnings().begin(), source.warnings().end());
  const Scene high_scene(device, high);
  const std::vector<ViewAngles> angles = angles_of(held_out);
  const NormalReference reference(high_scene, high, angles, *a.pixels);
  std::optional<DepthReference> depth_reference;
  if (a.study == "faces") depth_reference.emplace(high_scene, high, angles, *a.pixels);

  LowMeshes low_meshes(high, low);
  double seconds_bake = 0, seconds_measure = 0;
  for (const Setting& s : settings) {
    const std::string number = std::to_string(study.rows.size() + 1);
    if (!steps.start("setting " + number + " of " + std::to_string(settings.size()) + ", " +
                     s.curve))
      return std::nullopt;
    std::vector<Warning> warnings;
    const Mesh& mesh = low_meshes.get_low(s.faces, s.size, warnings);
    const bool views = s.views != 0, paper = s.curve == kPaperCurve;
    const auto null_without_views = [&](const Json& value) { return views ? value : Json(); };
    BakeOptions bake_with = make_bake_options(s, a);
    Json figures =
        fields("curve match views view_size view_criterion view_refine target_faces faces size",
               {s.curve, s.curve == kNoMapCurve ? Json() : Json(bake_with.match.method.name),
                null_without_views(s.views), Json(), null_without_views(paper ? "depth" : "angle"),
                null_without_views(!paper), s.faces, mesh.triangles.size(),
                s.size != 0 ? Json(s.size) : Json()});
    Stopwatch watch;
    NormalMap map;
    BakeResult result;
    if (s.curve != kNoMapCurve) {
      bake_with.progress = steps.step_progress(0.5);
      result = bake(source, mesh, bake_with);
      if (result.cancelled) return std::nullopt;
      const BakeReport& report = result.report;
      warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
      const DistanceError d = match_distance(*result.match);
      const double samples = static_cast<double>(std::max<std::uint64_t>(1, d.samples + d.missed));
      figures["matched_share"] = static_cast<double>(d.samples) / samples;
      figures["distance_error"] = error_json(d, study.diagonal);
      if (report.views) figures["view_size"] = report.views->size;
      study.max_distance = report.max_distance;
      map.image = &result.maps[0].image;
    }
    const double bake_time = watch.lap();
    const Scene scene(device, mesh, map);
    const NormalError error = reference.compare(scene);
    check_meshes_are_visible(error, high, mesh);
    figures["normal_error"] = describe(error);
    if (depth_reference && s.curve == kNoMapCurve) {
      figures["depth_difference"] = error_json(depth_reference->compare(scene));
    }
    const double measure_time = watch.lap();
    seconds_bake += bake_time, seconds_measure += measure_time;
    study.timing_rows.push_back(
        fields("seconds warnings",
               {fields("bake measure", {bake_time, measure_time}), describe(warnings)}));
    run.settings_warnings.insert(run.settings_warnings.end(), warnings.begin(), warnings.end());
    study.rows.push_back(std::move(figures));
    steps.done += 1;
    if (!views) continue;
    const auto degrees = [&](std::size_t i) { return study.rows[i].at(kDegreesPath).number(); };
    if (error.mean_degrees > degrees(study.worst_row)) study.worst_row = study.rows.size() - 1;
    if (error.mean_degrees < degrees(study.best_row)) study.best_row = study.rows.size() - 1;
  }
  run.seconds.update(
      fields("low bake measure", {low_meshes.seconds, seconds_bake, seconds_measure}));
  return study;
}

// ---- Plots ----

/// Returns the rows of one curve in the study's order.
/// \param faces  requested number of faces of the low poly; 0: rows of all low polys
std::vector<Json> select_rows(const Study& study, const std::string& curve, double faces = 0) {
  std::vector<Json> selected_rows;
  for (const Json& row : study.rows) {
    if (row.at("curve").text() == curve && (faces == 0 || row.at("target_faces").number() == faces))
      selected_rows.push_back(row);
  }
  return selected_rows;
}

double read_degrees(const Json& row) { return row.at(kDegreesPath).number(); }

/// Finds the first row of a series whose mean angle exceeds the smallest one by at most 5%: more views or texels than
/// in that row hardly reduce the error.
const Json& find_sufficient_row(const std::vector<Json>& series) {
  constexpr double kMaxRelativeGain = 0.05;
  double min_error = read_degrees(series.front());
  for (const Json& row : series) min_error = std::min(min_error, read_degrees(row));
  return *std::find_if(series.begin(), series.end(), [&](const Json& row) {
    return read_degrees(row) <= min_error * (1 + kMaxRelativeGain);
  });
}

/// Makes a curve with one point per row of a series.
/// \param x, y  paths in a row of the point's coordinates
Json make_curve(const std::string& title, const Json& look, const std::vector<Json>& series,
                const char* x, const char* y) {
  const auto figure = [](const char* path) {
    return [path](const Json& row) { return row.at(path); };
  };
  return plot_curve(title, look, series, figure(x), figure(y));
}

Json make_panel(const std::string& y_title, std::initializer_list<Json::Element> curves) {
  Json panel = plot_panel(y_title);
  panel["curves"] = Json::array(curves);
  return panel;
}

Json make_plot(const std::string& title, const char* x_title, const Json& x_ticks,
               const Json& panels) {
  return fields("kind title x_title x_ticks panels", {"study", title, x_title, x_ticks, panels});
}

std::string format_map_size(std::uint32_t size) {
  return std::to_string(size) + " × " + std::to_string(size) + " map";
}

/// Makes the curve of kPaperCurve, with coordinates at the paths `x` and `y` of a row.
Json make_paper_curve(const Study& study, const char* x, const char* y) {
  return make_curve("paper: least depth difference", kPaperCurve, select_rows(study, kPaperCurve),
                    x, y);
}

/// Makes the curve of kKilnCurve, with coordinates at the paths `x` and `y` of a row.
Json make_kiln_curve(const Study& study, const char* x, const char* y) {
  return make_curve("Kiln: best angle, refined", kKilnCurve, select_rows(study, kKilnCurve), x, y);
}

Json make_views_plot(const Study& study, const MeasureArguments& a, const std::string& mesh) {
  const auto panel = [&](const char* title, const char* path, const char* unit) {
    Json json = make_panel(
        title, {make_paper_curve(study, "views", path), make_kiln_curve(study, "views", path)});
    for (const auto& [name, curve] :
         {std::pair<std::string, std::string>{"rays (no views)", default_match()},
          {"no map", kNoMapCurve}}) {
      const double y = select_rows(study, curve).front().at(path).number();
      json["levels"].push_back(
          fields("title look y", {name + ": " + fixed_text(y, 2) + unit, curve, y}));
    }
    return json;
  };
  Json data = make_plot(
      "Normal error against the number of depth views: " + mesh + ", " +
          count_text(study.rows.front().at("faces")) + " faces, " + format_map_size(*a.size),
      "Depth views", kStudyViews,
      Json::array({panel("Mean angle between normals, degrees", kDegreesPath, " degrees"),
                   panel("Mean 8-bit difference of normals, 0 to 255",
                         "normal_error.mean_8bit_difference", "")}));
  data["x_note"] = fields("x text", {12, "12: the paper's choice"});
  return data;
}

Json make_faces_plot(const Study& study, const MeasureArguments& a, const std::string& mesh) {
  const std::vector<Json> kiln_rows = select_rows(study, kKilnCurve),
                          without_map = select_rows(study, kNoMapCurve);
  const char* faces = "target_faces";
  Json ticks = Json::array();
  for (const Json& row : kiln_rows) ticks.push_back(row.at(faces));
  const std::string search_percent = fixed_text(100 * study.max_distance / study.diagonal, 2);
  const Json distances = make_panel(
      "Distance of the low poly to the high poly, % of the diagonal",
      {make_curve("farthest (within " + search_percent + "% of the diagonal)", "max", kiln_rows,
                  faces, "distance_error.max_percent_of_diagonal"),
       make_curve("95th percentile", "p95", kiln_rows, faces,
                  "distance_error.p95_percent_of_diagonal"),
       make_curve("mean", "mean", kiln_rows, faces, "distance_error.mean_percent_of_diagonal")});
  // The depth difference depends only on the mesh, not on its map (Wang et al., figure 3b).
  const Json depth_reference = make_panel(
      "Depth difference in pictures, normalised screen units",
      {make_curve("mean over 30 views", "mean", without_map, faces, "depth_difference.mean")});
  const std::vector<Json> rays = select_rows(study, default_match());
  const Json angles = make_panel(
      "Mean angle between normals, degrees",
      {make_paper_curve(study, faces, kDegreesPath), make_kiln_curve(study, faces, kDegreesPath),
       make_curve("rays (no views)", default_match(), rays, faces, kDegreesPath),
       make_curve("no map", kNoMapCurve, without_map, faces, kDegreesPath)});
  return make_plot("Errors against the low poly's faces: " + mesh + ", " +
                       plural(*a.views, "view") + ", " + format_map_size(*a.size),
                   "Faces of the low poly", ticks,
                   Json::array({distances, depth_reference, angles}));
}

Json make_size_plot(const Study& study, const MeasureArguments& a, const std::string& mesh) {
  Json angles = plot_panel("Mean angle between normals, degrees");
  angles["rings"]["title"] = "larger maps gain less than 5%";
  const std::vector<Json> without_map = select_rows(study, kNoMapCurve);
  const double last = static_cast<double>(std::max<std::size_t>(2, without_map.size()) - 1);
  double curve_index = 0;
  for (const Json& row : without_map) {
    const std::vector<Json> series =
        select_rows(study, kKilnCurve, row.at("target_faces").number());
    angles["curves"].push_back(make_curve(count_text(row.at("target_faces")) + " faces (no map: " +
                                              fixed_text(read_degrees(row), 2) + ")",
                                          curve_index++ / last, series, "size", kDegreesPath));
    const Json& smallest_sufficient = find_sufficient_row(series);
    if (&smallest_sufficient == &series.back()) continue;
    angles["rings"]["x"].push_back(smallest_sufficient.at("size"));
    angles["rings"]["y"].push_back(read_degrees(smallest_sufficient));
  }
  return make_plot(
      "Normal error against map size and faces: " + mesh + ", " + plural(*a.views, "view"),
      "Texels a side of the map", kStudySizes, Json::array({angles}));
}

// ---- Text ----

/// Finds the number of views beyond which the error of a curve hardly falls, or the map size beyond which the error of
/// a low poly hardly falls. The keys are the curves, or the numbers of faces.
Json find_sufficient_counts(const Study& study, const MeasureArguments& a) {
  Json smallest_sufficient = Json::object();
  if (a.study == "views") {
    for (const char* curve : {kPaperCurve, kKilnCurve}) {
      smallest_sufficient[curve] = find_sufficient_row(select_rows(study, curve)).at("views");
    }
  } else if (a.study == "size") {
    for (const Json& row : select_rows(study, kNoMapCurve)) {
      const double faces = row.at("target_faces").number();
      smallest_sufficient[text_of(faces)] =
          find_sufficient_row(select_rows(study, kKilnCurve, faces)).at("size");
    }
  }
  return smallest_sufficient;
}

const std::vector<Column>& columns() {
  static const std::vector<Column> all_columns = {
      {"curve", "curve"},
      {"views", "views", 0},
      {"faces", "faces", 0},
      {"size", "size", 0},
      {"mean °", kDegreesPath, 3},
      {"median", "normal_error.median_angle_degrees", 3},
      {"95%", "normal_error.p95_angle_degrees", 2},
      {"99%", "normal_error.p99_angle_degrees", 2},
      {"8-bit", "normal_error.mean_8bit_difference", 2},
      {"distance %", "distance_error.mean_percent_of_diagonal", 4},
      {"95%", "distance_error.p95_percent_of_diagonal", 3},
      {"most", "distance_error.max_percent_of_diagonal", 2},
      {"depth", "depth_difference.mean", 5}};
  return all_columns;
}

/// Adds all results to the report.
void add_report(const Study& study, const MeasureArguments& a, LabRun& run) {
  run.lines = table_lines(columns(), study.rows);
  Json settings = study.rows;
  for (std::size_t i = 0; i < settings.size(); ++i) settings[i].update(study.timing_rows[i]);
  const Json levels = find_sufficient_counts(study, a);
  std::vector<std::string> findings;
  for (const std::string& key : levels.keys()) {
    const std::string level = text_of(levels.at(key).number());
    findings.push_back(a.study == "views"
                           ? key + ": from " + level +
                                 " views, the mean error is within 5% of the smallest"
                           : key + " faces: from " + level +
                                 " texels a side, the mean error is within 5% of "
                                 "the smallest");
  }
  run.lines.insert(run.lines.end(), findings.begin(), findings.end());
  run.report.update(fields("study diagonal max_distance_world settings worst best findings",
                           {a.study, study.diagonal, study.max_distance, settings, study.worst_row,
                            study.best_row, findings}));
  if (!levels.empty()) run.report["levels_off_at"] = levels;
}

// ---- Command ----

/// Rejects options that contradict each other. \throws Error(usage)
void check_study(const MeasureArguments& a) {
  refuse_flags(a,
               {"--match", "--directions", "--visibility-at", "--view", "--zoom", "--at", "--z-up",
                "--square", "--picture-size"},
               "is for rating matches: leave this flag out, or leave --study out.");
  refuse_if(a.out.empty(), "--study needs --out, a folder for its data and pictures.");
  const std::string ignored = "has no effect with --study " + a.study + ": leave it out.";
  if (a.study == "views") refuse_flags(a, {"--views"}, ignored);
  if (a.study != "views") refuse_flags(a, {"--faces"}, ignored);
  if (a.study == "size") refuse_flags(a, {"--size"}, ignored);
  if (a.low.empty()) return;
  refuse_if(a.study != "views", "--study " + a.study + " makes its own low polys, but LOW '" +
                                    a.low + "' is given: leave LOW out.");
  refuse_flags(a, {"--faces"},
               "is the size of a low poly that Kiln makes, but LOW '" + a.low +
                   "' is given: leave --faces or LOW out.");
}

}  // namespace

int run_study(MeasureArguments a) {
  check_study(a);
  a.search_distance();  // rejects an invalid --max-distance before any work
  a.views = a.views.value_or(12);
  a.size = a.size.value_or(1024);
  a.faces = a.faces.value_or(2000);
  a.pixels = a.pixels.value_or(512);
  LabRun run(a);
  const fs::path folder = a.out;

  const Device device = Device::open(a.device);
  if (!run.console.progress(0, "reading " + a.high)) return kExitCancelled;
  HighPolyInput high_input =
      load_high(a.high, a.heights, run.warnings, load_options(a.bake, MeshSide::high));
  shade(a.bake.frame.shading, high_input, run.warnings);
  const Mesh high = std::move(high_input.mesh);
  std::optional<Mesh> low;
  if (!a.low.empty()) {
    low = load_low(a.low, ", or leave LOW out", run.warnings, load_options(a.bake, MeshSide::low));
  }
  run.record_stage("load");

  constexpr double kProgressAtSave = 0.97;
  const Progress progress = run.partial_progress(0.02, kProgressAtSave);
  const std::optional<Study> study =
      measure_study(device, high, low ? &*low : nullptr, a, progress, run);
  if (!study) return kExitCancelled;
  run.record_stage("study");

  if (!run.console.progress(kProgressAtSave, "writing")) return kExitCancelled;
  const Plot plot = {"study_" + a.study,
                     (a.study == "faces"  ? make_faces_plot
                      : a.study == "size" ? make_size_plot
                                          : make_views_plot)(*study, a, high.name)};
  run.outputs = {(folder / (plot.name + ".csv")).string()};
  save_text(run.outputs[0], csv(study->rows));
  if (!save_plots(folder, {plot}, run.outputs, run.warnings)) return kExitCancelled;
  run.record_stage("save");

  // The report has the effective value of each option, or null if the study varies the option or does not use it.
  const bool views = a.study == "views";
  run.report.update(fields(
      "device inputs options",
      {describe(device.info()),
       fields("high low", {describe(high, a.high), low ? describe(*low, a.low) : Json()}),
       fields(
           "study max_distance views view_size size faces height extent",
           {a.study, a.max_distance, views ? Json() : Json(*a.views),
            a.view_size ? Json(*a.view_size) : Json("auto"),
            a.study == "size" ? Json() : Json(*a.size),
            views && a.low.empty() ? Json(*a.faces) : Json(),
            is_height_field(a.high) ? Json(a.heights.height) : Json(), extent_json(a.heights)})}));
  add_report(*study, a, run);
  return run.finish();
}

}  // namespace kiln::cli

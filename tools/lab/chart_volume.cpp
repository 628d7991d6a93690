// Charts the speed and the accuracy of normal maps of volumes, which are computed directly from the voxels, or baked
// from the full contour.
#include <algorithm>
#include <utility>

#include "job/check_result.h"
#include "job/files.h"
#include "kiln/contour.h"
#include "kiln/gradient.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "kiln/volume.h"
#include "lab/chart.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kMaxMapSize = 8192;

/// A method of making the map of a volume's surface.
struct VolumeMapMethod {
  /// Name, label and family as in Mark; the name excludes the map size
  std::string name, label, family;
  /// Flags of `kiln bake` for a bake from the full contour; nullopt if the method does not bake
  std::optional<std::string> flags;
  bool at_all_sizes;  ///< True if the method is also charted at half and at twice the size
};
/// True for the low poly's own normals, without a map.
bool is_without_map(const VolumeMapMethod& method) { return method.name == "none"; }
/// True for the map that extract() makes.
bool is_made_by_extract(const VolumeMapMethod& method) { return method.name == "direct"; }

/// Returns all methods that are compared.
std::vector<VolumeMapMethod> volume_map_methods() {
  return {{"none", "no map", "none", std::nullopt, false},
          {"direct", "direct", "direct", std::nullopt, true},
          {"ray", "rays", "rays", "", true},
          {"ray_2x2", "rays, 2×2 samples", "rays", "--samples 2", false},
          {"views_12", "12 views", "views", "--match views --views 12", false},
          {"closest", "nearest points", "closest", "--match closest", true}};
}

/// Returns the two measures: the mean angle between the map's texels and the volume's gradient, which is read along the
/// shading normal, and the mean angle between rendered normals of the low poly and of the full contour in held-out
/// views.
const std::vector<Measure>& measures() {
  static const std::vector<Measure> all_measures = {
      {"gradient_error", "gradient_error.mean_angle_degrees",
       "Error of the map: angle to the volume's gradient", "Mean angle, degrees"},
      {"normal_error", "normal_error.mean_angle_degrees",
       "Error of the picture: angle between rendered normals and the full contour's",
       "Mean angle, degrees"}};
  return all_measures;
}

/// The data of one map size. All methods share the low poly and its UVs.
struct SizeData {
  std::uint32_t size = 0;
  ExtractResult low_poly;
  std::optional<GradientReference> along_normals, along_faces;
  std::optional<ExtractReport> timed;  ///< Report of the extraction that the current run has timed
  double seconds = 0;                  ///< Seconds of that extraction
};

double sum_contour_seconds(const ContourReport& r) {
  return r.seconds_scan + r.seconds_outer + r.seconds_hermite + r.seconds_vertices +
         r.seconds_quads;
}

Json gradient_error_json(const GradientError& e) {
  return fields(
      "texels empty_texels mean_angle_degrees rms_angle_degrees median_angle_degrees "
      "p95_angle_degrees p99_angle_degrees max_angle_degrees",
      {e.texels, e.empty, e.mean_degrees, e.rms_degrees, e.median_degrees, e.p95_degrees,
       e.p99_degrees, e.max_degrees});
}

// Styles differ in shape and lightness as well, since colours (by Okabe and Ito, distinguishable with colour blindness)
// may be printed in grey.
constexpr MarkStyle kStyles[] = {{"none", "no map", "+", "#777777"},
                                 {"direct", "direct", "s", "#d55e00"},
                                 {"rays", "contour baked by rays", "^", "#222222"},
                                 {"views", "by depth views", "o", "#0072b2"},
                                 {"closest", "by nearest points", "v", "#cc79a7"}};

class VolumesChart : public ChartKind {
 public:
  explicit VolumesChart(const ChartArguments& a)
      : ChartKind(a, "volume", "volumes"),
        methods_(volume_map_methods()),
        extract_(extract_options(a.surface)) {
    extract_.space = NormalMapSpace::object;
    extract_.flip_y = false;
    extract_.raw = false;
    if (!a.settings.empty()) {
      std::erase_if(methods_,
                    [&](const VolumeMapMethod& method) { return !a.selects(method.name); });
    }
    options = describe(a.surface);
    options["chart_border"] = extract_.border_texels;
    options["settings"] = Json::array();
    for (const VolumeMapMethod& method : methods_) options["settings"].push_back(method.name);
    title = "Normal maps from volumes: straight from the voxels, or the full contour baked";
    seconds_title = "Seconds from the volume in memory to low poly and map";
    styles = kStyles;
    explanation =
        "Seconds: from the volume in memory to low poly and object-space map there. Errors are "
        "angles: between the map's texels and the volume's gradient, along the shading normal and "
        "along the triangle's, and between rendered normals and the full contour's. Missed: "
        "samples of the bake that found no point; empty: texels without a normal. *: no other "
        "setting is both faster and more accurate.";
  }

  void read(std::size_t i) override { volume_ = read_volume(inputs[i], a_.surface, warnings); }

  std::optional<ChartGroup> measure(const Device& device, std::size_t i,
                                    const Progress& progress) override {
    device_ = &device;
    steps_ = Steps(progress);
    sizes_.clear();
    if (!steps_.start("contouring in full")) return std::nullopt;
    high_ = contour(device, volume_, extract_.contour);
    for (const std::uint32_t size : {*a_.size / 2, *a_.size, 2 * *a_.size}) {
      if (!add_size(size)) return std::nullopt;
    }
    make_marks();
    ChartGroup group;
    group.report = fields("volume full_contour_triangles",
                          {describe(volume_, inputs[i]), high_.triangles.size()});
    if (!measure_errors_of_marks(group.report)) return std::nullopt;
    const auto run = [&](std::size_t k, const std::string& note) { return time_mark(k, note); };
    if (!time_in_turns(marks_, a_.repeat, run)) return std::nullopt;
    group.report.update(finish_marks(marks_, "total", measures()));
    group.title = volume_.name + ", full contour of " +
                  count_text(group.report.at("full_contour_triangles")) + " faces, to " +
                  count_text(group.report.at("light.faces"));
    group.tables = {
        {"",
         {{"size", "size", 0},
          {"texels a cell", "texels_per_cell", 2},
          {"texels", "covered_texels", 0},
          {"surface out of reach", "no_surface_texels", 0},
          {"on the volume's border", "border_texels", 0},
          {"where the field is flat", "flat_texels", 0}},
         group.report.at("sizes")},
        {"",
         {{"setting", "name"},
          {"seconds", "seconds.total", 3},
          {"contour", "seconds.contour", 3},
          {"low poly", "seconds.light", 3},
          {"build", "seconds.build", 3},
          {"map", "seconds.map", 3},
          {"missed", "texels.missed", 0},
          {"empty", "gradient_error.empty_texels", 0},
          {"gradient °", "gradient_error.mean_angle_degrees", 3, 1, "on_front.gradient_error"},
          {"rms", "gradient_error.rms_angle_degrees", 2},
          {"95%", "gradient_error.p95_angle_degrees", 2},
          {"along faces °", "gradient_error_along_face.mean_angle_degrees", 3},
          {"picture °", "normal_error.mean_angle_degrees", 3, 1, "on_front.normal_error"},
          {"rms", "normal_error.rms_angle_degrees", 2},
          {"95%", "normal_error.p95_angle_degrees", 2}},
         group.report.at("settings"),
         ".csv"}};
    for (const Measure& measure : measures()) {
      group.panels.push_back(chart_panel(marks_, measure));
    }
    return group;
  }

 private:
  /// The method and the map size that a mark of the plot stands for.
  struct Task {
    const VolumeMapMethod* method;
    SizeData* size_data;
  };

  ExtractOptions make_extract_options(std::uint32_t size) const {
    ExtractOptions sized_options = extract_;
    sized_options.size = size;
    return sized_options;
  }

  BakeOptions bake_options(const VolumeMapMethod& method, std::uint32_t size,
                           Progress progress) const {
    BakeOptions bake = parse_bake_job(*method.flags).bake;
    bake.width = bake.height = size;
    bake.encoding.space = NormalMapSpace::object;
    bake.match.max_distance = a_.search_distance();
    // The padding is at most as wide as the charts' border, so that charts do not overwrite each other.
    bake.encoding.gutter = static_cast<std::int32_t>(extract_.border_texels);
    bake.progress = std::move(progress);
    return bake;
  }

  bool add_size(std::uint32_t size) {
    const bool is_selected = std::any_of(
        methods_.begin(), methods_.end(),
        [&](const VolumeMapMethod& method) { return method.at_all_sizes || size == *a_.size; });
    if (!is_selected || size < 16 || size > kMaxMapSize) return true;
    if (!steps_.start("extracting for " + std::to_string(size) + "²")) return false;
    try {
      sizes_.push_back({size, extract(*device_, volume_, make_extract_options(size)), {}, {}, {}});
    } catch (const Error& error) {
      // A smaller map may have too few texels to hold all charts.
      const bool is_map_too_small =
          error.code() == ErrorCode::usage || error.code() == ErrorCode::input;
      if (size >= *a_.size || !is_map_too_small) throw;
      warnings.push_back({"size-skipped", error.what(), 1});
    }
    return true;
  }

  /// Makes the marks and their tasks, ordered by method, then by map size.
  void make_marks() {
    marks_.clear();
    tasks_.clear();
    for (const VolumeMapMethod& method : methods_) {
      for (SizeData& size_data : sizes_) {
        if (!method.at_all_sizes && size_data.size != *a_.size) continue;
        const std::string size = std::to_string(size_data.size);
        const bool without_map = is_without_map(method);
        Mark& mark = marks_.emplace_back();
        mark.name = without_map ? method.name : method.name + "_" + size;
        mark.label = method.at_all_sizes ? method.label + ", " + size + "²" : method.label;
        mark.family = method.family;
        mark.figures = fields(
            "name label family size",
            {mark.name, mark.label, mark.family, without_map ? Json() : Json(size_data.size)});
        tasks_.push_back({&method, &size_data});
      }
    }
    steps_.count = static_cast<double>(tasks_.size() * (2 + a_.repeat));
  }

  /// Measures the errors of all marks. \returns false if cancelled
  bool measure_errors_of_marks(Json& report) {
    const Source source(*device_, high_);
    const Length reach = a_.search_distance();
    const double diagonal = source.stats().diagonal;
    const double distance = reach.relative ? reach.value * diagonal : reach.value;
    Json sizes = Json::array();
    for (SizeData& size_data : sizes_) {
      if (!steps_.start("reading the gradient")) return false;
      const ExtractReport& low = size_data.low_poly.report;
      for (const GradientLine line : {GradientLine::shading, GradientLine::face}) {
        (line == GradientLine::face ? size_data.along_faces : size_data.along_normals)
            .emplace(volume_, extract_.contour, size_data.low_poly.mesh,
                     GradientOptions{.size = size_data.size, .reach = distance, .line = line});
      }
      const GradientReference& reference = *size_data.along_normals;
      sizes.push_back(
          fields("size texels_per_cell covered_texels no_surface_texels border_texels flat_texels",
                 {size_data.size, low.texels_per_cell, reference.covered(), reference.no_surface(),
                  reference.cut(), reference.no_gradient()}));
      if (size_data.size != *a_.size) continue;
      add_warnings(low.warnings, warnings);
      report["light"] = fields("faces quads triangles error_cells parts",
                               {low.faces, low.quads, low.triangles, low.error, low.parts});
    }
    report.update(fields("diagonal max_distance_world sizes", {diagonal, distance, sizes}));
    if (!steps_.start("drawing the full contour")) return false;
    const NormalReference pictures(Scene(*device_, high_), high_, default_held_out_angles(),
                                   *a_.pixels);
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      if (!measure_mark(i, source, pictures)) return false;
      steps_.done += 2;
    }
    return true;
  }

  bool measure_mark(std::size_t i, const Source& source, const NormalReference& pictures) {
    const VolumeMapMethod& method = *tasks_[i].method;
    const SizeData& size_data = *tasks_[i].size_data;
    const Mesh& low = size_data.low_poly.mesh;
    Json& figures = marks_[i].figures;
    if (!steps_.start("measuring " + marks_[i].label)) return false;
    Image map;
    if (method.flags) {
      BakeResult result =
          bake(source, low, bake_options(method, size_data.size, steps_.step_progress()));
      if (result.cancelled) return false;
      const BakeReport& report = result.report;
      check_result(report, high_, low);
      map = std::move(result.maps[0].image);
      figures.update(
          fields("texels warnings", {describe_texels(report), describe(report.warnings)}));
      add_warnings(report.warnings, settings_warnings);
    } else if (is_made_by_extract(method)) {
      map = size_data.low_poly.normal_map;
    }
    const Scene scene(*device_, low,
                      {is_without_map(method) ? nullptr : &map, NormalMapSpace::object, false});
    const auto compare = [&](const GradientReference& reference) {
      return is_without_map(method) ? reference.compare_without_map() : reference.compare(map);
    };
    const GradientError error = compare(*size_data.along_normals);
    if (error.texels == 0) {
      throw Error(ErrorCode::input, "None of the " +
                                        std::to_string(size_data.along_normals->covered()) +
                                        " texels of the low poly of volume '" + volume_.name +
                                        "' has the surface within reach: use a larger "
                                        "--max-distance or more faces.");
    }
    figures.update(
        fields("gradient_error gradient_error_along_face normal_error",
               {gradient_error_json(error), gradient_error_json(compare(*size_data.along_faces)),
                describe(pictures.compare(scene))}));
    return true;
  }

  /// Measures the seconds of a mark, from the volume in memory to low poly and map. The stages are: the full contour;
  /// simplification, and the unwrap if there is a map; for bakes the upload of the high poly and the bake, otherwise
  /// the splatting of the map. A stage that several marks share is timed once per run, and its time counts for each of
  /// them.
  /// \returns null if cancelled
  Json time_mark(std::size_t i, const std::string& note) {
    const auto& [method, size_data] = tasks_[i];
    const std::uint32_t size = size_data->size;
    if (!steps_.start("timing " + marks_[i].label + note)) return {};
    Stopwatch watch;
    if (i == 0) {
      high_ = contour(*device_, volume_, extract_.contour);
      contour_seconds_ = watch.lap();
      for (SizeData& other : sizes_) other.timed.reset();
    }
    if (!size_data->timed) {
      watch.lap();
      size_data->timed = extract(*device_, volume_, make_extract_options(size)).report;
      size_data->seconds = watch.lap();
    }
    steps_.done += 1;
    const ExtractReport& low_poly = *size_data->timed;
    const auto seconds = [](double total, double contour, double low, double build, double map) {
      return fields("total contour light build map", {total, contour, low, build, map});
    };
    const double contour = sum_contour_seconds(low_poly.contour);
    const double simplify = low_poly.seconds_simplify, low = simplify + low_poly.seconds_atlas;
    if (is_without_map(*method)) return seconds(contour + simplify, contour, simplify, 0, 0);
    if (is_made_by_extract(*method))
      return seconds(size_data->seconds, contour, low, 0, low_poly.seconds_map);
    watch.lap();
    const Source source(*device_, high_);
    const double upload = watch.lap();
    const BakeResult result = bake(source, size_data->low_poly.mesh,
                                   bake_options(*method, size, steps_.step_progress(0)));
    if (result.cancelled) return {};
    const double remaining = watch.lap(), build = result.report.seconds_build;
    return seconds(contour_seconds_ + low + upload + remaining, contour_seconds_, low,
                   upload + build, remaining - build);
  }

  std::vector<VolumeMapMethod> methods_;
  ExtractOptions extract_;  ///< Options of extract(); make_extract_options() sets the map size
  Volume volume_;
  // State of the volume that is being measured
  const Device* device_ = nullptr;
  Mesh high_;
  std::vector<SizeData> sizes_;
  std::vector<Mark> marks_;
  std::vector<Task> tasks_;  ///< One task for each element of marks_
  Steps steps_{nullptr};
  double contour_seconds_ = 0;  ///< Seconds in which the current run made the full contour
};

}  // namespace

std::vector<std::string> volume_setting_names() {
  std::vector<std::string> names;
  for (const VolumeMapMethod& method : volume_map_methods()) names.push_back(method.name);
  return names;
}

std::unique_ptr<ChartKind> chart_of_volumes(const ChartArguments& arguments) {
  return std::make_unique<VolumesChart>(arguments);
}

}  // namespace kiln::cli

// Speed against accuracy of maps from volumes: straight from the voxels, or the full contour baked.
#include <algorithm>
#include <utility>

#include "arguments/files.h"
#include "arguments/parse.h"
#include "kiln/contour.h"
#include "kiln/gradient.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "kiln/volume.h"
#include "lab/chart.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kMatchedViews = 12;  // matched from
constexpr std::uint32_t kLargest = 8192;

/// Ways to make a map of a volume's surface.
struct VolumeWay {
  std::string name, label, family;  ///< As Mark; the name without the size of the map
  std::optional<BakeOptions> bake;  ///< The full contour baked so; else no bake
  bool every_size = false;          ///< At half and twice the size, too
};
constexpr const char* kNoMap = "none";        ///< The low poly's own normals
constexpr const char* kDirectMap = "direct";  ///< extract()'s map

bool is_direct(const VolumeWay& way) { return way.name == kDirectMap; }
bool is_plain(const VolumeWay& way) { return way.name == kNoMap; }

/// Settings that are compared.
std::vector<VolumeWay> volume_ways() {
  BakeOptions rays, more_rays, views, closest;
  more_rays.samples = 2;
  views.match.method = MatchMethod::views;
  views.match.views.count = kMatchedViews;
  closest.match.method = MatchMethod::closest;
  return {{kNoMap, "no map", "none", std::nullopt, false},
          {kDirectMap, "direct", "direct", std::nullopt, true},
          {"ray", "rays", "rays", rays, true},
          {"ray_2x2", "rays, 2×2 samples", "rays", more_rays, false},
          {"views_12", "12 views", "views", views, false},
          {"closest", "nearest points", "closest", closest, true}};
}

// Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr std::array<MarkStyle, 5> kStyles = {{{"none", "no map", "+", "#777777"},
                                               {"direct", "direct", "s", "#d55e00"},
                                               {"rays", "contour baked by rays", "^", "#222222"},
                                               {"views", "by depth views", "o", "#0072b2"},
                                               {"closest", "by nearest points", "v", "#cc79a7"}}};

/// Mean angles: of the map's texels to the field's gradient on the shading normal's line; of rendered normals to
/// the full contour's, over views that nothing is matched from.
enum Measured : std::size_t { kGradient, kPicture };
const std::vector<Measure>& measures() {
  static const std::vector<Measure> all = {
      {"gradient_error", "Error of the map: angle to the volume's gradient", "Mean angle, degrees"},
      {"normal_error", "Error of the picture: rendered normals to the full contour's",
       "Mean angle, degrees"}};
  return all;
}

struct VolumeOptions {
  std::vector<VolumeWay> ways = volume_ways();
  ExtractOptions extract;  ///< Surface, faces, charts' border; size and space are the chart's
  std::uint32_t size, repeat;
  Length max_distance;
  std::uint32_t pixels;  ///< A side of the pictures whose normals are measured
};

/// Times of one run, from the volume in memory to low poly and map. Steps that several ways share count for each:
/// the full contour, once; the low poly and its UVs.
struct VolumeSeconds {
  double contour = 0;   ///< The finest contour; for a bake as a mesh, too
  double low_poly = 0;  ///< Simplifying, and UVs where there is a map
  double build = 0;     ///< Putting the high poly on the device, structures
  double map = 0;       ///< Splatting; the rest of the bake
  double total = 0;     ///< Wall clock of all that
};

struct VolumeRow : Mark {
  std::uint32_t size = 0;             ///< Texels a side; 0: no map
  std::optional<BakeReport> report;   ///< Of a bake, which is not timed
  GradientError gradient;             ///< GradientLine::shading
  GradientError gradient_along_face;  ///< GradientLine::face
  NormalError picture;
  std::vector<VolumeSeconds> all_seconds;  ///< As `runs`
  VolumeSeconds of_median;
};

/// The low poly's atlas for one size of map, and what could be compared there.
struct VolumeSize {
  std::uint32_t size = 0;
  std::uint64_t covered = 0;                               ///< Texels of the low poly
  std::uint64_t no_surface = 0, cut = 0, no_gradient = 0;  ///< See GradientReference
  double texels_per_cell = 0;
};

struct VolumeChart {
  std::string name;
  std::array<std::uint32_t, 3> voxels{};
  ExtractReport low_poly;             ///< At the given size
  std::uint64_t dense_triangles = 0;  ///< Of the full contour
  double diagonal = 0,
         max_distance = 0;  ///< World units; max_distance: also how far the surface is looked for
  std::vector<VolumeSize> sizes;
  std::vector<VolumeRow> rows;
  std::vector<Warning> warnings;
};

/// One size of map: the low poly with its UVs is made once for all ways.
struct Sized {
  VolumeSize size;
  ExtractResult low_poly;
};

ExtractOptions extract_options(const VolumeOptions& options, std::uint32_t size) {
  ExtractOptions extract = options.extract;
  extract.size = size;
  extract.space = NormalMapSpace::object;
  extract.flip_y = false;
  extract.raw = false;
  return extract;
}

BakeOptions bake_options(const VolumeOptions& options, const VolumeWay& way, std::uint32_t size,
                         const Progress& progress) {
  BakeOptions bake = *way.bake;
  bake.width = bake.height = size;
  bake.encoding.space = NormalMapSpace::object;
  bake.match.max_distance = options.max_distance;
  // Charts have just their border around them, and none may write into another's.
  bake.encoding.gutter = static_cast<std::int32_t>(options.extract.border_texels);
  bake.progress = progress;
  return bake;
}

double contour_seconds(const ContourReport& r) {
  return r.seconds_scan + r.seconds_outer + r.seconds_hermite + r.seconds_vertices +
         r.seconds_quads;
}

/// Makes one chart.
class Runner {
 public:
  Runner(const Device& device, const Volume& volume, const VolumeOptions& options,
         const Progress& progress)
      : device_(device), volume_(volume), options_(options), progress_(progress) {}

  std::optional<VolumeChart> run() {
    if (!show("contouring in full")) return std::nullopt;
    dense_ = contour(device_, volume_, options_.extract.contour);
    chart_.name = volume_.name;
    chart_.voxels = volume_.size;
    chart_.dense_triangles = dense_.triangles.size();
    for (const std::uint32_t size : {options_.size / 2, options_.size, 2 * options_.size}) {
      if (!add_size(size)) return std::nullopt;
    }
    plan();
    if (!measure() || !time()) return std::nullopt;
    for (VolumeRow& row : chart_.rows) {
      const std::size_t middle = median_index(row.runs);
      row.seconds = row.runs[middle];
      row.of_median = row.all_seconds[middle];
      row.errors = {row.gradient.mean_degrees, row.picture.mean_degrees};
    }
    mark_fronts(chart_.rows);
    return std::move(chart_);
  }

 private:
  /// Parts of a row.
  struct Task {
    const VolumeWay* way;
    const Sized* sized;
  };

  bool show(const std::string& stage) {
    stage_ = stage;
    return progress_(done_ / steps_, stage_);
  }

  bool add_size(std::uint32_t size) {
    const bool wanted =
        std::any_of(options_.ways.begin(), options_.ways.end(),
                    [&](const VolumeWay& way) { return way.every_size || size == options_.size; });
    if (!wanted || size < 16 || size > kLargest) return true;
    if (!show("extracting for " + std::to_string(size) + "²")) return false;
    Sized sized;
    sized.size.size = size;
    try {
      sized.low_poly = extract(device_, volume_, extract_options(options_, size));
    } catch (const Error& error) {
      // Fewer texels may have no room for so many charts.
      const bool no_room = error.code() == ErrorCode::usage || error.code() == ErrorCode::input;
      if (size >= options_.size || !no_room) throw;
      chart_.warnings.push_back({"size-skipped", error.what(), 1});
      return true;
    }
    const ExtractReport& report = sized.low_poly.report;
    sized.size.texels_per_cell = report.texels_per_cell;
    if (size == options_.size) {
      chart_.low_poly = report;
      chart_.warnings.insert(chart_.warnings.end(), report.warnings.begin(), report.warnings.end());
    }
    sizes_.push_back(std::move(sized));
    return true;
  }

  /// Rows by way, then by size.
  void plan() {
    for (const VolumeWay& way : options_.ways) {
      for (const Sized& sized : sizes_) {
        const std::uint32_t size = sized.size.size;
        if (!way.every_size && size != options_.size) continue;
        VolumeRow row;
        row.family = way.family;
        row.name = way.name;
        row.label = way.label;
        if (!is_plain(way)) {
          row.size = size;
          row.name += "_" + std::to_string(size);
          if (way.every_size) row.label += ", " + std::to_string(size) + "²";
        }
        chart_.rows.push_back(std::move(row));
        tasks_.push_back({&way, &sized});
      }
    }
    steps_ = static_cast<double>(tasks_.size() * (2 + options_.repeat));
  }

  bool measure() {
    const Source source(device_, dense_);
    chart_.diagonal = source.stats().diagonal;
    chart_.max_distance = options_.max_distance.relative
                              ? options_.max_distance.value * chart_.diagonal
                              : options_.max_distance.value;
    if (!show("drawing the full contour")) return false;
    const NormalReference pictures(Scene(device_, dense_), dense_, usual_held_out_angles(),
                                   options_.pixels);
    for (Sized& sized : sizes_) {
      if (!measure(source, pictures, sized)) return false;
      chart_.sizes.push_back(sized.size);
    }
    return true;
  }

  bool measure(const Source& source, const NormalReference& pictures, Sized& sized) {
    std::vector<std::pair<VolumeRow*, Image>> baked;
    const Mesh& low = sized.low_poly.mesh;
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (tasks_[i].sized != &sized) continue;
      VolumeRow& row = chart_.rows[i];
      const VolumeWay& way = *tasks_[i].way;
      if (!show("measuring " + row.label)) return false;
      Image map;
      if (way.bake) {
        BakeResult result =
            bake(source, low, bake_options(options_, way, sized.size.size, quiet()));
        if (result.cancelled) return false;
        check_result(result.report, dense_, low);
        map = std::move(result.maps[0].image);
        row.report = std::move(result.report);
      } else if (is_direct(way)) {
        map = sized.low_poly.normal_map;
      }
      const Scene scene(device_, low,
                        {is_plain(way) ? nullptr : &map, NormalMapSpace::object, false});
      row.picture = pictures.compare(scene);
      baked.emplace_back(&row, std::move(map));
      done_ += 1;
    }
    for (const GradientLine line : {GradientLine::shading, GradientLine::face}) {
      if (!show("reading the gradient")) return false;
      const GradientReference reference(
          volume_, options_.extract.contour, low,
          {.size = sized.size.size, .reach = chart_.max_distance, .line = line});
      for (const auto& [row, map] : baked) {
        (line == GradientLine::face ? row->gradient_along_face : row->gradient) =
            row->size == 0 ? reference.compare_without_map() : reference.compare(map);
      }
      done_ += 0.5 * static_cast<double>(baked.size());
      if (line == GradientLine::face) continue;
      sized.size.covered = reference.covered();
      sized.size.no_surface = reference.no_surface();
      sized.size.cut = reference.cut();
      sized.size.no_gradient = reference.no_gradient();
      if (!baked.empty() && baked[0].first->gradient.texels == 0) {
        throw Error(ErrorCode::input,
                    "None of the " + std::to_string(reference.covered()) +
                        " texels of the low poly of volume '" + volume_.name +
                        "' has the surface within reach: use a larger --max-distance or more "
                        "faces.");
      }
    }
    return true;
  }

  Progress quiet() {
    return [this](double, std::string_view) { return progress_(done_ / steps_, stage_); };
  }

  /// In turns, so that what else the machine does falls on all alike.
  bool time() {
    for (std::uint32_t run = 0; run < options_.repeat; ++run) {
      const std::string which =
          ", run " + std::to_string(run + 1) + " of " + std::to_string(options_.repeat);
      if (!show("timing the contour" + which)) return false;
      Stopwatch watch;
      dense_ = contour(device_, volume_, options_.extract.contour);
      const double contour_time = watch.lap();
      for (const Sized& sized : sizes_) {
        if (!show("timing the low poly" + which)) return false;
        watch.lap();
        const ExtractReport low_poly =
            extract(device_, volume_, extract_options(options_, sized.size.size)).report;
        const double wall = watch.lap();
        for (std::size_t i = 0; i < tasks_.size(); ++i) {
          if (tasks_[i].sized != &sized) continue;
          VolumeRow& row = chart_.rows[i];
          const VolumeWay& way = *tasks_[i].way;
          VolumeSeconds seconds;
          seconds.contour = contour_seconds(low_poly.contour);
          seconds.low_poly =
              low_poly.seconds_simplify + (is_plain(way) ? 0 : low_poly.seconds_atlas);
          if (is_plain(way)) {
            seconds.total = seconds.contour + seconds.low_poly;
          } else if (is_direct(way)) {
            seconds.map = low_poly.seconds_map;
            seconds.total = wall;
          } else {
            if (!show("timing " + row.label + which)) return false;
            seconds.contour = contour_time;
            watch.lap();
            const Source source(device_, dense_);
            seconds.build = watch.lap();
            const BakeResult result = bake(source, sized.low_poly.mesh,
                                           bake_options(options_, way, sized.size.size, quiet()));
            if (result.cancelled) return false;
            const double rest = watch.lap();
            seconds.build += result.report.seconds_build;
            seconds.map = rest - result.report.seconds_build;
            seconds.total = seconds.contour + seconds.low_poly + seconds.build + seconds.map;
          }
          row.runs.push_back(seconds.total);
          row.all_seconds.push_back(seconds);
          done_ += 1;
        }
      }
    }
    return true;
  }

  const Device& device_;
  const Volume& volume_;
  const VolumeOptions& options_;
  const Progress& progress_;
  Mesh dense_;
  std::vector<Sized> sizes_;
  std::vector<Task> tasks_;  ///< As rows
  VolumeChart chart_;
  std::string stage_;
  double done_ = 0, steps_ = 1;
};

/// Empty where there is nothing to tell.
std::string percent_text(std::uint64_t count, std::uint64_t all) {
  if (all == 0) return "";
  return fixed_text(100 * static_cast<double>(count) / static_cast<double>(all), 2) + "%";
}

Json json_of(const GradientError& e) {
  return fields(
      "texels empty_texels mean_angle_degrees rms_angle_degrees median_angle_degrees "
      "p95_angle_degrees p99_angle_degrees max_angle_degrees",
      {e.texels, e.empty, e.mean_degrees, e.rms_degrees, e.median_degrees, e.p95_degrees,
       e.p99_degrees, e.max_degrees});
}

Json json_of(const VolumeSeconds& s) {
  return fields("total contour light build map", {s.total, s.contour, s.low_poly, s.build, s.map});
}

Json json_of(const VolumeRow& row) {
  Json runs = Json::array();
  for (const VolumeSeconds& run : row.all_seconds) runs.push_back(json_of(run));
  Json json = fields(
      "name label family size seconds runs gradient_error gradient_error_along_face normal_error "
      "on_front",
      {row.name, row.label, row.family, row.size == 0 ? Json() : Json(row.size),
       json_of(row.of_median), runs, json_of(row.gradient), json_of(row.gradient_along_face),
       describe(row.picture), describe_front(row, measures())});
  if (row.report) {
    json["texels"] = describe_texels(*row.report);
    json["warnings"] = describe(row.report->warnings);
  }
  return json;
}

Json json_of(const VolumeChart& chart) {
  Json sizes = Json::array(), rows = Json::array(), fronts;
  for (const VolumeSize& s : chart.sizes) {
    sizes.push_back(
        fields("size texels_per_cell covered_texels no_surface_texels border_texels flat_texels",
               {s.size, s.texels_per_cell, s.covered, s.no_surface, s.cut, s.no_gradient}));
  }
  for (const VolumeRow& row : chart.rows) rows.push_back(json_of(row));
  for (std::size_t m = 0; m < measures().size(); ++m) {
    fronts[measures()[m].name] = front_names(marks_of(chart.rows), m);
  }
  const ExtractReport& low_poly = chart.low_poly;
  return fields(
      "full_contour_triangles diagonal max_distance_world light sizes settings front",
      {chart.dense_triangles, chart.diagonal, chart.max_distance,
       fields("faces quads triangles error_cells parts",
              {low_poly.faces, low_poly.quads, low_poly.triangles, low_poly.error, low_poly.parts}),
       sizes, rows, fronts});
}

class VolumesChart : public ChartKind {
 public:
  explicit VolumesChart(const ChartArguments& a) : arguments_(a) {
    inputs_key = "volumes";
    inputs = a.meshes;
    options_.extract = extract_options(a.surface);
    options_.size = a.size, options_.repeat = a.repeat, options_.pixels = a.pixels;
    options_.max_distance = parse_length_above_0("--max-distance", a.max_distance);
    if (a.settings.empty()) return;
    std::erase_if(options_.ways, [&](const VolumeWay& way) { return !a.names(way.name); });
  }

  bool look(const Progress&) override {
    for (const std::string& path : inputs) {
      std::vector<Warning> none;
      if (!is_readable_file(path))
        read_volume(path, arguments_.surface, none);  // says what is wrong
    }
    return true;
  }

  void read(std::size_t i) override {
    volume_ = read_volume(inputs[i], arguments_.surface, warnings);
  }

  std::optional<Json> measure(const Device& device, std::size_t i,
                              const Progress& progress) override {
    std::optional<VolumeChart> chart = Runner(device, volume_, options_, progress).run();
    if (!chart) return std::nullopt;
    warnings.insert(warnings.end(), chart->warnings.begin(), chart->warnings.end());
    for (const VolumeRow& row : chart->rows) {
      if (!row.report) continue;
      const std::vector<Warning>& more = row.report->warnings;
      of_settings.insert(of_settings.end(), more.begin(), more.end());
    }
    Json json = {{"volume", describe(volume_, inputs[i])}};
    json.update(json_of(*chart));
    charts_.push_back(std::move(*chart));
    return json;
  }

  std::string data() const override {
    Table table(
        "volume|setting|family|seconds|gradient_error|normal_error|gradient_front|normal_front|"
        "seconds_least|seconds_most|seconds_contour|seconds_light|seconds_build|seconds_map|size|"
        "gradient_texels|gradient_empty|gradient_rms|gradient_median|gradient_p95|gradient_p99|"
        "gradient_max|face_gradient_mean|face_gradient_rms|face_gradient_p95|normal_pixels|"
        "normal_rms|normal_p95|samples|missed");
    for (std::size_t i = 0; i < charts_.size(); ++i) {
      for (const VolumeRow& row : charts_[i].rows) {
        const VolumeSeconds& s = row.of_median;
        const GradientError &g = row.gradient, &f = row.gradient_along_face;
        const NormalError& p = row.picture;
        table.add({i + 1,
                   row.name,
                   row.family,
                   row.seconds,
                   row.errors[kGradient],
                   row.errors[kPicture],
                   bool{row.front[kGradient]},
                   bool{row.front[kPicture]},
                   row.least(),
                   row.most(),
                   s.contour,
                   s.low_poly,
                   s.build,
                   s.map,
                   row.size,
                   g.texels,
                   g.empty,
                   g.rms_degrees,
                   g.median_degrees,
                   g.p95_degrees,
                   g.p99_degrees,
                   g.max_degrees,
                   f.mean_degrees,
                   f.rms_degrees,
                   f.p95_degrees,
                   p.pixels,
                   p.rms_degrees,
                   p.p95_degrees,
                   row.report ? row.report->samples : 0,
                   row.report ? row.report->missed : 0});
      }
    }
    return table.csv();
  }

  std::string table(const DeviceInfo& device) const override {
    std::string text =
        "# Maps from volumes: speed against accuracy\n\n" + on_device(device) +
        ". Seconds: from the volume in memory to low poly and object-space map there, " +
        runs_text(options_.repeat) +
        "; the full contour counts once for each way, also where a high poly is made of it. "
        "Errors are angles in degrees, mean / root of the mean square / 95%: of the map's texels "
        "to the volume's gradient at a place of the surface. A line through the texel's point "
        "meets it: along the shading normal, and along the triangle's. And of rendered normals to "
        "the full contour's from " +
        std::to_string(kHeldOutViews) +
        " directions that nothing is matched from. Missed: samples of the bake that found "
        "nothing; empty: texels compared that the map leaves without a normal, where the low "
        "poly's own counts. ●: nothing else is both faster and closer.\n";
    for (const VolumeChart& chart : charts_) {
      text += formatted(
          "\n## %s, %u × %u × %u voxels: full contour of %s faces, low poly of %s "
          "(%s quads)\n\n",
          markdown_cell(chart.name).c_str(), chart.voxels[0], chart.voxels[1], chart.voxels[2],
          with_commas(chart.dense_triangles).c_str(), with_commas(chart.low_poly.faces).c_str(),
          with_commas(chart.low_poly.quads).c_str());
      for (const VolumeSize& s : chart.sizes) {
        const std::uint64_t compared = s.covered - s.no_surface - s.cut - s.no_gradient;
        text += formatted(
            "- %u²: %.2f texels a cell; of %s texels %s compared, %s without the "
            "surface within %g units, %s on the volume's border, %s where the field "
            "is flat\n",
            s.size, s.texels_per_cell, with_commas(s.covered).c_str(),
            with_commas(compared).c_str(), with_commas(s.no_surface).c_str(), chart.max_distance,
            with_commas(s.cut).c_str(), with_commas(s.no_gradient).c_str());
      }
      Table table(
          "way|>seconds|>contour|>low poly|>build|>map|>missed|>empty|>error to the gradient|^|"
          ">along the faces' normals|>picture's error|^");
      for (const VolumeRow& row : chart.rows) {
        const VolumeSeconds& s = row.of_median;
        const auto angles = [](const auto& e) {
          return formatted("%.3f / %.2f / %.2f", e.mean_degrees, e.rms_degrees, e.p95_degrees);
        };
        table.add({markdown_cell(row.label), fixed_text(s.total, 3), fixed_text(s.contour, 3),
                   fixed_text(s.low_poly, 3), row.report ? fixed_text(s.build, 3) : "",
                   row.size != 0 ? fixed_text(s.map, 3) : "",
                   row.report ? percent_text(row.report->missed, row.report->samples) : "",
                   row.size != 0 ? percent_text(row.gradient.empty, row.gradient.texels) : "",
                   angles(row.gradient), front_dot(row, kGradient), angles(row.gradient_along_face),
                   angles(row.picture), front_dot(row, kPicture)});
      }
      text += "\n" + table.markdown();
    }
    return text;
  }

  Json plot(const DeviceInfo& device) const override {
    Json data = fields(
        "kind title subtitle seconds_title styles groups",
        {"chart", "Normal maps from volumes: straight from the voxels, or the full contour baked",
         device.name + runs_note(options_.repeat),
         "Seconds from the volume in memory to low poly and map", Json::array(), Json::array()});
    add_styles(kStyles, marks_of(charts_.front().rows), data);
    for (const VolumeChart& chart : charts_) {
      Json panels = Json::array();
      for (const std::size_t m : {kGradient, kPicture}) {
        panels.push_back(chart_panel(marks_of(chart.rows), measures(), m));
      }
      data["groups"].push_back(
          fields("title note panels",
                 {chart.name + ", full contour of " + with_commas(chart.dense_triangles) +
                      " faces, to " + with_commas(chart.low_poly.faces),
                  "", panels}));
    }
    return data;
  }

  Json options() const override {
    Json json = describe(arguments_.surface), names = Json::array();
    for (const VolumeWay& way : options_.ways) names.push_back(way.name);
    json.update(fields("size chart_border max_distance repeat pixels settings",
                       {options_.size, options_.extract.border_texels, arguments_.max_distance,
                        options_.repeat, options_.pixels, names}));
    return json;
  }

  std::vector<std::string> lines() const override {
    std::vector<std::string> lines;
    for (const VolumeChart& chart : charts_) {
      lines.push_back(chart.name + ", " + with_commas(chart.dense_triangles) + " faces, to " +
                      with_commas(chart.low_poly.faces) +
                      " (* nothing else is both faster and closer):");
      for (const VolumeRow& row : chart.rows) {
        const GradientError& g = row.gradient;
        const NormalError& p = row.picture;
        lines.push_back(formatted(
            "%-14s %8.3f s; to the gradient mean %.3f degrees, rms %.2f, 95%% %.2f%s; picture "
            "mean %.3f, rms %.2f, 95%% %.2f%s",
            row.name.c_str(), row.seconds, g.mean_degrees, g.rms_degrees, g.p95_degrees,
            row.front[kGradient] ? " *" : "", p.mean_degrees, p.rms_degrees, p.p95_degrees,
            row.front[kPicture] ? " *" : ""));
      }
    }
    return lines;
  }

 private:
  const ChartArguments& arguments_;
  VolumeOptions options_;
  Volume volume_;
  std::vector<VolumeChart> charts_;
};

}  // namespace

std::vector<std::string> volume_setting_names() {
  std::vector<std::string> names;
  for (const VolumeWay& way : volume_ways()) names.push_back(way.name);
  return names;
}

std::unique_ptr<ChartKind> chart_of_volumes(const ChartArguments& arguments) {
  return std::make_unique<VolumesChart>(arguments);
}

}  // namespace kiln::cli

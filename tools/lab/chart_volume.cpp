#include "lab/chart_volume.h"

#include <algorithm>
#include <utility>

#include "lab/study.h"
#include "report/check_result.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kViews = 12;  // matched from
constexpr std::uint32_t kLargest = 8192;

BakeOptions by(MatchMethod method, std::uint32_t samples = 1) {
  BakeOptions bake;
  bake.method = method;
  bake.samples = samples;
  return bake;
}

BakeOptions by_views() {
  BakeOptions bake = by(MatchMethod::views);
  bake.views.count = kViews;
  return bake;
}

/// One size of map: the low poly with its UVs is made once for all ways.
struct Sized {
  VolumeSize size;
  ExtractResult light;
};

bool is_direct(const VolumeWay& way) { return way.name == kDirectMap; }
bool is_plain(const VolumeWay& way) { return way.name == kNoMap; }

ExtractOptions extract_options(const VolumeChartOptions& options, std::uint32_t size) {
  ExtractOptions extract = options.extract;
  extract.size = size;
  extract.space = NormalMapSpace::object;
  extract.flip_y = false;
  extract.raw = false;
  return extract;
}

BakeOptions bake_options(const VolumeChartOptions& options, const VolumeWay& way,
                         std::uint32_t size, const Progress& progress) {
  BakeOptions bake = *way.bake;
  bake.width = bake.height = size;
  bake.space = NormalMapSpace::object;
  bake.max_distance = options.max_distance;
  // Charts have just their border around them, and none may write into another's.
  bake.gutter = static_cast<std::int32_t>(options.extract.border_texels);
  bake.progress = progress;
  return bake;
}

double contour_seconds(const ContourReport& r) {
  return r.seconds_scan + r.seconds_outer + r.seconds_hermite + r.seconds_vertices +
         r.seconds_quads;
}

VolumeSeconds median(std::vector<VolumeSeconds> runs) {
  if (runs.empty()) return {};
  std::stable_sort(runs.begin(), runs.end(), [](const VolumeSeconds& a, const VolumeSeconds& b) {
    return a.total < b.total;
  });
  return runs[(runs.size() - 1) / 2];
}

void mark_fronts(std::vector<VolumeRow>& rows) {
  for (const VolumeMeasure measure : kVolumeMeasures) {
    std::vector<std::array<double, 2>> points;
    for (const VolumeRow& row : rows) points.push_back({row.seconds.total, row.error(measure)});
    const std::vector<bool> front = pareto_front(points);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].on_front[static_cast<std::size_t>(measure)] = front[i];
    }
  }
}

/// Makes one chart.
class Runner {
 public:
  Runner(const Device& device, const Volume& volume, const VolumeChartOptions& options,
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
    for (VolumeRow& row : chart_.rows) row.seconds = median(row.runs);
    mark_fronts(chart_.rows);
    return std::move(chart_);
  }

 private:
  /// What a row is made of.
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
      sized.light = extract(device_, volume_, extract_options(options_, size));
    } catch (const Error& error) {
      // Fewer texels may have no room for so many charts.
      const bool no_room = error.code() == ErrorCode::usage || error.code() == ErrorCode::input;
      if (size >= options_.size || !no_room) throw;
      chart_.warnings.push_back({"size-skipped", error.what(), 1});
      return true;
    }
    const ExtractReport& report = sized.light.report;
    sized.size.texels_per_cell = report.texels_per_cell;
    if (size == options_.size) {
      chart_.light = report;
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
    std::vector<ViewAngles> angles;
    for (const Vec3& toward :
         held_out_views(kHeldOutViews, spread_views(kViews), kLeastHeldOutAngle)) {
      angles.push_back(view_angles(toward));
    }
    if (!show("drawing the full contour")) return false;
    const NormalReference pictures(Scene(device_, dense_), dense_, angles, options_.pixels);
    for (Sized& sized : sizes_) {
      if (!measure(source, pictures, sized)) return false;
      chart_.sizes.push_back(sized.size);
    }
    return true;
  }

  bool measure(const Source& source, const NormalReference& pictures, Sized& sized) {
    std::vector<std::pair<VolumeRow*, Image>> baked;
    const Mesh& low = sized.light.mesh;
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
        map = sized.light.normal_map;
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
        const ExtractReport light =
            extract(device_, volume_, extract_options(options_, sized.size.size)).report;
        const double wall = watch.lap();
        for (std::size_t i = 0; i < tasks_.size(); ++i) {
          if (tasks_[i].sized != &sized) continue;
          VolumeRow& row = chart_.rows[i];
          const VolumeWay& way = *tasks_[i].way;
          VolumeSeconds seconds;
          seconds.contour = contour_seconds(light.contour);
          seconds.light = light.seconds_simplify + (is_plain(way) ? 0 : light.seconds_atlas);
          if (is_plain(way)) {
            seconds.total = seconds.contour + seconds.light;
          } else if (is_direct(way)) {
            seconds.map = light.seconds_map;
            seconds.total = wall;
          } else {
            if (!show("timing " + row.label + which)) return false;
            seconds.contour = contour_time;
            watch.lap();
            const Source source(device_, dense_);
            seconds.build = watch.lap();
            const BakeResult result = bake(source, sized.light.mesh,
                                           bake_options(options_, way, sized.size.size, quiet()));
            if (result.cancelled) return false;
            const double rest = watch.lap();
            seconds.build += result.report.seconds_build;
            seconds.map = rest - result.report.seconds_build;
            seconds.total = seconds.contour + seconds.light + seconds.build + seconds.map;
          }
          row.runs.push_back(seconds);
          done_ += 1;
        }
      }
    }
    return true;
  }

  const Device& device_;
  const Volume& volume_;
  const VolumeChartOptions& options_;
  const Progress& progress_;
  Mesh dense_;
  std::vector<Sized> sizes_;
  std::vector<Task> tasks_;  ///< As rows
  VolumeChart chart_;
  std::string stage_;
  double done_ = 0, steps_ = 1;
};

}  // namespace

const char* measure_name(VolumeMeasure measure) {
  return measure == VolumeMeasure::gradient ? "gradient_error" : "normal_error";
}

double VolumeRow::error(VolumeMeasure measure) const {
  return measure == VolumeMeasure::gradient ? gradient.mean_degrees : picture.mean_degrees;
}

std::vector<VolumeWay> volume_ways() {
  return {{kNoMap, "no map", "none", std::nullopt, false},
          {kDirectMap, "direct", "direct", std::nullopt, true},
          {"ray", "rays", "rays", by(MatchMethod::ray), true},
          {"ray_2x2", "rays, 2×2 samples", "rays", by(MatchMethod::ray, 2), false},
          {"views_12", "12 views", "views", by_views(), false},
          {"closest", "nearest points", "closest", by(MatchMethod::closest), true}};
}

std::optional<VolumeChart> run_volume_chart(const Device& device, const Volume& volume,
                                            const VolumeChartOptions& options,
                                            const Progress& progress) {
  return Runner(device, volume, options, progress).run();
}

}  // namespace kiln::cli

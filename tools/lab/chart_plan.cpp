#include "lab/chart_plan.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "lab/measuring.h"
#include "lab/table.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kFewestFaces = 125, kMostFaces = 16000, kSmallestMap = 16;
/// One part of a pair has at most so many times the bytes of the other: beyond that, a step of either brings
/// little.
constexpr std::uint64_t kMostApart = 16;
constexpr std::uint32_t kViews = 30, kPixels = 128;
/// As plans take them.
constexpr std::uint32_t kSampleBudget = 1024, kMostSamples = 4;
/// Errors to plan for, where none are given: at these shares of the way from worst to best, by ratio.
constexpr double kShares[] = {0.25, 0.5, 0.75};
/// Shares of the progress: grids, then plans.
constexpr double kAtPlans = 0.7;

/// Over welded vertices, those in use alone. Without normals: smooth.
Mesh by_meshoptimizer(const Mesh& high, std::uint32_t faces) {
  static_assert(sizeof(Triangle) == 3 * sizeof(unsigned int) && sizeof(Vec3) == 3 * sizeof(float));
  const std::size_t count = 3 * high.triangles.size();
  std::vector<unsigned int> remap(high.positions.size()), indices(count);
  const std::size_t welded =
      meshopt_generateVertexRemap(remap.data(), high.triangles.data()->data(), count,
                                  high.positions.data(), high.positions.size(), sizeof(Vec3));
  std::vector<Vec3> positions(welded);
  meshopt_remapVertexBuffer(positions.data(), high.positions.data(), high.positions.size(),
                            sizeof(Vec3), remap.data());
  meshopt_remapIndexBuffer(indices.data(), high.triangles.data()->data(), count, remap.data());
  std::vector<unsigned int> left(count);
  left.resize(meshopt_simplify(left.data(), indices.data(), count, &positions.data()->x, welded,
                               sizeof(Vec3), std::size_t{3} * faces, 1.0F, 0, nullptr));
  Mesh mesh;
  mesh.name = high.name;
  mesh.origin = high.origin;
  std::vector<std::uint32_t> number(welded, 0);
  for (std::size_t i = 0; i < left.size(); ++i) {
    std::uint32_t& at = number[left[i]];
    if (at == 0) {
      mesh.positions.push_back(positions[left[i]]);
      at = static_cast<std::uint32_t>(mesh.positions.size());
    }
    if (i % 3 == 0) mesh.triangles.emplace_back();
    mesh.triangles.back()[i % 3] = at - 1;
  }
  return mesh;
}

/// As a file of kGridBits a channel holds it.
Image rounded(Image map) {
  constexpr auto kSteps = static_cast<float>((1U << kGridBits) - 1);
  for (float& value : map.pixels) {
    value = std::floor(std::clamp(value, 0.0F, 1.0F) * kSteps + 0.5F) / kSteps;
  }
  return map;
}

class PlanCharter {
 public:
  PlanCharter(const Device& device, const Mesh& high, const PlanChartOptions& options,
              const Progress& progress)
      : device_(device),
        high_(high),
        options_(options),
        progress_(progress),
        source_(device, high),
        reference_(Scene(device, high), high, views(), kPixels) {
    if (options.screen != 0) on_screen_.emplace(source_, options.screen, kViews);
    chart_.screen = options.screen;
    chart_.name = high.name;
    chart_.faces = high.triangles.size();
    chart_.warnings = source_.warnings();
    sizes_.push_back(0);
    for (std::uint32_t s = kSmallestMap; s <= options.size; s *= 2) sizes_.push_back(s);
    const std::size_t most = std::min<std::size_t>(kMostFaces, high.triangles.size() / 2);
    for (std::uint32_t f = kFewestFaces; f <= most; f *= 2) faces_.push_back(f);
    if (faces_.empty()) {
      throw Error(ErrorCode::input, "'" + high.name + "' has " +
                                        std::to_string(high.triangles.size()) +
                                        " triangles: a chart of plans needs " +
                                        std::to_string(2 * kFewestFaces) + " or more.");
    }
  }

  std::optional<PlanChart> run() {
    for (const PlanWay way : {PlanWay::kiln, PlanWay::plain}) {
      for (const std::uint32_t faces : faces_) {
        if (!add_faces(way, faces)) return std::nullopt;
      }
      mark_front(way);
    }
    std::vector<double> errors = options_.errors.empty() ? errors_between() : options_.errors;
    std::sort(errors.rbegin(), errors.rend());
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(errors.size());
      if (!add_plan(errors[i], kAtPlans + (1 - kAtPlans) * share)) return std::nullopt;
    }
    return std::move(chart_);
  }

 private:
  /// None near those that plans look from.
  static std::vector<ViewAngles> views() {
    const std::vector<Vec3> seen = held_out_views(kPlanViews, spread_views(12));
    return angles_of(held_out_views(kViews, seen));
  }

  bool say(double done, const std::string& stage) const { return progress_(done, stage); }

  /// A number of faces with maps of all sizes. \returns false where progress said stop
  bool add_faces(PlanWay way, std::uint32_t faces) {
    const double step = kAtPlans / static_cast<double>(2 * faces_.size());
    const std::string stage =
        std::to_string(faces) + (way == PlanWay::kiln ? " faces" : " faces by meshoptimizer");
    at_ = step * static_cast<double>(grids_++);
    if (!say(at_, stage)) return false;
    Mesh simple;
    if (way == PlanWay::kiln) {
      SimplifyOptions options;
      options.faces = faces;
      simple = simplify(high_, options);
    } else {
      simple = by_meshoptimizer(high_, faces);
    }
    // Neither makes fewer faces than the shape needs.
    const std::vector<PlanPoint>& points = chart_.points;
    const bool again = !points.empty() && points.back().way == way &&
                       points.back().faces == simple.triangles.size();
    if (simple.triangles.empty() || again) return true;
    for (const std::uint32_t size : sizes_) {
      if (!say(at_, stage)) return false;
      if (!add_point(way, simple, size)) return false;
    }
    return true;
  }

  bool add_point(PlanWay way, const Mesh& simple, std::uint32_t size) {
    PlanPoint point;
    point.way = way;
    point.faces = simple.triangles.size();
    point.size = size;
    const LowPolyBytes plain =
        low_poly_bytes(simple.positions.size(), point.faces, size, {kChannels}, kGridBits);
    if (size != 0 && (plain.texels > kMostApart * plain.vertices ||
                      plain.vertices > kMostApart * plain.texels)) {
      return true;
    }
    if (size == 0) {
      point.vertices = simple.positions.size();
      point.bytes = plain;
      point.degrees = measured(simple);
      chart_.points.push_back(point);
      return true;
    }
    Mesh low = unwrap(simple, {UnwrapMethod::charts, size, std::max(2U, size / 256)});
    if (way == PlanWay::kiln) low = fit_normals(low, high_);
    BakeOptions bake_with;
    bake_with.width = bake_with.height = size;
    bake_with.report.recall = 0;
    if (way == PlanWay::kiln)
      bake_with.samples = std::clamp(kSampleBudget / size, 1U, kMostSamples);
    bake_with.progress = [&](double, std::string_view) { return progress_(at_, "baking"); };
    const BakeResult result = bake(source_, low, bake_with);
    if (result.cancelled) return false;
    point.vertices = split_vertices(low);
    point.bytes = low_poly_bytes(point.vertices, point.faces, size, {kChannels}, kGridBits);
    point.degrees = measured(low, rounded(result.maps[0].image), bake_with);
    chart_.points.push_back(point);
    return true;
  }

  double measured(const Mesh& low) const {
    return on_screen_ ? on_screen_->degrees(low)
                      : reference_.compare(Scene(device_, low)).mean_degrees;
  }

  double measured(const Mesh& low, const Image& map, const BakeOptions& baked) const {
    if (on_screen_) return on_screen_->degrees(low, map, baked);
    const NormalMap normal{&map, baked.encoding.space, baked.encoding.flip_y,
                           baked.encoding.bitangent};
    return reference_.compare(Scene(device_, low, normal)).mean_degrees;
  }

  /// By rising bytes.
  std::vector<const PlanPoint*> front(PlanWay way) const {
    std::vector<const PlanPoint*> points;
    for (const PlanPoint& point : chart_.points) {
      if (point.way == way && point.front) points.push_back(&point);
    }
    std::sort(points.begin(), points.end(), [](const PlanPoint* a, const PlanPoint* b) {
      return a->bytes.total() < b->bytes.total();
    });
    return points;
  }

  void mark_front(PlanWay way) {
    std::vector<PlanPoint*> points;
    for (PlanPoint& point : chart_.points) {
      if (point.way == way) points.push_back(&point);
    }
    std::sort(points.begin(), points.end(), [](const PlanPoint* a, const PlanPoint* b) {
      return std::tuple(a->bytes.total(), a->degrees) < std::tuple(b->bytes.total(), b->degrees);
    });
    double least = 1e300;
    for (PlanPoint* point : points) {
      point->front = point->degrees < least;
      least = std::min(least, point->degrees);
    }
  }

  /// Numbers of two digits each.
  std::vector<double> errors_between() const {
    const std::vector<const PlanPoint*> points = front(PlanWay::kiln);
    const double worst = points.front()->degrees, best = points.back()->degrees;
    std::vector<double> errors;
    for (const double share : kShares) {
      const double error = worst * std::pow(best / worst, share);
      const double unit = std::pow(10, std::floor(std::log10(error)) - 1);
      errors.push_back(std::max(std::round(error / unit), 1.0) * unit);
    }
    return errors;
  }

  /// Between the front's points, bytes follow a power of the error.
  double bytes_at(PlanWay way, double degrees) const {
    const PlanPoint* before = nullptr;
    for (const PlanPoint* point : front(way)) {
      if (point->degrees <= degrees) {
        const auto bytes = static_cast<double>(point->bytes.total());
        if (before == nullptr) return bytes;
        const auto fewer = static_cast<double>(before->bytes.total());
        const double share =
            std::log(before->degrees / degrees) / std::log(before->degrees / point->degrees);
        return fewer * std::pow(bytes / fewer, share);
      }
      before = point;
    }
    return 0;
  }

  bool add_plan(double wanted, double at) {
    PlanStand stand;
    stand.wanted = wanted;
    LowPolyPlanOptions options;
    options.max_error = wanted;
    options.screen = options_.screen;
    options.bake.width = options.bake.height = options_.size;
    options.bake.report.recall = 0;
    options.bake.progress = [&](double, std::string_view stage) {
      return say(at, "plan for " + text_of(wanted) + " degrees: " + std::string(stage));
    };
    const Stopwatch watch;
    LowPolyPlan plan = plan_low_poly(source_, high_, options);
    if (plan.cancelled) return false;
    stand.seconds = watch.total();
    stand.reached = plan.reached;
    stand.chosen = plan.chosen;
    stand.degrees = plan.result ? measured(plan.low, plan.drawn, plan.bake) : measured(plan.low);
    stand.front_bytes = bytes_at(PlanWay::kiln, stand.degrees);
    stand.plain_bytes = bytes_at(PlanWay::plain, stand.degrees);
    chart_.plans.push_back(stand);
    return true;
  }

  /// Bytes of a normal map: see low_poly_bytes().
  static constexpr std::uint32_t kChannels = 3;

  const Device& device_;
  const Mesh& high_;
  const PlanChartOptions& options_;
  const Progress& progress_;
  Source source_;
  NormalReference reference_;
  std::optional<ScreenPictures> on_screen_;  ///< In place of the reference
  std::vector<std::uint32_t> faces_, sizes_;
  std::size_t grids_ = 0;
  double at_ = 0;
  PlanChart chart_;
};

}  // namespace

const char* way_name(PlanWay way) { return way == PlanWay::kiln ? "kiln" : "meshoptimizer"; }

std::optional<PlanChart> run_plan_chart(const Device& device, const Mesh& high,
                                        const PlanChartOptions& options, const Progress& progress) {
  return PlanCharter(device, high, options, progress).run();
}

}  // namespace kiln::cli

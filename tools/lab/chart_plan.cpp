// `kiln chart HIGH --plan`: bytes against error: low polys of all numbers of faces with maps of all sizes, and where
// plans stand.
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "arguments/map_bounds.h"
#include "arguments/parse.h"
#include "arguments/small_file.h"
#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "lab/chart.h"
#include "lab/measuring.h"
#include "lab/table.h"

namespace kiln::cli {
namespace {

/// Ways to make a low poly and its map.
enum class PlanWay {
  kiln,   ///< simplify(), and as many samples a texel as plans take
  plain,  ///< meshoptimizer's simplifier, rays along the normals, one sample a texel
};

/// Bits a channel of all maps of the grids. Plans choose their own.
constexpr std::uint32_t kGridBits = 8;
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
  // Vertices in use, in the order of their use.
  std::vector<unsigned int> used(welded);
  mesh.positions.resize(
      meshopt_optimizeVertexFetchRemap(used.data(), left.data(), left.size(), welded));
  meshopt_remapVertexBuffer(mesh.positions.data(), positions.data(), welded, sizeof(Vec3),
                            used.data());
  for (std::size_t i = 0; i < left.size(); i += 3) {
    mesh.triangles.push_back({used[left[i]], used[left[i + 1]], used[left[i + 2]]});
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

/// A low poly with a map, as measured.
struct PlanPoint {
  PlanWay way = PlanWay::kiln;
  std::uint64_t faces = 0;     ///< Triangles
  std::uint64_t vertices = 0;  ///< As a renderer holds them
  std::uint32_t size = 0;      ///< Texels a side; 0: no map
  LowPolyBytes bytes;
  double degrees = 0;  ///< Mean angle between rendered normals and the high poly's
  bool front = false;  ///< Nothing else of its way has both fewer bytes and less error
};

double kib(std::uint64_t bytes) { return static_cast<double>(bytes) / 1024; }

Json json_of(const LowPolyBytes& b) {
  return fields("vertices texels total", {b.vertices, b.texels, b.total()});
}

Json json_of(const PlanPoint& p) {
  return fields("way faces vertices size bits bytes mean_degrees front",
                {p.way == PlanWay::kiln ? "kiln" : "meshoptimizer", p.faces, p.vertices, p.size,
                 p.size == 0 ? Json() : Json(kGridBits), json_of(p.bytes), p.degrees, p.front});
}

/// Makes and measures the grid of a high poly, then plans. Pictures come from 30 directions that plans do not look
/// from.
class PlanCharter {
 public:
  /// \throws Error(input) where HIGH has too few faces
  /// \param screen  LowPolyPlanOptions::screen, of plans and of what the grid is measured by; 0: points of 128²
  /// pictures \param size  the largest map, texels a side
  PlanCharter(const Device& device, const Mesh& high, std::uint32_t screen, std::uint32_t size,
              const Progress& progress)
      : device_(device),
        high_(high),
        screen_(screen),
        size_(size),
        progress_(progress),
        source_(device, high),
        reference_(Scene(device, high), high, views(), kPixels) {
    if (screen != 0) on_screen_.emplace(source_, screen, kViews);
    warnings = source_.warnings();
    sizes_.push_back(0);
    for (std::uint32_t s = kSmallestMap; s <= size; s *= 2) sizes_.push_back(s);
    const std::size_t most = std::min<std::size_t>(kMostFaces, high.triangles.size() / 2);
    for (std::uint32_t f = kFewestFaces; f <= most; f *= 2) faces_.push_back(f);
    if (faces_.empty()) {
      throw Error(ErrorCode::input, "'" + high.name + "' has " +
                                        std::to_string(high.triangles.size()) +
                                        " triangles: a chart of plans needs " +
                                        std::to_string(2 * kFewestFaces) + " or more.");
    }
  }

  /// \param errors  to plan for, degrees; none: three between the grid's best and worst
  /// \returns false where progress said stop
  bool run(std::vector<double> errors) {
    for (const PlanWay way : {PlanWay::kiln, PlanWay::plain}) {
      for (const std::uint32_t faces : faces_) {
        if (!add_faces(way, faces)) return false;
      }
      mark_front(way);
    }
    if (errors.empty()) errors = errors_between();
    std::sort(errors.rbegin(), errors.rend());
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(errors.size());
      if (!add_plan(errors[i], kAtPlans + (1 - kAtPlans) * share)) return false;
    }
    return true;
  }

  /// The points that are wanted, by rising bytes.
  template <class Wanted>
  std::vector<const PlanPoint*> points_of(const Wanted& wanted) const {
    std::vector<const PlanPoint*> some;
    for (const PlanPoint& point : points) {
      if (wanted(point)) some.push_back(&point);
    }
    std::sort(some.begin(), some.end(), [](const PlanPoint* a, const PlanPoint* b) {
      return std::tuple(a->bytes.total(), a->degrees) < std::tuple(b->bytes.total(), b->degrees);
    });
    return some;
  }
  std::vector<const PlanPoint*> front(PlanWay way) const {
    return points_of([&](const PlanPoint& point) { return point.way == way && point.front; });
  }

  std::vector<PlanPoint> points;  ///< By way, faces, size
  Json plans = Json::array();     ///< By falling error
  std::vector<Warning> warnings;

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
      points.push_back(point);
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
    points.push_back(point);
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

  void mark_front(PlanWay way) {
    double least = 1e300;
    for (const PlanPoint* of_way : points_of([&](const PlanPoint& p) { return p.way == way; })) {
      PlanPoint& point = points[static_cast<std::size_t>(of_way - points.data())];
      point.front = point.degrees < least;
      least = std::min(least, point.degrees);
    }
  }

  /// Numbers of two digits each.
  std::vector<double> errors_between() const {
    const std::vector<const PlanPoint*> front_points = front(PlanWay::kiln);
    const double worst = front_points.front()->degrees, best = front_points.back()->degrees;
    std::vector<double> errors;
    for (const double share : kShares) {
      const double error = worst * std::pow(best / worst, share);
      const double unit = std::pow(10, std::floor(std::log10(error)) - 1);
      errors.push_back(std::max(std::round(error / unit), 1.0) * unit);
    }
    return errors;
  }

  /// Of either way's front at an error; 0 where it does not get there. Between the front's points, bytes follow a power
  /// of the error.
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
    LowPolyPlanOptions options;
    options.max_error = wanted;
    options.screen = screen_;
    options.bake.width = options.bake.height = size_;
    options.bake.report.recall = 0;
    options.bake.progress = [&](double, std::string_view stage) {
      return say(at, "plan for " + text_of(wanted) + " degrees: " + std::string(stage));
    };
    const Stopwatch watch;
    LowPolyPlan plan = plan_low_poly(source_, high_, options);
    if (plan.cancelled) return false;
    const double seconds = watch.total();
    const Candidate& c = plan.chosen;  // measured by the plan's own pictures
    const double degrees =
        plan.result ? measured(plan.low, plan.drawn, plan.bake) : measured(plan.low);
    const double front = bytes_at(PlanWay::kiln, degrees),
                 plain = bytes_at(PlanWay::plain, degrees);
    const auto known = [](double value) { return value > 0 ? Json(value) : Json(); };
    const auto bytes = static_cast<double>(c.bytes.total());
    plans.push_back(fields(
        "wanted_degrees reached faces vertices size samples bits match bytes planned_degrees "
        "mean_degrees front_bytes plain_front_bytes times_front times_plain_front seconds",
        {wanted, plan.reached, c.faces, c.vertices, c.size, c.samples, c.bits, c.method.name,
         json_of(c.bytes), c.measured, degrees, known(front), known(plain),
         front > 0 ? Json(bytes / front) : Json(), plain > 0 ? Json(bytes / plain) : Json(),
         seconds}));
    return true;
  }

  /// Bytes of a normal map: see low_poly_bytes().
  static constexpr std::uint32_t kChannels = 3;

  const Device& device_;
  const Mesh& high_;
  std::uint32_t screen_, size_;
  const Progress& progress_;
  Source source_;
  NormalReference reference_;
  std::optional<ScreenPictures> on_screen_;  ///< In place of the reference
  std::vector<std::uint32_t> faces_, sizes_;
  std::size_t grids_ = 0;
  double at_ = 0;
};

std::string map_text(const Json& size) {
  return size.number() == 0 ? "no map" : text_of(size.number()) + "²";
}

/// Curves of the grid by size of map, both fronts, and rings where plans stand.
Json panel_of(const PlanCharter& chart, const std::string& title) {
  Json panel = plot_panel("Mean angle between rendered normals, degrees");
  panel["title"] = title;
  const auto add = [&](const std::string& name, const Json& look,
                       const std::vector<const PlanPoint*>& points) {
    panel["curves"].push_back(plot_curve(
        name, look, points, [](const PlanPoint* p) { return kib(p->bytes.total()); },
        [](const PlanPoint* p) { return p->degrees; }));
  };
  std::set<std::uint32_t> sizes;
  for (const PlanPoint& point : chart.points) sizes.insert(point.size);
  double before = 0;
  for (const std::uint32_t size : sizes) {
    const std::vector<const PlanPoint*> points = chart.points_of(
        [&](const PlanPoint& p) { return p.way == PlanWay::kiln && p.size == size; });
    const double shade = before++ / static_cast<double>(sizes.size());
    if (!points.empty()) add(map_text(size), {{"thin", shade}}, points);
  }
  const std::string bits = std::to_string(kGridBits) + " bits";
  add("Kiln: the front of faces and sizes, " + bits, "kiln", chart.front(PlanWay::kiln));
  add("meshoptimizer and a plain bake: the front, " + bits, "paper", chart.front(PlanWay::plain));
  Json& rings = panel["rings"];
  rings["title"] = "the plans";
  for (const Json& plan : chart.plans.elements()) {
    const Json& size = plan.at("size");
    rings["x"].push_back(plan.at("bytes.total").number() / 1024);
    rings["y"].push_back(plan.at("mean_degrees"));
    rings["labels"].push_back(
        "for " + text_of(plan.at("wanted_degrees").number()) +
        "°: " + with_commas(static_cast<std::uint64_t>(plan.at("faces").number())) + " faces, " +
        map_text(size) +
        (size.number() == 0 ? "" : ", " + text_of(plan.at("bits").number()) + " bits"));
  }
  return panel;
}

class PlansChart : public ChartKind {
 public:
  explicit PlansChart(const ChartArguments& a) : ChartKind(a, "mesh", "meshes") {
    about =
        "Bytes of low poly and maps against the mean angle of rendered normals, degrees. Plans "
        "choose faces, map size and bits; beside them are the fronts of all faces and map sizes, "
        "by "
        "Kiln and by meshoptimizer with a plain bake. Maps of the fronts have " +
        std::to_string(kGridBits) + " bits a channel.";
    if (!a.screen.empty()) screen_ = parse_pixels("--screen", a.screen);
    for (const std::string& text : a.max_errors) {
      // A bound with a name, as elsewhere: "normal=1.5".
      const std::string bound = normal_bound(text);
      errors_.push_back(parse_degrees("--max-error", bound.empty() ? text : bound));
    }
    options = fields("max_error screen", {errors_, screen_ == 0 ? Json() : Json(screen_)});
  }

  void read(std::size_t i) override {
    dense_ = read_high(a_, inputs[i], warnings);
    if (!dense_.heights) clean_high(dense_.mesh, CleanOptions(), warnings);
  }

  std::optional<ChartGroup> measure(const Device& device, std::size_t i,
                                    const Progress& progress) override {
    const Mesh& high = dense_.mesh;
    PlanCharter chart(device, high, screen_, *a_.size, progress);
    if (!chart.run(errors_)) return std::nullopt;
    add_warnings(chart.warnings, warnings);
    ChartGroup group;
    group.title = high.name + ", " + with_commas(high.triangles.size()) + " faces";
    if (screen_ != 0) group.title += ", " + with_commas(screen_) + " pixels on screen";
    Json points = Json::array(), data = Json::array();
    for (const PlanPoint& point : chart.points) points.push_back(json_of(point));
    for (Json plan : chart.plans.elements()) {
      plan["way"] = "plan";
      data.push_back(std::move(plan));
    }
    group.report = {{"high", describe(high, inputs[i])}};
    group.report.update({{"points", points}, {"plans", chart.plans}});
    group.panels.push_back(panel_of(chart, group.title));
    group.tables = {{"", {}, points, ".csv"},
                    {"Plans (map 0: none). Their bytes are told in times those of a front at the "
                     "same angle, too.",
                     {{"wanted °", "wanted_degrees", 3},
                      {"measured °", "mean_degrees", 3},
                      {"faces", "faces", 0},
                      {"map", "size", 0},
                      {"bits", "bits", 0},
                      {"KiB", "bytes.total", 1, kib(1)},
                      {"times the front", "times_front", 2},
                      {"times meshoptimizer's", "times_plain_front", 2}},
                     data,
                     ".csv"}};
    for (const auto& [way, whose] :
         {std::pair(PlanWay::kiln, "Kiln's"), std::pair(PlanWay::plain, "meshoptimizer's")}) {
      Json front = Json::array();
      for (const PlanPoint* point : chart.front(way)) front.push_back(json_of(*point));
      group.tables.push_back({std::string("The front of ") + whose + " grid:",
                              {{"faces", "faces", 0},
                               {"map", "size", 0},
                               {"KiB", "bytes.total", 1, kib(1)},
                               {"measured °", "mean_degrees", 3}},
                              front});
    }
    return group;
  }

  Json plot(const DeviceInfo&, const std::vector<ChartGroup>& groups) const override {
    Json panels = Json::array(), ticks = Json::array();
    double least = 1e300, most = 0;
    for (const ChartGroup& group : groups) {
      panels.push_back(group.panels[0]);
      for (const char* list : {"points", "plans"}) {
        for (const Json& made : group.report.at(list).elements()) {
          least = std::min(least, made.at("bytes.total").number() / 1024);
          most = std::max(most, made.at("bytes.total").number() / 1024);
        }
      }
    }
    // Powers of four around all of it.
    double tick = 1.0 / 256;
    while (4 * tick <= least) tick *= 4;
    for (; ticks.size() < 2 || ticks.back().number() < most; tick *= 4) ticks.push_back(tick);
    return fields("kind title x_title x_ticks panels",
                  {"study", "Bytes against error: faces, map sizes and plans",
                   "KiB of low poly and maps", ticks, panels});
  }

 private:
  std::uint32_t screen_ = 0;    ///< As PlanCharter
  std::vector<double> errors_;  ///< To plan for
  HighPolyInput dense_;
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_plans(const ChartArguments& arguments) {
  return std::make_unique<PlansChart>(arguments);
}

}  // namespace kiln::cli

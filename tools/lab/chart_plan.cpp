// `kiln chart HIGH --plan`: charts bytes against error of low polys with all face counts and map sizes, and compares
// them with plans.
#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "job/files.h"
#include "job/map_words.h"
#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "lab/chart.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

/// Bits per channel of all maps in the grid; plans choose their number of bits.
constexpr std::uint32_t kGridBits = 8;
constexpr std::uint32_t kMinFaces = 125, kMaxFaces = 16000, kSmallestMap = 16;
/// Maximum ratio of the bytes of mesh and map, in both directions. Beyond it, further steps hardly change the error.
constexpr std::uint64_t kMaxBytesRatio = 16;
constexpr std::uint32_t kHeldOutPictures = 30, kPixels = 128;
/// The number of samples is chosen as in plans.
constexpr std::uint32_t kSampleBudget = 1024, kMaxSamples = 4;
/// The default errors to plan for are interpolated geometrically between the worst and the best error at these shares.
constexpr double kDefaultErrorShares[] = {0.25, 0.5, 0.75};
/// Share of the progress at which plans start, after the grid was measured.
constexpr double kProgressAtPlans = 0.7;

/// Quantises a map to kGridBits per channel.
Image round_to_two_digits(Image map) {
  constexpr auto kSteps = static_cast<float>((1U << kGridBits) - 1);
  for (float& value : map.pixels) {
    value = std::floor(std::clamp(value, 0.0F, 1.0F) * kSteps + 0.5F) / kSteps;
  }
  return map;
}

double format_kib(double bytes) { return bytes / 1024; }
double bytes_of(const Json& made) { return made.at("bytes.total").number(); }
double degrees_of(const Json& made) { return made.at("mean_degrees").number(); }

Json bytes_json(const LowPolyBytes& b) {
  return fields("vertices texels total", {b.vertices, b.texels, b.total()});
}

std::string map_text(double size) { return size == 0 ? "no map" : text_of(size) + "²"; }

/// Charts each high poly: builds and measures a grid, then plans. Errors are measured in pictures from 30 directions
/// that plans do not use.
class PlansChart : public ChartKind {
 public:
  explicit PlansChart(const ChartArguments& a) : ChartKind(a, "mesh", "meshes") {
    explanation =
        "Bytes of low poly and maps against the mean angle of rendered normals, degrees. Plans "
        "choose faces, map size and bits; the front has the smallest files at each angle among all "
        "charted faces and map sizes, whose maps have " +
        std::to_string(kGridBits) + " bits a channel.";
    if (!a.screen.empty()) screen_ = parse_pixels("--screen", a.screen);
    for (const std::string& text : a.max_errors) {
      // An error may be prefixed by the map's name: "normal=1.5".
      const std::string bound = normal_error_bound(text);
      errors_.push_back(parse_degrees("--max-error", bound.empty() ? text : bound));
    }
    options = fields("max_error screen", {errors_, screen_ == 0 ? Json() : Json(screen_)});
  }

  void read(std::size_t i) override {
    high_ = read_high(a_, inputs[i], warnings);
    if (!high_.heights) clean_high(high_.mesh, CleanOptions(), warnings);
  }

  /// Measures one high poly. \throws Error(input) if HIGH has too few faces
  std::optional<ChartGroup> measure(const Device& device, std::size_t i,
                                    const Progress& progress) override {
    device_ = &device;
    progress_ = progress;
    points_.clear();
    plans_ = Json::array();
    const Mesh& high = high_.mesh;
    std::vector<std::uint32_t> faces;
    const std::size_t max_faces = std::min<std::size_t>(kMaxFaces, high.triangles.size() / 2);
    for (std::uint32_t f = kMinFaces; f <= max_faces; f *= 2) faces.push_back(f);
    if (faces.empty()) {
      throw Error(ErrorCode::input, "'" + high.name + "' has " +
                                        std::to_string(high.triangles.size()) +
                                        " triangles: a chart of plans needs " +
                                        std::to_string(2 * kMinFaces) + " or more.");
    }
    on_screen_.reset();
    source_.emplace(device, high);
    add_warnings(source_->warnings(), warnings);
    // the directions that plans use, which the measurement avoids
    const std::vector<Vec3> held_out = held_out_views(kPlanViews, spread_views(12));
    reference_.emplace(Scene(device, high), high,
                       angles_of(held_out_views(kHeldOutPictures, held_out)), kPixels);
    if (screen_ != 0) on_screen_.emplace(*source_, screen_, kHeldOutPictures);
    start_share_ = 0;
    for (const std::uint32_t count : faces) {
      if (!add_faces(count)) return std::nullopt;
      start_share_ += kProgressAtPlans / static_cast<double>(faces.size());
    }
    mark_front();
    std::vector<double> errors = errors_.empty() ? errors_between() : errors_;
    std::sort(errors.rbegin(), errors.rend());
    for (const double error : errors) {
      if (!add_plan(error)) return std::nullopt;
      start_share_ += (1 - kProgressAtPlans) / static_cast<double>(errors.size());
    }
    return group_of(inputs[i]);
  }

  Json plot(const DeviceInfo&, const std::vector<ChartGroup>& groups) const override {
    Json panels = Json::array();
    double min_error = 1e300, max_error = 0;
    for (const ChartGroup& group : groups) {
      panels.push_back(group.panels[0]);
      for (const char* list : {"points", "plans"}) {
        for (const Json& measured_point : group.report.at(list).elements()) {
          min_error = std::min(min_error, format_kib(bytes_of(measured_point)));
          max_error = std::max(max_error, format_kib(bytes_of(measured_point)));
        }
      }
    }
    return fields("kind title x_title x_ticks panels",
                  {"study", "Bytes against error: faces, map sizes and plans",
                   "KiB of low poly and maps", power_of_four_ticks(min_error, max_error), panels});
  }

 private:
  /// Adds a face count with maps of all sizes to the grid. \returns false if cancelled
  bool add_faces(std::uint32_t faces) {
    const std::string stage = std::to_string(faces) + " faces";
    if (!progress_(start_share_, stage)) return false;
    SimplifyOptions options;
    options.faces = faces;
    const Mesh simple = simplify(high_.mesh, options);
    // Simplification stops at the number of faces that the shape needs.
    const auto count = static_cast<double>(simple.triangles.size());
    const bool is_repeated = !points_.empty() && points_.back().at("faces").number() == count;
    if (simple.triangles.empty() || is_repeated) return true;
    if (!add_point(simple, 0)) return false;
    for (std::uint32_t size = kSmallestMap; size <= *a_.size; size *= 2) {
      if (!progress_(start_share_, stage) || !add_point(simple, size)) return false;
    }
    return true;
  }

  bool add_point(const Mesh& simple, std::uint32_t size) {
    constexpr std::uint32_t kChannels = 3;  // channels of a normal map
    const auto bytes_with = [&](std::size_t vertices) {
      return low_poly_bytes(vertices, simple.triangles.size(), size, {kChannels}, kGridBits);
    };
    std::size_t vertices = simple.positions.size();
    double degrees = 0;
    if (size == 0) {
      degrees = measured(simple);
    } else {
      const LowPolyBytes mesh_bytes = bytes_with(vertices);
      if (mesh_bytes.texels > kMaxBytesRatio * mesh_bytes.vertices ||
          mesh_bytes.vertices > kMaxBytesRatio * mesh_bytes.texels)
        return true;
      const Mesh low = fit_normals(
          unwrap(simple, {UnwrapMethod::charts, size, std::max(2U, size / 256)}), high_.mesh);
      BakeOptions bake_with;
      bake_with.width = bake_with.height = size;
      bake_with.report.recall = 0;
      bake_with.samples = std::clamp(kSampleBudget / size, 1U, kMaxSamples);
      bake_with.progress = [&](double, std::string_view) {
        return progress_(start_share_, "baking");
      };
      const BakeResult result = bake(*source_, low, bake_with);
      if (result.cancelled) return false;
      vertices = split_vertices(low);
      degrees = measured(low, round_to_two_digits(result.maps[0].image), bake_with);
    }
    points_.push_back(
        fields("faces vertices size bits bytes mean_degrees front",
               {simple.triangles.size(), vertices, size, size == 0 ? Json() : Json(kGridBits),
                bytes_json(bytes_with(vertices)), degrees, false}));
    return true;
  }

  double measured(const Mesh& low) const {
    return on_screen_ ? on_screen_->degrees(low)
                      : reference_->compare(Scene(*device_, low)).mean_degrees;
  }

  double measured(const Mesh& low, const Image& map, const BakeOptions& baked) const {
    if (on_screen_) return on_screen_->degrees(low, map, baked);
    const NormalMap normal{&map, baked.encoding.space, baked.encoding.flip_y,
                           baked.encoding.bitangent};
    return reference_->compare(Scene(*device_, low, normal)).mean_degrees;
  }

  /// The points for which `wanted` is true, in order of increasing bytes.
  template <class Wanted>
  std::vector<Json> points_of(const Wanted& wanted) const {
    std::vector<Json> selected_points;
    std::copy_if(points_.begin(), points_.end(), std::back_inserter(selected_points), wanted);
    std::stable_sort(
        selected_points.begin(), selected_points.end(), [](const Json& a, const Json& b) {
          return std::tuple(bytes_of(a), degrees_of(a)) < std::tuple(bytes_of(b), degrees_of(b));
        });
    return selected_points;
  }

  /// The Pareto front: points for which no other point has both fewer bytes and a lower error.
  std::vector<Json> pareto_front() const {
    double min_bytes = 1e300;
    std::vector<Json> selected_points = points_of([](const Json&) { return true; });
    std::erase_if(selected_points, [&](const Json& point) {
      if (degrees_of(point) >= min_bytes) return true;
      min_bytes = degrees_of(point);
      return false;
    });
    return selected_points;
  }

  void mark_front() {
    for (const Json& best : pareto_front()) {
      for (Json& point : points_) {
        const bool is_same =
            bytes_of(point) == bytes_of(best) && degrees_of(point) == degrees_of(best);
        if (is_same) point["front"] = true;
      }
    }
  }

  /// The default errors to plan for, rounded to two digits.
  std::vector<double> errors_between() const {
    const std::vector<Json> points = pareto_front();
    const double worst = degrees_of(points.front()), best = degrees_of(points.back());
    std::vector<double> errors;
    for (const double share : kDefaultErrorShares) {
      const double error = worst * std::pow(best / worst, share);
      const double unit = std::pow(10, std::floor(std::log10(error)) - 1);
      errors.push_back(std::max(std::round(error / unit), 1.0) * unit);
    }
    return errors;
  }

  /// Returns the size in bytes at which the Pareto front reaches an error, interpolated linearly in log-log scale; null
  /// if it does not reach the error.
  Json bytes_at(double degrees) const {
    const std::vector<Json> points = pareto_front();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (degrees_of(points[i]) > degrees) continue;
      const double bytes = bytes_of(points[i]);
      if (i == 0) return bytes;
      const double smaller_bytes = bytes_of(points[i - 1]),
                   coarser_error = degrees_of(points[i - 1]);
      const double share =
          std::log(coarser_error / degrees) / std::log(coarser_error / degrees_of(points[i]));
      return smaller_bytes * std::pow(bytes / smaller_bytes, share);
    }
    return {};
  }

  bool add_plan(double wanted) {
    LowPolyPlanOptions options;
    options.max_error = wanted;
    options.screen = screen_;
    options.bake.width = options.bake.height = *a_.size;
    options.bake.report.recall = 0;
    options.bake.progress = [&](double, std::string_view stage) {
      return progress_(start_share_,
                       "plan for " + text_of(wanted) + " degrees: " + std::string(stage));
    };
    const Stopwatch watch;
    LowPolyPlan plan = plan_low_poly(*source_, high_.mesh, options);
    if (plan.cancelled) return false;
    const double seconds = watch.total();
    const Candidate& c = plan.chosen;  // measured with the plan's own pictures
    const double degrees =
        plan.result ? measured(plan.low, plan.drawn, plan.bake) : measured(plan.low);
    const Json front = bytes_at(degrees);
    const Json times =
        front.is_null() ? Json() : Json(static_cast<double>(c.bytes.total()) / front.number());
    plans_.push_back(fields(
        "wanted_degrees reached faces vertices size samples bits match bytes planned_degrees "
        "mean_degrees front_bytes times_front seconds",
        {wanted, plan.reached, c.faces, c.vertices, c.size, c.samples, c.bits, c.method.name,
         bytes_json(c.bytes), c.measured, degrees, front, times, seconds}));
    return true;
  }

  /// Makes the plot: for each map size a curve of the tried numbers of faces, the Pareto front, and a ring at each
  /// plan.
  Json panel(const std::string& title) const {
    Json panel = plot_panel("Mean angle between rendered normals, degrees");
    panel["title"] = title;
    const auto add = [&](const std::string& name, const Json& look,
                         const std::vector<Json>& points) {
      panel["curves"].push_back(plot_curve(
          name, look, points, [](const Json& p) { return format_kib(bytes_of(p)); }, degrees_of));
    };
    std::set<double> sizes;
    for (const Json& point : points_) sizes.insert(point.at("size").number());
    double size_index = 0;
    for (const double size : sizes) {
      const double shade = size_index++ / static_cast<double>(sizes.size());
      add(map_text(size), {{"thin", shade}},
          points_of([&](const Json& p) { return p.at("size").number() == size; }));
    }
    add("the front of faces and sizes, " + std::to_string(kGridBits) + " bits", "kiln",
        pareto_front());
    Json& rings = panel["rings"];
    rings["title"] = "the plans";
    for (const Json& plan : plans_.elements()) {
      const double size = plan.at("size").number();
      const std::string depth = ", " + text_of(plan.at("bits").number()) + " bits";
      rings["x"].push_back(format_kib(bytes_of(plan)));
      rings["y"].push_back(degrees_of(plan));
      rings["labels"].push_back("for " + text_of(plan.at("wanted_degrees").number()) +
                                "°: " + count_text(plan.at("faces")) + " faces, " + map_text(size) +
                                (size == 0 ? "" : depth));
    }
    return panel;
  }

  ChartGroup group_of(const std::string& path) const {
    const Mesh& high = high_.mesh;
    ChartGroup group;
    group.title = high.name + ", " + with_commas(high.triangles.size()) + " faces";
    if (screen_ != 0) group.title += ", " + with_commas(screen_) + " pixels on screen";
    group.report = fields("high points plans", {describe(high, path), points_, plans_});
    group.panels.push_back(panel(group.title));
    const Column kibibytes = {"KiB", "bytes.total", 1, format_kib(1)};
    const Column faces = {"faces", "faces", 0}, map = {"map", "size", 0};
    const Column measured = {"measured °", "mean_degrees", 3};
    group.tables = {{"", {}, points_, ".csv"},
                    {"Plans (map 0: no map). The last column divides a plan's bytes by those of "
                     "the Pareto front at the same angle.",
                     {{"wanted °", "wanted_degrees", 3},
                      measured,
                      faces,
                      map,
                      {"bits", "bits", 0},
                      kibibytes,
                      {"times the front", "times_front", 2}},
                     plans_,
                     ".csv"},
                    {"The front of the grid:", {faces, map, kibibytes, measured}, pareto_front()}};
    return group;
  }

  /// LowPolyPlanOptions::screen for plans and grid; 0: pictures of 128² pixels
  std::uint32_t screen_ = 0;
  /// Errors to plan for in degrees; empty: three between the best and the worst
  std::vector<double> errors_;
  HighPolyInput high_;
  // the high poly that is being measured
  const Device* device_ = nullptr;
  Progress progress_;
  double start_share_ = 0;  ///< share of the progress at which this high poly starts
  std::optional<Source> source_;
  std::optional<NormalReference> reference_;
  /// reference pictures with --screen, used instead of the others
  std::optional<ScreenPictures> on_screen_;
  std::vector<Json> points_;  ///< points of the grid, by faces and size
  Json plans_;                ///< plans, by decreasing error
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_plans(const ChartArguments& arguments) {
  return std::make_unique<PlansChart>(arguments);
}

}  // namespace kiln::cli

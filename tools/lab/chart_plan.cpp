// `kiln chart HIGH --plan`: charts the bytes and the errors of a grid of low polys, with all combinations of face
// counts and map sizes, and compares the results of plan_low_poly() ("plans") with them.
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
/// The grid omits combinations in which the mesh has more than this many times the bytes of the map, or the map more
/// than this many times those of the mesh, since more faces or texels would hardly reduce the error there.
constexpr std::uint64_t kMaxBytesRatio = 16;
/// Number and pixels per side of the pictures that measure errors.
constexpr std::uint32_t kHeldOutPictures = 30, kPixels = 128;
/// Samples per side of a texel are chosen as in plans: kSampleBudget / map size, from 1 to kMaxSamples.
constexpr std::uint32_t kSampleBudget = 1024, kMaxSamples = 4;
/// Default errors of plans, as shares of the way from the worst to the best error of the grid, on a logarithmic scale.
constexpr double kDefaultErrorShares[] = {0.25, 0.5, 0.75};
/// Share of the progress that is complete when the grid has been measured, and the plans begin.
constexpr double kProgressAtPlans = 0.7;

/// Quantises a map to kGridBits per channel.
Image quantise_map(Image map) {
  constexpr auto kSteps = static_cast<float>((1U << kGridBits) - 1);
  for (float& value : map.pixels) {
    value = std::floor(std::clamp(value, 0.0F, 1.0F) * kSteps + 0.5F) / kSteps;
  }
  return map;
}

double to_kib(double bytes) { return bytes / 1024; }
double bytes_of(const Json& row) { return row.at("bytes.total").number(); }
double degrees_of(const Json& row) { return row.at("mean_degrees").number(); }

Json bytes_json(const LowPolyBytes& b) {
  return fields("vertices texels total", {b.vertices, b.texels, b.total()});
}

std::string map_text(double size) { return size == 0 ? "no map" : text_of(size) + "²"; }

/// Charts each high poly: measures a grid of low polys, then plans. Errors are measured in pictures from 30 directions
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
      // The name of the map may precede the error: "normal=1.5".
      const std::string bound = normal_error_bound(text);
      errors_.push_back(parse_degrees("--max-error", bound.empty() ? text : bound));
    }
    options = fields("max_error screen", {errors_, screen_ == 0 ? Json() : Json(screen_)});
  }

  void read(std::size_t i) override {
    high_ = read_high(a_, inputs[i], warnings);
    if (!high_.heights) clean_high(high_.mesh, CleanOptions(), warnings);
  }

  /// Measures the grid and the plans of one high poly. \throws Error(input) if it has too few faces
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
    // The directions that plans use, which the measurement avoids.
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
    std::vector<double> errors = errors_.empty() ? choose_default_errors() : errors_;
    std::sort(errors.rbegin(), errors.rend());
    for (const double error : errors) {
      if (!add_plan(error)) return std::nullopt;
      start_share_ += (1 - kProgressAtPlans) / static_cast<double>(errors.size());
    }
    return make_group(inputs[i]);
  }

  Json plot(const DeviceInfo&, const std::vector<ChartGroup>& groups) const override {
    Json panels = Json::array();
    double min_kib = 1e300, max_kib = 0;
    for (const ChartGroup& group : groups) {
      panels.push_back(group.panels[0]);
      for (const char* list : {"points", "plans"}) {
        for (const Json& measured_point : group.report.at(list).elements()) {
          min_kib = std::min(min_kib, to_kib(bytes_of(measured_point)));
          max_kib = std::max(max_kib, to_kib(bytes_of(measured_point)));
        }
      }
    }
    return fields("kind title x_title x_ticks panels",
                  {"study", "Bytes against error: faces, map sizes and plans",
                   "KiB of low poly and maps", power_of_four_ticks(min_kib, max_kib), panels});
  }

 private:
  /// Adds low polys with this face count and maps of all sizes to the grid. \returns false if cancelled
  bool add_faces(std::uint32_t faces) {
    const std::string stage = std::to_string(faces) + " faces";
    if (!progress_(start_share_, stage)) return false;
    SimplifyOptions options;
    options.faces = faces;
    const Mesh simple = simplify(high_.mesh, options);
    // Simplification may stop at more faces than requested, then with the same faces as for the previous count.
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
    constexpr std::uint32_t kNormalMapChannels = 3;
    const auto bytes_with = [&](std::size_t vertices) {
      return low_poly_bytes(vertices, simple.triangles.size(), size, {kNormalMapChannels},
                            kGridBits);
    };
    std::size_t vertices = simple.positions.size();
    double degrees = 0;
    if (size == 0) {
      degrees = measure_error(simple);
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
      degrees = measure_error(low, quantise_map(result.maps[0].image), bake_with);
    }
    points_.push_back(
        fields("faces vertices size bits bytes mean_degrees front",
               {simple.triangles.size(), vertices, size, size == 0 ? Json() : Json(kGridBits),
                bytes_json(bytes_with(vertices)), degrees, false}));
    return true;
  }

  double measure_error(const Mesh& low) const {
    return on_screen_ ? on_screen_->degrees(low)
                      : reference_->compare(Scene(*device_, low)).mean_degrees;
  }

  double measure_error(const Mesh& low, const Image& map, const BakeOptions& baked) const {
    if (on_screen_) return on_screen_->degrees(low, map, baked);
    const NormalMap normal{&map, baked.encoding.space, baked.encoding.flip_y,
                           baked.encoding.bitangent};
    return reference_->compare(Scene(*device_, low, normal)).mean_degrees;
  }

  /// Returns the points of the grid for which `wanted` is true, by increasing bytes.
  template <class Wanted>
  std::vector<Json> select_points(const Wanted& wanted) const {
    std::vector<Json> selected_points;
    std::copy_if(points_.begin(), points_.end(), std::back_inserter(selected_points), wanted);
    std::stable_sort(
        selected_points.begin(), selected_points.end(), [](const Json& a, const Json& b) {
          return std::tuple(bytes_of(a), degrees_of(a)) < std::tuple(bytes_of(b), degrees_of(b));
        });
    return selected_points;
  }

  /// Returns the Pareto front of the grid by increasing bytes: the points whose error is below that of all points with
  /// fewer bytes.
  std::vector<Json> select_pareto_front() const {
    double min_degrees = 1e300;
    std::vector<Json> selected_points = select_points([](const Json&) { return true; });
    std::erase_if(selected_points, [&](const Json& point) {
      if (degrees_of(point) >= min_degrees) return true;
      min_degrees = degrees_of(point);
      return false;
    });
    return selected_points;
  }

  void mark_front() {
    for (const Json& best : select_pareto_front()) {
      for (Json& point : points_) {
        const bool is_same =
            bytes_of(point) == bytes_of(best) && degrees_of(point) == degrees_of(best);
        if (is_same) point["front"] = true;
      }
    }
  }

  /// Returns the default errors of plans, rounded to two digits; see kDefaultErrorShares.
  std::vector<double> choose_default_errors() const {
    const std::vector<Json> points = select_pareto_front();
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
  Json interpolate_bytes(double degrees) const {
    const std::vector<Json> points = select_pareto_front();
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
    const Candidate& c = plan.chosen;  // Its error was measured in the plan's own pictures
    const double degrees =
        plan.result ? measure_error(plan.low, plan.drawn, plan.bake) : measure_error(plan.low);
    const Json front = interpolate_bytes(degrees);
    const Json times =
        front.is_null() ? Json() : Json(static_cast<double>(c.bytes.total()) / front.number());
    plans_.push_back(fields(
        "wanted_degrees reached faces vertices size samples bits match bytes planned_degrees "
        "mean_degrees front_bytes times_front seconds",
        {wanted, plan.reached, c.faces, c.vertices, c.size, c.samples, c.bits, c.method.name,
         bytes_json(c.bytes), c.measured, degrees, front, times, seconds}));
    return true;
  }

  /// Makes the data of the plot: a curve over the numbers of faces for each map size, the Pareto front, and a ring for
  /// each plan.
  Json make_panel(const std::string& title) const {
    Json panel = plot_panel("Mean angle between rendered normals, degrees");
    panel["title"] = title;
    const auto add = [&](const std::string& name, const Json& look,
                         const std::vector<Json>& points) {
      panel["curves"].push_back(plot_curve(
          name, look, points, [](const Json& p) { return to_kib(bytes_of(p)); }, degrees_of));
    };
    std::set<double> sizes;
    for (const Json& point : points_) sizes.insert(point.at("size").number());
    double size_index = 0;
    for (const double size : sizes) {
      const double shade = size_index++ / static_cast<double>(sizes.size());
      add(map_text(size), {{"thin", shade}},
          select_points([&](const Json& p) { return p.at("size").number() == size; }));
    }
    add("the front of faces and sizes, " + std::to_string(kGridBits) + " bits", "kiln",
        select_pareto_front());
    Json& rings = panel["rings"];
    rings["title"] = "the plans";
    for (const Json& plan : plans_.elements()) {
      const double size = plan.at("size").number();
      const std::string depth = ", " + text_of(plan.at("bits").number()) + " bits";
      rings["x"].push_back(to_kib(bytes_of(plan)));
      rings["y"].push_back(degrees_of(plan));
      rings["labels"].push_back("for " + text_of(plan.at("wanted_degrees").number()) +
                                "°: " + count_text(plan.at("faces")) + " faces, " + map_text(size) +
                                (size == 0 ? "" : depth));
    }
    return panel;
  }

  ChartGroup make_group(const std::string& path) const {
    const Mesh& high = high_.mesh;
    ChartGroup group;
    group.title = high.name + ", " + with_commas(high.triangles.size()) + " faces";
    if (screen_ != 0) group.title += ", " + with_commas(screen_) + " pixels on screen";
    group.report = fields("high points plans", {describe(high, path), points_, plans_});
    group.panels.push_back(make_panel(group.title));
    const Column kibibytes = {"KiB", "bytes.total", 1, to_kib(1)};
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
                    {"The Pareto front of faces and map sizes:",
                     {faces, map, kibibytes, measured},
                     select_pareto_front()}};
    return group;
  }

  /// Value of LowPolyPlanOptions::screen for plans and grid; 0: errors are measured in pictures of 128² pixels
  std::uint32_t screen_ = 0;
  /// Maximum errors of plans in degrees; empty: the default errors
  std::vector<double> errors_;
  HighPolyInput high_;
  // State of the high poly that is being measured
  const Device* device_ = nullptr;
  Progress progress_;
  double start_share_ = 0;  ///< Share of this high poly's progress at the start of the current step
  std::optional<Source> source_;
  std::optional<NormalReference> reference_;
  /// Reference pictures for --screen; if they exist, they measure errors instead of reference_
  std::optional<ScreenPictures> on_screen_;
  std::vector<Json> points_;  ///< Measured points of the grid, by increasing faces, then map size
  Json plans_;                ///< Measured plans, by decreasing maximum error
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_plans(const ChartArguments& arguments) {
  return std::make_unique<PlansChart>(arguments);
}

}  // namespace kiln::cli

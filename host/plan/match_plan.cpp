// Finds the cheapest match and the smallest map for a given low poly: see bake_planned(). Methods are tried in the
// order of their cost. For each method, the error with a map of infinite resolution is a lower bound for all maps;
// TexelError predicts the errors of other sizes, so that few sizes are baked.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bake/pipeline.h"
#include "base/formatted.h"
#include "kiln/plan.h"
#include "kiln/progress.h"
#include "measure/bounds.h"
#include "measure/normal_probe.h"
#include "plan/settings.h"

namespace kiln {
namespace {

using plan_settings::kMaxErrorRatioOfBetterMatch;

/// Side of the smallest map that is tried: smaller maps take as much time.
constexpr std::uint32_t kMinMapSize = 128;
/// From this number of triangles on, building the BVH dominates the time, so depth views are tried first.
constexpr std::size_t kMinTrianglesForViewsFirst = 2000000;
/// Maximum share of misses of a match that counts as working.
constexpr double kMaxMissedShare = 0.01;
/// Tolerance factor of comparisons. A map is large enough if its error is within this factor of an infinite map's
/// error, and is worth a bake if its predicted error is within this factor of the bound.
constexpr double kErrorTolerance = 1.05;
/// Map size at which matches are compared. To save time, comparisons use depth views of half the size, and an eighth
/// of the visibility directions.
constexpr std::uint32_t kComparisonSize = 1024;

/// Thrown if the UV layouts of both meshes do not agree at the size of a bake, or if no sample has a point at its UVs.
struct LayoutMismatch {};

/// Model of the error that the texels of a map of size s add to a match's error with an infinite map: 1 / (1 / range
/// + rate s^2). For a tiny map this is `range`, so that the whole error is that of the mesh without a map; for a
/// large map it is proportional to the square of the texel size.
class TexelError {
 public:
  double at(std::uint32_t size) const { return 1 / (1 / range_ + rate_ * size * size); }

  /// Sets the parameter `range` of the model. \param range error without a map minus error with an
  /// infinite map
  void set_range(double range) { range_ = std::max(range, kMinRange); }
  /// Calibrates the model by a measured map. \param excess_error error with a map of this size minus error with
  /// an infinite map
  void add_measurement(std::uint32_t size, double excess_error) {
    excess_error = std::max(excess_error, kMinRange);
    const double texels = 1.0 * size * size;
    // The charts of a tiny map have few texels, so its error may exceed the error without a map. The parameter range_
    // is therefore raised to at least twice the measured error.
    range_ = std::max(range_, 2 * excess_error);
    rate_ = (1 / excess_error - 1 / range_) / texels;
    if (texels_ > 0) {
      // Two measured sizes determine both parameters of the model.
      const double rate = (1 / excess_error - 1 / excess_error_) / (texels - texels_);
      const double inverse_range = 1 / excess_error - rate * texels;
      if (rate > 0 && inverse_range > 0) {
        rate_ = rate;
        range_ = 1 / inverse_range;
      }
    }
    texels_ = texels;
    excess_error_ = excess_error;
  }

 private:
  static constexpr double kMinRange = 1e-6;
  double range_ = kMinRange, rate_ = 0;
  // Texels of the last measured map, and its error above the infinite map's
  double texels_ = 0, excess_error_ = 0;
};

class MatchPlanner {
 public:
  MatchPlanner(const Source& source, const Mesh& low, const PlanOptions& options)
      : source_(source), low_(low), options_(options), target_error_(options.max_error) {}

  PlannedBake run() {
    const ProgressScope progress_scope(options_.bake.progress);
    return unless_cancelled<PlannedBake>(
        [this] {
          const bool has_cage =
              options_.bake.match.cage || options_.bake.match.cage_mesh != nullptr;
          try {
            return plan_methods(!has_cage && !impl_of(source_).uvs.empty());
          } catch (const LayoutMismatch&) {
            plan_ = {};
            texels_ = {};
            infinite_maps_.clear();
            best_score_ = 0;
            has_chosen_points_ = false;
            return plan_methods(/*by_uvs=*/false);
          }
        },
        [](PlannedBake& none) { none.result.cancelled = true; });
  }

 private:
  /// A bake that is not measured yet.
  struct UnmeasuredBake {
    PlanTrial trial;
    BakeOptions options;
    BakeResult result;
    Image normals_image;  // The tangent-space normals, if the map stores them in another encoding
  };

  PlannedBake plan_methods(bool by_uvs) {
    methods_ = searching_methods();
    if (by_uvs) methods_.insert(methods_.begin(), uv_method_);
    // The first bake comes before the reference pictures, because it throws LayoutMismatch.
    UnmeasuredBake baked = bake_at(methods_.front(), std::min(kMinMapSize, largest_size()));
    make_probe(uses_views(methods_[by_uvs ? 1 : 0]) || (by_uvs && target_error_ > 0));
    infinite_map_error(methods_.front());
    if (measure(std::move(baked)) <= target_error_) return finish();
    MatchMethod nearest = methods_.front();
    for (std::size_t i = 0; i < methods_.size(); ++i) {
      const MatchMethod method = methods_[i];
      // Number of methods up to and including this one, without matching by UVs, which searches nothing
      const std::size_t search_count = by_uvs ? i : i + 1;
      if (search_count > 1 &&
          (target_error_ == 0 || (has_chosen_points_ && is_unreachable(nearest))))
        break;
      if (search_count > 1 && uses_views(method) && !may_views_reduce_error()) continue;
      const double method_error = infinite_map_error(method),
                   nearest_error = infinite_map_error(nearest);
      if (by_uvs && limit_of(method).missed == 1) continue;
      if (target_error_ > 0 && grow_until_reached(method)) return finish();
      if (is_better_match(method, method_error, nearest, nearest_error)) nearest = method;
    }
    if (largest_tried_size(nearest) == 0 && target_error_ == 0)
      bake_trial(nearest, std::min(kMinMapSize, largest_size()));
    grow_until_converged(nearest);
    for (std::size_t i = 0; i < methods_.size() && !has_chosen_points_; ++i) {
      if (largest_tried_size(methods_[i]) != 0) continue;
      infinite_map_error(methods_[i]);
      if (std::isfinite(bake_trial(methods_[i], std::min(kMinMapSize, largest_size()))))
        grow_until_converged(methods_[i]);
    }
    return finish();
  }

  /// True if a method prepares depth views instead of a BVH.
  static bool uses_views(MatchMethod method) {
    return obeys(match_row(method).info, "match.views.count");
  }

  std::vector<MatchMethod> searching_methods() const {
    std::vector<MatchMethod> methods = planned_matches(&MatchRow::plan_order);
    if (options_.bake.match.cage || options_.bake.match.cage_mesh != nullptr) {
      std::erase_if(
          methods, [](MatchMethod method) { return !obeys(match_row(method).info, "match.cage"); });
    } else if (impl_of(source_).triangles.size() > kMinTrianglesForViewsFirst) {
      std::stable_partition(methods.begin(), methods.end(), uses_views);
    }
    return methods;
  }

  void make_probe(bool uses_raster) {
    const Stopwatch watch;
    if (!probe_) {
      std::vector<ViewAngles> views;
      for (const Vec3& toward : plan_directions()) views.push_back(view_angles(toward));
      probe_.emplace(impl_of(source_), low_, options_.bake.match.cage_mesh, views, kPlanPixels,
                     uses_raster);
    }
    plan_.without_map = probe_->without_map();
    plan_.seconds_measure += watch.total();
  }

  const PlanLimit& limit_of(MatchMethod method) const {
    return *std::find_if(plan_.limits.begin(), plan_.limits.end(),
                         [&](const PlanLimit& limit) { return limit.method == method; });
  }

  /// Mean error of a method with a map of infinite resolution. Cached.
  double infinite_map_error(MatchMethod method) {
    const auto cached = infinite_maps_.find(method.name);
    if (cached != infinite_maps_.end()) return cached->second.error.mean_degrees;
    const std::string progress_text = "analysing both meshes";
    BakeOptions options =
        bake_options(method, std::min(largest_size(), kComparisonSize), progress_text);
    options.match.visibility.directions =
        std::min(options.match.visibility.directions, kComparisonSize / 8);
    if (options.match.views.size == 0 && !uses_views(methods_.front()))
      options.match.views.size = kComparisonSize / 2;
    ProgressGuard::poll_at(0, progress_text);
    const Stopwatch watch;
    const NormalProbe::InfiniteMap& infinite_map = infinite_maps_[method.name] =
        probe_->infinite_map(options, visibility_field_);
    plan_.limits.push_back({method, infinite_map.error, infinite_map.missed, watch.total()});
    if (infinite_maps_.size() == 1) {
      texels_.set_range(plan_.without_map.mean_degrees - infinite_map.error.mean_degrees);
    }
    return infinite_map.error.mean_degrees;
  }

  /// True if a method has a lower error than another. At grazing views, a matched point far from the low poly can have
  /// a larger error than a miss, so that a method could win by missing more. Therefore a method with more misses than
  /// matching by UVs never counts as better than that.
  bool is_better_match(MatchMethod method, double error, MatchMethod other,
                       double other_error) const {
    const bool misses_more =
        other == uv_method_ && limit_of(method).missed > limit_of(other).missed + kMaxMissedShare;
    return !misses_more && error < kMaxErrorRatioOfBetterMatch * other_error;
  }

  /// True if no match can reach the error even at the largest size, so that the remaining methods need no comparison.
  bool is_unreachable(MatchMethod nearest) {
    if (plan_.least > 0 || uses_views(searching_methods().front()))
      return false;  // computing the lower bound would require a BVH
    const Stopwatch watch;
    const NormalProbe::InfiniteMap& infinite_map = infinite_maps_.at(nearest.name);
    plan_.least = infinite_map.error.mean_degrees * probe_->min_error_share(infinite_map);
    plan_.seconds_measure += watch.total();
    return plan_.least + texels_.at(largest_size()) > target_error_;
  }

  /// Preparing depth views in addition to a BVH is expensive. If rays miss nothing, and no other method has a
  /// lower error, then the low poly's shape limits the error and not the match, so views are not tried.
  bool may_views_reduce_error() const {
    const PlanLimit& first = limit_of(searching_methods().front());
    return first.missed > kMaxMissedShare ||
           std::any_of(plan_.limits.begin(), plan_.limits.end(), [&](const PlanLimit& limit) {
             return limit.error.mean_degrees <
                    first.error.mean_degrees * kMaxErrorRatioOfBetterMatch;
           });
  }

  /// Bakes growing maps, from the smallest that is predicted to meet the error bound.
  /// \returns true if one of them meets it
  bool grow_until_reached(MatchMethod method) {
    for (std::uint32_t size = largest_tried_size(method); size < largest_size();) {
      size = next_size(size);
      if (infinite_map_error(method) + texels_.at(size) > target_error_ * kErrorTolerance) continue;
      const double error = bake_trial(method, size);
      if (error <= target_error_) return true;
      // A larger map cannot reduce the error below that of an infinite map.
      if (error <= infinite_map_error(method) || !std::isfinite(error)) return false;
    }
    return false;
  }

  /// Bakes growing maps until texels add less than 5% to the error of an infinite map.
  void grow_until_converged(MatchMethod method) {
    for (std::uint32_t size = largest_tried_size(method); size < largest_size();) {
      std::uint32_t sufficient_size = size;
      while (sufficient_size < largest_size() &&
             texels_.at(sufficient_size) > (kErrorTolerance - 1) * infinite_map_error(method)) {
        sufficient_size = next_size(sufficient_size);
      }
      if (sufficient_size == size || !std::isfinite(bake_trial(method, size = sufficient_size)))
        return;
    }
  }

  std::uint32_t largest_size() const { return std::min(options_.bake.width, options_.bake.height); }

  /// The next larger map size; the smallest if `size` is 0.
  std::uint32_t next_size(std::uint32_t size) const {
    return std::min(size == 0 ? kMinMapSize : 2 * size, largest_size());
  }

  /// The largest map size that was tried with a method; 0 if there was none.
  std::uint32_t largest_tried_size(MatchMethod method) const {
    std::uint32_t size = 0;
    for (const PlanTrial& trial : plan_.trials) {
      if (trial.method == method) size = std::max(size, std::min(trial.width, trial.height));
    }
    return size;
  }

  BakeOptions bake_options(MatchMethod method, std::uint32_t size,
                           const std::string& progress_text) const {
    BakeOptions bake = options_.bake;
    const double share = static_cast<double>(size) / largest_size();
    bake.width = static_cast<std::uint32_t>(std::lround(bake.width * share));
    bake.height = static_cast<std::uint32_t>(std::lround(bake.height * share));
    bake.match.method = method;
    bake.match.visibility.at = VisibilityAt::vertex;
    std::erase(bake.match.fallback, method);
    if (!options_.bounds.empty() && !all_maps_) {
      request_only(bake, {shading_map(bake).value()});
    } else if (options_.choose_rays) {
      reserve_bound_for_rays(options_.bounds, bake);
    }
    // The number of trials is unknown, so progress reports the stage alone.
    if (options_.bake.progress) {
      bake.progress = [this, progress_text](double, std::string_view) {
        return options_.bake.progress(0, progress_text);
      };
    }
    return bake;
  }

  /// Bakes a map of one size. \throws LayoutMismatch
  UnmeasuredBake bake_at(MatchMethod method, std::uint32_t size) const {
    UnmeasuredBake baked;
    baked.options = bake_options(method, size, {});
    PlanTrial& trial = baked.trial;
    trial.method = method;
    trial.width = baked.options.width;
    trial.height = baked.options.height;
    baked.options = bake_options(
        method, size,
        "trying " + std::to_string(trial.width) + " x " + std::to_string(trial.height));
    const bool stores_tangent_normals =
        !baked.options.encoding.raw && !baked.options.encoding.two_component;
    const Stopwatch watch;
    try {
      baked.result = bake_drawn(impl_of(source_), low_, baked.options,
                                stores_tangent_normals ? nullptr : &baked.normals_image);
    } catch (const Error& error) {
      if (method == uv_method_ && error.code() == ErrorCode::input) throw LayoutMismatch();
      throw;
    }
    trial.seconds = watch.total();
    const BakeReport& report = baked.result.report;
    trial.missed = report.samples == 0 ? 1 : static_cast<double>(report.missed) / report.samples;
    if (report.recall) trial.lost = report.recall->lost;
    if (method == uv_method_ && has_no_points(report)) throw LayoutMismatch();
    return baked;
  }

  static bool has_no_points(const BakeReport& report) {
    return report.samples != 0 && report.missed == report.samples;
  }

  void set_error(UnmeasuredBake& baked) {
    const Stopwatch watch;
    const Image& normals_image = baked.normals_image.pixels.empty()
                                     ? baked.result.map(*shading_map(baked.options)).image
                                     : baked.normals_image;
    baked.trial.error = probe_->with_map(normals_image, baked.options);
    plan_.seconds_measure += watch.total();
    plan_.trials.push_back(baked.trial);
  }

  /// Bakes and measures a map.
  /// \returns the mean error; infinity if no texel sample has a point
  double bake_trial(MatchMethod method, std::uint32_t size) {
    return measure(bake_at(method, size));
  }

  double measure(UnmeasuredBake baked) {
    set_error(baked);
    const PlanTrial& trial = baked.trial;
    const double error = trial.error.mean_degrees;
    texels_.add_measurement(std::min(trial.width, trial.height),
                            std::max(error - infinite_map_error(trial.method),
                                     1e-3 * infinite_map_error(trial.method)));
    // Lost parts of the surface count with the error of the mesh without a map. A later trial replaces the chosen
    // one only if its error is 2% lower, or if it is the first trial that found a point.
    const double weighted_error = error + trial.lost * plan_.without_map.mean_degrees;
    const bool has_points = !has_no_points(baked.result.report);
    const bool is_first = plan_.trials.size() == 1 || (has_points && !has_chosen_points_);
    if (is_first || (has_points && ((target_error_ > 0 && error <= target_error_) ||
                                    weighted_error <= 0.98 * best_score_))) {
      best_score_ = weighted_error;
      has_chosen_points_ = has_points;
      plan_.chosen = trial;
      plan_.result = std::move(baked.result);
    }
    return has_points ? error : std::numeric_limits<double>::infinity();
  }

  PlannedBake finish() {
    plan_.wanted = target_error_ > 0 ? target_error_ : plan_.chosen.error.mean_degrees;
    if (!options_.bounds.empty()) bake_within_bounds();
    plan_.reached = has_chosen_points_ && plan_.chosen.error.mean_degrees <= plan_.wanted &&
                    are_all_bounds_reached(plan_.bounds);
    return std::move(plan_);
  }

  /// Bakes all maps with the chosen match at growing sizes until each is within its bound.
  void bake_within_bounds() {
    all_maps_ = true;
    for (std::uint32_t size = std::min(plan_.chosen.width, plan_.chosen.height);;
         size = next_size(size)) {
      UnmeasuredBake baked = bake_at(plan_.chosen.method, size);
      const Stopwatch watch;
      plan_.bounds =
          reached_bounds(impl_of(source_), low_, baked.options, options_.bounds, baked.result);
      plan_.seconds_measure += watch.total();
      set_error(baked);
      plan_.chosen = baked.trial;
      plan_.result = std::move(baked.result);
      if (are_all_bounds_reached(plan_.bounds) || size == largest_size()) return;
    }
  }

  const Source& source_;
  const Mesh& low_;
  const PlanOptions& options_;
  const double target_error_;
  const MatchMethod uv_method_ = match_at_uvs();
  std::vector<MatchMethod> methods_;  // Methods in increasing order of cost
  std::optional<NormalProbe> probe_;
  std::shared_ptr<const VisibilityField> visibility_field_;
  // Errors with a map of infinite resolution, by the name of the match
  std::map<std::string_view, NormalProbe::InfiniteMap> infinite_maps_;
  TexelError texels_;
  PlannedBake plan_;
  double best_score_ = 0;
  bool has_chosen_points_ = false;  // True if the chosen trial found a point for any sample
  // True while bake_within_bounds() bakes all maps; before that, only the normal map is baked
  bool all_maps_ = false;
};

}  // namespace

PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options) {
  const auto require = [](bool holds, const std::string& text) {
    if (!holds) throw Error(ErrorCode::usage, text);
  };
  require(
      std::isfinite(options.max_error) && options.max_error >= 0,
      "max_error is " + decimal(options.max_error) + " degrees: it must be finite, and 0 or more.");
  require(options.bake.match.saved == nullptr,
          "A plan chooses the match, but a saved match was given: leave it out.");
  require(shading_map(options.bake).has_value(),
          "A plan measures normal maps: add a normal map to the maps.");
  check_bounds(options.bake, options.bounds);
  return MatchPlanner(source, low, options).run();
}

}  // namespace kiln

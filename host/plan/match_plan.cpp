// The cheapest match and the smallest map for a given low poly: see bake_planned().
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

using plan_settings::kGain;

/// The smallest map that is tried: smaller ones take as long.
constexpr std::uint32_t kFirstSize = 128;
/// Triangles from which on building the BVH takes longer than all else, so that depth views come first.
constexpr std::size_t kMany = 2000000;
/// Rays may miss this share of places without there being something wrong.
constexpr double kFewMissed = 0.01;
/// An error so near to that of an endless map is as good as it; what is expected to be so far above the bound may be within it.
constexpr double kNear = 1.05;
/// Size of map for which matches that are only looked at are prepared, with depth views of half of it and visibility from
/// an eighth as many directions.
constexpr std::uint32_t kLookSize = 1024;

/// The two layouts turned out not to agree, at one size or another, or nothing lies at the same UVs.
struct Unfit {};

/// Error that texels add to a match's error with an endless map: 1 / (1 / range + rate s^2). A tiny map is as bad as none, a large one off by
/// the square of its texels' size.
class TexelError {
 public:
  double at(std::uint32_t size) const { return 1 / (1 / range_ + rate_ * size * size); }

  /// \param plain  the error without any map, over that of an endless one
  void begin(double plain) { range_ = std::max(plain, kLeast); }
  void measured(std::uint32_t size, double above) {
    above = std::max(above, kLeast);
    const double texels = 1.0 * size * size;
    // A tiny map, whose charts have few texels, is worse than none, and how much worse is not known.
    range_ = std::max(range_, 2 * above);
    rate_ = (1 / above - 1 / range_) / texels;
    if (texels_ > 0) {
      // Two sizes tell both.
      const double rate = (1 / above - 1 / above_) / (texels - texels_);
      const double start = 1 / above - rate * texels;
      if (rate > 0 && start > 0) {
        rate_ = rate;
        range_ = 1 / start;
      }
    }
    texels_ = texels;
    above_ = above;
  }

 private:
  static constexpr double kLeast = 1e-6;
  double range_ = kLeast, rate_ = 0;
  double texels_ = 0, above_ = 0;  // Of the last map
};

class MatchPlanner {
 public:
  MatchPlanner(const Source& source, const Mesh& low, const PlanOptions& options)
      : source_(source), low_(low), options_(options), wanted_(options.max_error) {}

  PlannedBake run() {
    const ProgressScope alive(options_.bake.progress);
    return unless_cancelled<PlannedBake>(
        [this] {
          const bool cage = options_.bake.match.cage || options_.bake.match.cage_mesh != nullptr;
          try {
            return planned(!cage && !impl_of(source_).uvs.empty());
          } catch (const Unfit&) {
            planned_ = {};
            texels_ = {};
            infinite_maps_.clear();
            best_weighed_ = 0;
            finds_ = false;
            return planned(/*by_uvs=*/false);
          }
        },
        [](PlannedBake& none) { none.result.cancelled = true; });
  }

 private:
  /// One bake, yet to be measured.
  struct Baked {
    PlanTrial trial;
    BakeOptions options;
    BakeResult result;
    Image drawn;  // The normals as renderers read them, where the map holds them otherwise
  };

  PlannedBake planned(bool by_uvs) {
    methods_ = searching_methods();
    if (by_uvs) methods_.insert(methods_.begin(), by_uv_);
    // The first map comes before pictures: it tells whether layouts agree.
    Baked baked = bake_at(methods_.front(), std::min(kFirstSize, largest()));
    take_pictures(by_views(methods_[by_uvs ? 1 : 0]) || (by_uvs && wanted_ > 0));
    infinite_map_error(methods_.front());
    if (measure(std::move(baked)) <= wanted_) return finished();
    MatchMethod nearest = methods_.front();
    for (std::size_t i = 0; i < methods_.size(); ++i) {
      const MatchMethod method = methods_[i];
      const std::size_t searching = by_uvs ? i : i + 1;  // Methods that search, this one included
      if (searching > 1 && (wanted_ == 0 || (finds_ && is_hopeless(nearest)))) break;
      if (searching > 1 && by_views(method) && !views_may_help()) continue;
      const double own = infinite_map_error(method), other = infinite_map_error(nearest);
      if (by_uvs && look_at(method).missed == 1) continue;
      if (wanted_ > 0 && grow_until_reached(method)) return finished();
      if (gains(method, own, nearest, other)) nearest = method;
    }
    if (tried(nearest) == 0 && wanted_ == 0) trial(nearest, std::min(kFirstSize, largest()));
    grow_until_flat(nearest);
    for (std::size_t i = 0; i < methods_.size() && !finds_; ++i) {
      if (tried(methods_[i]) != 0) continue;
      infinite_map_error(methods_[i]);
      if (std::isfinite(trial(methods_[i], std::min(kFirstSize, largest()))))
        grow_until_flat(methods_[i]);
    }
    return finished();
  }

  /// Its preparation is no BVH, but depth views.
  static bool by_views(MatchMethod method) {
    return obeys(match_row(method).info, "match.views.count");
  }

  std::vector<MatchMethod> searching_methods() const {
    std::vector<MatchMethod> methods = planned_matches(&MatchRow::plan_order);
    if (options_.bake.match.cage || options_.bake.match.cage_mesh != nullptr) {
      std::erase_if(methods,
                    [](MatchMethod way) { return !obeys(match_row(way).info, "match.cage"); });
    } else if (impl_of(source_).triangles.size() > kMany) {
      std::stable_partition(methods.begin(), methods.end(), by_views);
    }
    return methods;
  }

  void take_pictures(bool raster) {
    const Stopwatch watch;
    if (!probe_) {
      std::vector<ViewAngles> views;
      for (const Vec3& toward : plan_directions()) views.push_back(view_angles(toward));
      probe_.emplace(impl_of(source_), low_, options_.bake.match.cage_mesh, views, kPlanPixels,
                     raster);
    }
    planned_.without_map = probe_->without_map();
    planned_.seconds_measure += watch.total();
  }

  const PlanLimit& look_at(MatchMethod method) const {
    return *std::find_if(planned_.limits.begin(), planned_.limits.end(),
                         [&](const PlanLimit& limit) { return limit.method == method; });
  }

  /// The mean error that a map of endless size would reach. Found once.
  double infinite_map_error(MatchMethod method) {
    const auto known = infinite_maps_.find(method.name);
    if (known != infinite_maps_.end()) return known->second.error.mean_degrees;
    const std::string doing = "looking at both meshes";
    BakeOptions options = bake_options(method, std::min(largest(), kLookSize), doing);
    options.match.visibility.directions =
        std::min(options.match.visibility.directions, kLookSize / 8);
    if (options.match.views.size == 0 && !by_views(methods_.front()))
      options.match.views.size = kLookSize / 2;
    ProgressGuard::poll_at(0, doing);
    const Stopwatch watch;
    const NormalProbe::InfiniteMap& found = infinite_maps_[method.name] =
        probe_->infinite_map(options, field_);
    planned_.limits.push_back({method, found.error, found.missed, watch.total()});
    if (infinite_maps_.size() == 1) {
      texels_.begin(planned_.without_map.mean_degrees - found.error.mean_degrees);
    }
    return found.error.mean_degrees;
  }

  /// True if one way gets nearer than another. Seen from aslant, heights far off the low poly may look worse than none:
  /// what finds less than UVs do is no better for it.
  bool gains(MatchMethod method, double error, MatchMethod other, double other_error) const {
    const bool finds_less =
        other == by_uv_ && look_at(method).missed > look_at(other).missed + kFewMissed;
    return !finds_less && error < kGain * other_error;
  }

  /// True if no match is good enough, so that there is no need to look at others.
  bool is_hopeless(MatchMethod nearest) {
    if (planned_.least > 0 || by_views(searching_methods().front()))
      return false;  // That takes a BVH to tell.
    const Stopwatch watch;
    const NormalProbe::InfiniteMap& found = infinite_maps_.at(nearest.name);
    planned_.least = found.error.mean_degrees * probe_->least_share(found);
    planned_.seconds_measure += watch.total();
    return planned_.least + texels_.at(largest()) > wanted_;
  }

  /// Depth views take longer to prepare than all else where there is a BVH. Where rays miss nothing and no other way gets
  /// nearer, it is not the match that is wrong, but what a low poly of this shape can show.
  bool views_may_help() const {
    const PlanLimit& first = look_at(searching_methods().front());
    return first.missed > kFewMissed ||
           std::any_of(planned_.limits.begin(), planned_.limits.end(), [&](const PlanLimit& limit) {
             return limit.error.mean_degrees < first.error.mean_degrees * kGain;
           });
  }

  /// Bakes larger maps, from the smallest that is expected to reach the error on. \returns whether one did
  bool grow_until_reached(MatchMethod method) {
    for (std::uint32_t size = tried(method); size < largest();) {
      size = next(size);
      if (infinite_map_error(method) + texels_.at(size) > wanted_ * kNear) continue;
      const double error = trial(method, size);
      if (error <= wanted_) return true;
      // Larger maps gain nothing, or find no more.
      if (error <= infinite_map_error(method) || !std::isfinite(error)) return false;
    }
    return false;
  }

  /// Bakes larger maps until a still larger one would not improve much.
  void grow_until_flat(MatchMethod method) {
    for (std::uint32_t size = tried(method); size < largest();) {
      std::uint32_t enough = size;
      while (enough < largest() && texels_.at(enough) > (kNear - 1) * infinite_map_error(method)) {
        enough = next(enough);
      }
      if (enough == size || !std::isfinite(trial(method, size = enough))) return;
    }
  }

  std::uint32_t largest() const { return std::min(options_.bake.width, options_.bake.height); }

  /// 0: none yet.
  std::uint32_t next(std::uint32_t size) const {
    return std::min(size == 0 ? kFirstSize : 2 * size, largest());
  }

  /// The largest size that was tried, 0 where none was.
  std::uint32_t tried(MatchMethod method) const {
    std::uint32_t size = 0;
    for (const PlanTrial& trial : planned_.trials) {
      if (trial.method == method) size = std::max(size, std::min(trial.width, trial.height));
    }
    return size;
  }

  BakeOptions bake_options(MatchMethod method, std::uint32_t size, const std::string& doing) const {
    BakeOptions bake = options_.bake;
    const double share = static_cast<double>(size) / largest();
    bake.width = static_cast<std::uint32_t>(std::lround(bake.width * share));
    bake.height = static_cast<std::uint32_t>(std::lround(bake.height * share));
    bake.match.method = method;
    bake.match.visibility.at = VisibilityAt::vertex;
    std::erase(bake.match.fallback, method);
    if (!options_.bounds.empty() && !all_maps_) {
      ask_for(bake, {shading_map(bake).value()});
    } else if (options_.choose_rays) {
      leave_to_rays(options_.bounds, bake);
    }
    // The number of trials is not known: progress says what is going on.
    if (options_.bake.progress) {
      bake.progress = [this, doing](double, std::string_view) {
        return options_.bake.progress(0, doing);
      };
    }
    return bake;
  }

  /// \throws Unfit
  Baked bake_at(MatchMethod method, std::uint32_t size) const {
    Baked baked;
    baked.options = bake_options(method, size, {});
    PlanTrial& trial = baked.trial;
    trial.method = method;
    trial.width = baked.options.width;
    trial.height = baked.options.height;
    baked.options = bake_options(
        method, size,
        "trying " + std::to_string(trial.width) + " x " + std::to_string(trial.height));
    const bool plain = !baked.options.encoding.raw && !baked.options.encoding.two_component;
    const Stopwatch watch;
    try {
      baked.result =
          bake_drawn(impl_of(source_), low_, baked.options, plain ? nullptr : &baked.drawn);
    } catch (const Error& error) {
      if (method == by_uv_ && error.code() == ErrorCode::input) throw Unfit();
      throw;
    }
    trial.seconds = watch.total();
    const BakeReport& report = baked.result.report;
    trial.missed = report.samples == 0 ? 1 : static_cast<double>(report.missed) / report.samples;
    if (report.recall) trial.lost = report.recall->lost;
    if (method == by_uv_ && found_nothing(report)) throw Unfit();
    return baked;
  }

  static bool found_nothing(const BakeReport& report) {
    return report.samples != 0 && report.missed == report.samples;
  }

  void set_error(Baked& baked) {
    const Stopwatch watch;
    const Image& drawn = baked.drawn.pixels.empty()
                             ? baked.result.map(*shading_map(baked.options)).image
                             : baked.drawn;
    baked.trial.error = probe_->with_map(drawn, baked.options);
    planned_.seconds_measure += watch.total();
    planned_.trials.push_back(baked.trial);
  }

  /// Bakes and measures. \returns the mean error; infinite where nothing was found
  double trial(MatchMethod method, std::uint32_t size) { return measure(bake_at(method, size)); }

  double measure(Baked baked) {
    set_error(baked);
    const PlanTrial& trial = baked.trial;
    const double error = trial.error.mean_degrees;
    texels_.measured(std::min(trial.width, trial.height),
                     std::max(error - infinite_map_error(trial.method),
                              1e-3 * infinite_map_error(trial.method)));
    // Lost places count as without a map. A larger map must be worth it. A match that found nothing gives way to anything.
    const double weighed = error + trial.lost * planned_.without_map.mean_degrees;
    const bool finds = !found_nothing(baked.result.report);
    const bool first = planned_.trials.size() == 1 || (finds && !finds_);
    if (first ||
        (finds && ((wanted_ > 0 && error <= wanted_) || weighed <= 0.98 * best_weighed_))) {
      best_weighed_ = weighed;
      finds_ = finds;
      planned_.chosen = trial;
      planned_.result = std::move(baked.result);
    }
    return finds ? error : std::numeric_limits<double>::infinity();
  }

  PlannedBake finished() {
    planned_.wanted = wanted_ > 0 ? wanted_ : planned_.chosen.error.mean_degrees;
    if (!options_.bounds.empty()) reach_bounds();
    planned_.reached = finds_ && planned_.chosen.error.mean_degrees <= planned_.wanted &&
                       all_reached(planned_.bounds);
    return std::move(planned_);
  }

  /// Bakes all maps with the way to match that was chosen, ever larger until each is within its bound.
  void reach_bounds() {
    all_maps_ = true;
    for (std::uint32_t size = std::min(planned_.chosen.width, planned_.chosen.height);;
         size = next(size)) {
      Baked all = bake_at(planned_.chosen.method, size);
      const Stopwatch watch;
      planned_.bounds =
          reached_bounds(impl_of(source_), low_, all.options, options_.bounds, all.result);
      planned_.seconds_measure += watch.total();
      set_error(all);
      planned_.chosen = all.trial;
      planned_.result = std::move(all.result);
      if (all_reached(planned_.bounds) || size == largest()) return;
    }
  }

  const Source& source_;
  const Mesh& low_;
  const PlanOptions& options_;
  const double wanted_;
  const MatchMethod by_uv_ = match_at_uvs();
  std::vector<MatchMethod> methods_;  // In the order of their cost
  std::optional<NormalProbe> probe_;
  std::shared_ptr<const VisibilityField> field_;
  std::map<std::string_view, NormalProbe::InfiniteMap> infinite_maps_;  // By the method's name
  TexelError texels_;
  PlannedBake planned_;
  double best_weighed_ = 0;
  bool finds_ = false;     // The chosen trial found something
  bool all_maps_ = false;  // Bakes make all maps, where bounds are reached after the normal map's
};

}  // namespace

PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options) {
  const auto require = [](bool holds, const std::string& text) {
    if (!holds) throw Error(ErrorCode::usage, text);
  };
  require(std::isfinite(options.max_error) && options.max_error >= 0,
          "The error to reach is " + decimal(options.max_error) +
              " degrees: it must be finite, and 0 or more.");
  require(options.bake.match.saved == nullptr,
          "A plan chooses how to match, but a saved match was given.");
  require(shading_map(options.bake).has_value(),
          "A plan measures normal maps, but none is among the maps: add it.");
  check_bounds(options.bake, options.bounds);
  return MatchPlanner(source, low, options).run();
}

}  // namespace kiln

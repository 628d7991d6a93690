#include "kiln/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bake/pipeline.h"
#include "kiln/progress.h"
#include "measure/bounds.h"
#include "measure/normal_probe.h"
#include "measure/outlook.h"
#include "measure/plan_limits.h"

namespace kiln {
namespace {

/// Its preparation is no BVH, but depth views.
bool by_views(MatchMethod method) { return match_row(method).info.takes_views; }

class Planner {
 public:
  Planner(const Source& source, const Mesh& low, const PlanOptions& options)
      : source_(source), low_(low), options_(options), methods_(methods()) {
    const bool cage = options.bake.cage || options.bake.cage_mesh != nullptr;
    try_uv_ = !cage && !impl_of(source).uvs.empty();
  }

  PlannedBake run() {
    const ProgressScope alive(options_.bake.progress);
    const auto plan = [this] {
      try {
        return planned();
      } catch (const Unfit&) {
        try_uv_ = false;
        forget();
        return planned();
      }
    };
    return unless_cancelled<PlannedBake>(plan,
                                         [](PlannedBake& none) { none.result.cancelled = true; });
  }

 private:
  /// One bake, yet to be measured.
  struct Baked {
    PlanTrial trial;
    BakeOptions options;
    BakeResult result;
    Image drawn;  // the normals as renderers read them, where the map holds them otherwise
  };

  PlannedBake planned() {
    const double wanted = options_.max_error;
    const MatchMethod first = methods_.front();
    const std::uint32_t size = std::min(kFirstSize, largest());
    // Whether the layouts agree is known once they were baked with.
    std::optional<Baked> by_uv;
    if (try_uv_) by_uv = baked(by_uv_, size);
    take_pictures(by_views(first) || (by_uv && wanted > 0));
    const double plain = planned_.without_map.mean_degrees;
    std::optional<Outlook> uv;
    if (by_uv) {
      uv.emplace(limit(by_uv_), plain);
      if (measured(std::move(*by_uv), *uv) <= wanted) return finished(wanted);
      // Where not even an endless map is expected to reach it, another way may do at less cost.
      const bool within = wanted > 0 && uv->limit() <= wanted;
      if (within && climb(by_uv_, *uv, wanted)) return finished(wanted);
    }
    const double first_limit = limit(first);
    Outlook outlook = uv ? uv->with_limit(first_limit) : Outlook(first_limit, plain);
    const bool stay = uv && !gains(first, first_limit, by_uv_, uv->limit());
    if (wanted == 0) {
      if (!stay && trial(first, size, outlook) <= wanted) return finished(wanted);
      stay ? level(by_uv_, *uv) : level(first, outlook);
      find_something(size, outlook);
      return finished(best_error_);
    }
    if (!uv && trial(first, size, outlook) <= wanted) return finished(wanted);
    // The first way that is expected to reach it; and where none is, the one that gets nearest.
    MatchMethod nearest = uv ? by_uv_ : first;
    Outlook nearest_outlook = uv ? *uv : outlook;
    for (std::size_t i = 0; i < methods_.size(); ++i) {
      const MatchMethod method = methods_[i];
      if (i == 1 && best_finds_ && hopeless(nearest_outlook, wanted)) break;
      if (by_views(method) && !may_help(method)) continue;
      Outlook own = method == first ? outlook : outlook.with_limit(limit(method));
      if (uv && limit_of(method).missed == 1) continue;
      if (climb(method, own, wanted)) return finished(wanted);
      if (method == first) outlook = own;
      if (method == nearest || gains(method, own.limit(), nearest, nearest_outlook.limit())) {
        nearest = method;
        nearest_outlook = own;
      }
    }
    level(nearest, nearest_outlook);
    find_something(size, outlook);
    return finished(wanted);
  }

  /// Where all trials found nothing, takes the next way that finds something.
  void find_something(std::uint32_t size, const Outlook& outlook) {
    for (const MatchMethod method : methods_) {
      if (best_finds_) return;
      if (tried(method) != 0) continue;
      Outlook own = outlook.with_limit(limit(method));
      if (std::isfinite(trial(method, size, own))) level(method, own);
    }
  }

  void take_pictures(bool raster) {
    const Stopwatch watch;
    if (!probe_) {
      std::vector<ViewAngles> views;
      for (const Vec3& toward : held_out_views(kPlanViews, spread_views(12))) {
        views.push_back(view_angles(toward));
      }
      probe_.emplace(impl_of(source_), low_, options_.bake.cage_mesh, views, kPlanPixels, raster);
    }
    planned_.without_map = probe_->without_map();
    planned_.seconds_measure += watch.total();
  }

  /// Of a way that was looked at.
  const PlanLimit& limit_of(MatchMethod method) const {
    return *std::find_if(planned_.limits.begin(), planned_.limits.end(),
                         [&](const PlanLimit& limit) { return limit.method == method; });
  }

  /// Whether one way gets nearer than another with a lower limit. Seen from aslant, heights far off the
  /// low poly may look worse than none; what then finds less than UVs do is no better for it.
  bool gains(MatchMethod method, double limit, MatchMethod other, double other_limit) const {
    const bool finds_less =
        other == by_uv_ && limit_of(method).missed > limit_of(other).missed + kFewMissed;
    return !finds_less && limit < kGain * other_limit;
  }

  /// All that was found, but for the pictures and the seconds that they took.
  void forget() {
    const double seconds = planned_.seconds_measure;
    planned_ = {};
    planned_.seconds_measure = seconds;
    best_error_ = best_weighed_ = 0;
    best_finds_ = false;
    nearest_limit_.reset();
  }

  /// Whether no match is good enough, so that there is no need to look at others.
  bool hopeless(const Outlook& outlook, double wanted) {
    if (by_views(methods_.front())) return false;  // it takes a hierarchy to tell
    const Stopwatch watch;
    planned_.least = outlook.limit() * probe_->least_share(*nearest_limit_);
    planned_.seconds_measure += watch.total();
    return outlook.with_limit(planned_.least).error(largest()) > wanted;
  }

  /// Preparing depth views takes longer than all else where a hierarchy is there already. Where rays miss
  /// nothing and no other way gets nearer than they do, it is not the match that is wrong, but what a low
  /// poly of this shape can show.
  bool may_help(MatchMethod method) const {
    if (methods_.front() == method) return true;
    const PlanLimit& first =
        *std::find_if(planned_.limits.begin(), planned_.limits.end(),
                      [&](const PlanLimit& limit) { return limit.method == methods_.front(); });
    if (first.missed > kFewMissed) return true;
    return std::any_of(planned_.limits.begin(), planned_.limits.end(), [&](const PlanLimit& limit) {
      return limit.error.mean_degrees < first.error.mean_degrees * kGain;
    });
  }

  /// Bakes from the smallest size that is expected to reach the error on. \returns whether one did
  bool climb(MatchMethod method, Outlook& outlook, double wanted) {
    for (std::uint32_t size = tried(method);;) {
      do {
        if (size == largest()) return false;
        size = next(size);
      } while (outlook.error(size) > wanted * kNear);
      const double error = trial(method, size, outlook);
      if (error <= wanted) return true;
      // Larger maps gain nothing, or find no more.
      if (error <= outlook.limit() || !std::isfinite(error)) return false;
    }
  }

  /// Bakes at the smallest size that larger ones would not improve on much.
  void level(MatchMethod method, Outlook& outlook) {
    for (std::uint32_t size = tried(method); size < largest();) {
      std::uint32_t enough = size;
      while (enough < largest() && outlook.error(enough) > outlook.limit() * kLevel) {
        enough = next(enough);
      }
      if (enough == size) return;
      if (!std::isfinite(trial(method, size = enough, outlook))) return;
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

  std::vector<MatchMethod> methods() const {
    std::vector<MatchMethod> ways = planned_matches(&MatchRow::plan_turn);
    if (options_.bake.cage || options_.bake.cage_mesh != nullptr) {
      std::erase_if(ways, [](MatchMethod way) { return !match_row(way).info.takes_cage; });
    } else if (impl_of(source_).triangles.size() > kMany) {
      std::stable_partition(ways.begin(), ways.end(), by_views);
    }
    return ways;
  }

  BakeOptions bake_options(MatchMethod method, std::uint32_t size, const std::string& doing) const {
    BakeOptions bake = options_.bake;
    const double share = static_cast<double>(size) / largest();
    bake.width = static_cast<std::uint32_t>(std::lround(bake.width * share));
    bake.height = static_cast<std::uint32_t>(std::lround(bake.height * share));
    bake.method = method;
    bake.visibility.at = VisibilityAt::vertex;
    std::erase(bake.fallback, method);
    if (!options_.bounds.empty() && !all_maps_) {
      bake.maps = {shading_map(bake).value()};
      bake.transfers.clear();
      bake.own_maps.clear();
    } else if (options_.choose_rays) {
      leave_to_rays(options_.bounds, bake);
    }
    // How many trials there will be is not known: progress says what is going on.
    if (options_.bake.progress) {
      bake.progress = [this, doing](double, std::string_view) {
        return options_.bake.progress(0, doing);
      };
    }
    return bake;
  }

  /// \returns the mean error that an endless map would reach
  double limit(MatchMethod method) {
    const std::string doing = "looking at both meshes";
    BakeOptions options = bake_options(method, std::min(largest(), kLimitSize), doing);
    // What is unlikely to be chosen is looked at coarsely.
    options.visibility.directions = std::min(options.visibility.directions, kLimitDirections);
    if (options.views.size == 0 && method != methods_.front()) options.views.size = kLimitView;
    Heartbeat::at(0, doing);
    const Stopwatch watch;
    NormalProbe::Limit limit = probe_->limit(options, field_);
    planned_.limits.push_back({method, limit.error, limit.missed, watch.total()});
    const double mean = limit.error.mean_degrees;
    const bool candidate = method == by_uv_ || method == methods_.front();
    if (candidate && (!nearest_limit_ || mean < kGain * nearest_limit_->error.mean_degrees)) {
      nearest_limit_ = std::move(limit);
    }
    return mean;
  }

  /// \throws Unfit
  Baked baked(MatchMethod method, std::uint32_t size) const {
    Baked baked;
    PlanTrial& trial = baked.trial;
    BakeOptions& options = baked.options;
    trial.method = method;
    options = bake_options(method, size, {});
    trial.width = options.width;
    trial.height = options.height;
    options = bake_options(
        method, size,
        "trying " + std::to_string(options.width) + " x " + std::to_string(options.height));
    const Stopwatch watch;
    try {
      const bool plain = !options.raw && !options.two_component;
      baked.result = bake_drawn(impl_of(source_), low_, options, plain ? nullptr : &baked.drawn);
    } catch (const Error& error) {
      if (method == by_uv_ && error.code() == ErrorCode::input) throw Unfit();
      throw;
    }
    if (method == by_uv_ && found_nothing(baked.result.report)) throw Unfit();
    trial.seconds = watch.total();
    return baked;
  }

  /// Bakes and measures. \returns the mean error; infinite where nothing was found
  double trial(MatchMethod method, std::uint32_t size, Outlook& outlook) {
    return measured(baked(method, size), outlook);
  }

  double measured(Baked baked, Outlook& outlook) {
    BakeResult& result = baked.result;
    PlanTrial& trial = baked.trial;
    const Stopwatch watch;
    const BakeReport& report = result.report;
    trial.missed = missed_share(report);
    trial.error = with_map(baked);
    if (report.recall) trial.lost = report.recall->lost;
    planned_.seconds_measure += watch.total();
    planned_.trials.push_back(trial);
    const double error = trial.error.mean_degrees;
    // What was lost counts as without a map.
    const double weighed = error + trial.lost * planned_.without_map.mean_degrees;
    outlook.measured(std::min(trial.width, trial.height), error);
    const bool finds = !found_nothing(report);
    const bool reached = options_.max_error > 0 && error <= options_.max_error;
    // A larger map must be worth it. One that found nothing gives way to any that found something.
    const bool first = best_error_ == 0 || (finds && !best_finds_);
    if (first || (finds && (reached || weighed <= best_weighed_ * 0.98))) {
      best_error_ = error;
      best_weighed_ = weighed;
      best_finds_ = finds;
      planned_.chosen = trial;
      planned_.result = std::move(result);
    }
    return finds ? error : std::numeric_limits<double>::infinity();
  }

  PlannedBake finished(double wanted) {
    planned_.wanted = wanted;
    if (!options_.bounds.empty()) reach_bounds();
    planned_.reached =
        best_finds_ && planned_.chosen.error.mean_degrees <= wanted && all_reached(planned_.bounds);
    return std::move(planned_);
  }

  /// Bakes all maps with the way to match that was chosen, ever larger until each is within its bound.
  void reach_bounds() {
    const MatchMethod method = planned_.chosen.method;
    all_maps_ = true;
    for (std::uint32_t size = std::min(planned_.chosen.width, planned_.chosen.height);;) {
      Baked all = baked(method, size);
      const Stopwatch watch;
      planned_.bounds =
          reached_bounds(impl_of(source_), low_, all.options, options_.bounds, all.result);
      all.trial.error = with_map(all);
      planned_.seconds_measure += watch.total();
      if (all.result.report.recall) all.trial.lost = all.result.report.recall->lost;
      all.trial.missed = missed_share(all.result.report);
      planned_.trials.push_back(all.trial);
      planned_.chosen = all.trial;
      planned_.result = std::move(all.result);
      if (all_reached(planned_.bounds) || size == largest()) return;
      size = next(size);
    }
  }

  NormalError with_map(const Baked& baked) const {
    const Image& drawn = baked.drawn.pixels.empty()
                             ? baked.result.map(*shading_map(baked.options)).image
                             : baked.drawn;
    return probe_->with_map(drawn, baked.options);
  }

  const Source& source_;
  const Mesh& low_;
  const PlanOptions& options_;
  const std::vector<MatchMethod> methods_;  // that search
  const MatchMethod by_uv_ = match_at_uvs();
  bool try_uv_ = false;  // before them
  std::optional<NormalProbe> probe_;
  std::shared_ptr<const VisibilityField> field_;
  std::optional<NormalProbe::Limit> nearest_limit_;  // of UVs and the first way
  PlannedBake planned_;
  double best_error_ = 0, best_weighed_ = 0;
  bool best_finds_ = false;
  bool all_maps_ = false;  // bakes make all maps, where bounds are reached after the normal map's
};

}  // namespace

PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options) {
  if (!std::isfinite(options.max_error) || options.max_error < 0) {
    throw Error(ErrorCode::usage, "The error to reach is " + std::to_string(options.max_error) +
                                      " degrees: it must be finite, and 0 or more.");
  }
  if (options.bake.match != nullptr) {
    throw Error(ErrorCode::usage, "A plan chooses how to match, but a saved match was given.");
  }
  if (!shading_map(options.bake)) {
    throw Error(ErrorCode::usage,
                "A plan measures normal maps, but none is among the maps: add it.");
  }
  check_bounds(options.bake, options.bounds);
  return Planner(source, low, options).run();
}

}  // namespace kiln

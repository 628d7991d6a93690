#include "kiln/light_plan.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "bake/pipeline.h"
#include "kiln/plan.h"
#include "kiln/progress.h"
#include "lowpoly/keep_colors.h"
#include "measure/bounds.h"
#include "measure/light_check.h"
#include "measure/light_limits.h"
#include "measure/light_looks.h"
#include "measure/light_planner.h"
#include "measure/light_trials.h"

namespace kiln {
namespace {
using namespace light_limits;

class LightPlanner {
 public:
  LightPlanner(const Source& source, const Mesh& high, const LightPlanOptions& options,
               LevelCache& cache, std::uint64_t most_faces)
      : source_(source),
        high_(high),
        options_(options),
        most_faces_(most_faces),
        bake_(options.bake),
        alive_(bake_.progress),
        looks_(source, high, bake_, plan_, cache) {
    plan_.wanted = options.max_error;
    may_leave_map_out_ = options.may_leave_map_out && options.bounds.empty();
    if (options.choose_rays) leave_to_rays(options.bounds, bake_);
    cost_.bits = options.bits != 0 ? options.bits : options.max_error < kEightBits ? 16 : 8;
    cost_.channels = map_channels(bake_);
    largest_ = std::min(bake_.width, bake_.height);
    for (std::uint32_t size = kSmallestMap; size <= largest_; size *= 2) sizes_.push_back(size);
  }

  LightBake run() {
    return unless_cancelled<LightBake>([this] { return planned(); },
                                       [](LightBake& none) { none.cancelled = true; });
  }

 private:
  /// A mesh laid out for a size, with its map.
  struct Made {
    std::size_t level = 0;
    Mesh low;
    UnwrapReport unwrapped;
    BakeOptions bake;
    LightTrial trial;
  };

  LightBake planned() {
    looks_.take_pictures(options_.screen);
    first_map();
    search_and_bake();
    while (!all_reached(plan_.bounds) && plan_.chosen.size < largest_) {
      // A map of this size does not do for another map, whatever the mesh is.
      std::erase_if(sizes_, [&](std::uint32_t size) { return size <= plan_.chosen.size; });
      best_.reset();
      earlier_ = plan_.trials.size();
      const LightTrial next = *best_expected();
      try_map(next_level_, next.size);
      search_and_bake();
    }
    // Its deviation takes long to measure, so only that of what was chosen is.
    const Stopwatch watch;
    levels().mesh(best_->level, &plan_.simplified);
    plan_.seconds_simplify += watch.total();
    plan_.reached = plan_.chosen.measured <= options_.max_error && all_reached(plan_.bounds);
    fill_trade(
        plan_, model(), all_sizes(),
        [this](std::size_t level, std::uint32_t size) { return guess_of(level, size); },
        [this](std::uint32_t size) { return misses_at(size).aim(options_.max_error); });
    return std::move(plan_);
  }

  /// The lightest with maps of the sizes that are left. Meshes to choose among may have flaws that take long to mend:
  /// what was chosen is mended, and tried again.
  void search() {
    try_pairs();
    for (int i = 0; i < kMostMended && looks_.is_flawed(best_->level); ++i) {
      const std::size_t level = best_->level;
      const std::uint32_t size = best_->trial.size;
      looks_.solve(level);
      best_.reset();
      try_pair(level, size);
      if (!best_reached()) try_pairs();
    }
  }

  /// Tries look from few directions. Where that told too little, from all of them.
  void search_and_bake() {
    search();
    bake_all_maps();
    if (plan_.chosen.measured <= options_.max_error || !best_reached() || all_directions_) return;
    all_directions_ = true;
    correct(plan_.trials, best_->trial = plan_.chosen);
    search();
    bake_all_maps();
  }

  void try_pairs() {
    while (plan_.trials.size() - earlier_ < (best_reached() ? kMostTrials : kMostTrialsToReach)) {
      std::optional<LightTrial> next = best_expected();
      for (int i = 0; i < kMostLooks && next && next->size == 0 && !model().knows(next_level_);
           ++i) {
        model().exactly(next_level_);
        next = best_expected();
      }
      // What was expected to do and did not: a little more of it.
      while (next && !best_reached() && was_tried(plan_.trials, next->faces, next->size) &&
             next_level_ > finest()) {
        next = trial_of(--next_level_, next->size);
      }
      if (next && worth_trying(*next)) {
        try_pair(next_level_, next->size);
      } else if (!best_reached() || !try_another_size()) {
        break;
      }
    }
  }

  /// Errors of one size were known from other meshes alone: once, whether they are less. \returns false if none is
  bool try_another_size() {
    if (std::exchange(tried_another_, true)) return false;
    // The fewer maps were tried, the less guesses are worth.
    const double perhaps = plan_.trials.size() < kFewTrials ? kPerhapsEarly : kPerhaps;
    for (std::size_t i = sizes_.size(); i-- > 0;) {
      const std::uint32_t size = sizes_[i];
      if (size == best_->trial.size) continue;
      const double most = kLighter * best_bytes();
      std::size_t level = finest();
      while (level + 1 < levels().count() && weight(level, size) > most) ++level;
      if (weight(level, size) > most || !has_texels(looks_.faces(level), size) ||
          model().guessed(level, size) > perhaps * options_.max_error ||
          tried_about(plan_.trials, looks_.faces(level), size)) {
        continue;
      }
      try_map(level, size);
      return true;
    }
    return false;
  }

  /// The first map tells how much texels matter: of a mesh whose limit leaves room for them, with about
  /// as many bytes of texels as of vertices.
  void first_map() {
    const auto coarse =
        looks_.fewest_within(kFirstLimit * options_.max_error, options_.height_field);
    const std::size_t level = std::max(coarse.value_or(0), finest());
    if (options_.choose_match) looks_.choose_match(level, options_.height_field);
    if (may_leave_map_out_ && model().at(level).plain <= options_.max_error) {
      measure_without_map(level);  // A map would spare few faces.
      if (best_reached()) return;
    }
    std::uint32_t size = sizes_.front();
    while (2 * size <= largest_ && bytes(level, 2 * size).texels < bytes(level, 0).total()) {
      size *= 2;
    }
    size *= 4 * size <= kSmallFirst ? 4 : 2;
    try_map(level, std::min(size, sizes_.back()), /*learn=*/true);
  }

  std::uint32_t samples_for(std::uint32_t size) const {
    if (!options_.choose_samples) return bake_.samples;
    return std::clamp(kSampleBudget / size, 1U, kMostSamples);
  }

  LightBytes bytes(std::size_t level, std::uint32_t size) const {
    return cost_.bytes(looks_.vertices(level), looks_.faces(level), size);
  }

  LightTrial trial_of(std::size_t level, std::uint32_t size) {
    LightTrial trial = guess_of(level, size);
    trial.expected = model().expected(level, size);
    return trial;
  }

  LightTrial guess_of(std::size_t level, std::uint32_t size) const {
    LightTrial trial;
    trial.faces = looks_.faces(level);
    trial.positions = looks_.vertices(level);
    trial.vertices = cost_.vertices(trial.positions, size);
    trial.size = size;
    trial.samples = samples_for(size == 0 ? 1 : size);
    trial.bits = cost_.bits;
    trial.method = bake_.method;
    trial.bytes = bytes(level, size);
    trial.expected = model().guessed(level, size);
    return trial;
  }

  std::size_t finest() const { return looks_.finest(most_faces_); }
  LightModel& model() const { return looks_.model(); }
  const SimplifyLevels& levels() const { return looks_.levels(); }
  LightMisses misses_at(std::uint32_t size) const {
    return LightMisses::of(plan_.trials, size, options_.max_error);
  }

  double weight(std::size_t level, std::uint32_t size) const {
    return static_cast<double>(bytes(level, size).total());
  }

  double price(std::size_t level, std::uint32_t size) const {
    return weight(level, size) * misses_at(size).price();
  }

  /// Not below this level: with maps of this size, hardly finer meshes missed the error.
  std::optional<std::size_t> finer_than_misses(std::optional<std::size_t> level,
                                               std::uint32_t size) const {
    const LightMisses misses = misses_at(size);
    if (misses.count == 0) return level;
    std::size_t next = levels().count() - 1;
    const double least = misses.next_bytes(best_reached() ? best_bytes() : kEndless);
    while (next > finest() && weight(next, size) < least) --next;
    const bool may_do = misses.nearly(options_.max_error) &&
                        model().guess(next).limit <= kNearlyLimit * options_.max_error;
    if (may_do && (!level || weight(*level, size) > kLeap * weight(next, size))) return next;
    return level ? std::min(*level, next) : level;
  }

  std::vector<std::uint32_t> all_sizes() const {  // 0: without a map
    std::vector<std::uint32_t> sizes = sizes_;
    if (may_leave_map_out_) sizes.insert(sizes.begin(), 0);
    return sizes;
  }

  /// For each size the fewest faces expected to do, but not what weighs far more than others: looks take long.
  std::vector<std::pair<std::size_t, std::uint32_t>> pairs() {
    std::vector<std::pair<std::size_t, std::uint32_t>> result;
    std::vector<std::uint32_t> sizes = all_sizes();
    // What does, or was tried last, is about right, and tells what is far more.
    const LightTrial& right = best_reached() ? best_->trial : plan_.trials.back();
    const auto first = std::find(sizes.begin(), sizes.end(), right.size);
    if (first != sizes.end()) std::rotate(sizes.begin(), first, sizes.end());
    double least = kEndless;
    for (const std::uint32_t size : sizes) {
      std::size_t from = finest();
      while (from + 1 < levels().count() &&
             (weight(from, size) > kFarMore * least || !has_texels(looks_.faces(from), size))) {
        ++from;
      }
      const double aim = misses_at(size).aim(options_.max_error);
      if (weight(from, size) > kFarMore * least) continue;
      if (from > finest() && model().guessed(from, size) > kSurely * aim) continue;
      const auto level = finer_than_misses(
          model().fewest([&](std::size_t i) { return model().expected(i, size) / aim; }, from),
          size);
      if (!level || !has_texels(looks_.faces(*level), size)) continue;
      result.emplace_back(*level, size);
      least = std::min(least, price(*level, size));
    }
    std::sort(result.begin(), result.end(),
              [](const auto& a, const auto& b) { return a.second < b.second; });
    return result;
  }

  /// Sets next_level_. Where nothing is expected to do: what gets near the least error with few bytes.
  std::optional<LightTrial> best_expected() {
    std::vector<std::pair<std::size_t, std::uint32_t>> candidates = pairs();
    if (candidates.empty()) {
      double least = model().expected(finest(), sizes_.back());
      for (const std::uint32_t size : sizes_) {
        const auto level = model().fewest(
            [&](std::size_t i) { return model().expected(i, size) / (kNearLeast * least); },
            finest());
        if (level) candidates.emplace_back(*level, size);
      }
    }
    if (candidates.empty()) return std::nullopt;
    const auto [level, size] =
        *std::min_element(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
          return price(a.first, a.second) < price(b.first, b.second);
        });
    next_level_ = level;
    return trial_of(level, size);
  }

  /// Not what was made before, nor what is hardly lighter than the lightest that does.
  bool worth_trying(const LightTrial& next) const {
    return !was_tried(plan_.trials, next.faces, next.size) &&
           (!best_reached() ||
            static_cast<double>(next.bytes.total()) < kWorthwhile * best_bytes());
  }

  bool best_reached() const { return best_ && best_->trial.measured <= options_.max_error; }
  double best_bytes() const { return static_cast<double>(best_->trial.bytes.total()); }

  void measure_without_map(std::size_t level) {
    Made made;
    made.level = level;
    made.low = looks_.mesh(level);
    model().know(level, looks_.look_at(made.low));
    made.trial = trial_of(level, 0);
    made.trial.measured = model().exactly(level).plain;
    keep(std::move(made));
  }

  /// \param learn  from the map's mip-maps, too
  void try_map(std::size_t level, std::uint32_t size, bool learn = false) {
    Made made;
    made.level = level;
    const LaidOut& laid_out = looks_.laid_out(level, options_, size);
    made.low = laid_out.mesh;
    made.unwrapped = laid_out.report;
    made.trial = trial_of(level, size);
    made.bake = for_size(bake_, size, samples_for(size));
    BakeOptions plain = normals_alone(made.bake);
    if (!all_directions_) few_directions(plain);
    plain.mips = learn;
    const BakeResult result = bake_drawn(impl_of(source_), made.low, plain, nullptr);
    const Stopwatch measuring;
    const NormalProbe probe(impl_of(source_), made.low, looks_.shown());
    const auto error = [&](const Image& map) {
      return probe.with_map(rounded(map, cost_.bits), plain).mean_degrees;
    };
    if (!model().knows(level)) model().know(level, looks_.look_with(probe));
    if (learn) {
      for (const Image& map : result.maps.front().mips) {
        if (map.width < kSmallestMap) break;
        model().measured(level, map.width, error(map), /*mip=*/true);
      }
      made.trial.expected = model().expected(level, size);
    }
    made.trial.measured = error(result.maps.front().image);
    model().measured(level, size, made.trial.measured);
    made.trial.vertices = split_vertices(made.low);
    made.trial.charts = made.unwrapped.charts;
    made.trial.bytes = cost_.measured(made.trial);
    plan_.seconds_measure += measuring.total();
    keep(std::move(made));
  }

  void try_pair(std::size_t level, std::uint32_t size) {
    size == 0 ? measure_without_map(level) : try_map(level, size);
  }

  void keep(Made made) {
    plan_.trials.push_back(made.trial);
    if (!best_ || is_better(made.trial, best_->trial, options_.max_error)) best_ = std::move(made);
  }

  /// Bakes all maps, as asked for.
  void bake_all_maps() {
    plan_.low = best_->low;
    keep_colors(high_, plan_.low);
    plan_.chosen = best_->trial;
    if (plan_.chosen.size == 0) return;
    plan_.unwrapped = best_->unwrapped;
    plan_.bake = best_->bake;
    plan_.bake.progress = bake_.progress;
    plan_.result = bake_drawn(impl_of(source_), plan_.low, plan_.bake, &plan_.drawn);
    plan_.drawn = rounded(std::move(plan_.drawn), cost_.bits);
    const NormalProbe probe(impl_of(source_), plan_.low, looks_.shown());
    plan_.chosen.measured = probe.with_map(plan_.drawn, plan_.bake).mean_degrees;
    plan_.bounds =
        reached_bounds(impl_of(source_), plan_.low, plan_.bake, options_.bounds, *plan_.result);
  }

  const Source& source_;
  const Mesh& high_;
  const LightPlanOptions& options_;
  std::uint64_t most_faces_;
  BakeOptions bake_;
  ProgressScope alive_;
  LightCost cost_;
  std::uint32_t largest_ = 0;
  std::vector<std::uint32_t> sizes_;
  bool may_leave_map_out_ = true, tried_another_ = false, all_directions_ = false;
  // `earlier_`: trials with maps that turned out too small for another map
  std::size_t next_level_ = 0, earlier_ = 0;
  std::optional<Made> best_;
  LightBake plan_;
  LightLooks looks_;
};

}  // namespace

LightBake plan_light(const Source& source, const Mesh& high, const LightPlanOptions& options,
                     LevelCache& cache, std::uint64_t most_faces) {
  return LightPlanner(source, high, options, cache, most_faces).run();
}

LightBake bake_light(const Source& source, const Mesh& high, const LightPlanOptions& options) {
  check_light_plan(options);
  LevelCache cache;
  return plan_light(source, high, options, cache);
}

}  // namespace kiln

#include "kiln/light_plan.h"

#include <algorithm>
#include <span>
#include <utility>

#include "kiln/plan.h"
#include "kiln/progress.h"
#include "measure/bounds.h"
#include "measure/light_limits.h"
#include "measure/light_looks.h"
#include "measure/light_maker.h"
#include "measure/light_planner.h"
#include "measure/light_trials.h"

namespace kiln {
namespace {
using namespace light_limits;

class LightPlanner {
 public:
  LightPlanner(const Source& source, const Mesh& high, const LightPlanOptions& options,
               LevelCache& cache, std::uint64_t most_faces)
      : options_(options),
        most_faces_(most_faces),
        bake_(options.bake),
        alive_(bake_.progress),
        looks_(source, high, bake_, plan_, cache),
        maker_(source, high, options_, bake_, looks_, plan_) {
    plan_.wanted = options.max_error;
    plan_.max_outline = options.max_outline;
    may_leave_map_out_ = options.may_leave_map_out && options.bounds.empty();
    if (options.choose_rays) leave_to_rays(options.bounds, bake_);
    largest_ = std::min(bake_.width, bake_.height);
    for (std::uint32_t size = kSmallestMap; size <= largest_; size *= 2) sizes_.push_back(size);
  }

  LightBake run() {
    return unless_cancelled<LightBake>([this] { return planned(); },
                                       [](LightBake& none) { none.cancelled = true; });
  }

 private:
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
    plan_.reached = plan_.chosen.measured <= options_.max_error && all_reached(plan_.bounds) &&
                    has_outlines(plan_.chosen, plan_.max_outline);
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
    avoid_flaws();
    // Where a part of the surface is lost, what is left may well have the right normals.
    const bool lost = best_reached() && best_->trial.one_sided > most_one_sided(options_);
    if (!lost || !looks_.leave_out_coarse(best_->level, most_one_sided(options_))) return;
    best_ = std::exchange(shown_, std::nullopt);
    earlier_ = plan_.trials.size();
    search();
  }

  /// Triangles that face away are holes to many renderers.
  void avoid_flaws() {
    for (std::size_t step = 1; step <= kMostFiner && best_reached(); step *= 2) {
      const std::uint32_t size = best_->trial.size;
      if (!looks_.levels().has_flaws(best_->level) || best_->level < finest() + step) return;
      const std::size_t next = best_->level - step;
      if (maker_.weight(next, size) > kSoundPrice * best_bytes()) return;
      if (looks_.levels().has_flaws(next)) continue;
      const LightMade flawed = *std::exchange(best_, std::nullopt);
      try_pair(next, size);
      if (!best_reached()) best_ = flawed;
    }
  }

  /// Tries look from few directions. Where that told too little, from all of them.
  void search_and_bake() {
    search();
    bake_all_maps();
    if (plan_.chosen.measured <= options_.max_error || !best_reached() || all_directions_) return;
    all_directions_ = true;
    maker_.look_from_all_directions();
    correct(plan_.trials, best_->trial = plan_.chosen);
    search();
    bake_all_maps();
  }

  void bake_all_maps() {
    maker_.bake_all_maps(*best_, [this] {
      fill_trade(plan_, model(), all_sizes(), [this](std::size_t level, std::uint32_t size) {
        return maker_.guess(level, size);
      });
      if (options_.on_measured) options_.on_measured(plan_);
    });
  }

  void try_pairs() {
    while (may_try_another() || may_do_without_map()) {
      std::optional<LightTrial> next = best_expected();
      for (int i = 0; i < kMostLooks && next && next->size == 0 && !model().knows(next_level_);
           ++i) {
        model().plainly(next_level_);
        next = best_expected();
      }
      if (next && next->size != 0) next = maker_.within_leap(*next, next_level_, finest());
      // What was expected to do and did not: a little more of it.
      while (next && !best_reached() && was_tried(plan_.trials, next->faces, next->size) &&
             next_level_ > finest()) {
        next = maker_.expect(--next_level_, next->size);
      }
      if (next && worth_trying(*next)) {
        try_pair(next_level_, next->size);
      } else if (!best_reached() || (!try_another_size() && !try_lighter(kMuchLighter, kFlat) &&
                                     !may_do_without_map())) {
        break;
      }
    }
    for (int i = 0; i < kMostBetween && try_between(); ++i) continue;
    if (try_lighter(kWorthwhile, kFlat)) try_lighter(kWorthwhile, 1);
  }

  /// What nearly did is far lighter than what does: half-way between the two, whatever the model expects. Layouts of one
  /// mesh differ from the next one's, and misses in a row say little of more faces. \returns false where it is not
  bool try_between() {
    if (!best_reached()) return false;
    for (const std::uint32_t size : all_sizes()) {
      const double most = misses_at(size).between(best_bytes(), options_.max_error);
      if (most == 0) continue;
      const std::size_t level = maker_.finest_within(most, size, finest());
      const std::uint64_t faces = looks_.faces(level);
      if (!has_texels(faces, size) || was_tried(plan_.trials, faces, size)) continue;
      try_pair(level, size);
      return true;
    }
    return false;
  }

  /// Whether another map is worth its time. Layouts take most of it, and their faces tell how much.
  bool may_try_another() const {
    const std::size_t tried = plan_.trials.size() - earlier_;
    if (!best_reached()) return tried < kMostTrialsToReach;
    return tried < kMostTrials && laid_out_since_first() <= kMostLaidOut * faces_of_best();
  }

  /// Errors without a map do not fall evenly: once, whether the finest that is lighter than the lightest does.
  bool may_do_without_map() {
    const bool has_map = may_leave_map_out_ && best_reached() && best_->trial.size != 0;
    return has_map && !std::exchange(looked_without_map_, true) &&
           maker_.may_do_without_map(kWorthwhile * best_bytes(), finest());
  }

  /// How fine the first mesh had to be was not known.
  double laid_out_since_first() const {
    return static_cast<double>(faces_laid_out(std::span(plan_.trials).subspan(1)));
  }
  double faces_of_best() const { return static_cast<double>(best_->trial.faces); }

  /// Errors of one size were known from other meshes alone: once, whether they are less. \returns false if none is
  bool try_another_size() {
    const LightReach reach = LightReach::of(plan_.trials);
    if (reach.largest == 0) return false;  // Nothing is known of any map.
    if (std::exchange(tried_another_, true)) return false;
    // The fewer maps were tried, the less guesses are worth.
    const double perhaps = plan_.trials.size() < kFewTrials ? kPerhapsEarly : kPerhaps;
    const double most_faces = kMostOfAnother * faces_of_best() - laid_out_since_first();
    for (std::size_t i = sizes_.size(); i-- > 0;) {
      const std::uint32_t size = sizes_[i];
      if (size == best_->trial.size) continue;
      const double most = kLighter * best_bytes();
      std::size_t level = finest();
      while (level + 1 < model().count() &&
             (maker_.weight(level, size) > most || !reach.faces(looks_.faces(level)))) {
        ++level;
      }
      const std::uint64_t faces = looks_.faces(level);
      const double guess = std::min(model().guessed(level, size), misses_at(size).falling(faces));
      if (maker_.weight(level, size) > most || !has_texels(faces, size) ||
          static_cast<double>(faces) > most_faces || guess > perhaps * options_.max_error ||
          tried_about(plan_.trials, faces, size)) {
        continue;
      }
      try_map(level, size);
      return true;
    }
    return false;
  }

  /// Where errors hardly grow with fewer faces, charts decide more than the model knows: whether a lighter mesh does
  /// with maps of the same size. \returns false if the model expects too much of an error
  /// \param share  of the lightest's bytes
  /// \param room   times the error that may be expected of a map, once the mesh was looked at
  bool try_lighter(double share, double room) {
    if (!best_reached()) return false;
    const std::uint32_t size = best_->trial.size;
    std::size_t next = best_->level;
    while (next < model().count() && maker_.weight(next, size) > share * best_bytes()) ++next;
    if (next == model().count() || !has_texels(looks_.faces(next), size) ||
        was_tried(plan_.trials, looks_.faces(next), size) ||
        misses_at(size).heaviest >= maker_.weight(next, size) ||
        model().guessed(next, size) > kFlat * options_.max_error) {
      return false;
    }
    size == 0 ? model().plainly(next) : model().exactly(next);
    if (model().guessed(next, size) > (size == 0 ? 1 : room) * options_.max_error) return false;
    try_pair(next, size);
    return true;
  }

  /// The first map tells how much texels matter: of a mesh whose limit leaves room for them.
  void first_map() {
    const double limit = kFirstLimit * options_.max_error;
    const auto coarse = looks_.fewest_within(limit, options_.height_field, options_.max_outline);
    std::size_t level = std::max(coarse.value_or(0), finest());
    if (options_.choose_match && looks_.choose_match(level, options_.height_field)) {
      level = std::max(looks_.fewest_known(limit).value_or(0), finest());
    }
    if (may_leave_map_out_ && model().at(level).plain <= options_.max_error) {
      keep(maker_.without_map(level));  // A map would spare few faces.
      if (best_reached()) return;
    }
    const std::uint32_t size = maker_.first_size(level, sizes_);
    if (no_map_is_lightest(level, size)) return;
    keep(maker_.first_map(level, size));
  }

  /// Keeps the lightest mesh without a map, where no map is expected to be lighter than the faces that it spares.
  bool no_map_is_lightest(std::size_t first, std::uint32_t size) {
    const std::uint32_t laid_out_for = maker_.first_layout(first, size);
    for (int i = 0; may_leave_map_out_ && i < kMostLooks; ++i) {
      const auto level = maker_.lightest_without_map(sizes_, finest(), first, laid_out_for);
      if (!level) return false;
      if (!model().knows(*level)) {
        model().plainly(*level);
        continue;
      }
      keep(maker_.without_map(*level));
      if (best_reached()) return true;
    }
    return false;
  }

  std::size_t finest() const { return looks_.finest(most_faces_); }
  LightModel& model() const { return looks_.model(); }
  LightMisses misses_at(std::uint32_t size) const {
    return LightMisses::of(plan_.trials, size, options_.max_error);
  }

  LightOffer offer(std::size_t level, std::uint32_t size) const {
    return {level, size, looks_.faces(level), maker_.weight(level, size) * misses_at(size).price()};
  }

  /// Not below this level: with maps of this size, hardly finer meshes missed the error.
  std::optional<std::size_t> finer_than_misses(std::optional<std::size_t> level,
                                               std::uint32_t size) const {
    const LightMisses misses = misses_at(size);
    const bool nearly = misses.nearly(options_.max_error);
    if (misses.count == 0 && !nearly) return level;
    std::size_t next = model().count() - 1;
    if (misses.count > 0) {
      const double least = misses.next_bytes(best_bytes());
      while (next > finest() && maker_.weight(next, size) < least) --next;
    }
    std::size_t finer = next;
    if (nearly) {
      const double faces = misses.next_faces(options_.max_error);
      while (finer > finest() && static_cast<double>(looks_.faces(finer)) < faces) --finer;
    }
    const bool may_do = nearly && model().guess(finer).limit <= kNearlyLimit * options_.max_error;
    if (may_do && (!level || maker_.weight(*level, size) > kLeap * maker_.weight(finer, size)))
      return finer;
    return level ? std::min(*level, next) : level;
  }

  std::vector<std::uint32_t> all_sizes() const {  // 0: without a map
    std::vector<std::uint32_t> sizes = sizes_;
    if (may_leave_map_out_) sizes.insert(sizes.begin(), 0);
    return sizes;
  }

  /// For each size the fewest faces expected to do, but not what weighs far more than others: looks take long.
  std::vector<LightOffer> offers() {
    std::vector<LightOffer> result;
    std::vector<std::uint32_t> sizes = all_sizes();
    // What does, or was tried last, is about right, and tells what is far more.
    const LightTrial& right = best_reached() ? best_->trial : plan_.trials.back();
    const auto first = std::find(sizes.begin(), sizes.end(), right.size);
    if (first != sizes.end()) std::rotate(sizes.begin(), first, sizes.end());
    double least = kEndless;
    for (const std::uint32_t size : sizes) {
      std::size_t from = finest();
      while (from + 1 < model().count() && (maker_.weight(from, size) > kFarMore * least ||
                                            !has_texels(looks_.faces(from), size))) {
        ++from;
      }
      const double aim = misses_at(size).aim(options_.max_error);
      if (maker_.weight(from, size) > kFarMore * least) continue;
      if (from > finest() && model().guessed(from, size) > kSurely * aim) continue;
      const auto level = finer_than_misses(
          model().fewest([&](std::size_t i) { return model().expected(i, size) / aim; }, from),
          size);
      if (!level || !has_texels(looks_.faces(*level), size)) continue;
      result.push_back(offer(*level, size));
      least = std::min(least, result.back().price);
    }
    std::sort(result.begin(), result.end(),
              [](const LightOffer& a, const LightOffer& b) { return a.size < b.size; });
    return result;
  }

  /// Sets next_level_. Where nothing is expected to do: what gets near the least error with few bytes.
  std::optional<LightTrial> best_expected() {
    std::vector<LightOffer> candidates = offers();
    if (candidates.empty()) {
      double least = model().expected(finest(), sizes_.back());
      for (const std::uint32_t size : sizes_) {
        const auto level = model().fewest(
            [&](std::size_t i) { return model().expected(i, size) / (kNearLeast * least); },
            finest());
        if (level) candidates.push_back(offer(*level, size));
      }
    }
    if (candidates.empty()) return std::nullopt;
    const LightOffer& next = quickest(candidates, kWorthwhile * best_bytes());
    next_level_ = next.level;
    return maker_.expect(next.level, next.size);
  }

  /// Not what was made before, nor what is hardly lighter than the lightest that does.
  bool worth_trying(const LightTrial& next) const {
    const double most = share_asked(next, laid_out_since_first(), faces_of_best()) * best_bytes();
    return !was_tried(plan_.trials, next.faces, next.size) && next.bytes.total() < most;
  }

  bool best_reached() const { return best_ && best_->trial.measured <= options_.max_error; }
  double best_bytes() const {
    return best_reached() ? static_cast<double>(best_->trial.bytes.total()) : kEndless;
  }

  void try_map(std::size_t level, std::uint32_t size) {
    keep(maker_.measured_map(level, size, size, maker_.lay_out(level, size)));
  }

  void try_pair(std::size_t level, std::uint32_t size) {
    size == 0 ? keep(maker_.without_map(level)) : try_map(level, size);
  }

  void keep(LightMade made) {
    plan_.trials.push_back(made.trial);
    const auto better_than = [&](const std::optional<LightMade>& other) {
      return !other || is_better(made.trial, other->trial, options_.max_error);
    };
    if (made.trial.one_sided <= most_one_sided(options_) && better_than(shown_)) shown_ = made;
    if (better_than(best_)) best_ = std::move(made);
  }

  const LightPlanOptions& options_;
  std::uint64_t most_faces_;
  BakeOptions bake_;
  ProgressScope alive_;
  std::uint32_t largest_ = 0;
  std::vector<std::uint32_t> sizes_;
  bool may_leave_map_out_ = true, looked_without_map_ = false;
  bool tried_another_ = false, all_directions_ = false;
  // `earlier_`: trials with maps too small for another map. `shown_`: the best with about the right outlines
  std::size_t next_level_ = 0, earlier_ = 0;
  std::optional<LightMade> best_, shown_;
  LightBake plan_;
  LightLooks looks_;
  LightMaker maker_;
};

}  // namespace

LightBake plan_light(const Source& source, const Mesh& high, const LightPlanOptions& options,
                     LevelCache& cache, std::uint64_t most_faces) {
  return LightPlanner(source, high, options, cache, most_faces).run();
}

}  // namespace kiln

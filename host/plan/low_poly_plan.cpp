// Searches for the lightest low poly and map within an error bound. README.md describes the search.
#include "plan/low_poly_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/progress.h"
#include "base/formatted.h"
#include "base/stopwatch.h"
#include "detail/registry.h"
#include "kiln/progress.h"
#include "match/registry.h"
#include "measure/bounds.h"
#include "plan/candidate.h"
#include "plan/settings.h"
#include "simplify/transfer_colors.h"

namespace kiln {
namespace {

using namespace plan_settings;

class LowPolyPlanner {
 public:
  LowPolyPlanner(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                 LevelCache& cache, std::uint64_t max_faces)
      : source_(source),
        high_(high),
        options_(options),
        max_faces_(max_faces > 0 ? static_cast<double>(max_faces) : HUGE_VAL),
        max_mismatch_(options.max_outline > 0 ? options.max_outline : kMaxOutlineMismatch),
        bake_(options.bake),
        progress_scope_(bake_.progress),
        evaluator_(source, high, options, bake_, plan_, cache),
        builder_(source, options, bake_, evaluator_, plan_) {
    plan_.wanted = options.max_error;
    plan_.max_outline = options.max_outline;
    if (options.choose_rays) reserve_bound_for_rays(options.bounds, bake_);
    if (options.may_leave_map_out && options.bounds.empty()) sizes_.push_back(0);
    const std::uint32_t largest = std::min(bake_.width, bake_.height);
    for (std::uint32_t size = kSmallestMap; size <= largest; size *= 2) sizes_.push_back(size);
  }

  LowPolyPlan run() {
    try_first_map();
    do {
      do {
        search();
      } while (!rebuild_without_folds());
    } while (!finish());
    plan_.reached = meets_bounds(plan_.chosen) && are_all_bounds_reached(plan_.bounds);
    return std::move(plan_);
  }

 private:
  /// Candidates of one map size that exceeded a bound.
  struct MissRecord {
    /// Finest level among these candidates; it and coarser levels are excluded from the search
    std::size_t first_excluded = SIZE_MAX;
    int count = 0;
  };
  using Choice = std::pair<std::size_t, std::uint32_t>;  // Level and map size of a candidate

  bool meets_bounds(const Candidate& candidate) const {
    return candidate.measured <= options_.max_error &&
           (options_.max_outline == 0 || candidate.silhouette_mismatch <= options_.max_outline);
  }
  /// True if a candidate meets its bounds and has not lost a part of the surface.
  bool is_sound(const Candidate& candidate) const {
    return meets_bounds(candidate) && candidate.silhouette_mismatch <= max_mismatch_;
  }
  bool is_better(const Candidate& a, const Candidate& b) const {
    const auto rank = [&](const Candidate& c) {
      // An earlier bake showed that this size is too small for the bound of a map other than the normal
      // map.
      if (c.size < sizes_.front()) return -1;
      return is_sound(c) ? 2 : meets_bounds(c) ? 1 : 0;
    };
    if (rank(a) != rank(b)) return rank(a) > rank(b);
    return rank(a) > 0 ? a.bytes.total() < b.bytes.total() : a.measured < b.measured;
  }
  BuiltCandidate& best() {
    return *std::min_element(
        built_candidates_.begin(), built_candidates_.end(),
        [&](const auto& a, const auto& b) { return is_better(a.candidate, b.candidate); });
  }
  bool has_sound_candidate() {
    return !built_candidates_.empty() && is_sound(best().candidate) &&
           best().candidate.size >= sizes_.front();
  }

  void build_candidate(const Choice& choice) {
    const std::uint32_t size = choice.second;
    const std::size_t level = level_without_folds(choice);
    if (has_sound_candidate() && !can_be_foldless(level) && !is_worth_folds({level, size})) {
      misses_[size].first_excluded = level;
      return;
    }
    built_candidates_.push_back(builder_.build(level, size));
    if (!is_sound(built_candidates_.back().candidate)) record_miss(built_candidates_.back());
  }
  /// Returns the next finer level without folds if there is one within a limit, else the level itself. As long
  /// as no candidate is sound, the limit is eight levels; afterwards it is kMaxBytesRatioWithoutFolds times the bytes of
  /// `choice`.
  std::size_t level_without_folds(const Choice& choice) {
    const auto [level, size] = choice;
    if (can_be_foldless(level)) return level;
    const double max_bytes = kMaxBytesRatioWithoutFolds * builder_.bytes(level, size);
    for (std::size_t finer = 1; level >= finest_level() + finer;
         finer = has_sound_candidate() ? finer + 1 : 2 * finer) {
      if (has_sound_candidate() ? builder_.bytes(level - finer, size) > max_bytes : finer > 8)
        break;
      if (can_be_foldless(level - finer)) return level - finer;
    }
    return level;
  }
  /// True if no sound candidate without folds has less than kMaxBytesRatioWithoutFolds times the bytes.
  bool is_worth_folds(const Choice& choice) {
    const double max_bytes =
        kMaxBytesRatioWithoutFolds * builder_.bytes(choice.first, choice.second);
    return std::none_of(built_candidates_.begin(), built_candidates_.end(),
                        [&](const BuiltCandidate& built) {
                          return is_sound(built.candidate) && can_be_foldless(built.level) &&
                                 static_cast<double>(built.candidate.bytes.total()) <= max_bytes;
                        });
  }
  /// False if a level has folded triangles that rebuild_without_folds() cannot remove. Most renderers show folds as
  /// holes.
  bool can_be_foldless(std::size_t level) const {
    return !evaluator_.levels().has_flaws(level) || evaluator_.levels().can_be_solved(level);
  }
  void record_miss(const BuiltCandidate& built) {
    MissRecord& record = misses_[built.candidate.size];
    record.first_excluded = std::min(record.first_excluded, built.level);
    ++record.count;
  }

  std::size_t finest_level() const {
    std::size_t level = 0;
    while (level + 1 < evaluator_.count() && evaluator_.faces(level) > max_faces_) ++level;
    return level;
  }

  /// Like coarsest_level(), but for errors that may decrease from one level to the next coarser
  /// one: the search starts at the coarsest evaluated level that satisfies the predicate.
  template <class IsGood>
  std::optional<std::size_t> coarsest_level_from_known(std::size_t begin, std::size_t end,
                                                       bool mapped, const IsGood& is_good) const {
    for (const std::size_t level : evaluator_.evaluated_levels(mapped)) {
      if (level > begin && level < end && is_good(level)) begin = level;
    }
    return coarsest_level(begin, end, is_good);
  }

  /// True if a level's error with an infinite map is at most half of the bound, so that texels may
  /// add the other half.
  bool leaves_half_of_bound_to_texels(std::size_t level) {
    const LevelErrors errors = evaluator_.at(level, true);
    return errors.infinite_map <= options_.max_error / 2 &&
           errors.silhouette_mismatch <= max_mismatch_;
  }
  /// The coarsest level with an error of at most half of the bound; the other half is left to texels.
  /// \param begin  the finest level of the search
  std::optional<std::size_t> coarsest_for_map(std::size_t begin) {
    return coarsest_level(begin, evaluator_.count(),
                          [&](std::size_t level) { return leaves_half_of_bound_to_texels(level); });
  }
  /// The coarsest level below `max_bytes` that meets the error bound without a map.
  std::optional<std::size_t> coarsest_without_map(double max_bytes) {
    if (sizes_.front() != 0) return std::nullopt;
    return coarsest_level_from_known(finest_level_below(max_bytes, 0), evaluator_.count(), false,
                                     [&](std::size_t level) {
                                       const LevelErrors errors = evaluator_.at(level, false);
                                       return errors.without_map <= options_.max_error &&
                                              errors.silhouette_mismatch <= max_mismatch_;
                                     });
  }
  /// The finest level below `max_bytes` bytes.
  std::size_t finest_level_below(double max_bytes, std::uint32_t size) const {
    std::size_t level = finest_level();
    while (level < evaluator_.count() && builder_.bytes(level, size) >= max_bytes) ++level;
    return level;
  }

  /// The coarsest level within the bound with a map of infinite resolution: with the smallest map, no mapped mesh is
  /// lighter.
  /// \param begin  the finest level of the search
  std::size_t lightest_for_map(std::size_t begin) {
    return coarsest_level(begin, evaluator_.count(),
                          [&](std::size_t level) {
                            const LevelErrors errors = evaluator_.at(level, true);
                            return errors.infinite_map <= options_.max_error &&
                                   errors.silhouette_mismatch <= max_mismatch_;
                          })
        .value_or(begin);
  }

  /// Bakes the first map, which calibrates the error model. Its mesh has half of the error bound, so that texels may
  /// add the other half, and mesh and map have about equal bytes. If a mesh without a map is predicted to be lighter
  /// than this mesh with the smallest map, it is built first. If no mesh with a map can then be lighter than it, no map
  /// is baked.
  void try_first_map() {
    std::optional<std::size_t> mapped_level = coarsest_for_map(finest_level());
    if (!mapped_level && finest_level() == 0 && !coarsest_without_map(HUGE_VAL) &&
        evaluator_.refine()) {
      // A map is only needed on levels that exceed the error bound without one.
      const std::optional<std::size_t> coarsest_unmapped_level = coarsest_without_map(HUGE_VAL);
      if (!coarsest_unmapped_level || leaves_half_of_bound_to_texels(*coarsest_unmapped_level))
        mapped_level = coarsest_for_map(coarsest_unmapped_level.value_or(0));
    }
    std::size_t level = mapped_level.value_or(finest_level());
    const std::size_t smallest = sizes_.front() == 0 ? 1 : 0;
    if (coarsest_without_map(builder_.bytes(level, sizes_[smallest]))) {
      std::vector<std::uint32_t> all_sizes = std::exchange(sizes_, {0});
      search();
      const double min_mapped_bytes = builder_.bytes(lightest_for_map(level), all_sizes[smallest]);
      if (has_sound_candidate() &&
          kMaxBytesRatioToTry * static_cast<double>(best().candidate.bytes.total()) <=
              min_mapped_bytes) {
        return;
      }
      sizes_ = std::move(all_sizes);
    }
    auto size = sizes_.begin() + static_cast<std::ptrdiff_t>(smallest);
    if (options_.choose_match && evaluator_.choose_match(level)) {
      level = std::max(level, coarsest_for_map(finest_level()).value_or(level));
    }
    const double max_bytes = 2 * builder_.bytes(level, *size);
    while (size + 1 != sizes_.end() && builder_.bytes(level, size[1]) < max_bytes) ++size;
    build_candidate({level, *size});
  }

  /// Chooses the next candidate. For each map size, finds the coarsest level that is predicted to
  /// meet a target error, and returns the lightest of these levels. For the map size of the
  /// lightest candidate so far, the target is the error bound plus a margin; for other sizes, it is
  /// the bound minus a margin. Each candidate that exceeds the bound lowers the target for its map
  /// size.
  std::optional<Choice> lightest_predicted() {
    std::optional<Choice> lightest;
    const BuiltCandidate* best_built = has_sound_candidate() ? &best() : nullptr;
    double max_bytes = HUGE_VAL;
    if (best_built)
      max_bytes = kMaxBytesRatioToTry * static_cast<double>(best_built->candidate.bytes.total());
    // Meshes without a map are searched last, because they need the finest levels, which take longest to
    // evaluate.
    for (auto at = sizes_.rbegin(); at != sizes_.rend(); ++at) {
      const std::uint32_t size = *at;
      const MissRecord& record = misses_[size];
      const int margins =
          (best_built && best_built->candidate.size == size ? 1 : -1) - record.count;
      const double target_error = options_.max_error * (1 + kErrorMargin * margins);
      const std::size_t end = std::min(evaluator_.count(), record.first_excluded);
      const auto found_level = coarsest_level_from_known(
          finest_level_below(max_bytes, size), end, size != 0, [&](std::size_t level) {
            return builder_.expected_error(level, size) <= target_error &&
                   evaluator_.at(level, size != 0).silhouette_mismatch <= max_mismatch_;
          });
      if (!found_level) continue;
      lightest = {*found_level, size};
      max_bytes = builder_.bytes(*found_level, size);
    }
    return lightest;
  }

  /// The lightest candidate whose predicted error exceeds the smallest predicted error by at most kErrorMargin.
  Choice near_least_error() {
    double min_error = HUGE_VAL, max_bytes = HUGE_VAL;
    for (const std::uint32_t size : sizes_) {
      min_error = std::min(min_error, builder_.expected_error(finest_level(), size));
      for (const std::size_t level : evaluator_.evaluated_levels(size != 0)) {
        if (level > finest_level())
          min_error = std::min(min_error, builder_.expected_error(level, size));
      }
    }
    Choice lightest = {finest_level(), sizes_.back()};
    for (const std::uint32_t size : sizes_) {
      const auto level = coarsest_level_from_known(
          finest_level(), evaluator_.count(), size != 0, [&](std::size_t at) {
            return builder_.expected_error(at, size) <= min_error * (1 + kErrorMargin);
          });
      if (!level || builder_.bytes(*level, size) >= max_bytes) continue;
      lightest = {*level, size};
      max_bytes = builder_.bytes(*level, size);
    }
    return lightest;
  }

  /// Repeatedly builds the candidate that is predicted to be the lightest, until no lighter one is predicted. If no
  /// candidate is predicted to meet the error bound, builds near_least_error().
  void search() {
    const std::size_t max_candidates = std::max(kMaxCandidates, built_candidates_.size() + 2);
    while (built_candidates_.size() < max_candidates) {
      const std::optional<Choice> next = lightest_predicted();
      if (next) {
        build_candidate(*next);
      } else if (has_sound_candidate()) {
        return;
      } else {
        build_candidate(near_least_error());
        if (!has_sound_candidate()) return;
      }
    }
  }

  /// Rebuilds the best candidate if presimplification left folds in its mesh; other candidates are not rebuilt, since
  /// this is slow.
  /// \returns true if the best candidate has no folds
  bool rebuild_without_folds() {
    const Choice best_choice = {best().level, best().candidate.size};
    if (!evaluator_.levels().can_be_solved(best_choice.first)) return true;
    evaluator_.solve(best_choice.first);
    std::erase_if(built_candidates_,
                  [&](const BuiltCandidate& built) { return built.level == best_choice.first; });
    build_candidate(best_choice);
    return false;
  }

  /// Bakes all maps of the best candidate and measures them. \returns true if the plan is complete, false if the search
  /// must continue
  bool finish() {
    BuiltCandidate& best_built = best();
    const bool had_sound_candidate = has_sound_candidate();
    plan_.low = best_built.low;
    transfer_colors(high_, plan_.low);
    if (best_built.candidate.size != 0) builder_.finish(best_built);
    plan_.chosen = best_built.candidate;
    list_candidates();
    if (options_.on_measured) options_.on_measured(plan_);
    if (had_sound_candidate && !is_sound(best_built.candidate)) {
      record_miss(best_built);
      return false;
    }
    if (plan_.result) {
      plan_.bounds =
          reached_bounds(impl_of(source_), plan_.low, plan_.bake, options_.bounds, *plan_.result);
    }
    if (!are_all_bounds_reached(plan_.bounds) && best_built.candidate.size < sizes_.back()) {
      // At this size a map other than the normal map exceeds its bound on any mesh, so this and smaller sizes are
      // excluded.
      std::erase_if(sizes_, [&](std::uint32_t size) { return size <= best_built.candidate.size; });
      return false;
    }
    const Stopwatch watch;
    plan_.simplified = evaluator_.levels().report(best_built.level);
    plan_.seconds_simplify += watch.total();
    return true;
  }

  /// Fills LowPolyPlan::candidates, trade, outlook and levels from known errors.
  void list_candidates() {
    for (auto* list : {&plan_.candidates, &plan_.trade, &plan_.outlook}) list->clear();
    plan_.levels.clear();
    for (const BuiltCandidate& built : built_candidates_)
      plan_.candidates.push_back(built.candidate);
    std::vector<std::size_t> known_levels = evaluator_.evaluated_levels(true);
    if (known_levels.empty()) known_levels = evaluator_.evaluated_levels(false);
    evaluator_.freeze(true);
    for (const std::uint32_t size : sizes_) {
      const std::size_t end = std::min(known_levels.back() + 1, misses_[size].first_excluded);
      const auto coarsest_good_level =
          coarsest_level(known_levels.front(), end, [&](std::size_t level) {
            return builder_.expected_error(level, size) <= options_.max_error;
          });
      if (coarsest_good_level) plan_.trade.push_back(builder_.predict(*coarsest_good_level, size));
      for (const std::size_t level : known_levels)
        plan_.outlook.push_back(builder_.predict(level, size));
    }
    for (auto level = known_levels.rbegin(); level != known_levels.rend(); ++level) {
      plan_.levels.push_back(
          {evaluator_.levels().faces(*level), evaluator_.levels().vertices(*level),
           evaluator_.at(*level, false).without_map, evaluator_.at(*level, true).infinite_map});
    }
    evaluator_.freeze(false);
  }

  const Source& source_;
  const Mesh& high_;
  const LowPolyPlanOptions& options_;
  const double max_faces_, max_mismatch_;
  BakeOptions bake_;
  ProgressScope progress_scope_;
  std::vector<std::uint32_t> sizes_;            ///< Map sizes in increasing order; 0: no map
  std::map<std::uint32_t, MissRecord> misses_;  ///< Candidates that exceeded a bound, by map size
  std::vector<BuiltCandidate> built_candidates_;
  LowPolyPlan plan_;
  LevelEvaluator evaluator_;
  CandidateBuilder builder_;
};

}  // namespace

void check_plan(const LowPolyPlanOptions& options) {
  const auto require = [](bool holds, const std::string& text) {
    if (!holds) throw Error(ErrorCode::usage, "plan_low_poly: " + text);
  };
  const BakeOptions& bake = options.bake;
  const MatchInfo& match = match_row(bake.match.method).info;
  require(std::isfinite(options.max_error) && options.max_error > 0,
          "max_error is " + decimal(options.max_error) + " degrees; it must be finite and above 0");
  require(options.max_outline >= 0 && options.max_outline < 1,
          "max_outline is " + decimal(options.max_outline) +
              "; it must be a share above 0 and below 1, or 0");
  require(options.density != TexelDensity::detail ||
              (options.unwrap == UnwrapMethod::charts && !options.height_field),
          "the texel density detail requires the unwrap method charts, and a high poly that is no "
          "height field");
  check_bounds(bake, options.bounds);
  require(options.screen == 0 || (options.screen >= 16 && options.screen <= 16384),
          "screen is " + std::to_string(options.screen) + " pixels; it must be 16 to 16384, or 0");
  require(options.bits == 0 || options.bits == 8 || options.bits == 16,
          "bits is " + std::to_string(options.bits) + "; it must be 8, 16 or 0");
  require(std::min(bake.width, bake.height) >= kSmallestMap,
          "the largest map is " + std::to_string(bake.width) + " x " + std::to_string(bake.height) +
              "; it must be 16 x 16 at least");
  require(shading_map(bake).has_value(),
          "a plan measures normal maps: add a normal map to the maps");
  require(
      bake.match.cage_mesh == nullptr && bake.match.parts == nullptr && bake.match.saved == nullptr,
      "a cage mesh, parts and a saved match require a given low poly");
  require((!obeys(match, "match.uv") || options.height_field) && !needs_direction(match),
          "matching by " + std::string(bake.match.method.name) + " requires a given low poly");
}

LowPolyPlan plan_levels(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                        LevelCache& cache, std::uint64_t max_faces) {
  return unless_cancelled<LowPolyPlan>(
      [&] { return LowPolyPlanner(source, high, options, cache, max_faces).run(); },
      [](LowPolyPlan& none) { none.cancelled = true; });
}

LowPolyPlan plan_low_poly(const Source& source, const Mesh& high,
                          const LowPolyPlanOptions& options) {
  check_plan(options);
  LevelCache cache;
  return plan_levels(source, high, options, cache);
}

}  // namespace kiln

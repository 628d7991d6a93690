#include "plan/byte_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "bake/pipeline.h"
#include "bake/progress.h"
#include "base/formatted.h"
#include "base/progress_guard.h"
#include "base/stopwatch.h"
#include "detail/registry.h"
#include "kiln/progress.h"
#include "plan/candidate.h"
#include "plan/low_poly_plan.h"
#include "plan/settings.h"
#include "plan/widen_search.h"
#include "simplify/transfer_colors.h"

namespace kiln {
namespace {

/// Constants of the search for the face count within a byte budget. Building a low poly (unwrap, bake, measure)
/// dominates the plan's time, so the search builds few low polys and predicts the errors of all others.
struct BytePlanSettings {
  /// Maximum number of low polys that are built.
  static constexpr std::size_t kMaxTrials = 6;
  /// Another low poly is built only if its predicted error is below this share of the smallest error so far.
  static constexpr double kMaxErrorRatioToTry = 0.98;
  /// The first low poly gets the share kFirstBytesShare of the bytes; its face count follows from the estimate
  /// kBytesPerFace (48 bytes per vertex, 6 bytes of indices per face).
  static constexpr double kFirstBytesShare = 0.3, kBytesPerFace = 45;
  /// The first map has the largest size at which the whole budget gives at least this number of bytes per texel, for
  /// lossy and for lossless encodings. With fewer bytes per texel, a map of half the size and higher quality has a
  /// lower error.
  static constexpr double kMinLossyBytesPerTexel = 0.15, kMinLosslessBytesPerTexel = 0.5;
  /// First and last step of the descent, in levels. The first step halves the faces; each next one is half as long.
  static constexpr std::size_t kFirstLevelStep = plan_settings::kNodeStep, kLastLevelStep = 3;
  /// Penalty in steps of 1/255 for levels that have lost a part of the surface; it exceeds every real error.
  static constexpr double kLostSurfacePenalty = 1000;
};
using Settings = BytePlanSettings;

class BytePlanner {
 public:
  BytePlanner(const Source& source, const Mesh& high, const BytePlanOptions& options)
      : source_(source),
        high_(high),
        options_(options),
        max_mismatch_(options.plan.max_outline > 0 ? options.plan.max_outline
                                                   : plan_settings::kMaxOutlineMismatch),
        bake_(options.plan.bake),
        progress_scope_(bake_.progress),
        evaluator_(source, high, options.plan, bake_, result_.plan, cache_) {
    result_.plan.wanted = options.plan.max_error;
    result_.plan.max_outline = options.plan.max_outline;
    for (std::uint32_t size = std::min(bake_.width, bake_.height);; size /= 2) {
      sizes_.push_back(size);
      if (size % 2 != 0 || size / 2 < kSmallestMap) break;
    }
    Mesh triangle;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    fixed_bytes_ = options.mesh_bytes(with_any_uvs(std::move(triangle)));
  }

  BytePlan run() {
    const double faces = Settings::kFirstBytesShare * static_cast<double>(options_.max_bytes) /
                         Settings::kBytesPerFace;
    if (faces > plan_settings::kFinestFaces) evaluator_.refine();
    std::size_t level = 0;
    while (level + 1 < evaluator_.count() && evaluator_.faces(level) > faces) ++level;
    if (options_.plan.choose_match) evaluator_.choose_match(level);
    build_trial(level, first_size(), /*all_maps=*/true, 0);
    while (built_.size() < Settings::kMaxTrials) {
      const std::optional<Prediction> next = best_predicted();
      if (!next || next->error >= Settings::kMaxErrorRatioToTry * error_of(best())) break;
      build_trial(next->level, next->size, /*all_maps=*/false, next->error);
    }
    if (!best().trial.fits) build_smallest();
    rebuild_without_folds();
    return finish();
  }

 private:
  struct Made {
    std::size_t level = 0;
    Mesh low;
    UnwrapReport unwrapped;
    BakeOptions bake;
    std::optional<BakeResult> result;  ///< Present if all maps were baked
    std::vector<PictureLadder> ladders;
    double bytes_per_face = 0;
    NormalError normals;  ///< Error of the largest normal map
    ByteTrial trial;
  };
  struct Prediction {
    std::size_t level = 0;
    std::uint32_t size = 0;
    double error = 0;
  };

  std::uint32_t first_size() const {
    const PictureFitOptions& pictures = options_.pictures;
    const bool lossless = !pictures.any_format && pictures.encode.format == PictureFormat::png;
    const double least =
        lossless ? Settings::kMinLosslessBytesPerTexel : Settings::kMinLossyBytesPerTexel;
    for (const std::uint32_t size : sizes_) {
      if (least * size * size <= static_cast<double>(options_.max_bytes)) return size;
    }
    return sizes_.back();
  }

  double error_of(const Made& made) const {
    const bool lost = made.normals.one_sided_share > max_mismatch_;
    if (!made.trial.fits) return oversize_rank(made.trial.bytes);
    return made.trial.error + (lost ? Settings::kLostSurfacePenalty : 0);
  }
  /// Rank of a file that exceeds the budget: after all files that fit, by its bytes.
  double oversize_rank(std::uint64_t bytes) const {
    return 2 * Settings::kLostSurfacePenalty +
           static_cast<double>(bytes) / static_cast<double>(options_.max_bytes);
  }
  Made& best() {
    return *std::min_element(built_.begin(), built_.end(), [&](const Made& a, const Made& b) {
      return error_of(a) < error_of(b);
    });
  }
  const Made& nearest(std::size_t level) const {
    const auto apart = [level](const Made& made) {
      return std::max(made.level, level) - std::min(made.level, level);
    };
    return *std::min_element(built_.rbegin(), built_.rend(),
                             [&](const Made& a, const Made& b) { return apart(a) < apart(b); });
  }

  /// The nearest level without folds, among the level and the eight next finer ones; the level itself if there is
  /// none.
  std::size_t without_folds(std::size_t level) const {
    const SimplifyLevels& levels = evaluator_.levels();
    for (std::size_t finer = 0; finer <= 8 && finer <= level; ++finer) {
      const std::size_t at = level - finer;
      if (!levels.has_flaws(at) || levels.can_be_solved(at)) return at;
    }
    return level;
  }

  BakeOptions bake_options(std::uint32_t size) const {
    BakeOptions bake = bake_;
    bake.width = bake.height = size;
    if (options_.plan.choose_samples) bake.samples = std::clamp(1024 / std::max(size, 1U), 1U, 4U);
    return bake;
  }

  BakeResult bake_all(const Mesh& low, BakeOptions& bake) const {
    const std::string doing =
        "trying " + std::to_string(bake.width) + " x " + std::to_string(bake.height);
    if (options_.plan.bake.progress) {
      bake.progress = [this, doing](double, std::string_view) {
        return options_.plan.bake.progress(0.5, doing);
      };
    }
    BakeResult result = widen_search(
        bake,
        [&](const BakeOptions& wide) { return bake_drawn(impl_of(source_), low, wide, nullptr); },
        [](const BakeResult& baked) {
          const BakeReport& report = baked.report;
          return report.samples == 0 ? 0 : static_cast<double>(report.missed) / report.samples;
        });
    bake.progress = options_.plan.bake.progress;
    return result;
  }

  void build_trial(std::size_t asked, std::uint32_t size, bool all_maps, double expected) {
    Made& made = built_.emplace_back();
    made.level = without_folds(asked);
    const LaidOut& laid_out = evaluator_.laid_out(made.level, size);
    made.low = laid_out.mesh;
    made.unwrapped = laid_out.report;
    made.bake = bake_options(size);
    BakeOptions bake = made.bake;
    if (!all_maps) {
      ask_for(bake, {shading_map(bake).value()});
      bake.report.errors = bake.report.keep_match = false;
      bake.report.recall = 0;
      bake.match.visibility.directions =
          std::min(bake.match.visibility.directions, plan_settings::kTrialDirections);
    }
    BakeResult result = bake_all(made.low, bake);
    made.bake.match.max_distance = bake.match.max_distance;
    std::vector<BakedMap> maps = result.maps;
    AssetMaps pictures = options_.maps_of(maps, result.coverage);
    pictures.coverage = result.coverage;
    const Stopwatch watch;
    const NormalProbe probe(impl_of(source_), made.low, evaluator_.high_view());
    PictureFitOptions fit = options_.pictures;
    fit.most_bytes = options_.max_bytes;
    fit.normal_error = [&](const Image& picture) {
      ProgressGuard::poll_at(0.6, "encoding pictures");
      const NormalError error = probe.with_map(picture, bake);
      return PictureError{error.mean_8bit, error.mean_degrees};
    };
    made.ladders = picture_ladders(pictures, fit);
    // A plan compares only bytes and errors. The job encodes the chosen pictures again, so the data is freed here.
    for (PictureLadder& ladder : made.ladders) {
      for (PictureChoice& choice : ladder.choices) choice.data = {};
    }
    const LevelErrors errors = evaluator_.mapped_errors(probe);
    evaluator_.record_measured(made.level, /*mapped=*/true, errors);
    const PictureLadder& normals = made.ladders.front();
    for (std::size_t i = 0; i < normals.levels.size(); ++i) {
      model_.add_measurement(evaluator_.faces(made.level), errors, size >> i,
                             normals.levels[i].degrees, i == 0);
    }
    made.normals = probe.with_map(*pictures.normal, bake);
    result_.plan.seconds_measure += watch.total();
    if (all_maps) {
      made.result = std::move(result);
      other_ladders_.assign(made.ladders.begin() + 1, made.ladders.end());
      others_size_ = size;
    }
    // Vertex colours are added for counting bytes only; finish() transfers colours to the chosen low poly.
    Mesh weighed = made.low;
    if (!high_.colors.empty())
      weighed.colors.assign(weighed.positions.size(), high_.colors.front());
    made.trial.mesh_bytes = options_.mesh_bytes(weighed);
    const auto faces = static_cast<double>(made.low.triangles.size());
    made.bytes_per_face =
        (static_cast<double>(made.trial.mesh_bytes) - static_cast<double>(fixed_bytes_)) / faces;
    made.ladders.resize(1);  // others_ has the ladders of the other pictures
    std::vector<PictureLadder> all = made.ladders;
    const std::vector<PictureLadder> others = others_up_to(size);
    all.insert(all.end(), others.begin(), others.end());
    made.trial.faces = made.low.triangles.size();
    made.trial.expected = expected;
    made.trial.baked = size;
    choose(all, made.trial);
  }

  /// Ladders of all pictures except normals, limited to the size of a bake.
  std::vector<PictureLadder> others_up_to(std::uint32_t size) const {
    std::vector<PictureLadder> list = other_ladders_;
    for (PictureLadder& ladder : list) {
      const PictureChoice least = ladder.choices.front();
      std::erase_if(ladder.choices, [&](const PictureChoice& choice) {
        return std::min(choice.width, choice.height) > size;
      });
      if (ladder.choices.empty()) ladder.choices.push_back(least);
    }
    return list;
  }

  void choose(const std::vector<PictureLadder>& ladders, ByteTrial& trial) const {
    const std::uint64_t left = options_.max_bytes - std::min(options_.max_bytes, trial.mesh_bytes);
    const std::optional<PictureFit> fit = least_error(ladders, left);
    trial.fits = fit.has_value() && trial.mesh_bytes < options_.max_bytes;
    if (!trial.fits) {
      trial.bytes = trial.mesh_bytes + least_bytes(ladders);
      return;
    }
    trial.bytes = trial.mesh_bytes + fit->bytes;
    trial.error = fit->error;
    trial.pictures = trial_pictures(ladders, *fit);
    trial.degrees = trial.pictures.front().error.degrees;
  }

  /// Predicts a level's error with the best pictures that fit in the remaining bytes.
  Prediction predict(std::size_t level) {
    const Made& known = nearest(level);
    const LevelErrors errors = evaluator_.at(level, /*mapped=*/true);
    const double faces = evaluator_.faces(level);
    std::vector<PictureLadder> ladders = {known.ladders.front()};
    const PictureLadder& measured = known.ladders.front();
    const double steps_a_degree =
        measured.levels.front().degrees > 0
            ? measured.levels.front().steps / measured.levels.front().degrees
            : 0;
    for (PictureChoice& choice : ladders.front().choices) {
      const double plain = model_.expected(faces, errors, known.trial.baked >> choice.level);
      const double of_level = measured.levels[choice.level].degrees;
      const double is = choice.error.degrees;
      // The loss by encoding is independent of the error of the mesh and its texels, so the squares of the two errors
      // add up.
      const double lost = std::max(0.0, is * is - of_level * of_level);
      choice.error.degrees = std::sqrt(plain * plain + lost);
      choice.error.steps = steps_a_degree * choice.error.degrees;
    }
    const std::vector<PictureLadder> others = others_up_to(others_size_);
    ladders.insert(ladders.end(), others.begin(), others.end());
    for (PictureLadder& ladder : ladders) {  // Predicted errors need not decrease as bytes increase
      double least = HUGE_VAL;
      std::erase_if(ladder.choices, [&](const PictureChoice& choice) {
        if (choice.error.steps >= least) return true;
        least = choice.error.steps;
        return false;
      });
    }
    ByteTrial trial;
    trial.mesh_bytes =
        fixed_bytes_ + static_cast<std::uint64_t>(std::max(0.0, known.bytes_per_face) * faces);
    choose(ladders, trial);
    Prediction expected{level, sizes_.back(), oversize_rank(trial.bytes)};
    if (!trial.fits) return expected;
    expected.error =
        trial.error +
        (errors.silhouette_mismatch > max_mismatch_ ? Settings::kLostSurfacePenalty : 0);
    for (const TrialPicture& picture : trial.pictures) {
      expected.size = std::max(expected.size, std::min(picture.width, picture.height));
    }
    return expected;
  }

  /// Descends from the best level with decreasing steps to the smallest predicted error. For levels that were built,
  /// the measured error is used.
  std::optional<Prediction> best_predicted() {
    std::map<std::size_t, Prediction> known;
    const auto at = [&](std::size_t level) -> const Prediction& {
      const auto found = known.find(level);
      if (found != known.end()) return found->second;
      for (const Made& made : built_) {
        if (made.level == level) {
          return known[level] = {level, made.trial.baked, error_of(made)};
        }
      }
      return known[level] = predict(level);
    };
    std::size_t level = best().level;
    for (std::size_t step = Settings::kFirstLevelStep; step >= Settings::kLastLevelStep;
         step /= 2) {
      for (bool any_moved = true; any_moved;) {
        any_moved = false;
        for (const bool finer : {true, false}) {
          while (finer ? level >= step : level + step < evaluator_.count()) {
            const std::size_t next = finer ? level - step : level + step;
            if (at(next).error >= at(level).error) break;
            level = next;
            any_moved = true;
          }
        }
      }
    }
    const auto was_made = [&](const Made& made) { return without_folds(level) == made.level; };
    if (std::any_of(built_.begin(), built_.end(), was_made)) return std::nullopt;
    return at(level);
  }

  /// Builds the coarsest level with the smallest maps if no low poly has fitted so far.
  /// \throws Error(usage) with the bytes of that file if it does not fit either
  void build_smallest() {
    build_trial(evaluator_.count() - 1, sizes_.back(), /*all_maps=*/true, 0);
    if (best().trial.fits) return;
    const std::uint64_t least = built_.back().trial.bytes;
    throw Error(ErrorCode::usage,
                formatted("%llu bytes are too few for a low poly with these maps: "
                          "the smallest file has %llu.",
                          static_cast<unsigned long long>(options_.max_bytes),
                          static_cast<unsigned long long>(least)));
  }

  /// Rebuilds the best low poly if presimplification left folds in it. Other low polys are not rebuilt, since another
  /// simplification is slow.
  void rebuild_without_folds() {
    const std::size_t level = best().level;
    if (!evaluator_.levels().can_be_solved(level)) return;
    evaluator_.solve(level);
    const std::uint32_t size = best().trial.baked;
    std::erase_if(built_, [&](const Made& made) { return made.level == level; });
    build_trial(level, size, /*all_maps=*/true, 0);
    if (!best().trial.fits) build_smallest();
  }

  BytePlan finish() {
    Made& chosen = best();
    LowPolyPlan& plan = result_.plan;
    if (!chosen.result) {
      BakeOptions bake = chosen.bake;
      chosen.result = bake_all(chosen.low, bake);
      chosen.bake.match.max_distance = bake.match.max_distance;
    }
    for (const PictureLadder& ladder : other_ladders_) {
      for (std::size_t level = 0; level < ladder.levels.size(); ++level) {
        if (others_size_ >> level != chosen.trial.baked) continue;
        result_.coarseness.emplace_back(ladder.picture, ladder.levels[level].steps);
      }
    }
    plan.result = std::move(chosen.result);
    plan.bake = chosen.bake;
    plan.unwrapped = chosen.unwrapped;
    plan.simplified = evaluator_.levels().report(chosen.level);
    plan.low = std::move(chosen.low);
    transfer_colors(high_, plan.low);
    Candidate& candidate = plan.chosen;
    candidate.faces = plan.low.triangles.size();
    candidate.positions = plan.low.positions.size();
    candidate.vertices = split_vertices(plan.low);
    candidate.charts = chosen.unwrapped.charts;
    candidate.size = chosen.trial.baked;
    candidate.samples = chosen.bake.samples;
    candidate.method = bake_.match.method;
    candidate.expected = candidate.measured = chosen.trial.degrees;
    candidate.standard_error = chosen.normals.standard_error_degrees;
    candidate.silhouette_mismatch = chosen.normals.one_sided_share;
    plan.reached = (plan.wanted == 0 || candidate.measured <= plan.wanted) &&
                   (plan.max_outline == 0 || candidate.silhouette_mismatch <= plan.max_outline);
    for (const Made& made : built_) {
      if (&made == &chosen) result_.chosen = result_.trials.size();
      result_.trials.push_back(made.trial);
    }
    return std::move(result_);
  }

  const Source& source_;
  const Mesh& high_;
  const BytePlanOptions& options_;
  const double max_mismatch_;
  BakeOptions bake_;
  ProgressScope progress_scope_;
  LevelCache cache_;
  BytePlan result_;
  LevelEvaluator evaluator_;
  ErrorModel model_;
  std::vector<std::uint32_t> sizes_;  ///< Map sizes in decreasing order
  std::vector<Made> built_;
  /// Ladders of all pictures except normals, from the first bake of all maps
  std::vector<PictureLadder> other_ladders_;
  std::uint32_t others_size_ = 0;
  std::uint64_t fixed_bytes_ = 0;  ///< Bytes of the file that do not depend on the mesh
};

}  // namespace

std::vector<TrialPicture> trial_pictures(std::span<const PictureLadder> ladders,
                                         const PictureFit& fit) {
  std::vector<TrialPicture> list;
  for (std::size_t i = 0; i < ladders.size(); ++i) {
    const PictureChoice& choice = ladders[i].choices[fit.choices[i]];
    const bool lossy = choice.encoding.is_lossy();
    list.push_back({ladders[i].picture, choice.width, choice.height, choice.encoding.format,
                    lossy ? choice.encoding.quality : 0, choice.bytes, choice.error});
  }
  return list;
}

BytePlan plan_within_bytes(const Source& source, const Mesh& high, const BytePlanOptions& options) {
  return unless_cancelled<BytePlan>([&] { return BytePlanner(source, high, options).run(); },
                                    [](BytePlan& none) { none.plan.cancelled = true; });
}

}  // namespace kiln

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
  /// The mesh of the first low poly gets the share kInitialByteShare of the bytes. Its face count follows from
  /// the estimate kBytesPerFace (48 bytes per vertex, 6 bytes of indices per face).
  static constexpr double kInitialByteShare = 0.3, kBytesPerFace = 45;
  /// The first map has the largest size at which the whole budget gives at least this number of bytes per texel, for
  /// lossy and for lossless encodings. With fewer bytes per texel, a map of half the size and higher quality has a
  /// lower error.
  static constexpr double kMinLossyBytesPerTexel = 0.15, kMinLosslessBytesPerTexel = 0.5;
  /// First and last step of the descent, in levels. The first step halves the faces; each next one is half as long.
  static constexpr std::size_t kFirstLevelStep = plan_settings::kNodeStep, kLastLevelStep = 3;
  /// Finer meshes leave less detail to the normal map. Bytes of its encodings, and the errors that these add, are
  /// proportional to the face count to the power of -kDetailExponent (means of eleven shapes: 0 to 0.4). Bytes of the
  /// mesh per face are proportional to the power of -kSeamExponent (0.05 to 0.2), since seams split a smaller share
  /// of the vertices of a finer mesh. Without these, predictions favour coarse meshes, and finer ones are not built.
  static constexpr double kDetailExponent = 0.15, kSeamExponent = 0.1;
  /// Hard edges are compared with smooth normals if the latter have at most this share of the vertices.
  static constexpr double kMaxSmoothVertexRatio = 0.97;
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
    fixed_bytes_ = options.mesh_bytes(add_placeholder_uvs(std::move(triangle)));
  }

  BytePlan run() {
    const double faces = Settings::kInitialByteShare * static_cast<double>(options_.max_bytes) /
                         Settings::kBytesPerFace;
    if (faces > plan_settings::kFinestFaces) evaluator_.refine();
    std::size_t level = 0;
    while (level + 1 < evaluator_.count() && evaluator_.faces(level) > faces) ++level;
    if (options_.plan.choose_match) evaluator_.choose_match(level);
    build_trial(level, initial_size(), /*all_maps=*/true, 0);
    choose_normals();
    while (low_polys_.size() < Settings::kMaxTrials) {
      const std::optional<Prediction> next = best_prediction();
      if (!next || !is_worth_building(next->error, error_of(best()))) break;
      // Pictures that are larger than predicted may fit, so the maps are baked at the size of the
      // first ones.
      build_trial(next->level, low_polys_.front().trial.baked, /*all_maps=*/false, next->error);
    }
    if (!best().trial.fits) build_smallest();
    rebuild_without_folds();
    return finish();
  }

 private:
  struct BuiltLowPoly {
    std::size_t level = 0;
    Mesh low;
    UnwrapReport unwrapped;
    BakeOptions bake;
    std::optional<BakeResult> result;  ///< The baked maps; nullopt until all maps were baked
    std::vector<PictureEncodings> encodings_by_picture;
    double bytes_per_face = 0;
    LevelErrors errors;
    NormalError normals;  ///< Error of the largest normal map, in rendered pictures
    ByteTrial trial;
  };
  struct Prediction {
    std::size_t level = 0;
    double error = 0;
  };

  std::uint32_t initial_size() const {
    const PictureFitOptions& pictures = options_.pictures;
    const bool is_lossless = !pictures.any_format && pictures.encode.format == PictureFormat::png;
    const double min_bytes_per_texel =
        is_lossless ? Settings::kMinLosslessBytesPerTexel : Settings::kMinLossyBytesPerTexel;
    for (const std::uint32_t size : sizes_) {
      if (min_bytes_per_texel * size * size <= static_cast<double>(options_.max_bytes)) return size;
    }
    return sizes_.back();
  }

  double error_of(const BuiltLowPoly& low_poly) const {
    const bool has_lost_surface = low_poly.normals.one_sided_share > max_mismatch_;
    if (!low_poly.trial.fits) return oversize_rank(low_poly.trial.bytes);
    return low_poly.trial.error + (has_lost_surface ? Settings::kLostSurfacePenalty : 0);
  }
  /// Rank of a trial whose file exceeds the budget: worse than every file that fits; fewer bytes rank better.
  double oversize_rank(std::uint64_t bytes) const {
    return 2 * Settings::kLostSurfacePenalty +
           static_cast<double>(bytes) / static_cast<double>(options_.max_bytes);
  }
  /// True if a predicted error is clearly below the smallest one so far. If both include the penalty for a lost
  /// surface, it is left out of the comparison, since it would hide every difference.
  static bool is_worth_building(double predicted, double smallest) {
    const double penalty = Settings::kLostSurfacePenalty;
    const bool both_lost = std::min(predicted, smallest) >= penalty && smallest < 2 * penalty;
    const double common = both_lost ? penalty : 0;
    return predicted - common < Settings::kMaxErrorRatioToTry * (smallest - common);
  }
  BuiltLowPoly& best() {
    return *std::min_element(
        low_polys_.begin(), low_polys_.end(),
        [&](const BuiltLowPoly& a, const BuiltLowPoly& b) { return error_of(a) < error_of(b); });
  }
  const BuiltLowPoly& nearest(std::size_t level) const {
    const auto level_distance = [level](const BuiltLowPoly& low_poly) {
      return std::max(low_poly.level, level) - std::min(low_poly.level, level);
    };
    return *std::min_element(low_polys_.rbegin(), low_polys_.rend(),
                             [&](const BuiltLowPoly& a, const BuiltLowPoly& b) {
                               return level_distance(a) < level_distance(b);
                             });
  }

  /// The nearest level without folds, among the level and the eight next finer ones; the level itself if there is
  /// none.
  std::size_t level_without_folds(std::size_t level) const {
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
    const std::string progress_text =
        "trying " + std::to_string(bake.width) + " x " + std::to_string(bake.height);
    if (options_.plan.bake.progress) {
      bake.progress = [this, progress_text](double, std::string_view) {
        return options_.plan.bake.progress(0.5, progress_text);
      };
    }
    BakeResult result = widen_search(
        bake,
        [&](const BakeOptions& wide_options) {
          return bake_drawn(impl_of(source_), low, wide_options, nullptr);
        },
        [](const BakeResult& baked) {
          const BakeReport& report = baked.report;
          return report.samples == 0 ? 0 : static_cast<double>(report.missed) / report.samples;
        });
    bake.progress = options_.plan.bake.progress;
    return result;
  }

  /// Decides between hard edges along those of the high poly, and normals that are smooth except at seams. Hard edges
  /// split vertices, which may take the bytes of a larger map. Builds the first low poly once more, with smooth
  /// normals, if it has hard edges, and keeps the better one.
  void choose_normals() {
    if (options_.plan.height_field) return;
    const BuiltLowPoly& hard = low_polys_.front();
    const auto vertices = static_cast<double>(split_vertices(hard.low));
    Mesh smooth = hard.low;
    evaluator_.levels().fit_normals(smooth, EdgesUnderMap::smooth);
    if (static_cast<double>(split_vertices(smooth)) > Settings::kMaxSmoothVertexRatio * vertices) {
      return;
    }
    has_smooth_normals_ = true;
    build_trial(hard.level, hard.trial.baked, /*all_maps=*/false, 0);
    has_smooth_normals_ = error_of(low_polys_[1]) < error_of(low_polys_[0]);
    if (has_smooth_normals_) evaluator_.smooth_mapped_normals();
    // Both low polys have the same level. Only the low poly with the smaller error is kept, and it
    // calibrates the predictions.
    const std::size_t worse_index = has_smooth_normals_ ? 0 : 1;
    dropped_trials_.push_back(low_polys_[worse_index].trial);
    low_polys_.erase(low_polys_.begin() + static_cast<std::ptrdiff_t>(worse_index));
    calibrate_with(low_polys_.front());
  }

  void build_trial(std::size_t requested_level, std::uint32_t size, bool all_maps,
                   double expected) {
    BuiltLowPoly& low_poly = low_polys_.emplace_back();
    low_poly.level = level_without_folds(requested_level);
    const UnwrappedLowPoly& unwrapped = evaluator_.unwrapped(low_poly.level, size);
    low_poly.low = unwrapped.mesh;
    if (has_smooth_normals_) evaluator_.levels().fit_normals(low_poly.low, EdgesUnderMap::smooth);
    low_poly.trial.has_smooth_normals = has_smooth_normals_;
    low_poly.unwrapped = unwrapped.report;
    low_poly.bake = bake_options(size);
    BakeOptions bake = low_poly.bake;
    if (!all_maps) {
      request_only(bake, {shading_map(bake).value()});
      bake.report.errors = bake.report.keep_match = false;
      bake.report.recall = 0;
      bake.match.visibility.directions =
          std::min(bake.match.visibility.directions, plan_settings::kTrialDirections);
    }
    BakeResult result = bake_all(low_poly.low, bake);
    low_poly.bake.match.max_distance = bake.match.max_distance;
    std::vector<BakedMap> maps = result.maps;
    AssetMaps pictures = options_.maps_of(maps, result.coverage);
    pictures.coverage = result.coverage;
    const Stopwatch watch;
    const NormalProbe probe(impl_of(source_), low_poly.low, evaluator_.high_view());
    PictureFitOptions fit = options_.pictures;
    fit.max_picture_bytes = options_.max_bytes;
    fit.normal_error = [&](const Image& picture) {
      ProgressGuard::poll_at(0.6, "encoding pictures");
      const NormalError error = probe.with_map(picture, bake);
      return PictureError{error.mean_8bit, error.mean_degrees};
    };
    low_poly.encodings_by_picture = encode_pictures(pictures, fit);
    for (PictureEncodings& picture_encodings : low_poly.encodings_by_picture)
      add_intermediate_qualities(picture_encodings);
    // The data is freed here, since a plan only compares bytes and errors; the job encodes the chosen pictures again.
    for (PictureEncodings& picture_encodings : low_poly.encodings_by_picture) {
      for (PictureChoice& choice : picture_encodings.choices) choice.data = {};
    }
    low_poly.errors = evaluator_.mapped_errors(probe);
    low_poly.trial.baked = size;
    calibrate_with(low_poly);
    low_poly.normals = probe.with_map(*pictures.normal, bake);
    result_.plan.seconds_measure += watch.total();
    if (all_maps) {
      low_poly.result = std::move(result);
      other_encodings_.assign(low_poly.encodings_by_picture.begin() + 1,
                              low_poly.encodings_by_picture.end());
      other_encodings_size_ = size;
    }
    // These colours only serve to count bytes; finish() transfers the real colours to the chosen
    // low poly.
    Mesh colored_mesh = low_poly.low;
    if (!high_.colors.empty())
      colored_mesh.colors.assign(colored_mesh.positions.size(), high_.colors.front());
    low_poly.trial.mesh_bytes = options_.mesh_bytes(colored_mesh);
    const auto faces = static_cast<double>(low_poly.low.triangles.size());
    low_poly.bytes_per_face =
        (static_cast<double>(low_poly.trial.mesh_bytes) - static_cast<double>(fixed_bytes_)) /
        faces;
    // Only the encodings of the normal map are stored here; other_encodings_ stores those of the
    // other pictures.
    low_poly.encodings_by_picture.resize(1);
    std::vector<PictureEncodings> all_encodings = low_poly.encodings_by_picture;
    const std::vector<PictureEncodings> other_encodings = limit_other_encodings(size);
    all_encodings.insert(all_encodings.end(), other_encodings.begin(), other_encodings.end());
    low_poly.trial.faces = low_poly.low.triangles.size();
    low_poly.trial.expected = expected;
    choose(all_encodings, low_poly.trial);
  }

  /// Makes predictions follow a low poly's measured errors.
  void calibrate_with(const BuiltLowPoly& low_poly) {
    evaluator_.record_measured(low_poly.level, /*mapped=*/true, low_poly.errors);
    const PictureEncodings& normals = low_poly.encodings_by_picture.front();
    for (std::size_t i = 0; i < normals.levels.size(); ++i) {
      model_.add_measurement(evaluator_.faces(low_poly.level), low_poly.errors,
                             low_poly.trial.baked >> i, normals.levels[i].degrees, i == 0);
    }
  }

  /// Encodings of all pictures except normals, without those whose shorter side is above `size`. If none remains of a
  /// picture, it keeps the one of the fewest bytes.
  std::vector<PictureEncodings> limit_other_encodings(std::uint32_t size) const {
    std::vector<PictureEncodings> list = other_encodings_;
    for (PictureEncodings& picture_encodings : list) {
      const PictureChoice smallest_choice = picture_encodings.choices.front();
      std::erase_if(picture_encodings.choices, [&](const PictureChoice& choice) {
        return std::min(choice.width, choice.height) > size;
      });
      if (picture_encodings.choices.empty()) picture_encodings.choices.push_back(smallest_choice);
    }
    return list;
  }

  void choose(const std::vector<PictureEncodings>& encodings_by_picture, ByteTrial& trial) const {
    const std::uint64_t remaining_bytes =
        options_.max_bytes - std::min(options_.max_bytes, trial.mesh_bytes);
    const std::optional<PictureFit> fit = least_error(encodings_by_picture, remaining_bytes);
    trial.fits = fit.has_value() && trial.mesh_bytes < options_.max_bytes;
    if (!trial.fits) {
      trial.bytes = trial.mesh_bytes + least_bytes(encodings_by_picture);
      return;
    }
    trial.bytes = trial.mesh_bytes + fit->bytes;
    trial.error = fit->error;
    trial.pictures = trial_pictures(encodings_by_picture, *fit);
    trial.degrees = trial.pictures.front().error.degrees;
  }

  /// Predicts a level's error with the best pictures that fit in the remaining bytes.
  Prediction predict(std::size_t level) {
    const BuiltLowPoly& nearest_low_poly = nearest(level);
    const LevelErrors errors = evaluator_.at(level, /*mapped=*/true);
    const double faces = evaluator_.faces(level);
    std::vector<PictureEncodings> encodings_by_picture = {
        nearest_low_poly.encodings_by_picture.front()};
    const PictureEncodings& measured_encodings = nearest_low_poly.encodings_by_picture.front();
    const double steps_per_degree =
        measured_encodings.levels.front().degrees > 0
            ? measured_encodings.levels.front().steps / measured_encodings.levels.front().degrees
            : 0;
    const double face_ratio = faces / static_cast<double>(nearest_low_poly.trial.faces);
    const double detail_ratio = std::pow(face_ratio, -Settings::kDetailExponent);
    for (PictureChoice& choice : encodings_by_picture.front().choices) {
      const double unencoded_degrees =
          model_.expected(faces, errors, nearest_low_poly.trial.baked >> choice.level);
      const double level_degrees = measured_encodings.levels[choice.level].degrees;
      const double choice_degrees = choice.error.degrees;
      // The loss by encoding is independent of the error of the mesh and its texels, so the squares of the two errors
      // add up.
      const double encoding_loss =
          detail_ratio * detail_ratio *
          std::max(0.0, choice_degrees * choice_degrees - level_degrees * level_degrees);
      choice.bytes = static_cast<std::uint64_t>(static_cast<double>(choice.bytes) * detail_ratio);
      choice.error.degrees = std::sqrt(unencoded_degrees * unencoded_degrees + encoding_loss);
      choice.error.steps = steps_per_degree * choice.error.degrees;
    }
    const std::vector<PictureEncodings> other_encodings =
        limit_other_encodings(other_encodings_size_);
    encodings_by_picture.insert(encodings_by_picture.end(), other_encodings.begin(),
                                other_encodings.end());
    // The predicted error may rise although the bytes of a choice grow
    for (PictureEncodings& picture_encodings : encodings_by_picture) {
      double min_steps = HUGE_VAL;
      std::erase_if(picture_encodings.choices, [&](const PictureChoice& choice) {
        if (choice.error.steps >= min_steps) return true;
        min_steps = choice.error.steps;
        return false;
      });
    }
    ByteTrial trial;
    const double bytes_per_face = std::max(0.0, nearest_low_poly.bytes_per_face) *
                                  std::pow(face_ratio, -Settings::kSeamExponent);
    trial.mesh_bytes = fixed_bytes_ + static_cast<std::uint64_t>(bytes_per_face * faces);
    choose(encodings_by_picture, trial);
    if (!trial.fits) return {level, oversize_rank(trial.bytes)};
    const bool has_lost_surface = errors.silhouette_mismatch > max_mismatch_;
    return {level, trial.error + (has_lost_surface ? Settings::kLostSurfacePenalty : 0)};
  }

  /// Descends from the best level with decreasing steps to the smallest predicted error. For levels that were built,
  /// the measured error is used.
  std::optional<Prediction> best_prediction() {
    std::map<std::size_t, Prediction> predictions;
    const auto at = [&](std::size_t level) -> const Prediction& {
      const auto found = predictions.find(level);
      if (found != predictions.end()) return found->second;
      for (const BuiltLowPoly& low_poly : low_polys_) {
        if (low_poly.level == level) {
          return predictions[level] = {level, error_of(low_poly)};
        }
      }
      return predictions[level] = predict(level);
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
    const auto is_built_level = [&](const BuiltLowPoly& low_poly) {
      return level_without_folds(level) == low_poly.level;
    };
    if (std::any_of(low_polys_.begin(), low_polys_.end(), is_built_level)) return std::nullopt;
    return at(level);
  }

  /// Builds the coarsest level with the smallest maps if no low poly has fitted so far.
  /// \throws Error(usage) with the bytes of that file if it does not fit either
  void build_smallest() {
    build_trial(evaluator_.count() - 1, sizes_.back(), /*all_maps=*/true, 0);
    if (best().trial.fits) return;
    const std::uint64_t min_file_bytes = low_polys_.back().trial.bytes;
    throw Error(ErrorCode::usage, formatted("%llu bytes are too few for a low poly with these "
                                            "maps: the smallest possible file has %llu bytes.",
                                            static_cast<unsigned long long>(options_.max_bytes),
                                            static_cast<unsigned long long>(min_file_bytes)));
  }

  /// Rebuilds the best low poly if presimplification left folds in it. Other low polys are not rebuilt, since another
  /// simplification is slow.
  void rebuild_without_folds() {
    const std::size_t level = best().level;
    if (!evaluator_.levels().can_be_solved(level)) return;
    evaluator_.solve(level);
    const std::uint32_t size = best().trial.baked;
    std::erase_if(low_polys_,
                  [&](const BuiltLowPoly& low_poly) { return low_poly.level == level; });
    build_trial(level, size, /*all_maps=*/true, 0);
    if (!best().trial.fits) build_smallest();
  }

  BytePlan finish() {
    BuiltLowPoly& best_low_poly = best();
    LowPolyPlan& plan = result_.plan;
    if (!best_low_poly.result) {
      BakeOptions bake = best_low_poly.bake;
      best_low_poly.result = bake_all(best_low_poly.low, bake);
      best_low_poly.bake.match.max_distance = bake.match.max_distance;
    }
    for (const PictureEncodings& picture_encodings : other_encodings_) {
      for (std::size_t level = 0; level < picture_encodings.levels.size(); ++level) {
        if (other_encodings_size_ >> level != best_low_poly.trial.baked) continue;
        result_.picture_errors.emplace_back(picture_encodings.picture,
                                            picture_encodings.levels[level].steps);
      }
    }
    plan.result = std::move(best_low_poly.result);
    plan.bake = best_low_poly.bake;
    plan.unwrapped = best_low_poly.unwrapped;
    plan.simplified = evaluator_.levels().report(best_low_poly.level);
    plan.low = std::move(best_low_poly.low);
    transfer_colors(high_, plan.low);
    Candidate& candidate = plan.chosen;
    candidate.faces = plan.low.triangles.size();
    candidate.positions = plan.low.positions.size();
    candidate.vertices = split_vertices(plan.low);
    candidate.charts = best_low_poly.unwrapped.charts;
    candidate.size = best_low_poly.trial.baked;
    candidate.samples = best_low_poly.bake.samples;
    candidate.method = bake_.match.method;
    candidate.expected = candidate.measured = best_low_poly.trial.degrees;
    candidate.standard_error = best_low_poly.normals.standard_error_degrees;
    candidate.silhouette_mismatch = best_low_poly.normals.one_sided_share;
    plan.reached = (plan.wanted == 0 || candidate.measured <= plan.wanted) &&
                   (plan.max_outline == 0 || candidate.silhouette_mismatch <= plan.max_outline);
    result_.trials = dropped_trials_;
    for (const BuiltLowPoly& low_poly : low_polys_) {
      if (&low_poly == &best_low_poly) result_.chosen = result_.trials.size();
      result_.trials.push_back(low_poly.trial);
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
  std::vector<std::uint32_t> sizes_;  ///< Map sizes that are tried, in decreasing order
  std::vector<BuiltLowPoly> low_polys_;
  bool has_smooth_normals_ = false;        ///< See choose_normals()
  std::vector<ByteTrial> dropped_trials_;  ///< Trials of low polys that choose_normals() dropped
  /// Encodings of all pictures except normals, from the first bake of all maps
  std::vector<PictureEncodings> other_encodings_;
  std::uint32_t other_encodings_size_ = 0;
  std::uint64_t fixed_bytes_ = 0;  ///< Bytes of the file that do not depend on the mesh
};

}  // namespace

std::vector<TrialPicture> trial_pictures(std::span<const PictureEncodings> encodings_by_picture,
                                         const PictureFit& fit) {
  std::vector<TrialPicture> list;
  for (std::size_t i = 0; i < encodings_by_picture.size(); ++i) {
    const PictureChoice& choice = encodings_by_picture[i].choices[fit.choices[i]];
    const bool is_lossy = choice.encoding.is_lossy();
    list.push_back({encodings_by_picture[i].picture, choice.width, choice.height,
                    choice.encoding.format, is_lossy ? choice.encoding.quality : 0, choice.bytes,
                    choice.error});
  }
  return list;
}

BytePlan plan_within_bytes(const Source& source, const Mesh& high, const BytePlanOptions& options) {
  return unless_cancelled<BytePlan>([&] { return BytePlanner(source, high, options).run(); },
                                    [](BytePlan& none) { none.plan.cancelled = true; });
}

}  // namespace kiln

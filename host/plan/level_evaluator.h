// Simplified meshes at all face counts, and predictions of their errors before any map is baked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "kiln/plan.h"
#include "measure/normal_probe.h"
#include "plan/error_model.h"
#include "plan/settings.h"
#include "simplify/simplify_levels.h"
#include "unwrap/texel_detail.h"

namespace kiln {

/// A low poly with UVs.
struct UnwrappedLowPoly {
  Mesh mesh;
  UnwrapReport report;
};

/// Cache of a high poly's low polys, which plans for several sizes on screen share.
struct LevelSet {
  std::unique_ptr<SimplifyLevels> levels;
  std::map<std::size_t, Mesh> meshes;  ///< Simplified meshes by level
  std::map<std::size_t, std::array<Mesh, 2>>
      draft_meshes;  ///< Draft meshes by level, from SimplifyLevels::draft_meshes()
  /// Unwrapped meshes by level and map size
  std::map<std::pair<std::size_t, std::uint32_t>, UnwrappedLowPoly> unwrapped;
};
/// Cached low polys, keyed by the face count of the finest level
using LevelCache = std::map<std::uint32_t, LevelSet>;

/// The coarsest level of [begin, end) that satisfies a predicate, by bisection; all finer levels are assumed to
/// satisfy it. The range is split at two thirds, since coarse levels are the fastest to evaluate,
/// and preferably at a node (one of every kNodeStep levels), which is evaluated in any case.
template <class IsGood>
std::optional<std::size_t> coarsest_level(std::size_t begin, std::size_t end,
                                          const IsGood& is_good) {
  using plan_settings::kNodeStep;
  // Invariant: all levels before `good_end` satisfy the predicate, and level `bad_level` does not.
  std::size_t good_end = begin, bad_level = std::max(begin, end);
  while (good_end < bad_level) {
    std::size_t middle = good_end + (bad_level - good_end) * 2 / 3;
    const std::size_t node = (middle + kNodeStep / 2) / kNodeStep * kNodeStep;
    if (node >= good_end && node < bad_level) middle = node;
    // draft_errors() extrapolates up to half a step beyond known nodes, so the level chosen here needs no evaluation.
    if (bad_level % kNodeStep == 0 && bad_level - good_end > kNodeStep / 2 &&
        bad_level - good_end <= 2 * kNodeStep) {
      middle = bad_level - kNodeStep / 2;
    }
    if (is_good(middle)) {
      good_end = middle + 1;
    } else {
      bad_level = middle;
    }
  }
  return good_end > begin ? std::optional(good_end - 1) : std::nullopt;
}

/// Creates levels and evaluates every kNodeStep-th of them (the nodes) on draft meshes, in small pictures. Errors of
/// other levels are interpolated in log-log scale. Measured errors of final meshes replace these predictions and
/// correct those of other levels.
class LevelEvaluator {
 public:
  /// Creates levels and their draft meshes.
  /// \param bake  match options; choose_match() may change them
  /// \param plan  its run times are increased. All arguments must outlive this object
  LevelEvaluator(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                 BakeOptions& bake, LowPolyPlan& plan, LevelCache& cache);

  const SimplifyLevels& levels() const { return *level_set_->levels; }
  std::size_t count() const { return levels().count(); }
  double faces(std::size_t level) const { return static_cast<double>(levels().faces(level)); }
  /// Replaces the levels by levels with more faces.
  /// \returns false if the high poly has no more
  bool refine();

  /// Predicted or measured errors of a level.
  /// \param mapped  true for a mesh with a map, false for one without; their normals differ, and only the mesh with a
  /// map has LevelErrors::infinite_map
  LevelErrors at(std::size_t level, bool mapped);
  /// While frozen, at() interpolates between known levels and evaluates no level.
  void freeze(bool frozen) { is_frozen_ = frozen; }
  /// Evaluated levels from fine to coarse.
  std::vector<std::size_t> evaluated_levels(bool mapped) const;
  /// Replaces a level's predicted errors by those measured on its final mesh.
  void record_measured(std::size_t level, bool mapped, const LevelErrors& measured);
  /// From now on, meshes with a map have smooth normals instead of hard edges. Their predicted errors are
  /// discarded.
  void smooth_mapped_normals();
  /// Errors of a mesh without a map, and with a map of infinite resolution.
  LevelErrors mapped_errors(const NormalProbe& probe) const;

  /// Chooses the match with the smallest error on the node next to a level; of equal matches, the cheapest.
  /// \returns true if the method has changed
  bool choose_match(std::size_t level);

  /// A level's mesh, and its unwrapped mesh for a map whose side has `size` texels. Both are cached.
  const Mesh& mesh(std::size_t level);
  const UnwrappedLowPoly& unwrapped(std::size_t level, std::uint32_t size);
  /// Simplifies a level again without the folds that presimplification left.
  void solve(std::size_t level);
  /// Reference pictures of the high poly.
  const HighPolyView& high_view() const { return fine_view_; }

 private:
  void make_levels(std::uint32_t finest_faces);
  LevelErrors draft_errors(std::size_t level, bool mapped);
  void evaluate(std::size_t level, bool mapped);
  BakeOptions match_options(MatchMethod method) const;

  const Source& source_;
  const Mesh& high_;
  const LowPolyPlanOptions& options_;
  BakeOptions& bake_;
  LowPolyPlan& plan_;
  LevelCache& cache_;
  LevelSet* level_set_ = nullptr;
  std::uint32_t finest_faces_ = 0;  ///< Face count of the finest level
  bool is_frozen_ = false;
  EdgesUnderMap edges_under_map_ = EdgesUnderMap::hard;
  HighPolyView fine_view_, coarse_view_;
  /// Errors of draft meshes by level: [0] of meshes without a map, [1] of meshes with a map
  std::array<std::map<std::size_t, LevelErrors>, 2> nodes_;
  /// Measured errors of a level's final mesh, and their ratios to those of the draft mesh.
  struct MeasuredLevel {
    LevelErrors errors;
    double without_map = 1, infinite_map = 1;
  };
  /// Measured levels: [0] of meshes without a map, [1] of meshes with a map
  std::array<std::map<std::size_t, MeasuredLevel>, 2> measured_levels_;
  std::optional<TexelDetail> detail_;  ///< Detail of the high poly; only for TexelDensity::detail
};

}  // namespace kiln

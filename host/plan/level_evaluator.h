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
struct LaidOut {
  Mesh mesh;
  UnwrapReport report;
};

/// Cached low polys of one high poly. Plans for several sizes on screen share them.
struct LevelSet {
  std::unique_ptr<SimplifyLevels> levels;
  std::map<std::size_t, Mesh> meshes;                ///< By level
  std::map<std::size_t, std::array<Mesh, 2>> rough;  ///< SimplifyLevels::rough_meshes()
  std::map<std::pair<std::size_t, std::uint32_t>, LaidOut> laid_out;  ///< By level and size
};
using LevelCache = std::map<std::uint32_t, LevelSet>;  ///< By the faces of the finest level

/// The coarsest good level of [begin, end) by bisection, assuming that all finer ones are good. It splits at two
/// thirds, since coarse levels are the fastest to evaluate, and prefers nodes, which are evaluated in any case.
template <class IsGood>
std::optional<std::size_t> coarsest(std::size_t begin, std::size_t end, const IsGood& is_good) {
  using plan_settings::kNodeStep;
  // Invariant: levels before `good` are good, `bad` is not.
  std::size_t good = begin, bad = std::max(begin, end);
  while (good < bad) {
    std::size_t middle = good + (bad - good) * 2 / 3;
    const std::size_t node = (middle + kNodeStep / 2) / kNodeStep * kNodeStep;
    if (node >= good && node < bad) middle = node;
    // rough_errors() extrapolates up to half a step beyond known nodes, so this level costs no evaluation.
    if (bad % kNodeStep == 0 && bad - good > kNodeStep / 2 && bad - good <= 2 * kNodeStep) {
      middle = bad - kNodeStep / 2;
    }
    if (is_good(middle)) {
      good = middle + 1;
    } else {
      bad = middle;
    }
  }
  return good > begin ? std::optional(good - 1) : std::nullopt;
}

/// Creates levels and evaluates a few: every kNodeStep-th one, on rough meshes, in coarse pictures. Errors of other
/// levels are interpolated in log-log scale. Measured errors of final meshes replace these predictions and correct
/// those of other levels.
class LevelEvaluator {
 public:
  /// \param bake  match options; choose_match() may change them
  /// \param plan  its run times are increased. All arguments must outlive this object
  LevelEvaluator(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                 BakeOptions& bake, LowPolyPlan& plan, LevelCache& cache);

  const SimplifyLevels& levels() const { return *set_->levels; }
  std::size_t count() const { return levels().count(); }
  double faces(std::size_t level) const { return static_cast<double>(levels().faces(level)); }
  /// Replaces the levels by ones with more faces. \returns false if the high poly has no more
  bool refine();

  /// \param mapped  true for a mesh with a map, false for one without; their normals differ, and only the former has a
  ///                limit
  LevelErrors at(std::size_t level, bool mapped);
  /// While frozen, at() interpolates between known levels and evaluates none.
  void freeze(bool frozen) { is_frozen_ = frozen; }
  /// Evaluated levels from fine to coarse.
  std::vector<std::size_t> evaluated(bool mapped) const;
  /// Replaces a level's predicted errors by those measured on its final mesh.
  void record_measured(std::size_t level, bool mapped, const LevelErrors& measured);
  /// Errors of a mesh without its map and with an infinite one.
  LevelErrors mapped_errors(const NormalProbe& probe) const;

  /// Chooses the match with the least error on the node next to a level; cheaper ones win ties. \returns whether the
  /// method changed
  bool choose_match(std::size_t level);

  /// A level's mesh, and its unwrapped mesh for a map of `size` texels a side. Both are cached.
  const Mesh& mesh(std::size_t level);
  const LaidOut& laid_out(std::size_t level, std::uint32_t size);
  /// Simplifies a level again without the folds that presimplification left.
  void solve(std::size_t level);
  /// Reference pictures of the high poly.
  const HighPolyView& high_view() const { return fine_; }

 private:
  void make_levels(std::uint32_t most);
  LevelErrors rough_errors(std::size_t level, bool mapped);
  void evaluate(std::size_t level, bool mapped);
  BakeOptions match_options(MatchMethod method) const;

  const Source& source_;
  const Mesh& high_;
  const LowPolyPlanOptions& options_;
  BakeOptions& bake_;
  LowPolyPlan& plan_;
  LevelCache& cache_;
  LevelSet* set_ = nullptr;
  std::uint32_t most_ = 0;  ///< Faces of the finest level
  bool is_frozen_ = false;
  HighPolyView fine_, coarse_;
  /// Rough errors by level; [0] without a map, [1] with one
  std::array<std::map<std::size_t, LevelErrors>, 2> nodes_;
  /// Measured errors of a level's final mesh, and their ratios to those of the rough mesh.
  struct Made {
    LevelErrors errors;
    double without_map = 1, infinite_map = 1;
  };
  std::array<std::map<std::size_t, Made>, 2> made_;  ///< By level; [0] without a map, [1] with one
  std::optional<TexelDetail> detail_;  ///< Detail of the high poly, for TexelDensity::detail alone
};

}  // namespace kiln

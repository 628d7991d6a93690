// Low polys of all numbers of faces, and what is known of their errors before any map is made.
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

/// Low polys of one high poly that were made: plans for several sizes on screen share them.
struct LevelSet {
  std::unique_ptr<SimplifyLevels> levels;
  std::map<std::size_t, Mesh> meshes;                ///< By level
  std::map<std::size_t, std::array<Mesh, 2>> rough;  ///< SimplifyLevels::rough_meshes()
  std::map<std::pair<std::size_t, std::uint32_t>, LaidOut> laid_out;  ///< By level and size
};
using LevelCache = std::map<std::uint32_t, LevelSet>;  ///< By the faces of the finest level

/// The coarsest level of [begin, end) that is good, where all finer ones are. Coarse levels are asked first, since they
/// take the least time to evaluate, and those that are evaluated anyway before those between.
template <class IsGood>
std::optional<std::size_t> coarsest(std::size_t begin, std::size_t end, const IsGood& is_good) {
  using plan_settings::kNodeStep;
  std::size_t good = begin, bad = std::max(begin, end);  // Levels before `good` are good.
  while (good < bad) {
    std::size_t middle = good + (bad - good) * 2 / 3;
    const std::size_t node = (middle + kNodeStep / 2) / kNodeStep * kNodeStep;
    if (node >= good && node < bad) middle = node;
    // Levels up to half a step finer than known nodes follow from these (roughly_at()), so that no node is evaluated.
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

/// Makes levels, and evaluates a few: every kNodeStep-th, fitted roughly, in coarse pictures. Errors of others follow
/// from lines in log-log scale. Of meshes that were made well, the very errors are known, and correct those of others.
class LevelEvaluator {
 public:
  /// \param bake  how to match; choose_match() may change it
  /// \param plan  where seconds are added to. All arguments outlive this
  LevelEvaluator(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                 BakeOptions& bake, LowPolyPlan& plan, LevelCache& cache);

  const SimplifyLevels& levels() const { return *set_->levels; }
  std::size_t count() const { return levels().count(); }
  double faces(std::size_t level) const { return static_cast<double>(levels().faces(level)); }
  /// Makes levels of more faces. \returns false where there are none
  bool refine();

  /// \param mapped  the mesh has normals for use with a map (and a limit); else normals for use without one
  LevelErrors at(std::size_t level, bool mapped);
  /// While frozen, at() returns what is known, and evaluates nothing.
  void freeze(bool frozen) { is_frozen_ = frozen; }
  /// Levels that were evaluated, coarser ones last.
  std::vector<std::size_t> evaluated(bool mapped) const;
  /// Replaces what was expected of a level by what was measured of its final mesh.
  void set_made(std::size_t level, bool mapped, const LevelErrors& measured);
  /// Errors of a mesh that gets a map.
  LevelErrors mapped_errors(const NormalProbe& probe) const;

  /// Takes the first of the ways to match that gets nearest on about a level. \returns whether it is another
  bool choose_match(std::size_t level);

  /// A level's mesh, and with UVs for a map of `size` texels a side. Both are made once.
  const Mesh& mesh(std::size_t level);
  const LaidOut& laid_out(std::size_t level, std::uint32_t size);
  /// Makes a level again without the flaws that presimplification left.
  void solve(std::size_t level);
  /// Pictures of the high poly to measure by.
  const HighPolyView& shown() const { return fine_; }

 private:
  void make_levels(std::uint32_t most);
  LevelErrors roughly_at(std::size_t level, bool mapped);
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
  std::array<std::map<std::size_t, LevelErrors>, 2> nodes_;  ///< By level: for shading, for a map
  /// Errors of a level's final mesh, and their ratios to those of the rough one.
  struct Made {
    LevelErrors errors;
    double without_map = 1, infinite_map = 1;
  };
  std::array<std::map<std::size_t, Made>, 2> made_;  ///< As nodes_
  std::optional<TexelDetail> detail_;  ///< Detail of the high poly, if it was asked for
};

}  // namespace kiln

// Builds low polys with their maps, and measures them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kiln/plan.h"
#include "measure/normal_probe.h"
#include "plan/error_model.h"
#include "plan/level_evaluator.h"

namespace kiln {

/// A candidate that was built, with its mesh and the options of its bake.
struct BuiltCandidate {
  std::size_t level = 0;
  Candidate candidate;
  Mesh low;
  UnwrapReport unwrapped;
  BakeOptions bake;
};

/// Copies the measured errors of a mesh into a candidate.
void set_measured(const NormalError& error, Candidate& candidate);

/// Builds candidates, and corrects the predictions of the evaluator and the error model by the measured errors of
/// each.
class CandidateBuilder {
 public:
  /// Creates a builder. \param bake  match options; may change between candidates. All arguments must outlive this
  /// object
  CandidateBuilder(const Source& source, const LowPolyPlanOptions& options, const BakeOptions& bake,
                   LevelEvaluator& evaluator, LowPolyPlan& plan);

  /// Predicts a level's candidate with a map whose side has `size` texels; 0: without a map.
  Candidate predict(std::size_t level, std::uint32_t size) const;
  double bytes(std::size_t level, std::uint32_t size) const {
    return static_cast<double>(bytes_of(level, size).total());
  }
  double expected_error(std::size_t level, std::uint32_t size) const;

  BuiltCandidate build(std::size_t level, std::uint32_t size);
  /// Bakes all maps of a candidate into the plan's result, and measures it with them.
  void finish(BuiltCandidate& built);

 private:
  LowPolyBytes bytes_of(std::size_t level, std::uint32_t size) const;
  std::uint64_t vertices_of(std::size_t level, std::uint32_t size) const;
  std::uint32_t samples_for(std::uint32_t size) const;
  void build_map(BuiltCandidate& built, const NormalProbe& probe);

  const Source& source_;
  const LowPolyPlanOptions& options_;
  const BakeOptions& bake_;
  LevelEvaluator& evaluator_;
  LowPolyPlan& plan_;
  ErrorModel model_;
  std::uint32_t bits_ = 8;
  std::vector<std::uint32_t> channels_;  ///< Number of channels of each map
  double vertices_per_position_ = 1;     ///< Ratio of vertices to positions of a mesh without a map
  /// Vertices that seams of a mapped mesh add, divided by the square root of its positions
  double seam_vertices_ = 10;
  /// True once a baked map has calibrated the error model
  bool has_map_errors_ = false;
  bool uses_all_directions_ =
      false;  ///< True if candidates use as many visibility directions as final bakes
};

}  // namespace kiln

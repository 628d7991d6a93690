// Makes low polys with their maps, and measures them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kiln/plan.h"
#include "measure/normal_probe.h"
#include "plan/error_model.h"
#include "plan/level_evaluator.h"

namespace kiln {

/// A candidate that was made.
struct MadeCandidate {
  std::size_t level = 0;
  Candidate candidate;
  Mesh low;
  UnwrapReport unwrapped;
  BakeOptions bake;
};

/// Takes over what was measured of a candidate.
void set_measured(const NormalError& error, Candidate& candidate);

/// Makes candidates, which tell the evaluator and the model what levels and maps reach.
class CandidateBuilder {
 public:
  /// \param bake  how to match; may change between candidates. All arguments outlive this
  CandidateBuilder(const Source& source, const LowPolyPlanOptions& options, const BakeOptions& bake,
                   LevelEvaluator& evaluator, LowPolyPlan& plan);

  /// The candidate that is expected of a level with a map of a size; 0: without one.
  Candidate expect(std::size_t level, std::uint32_t size) const;
  double bytes(std::size_t level, std::uint32_t size) const {
    return static_cast<double>(bytes_of(level, size).total());
  }
  double expected_error(std::size_t level, std::uint32_t size) const;

  MadeCandidate build(std::size_t level, std::uint32_t size);
  /// Bakes all maps of a candidate and measures it by them: the plan's result.
  void finish(MadeCandidate& made);

 private:
  LowPolyBytes bytes_of(std::size_t level, std::uint32_t size) const;
  std::uint64_t vertices_of(std::size_t level, std::uint32_t size) const;
  std::uint32_t samples_for(std::uint32_t size) const;
  void build_map(MadeCandidate& made, const NormalProbe& probe);

  const Source& source_;
  const LowPolyPlanOptions& options_;
  const BakeOptions& bake_;
  LevelEvaluator& evaluator_;
  LowPolyPlan& plan_;
  ErrorModel model_;
  std::uint32_t bits_ = 8;
  std::vector<std::uint32_t> channels_;  ///< Per map
  double vertices_per_position_ = 1;     ///< Without a map
  double seam_vertices_ =
      10;  ///< With one: vertices that seams add, over the square root of positions
  bool knows_maps_ = false;      ///< A map was made
  bool all_directions_ = false;  ///< Candidates see as many directions as bakes do
};

}  // namespace kiln

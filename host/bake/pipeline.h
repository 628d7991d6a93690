// The stages of a bake, on one object: samples, match, fallback, maps, blend, mip chain, padding, encoding.
// bake(), sessions, clusters and plans run them; nobody repeats them.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bake/copy_check.h"
#include "bake/fallback_blend.h"
#include "bake/high_coverage.h"
#include "bake/layers.h"
#include "bake/match_stage.h"
#include "bake/match_transitions.h"
#include "bake/progress.h"
#include "base/stopwatch.h"
#include "match/cage_reach.h"

namespace kiln {

/// A band of rows: its samples, and their points of the high poly.
struct PipelineBand {
  TexelBand texels;
  DeviceCorrespondence match;
};

/// True if each band takes the place of the last one, or all stay on the device, for baking again.
enum class Bands { pass, stay };

/// Steps that a pass over the bands does with each.
struct Pass {
  bool match = true;     ///< Points are found
  bool measure = false;  ///< ... or stay, and have other distances
  bool read = true;      ///< All maps are made
};

class Pipeline {
 public:
  /// Input of the bake; all of it outlives the pipeline.
  struct Scene {
    const Source::Impl& high;
    const Mesh& low;
    const BakeOptions& options;
    std::uint32_t finer = 1;  ///< MapRequest::finer
  };

  Pipeline(const Scene& scene, Bands bands, BakeProgress progress = BakeProgress());

  /// One bake from the first stage to the last. \throws Cancelled
  /// \param drawn  see Layers::finish; null where nobody draws the map
  BakeResult run(Clusters& clusters, Image* drawn = nullptr);

  // For those who bake again, stage by stage:

  /// Samples all bands; for Bands::stay.
  void sample();
  /// Makes the matcher, unless one is there that follows the high poly as it moves.
  void prepare_match(Clusters& clusters);
  /// True if points stay as the high poly moves, and only distances change.
  bool points_stay() const { return matcher_ != nullptr && matcher_->points_stay(); }
  /// The high poly's vertices [first, first + positions.size()) moved. Frame units
  void move(std::uint32_t first, std::span<const Vec3> positions);
  /// All bands, through the stages of a pass.
  void over_bands(const Pass& pass);
  /// Sums up what the pass matched. \param first_time  the match may check its conditions, and refuse
  void finish_match(bool first_time);
  /// Mip chain, padding and encoding of all maps.
  void finish_maps(Image* drawn = nullptr);
  /// Reports on the whole at the end.
  void finish_report();
  /// Seconds of the report start from 0.
  void start_watch();
  /// Seconds since the last stage, for stages of the caller's own.
  double lap() { return watch_.lap(); }

  cl::Context& context() const { return context_; }
  const LowSurface& surface() const { return surface_; }
  Layers& layers() { return layers_; }
  std::vector<PipelineBand>& bands() { return bands_; }
  const std::vector<PipelineBand>& bands() const { return bands_; }
  BakeResult& result() { return result_; }
  /// The points of all bands that stay, as the caller's arrays.
  Match whole_match();

 private:
  double reach() const;
  bool keeps_matcher() const;
  void prepare_copies();
  PipelineBand& sampled(std::uint32_t number);
  PipelineBand& take(std::uint32_t number);
  void find(PipelineBand& band, const Pass& pass);
  void note(const PipelineBand& band, const Pass& pass);
  EdgeTurn find_turn();
  Match empty_match();
  void make_collectors();
  void report_coverage();
  void blend();
  void measure_errors(Clusters& clusters);
  void warn_about_pixels();

  Scene scene_;
  cl::Context& context_;
  Bands bands_stay_;
  BakeProgress progress_;
  double unit_;  // world length of a frame unit
  Stopwatch watch_;
  BakeResult result_;
  std::shared_ptr<LowSurface> low_;
  LowSurface& surface_;
  CageReach cage_;
  TexelSampler sampler_;
  EdgeTurn turn_;
  SheetReach sheets_;
  Layers layers_;
  std::vector<PipelineBand> bands_;  // one, or all
  bool sampled_ = false;             // all, and they stay
  std::unique_ptr<Matcher> matcher_;
  std::optional<CopyCheck> copies_;     // where triangles share texels
  std::vector<Warning> made_warnings_;  // of making the matcher
  std::vector<std::uint32_t> chart_of_triangle_;
  ChartMap charts_;
  std::optional<MatchTransitions> transitions_;
  std::optional<FallbackBlend> blend_;
  std::optional<HighCoverage> coverage_, vertex_coverage_;
  double distance_sum_ = 0;
  std::uint32_t cluster_ = 0;
  std::optional<std::uint64_t> source_hash_, low_hash_;
};

/// bake() of one cluster, whose normals are rendered next. \throws Cancelled
/// \param drawn  out: the normals as renderers read them, whatever the map's encoding; null: not wanted
BakeResult bake_drawn(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
                      Image* drawn);

}  // namespace kiln

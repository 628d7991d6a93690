// Runs the stages of a bake: samples, match, fallback, maps, blend, mip chain, padding, encoding. bake(), sessions,
// clusters and plans all use this class.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bake/copy_check.h"
#include "bake/fallback_blend.h"
#include "bake/high_coverage.h"
#include "bake/layers.h"
#include "bake/map_rows.h"
#include "bake/match_stage.h"
#include "bake/match_transitions.h"
#include "bake/progress.h"
#include "base/stopwatch.h"
#include "match/cage_reach.h"

namespace kiln {

/// A band of rows: its samples, and their matched points of the high poly.
struct PipelineBand {
  TexelBand texels;
  DeviceCorrespondence match;
};

/// Memory of bands: each band reuses that of the previous one, or all bands are kept on the device for further bakes.
enum class BandStorage { reused, kept };

/// Selects the steps that a pass over the bands runs.
struct Pass {
  bool match = true;              ///< True: match the samples again
  bool update_distances = false;  ///< Keep the matched points, and update their distances
  bool compute_maps = true;       ///< True: compute all maps from the matched points
};

class Pipeline {
 public:
  /// Input of a bake; all of it must outlive the pipeline.
  struct Scene {
    const Source::Impl& high;
    const Mesh& low;
    const BakeOptions& options;
    /// Divisor of the texels' footprint: MapRequest::footprint_divisor
    std::uint32_t footprint_divisor = 1;
    /// For maps that are finished row by row; null: all images stay in memory
    const OpenMapRows* open_rows = nullptr;
  };

  Pipeline(const Scene& scene, BandStorage bands, BakeProgress progress = BakeProgress());

  /// Runs all stages. \throws Cancelled
  /// \param drawn  see Layers::finish(); null: not computed
  BakeResult run(Clusters& clusters, Image* drawn = nullptr);

  // Single stages of a bake, for callers that bake the same scene repeatedly

  /// Samples all bands and keeps them. Requires BandStorage::kept.
  void sample();
  /// Makes the matcher, unless there is one that is updated when the high poly changes.
  void prepare_match(Clusters& clusters);
  /// True if points stay valid as the high poly moves, and only distances change.
  bool keeps_surface_points() const {
    return matcher_ != nullptr && matcher_->keeps_surface_points();
  }
  /// Moves the high poly's vertices [first, first + positions.size()). Frame units
  void move(std::uint32_t first, std::span<const Vec3> positions);
  /// Runs a pass over all bands.
  void run_over_bands(const Pass& pass);
  /// Completes the report about the match of a pass.
  /// \param first_time  true: also compares UV copies, and completes the matcher's own report, for which
  ///   Matcher::finish() throws Error(input) if the match does not suit the meshes
  void finish_match(bool first_time);
  /// Runs mip chain, padding and encoding of all maps.
  void finish_maps(Image* drawn = nullptr);
  /// Completes the report.
  void finish_report();
  /// Resets the report's seconds to 0.
  void restart_stopwatch();
  /// Returns the seconds since the last stage ended, for stages that the caller runs.
  double lap() { return stopwatch_.lap(); }

  cl::Context& context() const { return context_; }
  const LowSurface& surface() const { return surface_; }
  Layers& layers() { return layers_; }
  std::vector<PipelineBand>& bands() { return bands_; }
  const std::vector<PipelineBand>& bands() const { return bands_; }
  BakeResult& result() { return result_; }
  /// Correspondence of all stored bands, in host memory.
  Match stored_match();

 private:
  double max_point_distance() const;
  BakedMap describe(const Layer& layer) const;
  void open_rows();
  bool keeps_matcher() const;
  void prepare_copies();
  PipelineBand& sample_band(std::uint32_t number);
  PipelineBand& load_band(std::uint32_t number);
  void find(PipelineBand& band, const Pass& pass);
  void record_samples(const PipelineBand& band, const Pass& pass);
  SampleDirections make_directions();
  Match make_empty_match();
  void make_collectors();
  void report_coverage();
  void blend();
  void measure_errors(Clusters& clusters);
  void warn_about_coarse_views();

  Scene scene_;
  cl::Context& context_;
  BandStorage band_storage_;
  BakeProgress progress_;
  double units_per_frame_unit_;  // world units per frame unit
  Stopwatch stopwatch_;
  BakeResult result_;
  std::shared_ptr<LowSurface> low_;
  LowSurface& surface_;
  CageReach cage_;
  // For a high poly that is larger than memory: the part of it that maps read. Null if the whole high
  // poly is in memory
  std::unique_ptr<Source::Impl> streamed_part_;
  TexelSampler sampler_;
  SampleDirections sample_directions_;
  SheetDistances sheet_distances_;
  Layers layers_;
  std::vector<PipelineBand> bands_;  // The current band; with BandStorage::kept, all bands
  bool has_stored_bands_ = false;    // true once all bands are sampled and stored
  std::unique_ptr<Matcher> matcher_;
  std::optional<CopyCheck> copy_check_;    // set if there are triangles that share texels
  std::vector<Warning> matcher_warnings_;  // warnings of the matcher's construction
  std::vector<std::uint32_t> chart_of_triangle_;
  ChartMap charts_;
  std::optional<MethodTransitions> method_transitions_;
  std::optional<FallbackBlend> fallback_blend_;
  std::optional<HighCoverage> coverage_, vertex_coverage_;
  double distance_sum_ = 0;
  std::uint32_t cluster_ = 0;
  std::optional<std::uint64_t> source_hash_, low_hash_;
};

/// Bakes one cluster like bake(), and returns normals for rendering. \throws Cancelled
/// \param drawn out: the normals as renderers read them, independent of the encoding; null: not computed
BakeResult bake_drawn(const Source::Impl& high, const Mesh& low, const BakeOptions& options,
                      Image* drawn);

}  // namespace kiln

// Implementation of simplify(): preparation, reduction, repair and checks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kiln/simplify.h"
#include "mesh/surface_distance.h"
#include "mesh/two_sided.h"
#include "simplify/collapse.h"
#include "simplify/deviation_bound.h"
#include "simplify/enclosing_hull_constraint.h"
#include "simplify/heightfield_constraint.h"
#include "simplify/presimplify.h"
#include "simplify/simplify_check.h"
#include "simplify/simplify_input.h"
#include "simplify/small_components.h"
#include "simplify/surface_fit.h"
#include "simplify/uv_seam_constraint.h"

namespace kiln {

/// Maximum number of rounds of finding and repairing flaws.
inline constexpr int kMaxRepairRounds = 4;
/// Maximum number of high-poly samples for measuring the deviation.
inline constexpr std::uint64_t kMaxSamples = 1 << 18;
/// Radius around flaws within which the next presimplification keeps the high poly, as a share of the diagonal.
inline constexpr double kFlawRadius = 0.01;

/// A low poly in the coordinates of the collapser (unit size).
struct SimplifyResult {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> labels;  ///< Label of each triangle; empty if unknown
  Layout layout;                      ///< The UV layout that was kept; empty if none was
  /// Quadric of each point; empty if unknown
  std::vector<Quadric> quadrics;
  DistanceReport deviation;
  DistanceReport low_to_high;  ///< Deviation from the low to the high poly; only with a bound
  bool is_bounded = false;     ///< True if a bound limited the collapses
  /// The flawed triangles that SimplifyJob::has_no_flaws() found, as balls; degenerate triangles come first
  std::vector<Ball> flawed;
};

/// A mesh while it is simplified, with its constraints.
class SimplifyState {
 public:
  SimplifyState(const Work& work, const Layout* layout, const SimplifyOptions& options,
                const Scale& scale)
      : SimplifyState(work.points, work.triangles, work.labels, layout, options, scale) {
    turn_back_folds(work.folds);
  }
  SimplifyState(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles,
                const std::vector<std::uint32_t>& labels, const Layout* layout,
                const SimplifyOptions& options, const Scale& scale)
      : mesh_(points, triangles, labels),
        layout_(layout == nullptr ? nullptr : std::make_unique<UvSeamConstraint>(mesh_, *layout)),
        height_field_constraint_(
            options.height_field ? std::make_unique<HeightfieldConstraint>(mesh_) : nullptr),
        hull_constraint_(
            options.hull
                ? std::make_unique<EnclosingHullConstraint>(
                      mesh_, [scale](const Vec3d& p) { return scale.snap(p); }, scale.slack())
                : nullptr),
        collapser_(mesh_, rule(), [scale](const Vec3d& p) { return scale.snap(p); }) {}

  EdgeCollapser& collapser() { return collapser_; }
  /// Bounds the distance of the samples from the simplified mesh in all collapses that follow.
  /// \returns true if all samples are within the bound at present
  /// \param close  sets of balls; a sample that lies in a ball gets a smaller limit, once for each such set
  bool limit_deviation(const DeviationSamples& samples, double bound, bool is_high_poly,
                       std::span<const std::vector<Ball>> close, double sharpening) {
    deviation_bound_ = std::make_unique<DeviationBound>(mesh_, samples, bound, is_high_poly);
    for (const std::vector<Ball>& places : close) deviation_bound_->tighten_limits(places);
    collapser_.limit_deviation(deviation_bound_.get(), sharpening, bound);
    return deviation_bound_->was_within_bound();
  }
  void run_within_bound();
  bool is_bounded() const { return deviation_bound_->has_rejected_collapse(); }
  std::size_t faces() const { return mesh_.face_count_with_back_faces(); }
  /// \param of_triangles  see CollapseMesh::two_sided
  void set_two_sided(std::vector<std::uint8_t> of_triangles) {
    mesh_.set_two_sided(std::move(of_triangles));
  }

  /// \param of  receives the original index of each triangle; may be null
  void extract(SimplifyResult& result, std::vector<std::uint32_t>* of = nullptr) const {
    std::vector<std::uint32_t> unrequested_sources;
    std::vector<std::uint32_t>& sources = of != nullptr ? *of : unrequested_sources;
    mesh_.extract(result.points, result.triangles, sources);
    result.quadrics.clear();
    for (std::uint32_t v = 0; v < mesh_.points.size(); ++v) {
      if (mesh_.valence[v] != 0) result.quadrics.push_back(collapser_.quadric(v));
    }
    result.labels.clear();
    if (!mesh_.labels.empty()) {
      for (std::size_t t = 0; t < mesh_.labels.size(); ++t) {
        if (mesh_.alive[t] != 0) result.labels.push_back(mesh_.labels[t]);
      }
    }
    result.layout = {};
    if (!layout_) return;
    const Layout& from = layout_->layout();
    result.layout.uvs = from.uvs;
    for (const std::uint32_t t : sources) {
      result.layout.corners.push_back(from.corners[t]);
      result.layout.charts.push_back(from.charts[t]);
      if (!from.groups.empty()) result.layout.groups.push_back(from.groups[t]);
    }
  }

 private:
  void turn_back_folds(std::span<const Fold> folds);
  /// True if vertices may also move without a collapse.
  bool may_relax() const { return !layout_ && !hull_constraint_; }
  CollapseConstraint* rule() const {
    if (layout_) return layout_.get();
    if (height_field_constraint_) return height_field_constraint_.get();
    return hull_constraint_.get();
  }
  CollapseMesh mesh_;
  std::unique_ptr<UvSeamConstraint> layout_;
  std::unique_ptr<HeightfieldConstraint> height_field_constraint_;
  std::unique_ptr<EnclosingHullConstraint> hull_constraint_;
  EdgeCollapser collapser_;
  std::unique_ptr<DeviationBound> deviation_bound_;
};

/// One run of simplify(): its input, intermediate meshes and report.
class SimplifyJob {
 public:
  SimplifyJob(const Mesh& high, const SimplifyOptions& options, SimplifyReport& report)
      : high_(high),
        options_(options),
        report_(report),
        cleaned_triangles_(
            clean(high, sources_, has_free_vertices(options) ? &backs_ : nullptr, report.warnings)),
        scale_(high, cleaned_triangles_),
        dense_(prepare_dense_mesh()),
        dense_positions_(to_floats(dense_.points)),
        flaw_check_(dense_positions_, dense_.triangles, options.height_field) {
    if (options.keep_uvs)
      layout_ = layout_of(high, dense_);
    else
      find_labels();
  }

  /// Simplifies, and reports progress to the calling thread's callback.
  Mesh run(bool with_deviation);

  /// One mesh, not repaired yet, for each number of faces.
  /// \param faces  [in, out] requested numbers, descending; a number whose mesh equals the previous one is removed
  std::vector<SimplifyResult> levels(std::vector<std::uint32_t>& faces);
  /// Fits a level's vertices and repairs its flaws.
  /// \returns true if it has no flaws
  bool improve(SimplifyResult& result);
  /// Fits a level with fewer samples and rounds, for meshes that are only measured.
  void fit_draft(SimplifyResult& result);
  /// True if solve() may succeed where improve() has failed: all levels share one presimplification, and solve() makes
  /// another.
  bool may_solve();
  /// The repaired low poly. If presimplification causes flaws that cannot be repaired, it is run again and keeps the
  /// high poly around them. If flaws remain, the high poly itself is simplified.
  SimplifyResult solve();
  /// Measures the deviation of a low poly with all samples.
  DistanceReport deviation(const SimplifyResult& result) const;
  /// Numbers of triangles, and of vertices, of the resulting mesh. The backs of two-sided sheets have vertices of their
  /// own.
  std::size_t count_faces(const SimplifyResult& result) const {
    return count_faces(result.triangles.size(), result.labels);
  }
  std::size_t count_vertices(const SimplifyResult& result) const;
  /// Makes the resulting mesh, and completes the report.
  /// \param measured  true: the report includes the deviation of UVs, which is slow to measure
  Mesh make_result(const SimplifyResult& result, bool measured = false);

 private:
  /// Reports the progress of run(). The value never falls, although steps may be repeated. Not used for levels.
  void report_progress(double share);
  /// True if no constraint limits the vertices. Only then are the backs of two-sided sheets left out during
  /// simplification, and inside-out meshes reversed.
  static bool has_free_vertices(const SimplifyOptions& options) {
    return !options.keep_uvs && !options.hull && !options.height_field;
  }
  /// True if a triangle has a back.
  bool has_back(const std::vector<std::uint32_t>& labels, std::size_t triangle) const {
    if (label_back_.empty()) return false;
    return !dense_.keep_labels || label_back_[labels[triangle]] != TwoSided::kNone;
  }
  /// Number of triangles, including the reversed copies of two-sided ones.
  std::size_t count_faces(std::size_t triangles, const std::vector<std::uint32_t>& labels) const;
  std::size_t face_count_of_dense_mesh() const {
    return count_faces(dense_.triangles.size(), dense_.labels);
  }
  std::vector<std::uint8_t> two_sided_flags(const Work& work) const;
  void add_backs(const SimplifyResult& result, std::vector<Vec3d>& points,
                 std::vector<Triangle>& triangles) const;
  DistanceReport measure(const SimplifyResult& result, std::uint64_t samples) const;
  /// The high poly after cleaning, prepared for collapses.
  Work prepare_dense_mesh() {
    is_reversed_ =
        has_free_vertices(options_) && backs_.empty() && turn_outwards(high_, cleaned_triangles_);
    return compact(high_, std::move(cleaned_triangles_), std::move(sources_), std::move(backs_),
                   scale_);
  }
  const Layout* layout() const { return options_.keep_uvs ? &layout_ : nullptr; }
  SimplifyResult unchanged_high_poly() const {
    return {dense_.points, dense_.triangles, dense_.labels, layout_, {}, {}, {}, false, {}};
  }
  SimplifyResult simplify_to_count(const Work& work) const;
  SimplifyResult simplify_within_bound(double bound, const Work& work);
  std::size_t repair_within_bound(SimplifyState& shrinking, SimplifyResult& result);
  bool is_finely_tessellated();
  Work start(std::size_t faces, std::span<const Ball> untouched, bool parts, bool finely_curved,
             PresimplifiedPieces* known_pieces = nullptr) const;
  void find_labels();
  void drop_components(const ComponentSizes& parts, const std::vector<std::uint8_t>& dropped,
                       const std::string& why);
  bool drop_small_components();
  bool drop_surplus(const SimplifyResult& result);
  bool is_fitted(std::size_t faces) const;
  bool prepare_fit();
  std::span<const Quadric> planes_of(const SimplifyResult& result) const;
  SurfaceFit& surface_fit();
  bool fit(SimplifyResult& result);
  void revert_flawed(SimplifyResult& fitted, const SimplifyResult& before);
  std::size_t repair_flaws(SimplifyResult& result);
  bool has_no_flaws(SimplifyResult& result);
  bool simplify_from(const Work& work, bool last, SimplifyResult& result);
  std::vector<Ball> balls_around_flaws(const SimplifyResult& result, const Work& work) const;
  void warn_of_count(const SimplifyResult& result);
  void warn_of_uvs_outside(const Mesh& mesh);
  void assign_labels(const SimplifyResult& result, Mesh& mesh) const;
  void warn_of_bound(const SimplifyResult& result);
  std::string describe_place(const Vec3d& place) const;
  Mesh assemble(const SimplifyResult& result) const;

  const Mesh& high_;
  const SimplifyOptions& options_;
  SimplifyReport& report_;
  std::vector<SourceTriangle> sources_;
  std::vector<std::uint32_t> backs_;
  std::vector<Triangle> cleaned_triangles_;
  Scale scale_;
  /// True if the triangles of dense_ are reversed relative to the given mesh
  bool is_reversed_ = false;
  Work dense_;
  std::vector<Vec3> dense_positions_;
  SimplifyCheck flaw_check_;
  Layout layout_;
  std::vector<std::uint32_t> label_source_;  ///< For each label, a high-poly triangle that has it
  /// For each label, the triangle that is the back of a triangle with this label; see Labels::backs
  std::vector<std::uint32_t> label_back_;
  /// Samples by which bounds on the deviation are checked; built on first use
  std::unique_ptr<DeviationSamples> deviation_samples_;
  std::optional<bool> is_finely_tessellated_;  ///< Result of is_finely_tessellated(), once computed
  std::optional<double>
      reported_progress_;          ///< Largest progress reported so far; nullopt outside of run()
  std::optional<SurfaceFit> fit_;  ///< Fit of vertices; built on first use
};

}  // namespace kiln

// Makes a low poly from a high poly: see kiln/simplify.h.
#include "kiln/simplify.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/formatted.h"
#include "base/memory.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "base/stopwatch.h"
#include "kiln/normals.h"
#include "kiln/validate.h"
#include "simplify/height_layout.h"
#include "simplify/normal_fit.h"
#include "simplify/simplify_job.h"
#include "simplify/simplify_levels.h"
#include "simplify/simplify_uvs.h"
#include "simplify/transfer_colors.h"
#include "simplify/transfer_labels.h"

namespace kiln {
namespace {

/// Peak memory in bytes, in addition to the mesh. Measured with a number of faces as goal: 160 bytes per face of a mesh
/// of 2 million faces. Measured with an error as goal, for which the mesh is not presimplified: 430 bytes per face of a
/// mesh of 300,000, and 338 bytes per face of one of 1.2 million.
std::uint64_t bytes_of(std::uint64_t faces, bool within) {
  constexpr std::uint64_t kMaxCostlyFaces = 300000;
  return within ? 320 * faces + 80 * std::min(faces, kMaxCostlyFaces) : 160 * faces;
}
/// Edges of a level of detail are hard if the angle between their faces exceeds this, in degrees. Levels may be used
/// without maps and UVs. Charts also end at such edges, so levels look the same with and without UVs.
constexpr double kCreaseDegrees = 75;

void check_options(const Mesh& high, const SimplifyOptions& options) {
  if (options.faces == 0 && !(options.max_error > 0 && options.max_error <= 1)) {
    throw Error(ErrorCode::usage,
                "simplify: max_error is " + decimal(options.max_error) +
                    "; it must be above 0 and at most 1, a share of the diagonal");
  }
  require_memory("Simplification", bytes_of(high.triangles.size(), options.faces == 0));
  if (options.hull && (options.height_field || options.keep_uvs)) {
    throw Error(ErrorCode::usage, "simplify: " + option("hull") + " and " +
                                      (options.keep_uvs ? option("keep_uvs") : "height_field") +
                                      " exclude each other: both say where vertices may go");
  }
  if (!options.keep_uvs) return;
  if (options.height_field) {
    throw Error(ErrorCode::usage,
                "simplify: " + option("keep_uvs") +
                    " and height_field exclude each other: a height field's UVs follow "
                    "from its rectangle");
  }
  if (high.uv_triangles.size() != high.triangles.size() || high.uvs.empty()) {
    throw Error(ErrorCode::input, "simplify: mesh '" + high.name +
                                      "' has no UVs to keep; give it some, or leave " +
                                      option("keep_uvs") + " out");
  }
}

}  // namespace

Mesh simplify(const Mesh& high, const SimplifyOptions& options, SimplifyReport* report) {
  const auto start = std::chrono::steady_clock::now();
  validate(high);
  check_options(high, options);
  SimplifyReport unused_report;
  SimplifyReport& out = report != nullptr ? *report : unused_report;
  out = {};
  out.input_faces = high.triangles.size();
  std::optional<Mesh> with_uvs;
  if (options.keep_uvs) with_uvs = with_finite_uvs(high, out.warnings);
  Mesh mesh = SimplifyJob(with_uvs ? *with_uvs : high, options, out).run(report != nullptr);
  ProgressGuard::poll_at(0.9, "simplifying");
  transfer_labels(high, mesh);
  transfer_colors(high, mesh);
  ProgressGuard::poll_at(0.95, "simplifying");
  if (options.fit_normals) NormalFit(high).run(mesh);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return mesh;
}

struct SimplifyLevels::Impl {
  Impl(const Mesh& mesh, std::span<const std::uint32_t> faces, LevelRule rule)
      : repaired(rule == LevelRule::keep_uvs ? with_finite_uvs(mesh, report.warnings)
                                             : std::nullopt),
        high(repaired ? *repaired : mesh),
        requested_faces(faces.begin(), faces.end()) {
    options.faces = requested_faces.empty() ? 1 : requested_faces.front();
    options.keep_uvs = rule == LevelRule::keep_uvs;
    options.height_field = rule == LevelRule::height_field;
    check_options(high, options);
    job.emplace(high, options, report);
    results = job->levels(requested_faces);
    high_report = report;
    high_report.input_faces = high.triangles.size();
  }

  /// A level after fitting and repair, with its measurements.
  struct FinishedLevel {
    SimplifyResult result;
    SimplifyReport report;
    bool has_flaws = false, measured = false;
  };

  /// Selects the level that the following calls work on.
  void select_level(std::size_t level) {
    options.faces = requested_faces.at(level);
    report = high_report;
  }

  FinishedLevel& finished_level(std::size_t level) {
    const auto found = meshes.find(level);
    if (found != meshes.end()) return found->second;
    select_level(level);
    FinishedLevel next{results.at(level), {}};
    next.has_flaws = !job->improve(next.result) && job->may_solve();
    next.report = report;
    return meshes[level] = std::move(next);
  }

  const NormalFit& normals() {
    if (!fit) fit.emplace(high);
    return *fit;
  }

  Mesh with_layout(const SimplifyResult& result) {
    Mesh mesh = job->make_result(result);
    transfer_labels(high, mesh);
    normals().run(mesh, {.crease_degrees = kCreaseDegrees}, nullptr, &samples);
    lay_out(mesh);
    return mesh;
  }

  void lay_out(Mesh& mesh) const {
    if (options.height_field) lay_out_over_rectangle(mesh, FieldRectangle::of(high));
  }

  SimplifyReport report, high_report;
  /// A copy of the mesh with finite UVs; nullopt if all UVs were finite
  const std::optional<Mesh> repaired;
  const Mesh& high;
  /// For each item of `results`, the number of faces that was requested
  std::vector<std::uint32_t> requested_faces;
  SimplifyOptions options;
  std::optional<SimplifyJob> job;
  std::optional<NormalFit> fit;  ///< Fit of normals; built on first use
  NormalFit::Samples samples;    ///< Samples on the previously fitted mesh, for reuse
  std::vector<SimplifyResult> results;
  std::map<std::size_t, FinishedLevel> meshes;  ///< Finished levels, by index
};

SimplifyLevels::SimplifyLevels(const Mesh& high, std::span<const std::uint32_t> faces,
                               LevelRule rule) {
  validate(high);
  impl_ = std::make_unique<Impl>(high, faces, rule);
}
SimplifyLevels::~SimplifyLevels() = default;

std::size_t SimplifyLevels::count() const { return impl_->results.size(); }
std::uint32_t SimplifyLevels::requested_faces_of(std::size_t level) const {
  return impl_->requested_faces.at(level);
}
std::size_t SimplifyLevels::faces(std::size_t level) const {
  return impl_->job->count_faces(impl_->results.at(level));
}
std::size_t SimplifyLevels::vertices(std::size_t level) const {
  return impl_->job->count_vertices(impl_->results.at(level));
}

Mesh SimplifyLevels::mesh(std::size_t level, SimplifyReport* report) const {
  if (report != nullptr) *report = this->report(level);
  Impl::FinishedLevel& entry = impl_->finished_level(level);
  impl_->select_level(level);
  impl_->report = entry.report;
  return impl_->with_layout(entry.result);
}

SimplifyReport SimplifyLevels::report(std::size_t level) const {
  Impl::FinishedLevel& entry = impl_->finished_level(level);
  if (!std::exchange(entry.measured, true)) {
    entry.result.deviation = impl_->job->deviation(entry.result);
  }
  impl_->select_level(level);
  impl_->report = entry.report;
  impl_->job->make_result(entry.result, /*measured=*/true);
  return impl_->report;
}

std::array<Mesh, 2> SimplifyLevels::draft_meshes(std::size_t level, EdgesUnderMap edges) const {
  impl_->select_level(level);
  SimplifyResult result = impl_->results.at(level);
  impl_->job->fit_draft(result);
  std::array<Mesh, 2> draft_copies = impl_->normals().run_draft(
      impl_->job->make_result(result), {.crease_degrees = kCreaseDegrees}, edges);
  for (Mesh& mesh : draft_copies) impl_->lay_out(mesh);
  return draft_copies;
}

void SimplifyLevels::fit_normals(Mesh& low, EdgesUnderMap edges) const {
  impl_->normals().run(low, {}, nullptr, &impl_->samples, edges);
}

bool SimplifyLevels::can_be_solved(std::size_t level) const {
  return impl_->finished_level(level).has_flaws;
}

bool SimplifyLevels::has_flaws(std::size_t level) const {
  const SimplifyReport& report = impl_->finished_level(level).report;
  return report.folded + report.without_area + report.holes > 0;
}

void SimplifyLevels::solve(std::size_t level) const {
  Impl::FinishedLevel& entry = impl_->finished_level(level);
  if (!std::exchange(entry.has_flaws, false)) return;
  impl_->select_level(level);
  entry.result = impl_->job->solve();
  entry.report = impl_->report;
  entry.measured = false;
}

std::vector<SimplifiedLevel> simplify_levels(const Mesh& high, std::span<const std::uint32_t> faces,
                                             const SimplifyOptions& options) {
  const SimplifyOptions default_options;
  if (faces.empty())
    throw Error(ErrorCode::usage, "simplify_levels() needs a number of faces for each level.");
  if (std::adjacent_find(faces.begin(), faces.end(), std::less_equal<>()) != faces.end()) {
    throw Error(ErrorCode::usage, "The numbers of faces of levels must descend.");
  }
  if (options.max_error != default_options.max_error || options.hull || options.keep_parts ||
      options.fit_normals != default_options.fit_normals) {
    throw Error(
        ErrorCode::usage,
        "Levels support only keep_uvs and height_field: call simplify() for other options.");
  }
  if (options.keep_uvs && options.height_field) {
    throw Error(ErrorCode::usage, "keep_uvs and height_field exclude each other: leave one out.");
  }
  const SimplifyLevels levels(high, faces,
                              options.keep_uvs       ? LevelRule::keep_uvs
                              : options.height_field ? LevelRule::height_field
                                                     : LevelRule::shape);
  std::vector<SimplifiedLevel> result;
  result.reserve(faces.size());
  std::size_t level = 0;
  for (const std::uint32_t number : faces) {
    // If a requested count has no mesh of its own, its level is that of the previous count, which already has at most
    // as many faces.
    const std::size_t previous_level = level;
    while (level + 1 < levels.count() && levels.requested_faces_of(level + 1) >= number) ++level;
    if (!result.empty() && level == previous_level) {
      result.push_back(result.back());
      continue;
    }
    const Stopwatch timer;
    SimplifiedLevel& simplified = result.emplace_back();
    if (levels.can_be_solved(level)) levels.solve(level);
    simplified.mesh = levels.mesh(level, &simplified.report);
    transfer_colors(high, simplified.mesh);
    simplified.report.seconds = timer.total();
  }
  return result;
}

}  // namespace kiln

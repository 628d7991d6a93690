// Part of SimplifyJob: fits vertices to the high poly.
#include <utility>

#include "simplify/simplify_job.h"

namespace kiln {
namespace {

/// Vertices are only fitted if the high poly has at least this many triangles per face of the low poly. Below it,
/// quadrics alone reproduce the high poly's edges better: fitting a hard-surface assembly at a quarter of its triangles
/// made its normals 9% worse.
constexpr std::size_t kMinTrianglesPerFace = 6;

}  // namespace

/// True if the vertices of a low poly of `faces` faces are fitted to the high poly.
bool SimplifyJob::is_fitted(std::size_t faces) const {
  return !options_.hull && !options_.keep_uvs && options_.faces != 0 &&
         dense_.triangles.size() >= kMinTrianglesPerFace * faces;
}

/// Prepares the part of the fit that depends on the high poly alone.
/// \returns true if the vertices will be fitted
bool SimplifyJob::prepare_fit() {
  if (!is_fitted(options_.faces)) return false;
  surface_fit().prepare(options_.faces);
  return true;
}

/// The quadrics that attract the vertices of a low poly during the fit. On height fields, they also keep the outline a
/// rectangle.
std::span<const Quadric> SimplifyJob::planes_of(const SimplifyResult& result) const {
  if (options_.height_field) return {};
  return result.quadrics;
}

SurfaceFit& SimplifyJob::surface_fit() {
  if (!fit_) {
    fit_.emplace(dense_positions_, dense_.triangles, options_.height_field,
                 [this](const Vec3d& p) { return scale_.snap(p); });
  }
  return *fit_;
}

void SimplifyJob::fit_draft(SimplifyResult& result) {
  if (!is_fitted(result.triangles.size())) return;
  surface_fit().run(result.points, result.triangles, result.labels, planes_of(result),
                    /*draft=*/true);
}

/// Moves the corners of flawed triangles back to their positions before the fit.
void SimplifyJob::revert_flawed(SimplifyResult& fitted, const SimplifyResult& before) {
  for (int round = 0; round < kMaxRepairRounds; ++round) {
    const Flaws flaws = flaw_check_.find(fitted.points, fitted.triangles);
    bool any = false;
    for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
      for (const std::uint32_t t : *list) {
        for (const std::uint32_t v : fitted.triangles[t]) {
          const Vec3d displacement = fitted.points[v] - before.points[v];
          any = any || dot(displacement, displacement) > 0;
          fitted.points[v] = before.points[v];
        }
      }
    }
    if (!any) return;
  }
}

/// Fits vertices, and repairs the flaws that the fit causes. Does nothing if a constraint determines the positions of
/// the vertices.
/// \returns true on success; on failure, `result` is restored
bool SimplifyJob::fit(SimplifyResult& result) {
  if (!is_fitted(result.triangles.size())) return false;
  SimplifyResult fitted = result;
  surface_fit().run(fitted.points, fitted.triangles, fitted.labels, planes_of(fitted));
  revert_flawed(fitted, result);
  report_.mended = repair_flaws(fitted);
  if (!has_no_flaws(fitted)) return false;
  result = std::move(fitted);
  return true;
}

}  // namespace kiln

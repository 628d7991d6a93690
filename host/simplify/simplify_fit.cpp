// simplify() at work: vertices moved until faces lie on the high poly.
#include <utility>

#include "simplify/simplify_job.h"

namespace kiln {
namespace {

/// Vertices are fitted where the high poly has at least this many triangles for each face. With fewer, quadrics
/// meet its edges better (assembly of hard surfaces to a quarter of its triangles: normals 9% worse when fitted).
constexpr std::size_t kLeastToFit = 6;

}  // namespace

/// True if vertices of a low poly move to where its faces lie on the high poly.
bool SimplifyJob::is_fitted(std::size_t faces) const {
  return !options_.hull && !options_.keep_uvs && options_.faces != 0 &&
         dense_.triangles.size() >= kLeastToFit * faces;
}

/// Does what fit() needs of the high poly alone. \returns whether there is a fit
bool SimplifyJob::prepare_fit() {
  if (!is_fitted(options_.faces)) return false;
  surface_fit().prepare(options_.faces);
  return true;
}

/// The planes that hold a low poly's vertices while they are fitted. Those of height fields hold its rectangle, too.
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

void SimplifyJob::fit_roughly(SimplifyResult& result) {
  if (!is_fitted(result.triangles.size())) return;
  surface_fit().run(result.points, result.triangles, result.labels, planes_of(result),
                    /*rough=*/true);
}

/// Corners of triangles that are no good go back to where they were.
void SimplifyJob::take_back_flaws(SimplifyResult& fitted, const SimplifyResult& before) {
  for (int round = 0; round < kMendingRounds; ++round) {
    const Flaws flaws = check_.find(fitted.points, fitted.triangles);
    bool any = false;
    for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
      for (const std::uint32_t t : *list) {
        for (const std::uint32_t v : fitted.triangles[t]) {
          const Vec3d way = fitted.points[v] - before.points[v];
          any = any || dot(way, way) > 0;
          fitted.points[v] = before.points[v];
        }
      }
    }
    if (!any) return;
  }
}

/// Moves vertices so that the faces lie on the high poly, and mends that, where nothing else says how vertices may
/// move. \returns whether that was good; else `result` is as it was
bool SimplifyJob::fit(SimplifyResult& result) {
  if (!is_fitted(result.triangles.size())) return false;
  SimplifyResult fitted = result;
  surface_fit().run(fitted.points, fitted.triangles, fitted.labels, planes_of(fitted));
  take_back_flaws(fitted, result);
  report_.mended = mend(fitted);
  if (!is_good(fitted)) return false;
  result = std::move(fitted);
  return true;
}

}  // namespace kiln

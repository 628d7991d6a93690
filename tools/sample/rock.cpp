#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "scenes.h"
#include "sweep.h"

namespace kiln::sample {
namespace {

/// The profile of a unit sphere: half a circle from the lowest to the highest point.
Profile half_circle() {
  std::vector<Profile::ProfileControl> controls;
  constexpr int kPieces = 24;
  for (int i = 0; i <= kPieces; ++i) {
    const double latitude = std::numbers::pi * (static_cast<double>(i) / kPieces - 0.5);
    controls.push_back({std::cos(latitude), std::sin(latitude)});
  }
  controls.front().radius = controls.back().radius = 0;
  return Profile(controls);
}

/// Distance from the centre to the boulder's large facets in a direction: a smooth minimum of the distances to planes,
/// so that the silhouette is angular and needs few triangles.
double facets(const Point& direction) {
  const std::vector<Point> planes = {{0.9, 0.2, 0.3},    {-0.8, 0.35, 0.4},  {0.1, 0.95, 0.2},
                                     {0.2, 0.1, 1.0},    {-0.3, -0.2, -1.0}, {0.5, -0.3, -0.8},
                                     {-0.9, -0.3, -0.2}, {0.3, -1.0, 0.1},   {-0.4, 0.7, -0.6},
                                     {0.7, 0.6, -0.4},   {-0.5, -0.6, 0.6}};
  double sum = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const double length = std::sqrt(dot(planes[i], planes[i]));
    const double away = 0.80 + 0.035 * static_cast<double>(i * 7 % 5);
    const double along = dot(direction, planes[i]) / (length * away);
    if (along > 0) sum += std::pow(along, 14);
  }
  return std::min(std::pow(sum, -1.0 / 14), 1.35);
}

Point boulder(const SurfacePoint& at) {
  const Point& direction = at.position;
  const Point body = facets(direction) * Point{1.05 * direction.x, 0.85 * direction.y, direction.z};
  const Point warp{fractal_noise(2 * body, 4, 1), fractal_noise(2 * body, 4, 2),
                   fractal_noise(2 * body, 4, 3)};
  const Point q = body + 0.12 * warp;

  double h = 0.05 * fractal_noise(1.6 * body, 2, 5);
  h += 0.055 * (ridged_noise(3.2 * q, 6, 7) - 0.55);
  // Strata: inclined layers, of which hard ones protrude and soft ones are eroded.
  const double bed = 11 * (q.y + 0.22 * q.x) + 0.8 * gradient_noise(2 * body, 9);
  const double in_bed = bed - std::floor(bed);
  const double hardness = gradient_noise({0.37, std::floor(bed) + 0.5, 0.61}, 10);
  const double strata = smooth_step(-0.2, 0.4, gradient_noise(1.1 * body, 12));
  h += strata * (0.020 * hardness - 0.022 * smooth_step(0.12, 0.0, std::min(in_bed, 1 - in_bed)));
  // Cracks, large and small.
  for (const double size : {1.7, 5.5}) {
    const Cells cells = cellular_noise(size * q, size < 2 ? 21u : 22u);
    const double width = std::max(0.03 / size, 1.5 * at.spacing);
    const double open = smooth_step(-0.15, 0.25, gradient_noise(1.5 * body, size < 2 ? 23u : 24u));
    h -= (0.055 / size) * open * smooth_step(width, 0, cells.border / size);
    h += (0.030 / size) * open * (unit_from(cells.cell_hash) - 0.5);
  }
  const Cells holes = cellular_noise(18 * body, 31);
  if (unit_from(holes.cell_hash) < 0.35) h -= 0.007 * smooth_step(0.36, 0.12, holes.nearest);
  h += 0.004 * fractal_noise(22 * body, 4, 33);
  return body + h * direction;
}

}  // namespace

void rock(std::uint64_t faces, MeshPieceSink& sink) { sweep(half_circle(), faces, boulder, sink); }

Mesh rock(std::uint64_t faces) {
  Mesh mesh = sweep(half_circle(), faces, boulder);
  mesh.name = "rock";
  return mesh;
}

}  // namespace kiln::sample

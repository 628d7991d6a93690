// Part of SimplifyJob: two-sided sheets, of which only the fronts are simplified.
#include <algorithm>

#include "simplify/simplify_job.h"

namespace kiln {

std::size_t SimplifyJob::count_faces(std::size_t triangles,
                                     const std::vector<std::uint32_t>& labels) const {
  if (label_back_.empty()) return triangles;
  std::size_t count = triangles;
  for (std::size_t t = 0; t < triangles; ++t) count += has_back(labels, t);
  return count;
}

std::vector<std::uint8_t> SimplifyJob::two_sided_flags(const Work& work) const {
  std::vector<std::uint8_t> sides(label_back_.empty() ? 0 : work.triangles.size());
  for (std::size_t t = 0; t < sides.size(); ++t) sides[t] = has_back(work.labels, t);
  return sides;
}

std::size_t SimplifyJob::count_vertices(const SimplifyResult& result) const {
  std::vector<Vec3d> points = result.points;
  std::vector<Triangle> triangles;
  add_backs(result, points, triangles);
  return points.size();
}

/// For each triangle whose surface is two-sided in the high poly, adds a back: a triangle with the opposite
/// orientation. Backs get vertices of their own, since many programs reject two faces with the same vertices.
void SimplifyJob::add_backs(const SimplifyResult& result, std::vector<Vec3d>& points,
                            std::vector<Triangle>& triangles) const {
  if (label_back_.empty()) return;
  std::vector<std::uint32_t> number(result.points.size(), kNoVertex);
  for (std::size_t t = 0; t < result.triangles.size(); ++t) {
    if (!has_back(result.labels, t)) continue;
    Triangle corners = result.triangles[t];
    std::swap(corners[1], corners[2]);
    for (std::uint32_t& v : corners) {
      if (number[v] == kNoVertex) {
        number[v] = static_cast<std::uint32_t>(points.size());
        points.push_back(result.points[v]);
      }
      v = number[v];
    }
    triangles.push_back(corners);
  }
}

/// Measures the deviation. If only some triangles are two-sided, the samples on these count twice.
DistanceReport SimplifyJob::measure(const SimplifyResult& result, std::uint64_t samples) const {
  const SurfaceDistance low(to_floats(result.points), result.triangles);
  if (!dense_.keep_labels) {
    return one_sided_distance(dense_positions_, dense_.triangles, low, samples);
  }
  std::vector<Triangle> triangles;
  for (std::size_t t = 0; t < dense_.triangles.size(); ++t) {
    triangles.push_back(dense_.triangles[t]);
    if (has_back(dense_.labels, t)) triangles.push_back(dense_.triangles[t]);
  }
  return one_sided_distance(dense_positions_, triangles, low, samples);
}

}  // namespace kiln

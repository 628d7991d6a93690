#include "simplify/collapse_shape.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/two_boxes.h"

namespace kiln {
namespace {

/// Cosine of the largest angle by which a collapse may turn a triangle's normal; one value per leniency, of which 0 is
/// the strictest (CollapseShape::kMaxLeniency).
constexpr std::array<double, 3> kMinTurnCosines{0.5, 0.2, 0.0};
/// Minimum quality of a triangle (1: equilateral; 0: no area). Triangles below it may not get worse. The limit is low,
/// a triangle 80 times as long as high, because long triangles along bevels and creases approximate the surface better
/// than even ones. With a limit of 0.35, errors of rendered normals were up to 13% larger.
constexpr double kMinQuality = 0.02;
/// Minimum of a triangle's doubled area over its squared longest side. Triangles below it may not get worse at any
/// leniency. Triangles at this limit are still safely non-degenerate in single precision.
constexpr double kMinAreaRatio = 1e-5;
/// A triangle is degenerate if its doubled area over its squared longest side is below this ratio.
constexpr double kDegenerateRatio = 1e-12;
/// Smallest cosine between the normal of a triangle and the mean normal of the surface that its corners replace;
/// one value per leniency.
constexpr std::array<double, 3> kMinFacingCosines{0.2, 0.0, -0.1};
/// Minimum length of a mean of unit normals. Normals with a shorter mean have no common direction.
constexpr double kMinDirectionLength = 0.3;
/// Two adjacent triangles are folded onto each other if the cosine between their normals is below this; one value per
/// leniency.
constexpr std::array<double, 3> kMinFoldCosines{-0.8, -0.9, -0.985};
/// If a collapse turns no triangle by more than the angle of this cosine, it cannot cause folds. On flat surfaces this
/// saves nearly all checks for folds.
constexpr double kSafeTurnCosine = 0.9999;
/// Replaces kMinFoldCosines if collapses run until none is allowed.
constexpr double kStrictMinFoldCosine = -0.5;
/// If a vertex has more triangles than this, they are sorted for searching.
constexpr std::size_t kMinValenceToSort = 32;

/// \param sides  sum of the squared side lengths
double triangle_quality(double sides, double doubled_area) {
  return 2 * std::sqrt(3.0) * doubled_area / sides;
}

}  // namespace

CollapseShape::CollapseShape(const CollapseMesh& mesh)
    : orientation_of_vertex_(mesh.points.size()) {
  for (const Triangle& t : mesh.triangles) {
    const Vec3d normal =
        cross(mesh.points[t[1]] - mesh.points[t[0]], mesh.points[t[2]] - mesh.points[t[0]]);
    for (const std::uint32_t vertex : t)
      orientation_of_vertex_[vertex] += MeanOrientation{normal, length(normal)};
  }
}

CollapseShape::MeanOrientation& CollapseShape::MeanOrientation::operator+=(
    const MeanOrientation& other) {
  sum += other.sum;
  area += other.area;
  return *this;
}

/// Cosine between a normal and the mean direction. 1 if there is no mean direction, because the surface faces in all
/// directions.
double CollapseShape::MeanOrientation::cosine_to_mean(const Vec3d& unit_normal) const {
  const double size = length(sum);
  return size > kMinDirectionLength * area ? dot(unit_normal, sum) / size : 1;
}

/// Adds the triangles around the vertex `moved` that remain after the collapse. Returns false if one of them is not
/// allowed.
bool CollapseShape::add(CollapseMesh& mesh, std::uint32_t moved, std::uint32_t other,
                        const Vec3d& target, std::uint32_t leniency,
                        const MeanOrientation& orientation) {
  mesh.visits += mesh.around(moved).size();
  const Vec3d& a = mesh.points[moved];
  // Each Double2 holds a coordinate before and after the move.
  const Double2 ax{a.x, target.x}, ay{a.y, target.y}, az{a.z, target.z};
  for (const std::uint32_t t : mesh.around(moved)) {
    if (mesh.alive[t] == 0 || mesh.contains(t, other)) continue;
    const Triangle& v = mesh.triangles[t];
    const std::size_t k = v[0] == moved ? 0 : v[1] == moved ? 1 : 2;
    const std::uint32_t first = v[(k + 1) % 3], second = v[(k + 2) % 3];
    const Vec3d &b = mesh.points[first], &c = mesh.points[second];
    const Double2 bx = Double2{b.x, b.x} - ax, by = Double2{b.y, b.y} - ay,
                  bz = Double2{b.z, b.z} - az;
    const Double2 cx = Double2{c.x, c.x} - ax, cy = Double2{c.y, c.y} - ay,
                  cz = Double2{c.z, c.z} - az;
    const Double2 nx = by * cz - bz * cy, ny = bz * cx - bx * cz, nz = bx * cy - by * cx;
    const Double2 n2 = nx * nx + ny * ny + nz * nz;
    const Double2 b2 = bx * bx + by * by + bz * bz, c2 = cx * cx + cy * cy + cz * cz;
    const Vec3d bc = c - b;
    const double d2 = dot(bc, bc);
    const Double2 longest = larger(larger(b2, c2), Double2{d2, d2});
    const Vec3d normal_before{nx[0], ny[0], nz[0]}, normal_after{nx[1], ny[1], nz[1]};
    const double turn = dot(normal_before, normal_after), sides = b2[1] + d2 + c2[1];
    const double length_before = std::sqrt(n2[0]), length_after = std::sqrt(n2[1]);
    const double ratio_before = length_before / longest[0], ratio = length_after / longest[1];
    if (!(ratio > kDegenerateRatio) || (ratio < kMinAreaRatio && !(ratio > ratio_before)))
      return false;
    const bool had_area = ratio_before > kDegenerateRatio;
    if (had_area && !(turn > kMinTurnCosines[leniency] * length_before * length_after))
      return false;
    const Vec3d normal = normal_after * (1 / length_after);
    const Vec3d unit_normal_before = had_area ? normal_before * (1 / length_before) : Vec3d{};
    const bool turns_far = !had_area || !(dot(unit_normal_before, normal) > kSafeTurnCosine);
    if (sharpening_ || turns_far) {
      MeanOrientation replaced_surface = orientation;
      replaced_surface += orientation_of_vertex_[first];
      replaced_surface += orientation_of_vertex_[second];
      if (const double cosine = replaced_surface.cosine_to_mean(normal);
          cosine < kMinFacingCosines[leniency]) {
        // A triangle that faces away is only allowed if it faced away even more before.
        if (!had_area || !(cosine > replaced_surface.cosine_to_mean(unit_normal_before)))
          return false;
      }
    }
    if (leniency == 0) {
      const double quality = triangle_quality(sides, length_after);
      if (quality < kMinQuality && quality < triangle_quality(b2[0] + d2 + c2[0], length_before))
        return false;
    }
    any_turns_far_ = any_turns_far_ || sharpening_ || turns_far;
    new_triangles_.push_back({first, second, turns_far, unit_normal_before, normal});
  }
  return true;
}

/// True if the collapse makes neighbouring triangles fold onto each other that were not folded before.
bool CollapseShape::creates_folds(CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                  std::uint32_t leniency) {
  if (!any_turns_far_) return false;
  double cosine_before = 1, cosine_after = 1;
  const bool is_sorted = new_triangles_.size() > kMinValenceToSort;
  const auto is_less = [](const Star& x, std::uint32_t v) { return x.first < v; };
  if (is_sorted) {
    std::sort(new_triangles_.begin(), new_triangles_.end(),
              [](const Star& x, const Star& y) { return x.first < y.first; });
  }
  for (const Star& s : new_triangles_) {
    if (!sharpening_ && !s.turns_far) continue;
    auto next = new_triangles_.begin();
    if (is_sorted) next = std::lower_bound(next, new_triangles_.end(), s.second, is_less);
    for (; next != new_triangles_.end() && !(is_sorted && next->first != s.second); ++next) {
      if (next->first != s.second) continue;
      cosine_before = std::min(cosine_before, dot(s.before, next->before));
      cosine_after = std::min(cosine_after, dot(s.after, next->after));
    }
    if (mesh.is_hub(s.first) && mesh.is_hub(s.second)) continue;
    mesh.visits += std::min(mesh.valence[s.first], mesh.valence[s.second]);
    mesh.each_triangle_on_edge(s.first, s.second, [&](std::uint32_t t) {
      if (mesh.contains(t, a) || mesh.contains(t, b)) return;
      const Triangle& v = mesh.triangles[t];
      const Vec3d normal =
          cross(mesh.points[v[1]] - mesh.points[v[0]], mesh.points[v[2]] - mesh.points[v[0]]);
      const double size = length(normal);
      // A triangle that runs along the edge in the same direction belongs to another sheet of the surface.
      const std::size_t k = v[0] == s.second ? 0 : v[1] == s.second ? 1 : 2;
      if (!(size > 0) || v[(k + 1) % 3] != s.first) return;
      cosine_before = std::min(cosine_before, dot(s.before, normal) / size);
      cosine_after = std::min(cosine_after, dot(s.after, normal) / size);
    });
  }
  if (sharpening_)
    return cosine_after < kStrictMinFoldCosine && cosine_after < cosine_before - *sharpening_;
  return cosine_after < kMinFoldCosines[leniency] && cosine_after < cosine_before;
}

bool CollapseShape::keeps(CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, const Vec3d& target,
                          std::uint32_t fixed, std::uint32_t leniency) {
  new_triangles_.clear();
  any_turns_far_ = false;
  MeanOrientation orientation = orientation_of_vertex_[a];
  if (b != kNoVertex) orientation += orientation_of_vertex_[b];
  if (a != fixed && !add(mesh, a, b, target, leniency, orientation)) return false;
  if (b != kNoVertex && b != fixed && !add(mesh, b, a, target, leniency, orientation)) return false;
  return !creates_folds(mesh, a, b, leniency);
}

}  // namespace kiln

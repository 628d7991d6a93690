#include "simplify/heightfield_constraint.h"

#include <algorithm>

namespace kiln {
namespace {

/// One bit for each side of the rectangle.
constexpr std::uint8_t kLeft = 1, kRight = 2, kBottom = 4, kTop = 8;

}  // namespace

double upward_quality(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const auto squared = [](const Vec3d& e) { return e.x * e.x + e.y * e.y; };
  const Vec3d ab = b - a, ac = c - a;
  const double longest = std::max({squared(ab), squared(ac), squared(c - b)});
  return longest > 0 ? (ab.x * ac.y - ab.y * ac.x) / longest : 0;
}

HeightfieldConstraint::HeightfieldConstraint(const CollapseMesh& mesh) {
  Vec3d low = mesh.points.empty() ? Vec3d{} : mesh.points[0], high = low;
  for (const Vec3d& p : mesh.points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), 0};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), 0};
  }
  rectangle_sides_.reserve(mesh.points.size());
  for (const Vec3d& p : mesh.points) {
    rectangle_sides_.push_back(
        static_cast<std::uint8_t>((p.x == low.x ? kLeft : 0) | (p.x == high.x ? kRight : 0) |
                                  (p.y == low.y ? kBottom : 0) | (p.y == high.y ? kTop : 0)));
  }
}

std::optional<Vec3d> HeightfieldConstraint::place(const CollapseMesh& mesh, std::uint32_t a,
                                                  std::uint32_t b, Anchor anchor,
                                                  Quadric& sum) const {
  const Vec3d &pa = mesh.points[a], &pb = mesh.points[b];
  const auto sides_of_both = static_cast<std::uint8_t>(rectangle_sides_[a] | rectangle_sides_[b]);
  // Vertices on different sides of the rectangle may not merge, since one of them would leave its side.
  if (sides_of_both != rectangle_sides_[a] && sides_of_both != rectangle_sides_[b])
    return std::nullopt;
  if (anchor != Anchor::none) {
    const std::uint32_t fixed = anchor == Anchor::first ? a : b;
    return rectangle_sides_[fixed] == sides_of_both ? std::optional(mesh.points[fixed])
                                                    : std::nullopt;
  }
  if (sides_of_both == 0) return sum.best_near(pa, pb);
  // The merged vertex only moves along the side on which one of the two vertices lies. A corner of the rectangle keeps
  // its position.
  const Vec3d& fixed = rectangle_sides_[a] == sides_of_both ? pa : pb;
  const bool x_fixed = (sides_of_both & (kLeft | kRight)) != 0,
             y_fixed = (sides_of_both & (kBottom | kTop)) != 0;
  if (x_fixed && y_fixed) return fixed;
  Vec3d best = sum.best_near(pa, pb);
  (x_fixed ? best.x : best.y) = x_fixed ? fixed.x : fixed.y;
  return best;
}

bool HeightfieldConstraint::faces_up(const CollapseMesh& mesh, std::uint32_t moved,
                                     std::uint32_t other, const Vec3d& target) const {
  for (const std::uint32_t t : mesh.around(moved)) {
    if (mesh.alive[t] == 0 || mesh.contains(t, other)) continue;
    std::array<Vec3d, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) p[k] = mesh.points[mesh.triangles[t][k]];
    const double before = upward_quality(p[0], p[1], p[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      if (mesh.triangles[t][k] == moved) p[k] = target;
    }
    const double after = upward_quality(p[0], p[1], p[2]);
    if (after < kMinUpwardQuality && !(after > before)) return false;
  }
  return true;
}

bool HeightfieldConstraint::keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                  Anchor, const Vec3d& target) const {
  return faces_up(mesh, a, b, target) && faces_up(mesh, b, a, target);
}

void HeightfieldConstraint::collapse(const CollapseMesh&, std::uint32_t a, std::uint32_t b, Anchor,
                                     const Vec3d&, std::uint32_t kept) {
  rectangle_sides_[kept] = static_cast<std::uint8_t>(rectangle_sides_[a] | rectangle_sides_[b]);
}

bool HeightfieldConstraint::may_move(const CollapseMesh& mesh, std::uint32_t vertex,
                                     const Vec3d& target) const {
  return rectangle_sides_[vertex] == 0 && faces_up(mesh, vertex, kNoVertex, target);
}

}  // namespace kiln

#include "simplify/enclosing_hull_constraint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace kiln {
namespace {

/// Bound on the rounding errors of double precision in a mesh of unit size.
constexpr double kHullRounding = 1e-14;
/// Half-spaces are parallel if the sine between their normals is below this.
constexpr double kMaxParallelSine = 1e-9;

/// The quadratic form x.M.x / 2 - r.x with a symmetric matrix M; x is relative to the middle of an edge.
struct QuadraticForm {
  Vec3d row0{}, row1{}, row2{}, right{};

  Vec3d multiply(const Vec3d& v) const { return {dot(row0, v), dot(row1, v), dot(row2, v)}; }
};

/// Minimum of the form on a line through `at`, restricted to the points inside all of `half_spaces`.
std::optional<Vec3d> minimum_on_line(const QuadraticForm& form, const Vec3d& at, const Vec3d& along,
                                     std::span<const HalfSpace> half_spaces) {
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (const HalfSpace& half_space : half_spaces) {
    const double slope = dot(half_space.normal, along);
    const double gap = half_space.offset - dot(half_space.normal, at);
    if (std::abs(slope) < kMaxParallelSine) {
      if (gap > kHullRounding) return std::nullopt;
    } else if (slope > 0) {
      low = std::max(low, gap / slope);
    } else {
      high = std::min(high, gap / slope);
    }
  }
  if (low > high + kHullRounding) return std::nullopt;
  const double best = dot(along, form.right - form.multiply(at)) / dot(along, form.multiply(along));
  return at + along * std::min(std::max(best, low), high);
}

/// Minimum of the form on the plane that bounds a half-space, restricted to the points inside all of `half_spaces`.
std::optional<Vec3d> minimum_on_plane(const QuadraticForm& form, const HalfSpace& plane,
                                      std::span<const HalfSpace> half_spaces) {
  const Vec3d& n = plane.normal;
  const Vec3d other = std::abs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  Vec3d u = cross(n, other);
  u = u * (1 / length(u));
  const Vec3d v = cross(n, u);
  const Vec3d from = n * plane.offset;
  const Vec3d mu = form.multiply(u), mv = form.multiply(v),
              residual = form.right - form.multiply(from);
  const double uu = dot(u, mu), uv = dot(u, mv), vv = dot(v, mv);
  const double ru = dot(u, residual), rv = dot(v, residual);
  const double determinant = uu * vv - uv * uv;
  Vec3d best =
      from + u * ((ru * vv - rv * uv) / determinant) + v * ((rv * uu - ru * uv) / determinant);
  for (std::size_t i = 0; i < half_spaces.size(); ++i) {
    const HalfSpace& half_space = half_spaces[i];
    if (dot(half_space.normal, best) >= half_space.offset - kHullRounding) continue;
    const Vec3d along = cross(n, half_space.normal);
    const double sine = length(along);
    if (sine < kMaxParallelSine) return std::nullopt;
    // The search starts at a point on the intersection line of the two planes.
    const double cosine = dot(n, half_space.normal);
    const double share = 1 / (sine * sine);
    const Vec3d at = n * ((plane.offset - half_space.offset * cosine) * share) +
                     half_space.normal * ((half_space.offset - plane.offset * cosine) * share);
    const std::optional<Vec3d> on_line =
        minimum_on_line(form, at, along * (1 / sine), half_spaces.first(i));
    if (!on_line) return std::nullopt;
    best = *on_line;
  }
  return best;
}

/// Calls `body` for each open edge at a vertex, with the edge's two vertices in the order of its triangle, and that
/// triangle's normal.
template <class Body>
void each_open_edge(const CollapseMesh& mesh, std::uint32_t vertex, const Body& body) {
  struct EdgeTriangle {
    std::uint32_t other, triangle;
    bool starts_at_vertex;  ///< True if the edge starts at the vertex
  };
  thread_local std::vector<EdgeTriangle> sides;
  sides.clear();
  mesh.each_triangle_around(vertex, [&](std::uint32_t t) {
    const Triangle& v = mesh.triangles[t];
    const std::size_t k = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
    sides.push_back({v[(k + 1) % 3], t, true});
    sides.push_back({v[(k + 2) % 3], t, false});
  });
  std::sort(sides.begin(), sides.end(),
            [](const EdgeTriangle& a, const EdgeTriangle& b) { return a.other < b.other; });
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].other == sides[begin].other) ++end;
    if (end - begin != 1) continue;
    const EdgeTriangle& side = sides[begin];
    const Triangle& v = mesh.triangles[side.triangle];
    const Vec3d& p = mesh.points[v[0]];
    const Vec3d normal = cross(mesh.points[v[1]] - p, mesh.points[v[2]] - p);
    const Vec3d &vertex_point = mesh.points[vertex], &other_point = mesh.points[side.other];
    body(side.starts_at_vertex ? vertex_point : other_point,
         side.starts_at_vertex ? other_point : vertex_point, normal);
  }
}

void add_half_space(const Vec3d& normal, const Vec3d& through,
                    std::vector<HalfSpace>& half_spaces) {
  const double size = length(normal);
  if (!(size > 0)) return;  // A degenerate triangle bounds no tetrahedron
  const Vec3d unit = normal * (1 / size);
  half_spaces.push_back({unit, dot(unit, through)});
}

void add_half_spaces_around(const CollapseMesh& mesh, std::uint32_t vertex, bool open,
                            std::vector<HalfSpace>& half_spaces) {
  mesh.each_triangle_around(vertex, [&](std::uint32_t t) {
    const Triangle& v = mesh.triangles[t];
    const Vec3d& p = mesh.points[v[0]];
    add_half_space(cross(mesh.points[v[1]] - p, mesh.points[v[2]] - p), p, half_spaces);
  });
  if (!open) return;
  each_open_edge(mesh, vertex, [&](const Vec3d& from, const Vec3d& to, const Vec3d& normal) {
    add_half_space(cross(to - from, normal), from, half_spaces);
  });
}

}  // namespace

/// Adds one half-space after the other. If the current minimum violates the new half-space, the new minimum lies on the
/// plane that bounds it (Seidel 1991, for linear programs).
std::optional<Vec3d> minimum_within(const Quadric& q, const Vec3d& a, const Vec3d& b,
                                    std::span<const HalfSpace> half_spaces, double slack) {
  const Vec3d middle = (a + b) * 0.5;
  // A weak attraction to the edge's middle keeps the matrix regular, as in Quadric::best_near.
  const double attraction = 1e-3 * (q.xx + q.yy + q.zz) + std::numeric_limits<double>::min();
  QuadraticForm form{{q.xx + attraction, q.xy, q.xz},
                     {q.xy, q.yy + attraction, q.yz},
                     {q.xz, q.yz, q.zz + attraction},
                     {-(q.xx * middle.x + q.xy * middle.y + q.xz * middle.z + q.x),
                      -(q.xy * middle.x + q.yy * middle.y + q.yz * middle.z + q.y),
                      -(q.xz * middle.x + q.yz * middle.y + q.zz * middle.z + q.z)}};
  std::vector<HalfSpace> offset_half_spaces(half_spaces.begin(), half_spaces.end());
  for (HalfSpace& half_space : offset_half_spaces)
    half_space.offset += slack - dot(half_space.normal, middle);
  const Vec3d c12 = cross(form.row1, form.row2), c20 = cross(form.row2, form.row0),
              c01 = cross(form.row0, form.row1);
  Vec3d best =
      (c12 * form.right.x + c20 * form.right.y + c01 * form.right.z) * (1 / dot(form.row0, c12));
  for (std::size_t i = 0; i < offset_half_spaces.size(); ++i) {
    if (dot(offset_half_spaces[i].normal, best) >= offset_half_spaces[i].offset - kHullRounding)
      continue;
    const std::optional<Vec3d> on_plane = minimum_on_plane(
        form, offset_half_spaces[i], std::span<const HalfSpace>(offset_half_spaces).first(i));
    if (!on_plane) return std::nullopt;
    best = *on_plane;
  }
  // Rejects positions far from the edge, and NaN.
  const Vec3d edge = b - a;
  if (!(dot(best, best) <= 4 * dot(edge, edge))) return std::nullopt;
  return middle + best;
}

EnclosingHullConstraint::EnclosingHullConstraint(const CollapseMesh& mesh, Snap snap, double slack)
    : snap_(std::move(snap)),
      slack_(slack),
      fixed_(mesh.points.size(), 0),
      is_on_open_border_(mesh.points.size(), 0) {
  std::vector<std::pair<std::uint64_t, int>> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      sides.emplace_back(a < b ? a << 32 | b : b << 32 | a, a < b ? 1 : -1);
    }
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    int direction_sum = 0;
    while (end < sides.size() && sides[end].first == sides[begin].first)
      direction_sum += sides[end++].second;
    if (direction_sum == 0) continue;
    std::vector<std::uint8_t>& marks = end - begin == 1 ? is_on_open_border_ : fixed_;
    marks[sides[begin].first >> 32] = 1;
    marks[sides[begin].first & 0xffffffffU] = 1;
  }
}

/// True if moving the vertex to `target` cuts nothing off the solid.
bool EnclosingHullConstraint::is_outside(const CollapseMesh& mesh, std::uint32_t vertex,
                                         const Vec3d& target) const {
  bool is_outside_planes = true;
  mesh.each_triangle_around(vertex, [&](std::uint32_t t) {
    const Triangle& v = mesh.triangles[t];
    const Vec3d& p = mesh.points[v[0]];
    const Vec3d normal = cross(mesh.points[v[1]] - p, mesh.points[v[2]] - p);
    is_outside_planes =
        is_outside_planes && dot(normal, target - p) >= -kHullRounding * length(normal);
  });
  if (!is_outside_planes || is_on_open_border_[vertex] == 0) return is_outside_planes;
  each_open_edge(mesh, vertex, [&](const Vec3d& from, const Vec3d& to, const Vec3d& normal) {
    const Vec3d border_normal = cross(to - from, normal);
    is_outside_planes = is_outside_planes &&
                        dot(border_normal, target - from) >= -kHullRounding * length(border_normal);
  });
  return is_outside_planes;
}

std::optional<Vec3d> EnclosingHullConstraint::place(const CollapseMesh& mesh, std::uint32_t a,
                                                    std::uint32_t b, Anchor anchor,
                                                    Quadric& sum) const {
  const bool is_first_fixed = anchor == Anchor::first || fixed_[a] != 0;
  const bool is_second_fixed = anchor == Anchor::second || fixed_[b] != 0;
  if (is_first_fixed && is_second_fixed) return std::nullopt;
  if (is_first_fixed || is_second_fixed) {
    const Vec3d& target = mesh.points[is_first_fixed ? a : b];
    return is_outside(mesh, is_first_fixed ? b : a, target) ? std::optional(target) : std::nullopt;
  }
  thread_local std::vector<HalfSpace> half_spaces;
  half_spaces.clear();
  add_half_spaces_around(mesh, a, is_on_open_border_[a] != 0, half_spaces);
  add_half_spaces_around(mesh, b, is_on_open_border_[b] != 0, half_spaces);
  // Tries the exact planes first. Then planes that are moved slightly outwards, so that the position stays outside when
  // it is rounded to the mesh's precision.
  for (const double slack : {0.0, slack_, 4 * slack_}) {
    const std::optional<Vec3d> best =
        minimum_within(sum, mesh.points[a], mesh.points[b], half_spaces, slack);
    if (!best) return std::nullopt;
    const Vec3d target = snap_(*best);
    if (is_outside(mesh, a, target) && is_outside(mesh, b, target)) return target;
  }
  return std::nullopt;
}

bool EnclosingHullConstraint::keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                    Anchor anchor, const Vec3d& target) const {
  return (anchor == Anchor::first || is_outside(mesh, a, target)) &&
         (anchor == Anchor::second || is_outside(mesh, b, target));
}

void EnclosingHullConstraint::collapse(const CollapseMesh&, std::uint32_t a, std::uint32_t b,
                                       Anchor, const Vec3d&, std::uint32_t kept) {
  fixed_[kept] = static_cast<std::uint8_t>(fixed_[a] | fixed_[b]);
  is_on_open_border_[kept] =
      static_cast<std::uint8_t>(is_on_open_border_[a] | is_on_open_border_[b]);
}

bool EnclosingHullConstraint::may_move(const CollapseMesh& mesh, std::uint32_t vertex,
                                       const Vec3d& target) const {
  return fixed_[vertex] == 0 && is_outside(mesh, vertex, target);
}

}  // namespace kiln

#include "simplify/uv_seam_constraint.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "mesh/uv_grid.h"

namespace kiln {
namespace {

/// Weight of squared UV distances, scaled to lengths on the surface, relative to squared distances from planes. Maps
/// store detail by UV, so a shift along the surface matters less than a deviation from it.
constexpr double kUvWeight = 0.02;
/// Weight of the perpendicular planes through seams and borders of groups, relative to a triangle's own plane.
constexpr double kSeamWeight = 10;
/// Minimum of a UV triangle's doubled area over its squared longest side. Triangles below it may not get worse.
constexpr double kMinUvShape = 1e-3;
constexpr std::uint8_t kInsideVertex = 0, kLineVertex = 2, kCornerVertex = 3;

double squared(const Vec2& a, const Vec2& b) {
  const double x = double{b.x} - a.x, y = double{b.y} - a.y;
  return x * x + y * y;
}

double doubled_area(const std::array<Vec2, 3>& p) {
  return (double{p[1].x} - p[0].x) * (double{p[2].y} - p[0].y) -
         (double{p[1].y} - p[0].y) * (double{p[2].x} - p[0].x);
}

/// Shape of a UV triangle: its signed doubled area over its squared longest side; 0 if it is a point.
double uv_shape(const std::array<Vec2, 3>& p) {
  const double longest = std::max({squared(p[0], p[1]), squared(p[1], p[2]), squared(p[2], p[0])});
  return longest > 0 ? doubled_area(p) / longest : 0;
}

double uv_component(const Vec2& uv, std::size_t axis) { return axis == 0 ? uv.x : uv.y; }

/// Computes the gradients of a triangle's barycentric coordinates. Returns false if the triangle has no area.
bool corner_gradients(const std::array<Vec3d, 3>& p, std::array<Vec3d, 3>& gradients,
                      double& area) {
  const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
  const double n2 = dot(normal, normal);
  if (!(n2 > 0)) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    gradients[k] = cross(normal, p[(k + 2) % 3] - p[(k + 1) % 3]) * (1 / n2);
  }
  area = std::sqrt(n2) / 2;
  return true;
}

}  // namespace

UvSeamConstraint::UvErrorSums& UvSeamConstraint::UvErrorSums::operator+=(const UvErrorSums& o) {
  for (std::size_t i = 0; i < 2; ++i) {
    linear[i] += o.linear[i];
    gradient[i] += o.gradient[i];
    offset[i] += o.offset[i];
  }
  weight += o.weight;
  return *this;
}

/// The UV coordinate at point p that minimizes the sum of squared errors of the affine maps.
double UvSeamConstraint::UvErrorSums::best_uv(std::size_t axis, const Vec3d& p) const {
  return (dot(gradient[axis], p) + offset[axis]) / weight;
}

UvSeamConstraint::UvSeamConstraint(const CollapseMesh& mesh, Layout layout)
    : layout_(std::move(layout)),
      uv_copies_(layout_.uvs, layout_.corners),
      vertex_of_(layout_.uvs.size(), kNoVertex),
      chart_borders_({}, {}, {}, {}, uv_copies_),
      uv_error_sums_(layout_.uvs.size()) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) vertex_of_[layout_.corners[t][k]] = mesh.triangles[t][k];
  }
  const std::vector<std::uint64_t> edges = mesh.edges();
  classify(mesh, edges);
  std::vector<std::uint8_t> is_on_border(layout_.uvs.size(), 0);
  for (const std::uint64_t edge : edges) {
    const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
    if (!is_uv_border(mesh, a, b)) continue;
    mesh.each_triangle_on_edge(a, b, [&](std::uint32_t t) {
      is_on_border[corner_at(mesh, t, a)] = is_on_border[corner_at(mesh, t, b)] = 1;
    });
  }
  chart_borders_ =
      LayoutBorders(layout_.uvs, layout_.corners, layout_.charts, is_on_border, uv_copies_);
  add_uv_errors(mesh);
}

/// Classifies each vertex by the seams and group borders that meet there.
void UvSeamConstraint::classify(const CollapseMesh& mesh, std::span<const std::uint64_t> edges) {
  std::vector<std::uint32_t> lines(mesh.points.size(), 0), seams(mesh.points.size(), 0);
  for (const std::uint64_t edge : edges) {
    const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
    if (!is_line(mesh, a, b)) continue;
    const bool seam = is_uv_border(mesh, a, b);
    for (const std::uint32_t v : {a, b}) {
      ++lines[v];
      seams[v] += seam;
    }
  }
  vertex_class_.resize(mesh.points.size());
  for (std::size_t v = 0; v < lines.size(); ++v) {
    // A vertex at which a seam ends on a group border is a corner of both lines.
    const bool is_on_line = lines[v] == 2 && seams[v] != 1;
    vertex_class_[v] = lines[v] == 0 ? kInsideVertex : is_on_line ? kLineVertex : kCornerVertex;
  }
}

void UvSeamConstraint::add_uv_errors(const CollapseMesh& mesh) {
  double surface = 0, layout = 0;
  std::array<Vec3d, 3> p{}, gradients{};
  std::array<Vec2, 3> uv;
  const auto load_corners = [&](std::size_t t) {
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = mesh.points[mesh.triangles[t][k]];
      uv[k] = layout_.uvs[layout_.corners[t][k]];
    }
    return is_finite(uv[0]) && is_finite(uv[1]) && is_finite(uv[2]);
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!load_corners(t)) continue;
    surface += length(cross(p[1] - p[0], p[2] - p[0]));
    layout += std::abs(doubled_area(uv));
  }
  scale_ = layout > 0 ? std::sqrt(surface / layout) : 1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    double area = 0;
    if (!load_corners(t) || !corner_gradients(p, gradients, area)) continue;
    UvErrorSums contribution;
    contribution.weight = area / 3;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      Vec3d gradient{};
      for (std::size_t k = 0; k < 3; ++k) {
        gradient += gradients[k] * (scale_ * uv_component(uv[k], axis));
      }
      const double offset = scale_ * uv_component(uv[0], axis) - dot(gradient, p[0]);
      contribution.linear[axis].add_linear(gradient, offset, contribution.weight);
      contribution.gradient[axis] = gradient * contribution.weight;
      contribution.offset[axis] = offset * contribution.weight;
    }
    for (const std::uint32_t corner : layout_.corners[t]) uv_error_sums_[corner] += contribution;
  }
}

/// Adds, for each seam edge, planes that contain the edge and stand perpendicular to its triangles. Open borders have
/// such planes already.
void UvSeamConstraint::add_planes(const CollapseMesh& mesh, std::vector<Quadric>& quadrics) const {
  for (const std::uint64_t edge : mesh.edges()) {
    const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
    if (vertex_class_[a] == kInsideVertex || vertex_class_[b] == kInsideVertex ||
        !is_line(mesh, a, b))
      continue;
    std::uint32_t sides = 0;
    mesh.each_triangle_on_edge(a, b, [&](std::uint32_t) { ++sides; });
    if (sides < 2) continue;
    const Vec3d along = mesh.points[b] - mesh.points[a];
    mesh.each_triangle_on_edge(a, b, [&](std::uint32_t t) {
      const Triangle& v = mesh.triangles[t];
      const Vec3d& origin = mesh.points[v[0]];
      Vec3d normal = cross(along, cross(mesh.points[v[1]] - origin, mesh.points[v[2]] - origin));
      normal = normal * (1 / length(normal));
      if (!std::isfinite(normal.x + normal.y + normal.z)) return;
      const double weight = kSeamWeight * dot(along, along) / (2 * sides);
      for (const std::uint32_t vertex : {a, b}) {
        quadrics[vertex].add_plane(normal, mesh.points[a], weight);
      }
    });
  }
}

std::uint32_t UvSeamConstraint::corner_at(const CollapseMesh& mesh, std::uint32_t t,
                                          std::uint32_t vertex) const {
  const Triangle& v = mesh.triangles[t];
  return layout_.corners[t][v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2];
}

bool UvSeamConstraint::is_uv_border(const CollapseMesh& mesh, std::uint32_t a,
                                    std::uint32_t b) const {
  std::uint32_t count = 0, at_a = 0, at_b = 0;
  // Stops at the third triangle, since an edge may have very many.
  const bool is_same_edge = mesh.all_triangles_on_edge(a, b, [&](std::uint32_t t) {
    const std::uint32_t ca = corner_at(mesh, t, a), cb = corner_at(mesh, t, b);
    if (count++ == 0) {
      at_a = ca;
      at_b = cb;
    }
    return count <= 2 && ca == at_a && cb == at_b;
  });
  return count != 2 || !is_same_edge;
}

bool UvSeamConstraint::is_line(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b) const {
  if (is_uv_border(mesh, a, b)) return true;
  if (layout_.groups.empty()) return false;
  std::uint32_t group = kNoVertex;
  bool is_same_edge = true;
  mesh.each_triangle_on_edge(a, b, [&](std::uint32_t t) {
    is_same_edge = is_same_edge && (group == kNoVertex || layout_.groups[t] == group);
    group = layout_.groups[t];
  });
  return !is_same_edge;
}

/// Finds the pairs of corners that merge, from the triangles at the edge. Returns false if the edge has more than two
/// triangles.
bool UvSeamConstraint::pair_corners(const CollapseMesh& mesh, Plan& plan) const {
  bool is_consistent = true;
  mesh.each_triangle_on_edge(plan.gone, plan.kept, [&](std::uint32_t t) {
    const Pair pair{corner_at(mesh, t, plan.gone), corner_at(mesh, t, plan.kept)};
    for (std::size_t i = 0; i < plan.count; ++i) {
      if (plan.pairs[i].gone != pair.gone) continue;
      is_consistent = is_consistent && plan.pairs[i].kept == pair.kept;
      return;
    }
    if (plan.count == plan.pairs.size()) {
      is_consistent = false;
    } else {
      plan.pairs[plan.count++] = pair;
    }
  });
  return is_consistent && plan.count > 0;
}

UvSeamConstraint::Plan UvSeamConstraint::plan(const CollapseMesh& mesh, std::uint32_t a,
                                              std::uint32_t b, Anchor anchor) const {
  Plan plan;
  const auto onto = [&](std::uint32_t gone, std::uint32_t kept) {
    plan = {Plan::Kind::onto, gone, kept, {}, 0};
    if (!pair_corners(mesh, plan)) plan.kind = Plan::Kind::none;
  };
  if (vertex_class_[a] == kInsideVertex && vertex_class_[b] == kInsideVertex) {
    if (anchor != Anchor::none) {
      anchor == Anchor::first ? onto(b, a) : onto(a, b);
    } else {
      onto(b, a);
      if (plan.kind != Plan::Kind::onto) return plan;
      // Borders between copies and other triangles must stay in place, and folds as well.
      const int gone = rank(plan.pairs[0].gone), kept = rank(plan.pairs[0].kept);
      if (gone == kept) {
        plan.kind = Plan::Kind::inside;
      } else if (gone > kept) {
        onto(a, b);
      }
    }
    return plan;
  }
  const bool is_along_line = vertex_class_[a] != kInsideVertex && vertex_class_[b] != kInsideVertex;
  if (is_along_line && !is_line(mesh, a, b)) return plan;
  const bool can_remove_a =
      vertex_class_[a] == kInsideVertex || (is_along_line && vertex_class_[a] == kLineVertex);
  const bool can_remove_b =
      vertex_class_[b] == kInsideVertex || (is_along_line && vertex_class_[b] == kLineVertex);
  if (can_remove_a && anchor != Anchor::first) onto(a, b);
  if (!can_remove_b || anchor == Anchor::second) return plan;
  const Plan reverse_plan = plan;
  onto(b, a);
  if (reverse_plan.kind == Plan::Kind::none) return plan;
  // All copies must collapse in the same direction.
  const int gone_rank = rank(plan.pairs[0].gone), kept_rank = rank(plan.pairs[0].kept);
  if (gone_rank != kept_rank) return gone_rank < kept_rank ? plan : reverse_plan;
  if (has_copies(plan) || has_copies(reverse_plan)) {
    const auto key = [&](const Plan& p) { return uv_copies_.first_copy(p.pairs[0].kept); };
    return key(reverse_plan) < key(plan) ? reverse_plan : plan;
  }
  // Chooses the cheaper direction. On a straight line, the geometric error is nearly the same in both directions, so
  // the UV error decides.
  const Quadric keeps_b = cost_of(reverse_plan), keeps_a = cost_of(plan);
  return keeps_b.at(mesh.points[b]) < keeps_a.at(mesh.points[a]) ? reverse_plan : plan;
}

/// The UV error as a quadric in the position of the merged vertex.
Quadric UvSeamConstraint::cost_of(const Plan& plan) const {
  const double weight = kUvWeight;
  Quadric cost;
  for (std::size_t i = 0; i < plan.count; ++i) {
    UvErrorSums sum = uv_error_sums_[plan.pairs[i].gone];
    sum += uv_error_sums_[plan.pairs[i].kept];
    if (!(sum.weight > 0)) continue;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      Quadric axis_cost = sum.linear[axis];
      axis_cost.area = 0;
      if (plan.kind == Plan::Kind::inside) {
        // Hoppe 1999, section 3. The UV is eliminated from the equations, since it takes its best value at each
        // position.
        axis_cost.add_linear(sum.gradient[axis], sum.offset[axis], -1 / sum.weight);
      } else {
        const double value = scale_ * uv_component(layout_.uvs[plan.pairs[i].kept], axis);
        const Vec3d step = sum.gradient[axis] * -value;
        axis_cost.x += step.x, axis_cost.y += step.y, axis_cost.z += step.z;
        axis_cost.c += value * (sum.weight * value - 2 * sum.offset[axis]);
      }
      for (double* term :
           {&axis_cost.xx, &axis_cost.xy, &axis_cost.xz, &axis_cost.yy, &axis_cost.yz,
            &axis_cost.zz, &axis_cost.x, &axis_cost.y, &axis_cost.z, &axis_cost.c}) {
        *term *= weight;
      }
      cost += axis_cost;
    }
  }
  return cost;
}

std::optional<Vec3d> UvSeamConstraint::place(const CollapseMesh& mesh, std::uint32_t a,
                                             std::uint32_t b, Anchor anchor, Quadric& sum) const {
  const Plan chosen = plan(mesh, a, b, anchor);
  if (chosen.kind == Plan::Kind::none) return std::nullopt;
  sum += cost_of(chosen);
  if (chosen.kind == Plan::Kind::onto) return mesh.points[chosen.kept];
  return sum.best_near(mesh.points[a], mesh.points[b]);
}

/// UV of a merged vertex inside a chart: the best fit to the affine maps of the triangles, clamped to the surroundings
/// of the two old UVs.
Vec2 UvSeamConstraint::uv_at(const Plan& plan, const Vec3d& target) const {
  const Vec2 &a = layout_.uvs[plan.pairs[0].gone], &b = layout_.uvs[plan.pairs[0].kept];
  if (plan.kind == Plan::Kind::onto) return b;
  if (const auto moved = moved_uvs_.find(plan.pairs[0].kept); moved != moved_uvs_.end()) {
    return moved->second;
  }
  UvErrorSums sum = uv_error_sums_[plan.pairs[0].gone];
  sum += uv_error_sums_[plan.pairs[0].kept];
  if (!(sum.weight > 0)) return b;
  std::array<float, 2> uv{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto [low, high] = std::minmax({uv_component(a, axis), uv_component(b, axis)});
    const double max_shift = std::sqrt(squared(a, b)) / 2;
    uv[axis] = static_cast<float>(
        std::clamp(sum.best_uv(axis, target) / scale_, low - max_shift, high + max_shift));
  }
  return {uv[0], uv[1]};
}

/// True if the UV triangles around a vertex of the edge do not flip.
bool UvSeamConstraint::keeps_uvs(const CollapseMesh& mesh, std::uint32_t vertex, const Plan& plan,
                                 const Vec2& inside_uv) const {
  const std::uint32_t other = vertex == plan.gone ? plan.kept : plan.gone;
  for (const std::uint32_t t : mesh.around(vertex)) {
    if (mesh.alive[t] == 0 || mesh.contains(t, other)) continue;
    std::array<Vec2, 3> uv;
    std::size_t at = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      uv[k] = layout_.uvs[layout_.corners[t][k]];
      if (mesh.triangles[t][k] == vertex) at = k;
    }
    const std::uint32_t corner = layout_.corners[t][at];
    Vec2 moved = inside_uv;
    if (plan.kind == Plan::Kind::onto) {
      const auto pair =
          std::find_if(plan.pairs.begin(), plan.pairs.begin() + plan.count,
                       [&](const Pair& candidate) { return candidate.gone == corner; });
      // The edge has no triangle on this side.
      if (pair == plan.pairs.begin() + plan.count) return false;
      moved = layout_.uvs[pair->kept];
    } else if (corner != plan.pairs[0].gone && corner != plan.pairs[0].kept) {
      return false;
    }
    const double before = uv_shape(uv);
    uv[at] = moved;
    const double after = uv_shape(uv);
    if (before == 0 || std::isnan(before)) {
      if (after != 0 && !std::isnan(after)) return false;
      continue;
    }
    const double min_shape = std::min(kMinUvShape, std::abs(before));
    if (!((before > 0 ? after : -after) >= min_shape)) return false;
  }
  return true;
}

/// True if the seam or border stays valid when the removed vertex is taken out of it.
bool UvSeamConstraint::keeps_line(const CollapseMesh& mesh, const Plan& plan) const {
  std::uint32_t before = kNoVertex;
  bool is_free = true;
  mesh.each_triangle_around(plan.gone, [&](std::uint32_t t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v == plan.gone || v == plan.kept || !is_line(mesh, plan.gone, v)) continue;
      before = v;
      // A triangle whose three sides are all seams or borders is a chart or a group by itself.
      if (mesh.contains(t, plan.kept) && is_line(mesh, v, plan.kept)) is_free = false;
    }
  });
  if (!is_free || before == kNoVertex) return false;
  if (!is_uv_border(mesh, plan.gone, plan.kept)) return true;
  mesh.each_triangle_on_edge(plan.gone, before, [&](std::uint32_t t) {
    const std::uint32_t corner = corner_at(mesh, t, plan.gone);
    for (std::size_t i = 0; i < plan.count; ++i) {
      if (plan.pairs[i].gone != corner) continue;
      is_free = is_free && chart_borders_.may_remove(layout_.uvs, corner_at(mesh, t, before),
                                                     corner, plan.pairs[i].kept);
    }
  });
  return is_free;
}

bool UvSeamConstraint::keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                             Anchor anchor, const Vec3d& target) const {
  const Plan chosen = plan(mesh, a, b, anchor);
  if (chosen.kind == Plan::Kind::none) return false;
  const Vec2 uv = uv_at(chosen, target);
  if (!keeps_uvs(mesh, chosen.gone, chosen, uv)) return false;
  if (chosen.kind == Plan::Kind::inside) return keeps_uvs(mesh, chosen.kept, chosen, uv);
  return vertex_class_[chosen.gone] == kInsideVertex || keeps_line(mesh, chosen);
}

void UvSeamConstraint::collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                Anchor anchor, const Vec3d& target, std::uint32_t kept) {
  const Plan chosen = plan(mesh, a, b, anchor);
  const Vec2 uv = uv_at(chosen, target);
  for (std::size_t i = 0; i < chosen.count; ++i) {
    const Pair& pair = chosen.pairs[i];
    uv_error_sums_[pair.kept] += uv_error_sums_[pair.gone];
    if (chosen.kind == Plan::Kind::inside) layout_.uvs[pair.kept] = uv;
    if (pair.gone != pair.kept) chart_borders_.remove(pair.gone);
  }
  mesh.each_triangle_around(chosen.gone, [&](std::uint32_t t) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (mesh.triangles[t][k] != chosen.gone) continue;
      for (std::size_t i = 0; i < chosen.count; ++i) {
        if (chosen.pairs[i].gone != layout_.corners[t][k]) continue;
        layout_.corners[t][k] = chosen.pairs[i].kept;
        break;
      }
    }
  });
  if (uv_copies_.any()) {
    for (const std::uint32_t end : {chosen.gone, chosen.kept}) {
      mesh.each_triangle_around(
          end, [&](std::uint32_t t) { vertex_of_[corner_at(mesh, t, end)] = kept; });
    }
  }
  vertex_class_[kept] = vertex_class_[chosen.kept];
}

int UvSeamConstraint::rank(std::uint32_t uv) const {
  return uv_copies_.is_on_fold(uv) ? 2 : uv_copies_.has_copies(uv) ? 1 : 0;
}

bool UvSeamConstraint::has_copies(const Plan& plan) const {
  for (std::size_t i = 0; i < plan.count; ++i) {
    if (uv_copies_.has_copies(plan.pairs[i].gone)) return true;
  }
  return false;
}

/// The collapses that must happen together because they move copies of the same corners. Lookups take constant time, so
/// the time for a group is linear in the number of copies.
struct UvSeamConstraint::TwinGroup {
  std::vector<Plan> planned_collapses;
  /// Maps each removed vertex to the vertex that replaces it
  std::unordered_map<std::uint32_t, std::uint32_t> kept_of;
  std::unordered_set<std::uint32_t> kept;  ///< Vertices that replace removed ones
  /// Pairs (gone, kept) of first copies. All copies of such a pair are in the group already, so they need no further
  /// search.
  std::unordered_set<std::uint64_t> complete_pairs;

  void add(const Plan& step) {
    planned_collapses.push_back(step);
    kept_of.emplace(step.gone, step.kept);
    kept.insert(step.kept);
  }
};

/// The copy of pair.kept that shares a triangle with `gone`, which is a copy of pair.gone; kNoVertex if there is none.
/// If there are several, returns the one that LayoutCopies::all_of(pair.kept) visits last.
/// \param is_unique  set to false if there are several
std::uint32_t UvSeamConstraint::find_twin_corner(const CollapseMesh& mesh, std::uint32_t gone,
                                                 const Pair& pair, bool& is_unique) const {
  // all_of() visits copies in descending order from pair.kept to the lowest, then in descending order from the highest.
  const auto order = [&](std::uint32_t uv) {
    if (uv == pair.kept) return std::pair<int, std::uint32_t>(0, 0);
    return std::pair<int, std::uint32_t>(uv < pair.kept ? 1 : 2, ~uv);
  };
  std::uint32_t found = kNoVertex;
  mesh.each_triangle_around(vertex_of_[gone], [&](std::uint32_t t) {
    const Triangle& c = layout_.corners[t];
    if (std::find(c.begin(), c.end(), gone) == c.end()) return;
    for (const std::uint32_t other : c) {
      if (other == found || uv_copies_.first_copy(other) != uv_copies_.first_copy(pair.kept))
        continue;
      if (other == pair.kept && !uv_copies_.is_on_fold(other)) continue;
      if (!mesh.contains(t, vertex_of_[other])) continue;
      if (found != kNoVertex) is_unique = false;
      if (found == kNoVertex || order(other) > order(found)) found = other;
    }
  });
  return found;
}

/// Adds to the group all collapses that must happen together with the collapse of index `of`, because they move copies
/// of the same corners. Returns false if a copy has no such edge, or cannot collapse in the same direction.
bool UvSeamConstraint::add_twins(const CollapseMesh& mesh, TwinGroup& group, std::size_t of) const {
  const Plan::Kind kind = group.planned_collapses[of].kind;
  const auto add = [&](std::uint32_t gone, std::uint32_t kept) {
    if (const auto known = group.kept_of.find(gone); known != group.kept_of.end()) {
      return known->second == kept;
    }
    const bool moves = kind == Plan::Kind::inside && group.kept.contains(kept);
    if (moves || group.kept.contains(gone) || group.kept_of.contains(kept)) return false;
    const Plan twin = plan(mesh, gone, kept, Anchor::none);
    const Plan other = plan(mesh, kept, gone, Anchor::none);
    const Plan& is_consistent = twin.gone == gone ? twin : other;
    if (is_consistent.kind != kind || is_consistent.gone != gone || is_consistent.kept != kept)
      return false;
    group.add(is_consistent);
    return true;
  };
  for (std::size_t i = 0; i < group.planned_collapses[of].count; ++i) {
    const Pair pair = group.planned_collapses[of].pairs[i];
    const std::uint64_t key =
        std::uint64_t{uv_copies_.first_copy(pair.gone)} << 32 | uv_copies_.first_copy(pair.kept);
    if (group.complete_pairs.contains(key)) continue;
    bool is_unique = true;
    std::size_t found = 0, moved = 0;
    std::unordered_set<std::uint32_t> kept_corners{pair.kept};
    const bool added = uv_copies_.all_of(pair.gone, [&](std::uint32_t gone) {
      const std::uint32_t kept = find_twin_corner(mesh, gone, pair, is_unique);
      ++found;
      is_unique = is_unique && kept_corners.insert(kept).second;
      return kept != kNoVertex && add(vertex_of_[gone], vertex_of_[kept]);
    });
    if (!added) return false;
    if (kind == Plan::Kind::inside) {
      uv_copies_.all_of(pair.kept, [&](std::uint32_t) { return ++moved <= found; });
      if (moved != found) return false;
    }
    if (is_unique) group.complete_pairs.insert(key);
  }
  return true;
}

bool UvSeamConstraint::find_twins(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                                  Anchor anchor, const Vec3d& target,
                                  std::vector<std::array<std::uint32_t, 2>>& twins) {
  moved_uvs_.clear();
  if (!uv_copies_.any()) return true;
  const Plan first_plan = plan(mesh, a, b, anchor);
  for (std::size_t i = 0; i < first_plan.count; ++i) {
    const Pair& pair = first_plan.pairs[i];
    // The collapse would move a corner off a fold, or away from its copies.
    if (rank(pair.gone) > rank(pair.kept)) return false;
  }
  if (!has_copies(first_plan)) return true;
  if (anchor != Anchor::none) return false;
  TwinGroup group;
  group.add(first_plan);
  for (std::size_t i = 0; i < group.planned_collapses.size(); ++i) {
    if (!add_twins(mesh, group, i)) return false;
  }
  const Vec2 from = layout_.uvs[first_plan.pairs[0].kept], to = uv_at(first_plan, target);
  for (std::size_t i = 1; i < group.planned_collapses.size(); ++i) {
    const Plan& twin = group.planned_collapses[i];
    twins.push_back({twin.kept, twin.gone});  // The vertex that plan() removes must come second
    if (twin.kind != Plan::Kind::inside) continue;
    const std::uint32_t corner = twin.pairs[0].kept;
    const Vec2& old_uv = layout_.uvs[corner];
    moved_uvs_.emplace(corner, Vec2{old_uv.x + (to.x - from.x), old_uv.y + (to.y - from.y)});
  }
  return true;
}

bool UvSeamConstraint::may_move(const CollapseMesh&, std::uint32_t, const Vec3d&) const {
  return false;
}

}  // namespace kiln

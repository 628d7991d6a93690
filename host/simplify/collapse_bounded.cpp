// Part of EdgeCollapser: collapses within a bound on the deviation.
#include "simplify/collapse.h"

namespace kiln {

/// \param b  second vertex of the edge; kNoVertex if `a` moves without a collapse
bool EdgeCollapser::bound_allows(std::uint32_t a, std::uint32_t b, Anchor anchor,
                                 const Vec3d& target) {
  return deviation_bound_ == nullptr ||
         (keeps_lines(a, b, target) && deviation_bound_->keeps(mesh_, a, b, anchor, target));
}

bool EdgeCollapser::keeps_lines(std::uint32_t a, std::uint32_t b, const Vec3d& target) const {
  if (line_quadrics_.empty()) return true;
  Quadric sum = line_quadrics_[a];
  if (b != kNoVertex) sum += line_quadrics_[b];
  return sum.at(target) <= max_line_error_ * max_line_error_ * sum.area;
}

/// True if the bound allows the collapse of an edge, either as it is in `step` or with a nearby position, which is then
/// written to `step`.
bool EdgeCollapser::is_within_bound(const Entry& entry, Step& step) {
  if (!keeps_lines(entry.a, entry.b, step.target)) return false;
  if (bound_allows(entry.a, entry.b, step.anchor, step.target)) return true;
  if (rule_ != nullptr || step.anchor != Anchor::none || is_on_border_[entry.a] != 0 ||
      is_on_border_[entry.b] != 0 || !deviation_bound_->may_be_near()) {
    return false;
  }
  const Vec3d target = deviation_bound_->improved_position(step.target, DistanceNorm::large);
  step.target = round_point_ ? round_point_(target) : target;
  return keeps_shapes(entry, step) && bound_allows(entry.a, entry.b, step.anchor, step.target);
}

void EdgeCollapser::relax_vertex(std::uint32_t v, DistanceNorm which) {
  const Vec3d from = mesh_.points[v];
  if (!bound_allows(v, kNoVertex, Anchor::none, from)) return;
  const double before = deviation_bound_->energy(which);
  // Reassigns the samples: after the move, other triangles around the vertex may be nearer to them.
  deviation_bound_->collapse();
  const Vec3d displacement = deviation_bound_->improved_position(from, which) - from;
  if (!(dot(displacement, displacement) > 0)) return;
  for (const double part : {1.0, 0.5, 0.2}) {
    const Vec3d target =
        round_point_ ? round_point_(from + displacement * part) : from + displacement * part;
    if (!shape_limits_.keeps(mesh_, v, kNoVertex, target, kNoVertex, 0)) continue;
    if (rule_ != nullptr && !rule_->may_move(mesh_, v, target)) continue;
    if (!bound_allows(v, kNoVertex, Anchor::none, target)) continue;
    if (!(deviation_bound_->energy(which) < before)) continue;
    deviation_bound_->collapse();
    mesh_.points[v] = target;
    return;
  }
}

void EdgeCollapser::relax(DistanceNorm which) {
  for (std::uint32_t v = 0; v < mesh_.points.size(); ++v) {
    if (mesh_.valence[v] != 0 && is_on_border_[v] == 0 && !mesh_.is_hub(v)) relax_vertex(v, which);
  }
  touched_vertices_.assign(mesh_.points.size(), 1);
  rebuild_queue();
}

}  // namespace kiln

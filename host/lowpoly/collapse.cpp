#include "lowpoly/collapse.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/heartbeat.h"
#include "base/parallel.h"
#include "mesh/vertex_lists.h"

namespace kiln {
namespace {

/// Under a rule, weight of the planes that stand on open borders, against a triangle's own.
constexpr double kBorderWeight = 10;
/// Share of the squared edge length that counts as deviation: where the surface is flat, short edges
/// go first and triangles stay even. With 1e-5, faces stayed there that curved places need.
constexpr double kLengthWeight = 1e-8;
/// Weight of the sum of planes so far beside planes of the mesh as it is. Without it, what a thin rim has lost is
/// forgotten, and it loses more.
constexpr double kMemory = 0.1;
/// Collapses that leave bad shapes wait until they are this much cheaper than good ones. Refusing
/// them for good would leave the slivers of a high poly (at a sphere's poles) to stay as they are.
constexpr double kPenalty = 6;
constexpr double kStale = 1.01;  ///< At a hub, costs may be out of date by this share.
/// What was refused is tried again while a round takes at least one step in so many triangles, or a few rounds more.
constexpr std::size_t kWorthAnother = 64, kMostPoorRounds = 4;

}  // namespace

bool EdgeCollapser::Entry::operator<(const Entry& o) const {
  return cost != o.cost ? cost > o.cost : std::tie(a, b) > std::tie(o.a, o.b);
}

EdgeCollapser::EdgeCollapser(CollapseMesh& mesh, CollapseRule* rule, Snap snap)
    : mesh_(mesh),
      rule_(rule),
      snap_(std::move(snap)),
      shape_(mesh),
      quadrics_(mesh.points.size()),
      stamps_(mesh.points.size(), 0),
      border_(mesh.points.size(), 0) {
  build_quadrics();
  if (rule_ != nullptr) rule_->add_planes(mesh_, quadrics_);
  fill_heap();
}

void EdgeCollapser::build_quadrics() {
  const std::vector<Vec3d>& points = mesh_.points;
  std::vector<Triangle> triangles;
  triangles.reserve(mesh_.faces);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (mesh_.alive[t] != 0) triangles.push_back(mesh_.triangles[t]);
  }
  for (Quadric& sum : quadrics_) sum *= kMemory;
  next_renewal_ = std::bit_floor(std::max<std::size_t>(mesh_.faces, 1) - 1);
  for (const Triangle& v : triangles) {
    const Vec3d normal = cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]);
    const double size = length(normal);
    Quadric quadric;
    quadric.area = size / 6;  // A third of the area for each corner.
    if (size > 0) quadric.add_plane(normal * (1 / size), points[v[0]], quadric.area);
    for (const std::uint32_t vertex : v) quadrics_[vertex] += quadric;
  }
  const SideLists sides(triangles, points.size());
  sides.each_edge([&](std::uint32_t a, std::span<const SideLists::Item> of_edge) {
    const std::uint32_t b = SideLists::higher(of_edge[0]);
    if (of_edge.size() == 2 && rule_ == nullptr) {
      const auto far = [&](const SideLists::Item& side) -> const Vec3d& {
        return points[triangles[side.index / 3][(side.index + 2) % 3]];
      };
      const auto [from, to] = SideLists::forward(of_edge[0]) ? std::pair(a, b) : std::pair(b, a);
      const Quadric bent = bent_planes(points[from], points[to], far(of_edge[0]), far(of_edge[1]));
      quadrics_[a] += bent;
      quadrics_[b] += bent;
    }
    if (of_edge.size() != 1) return;
    border_[a] = border_[b] = 1;
    const Triangle& v = triangles[of_edge[0].index / 3];
    const Vec3d edge = points[b] - points[a];
    const Vec3d face = cross(points[v[1]] - points[v[0]], points[v[2]] - points[v[0]]);
    const Quadric border = rule_ == nullptr ? border_planes(points[a], points[b], face)
                                            : standing_plane(points[a], points[b], face,
                                                             kBorderWeight * dot(edge, edge) / 2);
    quadrics_[a] += border;
    quadrics_[b] += border;
  });
}

/// Where an edge would go, and at what cost. A hub stays: moving it would move all that is around it.
EdgeCollapser::Step EdgeCollapser::step_for(std::uint32_t a, std::uint32_t b) const {
  Step step;
  step.sum = quadrics_[a];
  step.sum += quadrics_[b];
  const bool hub_a = mesh_.is_hub(a), hub_b = mesh_.is_hub(b);
  if (hub_a && hub_b) return step;
  step.anchor = hub_a ? Anchor::first : hub_b ? Anchor::second : Anchor::none;
  const Vec3d &pa = mesh_.points[a], &pb = mesh_.points[b];
  if (rule_ != nullptr) {
    const std::optional<Vec3d> place = rule_->place(mesh_, a, b, step.anchor, step.sum);
    if (!place) return step;
    step.target = *place;
  } else {
    step.target = hub_a ? pa : hub_b ? pb : step.sum.best_near(pa, pb);
  }
  step.allowed = true;
  const Vec3d edge = pb - pa;
  step.cost = step.sum.at(step.target) + kLengthWeight * dot(edge, edge) * step.sum.area;
  return step;
}

/// An edge that may not go has endless cost.
EdgeCollapser::Entry EdgeCollapser::entry_for(std::uint32_t a, std::uint32_t b) const {
  const Step step = step_for(a, b);
  const double cost = step.allowed ? step.cost : std::numeric_limits<double>::infinity();
  return {cost, a, b, stamps_[a], stamps_[b], 0};
}

void EdgeCollapser::fill_heap() {
  const std::vector<std::uint64_t> all = mesh_.edges();
  mesh_.visits += all.size();
  heap_.resize(all.size());
  parallel_for(all.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      heap_[i] =
          entry_for(static_cast<std::uint32_t>(all[i] >> 32), static_cast<std::uint32_t>(all[i]));
    }
  });
  std::erase_if(heap_, [](const Entry& e) { return std::isinf(e.cost); });
  std::make_heap(heap_.begin(), heap_.end());
}

void EdgeCollapser::push(std::uint32_t a, std::uint32_t b) {
  ++mesh_.visits;
  const Entry entry = entry_for(std::min(a, b), std::max(a, b));
  if (std::isinf(entry.cost)) return;
  heap_.push_back(entry);
  std::push_heap(heap_.begin(), heap_.end());
}

/// Whether some triangle of a and one of b have their other two corners in common.
bool EdgeCollapser::lies_on_another(std::uint32_t a, std::uint32_t b) {
  const std::vector<std::uint32_t>& around = mesh_.around[b];
  mesh_.visits += around.size();
  for (const std::uint32_t t : around) {
    if (mesh_.alive[t] == 0 || mesh_.contains(t, a)) continue;
    const Triangle& v = mesh_.triangles[t];
    const std::size_t k = v[0] == b ? 0 : v[1] == b ? 1 : 2;
    const std::uint32_t p = v[(k + 1) % 3], q = v[(k + 2) % 3];
    if (mesh_.is_hub(p) && mesh_.is_hub(q)) return true;  // Too many to look at.
    mesh_.visits += std::min(mesh_.valence[p], mesh_.valence[q]);
    bool twin = false;
    mesh_.each_on_edge(p, q, [&](std::uint32_t other) { twin = twin || mesh_.contains(other, a); });
    if (twin) return true;
  }
  return false;
}

bool EdgeCollapser::keeps_topology(std::uint32_t a, std::uint32_t b) {
  if (mesh_.is_hub(a)) return keeps_topology_at_hub(a, b);
  if (mesh_.is_hub(b)) return keeps_topology_at_hub(b, a);
  mesh_.gather(a, near_a_);
  mesh_.gather(b, near_b_);
  std::uint32_t on_edge = 0, common = 0;
  bool border_a = false, border_b = false;
  for (const CollapseMesh::Neighbour& n : near_a_) {
    border_a = border_a || n.triangles == 1;
    if (n.vertex == b) on_edge = n.triangles;
  }
  for (const CollapseMesh::Neighbour& n : near_b_) border_b = border_b || n.triangles == 1;
  for (std::size_t i = 0, j = 0; i < near_a_.size() && j < near_b_.size();) {
    if (near_a_[i].vertex == near_b_[j].vertex)
      ++common, ++i, ++j;
    else if (near_a_[i].vertex < near_b_[j].vertex)
      ++i;
    else
      ++j;
  }
  if (on_edge == 0 || common != on_edge) return false;
  if (border_a && border_b && on_edge != 1) return false;
  // Something must be left, and no two triangles may come to lie on the same corners.
  if (mesh_.valence[a] + mesh_.valence[b] <= 2 * on_edge) return false;
  return !lies_on_another(a, b);
}

/// The same without a look at all triangles of the hub: only the other's neighbours count. A step next to
/// a second hub waits.
bool EdgeCollapser::keeps_topology_at_hub(std::uint32_t hub, std::uint32_t b) {
  mesh_.gather(b, near_b_);
  std::uint32_t on_edge = 0, common = 0;
  bool border_b = false;
  for (const CollapseMesh::Neighbour& n : near_b_) {
    border_b = border_b || n.triangles == 1;
    if (n.vertex == hub) {
      on_edge = n.triangles;
      continue;
    }
    if (mesh_.is_hub(n.vertex)) return false;
    bool next = false;
    mesh_.visits += mesh_.valence[n.vertex];
    mesh_.each_on_edge(n.vertex, hub, [&](std::uint32_t) { next = true; });
    common += next;
  }
  if (on_edge == 0 || common != on_edge) return false;
  if (border_[hub] != 0 && border_b && on_edge != 1) return false;
  return !lies_on_another(hub, b);
}

bool EdgeCollapser::keeps_shapes(const Entry& e, const Step& step) {
  const std::uint32_t fixed = step.anchor == Anchor::first    ? e.a
                              : step.anchor == Anchor::second ? e.b
                                                              : kNoVertex;
  return shape_.keeps(mesh_, e.a, e.b, step.target, fixed, e.leniency);
}

void EdgeCollapser::collapse(std::uint32_t a, std::uint32_t b, const Step& step) {
  // What is around the one that goes is walked: a hub is kept.
  const bool swap = step.anchor == Anchor::second;
  const std::uint32_t kept = swap ? b : a, gone = swap ? a : b;
  if (rule_ != nullptr) rule_->collapse(mesh_, a, b, step.anchor, step.target, kept);
  mesh_.points[kept] = step.target;
  quadrics_[kept] += quadrics_[gone];
  border_[kept] = border_[kept] | border_[gone];
  shape_.merge(kept, gone);
  if (step.anchor != Anchor::none) mesh_.gather(gone, near_b_);
  mesh_.merge(kept, gone);
  ++stamps_[gone];
  if (step.anchor != Anchor::none) {
    // Entries of the hub's other edges stay: their costs are brought up to date when their turn comes.
    for (const CollapseMesh::Neighbour& n : near_b_) {
      if (n.vertex != kept) push(kept, n.vertex);
    }
    return;
  }
  ++stamps_[kept];
  mesh_.gather(kept, near_a_);
  for (const CollapseMesh::Neighbour& n : near_a_) push(kept, n.vertex);
}

/// Takes a step if it may be taken; if it only leaves bad shapes, it waits.
bool EdgeCollapser::take(const Entry& entry) {
  Step step = step_for(entry.a, entry.b);
  if (!step.allowed) return false;
  if (step.anchor != Anchor::none) {
    const double cost = step.cost * std::pow(kPenalty, entry.leniency);
    if (cost > kStale * entry.cost) {
      ++mesh_.visits;
      heap_.push_back(entry);
      heap_.back().cost = cost;
      std::push_heap(heap_.begin(), heap_.end());
      return false;
    }
  }
  if (snap_) step.target = snap_(step.target);
  const bool shapes =
      keeps_shapes(entry, step) &&
      (rule_ == nullptr || rule_->keeps(mesh_, entry.a, entry.b, step.anchor, step.target));
  if (!shapes) {
    if (entry.leniency == CollapseShape::kMostLenient) return false;
    heap_.push_back(entry);
    heap_.back().cost *= kPenalty;
    ++heap_.back().leniency;
    std::push_heap(heap_.begin(), heap_.end());
    return false;
  }
  if (!keeps_topology(entry.a, entry.b)) return false;
  collapse(entry.a, entry.b, step);
  return true;
}

/// A sum of planes counts most of them twice and thrice, and some of surface that lies elsewhere by now: planes of
/// the mesh as it is place vertices better (Lindstrom and Turk 1998, "Fast and Memory Efficient Polygonal
/// Simplification"). At powers of two, so that a way through several numbers of faces is the same as to the last.
bool EdgeCollapser::renew(double distance) {
  if (rule_ != nullptr || std::isfinite(distance) || mesh_.faces > next_renewal_) return false;
  // Beside a hub most edges wait: to look at all of them again and again would cost too much.
  const auto is_hub = [](std::uint32_t valence) { return valence > CollapseMesh::kMostAround; };
  if (std::any_of(mesh_.valence.begin(), mesh_.valence.end(), is_hub)) {
    next_renewal_ = 0;
    return false;
  }
  build_quadrics();
  fill_heap();
  return true;
}

void EdgeCollapser::run(std::size_t faces, double distance) {
  constexpr std::size_t kBeat = 1024;
  std::size_t poor = 0, looked = 0;
  while (true) {
    std::size_t taken = 0;
    while (mesh_.faces > faces && !heap_.empty()) {
      if (++looked % kBeat == 0) Heartbeat::beat();
      if (renew(distance)) continue;
      const Entry entry = heap_.front();
      const bool valid = entry.stamp_a == stamps_[entry.a] && entry.stamp_b == stamps_[entry.b];
      const double area = quadrics_[entry.a].area + quadrics_[entry.b].area;
      if (valid && entry.cost > distance * distance * area) return;
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.pop_back();
      if (valid) taken += take(entry);
    }
    if (mesh_.faces <= faces || taken == 0) return;
    if (taken * kWorthAnother < mesh_.faces && ++poor > kMostPoorRounds) return;
    fill_heap();  // What was refused may be allowed by now.
  }
}

/// Moves a corner: to the middle of its neighbours, or between there and where it is.
bool EdgeCollapser::mend_by_moving(std::uint32_t triangle, const auto& bad) {
  double least = std::numeric_limits<double>::infinity();
  std::uint32_t mover = kNoVertex;
  Vec3d best;
  for (const std::uint32_t v : mesh_.triangles[triangle]) {
    if (mesh_.is_hub(v) || border_[v] != 0) continue;
    mesh_.gather(v, near_a_);
    Vec3d middle;
    for (const CollapseMesh::Neighbour& n : near_a_) middle += mesh_.points[n.vertex];
    middle = middle * (1.0 / static_cast<double>(near_a_.size()));
    for (const double share : {1.0, 0.5, 0.25, 1.5}) {
      Vec3d target = mesh_.points[v] + (middle - mesh_.points[v]) * share;
      if (snap_) target = snap_(target);
      const double cost = quadrics_[v].at(target);
      if (!(cost < least)) continue;
      if (rule_ != nullptr && !rule_->may_move(mesh_, v, target)) continue;
      if (!bad.none_around(v, kNoVertex, target)) continue;
      least = cost;
      mover = v;
      best = target;
    }
  }
  if (mover == kNoVertex) return false;
  mesh_.points[mover] = best;
  ++stamps_[mover];
  mesh_.gather(mover, near_a_);
  for (const CollapseMesh::Neighbour& n : near_a_) push(mover, n.vertex);
  return true;
}

/// Collapses a side: to an end, the middle, or the best point.
bool EdgeCollapser::mend_by_collapse(std::uint32_t triangle, const auto& bad) {
  Step best;
  best.cost = std::numeric_limits<double>::infinity();
  std::uint32_t best_a = 0, best_b = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [a, b] =
        std::minmax({mesh_.triangles[triangle][k], mesh_.triangles[triangle][(k + 1) % 3]});
    Step step = step_for(a, b);
    if (!step.allowed || step.anchor != Anchor::none || !keeps_topology(a, b)) continue;
    std::vector<Vec3d> places{step.target};
    if (rule_ == nullptr || rule_->any_place()) {
      places.push_back(mesh_.points[a]);
      places.push_back(mesh_.points[b]);
      places.push_back((mesh_.points[a] + mesh_.points[b]) * 0.5);
    }
    for (const Vec3d& place : places) {
      step.target = snap_ ? snap_(place) : place;
      step.cost = step.sum.at(step.target);
      if (!(step.cost < best.cost)) continue;
      if (rule_ != nullptr && !rule_->keeps(mesh_, a, b, step.anchor, step.target)) continue;
      if (!bad.none_around(a, b, step.target) || !bad.none_around(b, a, step.target)) continue;
      best = step;
      best_a = a;
      best_b = b;
    }
  }
  if (!std::isfinite(best.cost)) return false;
  collapse(best_a, best_b, best);
  return true;
}

bool EdgeCollapser::mend(std::uint32_t triangle,
                         const std::function<bool(const TriangleCorners&)>& bad) {
  if (mesh_.alive[triangle] == 0) return true;
  struct Around {
    const CollapseMesh& mesh;
    const std::function<bool(const TriangleCorners&)>& bad;
    std::uint32_t mended;  ///< Looked at first: it most often stays bad.
    bool none_around(std::uint32_t moved, std::uint32_t other, const Vec3d& target) const {
      const auto is_bad = [&](std::uint32_t t) {
        if (mesh.alive[t] == 0 || mesh.contains(t, other)) return false;
        TriangleCorners corners;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t v = mesh.triangles[t][k];
          corners[k] = v == moved ? target : mesh.points[v];
        }
        return bad(corners);
      };
      if (mesh.contains(mended, moved) && is_bad(mended)) return false;
      return std::none_of(mesh.around[moved].begin(), mesh.around[moved].end(),
                          [&](std::uint32_t t) { return t != mended && is_bad(t); });
    }
  };
  const Around around{mesh_, bad, triangle};
  return mend_by_moving(triangle, around) || mend_by_collapse(triangle, around);
}

}  // namespace kiln

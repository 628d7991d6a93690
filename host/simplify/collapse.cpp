#include "simplify/collapse.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "base/progress_guard.h"

namespace kiln {
namespace {

/// The cost of a collapse that leaves badly shaped triangles is multiplied by a factor: by the first one if costs are
/// distances, by the second if they are squared distances. Rejecting such collapses altogether would keep the high
/// poly's slivers, as at the poles of a sphere.
constexpr double kBadShapeFactor = 1.5, kBadShapeFactorOfSquares = 6;
/// An edge at a vertex of high valence may collapse although its cost has grown by up to this factor since it was queued.
constexpr double kHubCostTolerance = 1.01;
/// When the queue is empty, rejected edges are tried again in a new round, as long as each round collapses at least one
/// edge per kTrianglesPerCollapse triangles. At most kMaxUnproductiveRounds rounds may collapse fewer.
constexpr std::size_t kTrianglesPerCollapse = 64, kMaxUnproductiveRounds = 4;

}  // namespace

EdgeCollapser::EdgeCollapser(CollapseMesh& mesh, CollapseConstraint* rule, Snap snap,
                             std::vector<std::uint8_t> fixed)
    : mesh_(mesh),
      rule_(rule),
      round_point_(std::move(snap)),
      shape_limits_(mesh),
      quadrics_(mesh.points.size()),
      vertex_errors_(mesh.points.size()),
      vertex_stamps_(mesh.points.size(), 0),
      fixed_(std::move(fixed)),
      is_on_border_(mesh.points.size(), 0),
      bad_shape_factor_(rule == nullptr ? kBadShapeFactor : kBadShapeFactorOfSquares) {
  rebuild_queue();
}

/// True if one triangle of `a` and one of `b` have their other two corners in common.
bool EdgeCollapser::would_duplicate_triangle(std::uint32_t a, std::uint32_t b) {
  const std::span<const std::uint32_t> around = mesh_.around(b);
  mesh_.visits += around.size();
  const auto is_common = [&](std::uint32_t v) {
    return std::find(common_neighbours_.begin(), common_neighbours_.end(), v) !=
           common_neighbours_.end();
  };
  for (const std::uint32_t t : around) {
    if (mesh_.alive[t] == 0 || mesh_.contains(t, a)) continue;
    const Triangle& v = mesh_.triangles[t];
    const std::size_t k = v[0] == b ? 0 : v[1] == b ? 1 : 2;
    const std::uint32_t p = v[(k + 1) % 3], q = v[(k + 2) % 3];
    if (!is_common(p) || !is_common(q)) continue;
    // Two hubs have too many triangles to search.
    if (mesh_.is_hub(p) && mesh_.is_hub(q)) return true;
    mesh_.visits += std::min(mesh_.valence[p], mesh_.valence[q]);
    bool twin = false;
    mesh_.each_triangle_on_edge(
        p, q, [&](std::uint32_t other) { twin = twin || mesh_.contains(other, a); });
    if (twin) return true;
  }
  return false;
}

bool EdgeCollapser::keeps_topology(std::uint32_t a, std::uint32_t b) {
  if (mesh_.is_hub(a)) return keeps_topology_at_hub(a, b);
  if (mesh_.is_hub(b)) return keeps_topology_at_hub(b, a);
  mesh_.gather_unordered(a, neighbours_of_a_);
  mesh_.gather_unordered(b, neighbours_of_b_);
  std::uint32_t edge_triangles = 0;
  common_neighbours_.clear();
  bool is_a_on_border = false, is_b_on_border = false;
  for (const CollapseMesh::Neighbour& n : neighbours_of_a_) {
    is_a_on_border = is_a_on_border || n.triangles == 1;
    if (n.vertex == b) edge_triangles = n.triangles;
  }
  for (const CollapseMesh::Neighbour& n : neighbours_of_b_)
    is_b_on_border = is_b_on_border || n.triangles == 1;
  mesh_.find_common_neighbours(neighbours_of_a_, neighbours_of_b_, common_neighbours_);
  if (edge_triangles == 0 || common_neighbours_.size() != edge_triangles) return false;
  if (is_a_on_border && is_b_on_border && edge_triangles != 1) return false;
  // Some triangles must remain, and no two triangles may get the same corners.
  if (mesh_.valence[a] + mesh_.valence[b] <= 2 * edge_triangles) return false;
  return !would_duplicate_triangle(a, b);
}

/// Variant of keeps_topology() for the edge between a hub (a vertex with very many triangles) and `b`. It only tests
/// the neighbours of `b`, since it may not visit all triangles of the hub. Rejects the edge if `b` is also adjacent to
/// another hub.
bool EdgeCollapser::keeps_topology_at_hub(std::uint32_t hub, std::uint32_t b) {
  mesh_.gather(b, neighbours_of_b_);
  std::uint32_t edge_triangles = 0;
  common_neighbours_.clear();
  bool is_b_on_border = false;
  for (const CollapseMesh::Neighbour& n : neighbours_of_b_) {
    is_b_on_border = is_b_on_border || n.triangles == 1;
    if (n.vertex == hub) {
      edge_triangles = n.triangles;
      continue;
    }
    if (mesh_.is_hub(n.vertex)) return false;
    bool is_adjacent = false;
    mesh_.visits += mesh_.valence[n.vertex];
    mesh_.each_triangle_on_edge(n.vertex, hub, [&](std::uint32_t) { is_adjacent = true; });
    if (is_adjacent) common_neighbours_.push_back(n.vertex);
  }
  if (edge_triangles == 0 || common_neighbours_.size() != edge_triangles) return false;
  if (is_on_border_[hub] != 0 && is_b_on_border && edge_triangles != 1) return false;
  return !would_duplicate_triangle(hub, b);
}

bool EdgeCollapser::keeps_shapes(const Entry& e, const Step& step) {
  const std::uint32_t fixed = step.anchor == Anchor::first    ? e.a
                              : step.anchor == Anchor::second ? e.b
                                                              : kNoVertex;
  return shape_limits_.keeps(mesh_, e.a, e.b, step.target, fixed, e.leniency);
}

void EdgeCollapser::collapse(std::uint32_t a, std::uint32_t b, const Step& step) {
  // The merge visits all triangles of the removed vertex, so a hub is always the vertex that is kept.
  const bool is_swapped = step.anchor == Anchor::second;
  const std::uint32_t kept = is_swapped ? b : a, gone = is_swapped ? a : b;
  if (rule_ != nullptr) rule_->collapse(mesh_, a, b, step.anchor, step.target, kept);
  if (deviation_bound_ != nullptr) deviation_bound_->collapse();
  mesh_.points[kept] = step.target;
  quadrics_[kept] += quadrics_[gone];
  vertex_errors_[kept] = quadrics_[kept].weighted_distance(step.target);
  if (!line_quadrics_.empty()) line_quadrics_[kept] += line_quadrics_[gone];
  is_on_border_[kept] = is_on_border_[kept] | is_on_border_[gone];
  shape_limits_.merge(kept, gone);
  if (step.anchor != Anchor::none) mesh_.gather(gone, neighbours_of_b_);
  mesh_.merge(kept, gone);
  ++vertex_stamps_[gone];
  if (step.anchor != Anchor::none) {
    // The hub's other edges keep their queue entries. The cost of an entry is updated when the entry is popped.
    for (const CollapseMesh::Neighbour& n : neighbours_of_b_) {
      if (n.vertex != kept) push(kept, n.vertex);
    }
    return;
  }
  ++vertex_stamps_[kept];
  if (deferred_vertices_) {
    deferred_vertices_->push_back(kept);
    return;
  }
  mesh_.gather_unordered(kept, neighbours_of_a_);
  queue_edges(kept, neighbours_of_a_);
  if (deviation_bound_ == nullptr) return;
  touched_vertices_[kept] = 1;
  for (const CollapseMesh::Neighbour& n : neighbours_of_a_) touched_vertices_[n.vertex] = 1;
}

/// Collapses an edge if that is allowed. A collapse that only violates the limits of triangle shapes is queued again at
/// a higher cost.
bool EdgeCollapser::collapse_if_allowed(const Entry& entry) {
  Step step = step_for(entry.a, entry.b);
  if (!step.allowed) return false;
  if (step.anchor != Anchor::none) {
    const double cost = step.cost * std::pow(bad_shape_factor_, entry.leniency);
    if (cost > kHubCostTolerance * entry.cost) {
      ++mesh_.visits;
      Entry retry_entry = entry;
      retry_entry.cost = cost;
      queue_.push(retry_entry);
      return false;
    }
  }
  if (round_point_) step.target = round_point_(step.target);
  const bool shapes =
      keeps_shapes(entry, step) &&
      (rule_ == nullptr || rule_->keeps(mesh_, entry.a, entry.b, step.anchor, step.target));
  if (!shapes) {
    if (entry.leniency == CollapseShape::kMaxLeniency) return false;
    Entry retry_entry = entry;
    retry_entry.cost *= bad_shape_factor_;
    ++retry_entry.leniency;
    queue_.push(retry_entry);
    return false;
  }
  if (!keeps_topology(entry.a, entry.b) || !is_within_bound(entry, step)) return false;
  if (rule_ != nullptr) return collapse_with_twins(entry, step);
  collapse(entry.a, entry.b, step);
  return true;
}

/// The step that collapses a UV copy of an edge; nullopt if it is not allowed.
std::optional<EdgeCollapser::Step> EdgeCollapser::twin_step(const Entry& twin) {
  Step step = step_for(twin.a, twin.b);
  if (!step.allowed || step.anchor != Anchor::none) return std::nullopt;
  if (round_point_) step.target = round_point_(step.target);
  const bool is_allowed = keeps_shapes(twin, step) &&
                          rule_->keeps(mesh_, twin.a, twin.b, step.anchor, step.target) &&
                          keeps_topology(twin.a, twin.b) && is_within_bound(twin, step);
  return is_allowed ? std::optional(step) : std::nullopt;
}

/// Collapses an edge together with its UV copies, or none of them if one of these collapses is not allowed.
bool EdgeCollapser::collapse_with_twins(const Entry& entry, Step& step) {
  std::vector<std::array<std::uint32_t, 2>> twins;
  bool can_all_collapse =
      rule_->find_twins(mesh_, entry.a, entry.b, step.anchor, step.target, twins);
  const auto entry_of = [&](const std::array<std::uint32_t, 2>& edge) {
    Entry twin = entry;
    twin.a = edge[0];
    twin.b = edge[1];
    return twin;
  };
  for (std::size_t i = 0; can_all_collapse && i < twins.size(); ++i)
    can_all_collapse = twin_step(entry_of(twins[i])).has_value();
  // This edge is checked last, because the check stores the new triangles of the samples for the collapse that follows.
  if (can_all_collapse && !twins.empty()) can_all_collapse = is_within_bound(entry, step);
  if (can_all_collapse) {
    collapse(entry.a, entry.b, step);
    std::unordered_map<std::uint32_t, std::uint32_t> replacement_of{
        {entry.b, entry.a}};  // Maps removed vertices to those that replace them
    for (std::array<std::uint32_t, 2> last : twins) {
      for (std::uint32_t& end : last) {
        for (auto replacement = replacement_of.find(end); replacement != replacement_of.end();
             replacement = replacement_of.find(end)) {
          end = replacement->second;
        }
      }
      // The collapses of other copies may have made the collapse of this copy impossible. The copies that are left then
      // keep their triangles, which are no longer copies of the collapsed ones.
      const std::optional<Step> twin_collapse = twin_step(entry_of(last));
      if (!twin_collapse) break;
      collapse(last[0], last[1], *twin_collapse);
      if (last[1] != last[0]) replacement_of.emplace(last[1], last[0]);
    }
  }
  rule_->end_twins();
  if (can_all_collapse || entry.leniency == CollapseShape::kMaxLeniency) return can_all_collapse;
  Entry retry_entry = entry;
  retry_entry.cost *= bad_shape_factor_;
  ++retry_entry.leniency;
  queue_.push(retry_entry);
  return false;
}

/// Rebuilds quadrics from the current mesh. In the sums of merged quadrics, most planes count two or three times, and
/// some belong to triangles that have moved since. Planes of the current mesh place vertices better (Lindstrom and Turk
/// 1998, "Fast and Memory Efficient Polygonal Simplification"). Quadrics are rebuilt whenever the number of triangles
/// falls below a power of two, so that the result does not depend on intermediate targets.
bool EdgeCollapser::rebuild_when_due() {
  if (rule_ != nullptr || mesh_.faces > next_rebuild_) return false;
  // A mesh with a hub is not rebuilt: most edges of the hub are deferred, and evaluating all of them at each rebuild
  // would be too slow.
  const auto is_hub = [](std::uint32_t valence) { return valence > CollapseMesh::kMaxValence; };
  if (std::any_of(mesh_.valence.begin(), mesh_.valence.end(), is_hub)) {
    next_rebuild_ = 0;
    return false;
  }
  queue_.assign({});
  if (deviation_bound_ == nullptr) compact();
  rebuild_queue();
  return true;
}

void EdgeCollapser::compact() {
  const std::vector<std::uint32_t> number = mesh_.compact();
  queue_.renumber(number, vertex_stamps_);
  shape_limits_.renumber(number);
  renumber_values(quadrics_, number);
  renumber_values(vertex_errors_, number);
  renumber_values(vertex_stamps_, number);
  renumber_values(fixed_, number);
  renumber_values(is_on_border_, number);
}

/// Prefetches the data of the next queue entries, because the vertices of the cheapest edges are scattered in memory.
void EdgeCollapser::prefetch_next_entries() const {
  constexpr std::size_t kEntriesToCorners = 1, kEntriesToTriangles = 2, kEntriesToList = 4,
                        kEntriesToVertex = 8;
  if (const Entry* e = queue_.peek(kEntriesToVertex)) {
    for (const std::uint32_t v : {e->a, e->b}) {
      prefetch(&vertex_stamps_[v]);
      mesh_.prefetch_vertex(v);
    }
  }
  const auto current = [&](std::size_t others) {
    const Entry* const e = queue_.peek(others);
    return e != nullptr && is_current(*e) ? e : nullptr;
  };
  if (const Entry* e = current(kEntriesToList)) {
    for (const std::uint32_t v : {e->a, e->b}) {
      mesh_.prefetch_list(v);
      prefetch_planes(v);
    }
  }
  if (const Entry* e = current(kEntriesToTriangles)) {
    for (const std::uint32_t v : {e->a, e->b}) mesh_.prefetch_triangles(v);
  }
  if (const Entry* e = current(kEntriesToCorners)) {
    for (const std::uint32_t v : {e->a, e->b}) mesh_.prefetch_corners(v);
  }
}

void EdgeCollapser::collapse_up_to_cost(double cost) {
  constexpr std::uint8_t kVisitedVertex = 2;
  deferred_vertices_.emplace();
  for (const Entry* front = nullptr; (front = queue_.front(vertex_stamps_)) != nullptr;) {
    const Entry entry = *front;
    if (entry.cost > cost) break;
    queue_.pop();
    if (is_current(entry)) collapse_if_allowed(entry);
  }
  const std::vector<std::uint32_t> changed = std::move(*deferred_vertices_);
  deferred_vertices_.reset();
  std::vector<std::uint8_t> is_pending(mesh_.points.size(), 0);
  for (const std::uint32_t v : changed) is_pending[v] = 1;
  for (const std::uint32_t v : changed) {
    if (is_pending[v] == kVisitedVertex) continue;
    mesh_.gather_unordered(v, neighbours_of_a_);
    std::erase_if(neighbours_of_a_, [&](const CollapseMesh::Neighbour& n) {
      return is_pending[n.vertex] != 0 && n.vertex < v;
    });
    queue_edges(v, neighbours_of_a_);
    is_pending[v] = kVisitedVertex;
  }
  if (2 * mesh_.faces < mesh_.triangles.size()) compact();
}

void EdgeCollapser::run(std::size_t faces) {
  constexpr std::size_t kPollInterval = 1024;
  std::size_t unproductive_rounds = 0, tested_count = 0;
  while (true) {
    std::size_t collapse_count = 0;
    while (mesh_.face_count_with_back_faces() > faces && queue_.front(vertex_stamps_) != nullptr) {
      if (++tested_count % kPollInterval == 0) ProgressGuard::poll();
      if (rebuild_when_due()) continue;
      const Entry entry = *queue_.front(vertex_stamps_);
      queue_.pop();
      prefetch_next_entries();
      if (is_current(entry)) collapse_count += collapse_if_allowed(entry);
    }
    if (mesh_.face_count_with_back_faces() <= faces || collapse_count == 0) return;
    if (collapse_count * kTrianglesPerCollapse < mesh_.faces &&
        ++unproductive_rounds > kMaxUnproductiveRounds)
      return;
    // Edges that were rejected before may be allowed after the other collapses.
    fill_queue(mesh_.edges(), deviation_bound_ != nullptr);
  }
}

}  // namespace kiln

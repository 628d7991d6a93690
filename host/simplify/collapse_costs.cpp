// Part of EdgeCollapser: costs of edges, and their entries in the queue.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "simplify/collapse.h"

namespace kiln {
namespace {

/// Share of the edge length that is added to the cost. On flat surfaces, short edges then collapse first, and triangles
/// stay even. The weight is so small that flat surfaces do not keep triangles that curved ones need.
constexpr double kLengthWeight = 1e-7;
/// With a constraint: share of the squared edge length that is added to the squared deviation. The term exceeds the
/// rounding of single precision. (With 1e-8, long edges were too expensive.)
constexpr double kLengthWeightOfSquares = 1e-12;
/// Number of edges in a batch of a parallel loop. Pieces of a mesh have fewer edges, so each is processed by one
/// thread.
constexpr std::size_t kEdgesPerBatch = std::size_t{1} << 15;

}  // namespace

/// Position and cost of an edge's collapse. A hub keeps its position, since moving it would move its whole fan. Without
/// a constraint, the cost is the increase of the weighted distance, because a deviation is visible in proportion to its
/// size, not to its square. With a constraint, the cost is the squared distance, as in Garland and Heckbert, because
/// the constraint's planes add squared distances.
EdgeCollapser::Step EdgeCollapser::step_for(std::uint32_t a, std::uint32_t b) const {
  Step step(quadrics_[a] + quadrics_[b]);
  const bool hub_a = mesh_.is_hub(a), hub_b = mesh_.is_hub(b);
  if ((hub_a && hub_b) || (!fixed_.empty() && (fixed_[a] != 0 || fixed_[b] != 0))) return step;
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
  const double size = length(pb - pa);
  if (rule_ != nullptr) {
    step.cost = step.sum.at(step.target) + kLengthWeightOfSquares * size * step.sum.area;
    return step;
  }
  const double previous_error = vertex_errors_[a] + vertex_errors_[b];
  step.cost = std::max(0.0, step.sum.weighted_distance(step.target) - previous_error) +
              kLengthWeight * size * step.sum.area;
  return step;
}

/// Queue entry of an edge. Its cost is infinite if the edge may not collapse.
EdgeCollapser::Entry EdgeCollapser::entry_for(std::uint32_t a, std::uint32_t b) const {
  const Step step = step_for(a, b);
  const double cost = step.allowed ? step.cost : std::numeric_limits<double>::infinity();
  return {cost, a, b, vertex_stamps_[a], vertex_stamps_[b], 0};
}

/// \param edges    edges in the form that CollapseMesh::edges() returns
/// \param entries  [out] one entry per edge
void EdgeCollapser::make_entries(std::span<const std::uint64_t> edges, Entry* entries) const {
  for (const std::uint64_t edge : edges) {
    *entries++ =
        entry_for(static_cast<std::uint32_t>(edge >> 32), static_cast<std::uint32_t>(edge));
  }
}

/// \param all           all edges of the mesh, without duplicates
/// \param only_touched  true: skips edges whose surroundings have not changed since the last call
void EdgeCollapser::fill_queue(std::vector<std::uint64_t> all, bool only_touched) {
  if (rule_ == nullptr) {
    parallel_for(vertex_errors_.size(), std::size_t{1} << 14,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t v = begin; v < end; ++v)
                     vertex_errors_[v] = quadrics_[v].weighted_distance(mesh_.points[v]);
                 });
  }
  if (only_touched) {
    std::erase_if(all, [&](std::uint64_t e) {
      return touched_vertices_[e >> 32] == 0 &&
             touched_vertices_[static_cast<std::uint32_t>(e)] == 0;
    });
  }
  if (deviation_bound_ != nullptr) touched_vertices_.assign(mesh_.points.size(), 0);
  mesh_.visits += all.size();
  std::vector<Entry> entries(all.size());
  parallel_for(all.size(), kEdgesPerBatch, [&](std::size_t begin, std::size_t end) {
    make_entries(std::span(all).subspan(begin, end - begin), &entries[begin]);
  });
  std::erase_if(entries, [](const Entry& e) { return std::isinf(e.cost); });
  queue_.assign(std::move(entries));
}

/// Rebuilds the quadrics and the queue.
void EdgeCollapser::rebuild_queue() {
  std::vector<std::uint64_t> edges = build_quadrics();
  if (rule_ != nullptr) rule_->add_planes(mesh_, quadrics_);
  fill_queue(std::move(edges));
}

void EdgeCollapser::push(std::uint32_t a, std::uint32_t b) {
  ++mesh_.visits;
  const Entry entry = entry_for(std::min(a, b), std::max(a, b));
  if (!std::isinf(entry.cost)) queue_.push(entry);
}

/// Queues the edges from a vertex to the given neighbours.
void EdgeCollapser::queue_edges(std::uint32_t v,
                                const std::vector<CollapseMesh::Neighbour>& others) {
  for (const CollapseMesh::Neighbour& n : others) prefetch_planes(n.vertex);
  mesh_.visits += others.size();
  edges_.clear();
  for (const CollapseMesh::Neighbour& n : others) {
    edges_.push_back(std::uint64_t{std::min(v, n.vertex)} << 32 | std::max(v, n.vertex));
  }
  entries_.resize(edges_.size());
  make_entries(edges_, entries_.data());
  for (const Entry& entry : entries_) {
    if (!std::isinf(entry.cost)) queue_.push(entry);
  }
}

}  // namespace kiln

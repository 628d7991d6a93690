#include "unwrap/chart_proxy.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include "base/progress_guard.h"
#include "mesh/half_edge.h"
#include "mesh/quadric.h"

namespace kiln {
namespace {

/// Weight of the term that favours short edges where the surface is flat. In the cost of a collapse, the term is the
/// edge's squared length times the area around its first vertex; the quadric error has weight 1.
constexpr double kLengthCost = 0.003;
/// Weight of the plane that stands on a border edge, perpendicular to the surface, as a factor of the edge's squared
/// length.
constexpr double kBorderWeight = 1;
/// Minimum cosine between normals of a triangle before and after a collapse.
constexpr double kMinNormalCosine = 0.3;
/// Minimum area of a triangle after a collapse, as a share of the area of an equilateral triangle with the same sum of
/// squared sides. A triangle that is below this share before a collapse must not get worse.
constexpr double kMinTriangleShape = 0.05;

/// The half-edge that starts a vertex's fan: at a border, the half-edge without a mate, otherwise any.
std::uint32_t fan_begin(const std::vector<std::uint32_t>& mate, std::uint32_t h) {
  std::uint32_t begin = h;
  while (mate[begin] != kNoIndex) {
    begin = next_half_edge(mate[begin]);
    if (begin == h) break;
  }
  return begin;
}

class ProxyCollapse {
 public:
  ProxyCollapse(const ChartSurface& surface, const VertexFans& fans)
      : surface_(surface),
        start_vertex_(fans.of),
        mate_(surface.mate),
        surface_edge_(surface.mate.size()),
        fan_half_edge_(fans.first),
        piece_(surface.triangles.size()),
        is_removed_(surface.triangles.size(), 0),
        is_inside_piece_(surface.mate.size(), 0),
        area_(surface.area),
        position_(fans.first.size()),
        quadric_(fans.first.size()),
        is_queued_(fans.first.size(), 0),
        triangles_left_(surface.triangles.size()) {
    std::iota(surface_edge_.begin(), surface_edge_.end(), 0U);
    std::iota(piece_.begin(), piece_.end(), 0U);
    for (std::uint32_t v = 0; v < fan_half_edge_.size(); ++v)
      position_[v] = surface.positions[start_of(surface, fan_half_edge_[v])];
    for (std::uint32_t h = 0; h < start_vertex_.size(); ++h) {
      const std::uint32_t t = h / 3;
      Quadric& from = quadric_[start_vertex_[h]];
      from.add_plane(surface.normal[t], position_[start_vertex_[h]], surface.area[t]);
      from.area += surface.area[t];
      if (mate_[h] != kNoIndex) continue;
      const double squared_length = surface.length[h] * surface.length[h];
      const Quadric plane = perpendicular_plane(position_[start_vertex_[h]], position_[end(h)],
                                                surface.normal[t], kBorderWeight * squared_length);
      from += plane;
      quadric_[end(h)] += plane;
    }
  }

  void run(std::size_t triangles) {
    for (std::uint32_t v = 0; v < fan_half_edge_.size(); ++v) propose(v);
    while (triangles_left_ > triangles && !queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      is_queued_[next.from] = 0;
      // The queued cost may be outdated, since neighbours may have changed since then.
      const Candidate current_candidate = cheapest_collapse(next.from);
      if (current_candidate.half_edge == kNoIndex) continue;
      if (current_candidate.cost > next.cost) {
        push(current_candidate);
        continue;
      }
      if ((++collapse_count_ & 0xfff) == 0) ProgressGuard::poll();
      collapse(current_candidate);
    }
  }

  ChartProxy result() {
    ChartProxy proxy;
    std::vector<std::uint32_t> new_triangle(is_removed_.size(), kNoIndex),
        vertex(fan_half_edge_.size(), kNoIndex);
    ChartSurface& proxy_surface = proxy.surface;
    for (std::uint32_t t = 0; t < is_removed_.size(); ++t) {
      if (is_removed_[t] != 0) continue;
      new_triangle[t] = static_cast<std::uint32_t>(proxy_surface.triangles.size());
      Triangle corners{};
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t v = start_vertex_[3 * t + k];
        if (vertex[v] == kNoIndex) {
          vertex[v] = static_cast<std::uint32_t>(proxy_surface.positions.size());
          proxy_surface.positions.push_back(position_[v]);
        }
        corners[k] = vertex[v];
        proxy.surface_edge.push_back(surface_edge_[3 * t + k]);
      }
      proxy_surface.triangles.push_back(corners);
      proxy_surface.source.push_back(surface_.source[t]);
    }
    for (std::uint32_t t = 0; t < is_removed_.size(); ++t) {
      for (std::uint32_t k = 0; is_removed_[t] == 0 && k < 3; ++k) {
        const std::uint32_t m = mate_[3 * t + k];
        proxy_surface.mate.push_back(m == kNoIndex ? kNoIndex : 3 * new_triangle[m / 3] + m % 3);
      }
      proxy.piece.push_back(new_triangle[piece_of(t)]);
    }
    proxy.is_inside_piece = std::move(is_inside_piece_);
    return proxy;
  }

 private:
  /// A possible collapse of one vertex of an edge into the other, given by the edge's half-edge.
  struct Candidate {
    double cost = 0;
    std::uint32_t from = 0, half_edge = kNoIndex;
    Vec3d position{};  ///< Position of the remaining vertex after the collapse
    bool operator<(
        const Candidate& other) const {  // Comparison for a heap with the cheapest collapse on top
      return std::tie(cost, from) > std::tie(other.cost, other.from);
    }
  };

  std::uint32_t end(std::uint32_t h) const { return start_vertex_[next_half_edge(h)]; }
  bool is_at_border(std::uint32_t v) const { return mate_[fan_half_edge_[v]] == kNoIndex; }

  std::uint32_t piece_of(std::uint32_t t) {
    while (piece_[t] != t) t = piece_[t] = piece_[piece_[t]];
    return t;
  }

  /// Calls `body(h)` for each half-edge that starts at a vertex. If the vertex is on a border, calls `last(h)` at the
  /// end, for the border half-edge that ends at the vertex.
  template <typename Body, typename Last>
  void for_each_half_edge_from(std::uint32_t v, const Body& body, const Last& last) const {
    const std::uint32_t begin = fan_half_edge_[v];
    std::uint32_t h = begin;
    do {
      body(h);
      const std::uint32_t before = previous_half_edge(h);
      h = mate_[before];
      if (h == kNoIndex) {
        last(before);
        return;
      }
    } while (h != begin);
  }
  template <typename Body>
  void for_each_neighbour(std::uint32_t v, const Body& body) const {
    for_each_half_edge_from(
        v, [&](std::uint32_t h) { body(end(h)); },
        [&](std::uint32_t h) { body(start_vertex_[h]); });
  }

  void push(const Candidate& candidate) {
    queue_.push(candidate);
    is_queued_[candidate.from] = 1;
  }
  void propose(std::uint32_t v) {
    const Candidate best = cheapest_collapse(v);
    if (best.half_edge != kNoIndex) push(best);
  }

  /// The cheapest valid collapse of a vertex.
  Candidate cheapest_collapse(std::uint32_t v) {
    candidates_.clear();
    const bool border = is_at_border(v);
    const auto add = [&](std::uint32_t h, std::uint32_t to) {
      if (border && mate_[h] != kNoIndex) return;
      const Vec3d &a = position_[v], &b = position_[to], edge = b - a;
      const Quadric q = quadric_[v] + quadric_[to];
      const Vec3d position = is_at_border(to) && !border ? b : q.best_near(a, b);
      candidates_.push_back(
          {q.at(position) + kLengthCost * dot(edge, edge) * q.area, v, h, position});
    };
    for_each_half_edge_from(
        v, [&](std::uint32_t h) { add(h, end(h)); },
        [&](std::uint32_t h) { add(h, start_vertex_[h]); });
    while (!candidates_.empty()) {
      const auto best = std::max_element(
          candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
            return std::tie(a.cost, a.half_edge) > std::tie(b.cost, b.half_edge);
          });
      if (is_valid(*best)) return *best;
      *best = candidates_.back();
      candidates_.pop_back();
    }
    return {};
  }

  std::uint32_t target_vertex(const Candidate& candidate) const {
    return start_vertex_[candidate.half_edge] == candidate.from
               ? end(candidate.half_edge)
               : start_vertex_[candidate.half_edge];
  }

  /// True if collapsing the edge of h removes the triangle of half-edge g.
  bool triangle_vanishes(std::uint32_t g, std::uint32_t h) const {
    return g / 3 == h / 3 || (mate_[h] != kNoIndex && g / 3 == mate_[h] / 3);
  }

  /// True if a collapse keeps the topology and flips no triangle.
  bool is_valid(const Candidate& candidate) {
    const std::uint32_t u = candidate.from, v = target_vertex(candidate), h = candidate.half_edge,
                        m = mate_[h];
    std::array<std::uint32_t, 2> sides{h, m}, apex{kNoIndex, kNoIndex};
    for (std::size_t i = 0; i < 2; ++i) {
      if (sides[i] == kNoIndex) continue;
      const std::uint32_t next = next_half_edge(sides[i]), before = previous_half_edge(sides[i]);
      if (mate_[next] == kNoIndex && mate_[before] == kNoIndex) return false;
      apex[i] = start_vertex_[before];
      std::size_t neighbour_count = 0;
      for_each_neighbour(apex[i], [&](std::uint32_t) { ++neighbour_count; });
      if (neighbour_count <= 3 && !is_at_border(apex[i])) return false;
    }
    if (apex[0] == apex[1]) return false;
    ring_.clear();
    for_each_neighbour(u, [&](std::uint32_t w) { ring_.push_back(w); });
    bool is_linked = true;
    for_each_neighbour(v, [&](std::uint32_t w) {
      if (w == apex[0] || w == apex[1]) return;
      is_linked = is_linked && std::find(ring_.begin(), ring_.end(), w) == ring_.end();
    });
    if (!is_linked) return false;
    bool is_allowed = true;
    for (const std::uint32_t w : {u, v}) {
      for_each_half_edge_from(
          w,
          [&](std::uint32_t g) {
            if (!is_allowed || triangle_vanishes(g, h)) return;
            const Vec3d &a = position_[end(g)],
                        &b = position_[start_vertex_[previous_half_edge(g)]];
            is_allowed = keeps_shape(a, b, position_[w], candidate.position);
          },
          [](std::uint32_t) {});
    }
    return is_allowed;
  }

  /// True if a triangle with corners a, b keeps its orientation and does not become a needle when its third corner
  /// moves.
  static bool keeps_shape(const Vec3d& a, const Vec3d& b, const Vec3d& from, const Vec3d& to) {
    const Vec3d before = cross(b - a, from - a), after = cross(b - a, to - a);
    const double size = length(after);
    if (!(dot(before, after) > kMinNormalCosine * length(before) * size)) return false;
    const auto shape = [&](double doubled, const Vec3d& c) {
      const double sides = dot(b - a, b - a) + dot(c - a, c - a) + dot(c - b, c - b);
      return 3.4641016151377544 * doubled / sides;
    };
    return shape(size, to) >= std::min(kMinTriangleShape, shape(length(before), from));
  }

  void collapse(const Candidate& candidate) {
    const std::uint32_t u = candidate.from, v = target_vertex(candidate), h = candidate.half_edge,
                        m = mate_[h];
    fan_.clear();
    for_each_half_edge_from(
        u, [&](std::uint32_t g) { fan_.push_back(g); }, [](std::uint32_t) {});
    // A half-edge that starts at v and remains after the collapse; v's new fan is found from it.
    std::uint32_t half_edge_from_v = kNoIndex;
    for_each_half_edge_from(
        v,
        [&](std::uint32_t g) {
          if (!triangle_vanishes(g, h)) half_edge_from_v = g;
        },
        [](std::uint32_t) {});
    for (const std::uint32_t g : fan_) {
      start_vertex_[g] = v;
      if (!triangle_vanishes(g, h)) half_edge_from_v = g;
    }
    remove_triangle(h);
    if (m != kNoIndex) remove_triangle(m);
    fan_half_edge_[v] = fan_begin(mate_, half_edge_from_v);
    quadric_[v] += quadric_[u];
    position_[v] = candidate.position;
    for_each_neighbour(v, [&](std::uint32_t w) {
      if (is_queued_[w] == 0) vertices_to_queue_.push_back(w);
    });
    if (is_queued_[v] == 0) vertices_to_queue_.push_back(v);
    for (const std::uint32_t w : vertices_to_queue_) propose(w);
    vertices_to_queue_.clear();
  }

  /// Removes a triangle whose half-edge h was collapsed, and merges its other two sides into one edge.
  void remove_triangle(std::uint32_t h) {
    const std::uint32_t t = h / 3, apex = start_vertex_[previous_half_edge(h)];
    std::array<std::uint32_t, 2> own_sides{next_half_edge(h), previous_half_edge(h)};
    std::array<std::uint32_t, 2> opposite_sides{mate_[own_sides[0]], mate_[own_sides[1]]};
    is_removed_[t] = 1;
    --triangles_left_;
    const auto area = [&](std::uint32_t g) {
      return g == kNoIndex ? std::numeric_limits<double>::infinity() : area_[piece_of(g / 3)];
    };
    // The piece of the removed triangle is added to the neighbour whose piece is smaller.
    if (area(opposite_sides[1]) < area(opposite_sides[0]))
      std::swap(own_sides[0], own_sides[1]), std::swap(opposite_sides[0], opposite_sides[1]);
    const std::uint32_t to = opposite_sides[0] / 3;
    piece_[t] = to;
    area_[to] += area_[t];
    is_inside_piece_[surface_edge_[own_sides[0]]] =
        is_inside_piece_[surface_edge_[opposite_sides[0]]] = 1;
    surface_edge_[opposite_sides[0]] = surface_edge_[own_sides[1]];
    mate_[opposite_sides[0]] = opposite_sides[1];
    if (opposite_sides[1] != kNoIndex) mate_[opposite_sides[1]] = opposite_sides[0];
    // The removed half-edge may have been the first one of the apex's fan.
    fan_half_edge_[apex] = fan_begin(mate_, start_vertex_[opposite_sides[0]] == apex
                                                ? opposite_sides[0]
                                                : next_half_edge(opposite_sides[0]));
  }

  const ChartSurface& surface_;
  std::vector<std::uint32_t> start_vertex_, mate_, surface_edge_, fan_half_edge_, piece_;
  std::vector<std::uint8_t> is_removed_, is_inside_piece_;
  /// For each proxy triangle, the area of the surface that it represents
  std::vector<double> area_;
  std::vector<Vec3d> position_;
  std::vector<Quadric> quadric_;
  std::vector<std::uint8_t> is_queued_;
  std::priority_queue<Candidate> queue_;
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> ring_, fan_, vertices_to_queue_;
  std::size_t triangles_left_, collapse_count_ = 0;
};

}  // namespace

VertexFans::VertexFans(const ChartSurface& surface) : of(surface.mate.size(), kNoIndex) {
  for (std::uint32_t h = 0; h < of.size(); ++h) {
    if (of[h] != kNoIndex) continue;
    const std::uint32_t begin = fan_begin(surface.mate, h);
    std::uint32_t g = begin;
    do {
      of[g] = static_cast<std::uint32_t>(first.size());
      g = surface.mate[previous_half_edge(g)];
    } while (g != kNoIndex && g != begin);
    first.push_back(begin);
  }
}

ChartProxy chart_proxy(const ChartSurface& surface, const VertexFans& fans, std::size_t triangles) {
  ProxyCollapse collapse(surface, fans);
  collapse.run(triangles);
  ChartProxy proxy = collapse.result();
  measure_surface(proxy.surface);
  proxy.surface.finer_per_triangle = static_cast<double>(surface.triangles.size()) /
                                     static_cast<double>(proxy.surface.triangles.size());
  return proxy;
}

}  // namespace kiln

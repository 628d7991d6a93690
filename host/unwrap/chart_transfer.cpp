#include "unwrap/chart_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <memory>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "mesh/half_edge.h"
#include "unwrap/chart_growth.h"
#include "unwrap/cut_scratch.h"
#include "unwrap/straighten_seams.h"

namespace kiln {
namespace {

/// Finds the edges of the surface that are glued in the transferred charts: edges within a piece, edges that represent
/// glued edges of the proxy, and edges of the border trees around proxy vertices (see chart_proxy.h). Branches of these
/// trees along which a seam runs stay open.
std::vector<std::uint8_t> glued_edges(const ChartSurface& surface, const VertexFans& fans,
                                      const ChartProxy& proxy, const ChartBorders& borders) {
  std::vector<std::uint8_t> glued = proxy.is_inside_piece;
  std::vector<std::uint8_t> is_proxy_edge(glued.size(), 0);
  for (std::uint32_t h = 0; h < proxy.surface_edge.size(); ++h) {
    is_proxy_edge[proxy.surface_edge[h]] = 1;
    if (borders.is_glued(h)) glued[proxy.surface_edge[h]] = 1;
  }
  const auto end = [&](std::uint32_t h) { return fans.of[next_half_edge(h)]; };
  // Number of open edges at each vertex fan.
  std::vector<std::uint32_t> open_edges(fans.first.size(), 0);
  for (std::uint32_t h = 0; h < glued.size(); ++h) {
    const std::uint32_t m = surface.mate[h];
    if (glued[h] != 0 || (m != kNoIndex && m < h)) continue;
    ++open_edges[fans.of[h]], ++open_edges[end(h)];
  }
  std::vector<std::uint32_t> leaf_vertices;
  for (std::uint32_t v = 0; v < open_edges.size(); ++v) {
    if (open_edges[v] == 1) leaf_vertices.push_back(v);
  }
  while (!leaf_vertices.empty()) {
    const std::uint32_t v = leaf_vertices.back();
    leaf_vertices.pop_back();
    if (open_edges[v] != 1) continue;
    // v has one open edge, so it is not on the border: a border vertex has two
    std::uint32_t h = fans.first[v];
    while (glued[h] != 0) h = surface.mate[previous_half_edge(h)];
    if (is_proxy_edge[h] != 0) continue;
    glued[h] = glued[surface.mate[h]] = 1;
    --open_edges[v];
    if (--open_edges[end(h)] == 1) leaf_vertices.push_back(end(h));
  }
  return glued;
}

/// Maximum rounds of each solver that brings a chart within its limits.
constexpr int kTransferRigidRounds = 5, kTransferInjectiveRounds = 15, kUntangleRounds = 40;
/// Weights that hold vertices near the proxy's layout, relative to the weights of their triangles. They are tried in
/// this order.
constexpr std::array<double, 2> kHoldWeights{0, 0.01};
/// Untangling is only tried up to these limits: the number of pairs of border edges that touch, and the number of
/// flipped triangles. Large charts may have more: one touching pair for each kBorderEdgesPerTouchingPair border edges,
/// and one flipped triangle for each kTrianglesPerFlippedTriangle triangles.
constexpr std::size_t kMaxTouchingPairs = 16, kMaxFlippedTriangles = 8,
                      kBorderEdgesPerTouchingPair = 8, kTrianglesPerFlippedTriangle = 200;
/// Number of border vertices on each side of a touching vertex that are pushed with it.
constexpr std::size_t kPushedNeighbours = 4;

/// Flattens a chart near an initial layout.
/// \returns whether it is injective and within the limits
bool flatten_near_layout(FlatChart& chart, FlatStart start, const ChartLimits& limits) {
  const auto system = rigid_system(chart);
  const std::vector<double> relative_weights = start.hold_weights;
  const UntangleEffort effort{
      kUntangleRounds,
      std::max(kMaxTouchingPairs, chart.boundary.size() / kBorderEdgesPerTouchingPair),
      std::max(kMaxFlippedTriangles, chart.triangles.size() / kTrianglesPerFlippedTriangle),
      kPushedNeighbours};
  for (const double by : kHoldWeights) {
    for (std::size_t v = 0; v < relative_weights.size(); ++v)
      start.hold_weights[v] = by * relative_weights[v];
    if (!rigid_rounds(chart, kTransferRigidRounds, *system, &start)) continue;
    if (!is_injective(chart)) {
      if (rigid_energy(chart) > limits.energy + chart.roughness_energy) continue;
      if (!untangle(chart, effort, *system, &start)) continue;
    }
    injective_rounds(chart, kTransferInjectiveRounds, &limits, system.get(), true);
    if (is_within_limits(chart, limits)) return true;
  }
  return false;
}

/// UV layout of the proxy's charts.
class ProxyLayout {
 public:
  ProxyLayout(const ChartSurface& surface, const ChartProxy& proxy, const ChosenCharts& chosen)
      : surface_(surface), proxy_(proxy), chart_place_(proxy.surface.triangles.size()) {
    for (std::uint32_t c = 0; c < chosen.charts.size(); ++c) {
      const FlatChart& chart = chosen.charts[c];
      for (std::uint32_t i = 0; i < chart.source.size(); ++i)
        chart_place_[chart.source[i]] = {c, i};
    }
    for (const FlatChart& chart : chosen.charts) charts_.push_back(&chart);
  }

  /// The initial layout of a chart.
  /// \param chart  chart of the surface
  /// \param of     index of the proxy's chart that `chart` corresponds to
  /// \param index_in_chart  scratch memory, one entry per triangle of the surface
  FlatStart start_of(const FlatChart& chart, std::uint32_t of, std::span<const std::uint8_t> glued,
                     std::vector<std::uint32_t>& index_in_chart) const {
    const auto count = static_cast<std::uint32_t>(chart.source.size());
    FlatStart start;
    std::vector<Vec2d>& result = start.rotations;
    result.resize(count);
    start.vertex_positions.resize(chart.points.size());
    start.hold_weights.resize(chart.points.size(), 0);
    std::vector<std::uint8_t> is_placed(count, 0);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t t = chart.source[i], piece = proxy_.piece[t];
      index_in_chart[t] = i;
      if (chart_place_[piece].first != of) continue;
      std::array<Vec2d, 3> uvs{};
      for (std::size_t k = 0; k < 3; ++k) {
        uvs[k] = map_to_layout(surface_.positions[surface_.triangles[t][k]], piece);
        const std::uint32_t v = chart.triangles[i][k];
        start.vertex_positions[v] = start.vertex_positions[v] + uvs[k];
        ++start.hold_weights[v];
      }
      result[i] = rotation(chart.rest[i], uvs);
      is_placed[i] = 1;
      queue.push_back(i);
    }
    if (queue.empty()) {
      result[0] = {1, 0};
      is_placed[0] = 1;
      queue.push_back(0);
    }
    // Triangles that seam straightening added to the chart lie outside of its proxy chart. Each is unfolded from a
    // neighbour.
    for (std::size_t n = 0; n < queue.size(); ++n) {
      const std::uint32_t i = queue[n];
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t h = 3 * chart.source[i] + k, m = surface_.mate[h];
        if (glued[h] == 0 || is_placed[index_in_chart[m / 3]] != 0) continue;
        const std::uint32_t j = index_in_chart[m / 3];
        const Vec2d own = rest_side(chart.rest[i], k), other = -rest_side(chart.rest[j], m % 3);
        const Vec2d turn{dot(other, own), cross(other, own)}, r = result[i];
        const Vec2d rotation_sum{r.x * turn.x - r.y * turn.y, r.x * turn.y + r.y * turn.x};
        const double size = std::hypot(rotation_sum.x, rotation_sum.y);
        result[j] = size > 0 ? rotation_sum * (1 / size) : r;
        is_placed[j] = 1;
        queue.push_back(j);
      }
    }
    for (std::size_t v = 0; v < start.hold_weights.size(); ++v) {
      if (start.hold_weights[v] == 0) continue;
      start.vertex_positions[v] = start.vertex_positions[v] * (1 / start.hold_weights[v]);
      start.hold_weights[v] = 1;
    }
    return start;
  }

 private:
  /// The vector from corner k of a triangle's rest shape to the next corner.
  static Vec2d rest_side(const RestShape& rest, std::size_t k) {
    const Vec2d& g = rest.gradient[(k + 2) % 3];
    return Vec2d{g.y, -g.x} * (2 * rest.area);
  }

  /// Maps a position on the surface to the layout, by the affine map of a proxy triangle.
  Vec2d map_to_layout(const Vec3d& position, std::uint32_t piece) const {
    const auto [c, n] = chart_place_[piece];
    const FlatChart& chart = *charts_[c];
    const ChartSurface& proxy_surface = proxy_.surface;
    const Triangle& corners = proxy_surface.triangles[piece];
    const double doubled_area = 2 * proxy_surface.area[piece];
    Vec2d result{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d& from = proxy_surface.positions[corners[(k + 1) % 3]];
      const Vec3d edge_normal =
          cross(proxy_surface.normal[piece], proxy_surface.positions[corners[(k + 2) % 3]] - from);
      const double share = dot(edge_normal, position - from) / doubled_area;
      result = result + chart.points[chart.triangles[n][k]] * share;
    }
    return result;
  }

  /// Rotation nearest to the map from a rest shape to three positions, as cosine and sine.
  static Vec2d rotation(const RestShape& rest, const std::array<Vec2d, 3>& uvs) {
    Vec2d u{}, v{};
    for (std::size_t k = 0; k < 3; ++k) {
      u = u + rest.gradient[k] * uvs[k].x;
      v = v + rest.gradient[k] * uvs[k].y;
    }
    const double x = u.x + v.y, y = v.x - u.y, size = std::hypot(x, y);
    return size > 0 ? Vec2d{x / size, y / size} : Vec2d{1, 0};
  }

  const ChartSurface& surface_;
  const ChartProxy& proxy_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      chart_place_;  ///< For each proxy triangle, its chart and its index in the chart
  std::vector<const FlatChart*> charts_;
};

/// A separate surface that consists of some of the triangles. Edges that are not glued become borders.
ChartSurface extract_surface(const ChartSurface& surface, std::span<const std::uint32_t> triangles,
                             std::span<const std::uint8_t> glued,
                             std::vector<std::uint32_t>& index_in_chart) {
  ChartSurface part;
  part.positions = surface.positions;
  part.total_area = surface.total_area;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) index_in_chart[triangles[i]] = i;
  for (const std::uint32_t t : triangles) {
    part.triangles.push_back(surface.triangles[t]);
    part.source.push_back(t);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t h = 3 * t + k, m = surface.mate[h];
      part.mate.push_back(glued[h] == 0 ? kNoIndex : 3 * index_in_chart[m / 3] + m % 3);
      part.length.push_back(surface.length[h]);
    }
    part.area.push_back(surface.area[t]);
    part.normal.push_back(surface.normal[t]);
    part.bend.push_back(surface.bend[t]);
    part.bend_squared.push_back(surface.bend_squared[t]);
  }
  return part;
}

/// Grows new charts from the triangles of a chart that has no layout within the limits.
std::vector<FlatChart> grow_again(const ChartSurface& surface, const FlatChart& chart,
                                  const ChartLimits& limits, std::vector<std::uint8_t>& glued,
                                  std::vector<std::uint32_t>& index_in_chart, int threads) {
  const ChartSurface part = extract_surface(surface, chart.source, glued, index_in_chart);
  ChartBorders borders(part);
  std::vector<FlatChart> charts = grow_charts(part, borders, limits, threads);
  for (std::uint32_t h = 0; h < part.mate.size(); ++h) {
    if (part.mate[h] != kNoIndex) glued[3 * part.source[h / 3] + h % 3] = borders.is_glued(h);
  }
  for (FlatChart& one : charts) {
    for (std::uint32_t& t : one.source) t = part.source[t];
  }
  return charts;
}

}  // namespace

ChosenCharts transfer_charts(const ChartSurface& surface, const VertexFans& fans,
                             const ChartProxy& proxy, const ChosenCharts& chosen,
                             const ChartLimits& limits, int threads, std::size_t& regrown) {
  regrown = 0;
  std::vector<std::uint32_t> chart_of(proxy.surface.triangles.size());
  for (std::uint32_t c = 0; c < chosen.charts.size(); ++c) {
    for (const std::uint32_t t : chosen.charts[c].source) chart_of[t] = c;
  }
  std::vector<std::uint32_t> labels;
  labels.reserve(proxy.piece.size());
  for (const std::uint32_t piece : proxy.piece) labels.push_back(chart_of[piece]);
  ChosenCharts result{ChartBorders(surface), {}, chosen.packed, chosen.is_independent_of_size};
  result.borders.restore(glued_edges(surface, fans, proxy, chosen.borders));
  straighten_seams(surface, result.borders, labels);
  std::vector<std::vector<std::uint32_t>> triangles(chosen.charts.size());
  for (std::uint32_t t = 0; t < labels.size(); ++t) triangles[labels[t]].push_back(t);
  std::vector<FlatChart>& charts = result.charts;
  charts.resize(triangles.size());
  std::vector<std::uint8_t> is_transferred(charts.size(), 0);
  const ProxyLayout layout(surface, proxy, chosen);
  ScratchPool scratches(surface);
  const auto flatten = [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<CutScratch> scratch = scratches.acquire();
    for (std::size_t c = begin; c < end; ++c) {
      charts[c] = cut_open(surface, triangles[c], result.borders.glued(), scratch->index_in_chart);
      const FlatStart start = layout.start_of(charts[c], static_cast<std::uint32_t>(c),
                                              result.borders.glued(), scratch->index_in_chart);
      is_transferred[c] =
          is_disc(charts[c]) && flatten_near_layout(charts[c], start, limits) ? 1 : 0;
    }
    scratches.release(std::move(scratch));
  };
  parallel_for(charts.size(), 1, flatten, threads);
  if (std::find(is_transferred.begin(), is_transferred.end(), 0) == is_transferred.end())
    return result;
  std::vector<std::uint8_t> glued = result.borders.glued();
  std::vector<std::uint32_t> index_in_chart(surface.triangles.size());
  std::vector<FlatChart> all_charts;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (is_transferred[c] != 0) {
      all_charts.push_back(std::move(charts[c]));
      continue;
    }
    regrown += charts[c].source.size();
    std::vector<FlatChart> new_charts =
        grow_again(surface, charts[c], limits, glued, index_in_chart, threads);
    std::move(new_charts.begin(), new_charts.end(), std::back_inserter(all_charts));
  }
  charts = std::move(all_charts);
  result.borders.restore(std::move(glued));
  result.packed.reset();
  return result;
}

}  // namespace kiln

#include "unwrap/chart_cut_search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "mesh/half_edge.h"

namespace kiln {
namespace {

/// Number of lines that are tried perpendicular to each direction.
constexpr int kLinesPerDirection = 13;
/// Assumed ratio of the area of a part's bounding box to the area of the part. A chart is skipped if even parts with
/// such tight boxes would save nothing.
constexpr double kMinBoxRatio = 1.1;
/// Minimum area of a part, as a share of its chart's area.
constexpr double kMinCutShare = 0.01;
/// A connected piece of a band counts as an island if its area is below this share of the chart's area.
constexpr double kMaxIslandShare = 0.002;

using Extents = CutShape::Extents;

Vec2d direction_of(std::size_t d) {
  const double angle = static_cast<double>(d) * std::numbers::pi / CutShape::kDirections;
  return {std::cos(angle), std::sin(angle)};
}

/// Finds the best cut along parallel lines that are perpendicular to one direction. The lines divide the triangles into
/// bands; the connected components of all bands are the nodes of a small graph. Each line is tested on this graph.
class LineSearch {
 public:
  LineSearch(const CutShape& shape, std::span<const CutPrice> prices)
      : shape_(shape),
        cut_prices_(prices),
        triangle_count_(static_cast<std::uint32_t>(shape.chart.triangles.size())),
        cut_off_(prices.size()),
        best_cuts_(prices.size()) {}

  std::vector<ChartCut> run(std::size_t direction) {
    find_nodes(direction);
    find_links();
    absorb_islands();
    for (int line = 1; line <= kLinesPerDirection; ++line) test_line(line);
    for (std::size_t p = 0; p < best_cuts_.size(); ++p) {
      if (best_cuts_[p].gain <= 0) continue;
      best_cuts_[p].apart.resize(triangle_count_);
      for (std::uint32_t i = 0; i < triangle_count_; ++i)
        best_cuts_[p].apart[i] = cut_off_[p][node_of_triangle_[i]];
    }
    return std::move(best_cuts_);
  }

 private:
  /// A connected component of one band.
  struct Node {
    int band = 0;
    double area = 0;
  };
  /// The edges between two nodes, merged.
  struct NodeEdge {
    std::uint32_t a = 0, b = 0;
    double length = 0;
  };
  /// A connected component of the nodes on one side of the current line.
  struct Part {
    std::uint32_t neighbour = kNoIndex;
    bool is_leaf = true;  ///< True if the part is adjacent to a single other part
    double length = 0;    ///< Length of the part's edges to other parts
    double area = 0;
  };

  void find_nodes(std::size_t direction) {
    const double low = -shape_.chart_extents.to[direction + CutShape::kDirections];
    const double high = shape_.chart_extents.to[direction];
    const double bands = high > low ? (kLinesPerDirection + 1) / (high - low) : 0;
    std::vector<int> band(triangle_count_);
    // Projects the points again, although vertex_extents contains the projections: a separate array is contiguous in
    // memory.
    const std::vector<Vec2d>& points = shape_.chart.points;
    const Vec2d to = direction_of(direction);
    std::vector<float> projections(points.size());
    for (std::size_t v = 0; v < projections.size(); ++v)
      projections[v] = static_cast<float>(dot(to, points[v]));
    for (std::uint32_t i = 0; i < triangle_count_; ++i) {
      double projection_sum = 0;
      for (const std::uint32_t v : shape_.chart.triangles[i]) projection_sum += projections[v];
      band[i] = static_cast<int>((projection_sum / 3 - low) * bands);
    }
    node_of_triangle_.resize(triangle_count_);
    std::iota(node_of_triangle_.begin(), node_of_triangle_.end(), 0U);
    for (const CutShape::Edge& edge : shape_.edges) {
      if (band[edge.a] != band[edge.b]) {
        band_edges_.push_back(edge);
        continue;
      }
      const std::uint32_t a = find_root(node_of_triangle_, edge.a),
                          b = find_root(node_of_triangle_, edge.b);
      node_of_triangle_[std::max(a, b)] = std::min(a, b);
    }
    // The root is the first triangle of its node, so its entry is replaced by the node's number before other
    // triangles read it.
    for (std::uint32_t i = 0; i < triangle_count_; ++i) {
      if (node_of_triangle_[i] == i) {
        node_of_triangle_[i] = static_cast<std::uint32_t>(nodes_.size());
        nodes_.push_back({band[i], 0});
      } else {
        node_of_triangle_[i] = node_of_triangle_[node_of_triangle_[i]];
      }
      nodes_[node_of_triangle_[i]].area += shape_.chart.rest[i].area;
    }
  }

  /// Root of an element in a disjoint-set forest.
  static std::uint32_t find_root(std::vector<std::uint32_t>& to, std::uint32_t i) {
    while (to[i] != i) i = to[i] = to[to[i]];
    return i;
  }

  void find_links() {
    std::vector<std::vector<NodeEdge>> edges_of_node(nodes_.size());
    for (const CutShape::Edge& edge : band_edges_) {
      add_link(edges_of_node, node_of_triangle_[edge.a], node_of_triangle_[edge.b], edge.length);
    }
    collect_links(edges_of_node);
  }

  /// Merges each island into the neighbour with which it shares the longest border. The sides of bands are ragged,
  /// because triangles are not split. Without the merge, a cut along the line would give three parts where a
  /// separate piece lies at such a side.
  void absorb_islands() {
    const auto count = static_cast<std::uint32_t>(nodes_.size());
    std::vector<std::uint32_t> to(count);
    std::iota(to.begin(), to.end(), 0U);
    std::vector<const NodeEdge*> best(count, nullptr);
    for (const NodeEdge& link : links_) {
      for (const std::uint32_t n : {link.a, link.b}) {
        if (best[n] == nullptr || link.length > best[n]->length) best[n] = &link;
      }
    }
    for (std::uint32_t n = 0; n < count; ++n) {
      if (best[n] == nullptr || nodes_[n].area >= kMaxIslandShare * shape_.area) continue;
      to[find_root(to, n)] = find_root(to, best[n]->a == n ? best[n]->b : best[n]->a);
    }
    std::vector<std::uint32_t> new_index(count, kNoIndex);
    std::vector<Node> nodes;
    for (std::uint32_t n = 0; n < count; ++n) {
      if (to[n] != n) continue;
      new_index[n] = static_cast<std::uint32_t>(nodes.size());
      nodes.push_back({nodes_[n].band, 0});
    }
    for (std::uint32_t n = 0; n < count; ++n) {
      new_index[n] = new_index[find_root(to, n)];
      nodes[new_index[n]].area += nodes_[n].area;
    }
    if (nodes.size() == count) return;
    nodes_ = std::move(nodes);
    for (std::uint32_t& node : node_of_triangle_) node = new_index[node];
    std::vector<std::vector<NodeEdge>> edges_of_node(nodes_.size());
    for (const NodeEdge& link : links_) {
      add_link(edges_of_node, new_index[link.a], new_index[link.b], link.length);
    }
    collect_links(edges_of_node);
  }

  void collect_links(const std::vector<std::vector<NodeEdge>>& edges_of_node) {
    links_.clear();
    for (const std::vector<NodeEdge>& node_edges : edges_of_node)
      links_.insert(links_.end(), node_edges.begin(), node_edges.end());
  }

  static void add_link(std::vector<std::vector<NodeEdge>>& edges_of_node, std::uint32_t a,
                       std::uint32_t b, double length) {
    if (a == b) return;
    if (a > b) std::swap(a, b);
    const auto merged_edge = std::find_if(edges_of_node[a].begin(), edges_of_node[a].end(),
                                          [&](const NodeEdge& link) { return link.b == b; });
    if (merged_edge == edges_of_node[a].end()) {
      edges_of_node[a].push_back({a, b, length});
    } else {
      merged_edge->length += length;
    }
  }

  void test_line(int line) {
    line_ = static_cast<std::size_t>(line);
    const auto is_low = [&](std::uint32_t node) { return nodes_[node].band < line; };
    part_of_node_.resize(nodes_.size());
    std::iota(part_of_node_.begin(), part_of_node_.end(), 0U);
    for (const NodeEdge& link : links_) {
      if (is_low(link.a) != is_low(link.b)) continue;
      const std::uint32_t a = find_root(part_of_node_, link.a),
                          b = find_root(part_of_node_, link.b);
      part_of_node_[std::max(a, b)] = std::min(a, b);
    }
    parts_.assign(nodes_.size(), {});
    part_extents_.clear();
    parts_count_ = 0;
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      part_of_node_[n] = find_root(part_of_node_, n);
      parts_count_ += part_of_node_[n] == n ? 1 : 0;
      parts_[part_of_node_[n]].area += nodes_[n].area;
    }
    if (parts_count_ < 2) return;
    for (const NodeEdge& link : links_) {
      const std::uint32_t a = part_of_node_[link.a], b = part_of_node_[link.b];
      if (a == b) continue;
      for (const auto& [one, other] : {std::pair{a, b}, std::pair{b, a}}) {
        Part& part = parts_[one];
        part.is_leaf = part.is_leaf && (part.neighbour == kNoIndex || part.neighbour == other);
        part.neighbour = other;
        part.length += link.length;
      }
    }
    for (std::uint32_t p = 0; p < parts_.size(); ++p) {
      if (part_of_node_[p] == p && parts_[p].is_leaf) test_part(p);
    }
  }

  void test_part(std::uint32_t p) {
    const Part& part = parts_[p];
    const double rest = shape_.area - part.area;
    double box_area_sum = -1;  // Sum of both parts' box areas; computed on first use
    for (std::size_t n = 0; n < cut_prices_.size(); ++n) {
      const CutPrice& price = cut_prices_[n];
      ChartCut& best = best_cuts_[n];
      if (std::min(part.area, rest) < std::max(price.min_part_area, kMinCutShare * shape_.area))
        continue;
      const double cost =
          part.length * (2 * price.margin + price.seam) - 2 * price.size * part.area * rest;
      const double gain_to_beat = best.gain_at(part.length);
      if (shape_.box_area - kMinBoxRatio * shape_.area - cost <= gain_to_beat) continue;
      if (box_area_sum < 0) box_area_sum = box_area_with_and_without(p);
      const double gain = shape_.box_area - box_area_sum - cost;
      if (gain <= gain_to_beat) continue;
      best.gain = gain;
      best.length = part.length;
      cut_off_[n].resize(nodes_.size());
      for (std::uint32_t i = 0; i < nodes_.size(); ++i) cut_off_[n][i] = part_of_node_[i] == p;
    }
  }

  /// Area of the smallest bounding box of part p, plus that of the rest of the chart.
  double box_area_with_and_without(std::uint32_t p) {
    if (node_extents_.empty()) compute_extents();
    if (parts_count_ == 2) {  // Each part consists of all nodes on one side of the line
      return extents_below_[line_].smallest_box() + extents_above_[line_].smallest_box();
    }
    if (part_extents_.empty()) {
      part_extents_.resize(nodes_.size());
      for (std::uint32_t n = 0; n < nodes_.size(); ++n)
        part_extents_[part_of_node_[n]].add(node_extents_[n]);
    }
    Extents remaining_extents;
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      if (n != p && part_of_node_[n] == n) remaining_extents.add(part_extents_[n]);
    }
    return part_extents_[p].smallest_box() + remaining_extents.smallest_box();
  }

  /// Computes the extents of all nodes in one pass over the border vertices, which determine them.
  void compute_extents() {
    node_extents_.assign(nodes_.size(), {});
    std::vector<std::uint32_t> last_node(shape_.vertex_extents.size(), kNoIndex);
    const auto add = [&](std::uint32_t i, std::uint32_t v) {
      const std::uint32_t node = node_of_triangle_[i];
      if (last_node[v] == node) return;  // The vertex was added to this node just before
      last_node[v] = node;
      node_extents_[node].add(shape_.vertex_extents[v]);
    };
    for (const CutShape::BorderVertex& border_vertices : shape_.border_vertices)
      add(border_vertices.triangle, border_vertices.vertex);
    for (const std::size_t side : {0, 1}) {
      for (const CutShape::Edge& edge : band_edges_) {
        if (node_of_triangle_[edge.a] == node_of_triangle_[edge.b]) continue;
        for (const std::uint32_t v : edge.ends) add(side == 0 ? edge.a : edge.b, v);
      }
    }
    // Prefix and suffix unions: the extents of all nodes below each line, and of all nodes above it.
    extents_below_.assign(kLinesPerDirection + 2, {});
    extents_above_.assign(kLinesPerDirection + 2, {});
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      const auto band = static_cast<std::size_t>(std::clamp(nodes_[n].band, 0, kLinesPerDirection));
      extents_below_[band + 1].add(node_extents_[n]);
      extents_above_[band].add(node_extents_[n]);
    }
    for (std::size_t line = 1; line < extents_below_.size(); ++line) {
      extents_below_[line].add(extents_below_[line - 1]);
      extents_above_[extents_below_.size() - 1 - line].add(
          extents_above_[extents_below_.size() - line]);
    }
  }

  const CutShape& shape_;
  std::span<const CutPrice> cut_prices_;
  std::uint32_t triangle_count_;
  std::vector<std::uint32_t> node_of_triangle_;  ///< Node of each triangle
  std::vector<Node> nodes_;
  std::vector<NodeEdge> links_;
  std::vector<CutShape::Edge> band_edges_;  ///< Edges between triangles of different bands
  std::vector<Extents> node_extents_;       ///< Extent of each node; empty until first use
  std::vector<Extents> extents_below_,
      extents_above_;  ///< Extents below and above each line, computed with node_extents_.
  /// Index of the current line, and number of parts into which it cuts the chart
  std::size_t line_ = 0, parts_count_ = 0;
  std::vector<std::uint32_t> part_of_node_;  ///< For each node, the first node of its part
  std::vector<Part> parts_;
  std::vector<Extents> part_extents_;  ///< Extent of each part; empty until first use
  /// For each price and each node: 1 if the best cut at that price cuts the node off.
  std::vector<std::vector<std::uint8_t>> cut_off_;
  std::vector<ChartCut> best_cuts_;
};

}  // namespace

double CutShape::Extents::smallest_box() const {
  const auto span = [&](std::size_t d) { return double{to[d]} + double{to[d + kDirections]}; };
  double smallest_area = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < kDirections / 2; ++k) {
    smallest_area = std::min(smallest_area, span(k) * span(k + kDirections / 2));
  }
  return smallest_area;
}

double smallest_box(const FlatChart& chart) {
  Extents chart_extents;
  for (std::size_t d = 0; d < CutShape::kDirections; ++d) {
    const Vec2d to = direction_of(d);
    for (const std::uint32_t v : chart.boundary) {
      const auto projection = static_cast<float>(dot(to, chart.points[v]));
      chart_extents.to[d] = std::max(chart_extents.to[d], projection);
      chart_extents.to[d + CutShape::kDirections] =
          std::max(chart_extents.to[d + CutShape::kDirections], -projection);
    }
  }
  return chart_extents.smallest_box();
}

CutShape::CutShape(const ChartSurface& surface, const FlatChart& given,
                   const ChartNeighbours& neighbour)
    : chart(given), vertex_extents(given.points.size()) {
  edges.reserve(neighbour.size() / 2);
  for (std::uint32_t i = 0; i < chart.source.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t n = neighbour[3 * i + k];
      if (n == kNoIndex || n < i) continue;
      const Triangle& t = chart.triangles[i];
      edges.push_back(
          {i, n, {t[k], t[(k + 1) % 3]}, surface.length[3 * std::size_t{chart.source[i]} + k]});
    }
    area += chart.rest[i].area;
  }
  for (std::size_t d = 0; d < kDirections; ++d) {
    const Vec2d to = direction_of(d);
    for (std::size_t v = 0; v < vertex_extents.size(); ++v) {
      const auto projection = static_cast<float>(dot(to, chart.points[v]));
      vertex_extents[v].to[d] = projection;
      vertex_extents[v].to[d + kDirections] = -projection;
    }
  }
  std::vector<std::uint8_t> open(chart.points.size(), 0);
  for (const std::uint32_t v : chart.boundary) {
    open[v] = 1;
    chart_extents.add(vertex_extents[v]);
  }
  for (std::uint32_t i = 0; i < chart.triangles.size(); ++i) {
    for (const std::uint32_t v : chart.triangles[i]) {
      if (open[v] != 0) border_vertices.push_back({i, v});
    }
  }
  box_area = chart_extents.smallest_box();
}

bool CutShape::may_reduce_cost(const CutPrice& price) const {
  return area >= 2 * price.min_part_area &&
         box_area - kMinBoxRatio * area + 0.5 * price.size * area * area > 0;
}

std::vector<ChartCut> CutShape::best_cuts(std::size_t direction,
                                          std::span<const CutPrice> prices) const {
  return LineSearch(*this, prices).run(direction);
}

}  // namespace kiln

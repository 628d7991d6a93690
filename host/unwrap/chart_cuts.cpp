#include "unwrap/chart_cuts.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "mesh/half_edge.h"
#include "unwrap/chart_cut_search.h"

namespace kiln {
namespace {

FlatChart extract_part(const ChartSurface& surface, const ChartBorders& borders,
                       const FlatChart& chart, const std::vector<std::uint8_t>& is_apart,
                       bool apart, std::vector<std::uint32_t>& index_in_chart) {
  std::vector<std::uint32_t> triangles, part_triangles;
  std::vector<RestShape> rest;
  for (std::uint32_t i = 0; i < is_apart.size(); ++i) {
    if ((is_apart[i] != 0) != apart) continue;
    triangles.push_back(chart.source[i]);
    part_triangles.push_back(i);
    rest.push_back(chart.rest[i]);
  }
  FlatChart part =
      cut_open(surface, triangles, borders.glued(), index_in_chart, {}, std::move(rest));
  for (std::size_t i = 0; i < part_triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      part.points[part.triangles[i][k]] = chart.points[chart.triangles[part_triangles[i]][k]];
    }
  }
  return part;
}

/// A tree of charts and of the parts into which they are cut, for several CutPrices at once. A part that results from
/// several prices is a single node.
class CutTree {
 public:
  CutTree(const ChartSurface& surface, const ChartBorders& borders,
          std::span<const CutPrice> prices, int threads)
      : surface_(surface), borders_(borders), cut_prices_(prices), threads_(threads) {}

  void run(std::vector<FlatChart> charts) {
    std::vector<std::uint32_t> index_in_chart(surface_.triangles.size());
    for (const FlatChart& chart : charts) {
      for (std::uint32_t i = 0; i < chart.source.size(); ++i) index_in_chart[chart.source[i]] = i;
    }
    std::vector<std::uint32_t> all_prices(cut_prices_.size());
    std::iota(all_prices.begin(), all_prices.end(), 0U);
    for (FlatChart& chart : charts) {
      Node node{std::move(chart), {}, all_prices, {}};
      for (const std::uint32_t t : node.chart.source) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t h = 3 * t + k;
          node.neighbour.push_back(borders_.is_glued(h) ? index_in_chart[surface_.mate[h] / 3]
                                                        : kNoIndex);
        }
      }
      nodes_.push_back(std::move(node));
    }
    root_count_ = nodes_.size();
    for (std::size_t begin = 0; begin < nodes_.size();) {
      const std::size_t end = nodes_.size();
      cut_level(begin, end);
      begin = end;
    }
  }

  CutCharts charts_for_price(std::uint32_t price) const {
    std::vector<std::size_t> node_indices(root_count_);
    std::iota(node_indices.begin(), node_indices.end(), std::size_t{0});
    for (std::size_t i = 0; i < node_indices.size();) {
      const NodeSplit* const split = split_for_price(nodes_[node_indices[i]], price);
      if (split == nullptr) {
        ++i;
        continue;
      }
      node_indices.push_back(split->apart);
      node_indices[i] = split->rest;
    }
    CutCharts result{borders_.glued(), {}};
    std::vector<std::size_t> node_of_triangle(surface_.triangles.size());
    for (const std::size_t id : node_indices) {
      for (const std::uint32_t t : nodes_[id].chart.source) node_of_triangle[t] = id;
      result.charts.push_back(nodes_[id].chart);
    }
    for (std::uint32_t h = 0; h < surface_.mate.size(); ++h) {
      if (result.glued[h] != 0 && node_of_triangle[h / 3] != node_of_triangle[surface_.mate[h] / 3])
        result.glued[h] = 0;
    }
    return result;
  }

 private:
  /// The parts of a cut as node indices, and the prices at which this cut is the best.
  struct NodeSplit {
    std::vector<std::uint32_t> prices;
    std::size_t rest = 0, apart = 0;
  };
  struct Node {
    FlatChart chart;
    ChartNeighbours neighbour;
    std::vector<std::uint32_t> prices;  ///< The prices whose cuts lead to this part
    std::vector<NodeSplit> splits;
  };
  /// Scratch memory of one thread, with an entry for each half-edge and triangle of the surface.
  struct Scratch {
    ChartBorders borders;
    std::vector<std::uint32_t> index_in_chart;
  };

  static const NodeSplit* split_for_price(const Node& node, std::uint32_t price) {
    for (const NodeSplit& split : node.splits) {
      if (std::find(split.prices.begin(), split.prices.end(), price) != split.prices.end())
        return &split;
    }
    return nullptr;
  }

  /// Cuts the nodes of one level of the tree, at most once for each price, and appends the parts as new nodes.
  void cut_level(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<std::optional<CutShape>> shapes(count);
    const auto shape = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const Node& node = nodes_[begin + i];
        shapes[i].emplace(surface_, node.chart, node.neighbour);
      }
    };
    parallel_for(count, 1, shape, threads_);
    std::vector<std::vector<ChartCut>> cuts(count * CutShape::kDirections);
    const auto find_cuts = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const std::size_t n = i / CutShape::kDirections;
        std::vector<CutPrice> prices;
        bool any = false;
        for (const std::uint32_t p : nodes_[begin + n].prices) {
          prices.push_back(cut_prices_[p]);
          any = any || shapes[n]->may_reduce_cost(cut_prices_[p]);
        }
        cuts[i] = any ? shapes[n]->best_cuts(i % CutShape::kDirections, prices)
                      : std::vector<ChartCut>(prices.size());
      }
    };
    parallel_for(cuts.size(), 1, find_cuts, threads_);
    std::vector<std::vector<CutParts>> parts(count);
    const auto split = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        parts[i] = split_node(nodes_[begin + i], std::span(cuts).subspan(i * CutShape::kDirections,
                                                                         CutShape::kDirections));
      }
    };
    parallel_for(count, 1, split, threads_);
    for (std::size_t i = 0; i < count; ++i) {
      for (CutParts& made : parts[i]) {
        nodes_[begin + i].splits.push_back({made.rest.prices, nodes_.size(), nodes_.size() + 1});
        nodes_.push_back(std::move(made.rest));
        nodes_.push_back(std::move(made.apart));
      }
    }
  }

  struct CutParts {
    Node rest, apart;
  };

  /// The parts of each distinct cut that is best at some price. Cuts whose parts are not both discs are left out.
  std::vector<CutParts> split_node(const Node& node,
                                   std::span<std::vector<ChartCut>> by_direction) {
    std::vector<ChartCut> best(node.prices.size());
    for (std::vector<ChartCut>& cuts : by_direction) {
      for (std::size_t p = 0; p < best.size(); ++p) {
        if (cuts[p].gain > best[p].gain_at(cuts[p].length)) best[p] = std::move(cuts[p]);
      }
    }
    std::vector<CutParts> result;
    std::unique_ptr<Scratch> scratch;
    for (std::size_t p = 0; p < best.size(); ++p) {
      if (best[p].gain <= 0) continue;
      std::vector<std::uint32_t> prices;
      for (std::size_t q = p; q < best.size(); ++q) {
        if (best[q].gain <= 0 || (q != p && best[q].apart != best[p].apart)) continue;
        prices.push_back(node.prices[q]);
        if (q != p) best[q].gain = 0;
      }
      if (!scratch) scratch = acquire(node);
      CutParts parts{{node.chart, {}, prices, {}}, {{}, {}, prices, {}}};
      const std::vector<std::uint8_t>& apart = best[p].apart;
      const bool is_cut = cut_apart(surface_, scratch->borders, apart, scratch->index_in_chart,
                                    parts.rest.chart, parts.apart.chart);
      mark_edges(node, *scratch, true);
      if (!is_cut) continue;
      parts.rest.neighbour = neighbours_in_part(node.neighbour, apart, 0);
      parts.apart.neighbour = neighbours_in_part(node.neighbour, apart, 1);
      result.push_back(std::move(parts));
    }
    if (scratch) release(node, std::move(scratch));
    return result;
  }

  /// Marks the edges of a node's triangles in a thread's scratch memory.
  /// \param apart  true: opens the edges to other nodes; false: restores the state of borders_
  void mark_edges(const Node& node, Scratch& scratch, bool apart) const {
    for (std::uint32_t i = 0; i < node.chart.source.size(); ++i) {
      scratch.index_in_chart[node.chart.source[i]] = i;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t h = 3 * node.chart.source[i] + k;
        if (!borders_.is_glued(h)) continue;
        scratch.borders.set_glued(h, !apart || node.neighbour[3 * i + k] != kNoIndex);
      }
    }
  }

  std::unique_ptr<Scratch> acquire(const Node& node) {
    std::unique_ptr<Scratch> scratch;
    {
      const std::lock_guard lock(mutex_);
      if (!free_scratches_.empty()) {
        scratch = std::move(free_scratches_.back());
        free_scratches_.pop_back();
      }
    }
    if (!scratch) {
      scratch = std::make_unique<Scratch>(
          Scratch{borders_, std::vector<std::uint32_t>(surface_.triangles.size())});
    }
    mark_edges(node, *scratch, true);
    return scratch;
  }

  void release(const Node& node, std::unique_ptr<Scratch> scratch) {
    mark_edges(node, *scratch, false);
    const std::lock_guard lock(mutex_);
    free_scratches_.push_back(std::move(scratch));
  }

  /// For one of the two parts of a cut: the triangle across each side, as in ChartNeighbours.
  static ChartNeighbours neighbours_in_part(const ChartNeighbours& whole,
                                            const std::vector<std::uint8_t>& apart,
                                            std::uint8_t side) {
    std::vector<std::uint32_t> index_in_part(apart.size(), kNoIndex);
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < apart.size(); ++i) {
      if (apart[i] == side) index_in_part[i] = count++;
    }
    ChartNeighbours part;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      if (apart[i / 3] != side) continue;
      part.push_back(whole[i] == kNoIndex ? kNoIndex : index_in_part[whole[i]]);
    }
    return part;
  }

  const ChartSurface& surface_;
  const ChartBorders& borders_;
  std::span<const CutPrice> cut_prices_;
  int threads_;
  std::vector<Node> nodes_;
  std::size_t root_count_ = 0;  ///< Number of roots: the uncut charts, which come first
  std::mutex mutex_;            ///< Guards free_scratches_
  std::vector<std::unique_ptr<Scratch>> free_scratches_;
};

}  // namespace

bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart,
               std::vector<std::uint32_t>& index_in_chart, FlatChart& chart, FlatChart& apart) {
  std::vector<std::uint32_t> opened_edges;
  for (std::uint32_t i = 0; i < chart.source.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t h = 3 * chart.source[i] + k, mate = surface.mate[h];
      if (!borders.is_glued(h) || mate < h || is_apart[i] == is_apart[index_in_chart[mate / 3]])
        continue;
      opened_edges.push_back(h);
    }
  }
  for (const std::uint32_t h : opened_edges) borders.set_glued(h, false);
  FlatChart a = extract_part(surface, borders, chart, is_apart, true, index_in_chart);
  FlatChart b = extract_part(surface, borders, chart, is_apart, false, index_in_chart);
  if (!is_disc(a) || !is_disc(b) || !is_injective(a) || !is_injective(b)) {
    for (const std::uint32_t h : opened_edges) borders.set_glued(h, true);
    return false;
  }
  apart = std::move(a);
  chart = std::move(b);
  return true;
}

std::vector<CutCharts> cut_charts(const ChartSurface& surface, const ChartBorders& borders,
                                  std::span<const CutPrice> prices,
                                  const std::vector<FlatChart>& charts, int threads) {
  CutTree tree(surface, borders, prices, threads);
  tree.run(charts);
  std::vector<CutCharts> result;
  for (std::uint32_t p = 0; p < prices.size(); ++p) result.push_back(tree.charts_for_price(p));
  return result;
}

}  // namespace kiln

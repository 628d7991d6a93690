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

FlatChart part_of(const ChartSurface& surface, const ChartBorders& borders, const FlatChart& whole,
                  const std::vector<std::uint8_t>& is_apart, bool apart,
                  std::vector<std::uint32_t>& local) {
  std::vector<std::uint32_t> triangles, places;
  std::vector<RestShape> rest;
  for (std::uint32_t i = 0; i < is_apart.size(); ++i) {
    if ((is_apart[i] != 0) != apart) continue;
    triangles.push_back(whole.source[i]);
    places.push_back(i);
    rest.push_back(whole.rest[i]);
  }
  FlatChart part = cut_open(surface, triangles, borders.glued(), local, {}, std::move(rest));
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      part.points[part.triangles[i][k]] = whole.points[whole.triangles[places[i]][k]];
    }
  }
  return part;
}

/// A tree of charts and the parts into which they are cut for several CutPrices. A part that results for several of
/// them is a single node.
class CutTree {
 public:
  CutTree(const ChartSurface& surface, const ChartBorders& borders,
          std::span<const CutPrice> prices, int threads)
      : surface_(surface), borders_(borders), prices_(prices), threads_(threads) {}

  void run(std::vector<FlatChart> charts) {
    std::vector<std::uint32_t> local(surface_.triangles.size());
    for (const FlatChart& chart : charts) {
      for (std::uint32_t i = 0; i < chart.source.size(); ++i) local[chart.source[i]] = i;
    }
    std::vector<std::uint32_t> all_prices(prices_.size());
    std::iota(all_prices.begin(), all_prices.end(), 0U);
    for (FlatChart& chart : charts) {
      Node node{std::move(chart), {}, all_prices, {}};
      for (const std::uint32_t t : node.chart.source) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t h = 3 * t + k;
          node.neighbour.push_back(borders_.is_glued(h) ? local[surface_.mate[h] / 3] : kNoIndex);
        }
      }
      nodes_.push_back(std::move(node));
    }
    first_ = nodes_.size();
    for (std::size_t begin = 0; begin < nodes_.size();) {
      const std::size_t end = nodes_.size();
      cut_level(begin, end);
      begin = end;
    }
  }

  CutCharts collect(std::uint32_t price) const {
    std::vector<std::size_t> ids(first_);
    std::iota(ids.begin(), ids.end(), std::size_t{0});
    for (std::size_t i = 0; i < ids.size();) {
      const Split* const split = split_at(nodes_[ids[i]], price);
      if (split == nullptr) {
        ++i;
        continue;
      }
      ids.push_back(split->apart);
      ids[i] = split->rest;
    }
    CutCharts result{borders_.glued(), {}};
    std::vector<std::size_t> owner(surface_.triangles.size());
    for (const std::size_t id : ids) {
      for (const std::uint32_t t : nodes_[id].chart.source) owner[t] = id;
      result.charts.push_back(nodes_[id].chart);
    }
    for (std::uint32_t h = 0; h < surface_.mate.size(); ++h) {
      if (result.glued[h] != 0 && owner[h / 3] != owner[surface_.mate[h] / 3]) result.glued[h] = 0;
    }
    return result;
  }

 private:
  /// A cut and the prices that choose it; node indices of both parts.
  struct Split {
    std::vector<std::uint32_t> prices;
    std::size_t rest = 0, apart = 0;
  };
  struct Node {
    FlatChart chart;
    ChartNeighbours neighbour;
    std::vector<std::uint32_t> prices;  ///< Prices whose cuts lead to this part
    std::vector<Split> splits;
  };
  /// Scratch of one thread, with an entry for each half-edge and triangle of the surface.
  struct Scratch {
    ChartBorders borders;
    std::vector<std::uint32_t> local;
  };

  static const Split* split_at(const Node& node, std::uint32_t price) {
    for (const Split& split : node.splits) {
      if (std::find(split.prices.begin(), split.prices.end(), price) != split.prices.end())
        return &split;
    }
    return nullptr;
  }

  /// Cuts the nodes of one tree level, at most once for each price, and appends the parts as new nodes.
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
    const auto look = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const std::size_t n = i / CutShape::kDirections;
        std::vector<CutPrice> prices;
        bool any = false;
        for (const std::uint32_t p : nodes_[begin + n].prices) {
          prices.push_back(prices_[p]);
          any = any || shapes[n]->may_reduce_cost(prices_[p]);
        }
        cuts[i] = any ? shapes[n]->best_cuts(i % CutShape::kDirections, prices)
                      : std::vector<ChartCut>(prices.size());
      }
    };
    parallel_for(cuts.size(), 1, look, threads_);
    std::vector<std::vector<Parts>> parts(count);
    const auto split = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        parts[i] = split_node(nodes_[begin + i], std::span(cuts).subspan(i * CutShape::kDirections,
                                                                         CutShape::kDirections));
      }
    };
    parallel_for(count, 1, split, threads_);
    for (std::size_t i = 0; i < count; ++i) {
      for (Parts& made : parts[i]) {
        nodes_[begin + i].splits.push_back({made.rest.prices, nodes_.size(), nodes_.size() + 1});
        nodes_.push_back(std::move(made.rest));
        nodes_.push_back(std::move(made.apart));
      }
    }
  }

  struct Parts {
    Node rest, apart;
  };

  /// The two parts of each distinct cut that is best at some price, if both parts are discs.
  std::vector<Parts> split_node(const Node& node, std::span<std::vector<ChartCut>> by_direction) {
    std::vector<ChartCut> best(node.prices.size());
    for (std::vector<ChartCut>& cuts : by_direction) {
      for (std::size_t p = 0; p < best.size(); ++p) {
        if (cuts[p].gain > best[p].gain_at(cuts[p].length)) best[p] = std::move(cuts[p]);
      }
    }
    std::vector<Parts> result;
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
      Parts parts{{node.chart, {}, prices, {}}, {{}, {}, prices, {}}};
      const std::vector<std::uint8_t>& apart = best[p].apart;
      const bool done = cut_apart(surface_, scratch->borders, apart, scratch->local,
                                  parts.rest.chart, parts.apart.chart);
      mark(node, *scratch, true);
      if (!done) continue;
      parts.rest.neighbour = part_of(node.neighbour, apart, 0);
      parts.apart.neighbour = part_of(node.neighbour, apart, 1);
      result.push_back(std::move(parts));
    }
    if (scratch) release(node, std::move(scratch));
    return result;
  }

  /// Sets a scratch's glued edges for a node. \param apart  true: opens edges to other nodes; false: restores borders_
  void mark(const Node& node, Scratch& scratch, bool apart) const {
    for (std::uint32_t i = 0; i < node.chart.source.size(); ++i) {
      scratch.local[node.chart.source[i]] = i;
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
      if (!free_.empty()) {
        scratch = std::move(free_.back());
        free_.pop_back();
      }
    }
    if (!scratch) {
      scratch = std::make_unique<Scratch>(
          Scratch{borders_, std::vector<std::uint32_t>(surface_.triangles.size())});
    }
    mark(node, *scratch, true);
    return scratch;
  }

  void release(const Node& node, std::unique_ptr<Scratch> scratch) {
    mark(node, *scratch, false);
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(scratch));
  }

  /// Neighbours within one of two parts.
  static ChartNeighbours part_of(const ChartNeighbours& whole,
                                 const std::vector<std::uint8_t>& apart, std::uint8_t side) {
    std::vector<std::uint32_t> place(apart.size(), kNoIndex);
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < apart.size(); ++i) {
      if (apart[i] == side) place[i] = count++;
    }
    ChartNeighbours part;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      if (apart[i / 3] != side) continue;
      part.push_back(whole[i] == kNoIndex ? kNoIndex : place[whole[i]]);
    }
    return part;
  }

  const ChartSurface& surface_;
  const ChartBorders& borders_;
  std::span<const CutPrice> prices_;
  int threads_;
  std::vector<Node> nodes_;
  std::size_t first_ = 0;  ///< Index of the first node that is an uncut chart
  std::mutex mutex_;       ///< Guards the members below.
  std::vector<std::unique_ptr<Scratch>> free_;
};

}  // namespace

bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart, std::vector<std::uint32_t>& local,
               FlatChart& chart, FlatChart& apart) {
  std::vector<std::uint32_t> opened_edges;
  for (std::uint32_t i = 0; i < chart.source.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t h = 3 * chart.source[i] + k, mate = surface.mate[h];
      if (!borders.is_glued(h) || mate < h || is_apart[i] == is_apart[local[mate / 3]]) continue;
      opened_edges.push_back(h);
    }
  }
  for (const std::uint32_t h : opened_edges) borders.set_glued(h, false);
  FlatChart a = part_of(surface, borders, chart, is_apart, true, local);
  FlatChart b = part_of(surface, borders, chart, is_apart, false, local);
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
  for (std::uint32_t p = 0; p < prices.size(); ++p) result.push_back(tree.collect(p));
  return result;
}

}  // namespace kiln

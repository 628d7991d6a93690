#include "lowpoly/chart_cut_search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "lowpoly/pairing.h"

namespace kiln {
namespace {

/// Lines tried across each.
constexpr int kLines = 13;
/// Boxes of parts are hardly smaller, times the area; what could not gain even then is not looked at.
constexpr double kLeastBox = 1.1;
/// A part is at least this share of its chart.
constexpr double kLeastShare = 0.01;

using Extents = CutShape::Extents;

/// The best cut along lines across one direction. The lines make bands of triangles; what hangs together in
/// a band is a node. Each line is then tried on the few nodes.
class Sweep {
 public:
  Sweep(const CutShape& shape, std::span<const CutPrice> prices)
      : shape_(shape),
        prices_(prices),
        count_(static_cast<std::uint32_t>(shape.chart.triangles.size())),
        apart_(prices.size()),
        best_(prices.size()) {}

  std::vector<ChartCut> run(std::size_t direction) {
    find_nodes(direction);
    find_links();
    for (int line = 1; line <= kLines; ++line) look(line);
    for (std::size_t p = 0; p < best_.size(); ++p) {
      if (best_[p].gain <= 0) continue;
      best_[p].apart.resize(count_);
      for (std::uint32_t i = 0; i < count_; ++i) best_[p].apart[i] = apart_[p][node_of_[i]];
    }
    return std::move(best_);
  }

 private:
  /// Connected triangles of one band.
  struct Node {
    int band = 0;
    double area = 0;
  };
  /// The edges between two nodes.
  struct Link {
    std::uint32_t a = 0, b = 0;
    double length = 0;
  };
  /// Connected nodes on one side of a line.
  struct Part {
    std::uint32_t neighbour = kNoIndex;
    bool leaf = true;   ///< Next to one other part alone.
    double length = 0;  ///< Of its edges to others.
    double area = 0;
  };

  void find_nodes(std::size_t direction) {
    const double low = shape_.whole.low[direction], high = shape_.whole.high[direction];
    const double bands = high > low ? (kLines + 1) / (high - low) : 0;
    std::vector<int> band(count_);
    for (std::uint32_t i = 0; i < count_; ++i) {
      const Triangle& t = shape_.chart.triangles[i];
      const std::vector<CutShape::Along>& along = shape_.along;
      const double across =
          (along[t[0]][direction] + along[t[1]][direction] + along[t[2]][direction]) / 3;
      band[i] = static_cast<int>((across - low) * bands);
    }
    node_of_.assign(count_, kNoIndex);
    std::vector<std::uint32_t> stack;
    for (std::uint32_t seed = 0; seed < count_; ++seed) {
      if (node_of_[seed] != kNoIndex) continue;
      const auto id = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back({band[seed], 0});
      stack.assign(1, seed);
      node_of_[seed] = id;
      while (!stack.empty()) {
        const std::uint32_t i = stack.back();
        stack.pop_back();
        nodes_[id].area += shape_.chart.rest[i].area;
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t n = shape_.neighbour[3 * i + k];
          if (n == kNoIndex || node_of_[n] != kNoIndex || band[n] != band[seed]) continue;
          node_of_[n] = id;
          stack.push_back(n);
        }
      }
    }
  }

  void find_links() {
    std::vector<Link> edges;
    for (std::uint32_t i = 0; i < count_; ++i) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t n = shape_.neighbour[3 * i + k];
        if (n == kNoIndex || node_of_[n] == node_of_[i]) continue;
        if (rim_.empty() || rim_.back() != i) rim_.push_back(i);
        if (node_of_[i] < node_of_[n]) {
          edges.push_back({node_of_[i], node_of_[n], shape_.length[3 * i + k]});
        }
      }
    }
    std::stable_sort(edges.begin(), edges.end(), [](const Link& a, const Link& b) {
      return std::tie(a.a, a.b) < std::tie(b.a, b.b);
    });
    for (const Link& edge : edges) {
      if (links_.empty() || links_.back().a != edge.a || links_.back().b != edge.b) {
        links_.push_back({edge.a, edge.b, 0});
      }
      links_.back().length += edge.length;
    }
  }

  void look(int line) {
    const auto is_low = [&](std::uint32_t node) { return nodes_[node].band < line; };
    part_.resize(nodes_.size());
    std::iota(part_.begin(), part_.end(), 0U);
    const auto find = [&](std::uint32_t node) {
      while (part_[node] != node) node = part_[node] = part_[part_[node]];
      return node;
    };
    for (const Link& link : links_) {
      if (is_low(link.a) != is_low(link.b)) continue;
      const std::uint32_t a = find(link.a), b = find(link.b);
      part_[std::max(a, b)] = std::min(a, b);
    }
    parts_.assign(nodes_.size(), {});
    std::size_t count = 0;
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      part_[n] = find(n);
      count += part_[n] == n;
      parts_[part_[n]].area += nodes_[n].area;
    }
    if (count < 2) return;
    for (const Link& link : links_) {
      const std::uint32_t a = part_[link.a], b = part_[link.b];
      if (a == b) continue;
      for (const auto& [one, other] : {std::pair{a, b}, std::pair{b, a}}) {
        Part& part = parts_[one];
        part.leaf = part.leaf && (part.neighbour == kNoIndex || part.neighbour == other);
        part.neighbour = other;
        part.length += link.length;
      }
    }
    for (std::uint32_t p = 0; p < parts_.size(); ++p) {
      if (part_[p] == p && parts_[p].leaf) consider(p);
    }
  }

  void consider(std::uint32_t p) {
    const Part& part = parts_[p];
    const double rest = shape_.area - part.area;
    double boxes = -1;  // Of both parts; found when first needed.
    for (std::size_t n = 0; n < prices_.size(); ++n) {
      const CutPrice& price = prices_[n];
      ChartCut& best = best_[n];
      if (std::min(part.area, rest) < std::max(price.least, kLeastShare * shape_.area)) continue;
      const double cost =
          part.length * (2 * price.margin + price.seam) - 2 * price.size * part.area * rest;
      const double worth = best.gain_at(part.length);
      if (shape_.box - kLeastBox * shape_.area - cost <= worth) continue;
      if (boxes < 0) boxes = boxes_of(p);
      const double gain = shape_.box - boxes - cost;
      if (gain <= worth) continue;
      best.gain = gain;
      best.length = part.length;
      apart_[n].resize(nodes_.size());
      for (std::uint32_t i = 0; i < nodes_.size(); ++i) apart_[n][i] = part_[i] == p;
    }
  }

  /// The smallest upright boxes of a part and of the rest, added.
  double boxes_of(std::uint32_t p) {
    if (extents_.empty()) find_extents();
    Extents inside, outside;
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      (part_[n] == p ? inside : outside).add(extents_[n].low, extents_[n].high);
    }
    return inside.smallest_box() + outside.smallest_box();
  }

  /// Of all nodes in one pass: nothing inside a node reaches farther than its border.
  void find_extents() {
    extents_.assign(nodes_.size(), {});
    for (const std::vector<std::uint32_t>& border :
         {std::cref(shape_.rim), std::cref(std::as_const(rim_))}) {
      for (const std::uint32_t i : border) {
        for (const std::uint32_t v : shape_.chart.triangles[i]) {
          extents_[node_of_[i]].add(shape_.along[v], shape_.along[v]);
        }
      }
    }
  }

  const CutShape& shape_;
  std::span<const CutPrice> prices_;
  std::uint32_t count_;
  std::vector<std::uint32_t> node_of_;  ///< Of each triangle.
  std::vector<Node> nodes_;
  std::vector<Link> links_;
  std::vector<Extents> extents_;     ///< Of each node; empty until one is needed.
  std::vector<std::uint32_t> rim_;   ///< Triangles at borders of nodes.
  std::vector<std::uint32_t> part_;  ///< Of each node: the first node of its part.
  std::vector<Part> parts_;
  std::vector<std::vector<std::uint8_t>> apart_;  ///< At each price, per node, for the best cut.
  std::vector<ChartCut> best_;
};

}  // namespace

CutShape::Extents::Extents() {
  low.fill(std::numeric_limits<double>::max());
  high.fill(-std::numeric_limits<double>::max());
}

void CutShape::Extents::add(const Along& least, const Along& most) {
  for (std::size_t d = 0; d < kDirections; ++d) {
    low[d] = std::min(low[d], least[d]);
    high[d] = std::max(high[d], most[d]);
  }
}

double CutShape::Extents::smallest_box() const {
  double least = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < kDirections / 2; ++k) {
    const std::size_t across = k + kDirections / 2;
    least = std::min(least, (high[k] - low[k]) * (high[across] - low[across]));
  }
  return least;
}

CutShape::CutShape(const ChartSurface& surface, const FlatChart& given,
                   const ChartNeighbours& beside)
    : chart(given), neighbour(beside), length(beside.size()), along(given.points.size()) {
  for (std::size_t i = 0; i < chart.source.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      length[3 * i + k] = surface.length[3 * std::size_t{chart.source[i]} + k];
    }
    area += chart.rest[i].area;
  }
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double angle = static_cast<double>(d) * std::numbers::pi / kDirections;
    const FlatPoint to{std::cos(angle), std::sin(angle)};
    for (std::size_t v = 0; v < along.size(); ++v) along[v][d] = dot(to, chart.points[v]);
  }
  std::vector<std::uint8_t> open(chart.points.size(), 0);
  for (const std::uint32_t v : chart.boundary) {
    open[v] = 1;
    whole.add(along[v], along[v]);
  }
  for (std::uint32_t i = 0; i < chart.triangles.size(); ++i) {
    const Triangle& t = chart.triangles[i];
    if (open[t[0]] != 0 || open[t[1]] != 0 || open[t[2]] != 0) rim.push_back(i);
  }
  box = whole.smallest_box();
}

std::vector<ChartCut> CutShape::best_cuts(std::size_t direction,
                                          std::span<const CutPrice> prices) const {
  return Sweep(*this, prices).run(direction);
}

}  // namespace kiln

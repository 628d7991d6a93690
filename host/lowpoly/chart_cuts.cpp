#include "lowpoly/chart_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "lowpoly/pairing.h"

namespace kiln {
namespace {

/// Directions in half a turn; boxes are upright along each two that are square to each other.
constexpr std::size_t kDirections = 16;
/// Lines tried across each.
constexpr int kLines = 13;
/// Boxes of parts are hardly smaller, times the area; what could not gain even then is not looked at.
constexpr double kLeastBox = 1.1;
/// A part is at least this share of its chart.
constexpr double kLeastShare = 0.01;

/// Of points along each direction.
using Along = std::array<double, kDirections>;

/// What points span along each direction.
struct Extents {
  Along low, high;
  Extents() {
    low.fill(std::numeric_limits<double>::max());
    high.fill(-std::numeric_limits<double>::max());
  }
  void add(const Along& least, const Along& most) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      low[d] = std::min(low[d], least[d]);
      high[d] = std::max(high[d], most[d]);
    }
  }
};

double smallest_box(const Extents& extents) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < kDirections / 2; ++k) {
    const std::size_t across = k + kDirections / 2;
    least = std::min(
        least, (extents.high[k] - extents.low[k]) * (extents.high[across] - extents.low[across]));
  }
  return least;
}

struct Cut {
  double gain = 0, length = 0;
  std::vector<std::uint8_t>
      apart;  ///< Per triangle of the chart: whether it is of the part cut off.
  /// What a cut of another length must gain to be better.
  double gain_at(double other) const { return gain > 0 ? gain / length * other : 0; }
};

/// A chart as the search sees it.
struct Shape {
  Shape(const ChartSurface& surface, const ChartBorders& borders, const FlatChart& given,
        std::vector<std::uint32_t>& local)
      : chart(given), neighbour(given.triangles.size() * 3, kNoIndex), length(neighbour.size()) {
    const auto count = static_cast<std::uint32_t>(chart.triangles.size());
    for (std::uint32_t i = 0; i < count; ++i) local[chart.source[i]] = i;
    for (std::uint32_t i = 0; i < count; ++i) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t h = 3 * chart.source[i] + k;
        length[3 * i + k] = surface.length[h];
        if (borders.is_glued(h)) neighbour[3 * i + k] = local[surface.mate[h] / 3];
      }
      area += chart.rest[i].area;
    }
    along.resize(chart.points.size());
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
    for (std::uint32_t i = 0; i < count; ++i) {
      const Triangle& t = chart.triangles[i];
      if (open[t[0]] != 0 || open[t[1]] != 0 || open[t[2]] != 0) rim.push_back(i);
    }
    box = smallest_box(whole);
  }

  const FlatChart& chart;
  std::vector<std::uint32_t> neighbour;  ///< Over each side of each triangle.
  std::vector<double> length;            ///< Of each side.
  std::vector<std::uint32_t> rim;        ///< Triangles at the chart's border.
  std::vector<Along> along;              ///< Of each vertex.
  Extents whole;
  double area = 0, box = 0;
};

/// The best cut along lines across one direction. The lines make bands of triangles; what hangs together in
/// a band is a node. Each line is then tried on the few nodes.
class Sweep {
 public:
  Sweep(const Shape& shape, const CutPrice& price)
      : shape_(shape),
        price_(price),
        count_(static_cast<std::uint32_t>(shape.chart.triangles.size())) {}

  Cut run(std::size_t direction) {
    find_nodes(direction);
    find_links();
    for (int line = 1; line <= kLines; ++line) look(line);
    if (best_.gain > 0) {
      best_.apart.resize(count_);
      for (std::uint32_t i = 0; i < count_; ++i) best_.apart[i] = apart_[node_of_[i]];
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
    std::array<double, kLines> lines{};
    for (int line = 1; line <= kLines; ++line) {
      lines[static_cast<std::size_t>(line) - 1] = low + (high - low) * line / (kLines + 1);
    }
    std::vector<int> band(count_);
    for (std::uint32_t i = 0; i < count_; ++i) {
      const Triangle& t = shape_.chart.triangles[i];
      const std::vector<Along>& along = shape_.along;
      const double across =
          (along[t[0]][direction] + along[t[1]][direction] + along[t[2]][direction]) / 3;
      for (const double line : lines) band[i] += across < line ? 0 : 1;
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
    if (std::min(part.area, rest) < std::max(price_.least, kLeastShare * shape_.area)) return;
    const double cost =
        part.length * (2 * price_.margin + price_.seam) - 2 * price_.size * part.area * rest;
    if (shape_.box - kLeastBox * shape_.area - cost <= best_.gain_at(part.length)) return;
    if (extents_.empty()) find_extents();
    Extents inside, outside;
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      (part_[n] == p ? inside : outside).add(extents_[n].low, extents_[n].high);
    }
    const double gain = shape_.box - smallest_box(inside) - smallest_box(outside) - cost;
    if (gain <= best_.gain_at(part.length)) return;
    best_.gain = gain;
    best_.length = part.length;
    apart_.resize(nodes_.size());
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) apart_[n] = part_[n] == p;
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

  const Shape& shape_;
  const CutPrice& price_;
  std::uint32_t count_;
  std::vector<std::uint32_t> node_of_;  ///< Of each triangle.
  std::vector<Node> nodes_;
  std::vector<Link> links_;
  std::vector<Extents> extents_;     ///< Of each node; empty until one is needed.
  std::vector<std::uint32_t> rim_;   ///< Triangles at borders of nodes.
  std::vector<std::uint32_t> part_;  ///< Of each node: the first node of its part.
  std::vector<Part> parts_;
  std::vector<std::uint8_t> apart_;  ///< Per node, for the best cut.
  Cut best_;
};

Cut best_cut(const Shape& shape, const CutPrice& price, int threads) {
  std::array<Cut, kDirections> cuts;
  const auto sweep = [&](std::size_t begin, std::size_t end) {
    for (std::size_t d = begin; d < end; ++d) cuts[d] = Sweep(shape, price).run(d);
  };
  parallel_for(kDirections, shape.chart.triangles.size() < 64 ? kDirections : 1, sweep, threads);
  Cut best;
  for (Cut& cut : cuts) {
    if (cut.gain > best.gain_at(cut.length)) best = std::move(cut);
  }
  return best;
}

/// Whether the triangles hang together without a hole: what is open is one ring.
bool is_disc(const FlatChart& chart) {
  return 2 * chart.points.size() == 2 + chart.triangles.size() + chart.boundary.size();
}

FlatChart part_of(const ChartSurface& surface, const ChartBorders& borders, const FlatChart& whole,
                  const std::vector<std::uint8_t>& is_apart, bool apart,
                  std::vector<std::uint32_t>& local) {
  std::vector<std::uint32_t> triangles, places;
  for (std::uint32_t i = 0; i < is_apart.size(); ++i) {
    if ((is_apart[i] != 0) != apart) continue;
    triangles.push_back(whole.source[i]);
    places.push_back(i);
  }
  FlatChart part = cut_open(surface, triangles, borders.glued(), local);
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      part.points[part.triangles[i][k]] = whole.points[whole.triangles[places[i]][k]];
    }
  }
  return part;
}

/// Cuts a chart in two where that is worth it. \returns whether it was
bool cut_in_two(const ChartSurface& surface, ChartBorders& borders, const CutPrice& price,
                std::vector<std::uint32_t>& local, int threads, FlatChart& chart,
                FlatChart& apart) {
  const Cut cut = best_cut(Shape(surface, borders, chart, local), price, threads);
  return cut.gain > 0 && cut_apart(surface, borders, cut.apart, local, chart, apart);
}

}  // namespace

bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart, std::vector<std::uint32_t>& local,
               FlatChart& chart, FlatChart& apart) {
  std::vector<std::uint32_t> opened;
  for (std::uint32_t i = 0; i < chart.source.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t h = 3 * chart.source[i] + k, mate = surface.mate[h];
      if (!borders.is_glued(h) || mate < h || is_apart[i] == is_apart[local[mate / 3]]) continue;
      opened.push_back(h);
    }
  }
  for (const std::uint32_t h : opened) borders.set_glued(h, false);
  FlatChart a = part_of(surface, borders, chart, is_apart, true, local);
  FlatChart b = part_of(surface, borders, chart, is_apart, false, local);
  if (!is_disc(a) || !is_disc(b) || !is_injective(a) || !is_injective(b)) {
    for (const std::uint32_t h : opened) borders.set_glued(h, true);
    return false;
  }
  apart = std::move(a);
  chart = std::move(b);
  return true;
}

void cut_charts(const ChartSurface& surface, ChartBorders& borders, const CutPrice& price,
                std::vector<FlatChart>& charts, int threads) {
  std::vector<std::uint32_t> local(surface.triangles.size());
  for (std::size_t i = 0; i < charts.size();) {
    FlatChart apart;
    if (cut_in_two(surface, borders, price, local, threads, charts[i], apart)) {
      charts.push_back(std::move(apart));
    } else {
      ++i;
    }
  }
}

}  // namespace kiln

#include "lowpoly/chart_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/parallel.h"
#include "lowpoly/pairing.h"

namespace kiln {
namespace {

/// Directions in half a turn; boxes are upright along each two that are square to each other.
constexpr std::size_t directions = 16;
/// Lines tried across each.
constexpr int lines = 11;
/// A part is at least this share of its chart.
constexpr double least_share = 0.01;

using Extents = std::array<std::pair<double, double>, directions>;

Extents no_extents() {
  constexpr double most = std::numeric_limits<double>::max();
  Extents extents;
  extents.fill({most, -most});
  return extents;
}

double smallest_box(const Extents& extents) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < directions / 2; ++k) {
    const auto& [low, high] = extents[k];
    const auto& [left, right] = extents[k + directions / 2];
    least = std::min(least, (high - low) * (right - left));
  }
  return least;
}

struct Cut {
  double gain = 0, length = 0;
  std::vector<std::uint8_t>
      apart;  ///< Per triangle of the chart: whether it is of the smaller part.
};

/// Looks for the best cut of one chart.
class Search {
 public:
  Search(const ChartSurface& surface, const ChartBorders& borders, const FlatChart& chart,
         const CutPrice& price, std::vector<std::uint32_t>& local)
      : chart_(chart), price_(price), count_(static_cast<std::uint32_t>(chart.triangles.size())) {
    for (std::uint32_t i = 0; i < count_; ++i) local[chart.source[i]] = i;
    neighbour_.assign(std::size_t{count_} * 3, no_index);
    length_.resize(neighbour_.size());
    for (std::uint32_t i = 0; i < count_; ++i) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t h = 3 * chart.source[i] + k;
        length_[3 * i + k] = surface.length[h];
        if (borders.is_glued(h)) neighbour_[3 * i + k] = local[surface.mate[h] / 3];
      }
    }
    project();
  }

  Cut run() {
    std::vector<double> across(count_);
    for (std::size_t d = 0; d < directions; d += 2) {
      for (std::uint32_t i = 0; i < count_; ++i) {
        across[i] = 0;
        for (const std::uint32_t v : chart_.triangles[i]) across[i] += along_[d][v] / 3;
      }
      const auto& [low, high] = whole_[d];
      for (int line = 1; line <= lines; ++line) {
        look(across, low + (high - low) * line / (lines + 1));
      }
    }
    return std::move(best_);
  }

 private:
  /// Connected triangles on one side of a line.
  struct Part {
    std::uint32_t neighbour = no_index;
    bool leaf = true;   ///< Next to one other part alone.
    double length = 0;  ///< Of its edges to others.
    double area = 0;
  };

  void project() {
    whole_ = no_extents();
    for (std::size_t d = 0; d < directions; ++d) {
      const double angle = static_cast<double>(d) * std::numbers::pi / directions;
      const FlatPoint to{std::cos(angle), std::sin(angle)};
      along_[d].resize(chart_.points.size());
      for (std::size_t v = 0; v < along_[d].size(); ++v) {
        along_[d][v] = dot(to, chart_.points[v]);
        whole_[d].first = std::min(whole_[d].first, along_[d][v]);
        whole_[d].second = std::max(whole_[d].second, along_[d][v]);
      }
    }
    area_ = 0;
    for (const RestShape& rest : chart_.rest) area_ += rest.area;
    box_ = smallest_box(whole_);
  }

  void look(const std::vector<double>& across, double line) {
    part_.assign(count_, no_index);
    parts_.clear();
    for (std::uint32_t seed = 0; seed < count_; ++seed) {
      if (part_[seed] == no_index) spread(across, line, seed);
    }
    for (std::uint32_t i = 0; i < count_; ++i) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t n = neighbour_[3 * i + k];
        if (n == no_index || part_[n] == part_[i]) continue;
        Part& part = parts_[part_[i]];
        part.leaf = part.leaf && (part.neighbour == no_index || part.neighbour == part_[n]);
        part.neighbour = part_[n];
        part.length += length_[3 * i + k];
      }
    }
    for (std::uint32_t p = 0; p < parts_.size(); ++p) {
      if (parts_[p].leaf && parts_.size() > 1) consider(p);
    }
  }

  void spread(const std::vector<double>& across, double line, std::uint32_t seed) {
    const auto id = static_cast<std::uint32_t>(parts_.size());
    const bool side = across[seed] < line;
    Part part;
    stack_.assign(1, seed);
    part_[seed] = id;
    while (!stack_.empty()) {
      const std::uint32_t i = stack_.back();
      stack_.pop_back();
      part.area += chart_.rest[i].area;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t n = neighbour_[3 * i + k];
        if (n == no_index || part_[n] != no_index || (across[n] < line) != side) continue;
        part_[n] = id;
        stack_.push_back(n);
      }
    }
    parts_.push_back(part);
  }

  void consider(std::uint32_t p) {
    const Part& part = parts_[p];
    const double share = std::min(part.area, area_ - part.area);
    if (share < least_share * area_) return;
    const double cost = part.length * (2 * price_.margin + price_.seam);
    if (box_ - area_ - cost <= best_.worth_at(part.length)) return;
    Extents inside = no_extents(), outside = no_extents();
    for (std::uint32_t i = 0; i < count_; ++i) {
      Extents& extents = part_[i] == p ? inside : outside;
      for (std::size_t d = 0; d < directions; ++d) {
        auto& [low, high] = extents[d];
        for (const std::uint32_t v : chart_.triangles[i]) {
          low = std::min(low, along_[d][v]);
          high = std::max(high, along_[d][v]);
        }
      }
    }
    const double gain = box_ - smallest_box(inside) - smallest_box(outside) - cost;
    if (gain <= best_.worth_at(part.length)) return;
    best_.gain = gain;
    best_.length = part.length;
    best_.apart.resize(count_);
    for (std::uint32_t i = 0; i < count_; ++i) best_.apart[i] = part_[i] == p;
  }

  struct Best : Cut {
    /// What a cut of this length must gain to be better.
    double worth_at(double other) const { return gain > 0 ? gain / length * other : 0; }
  };

  const FlatChart& chart_;
  const CutPrice& price_;
  std::uint32_t count_;
  std::vector<std::uint32_t> neighbour_, part_, stack_;
  std::vector<double> length_;
  std::array<std::vector<double>, directions> along_;
  Extents whole_;
  double area_ = 0, box_ = 0;
  std::vector<Part> parts_;
  Best best_;
};

/// Whether the triangles hang together without a hole: what is open is one ring.
bool is_disc(const FlatChart& chart) {
  return 2 * chart.points.size() == 2 + chart.triangles.size() + chart.boundary.size();
}

FlatChart part_of(const ChartSurface& surface, const ChartBorders& borders, const FlatChart& whole,
                  const Cut& cut, bool apart, std::vector<std::uint32_t>& local) {
  std::vector<std::uint32_t> triangles, places;
  for (std::uint32_t i = 0; i < cut.apart.size(); ++i) {
    if ((cut.apart[i] != 0) != apart) continue;
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

/// Cuts one chart in two where that is worth it. \returns whether it was
bool cut_in_two(const ChartSurface& surface, ChartBorders& borders, const CutPrice& price,
                std::vector<std::uint32_t>& local, FlatChart& chart, FlatChart& apart) {
  const Cut cut = Search(surface, borders, chart, price, local).run();
  if (!(cut.gain > 0)) return false;
  std::vector<std::uint32_t> opened;
  for (std::uint32_t i = 0; i < chart.source.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t h = 3 * chart.source[i] + k, mate = surface.mate[h];
      if (!borders.is_glued(h) || mate < h || cut.apart[i] == cut.apart[local[mate / 3]]) continue;
      opened.push_back(h);
    }
  }
  for (const std::uint32_t h : opened) borders.set_glued(h, false);
  FlatChart a = part_of(surface, borders, chart, cut, true, local);
  FlatChart b = part_of(surface, borders, chart, cut, false, local);
  if (!is_disc(a) || !is_disc(b) || !is_injective(a) || !is_injective(b)) {
    for (const std::uint32_t h : opened) borders.set_glued(h, true);
    return false;
  }
  apart = std::move(a);
  chart = std::move(b);
  return true;
}

}  // namespace

void cut_charts(const ChartSurface& surface, ChartBorders& borders, const CutPrice& price,
                std::vector<FlatChart>& charts, int threads) {
  // Charts share no triangle: each has entries of its own here and in the borders.
  std::vector<std::uint32_t> local(surface.triangles.size());
  std::vector<std::vector<FlatChart>> parts(charts.size());
  const auto cut = [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      parts[c].push_back(std::move(charts[c]));
      for (std::size_t i = 0; i < parts[c].size();) {
        FlatChart apart;
        if (!cut_in_two(surface, borders, price, local, parts[c][i], apart)) {
          ++i;
        } else {
          parts[c].push_back(std::move(apart));
        }
      }
    }
  };
  parallel_for(charts.size(), 1, cut, threads);
  charts.clear();
  for (auto& list : parts) {
    for (FlatChart& chart : list) charts.push_back(std::move(chart));
  }
}

}  // namespace kiln

#include "unwrap/straighten_seams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/progress_guard.h"
#include "mesh/half_edge.h"
#include "unwrap/flat_predicates.h"

namespace kiln {
namespace {

/// Maximum number of sweeps over the seams, which normally converge earlier.
constexpr int kMaxSweeps = 16;
/// A move that replaces two edges by two others must shorten the seam by this factor.
constexpr double kMaxLengthRatio = 0.97;

bool boxes_apart(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d) {
  return std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
         std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y);
}

class Trimmer {
 public:
  Trimmer(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
          const std::vector<FlatChart>& charts)
      : surface_(surface),
        borders_(borders),
        limits_(limits),
        label_(surface.triangles.size()),
        rest_(surface.triangles.size()),
        corner_(surface.mate.size()) {
    trace();
    for (std::uint32_t c = 0; c < charts.size(); ++c) {
      const FlatChart& chart = charts[c];
      for (std::size_t i = 0; i < chart.source.size(); ++i) {
        label_[chart.source[i]] = c;
        rest_[chart.source[i]] = chart.rest[i];
        for (std::uint32_t k = 0; k < 3; ++k) {
          corner_[3 * chart.source[i] + k] = chart.points[chart.triangles[i][k]];
        }
      }
    }
  }
  /// Constructor for charts without a layout.
  Trimmer(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
          std::vector<std::uint32_t> label)
      : surface_(surface), borders_(borders), limits_(limits), label_(std::move(label)) {
    trace();
  }

  void run() {
    // All sweeps first move triangles in one direction across seams, then in the other. Mixing both directions would
    // leave steps in the seam that neither direction can remove.
    bool last = true;
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
      ProgressGuard::poll();
      forward_ = sweep % 2 == 0;
      bool any = false;
      for (std::uint32_t h = 0; h < surface_.mate.size(); ++h) {
        if (!borders_.is_glued(h) && move(h)) any = moved_ = true;
      }
      if (!any && !last) return;
      last = any;
    }
  }

  bool moved() const { return moved_; }
  std::vector<std::uint32_t> label() && { return std::move(label_); }

  std::vector<FlatChart> charts(std::size_t count) const {
    std::vector<std::vector<std::uint32_t>> triangles(count);
    for (std::uint32_t t = 0; t < label_.size(); ++t) triangles[label_[t]].push_back(t);
    std::vector<std::uint32_t> local(label_.size());
    std::vector<FlatChart> result;
    for (const auto& of_chart : triangles) {
      std::vector<RestShape> rest;
      rest.reserve(of_chart.size());
      for (const std::uint32_t t : of_chart) rest.push_back(rest_[t]);
      FlatChart chart = cut_open(surface_, of_chart, borders_.glued(), local, {}, std::move(rest));
      for (std::size_t i = 0; i < of_chart.size(); ++i) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          chart.points[chart.triangles[i][k]] = corner_[3 * of_chart[i] + k];
        }
      }
      result.push_back(std::move(chart));
    }
    return result;
  }

 private:
  void trace() {
    std::vector<std::uint8_t> is_visited(surface_.mate.size(), 0);
    for (std::uint32_t h = 0; h < is_visited.size(); ++h) {
      if (borders_.is_glued(h) || is_visited[h] != 0) continue;
      borders_.trace(h);
      for (std::uint32_t n = h; is_visited[n] == 0; n = borders_.next(n)) is_visited[n] = 1;
    }
  }

  bool is_flat() const { return !corner_.empty(); }

  /// A possible move: the one or two triangles around a vertex between two half-edges of a seam.
  struct Fan {
    std::array<std::uint32_t, 2> inside{};  ///< Half-edges of the triangles that end at the vertex
    std::array<std::uint32_t, 2> outer{};   ///< Opposite half-edges, which become border
    std::uint32_t count = 0;
    /// Positions in the new chart. `apex` is the shared corner of two triangles.
    Vec2d tip{}, first{}, last{}, apex{};
  };

  /// Tries to move the triangles at seam half-edge h and the next one to the other chart.
  /// \returns true if they were moved
  bool move(std::uint32_t h) {
    const std::uint32_t g = borders_.next(h), mate = surface_.mate[h], over = surface_.mate[g];
    if (mate == kNoIndex || over == kNoIndex || borders_.next(over) != mate) return false;
    const std::uint32_t from = label_[h / 3], to = label_[mate / 3];
    if (label_[over / 3] != to) return false;
    if (from == to ? is_flat() || is_end(h, g) : (from < to) != forward_) return false;
    Fan fan;
    if (!gather(h, g, fan) || !is_shorter(h, g, fan)) return false;
    if (is_narrow(over, mate)) return false;
    if (is_flat()) {
      lay_out_fan(h, g, fan);
      if (!fits(fan) || !is_clear(over, mate, fan)) return false;
    }
    move_to_other_chart(h, g, fan);
    return true;
  }

  /// True if a seam within one chart ends at these half-edges.
  bool is_end(std::uint32_t h, std::uint32_t g) const {
    return borders_.next(g) == surface_.mate[g] || borders_.previous(h) == surface_.mate[h];
  }

  /// Collects the triangles of a move.
  /// \returns false if there are more than two, or if their chart would not remain a disc
  bool gather(std::uint32_t h, std::uint32_t g, Fan& fan) const {
    for (std::uint32_t in = h;; in = surface_.mate[next_half_edge(in)]) {
      const std::uint32_t outer = previous_half_edge(in);
      if (fan.count == 2 || !borders_.is_glued(outer)) return false;
      fan.inside[fan.count] = in;
      fan.outer[fan.count++] = outer;
      if (next_half_edge(in) == g) break;
    }
    if (fan.count == 1) return true;
    // The apex must be an inner vertex of its chart.
    const std::uint32_t start = fan.outer[0];
    std::uint32_t at = start;
    do {
      if (!borders_.is_glued(at)) return false;
      at = next_half_edge(surface_.mate[at]);
    } while (at != start);
    return true;
  }

  bool is_shorter(std::uint32_t h, std::uint32_t g, const Fan& fan) const {
    if (fan.count == 1) return true;
    return surface_.length[fan.outer[0]] + surface_.length[fan.outer[1]] <
           kMaxLengthRatio * (surface_.length[h] + surface_.length[g]);
  }

  /// Position of the third corner of triangle h / 3 if its half-edge h goes from a to b.
  Vec2d unfolded(std::uint32_t h, const Vec2d& a, const Vec2d& b) const {
    const double base = surface_.length[h], to_a = surface_.length[previous_half_edge(h)],
                 to_b = surface_.length[next_half_edge(h)];
    const double foot = 0.5 * (1 + (to_a * to_a - to_b * to_b) / (base * base));
    const double height = 2 * surface_.area[h / 3] / (base * base);
    const Vec2d along = b - a;
    return a + along * foot + Vec2d{-along.y, along.x} * height;
  }

  void lay_out_fan(std::uint32_t h, std::uint32_t g, Fan& fan) const {
    fan.last = corner_[surface_.mate[g]];
    fan.tip = corner_[surface_.mate[h]];
    fan.first = corner_[next_half_edge(surface_.mate[h])];
    fan.apex = fan.last;
    if (fan.count == 2) {
      fan.apex = (unfolded(h, fan.first, fan.tip) + unfolded(g, fan.tip, fan.last)) * 0.5;
    }
  }

  /// Corner positions of the fan's triangle i, starting at its half-edge in Fan::inside.
  static std::array<Vec2d, 3> places(const Fan& fan, std::uint32_t i) {
    if (i == 0) return {fan.first, fan.tip, fan.apex};
    return {fan.apex, fan.tip, fan.last};
  }

  bool fits(const Fan& fan) const {
    for (std::uint32_t i = 0; i < fan.count; ++i) {
      const std::array<Vec2d, 3> p = places(fan, i);
      if (!orient2d_certain(p[0], p[1], p[2])) return false;
      const RestShape& rest = rest_[fan.inside[i] / 3];
      Vec2d du{}, dv{};
      for (std::uint32_t k = 0; k < 3; ++k) {
        const Vec2d& gradient = rest.gradient[(fan.inside[i] + k) % 3];
        du = du + gradient * p[k].x;
        dv = dv + gradient * p[k].y;
      }
      const double det = cross(du, dv), squares = dot(du, du) + dot(dv, dv);
      if (!(det > 0)) return false;
      const double most =
          0.5 * (std::sqrt(squares + 2 * det) + std::sqrt(std::max(0.0, squares - 2 * det)));
      if (std::max(most, most / det) > limits_.worst) return false;
    }
    return true;
  }

  /// True if nearly the whole border of the other chart would be glued.
  bool is_narrow(std::uint32_t over, std::uint32_t mate) const {
    const std::uint32_t after = borders_.next(mate);
    return after == over || borders_.next(after) == over;
  }

  /// True if the other chart's border stays simple.
  bool is_clear(std::uint32_t over, std::uint32_t mate, const Fan& fan) const {
    std::array<Vec2d, 3> path{fan.last, fan.apex, fan.first};
    if (fan.count == 1) path[1] = fan.first;
    const std::uint32_t pieces = fan.count;
    const auto folds = [](const Vec2d& a, const Vec2d& b, const Vec2d& c) {
      return !orient2d_certain(a, b, c) && !orient2d_certain(a, c, b) && dot(b - a, c - b) <= 0;
    };
    const std::uint32_t before = borders_.previous(over), after = borders_.next(mate);
    if (pieces == 2 && folds(path[0], path[1], path[2])) return false;
    if (folds(corner_[before], path[0], path[1])) return false;
    if (folds(path[pieces - 1], path[pieces], corner_[next_half_edge(after)])) return false;
    for (std::uint32_t r = after; r != over; r = borders_.next(r)) {
      const Vec2d &a = corner_[r], &b = corner_[next_half_edge(r)];
      for (std::uint32_t i = 0; i < pieces; ++i) {
        if ((r == before && i == 0) || (r == after && i + 1 == pieces)) continue;
        if (boxes_apart(path[i], path[i + 1], a, b)) continue;
        if (!segments_apart_certain(path[i], path[i + 1], a, b)) return false;
      }
    }
    return true;
  }

  void move_to_other_chart(std::uint32_t h, std::uint32_t g, const Fan& fan) {
    const std::uint32_t to = label_[surface_.mate[h] / 3];
    const std::uint32_t before_a = borders_.previous(h), after_a = borders_.next(g);
    const std::uint32_t before_b = borders_.previous(surface_.mate[g]),
                        after_b = borders_.next(surface_.mate[h]);
    borders_.set_glued(h, true);
    borders_.set_glued(g, true);
    std::uint32_t last_a = before_a, last_b = after_b;
    for (std::uint32_t i = 0; i < fan.count; ++i) {
      const std::uint32_t outer = fan.outer[i], t = outer / 3;
      borders_.set_glued(outer, false);
      borders_.connect(last_a, surface_.mate[outer]);
      borders_.connect(outer, last_b);
      last_a = surface_.mate[outer];
      last_b = outer;
      label_[t] = to;
      if (!is_flat()) continue;
      const std::array<Vec2d, 3> p = places(fan, i);
      for (std::uint32_t k = 0; k < 3; ++k) corner_[3 * t + (fan.inside[i] + k) % 3] = p[k];
    }
    borders_.connect(last_a, after_a);
    borders_.connect(before_b, last_b);
  }

  const ChartSurface& surface_;
  ChartBorders& borders_;
  const ChartLimits& limits_;
  std::vector<std::uint32_t> label_;  ///< Chart of each triangle
  /// Rest shape of each triangle; empty for charts without a layout
  std::vector<RestShape> rest_;
  /// Position of each corner in its chart; empty for charts without a layout
  std::vector<Vec2d> corner_;
  bool moved_ = false, forward_ = true;
};

}  // namespace

void straighten_seams(const ChartSurface& surface, ChartBorders& borders,
                      std::vector<std::uint32_t>& label) {
  const ChartLimits limits;
  Trimmer trimmer(surface, borders, limits, std::move(label));
  trimmer.run();
  label = std::move(trimmer).label();
}

void trim_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::vector<FlatChart>& charts) {
  const std::vector<std::uint8_t> before = borders.glued();
  Trimmer trimmer(surface, borders, limits, charts);
  trimmer.run();
  if (!trimmer.moved()) return;
  std::vector<FlatChart> trimmed = trimmer.charts(charts.size());
  // Each move should keep charts injective; the result is checked all the same before it is used.
  if (std::all_of(trimmed.begin(), trimmed.end(),
                  [](const FlatChart& chart) { return is_injective(chart); })) {
    charts = std::move(trimmed);
  } else {
    borders.restore(before);
  }
}

}  // namespace kiln

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

/// Maximum number of sweeps over the seams. Normally the sweeps converge earlier.
constexpr int kMaxSweeps = 16;
/// A move that replaces two seam edges by two others must shorten their length to at most this ratio.
constexpr double kMaxLengthRatio = 0.97;

bool are_boxes_disjoint(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d) {
  return std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
         std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y);
}

class SeamStraightener {
 public:
  SeamStraightener(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                   const std::vector<FlatChart>& charts)
      : surface_(surface),
        borders_(borders),
        limits_(limits),
        chart_of_(surface.triangles.size()),
        rest_shapes_(surface.triangles.size()),
        corner_positions_(surface.mate.size()) {
    trace();
    for (std::uint32_t c = 0; c < charts.size(); ++c) {
      const FlatChart& chart = charts[c];
      for (std::size_t i = 0; i < chart.source.size(); ++i) {
        chart_of_[chart.source[i]] = c;
        rest_shapes_[chart.source[i]] = chart.rest[i];
        for (std::uint32_t k = 0; k < 3; ++k) {
          corner_positions_[3 * chart.source[i] + k] = chart.points[chart.triangles[i][k]];
        }
      }
    }
  }
  /// Constructor for labelled triangles without a layout.
  SeamStraightener(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                   std::vector<std::uint32_t> take_labels)
      : surface_(surface), borders_(borders), limits_(limits), chart_of_(std::move(take_labels)) {
    trace();
  }

  void run() {
    // Each sweep moves triangles across seams in one direction only, and the next sweep in the other. Mixing both
    // directions would leave steps in the seam that neither direction can remove.
    bool moved_in_last_sweep = true;
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
      ProgressGuard::poll();
      is_forward_sweep_ = sweep % 2 == 0;
      bool moved_any = false;
      for (std::uint32_t h = 0; h < surface_.mate.size(); ++h) {
        if (!borders_.is_glued(h) && try_move(h)) moved_any = has_moved_ = true;
      }
      if (!moved_any && !moved_in_last_sweep) return;
      moved_in_last_sweep = moved_any;
    }
  }

  bool has_moved() const { return has_moved_; }
  std::vector<std::uint32_t> take_labels() && { return std::move(chart_of_); }

  std::vector<FlatChart> charts(std::size_t count) const {
    std::vector<std::vector<std::uint32_t>> triangles(count);
    for (std::uint32_t t = 0; t < chart_of_.size(); ++t) triangles[chart_of_[t]].push_back(t);
    std::vector<std::uint32_t> index_in_chart(chart_of_.size());
    std::vector<FlatChart> result;
    for (const auto& chart_triangles : triangles) {
      std::vector<RestShape> rest;
      rest.reserve(chart_triangles.size());
      for (const std::uint32_t t : chart_triangles) rest.push_back(rest_shapes_[t]);
      FlatChart chart = cut_open(surface_, chart_triangles, borders_.glued(), index_in_chart, {},
                                 std::move(rest));
      for (std::size_t i = 0; i < chart_triangles.size(); ++i) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          chart.points[chart.triangles[i][k]] = corner_positions_[3 * chart_triangles[i] + k];
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

  bool has_layout() const { return !corner_positions_.empty(); }

  /// The triangles of a possible move: one or two triangles around a vertex, between two half-edges of a seam.
  struct Fan {
    std::array<std::uint32_t, 2> inside{};  ///< Half-edges of the triangles that end at the vertex
    /// Half-edges opposite the vertex, which become the new border
    std::array<std::uint32_t, 2> outer{};
    std::uint32_t count = 0;
    /// Positions in the layout of the other chart. `apex` is the corner that both triangles share.
    Vec2d tip{}, first{}, last{}, apex{};
  };

  /// Tries to move the triangles between the seam half-edge h and the next seam half-edge to the other chart.
  /// \returns true if they were moved
  bool try_move(std::uint32_t h) {
    const std::uint32_t g = borders_.next(h), mate = surface_.mate[h],
                        mate_of_next = surface_.mate[g];
    if (mate == kNoIndex || mate_of_next == kNoIndex || borders_.next(mate_of_next) != mate)
      return false;
    const std::uint32_t from = chart_of_[h / 3], to = chart_of_[mate / 3];
    if (chart_of_[mate_of_next / 3] != to) return false;
    if (from == to ? has_layout() || ends_inner_seam(h, g) : (from < to) != is_forward_sweep_)
      return false;
    Fan fan;
    if (!collect_fan(h, g, fan) || !shortens_seam(h, g, fan)) return false;
    if (glues_most_of_border(mate_of_next, mate)) return false;
    if (has_layout()) {
      lay_out_fan(h, g, fan);
      if (!fits(fan) || !keeps_border_simple(mate_of_next, mate, fan)) return false;
    }
    move_to_other_chart(h, g, fan);
    return true;
  }

  /// True if a seam within one chart ends at the vertex between these half-edges.
  bool ends_inner_seam(std::uint32_t h, std::uint32_t g) const {
    return borders_.next(g) == surface_.mate[g] || borders_.previous(h) == surface_.mate[h];
  }

  /// Collects the triangles of a move.
  /// \returns false if there are more than two, or if the chart that loses them would not remain a disc
  bool collect_fan(std::uint32_t h, std::uint32_t g, Fan& fan) const {
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

  bool shortens_seam(std::uint32_t h, std::uint32_t g, const Fan& fan) const {
    if (fan.count == 1) return true;
    return surface_.length[fan.outer[0]] + surface_.length[fan.outer[1]] <
           kMaxLengthRatio * (surface_.length[h] + surface_.length[g]);
  }

  /// Position of the third corner of triangle h / 3, unfolded so that half-edge h runs from a to b.
  Vec2d unfold_third_corner(std::uint32_t h, const Vec2d& a, const Vec2d& b) const {
    const double base = surface_.length[h], to_a = surface_.length[previous_half_edge(h)],
                 to_b = surface_.length[next_half_edge(h)];
    const double foot = 0.5 * (1 + (to_a * to_a - to_b * to_b) / (base * base));
    const double height = 2 * surface_.area[h / 3] / (base * base);
    const Vec2d along = b - a;
    return a + along * foot + Vec2d{-along.y, along.x} * height;
  }

  void lay_out_fan(std::uint32_t h, std::uint32_t g, Fan& fan) const {
    fan.last = corner_positions_[surface_.mate[g]];
    fan.tip = corner_positions_[surface_.mate[h]];
    fan.first = corner_positions_[next_half_edge(surface_.mate[h])];
    fan.apex = fan.last;
    if (fan.count == 2) {
      fan.apex =
          (unfold_third_corner(h, fan.first, fan.tip) + unfold_third_corner(g, fan.tip, fan.last)) *
          0.5;
    }
  }

  /// Corner positions of the fan's triangle i, starting at its half-edge in Fan::inside.
  static std::array<Vec2d, 3> fan_corner_positions(const Fan& fan, std::uint32_t i) {
    if (i == 0) return {fan.first, fan.tip, fan.apex};
    return {fan.apex, fan.tip, fan.last};
  }

  bool fits(const Fan& fan) const {
    for (std::uint32_t i = 0; i < fan.count; ++i) {
      const std::array<Vec2d, 3> p = fan_corner_positions(fan, i);
      if (!orient2d_certain(p[0], p[1], p[2])) return false;
      const RestShape& rest = rest_shapes_[fan.inside[i] / 3];
      Vec2d du{}, dv{};
      for (std::uint32_t k = 0; k < 3; ++k) {
        const Vec2d& gradient = rest.gradient[(fan.inside[i] + k) % 3];
        du = du + gradient * p[k].x;
        dv = dv + gradient * p[k].y;
      }
      const double det = cross(du, dv), squares = dot(du, du) + dot(dv, dv);
      if (!(det > 0)) return false;
      const double larger_stretch =
          0.5 * (std::sqrt(squares + 2 * det) + std::sqrt(std::max(0.0, squares - 2 * det)));
      if (std::max(larger_stretch, larger_stretch / det) > limits_.max_stretch) return false;
    }
    return true;
  }

  /// True if the move would glue nearly the whole border of the other chart.
  bool glues_most_of_border(std::uint32_t over, std::uint32_t mate) const {
    const std::uint32_t after = borders_.next(mate);
    return after == over || borders_.next(after) == over;
  }

  /// True if the other chart's border would not touch or cross itself.
  bool keeps_border_simple(std::uint32_t over, std::uint32_t mate, const Fan& fan) const {
    std::array<Vec2d, 3> path{fan.last, fan.apex, fan.first};
    if (fan.count == 1) path[1] = fan.first;
    const std::uint32_t triangle_count = fan.count;
    const auto folds = [](const Vec2d& a, const Vec2d& b, const Vec2d& c) {
      return !orient2d_certain(a, b, c) && !orient2d_certain(a, c, b) && dot(b - a, c - b) <= 0;
    };
    const std::uint32_t before = borders_.previous(over), after = borders_.next(mate);
    if (triangle_count == 2 && folds(path[0], path[1], path[2])) return false;
    if (folds(corner_positions_[before], path[0], path[1])) return false;
    if (folds(path[triangle_count - 1], path[triangle_count],
              corner_positions_[next_half_edge(after)]))
      return false;
    for (std::uint32_t r = after; r != over; r = borders_.next(r)) {
      const Vec2d &a = corner_positions_[r], &b = corner_positions_[next_half_edge(r)];
      for (std::uint32_t i = 0; i < triangle_count; ++i) {
        if ((r == before && i == 0) || (r == after && i + 1 == triangle_count)) continue;
        if (are_boxes_disjoint(path[i], path[i + 1], a, b)) continue;
        if (!segments_apart_certain(path[i], path[i + 1], a, b)) return false;
      }
    }
    return true;
  }

  void move_to_other_chart(std::uint32_t h, std::uint32_t g, const Fan& fan) {
    const std::uint32_t to = chart_of_[surface_.mate[h] / 3];
    const std::uint32_t before_a = borders_.previous(h), after_a = borders_.next(g);
    const std::uint32_t before_b = borders_.previous(surface_.mate[g]),
                        after_b = borders_.next(surface_.mate[h]);
    borders_.set_glued(h, true);
    borders_.set_glued(g, true);
    std::uint32_t last_in_a = before_a, last_in_b = after_b;
    for (std::uint32_t i = 0; i < fan.count; ++i) {
      const std::uint32_t outer = fan.outer[i], t = outer / 3;
      borders_.set_glued(outer, false);
      borders_.connect(last_in_a, surface_.mate[outer]);
      borders_.connect(outer, last_in_b);
      last_in_a = surface_.mate[outer];
      last_in_b = outer;
      chart_of_[t] = to;
      if (!has_layout()) continue;
      const std::array<Vec2d, 3> p = fan_corner_positions(fan, i);
      for (std::uint32_t k = 0; k < 3; ++k)
        corner_positions_[3 * t + (fan.inside[i] + k) % 3] = p[k];
    }
    borders_.connect(last_in_a, after_a);
    borders_.connect(before_b, last_in_b);
  }

  const ChartSurface& surface_;
  ChartBorders& borders_;
  const ChartLimits& limits_;
  std::vector<std::uint32_t> chart_of_;  ///< Chart of each triangle
  /// Rest shape of each triangle; empty for charts without a layout
  std::vector<RestShape> rest_shapes_;
  /// Position of each corner in its chart; empty for charts without a layout
  std::vector<Vec2d> corner_positions_;
  bool has_moved_ = false, is_forward_sweep_ = true;
};

}  // namespace

void straighten_seams(const ChartSurface& surface, ChartBorders& borders,
                      std::vector<std::uint32_t>& take_labels) {
  const ChartLimits limits;
  SeamStraightener straightener(surface, borders, limits, std::move(take_labels));
  straightener.run();
  take_labels = std::move(straightener).take_labels();
}

void trim_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::vector<FlatChart>& charts) {
  const std::vector<std::uint8_t> before = borders.glued();
  SeamStraightener straightener(surface, borders, limits, charts);
  straightener.run();
  if (!straightener.has_moved()) return;
  std::vector<FlatChart> trimmed = straightener.charts(charts.size());
  // Each move should keep charts injective. The final check makes sure before the result is used.
  if (std::all_of(trimmed.begin(), trimmed.end(),
                  [](const FlatChart& chart) { return is_injective(chart); })) {
    charts = std::move(trimmed);
  } else {
    borders.restore(before);
  }
}

}  // namespace kiln

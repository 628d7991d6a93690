#include "lowpoly/chart_growth.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "base/heartbeat.h"
#include "lowpoly/pairing.h"

namespace kiln {
namespace {

/// Patches end where normals vary more than this: 1 - |mean normal|.
constexpr double kPatchVariance = 0.05;
/// The pull of small patches to be merged where nothing bends.
constexpr double kSmallPull = 0.02;

struct Patch {
  std::uint32_t open = 0, border = 3;  ///< A half-edge of its border; how many that has.
  double area = 0;
  Vec3d normal;  ///< Sum of normals by area.
  std::array<std::uint32_t, 2> parts{kNoIndex, kNoIndex};
  std::vector<std::uint32_t> glued;  ///< What joined the parts.
  bool alive = true;
};

double variance(double area, const Vec3d& normal) { return area - length(normal); }

/// Greedy merging; what a merge must fulfil is the caller's.
class Merger {
 public:
  Merger(const ChartSurface& surface, ChartBorders& borders)
      : surface_(surface), borders_(borders), owner_(surface.triangles.size()) {}

  std::uint32_t add(Patch patch) {
    patches_.push_back(std::move(patch));
    root_.push_back(static_cast<std::uint32_t>(root_.size()));
    return root_.back();
  }
  void own(std::uint32_t triangle, std::uint32_t patch) { owner_[triangle] = patch; }
  std::vector<Patch>& patches() { return patches_; }

  /// Merges until no pair is left that may. `fits(area, normal)` is a quick look before a pair queues;
  /// `accept(patch, a, b)` sees the joined patch and may refuse, and then the joint is opened again.
  template <typename Fits, typename Accept>
  void run(const Fits& fits, const Accept& accept) {
    for (std::uint32_t p = 0; p < patches_.size(); ++p) {
      if (patches_[p].alive) propose(p, true, fits);
    }
    while (!queue_.empty()) {
      Heartbeat::beat();
      const Pair pair = queue_.top();
      queue_.pop();
      if (!patches_[pair.a].alive || !patches_[pair.b].alive) continue;
      const Patch &a = patches_[pair.a], &b = patches_[pair.b];
      Patch joined;
      joined.open =
          borders_.glue(borders_.run_through(pair.half_edge), a.border, b.border, joined.glued);
      if (joined.open == kNoIndex) continue;
      joined.border = a.border + b.border - 2 * static_cast<std::uint32_t>(joined.glued.size());
      joined.area = a.area + b.area;
      joined.normal = a.normal + b.normal;
      joined.parts = {pair.a, pair.b};
      if (!accept(joined, pair.a, pair.b)) {
        borders_.unglue(joined.glued);
        continue;
      }
      patches_[pair.a].alive = patches_[pair.b].alive = false;
      const std::uint32_t id = add(std::move(joined));
      root_[pair.a] = root_[pair.b] = id;
      propose(id, false, fits);
    }
  }

 private:
  struct Pair {
    double cost = 0;
    std::uint32_t a = 0, b = 0, half_edge = 0;
    bool operator<(const Pair& other) const {  // The cheapest on top.
      return std::tie(cost, a, b) > std::tie(other.cost, other.a, other.b);
    }
  };

  std::uint32_t owner(std::uint32_t half_edge) {
    std::uint32_t p = owner_[half_edge / 3];
    while (root_[p] != p) p = root_[p] = root_[root_[p]];
    return p;
  }

  /// Queues a patch with each of its neighbours, over the longest run they share.
  template <typename Fits>
  void propose(std::uint32_t p, bool later_only, const Fits& fits) {
    std::vector<std::pair<std::uint32_t, ChartBorders::Run>> best;
    const std::uint32_t open = patches_[p].open;
    std::uint32_t h = open;
    const auto look = [&](std::uint32_t half_edge) {
      const ChartBorders::Run run = borders_.run_through(half_edge);
      const std::uint32_t other = owner(surface_.mate[half_edge]);
      for (auto& [neighbour, longest] : best) {
        if (neighbour != other) continue;
        if (run.length > longest.length) longest = run;
        return;
      }
      best.push_back({other, run});
    };
    bool any = false;
    std::uint32_t last_shared = kNoIndex;
    do {
      const std::uint32_t m = surface_.mate[h];
      if (m != kNoIndex && owner(m) != p) {
        last_shared = h;
        const std::uint32_t before = borders_.previous(h);
        const bool goes_on =
            surface_.mate[before] != kNoIndex && borders_.next(m) == surface_.mate[before];
        if (!goes_on) look(h), any = true;
      }
      h = borders_.next(h);
    } while (h != open);
    if (!any && last_shared != kNoIndex) look(last_shared);
    const Patch& patch = patches_[p];
    for (const auto& [other, run] : best) {
      if (later_only && other < p) continue;
      const Patch& neighbour = patches_[other];
      const double area = patch.area + neighbour.area;
      const Vec3d normal = patch.normal + neighbour.normal;
      if (!fits(area, normal)) continue;
      const double rise = variance(area, normal) - variance(patch.area, patch.normal) -
                          variance(neighbour.area, neighbour.normal);
      const double cost =
          (std::max(rise, 0.0) + kSmallPull * std::min(patch.area, neighbour.area)) / run.length;
      queue_.push({cost, std::min(p, other), std::max(p, other), run.first});
    }
  }

  const ChartSurface& surface_;
  ChartBorders& borders_;
  std::vector<std::uint32_t> owner_, root_;
  std::vector<Patch> patches_;
  std::priority_queue<Pair> queue_;
};

/// Patches of triangles whose normals agree; those without an injective flat map are taken apart again.
std::vector<FlatChart> grow_patches(const ChartSurface& surface, ChartBorders& borders) {
  Merger merger(surface, borders);
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    Patch patch;
    patch.open = 3 * t;
    patch.area = surface.area[t];
    patch.normal = surface.normal[t] * surface.area[t];
    merger.own(t, merger.add(std::move(patch)));
  }
  merger.run([](double area,
                const Vec3d& normal) { return variance(area, normal) <= kPatchVariance * area; },
             [](const Patch&, std::uint32_t, std::uint32_t) { return true; });

  std::vector<std::uint32_t> waiting, local(surface.triangles.size());
  const std::vector<Patch>& patches = merger.patches();
  for (std::uint32_t p = 0; p < patches.size(); ++p) {
    if (patches[p].alive) waiting.push_back(p);
  }
  std::reverse(waiting.begin(), waiting.end());
  std::vector<FlatChart> charts;
  while (!waiting.empty()) {
    const std::uint32_t p = waiting.back();
    waiting.pop_back();
    std::vector<std::uint32_t> triangles, stack{p};
    while (!stack.empty()) {
      const Patch& patch = patches[stack.back()];
      const std::uint32_t leaf = stack.back();
      stack.pop_back();
      if (patch.parts[0] == kNoIndex) {
        triangles.push_back(leaf);  // The first patches are the triangles.
      } else {
        stack.push_back(patch.parts[1]);
        stack.push_back(patch.parts[0]);
      }
    }
    FlatChart chart = cut_open(surface, triangles, borders.glued(), local);
    if (lay_flat(chart, surface) || triangles.size() == 1) {
      charts.push_back(std::move(chart));
      continue;
    }
    borders.unglue(patches[p].glued);
    waiting.push_back(patches[p].parts[1]);
    waiting.push_back(patches[p].parts[0]);
  }
  return charts;
}

/// Lays the joined chart's points where those of its parts are, the second moved so that the joint fits.
void lay_edge_to_edge(FlatChart& joined, const FlatChart& a, const FlatChart& b) {
  const std::size_t split = a.triangles.size();
  std::vector<std::uint8_t> of_a(joined.points.size(), 0);
  for (std::size_t i = 0; i < split; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      joined.points[joined.triangles[i][k]] = a.points[a.triangles[i][k]];
      of_a[joined.triangles[i][k]] = 1;
    }
  }
  FlatPoint mean_a, mean_b;
  double count = 0;
  const auto each_joint = [&](const auto& body) {
    for (std::size_t i = 0; i < b.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = joined.triangles[split + i][k];
        if (of_a[v] != 0) body(joined.points[v], b.points[b.triangles[i][k]]);
      }
    }
  };
  each_joint([&](const FlatPoint& in_a, const FlatPoint& in_b) {
    mean_a = mean_a + in_a, mean_b = mean_b + in_b, ++count;
  });
  mean_a = mean_a * (1 / count), mean_b = mean_b * (1 / count);
  double c = 0, s = 0;
  each_joint([&](const FlatPoint& in_a, const FlatPoint& in_b) {
    c += dot(in_b - mean_b, in_a - mean_a);
    s += cross(in_b - mean_b, in_a - mean_a);
  });
  const double size = std::hypot(c, s);
  c = size > 0 ? c / size : 1, s = size > 0 ? s / size : 0;
  for (std::size_t i = 0; i < b.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = joined.triangles[split + i][k];
      if (of_a[v] != 0) continue;
      const FlatPoint p = b.points[b.triangles[i][k]] - mean_b;
      joined.points[v] = mean_a + FlatPoint{c * p.x - s * p.y, s * p.x + c * p.y};
    }
  }
}

}  // namespace

bool within(const FlatChart& chart, const ChartLimits& limits) {
  const FlatDistortion d = distortion(chart);
  return d.energy <= limits.energy && d.worst <= limits.worst;
}

bool lay_flat(FlatChart& chart, const ChartSurface& surface) {
  constexpr int kRounds = 4;
  if (chart.triangles.size() == 1) {
    lay_single(chart, surface);
    return is_injective(chart);
  }
  project(chart, surface);
  const FlatChart projected = chart;
  if (rigid_rounds(chart, kRounds) && is_injective(chart)) return true;
  chart = projected;
  if (!conformal(chart)) return false;
  const FlatChart start = chart;
  if (rigid_rounds(chart, 2 * kRounds) && is_injective(chart)) return true;
  chart = start;
  return is_injective(chart);
}

std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits) {
  std::vector<FlatChart> charts = grow_patches(surface, borders);
  Merger merger(surface, borders);
  for (std::uint32_t c = 0; c < charts.size(); ++c) {
    Patch patch;
    for (const std::uint32_t t : charts[c].source) {
      merger.own(t, c);
      patch.area += surface.area[t];
      patch.normal += surface.normal[t] * surface.area[t];
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (!borders.is_glued(3 * t + k)) patch.open = 3 * t + k;
      }
    }
    patch.border = borders.trace(patch.open);
    merger.add(std::move(patch));
  }
  std::vector<std::uint32_t> local(surface.triangles.size());
  const auto accept = [&](const Patch&, std::uint32_t a, std::uint32_t b) {
    std::vector<std::uint32_t> triangles = charts[a].source;
    triangles.insert(triangles.end(), charts[b].source.begin(), charts[b].source.end());
    FlatChart joined = cut_open(surface, triangles, borders.glued(), local);
    lay_edge_to_edge(joined, charts[a], charts[b]);
    if (!rigid_rounds(joined, 5) || !within(joined, limits) || !is_injective(joined)) return false;
    charts[a] = charts[b] = {};
    charts.push_back(std::move(joined));
    return true;
  };
  merger.run([](double, const Vec3d&) { return true; }, accept);
  std::erase_if(charts, [](const FlatChart& chart) { return chart.source.empty(); });
  return charts;
}

}  // namespace kiln

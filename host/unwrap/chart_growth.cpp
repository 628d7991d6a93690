#include "unwrap/chart_growth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "unwrap/chart_choice.h"
#include "unwrap/chart_merger.h"
#include "unwrap/cut_scratch.h"
#include "unwrap/flat_predicates.h"

namespace kiln {
namespace {

/// Number of merges that are tried in one batch. It does not depend on the number of threads, so neither do results.
/// Most merges are refused, so few trials are wasted on charts that an earlier merge of the batch has consumed.
constexpr std::size_t kTrialsPerBatch = 6;
/// Number of parallel tasks into which the flattening of patches is divided.
constexpr std::size_t kFlatteningTasks = 32;
/// Maximum rounds of each solver for bringing a chart within its limits.
constexpr int kRigidRounds = 5, kInjectiveRounds = 15;
/// Largest variance of normals within a patch: 1 - |mean normal|.
constexpr double kMaxNormalVariance = 0.2;
/// Merges of charts with fewer triangles in total run on one thread, since starting threads would take longer.
constexpr std::size_t kMinTrianglesForThreads = 200;

/// Triangles of a patch: the leaves of its tree of merges.
std::vector<std::uint32_t> triangles_of(const std::vector<ChartPatch>& patches, std::uint32_t p) {
  std::vector<std::uint32_t> triangles, stack{p};
  while (!stack.empty()) {
    const std::uint32_t at = stack.back();
    stack.pop_back();
    const auto& parts = patches[at].parts;
    if (parts[0] == kNoIndex) {
      triangles.push_back(at);
    } else {
      stack.insert(stack.end(), {parts[1], parts[0]});
    }
  }
  return triangles;
}

/// State of a binary search for the largest part of a patch that can be flattened. The path leads down the patch's tree
/// of merges, always through the larger part.
struct PartSearch {
  /// Nodes of the tree of merges, from the patch down to one triangle
  std::vector<std::uint32_t> path;
  /// Indices in `path`: the last node that could not be flattened, and the first that could (or the single triangle at
  /// the end)
  int last_failing = -1, first_flat = 0;
  FlatChart chart;  ///< Chart of the largest part that could be flattened so far

  bool is_done() const { return last_failing + 1 == first_flat && !chart.source.empty(); }
  /// The index in `path` to try next. Until a part can be flattened, each attempt is on a part of at most 0.7 times the
  /// size of the previous one. From then on, the search is a bisection.
  int next(std::span<const std::uint32_t> trial_sizes) const {
    constexpr double kMaxNextSizeRatio = 0.7;
    if (last_failing < 0 || last_failing + 1 == first_flat) return last_failing + 1;
    if (!chart.source.empty()) return (last_failing + first_flat) / 2;
    int at = last_failing + 1;
    while (at < first_flat &&
           trial_sizes[path[static_cast<std::size_t>(at)]] >
               kMaxNextSizeRatio * trial_sizes[path[static_cast<std::size_t>(last_failing)]]) {
      ++at;
    }
    return at;
  }
};

/// Flattens patches. A patch that cannot be flattened within the limits is split along its tree of merges.
class PatchFlattener {
 public:
  PatchFlattener(const ChartSurface& surface, const std::vector<ChartPatch>& patches,
                 const ChartLimits& limits, ChartBorders& borders)
      : surface_(surface),
        patches_(patches),
        limits_(limits),
        borders_(borders),
        scratches_(surface) {
    patch_sizes_.reserve(patches.size());
    for (const ChartPatch& patch : patches) {  // The parts of a patch precede the patch in the list
      const auto [a, b] = patch.parts;
      patch_sizes_.push_back(a == kNoIndex ? 1 : patch_sizes_[a] + patch_sizes_[b]);
    }
  }

  std::vector<FlatChart> run(int threads) {
    std::vector<PartSearch> open_searches;
    for (std::uint32_t p = 0; p < patches_.size(); ++p) {
      if (patches_[p].is_current) open_searches.push_back(start_part_search(p));
    }
    std::vector<FlatChart> charts;
    while (!open_searches.empty()) {
      const auto flatten = [&](std::size_t begin, std::size_t end) {
        std::unique_ptr<CutScratch> scratch = scratches_.acquire();
        for (std::size_t i = begin; i < end; ++i) try_next_part(open_searches[i], *scratch);
        scratches_.release(std::move(scratch));
      };
      parallel_for(open_searches.size(), open_searches.size() / kFlatteningTasks + 1, flatten,
                   threads);
      std::vector<PartSearch> next;
      for (PartSearch& search : open_searches) {
        if (!search.is_done()) {
          next.push_back(std::move(search));
          continue;
        }
        charts.push_back(std::move(search.chart));
        for (std::size_t n = 0; n < static_cast<std::size_t>(search.first_flat); ++n) {
          const ChartPatch& patch = patches_[search.path[n]];
          borders_.open_edges(patch.glued);
          next.push_back(
              start_part_search(patch.parts[patch.parts[0] == search.path[n + 1] ? 1 : 0]));
        }
      }
      open_searches = std::move(next);
    }
    return charts;
  }

 private:
  PartSearch start_part_search(std::uint32_t p) const {
    PartSearch result;
    result.path.push_back(p);
    while (patches_[p].parts[0] != kNoIndex) {
      const auto [a, b] = patches_[p].parts;
      p = patch_sizes_[b] > patch_sizes_[a] ? b : a;
      result.path.push_back(p);
    }
    result.first_flat = static_cast<int>(result.path.size()) - 1;
    return result;
  }

  void try_next_part(PartSearch& search, CutScratch& scratch) const {
    const auto at = static_cast<std::size_t>(search.next(patch_sizes_));
    const auto set_above = [&](std::uint8_t value) {
      for (std::size_t n = 0; n < at; ++n)
        scratch.set_inverted(surface_, patches_[search.path[n]].glued, value);
    };
    set_above(1);
    FlatChart chart = cut_open(surface_, triangles_of(patches_, search.path[at]), borders_.glued(),
                               scratch.index_in_chart, scratch.inverted);
    set_above(0);
    const bool is_flat = flatten_chart(chart, surface_);
    const bool is_accepted =
        chart.source.size() == 1 || (is_flat && is_within_limits(chart, limits_));
    if (!is_accepted) {
      search.last_failing = static_cast<int>(at);
      return;
    }
    search.first_flat = static_cast<int>(at);
    search.chart = std::move(chart);
  }

  const ChartSurface& surface_;
  const std::vector<ChartPatch>& patches_;
  const ChartLimits& limits_;
  ChartBorders& borders_;
  std::vector<std::uint32_t> patch_sizes_;  ///< Number of triangles of each patch
  ScratchPool scratches_;
};

/// Flattened patches of triangles with similar normals. Patches that cannot be flattened within the limits are split.
std::vector<FlatChart> grow_patches(const ChartSurface& surface, const ChartLimits& limits,
                                    ChartBorders& borders, int threads) {
  ChartMerger chart_merger(surface, borders);
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    ChartPatch patch;
    patch.border_half_edge = 3 * t;
    patch.area = surface.area[t];
    patch.normal = surface.normal[t] * surface.area[t];
    chart_merger.assign_owner(t, chart_merger.add(std::move(patch)));
  }
  chart_merger.run(
      1,
      [&](double area, const Vec3d& normal) {
        return variance(area, normal) <= kMaxNormalVariance * area;
      },
      [](std::span<const ChartPatch>, std::span<std::uint8_t>) {});

  return PatchFlattener(surface, chart_merger.patches(), limits, borders).run(threads);
}

/// Initializes the layout of a joined chart: copies the layouts of both parts, and moves the second so that the edges
/// along which the parts are joined coincide.
void place_edge_to_edge(FlatChart& joined, const FlatChart& a, const FlatChart& b) {
  const std::size_t split = a.triangles.size();
  std::vector<std::uint8_t> is_vertex_of_a(joined.points.size(), 0);
  for (std::size_t i = 0; i < split; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      joined.points[joined.triangles[i][k]] = a.points[a.triangles[i][k]];
      is_vertex_of_a[joined.triangles[i][k]] = 1;
    }
  }
  Vec2d mean_point_a{}, mean_point_b{};
  double count = 0;
  const auto each_joint = [&](const auto& body) {
    for (std::size_t i = 0; i < b.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = joined.triangles[split + i][k];
        if (is_vertex_of_a[v] != 0) body(joined.points[v], b.points[b.triangles[i][k]]);
      }
    }
  };
  each_joint([&](const Vec2d& in_a, const Vec2d& in_b) {
    mean_point_a = mean_point_a + in_a, mean_point_b = mean_point_b + in_b, ++count;
  });
  mean_point_a = mean_point_a * (1 / count), mean_point_b = mean_point_b * (1 / count);
  double c = 0, s = 0;
  each_joint([&](const Vec2d& in_a, const Vec2d& in_b) {
    c += dot(in_b - mean_point_b, in_a - mean_point_a);
    s += cross(in_b - mean_point_b, in_a - mean_point_a);
  });
  const double size = std::hypot(c, s);
  c = size > 0 ? c / size : 1, s = size > 0 ? s / size : 0;
  for (std::size_t i = 0; i < b.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = joined.triangles[split + i][k];
      if (is_vertex_of_a[v] != 0) continue;
      const Vec2d p = b.points[b.triangles[i][k]] - mean_point_b;
      joined.points[v] = mean_point_a + Vec2d{c * p.x - s * p.y, s * p.x + c * p.y};
    }
  }
}

/// Joins two charts edge to edge.
/// \param joint  half-edges to glue
FlatChart join(const ChartSurface& surface, const ChartBorders& borders,
               std::span<const std::uint32_t> joint, const FlatChart& a, const FlatChart& b,
               CutScratch& scratch) {
  std::vector<std::uint32_t> triangles;
  std::vector<RestShape> rest;
  triangles.reserve(a.source.size() + b.source.size());
  rest.reserve(triangles.capacity());
  for (const FlatChart* part : {&a, &b}) {
    triangles.insert(triangles.end(), part->source.begin(), part->source.end());
    rest.insert(rest.end(), part->rest.begin(), part->rest.end());
  }
  scratch.set_inverted(surface, joint, 1);
  FlatChart joined = cut_open(surface, triangles, borders.glued(), scratch.index_in_chart,
                              scratch.inverted, std::move(rest));
  scratch.set_inverted(surface, joint, 0);
  place_edge_to_edge(joined, a, b);
  return joined;
}

/// Relaxes a joined chart. \returns whether it is injective and within the limits
bool relax_joined_chart(FlatChart& chart, const ChartLimits& limits) {
  if (!is_short(chart, limits)) return false;
  const auto system = rigid_system(chart);
  if (!rigid_rounds(chart, kRigidRounds, *system)) return false;
  if (is_injective(chart)) return is_within_limits(chart, limits);
  if (rigid_energy(chart) > limits.energy + chart.roughness_energy) return false;
  if (!untangle(chart, {}, *system)) return false;
  if (!is_within_limits(chart, limits))
    injective_rounds(chart, kInjectiveRounds, &limits, system.get());
  return is_within_limits(chart, limits);
}

}  // namespace

bool flatten_chart(FlatChart& chart, const ChartSurface& surface) {
  constexpr int kInitialRigidRounds = 4;
  if (chart.triangles.size() == 1) {
    lay_out_triangle(chart, surface);
    return is_injective(chart);
  }
  project_to_mean_plane(chart, surface);
  return rigid_rounds(chart, kInitialRigidRounds, *rigid_system(chart)) && is_injective(chart);
}

namespace {

/// Merges charts greedily. A merge is only kept if the merged chart can be flattened within the limits.
void join_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::vector<FlatChart>& charts, int threads) {
  ChartMerger chart_merger(surface, borders);
  for (std::uint32_t c = 0; c < charts.size(); ++c) {
    ChartPatch patch;
    for (const std::uint32_t t : charts[c].source) {
      chart_merger.assign_owner(t, c);
      patch.area += surface.area[t];
      patch.normal += surface.normal[t] * surface.area[t];
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (!borders.is_glued(3 * t + k)) patch.border_half_edge = 3 * t + k;
      }
    }
    patch.border_length = borders.trace(patch.border_half_edge);
    chart_merger.add(std::move(patch));
  }
  ScratchPool scratches(surface);
  const auto accept = [&](std::span<const ChartPatch> joined, std::span<std::uint8_t> accepted) {
    std::array<FlatChart, kTrialsPerBatch> trial_charts;
    MergeTrials<kTrialsPerBatch> trials(joined);
    // The largest trials start first, for load balance. Trials that an earlier merge of the batch may supersede come
    // last.
    std::array<std::size_t, kTrialsPerBatch> order{}, trial_sizes{};
    std::size_t triangles = 0;
    for (std::size_t i = 0; i < joined.size(); ++i) {
      for (const std::uint32_t part : joined[i].parts)
        trial_sizes[i] += charts[part].triangles.size();
      order[i] = i;
      triangles += trial_sizes[i];
    }
    std::stable_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(joined.size()),
                     [&](std::size_t p, std::size_t q) {
                       return std::pair(trials.has_rival(q), trial_sizes[p]) >
                              std::pair(trials.has_rival(p), trial_sizes[q]);
                     });
    const auto flatten = [&](std::size_t begin, std::size_t end) {
      std::unique_ptr<CutScratch> scratch = scratches.acquire();
      for (std::size_t n = begin; n < end; ++n) {
        const std::size_t i = order[n];
        if (trials.is_superseded(i)) {
          accepted[i] = 0;
          continue;
        }
        const FlatChart &a = charts[joined[i].parts[0]], &b = charts[joined[i].parts[1]];
        trial_charts[i] = join(surface, borders, joined[i].glued, a, b, *scratch);
        accepted[i] = relax_joined_chart(trial_charts[i], limits) ? 1 : 0;
        trials.record_outcome(i, accepted[i] != 0);
      }
      scratches.release(std::move(scratch));
    };
    parallel_for(joined.size(), 1, flatten, triangles < kMinTrianglesForThreads ? 1 : threads);
    for (std::size_t i = 0; i < joined.size(); ++i) {
      for (const std::uint32_t part : joined[i].parts) {
        // An earlier merge of the batch has consumed one of the two charts
        if (charts[part].source.empty()) accepted[i] = 0;
      }
      if (accepted[i] == 0) continue;
      for (const std::uint32_t part : joined[i].parts) charts[part] = {};
      charts.push_back(std::move(trial_charts[i]));
    }
  };
  chart_merger.run(
      kTrialsPerBatch, [](double, const Vec3d&) { return true; }, accept);
  std::erase_if(charts, [](const FlatChart& chart) { return chart.source.empty(); });
}

}  // namespace

std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits, int threads) {
  std::vector<FlatChart> charts = grow_patches(surface, limits, borders, threads);
  join_charts(surface, borders, limits, charts, threads);
  return charts;
}

}  // namespace kiln

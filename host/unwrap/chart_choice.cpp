#include "unwrap/chart_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "unwrap/chart_cut_search.h"
#include "unwrap/chart_cuts.h"
#include "unwrap/chart_growth.h"
#include "unwrap/chart_proxy.h"
#include "unwrap/chart_transfer.h"
#include "unwrap/straighten_seams.h"

namespace kiln {
namespace {

/// Ways to grow. The second is tried where the first leaves too much of the map.
constexpr std::array<ChartWay, 2> kWays{{{3, 0.2}, {20, 0.1}}};
/// If all leave more than half of it, charts may be no longer than that, for a surface as large as a square with a
/// side of 1: few long strips say how small all others are.
constexpr double kPoor = 0.5, kMostLength = 1.3;
/// Cuts that are tried. A seam as long as the side of a square with the mesh's area must save `seam` of that
/// area; a chart with all of the area would waste `size` of it.
struct CutChoice {
  double seam = 0, size = 0;
};
constexpr std::array<CutChoice, 10> kCutChoices{{{0.005, 0.3},
                                                 {0.035, 0.3},
                                                 {0.01, 0},
                                                 {0.005, 0},
                                                 {0.015, 0.5},
                                                 {0.01, 0.2},
                                                 {0.01, 0.4},
                                                 {0.02, 0.4},
                                                 {0.003, 0.5},
                                                 {0.002, 0.1}}};
/// And where a chart has more than kLarge of the area, so that little fits beside it.
constexpr CutChoice kLargeChoice{0.02, 1};
constexpr double kLarge = 0.3;
/// At which the best charts are joined again: cuts leave pieces that go together otherwise than they grew.
constexpr CutChoice kJoinChoice{0.03, 0.3};
/// A surface that is one chart with less energy than this stays whole.
constexpr CutChoice kFlatChoice{0.02, 0};
constexpr double kFlat = 1e-3;
/// Share of texels used from which on no other way is tried. What is missing of it weighs twice.
constexpr double kGoodEnough = 0.77;
/// Cuts add to what a way begins with: one with so many more vertices a position is not looked at further.
constexpr double kMoreVertices = 0.01;
/// This many of the best-packing choices are packed in more orders.
constexpr std::size_t kPromising = 5;
constexpr std::uint32_t kCutEffort = 20;
/// Above this many charts only the first, or none where vertices weigh already.
constexpr std::size_t kManyCharts = 150;
/// Above this many triangles charts are grown in one way: the other hardly gains.
constexpr double kManyTriangles = 10000;
/// Vertices that seams may add before they weigh all of kVertexPrice: this, times the square root of positions.
constexpr double kFreeVertices = 9.3;
/// Weight of earlier vertices, as a share of kVertexPrice.
constexpr double kFreePrice = 0.1;

/// Charts of a surface with more triangles than kMostWhole are chosen on a proxy of kProxyTriangles.
constexpr std::size_t kMostWhole = 24000, kProxyTriangles = 15000;
/// If charts of more than this share of the triangles cannot be flattened, the proxy does not represent the surface.
constexpr double kMostAnew = 0.5;
/// Distortion limits of a proxy's charts, and then of the surface's: it bends more. A few of its triangles are
/// needles, which say little.
constexpr ChartLimits kProxyLimits{0.035}, kTransferLimits{0.06, 20};

/// Rounds after growing and after cutting; the energy hardly falls after these.
constexpr int kRelaxingRounds = 4;

/// Charts, and what they are worth.
struct Tried {
  ChosenCharts chosen;
  double worth = -std::numeric_limits<double>::infinity();
};

Tried& best_of(std::vector<Tried>& tried) {
  return *std::max_element(tried.begin(), tried.end(),
                           [](const Tried& a, const Tried& b) { return a.worth < b.worth; });
}

CutPrice price_of(const ChartSurface& surface, const UnwrapOptions& options,
                  const CutChoice& choice) {
  const double extent = std::sqrt(surface.total_area);
  const double padding =
      extent / std::sqrt(kExpectedCoverage) * options.border_texels / options.size;
  return {0.5 * padding, choice.seam * extent, choice.size / surface.total_area,
          kLeastPart * surface.total_area};
}

/// Cuts charts at each of some prices, and straightens the seams. \returns one a choice
std::vector<Tried> cut(const ChartSurface& surface, const UnwrapOptions& options,
                       std::span<const CutChoice> choices, const ChosenCharts& grown, int threads) {
  std::vector<CutPrice> prices;
  for (const CutChoice& choice : choices) prices.push_back(price_of(surface, options, choice));
  std::vector<CutCharts> parts = cut_charts(surface, grown.borders, prices, grown.charts, threads);
  std::vector<Tried> result(choices.size(), Tried{{grown.borders, {}}});
  const auto trim = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ChosenCharts& chosen = result[i].chosen;
      chosen.borders.restore(std::move(parts[i].glued));
      chosen.charts = std::move(parts[i].charts);
      trim_charts(surface, chosen.borders, {}, chosen.charts);
    }
  };
  parallel_for(result.size(), 1, trim, threads);
  return result;
}

/// The price of vertices, as a share of the map's texels.
double vertex_price(const ChartSurface& surface, const std::vector<FlatChart>& charts) {
  double added = -static_cast<double>(surface.positions.size());
  for (const FlatChart& chart : charts) added += static_cast<double>(chart.points.size());
  // Seams have more vertices on a finer surface, though not as many more as it has.
  added *= std::sqrt(surface.finer);
  const double positions = static_cast<double>(surface.positions.size()) * surface.finer;
  const double dear = std::max(0.0, added - kFreeVertices * std::sqrt(positions));
  return kVertexPrice * (dear + kFreePrice * (added - dear)) / positions;
}

/// The choices that are worth a try, for some charts.
std::vector<CutChoice> choices_for(const ChartSurface& surface,
                                   const std::vector<FlatChart>& charts) {
  if (charts.size() > kManyCharts && vertex_price(surface, charts) > 0) return {};
  if (charts.size() > kManyCharts) return {kCutChoices.front()};
  if (charts.size() == 1 && distortion(charts[0]).energy < kFlat) return {kFlatChoice};
  const bool large = std::any_of(charts.begin(), charts.end(), [&](const FlatChart& chart) {
    return flat_area(chart) > kLarge * surface.total_area;
  });
  std::vector<CutChoice> choices(kCutChoices.begin(), kCutChoices.end());
  if (large) choices.push_back(kLargeChoice);
  return choices;
}

/// Indices of tried charts whose seams differ from all before.
std::vector<std::size_t> different(const std::vector<Tried>& tried) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < tried.size(); ++i) {
    const bool known = std::any_of(result.begin(), result.end(), [&](std::size_t other) {
      return tried[other].chosen.borders.glued() == tried[i].chosen.borders.glued();
    });
    if (!known) result.push_back(i);
  }
  return result;
}

/// Vertices a position.
double vertices_of(const ChartSurface& surface, const std::vector<FlatChart>& charts) {
  double count = 0;
  for (const FlatChart& chart : charts) count += static_cast<double>(chart.points.size());
  const double ratio = count / static_cast<double>(surface.positions.size());
  return 1 + (ratio - 1) / std::sqrt(surface.finer);
}

/// Packs charts on from where they were, and says what they are worth then.
void pack(const ChartSurface& surface, const UnwrapOptions& options, std::uint32_t effort,
          Tried& one) {
  PackState packed =
      search_packing(outlines_of(one.chosen.charts), options.size, options.border_texels, effort, 1,
                     one.chosen.packed ? &*one.chosen.packed : nullptr);
  one.worth = packed.share - std::max(0.0, kGoodEnough - packed.share) -
              vertex_price(surface, one.chosen.charts);
  if (packed.share > 0) one.chosen.packed = std::move(packed);
}

/// The charts with neighbours joined where what seam and boxes save is worth it, packed anew.
/// \param only  triangles by whose charts this is done: one of both at least; or all
/// \returns nothing where none are joined
std::optional<Tried> join(const ChartSurface& surface, const UnwrapOptions& options,
                          const ChartLimits& limits, const ChosenCharts& chosen, int threads,
                          std::span<const std::uint8_t> only = {}) {
  Tried joined{{chosen.borders, chosen.charts}};
  ChartBorders& borders = joined.chosen.borders;
  std::vector<std::uint8_t> ringed(surface.mate.size(), 0);
  for (std::uint32_t h = 0; h < ringed.size(); ++h) {
    if (borders.is_glued(h) || ringed[h] != 0) continue;
    borders.trace(h);
    for (std::uint32_t n = h; ringed[n] == 0; n = borders.next(n)) ringed[n] = 1;
  }
  const CutPrice price = price_of(surface, options, kJoinChoice);
  const auto worth = [&](std::span<const std::uint32_t> glued, const FlatChart& a,
                         const FlatChart& b, const FlatChart& both) {
    if (!only.empty() && only[a.source[0]] == 0 && only[b.source[0]] == 0) return false;
    double saved = smallest_box(a) + smallest_box(b) - smallest_box(both);
    for (const std::uint32_t h : glued)
      saved += surface.length[h] * (2 * price.margin + price.seam);
    return saved > 2 * price.size * flat_area(a) * flat_area(b);
  };
  join_charts(surface, borders, limits, surface.normal, worth, joined.chosen.charts, threads);
  if (joined.chosen.charts.size() == chosen.charts.size()) return std::nullopt;
  trim_charts(surface, borders, {}, joined.chosen.charts);
  pack(surface, options, kCutEffort, joined);
  return joined;
}

/// Grows charts in one way, and cuts them so that they pack well for few vertices.
/// \param fewest  vertices a position before cuts, of all ways so far; a way with many more is not cut
Tried try_way(const ChartSurface& surface, const UnwrapOptions& options, const ChartLimits& limits,
              const ChartWay& way, double& fewest, int threads) {
  Tried grown{{ChartBorders(surface), {}}};
  grown.chosen.charts = grow_charts(surface, grown.chosen.borders, limits, way, threads);
  relax_charts(grown.chosen.charts, threads);
  trim_charts(surface, grown.chosen.borders, {}, grown.chosen.charts);
  const double vertices = vertices_of(surface, grown.chosen.charts);
  grown.chosen.any_size = true;
  if (vertices > fewest + kMoreVertices) return grown;
  fewest = std::min(fewest, vertices);
  const std::vector<CutChoice> choices = choices_for(surface, grown.chosen.charts);
  if (choices.empty()) {
    grown.worth = -vertex_price(surface, grown.chosen.charts);
    return grown;
  }
  grown.chosen.any_size = false;
  std::vector<Tried> tried = cut(surface, options, choices, grown.chosen, threads);
  if (grown.chosen.charts.size() > kManyCharts) {  // One choice: nothing to compare by packing.
    tried[0].worth = -vertex_price(surface, tried[0].chosen.charts);
    return std::move(tried[0]);
  }
  const auto pack_some = [&](std::span<const std::size_t> which, std::uint32_t effort) {
    const auto pack_one = [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) pack(surface, options, effort, tried[which[n]]);
    };
    parallel_for(which.size(), 1, pack_one, threads);
  };
  std::vector<std::size_t> order = different(tried);
  pack_some(order, 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tried[a].worth > tried[b].worth; });
  order.resize(std::min(order.size(), kPromising));
  pack_some(order, kCutEffort);
  return std::move(best_of(tried));
}

/// Grows and cuts charts in a few ways and returns the best. \param limits  of growing
ChosenCharts choose(const ChartSurface& surface, const UnwrapOptions& options, ChartLimits limits,
                    int threads) {
  std::vector<Tried> tried;
  double fewest = std::numeric_limits<double>::infinity();
  for (const ChartWay& way : kWays) {
    tried.push_back(try_way(surface, options, limits, way, fewest, threads));
    const auto& packed = tried.back().chosen.packed;
    if (packed && packed->share >= kGoodEnough) break;
    if (!packed && static_cast<double>(surface.triangles.size()) * surface.finer > kManyTriangles)
      break;
  }
  const auto& so_far = best_of(tried).chosen.packed;
  if (so_far && so_far->share < kPoor) {
    limits.length = kMostLength * std::sqrt(surface.total_area);
    fewest = std::numeric_limits<double>::infinity();
    tried.push_back(try_way(surface, options, limits, kWays[0], fewest, threads));
  }
  const Tried& best = best_of(tried);
  if (best.chosen.packed) {
    std::optional<Tried> joined = join(surface, options, limits, best.chosen, threads);
    if (joined && joined->chosen.packed && joined->worth > best.worth) {
      return std::move(joined->chosen);
    }
  }
  const bool any_size =
      std::all_of(tried.begin(), tried.end(), [](const Tried& one) { return one.chosen.any_size; });
  ChosenCharts chosen = std::move(best_of(tried).chosen);
  chosen.any_size = any_size;
  return chosen;
}

}  // namespace

ChosenCharts choose_charts(const ChartSurface& surface, const UnwrapOptions& options, int threads) {
  if (surface.triangles.size() <= kMostWhole) return choose(surface, options, {}, threads);
  const VertexFans fans(surface);
  const ChartProxy proxy = chart_proxy(surface, fans, kProxyTriangles);
  // With many small parts, little is left out.
  if (proxy.surface.triangles.size() > kMostWhole) return choose(surface, options, {}, threads);
  const ChosenCharts chosen = choose(proxy.surface, options, kProxyLimits, threads);
  std::vector<std::uint8_t> anew;
  Tried made{transfer_charts(surface, fans, proxy, chosen, kTransferLimits, threads, anew)};
  const auto grown_anew = static_cast<double>(std::count(anew.begin(), anew.end(), 1));
  if (grown_anew > kMostAnew * static_cast<double>(surface.triangles.size()))
    return choose(surface, options, {}, threads);
  if (!chosen.packed || made.chosen.packed) return std::move(made.chosen);
  pack(surface, options, kCutEffort, made);
  std::optional<Tried> joined = join(surface, options, {}, made.chosen, threads, anew);
  return std::move(joined && joined->worth > made.worth ? joined->chosen : made.chosen);
}

void relax_charts(std::vector<FlatChart>& charts, int threads) {
  const auto relax = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (charts[i].triangles.size() == 1) continue;
      injective_rounds(charts[i], kRelaxingRounds);
      normalise(charts[i]);
    }
  };
  parallel_for(charts.size(), 1, relax, threads);
}

std::vector<Vec2d> outline_of(const FlatChart& chart) {
  std::vector<Vec2d> ring;
  ring.reserve(chart.boundary.size());
  for (const std::uint32_t v : chart.boundary) ring.push_back(chart.points[v]);
  return ring;
}

std::vector<Outline> outlines_of(const std::vector<FlatChart>& charts) {
  std::vector<Outline> outlines(charts.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    outlines[i].rings.push_back(outline_of(charts[i]));
    outlines[i].area = flat_area(charts[i]);
  }
  return outlines;
}

}  // namespace kiln

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

/// Where charts leave more than half of the map, they may be no longer than that, for a surface as large as a square
/// with a side of 1: few long strips say how small all others are.
constexpr double kPoor = 0.5, kMostLength = 1.3;
/// Cuts that are tried. A seam as long as the side of a square with the mesh's area must save `seam` of that
/// area; a chart with all of the area would waste `size` of it.
struct CutChoice {
  double seam = 0, size = 0;
};
constexpr std::array<CutChoice, 5> kCutChoices{
    {{0.005, 0.3}, {0.035, 0.3}, {0.01, 0}, {0.02, 0.4}, {0.002, 0.1}}};
/// A surface that is one chart with less energy than this stays whole.
constexpr CutChoice kFlatChoice{0.02, 0};
constexpr double kFlat = 1e-3;
/// What is missing of this share of texels used weighs twice.
constexpr double kGoodEnough = 0.77;
/// Orders that each of them is packed in.
constexpr std::uint32_t kCutEffort = 20;
/// Above this many charts only the first, or none where vertices weigh already.
constexpr std::size_t kManyCharts = 150;
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
  if (charts.size() == 1 && distortion(charts[0]).energy < kFlat) return {kFlatChoice};
  if (charts.size() <= kManyCharts) return {kCutChoices.begin(), kCutChoices.end()};
  if (vertex_price(surface, charts) > 0) return {};
  return {kCutChoices.front()};
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

/// Packs charts, and says what they are worth then.
void pack(const ChartSurface& surface, const UnwrapOptions& options, Tried& one) {
  PackState packed = search_packing(outlines_of(one.chosen.charts), options.size,
                                    options.border_texels, kCutEffort, 1);
  one.worth = packed.share - std::max(0.0, kGoodEnough - packed.share) -
              vertex_price(surface, one.chosen.charts);
  if (packed.share > 0) one.chosen.packed = std::move(packed);
}

/// Grows charts within some limits, and cuts them so that they pack well for few vertices.
Tried grow_and_cut(const ChartSurface& surface, const UnwrapOptions& options,
                   const ChartLimits& limits, int threads) {
  ChosenCharts grown{ChartBorders(surface), {}};
  grown.charts = grow_charts(surface, grown.borders, limits, threads);
  relax_charts(grown.charts, threads);
  trim_charts(surface, grown.borders, {}, grown.charts);
  const std::vector<CutChoice> choices = choices_for(surface, grown.charts);
  if (choices.empty()) {
    grown.any_size = true;
    return {std::move(grown)};
  }
  std::vector<Tried> tried = cut(surface, options, choices, grown, threads);
  if (grown.charts.size() > kManyCharts) return std::move(tried[0]);
  const std::vector<std::size_t> which = different(tried);
  const auto pack_one = [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) pack(surface, options, tried[which[n]]);
  };
  parallel_for(which.size(), 1, pack_one, threads);
  return std::move(best_of(tried));
}

ChosenCharts choose(const ChartSurface& surface, const UnwrapOptions& options, ChartLimits limits,
                    int threads) {
  Tried best = grow_and_cut(surface, options, limits, threads);
  if (!best.chosen.packed || best.chosen.packed->share >= kPoor) return std::move(best.chosen);
  limits.length = kMostLength * std::sqrt(surface.total_area);
  Tried shorter = grow_and_cut(surface, options, limits, threads);
  return std::move(shorter.worth > best.worth ? shorter.chosen : best.chosen);
}

}  // namespace

ChosenCharts choose_charts(const ChartSurface& surface, const UnwrapOptions& options, int threads) {
  if (surface.triangles.size() <= kMostWhole) return choose(surface, options, {}, threads);
  const VertexFans fans(surface);
  const ChartProxy proxy = chart_proxy(surface, fans, kProxyTriangles);
  // With many small parts, little is left out.
  if (proxy.surface.triangles.size() > kMostWhole) return choose(surface, options, {}, threads);
  const ChosenCharts chosen = choose(proxy.surface, options, kProxyLimits, threads);
  std::size_t anew = 0;
  Tried made{transfer_charts(surface, fans, proxy, chosen, kTransferLimits, threads, anew)};
  if (static_cast<double>(anew) > kMostAnew * static_cast<double>(surface.triangles.size()))
    return choose(surface, options, {}, threads);
  if (!chosen.packed || made.chosen.packed) return std::move(made.chosen);
  pack(surface, options, made);
  return std::move(made.chosen);
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

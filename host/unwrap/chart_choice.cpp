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

/// If charts cover less than kMinCoverage of the map, they are grown again with a limit on their length:
/// kMaxChartLength times the square root of the surface's area. Without this limit, a few long strips would determine
/// the scale of all charts.
constexpr double kMinCoverage = 0.5, kMaxChartLength = 1.3;
/// Penalties in the search for cuts. A cut must shrink the total area of bounding boxes: a seam as long as the square
/// root of the mesh's area must save at least the fraction `seam` of that area. Large charts are expected to waste
/// space: a single chart of the whole mesh is assumed to waste the fraction `size` of its area.
struct CutPenalties {
  double seam = 0, size = 0;
};
constexpr std::array<CutPenalties, 5> kCutPenalties{
    {{0.005, 0.3}, {0.035, 0.3}, {0.01, 0}, {0.02, 0.4}, {0.002, 0.1}}};
/// If the surface is a single chart with a distortion energy below kMaxFlatEnergy, cuts hardly help: only
/// kFlatPenalties are tried.
constexpr CutPenalties kFlatPenalties{0.02, 0};
constexpr double kMaxFlatEnergy = 1e-3;
/// A candidate that covers less than this share of the map is penalized: its score is its coverage minus the shortfall
/// from this share (and minus the price of added vertices).
constexpr double kTargetCoverage = 0.77;
/// Number of orders in which each candidate's charts are packed. The best packing counts.
constexpr std::uint32_t kPackingOrders = 20;
/// If there are more charts than this, only the first pair of penalties is tried, or none if the vertices that the
/// seams add have a price above 0 already.
constexpr std::size_t kMaxChartsToCut = 150;
/// Number of vertices that seams may add at the low price kAllowancePrice, as a multiple of the square root of the
/// number of positions.
constexpr double kAllowanceFactor = 9.3;
/// Price of a vertex within the number that kAllowanceFactor allows, as a fraction of kVertexPrice.
constexpr double kAllowancePrice = 0.1;

/// Charts of a surface with more triangles than kMaxDirectTriangles are chosen on a proxy of kProxyTriangles.
constexpr std::size_t kMaxDirectTriangles = 24000, kProxyTriangles = 15000;
/// The proxy is discarded if charts with more than this share of the triangles fail to flatten on the surface.
constexpr double kMaxRegrownShare = 0.5;
/// Distortion limits of charts on the proxy, and on the surface, which is rougher. The surface's limit on single
/// triangles is loose, since a few needles are distorted in every layout of the chart.
constexpr ChartLimits kProxyLimits{0.035}, kTransferLimits{0.06, 20};

/// Rounds of relaxation after growing and after cutting. More rounds hardly lower the energy.
constexpr int kRelaxingRounds = 4;

/// Charts that may be chosen, and their score.
struct ChartCandidate {
  ChosenCharts chosen;
  double score = -std::numeric_limits<double>::infinity();
};

ChartCandidate& best_candidate(std::vector<ChartCandidate>& tried_candidates) {
  return *std::max_element(
      tried_candidates.begin(), tried_candidates.end(),
      [](const ChartCandidate& a, const ChartCandidate& b) { return a.score < b.score; });
}

CutPrice cut_price(const ChartSurface& surface, const UnwrapOptions& options,
                   const CutPenalties& penalties) {
  const double extent = std::sqrt(surface.total_area);
  const double padding =
      extent / std::sqrt(kExpectedCoverage) * options.border_texels / options.size;
  return {0.5 * padding, penalties.seam * extent, penalties.size / surface.total_area,
          kMinPartShare * surface.total_area};
}

/// Cuts charts with each of several pairs of penalties, and straightens the seams.
/// \returns one candidate for each pair of penalties
std::vector<ChartCandidate> cut_with_penalties(const ChartSurface& surface,
                                               const UnwrapOptions& options,
                                               std::span<const CutPenalties> all_penalties,
                                               const ChosenCharts& grown, int threads) {
  std::vector<CutPrice> prices;
  for (const CutPenalties& penalties : all_penalties)
    prices.push_back(cut_price(surface, options, penalties));
  std::vector<CutCharts> parts = cut_charts(surface, grown.borders, prices, grown.charts, threads);
  std::vector<ChartCandidate> result(all_penalties.size(), ChartCandidate{{grown.borders, {}}});
  const auto straighten = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ChosenCharts& chosen = result[i].chosen;
      chosen.borders.restore(std::move(parts[i].glued));
      chosen.charts = std::move(parts[i].charts);
      trim_charts(surface, chosen.borders, {}, chosen.charts);
    }
  };
  parallel_for(result.size(), 1, straighten, threads);
  return result;
}

/// Price of the vertices that seams add, as a share of the map's texels.
double vertex_price(const ChartSurface& surface, const std::vector<FlatChart>& charts) {
  double added = -static_cast<double>(surface.positions.size());
  for (const FlatChart& chart : charts) added += static_cast<double>(chart.points.size());
  // If `surface` is a proxy, a seam has more vertices on the finer surface that the proxy represents. Their number is
  // proportional to the square root of the number of triangles.
  added *= std::sqrt(surface.finer_per_triangle);
  const double positions =
      static_cast<double>(surface.positions.size()) * surface.finer_per_triangle;
  const double excess_vertices = std::max(0.0, added - kAllowanceFactor * std::sqrt(positions));
  return kVertexPrice * (excess_vertices + kAllowancePrice * (added - excess_vertices)) / positions;
}

/// The penalties to try when these charts are cut.
std::vector<CutPenalties> penalties_for(const ChartSurface& surface,
                                        const std::vector<FlatChart>& charts) {
  if (charts.size() == 1 && distortion(charts[0]).energy < kMaxFlatEnergy) return {kFlatPenalties};
  if (charts.size() <= kMaxChartsToCut) return {kCutPenalties.begin(), kCutPenalties.end()};
  if (vertex_price(surface, charts) > 0) return {};
  return {kCutPenalties.front()};
}

/// Indices of candidates whose seams differ from all previous ones.
std::vector<std::size_t> distinct_candidates(const std::vector<ChartCandidate>& tried_candidates) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < tried_candidates.size(); ++i) {
    const bool is_known = std::any_of(result.begin(), result.end(), [&](std::size_t other) {
      return tried_candidates[other].chosen.borders.glued() ==
             tried_candidates[i].chosen.borders.glued();
    });
    if (!is_known) result.push_back(i);
  }
  return result;
}

/// Packs a candidate's charts and sets its score.
void pack(const ChartSurface& surface, const UnwrapOptions& options, ChartCandidate& candidate) {
  PackState packed = search_packing(outlines_of(candidate.chosen.charts), options.size,
                                    options.border_texels, kPackingOrders, 1);
  candidate.score = packed.share - std::max(0.0, kTargetCoverage - packed.share) -
                    vertex_price(surface, candidate.chosen.charts);
  if (packed.share > 0) candidate.chosen.packed = std::move(packed);
}

/// Grows charts within limits of distortion and length, and cuts them where that improves the packing at the cost of
/// few vertices.
ChartCandidate grow_and_cut(const ChartSurface& surface, const UnwrapOptions& options,
                            const ChartLimits& limits, int threads) {
  ChosenCharts grown{ChartBorders(surface), {}};
  grown.charts = grow_charts(surface, grown.borders, limits, threads);
  relax_charts(grown.charts, threads);
  trim_charts(surface, grown.borders, {}, grown.charts);
  const std::vector<CutPenalties> all_penalties = penalties_for(surface, grown.charts);
  if (all_penalties.empty()) {
    grown.is_independent_of_size = true;
    return {std::move(grown)};
  }
  std::vector<ChartCandidate> tried_candidates =
      cut_with_penalties(surface, options, all_penalties, grown, threads);
  if (grown.charts.size() > kMaxChartsToCut) return std::move(tried_candidates[0]);
  const std::vector<std::size_t> distinct = distinct_candidates(tried_candidates);
  const auto pack_one = [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) pack(surface, options, tried_candidates[distinct[n]]);
  };
  parallel_for(distinct.size(), 1, pack_one, threads);
  return std::move(best_candidate(tried_candidates));
}

ChosenCharts choose_directly(const ChartSurface& surface, const UnwrapOptions& options,
                             ChartLimits limits, int threads) {
  ChartCandidate best = grow_and_cut(surface, options, limits, threads);
  if (!best.chosen.packed || best.chosen.packed->share >= kMinCoverage)
    return std::move(best.chosen);
  limits.length = kMaxChartLength * std::sqrt(surface.total_area);
  ChartCandidate shorter = grow_and_cut(surface, options, limits, threads);
  return std::move(shorter.score > best.score ? shorter.chosen : best.chosen);
}

}  // namespace

ChosenCharts choose_charts(const ChartSurface& surface, const UnwrapOptions& options, int threads) {
  if (surface.triangles.size() <= kMaxDirectTriangles)
    return choose_directly(surface, options, {}, threads);
  const VertexFans fans(surface);
  const ChartProxy proxy = chart_proxy(surface, fans, kProxyTriangles);
  // A proxy keeps all triangles of small components. If the mesh consists of many of these, the proxy may have nearly
  // as many triangles as the mesh.
  if (proxy.surface.triangles.size() > kMaxDirectTriangles)
    return choose_directly(surface, options, {}, threads);
  const ChosenCharts chosen = choose_directly(proxy.surface, options, kProxyLimits, threads);
  std::size_t regrown_triangles = 0;
  ChartCandidate transferred{
      transfer_charts(surface, fans, proxy, chosen, kTransferLimits, threads, regrown_triangles)};
  if (static_cast<double>(regrown_triangles) >
      kMaxRegrownShare * static_cast<double>(surface.triangles.size()))
    return choose_directly(surface, options, {}, threads);
  if (!chosen.packed || transferred.chosen.packed) return std::move(transferred.chosen);
  pack(surface, options, transferred);
  return std::move(transferred.chosen);
}

void relax_charts(std::vector<FlatChart>& charts, int threads) {
  const auto relax = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (charts[i].triangles.size() == 1) continue;
      injective_rounds(charts[i], kRelaxingRounds);
      scale_to_surface_area(charts[i]);
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

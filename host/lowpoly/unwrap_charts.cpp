#include "lowpoly/unwrap_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "lowpoly/bitmap_packing.h"
#include "lowpoly/box_packing.h"
#include "lowpoly/chart_cuts.h"
#include "lowpoly/chart_density.h"
#include "lowpoly/chart_growth.h"
#include "lowpoly/chart_trims.h"
#include "lowpoly/flat_predicates.h"
#include "lowpoly/pairing.h"

namespace kiln {
namespace {

/// UVs are whole multiples of 2^-24: single precision holds them exactly up to 1, and double precision
/// decides the side of a point without rounding.
constexpr double kSteps = 16777216;
/// Above this many charts they are packed by their boxes.
constexpr std::size_t kBitmapLimit = 1000;
/// A padding that leaves less of the map than this to charts may be halved: where that raises it by a factor.
constexpr double kWantedCoverage = 0.25, kWorthwhile = 1.3;
/// Where padding is weighed, before packing.
constexpr double kExpectedCoverage = 0.75;
/// Cuts that are tried. A seam as long as the side of a square with the mesh's area must save `seam` of that
/// area; a chart with all of the area would waste `size` of it.
struct CutChoice {
  double seam = 0, size = 0;
};
constexpr std::array<CutChoice, 5> kCutChoices{
    {{0.02, 0}, {0.035, 0.3}, {0.01, 0}, {0.005, 0}, {0.005, 0.3}}};
/// And where a chart has more than kLarge of the area, so that little fits beside it.
constexpr std::array<CutChoice, 2> kLargeChoices{{{0.02, 1}, {0.005, 2}}};
constexpr double kLarge = 0.3;
/// Of texels used, where the first is taken whatever others promise.
constexpr double kGoodEnough = 0.83;
/// Orders in which the charts of each choice are packed.
constexpr std::uint32_t kCutEffort = 20;
/// Above this many charts only the last, or none where vertices weigh already; of one chart, only the first.
constexpr std::size_t kManyCharts = 150;
/// No part is smaller than this share of the mesh.
constexpr double kLeastPart = 0.003;
/// Vertices that seams may add before they count: this, times the square root of positions. Beyond, each
/// vertex weighs as much as that share of the map's texels.
constexpr double kFreeVertices = 9.3, kVertexPrice = 2;
/// Texels by detail are left alone where they are expected to gain less than this.
constexpr double kLeastGain = 0.01;
/// Rounds after growing; the energy hardly falls after these.
constexpr int kFinishingRounds = 4;

/// A triangle by itself, as an equilateral one: what is too small for a place in a chart.
FlatChart lone_chart(const ChartSurface& surface, ChartBorders& borders, std::uint32_t t,
                     double side, std::vector<std::uint32_t>& local) {
  const std::array<std::uint32_t, 1> triangle{t};
  FlatChart chart = cut_open(surface, triangle, borders.glued(), local);
  for (std::uint32_t k = 0; k < 3; ++k) side = std::max(side, surface.length[3 * t + k]);
  chart.points = {{0, 0}, {side, 0}, {0.5 * side, std::sqrt(0.75) * side}};
  return chart;
}

std::vector<Outline> outlines_of(const std::vector<FlatChart>& charts) {
  std::vector<Outline> outlines(charts.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    outlines[i].rings.resize(1);
    for (const std::uint32_t v : charts[i].boundary) {
      outlines[i].rings[0].push_back(charts[i].points[v]);
    }
    outlines[i].area = flat_area(charts[i]);
  }
  return outlines;
}

/// Charts and what is glued of the surface's edges.
struct Charts {
  ChartBorders borders;
  std::vector<FlatChart> charts;
};

ChartSurface make_surface(const Mesh& mesh, const std::vector<std::uint8_t>& lone) {
  ChartSurface surface = chart_surface(mesh);
  if (surface.triangles.empty()) {
    throw Error(ErrorCode::input,
                "unwrap: mesh '" + mesh.name +
                    "' has no triangle of positive area; check the file it is from");
  }
  for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
    if (lone[h / 3] == 0 || surface.mate[h] == kNoIndex) continue;
    surface.mate[surface.mate[h]] = kNoIndex;
    surface.mate[h] = kNoIndex;
  }
  return surface;
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
std::vector<Charts> cut(const ChartSurface& surface, const UnwrapOptions& options,
                        std::span<const CutChoice> choices, const Charts& made, int threads) {
  std::vector<CutPrice> prices;
  for (const CutChoice& choice : choices) prices.push_back(price_of(surface, options, choice));
  std::vector<CutCharts> parts = cut_charts(surface, made.borders, prices, made.charts, threads);
  std::vector<Charts> result(choices.size(), Charts{made.borders, {}});
  const auto trim = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result[i].borders.restore(std::move(parts[i].glued));
      result[i].charts = std::move(parts[i].charts);
      trim_charts(surface, result[i].borders, {}, result[i].charts);
    }
  };
  parallel_for(result.size(), 1, trim, threads);
  return result;
}

/// What vertices weigh, as a share of the map's texels.
double vertex_price(const ChartSurface& surface, const std::vector<FlatChart>& charts) {
  const auto positions = static_cast<double>(surface.positions.size());
  double added = -positions;
  for (const FlatChart& chart : charts) added += static_cast<double>(chart.points.size());
  return kVertexPrice * std::max(0.0, added - kFreeVertices * std::sqrt(positions)) / positions;
}

/// The choices that are worth a try, for some charts.
std::vector<CutChoice> choices_for(const ChartSurface& surface,
                                   const std::vector<FlatChart>& charts) {
  if (charts.size() > kManyCharts && vertex_price(surface, charts) > 0) return {};
  if (charts.size() > kManyCharts) return {kCutChoices.back()};
  if (charts.size() == 1) return {kCutChoices.front()};
  const bool large = std::any_of(charts.begin(), charts.end(), [&](const FlatChart& chart) {
    return flat_area(chart) > kLarge * surface.total_area;
  });
  std::vector<CutChoice> choices(kCutChoices.begin(), kCutChoices.end());
  if (large) choices.insert(choices.end(), kLargeChoices.begin(), kLargeChoices.end());
  return choices;
}

/// Cuts charts so that they pack well for few vertices. \returns how they were packed, if they were
std::optional<PackState> choose_cuts(const ChartSurface& surface, const UnwrapOptions& options,
                                     Charts& made, int threads) {
  const std::vector<CutChoice> choices = choices_for(surface, made.charts);
  if (choices.empty()) return std::nullopt;
  std::vector<Charts> tried = cut(surface, options, choices, made, threads);
  std::vector<PackState> packed(tried.size());
  std::vector<double> worths(tried.size(), 0);
  const auto pack_one = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& cuts = tried[i].borders.glued();
      const bool known = std::any_of(tried.begin(), tried.begin() + static_cast<std::ptrdiff_t>(i),
                                     [&](const Charts& c) { return c.borders.glued() == cuts; });
      worths[i] = -std::numeric_limits<double>::infinity();
      if (known) continue;
      packed[i] = search_packing(outlines_of(tried[i].charts), options.size, options.border_texels,
                                 kCutEffort, 1);
      worths[i] = packed[i].share - vertex_price(surface, tried[i].charts);
    }
  };
  if (tried.size() > 1) parallel_for(tried.size(), 1, pack_one, threads);
  const auto best = static_cast<std::size_t>(
      worths[0] >= kGoodEnough ? 0
                               : std::max_element(worths.begin(), worths.end()) - worths.begin());
  made.charts = std::move(tried[best].charts);
  made.borders.restore(tried[best].borders.glued());
  if (packed[best].share == 0) return std::nullopt;
  return std::move(packed[best]);
}

struct MadeCharts {
  Charts made;
  std::optional<PackState> packed;  ///< How they were packed when they were made, nearly.
};

MadeCharts make_charts(const ChartSurface& surface, const UnwrapOptions& options,
                       const std::vector<std::uint8_t>& lone, int threads) {
  Charts made{ChartBorders(surface), {}};
  made.charts = grow_charts(surface, made.borders, {});
  trim_charts(surface, made.borders, {}, made.charts);
  std::optional<PackState> packed = choose_cuts(surface, options, made, threads);
  const double texel = std::sqrt(surface.total_area) / options.size;
  std::vector<FlatChart>& charts = made.charts;
  std::vector<std::uint32_t> local(surface.triangles.size());
  for (FlatChart& chart : charts) {
    if (lone[chart.source[0]] != 0)
      chart = lone_chart(surface, made.borders, chart.source[0], texel, local);
  }
  const auto finish = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (charts[i].triangles.size() == 1) continue;
      injective_rounds(charts[i], kFinishingRounds);
      normalise(charts[i]);
    }
  };
  parallel_for(charts.size(), 1, finish, threads);
  return {std::move(made), std::move(packed)};
}

struct Layout {
  OutlinePacking packing;
  double padding = 0, coverage = 0;
};

Layout pack_with(std::span<const Outline> outlines, std::uint32_t size, double padding,
                 const PackState* from, int threads) {
  // Rounding to UV steps may move two borders towards each other.
  const double apart = padding + 4 * size / kSteps;
  Layout layout{outlines.size() > kBitmapLimit
                    ? pack_boxes(outlines, size, apart)
                    : pack_outlines(outlines, size, apart, from, threads),
                padding};
  const double side = layout.packing.scale / size;
  for (const Outline& outline : outlines) layout.coverage += outline.area * side * side;
  return layout;
}

/// With the padding asked for, or with less where that lets charts have many more texels.
Layout pack(const std::vector<FlatChart>& charts, const PackState* from,
            const UnwrapOptions& options, int threads) {
  const std::vector<Outline> outlines = outlines_of(charts);
  Layout best = pack_with(outlines, options.size, options.border_texels, from, threads);
  while (best.coverage < kWantedCoverage && (best.padding > 1 || best.coverage == 0)) {
    if (best.padding < 1.0 / 1024) {
      throw Error(ErrorCode::input, "unwrap: the mesh has too many charts for a texture of " +
                                        std::to_string(options.size) +
                                        " texels; simplify it first, or use a larger size");
    }
    Layout next = pack_with(outlines, options.size, 0.5 * best.padding, nullptr, threads);
    // Long thin charts leave room whatever the padding.
    if (best.coverage > 0 && next.coverage < kWorthwhile * best.coverage) break;
    best = std::move(next);
  }
  return best;
}

/// What a cut for other densities must be worth.
DensityPrice density_price(const ChartSurface& surface, const UnwrapOptions& options) {
  const double texel = std::sqrt(surface.total_area / kExpectedCoverage) / options.size;
  double length = 0;
  for (const double side : surface.length) length += side;
  const double edge = length / static_cast<double>(surface.length.size());
  const double vertex =
      kVertexPrice * surface.total_area / static_cast<double>(surface.positions.size());
  return {0.5 * options.border_texels * texel, vertex / edge, kLeastPart * surface.total_area};
}

/// Gives charts scales of their own, as they are or cut, where that is expected to gain.
/// \param mesh    that the surface is of
/// \param layout  of the charts as they are; out: of those chosen
void follow_detail(const ChartSurface& surface, const Mesh& mesh, const TexelDetail& detail,
                   const UnwrapOptions& options, Charts& made, Layout& layout, int threads) {
  const FlatTriangles flat =
      flat_triangles(surface, made.borders, made.charts, mesh.triangles.size());
  const std::vector<TexelNeed> needs =
      texel_needs(surface, detail.errors(mesh, flat, options.size, threads));
  const double even = std::sqrt(kExpectedCoverage / surface.total_area) * options.size;
  const auto error_of = [&](const std::vector<FlatChart>& charts, std::vector<double> scales,
                            const Layout& packed) {
    for (double& s : scales) s *= packed.packing.scale / even;
    return expected_error(chart_needs(charts, needs), scales);
  };
  double least =
      (1 - kLeastGain) * error_of(made.charts, std::vector<double>(made.charts.size(), 1), layout);
  Charts next = made;
  for (const bool cut : {false, true}) {
    const std::size_t before = next.charts.size();
    if (cut) {
      cut_by_density(surface, next.borders, density_price(surface, options), needs, next.charts);
      if (next.charts.size() == before) break;
    }
    const std::vector<double> scales = texel_scales(chart_needs(next.charts, needs));
    // Packing hardly gets better by it.
    if (error_of(next.charts, scales, layout) >= least) continue;
    std::vector<FlatChart> charts = next.charts;
    for (std::size_t i = 0; i < charts.size(); ++i) {
      for (FlatPoint& p : charts[i].points) p = p * scales[i];
    }
    Layout packed = pack(charts, nullptr, options, threads);
    const double error = error_of(charts, scales, packed);
    if (error >= least || packed.padding < layout.padding) continue;
    least = error;
    made.charts = std::move(charts);
    layout = std::move(packed);
  }
}

/// Moves the chart's points to their places in the texture, in whole steps.
void place(FlatChart& chart, const OutlinePlace& at, double scale, std::uint32_t size) {
  for (FlatPoint& p : chart.points) {
    const FlatPoint q = p * scale;
    const FlatPoint texel{at.turn.x * q.x - at.turn.y * q.y + at.shift.x,
                          at.turn.y * q.x + at.turn.x * q.y + at.shift.y};
    p = {std::round(texel.x / size * kSteps), std::round(texel.y / size * kSteps)};
  }
}

/// Marks triangles that rounding has flattened or flipped; where none is, but the border touches itself,
/// all of the chart's. \returns whether any was
bool mark_failures(const FlatChart& chart, std::vector<std::uint8_t>& lone) {
  if (is_injective(chart)) return false;
  bool any = false;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Triangle& t = chart.triangles[i];
    if (surely_left(chart.points[t[0]], chart.points[t[1]], chart.points[t[2]])) continue;
    lone[chart.source[i]] = 1;
    any = true;
  }
  if (any) return true;
  for (const std::uint32_t t : chart.source) lone[t] = 1;
  return true;
}

Mesh write(const Mesh& mesh, const ChartSurface& surface, const std::vector<FlatChart>& charts) {
  Mesh result = mesh;
  result.tangents.clear();  // those of other UVs
  result.uvs = {{0, 0}};    // All corners of the triangles that cover nothing.
  result.uv_triangles.assign(mesh.triangles.size(), Triangle{0, 0, 0});
  for (const FlatChart& chart : charts) {
    const auto first = static_cast<std::uint32_t>(result.uvs.size());
    for (const FlatPoint& p : chart.points) {
      result.uvs.push_back({static_cast<float>(p.x / kSteps), static_cast<float>(p.y / kSteps)});
    }
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      Triangle& uv = result.uv_triangles[surface.source[chart.source[i]]];
      for (std::size_t k = 0; k < 3; ++k) uv[k] = first + chart.triangles[i][k];
    }
  }
  return result;
}

void describe(const ChartSurface& surface, const std::vector<FlatChart>& charts, double padding,
              const UnwrapOptions& options, UnwrapReport& report) {
  report.charts = charts.size();
  report.border_texels = padding;
  double weight = 0, sum = 0, squares = 0;
  for (const FlatChart& chart : charts) {
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const Triangle& t = chart.triangles[i];
      const FlatPoint& a = chart.points[t[0]];
      const double flat =
          0.5 * cross(chart.points[t[1]] - a, chart.points[t[2]] - a) / (kSteps * kSteps);
      const double area = surface.area[chart.source[i]];
      const double density = std::log2(flat) - std::log2(area);
      report.coverage += flat;
      weight += area, sum += area * density, squares += area * density * density;
    }
  }
  const double mean = sum / weight;
  report.density_spread = std::sqrt(std::max(0.0, squares / weight - mean * mean));
  if (padding < options.border_texels) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%g", padding);
    report.warnings.push_back({"border-shrunk",
                               std::to_string(report.charts) +
                                   " charts leave no room for a border of " +
                                   std::to_string(options.border_texels) + " texels at a size of " +
                                   std::to_string(options.size) + "; it is " + text.data() +
                                   " texels: use a larger size or fewer faces",
                               report.charts});
  }
}

}  // namespace

Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads, const TexelDetail* detail) {
  std::vector<std::uint8_t> lone(mesh.triangles.size(), 0);
  // Each round sets at least one more triangle apart, and one by itself always has a place.
  for (;;) {
    const ChartSurface surface = make_surface(mesh, lone);
    MadeCharts made = make_charts(surface, options, lone, threads);
    std::vector<FlatChart>& charts = made.made.charts;
    Layout layout = pack(charts, made.packed ? &*made.packed : nullptr, options, threads);
    if (detail != nullptr)
      follow_detail(surface, mesh, *detail, options, made.made, layout, threads);
    bool failed = false;
    for (std::size_t i = 0; i < charts.size(); ++i) {
      place(charts[i], layout.packing.places[i], layout.packing.scale, options.size);
      failed = mark_failures(charts[i], lone) || failed;
    }
    if (failed) continue;
    if (report != nullptr) describe(surface, charts, layout.padding, options, *report);
    return write(mesh, surface, charts);
  }
}

}  // namespace kiln

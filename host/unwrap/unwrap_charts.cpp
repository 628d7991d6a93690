#include "unwrap/unwrap_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/counted.h"
#include "base/formatted.h"
#include "base/parallel.h"
#include "base/percent.h"
#include "mesh/half_edge.h"
#include "pack/bitmap_packing.h"
#include "pack/box_packing.h"
#include "unwrap/chart_choice.h"
#include "unwrap/chart_creases.h"
#include "unwrap/chart_density.h"
#include "unwrap/flat_predicates.h"

namespace kiln {
namespace {

/// UVs are whole multiples of 2^-24: single precision holds them exactly up to 1, and double precision
/// decides the side of a point without rounding.
constexpr double kSteps = 16777216;
/// Above this many charts they are packed by their boxes.
constexpr std::size_t kMostBitmaps = 10000;
/// A padding that leaves less of the map than this to charts may be halved: where that raises it by a factor.
constexpr double kWantedCoverage = 0.25, kWorthwhile = 1.3;
/// Below a texel only where hardly anything, or nothing, is left.
constexpr double kHardlyAny = 0.02;
/// Texels by detail are left alone where they are expected to gain less than this.
constexpr double kLeastGain = 0.01;
/// Share of the surface above which charts narrower than a texel are worth a warning: less is rims and fillets.
constexpr double kMostNarrow = 0.25;

/// A triangle by itself, as an equilateral one: what is too small for a place in a chart.
FlatChart lone_chart(const ChartSurface& surface, ChartBorders& borders, std::uint32_t t,
                     double side, std::vector<std::uint32_t>& local) {
  const std::array<std::uint32_t, 1> triangle{t};
  FlatChart chart = cut_open(surface, triangle, borders.glued(), local);
  for (std::uint32_t k = 0; k < 3; ++k) side = std::max(side, surface.length[3 * t + k]);
  chart.points = {{0, 0}, {side, 0}, {0.5 * side, std::sqrt(0.75) * side}};
  return chart;
}

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
  part_at_creases(surface);
  return surface;
}

/// Lays triangles by themselves, which have the size of a texel.
void lay_lone(const ChartSurface& surface, const UnwrapOptions& options,
              const std::vector<std::uint8_t>& lone, ChosenCharts& chosen) {
  const double texel = std::sqrt(surface.total_area) / options.size;
  std::vector<std::uint32_t> local(surface.triangles.size());
  for (FlatChart& chart : chosen.charts) {
    if (lone[chart.source[0]] != 0)
      chart = lone_chart(surface, chosen.borders, chart.source[0], texel, local);
  }
}

struct Layout {
  OutlinePacking packing;
  double padding = 0, coverage = 0;
};

Layout pack_with(std::span<const Outline> outlines, std::uint32_t size, double padding,
                 const PackState* from, int threads) {
  // Rounding to UV steps may move two borders towards each other.
  const double apart = padding + 4 * size / kSteps;
  const auto packed = [&] {
    if (outlines.size() > kMostBitmaps) return pack_boxes(outlines, size, apart);
    return pack_outlines(outlines, size, apart, from, threads);
  };
  Layout layout{packed(), padding};
  const double side = layout.packing.scale / size;
  for (const Outline& outline : outlines) layout.coverage += outline.area * side * side;
  return layout;
}

/// With the padding asked for, or with less where that lets charts have many more texels.
Layout pack(const std::vector<FlatChart>& charts, const PackState* from,
            const UnwrapOptions& options, int threads) {
  const std::vector<Outline> outlines = outlines_of(charts);
  Layout best = pack_with(outlines, options.size, options.border_texels, from, threads);
  while (best.coverage < kWantedCoverage && (best.padding > 1 || best.coverage < kHardlyAny)) {
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

/// The price of a cut for other densities.
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
                   const UnwrapOptions& options, ChosenCharts& made, Layout& layout, int threads) {
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
  ChosenCharts next = made;
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
      for (Vec2d& p : charts[i].points) p = p * scales[i];
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
  for (Vec2d& p : chart.points) {
    const Vec2d q = p * scale;
    const Vec2d texel{at.turn.x * q.x - at.turn.y * q.y + at.shift.x,
                      at.turn.y * q.x + at.turn.x * q.y + at.shift.y};
    p = {std::round(texel.x / size * kSteps), std::round(texel.y / size * kSteps)};
  }
}

/// Charts in whole steps, mended where rounding flattened a triangle or let the border touch itself.
class RoundedChart {
 public:
  explicit RoundedChart(FlatChart& chart) : chart_(chart) {}

  /// Moves vertices by a few steps. \returns whether that mends all
  bool mend() {
    for (int attempt = 0; attempt < kMostMends; ++attempt) {
      const std::vector<std::size_t> flat = flattened();
      const auto touch = flat.empty() ? first_touch(outline_of(chart_)) : std::nullopt;
      if (flat.empty() && !touch) return true;
      for (const std::size_t i : flat) widen(chart_.triangles[i]);
      if (touch) part(touch->first, touch->second);
    }
    return false;
  }

  /// Marks the flattened triangles; where none is, those at two places where the border touches itself.
  void mark(std::vector<std::uint8_t>& lone) const {
    const std::vector<std::size_t> flat = flattened();
    for (const std::size_t i : flat) lone[chart_.source[i]] = 1;
    if (!flat.empty()) return;
    const auto touch = first_touch(outline_of(chart_));
    if (!touch) return;
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = chart_.triangles[i][k];
        if (from != chart_.boundary[touch->first] && from != chart_.boundary[touch->second])
          continue;
        lone[chart_.source[i]] = 1;
      }
    }
  }

 private:
  /// At most 0.19 texels of 16384 altogether, if all move one vertex.
  static constexpr int kMostMends = 64;
  static constexpr double kMendSteps = 3;

  std::vector<std::size_t> flattened() const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const Triangle& t = chart_.triangles[i];
      if (!orient2d_certain(chart_.points[t[0]], chart_.points[t[1]], chart_.points[t[2]]))
        result.push_back(i);
    }
    return result;
  }

  /// Moves a vertex to the left of a direction.
  void move(std::uint32_t v, const Vec2d& along) {
    const double size = std::hypot(along.x, along.y);
    const Vec2d left =
        size > 0 ? Vec2d{-along.y, along.x} * (kMendSteps / size) : Vec2d{0, kMendSteps};
    Vec2d& p = chart_.points[v];
    p = {std::round(p.x + left.x), std::round(p.y + left.y)};
  }

  /// Moves the corner opposite to the longest side away from that.
  void widen(const Triangle& t) {
    std::size_t longest = 0;
    Vec2d along;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d side = chart_.points[t[(k + 1) % 3]] - chart_.points[t[k]];
      if (dot(side, side) <= dot(along, along)) continue;
      along = side;
      longest = k;
    }
    move(t[(longest + 2) % 3], along);
  }

  const Vec2d& border(std::size_t i) const {
    return chart_.points[chart_.boundary[i % chart_.boundary.size()]];
  }

  /// Distance between a side and a corner of the border, and the corner's direction.
  struct Near {
    double squared = std::numeric_limits<double>::max();
    std::size_t side = 0, corner = 0;
  };

  /// Moves a side and the corner of another that is nearest to it apart.
  void part(std::size_t a, std::size_t b) {
    Near near;
    for (const std::size_t end : {0, 1}) {
      for (const auto& [side, corner] : {std::pair{a, b + end}, std::pair{b, a + end}}) {
        const Vec2d along = border(side + 1) - border(side), to = border(corner) - border(side);
        const double at = std::clamp(dot(to, along) / std::max(dot(along, along), 1.0), 0.0, 1.0);
        const Vec2d off = to - along * at;
        if (corner % count() == side || corner % count() == (side + 1) % count()) continue;
        if (dot(off, off) < near.squared) near = {dot(off, off), side, corner % count()};
      }
    }
    if (near.squared == std::numeric_limits<double>::max()) return;
    // The corner goes back to where its neighbours are, mostly outside of the side.
    const Vec2d from = border(near.side), along = border(near.side + 1) - from;
    const double inside = cross(along, border(near.corner + count() - 1) - from) +
                          cross(along, border(near.corner + 1) - from);
    const Vec2d away = inside > 0 ? along * -1 : along;
    move(chart_.boundary[near.corner], away * -1);
    move(chart_.boundary[near.side], away);
    move(chart_.boundary[(near.side + 1) % count()], away);
  }

  std::size_t count() const { return chart_.boundary.size(); }

  FlatChart& chart_;
};

Mesh write(const Mesh& mesh, const ChartSurface& surface, const std::vector<FlatChart>& charts) {
  Mesh result = mesh;
  result.tangents.clear();  // those of other UVs
  result.uvs = {{0, 0}};    // All corners of the triangles that cover nothing.
  result.uv_triangles.assign(mesh.triangles.size(), Triangle{0, 0, 0});
  for (const FlatChart& chart : charts) {
    const auto first = static_cast<std::uint32_t>(result.uvs.size());
    for (const Vec2d& p : chart.points) {
      result.uvs.push_back({static_cast<float>(p.x / kSteps), static_cast<float>(p.y / kSteps)});
    }
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      Triangle& uv = result.uv_triangles[surface.source[chart.source[i]]];
      for (std::size_t k = 0; k < 3; ++k) uv[k] = first + chart.triangles[i][k];
    }
  }
  return result;
}

/// A chart's area over half the length of its border: the width of a strip. As a share of the map's side.
double width_of(const FlatChart& chart) {
  double twice = 0, length = 0;
  for (std::size_t i = 0; i < chart.boundary.size(); ++i) {
    const Vec2d &a = chart.points[chart.boundary[i]],
                &b = chart.points[chart.boundary[(i + 1) % chart.boundary.size()]];
    twice += cross(a, b);
    length += std::sqrt(dot(b - a, b - a));
  }
  return length > 0 ? twice / length / kSteps : 0;
}

void describe(const ChartSurface& surface, const std::vector<FlatChart>& charts, double padding,
              const UnwrapOptions& options, UnwrapReport& report) {
  report.charts = charts.size();
  report.border_texels = padding;
  double weight = 0, sum = 0, squares = 0, narrow = 0;
  std::uint64_t narrow_charts = 0;
  for (const FlatChart& chart : charts) {
    const bool is_narrow = width_of(chart) * options.size < 1;
    narrow_charts += is_narrow ? 1 : 0;
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const Triangle& t = chart.triangles[i];
      const Vec2d& a = chart.points[t[0]];
      const double flat =
          0.5 * cross(chart.points[t[1]] - a, chart.points[t[2]] - a) / (kSteps * kSteps);
      const double area = surface.area[chart.source[i]];
      const double density = std::log2(flat) - std::log2(area);
      report.coverage += flat;
      weight += area, sum += area * density, squares += area * density * density;
      if (is_narrow) narrow += area;
    }
  }
  const double mean = sum / weight;
  report.density_spread = std::sqrt(std::max(0.0, squares / weight - mean * mean));
  if (padding < options.border_texels) {
    const std::string text = decimal(padding);
    report.warnings.push_back({"border-shrunk",
                               std::to_string(report.charts) +
                                   " charts leave no room for a border of " +
                                   std::to_string(options.border_texels) + " texels at a size of " +
                                   std::to_string(options.size) + "; it is " + text +
                                   " texels: use a larger size or fewer faces",
                               report.charts});
  }
  if (narrow > kMostNarrow * weight) {
    report.warnings.push_back(
        {"narrow-charts",
         counted(narrow_charts, "chart") + ", of " + percent(narrow / weight, 2) +
             " of the surface, narrower than a texel at a size of " + std::to_string(options.size) +
             ": maps blur there, and shading may be worse with than without them: use a larger "
             "size or fewer faces",
         narrow_charts});
  }
}

}  // namespace

struct KnownCharts::State {
  std::unique_ptr<ChartSurface> surface;
  std::optional<ChosenCharts> chosen;  ///< Relaxed, not yet at their places.
};

KnownCharts::KnownCharts() : state_(std::make_unique<State>()) {}
KnownCharts::~KnownCharts() = default;

Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads, const TexelDetail* detail, KnownCharts* kept) {
  KnownCharts own;
  KnownCharts::State& known = kept != nullptr ? kept->state() : own.state();
  std::vector<std::uint8_t> lone(mesh.triangles.size(), 0);
  // Each round sets at least one more triangle apart, and one by itself always has a place.
  for (;;) {
    if (!known.chosen) known.surface = std::make_unique<ChartSurface>(make_surface(mesh, lone));
    const ChartSurface& surface = *known.surface;
    ChosenCharts made = known.chosen ? *known.chosen : choose_charts(surface, options, threads);
    if (!known.chosen) relax_charts(made.charts, threads);
    if (kept != nullptr && !known.chosen && made.any_size) known.chosen.emplace(made);
    lay_lone(surface, options, lone, made);
    std::vector<FlatChart>& charts = made.charts;
    Layout layout = pack(charts, made.packed ? &*made.packed : nullptr, options, threads);
    if (detail != nullptr) follow_detail(surface, mesh, *detail, options, made, layout, threads);
    bool failed = false;
    for (std::size_t i = 0; i < charts.size(); ++i) {
      place(charts[i], layout.packing.places[i], layout.packing.scale, options.size);
      RoundedChart rounded(charts[i]);
      if (rounded.mend()) continue;
      rounded.mark(lone);
      failed = true;
    }
    if (failed) {
      known.chosen.reset();
      continue;
    }
    // Triangles handled apart may lead to other charts.
    if (std::find(lone.begin(), lone.end(), 1) != lone.end()) known.chosen.reset();
    if (report != nullptr) describe(surface, charts, layout.padding, options, *report);
    return write(mesh, surface, charts);
  }
}

}  // namespace kiln

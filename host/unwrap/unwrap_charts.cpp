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

/// Number of UV steps along a side of the map. UVs are multiples of 2^-24. Single precision represents these exactly up
/// to 1, and double precision decides without rounding on which side of a line a point with such coordinates lies.
constexpr double kUvSteps = 16777216;
/// If there are more charts than this, they are packed by their bounding boxes instead of their shapes.
constexpr std::size_t kMaxBitmapCharts = 10000;
/// If charts cover less of the map than kMinWantedCoverage, the padding is halved repeatedly, as long as each halving
/// multiplies the coverage by at least kMinCoverageGain.
constexpr double kMinWantedCoverage = 0.25, kMinCoverageGain = 1.3;
/// The padding falls below a texel only if charts cover less than this share of the map.
constexpr double kMaxSubtexelCoverage = 0.02;
/// Texel density stays uniform if adapting it would lower the error by less than this share.
constexpr double kMinExpectedGain = 0.01;
/// A warning is given if more than this share of the surface lies in charts narrower than a texel. Rims and fillets
/// typically have less.
constexpr double kMaxNarrowShare = 0.25;

/// Makes a separate, equilateral chart of a triangle that is too small in its chart's layout. The new chart's sides are
/// at least `side` long.
FlatChart separate_triangle_chart(const ChartSurface& surface, ChartBorders& borders,
                                  std::uint32_t t, double side,
                                  std::vector<std::uint32_t>& index_in_chart) {
  const std::array<std::uint32_t, 1> triangle{t};
  FlatChart chart = cut_open(surface, triangle, borders.glued(), index_in_chart);
  for (std::uint32_t k = 0; k < 3; ++k) side = std::max(side, surface.length[3 * t + k]);
  chart.points = {{0, 0}, {side, 0}, {0.5 * side, std::sqrt(0.75) * side}};
  return chart;
}

ChartSurface make_surface(const Mesh& mesh, const std::vector<std::uint8_t>& is_separate) {
  ChartSurface surface = chart_surface(mesh);
  if (surface.triangles.empty()) {
    throw Error(ErrorCode::input,
                "unwrap: mesh '" + mesh.name +
                    "' has no triangle of positive area; check the file it was read from");
  }
  for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
    if (is_separate[h / 3] == 0 || surface.mate[h] == kNoIndex) continue;
    surface.mate[surface.mate[h]] = kNoIndex;
    surface.mate[h] = kNoIndex;
  }
  separate_at_creases(surface);
  return surface;
}

/// Makes each separated triangle a chart that is at least a texel long.
void lay_out_separate_triangles(const ChartSurface& surface, const UnwrapOptions& options,
                                const std::vector<std::uint8_t>& is_separate,
                                ChosenCharts& chosen) {
  const double texel_side = std::sqrt(surface.total_area) / options.size;
  std::vector<std::uint32_t> index_in_chart(surface.triangles.size());
  for (FlatChart& chart : chosen.charts) {
    if (is_separate[chart.source[0]] != 0)
      chart = separate_triangle_chart(surface, chosen.borders, chart.source[0], texel_side,
                                      index_in_chart);
  }
}

struct PackedLayout {
  OutlinePacking packing;
  double padding = 0, coverage = 0;
};

PackedLayout pack_with(std::span<const Outline> outlines, std::uint32_t size, double padding,
                       const PackState* from, int threads) {
  // The minimum distance between borders is the padding, plus the rounding of two borders to UV steps.
  const double min_distance = padding + 4 * size / kUvSteps;
  const auto packed = [&] {
    if (outlines.size() > kMaxBitmapCharts) return pack_boxes(outlines, size, min_distance);
    return pack_outlines(outlines, size, min_distance, from, threads);
  };
  PackedLayout layout{packed(), padding};
  const double side = layout.packing.scale / size;
  for (const Outline& outline : outlines) layout.coverage += outline.area * side * side;
  return layout;
}

/// Packs charts with the requested padding, or with less if they then cover much more of the map.
PackedLayout pack(const std::vector<FlatChart>& charts, const PackState* from,
                  const UnwrapOptions& options, int threads) {
  const std::vector<Outline> outlines = outlines_of(charts);
  PackedLayout best = pack_with(outlines, options.size, options.border_texels, from, threads);
  while (best.coverage < kMinWantedCoverage &&
         (best.padding > 1 || best.coverage < kMaxSubtexelCoverage)) {
    if (best.padding < 1.0 / 1024) {
      throw Error(ErrorCode::input, "unwrap: the mesh has too many charts for a texture of " +
                                        std::to_string(options.size) +
                                        " texels; simplify it first, or use a larger size");
    }
    PackedLayout next = pack_with(outlines, options.size, 0.5 * best.padding, nullptr, threads);
    // Long thin charts leave space unused at any padding.
    if (best.coverage > 0 && next.coverage < kMinCoverageGain * best.coverage) break;
    best = std::move(next);
  }
  return best;
}

/// Price of a cut that separates parts of different texel density.
DensityPrice density_price(const ChartSurface& surface, const UnwrapOptions& options) {
  const double texel_side = std::sqrt(surface.total_area / kExpectedCoverage) / options.size;
  double length = 0;
  for (const double side : surface.length) length += side;
  const double edge = length / static_cast<double>(surface.length.size());
  const double vertex =
      kVertexPrice * surface.total_area / static_cast<double>(surface.positions.size());
  return {0.5 * options.border_texels * texel_side, vertex / edge,
          kMinPartShare * surface.total_area};
}

/// Scales charts by their detail. Compares layouts with and without additional cuts, and keeps the layout with the
/// lowest expected error if this error is below that of uniform density.
/// \param mesh    mesh of the surface
/// \param layout  [in, out] on entry the packed charts at uniform density, on return those of the chosen layout
void scale_by_detail(const ChartSurface& surface, const Mesh& mesh, const TexelDetail& detail,
                     const UnwrapOptions& options, ChosenCharts& chosen_charts,
                     PackedLayout& layout, int threads) {
  const FlatTriangles flat =
      flat_triangles(surface, chosen_charts.borders, chosen_charts.charts, mesh.triangles.size());
  const std::vector<TexelNeed> needs =
      texel_needs(surface, detail.errors(mesh, flat, options.size, threads));
  const double uniform_scale = std::sqrt(kExpectedCoverage / surface.total_area) * options.size;
  const auto error_of = [&](const std::vector<FlatChart>& charts, std::vector<double> scales,
                            const PackedLayout& packed) {
    for (double& s : scales) s *= packed.packing.scale / uniform_scale;
    return expected_error(chart_needs(charts, needs), scales);
  };
  double min_error =
      (1 - kMinExpectedGain) *
      error_of(chosen_charts.charts, std::vector<double>(chosen_charts.charts.size(), 1), layout);
  ChosenCharts next = chosen_charts;
  for (const bool cut : {false, true}) {
    const std::size_t before = next.charts.size();
    if (cut) {
      cut_by_density(surface, next.borders, density_price(surface, options), needs, next.charts);
      if (next.charts.size() == before) break;
    }
    const std::vector<double> scales = texel_scales(chart_needs(next.charts, needs));
    // Packing hardly changes the expected error. So a candidate that promises no gain is skipped before it is packed.
    if (error_of(next.charts, scales, layout) >= min_error) continue;
    std::vector<FlatChart> charts = next.charts;
    for (std::size_t i = 0; i < charts.size(); ++i) {
      for (Vec2d& p : charts[i].points) p = p * scales[i];
    }
    PackedLayout packed = pack(charts, nullptr, options, threads);
    const double error = error_of(charts, scales, packed);
    if (error >= min_error || packed.padding < layout.padding) continue;
    min_error = error;
    chosen_charts.charts = std::move(charts);
    layout = std::move(packed);
  }
}

/// Moves the chart's points to their positions in the texture, rounded to UV steps.
void place_chart(FlatChart& chart, const OutlinePlace& at, double scale, std::uint32_t size) {
  for (Vec2d& p : chart.points) {
    const Vec2d q = p * scale;
    const Vec2d texel{at.turn.x * q.x - at.turn.y * q.y + at.shift.x,
                      at.turn.y * q.x + at.turn.x * q.y + at.shift.y};
    p = {std::round(texel.x / size * kUvSteps), std::round(texel.y / size * kUvSteps)};
  }
}

/// Repairs a chart whose UVs were rounded to UV steps: triangles that rounding made degenerate, and border edges that
/// touch.
class RoundedChart {
 public:
  explicit RoundedChart(FlatChart& chart) : chart_(chart) {}

  /// Moves vertices by a few UV steps until the chart is injective.
  /// \returns true if it is
  bool repair() {
    for (int attempt = 0; attempt < kMaxRepairs; ++attempt) {
      const std::vector<std::size_t> flat = flattened_triangles();
      const auto touching_pair =
          flat.empty() ? first_touching_sides(outline_of(chart_)) : std::nullopt;
      if (flat.empty() && !touching_pair) return true;
      for (const std::size_t i : flat) widen_triangle(chart_.triangles[i]);
      if (touching_pair) separate_sides(touching_pair->first, touching_pair->second);
    }
    return false;
  }

  /// Marks the triangles to separate from the chart: those without area, or if there are none, those at one pair of
  /// touching border edges.
  void mark_separate_triangles(std::vector<std::uint8_t>& is_separate) const {
    const std::vector<std::size_t> flat = flattened_triangles();
    for (const std::size_t i : flat) is_separate[chart_.source[i]] = 1;
    if (!flat.empty()) return;
    const auto touching_pair = first_touching_sides(outline_of(chart_));
    if (!touching_pair) return;
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = chart_.triangles[i][k];
        if (from != chart_.boundary[touching_pair->first] &&
            from != chart_.boundary[touching_pair->second])
          continue;
        is_separate[chart_.source[i]] = 1;
      }
    }
  }

 private:
  /// Limits of repairs. Together, all repairs move a vertex by at most 0.19 texels of a map of 16384 x 16384.
  static constexpr int kMaxRepairs = 64;
  static constexpr double kRepairSteps = 3;

  std::vector<std::size_t> flattened_triangles() const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < chart_.triangles.size(); ++i) {
      const Triangle& t = chart_.triangles[i];
      if (!orient2d_certain(chart_.points[t[0]], chart_.points[t[1]], chart_.points[t[2]]))
        result.push_back(i);
    }
    return result;
  }

  /// Moves a vertex to the left of a direction, perpendicularly to it.
  void move_left_of(std::uint32_t v, const Vec2d& along) {
    const double size = std::hypot(along.x, along.y);
    const Vec2d left =
        size > 0 ? Vec2d{-along.y, along.x} * (kRepairSteps / size) : Vec2d{0, kRepairSteps};
    Vec2d& p = chart_.points[v];
    p = {std::round(p.x + left.x), std::round(p.y + left.y)};
  }

  /// Moves the corner opposite the longest side away from that side.
  void widen_triangle(const Triangle& t) {
    std::size_t longest = 0;
    Vec2d along{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d side = chart_.points[t[(k + 1) % 3]] - chart_.points[t[k]];
      if (dot(side, side) <= dot(along, along)) continue;
      along = side;
      longest = k;
    }
    move_left_of(t[(longest + 2) % 3], along);
  }

  const Vec2d& border(std::size_t i) const {
    return chart_.points[chart_.boundary[i % chart_.boundary.size()]];
  }

  /// Given two border edges that touch: the end point of one of them that is nearest to the other edge, that other
  /// edge, and their squared distance. Edges and points are indices on the border.
  struct NearestPair {
    double squared = std::numeric_limits<double>::max();
    std::size_t side = 0, corner = 0;
  };

  /// Separates two border edges: moves one of them, and the nearest end point of the other, away from each other.
  void separate_sides(std::size_t a, std::size_t b) {
    NearestPair nearest;
    for (const std::size_t end : {0, 1}) {
      for (const auto& [side, corner] : {std::pair{a, b + end}, std::pair{b, a + end}}) {
        const Vec2d along = border(side + 1) - border(side), to = border(corner) - border(side);
        const double at = std::clamp(dot(to, along) / std::max(dot(along, along), 1.0), 0.0, 1.0);
        const Vec2d offset = to - along * at;
        if (corner % count() == side || corner % count() == (side + 1) % count()) continue;
        if (dot(offset, offset) < nearest.squared)
          nearest = {dot(offset, offset), side, corner % count()};
      }
    }
    if (nearest.squared == std::numeric_limits<double>::max()) return;
    // The corner moves to the side on which its neighbours mostly lie.
    const Vec2d from = border(nearest.side), along = border(nearest.side + 1) - from;
    const double neighbour_side = cross(along, border(nearest.corner + count() - 1) - from) +
                                  cross(along, border(nearest.corner + 1) - from);
    const Vec2d push_direction = neighbour_side > 0 ? -along : along;
    move_left_of(chart_.boundary[nearest.corner], -push_direction);
    move_left_of(chart_.boundary[nearest.side], push_direction);
    move_left_of(chart_.boundary[(nearest.side + 1) % count()], push_direction);
  }

  std::size_t count() const { return chart_.boundary.size(); }

  FlatChart& chart_;
};

Mesh write_uvs(const Mesh& mesh, const ChartSurface& surface,
               const std::vector<FlatChart>& charts) {
  Mesh result = mesh;
  result.tangents.clear();  // tangents belong to the previous UVs
  result.uvs = {{0, 0}};    // The one UV shared by all corners of triangles without texels
  result.uv_triangles.assign(mesh.triangles.size(), Triangle{0, 0, 0});
  for (const FlatChart& chart : charts) {
    const auto first = static_cast<std::uint32_t>(result.uvs.size());
    for (const Vec2d& p : chart.points) {
      result.uvs.push_back(
          {static_cast<float>(p.x / kUvSteps), static_cast<float>(p.y / kUvSteps)});
    }
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      Triangle& uv = result.uv_triangles[surface.source[chart.source[i]]];
      for (std::size_t k = 0; k < 3; ++k) uv[k] = first + chart.triangles[i][k];
    }
  }
  return result;
}

/// Width of a chart if it is seen as a strip: its area over half the length of its border, as a share of the map's
/// side.
double strip_width(const FlatChart& chart) {
  double doubled_area = 0, length = 0;
  for (std::size_t i = 0; i < chart.boundary.size(); ++i) {
    const Vec2d &a = chart.points[chart.boundary[i]],
                &b = chart.points[chart.boundary[(i + 1) % chart.boundary.size()]];
    doubled_area += cross(a, b);
    length += std::sqrt(dot(b - a, b - a));
  }
  return length > 0 ? doubled_area / length / kUvSteps : 0;
}

void write_report(const ChartSurface& surface, const std::vector<FlatChart>& charts, double padding,
                  const UnwrapOptions& options, UnwrapReport& report) {
  report.charts = charts.size();
  report.border_texels = padding;
  double weight = 0, sum = 0, squares = 0, narrow_area = 0;
  std::uint64_t narrow_charts = 0;
  for (const FlatChart& chart : charts) {
    const bool is_narrow = strip_width(chart) * options.size < 1;
    narrow_charts += is_narrow ? 1 : 0;
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const Triangle& t = chart.triangles[i];
      const Vec2d& a = chart.points[t[0]];
      const double flat =
          0.5 * cross(chart.points[t[1]] - a, chart.points[t[2]] - a) / (kUvSteps * kUvSteps);
      const double area = surface.area[chart.source[i]];
      const double density = std::log2(flat) - std::log2(area);
      report.coverage += flat;
      weight += area, sum += area * density, squares += area * density * density;
      if (is_narrow) narrow_area += area;
    }
  }
  const double mean = sum / weight;
  report.density_spread = std::sqrt(std::max(0.0, squares / weight - mean * mean));
  if (padding < options.border_texels) {
    const std::string padding_text = decimal(padding);
    report.warnings.push_back({"border-shrunk",
                               std::to_string(report.charts) +
                                   " charts leave no room for a padding of " +
                                   std::to_string(options.border_texels) + " texels at a size of " +
                                   std::to_string(options.size) + "; the padding was reduced to " +
                                   padding_text + " texels. Use a larger size or fewer faces",
                               report.charts});
  }
  if (narrow_area > kMaxNarrowShare * weight) {
    report.warnings.push_back(
        {"narrow-charts",
         "charts narrower than a texel at a size of " + std::to_string(options.size) + " cover " +
             percent(narrow_area / weight, 2) + " of the surface (" +
             counted(narrow_charts, "chart") +
             "). Maps blur there, and shading may be worse with maps than without. Use a larger "
             "size or fewer faces",
         narrow_charts});
  }
}

}  // namespace

struct KnownCharts::State {
  std::unique_ptr<ChartSurface> surface;
  std::optional<ChosenCharts> chosen;  ///< Relaxed charts that are not placed on the map yet
};

KnownCharts::KnownCharts() : state_(std::make_unique<State>()) {}
KnownCharts::~KnownCharts() = default;

Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads, const TexelDetail* detail, KnownCharts* kept) {
  KnownCharts uncached_charts;
  KnownCharts::State& known = kept != nullptr ? kept->state() : uncached_charts.state();
  std::vector<std::uint8_t> is_separate(mesh.triangles.size(), 0);
  // The loop terminates: each round separates at least one more triangle, and a triangle with a chart of its own can
  // always be placed.
  for (;;) {
    if (!known.chosen)
      known.surface = std::make_unique<ChartSurface>(make_surface(mesh, is_separate));
    const ChartSurface& surface = *known.surface;
    ChosenCharts chosen_charts =
        known.chosen ? *known.chosen : choose_charts(surface, options, threads);
    if (!known.chosen) relax_charts(chosen_charts.charts, threads);
    if (kept != nullptr && !known.chosen && chosen_charts.is_independent_of_size)
      known.chosen.emplace(chosen_charts);
    lay_out_separate_triangles(surface, options, is_separate, chosen_charts);
    std::vector<FlatChart>& charts = chosen_charts.charts;
    PackedLayout layout =
        pack(charts, chosen_charts.packed ? &*chosen_charts.packed : nullptr, options, threads);
    if (detail != nullptr)
      scale_by_detail(surface, mesh, *detail, options, chosen_charts, layout, threads);
    bool any_chart_failed = false;
    for (std::size_t i = 0; i < charts.size(); ++i) {
      place_chart(charts[i], layout.packing.places[i], layout.packing.scale, options.size);
      RoundedChart rounded(charts[i]);
      if (rounded.repair()) continue;
      rounded.mark_separate_triangles(is_separate);
      any_chart_failed = true;
    }
    if (any_chart_failed) {
      known.chosen.reset();
      continue;
    }
    // Charts with separated triangles cannot be reused for another size.
    if (std::find(is_separate.begin(), is_separate.end(), 1) != is_separate.end())
      known.chosen.reset();
    if (report != nullptr) write_report(surface, charts, layout.padding, options, *report);
    return write_uvs(mesh, surface, charts);
  }
}

}  // namespace kiln

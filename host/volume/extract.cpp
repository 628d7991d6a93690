// Extracts the low poly and its map, step by step.
#include "volume/extract.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "base/counted.h"
#include "base/formatted.h"
#include "base/memory.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "mesh/charts.h"
#include "volume/atlas.h"
#include "volume/chart_map.h"
#include "volume/fine_mesh.h"
#include "volume/isosurface_repair.h"
#include "volume/normal_splat.h"
#include "volume/simplified_isosurface.h"
#include "volume/vertex_tree.h"

namespace kiln {
namespace {

/// Parts with fewer than this share of the largest part's vertices count as small. If at least
/// kMinNoiseParts parts are small, they are considered noise and removed.
constexpr double kMinPartShare = 0.01;
constexpr std::uint64_t kMinNoiseParts = 100;
/// Maximum number of triangles if no goal is given, as a share of the full contour's triangles.
constexpr double kMaxFaceShare = 0.05;

/// Peak memory of the low poly, its layout and its map: bytes per texel of the map and per face, as
/// measured.
struct PeakBytes {
  std::uint64_t texel, face;
};
constexpr PeakBytes kPairBytes{48, 1500}, kChartBytes{260, 4300};

/// \param size  side of the map
void require_map(const PeakBytes& bytes, const SimplifiedIsosurface& low_poly, const Volume& volume,
                 std::uint64_t size) {
  require_memory("The low poly of volume '" + volume.name + "' and its map",
                 bytes.texel * size * size + bytes.face * low_poly.faces);
}

/// Number of edges with more than two triangles.
std::uint64_t count_nonmanifold_edges(const Mesh& mesh) {
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k], b = t[(k + 1) % 3];
      edges.push_back(std::min(a, b) << 32 | std::max(a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    count += end - i > 2 ? 1 : 0;
    i = end;
  }
  return count;
}

double spacing_of(const Volume& volume) {
  double spacing = 0;
  for (const auto& axis : volume.axes) spacing += std::hypot(axis[0], axis[1], axis[2]) / 3;
  return spacing;
}

void report_surface(const SimplifiedIsosurface& low_poly, const ExtractOptions& options,
                    ExtractReport& report) {
  report.faces = low_poly.faces;
  for (const SimplifiedIsosurface::Polygon& polygon : low_poly.polygons) {
    ++(polygon.is_quad() ? report.quads : report.triangles);
  }
  report.error = low_poly.error;
  report.parts = low_poly.parts;
  report.dropped_parts = low_poly.dropped_parts;
  if (low_poly.dropped_parts != 0) {
    const std::string share = formatted("%g", 100 * report.used.min_part);
    report.warnings.push_back(
        {"small-parts",
         std::to_string(low_poly.dropped_parts) + " of " + std::to_string(low_poly.parts) +
             " parts of the surface have less than " + share +
             "% of the largest one's vertices and were left out" +
             (options.choose.min_part ? " as noise (" + option("min_part") + ")." : ", as asked."),
         low_poly.dropped_parts});
  }
  if (!low_poly.is_goal_reached) {
    report.warnings.push_back({"faces-not-reached",
                               "The low poly has " + std::to_string(low_poly.faces) +
                                   " faces instead of " + std::to_string(options.faces) +
                                   ": fewer would change the surface's topology.",
                               low_poly.faces});
  }
  if (!(low_poly.pieces == low_poly.fine_pieces)) {
    const auto words = [](const SimplifiedIsosurface::Pieces& pieces) {
      return counted(pieces.parts, "part") + " and " + counted(pieces.border_loops, "border loop");
    };
    report.warnings.push_back(
        {"border-changed",
         "The full contour has " + words(low_poly.fine_pieces) + ", the low poly " +
             words(low_poly.pieces) +
             ": strips of surface only one cell wide are lost where the volume's open border cuts "
             "them. Close the border, or ask for more faces.",
         1});
  }
  if (low_poly.changed_topology != 0) {
    const std::string kept_faces_text = std::to_string(report.used.kept_faces);
    const std::string reason = report.used.kept_faces == 0
                                   ? "."
                                   : "; keeping all of them takes " + kept_faces_text + " faces.";
    report.warnings.push_back({"topology-changed",
                               std::to_string(low_poly.changed_topology) +
                                   " vertices of the low poly merge several sheets of the surface: "
                                   "parts, holes or handles were lost there" +
                                   reason,
                               low_poly.changed_topology});
  }
}

void report_flaws(const IsosurfaceFlaws& flaws, const Volume& volume, ExtractReport& report) {
  report.mended = flaws.mended;
  report.left_out = flaws.removed_back_to_back;
  report.folded = flaws.folded.count;
  report.without_area = flaws.degenerate.count;
  report.repeated = flaws.duplicates.count;
  const auto warn = [&](const char* code, const IsosurfaceFlaws::RemainingFlaws& left,
                        const char* what, const char* remedy) {
    if (left.count == 0) return;
    const std::string place =
        formatted(", one at (%.5g, %.5g, %.5g)", volume.origin[0] + left.place.x,
                  volume.origin[1] + left.place.y, volume.origin[2] + left.place.z);
    report.warnings.push_back(
        {code, counted(left.count, "triangle") + " of the low poly " + what + place + remedy,
         left.count});
  };
  warn("folded-triangles", flaws.folded,
       flaws.folded.count == 1 ? "faces away from the full contour and could not be repaired"
                               : "face away from the full contour and could not be repaired",
       ": ask for more faces.");
  warn("flat-triangles", flaws.degenerate,
       flaws.degenerate.count == 1 ? "has no area and could not be repaired"
                                   : "have no area and could not be repaired",
       ": ask for more faces.");
  warn("repeated-triangles", flaws.duplicates,
       flaws.duplicates.count == 1 ? "has the same corners as another one"
                                   : "have the same corners as others",
       ": the volume has walls there that are thinner than the low poly's cells. Ask for more "
       "faces, or keep the topology.");
}

/// Simplifies the surface with the requested or automatically chosen settings.
SimplifiedIsosurface simplify_with_options(const FineSurface& surface, const VertexTree& tree,
                                           const Volume& volume, const ExtractOptions& options,
                                           ExtractUsed& used) {
  IsosurfaceOptions surface_options{
      .faces = options.faces,
      .error = options.error,
      .share = options.choose.error ? kMaxFaceShare : 1,
      .keep_topology = options.keep_topology || options.choose.topology,
      .min_part = options.min_part};
  if (options.choose.min_part) {
    const bool noise = count_small_parts(tree, kMinPartShare) >= kMinNoiseParts;
    surface_options.min_part = noise ? kMinPartShare : 0;
  }
  SimplifiedIsosurface low_poly = simplify_isosurface(surface, tree, volume, surface_options);
  if (options.choose.topology && low_poly.aimed_faces != 0 &&
      low_poly.faces > 2 * low_poly.aimed_faces) {
    used.kept_faces = low_poly.faces;
    surface_options.keep_topology = false;
    low_poly = simplify_isosurface(surface, tree, volume, surface_options);
  }
  used.error = low_poly.error_limit;
  used.keep_topology = surface_options.keep_topology;
  used.min_part = surface_options.min_part;
  used.aimed_faces = low_poly.aimed_faces;
  return low_poly;
}

void warn_of_fine_map(const Volume& volume, ExtractReport& report) {
  if (report.texels_per_cell < kMapTooFine) return;
  // Texel density is proportional to the map's size. The suggested size gives 2 texels per cell and
  // is rounded up to a multiple of 16.
  const double side = 2 * report.used.size / report.texels_per_cell;
  const auto better = static_cast<std::uint32_t>(16 * std::max(1.0, std::ceil(side / 16)));
  const std::string texels = formatted("%.3g", report.texels_per_cell);
  report.warnings.push_back(
      {"map-too-fine",
       "The map has " + texels + " texels per cell of volume '" + volume.name +
           "', but each cell has only about one normal. Texels between these are interpolated, so "
           "the map may look worse than none. Ask for about " +
           std::to_string(better) + " x " + std::to_string(better) +
           " texels (2 per cell), or bake the map with rays.",
       report.charts});
}

void report_atlas(const Atlas& atlas, const Volume& volume, const ExtractOptions& options,
                  ExtractReport& report) {
  report.charts = atlas.charts.size();
  report.coverage = uv_area(atlas.mesh);
  report.texels_per_cell = atlas.texels_per_unit * spacing_of(volume);
  report.non_manifold_edges = count_nonmanifold_edges(atlas.mesh);
  if (atlas.border != options.border_texels) {
    report.warnings.push_back({"border-shrunk",
                               "The map has too many charts for the requested padding: it is " +
                                   std::to_string(atlas.border) + " texels instead of " +
                                   std::to_string(options.border_texels) +
                                   ". Use a larger map, or ask for fewer faces.",
                               atlas.charts.size()});
  }
  warn_of_fine_map(volume, report);
}

void report_charts(const ChartLayout& layout, const Volume& volume, ExtractReport& report) {
  report.charts = layout.unwrapped.charts;
  report.coverage = layout.unwrapped.coverage;
  report.texels_per_cell = layout.texels_per_unit * spacing_of(volume);
  report.non_manifold_edges = count_nonmanifold_edges(layout.mesh);
  const std::vector<Warning>& warnings = layout.unwrapped.warnings;
  report.warnings.insert(report.warnings.end(), warnings.begin(), warnings.end());
  warn_of_fine_map(volume, report);
}

}  // namespace

void check_extract_options(const ExtractOptions& options) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (options.faces == 0 && !(options.error > 0 && std::isfinite(options.error))) {
    fail("The error is " + decimal(options.error) +
         " cells: give one above 0, or a number of faces.");
  }
  if (!(options.min_part >= 0 && options.min_part <= 1)) {
    fail("The minimum size of parts is " + decimal(options.min_part) +
         " times that of the largest part: give a share from 0 to 1.");
  }
  if (!options.choose.size && (options.size < 16 || options.size > 8192)) {
    fail("The map's size is " + std::to_string(options.size) + " texels; use 16 to 8192.");
  }
  if (options.unwrap == UnwrapMethod::squares) {
    fail("Low polys from volumes cannot be unwrapped into equal squares: choose pairs or charts.");
  }
  if (options.density == TexelDensity::detail && options.unwrap != UnwrapMethod::charts) {
    fail(
        "Only large charts can get texels by their detail: choose the layout of charts, or texels "
        "by area.");
  }
  if (options.border_texels < 1 || options.border_texels > 64) {
    fail("The border is " + std::to_string(options.border_texels) + " texels; use 1 to 64.");
  }
  if (options.space == NormalMapSpace::face) {
    fail("Maps from volumes cannot be in face space: choose tangent or object space.");
  }
}

ExtractResult extract_from(cl::Context& context, const Volume& volume, const FineSurface& surface,
                           const VertexTree& tree, const ExtractOptions& options,
                           const ContourReport& contour, double seconds_tree) {
  check_extract_options(options);
  const auto start = std::chrono::steady_clock::now();
  auto last = start;
  const auto restart_clock = [&] {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last).count();
    last = now;
    return seconds;
  };
  ExtractResult result;
  ExtractReport& report = result.report;
  report.contour = contour;
  ProgressGuard::poll_at(0, "simplifying");
  report.warnings = contour.warnings;
  SimplifiedIsosurface low_poly =
      simplify_with_options(surface, tree, volume, options, report.used);
  if (low_poly.polygons.empty()) {
    throw Error(ErrorCode::input, "The low poly of volume '" + volume.name +
                                      "' would have no faces: ask for more faces or a smaller "
                                      "error, or keep the topology.");
  }
  report.clusters = tree.count() - tree.leaves();
  const auto flaws = repair_isosurface(surface, volume, low_poly);
  report_surface(low_poly, options, report);
  report_flaws(flaws, volume, report);
  report.seconds_simplify = seconds_tree + restart_clock();
  ExtractOptions sized_options = options;
  const double spacing = spacing_of(volume);
  if (options.unwrap == UnwrapMethod::charts) {
    ProgressGuard::poll_at(0, "growing charts on " + counted(low_poly.polygons.size(), "polygon"));
    std::optional<TexelDetail> detail;
    if (options.density == TexelDensity::detail) detail.emplace(make_fine_mesh(surface, volume));
    const TexelDetail* by = detail ? &*detail : nullptr;
    ChartLayout layout =
        options.choose.size
            ? lay_out_charts_at(low_poly, volume, 1 / spacing, options.border_texels,
                                sized_options.size, by)
            : lay_out_charts(low_poly, volume, sized_options.size, options.border_texels, by);
    report.used.size = sized_options.size;
    require_map(kChartBytes, low_poly, volume, sized_options.size);
    report_charts(layout, volume, report);
    report.seconds_atlas = restart_clock();
    ProgressGuard::poll_at(0, "making the map");
    result.normal_map = make_chart_map(context, surface, low_poly, volume, layout, spacing,
                                       sized_options, report.splatted_texels);
    result.mesh = std::move(layout.mesh);
  } else {
    if (options.choose.size)
      sized_options.size = find_atlas_size(low_poly, 1 / spacing, options.border_texels);
    report.used.size = sized_options.size;
    require_map(kPairBytes, low_poly, volume, sized_options.size);
    Atlas atlas = make_atlas(low_poly, volume, sized_options.size, options.border_texels);
    report_atlas(atlas, volume, options, report);
    report.seconds_atlas = restart_clock();
    result.normal_map = splat_normals(context, surface, low_poly, atlas, report.texels_per_cell,
                                      sized_options, report.splatted_texels);
    result.mesh = std::move(atlas.mesh);
  }
  report.seconds_map = restart_clock();
  report.seconds_total = std::chrono::duration<double>(last - start).count() + seconds_tree;
  return result;
}

ExtractResult extract(const Device& device, const Volume& volume, const ExtractOptions& options) {
  check_extract_options(options);
  const auto start = std::chrono::steady_clock::now();
  ContourReport contour;
  ProgressGuard::poll_at(0, "contouring");
  const FineSurface surface =
      fine_surface(context_of(device), volume, options.contour, true, contour);
  const auto contour_end = std::chrono::steady_clock::now();
  const VertexTree tree(surface, volume.size, options.contour.border == VolumeBorder::open);
  const auto seconds = [](auto from, auto to) {
    return std::chrono::duration<double>(to - from).count();
  };
  ExtractResult result = extract_from(context_of(device), volume, surface, tree, options, contour,
                                      seconds(contour_end, std::chrono::steady_clock::now()));
  result.report.seconds_total += seconds(start, contour_end);
  return result;
}

}  // namespace kiln

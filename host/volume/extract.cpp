// The light mesh and its map, step by step.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "kiln/contour.h"
#include "volume/atlas.h"
#include "volume/fine_surface.h"
#include "volume/light_surface.h"
#include "volume/normal_splat.h"
#include "volume/vertex_tree.h"

namespace kiln {
namespace {

void check(const ExtractOptions& options) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (options.faces == 0 && !(options.error > 0 && std::isfinite(options.error))) {
    fail("The error is " + std::to_string(options.error) +
         " cells: give one above 0, or a number of faces.");
  }
  if (!(options.min_part >= 0 && options.min_part <= 1)) {
    fail("The least part is " + std::to_string(options.min_part) +
         " of the largest: give a share from 0 to 1.");
  }
  if (options.size < 16 || options.size > 8192) {
    fail("The map's size is " + std::to_string(options.size) + " texels; use 16 to 8192.");
  }
  if (options.border_texels < 1 || options.border_texels > 64) {
    fail("The border is " + std::to_string(options.border_texels) + " texels; use 1 to 64.");
  }
  if (options.space == NormalMapSpace::face) {
    fail("Maps from volumes are in tangent or object space, not in the faces' own.");
  }
}

/// Edges with more than two triangles.
std::uint64_t crowded_edges(const Mesh& mesh) {
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

}  // namespace

ExtractResult extract(const Device& device, const Volume& volume, const ExtractOptions& options) {
  check(options);
  const auto start = std::chrono::steady_clock::now();
  auto last = start;
  const auto lap = [&] {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last).count();
    last = now;
    return seconds;
  };
  ExtractResult result;
  ExtractReport& report = result.report;
  const FineSurface surface =
      fine_surface(device.context(), volume, options.contour, true, report.contour);
  report.warnings = report.contour.warnings;
  lap();
  const VertexTree tree(surface, volume.size, options.contour.border == VolumeBorder::open);
  const LightSurface light = choose_light_surface(surface, tree, volume,
                                                  {.faces = options.faces,
                                                   .error = options.error,
                                                   .keep_topology = options.keep_topology,
                                                   .min_part = options.min_part});
  if (light.polygons.empty()) {
    throw Error(ErrorCode::input, "Nothing of the surface of volume '" + volume.name +
                                      "' is left: ask for more faces or a smaller error, or keep "
                                      "the topology.");
  }
  report.clusters = tree.count() - tree.leaves();
  report.faces = light.faces;
  for (const LightSurface::Polygon& polygon : light.polygons) {
    ++(polygon.is_quad() ? report.quads : report.triangles);
  }
  report.error = light.error;
  report.parts = light.parts;
  if (light.dropped_parts != 0) {
    report.warnings.push_back({"small-parts",
                               std::to_string(light.dropped_parts) + " of " +
                                   std::to_string(light.parts) +
                                   " parts of the surface are small and were left out, as asked.",
                               light.dropped_parts});
  }
  if (!light.reached) {
    report.warnings.push_back({"faces-not-reached",
                               "The light mesh has " + std::to_string(light.faces) +
                                   " faces instead of " + std::to_string(options.faces) +
                                   ": fewer would change the surface's topology.",
                               light.faces});
  }
  if (light.changed_topology != 0) {
    report.warnings.push_back({"topology-changed",
                               std::to_string(light.changed_topology) +
                                   " vertices of the light mesh stand for more than one sheet: "
                                   "parts, holes or handles were lost there.",
                               light.changed_topology});
  }
  report.seconds_simplify = lap();
  Atlas atlas = make_atlas(light, volume, options.size, options.border_texels);
  report.charts = atlas.charts.size();
  report.coverage = static_cast<double>(atlas.texels) / options.size / options.size;
  double spacing = 0;
  for (const auto& axis : volume.axes) spacing += std::hypot(axis[0], axis[1], axis[2]) / 3;
  report.texels_per_cell = atlas.texels_per_unit * spacing;
  if (atlas.border != options.border_texels) {
    report.warnings.push_back({"border-shrunk",
                               "Charts are many for the map's size: their border is " +
                                   std::to_string(atlas.border) + " texels instead of " +
                                   std::to_string(options.border_texels) + ".",
                               atlas.charts.size()});
  }
  if (report.texels_per_cell >= kMapTooFine) {
    // Texels a cell go with the size; a multiple of 16 at or above what comes to 2.
    const double side = 2 * options.size / report.texels_per_cell;
    const auto better = static_cast<std::uint32_t>(16 * std::max(1.0, std::ceil(side / 16)));
    char texels[32];
    std::snprintf(texels, sizeof texels, "%.3g", report.texels_per_cell);
    report.warnings.push_back(
        {"map-too-fine",
         std::string("The map has ") + texels + " texels a cell of volume '" + volume.name +
             "', whose fine vertices give one normal each: the rest is filled in between, and may "
             "be worse than no map. Ask for about " +
             std::to_string(better) + " x " + std::to_string(better) +
             " texels (2 a cell), or match by rays.",
         report.charts});
  }
  report.non_manifold_edges = crowded_edges(atlas.mesh);
  report.seconds_atlas = lap();
  result.normal_map =
      splat_normals(device.context(), surface, light, atlas, options, report.splatted_texels);
  result.mesh = std::move(atlas.mesh);
  report.seconds_map = lap();
  report.seconds_total = std::chrono::duration<double>(last - start).count();
  return result;
}

}  // namespace kiln

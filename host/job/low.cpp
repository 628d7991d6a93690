// Makes the low poly of a bake: reads, simplifies or unwraps it.
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>

#include "base/progress_guard.h"
#include "job/files.h"
#include "job/job_options.h"
#include "job/match_inputs.h"
#include "job/stages.h"
#include "job/streaming.h"
#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "options/parse.h"
#include "simplify/streamed_simplify.h"

namespace kiln {

namespace {

// Minimum angle in degrees between faces at a soft seam. The limit excludes cylinders of twelve sides with smooth
// normals, whose faces meet at 30 degrees.
constexpr double kMinSoftSeamDegrees = 40;

PolygonCounts count_polygons(const Mesh& mesh) {
  PolygonCounts counts;
  for (std::size_t first = 0, t = 1; t <= mesh.polygons.size(); ++t) {
    if (t < mesh.polygons.size() && mesh.polygons[t] == mesh.polygons[first]) continue;
    if (t - first == 2) ++counts.quads;
    if (t - first > 2) ++counts.larger_polygons;
    first = t;
  }
  return counts;
}

/// Detects soft seams, and splits them if requested; else prepares a warning. choose_seam_normals() decides whether the
/// split or the warning helps.
void detect_soft_seams(const Job& job, LowMesh& low) {
  if (low.mesh.uv_triangles.empty()) return;  // the bake reports missing UVs
  const SoftSeams seams = soft_seams(low.mesh, kMinSoftSeamDegrees);
  low.soft_seams = seams.edges;
  if (job.split_at_seams) {
    low.mesh_before_split = low.mesh;
    low.mesh = split_at_seams(low.mesh);
    low.made = true;
    return;
  }
  // Only the author knows whether a mesh without normals is meant to be smooth or has lost its normals, so such a mesh
  // gets no warning. A small share of soft seams occurs by chance, as on scans, and hardly affects the mean error.
  if (seams.between_flats == 0 || seams.between_flats * 10 < seams.edges) return;
  // Low polys that Kiln made have normals that suit a map already; see fit_normals().
  const std::vector<std::string> files = low_files(job);
  if (std::all_of(job.low.given.begin(), job.low.given.end(),
                  [](const JobInput& input) { return input.simplified != nullptr; })) {
    return;
  }
  if (std::all_of(files.begin(), files.end(), is_obj_by_kiln)) return;
  const auto world_coordinate = [&](double origin, float value) { return origin + double{value}; };
  const std::string text = formatted(
      " has %s with smooth normals between flat faces, for example at (%.5g, %.5g, "
      "%.5g), where the faces meet at %.0f degrees. ",
      plural(seams.between_flats, "UV seam").c_str(),
      world_coordinate(low.mesh.origin[0], seams.example.x),
      world_coordinate(low.mesh.origin[1], seams.example.y),
      world_coordinate(low.mesh.origin[2], seams.example.z), seams.example_degrees);
  low.soft_seam_warning = {"soft-seams",
                           "LOW " + quote_files(low_files(job)) + text +
                               "The normal map needs gradients there. Make these edges hard in the "
                               "modelling tool, or add " +
                               option("split_at_seams") + ".",
                           seams.between_flats};
}

/// Unwraps each material or object into a unit square of its own.
Mesh unwrap_sets(const Job& job, Mesh mesh, const UnwrapOptions& layout, UnwrapReport& report) {
  const bool by_material = job.sets == SetsBy::material;
  const auto& set_of_triangle = by_material ? mesh.materials : mesh.objects;
  const auto& names = by_material ? mesh.material_names : mesh.object_names;
  mesh.uvs.clear();
  mesh.tangents.clear();
  mesh.uv_triangles.assign(mesh.triangles.size(), {});
  std::size_t sets = 0;
  for (std::uint32_t set = 0; set < std::max<std::size_t>(names.size(), 1); ++set) {
    const auto is_in_set = [&](std::size_t t) {
      return set_of_triangle.empty() || set_of_triangle[t] == set;
    };
    Mesh set_mesh;
    set_mesh.name = set_of_triangle.empty() ? mesh.name : names[set];
    set_mesh.origin = mesh.origin;
    set_mesh.positions = mesh.positions;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (is_in_set(t)) set_mesh.triangles.push_back(mesh.triangles[t]);
    }
    if (set_mesh.triangles.empty()) continue;
    UnwrapOptions set_layout = layout;
    for (const SetSize& size : job.set_sizes) {
      if (size.set == set_mesh.name) set_layout.size = std::min(size.width, size.height);
    }
    UnwrapReport set_report;
    set_mesh = unwrap(set_mesh, set_layout, &set_report);
    const auto first = static_cast<std::uint32_t>(mesh.uvs.size());
    mesh.uvs.insert(mesh.uvs.end(), set_mesh.uvs.begin(), set_mesh.uvs.end());
    for (std::size_t t = 0, next = 0; t < mesh.triangles.size(); ++t) {
      if (!is_in_set(t)) continue;
      const Triangle& uvs = set_mesh.uv_triangles[next++];
      mesh.uv_triangles[t] = {first + uvs[0], first + uvs[1], first + uvs[2]};
    }
    report.charts += set_report.charts;
    report.seconds += set_report.seconds;
    report.coverage += (set_report.coverage - report.coverage) / static_cast<double>(++sets);
    report.density_spread = std::max(report.density_spread, set_report.density_spread);
    report.border_texels = sets == 1 ? set_report.border_texels
                                     : std::min(report.border_texels, set_report.border_texels);
    for (Warning& warning : set_report.warnings) {
      warning.message = "'" + set_mesh.name + "': " + warning.message;
      report.warnings.push_back(std::move(warning));
    }
  }
  return mesh;
}

}  // namespace

LowMesh prepare_low(const Job& job, const LoadedHigh& loaded, RunLog& log) {
  const HighPolyInput& input = loaded.input;
  std::vector<Warning>& warnings = log.warnings;
  std::optional<Mesh> reduced;  // the mesh that LOW is made from if HIGH is larger than memory
  if (loaded.chunks != nullptr) {
    ProgressGuard progress_guard(
        [&](double, std::string_view stage) { return log.report_progress(kProgressAtLow, stage); });
    reduced = reduce(*loaded.chunks, job.low.make.faces);
  }
  const Mesh& high = reduced ? *reduced : loaded.mesh();
  const BakeOptions& bake_options = job.bake;
  const UnwrapOptions layout =
      unwrap_options(job.unwrap_method, std::min(bake_options.width, bake_options.height),
                     job.density == TexelDensity::detail ? &high : nullptr);
  LowMesh low;
  if (!job.low.given.empty()) {
    for (const std::string& file : low_files(job)) log.progress(kProgressAtLow, "reading " + file);
    MeshFiles files = load_low_files(job, warnings);
    if (!job.unwrap) warn_of_shared_texels(files, warnings);
    low.mesh = std::move(files.mesh);
    low.nodes_and_materials = std::move(files.nodes_and_materials);
    low.hulls = std::move(files.hulls);
    low.polygons = count_polygons(low.mesh);
    if (low.mesh.triangles.size() > loaded.triangle_count()) {
      if (low.mesh.uvs.empty() && !high.uvs.empty() && !job.unwrap) {
        throw Error(ErrorCode::input, "LOW " + quote_files(low_files(job)) +
                                          " has no UVs and more triangles than HIGH " +
                                          quote_files(high_files(job)) +
                                          ": give HIGH first, LOW second.");
      }
      warnings.push_back({"low-denser",
                          "LOW " + quote_files(low_files(job)) + " has more triangles than HIGH " +
                              quote_files(high_files(job)) +
                              ": check their order, HIGH first, LOW second.",
                          1});
    }
    low.stem = low_stem(job);
    if (!job.unwrap) {
      detect_soft_seams(job, low);
      return low;
    }
  } else if (bakes_onto_plane(job)) {
    low.mesh = height_field_plane(*input.heights, job.heights);
    low.made = true;
    low.stem = low.mesh.name = low_stem(job);
    return low;
  } else {
    log.progress(kProgressAtLow, "simplifying");
    low.simplified.emplace();
    SimplifyOptions options;
    options.faces = job.low.make.faces;
    options.keep_parts = job.low.make.keep_parts;
    options.height_field = input.heights.has_value();
    // A match by UVs needs the high poly's layout on the low poly.
    options.keep_uvs =
        match_uses_option(job, "match.uv") && !input.heights && !high.uv_triangles.empty();
    // otherwise normals are fitted after unwrapping, which creates the seams
    options.fit_normals = input.heights || options.keep_uvs;
    if (const std::string bound = deviation_bound(job); !bound.empty()) {
      options.max_error = parse_error_bound(bound);
    }
    low.mesh = reduced ? simplify_reduced(*loaded.streamed, high, options, *low.simplified)
                       : simplify(high, options, &*low.simplified);
    low.stem = low_stem(job);
    low.made = true;
    if (input.heights) {
      lay_out_over_height_field(low.mesh, *input.heights, job.heights);
      low.mesh.name = low.stem;
      return low;
    }
    if (options.keep_uvs) {
      low.mesh.name = low.stem;
      return low;
    }
  }
  low.made = true;
  low.unwrapped.emplace();
  low.mesh = unwraps_sets(job) ? unwrap_sets(job, std::move(low.mesh), layout, *low.unwrapped)
                               : unwrap(low.mesh, layout, &*low.unwrapped);
  if (low.simplified) low.mesh = fit_normals(low.mesh, high);
  if (job.split_at_seams) low.mesh = split_at_seams(low.mesh);
  low.mesh.name = low.stem;
  return low;
}

}  // namespace kiln

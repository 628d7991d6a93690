// The low poly of a bake.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "job/files.h"
#include "job/job_options.h"
#include "job/match_inputs.h"
#include "job/stages.h"
#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "options/parse.h"

namespace kiln {

namespace {

// A smooth cylinder of twelve sides turns 30 a side, on purpose.
constexpr double kSoftDegrees = 40;

PolygonCounts count_polygons(const Mesh& mesh) {
  PolygonCounts counts;
  for (std::size_t first = 0, t = 1; t <= mesh.polygons.size(); ++t) {
    if (t < mesh.polygons.size() && mesh.polygons[t] == mesh.polygons[first]) continue;
    if (t - first == 2) ++counts.quads;
    if (t - first > 2) ++counts.larger;
    first = t;
  }
  return counts;
}

/// Splits soft seams where that is asked for; else prepares a warning. judge_seams() decides whether either helps.
void find_soft_seams(const Job& job, LowMesh& low) {
  if (low.mesh.uv_triangles.empty()) return;  // the bake says so
  const SoftSeams seams = soft_seams(low.mesh, kSoftDegrees);
  low.soft_seams = seams.edges;
  if (job.split_at_seams) {
    low.unsplit = low.mesh;
    low.mesh = split_at_seams(low.mesh);
    low.made = true;
    return;
  }
  // A mesh without normals is smooth on purpose, or has lost them: what it needs is said by the manual.
  // Few among many are chance, as on scans: they turn no picture's mean.
  if (seams.between_flats == 0 || seams.between_flats * 10 < seams.edges) return;
  // Kiln's own low polys have the normals that suit a map: see fit_normals().
  const std::vector<std::string> files = low_files(job);
  if (std::all_of(job.low.given.begin(), job.low.given.end(),
                  [](const JobInput& input) { return input.simplified != nullptr; })) {
    return;
  }
  if (std::all_of(files.begin(), files.end(), is_own_obj)) return;
  const auto at = [&](double origin, float value) { return origin + double{value}; };
  const std::string text = formatted(
      " has %s with smooth normals between flat faces, for example at (%.5g, %.5g, "
      "%.5g), where the surface bends by %.0f "
      "degrees. ",
      plural(seams.between_flats, "UV seam").c_str(), at(low.mesh.origin[0], seams.example.x),
      at(low.mesh.origin[1], seams.example.y), at(low.mesh.origin[2], seams.example.z),
      seams.example_degrees);
  low.seam_warning = {"soft-seams",
                      "LOW " + in_words(low_files(job)) + text +
                          "Its normal map gets gradients there. Make these edges hard in the "
                          "modelling tool, or add " +
                          option("split_at_seams") + ".",
                      seams.between_flats};
}

/// Lays out each material or object in a square of its own.
Mesh unwrap_sets(const Job& job, Mesh mesh, const UnwrapOptions& layout, UnwrapReport& report) {
  const bool by_material = job.sets == SetsBy::material;
  const auto& of = by_material ? mesh.materials : mesh.objects;
  const auto& names = by_material ? mesh.material_names : mesh.object_names;
  mesh.uvs.clear();
  mesh.tangents.clear();
  mesh.uv_triangles.assign(mesh.triangles.size(), {});
  std::size_t sets = 0;
  for (std::uint32_t set = 0; set < std::max<std::size_t>(names.size(), 1); ++set) {
    const auto holds = [&](std::size_t t) { return of.empty() || of[t] == set; };
    Mesh part;
    part.name = of.empty() ? mesh.name : names[set];
    part.origin = mesh.origin;
    part.positions = mesh.positions;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (holds(t)) part.triangles.push_back(mesh.triangles[t]);
    }
    if (part.triangles.empty()) continue;
    UnwrapOptions own = layout;
    for (const SetSize& size : job.set_sizes) {
      if (size.set == part.name) own.size = std::min(size.width, size.height);
    }
    UnwrapReport told;
    part = unwrap(part, own, &told);
    const auto first = static_cast<std::uint32_t>(mesh.uvs.size());
    mesh.uvs.insert(mesh.uvs.end(), part.uvs.begin(), part.uvs.end());
    for (std::size_t t = 0, next = 0; t < mesh.triangles.size(); ++t) {
      if (!holds(t)) continue;
      const Triangle& uvs = part.uv_triangles[next++];
      mesh.uv_triangles[t] = {first + uvs[0], first + uvs[1], first + uvs[2]};
    }
    report.charts += told.charts;
    report.seconds += told.seconds;
    report.coverage += (told.coverage - report.coverage) / static_cast<double>(++sets);
    report.density_spread = std::max(report.density_spread, told.density_spread);
    report.border_texels =
        sets == 1 ? told.border_texels : std::min(report.border_texels, told.border_texels);
    for (Warning& warning : told.warnings) {
      warning.message = "'" + part.name + "': " + warning.message;
      report.warnings.push_back(std::move(warning));
    }
  }
  return mesh;
}

}  // namespace

LowMesh prepare_low(const Job& job, const LoadedHigh& loaded, RunLog& log) {
  const Mesh& high = loaded.mesh();
  const HighPolyInput& dense = loaded.input;
  std::vector<Warning>& warnings = log.warnings;
  const BakeOptions& asked = job.bake;
  const UnwrapOptions layout =
      unwrap_options(job.unwrap_method, std::min(asked.width, asked.height),
                     job.density == TexelDensity::detail ? &high : nullptr);
  LowMesh low;
  if (!job.low.given.empty()) {
    for (const std::string& file : low_files(job)) log.progress(kAtLow, "reading " + file);
    MeshFiles files = load_low_files(job, warnings);
    if (!job.unwrap) warn_of_shared_texels(files, warnings);
    low.mesh = std::move(files.mesh);
    low.beside = std::move(files.beside);
    low.hulls = std::move(files.hulls);
    low.polygons = count_polygons(low.mesh);
    if (low.mesh.triangles.size() > loaded.triangle_count()) {
      if (low.mesh.uvs.empty() && !high.uvs.empty() && !job.unwrap) {
        throw Error(ErrorCode::input, "LOW " + in_words(low_files(job)) +
                                          " has no UVs and more triangles than HIGH " +
                                          in_words(high_files(job)) +
                                          ": give HIGH first, LOW second.");
      }
      warnings.push_back({"low-denser",
                          "LOW " + in_words(low_files(job)) + " has more triangles than HIGH " +
                              in_words(high_files(job)) + ": are they the wrong way round?",
                          1});
    }
    low.stem = low_stem(job);
    if (!job.unwrap) {
      find_soft_seams(job, low);
      return low;
    }
  } else if (onto_plane(job)) {
    low.mesh = height_field_plane(*dense.heights, job.heights);
    low.made = true;
    low.stem = low.mesh.name = low_stem(job);
    return low;
  } else {
    log.progress(kAtLow, "simplifying");
    low.simplified.emplace();
    SimplifyOptions options;
    options.faces = job.low.make.faces;
    options.keep_parts = job.low.make.keep_parts;
    options.height_field = dense.heights.has_value();
    // Points at the same UV: the low poly needs the layout of the high poly.
    options.keep_uvs = match_obeys(job, "match.uv") && !dense.heights && !high.uv_triangles.empty();
    options.fit_normals = dense.heights || options.keep_uvs;  // Else once there are seams.
    if (const std::string bound = deviation_bound(job); !bound.empty()) {
      options.max_error = parse_error_bound(bound);
    }
    low.mesh = simplify(high, options, &*low.simplified);
    low.stem = low_stem(job);
    low.made = true;
    if (dense.heights) {
      lay_out_over_height_field(low.mesh, *dense.heights, job.heights);
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
  low.mesh = lays_out_sets(job) ? unwrap_sets(job, std::move(low.mesh), layout, *low.unwrapped)
                                : unwrap(low.mesh, layout, &*low.unwrapped);
  if (low.simplified) low.mesh = fit_normals(low.mesh, high);
  if (job.split_at_seams) low.mesh = split_at_seams(low.mesh);
  low.mesh.name = low.stem;
  return low;
}

}  // namespace kiln

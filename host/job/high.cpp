// Loads the high poly of a run: meshes, repairs, normals and textures.
#include <algorithm>
#include <span>

#include "job/stages.h"
#include "job/transfers.h"
#include "kiln/files.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// HIGH's materials if they were read with its file. If the result is empty, load_textures() must read them; it also
/// reports missing entries of MTL files.
std::span<const Material> known_materials(const Job& job, const LoadedHigh& high) {
  if (high.prepared != nullptr) return high.prepared->materials;
  const JobInput& first = job.high.front();
  const bool is_obj = !first.asset && lower_extension(first.name) == ".obj";
  if (is_obj || job.high.size() > 1) return {};
  return high.input.nodes_and_materials.materials;
}

}  // namespace

LoadedHigh read_high(Job& job, RunLog& log) {
  for (const std::string& file : high_files(job)) log.progress(0, "reading " + file);
  LoadedHigh high;
  high.input = load_high(job.high, job.heights, load_options(job, MeshSide::high),
                         has_more_files(job) && !job.low.given.empty(), log.warnings,
                         !asset_file(job).empty(), job.keep_hulls);
  if (high.input.heights) job.heights = high.input.field;
  return high;
}

void repair_high(const Job& job, LoadedHigh& high, RunLog& log) {
  high.repairs = clean_high(high.input.mesh, clean_options(job), log.warnings);
  shade(job.frame.shading, high.input, log.warnings);
  if (job.load_match.empty() || (high.repairs.warnings.empty() && !job.given.contains("--clean"))) {
    return;
  }
  log.warnings.push_back({"match-of-clean",
                          option("load_match") + " '" + job.load_match +
                              "' is only valid if it was saved with the same " + option("clean") +
                              ", since repairs reorder the corners of faces.",
                          1});
}

void read_textures(const Job& job, LoadedHigh& high, BakeOptions& options, RunLog& log) {
  load_textures(job, high.mesh(), options, log.warnings, known_materials(job, high));
  if (!asset_file(job).empty() && !job.given.contains("--maps")) {
    // These maps were chosen because at least one material has them; materials without them keep the default value.
    std::erase_if(log.warnings, [](const Warning& w) { return w.code == "material-value"; });
  }
  if (high.prepared != nullptr) return;
  const std::size_t triangles = high.input.mesh.triangles.size();
  apply_alpha_test(job, options, high.input.mesh, log.warnings);
  // The alpha test may have removed outer faces.
  if (high.input.mesh.triangles.size() != triangles) high.repairs.faces_outwards = false;
}

}  // namespace kiln

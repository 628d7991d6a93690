#include "command/render_bake.h"

#include <algorithm>
#include <set>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/match_flags.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

/// Flags of the match that say no more than what the meshes are.
const std::set<std::string> kOfMeshes = {"--high",    "--low",  "--triangulate", "--split-at-seams",
                                         "--up",      "--unit", "--uv-set",      "--allow-outside",
                                         "--tangents"};

/// Flags that have a say in a cage; the first ones in any.
const std::set<std::string> kOfCages = {"--cage", "--cage-mesh"};
const std::set<std::string> kOfFoundCages = {"--direction",  "--edge-width", "--max-distance",
                                             "--match-by",   "--match-list", "--low-names",
                                             "--high-names", "--two-sided"};

void check_drawn_cage(const RenderArguments& arguments) {
  const BakeJob& bake = arguments.bake;
  if (!arguments.draw_cage) return;
  if (!bake.cage_auto && !bake.options.match.cage && bake.cage_mesh.empty()) {
    throw Error(ErrorCode::usage,
                "--draw-cage draws the cage that --cage or --cage-mesh says: add one of them.");
  }
  for (const std::string& flag : bake.given) {
    const bool serves = kOfMeshes.contains(flag) || kOfCages.contains(flag) ||
                        (bake.cage_auto && kOfFoundCages.contains(flag));
    if (serves || arguments.map_size_given) continue;
    throw Error(ErrorCode::usage, flag +
                                      " has no say in the cage that --draw-cage draws: leave it "
                                      "out, or add --map-size N to bake a map with it, too.");
  }
}

}  // namespace

bool bakes(const RenderArguments& arguments) {
  return arguments.map_size_given ||
         (!arguments.draw_cage &&
          std::any_of(arguments.bake.given.begin(), arguments.bake.given.end(),
                      [](const std::string& flag) { return !kOfMeshes.contains(flag); }));
}

BakeJob baking(const RenderArguments& arguments) {
  BakeJob bake = arguments.bake;
  bake.high = arguments.reference;
  bake.low = arguments.mesh;
  bake.heights = arguments.heights;
  bake.options.width = bake.options.height = arguments.map_size;
  bake.options.encoding.space = Words(kSpaces).at(arguments.space);
  bake.options.encoding.flip_y = arguments.flip_y;
  bake.options.encoding.bitangent = Words(kBitangents).at(arguments.bitangent);
  return bake;
}

void check_bake(const RenderArguments& arguments) {
  if (arguments.reference.empty() && !arguments.bake.more_high.empty()) {
    throw Error(ErrorCode::usage, "--high is for more files of --reference: add --reference.");
  }
  check_drawn_cage(arguments);
  const auto& given = arguments.bake.given;
  if (given.contains("--tangents") && !bakes(arguments) && arguments.normal.empty()) {
    throw Error(ErrorCode::usage, "--tangents is for a normal map: add --normal MAP.");
  }
  if (arguments.draw_cage && !arguments.reference.empty()) check(baking(arguments));
  if (!bakes(arguments)) return;
  if (arguments.reference.empty() || !arguments.normal.empty()) {
    const auto flag = std::find_if(given.begin(), given.end(), [](const std::string& name) {
      return !kOfMeshes.contains(name);
    });
    const bool cage = given.contains("--cage") || given.contains("--cage-mesh");
    throw Error(ErrorCode::usage,
                (arguments.map_size_given ? "--map-size" : *flag) +
                    " is for a map that is baked for the picture: add --reference HIGH, and leave "
                    "--normal out." +
                    (cage ? " --draw-cage draws a cage, and bakes nothing." : ""));
  }
  check(baking(arguments));
}

Image bake_map(const RenderArguments& arguments, const Device& device, const HighPolyInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings) {
  const BakeJob bake_as = baking(arguments);
  MatchInputs inputs;
  inputs.read(bake_as, dense.mesh, mesh, warnings);
  inputs.make_cage(bake_as, device, dense.mesh, mesh, warnings);
  BakeOptions options = options_of(bake_as);
  options.match.uv = uv_options(dense, options.match.uv);
  options.report.keep_match = false;
  inputs.apply(options);
  const Source source(device, dense.mesh, bake_as.traversal);
  BakeResult result = bake(source, mesh, options);
  check_result(result.report, dense.mesh, mesh);
  warnings.insert(warnings.end(), result.report.warnings.begin(), result.report.warnings.end());
  return std::move(result.maps[0].image);
}

}  // namespace kiln::cli

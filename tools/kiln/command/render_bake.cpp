#include "command/render_bake.h"

#include <algorithm>
#include <set>
#include <utility>

#include "arguments/match_flags.h"
#include "report/check_result.h"

namespace kiln::cli {

bool bakes(const RenderArguments& arguments) {
  // A cage alone is drawn, no more.
  const std::set<std::string> not_the_match = {"--high",           "--low",  "--triangulate",
                                               "--split-at-seams", "--cage", "--cage-mesh"};
  return arguments.map_size_given ||
         std::any_of(arguments.bake.given.begin(), arguments.bake.given.end(),
                     [&](const std::string& flag) { return !not_the_match.contains(flag); });
}

bool draws_cage(const RenderArguments& arguments) {
  const bool given = !arguments.bake.cage.empty() || !arguments.bake.cage_mesh.empty();
  return given && !bakes(arguments);
}

BakeArguments baking(const RenderArguments& arguments) {
  BakeArguments bake = arguments.bake;
  bake.high = arguments.reference;
  bake.low = arguments.mesh;
  bake.heights = arguments.heights;
  bake.size = std::to_string(arguments.map_size);
  bake.space = arguments.space;
  bake.flip_y = arguments.flip_y;
  bake.bitangent = arguments.bitangent;
  return bake;
}

void check_bake(const RenderArguments& arguments) {
  if (arguments.reference.empty() && !arguments.bake.more_high.empty()) {
    throw Error(ErrorCode::usage, "--high is for more files of --reference: add --reference.");
  }
  if (!bakes(arguments)) return;
  if (arguments.reference.empty() || !arguments.normal.empty()) {
    throw Error(ErrorCode::usage,
                (arguments.map_size_given ? "--map-size" : *arguments.bake.given.begin()) +
                    " is for a map that is baked for the picture: add --reference HIGH, and leave "
                    "--normal out.");
  }
  check(baking(arguments));
}

Image bake_map(const RenderArguments& arguments, const Device& device, const DenseInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings) {
  const BakeArguments bake_as = baking(arguments);
  MatchInputs inputs;
  inputs.read(bake_as, dense.mesh, mesh, warnings);
  inputs.make_cage(bake_as, device, dense.mesh, mesh, warnings);
  BakeOptions options = bake_options(bake_as);
  options.uv = uv_options(dense, options.uv);
  options.keep_match = false;
  inputs.apply(options);
  const Source source(device, dense.mesh, traversal(bake_as));
  BakeResult result = bake(source, mesh, options);
  check_result(result.report, dense.mesh, mesh);
  warnings.insert(warnings.end(), result.report.warnings.begin(), result.report.warnings.end());
  return std::move(result.maps[0].image);
}

}  // namespace kiln::cli

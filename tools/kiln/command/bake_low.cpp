// The low poly of a bake.
#include <algorithm>

#include "arguments/parse.h"
#include "arguments/unwrap_option.h"
#include "command/bake_run.h"

namespace kiln::cli {

namespace fs = std::filesystem;

std::string lod_stem(const BakeArguments& arguments, std::size_t level) {
  return fs::path(arguments.high).stem().string() + "_lod" + std::to_string(level);
}

std::string low_stem(const BakeArguments& arguments) {
  if (arguments.lods > 0) return lod_stem(arguments, 0);
  if (arguments.low.empty()) return fs::path(arguments.high).stem().string() + "_low";
  return fs::path(arguments.low).stem().string() + (arguments.unwrap ? "_unwrapped" : "");
}

const std::string& low_source(const BakeArguments& arguments) {
  return arguments.low.empty() ? arguments.high : arguments.low;
}

LowMesh prepare_low(const BakeArguments& arguments, const DenseInput& dense, Console& console,
                    std::vector<Warning>& warnings) {
  const Mesh& high = dense.mesh;
  const auto [width, height] = parse_size(arguments.size);
  const UnwrapOptions layout = unwrap_options(arguments.unwrap_method, std::min(width, height));
  LowMesh low;
  if (!arguments.low.empty()) {
    console.progress(kAtLow, "reading " + arguments.low);
    low.mesh = load_mesh(arguments.low, &warnings);
    if (low.mesh.triangles.size() > high.triangles.size()) {
      warnings.push_back({"low-denser",
                          "LOW '" + arguments.low + "' has more triangles than HIGH '" +
                              arguments.high + "': are they the wrong way round?",
                          1});
    }
    low.stem = low_stem(arguments);
    if (!arguments.unwrap) return low;
  } else if (onto_plane(arguments)) {
    low.mesh = height_field_plane(*dense.heights, height_field_options(arguments.heights));
    low.made = true;
    low.stem = low.mesh.name = low_stem(arguments);
    return low;
  } else {
    console.progress(kAtLow, "simplifying");
    low.simplified.emplace();
    SimplifyOptions options;
    options.faces = arguments.faces;
    options.height_field = dense.heights.has_value();
    // Points at the same UV: the light mesh needs the layout of the dense one.
    options.keep_uvs = arguments.match == "uv" && !dense.heights && !high.uv_triangles.empty();
    if (const std::string bound = deviation_bound(arguments); !bound.empty()) {
      options.max_error = parse_error_bound(bound);
    }
    low.mesh = simplify(high, options, &*low.simplified);
    low.stem = low_stem(arguments);
    low.made = true;
    if (dense.heights) {
      lay_out_over_height_field(low.mesh, *dense.heights, height_field_options(arguments.heights));
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
  low.mesh = unwrap(low.mesh, layout, &*low.unwrapped);
  low.mesh.name = low.stem;
  return low;
}

}  // namespace kiln::cli

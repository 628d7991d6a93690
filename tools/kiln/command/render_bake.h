// Arguments of `kiln render`, and the map that it bakes where a flag of the match is given.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "arguments/bake_job.h"
#include "arguments/high_poly_input.h"
#include "picture/dressed.h"
#include "picture/view_arguments.h"

namespace kiln::cli {

struct RenderArguments {
  std::string mesh, normal, reference, out, space = "tangent", device, json;
  DressMaps dress;
  std::vector<std::string> show;
  HeightFieldOptions heights;
  ViewArguments view;
  std::uint32_t size = 512, samples = 3, ambient_rays = 64, views = 0;
  std::optional<std::uint32_t> frames;
  BakeJob bake;  // flags of the match; given ones are in bake.given
  std::uint32_t map_size = 1024;
  bool map_size_given = false;
  std::string bitangent = "pixel";
  bool flip_y = false, flat = false, show_normals = false, error = false, quiet = false;
  bool draw_cage = false;
};

/// True if a map is to be baked for the picture: --map-size was given, or a flag of the match without --draw-cage.
bool bakes(const RenderArguments& arguments);

/// The flags of the match as the bake has them.
BakeJob baking(const RenderArguments& arguments);

/// Checks that would otherwise fail after the meshes were read. \throws Error(usage)
void check_bake(const RenderArguments& arguments);

Image bake_map(const RenderArguments& arguments, const Device& device, const HighPolyInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings);

}  // namespace kiln::cli

#include "picture/mapped_mesh.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "job/map_file.h"
#include "kiln/image.h"
#include "kiln/render.h"
#include "picture/sheet.h"

namespace kiln::cli {
namespace {

// Colour of meshes in Scene::draw(), in linear light (kernels/render/render.cl).
constexpr std::array<float, 3> kMeshColour = {0.60F, 0.505F, 0.425F};

double srgb_to_linear(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// Converts an image to three channels; a single channel becomes grey.
Image expand_to_three_channels(const Image& image) {
  Image result{image.width, image.height, 3, {}};
  const std::size_t texels = std::size_t{image.width} * image.height;
  result.pixels.resize(texels * 3);
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t source_channel = image.channels < 3 ? 0 : c;
      result.pixels[3 * i + c] = image.pixels[i * image.channels + source_channel];
    }
  }
  return result;
}

/// Draws the mesh unlit with a map. Pixels that do not show the mesh are 0.
Image draw_with_map(const MappedMesh& dressed, const Image& map, RenderOptions options) {
  const Scene scene(dressed.device, dressed.mesh, {&map});
  options.show_colors = true;
  options.flat = options.show_normals = options.ignore_map = false;
  return scene.draw(options);
}

/// Draws the mesh's coverage: pixels that show the mesh are not 0.
Image draw_coverage(const MappedMesh& dressed, const RenderOptions& options) {
  return draw_with_map(dressed, Image{1, 1, 3, {1, 1, 1}}, options);
}

/// Computes the factor by which a value of curvature changes the light. \param bend  from -1 (the strongest cavities)
/// to 1 (the strongest edges)
float light_factor(float bend) { return 1 + (bend > 0 ? kEdgeLight - 1 : 1 - kCavityLight) * bend; }

/// Returns the name of a map's file without the mesh's name and the underscore before it.
std::string caption_of_map(const std::string& file, const Mesh& mesh) {
  std::string stem = std::filesystem::path(file).stem().string();
  const std::string mesh_prefix = mesh.name + "_";
  if (stem.size() > mesh_prefix.size() && stem.starts_with(mesh_prefix))
    stem.erase(0, mesh_prefix.size());
  return stem;
}

}  // namespace

LitMaps load_lit_maps(const LitMapFiles& maps) {
  LitMaps apply_maps;
  if (!maps.color.empty()) apply_maps.color = expand_to_three_channels(load_image(maps.color));
  if (!maps.occlusion.empty())
    apply_maps.occlusion = expand_to_three_channels(load_image(maps.occlusion));
  if (!maps.curvature.empty())
    apply_maps.bend = expand_to_three_channels(load_curvature(maps.curvature));
  return apply_maps;
}

void apply_maps(const MappedMesh& dressed, const LitMaps& maps, const RenderOptions& options,
                Image& picture) {
  if (!maps.any()) return;
  const Image coverage = draw_coverage(dressed, options);
  const auto draw = [&](const Image& map) {
    return map.width == 0 ? Image() : draw_with_map(dressed, map, options);
  };
  const Image colors = draw(maps.color), open = draw(maps.occlusion), bend = draw(maps.bend);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    if (coverage.pixels[i] == 0) continue;
    double light = srgb_to_linear(picture.pixels[i]);
    if (colors.width != 0) light *= srgb_to_linear(colors.pixels[i]) / kMeshColour[i % 3];
    if (open.width != 0) light *= open.pixels[i];
    if (bend.width != 0) light *= light_factor(2 * bend.pixels[i] - 1);
    picture.pixels[i] = static_cast<float>(light);
  }
  // Pixels that do not show the mesh are copied unchanged, since they are already encoded.
  Image lit = picture;
  to_srgb(lit);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    if (coverage.pixels[i] != 0) picture.pixels[i] = lit.pixels[i];
  }
}

Image draw_map_sheet(const MappedMesh& dressed, const std::vector<std::string>& files,
                     RenderOptions options) {
  const Image coverage = draw_coverage(dressed, options);
  std::vector<Panel> panels;
  for (const std::string& file : files) {
    Image picture = draw_with_map(dressed, expand_to_three_channels(load_image(file)), options);
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
      if (coverage.pixels[i] == 0) picture.pixels[i] = 1;
    }
    panels.push_back({std::move(picture), {caption_of_map(file, dressed.mesh)}});
  }
  return make_sheet(panels);
}

}  // namespace kiln::cli

#include "picture/asset_pictures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "base/lower_case.h"
#include "batch/checks.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "job/map_file.h"
#include "job/match_inputs.h"
#include "job/mesh_files.h"
#include "job/run.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/render.h"
#include "kiln/texture_sets.h"
#include "picture/mapped_mesh.h"
#include "picture/sheet.h"
#include "picture/view_arguments.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// Samples per pixel, and occlusion rays per sample. Thumbnails need fewer of them than full pictures.
constexpr std::uint32_t kSamples = 2, kAmbientRays = 16;

/// Loads the low poly that the job wrote; if there is none, the given one. \param own  receives true if its materials
/// refer to its maps
MeshFiles load_written_low(const Job& job, const std::vector<std::string>& files, bool& own,
                           std::vector<Warning>& warnings) {
  const std::string asset = asset_file(job);
  own = !asset.empty();
  if (own) return load_meshes({asset}, LoadMeshOptions(), false, warnings, true);
  const auto written_asset = std::find_if(files.begin(), files.end(), [](const std::string& file) {
    return lower_case(fs::path(file).extension().string()) == ".obj";
  });
  if (written_asset != files.end())
    return load_meshes({*written_asset}, LoadMeshOptions(), false, warnings);
  return load_low_files(job, warnings);
}

/// Returns the part of a map's file name that follows the stem.
std::string map_name_of_file(const Job& job, const std::string& file) {
  const std::string name = fs::path(file).stem().string(), prefix = low_stem(job) + "_";
  return name.size() > prefix.size() && name.starts_with(prefix) ? name.substr(prefix.size())
                                                                 : name;
}

/// Finds the file that the job wrote for a slot; empty if there is none.
std::string file_for(const Image* AssetMaps::*place, const Job& job,
                     const std::vector<std::string>& files) {
  AssetMaps slots;
  for (const std::string& file : files) {
    if (is_map_file(file) && slot_of(slots, map_name_of_file(job, file)) == &(slots.*place))
      return file;
  }
  return {};
}

/// Reduces an image by averaging blocks of texels, so that no side exceeds `side`.
Image downsample(const Image& image, std::uint32_t side) {
  const std::uint32_t step =
      std::max(1U, (std::max(image.width, image.height) + side - 1) / std::max(1U, side));
  if (step == 1) return image;
  Image result{
      (image.width + step - 1) / step, (image.height + step - 1) / step, image.channels, {}};
  result.pixels.resize(std::size_t{result.width} * result.height * result.channels);
  for (std::uint32_t y = 0; y < result.height; ++y) {
    for (std::uint32_t x = 0; x < result.width; ++x) {
      const std::uint32_t right = std::min(image.width, (x + 1) * step),
                          bottom = std::min(image.height, (y + 1) * step);
      for (std::uint32_t c = 0; c < image.channels; ++c) {
        double sum = 0;
        std::size_t count = 0;
        for (std::uint32_t v = y * step; v < bottom; ++v) {
          for (std::uint32_t u = x * step; u < right; ++u) {
            const float value = image.at(u, v)[c];
            if (!std::isfinite(value)) continue;
            sum += double{value};
            ++count;
          }
        }
        result.at(x, y)[c] = count != 0 ? static_cast<float>(sum / static_cast<double>(count)) : 0;
      }
    }
  }
  return result;
}

/// Extracts channels of an image, with the range [from, to] scaled to [0, 1].
Image channels_of(const Image& image, std::uint32_t first, std::uint32_t count, double from,
                  double to) {
  Image result{image.width, image.height, count, {}};
  result.pixels.reserve(std::size_t{image.width} * image.height * count);
  const std::size_t texels = std::size_t{image.width} * image.height;
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::uint32_t c = first; c < first + count; ++c) {
      const double value = c < image.channels ? double{image.pixels[i * image.channels + c]} : 0;
      const double share = (value - from) / (to - from);
      result.pixels.push_back(std::isfinite(share) ? static_cast<float>(std::clamp(share, 0.0, 1.0))
                                                   : 0.0F);
    }
  }
  return result;
}

MapPicture make_map_picture(const std::string& name, const Image& map, std::uint32_t side) {
  MapPicture result;
  result.name = name;
  result.width = map.width;
  result.height = map.height;
  result.channels = map.channels;
  result.hash = pixel_hash(map);
  const std::size_t texels = std::size_t{map.width} * map.height;
  double min_value = 0, max_value = 1;
  for (std::uint32_t c = 0; c < map.channels; ++c) {
    double low = HUGE_VAL, high = -HUGE_VAL, sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < texels; ++i) {
      const double value = double{map.pixels[i * map.channels + c]};
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
      sum += value;
      ++count;
    }
    const bool has_values = count != 0;
    result.least.push_back(has_values ? std::optional(low) : std::nullopt);
    result.most.push_back(has_values ? std::optional(high) : std::nullopt);
    result.mean.push_back(has_values ? std::optional(sum / static_cast<double>(count))
                                     : std::nullopt);
    if (!has_values || c == 3) continue;
    min_value = std::min(min_value, low);
    max_value = std::max(max_value, high);
  }
  // Values of EXR may have any range; those of other formats are in [0, 1].
  result.value_shown_black = min_value;
  result.value_shown_white = max_value;
  const Image reduced = downsample(map, side);
  // A PNG stores grey or RGB, so a map of two channels gets a third of 0.
  result.picture = channels_of(reduced, 0, reduced.channels == 1 ? 1 : 3, min_value, max_value);
  if (map.channels == 4) result.alpha = channels_of(reduced, 3, 1, 0, 1);
  return result;
}

/// The maps for a lit picture, with three channels each; empty paths give empty images.
LitMaps lit_maps_of(const Job& job, const std::vector<std::string>& files) {
  LitMapFiles maps;
  maps.color = file_for(&AssetMaps::color, job, files);
  maps.occlusion = file_for(&AssetMaps::occlusion, job, files);
  return load_lit_maps(maps);
}

}  // namespace

DrawnAsset draw_asset(const Device& device, const Job& job, const std::vector<std::string>& files,
                      std::uint32_t size) {
  // The warnings are discarded, since the bake has already reported them.
  std::vector<Warning> warnings;
  DrawnAsset result;
  bool has_own_maps = false;
  MeshFiles low_files = load_written_low(job, files, has_own_maps, warnings);
  Mesh low_mesh = std::move(low_files.mesh);
  HighPolyInput dense = load_high(job.high, job.heights, load_options(job, MeshSide::high),
                                  has_more_files(job), warnings);
  if (!dense.heights) {
    clean_high(dense.mesh, clean_options(resolve_job(job)), warnings);
    shade(job.frame.shading, dense, warnings);
  }
  NormalMap map;
  Image normals;
  LitMaps lit_maps;
  if (has_own_maps) {
    MaterialAtlases maps =
        make_material_atlases(low_files.nodes_and_materials.materials, low_mesh, warnings);
    lit_maps = {std::move(maps.color), std::move(maps.occlusion), {}};
    normals = std::move(maps.normal);
  } else if (choose_texture_sets(low_mesh) != SetsBy::none) {
    result.note = "The low poly has several texture sets, whose maps are not shown.";
  } else {
    if (const std::string file = file_for(&AssetMaps::normal, job, files); !file.empty()) {
      normals = load_normal_map(file);
      map.space = job.bake.encoding.space;
      map.flip_y = job.bake.encoding.flip_y;
      map.bitangent = job.bake.encoding.bitangent;
    }
    lit_maps = lit_maps_of(job, files);
  }
  if (normals.width != 0) map.image = &normals;
  if (map.image == nullptr && !lit_maps.any() && result.note.empty())
    result.note = "No map of normals, colours or occlusion was written.";
  ViewArguments view;
  view.square = true;
  RenderOptions options = view_options(view, dense.heights.has_value());
  options.size = size;
  options.samples = kSamples;
  options.ambient_rays = kAmbientRays;
  options.frame = &dense.mesh;
  const Scene high(device, dense.mesh), low(device, low_mesh, map);
  result.high = high.draw(options);
  RenderOptions options_without_maps = options;
  options_without_maps.ignore_map = true;
  result.low = low.draw(options_without_maps);
  AnglePictures angles_without_maps;
  angles_without_maps.add(high, low, options_without_maps);
  result.without_maps_degrees = angles_without_maps.mean(0);
  AnglePictures angles_with_maps;
  angles_with_maps.add(high, low, options);
  result.with_maps_degrees = angles_with_maps.mean(0);
  const Scale scale = angles_with_maps.scale();
  result.scale_degrees = scale.end;
  result.errors = angles_with_maps.picture(0, scale);
  if (map.image == nullptr && !lit_maps.any()) return result;
  result.with_maps = low.draw(options);
  apply_maps({device, low_mesh}, lit_maps, options, result.with_maps);
  return result;
}

std::vector<MapPicture> picture_maps(const Job& job, const std::vector<std::string>& files,
                                     std::uint32_t side) {
  std::vector<MapPicture> maps;
  const std::string asset = asset_file(job);
  if (!asset.empty()) {
    std::vector<Warning> warnings;
    MeshFiles low = load_meshes({asset}, LoadMeshOptions(), false, warnings, true);
    const MaterialAtlases own_maps =
        make_material_atlases(low.nodes_and_materials.materials, low.mesh, warnings);
    for (const auto& [name, image] :
         {std::pair{"normals", &own_maps.normal}, std::pair{"colors", &own_maps.color},
          std::pair{"occlusion", &own_maps.occlusion}}) {
      if (image->width != 0) maps.push_back(make_map_picture(name, *image, side));
    }
    return maps;
  }
  for (const std::string& file : files) {
    if (!is_map_file(file)) continue;
    maps.push_back(make_map_picture(map_name_of_file(job, file), load_image(file), side));
    maps.back().file = file;
  }
  return maps;
}

}  // namespace kiln::cli

// Parsers of the options that request maps: --maps, --transfer, --max-error and --pack.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "kiln/map.h"
#include "options/json.h"

namespace kiln {

/// True if the map of this name uses the texture BakeOptions::color or BakeOptions::opacity.
/// \param option  "color" or "opacity"
bool map_uses(std::string_view name, std::string_view option);
/// True if the map of this name uses a texture of BakeOptions. Then --transfer sets that texture instead of adding a
/// map.
bool is_texture_of_map(std::string_view name);

/// Names of the maps that Kiln has no registry row for: transfers, except textures of maps; own maps; variants.
std::vector<std::string> own_map_names(const Job& arguments);

/// The kinds of maps in --maps, plus color and opacity if --transfer sets their textures.
std::vector<MapKind> requested_maps(const Job& arguments);

/// True if an item of --maps defines a variant: NAME=MAP, optionally followed by :OPTION=VALUE.
bool is_variant(std::string_view word);
/// Parses an item of --maps that defines a variant. The variant has the job's options except those that the item sets.
/// \throws Error(usage)
MapVariant parse_variant(const Job& job, const std::string& word);
/// The kind of map that a variant's item names.
MapKind variant_kind(const std::string& word);
/// The kinds of maps in --maps, including those of variants.
std::vector<MapKind> requested_map_kinds(const Job& job);
/// Copies the occluders of the bake to all variants. Call it after the meshes are loaded.
void copy_occluders_to_variants(BakeOptions& options);

/// Names of all maps of the job: requested_maps() and own_map_names().
std::vector<std::string> all_map_names(const Job& arguments);

/// The error bounds of all maps but the normal map. The names are views into the job.
/// \throws Error(usage) for an invalid list, or a bound of a map that is not baked
std::vector<MapBound> map_bounds(const Job& arguments);

/// The text after "normal=" in --max-error; empty if there is no such item.
/// \throws Error(usage) if the value is missing
std::string normal_error_bound(const std::string& max_error);

/// States the error that a map reached: "ao: 0.0052 off, 0.00784 wanted (root mean square at 2,003 points of the
/// surface)".
std::string describe(const MapReached& map);
Json bounds_json(const std::vector<MapReached>& bounds);

/// One channel of a packed image: the channel of a map, or a constant.
struct PackChannel {
  std::string map;            ///< Name of the map; if empty, the channel is the constant `value`
  std::uint32_t channel = 0;  ///< Index of the map's channel
  float value = 0;
};

/// A packed image, as requested by `--pack NAME=MAP[.r|.g|.b|.a],...`.
struct Pack {
  std::string name;
  std::vector<PackChannel> channels;  ///< 1 to 4 channels
};

/// Parses all values of --pack, and checks that their maps are baked. \throws Error(usage)
std::vector<Pack> parse_packs(const Job& arguments);

/// Packs the channels of one mip level into an image.
/// \param image_of  returns the image of a map at that level by name, encoded as in its file
template <typename ImageOf>
Image pack_channels(const Pack& pack, const ImageOf& image_of) {
  Image image;
  for (const PackChannel& channel : pack.channels) {
    if (channel.map.empty()) continue;
    const Image& source_image = image_of(channel.map);
    image.width = source_image.width;
    image.height = source_image.height;
  }
  image.channels = static_cast<std::uint32_t>(pack.channels.size());
  const std::size_t texels = std::size_t{image.width} * image.height;
  image.pixels.resize(texels * image.channels);
  for (std::size_t c = 0; c < pack.channels.size(); ++c) {
    const PackChannel& channel = pack.channels[c];
    const Image* source_image = channel.map.empty() ? nullptr : &image_of(channel.map);
    // A texture may turn out to have a single channel once it is read, so the index is clamped.
    const std::uint32_t read =
        source_image == nullptr ? 0 : std::min(channel.channel, source_image->channels - 1);
    for (std::size_t i = 0; i < texels; ++i) {
      image.pixels[i * image.channels + c] =
          source_image == nullptr ? channel.value
                                  : source_image->pixels[i * source_image->channels + read];
    }
  }
  return image;
}

}  // namespace kiln

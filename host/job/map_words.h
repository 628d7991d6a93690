// The requested maps of a bake: parsing of --maps, --transfer, --max-error and --pack.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "kiln/map.h"
#include "options/json.h"

namespace kiln {

/// True if the map of this name uses a texture of BakeOptions, "color" or "opacity".
bool map_takes(std::string_view name, std::string_view option);
/// True if the map uses any texture of BakeOptions. --transfer then sets that texture instead of adding a map.
bool is_texture_of_map(std::string_view name);

/// Maps that are not Kiln's: those of --transfer, except textures of maps, and own maps.
std::vector<std::string> own_map_names(const Job& arguments);

/// The kinds in --maps, plus color and opacity if --transfer sets their textures.
std::vector<MapKind> maps_asked(const Job& arguments);

/// True for a word of --maps that defines a variant: NAME=MAP, optionally followed by :OPTION=VALUE.
bool is_variant(std::string_view word);
/// Parses a variant. Its options are the job's except those that it sets. \throws Error(usage)
MapVariant parse_variant(const Job& job, const std::string& word);
/// The kind of a variant's word.
MapKind variant_kind(const std::string& word);
/// The kinds in --maps, including those of variants.
std::vector<MapKind> kinds_asked(const Job& job);
/// Gives all variants the same occluders. Call it when the meshes are loaded.
void share_occluders(BakeOptions& options);

/// Names of all maps: maps_asked() and own_map_names().
std::vector<std::string> all_maps(const Job& arguments);

/// The bounds of all maps but the normal map. Names are views into the arguments.
/// \throws Error(usage) for an invalid list, or a bound of a map that is not baked
std::vector<MapBound> map_bounds(const Job& arguments);

/// The text after "normal="; empty if there is no such item.
/// \throws Error(usage) if the value is missing
std::string normal_bound(const std::string& max_error);

/// "ao reached 0.0052 of 0.00784 wanted (root mean square at 2,003 points)".
std::string describe(const MapReached& map);
Json bounds_json(const std::vector<MapReached>& bounds);

/// One channel of a packed image: a map's channel, or a constant.
struct PackChannel {
  std::string map;            ///< Empty: `value`
  std::uint32_t channel = 0;  ///< Channel of the map
  float value = 0;
};

/// `--pack NAME=MAP[.r|.g|.b|.a],...`
struct Pack {
  std::string name;
  std::vector<PackChannel> channels;  ///< 1 to 4
};

/// Parses --pack, and checks that its maps are baked. \throws Error(usage)
std::vector<Pack> parse_packs(const Job& arguments);

/// Packs the channels of one mip level. \param image_of returns a map's image at that level by name, in the file's
/// encoding
template <typename ImageOf>
Image packed(const Pack& pack, const ImageOf& image_of) {
  Image image;
  for (const PackChannel& channel : pack.channels) {
    if (channel.map.empty()) continue;
    const Image& from = image_of(channel.map);
    image.width = from.width;
    image.height = from.height;
  }
  image.channels = static_cast<std::uint32_t>(pack.channels.size());
  const std::size_t texels = std::size_t{image.width} * image.height;
  image.pixels.resize(texels * image.channels);
  for (std::size_t c = 0; c < pack.channels.size(); ++c) {
    const PackChannel& channel = pack.channels[c];
    const Image* from = channel.map.empty() ? nullptr : &image_of(channel.map);
    // Whether a texture has only one channel is known only after it was read.
    const std::uint32_t read = from == nullptr ? 0 : std::min(channel.channel, from->channels - 1);
    for (std::size_t i = 0; i < texels; ++i) {
      image.pixels[i * image.channels + c] =
          from == nullptr ? channel.value : from->pixels[i * from->channels + read];
    }
  }
  return image;
}

}  // namespace kiln

// The maps that a bake is asked for: words of --maps and --transfer, bounds of --max-error, channels of --pack.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "kiln/map.h"
#include "options/json.h"

namespace kiln {

/// True if the map of this name holds a texture of BakeOptions, "color" or "opacity".
bool map_takes(std::string_view name, std::string_view option);
/// ... any of its textures: --transfer gives this one, and makes no map of its own.
bool is_texture_of_map(std::string_view name);

/// Maps that are not in --maps: those of --transfer, but for textures of maps, and those of the user's kernels.
std::vector<std::string> own_map_names(const Job& arguments);

/// --maps, and color and opacity where --transfer gives their textures.
std::vector<MapKind> maps_asked(const Job& arguments);

/// True for a word of --maps that asks for another map of a kind: NAME=MAP, with or without :OPTION=VALUE after it.
bool is_variant(std::string_view word);
/// Its options are the job's but for those that it gives. \throws Error(usage)
MapVariant parse_variant(const Job& job, const std::string& word);
/// Its kind alone.
MapKind variant_kind(const std::string& word);
/// The kinds of --maps, those of variants among them.
std::vector<MapKind> kinds_asked(const Job& job);
/// Occluders are the same for every map: call it when the meshes are there.
void share_occluders(BakeOptions& options);

/// Every map's name: maps_asked() and own_map_names().
std::vector<std::string> all_maps(const Job& arguments);

/// The bounds of all maps but the normal map. Names stay as long as the arguments do.
/// \throws Error(usage) for what is no list of them, or bounds a map that is not baked
std::vector<MapBound> map_bounds(const Job& arguments);

/// The text after "normal="; empty where there is no such item.
/// \throws Error(usage) where nothing stands after it
std::string normal_bound(const std::string& max_error);

/// "ao reached 0.0052 of 0.00784 wanted (root mean square at 2,003 points)".
std::string describe(const MapReached& map);
Json bounds_json(const std::vector<MapReached>& bounds);

/// One channel of a packed image: of a map, or a number.
struct PackChannel {
  std::string map;            ///< Empty: `value`
  std::uint32_t channel = 0;  ///< Of the map
  float value = 0;
};

/// `--pack NAME=MAP[.r|.g|.b|.a],...`
struct Pack {
  std::string name;
  std::vector<PackChannel> channels;  ///< 1 to 4
};

/// Checks that the maps are there, too. \throws Error(usage)
std::vector<Pack> parse_packs(const Job& arguments);

/// The image of one level. \param image_of  a map's image on that level, by name, as files hold it
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
    // A texture is known to be grey, of one channel, only when it has been read.
    const std::uint32_t read = from == nullptr ? 0 : std::min(channel.channel, from->channels - 1);
    for (std::size_t i = 0; i < texels; ++i) {
      image.pixels[i * image.channels + c] =
          from == nullptr ? channel.value : from->pixels[i * from->channels + read];
    }
  }
  return image;
}

}  // namespace kiln

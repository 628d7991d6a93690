// Channels of several maps in one file, as engines take them.
#pragma once

#include <string>
#include <vector>

#include "arguments/bake_job.h"

namespace kiln::cli {

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
std::vector<Pack> parse_packs(const BakeJob& arguments);

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
    for (std::size_t i = 0; i < texels; ++i) {
      image.pixels[i * image.channels + c] =
          from == nullptr ? channel.value : from->pixels[i * from->channels + channel.channel];
    }
  }
  return image;
}

}  // namespace kiln::cli

#include "arguments/packs.h"

#include <algorithm>
#include <charconv>

#include "arguments/transfers.h"

namespace kiln::cli {
namespace {

[[noreturn]] void fail(const std::string& text, const std::string& why) {
  throw Error(ErrorCode::usage, "--pack '" + text + "': " + why);
}

/// Channels of a map of this bake; 0 where there is none of that name.
std::uint32_t channels_of(const BakeJob& a, const std::string& map) {
  for (const MapKind asked : maps_asked(a)) {
    if (asked.name == map) return find_map(map).channels;
  }
  for (const std::string& word : a.variants) {
    if (word.substr(0, word.find('=')) == map) return find_map(variant_kind(word).name).channels;
  }
  const std::vector<std::string> own = own_map_names(a);
  return std::find(own.begin(), own.end(), map) != own.end() ? 3 : 0;
}

PackChannel parse_channel(const BakeJob& a, const std::string& text, const std::string& part) {
  PackChannel channel;
  const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), channel.value);
  if (status == std::errc() && end == part.data() + part.size()) {
    if (channel.value >= 0 && channel.value <= 1) return channel;
    fail(text, "numbers must be 0 to 1.");
  }
  const std::size_t dot = part.find('.');
  channel.map = part.substr(0, dot);
  if (dot != std::string::npos) {
    const std::size_t place = std::string("rgba").find(part.substr(dot + 1));
    if (part.size() != dot + 2 || place == std::string::npos) {
      fail(text, "'" + part + "' names no channel: add .r, .g, .b or .a to a map.");
    }
    channel.channel = static_cast<std::uint32_t>(place);
  }
  const std::uint32_t channels = channels_of(a, channel.map);
  if (channels == 0) {
    fail(text, "there is no map '" + channel.map +
                   "' in this bake: ask for it with --maps or --transfer.");
  }
  if (channel.channel >= channels) {
    fail(text, "the map " + channel.map + " has " + std::to_string(channels) + " channels.");
  }
  return channel;
}

}  // namespace

std::vector<Pack> parse_packs(const BakeJob& a) {
  std::vector<Pack> packs;
  for (const std::string& text : a.packs) {
    const std::size_t equals = text.find('=');
    Pack pack;
    pack.name = text.substr(0, equals);
    if (equals == std::string::npos || pack.name.empty() ||
        pack.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                    "_") != std::string::npos) {
      fail(text, "write NAME=MAP,MAP,MAP, such as orm=ao,roughness,metallic.");
    }
    if (channels_of(a, pack.name) != 0 || pack.name == "layers" ||
        std::any_of(packs.begin(), packs.end(),
                    [&](const Pack& other) { return other.name == pack.name; })) {
      fail(text, "'" + pack.name + "' is the name of another file of this bake.");
    }
    std::size_t begin = equals + 1;
    while (begin <= text.size()) {
      const std::size_t comma = std::min(text.find(',', begin), text.size());
      pack.channels.push_back(parse_channel(a, text, text.substr(begin, comma - begin)));
      begin = comma + 1;
    }
    if (pack.channels.size() > 4) fail(text, "an image has 4 channels at most.");
    if (std::all_of(pack.channels.begin(), pack.channels.end(),
                    [](const PackChannel& channel) { return channel.map.empty(); })) {
      fail(text, "at least one channel must be a map's.");
    }
    packs.push_back(std::move(pack));
  }
  return packs;
}

}  // namespace kiln::cli

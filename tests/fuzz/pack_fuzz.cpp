// The words of --pack, a line each, in a bake of four maps: 1 to 4 channels that are there, or
// kiln::Error(usage).
#include <cstdint>
#include <cstdlib>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "job/map_words.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kiln::Job arguments;
  arguments.bake.maps.clear();
  for (const char* map : {"normal", "ao", "color", "uv"}) {
    arguments.bake.maps.push_back(kiln::find_map(map).kind);
  }
  std::istringstream text({reinterpret_cast<const char*>(data), size});
  for (std::string line; std::getline(text, line);) arguments.packs.push_back(line);
  try {
    const std::vector<kiln::Pack> packs = kiln::parse_packs(arguments);
    if (packs.size() != arguments.packs.size()) std::abort();
    for (const kiln::Pack& pack : packs) {
      if (pack.name.empty() || pack.channels.empty() || pack.channels.size() > 4) std::abort();
      for (const kiln::PackChannel& channel : pack.channels) {
        const bool number = channel.map.empty() && channel.value >= 0 && channel.value <= 1;
        if (!number && channel.channel >= kiln::find_map(channel.map).channels) std::abort();
      }
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::usage) std::abort();
  }
  return 0;
}

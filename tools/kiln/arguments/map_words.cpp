// Which maps --maps and --transfer ask for, before any file is read.
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arguments/transfers.h"

namespace kiln::cli {

bool map_takes(std::string_view name, bool MapInfo::*texture) {
  return std::any_of(maps().begin(), maps().end(),
                     [&](const MapInfo& map) { return map.kind.name == name && map.*texture; });
}

bool is_texture_of_map(std::string_view name) {
  return map_takes(name, &MapInfo::takes_color) || map_takes(name, &MapInfo::takes_opacity);
}

std::vector<std::string> own_map_names(const BakeArguments& arguments) {
  std::vector<std::string> names;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    if (!is_texture_of_map(transfer.name)) names.push_back(transfer.name);
  }
  for (const std::string& text : arguments.own_maps)
    names.push_back(text.substr(0, text.find('=')));
  return names;
}

void part_maps(BakeArguments& a) {
  std::vector<std::string> maps;
  for (const std::string& map : a.maps) {
    (map.find('=') == std::string::npos ? maps : a.own_maps).push_back(map);
  }
  a.maps = std::move(maps);
}

std::vector<std::string> maps_asked(const BakeArguments& arguments) {
  std::vector<std::string> maps = arguments.maps;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    if (is_texture_of_map(transfer.name) &&
        std::find(maps.begin(), maps.end(), transfer.name) == maps.end()) {
      maps.push_back(transfer.name);
    }
  }
  return maps;
}

std::vector<std::string> all_maps(const BakeArguments& arguments) {
  std::vector<std::string> maps = maps_asked(arguments);
  for (std::string& name : own_map_names(arguments)) maps.push_back(std::move(name));
  return maps;
}

}  // namespace kiln::cli

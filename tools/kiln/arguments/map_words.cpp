// Which maps --maps and --transfer ask for, before any file is read.
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arguments/transfers.h"

namespace kiln::cli {

bool map_takes(std::string_view name, std::string_view option) {
  return std::any_of(maps().begin(), maps().end(), [&](const MapInfo& map) {
    return map.kind.name == name && obeys(map, option);
  });
}

bool is_texture_of_map(std::string_view name) {
  return map_takes(name, "color") || map_takes(name, "opacity");
}

std::vector<std::string> own_map_names(const BakeJob& arguments) {
  std::vector<std::string> names;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    if (!is_texture_of_map(transfer.name)) names.push_back(transfer.name);
  }
  for (const std::vector<std::string>* words : {&arguments.own_maps, &arguments.variants})
    for (const std::string& text : *words) names.push_back(text.substr(0, text.find('=')));
  return names;
}

std::vector<MapKind> maps_asked(const BakeJob& arguments) {
  std::vector<MapKind> maps = arguments.options.maps;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    if (!is_texture_of_map(transfer.name)) continue;
    const MapKind map = find_map(transfer.name).kind;
    if (std::find(maps.begin(), maps.end(), map) == maps.end()) maps.push_back(map);
  }
  return maps;
}

bool is_variant(std::string_view word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view rest = word.substr(equals + 1);
  const std::string_view kind = rest.substr(0, rest.find(':'));
  return std::any_of(maps().begin(), maps().end(),
                     [&](const MapInfo& map) { return map.kind.name == kind; });
}

MapKind variant_kind(const std::string& word) {
  const std::string rest = word.substr(word.find('=') + 1);
  return find_map(rest.substr(0, rest.find(':'))).kind;
}

std::vector<MapKind> kinds_asked(const BakeJob& job) {
  std::vector<MapKind> kinds = job.options.maps;
  for (const std::string& word : job.variants) kinds.push_back(variant_kind(word));
  return kinds;
}

std::vector<std::string> all_maps(const BakeJob& arguments) {
  std::vector<std::string> maps;
  for (const MapKind map : maps_asked(arguments)) maps.emplace_back(map.name);
  for (std::string& name : own_map_names(arguments)) maps.push_back(std::move(name));
  return maps;
}

}  // namespace kiln::cli

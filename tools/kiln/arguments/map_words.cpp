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

MapVariant parse_variant(const BakeJob& job, const std::string& word) {
  const std::size_t equals = word.find('=');
  MapVariant map;
  map.name = word.substr(0, equals);
  std::string rest = word.substr(equals + 1);
  const auto next = [&] {
    const std::size_t colon = std::min(rest.find(':'), rest.size());
    std::string part = rest.substr(0, colon);
    rest.erase(0, colon + 1);
    return part;
  };
  const MapInfo& info = find_map(next());
  map.kind = info.kind;
  BakeJob own = job;
  while (!rest.empty()) {
    const std::string part = next();
    const std::string flag = "--" + part.substr(0, part.find('='));
    const OptionRow* const row = find_row(bake_rows(), flag);
    // What is not a setting of maps is of the whole bake; lists have commas, which part the words of --maps.
    const bool is_setting =
        row != nullptr && row->map != nullptr && row->map(info) && row->value.type != "list";
    const std::string member = is_setting ? row->value.member : "";
    const auto is_of = [&](std::string_view path) { return member.starts_with(path); };
    const bool known = is_of("options.occlusion") || is_of("options.light") ||
                       is_of("options.curvature_radius") || is_of("options.id_by");
    if (!known) {
      fail_usage("--maps '" + word + "': '" + part + "' is no option of the map " +
                 std::string(info.kind.name) +
                 " alone: take one that --help names for it, such as " + "ao-distance=2% of ao.");
    }
    const bool has_value = part.find('=') != std::string::npos;
    if (has_value == row->value.type.starts_with("flag")) {
      fail_usage(
          "--maps '" + word + "': " + flag +
          (has_value ? " takes no value." : " needs a value: write " + flag.substr(2) + "=VALUE."));
    }
    try {
      row->value.set(&own, flag, {has_value ? part.substr(part.find('=') + 1) : "true"});
    } catch (const UsageError& error) {
      fail_usage("--maps '" + word + "': " + error.what());
    }
    if (is_of("options.occlusion")) map.occlusion = own.options.occlusion;
    if (is_of("options.light")) map.light = own.options.light;
    if (is_of("options.curvature_radius")) map.curvature_radius = own.options.curvature_radius;
    if (is_of("options.id_by")) map.id_by = own.options.id_by;
  }
  return map;
}

std::vector<MapKind> kinds_asked(const BakeJob& job) {
  std::vector<MapKind> kinds = job.options.maps;
  for (const std::string& word : job.variants) {
    const std::string rest = word.substr(word.find('=') + 1);
    kinds.push_back(find_map(rest.substr(0, rest.find(':'))).kind);
  }
  return kinds;
}

void share_occluders(BakeOptions& options) {
  for (MapVariant& map : options.variants) {
    if (!map.occlusion) continue;
    map.occlusion->by_high = options.occlusion.by_high;
    map.occlusion->by_low = options.occlusion.by_low;
    map.occlusion->by_others = options.occlusion.by_others;
  }
}

std::vector<std::string> all_maps(const BakeJob& arguments) {
  std::vector<std::string> maps;
  for (const MapKind map : maps_asked(arguments)) maps.emplace_back(map.name);
  for (std::string& name : own_map_names(arguments)) maps.push_back(std::move(name));
  return maps;
}

}  // namespace kiln::cli

// Maps of --maps with options of their own.
#include <algorithm>
#include <string>
#include <string_view>

#include "arguments/option_table.h"
#include "arguments/transfers.h"

namespace kiln::cli {

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
    // A flag that is no setting of maps is of the whole bake; lists have commas, which part the words of --maps.
    const bool is_setting =
        row != nullptr && row->is_of_maps() && row->serves(info) && row->value.type != "list";
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

void share_occluders(BakeOptions& options) {
  for (MapVariant& map : options.variants) {
    if (!map.occlusion) continue;
    map.occlusion->by_high = options.occlusion.by_high;
    map.occlusion->by_low = options.occlusion.by_low;
    map.occlusion->by_others = options.occlusion.by_others;
  }
}

}  // namespace kiln::cli

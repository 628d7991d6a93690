#include "arguments/map_bounds.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "arguments/bake_job.h"
#include "arguments/parse.h"
#include "arguments/transfers.h"

namespace kiln::cli {
namespace {

[[noreturn]] void bad(const BakeJob& a, const std::string& what) {
  throw Error(ErrorCode::usage, "--max-error is '" + a.max_error + "': " + what);
}

std::vector<std::string_view> items_of(std::string_view list) {
  std::vector<std::string_view> items;
  for (;;) {
    const std::size_t comma = list.find(',');
    items.push_back(list.substr(0, comma));
    if (comma == std::string_view::npos) return items;
    list.remove_prefix(comma + 1);
  }
}

}  // namespace

std::string normal_bound(const std::string& max_error) {
  for (const std::string_view item : items_of(max_error)) {
    const std::size_t sign = item.find('=');
    if (sign != std::string_view::npos && item.substr(0, sign) == shading_map().name) {
      if (sign + 1 == item.size()) {
        throw Error(ErrorCode::usage, "--max-error is '" + max_error +
                                          "': give degrees after normal=, such as normal=1.5.");
      }
      return std::string(item.substr(sign + 1));
    }
  }
  return "";
}

std::vector<MapBound> map_bounds(const BakeJob& a) {
  std::vector<MapBound> bounds;
  if (!bounds_maps(a)) return bounds;
  std::vector<std::string_view> named;
  const std::vector<std::string> own = own_map_names(a);
  for (const std::string_view item : items_of(a.max_error)) {
    const std::size_t sign = item.find('=');
    if (sign == std::string_view::npos) {
      bad(a, "'" + std::string(item) + "' names no map: give MAP=ERROR, such as ao=2/255.");
    }
    const std::string_view name = item.substr(0, sign);
    if (std::find(named.begin(), named.end(), name) != named.end()) {
      bad(a, std::string(name) + " has two errors: leave one of them out.");
    }
    named.push_back(name);
    if (name == shading_map().name) continue;
    const std::vector<MapKind> maps = maps_asked(a);
    if (std::find(maps.begin(), maps.end(), MapKind{name}) == maps.end() &&
        std::find(own.begin(), own.end(), name) == own.end()) {
      bad(a, "no map '" + std::string(name) + "' is baked: add it to --maps, or leave it out.");
    }
    const double error = fraction(item.substr(sign + 1)).value_or(0);
    if (error == 0) {
      bad(a, "the error of " + std::string(name) +
                 " must be a number or a fraction above 0, such as 2/255.");
    }
    bounds.push_back({MapKind{name}, error});
  }
  if (std::find(named.begin(), named.end(), shading_map().name) == named.end()) {
    bad(a, "add normal=DEGREES, since match and faces are chosen by the normals.");
  }
  return bounds;
}

void smooth_occlusion(BakeJob& a) {
  constexpr const char* kGathering[] = {"--ao-rays", "--ao-error", "--ao-by", "--ao-views"};
  if (std::any_of(std::begin(kGathering), std::end(kGathering),
                  [&](const char* flag) { return a.given.contains(flag); }))
    return;
  for (const std::string_view bound : items_of(a.max_error)) {
    const std::string_view name = bound.substr(0, bound.find('='));
    if (std::any_of(maps().begin(), maps().end(), [&](const MapInfo& map) {
          return map.kind.name == name && obeys(map, "occlusion.max_error");
        }))
      return;  // its bound chooses
  }
  a.options.occlusion.max_error = 1;
}

std::string describe(const MapReached& map) {
  const std::string unit = map.unit.empty() ? "" : " " + std::string(map.unit);
  return formatted("%s: %.3g%s off, %.3g wanted (root mean square at %s points of the surface)",
                   std::string(map.kind.name).c_str(), map.error, unit.c_str(), map.wanted,
                   with_commas(map.points).c_str());
}

Json bounds_json(const std::vector<MapReached>& bounds) {
  Json json = Json::array();
  for (const MapReached& map : bounds) {
    json.push_back({{"map", map.kind.name},
                    {"unit", map.unit},
                    {"wanted", map.wanted},
                    {"rms", map.error},
                    {"points", map.points},
                    {"reached", map.reached()}});
  }
  return json;
}

}  // namespace kiln::cli

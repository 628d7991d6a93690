#include "arguments/option_table.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "arguments/bake_values.h"
#include "arguments/transfers.h"

namespace kiln::cli {
namespace {

using ServesMatch = bool (*)(const MatchInfo&);
using ServesMap = bool (*)(const MapInfo&);

bool every_match(const MatchInfo&) { return true; }
bool by_views(const MatchInfo& match) { return match.takes_views; }
bool by_uv(const MatchInfo& match) { return match.needs_uvs; }
bool in_clusters(const MatchInfo& match) { return match.takes_clusters; }
bool takes_cage(const MatchInfo& match) { return match.takes_cage; }
bool tells_reasons(const MatchInfo& match) { return match.tells_reasons; }
bool along_low(const MatchInfo& match) { return match.along_low; }
bool searches_bvh(const MatchInfo& match) { return match.tells_recall; }
bool by_points(const MatchInfo& match) { return match.takes_parts; }
bool takes_directions(const MatchInfo& match) { return match.takes_directions; }
bool takes_visibility(const MatchInfo& match) { return match.takes_visibility; }
bool looks_far(const MatchInfo& match) { return match.looks_far; }

bool holds_directions(const MapInfo& map) { return map.type == MapType::unit_vector; }
bool has_padding(const MapInfo& map) { return map.type != MapType::coverage; }
bool has_mips(const MapInfo& map) { return has_padding(map) && map.type != MapType::id; }

bool takes_rays(const MapInfo& map) { return map.takes_rays; }
bool takes_back_faces(const MapInfo& map) { return map.takes_back_faces; }
bool takes_views(const MapInfo& map) { return map.takes_views; }
bool takes_falloff(const MapInfo& map) { return map.takes_falloff; }
bool takes_max_error(const MapInfo& map) { return map.takes_max_error; }
bool takes_light(const MapInfo& map) { return map.takes_light; }
bool takes_id_by(const MapInfo& map) { return map.takes_id_by; }
bool takes_origin(const MapInfo& map) { return map.takes_origin; }
bool takes_curvature_radius(const MapInfo& map) { return map.takes_curvature_radius; }

/// A flag that serves some matches, or some maps. Flags that serve every bake have no row.
struct OptionRow {
  std::string_view flag;
  ServesMatch match = nullptr;  ///< Null: it does not depend on the match
  ServesMap map = nullptr;      ///< Null: it does not depend on the maps
  bool in_fallback = true;      ///< It serves such a match as a fallback, too
  bool beside_auto = false;     ///< --match auto may choose a match that it serves
};

constexpr std::array kOptions = {
    // Any match: none is made from a saved one.
    OptionRow{.flag = "--match", .match = every_match, .beside_auto = true},
    OptionRow{.flag = "--fallback", .match = every_match, .beside_auto = true},
    OptionRow{.flag = "--fallback-blend", .match = every_match, .beside_auto = true},
    OptionRow{.flag = "--max-distance", .match = looks_far, .beside_auto = true},
    OptionRow{.flag = "--cage", .match = takes_cage, .beside_auto = true},
    OptionRow{.flag = "--cage-mesh", .match = takes_cage, .beside_auto = true},
    OptionRow{.flag = "--save-cage", .match = takes_cage, .beside_auto = true},
    OptionRow{.flag = "--ray", .match = takes_cage, .beside_auto = true},
    OptionRow{.flag = "--direction", .match = along_low, .in_fallback = false, .beside_auto = true},
    OptionRow{
        .flag = "--edge-width", .match = along_low, .in_fallback = false, .beside_auto = true},
    OptionRow{.flag = "--match-by", .match = by_points, .in_fallback = false},
    OptionRow{.flag = "--low-names", .match = by_points, .in_fallback = false},
    OptionRow{.flag = "--high-names", .match = by_points, .in_fallback = false},
    OptionRow{.flag = "--match-list", .match = by_points, .in_fallback = false},
    OptionRow{.flag = "--reasons", .match = tells_reasons, .in_fallback = false},
    OptionRow{.flag = "--recall", .match = searches_bvh, .in_fallback = false, .beside_auto = true},
    OptionRow{.flag = "--force-uv", .match = by_uv, .in_fallback = false},
    OptionRow{.flag = "--views", .match = by_views},
    OptionRow{.flag = "--view", .match = takes_directions},
    OptionRow{.flag = "--view-size", .match = by_views},
    OptionRow{.flag = "--view-criterion", .match = by_views},
    OptionRow{.flag = "--no-view-refine", .match = by_views},
    OptionRow{.flag = "--visibility-at", .match = takes_visibility},
    OptionRow{.flag = "--directions", .match = takes_visibility},
    OptionRow{.flag = "--visibility-test", .match = takes_visibility},
    OptionRow{.flag = "--visibility-size", .match = takes_visibility},
    OptionRow{.flag = "--visibility-smooth", .match = takes_visibility},
    OptionRow{.flag = "--view-weight", .match = takes_visibility},
    OptionRow{.flag = "--visibility-clusters", .match = in_clusters, .in_fallback = false},
    OptionRow{.flag = "--visibility-deviation", .match = in_clusters, .in_fallback = false},
    OptionRow{.flag = "--space", .map = holds_directions},
    OptionRow{.flag = "--bitangent", .map = holds_directions},
    OptionRow{.flag = "--flip-y", .map = holds_directions},
    OptionRow{.flag = "--two-component", .map = holds_directions},
    OptionRow{.flag = "--raw", .map = holds_directions},
    OptionRow{.flag = "--ao-by", .map = takes_views},
    OptionRow{.flag = "--ao-views", .map = takes_views},
    OptionRow{.flag = "--ao-rays", .map = takes_rays},
    OptionRow{.flag = "--ao-distance", .map = takes_rays},
    OptionRow{.flag = "--ao-falloff", .map = takes_falloff},
    OptionRow{.flag = "--ao-ignore-back-faces", .map = takes_back_faces},
    OptionRow{.flag = "--ao-occluders", .map = takes_back_faces},
    OptionRow{.flag = "--part-occlusion", .map = takes_back_faces},
    OptionRow{.flag = "--curvature-radius", .map = takes_curvature_radius},
    OptionRow{.flag = "--ao-error", .map = takes_max_error},
    OptionRow{.flag = "--light", .map = takes_light},
    OptionRow{.flag = "--light-angle", .map = takes_light},
    OptionRow{.flag = "--id-by", .map = takes_id_by},
    OptionRow{.flag = "--origin", .map = takes_origin},
    OptionRow{.flag = "--gutter", .map = has_padding},
    OptionRow{.flag = "--mips", .map = has_mips},
};

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  }
  return text;
}

bool serves_match(const OptionRow& row, const BakeArguments& a) {
  if (row.match == nullptr) return true;
  if (a.match == kAutomatic && row.beside_auto) return true;
  const auto served = [&](const MatchInfo& match) {
    return row.match(match) &&
           (a.match == match.method.name || (row.in_fallback && matches_by(a, match.method)));
  };
  return std::any_of(matches().begin(), matches().end(), served);
}

/// What any of them may be.
MapInfo own_map_info() {
  MapInfo info;
  info.type = MapType::unit_vector;
  info.takes_origin = true;
  return info;
}

bool serves_map(const OptionRow& row, const BakeArguments& a) {
  // Maps beside --maps are textures and the user's own: normals, or colours and numbers.
  if (row.map != nullptr && !own_map_names(a).empty() && row.map(own_map_info())) return true;
  return row.map == nullptr ||
         std::any_of(a.maps.begin(), a.maps.end(),
                     [&](const std::string& name) { return row.map(find_map(name)); });
}

std::string not_this_match(const OptionRow& row, const BakeArguments& a) {
  std::vector<std::string> served, following;
  for (const MatchInfo& match : matches()) {
    if (!row.match(match)) continue;
    served.emplace_back(match.method.name);
    if (match.may_follow && row.in_fallback) following.emplace_back(match.method.name);
  }
  const std::string flag(row.flag);
  return flag + " is for --match " + joined(served) +
         (following.empty()
              ? ": leave it out."
              : ": with --match " + a.match + " it needs --fallback " + joined(following) + ".");
}

std::string not_these_maps(const OptionRow& row) {
  std::vector<std::string> served;
  for (const MapInfo& map : maps()) {
    if (row.map(map)) served.emplace_back(map.kind.name);
  }
  return std::string(row.flag) + " is for --maps " + joined(served) +
         ": add such a map, or leave it out.";
}

}  // namespace

std::set<std::string> given_flags(const Command& command) {
  std::set<std::string> given;
  for (const Option* option : command.get_options()) {
    if (option->count() == 0) continue;
    for (const std::string& name : option->get_lnames()) given.insert("--" + name);
  }
  return given;
}

void check_served(const BakeArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  for (const OptionRow& row : kOptions) {
    const std::string flag(row.flag);
    if (!a.given.contains(flag)) continue;
    // The chain's end is about the maps.
    if (flag == "--fallback" && fallback_methods(a).empty()) continue;
    if (row.match != nullptr && !a.load_match.empty()) {
      fail(flag + " is for matching, but --load-match takes a match as it is: leave one out.");
    }
    if (!serves_match(row, a)) fail(not_this_match(row, a));
    if (!serves_map(row, a)) fail(not_these_maps(row));
  }
}

}  // namespace kiln::cli

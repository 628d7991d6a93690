#include "job/map_words.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "job/job_options.h"
#include "job/transfers.h"
#include "options/option_table.h"
#include "options/parse.h"

namespace kiln {
bool map_uses(std::string_view name, std::string_view option) {
  return std::any_of(maps().begin(), maps().end(), [&](const MapInfo& map) {
    return map.kind.name == name && obeys(map, option);
  });
}

bool is_texture_of_map(std::string_view name) {
  return map_uses(name, "color") || map_uses(name, "opacity");
}

std::vector<std::string> own_map_names(const Job& arguments) {
  std::vector<std::string> names;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    if (!is_texture_of_map(transfer.name)) names.push_back(transfer.name);
  }
  for (const std::vector<std::string>* words : {&arguments.own_maps, &arguments.variants})
    for (const std::string& text : *words) names.push_back(text.substr(0, text.find('=')));
  return names;
}

std::vector<MapKind> requested_maps(const Job& arguments) {
  std::vector<MapKind> maps = maps_or_default(arguments);
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

std::vector<MapKind> requested_map_kinds(const Job& job) {
  std::vector<MapKind> kinds = maps_or_default(job);
  for (const std::string& word : job.variants) kinds.push_back(variant_kind(word));
  return kinds;
}

std::vector<std::string> all_map_names(const Job& arguments) {
  std::vector<std::string> maps;
  for (const MapKind map : requested_maps(arguments)) maps.emplace_back(map.name);
  for (std::string& name : own_map_names(arguments)) maps.push_back(std::move(name));
  return maps;
}

MapVariant parse_variant(const Job& job, const std::string& word) {
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
  Job parsed_job = job;
  while (!rest.empty()) {
    const std::string part = next();
    const std::string flag = "--" + part.substr(0, part.find('='));
    const OptionRow* const row = find_row(bake_rows(), flag);
    // Only options of a single map can be set here; others apply to the whole bake. Lists are excluded because commas
    // separate the items of --maps.
    const bool is_settable = row != nullptr && row->is_map_option() && row->applies_to(info) &&
                             row->value.type != "list";
    const std::string option_member = is_settable ? row->value.member : "";
    const auto is_in_member = [&](std::string_view path) {
      return option_member.starts_with(path);
    };
    const bool is_known = is_in_member("bake.occlusion") || is_in_member("bake.light") ||
                          is_in_member("bake.curvature_radius") || is_in_member("bake.id_by");
    refuse_if(
        !is_known,
        option("maps") + " '" + word + "': '" + part + "' cannot be set for the map " +
            std::string(info.kind.name) +
            " alone: use an option that --help lists for this map, such as ao-distance=2% for ao.");
    const bool has_value = part.find('=') != std::string::npos;
    refuse_if(has_value == row->value.type.starts_with("flag"),
              option("maps") + " '" + word + "': " + option_of(flag) +
                  (has_value ? " does not take a value."
                             : " needs a value: write " + flag.substr(2) + "=VALUE."));
    try {
      row->value.set(&parsed_job, option_of(flag),
                     {has_value ? part.substr(part.find('=') + 1) : "true"});
    } catch (const Error& error) {
      fail_usage(option("maps") + " '" + word + "': " + error.message());
    }
    if (is_in_member("bake.occlusion")) map.occlusion = parsed_job.bake.occlusion;
    if (is_in_member("bake.light")) map.light = parsed_job.bake.light;
    if (is_in_member("bake.curvature_radius"))
      map.curvature_radius = parsed_job.bake.curvature_radius;
    if (is_in_member("bake.id_by")) map.id_by = parsed_job.bake.id_by;
  }
  return map;
}

void copy_occluders_to_variants(BakeOptions& options) {
  for (MapVariant& map : options.variants) {
    if (!map.occlusion) continue;
    map.occlusion->by_high = options.occlusion.by_high;
    map.occlusion->by_low = options.occlusion.by_low;
    map.occlusion->by_others = options.occlusion.by_others;
  }
}

namespace {

[[noreturn]] void fail_max_error(const Job& a, const Message& what) {
  fail_usage(option("max_error") + " is '" + a.low.make.max_error + "': " + what);
}

std::vector<std::string_view> split_items(std::string_view list) {
  std::vector<std::string_view> bound_items;
  for (;;) {
    const std::size_t comma = list.find(',');
    bound_items.push_back(list.substr(0, comma));
    if (comma == std::string_view::npos) return bound_items;
    list.remove_prefix(comma + 1);
  }
}

}  // namespace

std::string normal_error_bound(const std::string& max_error) {
  for (const std::string_view bound_item : split_items(max_error)) {
    const std::size_t sign = bound_item.find('=');
    if (sign != std::string_view::npos && bound_item.substr(0, sign) == shading_map().name) {
      refuse_if(sign + 1 == bound_item.size(),
                option("max_error") + " is '" + max_error +
                    "': give degrees after normal=, such as normal=1.5.");
      return std::string(bound_item.substr(sign + 1));
    }
  }
  return "";
}

std::vector<MapBound> map_bounds(const Job& a) {
  std::vector<MapBound> bounds;
  if (!bounds_map_errors(a)) return bounds;
  std::vector<std::string_view> named;
  const std::vector<std::string> own_names = own_map_names(a);
  for (const std::string_view bound_item : split_items(a.low.make.max_error)) {
    const std::size_t sign = bound_item.find('=');
    if (sign == std::string_view::npos) {
      fail_max_error(
          a, "'" + std::string(bound_item) + "' has no map: give MAP=ERROR, such as ao=2/255.");
    }
    const std::string_view name = bound_item.substr(0, sign);
    if (std::find(named.begin(), named.end(), name) != named.end()) {
      fail_max_error(a, std::string(name) + " is given two errors: leave one of them out.");
    }
    named.push_back(name);
    if (name == shading_map().name) continue;
    const std::vector<MapKind> maps = requested_maps(a);
    if (std::find(maps.begin(), maps.end(), MapKind{name}) == maps.end() &&
        std::find(own_names.begin(), own_names.end(), name) == own_names.end()) {
      fail_max_error(a, "the map '" + std::string(name) + "' is not baked: add it to " +
                            option("maps") + ", or leave it out.");
    }
    const double error = fraction(bound_item.substr(sign + 1)).value_or(0);
    if (error == 0) {
      fail_max_error(a, "the error of " + std::string(name) +
                            " must be a number or a fraction above 0, such as 2/255.");
    }
    bounds.push_back({MapKind{name}, error});
  }
  if (std::find(named.begin(), named.end(), shading_map().name) == named.end()) {
    fail_max_error(
        a, "add normal=DEGREES, since the error of normals decides the match and the faces.");
  }
  return bounds;
}

void enable_occlusion_smoothing(Job& a) {
  constexpr const char* kGatherFlags[] = {"--ao-rays", "--ao-error", "--ao-by", "--ao-views"};
  if (std::any_of(std::begin(kGatherFlags), std::end(kGatherFlags),
                  [&](const char* flag) { return a.given.contains(flag); }))
    return;
  for (const std::string_view bound : split_items(a.low.make.max_error)) {
    const std::string_view name = bound.substr(0, bound.find('='));
    if (std::any_of(maps().begin(), maps().end(), [&](const MapInfo& map) {
          return map.kind.name == name && obeys(map, "occlusion.max_error");
        }))
      return;  // the error bound chooses the number of rays
  }
  // On smaller maps smoothing has too few neighbouring texels, so that nearly all texels would cast all rays anyway.
  constexpr std::uint64_t kMinTexelsToSmooth = std::uint64_t{1024} * 1024;
  if (std::uint64_t{a.bake.width} * a.bake.height < kMinTexelsToSmooth) return;
  a.bake.occlusion.max_error = 1;
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

namespace {

[[noreturn]] void fail(const std::string& text, const Message& why) {
  fail_usage(option("pack") + " '" + text + "': " + why);
}

/// Number of channels of one of the job's maps; 0 if no map has this name.
std::uint32_t channels_of(const Job& a, const std::string& map) {
  for (const MapKind requested_map : requested_maps(a)) {
    if (requested_map.name == map) return find_map(map).channels;
  }
  for (const std::string& word : a.variants) {
    if (word.substr(0, word.find('=')) == map) return find_map(variant_kind(word).name).channels;
  }
  const std::vector<std::string> own_names = own_map_names(a);
  return std::find(own_names.begin(), own_names.end(), map) != own_names.end() ? 3 : 0;
}

PackChannel parse_channel(const Job& a, const std::string& text, const std::string& part) {
  PackChannel channel;
  const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), channel.value);
  if (status == std::errc() && end == part.data() + part.size()) {
    if (channel.value >= 0 && channel.value <= 1) return channel;
    fail(text, "a number must be from 0 to 1.");
  }
  const std::size_t dot = part.find('.');
  channel.map = part.substr(0, dot);
  if (dot != std::string::npos) {
    const std::size_t channel_index = std::string("rgba").find(part.substr(dot + 1));
    if (part.size() != dot + 2 || channel_index == std::string::npos) {
      fail(text,
           "'" + part + "' does not end in a channel: append .r, .g, .b or .a to the map's name.");
    }
    channel.channel = static_cast<std::uint32_t>(channel_index);
  }
  const std::uint32_t channels = channels_of(a, channel.map);
  if (channels == 0) {
    fail(text, "the map '" + channel.map + "' is not baked: add it with " + option("maps") +
                   " or " + option("transfer") + ".");
  }
  if (channel.channel >= channels) {
    fail(text, "the map " + channel.map + " has " + std::to_string(channels) +
                   " channels: choose another one.");
  }
  return channel;
}

}  // namespace

std::vector<Pack> parse_packs(const Job& a) {
  std::vector<Pack> packed_images;
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
        std::any_of(packed_images.begin(), packed_images.end(),
                    [&](const Pack& other) { return other.name == pack.name; })) {
      fail(text, "'" + pack.name +
                     "' is already the name of another file of this bake: choose another name.");
    }
    std::size_t begin = equals + 1;
    while (begin <= text.size()) {
      const std::size_t comma = std::min(text.find(',', begin), text.size());
      pack.channels.push_back(parse_channel(a, text, text.substr(begin, comma - begin)));
      begin = comma + 1;
    }
    if (pack.channels.size() > 4) fail(text, "an image has at most 4 channels: remove some.");
    if (std::all_of(pack.channels.begin(), pack.channels.end(),
                    [](const PackChannel& channel) { return channel.map.empty(); })) {
      fail(text, "at least one channel must be a map, not a number.");
    }
    packed_images.push_back(std::move(pack));
  }
  return packed_images;
}

}  // namespace kiln

#include "arguments/bake_job.h"

#include <algorithm>
#include <charconv>

#include "arguments/lists.h"
#include "arguments/map_words.h"
#include "arguments/parse.h"
#include "arguments/transfers.h"

namespace kiln::cli {
namespace {

/// "height=-0.2,0.2" of a map of this bake.
MapRange parse_range(const BakeJob& job, const std::string& text) {
  const std::size_t equals = text.find('='), comma = text.find(',', equals);
  MapRange range;
  const auto number = [&](std::size_t begin, std::size_t end, float& value) {
    const char* const last = text.data() + end;
    const auto [stop, status] = std::from_chars(text.data() + begin, last, value);
    return status == std::errc() && stop == last;
  };
  refuse_if(equals == std::string::npos || comma == std::string::npos ||
                !number(equals + 1, comma, range.range.low) ||
                !number(comma + 1, text.size(), range.range.high),
            "--range '" + text + "': write MAP=LO,HI, two numbers, such as height=-0.2,0.2.");
  const std::string_view name = std::string_view(text).substr(0, equals);
  const std::vector<std::string> own = own_map_names(job);
  const bool is_own = std::find(own.begin(), own.end(), name) != own.end();
  range.kind = is_own ? MapKind{name} : find_map(name).kind;
  return range;
}

}  // namespace

BakeOptions options_of(const BakeJob& job) {
  BakeOptions options = job.options;
  options.maps = maps_asked(job);
  for (const std::string& text : job.ranges) {
    options.encoding.ranges.push_back(parse_range(job, text));
  }
  options.own_maps = load_own_maps(job);
  for (const std::string& text : job.variants) options.variants.push_back(parse_variant(job, text));
  VisibilityOptions& visibility = options.match.visibility;
  if (visibility.likelihood == ViewLikelihood::list) {
    visibility.likelihoods = load_likelihoods(job.view_weights);
  }
  options.report.keep_match = !job.save_match.empty() || job.reasons;
  if (holds_mips(job.image) && !is_exr(job.image)) options.encoding.mips = true;
  return options;
}

Json describe(const BakeJob& job, const BakeReport& report) {
  Json json = values_json(bake_rows(), &job);
  // An option that does not apply is null, and a choice is told as it was made.
  const auto only_if = [&](bool applies, std::initializer_list<const char*> keys) {
    for (const char* key : keys) {
      if (!applies) json[key] = Json();
    }
  };
  if (!job.load_match.empty()) json["match"] = "loaded";
  only_if(job.load_match.empty(), {"fallback"});
  only_if(chain_obeys(job, "match.views.count"), {"views"});
  only_if(report.views.has_value(), {"view_size", "view_criterion", "view_refine"});
  if (report.views) json["view_size"] = report.views->size;
  only_if(job.load_match.empty() && chain_obeys(job, "match.visibility"),
          {"visibility_at", "directions", "visibility_size", "visibility_smooth",
           "visibility_clusters", "visibility_deviation", "view_weight"});
  json["visibility_test"] =
      report.visibility ? Json(report.visibility->by_rays ? "rays" : "views") : Json();
  json["max_distance_world"] = report.max_distance;
  only_if(job.parts_by.has_value(), {"part_occlusion"});
  only_if(job.parts_by == PartsBy::name, {"low_names", "high_names"});
  only_if(!job.low.empty() || !is_height_field(job.high), {"triangulate"});
  only_if(!job.low.empty(), {"tangents"});
  only_if(report.recall.has_value(), {"recall"});
  json["miss"] = name_of(Words(kMisses), job.options.encoding.miss);
  only_if(is_height_field(job.high), {"height", "no_data"});
  only_if(job.options.encoding.space == NormalMapSpace::tangent, {"bitangent"});
  json["ao_by"] =
      report.occlusion ? Json(name_of(Words(kOcclusionBy), report.occlusion->by)) : Json();
  json["ao_views"] =
      report.occlusion && report.occlusion->views > 0 ? Json(report.occlusion->views) : Json();
  only_if(maps_obey(job, "occlusion.rays"), {"ao_rays", "ao_occluders", "ao_back_faces"});
  only_if(maps_obey(job, "occlusion.falloff"), {"ao_falloff"});
  json["own_maps"] = job.own_maps;
  json["variants"] = job.variants;
  json["set_sizes"] = Json::object();
  for (const SetSize& size : job.set_sizes) json["set_sizes"][size.set] = {size.width, size.height};
  only_if(job.lods > 0, {"lod_growth", "lod_uvs"});
  json["unwrap_method"] = job.unwrap_method.empty() ? Json() : Json(job.unwrap_method);
  return json;
}

std::vector<std::string> high_files(const BakeJob& job) {
  std::vector<std::string> files = {job.high};
  files.insert(files.end(), job.more_high.begin(), job.more_high.end());
  return files;
}

std::vector<std::string> low_files(const BakeJob& job) {
  if (job.low.empty()) return {};
  std::vector<std::string> files = {job.low};
  files.insert(files.end(), job.more_low.begin(), job.more_low.end());
  return files;
}

bool has_more_files(const BakeJob& job) { return !job.more_high.empty() || !job.more_low.empty(); }

std::vector<std::string> match_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (!needs_direction(match)) names.emplace_back(match.method.name);
  }
  return names;
}

std::vector<std::string> surface_matches(const char* first) {
  std::vector<std::string> names = {first};
  for (const MatchInfo& match : matches()) {
    const bool more =
        obeys(match, "match.uv") || obeys(match, "match.views") || obeys(match, "match.visibility");
    if (!more) names.emplace_back(match.method.name);
  }
  return names;
}

MatchMethod first_match(std::string_view option) {
  return std::find_if(matches().begin(), matches().end(),
                      [&](const MatchInfo& match) { return obeys(match, option); })
      ->method;
}

MatchMethod nearest_match() {
  return std::find_if(matches().begin(), matches().end(),
                      [](const MatchInfo& match) {
                        return obeys(match, "match.max_distance") && !obeys(match, "match.ray") &&
                               !obeys(match, "match.views") && !obeys(match, "match.visibility");
                      })
      ->method;
}

std::string match_word(const BakeJob& job) {
  return job.match_auto ? kAutomatic : std::string(job.options.match.method.name);
}

bool matches_by(const BakeJob& job, MatchMethod method) {
  const MatchOptions& match = job.options.match;
  return (!job.match_auto && match.method == method) ||
         std::find(match.fallback.begin(), match.fallback.end(), method) != match.fallback.end();
}

bool match_obeys(const BakeJob& job, std::string_view option) {
  return !job.match_auto && obeys(find_match(job.options.match.method.name), option);
}

bool chain_obeys(const BakeJob& job, std::string_view option) {
  return std::any_of(matches().begin(), matches().end(), [&](const MatchInfo& match) {
    return obeys(match, option) && matches_by(job, match.method);
  });
}

bool maps_obey(const BakeJob& job, std::string_view option) {
  const std::vector<MapKind> kinds = kinds_asked(job);
  return std::any_of(kinds.begin(), kinds.end(),
                     [&](MapKind map) { return obeys(find_map(map.name), option); });
}

MapKind shading_map() { return BakeOptions().maps.front(); }

bool bakes_shading_map(const BakeJob& job) {
  const std::vector<MapKind>& maps = job.options.maps;
  return std::find(maps.begin(), maps.end(), shading_map()) != maps.end();
}

bool bounds_maps(const BakeJob& job) { return job.max_error.find('=') != std::string::npos; }

std::string angle_bound(const BakeJob& job) {
  if (bounds_maps(job)) return normal_bound(job.max_error);
  return job.max_angle.empty() && job.match_auto ? job.max_error : job.max_angle;
}

std::string deviation_bound(const BakeJob& job) {
  if (bounds_maps(job)) return "";
  return job.max_angle.empty() && job.match_auto ? "" : job.max_error;
}

bool plans_low_poly(const BakeJob& job) {
  const bool own = job.low.empty() && job.faces == 0;
  return own && job.load_match.empty() && !angle_bound(job).empty();
}

bool shares_uvs(const BakeJob& job) { return job.lods > 0 && job.lods_share_uvs; }

bool onto_plane(const BakeJob& job) {
  const bool simplified = job.faces != 0 || !deviation_bound(job).empty();
  return is_height_field(job.high) && job.low.empty() && !simplified;
}

bool is_exr(const SaveImageOptions& options) {
  return options.format == ImageFormat::exr_half || options.format == ImageFormat::exr_float;
}

bool holds_floats(const SaveImageOptions& options) {
  return is_exr(options) || options.format == ImageFormat::tiff_float;
}

bool holds_mips(const SaveImageOptions& options) {
  return is_exr(options) || options.format == ImageFormat::ktx2 ||
         options.format == ImageFormat::dds;
}

bool holds_bytes(const SaveImageOptions& options) {
  return !holds_floats(options) && options.format != ImageFormat::png16 &&
         options.format != ImageFormat::tiff16;
}

TextureUse texture_use(const BakedMap& map, const BakeOptions& options) {
  if (map.info.type == MapType::color) return TextureUse::color;
  if (map.info.type != MapType::unit_vector || map.image.channels < 3) return TextureUse::values;
  const NormalMapSpace space = map.info.space.value_or(options.encoding.space);
  return map.kind == shading_map() && space == NormalMapSpace::tangent ? TextureUse::tangent_normal
                                                                       : TextureUse::normal;
}

std::string extension(const SaveImageOptions& options) {
  return std::string(extension_of(options.format));
}

std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options) {
  std::vector<std::filesystem::path> files = {folder / (name + extension(options))};
  for (std::size_t level = 1; level <= mips && !holds_mips(options); ++level) {
    const std::string number = (level < 10 ? "0" : "") + std::to_string(level);
    files.push_back(folder / (name + ".mip" + number + extension(options)));
  }
  return files;
}

}  // namespace kiln::cli

#include "job/job_options.h"

#include <algorithm>
#include <charconv>

#include "image/stored_values.h"
#include "job/lists.h"
#include "job/map_words.h"
#include "job/transfers.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// Parses a value of --range, such as "height=-0.2,0.2", for a map of this job.
MapRange parse_range(const Job& job, const std::string& text) {
  const std::size_t equals = text.find('='), comma = text.find(',', equals);
  MapRange range;
  const auto number = [&](std::size_t begin, std::size_t end, float& value) {
    const char* const last = text.data() + end;
    const auto [stop, status] = std::from_chars(text.data() + begin, last, value);
    return status == std::errc() && stop == last;
  };
  refuse_if(
      equals == std::string::npos || comma == std::string::npos ||
          !number(equals + 1, comma, range.range.low) ||
          !number(comma + 1, text.size(), range.range.high),
      option("range") + " '" + text + "': write MAP=LO,HI, two numbers, such as height=-0.2,0.2.");
  const std::string_view name = std::string_view(text).substr(0, equals);
  const std::vector<std::string> own_names = own_map_names(job);
  const bool is_own_map = std::find(own_names.begin(), own_names.end(), name) != own_names.end();
  range.kind = is_own_map ? MapKind{name} : find_map(name).kind;
  return range;
}

}  // namespace

BakeOptions options_of(const Job& job) {
  BakeOptions options = job.bake;
  options.maps = requested_maps(job);
  for (const std::string& text : job.ranges) {
    options.encoding.ranges.push_back(parse_range(job, text));
  }
  for (OwnMap& map : load_own_maps(job)) options.own_maps.push_back(std::move(map));
  for (const std::string& text : job.variants) options.variants.push_back(parse_variant(job, text));
  VisibilityOptions& visibility = options.match.visibility;
  if (visibility.likelihood == ViewLikelihood::list) {
    visibility.likelihoods = load_likelihoods(job.view_weights);
  }
  options.report.keep_match |= !job.save_match.empty() || job.reasons;
  if (stores_mips_in_one_file(job.image) && !is_exr(job.image)) options.encoding.mips = true;
  return options;
}

Json describe(const Job& job, const BakeReport& report) {
  Json json = values_json(bake_rows(), &job);
  // The report shows null for options that do not apply, and for automatic options the value that was chosen.
  const auto set_null_unless = [&](bool applies, std::initializer_list<const char*> keys) {
    for (const char* key : keys) {
      if (!applies) json[key] = Json();
    }
  };
  if (has_saved_match(job)) json["match"] = "loaded";
  set_null_unless(!has_saved_match(job), {"fallback"});
  set_null_unless(any_match_uses_option(job, "match.views.count"), {"views"});
  set_null_unless(report.views.has_value(), {"view_size", "view_criterion", "view_refine"});
  if (report.views) json["view_size"] = report.views->size;
  set_null_unless(!has_saved_match(job) && any_match_uses_option(job, "match.visibility"),
                  {"visibility_at", "directions", "visibility_size", "visibility_smooth",
                   "visibility_clusters", "visibility_deviation", "view_weight"});
  json["visibility_test"] =
      report.visibility ? Json(report.visibility->by_rays ? "rays" : "views") : Json();
  json["max_distance_world"] = report.max_distance;
  set_null_unless(job.parts_by.has_value(), {"part_occlusion"});
  set_null_unless(job.parts_by == PartsBy::name, {"low_names", "high_names"});
  set_null_unless(!job.low.given.empty() || !has_heights(job), {"triangulate"});
  set_null_unless(!job.low.given.empty(), {"tangents"});
  set_null_unless(report.recall.has_value(), {"recall"});
  json["miss"] = name_of(Words(kMissWords), job.bake.encoding.miss);
  set_null_unless(has_heights(job), {"height", "no_data"});
  set_null_unless(job.bake.encoding.space == NormalMapSpace::tangent, {"bitangent"});
  json["ao_by"] =
      report.occlusion ? Json(name_of(Words(kOcclusionByWords), report.occlusion->by)) : Json();
  json["ao_views"] =
      report.occlusion && report.occlusion->views > 0 ? Json(report.occlusion->views) : Json();
  set_null_unless(any_map_uses_option(job, "occlusion.rays"),
                  {"ao_rays", "ao_occluders", "ao_back_faces"});
  set_null_unless(any_map_uses_option(job, "occlusion.falloff"), {"ao_falloff"});
  if (!writes_gltf(job)) {
    json["dither"] = job.image.dither;
    set_null_unless(false, {"quality", "normal_error", "fallback_textures", "mesh_compression"});
  }
  json["own_maps"] = job.own_maps;
  json["variants"] = job.variants;
  json["set_sizes"] = Json::object();
  for (const SetSize& size : job.set_sizes) json["set_sizes"][size.set] = {size.width, size.height};
  set_null_unless(job.low.make.lods > 0, {"lod_growth", "lod_uvs", "lod_files"});
  json["unwrap_method"] = job.unwrap_method.empty() ? Json() : Json(job.unwrap_method);
  return json;
}

namespace {

bool is_asset(const std::filesystem::path& out) {
  // A prefix is added, so that a name such as ".glb", which is only an extension, counts as an asset. A trailing slash
  // means a folder.
  const std::string ending = lower_extension("x" + out.filename().string());
  return ending == ".glb" || ending == ".gltf" || ending == ".obj";
}

const std::string& first_input_name(const std::vector<JobInput>& inputs) {
  static const std::string empty_name;
  return inputs.empty() ? empty_name : inputs.front().name;
}

std::vector<std::string> input_names(const std::vector<JobInput>& inputs) {
  std::vector<std::string> names;
  for (const JobInput& input : inputs) names.push_back(input.name);
  return names;
}

}  // namespace

std::string asset_file(const Job& job) { return is_asset(job.out) ? job.out : std::string(); }

std::string out_folder(const Job& job) {
  const std::filesystem::path out = job.out;
  if (!is_asset(out)) return job.out;
  return out.has_parent_path() ? out.parent_path().string() : ".";
}

const std::string& high_name(const Job& job) { return first_input_name(job.high); }
const std::string& low_name(const Job& job) { return first_input_name(job.low.given); }
void set_first_input(std::vector<JobInput>& inputs, const std::string& name) {
  if (inputs.empty()) inputs.emplace_back(name);
  inputs.front() = JobInput(name);
}
std::vector<std::string> further_input_names(const std::vector<JobInput>& inputs) {
  std::vector<std::string> names = input_names(inputs);
  if (!names.empty()) names.erase(names.begin());
  return names;
}
bool has_heights(const Job& job) {
  return !job.high.empty() && !job.high.front().asset && is_height_field(job.high.front().name);
}
std::vector<std::string> high_files(const Job& job) { return input_names(job.high); }
std::vector<std::string> low_files(const Job& job) { return input_names(job.low.given); }
bool has_more_files(const Job& job) { return job.high.size() > 1 || job.low.given.size() > 1; }

bool has_saved_match(const Job& job) {
  return !job.load_match.empty() || job.bake.match.saved != nullptr;
}
bool has_cage_mesh(const Job& job) {
  return !job.cage_mesh.empty() || job.bake.match.cage_mesh != nullptr;
}

std::vector<std::string> match_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (!needs_direction(match)) names.emplace_back(match.method.name);
  }
  return names;
}

std::vector<std::string> surface_match_names(const char* first) {
  std::vector<std::string> names = {first};
  for (const MatchInfo& match : matches()) {
    const bool has_further_files =
        obeys(match, "match.uv") || obeys(match, "match.views") || obeys(match, "match.visibility");
    if (!has_further_files) names.emplace_back(match.method.name);
  }
  return names;
}

MatchMethod first_match(std::string_view option) {
  return std::find_if(matches().begin(), matches().end(),
                      [&](const MatchInfo& match) { return obeys(match, option); })
      ->method;
}

MatchMethod distance_match() {
  return std::find_if(matches().begin(), matches().end(),
                      [](const MatchInfo& match) {
                        return obeys(match, "match.max_distance") && !obeys(match, "match.ray") &&
                               !obeys(match, "match.views") && !obeys(match, "match.visibility");
                      })
      ->method;
}

std::string match_name(const Job& job) {
  return job.match_auto ? kAutomatic : std::string(job.bake.match.method.name);
}

bool requests_match(const Job& job, MatchMethod method) {
  const MatchOptions& match = job.bake.match;
  return (!job.match_auto && match.method == method) ||
         std::find(match.fallback.begin(), match.fallback.end(), method) != match.fallback.end();
}

bool match_uses_option(const Job& job, std::string_view option) {
  return !job.match_auto && obeys(find_match(job.bake.match.method.name), option);
}

bool any_match_uses_option(const Job& job, std::string_view option) {
  return std::any_of(matches().begin(), matches().end(), [&](const MatchInfo& match) {
    return obeys(match, option) && requests_match(job, match.method);
  });
}

bool any_map_uses_option(const Job& job, std::string_view option) {
  const std::vector<MapKind> kinds = requested_map_kinds(job);
  return std::any_of(kinds.begin(), kinds.end(),
                     [&](MapKind map) { return obeys(find_map(map.name), option); });
}

std::vector<MapKind> maps_or_default(const Job& job) {
  const BakeOptions& bake = job.bake;
  const bool has_no_maps = bake.maps.empty() && bake.own_maps.empty() && bake.variants.empty() &&
                           job.own_maps.empty() && job.variants.empty();
  return has_no_maps ? BakeOptions().maps : bake.maps;
}

MapKind shading_map() { return BakeOptions().maps.front(); }

bool bakes_shading_map(const Job& job) {
  const std::vector<MapKind> maps = maps_or_default(job);
  return std::find(maps.begin(), maps.end(), shading_map()) != maps.end();
}

bool bounds_map_errors(const Job& job) {
  return job.low.make.max_error.find('=') != std::string::npos;
}

std::string angle_bound(const Job& job) {
  if (bounds_map_errors(job)) return normal_error_bound(job.low.make.max_error);
  return job.low.make.max_angle.empty() && job.match_auto ? job.low.make.max_error
                                                          : job.low.make.max_angle;
}

std::string deviation_bound(const Job& job) {
  if (bounds_map_errors(job)) return "";
  return job.low.make.max_angle.empty() && job.match_auto ? "" : job.low.make.max_error;
}

bool plans_low_poly(const Job& job) {
  const bool makes_low = job.low.given.empty() && job.low.make.faces == 0;
  const bool is_limited_by_bytes = job.max_bytes != 0 && deviation_bound(job).empty();
  return makes_low && !has_saved_match(job) && (is_limited_by_bytes || !angle_bound(job).empty());
}

bool writes_lods_into_one_file(const Job& job) {
  return job.low.make.lods > 0 && job.low.make.lods_in_one_file;
}

bool shares_uvs(const Job& job) { return job.low.make.lods > 0 && job.low.make.lods_share_uvs; }

bool bakes_onto_plane(const Job& job) {
  const bool simplified = job.low.make.faces != 0 || !deviation_bound(job).empty();
  return has_heights(job) && job.low.given.empty() && !simplified;
}

bool is_exr(const SaveImageOptions& options) {
  return options.format == ImageFormat::exr_half || options.format == ImageFormat::exr_float;
}

bool holds_floats(const SaveImageOptions& options) { return holds_floats(options.format); }

bool stores_mips_in_one_file(const SaveImageOptions& options) {
  return is_exr(options) || options.format == ImageFormat::ktx2 ||
         options.format == ImageFormat::dds;
}

bool stores_8_bits(const SaveImageOptions& options) {
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

std::filesystem::path mip_level_file(const std::filesystem::path& path, std::size_t level) {
  if (level == 0) return path;
  const std::string number = (level < 10 ? "0" : "") + std::to_string(level);
  std::filesystem::path file = path;
  file.replace_filename(path.stem().string() + ".mip" + number + path.extension().string());
  return file;
}

std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options) {
  std::vector<std::filesystem::path> files;
  for (std::size_t level = 0; level <= (stores_mips_in_one_file(options) ? 0 : mips); ++level) {
    files.push_back(mip_level_file(folder / (name + extension(options)), level));
  }
  return files;
}

std::string lod_stem(const Job& job, std::size_t level) {
  const std::filesystem::path naming_file =
      asset_file(job).empty() ? high_name(job) : asset_file(job);
  return naming_file.stem().string() + "_lod" + std::to_string(level);
}

bool writes_low(const Job& job) {
  return job.low.given.empty() || job.unwrap || job.split_at_seams || !asset_file(job).empty();
}

std::string low_stem(const Job& job) {
  if (!asset_file(job).empty()) return std::filesystem::path(asset_file(job)).stem().string();
  if (job.low.make.lods > 0) return lod_stem(job, 0);
  if (job.low.given.empty()) return std::filesystem::path(high_name(job)).stem().string() + "_low";
  return std::filesystem::path(low_name(job)).stem().string() + (job.unwrap           ? "_unwrapped"
                                                                 : job.split_at_seams ? "_split"
                                                                                      : "");
}

const std::string& low_source(const Job& job) {
  return job.low.given.empty() ? high_name(job) : low_name(job);
}

}  // namespace kiln

#include <algorithm>
#include <filesystem>

#include "asset/gltf_draco_write.h"
#include "job/job_options.h"
#include "job/map_words.h"
#include "job/transfers.h"
#include "kiln/plan.h"
#include "options/parse.h"

namespace kiln {

bool unwraps_sets(const Job& a) {
  const bool splits_by_name = a.sets == SetsBy::material || a.sets == SetsBy::object;
  return splits_by_name && (a.low.given.empty() || a.unwrap) && !has_heights(a) &&
         !plans_low_poly(a) && !match_uses_option(a, "match.uv");
}

std::string explain_single_set(const Job& a) {
  if (unwraps_sets(a) || (!a.low.given.empty() && !a.unwrap)) return "";
  return "splits the UV layout of a given LOW, but here Kiln makes a layout of one atlas: leave it "
         "out.";
}

std::optional<CleanOptions> clean_options(const Job& a) {
  if (has_heights(a)) return std::nullopt;
  // Transparent surfaces show the inside of HIGH, and rays of thickness start there, so inner shells must be kept.
  const auto shows_inside = [](const MapKind kind) {
    const MapInfo& map = find_map(kind.name);
    return obeys(map, "opacity") ||
           (obeys(map, "occlusion.rays") && !obeys(map, "occlusion.back_faces"));
  };
  const std::vector<MapKind> maps = requested_map_kinds(a);
  const bool keep_inner =
      a.keep_inner || a.alpha_test > 0 || std::any_of(maps.begin(), maps.end(), shows_inside);
  return clean_options(a.clean, a.low.given.empty() && !match_uses_option(a, "match.uv"),
                       keep_inner, a.fill_holes, a.low.make.keep_parts);
}

void resolve_asset_output(Job& a) {
  const std::filesystem::path out = a.out;
  // A prefix is added, so that a name such as ".glb", which is only an extension, counts as an asset. A trailing slash
  // means a folder.
  const std::string ending = lower_extension("x" + out.filename().string());
  std::error_code ignored_error;
  const bool is_folder = std::filesystem::is_directory(out, ignored_error);
  if (ending != ".glb" && ending != ".gltf" && ending != ".obj") {
    if (is_folder) return;
    // A name with the extension of another file format counts as a mistake, since hardly any folder has such a name.
    constexpr std::string_view kExtensionsOfOtherFormats[] = {
        ".3ds",  ".abc",  ".blend", ".bmp",  ".dae",  ".dds",  ".exr",  ".fbx", ".hdr",
        ".jpeg", ".jpg",  ".ktx",   ".ktx2", ".off",  ".ply",  ".png",  ".stl", ".tga",
        ".tif",  ".tiff", ".usd",   ".usda", ".usdc", ".usdz", ".webp", ".x",   ".zip"};
    refuse_if(std::find(std::begin(kExtensionsOfOtherFormats), std::end(kExtensionsOfOtherFormats),
                        ending) != std::end(kExtensionsOfOtherFormats),
              option("out") + " '" + a.out +
                  "': a bake writes maps into a folder, or an asset NAME.glb, NAME.gltf or "
                  "NAME.obj: name one of these. " +
                  option("format") + " chooses the maps' format.");
    return;
  }
  refuse_if(!out.has_extension(),
            option("out") + " '" + a.out + "' has only an extension: write NAME" + ending + ".");
  refuse_if(is_folder, option("out") + " '" + a.out +
                           "' is an existing folder: name another file, or end the name with a "
                           "slash to write maps into the folder.");
  const auto refuse_flag_if = [&](bool is_given, const char* flag) {
    refuse_if(is_given, option_of(flag) + " is not for a glTF, GLB or OBJ, " + option("out") +
                            " '" + a.out + "': leave it out, or name a folder.");
  };
  refuse_flag_if(a.layers, "--layers");
  refuse_flag_if(a.bake.match.visibility.clusters > 1, "--visibility-clusters");
  if (ending == ".obj") {
    refuse_flag_if(a.low.make.lods != 0, "--lod");
  } else {
    const ImageFormat format = a.image.format;
    EncodeMapsOptions& pictures = a.pictures;
    if (format == ImageFormat::webp) pictures.format = PictureFormat::webp;
    if (a.image.dither) pictures.dither = Dither::on;
    const bool is_lossy = pictures.format != PictureFormat::png;
    const bool is_jpeg = pictures.format == PictureFormat::jpeg;
    refuse_if(a.given.contains("--format") && format == ImageFormat::ktx2,
              "KTX 2 in a glTF holds Basis Universal, which Kiln does not encode: give " +
                  option("format", "webp") +
                  ", or convert the file (gltf-transform etc1s or uastc).");
    refuse_if(
        a.given.contains("--format") && format != ImageFormat::png8 && !is_lossy,
        "The pictures in '" + a.out + "' can be " + option("format", "png8") + ", webp or jpeg.");
    for (const char* const name : {"quality", "normal_error"}) {
      refuse_if(
          a.given.contains(option_as_flag(name, {})) && !is_lossy,
          option(name) + " is for " + option("format", "webp") + " and jpeg: add one of them.");
    }
    refuse_if(pictures.dither == Dither::on && (is_jpeg || pictures.quality != 0),
              option("dither") +
                  " only applies to lossless pictures, png8 and webp: leave it out, or leave out " +
                  (is_jpeg ? option("format", "jpeg") : option("quality")) + ".");
    refuse_if(pictures.fallback && pictures.format != PictureFormat::webp,
              option("fallback_textures") + " is for " + option("format", "webp") +
                  ": all programs read PNG and JPEG.");
    refuse_if(a.mesh_compression == MeshCompression::draco && !can_pack_draco(),
              "This build of Kiln was made without Draco: give " +
                  option("mesh_compression", "meshopt") + ".");
    refuse_flag_if(a.bake.encoding.space != NormalMapSpace::tangent, "--space");
    refuse_flag_if(a.bake.encoding.flip_y, "--flip-y");
    refuse_flag_if(a.bake.encoding.two_component, "--two-component");
    refuse_flag_if(a.bake.encoding.raw, "--raw");
    refuse_flag_if(!a.ranges.empty(), "--range");
    refuse_flag_if(!a.packs.empty(), "--pack");
    refuse_flag_if(a.bake.encoding.mips, "--mips");
    refuse_flag_if(a.reasons, "--reasons");
    a.image.format = pictures.format == PictureFormat::webp ? ImageFormat::webp : ImageFormat::png8;
  }
}

namespace {

/// Rejects options that write files if the job returns its results in memory.
void check_memory(const Job& a) {
  if (!a.in_memory) return;
  const std::string ending = lower_extension(asset_file(a));
  refuse_if(ending == ".gltf" || ending == ".obj",
            option("out") + " '" + a.out +
                "' consists of several files, but a job in memory returns one file: use .glb, or a "
                "folder of maps.");
  const auto refuse_flag_if = [](bool is_given, const char* flag) {
    refuse_if(is_given,
              option_of(flag) + " is a file, but a job in memory writes none: leave it out.");
  };
  refuse_if(a.low.make.lods != 0 && !writes_lods_into_one_file(a),
            option("lod") + " makes several files, but a job in memory returns one: add " +
                option("lod_files", "one") + ", or leave it out.");
  refuse_flag_if(!a.packs.empty(), "--pack");
  refuse_flag_if(a.layers, "--layers");
  refuse_flag_if(a.reasons, "--reasons");
  refuse_flag_if(!a.save_match.empty(), "--save-match");
  refuse_flag_if(!a.save_cage.empty(), "--save-cage");
  refuse_flag_if(!a.save_source.empty(), "--save-source");
  refuse_flag_if(!a.json.empty(), "--json");
}

}  // namespace

bool writes_gltf(const Job& a) {
  return !asset_file(a).empty() && lower_extension(asset_file(a)) != ".obj";
}

namespace {

// ---- Flags without effect ---------------------------------------------------------------------------

std::string join_names(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  }
  return text;
}

bool applies_to_match(const OptionRow& row, const Job& a) {
  if (!row.is_match_option()) return true;
  if (a.match_auto && row.allowed_with_auto) return true;
  const auto applicable = [&](const MatchInfo& match) {
    const bool is_main_match = !a.match_auto && a.bake.match.method == match.method;
    return row.applies_to(match) &&
           (is_main_match || (row.applies_to_fallback && requests_match(a, match.method)));
  };
  return std::any_of(matches().begin(), matches().end(), applicable);
}

/// A placeholder row for user-defined maps, with which tests find the options that apply to such maps.
MapInfo own_map_info() {
  MapInfo info;
  info.type = MapType::unit_vector;
  info.options = "encoding.origin";
  return info;
}

bool applies_to_maps(const OptionRow& row, const Job& a) {
  // User-defined maps and transfers hold normals, colours or values, so the options for normals, colours and values
  // apply to them, too.
  if (!row.is_map_option()) return true;
  if (!own_map_names(a).empty() && row.applies_to(own_map_info())) return true;
  const std::vector<MapKind> kinds = requested_map_kinds(a);
  return std::any_of(kinds.begin(), kinds.end(),
                     [&](MapKind map) { return row.applies_to(find_map(map.name)); });
}

Message explain_wrong_match(const OptionRow& row, const Job& a) {
  std::vector<std::string> applicable, fallback_names;
  for (const MatchInfo& match : matches()) {
    if (!row.applies_to(match)) continue;
    applicable.emplace_back(match.method.name);
    if (!obeys(match, "match.uv") && row.applies_to_fallback)
      fallback_names.emplace_back(match.method.name);
  }
  return option_of(row.flag) + " is for " + option("match") + " " + join_names(applicable) +
         (fallback_names.empty() ? Message(": leave it out.")
                                 : ": with " + option("match", match_name(a)) + " it needs " +
                                       option("fallback") + " " + join_names(fallback_names) + ".");
}

Message explain_wrong_maps(const OptionRow& row) {
  std::vector<std::string> applicable;
  for (const MapInfo& map : maps()) {
    if (row.applies_to(map)) applicable.emplace_back(map.kind.name);
  }
  return option_of(row.flag) + " is for " + option("maps") + " " + join_names(applicable) +
         ": add such a map, or leave it out.";
}

// ---- Flags that contradict each other --------------------------------------------------------------

/// Rejects a fallback that repeats the match, and a blend without a fallback. \throws Error(usage)
void check_fallback(const Job& a) {
  const MatchOptions& match = a.bake.match;
  refuse_if(!a.match_auto && std::find(match.fallback.begin(), match.fallback.end(),
                                       match.method) != match.fallback.end(),
            option("fallback", std::string(match.method.name)) +
                " repeats a match, which would miss the same samples again: name each match once.");
  refuse_if(a.given.contains("--fallback-blend") && match.fallback.empty(),
            option("fallback_blend") + " needs a " + option("fallback") +
                " that finds points: ray, closest or views.");
}

/// Checks options of levels of detail.
void check_lods(const Job& a) {
  for (const char* flag : {"--lod-uvs", "--lod-growth", "--lod-files"}) {
    refuse_if(a.given.contains(flag) && a.low.make.lods == 0,
              option_of(flag) + " is for several low polys: add " + option("lod", "N") +
                  ", or leave it out.");
  }
  if (a.low.make.lods == 0) return;
  refuse_if(!plans_low_poly(a) || a.low.make.screen.empty(),
            option("lod") + " plans each low poly for its size on screen: give " +
                option("max_error", "normal=DEGREES") + " and " + option("screen") +
                ", and neither LOW nor " + option("faces") + ".");
  const std::uint32_t min_pixels = 16U << (a.low.make.lods - 1);
  refuse_if(
      parse_pixels(option("screen"), a.low.make.screen) < min_pixels,
      option("lod", std::to_string(a.low.make.lods)) +
          " halves the size on screen per level, and the last one needs 16 pixels at least: give " +
          option("screen", std::to_string(min_pixels)) + "px or more, or fewer levels.");
  refuse_if(!a.save_match.empty() || a.reasons,
            option("save_match") + " and " + option("reasons") +
                " only work with one low poly: leave them out, or leave out " + option("lod") +
                ".");
  refuse_if(a.low.make.lods_in_one_file && !writes_gltf(a),
            option("lod_files", "one") + " writes all levels into one GLB or glTF: give " +
                option("out", "NAME.glb") + ", or leave it out.");
}

/// Checks options of a plan of low poly, map and match.
void check_low_poly_plan(const Job& a) {
  map_bounds(a);
  const bool plans = plans_low_poly(a);
  if (!a.low.make.screen.empty()) {
    parse_pixels(option("screen"), a.low.make.screen);
    refuse_if(!plans, option("screen") + " is for a low poly that Kiln plans: give " +
                          option("max_error", "normal=DEGREES") +
                          ", and "
                          "neither LOW nor " +
                          option("faces") + ".");
  }
  if (!a.low.make.max_outline.empty()) {
    parse_outline_bound(a.low.make.max_outline);
    refuse_if(!plans, option("max_outline") + " is for a low poly that Kiln plans: give " +
                          option("max_error", "normal=DEGREES") +
                          ", and "
                          "neither LOW nor " +
                          option("faces") + ".");
  }
  if (!plans) {
    refuse_if(!a.match_auto && bounds_map_errors(a),
              option("max_error", "normal=DEGREES") + " needs " + option("match", "auto") +
                  " where LOW or " + option("faces") + " is given.");
    return;
  }
  refuse_if(std::min(a.bake.width, a.bake.height) < kSmallestMap,
            option("size") + " is the largest map that a plan may choose: give " +
                std::to_string(kSmallestMap) + " or more.");
  refuse_if(!a.low.make.max_angle.empty() && !a.low.make.max_error.empty(),
            option("max_angle") + " and " + option("max_error") +
                " both limit the error: leave one of them out.");
  if (const std::string bound = angle_bound(a); !bound.empty()) {
    parse_degrees(a.low.make.max_angle.empty() ? option("max_error") : option("max_angle"), bound);
  }
  refuse_if(has_cage_mesh(a) || a.cage_auto || a.parts_by == PartsBy::name,
            option("cage_mesh") + ", " + option("cage", "auto") + " and " +
                option("match_by", "name") + " need a LOW, yours or with " + option("faces", "N") +
                ": Kiln "
                "plans its own here.");
  const bool matches_by_uvs = match_uses_option(a, "match.uv") && !has_heights(a);
  refuse_if(
      matches_by_uvs || (!a.match_auto && needs_direction(find_match(a.bake.match.method.name))),
      option("match", match_name(a)) + " needs LOW before the bake: leave it out, or give LOW or " +
          option("faces") + ".");
  refuse_if(!bakes_shading_map(a),
            (a.max_bytes != 0 ? option("max_bytes") : option("max_error", "normal=DEGREES")) +
                " measures normal maps: add " + std::string(shading_map().name) + " to " +
                option("maps") + ".");
}

/// Checks the options that a limit on a GLB's size excludes.
void check_bytes(const Job& a) {
  if (a.max_bytes == 0) return;
  refuse_if(lower_extension(asset_file(a)) != ".glb",
            option("max_bytes") + " limits the size of one file that holds everything: name " +
                option("out", "NAME.glb") + ", or leave it out.");
  refuse_if(a.low.make.lods != 0,
            option("max_bytes") + " is for one low poly: leave it out, or " + option("lod") + ".");
  refuse_if(a.pictures.fallback, option("fallback_textures") + " stores pictures twice, which " +
                                     option("max_bytes") +
                                     " does not support: leave one of them out.");
  refuse_if(!map_bounds(a).empty(),
            option("max_bytes") + " distributes the bytes among the maps: with it, " +
                option("max_error") + " can only limit the error of normals, normal=DEGREES.");
}

/// Checks --density, which only affects UV charts that Kiln makes.
void check_texels(const Job& a) {
  const bool is_density_given = a.given.contains("--density");
  refuse_if(is_density_given && !a.low.given.empty() && !a.unwrap,
            option("density") + " applies to UV charts that Kiln makes, but LOW '" + low_name(a) +
                "' has its own: add " + option("unwrap") + ", or leave it out.");
  refuse_if(is_density_given && a.low.given.empty() && has_heights(a),
            option("density") +
                " is not for a low poly of a height field, which lies over the image as it is.");
  refuse_if(is_density_given && a.low.given.empty() && match_uses_option(a, "match.uv"),
            option("density") + " applies to new UV charts, but " + option("match", match_name(a)) +
                " keeps the charts of HIGH: leave one out.");
  check_density(is_density_given, a.unwrap_method);
}

/// Checks options that make a low poly, and options of a given one.
void check_low(const Job& a) {
  refuse_if(!a.match_auto && !a.low.make.max_angle.empty(),
            option("max_angle") + " is for " + option("match", "auto") + ": leave it out, or use " +
                option("max_error") + ", which limits the deviation of the low poly.");
  check_bytes(a);
  check_low_poly_plan(a);
  check_lods(a);
  const bool has_deviation_bound = !deviation_bound(a).empty();
  refuse_if(a.low.make.faces != 0 && has_deviation_bound,
            option("faces") + " and " + option("max_error") +
                " both limit the size of the low poly: leave one of them out.");
  refuse_if(!a.low.given.empty() && (a.low.make.faces != 0 || has_deviation_bound),
            option("faces") + " and " + option("max_error") +
                " are for making a low poly, but LOW '" + low_name(a) +
                "' was given: leave one of them out.");
  refuse_if(a.low.make.keep_parts && (!a.low.given.empty() || a.low.make.faces == 0),
            option("keep_parts") + " needs a number of faces: add " + option("faces", "N") +
                " and leave LOW out, or "
                "leave " +
                option("keep_parts") + " out.");
  refuse_if(a.low.make.keep_parts && (has_heights(a) || match_uses_option(a, "match.uv")),
            option("keep_parts") + " is not for height fields or " + option("match") +
                " uv, which keep all parts.");
  const std::optional<CleanOptions> clean = clean_options(a);
  refuse_if(a.keep_inner && (!clean || clean->windings_alone),
            option("keep_inner") + " is for " + option("clean", "all") +
                ", or for a low poly that Kiln makes: leave it out.");
  refuse_if(a.fill_holes > 0 && !clean,
            option("fill_holes") + " repairs a mesh, " +
                (has_heights(a) ? "but HIGH is a height field: leave it out."
                                : "but " + option("clean", "none") +
                                      " leaves HIGH as it is: leave one of them out."));
  refuse_if(a.low.given.empty() && a.unwrap && a.unwrap_method == "given",
            option("unwrap") +
                " without a method is for a given LOW; a low poly that Kiln makes is always "
                "unwrapped: choose the method with " +
                option("unwrap", "charts") + " or " + option("unwrap", "pairs") +
                ", or leave it out.");
  refuse_if(a.low.given.empty() && a.unwrap && has_heights(a),
            option("unwrap") +
                " is not for a low poly of a height field, which lies over the image as it is.");
  check_texels(a);
  refuse_if(a.low.given.empty() && has_cage_mesh(a),
            option("cage_mesh") + " needs LOW, since it is a cage of that mesh.");
}

/// Checks options that only some kinds of rays use.
void check_rays(const Job& a) {
  const bool cage = a.cage_auto || a.bake.match.cage || has_cage_mesh(a);
  refuse_if(cage && a.given.contains("--ray"),
            option_of("--ray") +
                " has no effect with a cage: rays from a cage use the first face that they hit. "
                "Leave one out.");
  refuse_if(
      a.given.contains("--edge-width") && a.bake.match.ray.direction != RayDirection::automatic,
      option("edge_width") + " is for " + option("direction", "auto") + ".");
  refuse_if(!a.save_cage.empty() && !a.cage_auto, option("save_cage") + " writes the cage that " +
                                                      option("cage", "auto") + " finds: add " +
                                                      option("cage", "auto") + ".");
}

/// Checks that tangents from LOW's file are used with the UVs and normals of that file.
void check_tangents(const Job& a) {
  if (!a.given.contains("--tangents")) return;
  refuse_if(a.low.given.empty(),
            option("tangents") + " needs a given LOW: name one, or leave this option out.");
  refuse_if(a.bake.encoding.space != NormalMapSpace::tangent,
            option("tangents") + " is for " + option("space", "tangent") + ": leave it out.");
  refuse_if(a.file_tangents && (a.unwrap || a.split_at_seams),
            option("tangents", "file") +
                " is only valid with the UVs and normals of LOW's file: leave out " +
                option("unwrap") + " and " + option("split_at_seams") + ".");
}

/// Checks options that name further input files.
void check_more_files(const Job& a) {
  for (const JobInput& input : a.high) {
    if (a.high.size() < 2 || input.asset || !is_height_field(input.name)) continue;
    fail_usage("'" + input.name +
               "' is a height field, which cannot be joined with other files: leave " +
               option("high") + " out.");
  }
  check_tangents(a);
  check_mesh_frame(a.frame, high_files(a), low_files(a), a.occluders);
  refuse_if(a.low.given.empty() && a.split_at_seams,
            option("split_at_seams") + " needs a given LOW: name one, or leave this option out.");
  refuse_if(
      a.low.given.empty() && has_heights(a) && a.given.contains("--triangulate"),
      option("triangulate") + " is for meshes, and a height field has no polygons: leave it out.");
}

void check_parts(const Job& a) {
  check_more_files(a);
  refuse_if(!a.parts_by && a.given.contains("--part-occlusion"),
            option("part_occlusion") + " needs parts: add " + option("match_by", "name") +
                ", group, object, material or list.");
  refuse_if(a.given.contains("--bitangent") && a.bake.encoding.space != NormalMapSpace::tangent,
            option("bitangent") + " is for " + option("space", "tangent") + ": leave it out.");
  refuse_if(a.reasons && !a.bake.match.fallback.empty(),
            option("reasons") + " only explains rays: leave out " + option("fallback") +
                ", or end it with low, fill or mark.");
  if (a.parts_by && (a.low.given.empty() || a.unwrap)) {
    fail_usage(option("match_by", name_of(Words(kPartsByChoices), a.parts_by)) +
               " needs a LOW with named parts and UVs of its own.");
  }
  refuse_if(
      (a.parts_by == PartsBy::list) != a.given.contains("--match-list"),
      option("match_by", "list") + " and " + option("match_list", "FILE") + " belong together.");
  refuse_if(a.parts_by != PartsBy::name &&
                (a.given.contains("--low-names") || a.given.contains("--high-names")),
            option("low_names") + " and " + option("high_names") + " are for " +
                option("match_by", "name") + ".");
}

/// Checks options that only some kinds of visibility matching use.
void check_visibility(const Job& a) {
  const VisibilityOptions& visibility = a.bake.match.visibility;
  const auto given = [&](const char* flag) { return a.given.contains(flag); };
  refuse_if(visibility.clusters > 1 && visibility.at != VisibilityAt::texel,
            option("visibility_clusters") + " is for " + option("match") + " visibility with " +
                option("visibility_at", "texel") + ".");
  refuse_if(visibility.at != VisibilityAt::texel && given("--visibility-smooth"),
            option("visibility_smooth") + " is for " + option("visibility_at", "texel") + ".");
  refuse_if(visibility.test == VisibilityTest::rays && given("--visibility-size"),
            option("visibility_size") + " is the size of depth views, but " +
                option("visibility_test", "rays") + " uses none: leave one out.");
  refuse_if(visibility.clusters == 1 && given("--visibility-deviation"),
            option("visibility_deviation") + " is for " + option("visibility_clusters", "2") +
                " and more.");
  refuse_if(visibility.clusters > 1 && !a.save_match.empty(),
            option("visibility_clusters") + " makes several matches, but " + option("save_match") +
                " saves one: leave one out.");
}

/// Checks maps of values that only some matches compute.
void check_maps(const Job& a) {
  const bool matches_by_visibility =
      !has_saved_match(a) && match_uses_option(a, "match.visibility");
  for (const MapKind map : requested_map_kinds(a)) {
    if (!obeys(find_map(map.name), "match.visibility") || matches_by_visibility) continue;
    fail_usage(option("maps", std::string(map.name)) +
               " holds visibility directions, which only some matches compute: use it with " +
               option("match") + " visibility or hybrid.");
  }
}

/// Checks options of ambient occlusion, bent normals and the user's own maps.
void check_occlusion(const Job& a) {
  const auto given = [&](const char* flag) { return a.given.contains(flag); };
  refuse_if(given("--map-seconds") && a.own_maps.empty(),
            option("map_seconds") + " is for your own maps: add " + option("maps") +
                " NAME=FILE.cl, or leave it out.");
  refuse_if(a.bake.occlusion.by == OcclusionBy::rays && given("--ao-views"),
            option("ao_views") + " is for " + option("ao_by", "views") +
                " or auto: add one of them, or leave it out.");
  if (a.bake.occlusion.by != OcclusionBy::views) return;
  for (const char* flag :
       {"--ao-distance", "--ao-falloff", "--ao-ignore-back-faces", "--ao-error"}) {
    if (!given(flag)) continue;
    fail_usage(
        option_of(flag) +
        " is for rays, since a depth view only shows the first face: leave out this option or " +
        option("ao_by") +
        " "
        "views.");
  }
  const std::vector<MapKind> kinds = requested_map_kinds(a);
  const bool bakes_other_map = std::any_of(kinds.begin(), kinds.end(), [](MapKind map) {
    return obeys(find_map(map.name), "occlusion.rays") &&
           !obeys(find_map(map.name), "occlusion.views");
  });
  refuse_if(given("--ao-rays") && !bakes_other_map, option("ao_rays") + " is for rays, but " +
                                                        option("ao_by", "views") +
                                                        " casts none: leave one of them out.");
}

/// Checks options of the map files.
void check_files(const Job& a) {
  parse_packs(a);
  for (const char* flag : {"--alpha", "--double-sided"}) {
    refuse_if(asset_file(a).empty() && a.given.contains(flag),
              option_of(flag) + " is for a GLB, glTF or OBJ: name one by " + option("out") +
                  ", or leave it out.");
  }
  std::uint32_t side = std::max(a.bake.width, a.bake.height);
  for (const SetSize& size : a.set_sizes) side = std::max({side, size.width, size.height});
  constexpr std::uint32_t kMaxWebpSide = 16383;
  refuse_if(a.image.format == ImageFormat::webp && side > kMaxWebpSide,
            option("format") +
                " webp holds at most 16383 texels a side: choose another, or a smaller " +
                option("size") + ".");
  refuse_if(a.layers && !is_exr(a.image), option("layers") +
                                              " writes one EXR with several layers: add " +
                                              option("format", "exr") + " or exr32.");
  refuse_if(a.layers && a.bake.encoding.mips,
            option("layers") + " requires maps of one size, but " + option("mips") +
                " adds smaller levels: leave one of them out.");
  refuse_if(a.bake.report.errors && a.match_auto,
            option("match", "auto") + " measures the errors by itself: leave " +
                option("report_error") + " out, or choose a match.");
}

/// Checks options of texture sets, which apply to a given layout, and to layouts that Kiln makes per material or
/// object.
void check_sets(const Job& a) {
  refuse_if(a.sets == SetsBy::none && !a.set_sizes.empty(),
            option("size", "NAME=SIZE") + " is for texture sets, but " + option("sets", "none") +
                " makes one map for all: leave one out.");
  if (!a.sets || a.sets == SetsBy::none) return;
  if (const std::string reason = explain_single_set(a); !reason.empty()) {
    fail_usage(option("sets", name_of(Words(kSetsWords), a.sets)) + " " + reason);
  }
}

void check_height_field(const Job& a) {
  if (!has_heights(a)) {
    if (!a.given.contains("--height") && !a.given.contains("--extent") &&
        !a.given.contains("--no-data")) {
      return;
    }
    fail_usage(option_of("--height") + ", " + option("extent") + " and " + option("no_data") +
               " are for a HIGH that is a height field, a PNG, EXR or "
               "TIFF. "
               "The map of heights is " +
               option("maps") + " height.");
  }
  const bool has_search_distance =
      a.bake.match.max_distance || a.cage_auto || a.bake.match.cage || has_cage_mesh(a);
  refuse_if(bakes_onto_plane(a) && !match_uses_option(a, "match.uv") && !a.match_auto &&
                !has_saved_match(a) && !has_search_distance,
            "Without LOW and " + option("faces") +
                " a height field is baked onto a plane at height 0, and from there " +
                option("match", match_name(a)) +
                " searches only as far as 2% of the diagonal: leave " + option("match") +
                " out (Kiln then matches points of the same UV), or give " + option("faces", "N") +
                ", a LOW, or a " + option("max_distance") + " larger than the heights.");
}

}  // namespace

bool is_applicable(const OptionRow& row, const Job& a) {
  return applies_to_match(row, a) && applies_to_maps(row, a);
}

void check_applicable(const Job& a) {
  for (const OptionRow& row : bake_rows()) {
    if (!a.given.contains(row.flag)) continue;
    // A fallback that only fills misses affects maps, not the match.
    if (row.flag == "--fallback" && a.bake.match.fallback.empty()) continue;
    refuse_if(row.is_match_option() && has_saved_match(a),
              option_of(row.flag) + " affects matching, but " + option("load_match") +
                  " uses a finished match: leave one out.");
    refuse_if(!applies_to_match(row, a), explain_wrong_match(row, a));
    refuse_if(!applies_to_maps(row, a), explain_wrong_maps(row));
  }
}

void check_resolved_job(const Job& a) {
  refuse_if(a.match_auto && !bakes_shading_map(a),
            option("match", "auto") + " measures normal maps: add " +
                std::string(shading_map().name) + " to " + option("maps") + ".");
  check_maps(a);
  check_low(a);
  check_applicable(a);
  for (const MatchInfo& match : matches()) {
    if (!needs_direction(match) || !requests_match(a, match.method) ||
        a.bake.match.views.directions.size() == 1)
      continue;
    fail_usage(option("match", std::string(match.method.name)) +
               " searches along one direction: give exactly one " + option("view") +
               ", such as 0,0,1.");
  }
  check_rays(a);
  check_parts(a);
  check_visibility(a);
  check_fallback(a);
  check_height_field(a);
  check_sets(a);
  check_occlusion(a);
  check_files(a);
  refuse_if(a.bake.encoding.raw && !holds_floats(a.image),
            option("raw") + " writes negative values, which " +
                option("format", name_of(Words(kFormatWords), a.image.format)) +
                " cannot hold: add " + option("format", "exr") + ".");
  const bool can_dither = a.image.format == ImageFormat::png8 ||
                          a.image.format == ImageFormat::tga || a.image.format == ImageFormat::webp;
  refuse_if(a.pictures.format == PictureFormat::jpeg && !writes_gltf(a),
            option("format", "jpeg") +
                " is for the pictures of a GLB or glTF: name the output NAME.glb, or choose "
                "another format.");
  for (const char* const name :
       {"quality", "normal_error", "fallback_textures", "mesh_compression"}) {
    refuse_if(a.given.contains(option_as_flag(name, {})) && !writes_gltf(a),
              option(name) + " is for a GLB or glTF: name the output NAME.glb.");
  }
  if (writes_gltf(a)) return;
  refuse_if(a.image.dither && !can_dither,
            option("dither") + " is for " + option("format", "png8") + ", tga and webp.");
  refuse_if(a.given.contains("--dither") && a.pictures.dither == Dither::automatic,
            option("dither", "auto") +
                " is for a GLB or glTF: name the output NAME.glb, or say on or off.");
}

namespace {

/// Checks OptionRow::needs and OptionRow::excludes of all given options.
void check_pairs(const Job& job) {
  for (const OptionRow& row : bake_rows()) {
    if (!job.given.contains(row.flag)) continue;
    refuse_if(!row.needs.empty() && !job.given.contains(row.needs),
              option_of(row.flag) + " needs " + row.needs + ": add it, or leave " +
                  option_of(row.flag) + " out");
    for (const std::string& other_flag : job.given) {
      refuse_if((" " + row.excludes + " ").find(" " + other_flag + " ") != std::string::npos,
                option_of(row.flag) + " and " + option_of(other_flag) +
                    " exclude each other: leave one of them out");
    }
  }
}

}  // namespace

Job resolve_job(const Job& given) {
  Job job = given;
  refuse_if(job.high.empty(), "HIGH is missing: name the high poly.");
  refuse_if(job.out.empty() && !job.in_memory, option("out") + " is empty: give a folder.");
  refuse_if(
      !job.low.given.empty() && job.low.given.front().name.empty(),
      option("low") + " adds further files to a given LOW: name the first file of LOW after HIGH.");
  job.given = options_given(given);
  check_pairs(job);
  job.bake.maps = maps_or_default(job);
  if (has_heights(job) && !job.given.contains("--match")) {
    job.bake.match.method = first_match("match.uv");
  }
  const bool plans = bounds_map_errors(job) || (job.max_bytes != 0 && plans_low_poly(job));
  if (plans && !job.given.contains("--match")) job.match_auto = true;
  resolve_asset_output(job);
  set_default_asset_maps(job);
  if (writes_gltf(job)) enable_occlusion_smoothing(job);
  check_memory(job);
  check_resolved_job(job);
  return job;
}

void check(const Job& job) { resolve_job(job); }

}  // namespace kiln

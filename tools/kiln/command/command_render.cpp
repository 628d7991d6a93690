#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <set>

#include "arguments/command_options.h"
#include "cl/driver_state.h"
#include "command/render_parts.h"
#include "commands.h"
#include "job/check_result.h"
#include "job/describe.h"
#include "job/files.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "job/map_file.h"
#include "job/match_inputs.h"
#include "job/mesh_files.h"
#include "kiln/image.h"
#include "kiln/render.h"
#include "kiln/texture_sets.h"
#include "kiln/version.h"
#include "options/option_table.h"
#include "options/parse.h"
#include "picture/mapped_mesh.h"
#include "picture/sheet.h"
#include "picture/view_arguments.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

RenderOptions render_options(const RenderArguments& arguments) {
  RenderOptions options = view_options(arguments.view, is_height_field(arguments.reference));
  options.size = arguments.size;
  options.samples = arguments.samples;
  options.ambient_rays = arguments.ambient_rays;
  options.flat = arguments.flat;
  options.show_normals = arguments.show_normals;
  return options;
}

/// Checks the arguments before meshes are read.
void check_render(const RenderArguments& arguments) {
  refuse_if(std::filesystem::path(arguments.out).extension() != ".png",
            "--out '" + arguments.out + "': the picture is a PNG, so the name must end in .png.");
  refuse_if(has_height_field_options(arguments.heights) && !is_height_field(arguments.reference),
            "--height, --extent and --no-data are for a --reference that is a height field, a PNG, "
            "EXR or TIFF.");
  refuse_if(arguments.flat && !arguments.normal.empty(),
            "--flat and --normal exclude each other: leave one of them out. With --reference and "
            "--normal, the flat mesh is one of the panels.");
  refuse_if(arguments.error && arguments.reference.empty(),
            "--error is the angle to HIGH's normals: add --reference HIGH.");
  refuse_if(arguments.views != 0 && (!arguments.reference.empty() || arguments.view.given()),
            "--views shows only MESH, from all around: leave out --reference, --view, --zoom "
            "and --at.");
  const bool has_lit_maps = arguments.apply_maps.any();
  refuse_if(has_lit_maps && (arguments.flat || arguments.show_normals || arguments.views != 0),
            "--color, --occlusion and --curvature are for lit pictures: leave out --flat, "
            "--normals and --views.");
  refuse_if(!arguments.show.empty() && (has_lit_maps || !arguments.normal.empty() ||
                                        arguments.views != 0 || !arguments.reference.empty()),
            "--show draws unlit maps, one picture each: leave out --normal, --color, "
            "--occlusion, --curvature, --reference and --views.");
  refuse_if(arguments.draw_cage && (arguments.views != 0 || !arguments.show.empty() ||
                                    arguments.show_normals || arguments.error),
            "--draw-cage is for lit pictures: leave out --views, --show, --normals and --error.");
  refuse_if(arguments.frames && arguments.json.empty(),
            "--frames is the number of frames that --json times: add --json FILE.");
}

/// True if a lit picture shows the maps of the mesh's materials, because no maps are given.
bool shows_own_maps(const RenderArguments& a) {
  return !a.no_maps && a.normal.empty() && !requests_baked_map(a) && !a.apply_maps.any() &&
         a.show.empty() && a.views == 0 && !a.flat;
}

/// Returns the normal map: from a file, baked, or from the mesh's materials; empty if there is none.
NormalMap choose_normal_map(const RenderArguments& arguments, Image& image,
                            const std::function<Image()>& baked) {
  NormalMap map;
  if (requests_baked_map(arguments)) image = baked();
  if (!arguments.normal.empty()) image = load_normal_map(arguments.normal);
  if (image.width == 0) return map;
  map.image = &image;
  map.flip_y = arguments.flip_y;
  map.space = arguments.space;
  map.bitangent = arguments.bitangent;
  return map;
}

/// Draws the available panels: high poly, low poly, low poly with its map; with --error also the angles between their
/// normals.
/// \param cage  overlay for all panels; null: none
Image draw_picture(const RenderArguments& arguments, const Scene* high, const Scene& low,
                   const MappedMesh& mesh, const LitMaps& maps, bool has_map,
                   const RenderOptions& options, const CagePicture* cage) {
  std::vector<Panel> panels;
  const auto add = [&](const Scene& scene, Image picture, const char* caption) {
    if (cage != nullptr) cage->draw(scene, options, picture);
    panels.push_back({std::move(picture), {caption}});
  };
  if (high != nullptr) {
    const std::uint64_t other_bytes = bytes_of(low.geometry(options), has_map ? 2 : 1);
    add(*high, draw_with_room(*high, options, other_bytes), "high poly");
  }
  if (high != nullptr && has_map) {
    RenderOptions flat = options;
    flat.flat = true;
    add(low, low.draw(flat), "low poly");
  }
  Image last = low.draw(options);
  if (!options.show_normals) apply_maps(mesh, maps, options, last);
  add(low, std::move(last), has_map ? "with the map" : "low poly");
  if (!arguments.error) {
    std::vector<Image> images;
    for (Panel& panel : panels) images.push_back(std::move(panel.image));
    return join(std::move(images));
  }
  AnglePictures angles;
  angles.add(*high, low, options);
  const Scale scale = angles.scale();
  const std::string text = formatted("error: mean %.2f degrees", angles.mean(0));
  panels.push_back({angles.picture(0, scale), {text}});
  return make_sheet(panels, scale, panels.size());
}

/// Maximum number of pictures in memory at a time: all panels, the combined picture and temporaries.
std::uint64_t count_pictures_in_memory(const RenderArguments& arguments, const LitMaps& maps,
                                       bool has_map) {
  if (arguments.views != 0) return 2 * std::uint64_t{arguments.views};
  if (!arguments.show.empty()) return 2 * arguments.show.size() + 1;
  const std::uint64_t helpers = maps.any() ? 2 + maps.count() : 0;
  if (arguments.reference.empty()) return 1 + helpers;
  const std::uint64_t panels = has_map ? 3 : 2;
  return panels + std::max(helpers, arguments.error ? panels + 2 : panels);
}

/// Measures frame times of the high poly, the low poly, and the low poly with its map (Wang et al., figure 7; Barry and
/// Wood, table 1).
Json time_frames(const RenderArguments& arguments, Console& console, const Scene* high,
                 const Scene& low, bool has_map, RenderOptions options) {
  constexpr std::uint32_t kFrames = 30, kMaxTimedSize = 2048;
  const std::uint32_t count = arguments.frames.value_or(kFrames);
  options.zoom = 1;
  options.at.reset();
  options.size = std::min(options.size, kMaxTimedSize);
  Json json = Json::object();
  std::string line = "a frame by z-buffer, median of " + std::to_string(count) + ":";
  const auto add = [&](const char* key, const char* name, const Scene& scene,
                       const RenderOptions& with) {
    const FrameCost cost = scene.time_frames(with, count);
    json[key] = {{"frames", cost.frames},
                 {"size", {cost.width, cost.height}},
                 {"seconds_median", cost.seconds_median},
                 {"seconds_least", cost.seconds_least},
                 {"seconds_most", cost.seconds_most},
                 {"triangles", cost.triangles},
                 {"vertices", cost.vertices},
                 {"bytes", cost.bytes}};
    line += formatted("%s %s %.2f ms (%s bytes)", line.back() == ':' ? "" : ",", name,
                      cost.seconds_median * 1e3, with_commas(cost.bytes).c_str());
  };
  if (high != nullptr) add("reference", "high poly", *high, options);
  RenderOptions options_without_map = options;
  options_without_map.ignore_map = true;
  add("mesh", "low poly", low, options_without_map);
  if (has_map) add("with_map", "with the map", low, options);
  console.line(line);
  return json;
}

#define AT(member) KILN_MEMBER(RenderArguments, member)

std::vector<OptionRow> render_rows() {
  std::vector<OptionRow> rows = {
      {.flag = "--map-size",
       .value = integer(AT(map_size), 16, 8192),
       .help =
           "Bake a map for the picture, with this many texels per side; flags of the match apply"},
      {.flag = "--bitangent",
       .value = choice(AT(bitangent), Words(kBitangentWords)),
       .help = "The value with which the map was baked: pixel, or vertex"},
      {.flag = "MESH",
       .value = text(AT(mesh)),
       .help = "The mesh to show",
       .key = "-",
       .required = true},
      {.flag = "--normal",
       .value = text(AT(normal)),
       .help = "Normal map to apply through the mesh's UVs; Kiln's raw and two-component maps are "
               "recognised",
       .key = "normal_map"},
      {.flag = "--color",
       .value = text(AT(apply_maps.color)),
       .help = "Colour map (sRGB) of the mesh"},
      {.flag = "--occlusion",
       .value = text(AT(apply_maps.occlusion)),
       .help = "Map of ambient occlusion, which darkens the mesh"},
      {.flag = "--curvature",
       .value = text(AT(apply_maps.curvature)),
       .help = "Map of curvature, for the look of worn surfaces: lightens edges by up to a half, "
               "darkens cavities by up to a quarter"},
      {.flag = "--show",
       .value = texts(AT(show)),
       .help = "Show MESH unlit with this map, and the map's name; if given several times, as a "
               "contact sheet"},
      {.flag = "--no-maps",
       .value = toggle(AT(no_maps)),
       .help = "Show MESH without the maps of its own materials, which are used by default"},
      {.flag = "--space",
       .value = choice(AT(space), Words(kSpaceWords)),
       .help = "Space of the normal map: tangent, object or face"},
      {.flag = "--flip-y",
       .value = toggle(AT(flip_y)),
       .help = "The map's green points down (DirectX)"},
      {.flag = "--reference",
       .value = text(AT(reference)),
       .help = "A high poly or height field, shown beside MESH; the difference is measured",
       .key = "-"},
      {.flag = "--out",
       .value = text(AT(out)),
       .help = "The picture to write (PNG)",
       .key = "-",
       .required = true},
      {.flag = "--views",
       .value = integer(AT(views), 1, 512).or_unset(),
       .help = "Show MESH from N directions on one sheet, as --match views uses them"},
      {.flag = "--size", .value = integer(AT(size), 1, 8192), .help = "Pixels of the longer side"},
      {.flag = "--samples", .value = integer(AT(samples), 1, 16), .help = "N x N samples a pixel"},
      {.flag = "--ambient-rays",
       .value = integer(AT(ambient_rays), 0, 255),
       .help = "Rays per pixel for ambient occlusion (0: none)"},
      {.flag = "--flat",
       .value = toggle(AT(flat)),
       .help = "Shade with face normals instead of smooth ones"},
      {.flag = "--normals",
       .value = toggle(AT(show_normals)),
       .help = "Colour by world-space normal"},
      {.flag = "--draw-cage",
       .value = toggle(AT(draw_cage)),
       .help = "Draw the cage of --cage or --cage-mesh on the pictures"},
      {.flag = "--error",
       .value = toggle(AT(error)),
       .help = "Add a picture of the angles to HIGH's normals, with a scale"},
      {.flag = "--frames",
       .value = integer(AT(frames), 1, 1000),
       .help = "Number of frames that --json times for each mesh (default 30)",
       .key = "-"},
      device_row<RenderArguments>(""),
      json_row<RenderArguments>(""),
      quiet_row<RenderArguments>(""),
  };
  const std::vector<OptionRow> view = view_rows<RenderArguments>();
  rows.insert(rows.end() - 3, view.begin(), view.end());
  return rows;
}

#undef AT

Json describe_options(const RenderArguments& arguments, const RenderOptions& options) {
  Json json = values_json(render_rows(), &arguments);
  json["view"] = {options.azimuth_degrees, options.elevation_degrees};
  json["z_up"] = options.z_up;
  json["at"] = options.at;
  json["cage"] = find_row(bake_rows(), "--cage")->value.get(&arguments.bake);
  json["cage_mesh"] = arguments.bake.cage_mesh;
  json["match_flags"] = arguments.bake.given;
  if (!requests_baked_map(arguments)) json["map_size"] = Json();
  return json;
}

int run_render(const RenderArguments& arguments) {
  Console console(arguments.quiet, arguments.json);
  Stopwatch watch;
  check_render(arguments);
  check_bake(arguments);
  const LitMapFiles& apply_maps = arguments.apply_maps;
  std::vector<std::filesystem::path> files = {arguments.mesh,       arguments.normal,
                                              apply_maps.color,     apply_maps.occlusion,
                                              apply_maps.curvature, arguments.reference};
  const Job& bake_as = arguments.bake;
  const std::vector<std::string> further_high_polys = further_input_names(bake_as.high),
                                 further_low_polys = further_input_names(bake_as.low.given);
  for (const auto* more : {&arguments.show, &further_high_polys, &further_low_polys}) {
    files.insert(files.end(), more->begin(), more->end());
  }
  files.insert(files.end(), {bake_as.load_match, bake_as.cage_mesh, bake_as.match_list});
  check_paths(files, {arguments.out, arguments.json});
  RenderOptions options = render_options(arguments);
  prepare_parent(arguments.out);
  prepare_parent(arguments.json);
  std::vector<std::string> high_files = further_high_polys, low_files = further_low_polys;
  if (!arguments.reference.empty()) high_files.push_back(arguments.reference);
  low_files.push_back(arguments.mesh);
  check_mesh_frame(bake_as.frame, high_files, low_files, {});
  std::vector<Warning> warnings;
  MeshFiles files_of_mesh =
      load_low_files(bake_job_of(arguments), warnings, shows_own_maps(arguments));
  warn_of_shared_texels(files_of_mesh, warnings);
  Mesh mesh =
      bake_as.split_at_seams ? split_at_seams(files_of_mesh.mesh) : std::move(files_of_mesh.mesh);
  std::optional<HighPolyInput> high_poly;
  if (!arguments.reference.empty()) {
    high_poly = load_high(bake_job_of(arguments).high, arguments.heights,
                          load_options(arguments.bake, MeshSide::high),
                          has_more_files(arguments.bake), warnings);
    shade(bake_as.frame.shading, *high_poly, warnings);
  }
  const Mesh* const reference = high_poly ? &high_poly->mesh : nullptr;
  if (reference != nullptr)
    warn_of_bounds_mismatch("--reference and MESH", *reference, mesh, warnings);
  if ((!arguments.normal.empty() || apply_maps.any() || !arguments.show.empty()) &&
      choose_texture_sets(mesh) != SetsBy::none) {
    warnings.push_back({"several-sets",
                        "MESH '" + mesh.name +
                            "' has several texture sets with overlapping UVs, so that the map of "
                            "one set appears on all. Render the faces of each set separately.",
                        1});
  }
  const Device device = Device::open(arguments.device);
  for (Warning& warning : kernel_folder_warnings()) warnings.push_back(std::move(warning));
  MaterialAtlases own_maps;
  if (shows_own_maps(arguments))
    own_maps = make_material_atlases(files_of_mesh.nodes_and_materials.materials, mesh, warnings);
  LitMaps lit_maps = load_lit_maps(apply_maps);
  if (own_maps.any()) lit_maps = {std::move(own_maps.color), std::move(own_maps.occlusion), {}};
  Image map_image = std::move(own_maps.normal);
  const NormalMap map = choose_normal_map(arguments, map_image, [&] {
    return bake_map(arguments, device, *high_poly, mesh, warnings);
  });
  const bool has_map = map.image != nullptr;
  const double seconds_load = watch.lap();

  const Scene low(device, mesh, map);
  warnings.insert(warnings.end(), low.warnings().begin(), low.warnings().end());
  std::optional<Scene> high;
  if (reference != nullptr) {
    high.emplace(device, *reference);
    warnings.insert(warnings.end(), high->warnings().begin(), high->warnings().end());
    options.frame = reference;
  }
  const Scene* original = high ? &*high : nullptr;
  std::optional<CagePicture> cage;
  if (arguments.draw_cage) {
    cage.emplace(device, outer_cage(bake_job_of(arguments), device, mesh, reference, warnings));
    options.frame = &cage->mesh();
  }
  const double seconds_build = watch.lap();
  const MappedMesh has_lit_maps{device, mesh};
  require_pictures(low.geometry(options), count_pictures_in_memory(arguments, lit_maps, has_map));
  const Image picture = arguments.views != 0 ? draw_contact_sheet(low, arguments.views, options)
                        : !arguments.show.empty()
                            ? draw_map_sheet(has_lit_maps, arguments.show, options)
                            : draw_picture(arguments, original, low, has_lit_maps, lit_maps,
                                           has_map, options, cage ? &*cage : nullptr);
  const double seconds_draw = watch.lap();
  save_image(picture, arguments.out, {ImageFormat::png8});
  const double seconds_save = watch.lap();

  Json rendered_error;
  const bool needs_error = !arguments.quiet || !arguments.json.empty();
  if (high && needs_error)
    rendered_error = measure(console, *high, low, *reference, options, has_map);
  if (high) check_green_channel(device, mesh, map, *high, *reference, options.z_up, warnings);
  for (const Warning& warning : warnings) console.warning(warning.message);
  const double seconds_measure = watch.lap();
  if (!arguments.json.empty()) {
    const Json frames = time_frames(arguments, console, original, low, has_map, options);
    Json inputs = {{"mesh", describe(mesh, arguments.mesh)}};
    if (reference != nullptr) {
      inputs["reference"] = describe(*reference, arguments.reference);
      if (!high_poly->heights) inputs["reference"]["normals"] = describe(high_poly->shading);
    }
    Json json = {{"version", version()},
                 {"device", describe(device.info())},
                 {"inputs", inputs},
                 {"options", describe_options(arguments, options)},
                 {"frames", frames},
                 {"outputs", {arguments.out}},
                 {"seconds",
                  {{"load", seconds_load},
                   {"build", seconds_build},
                   {"draw", seconds_draw},
                   {"save", seconds_save},
                   {"measure", seconds_measure},
                   {"frames", watch.lap()},
                   {"total", watch.total()}}},
                 {"warnings", describe(warnings)}};
    if (high) json["rendered_normals"] = rendered_error;
    if (high && has_map) {
      json["rendered_normals"]["around"] = measure_around(*high, low, *reference, options.z_up);
    }
    save_report(arguments.json, json);
  }
  console.line("wrote " + arguments.out);
  return 0;
}

}  // namespace

Run add_render(Command& app) {
  Command* command = app.add_command(
      "render",
      "A picture of a mesh; with --reference and --normal: original | flat | with the map");
  auto a = std::make_shared<RenderArguments>();
  const std::set<std::string> own = {"--views",           "--view",
                                     "--view-size",       "--view-criterion",
                                     "--no-view-refine",  "--visibility-at",
                                     "--directions",      "--visibility-test",
                                     "--visibility-size", "--visibility-smooth",
                                     "--view-weight"};
  const std::set<std::string> matching = add_matching_flags(*command, a->bake, own);
  add_height_options(*command, *a, "The height field (--reference is a PNG, EXR or TIFF)");
  add_options(*command, render_rows(), a.get());
  return [a, command, matching] {
    for (const std::string& flag : given_flags(*command)) {
      if (matching.contains(flag)) a->bake.given.insert(flag);
      if (flag == "--map-size") a->map_size_given = true;
    }
    return run_render(*a);
  };
}

}  // namespace kiln::cli

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <tuple>

#include "arguments/dense_input.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "commands.h"
#include "kiln/kiln.h"
#include "report/console.h"
#include "report/map_file.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

struct RenderArguments {
  std::string mesh, normal, reference, out, view = "30,15", space = "tangent", device, json;
  HeightArguments heights;
  std::uint32_t size = 512, samples = 3, ambient_rays = 64;
  bool flip_y = false, z_up = false, flat = false, show_normals = false, quiet = false;
};

/// Pictures side by side, with a thin line between them.
Image join(const std::vector<Image>& panels) {
  const std::uint32_t gap = std::max(1U, panels[0].width / 256);
  Image sheet;
  sheet.channels = 3;
  for (const Image& panel : panels) {
    sheet.width += panel.width + (sheet.width == 0 ? 0 : gap);
    sheet.height = std::max(sheet.height, panel.height);
  }
  sheet.pixels.assign(std::size_t{sheet.width} * sheet.height * 3, 1.0F);
  std::size_t left = 0;
  for (const Image& panel : panels) {
    for (std::size_t y = 0; y < panel.height; ++y) {
      std::copy_n(panel.at(0, y), std::size_t{panel.width} * 3, sheet.at(left, y));
    }
    left += panel.width + gap;
  }
  return sheet;
}

/// Measures how near the light mesh comes to the reference, from the view shown and along the six axes,
/// says so, and returns it for the report. The same pixels whatever the picture's own size.
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map) {
  const std::vector<ViewAngles> views = {{options.azimuth_degrees, options.elevation_degrees},
                                         {0, 0},
                                         {90, 0},
                                         {180, 0},
                                         {270, 0},
                                         {0, 90},
                                         {0, -90}};
  const NormalReference reference(high, frame, views, 512, options.z_up);
  const NormalError without = reference.compare(low, true);
  Json json = {{"views", views.size()}, {"without_map", describe(without)}};
  char text[256];
  if (has_map) {
    const NormalError with = reference.compare(low);
    json["with_map"] = describe(with);
    std::snprintf(text, sizeof text,
                  "rendered normals against the original, %zu views (this one and along the axes): "
                  "mean %.2f degrees smooth "
                  "without the map, %.2f with it (95%%: %.2f, %.2f)",
                  views.size(), without.mean_degrees, with.mean_degrees, without.p95_degrees,
                  with.p95_degrees);
  } else {
    std::snprintf(text, sizeof text,
                  "rendered normals against the original, %zu views: mean %.2f degrees (95%%: "
                  "%.2f)",
                  views.size(), without.mean_degrees, without.p95_degrees);
  }
  console.line(text);
  return json;
}

RenderOptions render_options(const RenderArguments& arguments) {
  RenderOptions options;
  options.size = arguments.size;
  std::tie(options.azimuth_degrees, options.elevation_degrees) = parse_view(arguments.view);
  options.samples = arguments.samples;
  options.ambient_rays = arguments.ambient_rays;
  options.z_up = arguments.z_up;
  options.flat = arguments.flat;
  options.show_normals = arguments.show_normals;
  return options;
}

/// What would only be found out after the meshes were read.
void check(const RenderArguments& arguments) {
  if (arguments.size < 1 || arguments.size > 8192) {
    throw Error(ErrorCode::usage,
                "--size is " + std::to_string(arguments.size) + ": use 1 to 8192 pixels.");
  }
  if (std::filesystem::path(arguments.out).extension() != ".png") {
    throw Error(ErrorCode::usage, "--out '" + arguments.out +
                                      "': the picture is a PNG, so the name must end in .png.");
  }
  if (arguments.heights.given() && !is_height_field(arguments.reference)) {
    throw Error(
        ErrorCode::usage,
        "--height and --extent are for a --reference that is a height field, a PNG or EXR.");
  }
  if (arguments.flat && !arguments.normal.empty()) {
    throw Error(ErrorCode::usage,
                "--flat shows faces and --normal the map: leave one of them out. With --reference "
                "and --normal the flat mesh is shown beside.");
  }
}

int run_render(const RenderArguments& arguments) {
  Console console(arguments.quiet, arguments.json);
  Stopwatch watch;
  check(arguments);
  check_paths({arguments.mesh, arguments.normal, arguments.reference},
              {arguments.out, arguments.json});
  RenderOptions options = render_options(arguments);
  prepare_parent(arguments.out);
  prepare_parent(arguments.json);
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(arguments.mesh, &warnings);
  std::optional<Mesh> reference;
  if (!arguments.reference.empty()) {
    reference = load_dense(arguments.reference, arguments.heights, warnings).mesh;
  }
  Image map_image;
  NormalMap map;
  if (!arguments.normal.empty()) {
    map_image = load_normal_map(arguments.normal);
    map.image = &map_image;
    map.flip_y = arguments.flip_y;
    map.space = arguments.space == "object" ? NormalMapSpace::object
                : arguments.space == "face" ? NormalMapSpace::face
                                            : NormalMapSpace::tangent;
  }
  const double seconds_load = watch.lap();

  const Device device = Device::open(arguments.device);
  const Scene low(device, mesh, map);
  warnings.insert(warnings.end(), low.warnings().begin(), low.warnings().end());
  std::optional<Scene> high;
  if (reference) {
    high.emplace(device, *reference);
    warnings.insert(warnings.end(), high->warnings().begin(), high->warnings().end());
    options.frame = &*reference;
  }
  const double seconds_build = watch.lap();

  std::vector<Image> panels;
  if (high) panels.push_back(high->draw(options));
  if (high && map.image != nullptr) {
    RenderOptions flat = options;
    flat.flat = true;
    panels.push_back(low.draw(flat));
  }
  panels.push_back(low.draw(options));
  const double seconds_draw = watch.lap();
  save_image(join(panels), arguments.out, {ImageFormat::png8});
  const double seconds_save = watch.lap();

  for (const Warning& warning : warnings) console.warning(warning.message);
  Json rendered;
  if (high) rendered = measure(console, *high, low, *reference, options, map.image != nullptr);
  console.line("wrote " + arguments.out);
  if (!arguments.json.empty()) {
    Json inputs = {{"mesh", describe(mesh, arguments.mesh)}};
    if (reference) inputs["reference"] = describe(*reference, arguments.reference);
    Json json = {{"version", version()},
                 {"device", describe(device.info())},
                 {"inputs", inputs},
                 {"options",
                  {{"size", arguments.size},
                   {"samples", arguments.samples},
                   {"ambient_rays", arguments.ambient_rays},
                   {"view", {options.azimuth_degrees, options.elevation_degrees}},
                   {"z_up", arguments.z_up},
                   {"flat", arguments.flat},
                   {"normals", arguments.show_normals},
                   {"normal_map", arguments.normal},
                   {"space", arguments.space},
                   {"flip_y", arguments.flip_y}}},
                 {"outputs", {arguments.out}},
                 {"seconds",
                  {{"load", seconds_load},
                   {"build", seconds_build},
                   {"draw", seconds_draw},
                   {"save", seconds_save},
                   {"measure", watch.lap()},
                   {"total", watch.total()}}},
                 {"warnings", describe(warnings)}};
    if (high) json["rendered_normals"] = rendered;
    save_report(arguments.json, json);
  }
  return 0;
}

}  // namespace

Run add_render(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "render",
      "A picture of a mesh; with --reference and --normal: original | flat | with the map");
  auto a = std::make_shared<RenderArguments>();
  command->add_option("MESH", a->mesh, "The mesh to show")->required();
  command->add_option(
      "--normal", a->normal,
      "Normal map to apply through the mesh's UVs; Kiln's raw and two-component maps "
      "are recognised");
  command->add_option("--space", a->space, "Of the map: tangent, object or face")
      ->check(CLI::IsMember({"tangent", "object", "face"}))
      ->capture_default_str();
  command->add_flag("--flip-y", a->flip_y, "The map's green points down (DirectX)");
  command->add_option("--reference", a->reference,
                      "The dense mesh or height field, shown beside; also measures the difference");
  add_height_options(*command, a->heights, "The height field (--reference is a PNG or EXR)");
  command->add_option("--out", a->out, "The picture to write (PNG)")->required();
  command->add_option("--view", a->view, "AZ,EL in degrees: 0,0 looks at the front, from +Z")
      ->capture_default_str();
  command->add_option("--size", a->size, "Pixels a side, 1 to 8192")->capture_default_str();
  command->add_option("--samples", a->samples, "N x N samples a pixel, 1 to 16")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  command
      ->add_option("--ambient-rays", a->ambient_rays,
                   "Rays a pixel for ambient occlusion, 0 (none) to 255")
      ->check(CLI::Range(0, 255))
      ->capture_default_str();
  command->add_flag("--z-up", a->z_up, "The up axis is +Z (default +Y): the front is seen from -Y");
  command->add_flag("--flat", a->flat, "Face normals instead of smooth ones");
  command->add_flag("--normals", a->show_normals, "Colour by world-space normal");
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_option("--json", a->json, "Write a report to this file, or - for standard output");
  command->add_flag("--quiet", a->quiet,
                    "Leave out progress and the summary; warnings and errors stay");
  return [a] { return run_render(*a); };
}

}  // namespace kiln::cli

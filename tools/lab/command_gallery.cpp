#include <memory>
#include <optional>

#include "arguments/bake_arguments.h"
#include "arguments/dense_input.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "lab/gallery.h"
#include "picture/view_arguments.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

struct GalleryArguments {
  std::string high, low, out, json, device, max_distance = "2%";
  std::vector<std::string> matches;
  HeightArguments heights;
  ViewArguments view;
  std::uint32_t size = 1024, picture_size = 480, pixels = 512;
  bool quiet = false;
};

GalleryOptions gallery_options(const GalleryArguments& a) {
  GalleryOptions options;
  options.methods = a.matches.empty() ? match_names() : a.matches;
  options.strict = !a.matches.empty();
  options.size = a.size;
  options.pixels = a.pixels;
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.view = view_options(a.view, is_height_field(a.high));
  options.view.size = a.picture_size;
  return options;
}

std::vector<std::string> save_gallery(const Gallery& gallery, const fs::path& folder,
                                      const std::string& stem) {
  std::vector<std::string> outputs;
  const auto save = [&](const Image& image, const std::string& name, ImageFormat format) {
    save_image(image, folder / name, {format});
    outputs.push_back((folder / name).string());
  };
  save(gallery.matches, "matches.png", ImageFormat::png8);
  save(gallery.error, "error.png", ImageFormat::png8);
  save(gallery.samples, "samples.png", ImageFormat::png8);
  for (const Exhibit& exhibit : gallery.exhibits) {
    save(exhibit.error, stem + "_" + exhibit.method + "_normal_error.exr", ImageFormat::exr_float);
  }
  return outputs;
}

int run_gallery(const GalleryArguments& a) {
  GalleryOptions options = gallery_options(a);
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  check_paths({a.high, a.low},
              {folder / "matches.png", folder / "error.png", folder / "samples.png", a.json});
  prepare_output_folder(folder);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const DenseInput dense = load_dense(a.high, a.heights, warnings);
  options.uv = uv_options(dense);
  const Mesh low = load_light(a.low, "", warnings);
  const double seconds_load = watch.lap();
  const std::optional<Gallery> gallery =
      make_gallery(device, dense.mesh, low, options, [&](double done, std::string_view stage) {
        return console.progress(0.05 + 0.9 * done, stage);
      });
  if (!gallery) return kExitCancelled;
  warnings.insert(warnings.end(), gallery->warnings.begin(), gallery->warnings.end());
  const double seconds_draw = watch.lap();
  const std::vector<std::string> outputs = save_gallery(*gallery, folder, low.name);
  console.progress(1, "done");
  std::vector<Warning> of_methods;
  for (const Exhibit& exhibit : gallery->exhibits) {
    of_methods.insert(of_methods.end(), exhibit.bake.warnings.begin(), exhibit.bake.warnings.end());
  }
  print_warnings(console, warnings, of_methods, "--json");
  for (const LeftOut& left : gallery->left_out) {
    console.line("left out: " + left.name + ": " + left.reason);
  }
  for (const std::string& output : outputs) console.line("wrote " + output);
  if (a.json.empty()) return 0;
  Json json = {{"version", version()},
               {"device", describe(device.info())},
               {"inputs", {{"high", describe(dense.mesh, a.high)}, {"low", describe(low, a.low)}}},
               {"options",
                {{"match", options.methods},
                 {"size", options.size},
                 {"max_distance", a.max_distance},
                 {"picture_size", a.picture_size},
                 {"pixels", a.pixels},
                 {"view", {options.view.azimuth_degrees, options.view.elevation_degrees}},
                 {"zoom", options.view.zoom},
                 {"at", options.view.at ? Json(*options.view.at) : Json()},
                 {"z_up", options.view.z_up},
                 {"square", a.view.square},
                 {"height", is_height_field(a.high) ? Json(a.heights.height) : Json()},
                 {"extent", a.heights.extent.empty() ? Json() : Json(a.heights.extent)}}}};
  json.update(describe(*gallery));
  add_ending(json, {{"load", seconds_load}, {"draw", seconds_draw}}, watch, outputs, warnings);
  save_report(a.json, json);
  return 0;
}

}  // namespace

Run add_gallery(Command& app) {
  Command* command = name_lab_command(app, "gallery");
  auto a = std::make_shared<GalleryArguments>();
  command->add_option("HIGH", a->high, std::string("The high poly (") + kDenseKinds + ")")
      ->required();
  command->add_option("LOW", a->low, "The low poly, with UVs")->required();
  command
      ->add_option("--out", a->out,
                   "Folder for matches.png, error.png, samples.png, and "
                   "LOW_<match>_normal_error.exr")
      ->required();
  command
      ->add_option("--match", a->matches,
                   "A match, as of kiln bake; may be given again (default: all that do)")
      ->allow_extra_args(false)
      ->check(one_of(match_names()));
  command->add_option("--size", a->size, "Texels a side of the maps, 16 to 8192")
      ->check(range(16U, 8192U))
      ->capture_default_str();
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  command
      ->add_option("--picture-size", a->picture_size,
                   "Pixels of a picture's longer side, 64 to 4096")
      ->check(range(64U, 4096U))
      ->capture_default_str();
  command
      ->add_option("--pixels", a->pixels,
                   "Pixels a side of the pictures that the errors of texels are measured in")
      ->check(range(16U, 4096U))
      ->capture_default_str();
  add_view_options(*command, a->view);
  add_height_options(*command, a->heights, "The height field (HIGH is a PNG or EXR)");
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_option("--json", a->json, "Write a report to this file, or - for standard output");
  command->add_flag("--quiet", a->quiet,
                    "Leave out progress and the summary; warnings and errors stay");
  return [a] { return run_gallery(*a); };
}

}  // namespace kiln::cli

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <tuple>

#include "commands.h"
#include "console.h"
#include "kiln/kiln.h"
#include "parse.h"
#include "report.h"

namespace kiln::cli {
namespace {

struct RenderArguments {
  std::string mesh, normal, reference, out, view = "30,15", space = "tangent", device, json;
  std::uint32_t size = 512;
  bool flip_y = false, z_up = false, flat = false, show_normals = false, quiet = false;
};

/// Pictures side by side.
Image join(const std::vector<Image>& panels) {
  Image sheet;
  sheet.channels = 3;
  for (const Image& panel : panels) {
    sheet.width += panel.width;
    sheet.height = std::max(sheet.height, panel.height);
  }
  sheet.pixels.assign(std::size_t{sheet.width} * sheet.height * 3, 0);
  std::size_t left = 0;
  for (const Image& panel : panels) {
    for (std::size_t y = 0; y < panel.height; ++y) {
      std::copy_n(panel.at(0, y), std::size_t{panel.width} * 3, sheet.at(left, y));
    }
    left += panel.width;
  }
  return sheet;
}

/// How far the rendered normals are from the reference's, over the pixels that both cover.
ImageDifference rendered_difference(const Device& device, const Mesh& high, const Mesh& low,
                                    RenderOptions options) {
  options.show_normals = true;
  options.samples = 1;
  const Image b = render(device, low, options);
  options.normal_map = nullptr;
  const Image a = render(device, high, options);
  Image mask{a.width, a.height, 1, std::vector<float>(std::size_t{a.width} * a.height)};
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    const auto covered = [&](const Image& image) {
      const float* p = &image.pixels[i * 3];
      return p[0] != 0 || p[1] != 0 || p[2] != 0;
    };
    mask.pixels[i] = covered(a) && covered(b) ? 1.0F : 0.0F;
  }
  return compare_images(a, b, &mask);
}

int run_render(const RenderArguments& arguments) {
  Console console(arguments.quiet);
  if (arguments.size < 1 || arguments.size > 8192) {
    throw Error(ErrorCode::usage,
                "--size is " + std::to_string(arguments.size) + ": use 1 to 8192 pixels.");
  }
  const std::filesystem::path out = arguments.out;
  if (out.extension() != ".png") {
    throw Error(ErrorCode::usage, "--out '" + arguments.out +
                                      "': the picture is a PNG, so the name must end in .png.");
  }
  prepare_output_folder(out.parent_path());
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(arguments.mesh, &warnings);
  std::optional<Mesh> reference;
  if (!arguments.reference.empty()) reference = load_mesh(arguments.reference, &warnings);
  std::optional<Image> normal;
  if (!arguments.normal.empty()) normal = load_image(arguments.normal);
  const Device device = Device::open(arguments.device);

  RenderOptions options;
  options.size = arguments.size;
  std::tie(options.azimuth_degrees, options.elevation_degrees) = parse_view(arguments.view);
  options.z_up = arguments.z_up;
  options.flat = arguments.flat;
  options.show_normals = arguments.show_normals;
  options.flip_y = arguments.flip_y;
  options.space = arguments.space == "object" ? NormalMapSpace::object
                  : arguments.space == "face" ? NormalMapSpace::face
                                              : NormalMapSpace::tangent;
  if (reference) options.frame = &*reference;

  std::vector<Image> panels;
  if (reference) panels.push_back(render(device, *reference, options));
  if (reference && normal) {
    RenderOptions plain = options;
    plain.flat = true;
    panels.push_back(render(device, mesh, plain));
  }
  if (normal) options.normal_map = &*normal;
  panels.push_back(render(device, mesh, options));
  save_image(join(panels), out, {ImageFormat::png8});

  for (const Warning& warning : warnings) console.warning(warning.message);
  Json json = {{"version", version()},
               {"device", describe(device.info())},
               {"outputs", {arguments.out}},
               {"warnings", describe(warnings)}};
  if (reference) {
    const ImageDifference difference = rendered_difference(device, *reference, mesh, options);
    char text[256];
    std::snprintf(
        text, sizeof text,
        "rendered normals against the reference: mean %.2f, 95%% %.2f degrees over %s pixels",
        difference.mean_angle_degrees, difference.p95_angle_degrees,
        with_commas(difference.compared).c_str());
    console.line(text);
    json["rendered_normals"] = {{"pixels", difference.compared},
                                {"mean_angle_degrees", difference.mean_angle_degrees},
                                {"p95_angle_degrees", difference.p95_angle_degrees},
                                {"p99_angle_degrees", difference.p99_angle_degrees}};
  }
  console.line("wrote " + arguments.out);
  if (!arguments.json.empty()) save_text(arguments.json, json.dump(2) + "\n");
  return 0;
}

}  // namespace

Run add_render(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "render",
      "A picture of a mesh; with --reference and --normal: original | flat | with the map");
  auto a = std::make_shared<RenderArguments>();
  command->add_option("MESH", a->mesh, "The mesh to show")->required();
  command->add_option("--normal", a->normal, "Normal map to apply through the mesh's UVs");
  command->add_option("--space", a->space, "Of the map: tangent, object or face")
      ->check(CLI::IsMember({"tangent", "object", "face"}))
      ->capture_default_str();
  command->add_flag("--flip-y", a->flip_y, "The map's green points down (DirectX)");
  command->add_option("--reference", a->reference,
                      "The dense mesh, shown beside; also measures the difference");
  command->add_option("--out", a->out, "The picture to write (PNG)")->required();
  command->add_option("--view", a->view, "AZ,EL in degrees: 0,0 looks at the front, from +Z")
      ->capture_default_str();
  command->add_option("--size", a->size, "Pixels a side, 1 to 8192")->capture_default_str();
  command->add_flag("--z-up", a->z_up, "The up axis is +Z (default +Y)");
  command->add_flag("--flat", a->flat, "Face normals instead of smooth ones");
  command->add_flag("--normals", a->show_normals, "Colour by world-space normal");
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_option("--json", a->json, "Write a report to this file");
  command->add_flag("--quiet", a->quiet, "Print nothing but errors");
  return [a] { return run_render(*a); };
}

}  // namespace kiln::cli

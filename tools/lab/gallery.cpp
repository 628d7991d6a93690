// `kiln gallery HIGH LOW`: shows pictures of all matches side by side.
#include <memory>
#include <optional>

#include "arguments/command_options.h"
#include "commands.h"
#include "interrupt.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/bake.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/render.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "picture/sheet.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// Estimates the bytes that a gallery allocates after its first picture: further pictures and sheets, a map with its
/// errors, memory that bakes do not release (measured: 20 MiB), and the high poly's BVH (measured: 87 bytes per face of
/// a mesh of 300,000 faces).
std::uint64_t estimate_further_bytes(const PictureGeometry& picture, std::uint64_t methods,
                                     std::uint64_t texels, std::uint64_t faces) {
  constexpr std::uint64_t kBytesPerFace = 80, kRetainedBytes = 16 << 20,
                          kBytesPerTexel = 4 * sizeof(float);
  return bytes_of(picture, 2 * methods + 5) + kBytesPerTexel * texels + kRetainedBytes +
         kBytesPerFace * faces;
}

/// Draws and saves all pictures, and adds them to the report. \returns false if cancelled
/// \throws Error(input) if a match finds no point, or if a match that --match names does not suit the meshes
bool make_gallery(const Device& device, const HighPolyInput& high_input, const Mesh& low,
                  const LabArguments& a, RenderOptions view, LabRun& run) {
  const fs::path folder = a.out;
  const auto save = [&](const Image& image, const std::string& name, ImageFormat format) {
    run.outputs.push_back((folder / name).string());
    save_image(image, run.outputs.back(), {format});
  };
  Steps steps(run.partial_progress(0.05, 0.95));
  if (!steps.start("preparing the high poly")) return false;
  const Mesh& high = high_input.mesh;
  const Source source(device, high);
  run.warnings.insert(run.warnings.end(), source.warnings().begin(), source.warnings().end());
  std::vector<std::string> methods = a.matches;
  std::vector<OmittedSetting> left_out;
  std::erase_if(methods, [&](const std::string& name) {
    std::optional<OmittedSetting> unsuitable =
        explain_unsuitable(find_match(name).method, "--match " + name, source, high, low,
                           uv_options(high_input), a.was_given("--match"));
    if (unsuitable) left_out.push_back({name, unsuitable->reason});
    return unsuitable.has_value();
  });
  steps.count = static_cast<double>(methods.size());
  view.frame = &high;
  const Scene original(device, high), unmapped_low(device, low);
  const TexelViews texel_views(device, low);
  RenderOptions flat = view;
  flat.flat = true;
  const std::uint64_t remaining_bytes =
      estimate_further_bytes(original.geometry(view), methods.size(),
                             std::uint64_t{*a.size} * *a.size, high.triangles.size());
  std::vector<Panel> panels = {
      {draw_with_room(original, view, remaining_bytes),
       {"high poly", plural(high.triangles.size(), "face"), ""}},
      {unmapped_low.draw(flat), {"low poly", plural(low.triangles.size(), "face"), ""}}};
  const std::vector<ViewAngles> held_out = default_held_out_angles();
  AnglePictures angles;
  angles.add(original, unmapped_low, view);
  Json figures = Json::array();
  BakeOptions bake_with;
  bake_with.width = bake_with.height = *a.size;
  bake_with.match.max_distance = a.search_distance();
  bake_with.match.uv = uv_options(high_input);
  for (const std::string& method : methods) {
    if (!steps.start("matching by " + method)) return false;
    bake_with.match.method = find_match(method).method;
    bake_with.progress = steps.step_progress(0.6);
    const BakeResult baked = bake(source, low, bake_with);
    if (baked.cancelled || !steps.start("drawing")) return false;
    const BakeReport& report = baked.report;
    check_result(report, high, low);
    const Scene mapped(device, low, {&baked.maps[0].image});
    angles.add(original, mapped, view);
    const double mean = angles.mean(figures.size() + 1);
    panels.push_back({mapped.draw(view),
                      {method, "normals off " + fixed_text(mean, 2) + " degrees",
                       plural(report.missed, "texel") + " missed"}});
    save(make_normal_error_texture(texel_views, original, mapped, high, held_out, *a.size,
                                   *a.pixels),
         low.name + "_" + method + "_normal_error.exr", ImageFormat::exr_float);
    figures.push_back(fields("method mean_angle_degrees texels warnings",
                             {method, mean, describe_texels(report), describe(report.warnings)}));
    run.settings_warnings.insert(run.settings_warnings.end(), report.warnings.begin(),
                                 report.warnings.end());
    steps.done += 1;
  }
  save(make_sheet(panels), "matches.png", ImageFormat::png8);
  const Scale scale = angles.scale();
  std::vector<Panel> errors = {{panels[0].image, {"high poly", ""}}};
  for (std::size_t i = 0; i <= methods.size(); ++i) {
    errors.push_back({angles.picture(i, scale),
                      {i == 0 ? "without a map" : methods[i - 1],
                       "mean " + fixed_text(angles.mean(i), 2) + " degrees"}});
  }
  save(make_sheet(errors, scale), "error.png", ImageFormat::png8);
  run.report.update(
      fields("methods left_out", {figures, describe_left_out(left_out, "method", &run.lines)}));
  return true;
}

// ---- Command ----

int run_gallery(LabArguments a, const std::vector<OptionRow>& rows) {
  check_mesh_frame(a.frame, {a.high}, {a.low}, {});
  a.search_distance();  // rejects an invalid --max-distance before any work
  if (a.matches.empty()) a.matches = match_names();
  RenderOptions view = view_options(a.view, is_height_field(a.high));
  view.size = *a.picture_size;
  const fs::path folder = a.out;
  check_paths({a.high, a.low}, {folder / "matches.png", folder / "error.png", a.json});
  LabRun run(a);

  const Device device = Device::open(a.device);
  if (!run.console.progress(0, "reading " + a.high)) return kExitCancelled;
  HighPolyInput high_input =
      load_high(a.high, a.heights, run.warnings, load_options(a, MeshSide::high));
  shade(a.frame.shading, high_input, run.warnings);
  const Mesh low = load_low(a.low, "", run.warnings, load_options(a, MeshSide::low));
  run.record_stage("load");
  Json options = values_json(rows, &a);
  if (!is_height_field(a.high)) options["height"] = {};
  options.update(describe_view(view));
  run.report.update(fields(
      "device inputs options",
      {describe(device.info()),
       fields("high low", {describe(high_input.mesh, a.high), describe(low, a.low)}), options}));
  if (!make_gallery(device, high_input, low, a, view, run)) return kExitCancelled;
  run.record_stage("draw");
  return run.finish();
}

}  // namespace

Run add_gallery(Command& app) {
  Command* command = add_lab_command_name(app, "gallery");
  auto a = std::make_shared<LabArguments>();
  a->size = 1024, a->pixels = 512, a->picture_size = 480;
  const OptionRow files[] = {
      {.flag = "HIGH",
       .value = text(KILN_MEMBER(LabArguments, high)),
       .help = "The high poly (" + high_poly_formats() + ")",
       .required = true},
      {.flag = "LOW",
       .value = text(KILN_MEMBER(LabArguments, low)),
       .help = "The low poly, with UVs",
       .required = true},
      {.flag = "--out",
       .value = text(KILN_MEMBER(LabArguments, out)),
       .help = "Folder for matches.png, error.png and LOW_<match>_normal_error.exr",
       .required = true},
  };
  add_options(*command, files, a.get());
  const std::vector<OptionRow> rows =
      lab_rows({"--match", "--size", "--max-distance", "--picture-size", "--pixels", "--height",
                "--extent", "--triangulate", "--up", "--unit", "--uv-set", "--allow-outside",
                "--high-normals", "--device", "--json", "--quiet"});
  add_options(*command, rows, a.get());
  add_options(*command, view_rows<LabArguments>(), a.get());
  return [a, command, rows] {
    a->given = given_flags(*command);
    return run_gallery(*a, rows);
  };
}

}  // namespace kiln::cli

#include <charconv>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

#include "bake_arguments.h"
#include "check_result.h"
#include "commands.h"
#include "console.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "parse.h"
#include "paths.h"
#include "report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, VoxelType> kTypes = {{"u8", VoxelType::u8},   {"i8", VoxelType::i8},
                                                 {"u16", VoxelType::u16}, {"i16", VoxelType::i16},
                                                 {"u32", VoxelType::u32}, {"i32", VoxelType::i32},
                                                 {"f32", VoxelType::f32}, {"f64", VoxelType::f64}};

struct VolumeArguments {
  std::string volume, out, full;
  std::string iso;
  std::string inside = "above", border = "closed";
  bool outer = false;
  std::uint32_t outer_gap = 0;
  std::uint32_t faces = 0;
  double error = 0.1;
  std::string topology = "keep";
  double min_part = 0;
  std::string match = "direct";
  std::string max_distance;
  std::uint32_t samples = 1;
  std::string size = "1024";
  std::uint32_t border_texels = 2;
  std::string space = "tangent";
  bool flip_y = false;
  std::string format = "png16";
  std::string raw_size, raw_type = "u8", raw_spacing, raw_order = "little";
  std::int64_t raw_header = 0;
  bool force = false;
  std::string device, json;
  bool quiet = false;
};

CLI::Validator one_of(std::vector<std::string> names) {
  return CLI::IsMember(std::move(names), CLI::ignore_case);
}

[[noreturn]] void fail(const std::string& text) { throw Error(ErrorCode::usage, text); }

/// Three numbers with a separator between them.
template <typename T>
std::array<T, 3> parse_three(const char* flag, const std::string& text, char separator) {
  std::array<T, 3> values{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [next, error] = std::from_chars(at, end, values[k]);
    const bool last = k == 2;
    if (error != std::errc() || (last ? next != end : next == end || *next != separator)) {
      fail(std::string(flag) + " '" + text + "': expected three numbers, as in 1" + separator +
           "2" + separator + "3.");
    }
    at = next + 1;
  }
  return values;
}

/// A number, as the volume's values are.
double parse_iso(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value - value == 0)) {
    fail("--iso '" + text + "': expected a finite number.");
  }
  return value;
}

void check(const VolumeArguments& a) {
  if (a.raw_size.empty() && (a.raw_type != "u8" || !a.raw_spacing.empty() || a.raw_header != 0 ||
                             a.raw_order != "little")) {
    fail(
        "--raw-type, --raw-spacing, --raw-order and --raw-header are for files without header: "
        "give --raw-size too.");
  }
  if (a.match == "direct" && (!a.max_distance.empty() || a.samples != 1)) {
    fail("--max-distance and --samples are for --match ray or closest.");
  }
  if (a.topology == "free" && a.faces == 0) fail("--topology free needs --faces.");
  if (!a.full.empty() && fs::path(a.full).extension() != ".obj") {
    fail("--full '" + a.full +
         "': the full contour is written as OBJ, so the name must end in .obj.");
  }
}

ExtractOptions extract_options(const VolumeArguments& a) {
  ExtractOptions options;
  options.contour.iso = parse_iso(a.iso);
  options.contour.inside = a.inside == "above" ? Inside::above : Inside::below;
  options.contour.border = a.border == "closed" ? VolumeBorder::closed : VolumeBorder::open;
  options.contour.outer_only = a.outer;
  options.contour.outer_gap = a.outer_gap;
  options.faces = a.faces;
  options.error = a.error;
  options.min_part = a.min_part / 100;
  options.keep_topology = a.topology == "keep";
  const auto [width, height] = parse_size(a.size);
  if (width != height) fail("--size " + a.size + ": maps from volumes are square.");
  options.size = width;
  options.border_texels = a.border_texels;
  options.space = a.space == "tangent" ? NormalMapSpace::tangent : NormalMapSpace::object;
  options.flip_y = a.flip_y;
  return options;
}

SaveImageOptions save_options(const VolumeArguments& a) {
  SaveImageOptions options;
  options.format = a.format == "png8"    ? ImageFormat::png8
                   : a.format == "exr"   ? ImageFormat::exr_half
                   : a.format == "exr32" ? ImageFormat::exr_float
                                         : ImageFormat::png16;
  return options;
}

Volume read(const VolumeArguments& a, std::vector<Warning>& warnings) {
  if (a.raw_size.empty()) return load_volume(a.volume, &warnings);
  RawVolumeLayout layout;
  layout.size = parse_three<std::uint64_t>("--raw-size", a.raw_size, 'x');
  layout.type = kTypes.at(a.raw_type);
  if (!a.raw_spacing.empty()) {
    layout.spacing = parse_three<double>("--raw-spacing", a.raw_spacing, ',');
  }
  layout.byte_order = a.raw_order == "little" ? ByteOrder::little : ByteOrder::big;
  layout.header_bytes = a.raw_header;
  return load_raw_volume(a.volume, layout, &warnings);
}

/// The long way: the full contour as the dense mesh.
struct Baked {
  BakeReport report;
  double contour = 0, build = 0, bake = 0;  // seconds
  std::uint64_t triangles = 0;
  bool cancelled = false;
};

Baked bake_map(const Device& device, const VolumeArguments& a, const Mesh& dense,
               ExtractResult& result, Console& console) {
  Baked baked;
  Stopwatch watch;
  baked.triangles = dense.triangles.size();
  const Source source(device, dense);
  baked.build = watch.lap();
  BakeOptions options;
  options.width = options.height = result.normal_map.width;
  options.samples = a.samples;
  options.method = a.match == "ray" ? MatchMethod::ray : MatchMethod::closest;
  if (!a.max_distance.empty()) options.max_distance = parse_reach(a.max_distance);
  options.space = a.space == "tangent" ? NormalMapSpace::tangent : NormalMapSpace::object;
  options.flip_y = a.flip_y;
  // Charts have just their border around them, and none may write into another's.
  options.gutter = static_cast<std::int32_t>(a.border_texels);
  options.progress = [&](double done, std::string_view stage) {
    return console.progress(0.6 + 0.3 * done, stage);
  };
  BakeResult bake_result = bake(source, result.mesh, options);
  baked.bake = watch.lap();
  baked.cancelled = bake_result.cancelled;
  if (baked.cancelled) return baked;
  check_result(bake_result.report, dense, result.mesh);
  result.normal_map = std::move(bake_result.maps[0].image);
  baked.report = std::move(bake_result.report);
  return baked;
}

Json describe(const Volume& volume, const std::string& path) {
  static const std::map<VoxelType, std::string> names = [] {
    std::map<VoxelType, std::string> result;
    for (const auto& [name, type] : kTypes) result[type] = name;
    return result;
  }();
  return {{"path", path},
          {"size", volume.size},
          {"type", names.at(volume.type)},
          {"origin", volume.origin},
          {"axes", volume.axes}};
}

void print_summary(Console& console, const ExtractReport& r, const ExtractOptions& options) {
  char text[400];
  std::snprintf(text, sizeof text, "full contour: %s cells, %s vertices, %s quads, %s parts",
                with_commas(r.contour.cells).c_str(), with_commas(r.contour.vertices).c_str(),
                with_commas(r.contour.quads).c_str(), with_commas(r.parts).c_str());
  console.line(text);
  std::snprintf(
      text, sizeof text,
      "light mesh: %s faces (%s quads, %s triangles), within %.3g cells, %s edges with more "
      "than two faces",
      with_commas(r.faces).c_str(), with_commas(r.quads).c_str(), with_commas(r.triangles).c_str(),
      r.error, with_commas(r.non_manifold_edges).c_str());
  console.line(text);
  std::snprintf(text, sizeof text,
                "map: %u x %u, %s charts cover %.0f%%, %.2f texels a cell, %s texels from fine "
                "vertices",
                options.size, options.size, with_commas(r.charts).c_str(), 100 * r.coverage,
                r.texels_per_cell, with_commas(r.splatted_texels).c_str());
  console.line(text);
}

int run_volume(const VolumeArguments& a) {
  check(a);
  const ExtractOptions options = extract_options(a);
  const SaveImageOptions image_options = save_options(a);
  Console console(a.quiet);
  Stopwatch watch;
  const fs::path folder = a.out;
  const std::string stem = fs::path(a.volume).stem().string() + "_low";
  const fs::path mesh_path = folder / (stem + ".obj");
  const fs::path map_path = folder / (stem + "_normal" + extension(image_options));
  check_paths({a.volume}, {mesh_path, map_path, a.full, a.json});
  check_not_foreign(mesh_path, a.force);
  if (!a.full.empty()) check_not_foreign(a.full, a.force);
  prepare_output_folder(folder);
  prepare_parent(a.full);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  std::vector<Warning> warnings;
  if (!console.progress(0, "reading " + a.volume)) return kExitCancelled;
  const Volume volume = read(a, warnings);
  const double load_seconds = watch.lap();
  if (!console.progress(0.2, "contouring")) return kExitCancelled;
  ExtractResult result = extract(device, volume, options);
  result.mesh.name = stem;
  watch.lap();
  std::optional<Baked> baked;
  std::optional<Mesh> dense;
  double dense_seconds = 0;
  if (a.match != "direct" || !a.full.empty()) {
    if (!console.progress(0.5, "contouring in full")) return kExitCancelled;
    dense = contour(device, volume, options.contour);
    dense_seconds = watch.lap();
  }
  if (a.match != "direct") {
    baked = bake_map(device, a, *dense, result, console);
    if (baked->cancelled) return kExitCancelled;
    baked->contour = dense_seconds;
  }
  watch.lap();
  if (!console.progress(0.9, "writing " + mesh_path.string())) return kExitCancelled;
  std::vector<std::string> outputs = {mesh_path.string(), map_path.string()};
  save_obj(result.mesh, mesh_path);
  save_image(result.normal_map, map_path, image_options);
  if (!a.full.empty()) {
    save_obj(*dense, a.full);
    outputs.push_back(a.full);
  }
  const double save_seconds = watch.lap();
  const ExtractReport& r = result.report;
  warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
  if (baked) {
    warnings.insert(warnings.end(), baked->report.warnings.begin(), baked->report.warnings.end());
  }

  if (!a.json.empty()) {
    Json json = {{"version", version()},
                 {"device", kiln::cli::describe(device.info())},
                 {"inputs", {{"volume", describe(volume, a.volume)}}},
                 {"options",
                  {{"iso", options.contour.iso},
                   {"inside", a.inside},
                   {"border", a.border},
                   {"outer", a.outer},
                   {"outer_gap", a.outer ? Json(a.outer_gap) : Json()},
                   {"faces", a.faces == 0 ? Json() : Json(a.faces)},
                   {"error", a.faces == 0 ? Json(a.error) : Json()},
                   {"topology", a.topology},
                   {"min_part_percent", a.min_part},
                   {"match", a.match},
                   {"size", options.size},
                   {"chart_border", options.border_texels},
                   {"space", a.space},
                   {"flip_y", a.flip_y},
                   {"format", a.format}}},
                 {"seconds",
                  {{"load", load_seconds},
                   {"scan", r.contour.seconds_scan},
                   {"outer", r.contour.seconds_outer},
                   {"hermite", r.contour.seconds_hermite},
                   {"vertices", r.contour.seconds_vertices},
                   {"quads", r.contour.seconds_quads},
                   {"simplify", r.seconds_simplify},
                   {"atlas", r.seconds_atlas},
                   {"map", r.seconds_map},
                   {"extract", r.seconds_total},
                   {"save", save_seconds},
                   {"total", watch.total()}}},
                 {"compile_seconds", device.compile_seconds()},
                 {"contour",
                  {{"parts", r.parts},
                   {"filled_voxels", a.outer ? Json(r.contour.filled_voxels) : Json()},
                   {"cells", r.contour.cells},
                   {"vertices", r.contour.vertices},
                   {"quads", r.contour.quads}}},
                 {"low",
                  {{"faces", r.faces},
                   {"quads", r.quads},
                   {"triangles", r.triangles},
                   {"error_cells", r.error},
                   {"non_manifold_edges", r.non_manifold_edges}}},
                 {"map",
                  {{"charts", r.charts},
                   {"coverage", r.coverage},
                   {"texels_per_cell", r.texels_per_cell},
                   {"splatted_texels", baked ? Json() : Json(r.splatted_texels)}}},
                 {"memory", {{"peak_resident_bytes", peak_resident_bytes()}}},
                 {"outputs", outputs},
                 {"warnings", kiln::cli::describe(warnings)}};
    if (baked) {
      json["bake"] = {
          {"dense_triangles", baked->triangles},
          {"texels", describe_texels(baked->report)},
          {"seconds",
           {{"contour", baked->contour}, {"build", baked->build}, {"bake", baked->bake}}}};
    }
    save_report(a.json, json);
  }
  console.progress(1, "done");
  for (const Warning& warning : warnings) console.warning(warning.message);
  print_summary(console, r, options);
  char text[400];
  std::snprintf(text, sizeof text,
                "%.2f s: load %.2f, scan %.2f, outer %.2f, hermite %.2f, vertices %.2f, quads "
                "%.2f, simplify %.2f, "
                "atlas %.2f, map %.2f, save %.2f",
                watch.total(), load_seconds, r.contour.seconds_scan, r.contour.seconds_outer,
                r.contour.seconds_hermite, r.contour.seconds_vertices, r.contour.seconds_quads,
                r.seconds_simplify, r.seconds_atlas, r.seconds_map, save_seconds);
  console.line(text);
  if (baked) {
    std::snprintf(text, sizeof text,
                  "baked by %s from %s triangles: contour %.2f s, build %.2f, bake %.2f",
                  a.match.c_str(), with_commas(baked->triangles).c_str(), baked->contour,
                  baked->build, baked->bake);
    console.line(text);
  }
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace

Run add_volume(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "volume", "Extract a light mesh with a normal map straight from volume data");
  auto arguments = std::make_shared<VolumeArguments>();
  VolumeArguments& a = *arguments;
  command
      ->add_option("VOLUME", a.volume,
                   "Scalar voxels: NRRD, MetaImage, NIfTI, OpenVDB, or raw with --raw-size")
      ->required();
  command->add_option("--iso", a.iso, "The surface's value")->required();
  command
      ->add_option("--out", a.out,
                   "Folder for mesh and map (made where only its last part is missing)")
      ->required();

  const char* const group_surface = "The surface";
  command->add_option("--inside", a.inside, "Which voxels are solid: above or below the iso value")
      ->check(one_of({"above", "below"}))
      ->capture_default_str()
      ->group(group_surface);
  command
      ->add_option("--border", a.border,
                   "Where the solid reaches the volume's border: closed (cut off flat) or open")
      ->check(one_of({"closed", "open"}))
      ->capture_default_str()
      ->group(group_surface);
  CLI::Option* outer = command
                           ->add_flag("--outer", a.outer,
                                      "The outer surface alone: what cannot be reached from the "
                                      "volume's border is solid")
                           ->group(group_surface);
  command
      ->add_option(
          "--outer-gap", a.outer_gap,
          "With --outer: reach by a cube of 2 N + 1 voxels a side, so that narrower gaps are "
          "closed")
      ->check(CLI::Range(0U, 64U))
      ->needs(outer)
      ->capture_default_str()
      ->group(group_surface);
  CLI::Option* faces = command->add_option("--faces", a.faces, "At most N triangles")
                           ->check(CLI::Range(1U, 100000000U))
                           ->group(group_surface);
  command
      ->add_option("--error", a.error,
                   "Without --faces: few triangles whose vertices fit the surface to so many cells "
                   "(root mean square)")
      ->check(CLI::Range(1e-6, 1e6))
      ->excludes(faces)
      ->capture_default_str()
      ->group(group_surface);
  command
      ->add_option("--topology", a.topology,
                   "keep every part, hole and handle, or be free to lose some to reach --faces")
      ->check(one_of({"keep", "free"}))
      ->capture_default_str()
      ->group(group_surface);
  command
      ->add_option("--min-part", a.min_part,
                   "Leave out parts with less than P percent of the largest one's vertices")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str()
      ->group(group_surface);
  command->add_option("--full", a.full, "Also write the full-resolution contour (OBJ)")
      ->group(group_surface);

  const char* const group_map = "The map";
  command->add_option("--size", a.size, "Texels a side, 16 to 8192")
      ->capture_default_str()
      ->group(group_map);
  command
      ->add_option("--match", a.match,
                   "How texels find their normals: direct (fine vertices splatted), or the full "
                   "contour baked by ray or closest point")
      ->check(one_of({"direct", "ray", "closest"}))
      ->capture_default_str()
      ->group(group_map);
  command
      ->add_option("--max-distance", a.max_distance,
                   "ray, closest: how far to look, units or N% of the diagonal (default 2%)")
      ->group(group_map);
  command->add_option("--samples", a.samples, "ray, closest: N x N samples a texel")
      ->check(CLI::Range(1U, 16U))
      ->capture_default_str()
      ->group(group_map);
  command->add_option("--chart-border", a.border_texels, "Texels around each chart")
      ->check(CLI::Range(1U, 64U))
      ->capture_default_str()
      ->group(group_map);
  command->add_option("--space", a.space, "Of the normals: tangent (MikkTSpace) or object")
      ->check(one_of({"tangent", "object"}))
      ->capture_default_str()
      ->group(group_map);
  command->add_flag("--flip-y", a.flip_y, "Green points down (DirectX); the default is up (OpenGL)")
      ->group(group_map);
  command->add_option("--format", a.format, "png16, png8, exr (half) or exr32 (float)")
      ->check(one_of({"png16", "png8", "exr", "exr32"}))
      ->capture_default_str()
      ->group(group_map);

  const char* const group_raw = "Files without header";
  command->add_option("--raw-size", a.raw_size, "XxYxZ voxels, x fastest")->group(group_raw);
  std::vector<std::string> types;
  for (const auto& [name, type] : kTypes) types.push_back(name);
  command->add_option("--raw-type", a.raw_type, "The voxels' type")
      ->check(one_of(types))
      ->capture_default_str()
      ->group(group_raw);
  command->add_option("--raw-spacing", a.raw_spacing, "X,Y,Z units between voxels (default 1,1,1)")
      ->group(group_raw);
  command->add_option("--raw-order", a.raw_order, "Bytes' order: little or big endian")
      ->check(one_of({"little", "big"}))
      ->capture_default_str()
      ->group(group_raw);
  command
      ->add_option("--raw-header", a.raw_header,
                   "Bytes to skip; -1: whatever precedes the last voxels")
      ->capture_default_str()
      ->group(group_raw);

  const char* const group_run = "The run";
  command->add_flag("--force", a.force, "Write over meshes that Kiln did not write")
      ->group(group_run);
  command
      ->add_option("--device", a.device,
                   "OpenCL device: index or part of its name (see kiln devices)")
      ->group(group_run);
  command->add_option("--json", a.json, "Write a report to this file, or - for standard output")
      ->group(group_run);
  command->add_flag("--quiet", a.quiet, "Print nothing but errors")->group(group_run);
  return [arguments] { return run_volume(*arguments); };
}

}  // namespace kiln::cli

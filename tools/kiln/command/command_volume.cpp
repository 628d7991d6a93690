#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include "arguments/command_options.h"
#include "arguments/surface_arguments.h"
#include "cl/driver_state.h"
#include "commands.h"
#include "interrupt.h"
#include "job/check_result.h"
#include "job/describe.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/contour.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/plan.h"
#include "kiln/progress.h"
#include "kiln/unwrap.h"
#include "kiln/version.h"
#include "kiln/volume.h"
#include "options/json.h"
#include "options/parse.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// value of --match for maps without a match: vertices of the contour are splatted into the map
constexpr const char* kSplatMatch = "direct";

struct VolumeArguments {
  VolumeArguments() { surface.options.choose.size = true; }

  std::string volume, out, full;
  SurfaceArguments surface;
  std::string match = kSplatMatch;
  std::optional<Length> max_distance;
  std::uint32_t samples = 1, lods = 0;
  SaveImageOptions image = {.format = ImageFormat::png16};
  bool force = false;
  std::string device, json;
  bool quiet = false;
};

#define AT(member) KILN_MEMBER(VolumeArguments, member)

constexpr Word<UnwrapMethod> kUnwraps[] = {{"charts", UnwrapMethod::charts},
                                           {"pairs", UnwrapMethod::pairs}};
constexpr Word<NormalMapSpace> kVolumeSpaces[] = {{"object", NormalMapSpace::object},
                                                  {"tangent", NormalMapSpace::tangent}};
constexpr Word<ImageFormat> kVolumeFormats[] = {{"exr", ImageFormat::exr_half},
                                                {"exr32", ImageFormat::exr_float},
                                                {"png16", ImageFormat::png16},
                                                {"png8", ImageFormat::png8}};

OptionValue size_value() {
  return value_of<VolumeArguments>(
      "surface.options.size", "size", "N|auto",
      [](VolumeArguments& a, const Message& flag, const OptionWords& words) {
        ExtractOptions& options = a.surface.options;
        options.choose.size = words.back() == "auto";
        if (options.choose.size) return;
        const auto [width, height] = parse_size(words.back());
        if (width != height) {
          fail_usage(flag + " " + words.back() + ": maps from volumes are square.");
        }
        options.size = width;
      },
      [](VolumeArguments& a) {
        return a.surface.options.choose.size ? Json("auto") : Json(a.surface.options.size);
      });
}

std::vector<OptionRow> volume_rows() {
  return {
      {.flag = "VOLUME",
       .value = text(AT(volume)),
       .help = "Scalar voxels: NRRD, MetaImage, NIfTI, OpenVDB, or raw with --raw-size",
       .key = "-",
       .required = true},
      {.flag = "--out",
       .value = text(AT(out)),
       .help = "Folder for mesh and map, created if it is missing",
       .key = "-",
       .required = true},
      {.flag = "--full",
       .group = kSurfaceGroup,
       .value = text(AT(full)),
       .help = "Also write the full-resolution contour (OBJ)",
       .key = "-"},
      {.flag = "--lod",
       .group = kSurfaceGroup,
       .value = integer(AT(lods), 2, 8).or_unset(),
       .help = "N low polys, 2 to 8, each for half the size on screen of the previous one: with a "
               "quarter of the faces, half the map's side, and the same parts (NAME_lod0, "
               "NAME_lod1...; NAME_lods.json)"},
      {.flag = "--size",
       .group = kMapGroup,
       .value = size_value(),
       .help = "Texels per side, 16 to 8192, or auto: about one per cell"},
      {.flag = "--match",
       .group = kMapGroup,
       .value = word(AT(match), surface_match_names(kSplatMatch)),
       .help = "Source of the map's normals: direct (vertices of the fine contour are splatted "
               "into it), or a bake of the full contour by ray or closest"},
      {.flag = "--max-distance",
       .group = kMapGroup,
       .value = length(AT(max_distance)),
       .help = "With ray or closest: search distance (default 2%)"},
      {.flag = "--samples",
       .group = kMapGroup,
       .value = integer(AT(samples), 1, 16),
       .help = "With ray or closest: N x N samples per texel"},
      {.flag = "--unwrap",
       .group = kMapGroup,
       .value = choice(AT(surface.options.unwrap), Words(kUnwraps)),
       .help = "UV layout: pairs (each polygon separately) or charts (few large ones)"},
      density_row<VolumeArguments>(kMapGroup, "the full contour", AT(surface.options.density)),
      {.flag = "--space",
       .group = kMapGroup,
       .value = choice(AT(surface.options.space), Words(kVolumeSpaces)),
       .help = "Space of the normals: tangent (MikkTSpace) or object"},
      {.flag = "--flip-y",
       .group = kMapGroup,
       .value = toggle(AT(surface.options.flip_y)),
       .help = "Green points down (DirectX); by default it points up (OpenGL)"},
      {.flag = "--format",
       .group = kMapGroup,
       .value = choice(AT(image.format), Words(kVolumeFormats)),
       .help = "png16, png8, exr (half) or exr32 (float)"},
  };
}

void check_volume(const VolumeArguments& a, bool by_density) {
  check(a.surface);
  check_density(by_density, name_of(Words(kUnwraps), a.surface.options.unwrap));
  refuse_if(a.match == kSplatMatch && (a.max_distance || a.samples != 1),
            "--max-distance and --samples are for --match ray or closest.");
  refuse_if(
      !a.full.empty() && fs::path(a.full).extension() != ".obj",
      "--full '" + a.full + "': the full contour is written as OBJ, so the name must end in .obj.");
}

/// A bake with the full contour as high poly, and its result.
struct ContourBake {
  BakeReport report;
  double contour = 0, build = 0, bake = 0;  // seconds of each stage
  std::uint64_t triangles = 0;
  bool cancelled = false;
};

ContourBake bake_map(const Device& device, const VolumeArguments& a, const Mesh& dense,
                     ExtractResult& result, Console& console) {
  ContourBake baked;
  Stopwatch watch;
  baked.triangles = dense.triangles.size();
  const Source source(device, dense);
  baked.build = watch.lap();
  BakeOptions options;
  options.width = options.height = result.normal_map.width;
  options.samples = a.samples;
  options.match.method = find_match(a.match).method;
  options.match.max_distance = a.max_distance;
  options.encoding.space = a.surface.options.space;
  options.encoding.flip_y = a.surface.options.flip_y;
  // The padding is limited to the border of charts, so that charts do not overwrite each other.
  options.encoding.gutter = static_cast<std::int32_t>(a.surface.options.border_texels);
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

/// Options of the next level of detail. Each level is for half the size on screen of the one before, so it has a
/// quarter of the faces and half the map's side. All levels share parts and topology.
ExtractOptions next_level(const ExtractOptions& first, const ExtractReport& before) {
  ExtractOptions options = first;
  options.choose = {};
  options.faces = static_cast<std::uint32_t>(std::max<std::uint64_t>(4, before.faces / 4));
  options.keep_topology = before.used.keep_topology;
  options.min_part = before.used.min_part;
  options.size = std::max(16U, before.used.size / 2);
  return options;
}

/// Adds further levels to the first. The chain ends before a level that would save less than 10% of the faces. \returns
/// false if cancelled
bool add_levels(const Device& device, const VolumeArguments& a, const ExtractOptions& options,
                const VolumeSession& session, const std::optional<Mesh>& dense, Console& console,
                std::vector<ExtractResult>& levels, std::vector<Warning>& warnings) {
  while (levels.size() < a.lods) {
    const ExtractReport& previous = levels.back().report;
    ExtractResult level = session.extract(next_level(options, previous));
    const std::string name = "Level " + std::to_string(levels.size());
    if (10 * level.report.faces > 9 * previous.faces) {
      warnings.push_back(
          {"lod-left-out",
           name + " and further levels are left out: " + with_commas(level.report.faces) +
               " faces would remain of " + with_commas(previous.faces) +
               (previous.used.keep_topology ? ", to keep every part, hole and handle." : "."),
           a.lods - levels.size()});
      break;
    }
    if (a.match != kSplatMatch) {
      ContourBake baked = bake_map(device, a, *dense, level, console);
      if (baked.cancelled) return false;
      level.report.warnings = std::move(baked.report.warnings);
    }
    for (Warning& warning : level.report.warnings) {
      if (warning.code == "faces-not-reached") continue;
      warning.message = name + ": " + warning.message;
      warnings.push_back(warning);
    }
    levels.push_back(std::move(level));
  }
  return true;
}

/// Describes one level for the JSON report.
Json level_json(const ExtractResult& level, std::size_t number, const fs::path& mesh,
                const fs::path& map) {
  return {{"level", number},
          {"mesh", mesh.filename().string()},
          {"maps", {map.filename().string()}},
          {"faces", level.report.faces},
          {"positions", level.mesh.positions.size()},
          {"vertices", split_vertices(level.mesh)},
          {"size", level.normal_map.width},
          {"error_cells", level.report.error}};
}

/// Prints the values that Kiln chose, with the reasons.
void print_choice(Console& console, const ExtractReport& r, const ExtractOptions& options) {
  const ExtractUsed& effective = r.used;
  if (options.choose.error) {
    console.line(
        formatted("chosen: error %.3g cells, which aims at %s faces, a twentieth of the full "
                  "contour's (--faces, --error)",
                  effective.error, with_commas(effective.aimed_faces).c_str()));
  }
  if (options.choose.topology) {
    console.line(formatted("chosen: topology %s%s%s (--topology)",
                           effective.keep_topology ? "kept" : "free, since keeping it leaves ",
                           effective.keep_topology ? "" : with_commas(effective.kept_faces).c_str(),
                           effective.keep_topology ? "" : " faces"));
  }
  if (options.choose.min_part && r.dropped_parts != 0) {
    console.line(
        formatted("chosen: %s of %s parts left out, each under %.3g%% of the largest (--min-part)",
                  with_commas(r.dropped_parts).c_str(), with_commas(r.parts).c_str(),
                  100 * effective.min_part));
  }
  if (options.choose.size) {
    console.line(formatted("chosen: map of %u x %u, %.2f texels a cell (--size)", effective.size,
                           effective.size, r.texels_per_cell));
  }
}

void print_summary(Console& console, const ExtractReport& r, const ExtractOptions& options) {
  print_choice(console, r, options);
  console.line(formatted("full contour: %s cells, %s vertices, %s quads, %s parts",
                         with_commas(r.contour.cells).c_str(),
                         with_commas(r.contour.vertices).c_str(),
                         with_commas(r.contour.quads).c_str(), with_commas(r.parts).c_str()));
  console.line(formatted(
      "low poly: %s faces (%s quads, %s triangles), within %.3g cells, %s edges with more "
      "than two faces",
      with_commas(r.faces).c_str(), with_commas(r.quads).c_str(), with_commas(r.triangles).c_str(),
      r.error, with_commas(r.non_manifold_edges).c_str()));
  for (const std::string& line : flaw_lines(r)) console.line(line);
  console.line(
      formatted("map: %u x %u, %s charts cover %.0f%%, %.2f texels a cell, %s texels with "
                "vertices of the full contour",
                r.used.size, r.used.size, with_commas(r.charts).c_str(), 100 * r.coverage,
                r.texels_per_cell, with_commas(r.splatted_texels).c_str()));
}

Json json_of(const VolumeArguments& a) {
  Json json = describe(a.surface);
  json.update(values_json(file_and_chart_rows(), &a.surface));
  json.update(values_json(volume_rows(), &a));
  return json;
}

int run_volume(const VolumeArguments& a) {
  const ExtractOptions options = extract_options(a.surface);
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  const std::string name = fs::path(a.volume).stem().string();
  std::vector<fs::path> meshes, maps;  // file names, by level
  for (std::uint32_t k = 0; k < std::max(1U, a.lods); ++k) {
    const std::string stem = name + (a.lods == 0 ? "_low" : "_lod" + std::to_string(k));
    meshes.push_back(folder / (stem + ".obj"));
    maps.push_back(folder / (stem + "_normal" + extension(a.image)));
  }
  const fs::path lods_path = a.lods == 0 ? fs::path() : folder / (name + "_lods.json");
  std::vector<fs::path> files = {a.full, a.json, lods_path};
  files.insert(files.end(), meshes.begin(), meshes.end());
  files.insert(files.end(), maps.begin(), maps.end());
  check_paths({a.volume}, files);
  for (const fs::path& mesh : meshes) check_obj_is_replaceable(mesh, a.force);
  if (!a.full.empty()) check_obj_is_replaceable(a.full, a.force);
  prepare_output_folder(folder);
  prepare_parent(a.full);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  std::vector<Warning> warnings = kernel_folder_warnings();
  if (!console.progress(0, "reading " + a.volume)) return kExitCancelled;
  Volume loaded = read_volume(a.volume, a.surface, warnings);
  const double load_seconds = watch.lap();
  std::optional<ProgressScope> extraction_progress(console.stages_at_share(0.2));
  std::optional<VolumeSession> session;
  if (a.lods != 0) session.emplace(device, std::move(loaded), options.contour);
  const Volume& volume = session ? session->volume() : loaded;
  std::vector<ExtractResult> levels;
  // The vector must not reallocate its memory, since references to the first level are in use
  levels.reserve(std::max(1U, a.lods));
  levels.push_back(session ? session->extract(options) : extract(device, volume, options));
  extraction_progress.reset();
  ExtractResult& result = levels.front();
  watch.lap();
  std::optional<ContourBake> baked;
  std::optional<Mesh> dense;
  double dense_seconds = 0;
  if (a.match != kSplatMatch || !a.full.empty()) {
    if (!console.progress(0.5, "contouring in full")) return kExitCancelled;
    dense = contour(device, volume, options.contour);
    dense_seconds = watch.lap();
  }
  if (a.match != kSplatMatch) {
    baked = bake_map(device, a, *dense, result, console);
    if (baked->cancelled) return kExitCancelled;
    baked->contour = dense_seconds;
  }
  std::vector<Warning> level_warnings;
  if (session &&
      !add_levels(device, a, options, *session, dense, console, levels, level_warnings)) {
    return kExitCancelled;
  }
  watch.lap();
  std::vector<std::string> outputs;
  Json levels_json = Json::array();
  for (std::size_t k = 0; k < levels.size(); ++k) {
    if (!console.progress(0.9, "writing " + meshes[k].string())) return kExitCancelled;
    levels[k].mesh.name = meshes[k].stem().string();
    save_obj(levels[k].mesh, meshes[k]);
    save_image(levels[k].normal_map, maps[k], a.image);
    outputs.insert(outputs.end(), {meshes[k].string(), maps[k].string()});
    levels_json.push_back(level_json(levels[k], k, meshes[k], maps[k]));
  }
  if (!lods_path.empty()) {
    save_text(lods_path, to_text({{"version", version()}, {"levels", levels_json}}));
    outputs.push_back(lods_path.string());
  }
  if (!a.full.empty()) {
    save_obj(*dense, a.full);
    outputs.push_back(a.full);
  }
  const double save_seconds = watch.lap();
  ExtractReport& r = result.report;
  // The warning is about the direct map, which is replaced by the baked one.
  if (baked) std::erase_if(r.warnings, [](const Warning& w) { return w.code == "map-too-fine"; });
  warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
  if (baked) {
    warnings.insert(warnings.end(), baked->report.warnings.begin(), baked->report.warnings.end());
  }
  warnings.insert(warnings.end(), level_warnings.begin(), level_warnings.end());

  if (!a.json.empty()) {
    Json json = {
        {"version", version()},
        {"device", describe(device.info())},
        {"inputs", {{"volume", describe(volume, a.volume)}}},
        {"options", json_of(a)},
        {"used", describe(r.used)},
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
          {"filled_voxels", options.contour.outer_only ? Json(r.contour.filled_voxels) : Json()},
          {"cells", r.contour.cells},
          {"vertices", r.contour.vertices},
          {"quads", r.contour.quads}}},
        {"low",
         {{"faces", r.faces},
          {"quads", r.quads},
          {"triangles", r.triangles},
          {"error_cells", r.error},
          {"non_manifold_edges", r.non_manifold_edges}}},
        {"flaws", describe_flaws(r)},
        {"map",
         {{"charts", r.charts},
          {"vertices", split_vertices(result.mesh)},
          {"positions", result.mesh.positions.size()},
          {"coverage", r.coverage},
          {"texels_per_cell", r.texels_per_cell},
          {"splatted_texels", baked ? Json() : Json(r.splatted_texels)}}},
        {"memory", {{"peak_resident_bytes", peak_resident_bytes()}}},
        {"outputs", outputs},
        {"warnings", describe(warnings)}};
    if (a.lods != 0) json["levels"] = levels_json;
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
  for (std::size_t k = 0; a.lods != 0 && k < levels.size(); ++k) {
    console.line(formatted("level %zu: %s faces within %.3g cells, map of %u x %u", k,
                           with_commas(levels[k].report.faces).c_str(), levels[k].report.error,
                           levels[k].normal_map.width, levels[k].normal_map.height));
  }
  console.line(
      formatted("%.2f s: load %.2f, scan %.2f, outer %.2f, hermite %.2f, vertices %.2f, quads "
                "%.2f, simplify %.2f, atlas %.2f, map %.2f, save %.2f",
                watch.total(), load_seconds, r.contour.seconds_scan, r.contour.seconds_outer,
                r.contour.seconds_hermite, r.contour.seconds_vertices, r.contour.seconds_quads,
                r.seconds_simplify, r.seconds_atlas, r.seconds_map, save_seconds));
  if (baked) {
    console.line(formatted("baked by %s from %s triangles: contour %.2f s, build %.2f, bake %.2f",
                           a.match.c_str(), with_commas(baked->triangles).c_str(), baked->contour,
                           baked->build, baked->bake));
    const BakeReport& bake = baked->report;
    console.line(formatted(
        "%s texels covered, %s of %s samples missed (%.1f%%)", with_commas(bake.texels).c_str(),
        with_commas(bake.missed).c_str(), with_commas(bake.samples).c_str(),
        bake.samples == 0
            ? 0.0
            : 100 * static_cast<double>(bake.missed) / static_cast<double>(bake.samples)));
  }
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace

Run add_volume(Command& app) {
  Command* command =
      app.add_command("volume", "Extract a low poly with a normal map directly from volume data");
  auto arguments = std::make_shared<VolumeArguments>();
  VolumeArguments& a = *arguments;
  add_options(*command, surface_rows(/*iso_required=*/true), &a.surface);
  add_options(*command, volume_rows(), &a);
  add_options(*command, file_and_chart_rows(), &a.surface);
  const char* const group_run = "The run";
  const OptionRow rows[] = {{.flag = "--force",
                             .group = group_run,
                             .value = toggle(AT(force)),
                             .help = "Overwrite meshes that Kiln did not write"}};
  add_options(*command, rows, &a);
  add_run_options(*command, a, group_run);
  return [arguments, command] {
    check_volume(*arguments, command->find_option("--density")->count() > 0);
    return run_volume(*arguments);
  };
}

#undef AT

}  // namespace kiln::cli

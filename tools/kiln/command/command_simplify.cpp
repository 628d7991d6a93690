#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "arguments/command_options.h"
#include "base/progress_guard.h"
#include "clean/high_hulls.h"
#include "commands.h"
#include "interrupt.h"
#include "job/describe.h"
#include "job/files.h"
#include "job/high_poly_input.h"
#include "job/mesh_files.h"
#include "job/streaming.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "kiln/version.h"
#include "options/option_table.h"
#include "options/parse.h"
#include "report/console.h"
#include "simplify/streamed_simplify.h"
#include "source/chunked_mesh.h"

namespace kiln::cli {
namespace {

/// values of --normals
constexpr const char *kForMap = "map", *kForShading = "shading";

struct SimplifyArguments {
  std::string high, out, size = "2048", unwrap = "charts", json;
  TexelDensity density = TexelDensity::area;
  LoadMeshOptions load;
  std::string normals = kForMap;
  MeshFrameArguments frame;
  std::uint32_t faces = 0;
  std::string max_error;
  double hard_angle = FitNormalsOptions{}.hard_degrees;
  bool hull = false, keep_parts = false;
  CleanHigh clean = CleanHigh::automatic;
  bool keep_inner = false, keep_hulls = false;
  double fill_holes = 0;
  // true if --size, --unwrap or --density was given
  bool keep_uvs = false, has_layout_option = false;
  bool has_density_option = false;  // true if --density was given
  bool quiet = false, force = false;
};

/// Describes the UV layout for the summary.
std::string describe_layout(std::uint64_t charts, double coverage, bool kept) {
  const char* const covers = charts == 1 ? kept ? "chart was kept, and covers" : "chart covers"
                             : kept      ? "charts were kept, and cover"
                                         : "charts cover";
  return formatted("%s %s %.0f%% of the texture", with_commas(charts).c_str(), covers,
                   coverage * 100);
}

/// Warns of UVs that lie outside HIGH's charts by more than the usual padding of textures.
void warn_of_uv_excess(const SimplifyReport& report, std::uint32_t size,
                       std::vector<Warning>& warnings) {
  constexpr double kMaxUvExcessTexels = 8;
  const double texels = report.uv_strays * size;
  if (!(texels > kMaxUvExcessTexels)) return;
  const std::string text = formatted(
      "The low poly's UVs extend up to %.0f texels (of %u) beyond HIGH's charts, so textures need "
      "that much padding. Use more faces, or a smaller error.",
      texels, size);
  warnings.push_back({"uv-strays", text, 1});
}

/// Explains which argument needs a high poly in memory; empty if none does.
Message find_streaming_obstacle(const SimplifyArguments& arguments) {
  if (arguments.keep_uvs) return explain_whole_mesh_need("--keep-uvs");
  if (arguments.hull) return explain_whole_mesh_need("--hull");
  if (arguments.clean == CleanHigh::all) return explain_whole_mesh_need("--clean all");
  return find_reading_obstacle(arguments.frame, arguments.fill_holes);
}

int run_simplify(const SimplifyArguments& arguments) {
  Console console(arguments.quiet, arguments.json);
  Stopwatch watch;
  const std::filesystem::path out = arguments.out;
  refuse_if(out.extension() != ".obj",
            "--out '" + arguments.out +
                "': the low poly is written as OBJ, so the name must end in .obj.");
  refuse_if(arguments.fill_holes > 0 && arguments.clean == CleanHigh::none,
            "--fill-holes repairs a mesh, but --clean none leaves HIGH as it is: leave one of them "
            "out.");
  const auto [width, height] = parse_size(arguments.size);
  refuse_if(arguments.keep_uvs && arguments.has_layout_option,
            "--size, --unwrap and --density apply to new charts, but --keep-uvs keeps the charts "
            "of HIGH: leave one of them out.");
  check_density(arguments.has_density_option, arguments.unwrap);
  check_mesh_frame(arguments.frame, {arguments.high}, {}, {});
  check_paths({arguments.high}, {out, arguments.json});
  check_obj_is_replaceable(out, arguments.force);
  prepare_parent(out);
  prepare_parent(arguments.json);
  std::vector<Warning> warnings;
  if (!console.progress(0.0, "reading")) return kExitCancelled;
  LoadMeshOptions load = load_options(arguments.frame, MeshSide::high);
  load.triangulation = arguments.load.triangulation;
  Mesh high;
  CleanReport cleaned;
  ShadingReport shading;
  const Progress reading = [&](double, std::string_view stage) {
    return console.progress(0.0, stage);
  };
  const std::shared_ptr<const MeshStream> streamed = [&] {
    ProgressGuard progress_guard(reading);
    return open_larger_than_memory(
        arguments.high, arguments.faces != 0 ? kMemoryToSimplify : kMemoryToSimplifyWithinError,
        {arguments.load.triangulation, arguments.keep_hulls},
        [&](const LargeFile&) { return find_streaming_obstacle(arguments); });
  }();
  if (streamed != nullptr) {
    ProgressGuard progress_guard(reading);
    high = reduce(ChunkedMesh(streamed), arguments.faces);
    // The reduced mesh has no normals of its own.
    shading.chosen = ShadingRule::smooth;
    shading.missing = streamed->triangle_count();
  } else {
    high = load_mesh(arguments.high, load, &warnings);
    if (!arguments.keep_hulls) drop_hidden_hulls(high, warnings);
    cleaned =
        clean_high(high,
                   clean_options(arguments.clean, !arguments.keep_uvs, arguments.keep_inner,
                                 arguments.fill_holes, arguments.keep_parts || arguments.hull),
                   warnings);
    shading = shade(arguments.frame.shading, high, warnings);
  }
  if (!console.progress(0.2, "simplifying")) return kExitCancelled;
  SimplifyReport report;
  SimplifyOptions options;
  options.faces = arguments.faces;
  if (!arguments.max_error.empty()) options.max_error = parse_error_bound(arguments.max_error);
  options.keep_uvs = arguments.keep_uvs;
  options.hull = arguments.hull;
  options.keep_parts = arguments.keep_parts;
  options.fit_normals =
      false;  // Normals are fitted after the unwrap, because it determines the seams
  const Mesh simplified = streamed != nullptr ? simplify_reduced(*streamed, high, options, report)
                                              : simplify(high, options, &report);
  if (!console.progress(0.8, "unwrapping")) return kExitCancelled;
  UnwrapReport unwrap_report;
  const UnwrapOptions layout =
      unwrap_options(arguments.unwrap, std::min(width, height),
                     arguments.density == TexelDensity::detail ? &high : nullptr);
  Mesh low = arguments.keep_uvs ? simplified : unwrap(simplified, layout, &unwrap_report);
  const bool fits_normals_for_shading = arguments.normals != kForMap;
  FitNormalsReport normals;
  Stopwatch normal_fit_watch;
  low = fit_normals(
      low, high,
      {.hard_degrees = arguments.hard_angle,
       // At 180 degrees, no edge is hard
       .crease_degrees = arguments.hard_angle < 180 ? kShadingCreaseDegrees : 180,
       .purpose = fits_normals_for_shading ? NormalPurpose::shading : NormalPurpose::map},
      &normals);
  const double seconds_normals = normal_fit_watch.total();
  if (!console.progress(0.9, "writing")) return kExitCancelled;
  move_material_files(low, std::filesystem::path(arguments.high).parent_path(),
                      std::filesystem::path(out).parent_path());
  save_obj(low, out);
  for (const auto* list : {&report.warnings, &unwrap_report.warnings}) {
    warnings.insert(warnings.end(), list->begin(), list->end());
  }
  warn_of_lost_shape(report, "Use more " + option("faces") + ".", warnings);
  if (arguments.keep_uvs) warn_of_uv_excess(report, std::max(width, height), warnings);
  for (const Warning& warning : warnings) console.warning(warning.message);
  const std::uint64_t charts = arguments.keep_uvs ? report.charts : unwrap_report.charts;
  const double coverage = arguments.keep_uvs ? report.coverage : unwrap_report.coverage;
  const std::uint64_t vertices = split_vertices(low);
  const bool is_error_bounded = arguments.faces == 0;
  std::string back;
  if (is_error_bounded) back = formatted(" (%.4f%% the other way)", report.back_error * 100);
  console.line(formatted(
      "wrote %s: %s of %s %s, %s vertices, deviation %.4f%% of the diagonal%s, %s, %.2f s",
      arguments.out.c_str(), with_commas(report.faces).c_str(),
      with_commas(report.input_faces).c_str(), report.input_faces == 1 ? "face" : "faces",
      with_commas(vertices).c_str(), report.error * 100, back.c_str(),
      describe_layout(charts, coverage, arguments.keep_uvs).c_str(), watch.total()));
  if (streamed != nullptr) {
    console.line(streaming_line("smooth"));
  } else if (const Message text = shading_line(shading, arguments.frame.shading); !text.empty()) {
    console.line(text.text(option_as_flag));
  }
  if (report.mended > 0) {
    console.line("mended " + plural(report.mended, "triangle") +
                 " that folded over, had no area or faced down");
  }
  if (!arguments.json.empty()) {
    Json json = {{"version", version()},
                 {"inputs",
                  {streamed != nullptr ? describe(*streamed, arguments.high)
                                       : describe(high, arguments.high)}},
                 {"outputs", {arguments.out}},
                 {"faces", report.faces},
                 {"vertices", vertices},
                 {"error", report.error},
                 {"back_error", is_error_bounded ? Json(report.back_error) : Json()},
                 {"unwrap", arguments.keep_uvs ? "kept" : arguments.unwrap},
                 {"uv_strays", arguments.keep_uvs ? Json(report.uv_strays) : Json()},
                 {"triangulate", name_of(Words(kTriangulationWords), arguments.load.triangulation)},
                 {"hull", arguments.hull},
                 {"dropped_parts", report.dropped_parts},
                 {"normals", arguments.normals},
                 {"charts", charts},
                 {"coverage", coverage},
                 {"flaws", describe_flaws(report)},
                 {"clean", describe(cleaned)},
                 {"high_normals", describe(shading)},
                 {"seconds",
                  {{"simplify", report.seconds},
                   {"unwrap", unwrap_report.seconds},
                   {"normals", seconds_normals},
                   {"total", watch.total()}}},
                 {"memory", {{"peak_resident_bytes", peak_resident_bytes()}}},
                 {"warnings", describe(warnings)}};
    if (!arguments.keep_uvs) {
      json["border_texels"] = unwrap_report.border_texels;
      json["density"] = name_of(Words(kDensityWords), arguments.density);
      json["density_spread"] = unwrap_report.density_spread;
      json["hard_edges"] = normals.hard_edges;
    }
    save_report(arguments.json, json);
  }
  if (misses_faces(report, arguments.faces)) {
    print_line(stderr, "kiln: " + too_many_faces(report, arguments.faces).text(option_as_flag));
    return 1;
  }
  return 0;
}

}  // namespace

Run add_simplify(Command& app) {
  Command* command =
      app.add_command("simplify", "Make a low poly from a high poly: few faces, with UVs");
  auto arguments = std::make_shared<SimplifyArguments>();
  using Job = SimplifyArguments;
#define AT(member) KILN_MEMBER(SimplifyArguments, member)
  const OptionRow main_rows[] = {
      {.flag = "HIGH",
       .value = text(AT(high)),
       .help = "The high poly (" + mesh_format_list() + ")",
       .required = true},
      {.flag = "--out",
       .value = text(AT(out)),
       .help = "The low poly to write (OBJ)",
       .required = true},
      {.flag = "--faces",
       .value = integer(AT(faces), 1, 100000000).or_unset(),
       .help = "Number of triangles (default: as few as --max-error allows)"},
      {.flag = "--max-error",
       .value = text(AT(max_error)),
       .help = "Largest deviation in both directions, in percent of the diagonal: 0.2% or 0.2 "
               "(default 0.2%)",
       .excludes = "--faces"},
  };
  const OptionRow layout_rows[] = {
      {.flag = "--size",
       .value = text(AT(size)),
       .help = "Size of the map for which the padding of charts is chosen"},
      {.flag = "--unwrap",
       .value = word(AT(unwrap), {"charts", "pairs", "squares"}),
       .help = "Method of unwrapping: charts (few large ones), pairs (of triangles) or squares "
               "(pairs in equal squares, for comparison)"},
      density_row<Job>("", "HIGH", AT(density)),
      triangulate_row<Job>("", "HIGH"),
      clean_row<Job>(""),
      keep_inner_row<Job>(""),
      fill_holes_row<Job>(""),
      {.flag = "--keep-hulls",
       .value = toggle(AT(keep_hulls)),
       .help = "Keep HIGH's collision hulls, which are left out otherwise: objects or groups whose "
               "names begin with UCX_, UBX_, USP_ or UCP_, or end in -colonly or -convcolonly"},
      json_row<Job>(""),
      quiet_row<Job>(""),
      {.flag = "--keep-uvs",
       .value = toggle(AT(keep_uvs)),
       .help = "Keep HIGH's UVs, seams and groups instead of making new charts"},
      {.flag = "--hull",
       .value = toggle(AT(hull)),
       .help = "Make the low poly enclose HIGH completely",
       .excludes = "--keep-uvs"},
      {.flag = "--keep-parts",
       .value = toggle(AT(keep_parts)),
       .help = "With --faces: keep parts of HIGH that are smaller than the low poly's deviation",
       .excludes = "--keep-uvs --hull"},
      {.flag = "--hard-angle",
       .value = number(AT(hard_angle), 0, 180).in("degrees"),
       .help = "Smallest angle in degrees between normals at a seam that is made a hard edge (0: "
               "all seams, 180: none)",
       .excludes = "--keep-uvs"},
      {.flag = "--normals",
       .value = word(AT(normals), {kForMap, kForShading}),
       .help = "Purpose of the normals: map, for a normal map, or shading, without one"},
      {.flag = "--force",
       .value = toggle(AT(force)),
       .help = "Overwrite an OBJ that Kiln did not write"},
  };
#undef AT
  add_options(*command, main_rows, arguments.get());
  add_options(*command, mesh_frame_rows<Job>("Files of meshes", false), arguments.get());
  add_options(*command, layout_rows, arguments.get());
  return [arguments, command] {
    const std::set<std::string> given = given_flags(*command);
    arguments->has_density_option = given.contains("--density");
    arguments->has_layout_option =
        arguments->has_density_option || given.contains("--size") || given.contains("--unwrap");
    refuse_if(arguments->keep_parts && arguments->faces == 0,
              "--keep-parts needs --faces: add it, or leave --keep-parts out.");
    return run_simplify(*arguments);
  };
}

}  // namespace kiln::cli

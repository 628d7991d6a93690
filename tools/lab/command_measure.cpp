#include <algorithm>
#include <memory>

#include "arguments/bake_job.h"
#include "arguments/files.h"
#include "arguments/match_inputs.h"
#include "arguments/option_table.h"
#include "arguments/parse.h"
#include "arguments/transfers.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/layout.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

std::vector<std::string> lines_of(const LayoutRating& r, std::uint32_t size) {
  const std::string charts = with_commas(r.charts), seams = with_commas(r.seams);
  const std::string triangles = with_commas(r.triangles), mirrored = with_commas(r.mirrored);
  return {formatted("stretch (1 is none): L2 %.3f, Linf %.3f", r.stretch_l2, r.stretch_linf),
          formatted("uniformity:          %.1f%%", r.uniformity_percent),
          formatted("texels a unit:       %.4g least, %.4g mean, %.4g most at %u x %u",
                    r.least_density, r.mean_density, r.greatest_density, size, size),
          formatted("charts:              %s, with seams of %s edges, %.4g units long",
                    charts.c_str(), seams.c_str(), r.seam_length),
          formatted("used:                %.1f%% of the square, %.2g%% of that more than once",
                    100 * r.used, 100 * r.overlap),
          formatted("triangles:           %s, %s of them mirrored; %s without texels",
                    triangles.c_str(), mirrored.c_str(), with_commas(r.flat).c_str())};
}

}  // namespace

int rate_layout_of(const MeasureArguments& a) {
  Console console(a.quiet, a.json);
  Stopwatch watch;
  check_paths({a.high}, {a.json});
  if (!a.json.empty() && a.json != "-") prepare_parent(a.json);
  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(a.high, load_options(a.bake, MeshSide::high), &warnings);
  if (mesh.uvs.empty()) {
    fail("'" + a.high +
         "' has no UVs to rate. To rate matches, give both meshes: kiln measure HIGH "
         "LOW. With HIGH alone, name a study: --study views, faces or size.");
  }
  const std::uint32_t size = a.size.value_or(512);
  if (!console.progress(0.5, "rating the layout")) return kExitCancelled;
  const LayoutRating r = rate_layout(device, mesh, size, size);
  warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
  console.progress(1, "done");
  print_warnings(console, warnings, {}, "--json");
  if (a.json != "-") {
    for (const std::string& line : lines_of(r, size)) console.line(line);
  }
  if (a.json.empty()) return 0;
  const Json rating = fields(
      "triangles degenerate flat mirrored area stretch_l2 stretch_linf uniformity_percent "
      "texels_per_unit charts seams seam_length texels used overlap",
      {r.triangles, r.degenerate, r.flat, r.mirrored, r.area, r.stretch_l2, r.stretch_linf,
       r.uniformity_percent,
       fields("least mean greatest", {r.least_density, r.mean_density, r.greatest_density}),
       r.charts, r.seams, r.seam_length, r.texels, r.used, r.overlap});
  const Json json =
      fields("version inputs options layout seconds memory warnings",
             {version(), fields("low", {describe(mesh, a.high)}), fields("size", {size}), rating,
              fields("rate total", {r.seconds, watch.total()}),
              fields("peak_resident_bytes", {peak_resident_bytes()}), describe(warnings)});
  save_report(a.json, json);
  return 0;
}

Run add_measure(Command& app) {
  Command* command = name_lab_command(app, "measure");
  auto a = std::make_shared<MeasureArguments>();
  const std::set<std::string> own = {"--match",         "--max-distance", "--views", "--view-size",
                                     "--visibility-at", "--directions",   "--view"};
  a->matching_flags = add_matching_flags(*command, a->bake, own);
  a->matching_flags.merge(add_measured_map_flags(*command, a->bake));
  command->add_option("HIGH", a->high, "The high poly (" + high_poly_kinds() + ")")->required();
  command->add_option(
      "LOW", a->low,
      "The low poly, with UVs; with --study views it may be left out: Kiln makes one");
  command
      ->add_option("--match", a->matches,
                   "A match to rate, as of kiln bake; may be given again (default: all, but uv "
                   "only where HIGH has UVs that lie over LOW's)")
      ->allow_extra_args(false)
      ->check(one_of(match_names()));
  command
      ->add_option(
          "--visibility-at", a->visibility_at,
          "Rate visibility and hybrid with directions gathered here: face, vertex or texel; "
          "may be given again (default: texel)")
      ->allow_extra_args(false)
      ->check(one_of(Words(kVisibilityAt)));
  command
      ->add_option("--directions", a->directions,
                   "Directions that viewing rays come from (default 512)")
      ->check(range(12U, 4096U));
  command
      ->add_option("--pixels", a->pixels,
                   "Pixels a side of the pictures that rendered normals are measured in (default "
                   "512)")
      ->check(range(16U, 4096U));
  command
      ->add_option("--study", a->study,
                   "What varies: the views matched from, the low poly's faces, or its faces and "
                   "the map's size")
      ->check(one_of(study_names()));
  command->add_option("--out", a->out,
                      "Folder for measure.png and the measures as textures (EXR); with --study for "
                      "study_<what>.csv and .png and study_<what>_error.png; and for what the "
                      "pictures show, ..._plot.json and .png");
  command->add_option("--views", a->views, "Depth views, where they do not vary (default 12)")
      ->check(range(1U, 128U));
  command
      ->add_option("--view-size", a->view_size,
                   "Pixels a side of a depth view (default: by the density of HIGH)")
      ->check(range(16U, 8192U));
  command
      ->add_option("--size", a->size,
                   "Texels a side (default 512; of a study, where they do not vary, 1024)")
      ->check(range(16U, 8192U));
  command
      ->add_option("--faces", a->faces,
                   "--study views without LOW: triangles of the low poly (default 2000)")
      ->check(range(4U, 100000000U));
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  add_height_options(*command, *a, "The height field (HIGH is a PNG or EXR)");
  command
      ->add_option("--picture-size", a->picture_size,
                   "Pixels of a picture's longer side (default: by how much of it the mesh fills)")
      ->check(range(64U, 4096U));
  add_options(*command, view_rows<MeasureArguments>(), a.get());
  add_run_options(*command, *a);
  return [a, command] {
    static const std::set<std::string> of_meshes = {"--up", "--unit", "--uv-set", "--allow-outside",
                                                    "--triangulate"};
    std::vector<std::string> high = {a->high}, low = a->bake.more_low;
    high.insert(high.end(), a->bake.more_high.begin(), a->bake.more_high.end());
    if (!a->low.empty()) low.push_back(a->low);
    check_mesh_frame(a->bake.frame, high, low, a->bake.occluders);
    for (const std::string& flag : given_flags(*command)) {
      const bool takes = a->matching_flags.contains(flag);
      if (takes) a->bake.given.insert(flag);
      if (flag == "--max-distance") a->distance_given = true;
      if (!takes || a->study.empty() || of_meshes.contains(flag)) continue;
      fail(flag + " is for rating matches: leave out --study, or it.");
    }
    if (a->study.empty() && a->low.empty()) {
      std::set<std::string> own_of_layouts = {"--size", "--json", "--quiet", "--device"};
      own_of_layouts.insert(of_meshes.begin(), of_meshes.end());
      const std::set<std::string> given = given_flags(*command);
      if (std::all_of(given.begin(), given.end(),
                      [&](const std::string& flag) { return own_of_layouts.contains(flag); })) {
        return rate_layout_of(*a);
      }
    }
    return a->study.empty() ? run_rating(*a) : run_study(*a);
  };
}

}  // namespace kiln::cli

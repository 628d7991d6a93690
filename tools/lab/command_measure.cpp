#include <memory>

#include "arguments/command_options.h"
#include "commands.h"
#include "interrupt.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/job_options.h"
#include "job/match_inputs.h"
#include "job/transfers.h"
#include "kiln/layout.h"
#include "lab/lab_run.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/option_table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

std::vector<std::string> format_rating(const LayoutRating& r, std::uint32_t size) {
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
  check_paths({a.high}, {a.json});
  LabRun run(a);
  const Device device = Device::open(a.device);
  if (!run.console.progress(0, "reading " + a.high)) return kExitCancelled;
  const Mesh mesh = load_mesh(a.high, load_options(a.bake, MeshSide::high), &run.warnings);
  refuse_if(mesh.uvs.empty(),
            "'" + a.high +
                "' has no UVs to rate. To rate matches, give both meshes: kiln measure HIGH "
                "LOW. With HIGH alone, name a study: --study views, faces or size.");
  const std::uint32_t size = a.size.value_or(512);
  if (!run.console.progress(0.5, "rating the layout")) return kExitCancelled;
  const LayoutRating r = rate_layout(device, mesh, size, size);
  run.warnings.insert(run.warnings.end(), r.warnings.begin(), r.warnings.end());
  run.seconds["rate"] = r.seconds;
  run.lines = format_rating(r, size);
  const Json rating = fields(
      "triangles degenerate flat mirrored area stretch_l2 stretch_linf uniformity_percent "
      "texels_per_unit charts seams seam_length texels used overlap",
      {r.triangles, r.degenerate, r.flat, r.mirrored, r.area, r.stretch_l2, r.stretch_linf,
       r.uniformity_percent,
       fields("least mean greatest", {r.least_density, r.mean_density, r.greatest_density}),
       r.charts, r.seams, r.seam_length, r.texels, r.used, r.overlap});
  run.report.update(fields("inputs options layout", {fields("low", {describe(mesh, a.high)}),
                                                     fields("size", {size}), rating}));
  return run.finish();
}

Run add_measure(Command& app) {
  using Job = MeasureArguments;
  Command* command = add_lab_command_name(app, "measure");
  auto a = std::make_shared<Job>();
  const std::set<std::string> own = {"--match",         "--max-distance", "--views", "--view-size",
                                     "--visibility-at", "--directions",   "--view"};
  a->matching_flags = add_matching_flags(*command, a->bake, own);
  a->matching_flags.merge(add_measured_map_flags(*command, a->bake));
  const OptionRow rows[] = {
      {.flag = "HIGH",
       .value = text(KILN_MEMBER(Job, high)),
       .help = "The high poly (" + high_poly_formats() + ")",
       .required = true},
      {.flag = "LOW",
       .value = text(KILN_MEMBER(Job, low)),
       .help = "The low poly, with UVs; if it is left out, --study views makes one"},
      {.flag = "--out",
       .value = text(KILN_MEMBER(Job, out)),
       .help = "Folder for measure.png and the measures as textures (EXR); with --study for "
               "study_<what>.csv, .png and _plot.json"},
      {.flag = "--visibility-at",
       .value = list_option(KILN_MEMBER(Job, visibility_at), names_of(Words(kVisibilityAtWords))),
       .help =
           "Where the matches visibility and hybrid gather directions: per texel, vertex or face; "
           "may be repeated to rate several (default: texel)"},
      {.flag = "--study",
       .value = word(KILN_MEMBER(Job, study), kStudies),
       .help =
           "What the study varies: views, the number of depth views; faces, the low poly's faces; "
           "size, both the low poly's faces and the map's size, which is --size in the other "
           "studies (default 1024)"},
      {.flag = "--views",
       .value = integer(KILN_MEMBER(Job, views), 1, 128),
       .help = "With --study faces or size: number of depth views (default 12)"},
      {.flag = "--view-size",
       .value = integer(KILN_MEMBER(Job, view_size), 16, 8192),
       .help = "Pixels a side of a depth view (default: by the density of HIGH)"},
      {.flag = "--faces",
       .value = integer(KILN_MEMBER(Job, faces), 4, 100000000),
       .help = "With --study views without LOW: triangles of the low poly (default 2000)"}};
  add_options(*command, rows, a.get());
  LabArguments* const shared = a.get();
  add_options(*command,
              lab_rows({"--match", "--size", "--max-distance", "--directions", "--pixels",
                        "--picture-size", "--height", "--extent", "--device", "--json", "--quiet"}),
              shared);
  add_options(*command, view_rows<MeasureArguments>(), a.get());
  return [a, command] {
    static const std::set<std::string> mesh_flags = {"--up", "--unit", "--uv-set",
                                                     "--allow-outside", "--triangulate"};
    std::vector<std::string> high = {a->high}, low = further_input_names(a->bake.low.given);
    const std::vector<std::string> more_files = further_input_names(a->bake.high);
    high.insert(high.end(), more_files.begin(), more_files.end());
    if (!a->low.empty()) low.push_back(a->low);
    check_mesh_frame(a->bake.frame, high, low, a->bake.occluders);
    a->given = given_flags(*command);
    bool has_rating_flag =
        false;  // true if a flag was given that has no effect on the rating of a UV layout
    for (const std::string& flag : a->given) {
      static const std::set<std::string> layout_flags = {"--size", "--json", "--quiet", "--device"};
      has_rating_flag =
          has_rating_flag || !(layout_flags.contains(flag) || mesh_flags.contains(flag));
      if (!a->matching_flags.contains(flag)) continue;
      a->bake.given.insert(flag);
      if (a->study.empty() || mesh_flags.contains(flag) || flag == "--high-normals") continue;
      fail_usage(flag + " is for rating matches: leave this flag out, or leave --study out.");
    }
    if (!a->study.empty()) return run_study(*a);
    return a->low.empty() && !has_rating_flag ? rate_layout_of(*a) : run_rating(*a);
  };
}

}  // namespace kiln::cli

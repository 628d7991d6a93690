// kiln measure LOW: rates a UV layout.
#include <cstdio>

#include "arguments/parse.h"
#include "arguments/paths.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "lab/measure_run.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/json_text.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kDefaultSize = 512;

void print(Console& console, const LayoutRating& r, std::uint32_t size) {
  char text[200];
  std::snprintf(text, sizeof text, "stretch (1 is none): L2 %.3f, Linf %.3f", r.stretch_l2,
                r.stretch_linf);
  console.line(text);
  std::snprintf(text, sizeof text, "uniformity:          %.1f%%", r.uniformity_percent);
  console.line(text);
  std::snprintf(text, sizeof text,
                "texels a unit:       %.4g least, %.4g mean, %.4g most at %u x %u", r.least_density,
                r.mean_density, r.greatest_density, size, size);
  console.line(text);
  std::snprintf(text, sizeof text,
                "charts:              %s, with seams of %s edges, %.4g units long",
                with_commas(r.charts).c_str(), with_commas(r.seams).c_str(), r.seam_length);
  console.line(text);
  std::snprintf(text, sizeof text,
                "used:                %.1f%% of the square, %.2g%% of that more than once",
                100 * r.used, 100 * r.overlap);
  console.line(text);
  std::snprintf(text, sizeof text,
                "triangles:           %s, %s of them mirrored; %s without texels",
                with_commas(r.triangles).c_str(), with_commas(r.mirrored).c_str(),
                with_commas(r.flat).c_str());
  console.line(text);
}

}  // namespace

int rate_one_layout(const MeasureArguments& a) {
  Console console(a.quiet, a.json);
  Stopwatch watch;
  check_paths({a.high}, {a.json});
  if (!a.json.empty() && a.json != "-") prepare_parent(a.json);
  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(a.high, &warnings);
  if (mesh.uvs.empty()) {
    throw Error(ErrorCode::usage,
                "'" + a.high +
                    "' has no UVs to rate. To rate matches, give both meshes: kiln measure HIGH "
                    "LOW. With HIGH alone, name a study: --study views, faces or size.");
  }
  const std::uint32_t size = a.size.value_or(kDefaultSize);
  if (!console.progress(0.5, "rating the layout")) return kExitCancelled;
  const LayoutRating r = rate_layout(device, mesh, size, size);
  warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
  console.progress(1, "done");
  print_warnings(console, warnings, {}, "--json");
  if (a.json != "-") print(console, r, size);
  if (a.json.empty()) return 0;
  Json json = {
      {"version", version()},
      {"inputs", {{"low", cli::describe(mesh, a.high)}}},
      {"options", {{"size", size}}},
      {"layout",
       {{"triangles", r.triangles},
        {"degenerate", r.degenerate},
        {"flat", r.flat},
        {"mirrored", r.mirrored},
        {"area", r.area},
        {"stretch_l2", r.stretch_l2},
        {"stretch_linf", r.stretch_linf},
        {"uniformity_percent", r.uniformity_percent},
        {"texels_per_unit",
         {{"least", r.least_density}, {"mean", r.mean_density}, {"greatest", r.greatest_density}}},
        {"charts", r.charts},
        {"seams", r.seams},
        {"seam_length", r.seam_length},
        {"texels", r.texels},
        {"used", r.used},
        {"overlap", r.overlap}}},
      {"seconds", {{"rate", r.seconds}, {"total", watch.total()}}},
      {"memory", {{"peak_resident_bytes", peak_resident_bytes()}}},
      {"warnings", cli::describe(warnings)}};
  save_report(a.json, json);
  return 0;
}

}  // namespace kiln::cli

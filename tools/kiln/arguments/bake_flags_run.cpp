#include <charconv>

#include "arguments/bake_flags.h"
#include "arguments/unwrap_option.h"

namespace kiln::cli {
namespace {

/// Percent, 0 to 100.
Check percentage() {
  return Check(
      [](const std::string& text) {
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool good = error == std::errc() && end == text.data() + text.size();
        return good && value >= 0 && value <= 100 ? std::string()
                                                  : "expected 0 to 100, not '" + text + "'";
      },
      "P");
}

}  // namespace

void add_run_flags(Command& command, BakeArguments& a) {
  const char* const group_heights = "The height field (HIGH is a PNG or EXR; --match is uv then)";
  add_height_options(command, a.heights, group_heights);

  const char* const group_low = "The low poly";
  command.add_option("--faces", a.faces, "Without LOW: simplify HIGH to N triangles")
      ->check(range(1U, 100000000U))
      ->group(group_low);
  command
      .add_flag("--keep-parts", a.keep_parts,
                "With --faces: keep parts of HIGH that are smaller than the low poly's deviation")
      ->group(group_low);
  command
      .add_option("--max-error", a.max_error,
                  "Without LOW and --faces: normal=DEGREES, the fewest bytes of low poly and "
                  "maps whose rendered normals are this near on average; or P%, few triangles that "
                  "stay within this share of the diagonal (default 0.2%). With --match auto and "
                  "without --max-angle: the older name of that. normal=DEGREES,MAP=E...: errors "
                  "of several maps at once (degrees, world units, colour differences, or shares "
                  "of 1 such as 2/255)")
      ->group(group_low);
  command
      .add_option("--screen", a.screen,
                  "With --max-error normal=DEGREES: the largest size at which the mesh will be "
                  "seen, the longer of its width and height, such as 600px; finer detail than a "
                  "pixel then does not count")
      ->group(group_low);
  command
      .add_option(
          "--max-outline", a.max_outline,
          "With --max-error normal=DEGREES: outlines may differ by this share of what "
          "either mesh covers in pictures, such as 2%; rendered normals tell little of them")
      ->group(group_low);
  command
      .add_option(
          "--lod", a.lods,
          "With --screen: N low polys, 2 to 8, each planned for half the size on screen "
          "of the one before (NAME_lod0, NAME_lod1...; NAME_lods.json says which takes over "
          "where)")
      ->check(range(2U, 8U))
      ->group(group_low);
  command
      .add_option("--lod-growth", a.lod_growth,
                  "With --lod: each level may be off by so many times the one before, 1 (default, "
                  "all by the same) to 4")
      ->check(range(1.0, 4.0))
      ->group(group_low);
  command
      .add_option("--lod-uvs", a.lod_uvs,
                  "With --lod: own, each level has its layout and maps, or shared, the first one's "
                  "maps serve all")
      ->check(one_of({"own", "shared"}))
      ->group(group_low);
  command
      .add_flag(
          "--unwrap{given}", a.unwrap_method,
          "Give LOW new UVs, and write it beside the maps. How the low poly is laid out, "
          "with LOW or without: --unwrap=charts (few large ones, default), --unwrap=pairs (of "
          "triangles) or --unwrap=squares (pairs in equal squares, to compare with)")
      ->check(one_of({"given", "charts", "pairs", "squares"}))
      ->each([&a](const std::string&) { a.unwrap = true; })
      ->type_name("[=charts|pairs|squares]")
      ->group(group_low);
  add_density_option(command, a.density, "the high poly")->group(group_low);

  const char* const group_run = "The run";
  command
      .add_option("--max-missed", a.max_missed_percent,
                  "Exit with 1 where more than P percent of the samples are missed")
      ->check(percentage())
      ->group(group_run);
  command
      .add_flag("--force", a.force,
                "Write over a low poly that Kiln did not write, and over maps of another LOW")
      ->group(group_run);
  command
      .add_option("--device", a.device,
                  "OpenCL device: index or part of its name (see kiln devices)")
      ->group(group_run);
  command.add_option("--json", a.json, "Write a report to this file, or - for standard output")
      ->group(group_run);
  command
      .add_flag("--quiet", a.quiet, "Leave out progress and the summary; warnings and errors stay")
      ->group(group_run);
}

}  // namespace kiln::cli

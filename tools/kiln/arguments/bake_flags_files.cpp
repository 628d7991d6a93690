#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"

namespace kiln::cli {

void add_file_flags(Command& command, BakeArguments& a) {
  const char* const group_textures = "Textures of HIGH";
  command
      .add_option("--transfer", a.transfers,
                  "FILE[:NAME][:srgb|linear|normal]: bakes a picture over HIGH's UVs into the map "
                  "NAME (default: FILE's name), filtered over each texel's area. srgb (default of "
                  "PNG): colours, filtered in linear light. linear (default of EXR): numbers. "
                  "normal: a tangent-space normal map. mtl:roughness and the like: the pictures "
                  "that HIGH's materials name. NAME color or opacity: for these maps. May be given "
                  "again")
      ->allow_extra_args(false)
      ->group(group_textures);
  command
      .add_option("--alpha-test", a.alpha_test,
                  "Above 0, to 1: parts of HIGH that are less opaque are not there, for any match "
                  "and map: leaves on cards. By --transfer FILE:opacity, or by the pictures that "
                  "HIGH's materials name (map_d, or the alpha of map_Kd)")
      ->check(range(0.0, 1.0))
      ->group(group_textures);
  command
      .add_option("--pack", a.packs,
                  "NAME=MAP[.r],MAP,MAP: also writes these maps' channels as the channels of one "
                  "file; 0 to 1 is a number. Such as orm=ao,roughness,metallic. May be given again")
      ->allow_extra_args(false)
      ->group("The map");
  command
      .add_flag("--layers", a.layers,
                "EXR: all maps as the layers of one file, NAME_layers.exr, instead of a file each")
      ->group("The map");
  command
      .add_option("--id-by", a.id_by,
                  "What the map id tells apart: connected parts, or HIGH's materials, groups or "
                  "objects (OBJ). --json has the legend")
      ->check(one_of(id_by_values()))
      ->capture_default_str()
      ->group("The map");
  command
      .add_flag("--report-error", a.report_error,
                "Also compares each map at 2,000 texels with a finer evaluation: 16 times as many "
                "points, 4096 rays")
      ->group("The map");
}

}  // namespace kiln::cli

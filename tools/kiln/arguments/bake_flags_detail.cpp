#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"
#include "arguments/parse.h"

namespace kiln::cli {

void add_detail_flags(Command& command, BakeArguments& a) {
  const char* const group_occlusion = "Occlusion (--maps ao, bent_normal, thickness)";
  command
      .add_option("--ao-by", a.ao_by,
                  "What gathers ao and bent_normal: rays; views (depth views of all that darkens, "
                  "from all around: no grain); or auto (views where they are expected to be "
                  "faster)")
      ->check(one_of(occlusion_by_values()))
      ->capture_default_str()
      ->group(group_occlusion);
  command.add_option("--ao-views", a.ao_views, "With --ao-by views: their directions, 16 to 4096")
      ->check(range(16U, 4096U))
      ->capture_default_str()
      ->group(group_occlusion);
  command
      .add_option("--ao-rays", a.ao_rays,
                  "Rays a sample, 1 to 4096: more rays, less grain in ambient occlusion (ao), bent "
                  "normals and thickness. --samples multiplies them")
      ->check(range(1U, 4096U))
      ->capture_default_str()
      ->group(group_occlusion);
  command
      .add_option(
          "--ao-distance", a.ao_distance,
          "How far away something still darkens ambient occlusion and bends normals "
          "(default: all of HIGH); how thick thickness shows as white (default: 10%). World "
          "units, or P% of HIGH's diagonal")
      ->group(group_occlusion);
  command
      .add_option(
          "--ao-falloff", a.ao_falloff,
          "How much something darkens ao and bends bent_normal, by its share x of --ao-distance "
          "(default: HIGH's diagonal): all alike (none), 1 - x (linear), or 1 - x^2 (3 - 2x) "
          "(smooth)")
      ->check(one_of(occlusion_falloff_values()))
      ->capture_default_str()
      ->group(group_occlusion);
  command
      .add_flag("--ao-ignore-back-faces", a.ao_ignore_back_faces,
                "Only faces that look at a point darken it: for open meshes, whose insides show. "
                "thickness always takes both sides")
      ->group(group_occlusion);
  command
      .add_option("--ao-occluders", a.ao_occluders,
                  "What darkens ao, bends bent_normal and casts shadow: high, low, and mesh files "
                  "in HIGH's space, such as a ground, separated by commas")
      ->delimiter(',')
      ->capture_default_str()
      ->group(group_occlusion);
  command
      .add_option(
          "--part-occlusion", a.part_occlusion,
          "With --match-by: what of HIGH and LOW darkens a part: all, or its own part alone "
          "(own), as if the parts were pulled apart. Files of --ao-occluders always do")
      ->check(one_of({"all", "own"}))
      ->capture_default_str()
      ->group(group_occlusion);
  command
      .add_option(
          "--ao-error", a.ao_error,
          "Of ao, such as 2/255 or 0.01: the root mean square error to reach. Texels begin with "
          "a quarter of --ao-rays; noise is smoothed where that blurs nothing, and texels "
          "that need it cast more, up to 4096. What was reached is measured and printed")
      ->check(share_of_1())
      ->group(group_occlusion);
  command
      .add_option("--light", a.light,
                  "X,Y,Z: where the light of the map shadow comes from, object space")
      ->capture_default_str()
      ->group("Shadow (--maps shadow)");
  command
      .add_option("--light-angle", a.light_angle,
                  "Diameter of its disc as seen, degrees, 0 (a point) to 90: soft shadows, by "
                  "--ao-rays. The sun's is 0.53")
      ->check(range(0.0, 90.0))
      ->capture_default_str()
      ->group("Shadow (--maps shadow)");
  command
      .add_option("--origin", a.origin,
                  "X,Y,Z: what positions are measured from, world units (default: 0; the middle of "
                  "HIGH, rounded, where that is farther from 0 than 16 of its diagonals)")
      ->group("Position (--maps position)");
  command
      .add_option("--curvature-radius", a.curvature_radius,
                  "Curvature is the mean over HIGH's surface this far around the point (default "
                  "0.5%, but 3 facets of smooth parts at least). World units, or P% of HIGH's "
                  "diagonal")
      ->group("Curvature (--maps curvature)");
  command
      .add_option(
          "--range", a.ranges,
          "MAP=LO,HI: the values of a map that are 0 and 1 in a PNG, instead of those of its "
          "rule. May be given again")
      ->allow_extra_args(false)
      ->group("The map");
}

}  // namespace kiln::cli

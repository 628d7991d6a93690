#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"

namespace kiln::cli {
namespace {

/// Of `kiln bake`: all of them.
std::vector<std::string> bake_match_names() {
  std::vector<std::string> names = {kAutomatic};
  for (const MatchInfo& match : matches()) names.emplace_back(match.method.name);
  return names;
}

std::string matches_in_words() {
  std::string text;
  for (const MatchInfo& match : matches()) {
    text += std::string(match.method.name) + ": " + std::string(match.searches) + "; ";
  }
  return text;
}

std::vector<std::string> fallback_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (match.may_follow) names.emplace_back(match.method.name);
  }
  for (const auto& [name, value] : miss_values()) names.push_back(name);
  return names;
}

}  // namespace

void add_match_flags(Command& command, BakeArguments& a) {
  const char* const group_match = "The match";
  command
      .add_option(
          "--match", a.match,
          "Which point of HIGH a texel stands for. " + matches_in_words() +
              "auto: the cheapest match and the smallest map (up to --size) that reach --max-angle")
      ->check(one_of(bake_match_names()))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option("--max-angle", a.max_angle,
                  "For --match auto: the mean angle to reach, in degrees, between rendered normals "
                  "and HIGH's "
                  "(default: what the largest map would reach)")
      ->group(group_match);
  command
      .add_option(
          "--fallback", a.fallback,
          "What decides samples that the match misses: a chain such as ray,closest. Its end "
          "is low (LOW's normal), fill (from around) or mark (in magenta)")
      ->delimiter(',')
      ->check(one_of(fallback_names()))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option(
          "--fallback-blend", a.fallback_blend,
          "TEXELS: the way over which the match's normals blend into the fallback's, so that the "
          "map has no step")
      ->check(range(0U, 256U))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option(
          "--max-distance", a.max_distance,
          "How far to look each way: world units, or P% of HIGH's diagonal (default 2%); with a "
          "cage, the ray's length from the cage inward (default: twice the cage); with --cage "
          "auto, "
          "how far above LOW a part of HIGH may begin (default 4%)")
      ->group(group_match);
  Option* cage =
      command
          .add_option(
              "--cage", a.cage,
              "Cast from this far outside, inward, first hit: D or P%; or auto, "
              "found for each vertex. For parts that float over LOW, cut through it or lie on it")
          ->group(group_match);
  command
      .add_option(
          "--cage-mesh", a.cage_mesh,
          "Cast from this mesh: LOW with its vertices moved, what --save-cage wrote, or any "
          "closed hull around LOW")
      ->excludes(cage)
      ->group(group_match);
  command
      .add_option("--save-cage", a.save_cage,
                  "--cage auto: also write the cage, an OBJ of two shells or an EXR of distances "
                  "and directions. Correct a vertex of it, and bake with --cage-mesh")
      ->group(group_match);
  command
      .add_option(
          "--ray", a.ray,
          "Which face a ray takes: outermost, which is what a viewer sees, but nothing beyond "
          "LOW's own folds and parts; or nearest, outward first")
      ->check(one_of(ray_rule_values()))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option(
          "--direction", a.direction,
          "Where rays leave to: auto, LOW's own normal, turned to the averaged one at hard "
          "edges; averaged; face, LOW's own normal alone, which leaves gaps at edges; or painted, "
          "as LOW's vertex colours say: red along its own normal, black averaged")
      ->check(one_of(ray_direction_values()))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option(
          "--edge-width", a.edge_width,
          "--direction auto: how near to a hard edge rays turn, D or P% (default: for each edge "
          "two fifths of the width of HIGH's bevel there)")
      ->group(group_match);
  command
      .add_option(
          "--match-by", a.match_by,
          "Which part of HIGH a texel may find: all, or its own part alone. name: the group or "
          "object X_low of LOW takes X_high and X_high_* of HIGH, or X_lp that of X_hp, X_lo that "
          "of X_hi; group, object, material: "
          "the one of the same name; list: as --match-list says")
      ->check(one_of({"all", "name", "group", "object", "material", "list"}))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option("--low-names", a.low_names,
                  "--match-by name: patterns of LOW's names; the first * is the part's name")
      ->delimiter(',')
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option("--high-names", a.high_names,
                  "--match-by name: patterns of HIGH's names; the first * is the part's name")
      ->delimiter(',')
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option("--match-list", a.match_list,
                  "--match-by list: a file of lines LOW = HIGH, HIGH with names of groups or "
                  "objects; * is any text")
      ->group(group_match);
  command
      .add_option(
          "--uv-copies", a.uv_copies,
          "Of parts of LOW that have the same UVs, which is baked: plain (copies that are not "
          "mirrored), mirrored, or first (by the order of triangles)")
      ->check(one_of(uv_copies_values()))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option(
          "--triangulate", a.triangulate,
          "How polygons of LOW, HIGH, cage and occluders become triangles; LOW's must be as where "
          "the map is shown. auto: quads from their first corner, larger ones Delaunay; blender: "
          "as Blender 5 draws them; fan: around the first corner; shortest: along the shorter "
          "diagonal")
      ->check(one_of(triangulation_values()))
      ->capture_default_str()
      ->group("The low poly");
  add_mesh_frame_options(command, a.frame, true, "Files of meshes");
  command
      .add_option(
          "--tangents", a.tangents,
          "Tangents of the map: file, LOW's own where its file has them, else MikkTSpace's; or "
          "mikktspace, in any case")
      ->check(one_of({"file", "mikktspace"}))
      ->capture_default_str()
      ->group("The low poly");
  command
      .add_flag(
          "--split-at-seams", a.split_at_seams,
          "Make LOW's UV seams hard edges, so that no gradient runs across them. The LOW that "
          "has them is written beside the maps: use it")
      ->group("The low poly");
  command
      .add_option("--recall", a.recall,
                  "Number of places of HIGH that are checked: is there a texel that stands for "
                  "each? 0: no check")
      ->check(range(0U, 1U << 20))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_flag(
          "--reasons", a.reasons,
          "Also writes NAME_reasons.png: why each texel found its point or none, and says how "
          "many and where")
      ->group(group_match);
  command
      .add_flag("--two-sided", a.two_sided, "Also hit back faces of HIGH (scans of mixed winding)")
      ->group(group_match);
  command
      .add_option(
          "--traversal", a.traversal,
          "Ray kernels for CPUs, for GPUs, or by the device (auto). Maps are the same to the bit")
      ->check(one_of(traversal_values()))
      ->capture_default_str()
      ->group(group_match);
  Option* save = command.add_option("--save-match", a.save_match, "Write the correspondence (EXR)")
                     ->group(group_match);
  command
      .add_option("--load-match", a.load_match, "Use a saved correspondence instead of matching")
      ->excludes(save)
      ->group(group_match);
  command
      .add_flag(
          "--force-uv", a.force_uv,
          "--match uv: bake even where HIGH's UV triangles overlap much or the layouts disagree")
      ->group(group_match);
}

}  // namespace kiln::cli

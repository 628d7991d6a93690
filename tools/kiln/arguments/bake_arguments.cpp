#include "arguments/bake_arguments.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <map>
#include <tuple>

#include "arguments/likelihoods.h"
#include "arguments/parse.h"

namespace kiln::cli {
namespace {

const std::map<std::string, NormalMapSpace> kSpaces = {{"tangent", NormalMapSpace::tangent},
                                                       {"object", NormalMapSpace::object},
                                                       {"face", NormalMapSpace::face}};
const std::map<std::string, MissPolicy> kMisses = {
    {"keep", MissPolicy::keep}, {"fill", MissPolicy::fill}, {"mark", MissPolicy::mark}};
const std::map<std::string, RayTraversal> kTraversals = {
    {"auto", RayTraversal::automatic}, {"cpu", RayTraversal::cpu}, {"gpu", RayTraversal::gpu}};
constexpr const char* kAutomatic = "auto";

/// Of `kiln bake`: all of them.
std::vector<std::string> bake_match_names() {
  std::vector<std::string> names = {kAutomatic};
  for (const MatchInfo& match : matches()) names.emplace_back(match.method.name);
  return names;
}

std::vector<std::string> map_names() {
  std::vector<std::string> names;
  for (const MapInfo& map : maps()) names.emplace_back(map.kind.name);
  return names;
}

/// "normal: ...; mask: ...".
std::string maps_in_words() {
  std::string text;
  for (const MapInfo& map : maps()) {
    text += (text.empty() ? "" : "; ") + std::string(map.kind.name) + ": " + std::string(map.holds);
  }
  return text;
}

std::string matches_in_words() {
  std::string text;
  for (const MatchInfo& match : matches()) {
    text += std::string(match.method.name) + ": " + std::string(match.searches) + "; ";
  }
  return text;
}
const std::map<std::string, VisibilityAt> kVisibilityAt = {
    {"face", VisibilityAt::face}, {"vertex", VisibilityAt::vertex}, {"texel", VisibilityAt::texel}};
const std::map<std::string, VisibilityTest> kVisibilityTests = {{"auto", VisibilityTest::automatic},
                                                                {"views", VisibilityTest::views},
                                                                {"rays", VisibilityTest::rays}};
const std::map<std::string, ViewLikelihood> kLikelihoods = {
    {"all", ViewLikelihood::all}, {"horizon", ViewLikelihood::horizon}, {"up", ViewLikelihood::up}};
const std::map<std::string, ViewCriterion> kCriteria = {{"depth", ViewCriterion::depth},
                                                        {"distance", ViewCriterion::distance},
                                                        {"angle", ViewCriterion::angle}};
const std::map<std::string, ImageFormat> kFormats = {{"exr", ImageFormat::exr_half},
                                                     {"exr32", ImageFormat::exr_float},
                                                     {"png16", ImageFormat::png16},
                                                     {"png8", ImageFormat::png8}};

template <typename T>
CLI::Validator one_of(const std::map<std::string, T>& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  return CLI::IsMember(names, CLI::ignore_case);
}

/// A value as it is written on the command line.
template <typename T>
std::string name_of(const std::map<std::string, T>& values, T wanted) {
  for (const auto& [name, value] : values) {
    if (value == wanted) return name;
  }
  throw Error(ErrorCode::internal, "An option's value has no name.");
}

/// What --fallback can end with: other ways to say --miss.
const std::map<std::string, MissPolicy> kFallbackMisses = {
    {"low", MissPolicy::keep}, {"fill", MissPolicy::fill}, {"none", MissPolicy::mark}};

std::vector<std::string> fallback_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (match.may_follow) names.emplace_back(match.method.name);
  }
  for (const auto& [name, value] : kFallbackMisses) names.push_back(name);
  return names;
}

/// What the chain of fallbacks says of misses at its end, or else --miss.
MissPolicy miss_policy(const BakeArguments& a) {
  const auto said = kFallbackMisses.find(a.fallback.back());
  return said != kFallbackMisses.end() && said->second != MissPolicy::keep ? said->second
                                                                           : kMisses.at(a.miss);
}

/// The matches that are asked in turn for what the match leaves undecided.
std::vector<MatchMethod> fallback_methods(const BakeArguments& a) {
  std::vector<MatchMethod> methods;
  for (const std::string& name : a.fallback) {
    if (!kFallbackMisses.contains(name)) methods.push_back(find_match(name).method);
  }
  return methods;
}

/// Whether a match is the one asked for, or one of its fallbacks.
bool matches_by(const BakeArguments& a, MatchMethod method) {
  return a.match == method.name ||
         std::find(a.fallback.begin(), a.fallback.end(), method.name) != a.fallback.end();
}

/// \throws Error(usage) for a chain of fallbacks that asks a match twice, or goes on after its end
void check_fallback(const BakeArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  std::vector<std::string> asked = {a.match};
  for (std::size_t i = 0; i < a.fallback.size(); ++i) {
    const std::string& name = a.fallback[i];
    if (std::find(asked.begin(), asked.end(), name) != asked.end()) {
      fail("--fallback " + name + " leaves the same samples undecided as before: name each match once.");
    }
    if (kFallbackMisses.contains(name) && i + 1 != a.fallback.size()) {
      fail("--fallback " + name + " decides all that is left: nothing can follow it.");
    }
    asked.push_back(name);
  }
  if (miss_policy(a) != kMisses.at(a.miss) && a.miss != "keep") {
    fail("--fallback " + a.fallback.back() + " is another --miss than " + a.miss +
         ": leave one of them out.");
  }
  if (!a.load_match.empty() && a.fallback != BakeArguments().fallback) {
    fail("--fallback is for matching, but --load-match takes a match as it is: leave one out.");
  }
  if (a.fallback_blend != 0 && fallback_methods(a).empty()) {
    fail("--fallback-blend needs a --fallback that finds points: ray, closest or views.");
  }
}

/// Percent, 0 to 100.
CLI::Validator percentage() {
  return CLI::Validator(
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

void add_bake_options(CLI::App& command, BakeArguments& a) {
  command
      .add_option("HIGH", a.high,
                  "The dense mesh (PLY, OBJ, STL, OFF), or a height field (PNG, EXR)")
      ->required();
  command.add_option("LOW", a.low,
                     "The light mesh, with UVs; left out, Kiln makes one from HIGH (of a height "
                     "field a plane, or with --faces or --max-error a simplified one)");
  command
      .add_option("--out", a.out, "Folder for the maps (made where only its last part is missing)")
      ->required();

  const char* const group_map = "The map";
  command.add_option("--size", a.size, "Texels: one side, or WxH, 1 to 16384")
      ->capture_default_str()
      ->group(group_map);
  command.add_option("--maps", a.maps, "Which maps, separated by commas. " + maps_in_words())
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(map_names(), CLI::ignore_case))
      ->capture_default_str()
      ->group(group_map);
  command
      .add_option("--curvature-radius", a.curvature_radius,
                  "The map curvature is the mean over the surface this near: world units, or P% of "
                  "HIGH's diagonal (default 0.5%)")
      ->group(group_map);
  command
      .add_option("--space", a.space,
                  "Of the normals: tangent (MikkTSpace), object, or each face's own")
      ->check(one_of(kSpaces))
      ->capture_default_str()
      ->group(group_map);
  command.add_flag("--flip-y", a.flip_y, "Green points down (DirectX); the default is up (OpenGL)")
      ->group(group_map);
  command
      .add_flag("--two-component", a.two_component,
                "Leave out the third component: z = sqrt(1-x^2-y^2)")
      ->group(group_map);
  command.add_option("--format", a.format, "png16, png8, exr (half) or exr32 (float)")
      ->check(one_of(kFormats))
      ->capture_default_str()
      ->group(group_map);
  command.add_flag("--dither", a.dither, "png8: ordered dither instead of rounding")
      ->group(group_map);
  command.add_flag("--raw", a.raw, "EXR: components in [-1, 1] instead of n/2 + 1/2")
      ->group(group_map);
  command.add_option("--samples", a.samples, "N: N x N samples a texel, averaged")
      ->check(CLI::Range(1U, 16U))
      ->capture_default_str()
      ->group(group_map);
  command.add_option("--gutter", a.gutter, "Texels filled around charts, or inf")
      ->capture_default_str()
      ->group(group_map);
  command
      .add_flag("--mips", a.mips,
                "Also the mip-maps, filtered within charts. EXR: in the map's file (tiled). PNG: "
                "NAME_MAP.mip01.png and so on down to 1x1, which sort in the order that toktx and "
                "ktx create take them")
      ->group(group_map);

  const char* const group_match = "The match";
  command
      .add_option(
          "--match", a.match,
          "Which point of HIGH a texel stands for. " + matches_in_words() +
              "auto: the cheapest way and the smallest map (up to --size) that reach --max-error")
      ->check(CLI::IsMember(bake_match_names(), CLI::ignore_case))
      ->each([&a](const std::string&) { a.match_given = true; })
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option("--fallback", a.fallback,
                  "What decides samples that the match leaves undecided: other matches, asked in "
                  "turn, as in ray,closest. At the end of the chain low (LOW's normal; such samples "
                  "count as missed), fill (the map around them, as --miss fill), or none (marked, as "
                  "--miss mark)")
      ->delimiter(',')
      ->check(CLI::IsMember(fallback_names(), CLI::ignore_case))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option("--fallback-blend", a.fallback_blend,
                  "TEXELS: this near to what the fallback decided, the match's normals blend into "
                  "the fallback's, so that the map has no step")
      ->check(CLI::Range(0U, 256U))
      ->capture_default_str()
      ->group(group_match);
  command
      .add_option(
          "--max-distance", a.max_distance,
          "How far to look each way: world units, or P% of HIGH's diagonal (default 2%); with a "
          "cage, the ray's length from the cage inward (default: twice the cage)")
      ->group(group_match);
  CLI::Option* cage =
      command
          .add_option(
              "--cage", a.cage,
              "Cast from this far outside, inward, first hit: D or P%. For parts that float, "
              "intersect or lie on the surface")
          ->group(group_match);
  command.add_option("--cage-mesh", a.cage_mesh, "Cast from this mesh, which has LOW's triangles")
      ->excludes(cage)
      ->group(group_match);
  command
      .add_flag("--two-sided", a.two_sided, "Also hit back faces of HIGH (scans of mixed winding)")
      ->group(group_match);
  command
      .add_option("--miss", a.miss,
                  "Where nothing is found: keep LOW's normal, fill from around, or mark")
      ->check(one_of(kMisses))
      ->capture_default_str()
      ->group(group_match);
  command.add_option("--traversal", a.traversal, "Ray kernels: the same answer to the bit")
      ->check(one_of(kTraversals))
      ->capture_default_str()
      ->group(group_match);
  CLI::Option* save =
      command.add_option("--save-match", a.save_match, "Write the correspondence (EXR)")
          ->group(group_match);
  command
      .add_option("--load-match", a.load_match, "Use a saved correspondence instead of matching")
      ->excludes(save)
      ->group(group_match);

  const char* const group_views = "The depth views (--match views)";
  command
      .add_option("--views", a.views,
                  "N directions, spread evenly, or auto: chosen by what they see (default: 12; 1 "
                  "where both meshes are height fields)")
      ->group(group_views);
  command
      .add_option("--view", a.view,
                  "X,Y,Z: a view of your own, from the mesh to the viewer, beside the --views; may "
                  "be given "
                  "again (--views 0: only your own)")
      ->group(group_views);
  command
      .add_option("--view-size", a.view_size,
                  "Pixels a side of a view (default: by the density of HIGH, up to two a sample)")
      ->check(CLI::Range(16U, 8192U))
      ->group(group_views);
  command
      .add_option("--view-criterion", a.view_criterion,
                  "Which view decides a sample: the least depth difference, the least true "
                  "distance, or the best angle")
      ->check(one_of(kCriteria))
      ->capture_default_str()
      ->group(group_views);
  command
      .add_flag("--no-view-refine", a.no_view_refine,
                "Keep the point on the view's line (as in the paper) instead of moving it to the "
                "normal's")
      ->group(group_views);

  const char* const group_visibility = "Visibility (--match visibility, hybrid)";
  command
      .add_option("--visibility-at", a.visibility_at,
                  "Where directions are gathered: face (averaged at vertices), vertex or texel "
                  "(smoothed, across seams too)")
      ->check(one_of(kVisibilityAt))
      ->capture_default_str()
      ->group(group_visibility);
  command.add_option("--directions", a.directions, "How many directions look at LOW, 1 to 4096")
      ->check(CLI::Range(1U, 4096U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--visibility-test", a.visibility_test,
                  "What finds out what they see: views (pictures of LOW), rays (exact), or auto: "
                  "rays for vertices, else views")
      ->check(one_of(kVisibilityTests))
      ->capture_default_str()
      ->group(group_visibility);
  command.add_option("--visibility-size", a.visibility_size, "Pixels a side of these pictures")
      ->check(CLI::Range(16U, 2048U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--visibility-smooth", a.visibility_smooth,
                  "Rounds of smoothing texels' directions, 3 x 3 texels each")
      ->check(CLI::Range(0U, 256U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--view-weight", a.view_weight,
                  "From where LOW will be looked at: all, horizon, up (+Y), or a file with a line "
                  "\"X Y Z WEIGHT\" a direction to the viewer; each of --directions takes the "
                  "weight of the line nearest to it")
      ->capture_default_str()
      ->group(group_visibility);

  command
      .add_option("--visibility-clusters", a.visibility_clusters,
                  "K: with --match visibility, K maps (NAME_normal, NAME_normal_1, ...): where the "
                  "directions that see a texel scatter, a map for each cluster of them. "
                  "NAME_clusters.exr has the clusters' directions: use the map of the one that is "
                  "nearest to the view")
      ->check(CLI::Range(1U, 4U))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_option("--visibility-deviation", a.visibility_deviation,
                  "Standard deviation of directions, 0 to 1, above which they are parted into "
                  "clusters; that of an open plane is 0.745")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group_visibility);
  command
      .add_flag(
          "--force-uv", a.force_uv,
          "--match uv: bake even where HIGH's UV triangles overlap much or the layouts disagree")
      ->group(group_match);

  const char* const group_heights = "The height field (HIGH is a PNG or EXR; --match is uv then)";
  add_height_options(command, a.heights, group_heights);

  const char* const group_low = "The light mesh";
  command.add_option("--faces", a.faces, "Without LOW: simplify HIGH to N triangles")
      ->check(CLI::Range(1U, 100000000U))
      ->group(group_low);
  command
      .add_option("--max-error", a.max_error,
                  "Without LOW and --faces: few triangles that stay within this share of the "
                  "diagonal (default 0.2%). With --match auto: the mean angle in degrees between "
                  "rendered normals and the dense mesh's that is to be reached (default: what the "
                  "largest map would reach)")
      ->group(group_low);
  command.add_flag("--unwrap", a.unwrap, "Give LOW new UVs, and write it beside the maps")
      ->group(group_low);

  const char* const group_run = "The run";
  command
      .add_option("--max-missed", a.max_missed_percent,
                  "Exit with 1 where more than P percent of the samples are missed")
      ->check(percentage())
      ->group(group_run);
  command.add_flag("--force", a.force, "Write over a light mesh that Kiln did not write")
      ->group(group_run);
  command
      .add_option("--device", a.device,
                  "OpenCL device: index or part of its name (see kiln devices)")
      ->group(group_run);
  command.add_option("--json", a.json, "Write a report to this file, or - for standard output")
      ->group(group_run);
  command.add_flag("--quiet", a.quiet, "Print nothing but errors")->group(group_run);
}

bool by_visibility(const BakeArguments& a) {
  return a.load_match.empty() && (matches_by(a, MatchMethod::visibility) || matches_by(a, MatchMethod::hybrid));
}

void check(const BakeArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  const bool automatic = a.match == "auto";
  if (automatic && !a.load_match.empty()) {
    fail(
        "--match auto chooses how to match, but --load-match takes a match as it is: leave one "
        "out.");
  }
  if (automatic && std::find(a.maps.begin(), a.maps.end(), "normal") == a.maps.end()) {
    fail("--match auto measures normal maps: add normal to --maps.");
  }
  if (!automatic && a.faces != 0 && !a.max_error.empty()) {
    fail("--faces and --max-error both say how light the mesh is to be: leave one of them out.");
  }
  if (!a.low.empty() && (a.faces != 0 || (!a.max_error.empty() && !automatic))) {
    fail("--faces and --max-error are for making a light mesh, but LOW '" + a.low +
         "' was given: leave one of them out.");
  }
  if (a.low.empty() && a.unwrap) {
    fail("--unwrap is for a given LOW; a light mesh that Kiln makes is always unwrapped.");
  }
  if (a.low.empty() && !a.cage_mesh.empty()) {
    fail("--cage-mesh needs the LOW that it belongs to.");
  }
  const bool views = matches_by(a, MatchMethod::views);
  const bool by_direction = matches_by(a, MatchMethod::axis);
  if (!views && (!a.views.empty() || a.view_size != 0 || (!by_direction && !a.view.empty()))) {
    fail("--views, --view and --view-size are for --match views.");
  }
  if (by_direction && a.view.size() != 1) {
    fail("--match axis looks along one direction: give one --view, such as 0,0,1.");
  }
  const BakeArguments defaults;
  if (!by_visibility(a) &&
      (a.visibility_at != defaults.visibility_at || a.directions != defaults.directions ||
       a.visibility_test != defaults.visibility_test ||
       a.visibility_size != defaults.visibility_size ||
       a.visibility_smooth != defaults.visibility_smooth ||
       a.visibility_clusters != defaults.visibility_clusters ||
       a.visibility_deviation != defaults.visibility_deviation ||
       a.view_weight != defaults.view_weight)) {
    fail(
        "--visibility-..., --directions and --view-weight are for --match visibility and "
        "--match hybrid, or such a --fallback.");
  }
  if (a.visibility_clusters > 1 && (a.match != "visibility" || a.visibility_at != "texel")) {
    fail("--visibility-clusters is for --match visibility with --visibility-at texel.");
  }
  if (a.visibility_at != "texel" && a.visibility_smooth != defaults.visibility_smooth) {
    fail("--visibility-smooth is for --visibility-at texel.");
  }
  if (a.visibility_test == "rays" && a.visibility_size != defaults.visibility_size) {
    fail(
        "--visibility-size is for pictures, but --visibility-test rays takes none: leave one out.");
  }
  if (a.visibility_clusters == 1 && a.visibility_deviation != defaults.visibility_deviation) {
    fail("--visibility-deviation is for --visibility-clusters 2 and more.");
  }
  if (a.visibility_clusters > 1 && !a.save_match.empty()) {
    fail("--visibility-clusters makes several matches, --save-match saves one: leave one out.");
  }
  check_fallback(a);
  if (is_height_field(a.high)) {
    if (a.low.empty() && a.unwrap) fail("--unwrap is for a given LOW.");
    height_field_options(a.heights);
    const bool far = !a.max_distance.empty() || !a.cage.empty() || !a.cage_mesh.empty();
    if (onto_plane(a) && a.match != "uv" && !automatic && a.load_match.empty() && !far) {
      fail(
          "Without LOW and --faces a height field is baked onto a plane at height 0, from which "
          "--match " +
          a.match +
          " looks for heights no further than 2% of the diagonal: leave --match out (points are "
          "then taken at the same UV), or give --faces N, a LOW of yours, or a --max-distance "
          "beyond the heights.");
    }
  } else if (a.heights.given()) {
    fail("--height and --extent are for a HIGH that is a height field, a PNG or EXR.");
  }
  if (a.match != "uv" && a.force_uv) fail("--force-uv is for --match uv.");
  if (a.match == "uv" && fallback_methods(a).empty() && !a.max_distance.empty()) {
    fail("--max-distance is for searching, but --match uv does not search: leave one out.");
  }
  if (!a.load_match.empty() && (a.match_given || a.force_uv)) {
    fail("--load-match takes a match as it is: leave --match and --force-uv out.");
  }
  if (!automatic && !matches_by(a, MatchMethod::ray) &&
      (!a.cage.empty() || !a.cage_mesh.empty())) {
    fail("A cage is for rays: with --match " + a.match + " it needs --fallback ray.");
  }
  if (a.raw && !is_exr(image_options(a)))
    fail("--raw writes negative values, which PNG cannot hold: add --format exr.");
  if (a.dither && a.format != "png8") fail("--dither is for --format png8.");
  if (!a.curvature_radius.empty() &&
      std::find(a.maps.begin(), a.maps.end(), "curvature") == a.maps.end()) {
    fail("--curvature-radius is for the map curvature: add it to --maps.");
  }
}

BakeOptions bake_options(const BakeArguments& a) {
  BakeOptions options;
  std::tie(options.width, options.height) = parse_size(a.size);
  options.samples = a.samples;
  options.maps.clear();
  for (const std::string& name : a.maps) {
    const MapKind kind = find_map(name).kind;
    if (std::find(options.maps.begin(), options.maps.end(), kind) == options.maps.end()) {
      options.maps.push_back(kind);
    }
  }
  if (a.match != kAutomatic) options.method = find_match(a.match).method;
  options.views.criterion = kCriteria.at(a.view_criterion);
  options.fallback = fallback_methods(a);
  options.fallback_blend = a.fallback_blend;
  options.visibility.at = kVisibilityAt.at(a.visibility_at);
  options.visibility.test = kVisibilityTests.at(a.visibility_test);
  options.visibility.directions = a.directions;
  options.visibility.view_size = a.visibility_size;
  options.visibility.smoothing = a.visibility_smooth;
  options.visibility.clusters = a.visibility_clusters;
  options.visibility.cluster_deviation = a.visibility_deviation;
  if (const auto known = kLikelihoods.find(a.view_weight); known != kLikelihoods.end()) {
    options.visibility.likelihood = known->second;
  } else {
    options.visibility.likelihood = ViewLikelihood::list;
    options.visibility.likelihoods = load_likelihoods(a.view_weight);
  }
  options.views.size = a.view_size;
  options.views.refine = !a.no_view_refine;
  for (const std::string& view : a.view) options.views.directions.push_back(parse_direction(view));
  if (a.views == "auto") {
    options.views.automatic = true;
  } else if (!a.views.empty()) {
    options.views.count = parse_views(a.views);
  }
  if (!a.max_distance.empty()) {
    options.max_distance = parse_length("--max-distance", a.max_distance);
    if (options.max_distance->value == 0) {
      throw Error(ErrorCode::usage, "--max-distance is 0: rays that reach nowhere find nothing.");
    }
  }
  if (!a.curvature_radius.empty()) {
    options.curvature_radius = parse_length("--curvature-radius", a.curvature_radius);
    if (options.curvature_radius->value == 0) {
      throw Error(ErrorCode::usage,
                  "--curvature-radius is 0: a surface bends over some way, so give it one.");
    }
  }
  if (a.force_uv) {
    options.uv.max_overlap = options.uv.max_distance = std::numeric_limits<double>::infinity();
  }
  if (!a.cage.empty()) options.cage = parse_length("--cage", a.cage);
  options.two_sided = a.two_sided;
  options.space = kSpaces.at(a.space);
  options.flip_y = a.flip_y;
  options.two_component = a.two_component;
  options.raw = a.raw;
  options.miss = miss_policy(a);
  options.gutter = parse_gutter(a.gutter);
  options.mips = a.mips;
  options.keep_match = !a.save_match.empty();
  return options;
}

SaveImageOptions image_options(const BakeArguments& a) {
  SaveImageOptions options;
  options.format = kFormats.at(a.format);
  options.dither = a.dither;
  return options;
}

RayTraversal traversal(const BakeArguments& a) { return kTraversals.at(a.traversal); }

std::string map_name(MapKind kind) { return std::string(kind.name); }
std::string match_name(MatchMethod method) { return std::string(method.name); }
MatchMethod match_method(const std::string& name) { return find_match(name).method; }
std::vector<std::string> match_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (!match.needs_direction) names.emplace_back(match.method.name);
  }
  return names;
}
std::string chain_name(const std::vector<MatchMethod>& fallback) {
  std::string names;
  for (const MatchMethod next : fallback) names += (names.empty() ? "" : ",") + match_name(next);
  return names.empty() ? "low" : names;
}
std::string criterion_name(ViewCriterion criterion) { return name_of(kCriteria, criterion); }

bool onto_plane(const BakeArguments& a) {
  // With --match auto the error is one of normals.
  const bool simplified = a.faces != 0 || (!a.max_error.empty() && a.match != kAutomatic);
  return is_height_field(a.high) && a.low.empty() && !simplified;
}

bool is_exr(const SaveImageOptions& options) {
  return options.format == ImageFormat::exr_half || options.format == ImageFormat::exr_float;
}

std::string extension(const SaveImageOptions& options) { return is_exr(options) ? ".exr" : ".png"; }

std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options) {
  std::vector<std::filesystem::path> files = {folder / (name + extension(options))};
  for (std::size_t level = 1; level <= mips && !is_exr(options); ++level) {
    const std::string number = (level < 10 ? "0" : "") + std::to_string(level);
    files.push_back(folder / (name + ".mip" + number + extension(options)));
  }
  return files;
}

Json describe(const BakeArguments& a, const BakeReport& report) {
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  return {{"size", a.size},
          {"maps", a.maps},
          {"curvature_radius", or_null(a.curvature_radius)},
          {"match", a.load_match.empty() ? a.match : "loaded"},
          {"views", matches_by(a, MatchMethod::views)
                        ? Json(a.views.empty() ? "default" : a.views)
                        : Json()},
          {"view", a.view},
          {"view_size", report.views ? Json(report.views->size) : Json()},
          {"view_criterion", report.views ? Json(a.view_criterion) : Json()},
          {"view_refine", report.views ? Json(!a.no_view_refine) : Json()},
          {"visibility_at", by_visibility(a) ? Json(a.visibility_at) : Json()},
          {"visibility_test",
           report.visibility ? Json(report.visibility->by_rays ? "rays" : "views") : Json()},
          {"directions", by_visibility(a) ? Json(a.directions) : Json()},
          {"visibility_size", by_visibility(a) ? Json(a.visibility_size) : Json()},
          {"visibility_smooth", by_visibility(a) ? Json(a.visibility_smooth) : Json()},
          {"visibility_clusters", by_visibility(a) ? Json(a.visibility_clusters) : Json()},
          {"visibility_deviation", by_visibility(a) ? Json(a.visibility_deviation) : Json()},
          {"view_weight", by_visibility(a) ? Json(a.view_weight) : Json()},
          {"fallback", a.load_match.empty() ? Json(a.fallback) : Json()},
          {"fallback_blend", a.fallback_blend},
          {"max_distance", or_null(a.max_distance)},
          {"max_distance_world", report.max_distance},
          {"cage", or_null(a.cage)},
          {"cage_mesh", or_null(a.cage_mesh)},
          {"two_sided", a.two_sided},
          {"miss", name_of(kMisses, miss_policy(a))},
          {"force_uv", a.force_uv},
          {"height", is_height_field(a.high) ? Json(a.heights.height) : Json()},
          {"extent", or_null(a.heights.extent)},
          {"traversal", a.traversal},
          {"space", a.space},
          {"flip_y", a.flip_y},
          {"two_component", a.two_component},
          {"format", a.format},
          {"raw", a.raw},
          {"dither", a.dither},
          {"samples", a.samples},
          {"gutter", a.gutter},
          {"mips", a.mips},
          {"faces", a.faces == 0 ? Json() : Json(a.faces)},
          {"max_error", or_null(a.max_error)},
          {"max_missed_percent", a.max_missed_percent},
          {"unwrap", a.unwrap},
          {"save_match", or_null(a.save_match)},
          {"load_match", or_null(a.load_match)}};
}

}  // namespace kiln::cli

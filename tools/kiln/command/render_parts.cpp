#include "command/render_parts.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include "job/check_result.h"
#include "job/job_options.h"
#include "job/match_inputs.h"
#include "kiln/cage.h"
#include "kiln/limits.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "options/parse.h"
#include "picture/canvas.h"
#include "picture/view_arguments.h"

namespace kiln::cli {
namespace {

/// Flags of mesh input; giving one does not request a bake.
const std::set<std::string> kMeshInputFlags = {
    "--high", "--low",    "--triangulate",   "--split-at-seams", "--up",
    "--unit", "--uv-set", "--allow-outside", "--tangents",       "--high-normals"};

/// Flags that affect a cage: kCageFlags affect any cage, kAutomaticCageFlags only one that Kiln computes.
const std::set<std::string> kCageFlags = {"--cage", "--cage-mesh"};
const std::set<std::string> kAutomaticCageFlags = {"--direction",  "--edge-width", "--max-distance",
                                                   "--match-by",   "--match-list", "--low-names",
                                                   "--high-names", "--two-sided"};

void check_drawn_cage(const RenderArguments& arguments) {
  const Job& bake = arguments.bake;
  if (!arguments.draw_cage) return;
  refuse_if(!bake.cage_auto && !bake.bake.match.cage && bake.cage_mesh.empty(),
            "--draw-cage draws the cage of --cage or --cage-mesh: add one of them.");
  for (const std::string& flag : bake.given) {
    const bool affects_map = kMeshInputFlags.contains(flag) || kCageFlags.contains(flag) ||
                             (bake.cage_auto && kAutomaticCageFlags.contains(flag));
    if (affects_map || arguments.map_size_given) continue;
    fail_usage(flag +
               " does not affect the cage that --draw-cage draws: leave it out, or add --map-size "
               "N to bake a map with it as well.");
  }
}

}  // namespace

bool requests_baked_map(const RenderArguments& arguments) {
  return arguments.map_size_given ||
         (!arguments.draw_cage &&
          std::any_of(arguments.bake.given.begin(), arguments.bake.given.end(),
                      [](const std::string& flag) { return !kMeshInputFlags.contains(flag); }));
}

Job bake_job_of(const RenderArguments& arguments) {
  Job bake = arguments.bake;
  set_first_input(bake.high, arguments.reference);
  set_first_input(bake.low.given, arguments.mesh);
  bake.heights = arguments.heights;
  bake.bake.width = bake.bake.height = arguments.map_size;
  bake.bake.encoding.space = arguments.space;
  bake.bake.encoding.flip_y = arguments.flip_y;
  bake.bake.encoding.bitangent = arguments.bitangent;
  return bake;
}

void check_bake(const RenderArguments& arguments) {
  refuse_if(arguments.reference.empty() && arguments.bake.high.size() > 1,
            "--high names further files of --reference: add --reference.");
  check_drawn_cage(arguments);
  const auto& given = arguments.bake.given;
  refuse_if(given.contains("--high-normals") && arguments.reference.empty(),
            "--high-normals chooses the normals of --reference: add --reference HIGH.");
  refuse_if(
      given.contains("--tangents") && !requests_baked_map(arguments) && arguments.normal.empty(),
      "--tangents is for a normal map: add --normal MAP.");
  if (arguments.draw_cage && !arguments.reference.empty())
    check_resolved_job(bake_job_of(arguments));
  if (!requests_baked_map(arguments)) return;
  if (arguments.reference.empty() || !arguments.normal.empty()) {
    const auto flag = std::find_if(given.begin(), given.end(), [](const std::string& name) {
      return !kMeshInputFlags.contains(name);
    });
    const bool cage = given.contains("--cage") || given.contains("--cage-mesh");
    fail_usage((arguments.map_size_given ? "--map-size" : *flag) +
               " affects a map that is baked for the picture: add --reference HIGH, and leave "
               "--normal out." +
               (cage ? " --draw-cage draws a cage, and bakes nothing." : ""));
  }
  check_resolved_job(bake_job_of(arguments));
}

Image bake_map(const RenderArguments& arguments, const Device& device, const HighPolyInput& dense,
               const Mesh& mesh, std::vector<Warning>& warnings) {
  const Job bake_as = bake_job_of(arguments);
  MatchInputs inputs;
  inputs.read_with_match(bake_as, dense.mesh, mesh, warnings);
  inputs.find_cage(bake_as, device, dense.mesh, mesh, warnings);
  BakeOptions options = options_of(bake_as);
  options.match.uv = uv_options(dense, options.match.uv);
  options.report.keep_match = false;
  inputs.apply(options);
  const Source source(device, dense.mesh, bake_as.traversal);
  BakeResult result = bake(source, mesh, options);
  check_result(result.report, dense.mesh, mesh);
  warnings.insert(warnings.end(), result.report.warnings.begin(), result.report.warnings.end());
  return std::move(result.maps[0].image);
}

Image join(std::vector<Image> panels) {
  if (panels.size() == 1) return std::move(panels.front());
  const std::uint32_t gap = std::max(1U, panels[0].width / 256);
  Image sheet;
  sheet.channels = 3;
  for (const Image& panel : panels) {
    sheet.width += panel.width + (sheet.width == 0 ? 0 : gap);
    sheet.height = std::max(sheet.height, panel.height);
  }
  sheet.pixels.assign(std::size_t{sheet.width} * sheet.height * 3, 1.0F);
  std::size_t column_offset = 0;
  for (const Image& panel : panels) {
    for (std::size_t y = 0; y < panel.height; ++y) {
      std::copy_n(panel.at(0, y), std::size_t{panel.width} * 3, sheet.at(column_offset, y));
    }
    column_offset += panel.width + gap;
  }
  return sheet;
}

void require_pictures(const PictureGeometry& size, std::uint64_t count) {
  constexpr std::uint64_t kBytesOfWriter =
      2;  // bytes per pixel during compression: 36 MiB were measured for 4096 x 4096
  const std::uint64_t bytes =
      bytes_of(size, count) + std::uint64_t{size.width} * size.height * kBytesOfWriter;
  const std::uint64_t remaining_bytes = memory_left();
  if (bytes <= remaining_bytes) return;
  const auto format_mebibytes = [](std::uint64_t b) { return std::to_string(b >> 20) + " MiB"; };
  throw Error(ErrorCode::internal,
              "Pictures of " + std::to_string(size.width) + "x" + std::to_string(size.height) +
                  " pixels would take " + format_mebibytes(bytes) + " of memory, but only " +
                  format_mebibytes(remaining_bytes) +
                  " are left of the memory limit. Use a smaller " + option("size") +
                  " or fewer pictures, or raise "
                  "the " +
                  option("memory_limit") + ".");
}

std::vector<ViewAngles> list_measured_views(const RenderOptions& options) {
  return {{options.azimuth_degrees, options.elevation_degrees},
          {0, 0},
          {90, 0},
          {180, 0},
          {270, 0},
          {0, 90},
          {0, -90}};
}

/// Measures the low poly's deviation from the reference in list_measured_views(), prints it, and returns it for the report.
/// The resolution is independent of the picture's size.
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map) {
  const std::vector<ViewAngles> views = list_measured_views(options);
  const NormalReference reference(high, frame, views, 512, options.z_up);
  const NormalError without = reference.compare(low, true);
  Json json = {{"views", views.size()}, {"without_map", describe(without)}};
  std::string text;
  if (has_map) {
    const NormalError with_map = reference.compare(low);
    json["with_map"] = describe(with_map);
    text = formatted(
        "rendered normals against the original, %zu views (this one and along the axes): "
        "mean %.2f degrees smooth "
        "without the map, %.2f with it (95%%: %.2f, %.2f)",
        views.size(), without.mean_degrees, with_map.mean_degrees, without.p95_degrees,
        with_map.p95_degrees);
  } else {
    text = formatted(
        "rendered normals against the original, %zu views: mean %.2f degrees (95%%: "
        "%.2f)",
        views.size(), without.mean_degrees, without.p95_degrees);
  }
  console.line(text);
  return json;
}

/// Shows the depth views of --match views (Wang, Froehlich, Goebel 2003, figure 4a).
Image draw_contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options) {
  options.trim = false;
  std::vector<Panel> panels;
  for (const Vec3& toward : spread_views(count)) {
    look_from(toward, options);
    const std::uint64_t other_bytes = bytes_of(scene.geometry(options), count - panels.size() - 1);
    const std::string text = formatted("%zu: %.0f, %.0f", panels.size() + 1,
                                       options.azimuth_degrees, options.elevation_degrees);
    panels.push_back({draw_with_room(scene, options, other_bytes), {text}});
  }
  return make_sheet(panels);
}

/// Measures the low poly's deviation from directions all around. No direction is along an axis, since flat faces seen
/// head-on hide errors.
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up) {
  constexpr std::uint32_t kDirectionsAround = 30, kPixels = 256;
  std::vector<ViewAngles> views;
  for (const Vec3& toward : held_out_views(kDirectionsAround, spread_views(12))) {
    views.push_back(view_angles(toward));
  }
  const NormalReference reference(high, frame, views, kPixels, z_up);
  return {{"views", views.size()},
          {"without_map", describe(reference.compare(low, true))},
          {"with_map", describe(reference.compare(low))}};
}

namespace {

// The map's green counts as inverted if the error with inverted green is below this share of the error with green as
// given.
constexpr double kMaxRatioToInvert = 0.9;
// A map of HIGH's normals reduces the error, apart from rounding. If a map increases it by this factor plus this many
// degrees, it belongs to another HIGH.
constexpr double kMisfitRatio = 1.1, kMisfitDegrees = 1;
constexpr std::uint32_t kPixels = 256;

}  // namespace

void check_green_channel(const Device& device, const Mesh& mesh, NormalMap map, const Scene& high,
                         const Mesh& frame, bool z_up, std::vector<Warning>& warnings) {
  if (map.image == nullptr) return;
  const std::vector<ViewAngles> views = {{40, 25}, {160, -20}, {280, 10}};
  const NormalReference reference(high, frame, views, kPixels, z_up);
  const double given_error = reference.compare(Scene(device, mesh, map)).mean_degrees;
  map.flip_y = !map.flip_y;
  const double inverted = reference.compare(Scene(device, mesh, map)).mean_degrees;
  const double without = reference.compare(Scene(device, mesh, map), true).mean_degrees;
  const bool inverted_green_is_better = inverted < kMaxRatioToInvert * given_error;
  // For a map of another HIGH, inverting green may reduce the error by chance. Only if the inverted map is better than
  // no map, its convention is assumed to be wrong.
  const bool map_increases_error =
      std::min(given_error, inverted) > kMisfitRatio * without + kMisfitDegrees;
  if (map_increases_error ||
      (inverted_green_is_better && !(inverted < kMaxRatioToInvert * without))) {
    const std::string text = formatted(
        "The map does not fit HIGH's normals with either direction of green: rendered normals "
        "deviate by %.2f degrees, without the map by %.2f. It was baked from another HIGH or from "
        "other normals, such as smooth ones at hard edges: bake it again, or give the "
        "--high-normals of that bake.",
        given_error, without);
    warnings.push_back({"map-misfit", text, 1});
    return;
  }
  if (!inverted_green_is_better) return;
  const std::string text = formatted(
      "The map fits HIGH better with green %s: rendered normals then deviate by %.2f degrees "
      "instead of %.2f. %s --flip-y, or bake the map again for the other convention.",
      map.flip_y ? "down (DirectX)" : "up (OpenGL)", inverted, given_error,
      map.flip_y ? "Add" : "Leave out");
  warnings.push_back({"green-flipped", text, 1});
}

namespace {

constexpr Colour kTintColour = {0.98F, 0.62F, 0.16F}, kEdgeColour = {0.62F, 0.27F, 0.02F};
constexpr float kTintOpacity = 0.3F;  // opacity of the cage's colour over the picture
constexpr double kEdgeWidth = 1.5, kEdgeOpacity = 0.9;
constexpr double kEdgeSampleStep = 1;  // distance of samples along an edge, in pixels
// tolerance of depth in pixels, since an edge lies on its own faces
constexpr double kDepthTolerance = 1.5;

/// Returns the outer shell of a cage, with the data that pictures need.
Mesh outer_shell_of(const Mesh& cage) {
  Mesh outer;
  outer.name = cage.name;
  outer.origin = cage.origin;
  outer.positions = cage.positions;
  for (std::size_t t = 0; t < cage.triangles.size(); ++t) {
    const bool inner = !cage.groups.empty() && cage.group_names[cage.groups[t]] == "inner";
    if (!inner) outer.triangles.push_back(cage.triangles[t]);
  }
  return outer;
}

struct ProjectedPoint {
  double x = 0, y = 0, depth = 0;
};

ProjectedPoint project(const PictureGeometry& geometry, const Mesh& mesh, std::uint32_t vertex) {
  const Vec3& p = mesh.positions[vertex];
  const auto at =
      geometry.project({mesh.origin[0] + p.x, mesh.origin[1] + p.y, mesh.origin[2] + p.z});
  return {at[0], at[1], at[2]};
}

/// Draws those parts of an edge that the cage itself does not hide.
void draw_edge(const ProjectedPoint& a, const ProjectedPoint& b, const Image& depth, double behind,
               Canvas& canvas) {
  const double size = std::hypot(b.x - a.x, b.y - a.y);
  if (!std::isfinite(size)) return;
  const auto steps = static_cast<std::size_t>(std::clamp(size / kEdgeSampleStep, 1.0, 65536.0));
  const auto at = [&](std::size_t i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    return ProjectedPoint{a.x + (b.x - a.x) * share, a.y + (b.y - a.y) * share,
                          a.depth + (b.depth - a.depth) * share};
  };
  const auto is_visible = [&](const ProjectedPoint& p) {
    if (!(p.x >= 0 && p.y >= 0 && p.x < depth.width && p.y < depth.height)) return false;
    return p.depth + behind >=
           double{*depth.at(static_cast<std::size_t>(p.x), static_cast<std::size_t>(p.y))};
  };
  for (std::size_t i = 0; i <= steps; ++i) {
    const ProjectedPoint from = at(i);
    if (!is_visible(from)) continue;
    while (i < steps && is_visible(at(i + 1))) ++i;
    const ProjectedPoint to = at(i);
    canvas.line(from.x, from.y, to.x, to.y, kEdgeWidth, kEdgeColour, kEdgeOpacity);
  }
}

}  // namespace

Mesh outer_cage(const Job& arguments, const Device& device, const Mesh& low, const Mesh* high,
                std::vector<Warning>& warnings) {
  if (!arguments.cage_mesh.empty()) {
    return outer_shell_of(
        load_cage(arguments.cage_mesh, low, load_options(arguments, MeshSide::low), &warnings));
  }
  const bool is_auto_cage = arguments.cage_auto;
  const Length length = arguments.bake.match.cage.value_or(Length{});
  refuse_if((is_auto_cage || length.relative) && high == nullptr,
            "--cage " + (is_auto_cage ? kAutomatic : format_length(length)) +
                " depends on HIGH: add --reference HIGH, or give a length in world units.");
  if (is_auto_cage) {
    MatchInputs inputs;
    inputs.read_with_match(arguments, *high, low, warnings);
    inputs.find_cage(arguments, device, *high, low, warnings);
    return outer_shell_of(*inputs.cage_mesh());
  }
  const double unit = length.relative ? Source(device, *high).stats().diagonal : 1;
  return outer_shell_of(offset_cage(low, length.value * unit));
}

CagePicture::CagePicture(const Device& device, Mesh cage)
    : mesh_(std::move(cage)), scene_(device, mesh_) {}

void CagePicture::draw(const Scene& within, const RenderOptions& options, Image& picture) const {
  const Image depth = scene_.draw_depth(options), scene_depth = within.draw_depth(options);
  for (std::size_t i = 0; i < depth.pixels.size(); ++i) {
    if (!(depth.pixels[i] > Scene::kNoDepth) || depth.pixels[i] < scene_depth.pixels[i]) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = picture.pixels[3 * i + c];
      value += kTintOpacity * (kTintColour[c] - value);
    }
  }
  const PictureGeometry geometry = scene_.geometry(options);
  std::vector<ProjectedPoint> projected_vertices;
  projected_vertices.reserve(mesh_.positions.size());
  for (std::uint32_t v = 0; v < mesh_.positions.size(); ++v) {
    projected_vertices.push_back(project(geometry, mesh_, v));
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh_.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  Canvas canvas(std::move(picture));
  for (const auto& [a, b] : edges) {
    draw_edge(projected_vertices[a], projected_vertices[b], depth, kDepthTolerance * geometry.pixel,
              canvas);
  }
  picture = canvas.take();
}

}  // namespace kiln::cli

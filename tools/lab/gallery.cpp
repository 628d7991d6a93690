// Pictures of every way to match, side by side: `kiln gallery HIGH LOW`.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "arguments/bake_job.h"
#include "arguments/files.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/files.h"
#include "kiln/kiln.h"
#include "kiln/render.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "picture/sheet.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// One way to match.
struct Exhibit {
  std::string method;
  Image map;    ///< Normals, tangent space
  Match match;  ///< A sample a texel
};

// ---- where texels land -------------------------------------------------------------------------

using Point = std::array<double, 3>;

constexpr double kCloseUp = 6;
constexpr double kApart = 7;  // pixels between dots, at least
constexpr double kRadius = 1.8;
constexpr Colour kDot = {0.05F, 0.25F, 0.65F};
constexpr float kPale = 0.45F;  // what is left of the picture's own contrast

/// Points of a mesh, in world space, that texels have by a match onto it: those of every texel whose column and row
/// `every` divides.
std::vector<Point> points_on(const Mesh& mesh, const Match& match, std::uint32_t every) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < match.triangle.size(); ++i) {
    if (i / match.width % every != 0 || i % match.width % every != 0) continue;
    if (match.triangle[i] == ~std::uint32_t{0}) continue;
    const Triangle& corners = mesh.triangles[match.triangle[i]];
    const double u = match.u[i], v = match.v[i];
    const Vec3 &a = mesh.positions[corners[0]], &b = mesh.positions[corners[1]],
               &c = mesh.positions[corners[2]];
    const auto at = [&](float Vec3::*axis) {
      return (1 - u - v) * double{a.*axis} + u * double{b.*axis} + v * double{c.*axis};
    };
    points.push_back({mesh.origin[0] + at(&Vec3::x), mesh.origin[1] + at(&Vec3::y),
                      mesh.origin[2] + at(&Vec3::z)});
  }
  return points;
}

/// Pale, so that dots show.
Canvas paper(Image picture) {
  for (float& value : picture.pixels) value = 1 - (1 - value) * kPale;
  return Canvas(std::move(picture));
}

/// In the picture's middle, or as near to it as the mesh is shown.
std::array<double, 3> middle_of(const Scene& scene, const RenderOptions& view) {
  const Image depth = scene.draw_depth(view);
  const PictureGeometry geometry = scene.geometry(view);
  double least = 1e300;
  Point best = geometry.center;
  for (std::uint32_t y = 0; y < depth.height; ++y) {
    for (std::uint32_t x = 0; x < depth.width; ++x) {
      const float toward = *depth.at(x, y);
      if (toward == Scene::kNoDepth) continue;
      const double across = x + 0.5 - depth.width / 2.0, down = y + 0.5 - depth.height / 2.0;
      const double off = across * across + down * down;
      if (off >= least) continue;
      least = off;
      for (std::size_t c = 0; c < 3; ++c) {
        best[c] = geometry.center[c] +
                  geometry.pixel * (geometry.right[c] * across - geometry.up[c] * down) +
                  geometry.toward[c] * double{toward};
      }
    }
  }
  return best;
}

/// Points of the world as dots on a picture: those that nothing hides. \returns how many
std::uint64_t draw_points(const Scene& scene, const RenderOptions& view,
                          const std::vector<std::array<double, 3>>& points, double radius,
                          const Colour& colour, Canvas& canvas) {
  const PictureGeometry geometry = scene.geometry(view);
  const Image depth = scene.draw_depth(view);
  // A point lies as deep as its pixel's middle shows, but for the surface's slope across the pixel.
  constexpr double kSlack = 3;  // pixels
  std::uint64_t count = 0;
  for (const Point& point : points) {
    const auto [x, y, toward] = geometry.project(point);
    if (!(x >= 0 && y >= 0 && x < depth.width && y < depth.height)) continue;
    const float front = *depth.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y));
    if (front == Scene::kNoDepth || toward < double{front} - kSlack * geometry.pixel) continue;
    if (radius > 0) canvas.dot(x, y, radius, colour);
    ++count;
  }
  return count;
}

/// The least step at which texels' dots lie kApart pixels apart on the low poly. \param points  of all texels
std::uint32_t choose_every(const Scene& plain, const RenderOptions& view,
                           const std::vector<Point>& points) {
  const Image depth = plain.draw_depth(view);
  const auto covered =
      static_cast<double>(std::count_if(depth.pixels.begin(), depth.pixels.end(),
                                        [](float value) { return value != Scene::kNoDepth; }));
  Canvas none(depth.width, depth.height);
  const auto shown = static_cast<double>(draw_points(plain, view, points, 0, kWhite, none));
  if (!(covered > 0) || !(shown > 0)) return 1;
  return static_cast<std::uint32_t>(std::max(1.0, std::ceil(kApart / std::sqrt(covered / shown))));
}

/// The sampling pattern (Tarini, Cignoni, Scopigno 2003, figure 5): texels' middles p on the low poly, then
/// F(p) on the high poly for each match.
/// \param view  the pictures', framed; where it shows all of the mesh, the middle of it six times as large
/// \param own  of the low poly onto itself
/// \param drawn  "every", texels between those drawn, and "drawn", how many are on the low poly
Image draw_samples(const Scene& original, const Mesh& high, const Scene& plain, const Mesh& low,
                   const Match& own, RenderOptions view, const std::vector<Exhibit>& exhibits,
                   Json& drawn) {
  if (view.zoom == 1) {
    if (!view.at) view.at = middle_of(plain, view);
    view.zoom = kCloseUp;
  }
  RenderOptions flat = view;
  flat.flat = true;
  const std::uint32_t every = choose_every(plain, view, points_on(low, own, 1));
  Canvas texels = paper(plain.draw(flat));
  const std::uint64_t count =
      draw_points(plain, view, points_on(low, own, every), kRadius, kDot, texels);
  drawn = fields("every drawn", {every, count});
  std::vector<Panel> panels = {{texels.take(), {"texels on the low poly"}}};
  const Image picture = original.draw(view);
  for (const Exhibit& exhibit : exhibits) {
    Canvas canvas = paper(picture);
    draw_points(original, view, points_on(high, exhibit.match, every), kRadius, kDot, canvas);
    panels.push_back({canvas.take(), {exhibit.method + ", on the high poly"}});
  }
  return make_sheet(panels);
}

// ---- the gallery -------------------------------------------------------------------------------

/// Bytes that are held when the last picture is drawn, and not yet when the first is: pictures and sheets, matches
/// with their maps, what bakes leave behind (20 MiB were measured), and the high poly's tree (87 bytes a face of 300,000).
std::uint64_t bytes_to_come(const PictureGeometry& picture, std::uint64_t methods,
                            std::uint64_t texels, std::uint64_t faces) {
  constexpr std::uint64_t kBytesOfFace = 80, kBytesOfBake = 16 << 20,
                          kBytesOfTexel = 4 * sizeof(float) + 1 + 3 * sizeof(float);
  return bytes_of(picture, 2 * methods + 5) + kBytesOfTexel * methods * texels + kBytesOfBake +
         kBytesOfFace * faces;
}

/// Draws and saves all, and adds it to the report. \returns false where progress said stop
/// \throws Error(input) where nothing matches, or a match that was asked for does not do
bool make_gallery(const Device& device, const HighPolyInput& dense, const Mesh& low,
                  const LabArguments& a, RenderOptions view, LabRun& run) {
  const fs::path folder = a.out;
  const auto save = [&](const Image& image, const std::string& name, ImageFormat format) {
    run.outputs.push_back((folder / name).string());
    save_image(image, run.outputs.back(), {format});
  };
  Steps steps(run.within(0.05, 0.95));
  if (!steps.at("preparing the high poly")) return false;
  const Mesh& high = dense.mesh;
  const Source source(device, high);
  run.warnings.insert(run.warnings.end(), source.warnings().begin(), source.warnings().end());
  std::vector<std::string> methods = a.matches;
  std::vector<LeftOut> left_out;
  std::erase_if(methods, [&](const std::string& name) {
    std::optional<LeftOut> left = unfit(find_match(name).method, "--match " + name, source, high,
                                        low, uv_options(dense), a.gave("--match"));
    if (left) left_out.push_back({name, left->reason});
    return left.has_value();
  });
  steps.count = static_cast<double>(methods.size());
  view.frame = &high;
  const Scene original(device, high), plain(device, low);
  const Places places(device, low);
  RenderOptions flat = view;
  flat.flat = true;
  const std::uint64_t to_come =
      bytes_to_come(original.geometry(view), methods.size(), std::uint64_t{*a.size} * *a.size,
                    high.triangles.size());
  std::vector<Panel> panels = {
      {draw_with_room(original, view, to_come),
       {"high poly", plural(high.triangles.size(), "face"), ""}},
      {plain.draw(flat), {"low poly", plural(low.triangles.size(), "face"), ""}}};
  const std::vector<ViewAngles> held_out = usual_held_out_angles();
  AnglePictures angles;
  angles.add(original, plain, view);
  std::vector<Exhibit> exhibits;
  Json figures = Json::array();
  BakeOptions bake_with;
  bake_with.width = bake_with.height = *a.size;
  bake_with.match.max_distance = a.search_distance();
  bake_with.match.uv = uv_options(dense);
  bake_with.report.keep_match = true;
  for (const std::string& method : methods) {
    if (!steps.at("matching by " + method)) return false;
    bake_with.match.method = find_match(method).method;
    bake_with.progress = steps.within(0.6);
    BakeResult baked = bake(source, low, bake_with);
    if (baked.cancelled || !steps.at("drawing")) return false;
    const BakeReport& report = baked.report;
    check_result(report, high, low);
    Exhibit& exhibit = exhibits.emplace_back(
        Exhibit{method, std::move(baked.maps[0].image), std::move(*baked.match)});
    const Scene mapped(device, low, {&exhibit.map});
    angles.add(original, mapped, view);
    const double mean = angles.mean(exhibits.size());
    panels.push_back({mapped.draw(view),
                      {method, "normals off " + fixed_text(mean, 2) + " degrees",
                       plural(report.missed, "texel") + " missed"}});
    save(normal_error_texture(places, original, mapped, high, held_out, *a.size, *a.pixels),
         low.name + "_" + method + "_normal_error.exr", ImageFormat::exr_float);
    figures.push_back(fields("method mean_angle_degrees texels warnings",
                             {method, mean, describe_texels(report), describe(report.warnings)}));
    run.of_settings.insert(run.of_settings.end(), report.warnings.begin(), report.warnings.end());
    steps.done += 1;
  }
  save(make_sheet(panels), "matches.png", ImageFormat::png8);
  const Scale scale = angles.scale();
  std::vector<Panel> errors = {{panels[0].image, {"high poly", ""}}};
  for (std::size_t i = 0; i <= exhibits.size(); ++i) {
    errors.push_back({angles.picture(i, scale),
                      {i == 0 ? "without a map" : exhibits[i - 1].method,
                       "mean " + fixed_text(angles.mean(i), 2) + " degrees"}});
  }
  save(make_sheet(errors, scale), "error.png", ImageFormat::png8);
  bake_with.match.method = nearest_match();
  bake_with.progress = steps.within(0);
  const BakeResult own = bake(Source(device, low), low, bake_with);
  if (own.cancelled) return false;
  Json drawn;
  save(draw_samples(original, high, plain, low, *own.match, view, exhibits, drawn), "samples.png",
       ImageFormat::png8);
  run.report.update(fields("methods left_out samples",
                           {figures, describe_left_out(left_out, "method", &run.lines), drawn}));
  return true;
}

// ---- the command -------------------------------------------------------------------------------

int run_gallery(LabArguments a, const std::vector<OptionRow>& rows) {
  check_mesh_frame(a.frame, {a.high}, {a.low}, {});
  a.search_distance();  // checked before any work
  if (a.matches.empty()) a.matches = match_names();
  RenderOptions view = view_options(a.view, is_height_field(a.high));
  view.size = *a.picture_size;
  const fs::path folder = a.out;
  check_paths({a.high, a.low},
              {folder / "matches.png", folder / "error.png", folder / "samples.png", a.json});
  LabRun run(a);

  const Device device = Device::open(a.device);
  if (!run.console.progress(0, "reading " + a.high)) return kExitCancelled;
  const HighPolyInput dense =
      load_high(a.high, a.heights, run.warnings, load_options(a, MeshSide::high));
  const Mesh low = load_low(a.low, "", run.warnings, load_options(a, MeshSide::low));
  run.lap("load");
  Json options = values_json(rows, &a);
  if (!is_height_field(a.high)) options["height"] = {};
  options.update(describe_view(view));
  run.report.update(
      fields("device inputs options",
             {describe(device.info()),
              fields("high low", {describe(dense.mesh, a.high), describe(low, a.low)}), options}));
  if (!make_gallery(device, dense, low, a, view, run)) return kExitCancelled;
  run.lap("draw");
  return run.end();
}

}  // namespace

Run add_gallery(Command& app) {
  Command* command = name_lab_command(app, "gallery");
  auto a = std::make_shared<LabArguments>();
  a->size = 1024, a->pixels = 512, a->picture_size = 480;
  const OptionRow files[] = {
      {.flag = "HIGH",
       .value = text(KILN_MEMBER(LabArguments, high)),
       .help = "The high poly (" + high_poly_kinds() + ")",
       .required = true},
      {.flag = "LOW",
       .value = text(KILN_MEMBER(LabArguments, low)),
       .help = "The low poly, with UVs",
       .required = true},
      {.flag = "--out",
       .value = text(KILN_MEMBER(LabArguments, out)),
       .help = "Folder for matches.png, error.png, samples.png, and LOW_<match>_normal_error.exr",
       .required = true},
  };
  add_options(*command, files, a.get());
  const std::vector<OptionRow> rows =
      lab_rows({"--match", "--size", "--max-distance", "--picture-size", "--pixels", "--height",
                "--extent", "--triangulate", "--up", "--unit", "--uv-set", "--allow-outside",
                "--device", "--json", "--quiet"});
  add_options(*command, rows, a.get());
  add_options(*command, view_rows<LabArguments>(), a.get());
  return [a, command, rows] {
    a->given = given_flags(*command);
    return run_gallery(*a, rows);
  };
}

}  // namespace kiln::cli

// Pictures of every way to match, side by side: `kiln gallery HIGH LOW`.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "arguments/bake_job.h"
#include "arguments/files.h"
#include "arguments/high_poly_input.h"
#include "arguments/mesh_files.h"
#include "arguments/parse.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/files.h"
#include "kiln/kiln.h"
#include "kiln/render.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "picture/sheet.h"
#include "picture/view_arguments.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

struct GalleryArguments {
  std::string high, low, out, json, device, max_distance = "2%";
  std::vector<std::string> matches;  ///< Empty: all that do for the meshes
  HeightFieldOptions heights;
  LoadMeshOptions load;
  MeshFrameArguments frame;
  ViewArguments view;
  std::uint32_t size = 1024;         ///< Texels a side
  std::uint32_t picture_size = 480;  ///< Pixels of the longer side
  std::uint32_t pixels = 512;        ///< A side of the pictures whose normals are measured
  bool quiet = false;
};

/// One way to match.
struct Exhibit {
  std::string method;
  BakeReport bake;
  Image map;     ///< Normals, tangent space
  Image points;  ///< F(p) of each texel's middle p, object space, from `origin`
  std::array<double, 3> origin{};
  Image offsets;                       ///< F(p) - p
  std::vector<std::uint8_t> coverage;  ///< Of both, per texel: 1 where a point was found
  double mean_degrees = 0;             ///< Of rendered normals, from the pictures' view
  Image error;                         ///< Of the normal, per texel; see normal_error_texture()
};

struct Gallery {
  std::vector<Exhibit> exhibits;
  std::vector<LeftOut> left_out;
  std::vector<Warning> warnings;
  Image matches;  ///< Original, low poly and each match (Tarini et al. 2003, figures 7 and 8)
  Image error;    ///< Where each match's normals differ (Wang et al. 2003, figure 4b)
  Image samples;  ///< Where texels' points land on the high poly (Tarini et al., figure 5)
  std::uint32_t every = 1;          ///< Texels between those drawn in `samples`
  std::uint64_t samples_drawn = 0;  ///< On the low poly
};

// ---- where texels land -------------------------------------------------------------------------

using Point = std::array<double, 3>;

constexpr double kCloseUp = 6;
constexpr double kApart = 7;  // pixels between dots, at least
constexpr double kRadius = 1.8;
constexpr Colour kDot = {0.05F, 0.25F, 0.65F};
constexpr float kPale = 0.45F;                   // what is left of the picture's own contrast
constexpr std::uint8_t kFound = 1, kMissed = 2;  // BakeResult::coverage

/// Texels in a grid of their own: every one whose column and row `every` divides. Those that were missed are
/// on the low poly alone.
std::vector<Point> texel_points(const Exhibit& exhibit, std::uint32_t every, bool on_high) {
  std::vector<Point> points;
  const Image& at = exhibit.points;
  for (std::uint32_t y = 0; y < at.height; y += every) {
    for (std::uint32_t x = 0; x < at.width; x += every) {
      const std::size_t i = std::size_t{y} * at.width + x;
      const std::uint8_t coverage = exhibit.coverage[i];
      if (coverage != kFound && (on_high || coverage != kMissed)) continue;
      Point point;
      for (std::size_t c = 0; c < 3; ++c) {
        point[c] = exhibit.origin[c] + double{at.pixels[3 * i + c]};
        if (!on_high) point[c] -= double{exhibit.offsets.pixels[3 * i + c]};
      }
      points.push_back(point);
    }
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

/// The least step at which dots of the first match lie kApart pixels apart on the low poly.
std::uint32_t choose_every(const Scene& plain, const RenderOptions& view, const Exhibit& exhibit) {
  const std::vector<Point> points = texel_points(exhibit, 1, false);
  const Image depth = plain.draw_depth(view);
  const auto covered =
      static_cast<double>(std::count_if(depth.pixels.begin(), depth.pixels.end(),
                                        [](float value) { return value != Scene::kNoDepth; }));
  Canvas none(depth.width, depth.height);
  const auto shown = static_cast<double>(draw_points(plain, view, points, 0, kWhite, none));
  if (!(covered > 0) || !(shown > 0)) return 1;
  const double apart = std::sqrt(covered / shown);
  return static_cast<std::uint32_t>(std::max(1.0, std::ceil(kApart / apart)));
}

/// The sampling pattern (Tarini, Cignoni, Scopigno 2003, figure 5): texels' middles p on the low poly, then
/// F(p) on the high poly for each match. Sets Gallery::samples, every, samples_drawn.
/// \param view  the pictures', framed; where it shows all of the mesh, the middle of it six times as large
void draw_samples(const Scene& original, const Scene& plain, RenderOptions view, Gallery& gallery) {
  if (gallery.exhibits.empty()) return;
  if (view.zoom == 1) {
    if (!view.at) view.at = middle_of(plain, view);
    view.zoom = kCloseUp;
  }
  RenderOptions flat = view;
  flat.flat = true;
  gallery.every = choose_every(plain, view, gallery.exhibits.front());
  Canvas low = paper(plain.draw(flat));
  gallery.samples_drawn =
      draw_points(plain, view, texel_points(gallery.exhibits.front(), gallery.every, false),
                  kRadius, kDot, low);
  std::vector<Panel> panels = {{low.take(), {"texels on the low poly"}}};
  const Image high = original.draw(view);
  for (const Exhibit& exhibit : gallery.exhibits) {
    Canvas canvas = paper(high);
    draw_points(original, view, texel_points(exhibit, gallery.every, true), kRadius, kDot, canvas);
    panels.push_back({canvas.take(), {exhibit.method + ", on the high poly"}});
  }
  gallery.samples = make_sheet(panels);
}

// ---- the gallery -------------------------------------------------------------------------------

std::string faces_text(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  return std::to_string(count) + (count == 1 ? " face" : " faces");
}

std::string missed_text(const BakeReport& report) {
  const double share = report.samples == 0 ? 0
                                           : 100.0 * static_cast<double>(report.missed) /
                                                 static_cast<double>(report.samples);
  return "missed " + fixed_text(share, 2) + "%";
}

/// The map to look at, and then the points that the same match finds. \returns false where stopped
bool bake_exhibit(const Source& source, const Mesh& high, const Mesh& low,
                  const GalleryArguments& a, const UvOptions& uv, const Progress& show,
                  Exhibit& exhibit) {
  BakeOptions bake_with;
  bake_with.match.method = find_match(exhibit.method).method;
  bake_with.width = bake_with.height = a.size;
  bake_with.match.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  bake_with.match.uv = uv;
  bake_with.report.keep_match = true;
  bake_with.progress = show;
  BakeResult baked = bake(source, low, bake_with);
  if (baked.cancelled) return false;
  check_result(baked.report, high, low);
  exhibit.map = std::move(baked.maps[0].image);
  BakeOptions points;
  points.width = points.height = a.size;
  points.match.saved = &*baked.match;
  points.maps = {MapKind{"position"}, MapKind{"displacement"}};
  points.encoding.space = NormalMapSpace::object;
  points.encoding.gutter = 0;
  BakeResult read = bake(source, low, points);
  exhibit.origin = read.maps[0].origin;
  exhibit.points = std::move(read.maps[0].image);
  exhibit.offsets = std::move(read.maps[1].image);
  exhibit.coverage = std::move(read.coverage);
  exhibit.bake = std::move(baked.report);
  return true;
}

/// \returns nothing where progress said stop
/// \throws Error(input) where nothing matches, or a match that was asked for does not do
std::optional<Gallery> make_gallery(const Device& device, const Mesh& high, const Mesh& low,
                                    const GalleryArguments& a, const UvOptions& uv,
                                    RenderOptions view, const Progress& progress) {
  Gallery gallery;
  if (!progress(0, "preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  gallery.warnings = source.warnings();
  std::vector<std::string> methods = a.matches.empty() ? match_names() : a.matches;
  std::erase_if(methods, [&](const std::string& name) {
    std::optional<LeftOut> left = unfit(find_match(name).method, "--match " + name, source, high,
                                        low, uv, !a.matches.empty());
    if (left) gallery.left_out.push_back({name, left->reason});
    return left.has_value();
  });
  view.frame = &high;
  const Scene original(device, high), plain(device, low);
  RenderOptions flat = view;
  flat.flat = true;
  std::vector<Panel> panels = {{original.draw(view), {"high poly", faces_text(high), ""}},
                               {plain.draw(flat), {"low poly", faces_text(low), ""}}};
  const std::vector<ViewAngles> held_out = usual_held_out_angles();
  AnglePictures angles;
  angles.add(original, plain, view);
  const double steps = static_cast<double>(methods.size());
  for (std::size_t i = 0; i < methods.size(); ++i) {
    Exhibit exhibit;
    exhibit.method = methods[i];
    const auto show = [&](double done, std::string_view) {
      return progress((static_cast<double>(i) + 0.6 * done) / steps,
                      "matching by " + exhibit.method);
    };
    if (!bake_exhibit(source, high, low, a, uv, show, exhibit)) return std::nullopt;
    if (!progress((static_cast<double>(i) + 0.6) / steps, "drawing")) return std::nullopt;
    const Scene mapped(device, low, {&exhibit.map});
    angles.add(original, mapped, view);
    exhibit.mean_degrees = angles.mean(i + 1);
    panels.push_back(
        {mapped.draw(view),
         {exhibit.method, "normals off " + fixed_text(exhibit.mean_degrees, 2) + " degrees",
          missed_text(exhibit.bake)}});
    exhibit.error =
        normal_error_texture(device, original, mapped, high, low, held_out, a.size, a.pixels);
    gallery.exhibits.push_back(std::move(exhibit));
  }
  gallery.matches = make_sheet(panels);
  const Scale scale = angles.scale();
  std::vector<Panel> errors = {
      {panels[0].image, {"high poly", ""}},
      {angles.picture(0, scale),
       {"without a map", "mean " + fixed_text(angles.mean(0), 2) + " degrees"}}};
  for (std::size_t i = 0; i < gallery.exhibits.size(); ++i) {
    errors.push_back(
        {angles.picture(i + 1, scale),
         {gallery.exhibits[i].method, "mean " + fixed_text(angles.mean(i + 1), 2) + " degrees"}});
  }
  gallery.error = make_sheet(errors, scale);
  draw_samples(original, plain, view, gallery);
  return gallery;
}

// ---- the command -------------------------------------------------------------------------------

std::vector<std::string> save_gallery(const Gallery& gallery, const fs::path& folder,
                                      const std::string& stem) {
  std::vector<std::string> outputs;
  const auto save = [&](const Image& image, const std::string& name, ImageFormat format) {
    save_image(image, folder / name, {format});
    outputs.push_back((folder / name).string());
  };
  save(gallery.matches, "matches.png", ImageFormat::png8);
  save(gallery.error, "error.png", ImageFormat::png8);
  save(gallery.samples, "samples.png", ImageFormat::png8);
  for (const Exhibit& exhibit : gallery.exhibits) {
    save(exhibit.error, stem + "_" + exhibit.method + "_normal_error.exr", ImageFormat::exr_float);
  }
  return outputs;
}

int run_gallery(const GalleryArguments& a) {
  check_mesh_frame(a.frame, {a.high}, {a.low}, {});
  parse_length_above_0("--max-distance", a.max_distance);  // before any work
  RenderOptions view = view_options(a.view, is_height_field(a.high));
  view.size = a.picture_size;
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  check_paths({a.high, a.low},
              {folder / "matches.png", folder / "error.png", folder / "samples.png", a.json});
  prepare_output_folder(folder);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const HighPolyInput dense =
      load_high(a.high, a.heights, warnings, load_options(a, MeshSide::high));
  const Mesh low = load_low(a.low, "", warnings, load_options(a, MeshSide::low));
  const double seconds_load = watch.lap();
  const std::optional<Gallery> gallery =
      make_gallery(device, dense.mesh, low, a, uv_options(dense), view,
                   [&](double done, std::string_view stage) {
                     return console.progress(0.05 + 0.9 * done, stage);
                   });
  if (!gallery) return kExitCancelled;
  warnings.insert(warnings.end(), gallery->warnings.begin(), gallery->warnings.end());
  const double seconds_draw = watch.lap();
  const std::vector<std::string> outputs = save_gallery(*gallery, folder, low.name);
  console.progress(1, "done");
  std::vector<Warning> of_methods;
  for (const Exhibit& exhibit : gallery->exhibits) {
    of_methods.insert(of_methods.end(), exhibit.bake.warnings.begin(), exhibit.bake.warnings.end());
  }
  print_warnings(console, warnings, of_methods, "--json");
  for (const LeftOut& left : gallery->left_out) {
    console.line("left out: " + left.name + ": " + left.reason);
  }
  for (const std::string& output : outputs) console.line("wrote " + output);
  if (a.json.empty()) return 0;
  Json methods = Json::array();
  for (const Exhibit& exhibit : gallery->exhibits) {
    methods.push_back(fields("method mean_angle_degrees texels warnings",
                             {exhibit.method, exhibit.mean_degrees, describe_texels(exhibit.bake),
                              describe(exhibit.bake.warnings)}));
  }
  Json json = fields(
      "version device inputs options methods left_out samples",
      {version(), describe(device.info()),
       fields("high low", {describe(dense.mesh, a.high), describe(low, a.low)}),
       fields("match size max_distance picture_size pixels view zoom at z_up square height extent "
              "triangulate up unit uv_set",
              {a.matches.empty() ? match_names() : a.matches, a.size, a.max_distance,
               a.picture_size, a.pixels,
               Json::array({view.azimuth_degrees, view.elevation_degrees}), view.zoom, view.at,
               view.z_up, a.view.square, is_height_field(a.high) ? Json(a.heights.height) : Json(),
               extent_json(a.heights), name_of(Words(kTriangulations), a.load.triangulation),
               a.frame.up, a.frame.unit, a.frame.uv_set}),
       methods, describe_left_out(gallery->left_out, "method"),
       fields("every drawn", {gallery->every, gallery->samples_drawn})});
  add_ending(json, {{"load", seconds_load}, {"draw", seconds_draw}}, watch, outputs, warnings);
  save_report(a.json, json);
  return 0;
}

}  // namespace

Run add_gallery(Command& app) {
  Command* command = name_lab_command(app, "gallery");
  auto a = std::make_shared<GalleryArguments>();
  command->add_option("HIGH", a->high, "The high poly (" + high_poly_kinds() + ")")->required();
  command->add_option("LOW", a->low, "The low poly, with UVs")->required();
  command
      ->add_option("--out", a->out,
                   "Folder for matches.png, error.png, samples.png, and "
                   "LOW_<match>_normal_error.exr")
      ->required();
  command
      ->add_option("--match", a->matches,
                   "A match, as of kiln bake; may be given again (default: all that do)")
      ->allow_extra_args(false)
      ->check(one_of(match_names()));
  command->add_option("--size", a->size, "Texels a side of the maps, 16 to 8192")
      ->check(range(16U, 8192U))
      ->capture_default_str();
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  command
      ->add_option("--picture-size", a->picture_size,
                   "Pixels of a picture's longer side, 64 to 4096")
      ->check(range(64U, 4096U))
      ->capture_default_str();
  command
      ->add_option("--pixels", a->pixels,
                   "Pixels a side of the pictures that the errors of texels are measured in")
      ->check(range(16U, 4096U))
      ->capture_default_str();
  add_options(*command, view_rows<GalleryArguments>(), a.get());
  add_height_options(*command, *a, "The height field (HIGH is a PNG or EXR)");
  const OptionRow rows[] = {triangulate_row<GalleryArguments>("", "HIGH and LOW")};
  add_options(*command, rows, a.get());
  add_options(*command, mesh_frame_rows<GalleryArguments>("Files of meshes", /*low=*/true),
              a.get());
  add_run_options(*command, *a);
  return [a] { return run_gallery(*a); };
}

}  // namespace kiln::cli

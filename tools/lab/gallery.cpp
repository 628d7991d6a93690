// Pictures of every way to match, side by side: `kiln gallery HIGH LOW`.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "arguments/bake_job.h"
#include "arguments/paths.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/files.h"
#include "kiln/kiln.h"
#include "kiln/render.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "picture/angles.h"
#include "picture/sheet.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// One way to match.
struct Exhibit {
  std::string method;
  Json figures;  ///< For the report
  std::vector<Warning> warnings;
  Image map;     ///< Normals, tangent space
  Image points;  ///< F(p) of each texel's middle p, object space, from `origin`
  std::array<double, 3> origin{};
  Image offsets;                       ///< F(p) - p
  std::vector<std::uint8_t> coverage;  ///< Of both, per texel: 1 where a point was found
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

/// The map to look at, and then the points that the same match finds. \returns false where stopped
bool bake_exhibit(const Source& source, const Mesh& high, const Mesh& low, const LabArguments& a,
                  const UvOptions& uv, const Progress& show, Exhibit& exhibit) {
  BakeOptions bake_with;
  bake_with.match.method = find_match(exhibit.method).method;
  bake_with.width = bake_with.height = *a.size;
  bake_with.match.max_distance = a.search_distance();
  bake_with.match.uv = uv;
  bake_with.report.keep_match = true;
  bake_with.progress = show;
  BakeResult baked = bake(source, low, bake_with);
  if (baked.cancelled) return false;
  check_result(baked.report, high, low);
  exhibit.map = std::move(baked.maps[0].image);
  BakeOptions points;
  points.width = points.height = *a.size;
  points.match.saved = &*baked.match;
  points.maps = {MapKind{"position"}, MapKind{"displacement"}};
  points.encoding.space = NormalMapSpace::object;
  points.encoding.gutter = 0;
  BakeResult read = bake(source, low, points);
  exhibit.origin = read.maps[0].origin;
  exhibit.points = std::move(read.maps[0].image);
  exhibit.offsets = std::move(read.maps[1].image);
  exhibit.coverage = std::move(read.coverage);
  exhibit.warnings = std::move(baked.report.warnings);
  exhibit.figures = fields("method texels warnings", {exhibit.method, describe_texels(baked.report),
                                                      describe(exhibit.warnings)});
  return true;
}

/// \returns nothing where progress said stop
/// \throws Error(input) where nothing matches, or a match that was asked for does not do
std::optional<Gallery> make_gallery(const Device& device, const Mesh& high, const Mesh& low,
                                    const LabArguments& a, const UvOptions& uv, RenderOptions view,
                                    const Progress& progress) {
  Gallery gallery;
  Steps steps(progress);
  if (!steps.at("preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  gallery.warnings = source.warnings();
  std::vector<std::string> methods = a.matches;
  std::erase_if(methods, [&](const std::string& name) {
    std::optional<LeftOut> left =
        unfit(find_match(name).method, "--match " + name, source, high, low, uv, a.gave("--match"));
    if (left) gallery.left_out.push_back({name, left->reason});
    return left.has_value();
  });
  steps.count = static_cast<double>(methods.size());
  view.frame = &high;
  const Scene original(device, high), plain(device, low);
  const Places places(device, low);
  RenderOptions flat = view;
  flat.flat = true;
  std::vector<Panel> panels = {
      {original.draw(view), {"high poly", plural(high.triangles.size(), "face"), ""}},
      {plain.draw(flat), {"low poly", plural(low.triangles.size(), "face"), ""}}};
  const std::vector<ViewAngles> held_out = usual_held_out_angles();
  AnglePictures angles;
  angles.add(original, plain, view);
  for (const std::string& method : methods) {
    Exhibit exhibit;
    exhibit.method = method;
    if (!steps.at("matching by " + method)) return std::nullopt;
    if (!bake_exhibit(source, high, low, a, uv, steps.within(0.6), exhibit)) return std::nullopt;
    if (!steps.at("drawing")) return std::nullopt;
    const Scene mapped(device, low, {&exhibit.map});
    angles.add(original, mapped, view);
    const double mean = angles.mean(gallery.exhibits.size() + 1);
    exhibit.figures["mean_angle_degrees"] = mean;
    const auto missed = static_cast<std::uint64_t>(exhibit.figures.at("texels.missed").number());
    panels.push_back({mapped.draw(view),
                      {method, "normals off " + fixed_text(mean, 2) + " degrees",
                       plural(missed, "texel") + " missed"}});
    exhibit.error =
        normal_error_texture(places, original, mapped, high, held_out, *a.size, *a.pixels);
    gallery.exhibits.push_back(std::move(exhibit));
    steps.done += 1;
  }
  gallery.matches = make_sheet(panels);
  const Scale scale = angles.scale();
  std::vector<Panel> errors = {{panels[0].image, {"high poly", ""}}};
  for (std::size_t i = 0; i <= gallery.exhibits.size(); ++i) {
    errors.push_back({angles.picture(i, scale),
                      {i == 0 ? "without a map" : gallery.exhibits[i - 1].method,
                       "mean " + fixed_text(angles.mean(i), 2) + " degrees"}});
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
  const std::optional<Gallery> gallery =
      make_gallery(device, dense.mesh, low, a, uv_options(dense), view, run.within(0.05, 0.95));
  if (!gallery) return kExitCancelled;
  run.lap("draw");
  run.warnings.insert(run.warnings.end(), gallery->warnings.begin(), gallery->warnings.end());
  run.outputs = save_gallery(*gallery, folder, low.name);
  Json methods = Json::array();
  for (const Exhibit& exhibit : gallery->exhibits) {
    methods.push_back(exhibit.figures);
    run.of_settings.insert(run.of_settings.end(), exhibit.warnings.begin(), exhibit.warnings.end());
  }
  for (const LeftOut& left : gallery->left_out) {
    run.lines.push_back("left out: " + left.name + ": " + left.reason);
  }
  Json options = values_json(rows, &a);
  if (!is_height_field(a.high)) options["height"] = {};
  options.update(describe_view(view));
  run.report.update(
      fields("device inputs options methods left_out samples",
             {describe(device.info()),
              fields("high low", {describe(dense.mesh, a.high), describe(low, a.low)}), options,
              methods, describe_left_out(gallery->left_out, "method"),
              fields("every drawn", {gallery->every, gallery->samples_drawn})}));
  return run.end();
}

}  // namespace

Run add_gallery(Command& app) {
  Command* command = name_lab_command(app, "gallery");
  auto a = std::make_shared<LabArguments>();
  a->size = 1024, a->pixels = 512, a->picture_size = 480;
  command->add_option("HIGH", a->high, "The high poly (" + high_poly_kinds() + ")")->required();
  command->add_option("LOW", a->low, "The low poly, with UVs")->required();
  command
      ->add_option("--out", a->out,
                   "Folder for matches.png, error.png, samples.png, and "
                   "LOW_<match>_normal_error.exr")
      ->required();
  const std::vector<OptionRow> rows =
      lab_rows({"--match", "--size", "--max-distance", "--picture-size", "--pixels", "--height",
                "--extent", "--triangulate", "--up", "--unit", "--uv-set", "--allow-outside",
                "--device", "--json", "--quiet"});
  add_options(*command, rows, a.get());
  add_view_options(*command, a->view);
  return [a, command, rows] {
    a->given = given_flags(*command);
    return run_gallery(*a, rows);
  };
}

}  // namespace kiln::cli

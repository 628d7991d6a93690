#include "lab/gallery_samples.h"

#include <algorithm>
#include <cmath>

namespace kiln::cli {
namespace {

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

}  // namespace

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

void draw_samples(const Scene& original, const Scene& plain, const GalleryOptions& /*options*/,
                  RenderOptions view, Gallery& gallery) {
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
  std::vector<Panel> panels = {{low.image(), {"texels on the low poly"}}};
  const Image high = original.draw(view);
  for (const Exhibit& exhibit : gallery.exhibits) {
    Canvas canvas = paper(high);
    draw_points(original, view, texel_points(exhibit, gallery.every, true), kRadius, kDot, canvas);
    panels.push_back({canvas.image(), {exhibit.method + ", on the high poly"}});
  }
  gallery.samples = make_sheet(panels);
}

}  // namespace kiln::cli

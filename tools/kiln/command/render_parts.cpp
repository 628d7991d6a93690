#include "command/render_parts.h"

#include <algorithm>
#include <filesystem>

#include "arguments/parse.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "picture/view_arguments.h"

namespace kiln::cli {

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
  std::size_t left = 0;
  for (const Image& panel : panels) {
    for (std::size_t y = 0; y < panel.height; ++y) {
      std::copy_n(panel.at(0, y), std::size_t{panel.width} * 3, sheet.at(left, y));
    }
    left += panel.width + gap;
  }
  return sheet;
}

void require_pictures(const PictureGeometry& size, std::uint64_t count) {
  constexpr std::uint64_t kBytesOfWriter =
      2;  // a pixel, while one is compressed: 36 MiB of 4096 x 4096 were measured
  const std::uint64_t pixels = std::uint64_t{size.width} * size.height;
  const std::uint64_t bytes = pixels * (count * 3 * sizeof(float) + kBytesOfWriter);
  const std::uint64_t left = memory_left();
  if (bytes <= left) return;
  const auto mebibytes = [](std::uint64_t b) { return std::to_string(b >> 20) + " MiB"; };
  throw Error(ErrorCode::internal,
              "Pictures of " + std::to_string(size.width) + "x" + std::to_string(size.height) +
                  " pixels would take " + mebibytes(bytes) + " of memory, but only " +
                  mebibytes(left) +
                  " are left of the memory limit. Use a smaller --size or fewer pictures, or raise "
                  "the `memory_limit`.");
}

/// Measures how near the low poly comes to the reference, from the view shown and along the six
/// axes. Says so, and returns it for the report. The same pixels whatever the picture's own size.
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map) {
  const std::vector<ViewAngles> views = {{options.azimuth_degrees, options.elevation_degrees},
                                         {0, 0},
                                         {90, 0},
                                         {180, 0},
                                         {270, 0},
                                         {0, 90},
                                         {0, -90}};
  const NormalReference reference(high, frame, views, 512, options.z_up);
  const NormalError without = reference.compare(low, true);
  Json json = {{"views", views.size()}, {"without_map", describe(without)}};
  std::string text;
  if (has_map) {
    const NormalError with = reference.compare(low);
    json["with_map"] = describe(with);
    text = formatted(
        "rendered normals against the original, %zu views (this one and along the axes): "
        "mean %.2f degrees smooth "
        "without the map, %.2f with it (95%%: %.2f, %.2f)",
        views.size(), without.mean_degrees, with.mean_degrees, without.p95_degrees,
        with.p95_degrees);
  } else {
    text = formatted(
        "rendered normals against the original, %zu views: mean %.2f degrees (95%%: "
        "%.2f)",
        views.size(), without.mean_degrees, without.p95_degrees);
  }
  console.line(text);
  return json;
}

/// The views that a match by depth views takes (Wang, Froehlich, Goebel 2003, figure 4a).
Image contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options) {
  options.trim = false;
  std::vector<Panel> panels;
  for (const Vec3& toward : spread_views(count)) {
    look_from(toward, options);
    const std::string text = formatted("%zu: %.0f, %.0f", panels.size() + 1,
                                       options.azimuth_degrees, options.elevation_degrees);
    panels.push_back({scene.draw(options), {text}});
  }
  return make_sheet(panels);
}

/// Distance of the low poly from directions all around. None is along an axis, from where flat
/// faces look as straight down as they were baked.
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up) {
  constexpr std::uint32_t kAround = 30, kPixels = 256;
  std::vector<ViewAngles> views;
  for (const Vec3& toward : held_out_views(kAround, spread_views(12))) {
    views.push_back(view_angles(toward));
  }
  const NormalReference reference(high, frame, views, kPixels, z_up);
  return {{"views", views.size()},
          {"without_map", describe(reference.compare(low, true))},
          {"with_map", describe(reference.compare(low))}};
}

}  // namespace kiln::cli

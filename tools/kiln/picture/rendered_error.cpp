#include "picture/rendered_error.h"

#include <cstdio>
#include <vector>

#include "report/report.h"

namespace kiln::cli {

Json measure_rendered(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
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
  char text[256];
  if (has_map) {
    const NormalError with = reference.compare(low);
    json["with_map"] = describe(with);
    std::snprintf(text, sizeof text,
                  "rendered normals against the original, %zu views (this one and along the axes): "
                  "mean %.2f degrees smooth "
                  "without the map, %.2f with it (95%%: %.2f, %.2f)",
                  views.size(), without.mean_degrees, with.mean_degrees, without.p95_degrees,
                  with.p95_degrees);
  } else {
    std::snprintf(text, sizeof text,
                  "rendered normals against the original, %zu views: mean %.2f degrees (95%%: "
                  "%.2f)",
                  views.size(), without.mean_degrees, without.p95_degrees);
  }
  console.line(text);
  return json;
}

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

#include "lab/gallery.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "arguments/bake_arguments.h"
#include "lab/gallery_samples.h"
#include "lab/normal_error.h"
#include "lab/study.h"
#include "picture/angles.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

std::string faces_text(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  return std::to_string(count) + (count == 1 ? " face" : " faces");
}

std::string with_two_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string missed_text(const BakeReport& report) {
  const double share = report.samples == 0 ? 0
                                           : 100.0 * static_cast<double>(report.missed) /
                                                 static_cast<double>(report.samples);
  return "missed " + with_two_digits(share) + "%";
}

BakeOptions bake_options(const GalleryOptions& options, const std::string& method) {
  BakeOptions bake_with;
  bake_with.method = match_method(method);
  bake_with.width = bake_with.height = options.size;
  bake_with.max_distance = options.max_distance;
  bake_with.uv = options.uv;
  return bake_with;
}

/// The map to look at, and then the points that the same match finds. \returns false where stopped
bool bake_exhibit(const Source& source, const Mesh& high, const Mesh& low,
                  const GalleryOptions& options, const Progress& show, Exhibit& exhibit) {
  BakeOptions bake_with = bake_options(options, exhibit.method);
  bake_with.keep_match = true;
  bake_with.progress = show;
  BakeResult baked = bake(source, low, bake_with);
  if (baked.cancelled) return false;
  check_result(baked.report, high, low);
  exhibit.map = std::move(baked.maps[0].image);
  BakeOptions points;
  points.width = points.height = options.size;
  points.match = &*baked.match;
  points.maps = {MapKind{"position"}, MapKind{"displacement"}};
  points.space = NormalMapSpace::object;
  points.gutter = 0;
  BakeResult read = bake(source, low, points);
  exhibit.origin = read.maps[0].origin;
  exhibit.points = std::move(read.maps[0].image);
  exhibit.offsets = std::move(read.maps[1].image);
  exhibit.coverage = std::move(read.coverage);
  exhibit.bake = std::move(baked.report);
  return true;
}

}  // namespace

std::optional<Gallery> make_gallery(const Device& device, const Mesh& high, const Mesh& low,
                                    const GalleryOptions& options, const Progress& progress) {
  Gallery gallery;
  if (!progress(0, "preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  gallery.warnings = source.warnings();
  std::vector<std::string> methods = options.methods;
  std::erase_if(methods, [&](const std::string& name) {
    std::optional<LeftOut> left =
        unfit(match_method(name), "--match " + name, source, high, low, options.uv, options.strict);
    if (left) gallery.left_out.push_back({name, left->reason});
    return left.has_value();
  });
  RenderOptions view = options.view;
  view.frame = &high;
  const Scene original(device, high), plain(device, low);
  RenderOptions flat = view;
  flat.flat = true;
  std::vector<Panel> panels = {{original.draw(view), {"high poly", faces_text(high), ""}},
                               {plain.draw(flat), {"low poly", faces_text(low), ""}}};
  std::vector<ViewAngles> held_out;
  for (const Vec3& toward : held_out_views(kHeldOutViews, spread_views(12), kLeastHeldOutAngle)) {
    held_out.push_back(view_angles(toward));
  }
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
    if (!bake_exhibit(source, high, low, options, show, exhibit)) return std::nullopt;
    if (!progress((static_cast<double>(i) + 0.6) / steps, "drawing")) return std::nullopt;
    const Scene mapped(device, low, {&exhibit.map});
    angles.add(original, mapped, view);
    exhibit.mean_degrees = angles.mean(i + 1);
    panels.push_back(
        {mapped.draw(view),
         {exhibit.method, "normals off " + with_two_digits(exhibit.mean_degrees) + " degrees",
          missed_text(exhibit.bake)}});
    exhibit.error = normal_error_texture(device, original, mapped, high, low, held_out,
                                         options.size, options.size, options.pixels);
    gallery.exhibits.push_back(std::move(exhibit));
  }
  gallery.matches = make_sheet(panels);
  const Scale scale = angles.scale();
  std::vector<Panel> errors = {
      {panels[0].image, {"high poly", ""}},
      {angles.picture(0, scale),
       {"without a map", "mean " + with_two_digits(angles.mean(0)) + " degrees"}}};
  for (std::size_t i = 0; i < gallery.exhibits.size(); ++i) {
    errors.push_back(
        {angles.picture(i + 1, scale),
         {gallery.exhibits[i].method, "mean " + with_two_digits(angles.mean(i + 1)) + " degrees"}});
  }
  gallery.error = make_sheet(errors, scale);
  draw_samples(original, plain, options, view, gallery);
  return gallery;
}

Json describe(const Gallery& gallery) {
  Json rows = Json::array();
  for (const Exhibit& exhibit : gallery.exhibits) {
    rows.push_back({{"method", exhibit.method},
                    {"mean_angle_degrees", exhibit.mean_degrees},
                    {"texels", describe_texels(exhibit.bake)},
                    {"warnings", describe(exhibit.bake.warnings)}});
  }
  Json left_out = Json::array();
  for (const LeftOut& left : gallery.left_out) {
    left_out.push_back({{"method", left.name}, {"reason", left.reason}});
  }
  return {{"methods", rows},
          {"left_out", left_out},
          {"samples", {{"every", gallery.every}, {"drawn", gallery.samples_drawn}}}};
}

}  // namespace kiln::cli

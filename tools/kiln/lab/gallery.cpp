#include "lab/gallery.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "arguments/bake_arguments.h"
#include "lab/gallery_samples.h"
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
  exhibit.points = std::move(read.maps[0].image);
  exhibit.offsets = std::move(read.maps[1].image);
  exhibit.coverage = std::move(read.coverage);
  exhibit.bake = std::move(baked.report);
  return true;
}

}  // namespace

Image normal_error_texture(const Device& device, const Scene& high, const Scene& low,
                           const Mesh& mesh, const Mesh& frame, const std::vector<Vec3>& views,
                           std::uint32_t size) {
  // A map whose colours say where they lie in it: what a pixel shows names its texel.
  constexpr std::uint32_t kRamp = 256;
  Image ramp{kRamp, kRamp, 3, {}};
  for (std::uint32_t y = 0; y < kRamp; ++y) {
    for (std::uint32_t x = 0; x < kRamp; ++x) {
      ramp.pixels.insert(ramp.pixels.end(), {(static_cast<float>(x) + 0.5F) / kRamp,
                                             (static_cast<float>(y) + 0.5F) / kRamp, 1.0F});
    }
  }
  const Scene places(device, mesh, {&ramp});
  std::vector<double> sums(std::size_t{size} * size);
  std::vector<std::uint32_t> counts(sums.size());
  for (const Vec3& toward : views) {
    const ViewAngles angles = view_angles(toward);
    RenderOptions view;
    view.size = kMeasuredSize;
    view.azimuth_degrees = angles.azimuth_degrees;
    view.elevation_degrees = angles.elevation_degrees;
    view.frame = &frame;
    view.samples = 1;
    RenderOptions colours = view;
    colours.show_colors = true;
    const Image shown = places.draw(colours);
    view.show_normals = true;
    const Image error = normal_angles(high.draw(view), low.draw(view));
    for (std::size_t i = 0; i < error.pixels.size(); ++i) {
      if (error.pixels[i] < 0) continue;
      const auto texel = [&](float share) {
        return std::min(size - 1, static_cast<std::uint32_t>(share * static_cast<float>(size)));
      };
      const std::size_t at =
          std::size_t{texel(shown.pixels[3 * i + 1])} * size + texel(shown.pixels[3 * i]);
      sums[at] += double{error.pixels[i]};
      ++counts[at];
    }
  }
  Image result{size, size, 1, {}};
  result.pixels.resize(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    result.pixels[i] = counts[i] == 0 ? -1.0F : static_cast<float>(sums[i] / counts[i]);
  }
  return result;
}

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
  const std::vector<Vec3> held_out =
      held_out_views(kHeldOutViews, spread_views(12), kLeastHeldOutAngle);
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
    exhibit.error =
        normal_error_texture(device, original, mapped, low, high, held_out, options.size);
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

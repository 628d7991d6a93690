#include "picture/view_arguments.h"

#include <tuple>

#include "kiln/measure.h"
#include "kiln/render.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

constexpr const char* kDefaultView = "30,15";
constexpr const char* kDefaultHeightFieldView = "30,35";

}  // namespace

RenderOptions view_options(const ViewArguments& arguments, bool height_field) {
  RenderOptions options;
  const std::string view = !arguments.view.empty() ? arguments.view
                           : height_field          ? kDefaultHeightFieldView
                                                   : kDefaultView;
  std::tie(options.azimuth_degrees, options.elevation_degrees) = parse_view(view);
  options.zoom = arguments.zoom;
  if (!arguments.at.empty()) options.at = parse_point("--at", arguments.at);
  options.z_up = arguments.z_up || height_field;
  options.trim = !arguments.square;
  return options;
}

void look_from(const Vec3& toward, RenderOptions& options) {
  const ViewAngles angles =
      view_angles(options.z_up ? Vec3{toward.x, toward.z, -toward.y} : toward);
  options.azimuth_degrees = angles.azimuth_degrees;
  options.elevation_degrees = angles.elevation_degrees;
}

}  // namespace kiln::cli

#include "picture/view_arguments.h"

#include <cmath>
#include <cstdlib>
#include <tuple>

#include "arguments/parse.h"
#include "kiln/measure.h"
#include "kiln/render.h"

namespace kiln::cli {
namespace {

constexpr const char* kView = "30,15";
constexpr const char* kViewOfHeights = "30,35";

std::array<double, 3> parse_point(const std::string& text) {
  std::array<double, 3> point{};
  const char* rest = text.c_str();
  for (std::size_t i = 0; i < 3; ++i) {
    char* end = nullptr;
    point[i] = std::strtod(rest, &end);
    if (end == rest || !std::isfinite(point[i]) || *end != (i < 2 ? ',' : '\0')) {
      throw Error(ErrorCode::usage,
                  "--at '" + text + "': give a point of the world, X,Y,Z, such as 0.1,0,-2.5.");
    }
    rest = end + 1;
  }
  return point;
}

}  // namespace

void add_view_options(Command& command, ViewArguments& arguments) {
  command.add_option("--view", arguments.view,
                     "AZ,EL in degrees: 0,0 looks at the front, from +Z (default 30,15; height "
                     "field: 30,35)");
  command.add_option("--zoom", arguments.zoom, "How much larger than what fits, 0.01 to 100000")
      ->check(range(0.01, 1e5))
      ->capture_default_str();
  command.add_option("--at", arguments.at,
                     "X,Y,Z: the point in the picture's middle (default: the mesh's)");
  command.add_flag("--z-up", arguments.z_up,
                   "The up axis is +Z (default +Y; height fields: always +Z): the front is seen "
                   "from -Y");
  command.add_flag("--square", arguments.square,
                   "A square picture, whatever the mesh's shape in it");
}

RenderOptions view_options(const ViewArguments& arguments, bool height_field) {
  RenderOptions options;
  const std::string view = !arguments.view.empty() ? arguments.view
                           : height_field          ? kViewOfHeights
                                                   : kView;
  std::tie(options.azimuth_degrees, options.elevation_degrees) = parse_view(view);
  options.zoom = arguments.zoom;
  if (!arguments.at.empty()) options.at = parse_point(arguments.at);
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

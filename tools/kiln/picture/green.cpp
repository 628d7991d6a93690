#include "picture/green.h"

#include "arguments/parse.h"
#include "kiln/measure.h"
#include "kiln/render.h"

namespace kiln::cli {
namespace {

constexpr double kClearly = 0.9;  // of the error, at most
constexpr std::uint32_t kPixels = 256;

}  // namespace

void check_green(const Device& device, const Mesh& mesh, NormalMap map, const Scene& high,
                 const Mesh& frame, bool z_up, std::vector<Warning>& warnings) {
  if (map.image == nullptr) return;
  const std::vector<ViewAngles> views = {{40, 25}, {160, -20}, {280, 10}};
  const NormalReference reference(high, frame, views, kPixels, z_up);
  const double as_given = reference.compare(Scene(device, mesh, map)).mean_degrees;
  map.flip_y = !map.flip_y;
  const double turned = reference.compare(Scene(device, mesh, map)).mean_degrees;
  if (!(turned < kClearly * as_given)) return;
  const std::string text = formatted(
      "The map fits HIGH better with green %s: rendered normals are %.2f degrees off, not "
      "%.2f. %s --flip-y, or bake the map again for the other convention.",
      map.flip_y ? "down (DirectX)" : "up (OpenGL)", turned, as_given,
      map.flip_y ? "Add" : "Leave out");
  warnings.push_back({"green-flipped", text, 1});
}

}  // namespace kiln::cli

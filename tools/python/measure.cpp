#include "measure.h"

#include <nanobind/stl/string.h>

#include "arrays.h"
#include "base/option.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "mesh.h"
#include "options/words.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

template <typename T>
T parse_word(const Words<T>& words, const char* parameter, const std::string& text) {
  if (const T* const value = words.find(text)) return *value;
  std::string names;
  for (const auto& [name, value] : words) names += (names.empty() ? "" : ", ") + std::string(name);
  throw Error(ErrorCode::usage,
              option(parameter) + " is '" + text + "': give one of " + names + ".", "option-enum");
}

nb::dict run_measure(const PyMesh& high, const PyMesh& low, nb::handle normal,
                     const std::string& space, bool flip_y, const std::string& bitangent,
                     std::uint32_t views, std::uint32_t size, bool z_up, const std::string& device,
                     nb::object progress) {
  const Call call(std::move(progress));
  if (views < 1 || views > 4096) {
    throw Error(ErrorCode::usage,
                option("views") + " is " + std::to_string(views) + ": give 1 to 4096.",
                "option-range");
  }
  if (size < 16 || size > 8192) {
    throw Error(ErrorCode::usage,
                option("size") + " is " + std::to_string(size) + ": give 16 to 8192.",
                "option-range");
  }
  Image image;
  NormalMap map;
  if (!normal.is_none()) {
    image = image_of(normal, "normal");
    map = {&image, parse_word(Words(kSpaceWords), "space", space), flip_y,
           parse_word(Words(kBitangentWords), "bitangent", bitangent)};
  }
  const NormalError error = call.run([&] {
    const Device& open_device = device_of(device);
    std::vector<ViewAngles> angles;
    for (const Vec3& toward : held_out_views(views, {})) angles.push_back(view_angles(toward));
    const NormalReference reference(Scene(open_device, *high.mesh), *high.mesh, std::move(angles),
                                    size, z_up);
    return reference.compare(Scene(open_device, *low.mesh, map));
  });
  nb::dict d;
  d["mean"] = error.mean_degrees;
  d["rms"] = error.rms_degrees;
  d["median"] = error.median_degrees;
  d["p95"] = error.p95_degrees;
  d["p99"] = error.p99_degrees;
  d["max"] = error.max_degrees;
  d["pixels"] = error.pixels;
  d["one_sided_share"] = error.one_sided_share;
  d["standard_error"] = error.standard_error_degrees;
  return d;
}

/// Renders a mesh. \returns (H, W, 3), sRGB-encoded
nb::any run_render(const PyMesh& mesh, nb::handle normal, const std::string& space, bool flip_y,
                   const std::string& bitangent, std::uint32_t size, double azimuth,
                   double elevation, bool z_up, bool show_normals, const PyMesh* frame,
                   const std::string& device, nb::object progress) {
  const Call call(std::move(progress));
  Image image;
  NormalMap map;
  if (!normal.is_none()) {
    image = image_of(normal, "normal");
    map = {&image, parse_word(Words(kSpaceWords), "space", space), flip_y,
           parse_word(Words(kBitangentWords), "bitangent", bitangent)};
  }
  RenderOptions options;
  options.size = size;
  options.azimuth_degrees = azimuth;
  options.elevation_degrees = elevation;
  options.z_up = z_up;
  options.show_normals = show_normals;
  if (show_normals) options.samples = 1;
  if (frame != nullptr) options.frame = frame->mesh.get();
  Image picture = call.run([&] { return render(device_of(device), *mesh.mesh, options, map); });
  const std::size_t height = picture.height, width = picture.width, channels = picture.channels;
  return array(std::move(picture.pixels), {height, width, channels});
}

}  // namespace

void add_measure(nb::module_& module) {
  module.def("render", &run_render, "mesh"_a, "normal"_a.none(), "space"_a, "flip_y"_a,
             "bitangent"_a, "size"_a, "azimuth"_a, "elevation"_a, "z_up"_a, "show_normals"_a,
             "frame"_a.none(), "device"_a, "progress"_a.none());
  module.def("measure", &run_measure, "high"_a, "low"_a, "normal"_a.none(), "space"_a, "flip_y"_a,
             "bitangent"_a, "views"_a, "size"_a, "z_up"_a, "device"_a, "progress"_a.none());
}

}  // namespace kiln::python

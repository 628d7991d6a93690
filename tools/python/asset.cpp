#include "asset.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>

#include <map>

#include "arrays.h"
#include "job/open_shell_sides.h"
#include "kiln/asset.h"
#include "kiln/attribute.h"
#include "kiln/version.h"
#include "options/words.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// Encodes a GLB with one material.
/// \param maps          pictures in [0, 1] by the names of their slots
/// \param alpha         alpha mode if the maps have opacity
/// \param double_sided  whether back faces are shown: yes, no, or auto: if views see many of them through borders of an
/// open mesh
nb::bytes encode(const PyMesh& low, const std::map<std::string, nb::object>& maps,
                 const std::string& alpha, const std::string& double_sided) {
  const Call call;
  std::map<std::string, Image> images;
  AssetMaps slots;
  for (const auto& [name, pixels] : maps) {
    if (const Image** const slot = slot_of(slots, name); slot != nullptr) {
      *slot = &(images[name] = image_of(pixels, name.c_str()));
    }
  }
  AssetMaterial material;
  material.name = low.mesh->name.empty() ? "mesh" : low.mesh->name;
  material.alpha_mode = *Words(kAlphaWords).at(alpha);
  std::optional<Warning> warning;
  const std::optional<bool> is_double_sided = Words(kSidesWords).at(double_sided);
  material.double_sided = is_double_sided.value_or(false);
  SaveAssetOptions options;
  options.metres = low.mesh->metres;
  options.kiln_extras = "{\"version\": \"" + std::string(version()) + "\"}";
  const std::vector<std::byte> bytes = call.run([&] {
    Mesh mesh = *low.mesh;
    mesh.material_names = {material.name};
    mesh.materials.assign(mesh.triangles.size(), 0);
    if (!is_double_sided) warning = show_backs_of_shells(mesh, {false}, std::span(&material, 1));
    material.pictures = std::make_shared<const AssetPictures>(encode_maps(slots));
    return encode_glb(mesh, std::span(&material, 1), options);
  });
  if (warning) warn({*warning});
  return nb::bytes(bytes.data(), bytes.size());
}

/// Fills texels around charts. \returns the padded pixels
nb::any pad(const std::string& device, nb::handle pixels, nb::handle coverage, int texels,
            bool fill_missed, bool unit_vectors) {
  const Call call;
  Image image = image_of(pixels, "values");
  const auto states = bytes(coverage, "coverage", {-1, -1});
  std::vector<std::uint8_t> covered(states.data(), states.data() + states.size());
  call.run([&] {
    fill_padding(device_of(device), image, covered, {texels, fill_missed, unit_vectors});
  });
  const std::size_t height = image.height, width = image.width, channels = image.channels;
  return array(std::move(image.pixels), {height, width, channels});
}

}  // namespace

void add_asset(nb::module_& module) {
  module.def("encode_glb", &encode, "low"_a, "maps"_a, "alpha"_a, "double_sided"_a);
  module.def("pad", &pad, "device"_a, "pixels"_a, "coverage"_a, "texels"_a, "fill_missed"_a,
             "unit_vectors"_a);
}

}  // namespace kiln::python

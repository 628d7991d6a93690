#include "asset.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>

#include <map>

#include "arrays.h"
#include "kiln/asset.h"
#include "kiln/attribute.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// \param maps               pictures in [0, 1] by their names
/// \param emission_strength  what 1 of emission stands for
void write_glb(const PyMesh& low, const std::map<std::string, nb::object>& maps,
               float emission_strength, const std::filesystem::path& path, const std::string& alpha,
               bool double_sided, const std::string& extras) {
  const Call call;
  std::map<std::string, Image> images;
  AssetMaps slots;
  slots.emission_strength = emission_strength;
  for (const auto& [name, pixels] : maps) {
    if (const Image** const slot = slot_of(slots, name); slot != nullptr) {
      *slot = &(images[name] = image_of(pixels, name.c_str()));
    }
  }
  SaveGlbOptions options;
  options.alpha_mode = alpha == "blend" ? AlphaMode::blend : AlphaMode::mask;
  options.double_sided = double_sided;
  options.metres = low.mesh->metres;
  options.extras = extras;
  call.run([&] { save_glb(*low.mesh, slots, path, options); });
}

/// \returns the padded pixels
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
  module.def("save_glb", &write_glb, "low"_a, "maps"_a, "emission_strength"_a, "path"_a, "alpha"_a,
             "double_sided"_a, "extras"_a);
  module.def("pad", &pad, "device"_a, "pixels"_a, "coverage"_a, "texels"_a, "fill_missed"_a,
             "unit_vectors"_a);
}

}  // namespace kiln::python

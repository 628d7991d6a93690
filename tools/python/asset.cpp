#include "asset.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <map>
#include <set>
#include <tuple>

#include "arrays.h"
#include "kiln/asset.h"
#include "kiln/attribute.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

/// Alpha mode, cutoff, and whether back faces are shown.
using Look = std::tuple<std::string, float, bool>;

/// Gives the mesh a material for each look of its triangles.
/// \param looks  of its materials by name; `otherwise` of those that are not among them
std::vector<AssetMaterial> part_by_looks(const std::map<std::string, Look>& looks,
                                         const Look& otherwise, Mesh& mesh) {
  const std::string plain = mesh.name.empty() ? "mesh" : mesh.name;
  std::vector<std::string> names{plain};
  std::vector<std::uint32_t> of(mesh.triangles.size(), 0);
  if (!mesh.materials.empty()) {
    names = mesh.material_names;
    of = mesh.materials;
  }
  std::map<Look, std::uint32_t> known;
  std::vector<std::set<std::string>> names_of;
  std::vector<AssetMaterial> materials;
  for (std::uint32_t& material : of) {
    const std::string& name = names[material];
    const auto found = looks.find(name);
    const Look& look = found != looks.end() ? found->second : otherwise;
    const auto [entry, added] = known.emplace(look, static_cast<std::uint32_t>(materials.size()));
    material = entry->second;
    if (added) {
      AssetMaterial& made = materials.emplace_back();
      made.alpha_mode = Words(kAlphaModes).at(std::get<0>(look));
      made.alpha_cutoff = std::get<1>(look);
      made.double_sided = std::get<2>(look);
      names_of.emplace_back();
    }
    names_of[material].insert(name);
  }
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const bool one_of_several = materials.size() > 1 && names_of[i].size() == 1;
    materials[i].name = one_of_several ? *names_of[i].begin() : plain;
  }
  mesh.materials = std::move(of);
  mesh.material_names.clear();
  for (const AssetMaterial& material : materials) mesh.material_names.push_back(material.name);
  return materials;
}

/// \param maps               pictures in [0, 1] by their names
/// \param emission_strength  what 1 of emission stands for
/// \param looks, otherwise   as of part_by_looks()
void write_glb(const PyMesh& low, const std::map<std::string, nb::object>& maps,
               float emission_strength, const std::filesystem::path& path,
               const std::map<std::string, Look>& looks, const Look& otherwise,
               const std::string& extras) {
  const Call call;
  std::map<std::string, Image> images;
  AssetMaps slots;
  slots.emission_strength = emission_strength;
  for (const auto& [name, pixels] : maps) {
    if (const Image** const slot = slot_of(slots, name); slot != nullptr) {
      *slot = &(images[name] = image_of(pixels, name.c_str()));
    }
  }
  SaveAssetOptions options;
  options.metres = low.mesh->metres;
  options.kiln_extras = extras;
  call.run([&] {
    Mesh mesh = *low.mesh;
    std::vector<AssetMaterial> materials = part_by_looks(looks, otherwise, mesh);
    const auto pictures = std::make_shared<const AssetPictures>(encode_maps(slots));
    for (AssetMaterial& material : materials) material.pictures = pictures;
    save_asset(mesh, materials, path, options);
  });
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
  module.def("save_glb", &write_glb, "low"_a, "maps"_a, "emission_strength"_a, "path"_a, "looks"_a,
             "otherwise"_a, "extras"_a);
  module.def("pad", &pad, "device"_a, "pixels"_a, "coverage"_a, "texels"_a, "fill_missed"_a,
             "unit_vectors"_a);
}

}  // namespace kiln::python

// What materials look like, and their pictures.
#include "io/mesh/materials.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string_view>

#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "io/file/text_scanner.h"
#include "kiln/material.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// A file's path among materials of one picture.
const fs::path& file_of(const Material& material, MaterialSlot slot) {
  switch (slot) {
    case MaterialSlot::color:
      return material.color_file;
    case MaterialSlot::opacity:
      return material.opacity_file;
    case MaterialSlot::normal:
      return material.normal_file;
    case MaterialSlot::roughness:
      return material.roughness_file;
    case MaterialSlot::metallic:
      return material.metallic_file;
    case MaterialSlot::emission:
      return material.emission_file;
  }
  return material.color_file;
}

/// What stands in for a picture.
std::array<float, 4> plain_of(const Material& material, MaterialSlot slot) {
  const auto all = [](float value) { return std::array<float, 4>{value, value, value, value}; };
  const auto& [red, green, blue] = material.color;
  switch (slot) {
    case MaterialSlot::color:
      return {red, green, blue, material.opacity};
    case MaterialSlot::opacity:
      return all(material.opacity);
    case MaterialSlot::normal:
      return {0, 0, 1, 1};
    case MaterialSlot::roughness:
      return all(material.roughness);
    case MaterialSlot::metallic:
      return all(material.metallic);
    case MaterialSlot::emission:
      return {material.emission[0], material.emission[1], material.emission[2], 1};
  }
  return {};
}

}  // namespace

std::vector<Material> load_materials(const Mesh& mesh, const fs::path& mesh_file,
                                     std::vector<Warning>* warnings) {
  std::vector<Material> read;
  for (const std::string& name : mesh.material_files) {
    std::string file = name;
    std::replace(file.begin(), file.end(), '\\', '/');
    const fs::path path = mesh_file.parent_path() / file;
    MeshInput input{path.string(), {}, warnings};
    const FailWith fail = [&input](const std::string& place, const std::string& problem,
                                   const std::string& remedy) {
      input.fail(place, problem, remedy);
    };
    const std::unique_ptr<ByteSource> source = open_file(path, fail);
    require_memory("its bytes", source->size(), memory_failure(fail, ""));
    std::string bytes(static_cast<std::size_t>(source->size()), '\0');
    bytes.resize(source->read_at(0, bytes.data(), bytes.size()));
    input.bytes = bytes;
    for (Material& material : read_materials(input, path.parent_path())) {
      read.push_back(std::move(material));
    }
  }
  std::map<std::string_view, const Material*> by_name;  // the first of a name
  for (const Material& material : read) by_name.emplace(material.name, &material);
  std::vector<Material> materials;
  std::uint64_t missing = 0;
  std::string example;
  for (const std::string& name : mesh.material_names) {
    if (const auto found = by_name.find(name); found != by_name.end()) {
      materials.push_back(*found->second);
      continue;
    }
    materials.emplace_back().name = name;
    if (missing++ == 0) example = name;
  }
  if (missing != 0 && warnings != nullptr) {
    warnings->push_back({"material-missing",
                         "'" + mesh_file.string() + "': " + std::to_string(missing) +
                             " of its materials (\"" + printable(example) +
                             "\" for one) are described in no file; they are white.",
                         missing});
  }
  return materials;
}

Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot) {
  Texture texture;
  const bool color = slot == MaterialSlot::color || slot == MaterialSlot::emission;
  texture.kind = slot == MaterialSlot::normal ? TextureKind::normal
                 : color                      ? TextureKind::srgb
                                              : TextureKind::linear;
  std::map<fs::path, std::uint32_t> known;
  // Opacity may stand in the colour's alpha.
  const bool in_alpha = slot == MaterialSlot::opacity &&
                        std::all_of(materials.begin(), materials.end(), [](const Material& m) {
                          return m.opacity_file.empty() || m.opacity_file == m.color_file;
                        });
  const MaterialSlot from = in_alpha ? MaterialSlot::color : slot;
  texture.channel = in_alpha ? 3 : 0;
  for (const Material& material : materials) {
    const fs::path& file = file_of(material, from);
    texture.plain.push_back(plain_of(material, slot));
    if (file.empty()) {
      texture.image_of.push_back(Texture::kNone);
      continue;
    }
    const auto [entry, added] =
        known.emplace(file, static_cast<std::uint32_t>(texture.images.size()));
    if (added) texture.images.push_back(std::make_shared<const Image>(load_image(file)));
    texture.image_of.push_back(entry->second);
  }
  if (materials.empty()) {
    throw Error(ErrorCode::input,
                "The high poly has no materials: give the picture itself, or an OBJ with its MTL.");
  }
  return texture;
}

}  // namespace kiln

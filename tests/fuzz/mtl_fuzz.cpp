// An MTL file and the pictures that it names, of a folder with two.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "asset/materials.h"
#include "kiln/image.h"

namespace {

namespace fs = std::filesystem;

fs::path make_pictures() {
  std::string name = fs::temp_directory_path() / "kiln-mtl-fuzz-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) std::abort();
  const kiln::Image image{2, 1, 4, std::vector<float>(8, 0.5F)};
  kiln::save_image(image, fs::path(name) / "a.png", {.format = kiln::ImageFormat::png8});
  kiln::save_image(image, fs::path(name) / "b.exr", {.format = kiln::ImageFormat::exr_float});
  return name;
}

/// Gone at the end, also where libFuzzer ends the process.
const fs::path& folder() {
  static const fs::path pictures = [] {
    static const fs::path made = make_pictures();
    std::atexit([] { fs::remove_all(made); });
    return made;
  }();
  return pictures;
}

/// Other files are none of a fuzzer's business: to open a device may do something.
bool all_in_the_folder(const std::vector<kiln::Material>& materials) {
  for (const kiln::Material& m : materials) {
    for (const fs::path* file :
         {&m.color_map.file, &m.opacity_map.file, &m.normal_map.file, &m.roughness_map.file,
          &m.metallic_map.file, &m.emission_map.file}) {
      if (!file->empty() && (file->parent_path() != folder() || file->filename() == "..")) {
        return false;
      }
    }
  }
  return true;
}

/// Materials without a picture or number of the slot are refused: others may have theirs.
void check_texture(const std::vector<kiln::Material>& materials, kiln::MaterialSlot slot,
                   std::vector<kiln::Warning>* warnings) {
  try {
    const kiln::Texture texture = kiln::load_material_texture(materials, slot, warnings);
    if (texture.plain.size() != materials.size() || texture.image_of.size() != materials.size()) {
      std::abort();
    }
    for (const std::uint32_t image : texture.image_of) {
      if (image != kiln::Texture::kNone && image >= texture.images.size()) std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
}

}  // namespace

/// Materials and their textures come, or kiln::Error of an input.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using kiln::MaterialSlot;
  std::vector<kiln::Warning> warnings;
  kiln::FileFinder finder(folder(), &warnings);
  try {
    const std::vector<kiln::Material> materials = kiln::read_materials(
        {"input", {reinterpret_cast<const char*>(data), size}, &warnings}, folder(), &finder);
    if (!all_in_the_folder(materials)) return 0;
    for (const MaterialSlot slot :
         {MaterialSlot::color, MaterialSlot::opacity, MaterialSlot::normal, MaterialSlot::roughness,
          MaterialSlot::metallic, MaterialSlot::emission}) {
      check_texture(materials, slot, &warnings);
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}

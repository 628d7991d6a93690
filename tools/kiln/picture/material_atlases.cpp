// Combines the textures of a mesh's own materials into an atlas per slot.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "base/srgb.h"
#include "image/wrap.h"
#include "job/mesh_files.h"
#include "kiln/image.h"
#include "kiln/texture_sets.h"
#include "picture/mapped_mesh.h"

namespace kiln::cli {
namespace {

constexpr std::uint32_t kMaxAtlasSide = 8192;  // maximum side of an atlas in texels

/// One texture slot of all materials.
class Slot {
 public:
  Slot(const std::vector<Material>& materials, MaterialSlot slot, std::vector<Warning>& warnings,
       const Mesh& mesh)
      : texture_(load_material_texture(materials, slot, mesh, &warnings)) {}

  /// Returns the index of a material's picture; Texture::kNone if it has none.
  std::uint32_t image_of(std::size_t material) const { return texture_.image_of[material]; }
  /// True if the textures repeat, and use the mesh's UVs without a transform.
  bool repeats() const {
    return texture_.uv_transforms.empty() && texture_.wraps.empty() && texture_.tiles.empty();
  }
  /// True if the material uses its picture in this slot unchanged, without factors.
  bool is_unchanged_picture(std::size_t material) const {
    return image_of(material) != Texture::kNone && texture_.factors.empty() && repeats();
  }
  std::uint32_t map_side(std::size_t material) const {
    const std::uint32_t image = image_of(material);
    if (image == Texture::kNone) return 1;
    return std::max(texture_.images[image]->width, texture_.images[image]->height);
  }

  /// A material's value at a UV, filtered bilinearly.
  std::array<float, 3> at(std::size_t material, double u, double v) const {
    const std::uint32_t image_index = image_of(material);
    if (image_index == Texture::kNone)
      return encode_value(texture_.plain[material], /*linear=*/true);
    const Image& image = *texture_.images[image_index];
    if (!texture_.uv_transforms.empty()) {
      const std::array<float, 6>& m = texture_.uv_transforms[material];
      const double transformed_u = m[0] * u + m[1] * v + m[2];
      v = m[3] * u + m[4] * v + m[5];
      u = transformed_u;
    }
    const std::array<TextureWrap, 2> wrap =
        texture_.wraps.empty() ? std::array<TextureWrap, 2>{} : texture_.wraps[material];
    const double x = u * image.width - 0.5, y = (1 - v) * image.height - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const auto texel_at = [](std::int64_t place, std::uint32_t size, TextureWrap by) {
      return static_cast<std::size_t>(wrapped_texel(place, size, by));
    };
    std::array<float, 4> value{};
    for (int k = 0; k < 4; ++k) {
      const int right = k % 2, lower = k / 2;
      const float* const texel =
          image.at(texel_at(static_cast<std::int64_t>(left) + right, image.width, wrap[0]),
                   texel_at(static_cast<std::int64_t>(top) + lower, image.height, wrap[1]));
      const double weight =
          (right != 0 ? x - left : 1 - x + left) * (lower != 0 ? y - top : 1 - y + top);
      for (std::size_t c = 0; c < 3; ++c) {
        value[c] += static_cast<float>(weight * texel[image.channels < 3 ? 0 : c]);
      }
    }
    if (texture_.factors.empty()) return encode_value(value, /*linear=*/false);
    const Texture::Factor& factor = texture_.factors[material];
    for (std::size_t c = 0; c < 3; ++c) {
      double number = value[c];
      if (texture_.kind == TextureKind::srgb) number = from_srgb(number);
      if (texture_.kind == TextureKind::normal) number = 2 * number - 1;
      value[c] = static_cast<float>(number * factor.times[c] + factor.plus);
    }
    return encode_value(value, /*linear=*/true);
  }

 private:
  /// Converts a value to the encoding of the map. \param linear  true if the value is linear light, or a vector
  std::array<float, 3> encode_value(const std::array<float, 4>& value, bool linear) const {
    std::array<float, 3> result{value[0], value[1], value[2]};
    if (!linear) return result;
    if (texture_.kind == TextureKind::normal) {
      const float length = std::hypot(value[0], value[1], value[2]);
      for (float& number : result) number = length > 0 ? number / length / 2 + 0.5F : 0.5F;
    } else if (texture_.kind == TextureKind::srgb) {
      for (float& number : result) number = to_srgb(number);
    }
    return result;
  }

  Texture texture_;
};

/// Key of a cell of the atlas: the pictures of all slots and, if factors change these pictures, the material. Materials
/// with equal keys share a cell.
struct CellKey {
  std::array<std::uint32_t, 3> pictures{Texture::kNone, Texture::kNone, Texture::kNone};
  std::size_t material = 0;
  auto operator<=>(const CellKey&) const = default;
};

/// The layout of an atlas: a square grid of cells, each with the pictures of one material.
struct AtlasLayout {
  std::vector<std::size_t> material;  ///< material of each cell
  /// number of cells along a side, and texels along a cell's side
  std::uint32_t rows = 1, side = 1;

  Image draw(const Slot& slot) const {
    Image image{rows * side, rows * side, 3, {}};
    image.pixels.resize(std::size_t{image.width} * image.height * 3);
    for (std::size_t cell = 0; cell < material.size(); ++cell) {
      const std::size_t left = cell % rows * side, bottom = cell / rows * side;
      for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) {
          const auto value = slot.at(material[cell], (x + 0.5) / side, (y + 0.5) / side);
          std::ranges::copy(value, image.at(left + x, image.height - 1 - bottom - y));
        }
      }
    }
    return image;
  }
};

bool in_unit_square(const Mesh& mesh) {
  constexpr float kUvTolerance = 1e-4F;
  return std::all_of(mesh.uvs.begin(), mesh.uvs.end(), [](const Vec2& uv) {
    return uv.x >= -kUvTolerance && uv.x <= 1 + kUvTolerance && uv.y >= -kUvTolerance &&
           uv.y <= 1 + kUvTolerance;
  });
}

}  // namespace

MaterialAtlases make_material_atlases(const std::vector<Material>& materials, Mesh& mesh,
                                      std::vector<Warning>& warnings) {
  constexpr std::array kSlots = {MaterialSlot::normal, MaterialSlot::color,
                                 MaterialSlot::occlusion};
  constexpr std::array kPictures = {&Material::normal_map, &Material::color_map,
                                    &Material::occlusion_map};
  MaterialAtlases maps;
  if (materials.empty() || mesh.uvs.empty()) return maps;
  const auto leave_out = [&](const std::string& why) {
    warnings.push_back({"own-maps", "MESH is shown without the maps of its materials: " + why, 1});
    return MaterialAtlases();
  };
  std::array<std::optional<Slot>, 3> slots;
  try {
    for (std::size_t k = 0; k < slots.size(); ++k) {
      if (std::any_of(materials.begin(), materials.end(), [&](const Material& material) {
            return !(material.*kPictures[k]).empty();
          })) {
        slots[k].emplace(materials, kSlots[k], warnings, mesh);
      }
    }
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    return leave_out(error.what());
  }
  if (!slots[0] && !slots[1] && !slots[2]) return maps;
  AtlasLayout sheet;
  std::map<CellKey, std::size_t> cells;
  std::vector<std::size_t> cell_of(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < cell_of.size(); ++t) {
    const std::size_t material = mesh.materials.empty() ? 0 : mesh.materials[t];
    CellKey cell_key;
    std::uint32_t side = 1;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      if (!slots[k]) continue;
      cell_key.pictures[k] = slots[k]->image_of(material);
      side = std::max(side, slots[k]->map_side(material));
      if (!slots[k]->is_unchanged_picture(material)) cell_key.material = material;
    }
    const auto [entry, added] = cells.try_emplace(cell_key, sheet.material.size());
    if (added) sheet.material.push_back(material);
    sheet.side = std::max(sheet.side, side);
    cell_of[t] = entry->second;
  }
  while (std::size_t{sheet.rows} * sheet.rows < sheet.material.size()) ++sheet.rows;
  const bool repeat = std::all_of(slots.begin(), slots.end(), [](const std::optional<Slot>& slot) {
    return !slot || slot->repeats();
  });
  if ((sheet.rows > 1 || !repeat) && !in_unit_square(mesh)) {
    return leave_out(
        "its UVs leave the unit square, but there are several pictures, or pictures that are "
        "transformed, UDIM sets, or do not repeat.");
  }
  if (sheet.rows > 1) {
    if (mesh.tangents.empty()) mesh.tangents = tangents_of(mesh);
    const auto rows = static_cast<float>(sheet.rows);
    move_uvs(
        cell_of,
        [&](std::size_t cell, const Vec2& uv) {
          return Vec2{(static_cast<float>(cell % sheet.rows) + uv.x) / rows,
                      (static_cast<float>(cell / sheet.rows) + uv.y) / rows};
        },
        mesh);
  }
  sheet.side = std::max(1U, std::min(sheet.side, kMaxAtlasSide / sheet.rows));
  const std::array<Image*, 3> images = {&maps.normal, &maps.color, &maps.occlusion};
  for (std::size_t k = 0; k < slots.size(); ++k) {
    if (slots[k]) *images[k] = sheet.draw(*slots[k]);
  }
  return maps;
}

}  // namespace kiln::cli

// Pictures of a glTF's material, before they are encoded.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "kiln/asset.h"

namespace kiln {

/// Pictures that a material takes.
enum class PictureSlot { normal, color, surface, emission };

/// Its name in reports: normal, color, surface (occlusion, roughness and metalness), emission.
std::string_view name_of(PictureSlot picture);
/// Its file in a material's pictures.
std::vector<std::byte>& file_of(AssetPictures& pictures, PictureSlot picture);

/// Base colour, with opacity as alpha; empty: neither is there. \throws Error(usage) where their sizes differ
Image color_picture(const AssetMaps& maps);
/// Occlusion, roughness and metalness; empty: none is there. \throws Error(usage) where their sizes differ
Image surface_picture(const AssetMaps& maps);
/// What AssetPictures says of its pictures, without any.
AssetPictures described_pictures(const AssetMaps& maps);

}  // namespace kiln

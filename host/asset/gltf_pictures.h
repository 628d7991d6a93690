// Pictures of a glTF's material, before they are encoded.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "kiln/asset.h"

namespace kiln {

/// Textures of a written material.
enum class PictureSlot { normal, color, surface, emission };

/// Its name in reports: normal, color, surface (occlusion, roughness and metalness), emission.
std::string_view name_of(PictureSlot picture);
/// The encoded file of a slot.
std::vector<std::byte>& file_of(AssetPictures& pictures, PictureSlot picture);

/// Base colour, with opacity as alpha; empty if both are missing. \throws Error(usage) if their sizes differ
Image color_picture(const AssetMaps& maps);
/// Occlusion, roughness and metalness; empty if all are missing. \throws Error(usage) if their sizes differ
Image surface_picture(const AssetMaps& maps);
/// AssetPictures without files: only the properties that describe its pictures.
AssetPictures described_pictures(const AssetMaps& maps);

}  // namespace kiln

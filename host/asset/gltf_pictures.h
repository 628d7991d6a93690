// Combines maps to the pictures of a glTF material, before these are encoded.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "kiln/asset.h"

namespace kiln {

/// The textures of a material that is written.
enum class PictureSlot { normal, color, surface, emission };

/// Name of a slot in reports: normal, color, surface (occlusion, roughness and metalness) or
/// emission.
std::string_view name_of(PictureSlot picture);
/// The member that holds the encoded file of a slot.
std::vector<std::byte>& file_of(AssetPictures& pictures, PictureSlot picture);

/// Combines the base colour with opacity as alpha. Empty if both maps are missing.
/// \throws Error(usage) if their sizes differ
Image color_picture(const AssetMaps& maps);
/// Combines occlusion, roughness and metalness. Empty if all maps are missing.
/// \throws Error(usage) if their sizes differ
Image surface_picture(const AssetMaps& maps);
/// AssetPictures without encoded files, which only state what the pictures would hold.
AssetPictures described_pictures(const AssetMaps& maps);

}  // namespace kiln

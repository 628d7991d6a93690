// Combines the pictures of a glTF material from maps, before they are encoded.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "kiln/asset.h"

namespace kiln {

/// The textures of a written material.
enum class PictureSlot { normal, color, surface, emission };

/// The name of a slot in reports: normal, color, surface (occlusion, roughness and metalness), or emission.
std::string_view name_of(PictureSlot picture);
/// The encoded file of a slot.
std::vector<std::byte>& file_of(AssetPictures& pictures, PictureSlot picture);

/// Combines the base colour with opacity as alpha; empty if both are missing. \throws Error(usage) if their sizes
/// differ
Image color_picture(const AssetMaps& maps);
/// Combines occlusion, roughness and metalness; empty if all are missing. \throws Error(usage) if their sizes differ
Image surface_picture(const AssetMaps& maps);
/// Returns AssetPictures without files, which only describe what the pictures hold.
AssetPictures described_pictures(const AssetMaps& maps);

}  // namespace kiln

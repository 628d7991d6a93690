// Names of voxel types.
#include "kiln/volume.h"

namespace kiln {

const char* name_of(VoxelType type) {
  static constexpr const char* kNames[] = {"u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64"};
  return kNames[static_cast<int>(type)];
}

std::optional<VoxelType> voxel_type_of(std::string_view name) {
  for (const VoxelType type : {VoxelType::u8, VoxelType::i8, VoxelType::u16, VoxelType::i16,
                               VoxelType::u32, VoxelType::i32, VoxelType::f32, VoxelType::f64}) {
    if (name == name_of(type)) return type;
  }
  return std::nullopt;
}

}  // namespace kiln

// Dispatch over voxel types.
#pragma once

#include <cstdint>

#include "kiln/volume.h"

namespace kiln {

/// Calls visit with a value of the voxel type.
template <typename Visit>
auto with_voxel_type(VoxelType type, const Visit& visit) {
  switch (type) {
    case VoxelType::u8:
      return visit(std::uint8_t{});
    case VoxelType::i8:
      return visit(std::int8_t{});
    case VoxelType::u16:
      return visit(std::uint16_t{});
    case VoxelType::i16:
      return visit(std::int16_t{});
    case VoxelType::u32:
      return visit(std::uint32_t{});
    case VoxelType::i32:
      return visit(std::int32_t{});
    case VoxelType::f32:
      return visit(float{});
    case VoxelType::f64:
      break;
  }
  return visit(double{});
}

}  // namespace kiln

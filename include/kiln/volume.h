#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "kiln/error.h"

namespace kiln {

/// How a voxel is stored, in the machine's byte order.
enum class VoxelType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };

/// Bytes of one voxel.
constexpr std::size_t size_of(VoxelType type) {
  switch (type) {
    case VoxelType::u8:
    case VoxelType::i8: return 1;
    case VoxelType::u16:
    case VoxelType::i16: return 2;
    case VoxelType::u32:
    case VoxelType::i32:
    case VoxelType::f32: return 4;
    case VoxelType::f64: return 8;
  }
  return 0;
}

/// A scalar field sampled on a regular grid. A voxel is a sample at a grid point, not a box.
struct Volume {
  std::string name;                     ///< Stem of the file, or any name; used in messages.
  std::array<std::uint32_t, 3> size{};  ///< Voxels along x, y, z.
  VoxelType type = VoxelType::u8;
  /// World position of voxel (i, j, k) = origin + i axes[0] + j axes[1] + k axes[2]: an axis' length is
  /// the spacing. Axes are independent; a left-handed set mirrors the picture, as the file says.
  std::array<double, 3> origin{};
  std::array<std::array<double, 3>, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::vector<std::byte> voxels;  ///< size[0] size[1] size[2] values, x fastest.
};

}  // namespace kiln

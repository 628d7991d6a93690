// A volume's voxels as the kernels take them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/contour.h"

namespace kiln {

/// Voxels of a type that kernels read (u8, i8, u16, i16, f32), beside the volume or converted from it.
struct DeviceVoxels {
  const std::byte* data = nullptr;
  /// Used if the type is another, or infinite voxels are of the solid: value - iso, its sign kept
  std::vector<float> converted;
  VoxelType type = VoxelType::f32;
  float iso = 0;  ///< The least float that is not below the iso value; 0 where converted
  float outside =
      0;  ///< The finite voxel farthest from the solid: stands for other voxels that are not finite
  double infinite_inside = 0;  ///< Stand-in for infinite voxels of the solid, where there are any
  std::uint64_t not_finite = 0;
  std::uint64_t beyond_float = 0;  ///< Voxels whose difference to the iso value a float cannot hold

  std::size_t bytes_per_voxel() const { return size_of(type); }
  /// As KILN_VOXEL takes it.
  const char* type_name() const;
};

/// \param lowest, highest  [out] the range of finite voxels, where it was looked for
/// \throws Error(usage), Error(input)
DeviceVoxels device_voxels(const Volume& volume, const ContourOptions& options, double& lowest,
                           double& highest);

/// Throws the error that says why no surface is there.
[[noreturn]] void throw_no_surface(const Volume& volume, const ContourOptions& options);

}  // namespace kiln

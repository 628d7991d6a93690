// A volume's voxels, converted for kernels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/contour.h"

namespace kiln {

/// Voxels of a type that kernels read (u8, i8, u16, i16, f32): the volume's own, or converted ones.
struct DeviceVoxels {
  const std::byte* data = nullptr;
  /// The differences value - iso, with exact signs. They are used if kernels cannot read the
  /// volume's type, or if voxels inside the solid are infinite.
  std::vector<float> converted;
  VoxelType type = VoxelType::f32;
  float iso = 0;  ///< Smallest float that is not below the iso value; 0 for `converted`
  /// The finite value that is farthest from the iso value on the empty side; it replaces NaN, and
  /// infinity on the empty side
  float outside = 0;
  /// The value that replaces infinite voxels of the solid, if there are any
  double infinity_value = 0;
  std::uint64_t not_finite = 0;
  /// Number of voxels whose difference to the iso value is too large or too small for a float
  std::uint64_t beyond_float = 0;

  std::size_t bytes_per_voxel() const { return size_of(type); }
  /// Name of the voxel type in kernels, for the macro KILN_VOXEL.
  const char* type_name() const;
};

/// \param lowest, highest  [out] range of the finite voxels; unchanged if voxels are integers
/// \throws Error(usage), Error(input)
DeviceVoxels convert_voxels(const Volume& volume, const ContourOptions& options, double& lowest,
                            double& highest);

/// Throws an error that explains why there is no surface.
[[noreturn]] void throw_no_surface(const Volume& volume, const ContourOptions& options);

}  // namespace kiln

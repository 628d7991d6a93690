// Makes the volume that benchmarks extract.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/parallel.h"
#include "kiln/volume.h"

namespace kiln::bench {

/// Makes a hollow ball with bumps, scaled to the volume's sides; 8 bits per voxel, the surface at 128.
inline Volume bumpy_volume(const std::array<std::uint32_t, 3>& size) {
  Volume volume;
  volume.name =
      std::to_string(size[0]) + "x" + std::to_string(size[1]) + "x" + std::to_string(size[2]);
  volume.size = size;
  volume.type = VoxelType::u8;
  volume.voxels.resize(std::size_t{size[0]} * size[1] * size[2]);
  const double least = *std::min_element(size.begin(), size.end());
  parallel_for(size[2], 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      for (std::size_t y = 0; y < size[1]; ++y) {
        for (std::size_t x = 0; x < size[0]; ++x) {
          const double p = 2.0 * x / (size[0] - 1) - 1, q = 2.0 * y / (size[1] - 1) - 1,
                       r = 2.0 * z / (size[2] - 1) - 1;
          const double radius = std::sqrt(p * p + q * q + r * r);
          const double bumps = 0.03 * std::sin(23 * p) * std::sin(19 * q) * std::sin(21 * r);
          const double shell = std::min(0.85 + bumps - radius, radius - 0.5);
          // The value rises over four voxels on each side of the surface.
          const double value = 128 + shell * least / 2 * 32;
          volume.voxels[(z * size[1] + y) * size[0] + x] =
              static_cast<std::byte>(std::clamp(std::lround(value), 0L, 255L));
        }
      }
    }
  });
  return volume;
}

}  // namespace kiln::bench

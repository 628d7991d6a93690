// A volume as a continuous field in double precision: the reference for measures.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "mesh/vector.h"
#include "volume/voxels.h"

namespace kiln {

/// The volume's values, interpolated. A point is in the solid if value() is above 0 (or equal to 0, for Inside::above).
/// Positions are in voxels.
template <typename T>
class VolumeField {
 public:
  VolumeField(const DeviceVoxels& voxels, const Volume& volume, const ContourOptions& options)
      : voxels_(reinterpret_cast<const T*>(voxels.data)),
        size_(volume.size),
        iso_(voxels.converted.empty() ? options.iso : 0),
        outside_(voxels.outside),
        is_solid_below_(options.inside == Inside::below) {}

  /// Trilinear interpolation, positive in the solid.
  /// \param p  within the volume
  double value(const Vec3d& p) const {
    const Cell c = cell(p);
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
      sum += c.corner_weight(k) * voxel_value(c.x + (k & 1), c.y + (k >> 1 & 1), c.z + (k >> 2));
    }
    return is_solid_below_ ? iso_ - sum : sum - iso_;
  }
  /// Gradient by central differences, interpolated like the field; points into the solid.
  Vec3d gradient(const Vec3d& p) const {
    const Cell c = cell(p);
    Vec3d sum{};
    for (int k = 0; k < 8; ++k) {
      sum +=
          voxel_gradient({c.x + (k & 1), c.y + (k >> 1 & 1), c.z + (k >> 2)}) * c.corner_weight(k);
    }
    return is_solid_below_ ? -sum : sum;
  }
  bool is_solid(double value) const { return is_solid_below_ ? value > 0 : value >= 0; }
  bool contains(const Vec3d& p) const {
    return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= size_[0] - 1.0 && p.y <= size_[1] - 1.0 &&
           p.z <= size_[2] - 1.0;
  }
  /// The cell that contains a point, given by its lowest voxel.
  std::array<std::uint32_t, 3> cell_of(const Vec3d& p) const {
    const Cell c = cell(p);
    return {c.x, c.y, c.z};
  }

 private:
  struct Cell {
    std::uint32_t x, y, z;
    double u, v, w;
    double corner_weight(int k) const {
      return ((k & 1) != 0 ? u : 1 - u) * ((k & 2) != 0 ? v : 1 - v) * ((k & 4) != 0 ? w : 1 - w);
    }
  };
  Cell cell(const Vec3d& p) const {
    const auto low = [](double at, std::uint32_t side) {
      return static_cast<std::uint32_t>(std::clamp(std::floor(at), 0.0, side - 2.0));
    };
    Cell c{low(p.x, size_[0]), low(p.y, size_[1]), low(p.z, size_[2]), 0, 0, 0};
    c.u = p.x - c.x;
    c.v = p.y - c.y;
    c.w = p.z - c.z;
    return c;
  }
  double voxel_value(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    const auto value = static_cast<double>(voxels_[(std::size_t{z} * size_[1] + y) * size_[0] + x]);
    return std::isfinite(value) ? value : outside_;
  }
  Vec3d voxel_gradient(const std::array<std::uint32_t, 3>& at) const {
    double slope[3];
    for (std::size_t k = 0; k < 3; ++k) {
      auto a = at, b = at;
      if (a[k] > 0) --a[k];
      if (b[k] + 1 < size_[k]) ++b[k];
      slope[k] = (voxel_value(b[0], b[1], b[2]) - voxel_value(a[0], a[1], a[2])) / (b[k] - a[k]);
    }
    return {slope[0], slope[1], slope[2]};
  }

  const T* voxels_;
  std::array<std::uint32_t, 3> size_;
  double iso_, outside_;
  bool is_solid_below_;
};

}  // namespace kiln

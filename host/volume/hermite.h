// Contouring data computed on the device: signs, crossings with normals, vertices.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cl/context.h"
#include "kiln/contour.h"
#include "volume/cell_grid.h"
#include "volume/fine_surface.h"
#include "volume/voxels.h"

namespace kiln {

/// A slab of voxel planes on the device.
class DeviceSlab {
 public:
  DeviceSlab(cl::Context& context, const Volume& volume, const DeviceVoxels& voxels,
             std::size_t slab_bytes)
      : context_(context),
        voxels_(voxels),
        plane_bytes_(std::size_t{volume.size[0]} * volume.size[1] * voxels.bytes_per_voxel()),
        planes_(volume.size[2]) {
    const std::uint64_t largest = context.info().largest_buffer_bytes;
    const std::size_t bytes = std::min<std::uint64_t>(slab_bytes, largest / 2);
    slab_planes_ = static_cast<std::uint32_t>(
        std::min<std::size_t>(planes_, std::max<std::size_t>(bytes / plane_bytes_, 8)));
  }
  std::uint32_t step() const { return slab_planes_; }
  /// Uploads voxel planes `first` to `last` - 1 unless they are on the device already.
  const cl::Array<std::byte>& load(std::uint32_t first, std::uint32_t last,
                                   kiln_volume_grid& grid) {
    if (first < first_ || last > last_) {
      if (device_voxels_.size() != (last - first) * plane_bytes_) {
        device_voxels_ = {};
        device_voxels_ = cl::Array<std::byte>(context_, (last - first) * plane_bytes_);
      }
      device_voxels_.write(context_,
                           {voxels_.data + first * plane_bytes_, (last - first) * plane_bytes_});
      first_ = first;
      last_ = last;
    }
    grid.first_z = first_;
    grid.count_z = last_ - first_;
    return device_voxels_;
  }

 private:
  cl::Context& context_;
  const DeviceVoxels& voxels_;
  std::size_t plane_bytes_;
  std::uint32_t planes_;
  std::uint32_t slab_planes_ = 0, first_ = ~0U, last_ = 0;
  cl::Array<std::byte> device_voxels_;
};

kiln_volume_grid make_grid(const Volume& volume, const ContourOptions& options,
                           const DeviceVoxels& voxels, const CellGrid& cells);

/// Computes the signs of some voxel planes.
void find_signs(cl::Context& context, DeviceSlab& slabs, const cl::Kernel& kernel,
                kiln_volume_grid grid, const PlaneRange& voxel_planes, CellGrid& cells);

/// True if some voxels are inside of the solid and some are outside.
bool has_both_signs(CellGrid& cells);

/// Computes the crossings of the edges of some padded planes, in edge order.
cl::Array<kiln_volume_crossing> find_crossings(cl::Context& context, DeviceSlab& slabs,
                                               const cl::Kernel& kernel, kiln_volume_grid grid,
                                               const CellGrid& cells, const PlaneRange& planes);

/// Computes vertices `begin` to `end` - 1, and their error functions if the surface stores them.
/// The keys of the vertices must be set.
/// \param crossings  crossings of all edges
void find_vertices(cl::Context& context, const cl::Kernel& kernel, kiln_volume_grid grid,
                   const CellGrid& cells, const cl::Array<kiln_volume_crossing>& crossings,
                   std::size_t begin, std::size_t end, FineSurface& surface);

}  // namespace kiln

// The full-resolution contour of a volume that changes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "volume/fine_surface.h"
#include "volume/hermite.h"
#include "volume/sheets.h"

namespace kiln {

/// Contours a volume, and updates the contour near planes whose voxels changed. The surface is bit-identical to a new
/// contour of the whole volume.
///
/// A crossing depends on voxels up to three planes away, a vertex on the crossings of its cell;
/// both are copied for planes that are not affected. Sheets and quads are recomputed for all
/// planes, which is cheap, since they only depend on signs.
class FineContour {
 public:
  /// \param keep  true: stores data for update(): 16 bytes per edge, 6 bits per voxel
  FineContour(cl::Context& context, const ContourOptions& options, bool with_qefs, bool keep,
              std::size_t slab_bytes)
      : context_(context),
        options_(options),
        slab_bytes_(slab_bytes),
        with_qefs_(with_qefs),
        keeps_state_(keep) {}

  /// \param voxel_planes  voxel planes that changed since the last call; ignored by the first call
  /// \returns the vertices that did not change
  /// \throws as contour(); the state is unchanged in that case
  UnchangedVertices update(const Volume& volume, const PlaneRange& voxel_planes,
                           ContourReport& report);

  const FineSurface& surface() const { return surface_; }
  FineSurface release_surface() { return std::move(surface_); }

 private:
  struct Kernels {
    cl::Kernel signs, crossings, vertices;
  };
  /// State after the last update, except the surface.
  struct State {
    std::optional<CellGrid> cells;
    /// Voxel signs before unreachable voxels were filled; empty if ContourOptions::outer_only is
    /// not set
    std::vector<std::uint64_t> signs;
    std::vector<std::uint32_t> plane_vertices;
    RawVector<kiln_volume_crossing> crossings;
    VoxelType type = VoxelType::f32;
    float iso = 0, outside = 0;
    double infinity_value = 0;
    bool not_finite = false;
  };
  Kernels kernels(const DeviceVoxels& voxels) const;
  /// Updates the signs.
  /// \returns the range of padded planes whose signs or voxels changed
  PlaneRange update_signs(const Volume& volume, const DeviceVoxels& voxels, DeviceSlab& slabs,
                          const Kernels& kernels, const kiln_volume_grid& grid,
                          const PlaneRange& voxel_planes, State& next, ContourReport& report) const;
  cl::Array<kiln_volume_crossing> compute_crossings(DeviceSlab& slabs, const Kernels& kernels,
                                                    const kiln_volume_grid& grid,
                                                    const PlaneRange& planes, State& next) const;
  bool needs_full_update(const DeviceVoxels& voxels) const;

  cl::Context& context_;
  ContourOptions options_;
  std::size_t slab_bytes_;
  bool with_qefs_, keeps_state_;
  State state_;
  FineSurface surface_;
};

}  // namespace kiln

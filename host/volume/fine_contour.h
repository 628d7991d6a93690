// The finest contour of a volume that changes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "volume/fine_surface.h"
#include "volume/hermite.h"
#include "volume/sheets.h"

namespace kiln {

/// Contours a volume, and again what is near the planes whose voxels changed. The surface is, to the bit,
/// what a fresh contour of the volume gives.
///
/// A crossing depends on the voxels up to three planes away, a vertex on its cell's crossings; all other
/// planes are copied. Sheets and quads are found anew, from signs alone.
class FineContour {
 public:
  /// \param keep  what update() needs: 16 bytes an edge, 6 bits a voxel
  FineContour(cl::Context& context, const ContourOptions& options, bool with_qefs, bool keep,
              std::size_t slab_bytes)
      : context_(context),
        options_(options),
        slab_bytes_(slab_bytes),
        with_qefs_(with_qefs),
        keep_(keep) {}

  /// \param voxel_planes  that changed since the last time; of no meaning the first time
  /// \throws as contour(); all is as before then
  KeptVertices update(const Volume& volume, const Planes& voxel_planes, ContourReport& report);

  const FineSurface& surface() const { return surface_; }
  FineSurface take() { return std::move(surface_); }

 private:
  struct Kernels {
    cl::Kernel signs, crossings, vertices;
  };
  /// State that the last update found, beside the surface.
  struct State {
    std::optional<CellGrid> cells;
    std::vector<std::uint64_t> signs;  ///< Before filling, where there is any
    std::vector<std::uint32_t> plane_vertices;
    RawVector<kiln_volume_crossing> crossings;
    VoxelType type = VoxelType::f32;
    float iso = 0, outside = 0;
    double infinite_inside = 0;
    bool not_finite = false;
  };
  Kernels kernels(const DeviceVoxels& voxels) const;
  /// Padded planes whose signs or voxels changed: first to last - 1.
  Planes find_signs_anew(const Volume& volume, const DeviceVoxels& voxels, Slabs& slabs,
                         const Kernels& kernels, const kiln_volume_grid& grid,
                         const Planes& voxel_planes, State& next, ContourReport& report) const;
  cl::Array<kiln_volume_crossing> cross(Slabs& slabs, const Kernels& kernels,
                                        const kiln_volume_grid& grid, const Planes& planes,
                                        State& next) const;
  bool all_changed(const DeviceVoxels& voxels) const;

  cl::Context& context_;
  ContourOptions options_;
  std::size_t slab_bytes_;
  bool with_qefs_, keep_;
  State state_;
  FineSurface surface_;
};

}  // namespace kiln

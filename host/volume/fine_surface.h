// The full-resolution contour of a volume: one vertex per sheet and cell, one quad per crossed edge.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cl/context.h"
#include "kiln/contour.h"
#include "shared/volume.h"
#include "volume/cell_grid.h"
#include "volume/raw_vector.h"

namespace kiln {

/// A crossed edge with the vertices of the four cells around it, counter-clockwise as seen from the edge's upper end:
/// at (u-1, v-1), (u, v-1), (u, v), (u-1, v), with u = (axis + 1) % 3 and v = (axis + 2) % 3. CellGrid::kNone if
/// there is no cell (at the volume's open border).
struct FineEdge {
  std::array<std::uint32_t, 4> vertices;
  /// Trailing zeros of the edge's padded u and v, 31 at 0: the cells on its two sides along u share an octree node from
  /// level u_level + 1 on, and likewise along v.
  std::uint8_t u_level;
  std::uint8_t v_level;
  std::uint8_t axis;
  /// 1: the solid is at the lower end, so the normal points along the axis
  std::uint8_t solid_at_lower_end;

  bool is_quad() const {
    return vertices[0] != CellGrid::kNone && vertices[1] != CellGrid::kNone &&
           vertices[2] != CellGrid::kNone && vertices[3] != CellGrid::kNone;
  }
};

/// A vertex with two neighbours through the same face, since its sheet bends back there. The two neighbours may
/// only be merged together with the vertex; otherwise an edge would have four faces.
struct ForkedVertex {
  std::uint32_t stem;
  std::array<std::uint32_t, 2> forked_neighbours;
};

/// PlaneRange first to last - 1, of voxels or of padded coordinates.
struct PlaneRange {
  std::uint32_t first = 0, last = 0;
};

/// Vertices that an update did not change: a prefix, with numbers below `before`, and a suffix, which started at
/// old_suffix_begin before the update and starts at new_suffix_begin now.
struct UnchangedVertices {
  std::uint32_t before = 0;
  std::uint32_t old_suffix_begin = 0, new_suffix_begin = 0;
  PlaneRange planes;  ///< Padded cell planes that may have changed
};

struct FineSurface {
  std::uint32_t cells = 0;
  std::uint64_t quads = 0;
  /// Packed keys of the vertices (see shared/volume.h), ordered by cell, plane by plane
  RawVector<std::uint64_t> keys;
  RawVector<kiln_volume_vertex> vertices;
  RawVector<kiln_volume_qef> qefs;  ///< Error function of each vertex; empty if not requested
  RawVector<FineEdge> edges;
  /// Vertices with two neighbours through one face; rare
  std::vector<ForkedVertex> forked_vertices;
  bool is_left_handed = false;  ///< The axes are left-handed: triangles must be reversed
};

/// \param with_qefs  keeps the vertices' error functions
/// \param slab_bytes  approximate size of the slabs in which voxels are copied to the device
FineSurface fine_surface(cl::Context& context, const Volume& volume, const ContourOptions& options,
                         bool with_qefs, ContourReport& report,
                         std::size_t slab_bytes = std::size_t{1} << 30);

}  // namespace kiln

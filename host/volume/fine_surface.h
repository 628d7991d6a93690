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
  /// Number of trailing zero bits of the edge's padded u coordinate, or 31 if the coordinate is 0.
  /// The cells on the two sides of the edge along u lie in the same octree node from level u_level
  /// + 1 upwards. v_level is the same for v.
  std::uint8_t u_level;
  std::uint8_t v_level;
  std::uint8_t axis;
  /// 1 if the solid is at the edge's lower end, so that the normal points along the positive axis
  std::uint8_t solid_at_lower_end;

  bool is_quad() const {
    return vertices[0] != CellGrid::kNone && vertices[1] != CellGrid::kNone &&
           vertices[2] != CellGrid::kNone && vertices[3] != CellGrid::kNone;
  }
};

/// A vertex whose sheet crosses one face of its cell in two lines (SheetTable::doubled_face()), so
/// that two of its neighbours lie beyond the same face. These two may only be merged with each
/// other if the vertex is merged with them, too; otherwise an edge would have four faces.
struct DoubledFaceVertex {
  std::uint32_t vertex;
  std::array<std::uint32_t, 2> neighbours;
};

/// A range of planes of voxels or of padded voxels: `first` to `last` - 1.
struct PlaneRange {
  std::uint32_t first = 0, last = 0;
};

/// Vertices that an update did not change: a prefix, with numbers below `prefix_end`, and a suffix,
/// whose first vertex had the number old_suffix_begin before the update and has new_suffix_begin
/// now.
struct UnchangedVertices {
  std::uint32_t prefix_end = 0;
  std::uint32_t old_suffix_begin = 0, new_suffix_begin = 0;
  PlaneRange planes;  ///< Planes of padded cells that may have changed
};

struct FineSurface {
  std::uint32_t cells = 0;
  std::uint64_t quads = 0;
  /// Packed keys of the vertices (see shared/volume.h), ordered by cell, plane by plane
  RawVector<std::uint64_t> keys;
  RawVector<kiln_volume_vertex> vertices;
  RawVector<kiln_volume_qef> qefs;  ///< Error function of each vertex; empty if not requested
  RawVector<FineEdge> edges;
  /// Vertices at doubled faces, which are rare
  std::vector<DoubledFaceVertex> doubled_face_vertices;
  /// True if the volume's axes are left-handed, so that triangles must be reversed
  bool is_left_handed = false;
};

/// \param with_qefs  true: keeps the error function of each vertex
/// \param slab_bytes  approximate size in bytes of the slabs in which voxels are copied to the
///   device
FineSurface fine_surface(cl::Context& context, const Volume& volume, const ContourOptions& options,
                         bool with_qefs, ContourReport& report,
                         std::size_t slab_bytes = std::size_t{1} << 30);

}  // namespace kiln

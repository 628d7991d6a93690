// The finest contour of a volume: a vertex a sheet and cell, a quad a crossed edge.
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

/// A crossed edge: the vertices of the four cells around it, counter-clockwise seen from the end of its
/// axis: at (u-1, v-1), (u, v-1), (u, v), (u-1, v), with u = (axis + 1) % 3 and v = (axis + 2) % 3.
/// CellGrid::kNone where there is no cell (the volume's open border).
struct FineEdge {
  std::array<std::uint32_t, 4> vertices;
  std::uint8_t u_level;  ///< Trailing zeros of the edge's padded u: cells on its two sides are in
  std::uint8_t v_level;  ///< the same node of the octree from level u_level + 1 on; 31 at u = 0
  std::uint8_t axis;
  std::uint8_t rises;  ///< 1: the solid is at its lower end, so the normal points along the axis

  bool is_quad() const {
    return vertices[0] != CellGrid::kNone && vertices[1] != CellGrid::kNone &&
           vertices[2] != CellGrid::kNone && vertices[3] != CellGrid::kNone;
  }
};

/// A vertex that meets two others through the same face, since its sheet bends back there: these two must not
/// become one vertex unless it joins them, or an edge would have four faces.
struct FineFork {
  std::uint32_t stem;
  std::array<std::uint32_t, 2> branches;
};

/// Planes first to last - 1, of voxels or of padded places.
struct Planes {
  std::uint32_t first = 0, last = 0;
};

/// Vertices that an update left as they were: vertices below `before`, and from new_after on vertices that were
/// from old_after on.
struct KeptVertices {
  std::uint32_t before = 0;
  std::uint32_t old_after = 0, new_after = 0;
  Planes planes;  ///< Planes of cells, padded: outside of these nothing changed
};

struct FineSurface {
  std::uint32_t cells = 0;
  std::uint64_t quads = 0;
  RawVector<std::uint64_t> keys;  ///< Per vertex, shared/volume.h; by cell, plane after plane
  RawVector<kiln_volume_vertex> vertices;
  RawVector<kiln_volume_qef> qefs;  ///< Empty where not asked for
  RawVector<FineEdge> edges;
  std::vector<FineFork> forks;  ///< Few
  bool mirrored = false;        ///< The axes are left-handed: triangles must be turned round
};

/// \param with_qefs  keep the vertices' error functions
/// \param slab_bytes  voxels are taken to the device in slabs of about so many bytes
FineSurface fine_surface(cl::Context& context, const Volume& volume, const ContourOptions& options,
                         bool with_qefs, ContourReport& report,
                         std::size_t slab_bytes = std::size_t{1} << 30);

}  // namespace kiln

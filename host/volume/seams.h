// Which charts of a volume's map meet where.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume.h"

namespace kiln {

/// Corners and sides are numbered 4 chart + corner; the side starts at that corner.
struct Seams {
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  /// Corners at vertex v of the low poly: corner_members[corner_begins[v]] to [corner_begins[v + 1] - 1].
  std::vector<std::uint32_t> corner_begins, corner_members;
  std::vector<std::uint32_t> edges;  ///< Per side; kNone where a chart has no such side
  /// Sides at an edge, as corners at a vertex.
  std::vector<std::uint32_t> edge_begins, edge_members;
};

/// Texels on a chart's sides, the ends of each included.
std::uint32_t ring_texels(const kiln_volume_chart& chart);

/// \param vertices  of the low poly
Seams find_seams(std::span<const kiln_volume_chart> charts, std::size_t vertices);

}  // namespace kiln

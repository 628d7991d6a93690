// Tracks which edges of a surface are glued, and each chart's border as a ring of half-edges.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Charts as topological discs whose borders are rings of half-edges. At first, each triangle is a disc of its own. Two
/// discs are joined along one run of shared border edges. Shared edges outside of that run stay open, as a seam within
/// the chart. The union is therefore a disc, whatever the topology of the surface.
class ChartBorders {
 public:
  explicit ChartBorders(const ChartSurface& surface);

  /// A run of `count` consecutive half-edges of one border, from `first` to `last`, with their total length. The
  /// opposite half-edges (mates) lie in reverse order on another chart's border.
  struct Run {
    std::uint32_t first = 0, last = 0, count = 0;
    double length = 0;
  };
  /// The longest run through half-edge h, which must be open and have a mate in another chart.
  Run run_through(std::uint32_t h) const;

  /// Glues the edges of a run. Then glues each pair of opposite half-edges that have thereby become neighbours on the
  /// ring.
  /// \param count_a, count_b  lengths of the two borders in half-edges
  /// \param glued   [out] one half-edge of every glued edge, for open_edges()
  /// \returns a half-edge of the new border; kNoIndex, with nothing changed, if the border would have fewer than 3
  /// half-edges
  std::uint32_t glue(const Run& run, std::uint32_t count_a, std::uint32_t count_b,
                     std::vector<std::uint32_t>& glued);

  /// Opens edges that glue() glued, and repairs the rings at their end points.
  void open_edges(const std::vector<std::uint32_t>& edges);
  /// Rebuilds the ring that starts at an open half-edge. \returns its number of half-edges.
  std::uint32_t trace(std::uint32_t h);

  bool is_glued(std::uint32_t h) const { return glued_[h] != 0; }
  const std::vector<std::uint8_t>& glued() const { return glued_; }
  std::uint32_t next(std::uint32_t h) const { return next_[h]; }
  std::uint32_t previous(std::uint32_t h) const { return previous_[h]; }

  /// Marks both half-edges of an edge as glued or open. Does not update the rings.
  void set_glued(std::uint32_t h, bool value) { glued_[h] = glued_[surface_.mate[h]] = value; }
  /// Makes b the successor of a on a ring.
  void connect(std::uint32_t a, std::uint32_t b) {
    next_[a] = b;
    previous_[b] = a;
  }
  /// Restores a saved state (glued or open) of all edges. Does not update the rings.
  void restore(std::vector<std::uint8_t> glued) { glued_ = std::move(glued); }

 private:
  const ChartSurface& surface_;
  std::vector<std::uint8_t> glued_;
  std::vector<std::uint32_t> next_, previous_;
};

}  // namespace kiln

// Glued edges of a surface, and the border of every chart as a ring of half-edges.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Charts as topological discs whose borders are rings of half-edges. At first, each triangle is a disc. Two discs are
/// joined along one run of shared border edges; shared edges outside of the run stay open, as a seam inside the chart.
/// So the union is a disc for every topology of the surface.
class ChartBorders {
 public:
  explicit ChartBorders(const ChartSurface& surface);

  /// A run of `count` consecutive half-edges of one border, starting at `first`. Their mates lie on another chart's
  /// border in the opposite order.
  struct Run {
    std::uint32_t first = 0, last = 0, count = 0;
    double length = 0;
  };
  /// The longest run through half-edge h, which must be open and have a mate in another chart.
  Run run_through(std::uint32_t h) const;

  /// Glues the edges of a run, then also glues every pair of mates that have become neighbours on the ring.
  /// \param charts  lengths of the two borders in half-edges
  /// \param glued   [out] one half-edge of every glued edge, for unglue()
  /// \returns a half-edge of the new border; kNoIndex, with nothing changed, if the border would have fewer than 3
  /// half-edges
  std::uint32_t glue(const Run& run, std::uint32_t count_a, std::uint32_t count_b,
                     std::vector<std::uint32_t>& glued);

  /// Opens glued edges and repairs the rings at their end points.
  void unglue(const std::vector<std::uint32_t>& edges);
  /// Rebuilds the ring that starts at an open half-edge. \returns its number of half-edges.
  std::uint32_t trace(std::uint32_t h);

  bool is_glued(std::uint32_t h) const { return glued_[h] != 0; }
  const std::vector<std::uint8_t>& glued() const { return glued_; }
  std::uint32_t next(std::uint32_t h) const { return next_[h]; }
  std::uint32_t previous(std::uint32_t h) const { return previous_[h]; }

  /// Sets both half-edges of an edge; does not update rings.
  void set_glued(std::uint32_t h, bool value) { glued_[h] = glued_[surface_.mate[h]] = value; }
  /// Makes b the successor of a on a ring.
  void connect(std::uint32_t a, std::uint32_t b) {
    next_[a] = b;
    previous_[b] = a;
  }
  /// Restores a saved state of glued edges; does not update rings.
  void restore(std::vector<std::uint8_t> glued) { glued_ = std::move(glued); }

 private:
  const ChartSurface& surface_;
  std::vector<std::uint8_t> glued_;
  std::vector<std::uint32_t> next_, previous_;
};

}  // namespace kiln

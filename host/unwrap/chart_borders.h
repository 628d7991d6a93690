// Which edges are glued, and the border of every chart as a ring of half-edges.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Discs whose borders are rings. They start as single triangles; two become one along a run of edges
/// that both have. Edges that they share beyond the run stay open, as a seam inside the chart. So a disc
/// stays a disc, whatever the surface is.
class ChartBorders {
 public:
  explicit ChartBorders(const ChartSurface& surface);

  /// A run of `count` half-edges of one border, from `first` on, whose mates lie in another's in the
  /// opposite order.
  struct Run {
    std::uint32_t first = 0, last = 0, count = 0;
    double length = 0;
  };
  /// The longest run through half-edge h, which is open and has a mate in another chart.
  Run run_through(std::uint32_t h) const;

  /// Glues along a run, then every pair of mates that has become neighbours.
  /// \param charts  half-edges counts of the two borders
  /// \param glued   [out] what was glued: one half-edge of every pair, to be taken back
  /// \returns a half-edge of the new border; kNoIndex, with nothing done, where fewer than 3 would
  ///          be left of it
  std::uint32_t glue(const Run& run, std::uint32_t count_a, std::uint32_t count_b,
                     std::vector<std::uint32_t>& glued);

  /// Opens edges again and mends the rings around them.
  void unglue(const std::vector<std::uint32_t>& edges);
  /// Makes the ring that starts at an open half-edge anew. \returns its number of half-edges.
  std::uint32_t trace(std::uint32_t h);

  bool is_glued(std::uint32_t h) const { return glued_[h] != 0; }
  const std::vector<std::uint8_t>& glued() const { return glued_; }
  std::uint32_t next(std::uint32_t h) const { return next_[h]; }
  std::uint32_t previous(std::uint32_t h) const { return previous_[h]; }

  /// Marks both sides of an edge; rings are as they were.
  void set_glued(std::uint32_t h, bool value) { glued_[h] = glued_[surface_.mate[h]] = value; }
  /// Lets b follow a on a ring.
  void connect(std::uint32_t a, std::uint32_t b) {
    next_[a] = b;
    previous_[b] = a;
  }
  /// Glues as before; rings are as they were.
  void restore(std::vector<std::uint8_t> glued) { glued_ = std::move(glued); }

 private:
  const ChartSurface& surface_;
  std::vector<std::uint8_t> glued_;
  std::vector<std::uint32_t> next_, previous_;
};

}  // namespace kiln

// The chart borders of a UV layout, which must not cross each other.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "simplify/layout_copies.h"

namespace kiln {

/// A grid over the layout that holds the corners of all chart borders. Charts that overlap from the start without being
/// copies may overlap further.
class LayoutBorders {
 public:
  /// \param corners  indices into uvs, for each triangle
  /// \param on_border  for each UV, 1 if it lies on a chart's border
  /// \param copies  which of these corners are copies; must outlive this object
  LayoutBorders(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                std::span<const std::uint32_t> charts, const std::vector<std::uint8_t>& on_border,
                const LayoutCopies& copies);

  /// True if no corner of another border lies in the triangle (before, gone, after), which a border sweeps when the
  /// corner `gone` is removed from it. This test suffices if no borders cross: a border without a corner in the
  /// triangle could only enter it and leave through the triangle's two old sides.
  bool may_remove(std::span<const Vec2> uvs, std::uint32_t before, std::uint32_t gone,
                  std::uint32_t after) const;

  /// Removes a corner from its border.
  void remove(std::uint32_t uv);

 private:
  void find_overlaps(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                     std::span<const std::uint32_t> charts);
  std::uint32_t column(float u) const;
  std::uint32_t row(float v) const;

  /// Border corners at one position that are copies of each other. Usually one of them represents all.
  struct BorderPosition {
    std::uint32_t first = 0, count = 0;  ///< Range in border_corners_ of the corners that remain
  };

  const LayoutCopies* copies_;
  std::vector<std::uint32_t> chart_of_uv_;  ///< Chart of each UV
  /// For each chart, its group; charts that overlap each other form one group
  std::vector<std::uint32_t> chart_group_;
  std::vector<std::uint8_t> overlapping_;  ///< For each group, 1 if its charts overlap each other
  Vec2 low_{}, size_{1, 1};
  std::uint32_t cells_per_side_ = 1;  ///< Number of cells along a side of the grid
  /// For each cell of the grid, its first position in border_positions_; one extra entry at the end
  std::vector<std::uint32_t> first_position_of_cell_;
  std::vector<BorderPosition> border_positions_;
  std::vector<std::uint32_t> border_corners_;  ///< UVs of the border corners, grouped by position
  /// For each UV on a border, its index in border_positions_
  std::vector<std::uint32_t> position_of_uv_;
  /// For each UV, its index in border_corners_; kNoIndex if it is not on a border
  std::vector<std::uint32_t> index_of_uv_;
};

}  // namespace kiln

// Chart borders in a UV layout, to keep charts from overlapping.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "simplify/layout_copies.h"

namespace kiln {

/// A grid over the layout that holds the corners of chart borders. Charts that overlap from the start without being
/// copies may overlap further.
class LayoutBorders {
 public:
  /// \param corners  indices into uvs, by triangle
  /// \param on_border  by UV, 1 on a chart's border
  /// \param copies  copies among these corners; must outlive this object
  LayoutBorders(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                std::span<const std::uint32_t> charts, const std::vector<std::uint8_t>& on_border,
                const LayoutCopies& copies);

  /// True if the triangle (before, gone, after), which a border sweeps when it skips `gone`, holds no corner of
  /// another border. This suffices if no borders cross: a border that enters the triangle without a corner in it
  /// would have to leave through one of the old sides.
  bool free(std::span<const Vec2> uvs, std::uint32_t before, std::uint32_t gone,
            std::uint32_t after) const;

  /// Removes a corner from its border.
  void remove(std::uint32_t uv);

 private:
  void find_overlaps(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                     std::span<const std::uint32_t> charts);
  std::uint32_t column(float u) const;
  std::uint32_t row(float v) const;

  /// Corners at one position that are copies of each other; usually one of them represents all.
  struct BorderPosition {
    std::uint32_t first = 0, count = 0;  ///< Range of remaining border corners in border_corners_.
  };

  const LayoutCopies* copies_;
  std::vector<std::uint32_t> chart_of_uv_;  ///< Chart of each UV.
  std::vector<std::uint32_t> chart_group_;  ///< Charts that overlap each other form one group.
  std::vector<std::uint8_t> overlapping_;   ///< By group, 1 if its charts overlap each other
  Vec2 low_{}, size_{1, 1};
  std::uint32_t cells_per_side_ = 1;  ///< Cells along a side of the grid.
  std::vector<std::uint32_t>
      first_place_of_cell_;  ///< First place of each grid cell; one extra entry at the end
  std::vector<BorderPosition> border_places_;
  std::vector<std::uint32_t> border_corners_;  ///< UVs of border corners, grouped by place.
  std::vector<std::uint32_t> place_of_uv_;     ///< Place of each UV on a border.
  std::vector<std::uint32_t>
      index_of_uv_;  ///< By UV, its index in border_corners_; kNoIndex: not on a border.
};

}  // namespace kiln

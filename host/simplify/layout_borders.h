// Chart borders in a UV layout, so that no chart is drawn over another.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "simplify/layout_copies.h"

namespace kiln {

/// Corners of chart borders in a grid over the layout. Charts that overlap from the start, not as
/// copies, are not held apart from each other.
class LayoutBorders {
 public:
  /// \param corners  indices into uvs, by triangle
  /// \param on_border  by UV: whether it lies on a chart's border
  /// \param copies  of the same corners; outlives this
  LayoutBorders(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                std::span<const std::uint32_t> charts, const std::vector<std::uint8_t>& on_border,
                const LayoutCopies& copies);

  /// A border that goes from `before` straight to `after`, without `gone` between them, sweeps over a
  /// triangle. Whether no corner of a border lies in it. That is enough where no borders cross:
  /// what entered the triangle would have to leave it through one of the old sides.
  bool free(std::span<const Vec2> uvs, std::uint32_t before, std::uint32_t gone,
            std::uint32_t after) const;

  /// A corner is no longer on a border.
  void remove(std::uint32_t uv);

 private:
  void find_overlaps(std::span<const Vec2> uvs, std::span<const Triangle> corners,
                     std::span<const std::uint32_t> charts);
  std::uint32_t column(float u) const;
  std::uint32_t row(float v) const;

  /// Corners at one place that are copies of each other: mostly, one of them answers for all.
  struct Place {
    std::uint32_t first = 0, count = 0;  ///< Range in items_ of those that are still on a border.
  };

  const LayoutCopies* copies_;
  std::vector<std::uint32_t> chart_;       ///< By UV.
  std::vector<std::uint32_t> group_;       ///< By chart: those that overlap each other are in one.
  std::vector<std::uint8_t> overlapping_;  ///< By group.
  Vec2 low_{}, size_{1, 1};
  std::uint32_t side_ = 1;            ///< Cells of the grid.
  std::vector<std::uint32_t> start_;  ///< By cell, and one more: its first place.
  std::vector<Place> places_;
  std::vector<std::uint32_t> items_;     ///< UVs, by place.
  std::vector<std::uint32_t> place_of_;  ///< By UV; of those on borders.
  std::vector<std::uint32_t> index_of_;  ///< By UV: where it is in items_; kNoIndex: on no border.
};

}  // namespace kiln

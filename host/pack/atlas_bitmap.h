// Rasterises chart outlines as masks at one scale and packs them one after another into a square of cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "pack/outline_mask.h"

namespace kiln {

/// An outline's place in the atlas: turned, scaled and moved, in texels.
struct OutlinePlace {
  Vec2d turn{1, 0};  ///< Cosine and sine.
  Vec2d shift;
};

/// The order in which outlines are placed.
struct PackOrder {
  std::vector<std::uint32_t> order;
  std::vector<std::int8_t> turn;  ///< The only turn of an outline, or -1 for any.
};

/// The result of packing in one order.
struct Packed {
  double left_out = 0;                 ///< Area of the outlines that found no place.
  std::vector<std::uint32_t> refused;  ///< These outlines.
  std::uint32_t height = 0;            ///< Rows.
  double weight = 0;                   ///< Sum of area by top.
  std::vector<OutlinePlace> places;
  std::vector<std::int8_t> turn;  ///< Rotation that each outline got, or -1.
  std::vector<std::uint32_t> x, y;
};

/// Outlines drawn at one scale, at all turns.
struct AtlasBitmap {
  static constexpr std::uint32_t kTurns = 16;

  std::uint32_t cells = 0;
  double scale = 0;  ///< Cells per unit.
  std::vector<ChartMask> masks;

  const ChartMask& mask(std::uint32_t outline, std::int8_t turn) const {
    return masks[std::size_t{outline} * kTurns + static_cast<std::size_t>(turn)];
  }
};

/// A random number in [0, n), the same on every machine.
inline std::uint32_t random_below(std::mt19937& random, std::size_t n) {
  return static_cast<std::uint32_t>(random() % n);
}

/// Draws outlines at any scale, and packs what it drew.
class AtlasPacker {
 public:
  static constexpr std::uint32_t kTurns = AtlasBitmap::kTurns;

  /// \param outlines  viewed, not copied
  /// \param size      texels of a side
  /// \param padding   texels between two outlines
  /// \param angles    of each outline's first turn; empty: that of its smallest box
  AtlasPacker(std::span<const Outline> outlines, std::uint32_t size, double padding,
              std::vector<double> angles = {});

  std::span<const Outline> outlines() const { return outlines_; }
  const std::vector<double>& angles() const { return angles_; }
  /// The sum of all.
  double area() const { return area_; }
  /// At how many of the turns an outline is drawn: large ones decide, small ones find gaps at few.
  std::uint32_t turns_of(std::uint32_t outline) const { return turns_of_[outline]; }

  /// \param scale  cells per unit
  AtlasBitmap draw(std::uint32_t cells, double scale) const;

  /// Each outline goes to the free place where its top is lowest. What finds none is left out.
  /// \param most  area that may be left out; beyond, the rest is not tried, and left_out is above it
  /// \param done  places of the first `same` outlines of the order on this sheet, kept as they are. Turns of
  ///              the others are looked at first: that is quicker where they are good
  Packed pack(const AtlasBitmap& sheet, const PackOrder& order,
              double most = std::numeric_limits<double>::infinity(), const Packed* done = nullptr,
              std::size_t same = 0) const;

 private:
  void note(const AtlasBitmap& sheet, std::uint32_t outline, Packed& packed) const;

  std::span<const Outline> outlines_;
  std::uint32_t size_;
  double padding_, area_ = 0;
  std::vector<double> angles_;
  std::vector<std::uint32_t> turns_of_;
};

}  // namespace kiln

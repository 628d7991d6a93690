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

/// An outline's transform into the atlas: rotation, then scale, then translation in texels.
struct OutlinePlace {
  Vec2d turn{1, 0};  ///< Cosine and sine of the rotation
  Vec2d shift{};
};

/// The order in which outlines are placed.
struct PackOrder {
  std::vector<std::uint32_t> order;
  std::vector<std::int8_t> turn;  ///< Fixed rotation of each outline, or -1 if any is allowed
};

/// The result of placing outlines in one order.
struct PackedOutlines {
  /// Total area of the outlines that did not fit.
  double left_out_area = 0;
  /// Indices of the outlines that did not fit.
  std::vector<std::uint32_t> left_out_outlines;
  std::uint32_t height = 0;  ///< Number of used rows
  /// Sum of (area * top row) over all outlines; a lower sum means a more compact packing.
  double height_weight = 0;
  std::vector<OutlinePlace> places;
  std::vector<std::int8_t> turn;  ///< Rotation of each placed outline, or -1.
  std::vector<std::uint32_t> x, y;
};

/// Masks of all outlines at one scale and all rotations.
struct AtlasBitmap {
  static constexpr std::uint32_t kRotations = 16;

  std::uint32_t cells = 0;
  double scale = 0;  ///< Cells per unit of the outlines
  std::vector<ChartMask> masks;

  const ChartMask& mask(std::uint32_t outline, std::int8_t turn) const {
    return masks[std::size_t{outline} * kRotations + static_cast<std::size_t>(turn)];
  }
};

/// A random number in [0, n), identical on every platform.
inline std::uint32_t random_below(std::mt19937& random, std::size_t n) {
  return static_cast<std::uint32_t>(random() % n);
}

/// Rasterises outlines at any scale, and places the masks.
class AtlasPacker {
 public:
  static constexpr std::uint32_t kRotations = AtlasBitmap::kRotations;

  /// \param outlines  outlines, which must outlive this object
  /// \param size  side of the atlas in texels
  /// \param padding   distance between two outlines in texels
  /// \param angles  each outline's first rotation in radians; if empty, the rotations of the smallest bounding boxes
  AtlasPacker(std::span<const Outline> outlines, std::uint32_t size, double padding,
              std::vector<double> angles = {});

  std::span<const Outline> outlines() const { return outlines_; }
  const std::vector<double>& angles() const { return angles_; }
  /// Total area of all outlines.
  double area() const { return area_; }
  /// Number of rotations at which an outline is rasterised. Large outlines are rasterised at all rotations, since
  /// they determine the result; for small ones, few rotations suffice.
  std::uint32_t rotation_count(std::uint32_t outline) const { return rotation_counts_[outline]; }

  /// \param scale  cells per unit of the outlines
  AtlasBitmap draw(std::uint32_t cells, double scale) const;

  /// Places each outline at the position at which its top is lowest. Outlines that fit nowhere are left out.
  /// \param max_left_out_area packing stops as soon as the total area of left-out outlines exceeds
  ///   this
  /// \param done an earlier result on this sheet. The first `same` outlines of the order keep their places of that
  ///     result. The rotations that the other outlines have in that result are tried first, which saves time if
  ///     they are good
  PackedOutlines pack(const AtlasBitmap& sheet, const PackOrder& order,
                      double max_left_out_area = std::numeric_limits<double>::infinity(),
                      const PackedOutlines* done = nullptr, std::size_t same = 0) const;

 private:
  void record_place(const AtlasBitmap& sheet, std::uint32_t outline, PackedOutlines& packed) const;

  std::span<const Outline> outlines_;
  std::uint32_t size_;
  double padding_, area_ = 0;
  std::vector<double> angles_;
  std::vector<std::uint32_t> rotation_counts_;
};

}  // namespace kiln

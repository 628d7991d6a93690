// Packing made denser by pressing: outlines drawn larger overlap, and move until none does.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "lowpoly/chart_sheet.h"

namespace kiln {

/// Outlines on a sheet that is a little too small for where they lie.
///
/// Those that overlap others move, one after another, to where they overlap least: near by, or where some random
/// places promise most. What goes on overlapping weighs more and more (guided local search; Umetani et al. 2009,
/// Egeblad et al. 2007), so that it is the others that give way. Each row keeps the running sum of the weights
/// on its cells: what a run of cells overlaps is a difference of two.
class PackingPress {
 public:
  /// \param sheets   viewed, as is the sheet
  /// \param samples  random places that a move looks at; 0: an outline keeps its turn and stays near by
  PackingPress(const ChartSheets& sheets, const Sheet& sheet, std::uint32_t samples,
               std::mt19937& random);

  /// Starts from the places on another sheet: each outline's middle stays where it was.
  /// \returns false where one is larger than the sheet
  bool begin(const Sheet& from, const Packed& packed);

  /// Moves outlines until none overlaps, so many times at most. \returns whether none does
  bool run(std::uint32_t moves);

  /// Of outlines that do not overlap.
  Packed packed() const;

 private:
  struct Spot {
    std::uint32_t turn = 0, x = 0, y = 0;
  };
  struct Found {
    std::int64_t overlap = 0;
    Spot spot;
  };

  /// Where sums before and after a run of cells stand, from those of a mask's lower left corner.
  struct RunSums {
    std::uint32_t before = 0, after = 0;
  };

  const ChartMask& mask_of(std::uint32_t outline, std::uint32_t turn) const;
  void add(std::uint32_t outline, std::int32_t weight);
  std::int64_t overlap(std::uint32_t outline, const Spot& spot, std::int64_t most) const;
  void descend(std::uint32_t outline, std::uint32_t step, Found& found) const;
  void move(std::uint32_t outline);

  const ChartSheets& sheets_;
  const Sheet& sheet_;
  std::uint32_t samples_;
  std::mt19937& random_;
  std::size_t stride_;
  std::vector<std::int32_t> sums_;       ///< Of each row, the weights on the cells before each.
  std::vector<RunSums> run_sums_;        ///< Of all masks, in their order.
  std::vector<std::size_t> first_sums_;  ///< Of each mask, among these.
  std::vector<Spot> spots_;
  std::vector<std::int32_t> weights_;
  std::vector<std::vector<std::uint32_t>> turns_;  ///< At which each is drawn.
};

}  // namespace kiln

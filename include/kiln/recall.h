#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// What a bake leaves out of the dense mesh, which no measure over the light mesh can tell: of all that
/// views from outside show of the dense mesh near the light one, the share that no sample stands for.
///
/// Places lie evenly over the dense mesh's area. A place counts where it lies within the match's distance
/// of the light mesh, where its face is turned by less than 60 degrees against the light mesh's there (a
/// map along that normal cannot hold steeper ones), and by how much of it 64 directions all around see past
/// the dense mesh: the sum of their cosines, which is how many pixels of pictures would show it. A sample
/// stands for a place where its point lies within one and a half samples' steps of it, and its face does
/// not look the other way. Layers closer than that are one.
struct RecallReport {
  std::uint64_t places = 0;       ///< That counted
  double lost = 0;                ///< Share that no sample stands for, 0 to 1
  double largest = 0;             ///< Share of the largest connected part of it, 0 to 1
  std::array<double, 3> where{};  ///< A place in the middle of that part, world units
};

/// Per vertex of the dense mesh: whether a sample stands for it.
enum class Recalled : std::uint8_t {
  beside,  ///< Does not count: unseen, steep, or not near the light mesh
  held,    ///< A sample stands for it
  lost,    ///< None does
};

}  // namespace kiln

// Packing of whole-numbered rectangles into a square.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kiln {

struct PackSize {
  std::uint32_t width = 0, height = 0;
};

/// A rectangle's place: its lower left corner; if turned, its width runs along y.
struct PackPlace {
  std::uint32_t x = 0, y = 0;
  bool turned = false;
};

/// Places rectangles without overlap in [0, side] x [0, side], turning them by a quarter where that
/// helps. Up to 8,192 of them go onto a skyline, each where its top ends up lowest (Jylänki 2010, "A
/// Thousand Ways to Pack the Bin", section 5), highest first. More go onto shelves sorted by height.
/// This wastes little once there are many of them, and costs n log n.
///
/// \param sizes   every side at least 1
/// \param places  [out] one a rectangle; undefined where the answer is false
/// \returns whether they all fit, by these rules. Deterministic.
bool pack_rectangles(std::span<const PackSize> sizes, std::uint32_t side,
                     std::vector<PackPlace>& places);

}  // namespace kiln

// Packs rectangles with integer sides into a square.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kiln {

struct PackSize {
  std::uint32_t width = 0, height = 0;
};

/// A rectangle's lower left corner; if `turned`, its width is along y.
struct PackPlace {
  std::uint32_t x = 0, y = 0;
  bool turned = false;
};

/// Places rectangles without overlap in [0, side] x [0, side], rotated by 90 degrees if that helps. First tries
/// shelves sorted by height, in O(n log n), whose waste is small for large numbers. If that fails, up to 8,192
/// rectangles are placed onto a skyline, longest side first, each at the position at which its lower side is lowest
/// (Jylänki 2010, "A Thousand Ways to Pack the Bin", section 5).
///
/// \param sizes  all sides at least 1
/// \param places  [out] one per rectangle; undefined if the result is false
/// \returns true if all rectangles were placed. Deterministic.
bool pack_rectangles(std::span<const PackSize> sizes, std::uint32_t side,
                     std::vector<PackPlace>& places);

}  // namespace kiln

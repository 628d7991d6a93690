// Letters as strokes, for labels in pictures.
#pragma once

#include <string_view>

namespace kiln::cli {

/// A letter on a grid: lines from y = 0 (as deep as a "g") over 2 (where letters stand) and 6 (as high as an
/// "x") to 8 (as high as an "X").
struct Glyph {
  int width = 0;  ///< Largest x; the next letter begins kGlyphGap further
  /// Lines, apart by spaces: two digits a point, x and y. A line of one point twice is a dot.
  std::string_view lines;
};

constexpr double kGlyphGap = 2;

/// \returns a box for what is not printable ASCII
Glyph glyph_of(char letter);

}  // namespace kiln::cli

#include "picture/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace kiln::cli {
namespace {

/// A letter, drawn by strokes between points of a grid. Rows of the grid: 0 is the bottom of "g", 2 the baseline, 6 the
/// top of "x", 8 the top of "X".
struct Glyph {
  /// Rightmost column of the strokes; the next letter begins kGlyphGap columns further right
  int width = 0;
  /// Polylines, separated by spaces, with two digits per point: column and row. A dot is a line from a point to itself.
  std::string_view lines;
};

constexpr double kGlyphGap = 2;

constexpr Glyph kMissingGlyph = {4, "0208484202"};

// Glyphs of the ASCII characters 32 (space) to 126 ("~").
constexpr std::array<Glyph, 95> kGlyphs = {{
    {2, ""},
    {0, "0804 0202"},
    {1, "0806 1816"},
    {4, "1218 3238 0444 0646"},
    {4, "473817063544322203 2921"},
    {5, "0258 0818170708 4353524243"},
    {4, "4206071828370403122244"},
    {0, "0806"},
    {1, "18060411"},
    {1, "08161401"},
    {4, "2327 0446 0644"},
    {4, "0545 2327"},
    {1, "1201"},
    {3, "0535"},
    {0, "0202"},
    {4, "0248"},
    {4, "120307183847433212"},
    {2, "061812 0222"},
    {4, "07183847460242"},
    {4, "07183847463515 354443321203"},
    {4, "32380444"},
    {4, "480806364543321203"},
    {4, "473818070312324344351504"},
    {4, "084812"},
    {4, "15060718384746351504031232434435"},
    {4, "031232434738180706153546"},
    {0, "0202 0606"},
    {1, "1606 1201"},
    {3, "370533"},
    {3, "0434 0636"},
    {3, "073503"},
    {4, "07183847462524 2222"},
    {5, "443424252646554432120307184857"},
    {4, "022842 1434"},
    {4, "02083847463505 3544433202"},
    {4, "4738180703123243"},
    {4, "02082847432202"},
    {4, "48080242 0535"},
    {4, "480802 0535"},
    {4, "47381807031232434525"},
    {4, "0208 4248 0545"},
    {2, "1812 0828 0222"},
    {3, "3833221203"},
    {4, "0208 4805 1642"},
    {4, "080242"},
    {4, "0208254842"},
    {4, "02084248"},
    {4, "120307183847433212"},
    {4, "02083847463505"},
    {4, "120307183847433212 2442"},
    {4, "02083847463505 2542"},
    {4, "473818070615354443321203"},
    {4, "0848 2228"},
    {4, "080312324348"},
    {4, "082248"},
    {6, "0812365268"},
    {4, "0248 0842"},
    {4, "082548 2522"},
    {4, "08480242"},
    {1, "18080111"},
    {4, "0842"},
    {1, "08181101"},
    {4, "062846"},
    {4, "0141"},
    {1, "0817"},
    {4, "16364542 441403123243"},
    {4, "0802 0516364543321203"},
    {4, "4536160503123243"},
    {4, "4842 4536160503123243"},
    {4, "04444536160503123243"},
    {3, "38281712 0636"},
    {4, "4536160503123243 4641301001"},
    {4, "0802 0516364542"},
    {0, "0206 0808"},
    {1, "161100 1818"},
    {3, "0802 3604 1532"},
    {1, "080312"},
    {6, "0602 0516263532 3546566562"},
    {4, "0602 0516364542"},
    {4, "120305163645433212"},
    {4, "0600 0516364543321203"},
    {4, "4640 4536160503123243"},
    {3, "0602 05162636"},
    {4, "45361605143443321203"},
    {3, "18132232 0636"},
    {4, "0603123243 4642"},
    {4, "062246"},
    {6, "0612355266"},
    {4, "0246 0642"},
    {4, "0622 461000"},
    {4, "06460242"},
    {2, "28171605140322"},
    {0, "0009"},
    {2, "0817161514130201"},
    {4, "04153544"},
}};

Glyph glyph_of(char letter) {
  const int index = static_cast<unsigned char>(letter) - ' ';
  if (index < 0 || index >= static_cast<int>(kGlyphs.size())) return kMissingGlyph;
  return kGlyphs[static_cast<std::size_t>(index)];
}

constexpr double kGridRowsPerLine = 10;  // number of grid rows in a line of text

/// True if a byte starts a UTF-8 character.
bool starts_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

}  // namespace

double text_width(const std::string& text, double height) {
  double grid_units = 0;
  for (const char letter : text) {
    if (starts_character(letter)) grid_units += glyph_of(letter).width + kGlyphGap;
  }
  return std::max(0.0, grid_units - kGlyphGap) * height / kGridRowsPerLine;
}

Canvas::Canvas(std::uint32_t width, std::uint32_t height, const Colour& background)
    : image_{width, height, 3, {}} {
  image_.pixels.resize(std::size_t{width} * height * 3);
  fill(0, 0, width, height, background);
}

void Canvas::put(const Image& picture, std::int64_t left, std::int64_t top) {
  for (std::int64_t y = 0; y < picture.height; ++y) {
    if (top + y < 0 || top + y >= image_.height) continue;
    for (std::int64_t x = 0; x < picture.width; ++x) {
      if (left + x < 0 || left + x >= image_.width) continue;
      std::copy_n(picture.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y)), 3,
                  image_.at(static_cast<std::size_t>(left + x), static_cast<std::size_t>(top + y)));
    }
  }
}

void Canvas::fill(std::int64_t left, std::int64_t top, std::int64_t width, std::int64_t height,
                  const Colour& colour) {
  const auto clipped = [](std::int64_t value, std::uint32_t most) {
    return std::clamp<std::int64_t>(value, 0, most);
  };
  for (std::int64_t y = clipped(top, image_.height); y < clipped(top + height, image_.height);
       ++y) {
    for (std::int64_t x = clipped(left, image_.width); x < clipped(left + width, image_.width);
         ++x) {
      std::copy_n(colour.begin(), 3,
                  image_.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y)));
    }
  }
}

void Canvas::line(double x0, double y0, double x1, double y1, double width, const Colour& colour,
                  double share) {
  const double radius = width / 2, reach = radius + 1;
  const auto first = [&](double a, double b) {
    return static_cast<std::int64_t>(std::max(0.0, std::floor(std::min(a, b) - reach)));
  };
  const auto last = [&](double a, double b, std::uint32_t size) {
    return static_cast<std::int64_t>(
        std::min(static_cast<double>(size) - 1, std::ceil(std::max(a, b) + reach)));
  };
  const double dx = x1 - x0, dy = y1 - y0, square = dx * dx + dy * dy;
  for (std::int64_t y = first(y0, y1); y <= last(y0, y1, image_.height); ++y) {
    for (std::int64_t x = first(x0, x1); x <= last(x0, x1, image_.width); ++x) {
      const double px = static_cast<double>(x) + 0.5 - x0, py = static_cast<double>(y) + 0.5 - y0;
      const double along = square > 0 ? std::clamp((px * dx + py * dy) / square, 0.0, 1.0) : 0.0;
      const double distance = std::hypot(px - along * dx, py - along * dy);
      const auto cover = static_cast<float>(std::clamp(radius + 0.5 - distance, 0.0, 1.0) * share);
      if (!(cover > 0)) continue;
      float* pixel = image_.at(static_cast<std::size_t>(x), static_cast<std::size_t>(y));
      for (std::size_t c = 0; c < 3; ++c) pixel[c] += (colour[c] - pixel[c]) * cover;
    }
  }
}

void Canvas::text(double left, double top, const std::string& words, const Colour& colour,
                  double height) {
  const double unit = height / kGridRowsPerLine, width = std::max(1.2, 0.7 * unit);
  for (const char letter : words) {
    if (!starts_character(letter)) continue;
    const Glyph glyph = glyph_of(letter);
    const auto x = [&](std::size_t i) { return left + (glyph.lines[i] - '0') * unit; };
    const auto y = [&](std::size_t i) {
      return top + (kGridRowsPerLine - 0.5 - (glyph.lines[i + 1] - '0')) * unit;
    };
    for (std::size_t i = 0; i + 3 < glyph.lines.size(); i += 2) {
      if (glyph.lines[i] == ' ') ++i;
      if (glyph.lines[i + 2] == ' ') continue;
      line(x(i), y(i), x(i + 2), y(i + 2), width, colour);
    }
    left += (glyph.width + kGlyphGap) * unit;
  }
}

}  // namespace kiln::cli

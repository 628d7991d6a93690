#include "picture/canvas.h"

#include <algorithm>
#include <cmath>

#include "picture/strokes.h"

namespace kiln::cli {
namespace {

constexpr double kRows = 10;  // of a glyph's grid, in the height of a line

/// True if a byte begins a character of UTF-8.
bool begins(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

}  // namespace

double text_width(const std::string& text, double height) {
  double units = 0;
  for (const char letter : text) {
    if (begins(letter)) units += glyph_of(letter).width + kGlyphGap;
  }
  return std::max(0.0, units - kGlyphGap) * height / kRows;
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
  const double unit = height / kRows, width = std::max(1.2, 0.7 * unit);
  for (const char letter : words) {
    if (!begins(letter)) continue;
    const Glyph glyph = glyph_of(letter);
    const auto x = [&](std::size_t i) { return left + (glyph.lines[i] - '0') * unit; };
    const auto y = [&](std::size_t i) {
      return top + (kRows - 0.5 - (glyph.lines[i + 1] - '0')) * unit;
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

// Drawing into an image: rectangles, pictures, words, and colours for measured values.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "kiln/image.h"

namespace kiln::cli {

using Color = std::array<float, 3>;  ///< sRGB, [0, 1]

/// A colour for a value in [0, 1], from nearly black over violet and red to light yellow: evenly spaced in
/// perceived lightness (Ottosson 2020, "A perceptual color space for image processing": Oklab), so that equal
/// steps of value look equal and the order shows in grey too.
Color heat(double value);

class Canvas {
 public:
  Canvas(std::uint32_t width, std::uint32_t height, const Color& background);

  void fill(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
            const Color& color);
  /// An RGB picture, wholly inside.
  void place(const Image& picture, std::uint32_t x, std::uint32_t y);
  /// Lower-case letters (capitals become such), digits and . , : ' % ( ) - + = / ; of anything else a
  /// small box. \param x,y  left end of the base line, pixels \param height  of a digit, pixels
  void text(double x, double y, double height, const Color& color, std::string_view words);
  static double text_width(double height, std::string_view words);

  const Image& image() const { return image_; }

 private:
  void blend(std::uint32_t x, std::uint32_t y, float share, const Color& color);

  Image image_;
};

}  // namespace kiln::cli

// A canvas on which pictures are composed from panels, lines and labels.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "kiln/image_data.h"

namespace kiln::cli {

/// A colour with components in [0, 1], in the file's encoding
using Colour = std::array<float, 3>;
constexpr Colour kWhite = {1, 1, 1}, kTextColour = {0.13F, 0.13F, 0.13F};

/// Default height of a line of text in pixels, readable if the picture is shown unscaled.
constexpr double kTextHeight = 20;

/// Width of a text in pixels.
double text_width(const std::string& text, double height = kTextHeight);

/// An RGB picture to draw on. Coordinates are pixels from the top left corner; drawing is clipped to the picture.
class Canvas {
 public:
  Canvas(std::uint32_t width, std::uint32_t height, const Colour& background = kWhite);
  /// Creates a canvas on a picture of 3 channels.
  explicit Canvas(Image picture) : image_(std::move(picture)) {}

  void put(const Image& picture, std::int64_t left, std::int64_t top);
  void fill(std::int64_t left, std::int64_t top, std::int64_t width, std::int64_t height,
            const Colour& colour);
  /// Draws a line with round ends.
  /// \param width  width in pixels
  /// \param share  opacity in [0, 1]
  void line(double x0, double y0, double x1, double y1, double width, const Colour& colour,
            double share = 1);
  /// Draws a line of text. Characters outside ASCII become boxes. \param top  upper edge of the line of text
  void text(double left, double top, const std::string& words, const Colour& colour = kTextColour,
            double height = kTextHeight);

  Image take() { return std::move(image_); }

 private:
  Image image_;
};

}  // namespace kiln::cli

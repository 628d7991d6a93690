// Pictures of values on a mesh, for picture/plot.py.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "kiln/kiln.h"
#include "kiln/render.h"
#include "picture/plot.h"

namespace kiln::cli {

/// Pictures of one size below each other in one picture of 16 bits, cropped to what any of them shows.
class ValueTiles {
 public:
  /// Instead of a value.
  static constexpr double kBeside = -1, kNotKnown = -2, kFolded = -3;

  /// \param picture  one channel
  /// \param value  of a pixel: 0 or above, or one of those above
  /// \returns the tile as the script reads it
  Json add(const Image& picture, const std::function<double(float)>& value);

  /// A picture as it is, in grey. It does not count for cropping.
  Json add_gray(const Image& picture);

  /// Width and height of a tile, cropped.
  Json size() const;
  /// NAME.png of blocks of tiles. \param not_known  what the legend says of pixels without a value
  Plot plot(const std::string& name, const Json& blocks, const char* not_known) const;

 private:
  struct Box {
    std::size_t left, top, right, bottom;  ///< right, bottom: the first beside it
  };
  Box box() const;
  Image image() const;

  std::size_t width_ = 0, height_ = 0;
  std::vector<std::vector<float>> tiles_;  ///< As 16-bit numbers
  std::vector<bool> counts_;               ///< For cropping
};

/// Brightness of RGB, one channel.
Image gray(const Image& picture);

/// Pixels a side of a picture in which the mesh, however thin, covers the area of a square.
/// \param view  with frame and directions
/// \param side  of the square, pixels
std::uint32_t picture_size(const Scene& scene, RenderOptions view, double side);

}  // namespace kiln::cli

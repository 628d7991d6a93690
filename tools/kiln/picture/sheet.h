// Composes contact sheets: panels of equal size with captions, and a colour scale if needed.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kiln/render.h"
#include "picture/canvas.h"

namespace kiln::cli {

struct Panel {
  Image image;  ///< The picture, with 3 channels
  std::vector<std::string> captions;
};

/// A colour scale for values from 0 to `end`.
struct Scale {
  double end = 1;
  std::string unit;  ///< Unit of the values, such as "degrees"
  /// Colours of pixels without a value, with their legends
  std::vector<std::pair<Colour, std::string>> others;
};

/// Returns the colour of a value in [0, 1], from dark to light (the colour map inferno by Smith and van der Walt,
/// interpolated from nine of its colours).
Colour scale_colour(double share);

/// Finds the smallest number that is 1, 2 or 5 times a power of ten, and that at most 3% of the values exceed.
double round_scale_end(std::vector<double> values);

/// Converts values to colours.
/// \param values  an image of one channel
/// \param other  function that returns the colour of a value that the scale does not show, such as the mark of a
///               missing value; nullopt for other values
Image map_to_colours(const Image& values, const Scale& scale,
                     const std::function<std::optional<Colour>(float)>& other);

/// Arranges panels in columns. Cells are at least as wide as the widest caption.
/// \param columns  number of columns; 0: for an aspect ratio of about 8 : 5
Image make_sheet(const std::vector<Panel>& panels, const std::optional<Scale>& scale = {},
                 std::size_t columns = 0);

/// Computes the bytes of memory that `count` pictures take.
std::uint64_t bytes_of(const PictureGeometry& size, std::uint64_t count);

/// Draws the scene, after it has checked that the memory suffices for the picture and for the steps after it.
/// \param bytes  memory in bytes that the later steps need
Image draw_with_room(const Scene& scene, const RenderOptions& options, std::uint64_t bytes);

/// Pictures of angles between normals, in one or several views, with a common scale.
class AnglePictures {
 public:
  /// Adds the angles between the normals of two scenes in a view (Wang, Froehlich, Goebel 2003, figure 4b).
  /// \param view  options for both scenes
  void add(const Scene& high, const Scene& low, RenderOptions view);
  /// Adds an image of angles in one channel, in which -1 and -2 mean the same as in
  /// normal_angles().
  void add(Image values) { angles_.push_back(std::move(values)); }

  /// Computes the mean angle of a picture over the pixels that both meshes cover; 0 if there are none.
  double mean(std::size_t index) const;
  Scale scale() const;
  Image picture(std::size_t index, const Scale& scale) const;

 private:
  std::vector<Image> angles_;  ///< One result of normal_angles() for each picture
};

}  // namespace kiln::cli

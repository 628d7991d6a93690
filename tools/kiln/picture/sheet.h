// Contact sheets: panels of equal size with captions, and a colour scale if needed.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kiln/kiln.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "picture/canvas.h"

namespace kiln::cli {

struct Panel {
  Image image;  ///< 3 channels
  std::vector<std::string> captions;
};

/// A colour scale for values from 0 to `end`.
struct Scale {
  double end = 1;
  std::string unit;  ///< "degrees"
  /// Colours of pixels without a value, with their legends.
  std::vector<std::pair<Colour, std::string>> others;
};

/// Colour of a share in [0, 1], dark to light (inferno, by Smith and van der Walt, interpolated from nine points).
Colour scale_colour(double share);

/// The least number of the form 1, 2 or 5 times a power of ten that at most 3% of the values exceed.
double scale_end(std::vector<double> values);

/// Converts values to colours. \param values one channel
/// \param other  colour of a value outside the scale, if it is one
Image coloured(const Image& values, const Scale& scale,
               const std::function<std::optional<Colour>(float)>& other);

/// Arranges panels in columns. Cells are at least as wide as the widest caption. \param columns 0: as for an aspect
/// ratio of about 8 : 5
Image make_sheet(const std::vector<Panel>& panels, const std::optional<Scale>& scale = {},
                 std::size_t columns = 0);

/// Memory of `count` pictures in bytes.
std::uint64_t bytes_of(const PictureGeometry& size, std::uint64_t count);

/// scene.draw(options), but fails at once if memory does not suffice for later steps. \param bytes memory of these
Image draw_with_room(const Scene& scene, const RenderOptions& options, std::uint64_t bytes);

/// Pictures of angles between normals in one or several views with a common scale.
class AnglePictures {
 public:
  /// Adds the local error of a view (Wang, Froehlich, Goebel 2003, figure 4b). \param view options of both scenes
  void add(const Scene& high, const Scene& low, RenderOptions view);
  /// Adds angles in one channel; -1 and -2 have the meaning of normal_angles().
  void add(Image values) { angles_.push_back(std::move(values)); }

  /// Mean over the pixels that both meshes cover; 0 if there are none.
  double mean(std::size_t index) const;
  Scale scale() const;
  Image picture(std::size_t index, const Scale& scale) const;

 private:
  std::vector<Image> angles_;  ///< normal_angles()
};

}  // namespace kiln::cli

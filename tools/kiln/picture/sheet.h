// Panels of one size side by side, each with its captions, over a scale of colours where they need one.
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

/// Colours of values from 0 to an end.
struct Scale {
  double end = 1;
  std::string unit;  ///< "degrees"
  /// Marks that some pixels hold instead of a value.
  std::vector<std::pair<Colour, std::string>> others;
};

/// A value's colour, dark to light (inferno, by Smith and van der Walt, at nine of its points).
Colour scale_colour(double share);

/// A round number, 1, 2 or 5 times a power of ten, that 3 of 100 values exceed at most.
double scale_end(std::vector<double> values);

/// Values as colours. \param values  one channel
/// \param other  of a value that is none: its colour
Image coloured(const Image& values, const Scale& scale,
               const std::function<std::optional<Colour>(float)>& other);

/// In as many columns as make the sheet about 8 : 5, or as told. Cells are as wide as the widest caption.
Image make_sheet(const std::vector<Panel>& panels, const std::optional<Scale>& scale = {},
                 std::size_t columns = 0);

/// Bytes of so many pictures.
std::uint64_t bytes_of(const PictureGeometry& size, std::uint64_t count);

/// scene.draw(options), which fails at once where what follows has no room beside it. \param bytes  of that
Image draw_with_room(const Scene& scene, const RenderOptions& options, std::uint64_t bytes);

/// Angles of one view, or several, that share a scale.
class AnglePictures {
 public:
  /// The local error of a view (Wang, Froehlich, Goebel 2003, figure 4b). \param view  of both scenes
  void add(const Scene& high, const Scene& low, RenderOptions view);
  /// Values of one channel; -1 and -2 as normal_angles() has them.
  void add(Image values) { angles_.push_back(std::move(values)); }

  /// Over the pixels that both meshes cover; 0 where there is none.
  double mean(std::size_t index) const;
  Scale scale() const;
  Image picture(std::size_t index, const Scale& scale) const;

 private:
  std::vector<Image> angles_;  ///< normal_angles()
};

}  // namespace kiln::cli

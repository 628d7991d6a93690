// The angle between rendered normals as a picture.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "kiln/kiln.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "picture/sheet.h"

namespace kiln::cli {

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

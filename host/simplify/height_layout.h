// UVs of meshes over a height field.
#pragma once

#include <array>

#include "kiln/mesh.h"

namespace kiln {

/// A rectangle of the plane of x and y, world units.
struct FieldRectangle {
  std::array<double, 2> center{};
  std::array<double, 2> size{};

  /// The one that a height field's vertices span. \throws Error(input) where it has no area
  static FieldRectangle of(const Mesh& field);
};

/// UVs by x and y: the rectangle is the unit square. Replaces what UVs there are.
void lay_out_over(Mesh& mesh, const FieldRectangle& rectangle);

}  // namespace kiln

// UVs of meshes that cover a height field.
#pragma once

#include <array>

#include "kiln/mesh.h"

namespace kiln {

/// A rectangle in the x-y plane, in world units.
struct FieldRectangle {
  std::array<double, 2> center{};
  std::array<double, 2> size{};

  /// The bounding rectangle of the vertices of a height field.
  /// \throws Error(input) if it has no area
  static FieldRectangle of(const Mesh& field);
};

/// Sets UVs from x and y, so that the rectangle is mapped to the unit square. Replaces existing UVs.
void lay_out_over_rectangle(Mesh& mesh, const FieldRectangle& rectangle);

}  // namespace kiln

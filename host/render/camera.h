// Where a picture is taken from.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kiln/render.h"
#include "mesh/frame.h"
#include "mesh/vector.h"

namespace kiln {

/// What a camera is to show: the vertices that finite triangles use, in a frame of their own.
struct CameraTarget {
  Frame frame;
  std::vector<Vec3> points;

  /// \throws Error(input) where the mesh has no extent
  static CameraTarget of(const Mesh& mesh);
};

/// An orthographic view of the world: a square picture.
struct Camera {
  Vec3d right, up, toward;         ///< Unit; `toward` points from the scene to the viewer
  std::array<double, 3> center{};  ///< World point in the picture's middle
  double half_side = 1;            ///< World units

  /// Fits the target into the picture, with a margin of 4% of it on each side.
  static Camera fit(const CameraTarget& target, const RenderOptions& options);
};

}  // namespace kiln

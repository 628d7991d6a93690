// The camera of a picture.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/render.h"
#include "mesh/frame.h"
#include "mesh/vector.h"

namespace kiln {

/// Vertices that a camera shows: those that finite triangles use, in a frame of their own.
struct CameraTarget {
  Frame frame;
  std::vector<Vec3> points;
  /// Mean of the triangles' normals by area: length 0 where they close, 1 on a plane.
  Vec3d facing;

  /// \throws Error(input) where the mesh has no extent
  static CameraTarget of(const Mesh& mesh);
};

/// An orthographic view of the world.
struct Camera {
  Vec3d right, up, toward;              ///< Unit; `toward` points from the scene to the viewer
  std::array<double, 3> center{};       ///< World point in the picture's middle
  double half_side = 1;                 ///< World units: of the picture's longer side
  std::uint32_t width = 1, height = 1;  ///< Pixels
  /// Direction of the key light, unit, in the camera's own axes: right, up, towards the viewer.
  Vec3d key;

  /// Fits the target into the picture, with a margin of 4% of its longer side on each side; then zooms and
  /// moves as the options say.
  static Camera fit(const CameraTarget& target, const RenderOptions& options);

  /// World units.
  double pixel() const { return 2 * half_side / std::max(width, height); }
};

}  // namespace kiln

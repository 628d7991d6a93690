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

/// The vertices that a camera shows: those of finite triangles, in a local frame of their own.
struct CameraTarget {
  Frame local_frame;
  std::vector<Vec3> points;
  /// Mean normal of the triangles, weighted by area: length 0 for closed meshes, 1 for planes.
  Vec3d facing{};

  /// \throws Error(input) if the mesh has no extent
  static CameraTarget of(const Mesh& mesh);
};

/// An orthographic camera in world space.
struct Camera {
  /// Unit vectors of the camera's axes; `toward` points from the scene to the viewer
  Vec3d right{}, up{}, toward{};
  std::array<double, 3> center{};       ///< World point at the picture's centre
  double half_side = 1;                 ///< Half of the picture's longer side, world units
  std::uint32_t width = 1, height = 1;  ///< Size of the picture in pixels
  /// Unit vector to the key light in camera axes: right, up, towards the viewer.
  Vec3d key{};

  /// Fits the target into the picture with a margin of 4% of its longer side, then applies the options' zoom and
  /// position.
  static Camera fit(const CameraTarget& target, const RenderOptions& options);

  /// Size of a pixel in world units.
  double pixel() const { return 2 * half_side / std::max(width, height); }
};

}  // namespace kiln

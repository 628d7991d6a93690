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

/// The vertices that a camera shows: those of triangles with finite corners and an area, in the mesh's local frame.
struct CameraTarget {
  Frame local_frame;
  std::vector<Vec3> points;
  /// Mean of the triangles' unit normals, weighted by area. Its length is 0 for closed meshes, and 1 for planes.
  Vec3d facing{};

  /// \throws Error(input) if the mesh has no extent
  static CameraTarget of(const Mesh& mesh);
};

/// An orthographic camera in world space.
struct Camera {
  /// Unit vectors of the camera's axes; `toward` points from the scene to the viewer
  Vec3d right{}, up{}, toward{};
  std::array<double, 3> center{};       ///< Point at the picture's centre, in world space
  double half_side = 1;                 ///< Half of the picture's longer side in world units
  std::uint32_t width = 1, height = 1;  ///< Size of the picture in pixels
  /// Unit vector to the key light, along the camera's axes `right`, `up` and `toward`.
  Vec3d key{};

  /// Makes a camera whose picture shows the whole target, with a margin of 4% of the picture's longer side; then
  /// applies RenderOptions::zoom and RenderOptions::at.
  static Camera fit(const CameraTarget& target, const RenderOptions& options);

  /// Size of a pixel in world units.
  double pixel() const { return 2 * half_side / std::max(width, height); }
};

}  // namespace kiln

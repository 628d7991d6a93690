#pragma once

#include <cstdint>

#include "kiln/device.h"
#include "kiln/image.h"
#include "kiln/mesh.h"

namespace kiln {

enum class NormalMapSpace { tangent, object, face };

struct RenderOptions {
  std::uint32_t size = 512;           ///< Width and height of the picture
  double azimuth_degrees = 30;        ///< Around the up axis (+Y), 0 looks at the front (from +Z)
  double elevation_degrees = 15;      ///< Above the horizon
  std::uint32_t samples = 3;          ///< N x N samples a pixel
  bool flat = false;                  ///< Face normals instead of the mesh's own
  bool z_up = false;                  ///< The scene's up axis is +Z
  bool show_normals = false;          ///< Colour by world-space normal instead of shading
  const Image* normal_map = nullptr;  ///< Applied through the mesh's UVs, bilinear
  NormalMapSpace space = NormalMapSpace::tangent;
  bool flip_y = false;  ///< The map's green points down (DirectX)
  const Mesh* frame =
      nullptr;  ///< Frame the picture on this mesh's bounding box (default: own), so
                ///< that pictures of several meshes line up
};

/// A picture of a mesh, shaded by a fixed key, fill and rim light over a plain background.
/// Orthographic. RGB, [0, 1], sRGB-encoded. Deterministic.
/// \throws Error(usage), Error(input), Error(device)
Image render(const Device& device, const Mesh& mesh, const RenderOptions& options = {});

}  // namespace kiln

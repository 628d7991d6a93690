#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/image.h"
#include "kiln/map.h"
#include "kiln/mesh.h"

namespace kiln {

/// A normal map for a mesh's UVs: n/2 + 1/2 in the first three channels.
struct NormalMap {
  const Image* image = nullptr;  ///< Null: none. Read while a Scene is made, not kept.
  NormalMapSpace space = NormalMapSpace::tangent;  ///< That the map was baked in
  bool flip_y = false;                             ///< Green points down (DirectX)
};

/// Camera, light and surface of a picture.
struct RenderOptions {
  std::uint32_t size = 512;         ///< Width and height of the picture, 1 to 8192 pixels
  double azimuth_degrees = 30;      ///< Around the up axis (+Y): 0 looks at the front, from +Z; 90
                                    ///< looks from +X
  double elevation_degrees = 15;    ///< Of the camera above the horizon, -90 to 90
  bool z_up = false;                ///< The up axis is +Z; the front is then seen from -Y
  std::uint32_t samples = 3;        ///< N x N samples a pixel, 1 to 16
  std::uint32_t ambient_rays = 64;  ///< For ambient occlusion, about so many a pixel; 0 to 255
  bool flat = false;                ///< Face normals instead of the mesh's own. Leaves a map out.
  bool ignore_map = false;          ///< Leave the scene's normal map out
  bool show_normals = false;  ///< Colour by world-space normal as n/2 + 1/2, without sRGB; exactly
                              ///< 0 beside the mesh. With one sample a pixel, a measurement.
  bool show_colors = false;   ///< The map's channels as they are, without light, averaged over the
                              ///< samples that hit; 0 beside the mesh. Needs a map.
  const Mesh* frame =
      nullptr;  ///< Fit this mesh into the picture (default: the scene's own), so that
                ///< pictures of several meshes line up in world coordinates
};

/// A mesh made ready for pictures: hierarchy, normals and normal map on the device. Built once, drawn
/// from any number of sides, immutable. Cheap to copy (shared).
class Scene {
 public:
  /// \param map  read through the mesh's UVs: bilinear, clamped to the edges, 16 bits a channel; texels
  ///             that are not finite count as (1/2, 1/2, 1). Tangent frames follow MikkTSpace.
  /// \throws Error(input) where no triangle is usable, or a map is given and the mesh has no UVs or the
  ///         map fewer than 3 channels; Error(device) where memory runs out
  explicit Scene(const Device& device, const Mesh& mesh, const NormalMap& map = {});

  /// An orthographic picture: clay in the light of a key, a fill and a rim light that travel with the
  /// camera, and of a sky dimmed by ambient occlusion, over a plain light background. RGB, [0, 1],
  /// sRGB-encoded. Faces turned away are shaded as if they faced the viewer. Normal maps change the
  /// shading and never the silhouette or the occlusion.
  ///
  /// Deterministic. Device memory beside the mesh's stays under 110 MB at any size.
  /// \throws Error(usage) for an option out of its range, Error(input) for a frame without extent,
  ///         Error(device)
  Image draw(const RenderOptions& options = {}) const;

  /// Triangles that rays pass through, since they have no area or are not finite.
  const std::vector<Warning>& warnings() const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// One picture: Scene(device, mesh, map).draw(options).
Image render(const Device& device, const Mesh& mesh, const RenderOptions& options = {},
             const NormalMap& map = {});

}  // namespace kiln

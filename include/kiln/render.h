#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/map.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// A normal map for a mesh's UVs: n/2 + 1/2 in the first three channels.
struct NormalMap {
  const Image* image = nullptr;  ///< Null: none. Read while a Scene is made, not kept.
  NormalMapSpace space = NormalMapSpace::tangent;  ///< That the map was baked in
  bool flip_y = false;                             ///< Green points down (DirectX)
  Bitangent bitangent = Bitangent::pixel;          ///< That the map was baked with
};

/// Camera, light and surface of a picture.
struct RenderOptions {
  std::uint32_t size = 512;     ///< Width and height of the picture (see `trim`), 1 to 8192 pixels
  double azimuth_degrees = 30;  ///< Around the up axis (+Y): 0 looks at the front, from +Z; 90
                                ///< looks from +X
  double elevation_degrees = 15;    ///< Elevation of the camera above the horizon, -90 to 90
  bool z_up = false;                ///< The up axis is +Z; the front is then seen from -Y
  std::uint32_t samples = 3;        ///< N x N samples a pixel, 1 to 16
  std::uint32_t ambient_rays = 64;  ///< For ambient occlusion, about so many a pixel; 0 to 255
  bool flat = false;                ///< Face normals instead of the mesh's own. Leaves a map out.
  bool ignore_map = false;          ///< Leave the scene's normal map out
  bool show_normals = false;  ///< Colour by world-space normal as n/2 + 1/2, without sRGB; exactly
                              ///< 0 beside the mesh. With one sample a pixel, a measurement.
  bool show_colors = false;   ///< The map's channels as they are, without light, averaged over the
                              ///< samples that hit; 0 beside the mesh. Needs a map.
  /// Fit this mesh into the picture (default: the scene's own), so that pictures of several meshes line up in
  /// world coordinates. Read during the call.
  const Mesh* frame = nullptr;
  double zoom = 1;  ///< Magnification beyond what fits, 0.01 to 100,000
  /// World point in the picture's middle. None given: the middle of what is framed.
  std::optional<std::array<double, 3>> at = {};
  bool trim =
      false;  ///< Only as wide and high as the framed mesh needs; its longer side has `size` pixels
};

/// Mapping from the world to a picture.
struct PictureGeometry {
  std::uint32_t width = 0;         ///< Pixels
  std::uint32_t height = 0;        ///< Pixels
  std::array<double, 3> right{};   ///< Unit, to the picture's right
  std::array<double, 3> up{};      ///< Unit, to the picture's top
  std::array<double, 3> toward{};  ///< Unit, to the viewer
  std::array<double, 3> center{};  ///< World point in the picture's middle
  double pixel = 1;                ///< Side of one, world units

  /// Column and row of a point, pixels from the picture's top left corner (a pixel's middle is at a half);
  /// and how far the point is from the plane through the picture's middle, towards the viewer, world units.
  std::array<double, 3> project(const std::array<double, 3>& point) const;
};

/// Cost of drawing a scene, as papers on simplified meshes state it.
struct FrameCost {
  std::uint32_t frames = 0;     ///< Timed
  std::uint32_t width = 0;      ///< Side of a frame, pixels
  std::uint32_t height = 0;     ///< Side of a frame, pixels
  double seconds_median = 0;    ///< Time of one frame
  double seconds_least = 0;     ///< Time of one frame
  double seconds_most = 0;      ///< Time of one frame
  std::uint64_t triangles = 0;  ///< Drawn a frame
  /// Corners that differ in position, normal or (with a map) UV: what a vertex buffer would hold.
  std::uint64_t vertices = 0;
  /// Bytes of those vertices: position and normal, 24; with a map also UV and tangent, 48. And of three
  /// indices of 4 bytes a triangle, and of the map: 3 channels of 16 bits a texel.
  std::uint64_t bytes = 0;
};

/// A mesh made ready for pictures: hierarchy, normals and normal map on the device. Built once, drawn
/// from any number of sides, immutable. Cheap to copy (shared). It holds the Device and copies of mesh and map.
/// Thread safety: as Source, any number of threads may draw one Scene, or copies of it. No callback comes.
/// Welding: vertices with exactly equal positions count as one where normals are computed.
class Scene {
 public:
  /// \param map  read through the mesh's UVs: bilinear, clamped to the edges, 16 bits a channel; texels
  ///             that are not finite count as (1/2, 1/2, 1). Tangent frames follow MikkTSpace.
  /// \throws Error(input) where no triangle is usable; where a map is given, and the mesh has no
  ///         UVs or the map fewer than 3 channels; Error(device) where memory runs out
  explicit Scene(const Device& device, const Mesh& mesh, const NormalMap& map = {});

  /// An orthographic picture: clay over a plain light background. A key, a fill and a rim light
  /// travel with the camera; ambient occlusion dims a sky. The key light grazes sheets, such as
  /// terrains. RGB, [0, 1], sRGB-encoded. Faces turned away are shaded as if they faced the
  /// viewer. Normal maps change the shading and never the silhouette or the occlusion.
  ///
  /// Deterministic. Device memory beside the mesh's stays under 110 MB at any size.
  /// \throws Error(usage) for an option out of its range, Error(input) for a frame without extent,
  ///         Error(device)
  Image draw(const RenderOptions& options = {}) const;

  /// Mapping from the world to the picture that draw() makes with these options. \throws as draw()
  PictureGeometry geometry(const RenderOptions& options = {}) const;

  /// Depth of the foremost surface: its distance from the plane through the picture's middle, towards the viewer, world
  /// units, one channel; kNoDepth beside the mesh. One sample a pixel, whatever the options say.
  /// \throws as draw()
  Image draw_depth(const RenderOptions& options = {}) const;
  /// Value of draw_depth() beside the mesh.
  static constexpr float kNoDepth = -std::numeric_limits<float>::infinity();

  /// The same picture as draw() with one sample a pixel and no ambient occlusion, but by a z-buffer: as a
  /// renderer of frames draws it. Differs from draw() where a triangle's edge passes within 1/128 of a pixel
  /// of a pixel's middle.
  /// \throws Error(usage) for show_colors, a zoom, or a picture of more than 2048 pixels a side
  Image rasterise(const RenderOptions& options = {}) const;

  /// Times rasterise() from `frames` sides around the up axis, without reading pictures back, after two that
  /// are not timed. \throws as rasterise(); Error(usage) for frames not in 1 to 1,000
  FrameCost time_frames(const RenderOptions& options = {}, std::uint32_t frames = 30) const;

  /// Triangles that rays pass through, since they have no area or are not finite; coordinates too coarse for the edges.
  const std::vector<Warning>& warnings() const;

  /// \cond The library's own.
  struct KILN_OPAQUE Impl;
  /// \endcond

 private:
  std::shared_ptr<const Impl> impl_;
};

/// One picture: Scene(device, mesh, map).draw(options), with what these say. Nothing is kept.
Image render(const Device& device, const Mesh& mesh, const RenderOptions& options = {},
             const NormalMap& map = {});

}  // namespace kiln

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
#include "kiln/image_data.h"
#include "kiln/map.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// A normal map for a mesh's UVs: n/2 + 1/2 in the first three channels.
struct NormalMap {
  /// The map's image, or null for none. It is read in the constructor of Scene, which stores no reference to
  /// it.
  const Image* image = nullptr;
  NormalMapSpace space = NormalMapSpace::tangent;  ///< Space of the map's normals
  bool flip_y = false;  ///< True: the map's green points down (DirectX); false: up (OpenGL)
  /// How the bitangent was computed when the map was baked
  Bitangent bitangent = Bitangent::pixel;
};

/// Camera, light and surface of a picture.
struct RenderOptions {
  std::uint32_t size = 512;  ///< Width and height of the picture (see `trim`), 1 to 8192 pixels
  /// Angle of the viewer around the up axis (+Y), degrees: 0 shows the front, from +Z; 90 shows the
  /// side seen from +X
  double azimuth_degrees = 30;
  double elevation_degrees = 15;  ///< Elevation of the viewer above the horizon, degrees, -90 to 90
  bool z_up = false;              ///< Use +Z as the up axis; the front is then seen from -Y
  std::uint32_t samples = 3;      ///< N x N samples a pixel, 1 to 16
  /// Rays of ambient occlusion per pixel, approximately; 0 to 255
  std::uint32_t ambient_rays = 64;
  /// Shade with face normals instead of the mesh's own; disables the map, too.
  bool flat = false;
  bool ignore_map = false;  ///< Draw the mesh without the scene's normal map
  /// Show world-space normals as n/2 + 1/2, not sRGB-encoded; exactly 0 for background. With one sample per
  /// pixel, the values are exact normals.
  bool show_normals = false;
  /// Show the map's channels unchanged and unlit, averaged over the pixel's samples that hit the
  /// mesh; 0 for background. Requires a map.
  bool show_colors = false;
  /// Mesh whose bounds the picture shows (default: the scene's mesh), so that pictures of several meshes
  /// can show the same part of the world. Read during the call.
  const Mesh* frame = nullptr;
  /// Magnification relative to a picture that shows the whole mesh, 0.01 to 100,000
  double zoom = 1;
  /// Point in world space at the picture's centre. None given: the centre of the mesh that the
  /// picture shows.
  std::optional<std::array<double, 3>> at = {};
  /// Crop the picture to the mesh that it shows; the longer side then has `size` pixels
  bool trim = false;
};

/// Mapping from the world to a picture.
struct PictureGeometry {
  std::uint32_t width = 0;         ///< Pixels
  std::uint32_t height = 0;        ///< Pixels
  std::array<double, 3> right{};   ///< Unit vector towards the picture's right
  std::array<double, 3> up{};      ///< Unit vector towards the picture's top
  std::array<double, 3> toward{};  ///< Unit vector towards the viewer
  std::array<double, 3> center{};  ///< Point in world space at the picture's centre
  double pixel = 1;                ///< Side of a pixel, world units

  /// Column and row of a point, pixels from the picture's top left corner (pixel centres are at one half);
  /// and its distance from the plane through the picture's centre, towards the viewer, world units.
  std::array<double, 3> project(const std::array<double, 3>& point) const;
};

/// Cost of drawing a scene, as papers on simplified meshes state it.
struct FrameCost {
  std::uint32_t frames = 0;     ///< Number of timed frames
  std::uint32_t width = 0;      ///< Width and height of a frame, pixels
  std::uint32_t height = 0;     ///< Width and height of a frame, pixels
  double seconds_median = 0;    ///< Median time of a frame
  double seconds_least = 0;     ///< Shortest time of a frame
  double seconds_most = 0;      ///< Longest time of a frame
  std::uint64_t triangles = 0;  ///< Triangles drawn per frame
  /// Corners that differ in position, normal or (with a map) UV: the size of a vertex buffer.
  std::uint64_t vertices = 0;
  /// Bytes of `vertices` (24 each for position and normal; 48 with a map, which adds UV and tangent), of three 4-byte
  /// indices per triangle, and of the map (3 channels of 16 bits per texel).
  std::uint64_t bytes = 0;
};

/// A mesh prepared for rendering: BVH, normals and normal map on the device. Built once, rendered from any
/// number of sides, immutable. Cheap to copy (shared). It holds the Device and copies of mesh and map. Thread
/// safety: as Source, any number of threads may draw one Scene, or copies of it. No callback is called.
/// Welding: vertices with exactly equal positions count as one where normals are computed.
class Scene {
 public:
  /// \param map  read through the mesh's UVs: bilinear, clamped to the edges, 16 bits a channel; texels
  ///             that are not finite count as (1/2, 1/2, 1). Tangent frames follow MikkTSpace.
  /// \throws Error(input) if no triangle is usable; if a map is given, and the mesh has no UVs or the
  ///         map fewer than 3 channels; Error(device) if memory runs out
  explicit Scene(const Device& device, const Mesh& mesh, const NormalMap& map = {});

  /// Renders an orthographic picture: a clay-like material over a plain light background. A key, a
  /// fill and a rim light move with the camera; light from a sky is dimmed by ambient occlusion. On
  /// flat meshes, such as terrains, the key light falls at a grazing angle. RGB, [0, 1],
  /// sRGB-encoded. Back faces are shaded as if they faced the viewer. Normal maps change the
  /// shading and never the silhouette or the occlusion.
  ///
  /// Deterministic. Device memory beside the mesh's stays under 110 MB at any size.
  /// \throws Error(usage) for an option out of its range, Error(input) for a frame without extent,
  ///         Error(device)
  Image draw(const RenderOptions& options = {}) const;

  /// Mapping from the world to the picture that draw() makes with these options. \throws as draw()
  PictureGeometry geometry(const RenderOptions& options = {}) const;

  /// Renders the depth of the foremost surface: its distance from the plane through the picture's centre, towards the
  /// viewer, world units, one channel; kNoDepth for background. One sample per pixel, regardless of the options.
  /// \throws as draw()
  Image draw_depth(const RenderOptions& options = {}) const;
  /// Background value of draw_depth().
  static constexpr float kNoDepth = -std::numeric_limits<float>::infinity();

  /// Renders the picture of draw() with one sample per pixel and no ambient occlusion by a z-buffer, as
  /// real-time renderers do. Differs from draw() where a triangle's edge passes within 1/128 of a pixel of a
  /// pixel's centre.
  /// \throws Error(usage) for show_colors, a zoom, or a picture of more than 2048 pixels a side
  Image rasterise(const RenderOptions& options = {}) const;

  /// Times rasterise() from `frames` sides around the up axis, without reading pictures back, after two
  /// untimed frames.
  /// \throws as rasterise(); Error(usage) for frames not in 1 to 1,000
  FrameCost time_frames(const RenderOptions& options = {}, std::uint32_t frames = 30) const;

  /// Warnings: triangles that rays ignore, since they have no area or are not finite; coordinates too coarse for the
  /// edges.
  const std::vector<Warning>& warnings() const;

  /// \cond Internal.
  struct KILN_OPAQUE Impl;
  /// \endcond

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Renders one picture: Scene(device, mesh, map).draw(options). No argument is kept.
Image render(const Device& device, const Mesh& mesh, const RenderOptions& options = {},
             const NormalMap& map = {});

}  // namespace kiln

// The device arrays of a Scene, and the functions that draw its pictures.
#pragma once

#include <memory>
#include <vector>

#include "accel/ray.h"
#include "cl/context.h"
#include "kiln/render.h"
#include "mesh/kernels_shared.h"
#include "render/camera.h"

namespace kiln {

struct KILN_HIDDEN Scene::Impl {
  Impl(const Device& opened, const Mesh& mesh, const NormalMap& normal_map);
  Image draw(const RenderOptions& options) const;
  Image draw_depth(const RenderOptions& options) const;
  Image rasterise(const RenderOptions& options) const;
  FrameCost time_frames(const RenderOptions& options, std::uint32_t frames) const;

  Device device;
  CameraTarget target;
  std::vector<Warning> warnings;

  std::unique_ptr<RayCaster> rays;
  cl::Array<std::uint32_t>
      position_indices;  ///< Index of the position of each corner, [3 * triangles]
  cl::Array<std::uint32_t> normal_indices;  ///< Index of the normal of each corner, [3 * triangles]
  cl::Array<float> positions;               ///< Positions, [3 * vertices]
  cl::Array<float> normals;                 ///< Vertex normals, [3 * normals]

  bool has_map = false;
  kiln_render_map_params map_params{};
  cl::Array<kiln_low_shading> shading;  ///< Tangent frames for shading, [triangles]
  cl::Array<float> uvs;                 ///< UVs of the corners, [6 * triangles]
  cl::Array<std::uint16_t> map;         ///< Texels of the normal map, [3 * width * height]

  Camera camera(const RenderOptions& options) const;

 private:
  void upload_map(const Mesh& mesh, const NormalMap& normal_map);
  /// Draws a picture by ray casts, one section of tiles after another.
  /// \param depth  true to return depths and the coverage instead of colours
  Image trace(const Camera& camera, const RenderOptions& options, bool depth) const;
};

/// Checks all options. \throws Error(usage) for an option out of its range
void check_render(const RenderOptions& options);

/// Converts a camera from world space to the local frame of a mesh, and makes the parameters of the kernels.
kiln_render_params camera_params(const Camera& camera, const Frame& frame,
                                 const RenderOptions& options);

/// Copies the pixels of a section, which are stored tile by tile, to the picture.
void copy_pixels_to_picture(const std::vector<float>& colors, const kiln_render_params& params,
                            Image& image);

}  // namespace kiln

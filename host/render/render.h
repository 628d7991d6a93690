// The arrays of a Scene on the device; traces rays to draw pictures of it.
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
  cl::Array<std::uint32_t> position_indices;  ///< Vertex of each corner, [3 * triangles]
  cl::Array<std::uint32_t> normal_indices;    ///< Normal of each corner, [3 * triangles]
  cl::Array<float> positions;                 ///< Positions, [3 * vertices]
  cl::Array<float> normals;                   ///< Normal pool, [3 * normals]

  bool has_map = false;
  kiln_render_map_params map_params{};
  cl::Array<kiln_low_shading> shading;  ///< Shading frames, [triangles]
  cl::Array<float> uvs;                 ///< UVs of the corners, [6 * triangles]
  cl::Array<std::uint16_t> map;         ///< Texels of the normal map, [3 * width * height]

  Camera camera(const RenderOptions& options) const;

 private:
  void upload_map(const Mesh& mesh, const NormalMap& normal_map);
  /// Traces rays for one section of the picture after another. \param depth true: returns depth
  /// instead of the options' colours
  Image trace(const Camera& camera, const RenderOptions& options, bool depth) const;
};

/// \throws Error(usage) for an option out of its range
void check_render(const RenderOptions& options);

/// The camera's parameters in the local frame of a mesh, in which the mesh lies around the origin.
kiln_render_params camera_params(const Camera& camera, const Frame& frame,
                                 const RenderOptions& options);

/// Copies the pixels of a section, which are ordered by tiles, to the picture.
void copy_pixels_to_picture(const std::vector<float>& colors, const kiln_render_params& params,
                            Image& image);

}  // namespace kiln

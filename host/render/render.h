// What a Scene keeps on the device, and how it draws.
#pragma once

#include <memory>
#include <vector>

#include "accel/ray.h"
#include "cl/context.h"
#include "kiln/render.h"
#include "mesh/kernels_shared.h"
#include "render/camera.h"

namespace kiln {

struct Scene::Impl {
  Impl(const Device& opened, const Mesh& mesh, const NormalMap& normal_map);
  Image draw(const RenderOptions& options) const;

  Device device;
  CameraTarget target;
  std::vector<Warning> warnings;

  std::unique_ptr<RayCaster> rays;
  cl::Array<std::uint32_t> position_indices;  ///< [3 * triangles]
  cl::Array<std::uint32_t> normal_indices;    ///< [3 * triangles]
  cl::Array<float> positions;                 ///< [3 * vertices]
  cl::Array<float> normals;                   ///< [3 * pool]

  bool has_map = false;
  kiln_render_map_params map_params{};
  cl::Array<kiln_low_shading> shading;  ///< [triangles]
  cl::Array<float> uvs;                 ///< [6 * triangles]
  cl::Array<std::uint16_t> map;         ///< [3 * width * height]

 private:
  void upload_map(const Mesh& mesh, const NormalMap& normal_map);
};

}  // namespace kiln

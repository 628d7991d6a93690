// Makes a low poly with a normal map from voxels in memory: a ball of radius 20 in 48 x 48 x 48 voxels.
#include <kiln/contour.h>
#include <kiln/kiln.h>
#include <kiln/volume.h>

#include <cmath>
#include <cstdio>

int main() {
  kiln::Volume volume;
  volume.name = "ball";
  volume.size = {48, 48, 48};
  volume.type = kiln::VoxelType::f32;
  std::vector<float> values;
  for (int z = 0; z < 48; ++z) {
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 48; ++x) {
        const double radius = std::hypot(x - 23.5, y - 23.5, z - 23.5);
        values.push_back(static_cast<float>(20 - radius));
      }
    }
  }
  const auto bytes = std::as_bytes(std::span(values));
  volume.voxels.assign(bytes.begin(), bytes.end());
  const kiln::ExtractResult result = kiln::extract(
      kiln::Device::open(), volume, {.contour = {.iso = 0}, .faces = 400, .size = 256});
  kiln::save_obj(result.mesh, "ball.obj");
  kiln::save_image(result.normal_map, "ball_normal.exr");
  std::printf("%zu triangles, map of %u x %u\n", result.mesh.triangles.size(),
              result.normal_map.width, result.normal_map.height);
}

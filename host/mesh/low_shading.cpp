#include "mesh/low_shading.h"

#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// Sets the frame of a face: its normal, and the direction of increasing u in its plane.
void set_face_frame(const std::array<LowSurface::Corner, 3>& corners, kiln_low_shading& shading) {
  const Vec3d p0 = to_double(corners[0].position);
  const Vec3d e1 = to_double(corners[1].position) - p0;
  const Vec3d e2 = to_double(corners[2].position) - p0;
  Vec3d normal = cross(e1, e2);
  normal = length(normal) > 0 ? normal * (1 / length(normal)) : to_double(corners[0].normal);
  const double u1 = double{corners[1].uv.x} - corners[0].uv.x;
  const double v1 = double{corners[1].uv.y} - corners[0].uv.y;
  const double u2 = double{corners[2].uv.x} - corners[0].uv.x;
  const double v2 = double{corners[2].uv.y} - corners[0].uv.y;
  const double determinant = u1 * v2 - u2 * v1;
  Vec3d tangent = (e1 * v2 - e2 * v1) * (determinant < 0 ? -1.0 : 1.0);
  if (!(length(tangent) > 0)) tangent = e1;
  tangent = tangent - normal * dot(tangent, normal);
  tangent = length(tangent) > 0 ? tangent * (1 / length(tangent)) : to_double(corners[0].tangent);
  const Vec3 n = to_float(normal);
  const Vec3 t = to_float(tangent);
  shading.face_normal[0] = n.x;
  shading.face_normal[1] = n.y;
  shading.face_normal[2] = n.z;
  shading.face_tangent[0] = t.x;
  shading.face_tangent[1] = t.y;
  shading.face_tangent[2] = t.z;
}

kiln_low_shading shading_of(const std::array<LowSurface::Corner, 3>& corners) {
  kiln_low_shading shading{};
  float sign = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& n = corners[k].normal;
    const Vec3& t = corners[k].tangent;
    const float values[6] = {n.x, n.y, n.z, t.x, t.y, t.z};
    for (std::size_t c = 0; c < 3; ++c) {
      shading.normal[3 * k + c] = values[c];
      shading.tangent[3 * k + c] = values[3 + c];
    }
    sign += corners[k].sign;
  }
  shading.sign = sign < 0 ? -1.0F : 1.0F;
  set_face_frame(corners, shading);
  return shading;
}

}  // namespace

std::vector<kiln_low_shading> low_shading(const LowSurface& surface, bool with_uvs) {
  std::vector<kiln_low_shading> result(surface.triangles.size());
  const std::size_t count = with_uvs ? surface.with_uvs.size() : result.size();
  parallel_for(count, 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      const std::size_t i = with_uvs ? surface.with_uvs[at] : at;
      result[i] = shading_of(surface.triangles[i]);
    }
  });
  return result;
}

std::vector<kiln_low_shading> shading_with_uvs(const LowSurface& surface) {
  std::vector<kiln_low_shading> result(surface.with_uvs.size());
  parallel_for(result.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result[i] = shading_of(surface.triangles[surface.with_uvs[i]]);
    }
  });
  return result;
}

}  // namespace kiln

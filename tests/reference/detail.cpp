#include "reference/detail.h"

#include <cmath>
#include <glm/glm.hpp>

namespace kiln::test {
namespace {

glm::dvec3 vec(const Vec3& v) { return {v.x, v.y, v.z}; }

glm::dvec3 mix3(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double u, double v) {
  return a * (1 - u - v) + b * u + c * v;
}

glm::dmat3 face_matrix(const std::array<LowSurface::Corner, 3>& c) {
  const glm::dvec3 e1 = vec(c[1].position) - vec(c[0].position);
  const glm::dvec3 e2 = vec(c[2].position) - vec(c[0].position);
  const glm::dvec3 z = glm::normalize(glm::cross(e1, e2));
  // Solve [e1 e2] = [Pu Pv] * uv for Pu.
  const glm::dmat2 uv(c[1].uv.x - c[0].uv.x, c[1].uv.y - c[0].uv.y, c[2].uv.x - c[0].uv.x,
                      c[2].uv.y - c[0].uv.y);
  const glm::dmat2 inverse = glm::inverse(uv);
  const glm::dvec3 x = glm::normalize(e1 * inverse[0][0] + e2 * inverse[0][1]);
  return {x, glm::cross(z, x), z};
}

}  // namespace

std::array<double, 3> reference_normal(const DetailSample& s, NormalMapSpace space, bool flip_y) {
  const glm::dvec3 low_normal =
      mix3(vec(s.low[0].normal), vec(s.low[1].normal), vec(s.low[2].normal), s.low_u, s.low_v);
  glm::dvec3 n = glm::normalize(low_normal);
  if (s.hit) {
    n = glm::normalize(
        mix3(vec(s.high_normals[0]), vec(s.high_normals[1]), vec(s.high_normals[2]), s.u, s.v));
  }
  if (space == NormalMapSpace::tangent) {
    const glm::dvec3 t =
        mix3(vec(s.low[0].tangent), vec(s.low[1].tangent), vec(s.low[2].tangent), s.low_u, s.low_v);
    const glm::dvec3 b = glm::cross(low_normal, t) * double{s.low[0].sign};
    n = glm::normalize(glm::inverse(glm::dmat3(t, b, low_normal)) * n);
  } else if (space == NormalMapSpace::face) {
    n = glm::normalize(glm::transpose(face_matrix(s.low)) * n);
  }
  if (flip_y) n.y = -n.y;
  return {n.x, n.y, n.z};
}

}  // namespace kiln::test

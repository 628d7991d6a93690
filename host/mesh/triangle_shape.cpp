#include "mesh/triangle_shape.h"

#include <array>
#include <cmath>

#include "mesh/vector.h"

namespace kiln {

TriangleShape triangle_shape(const Vec3& a, const Vec3& b, const Vec3& c) {
  TriangleShape shape;
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return shape;
  const std::array<const Vec3*, 3> p{&a, &b, &c};
  std::array<std::array<double, 3>, 3> edge{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& from = *p[(k + 1) % 3];
    const Vec3& to = *p[(k + 2) % 3];
    edge[k] = {double{to.x} - double{from.x}, double{to.y} - double{from.y},
               double{to.z} - double{from.z}};
    shape.squared_edge[k] =
        edge[k][0] * edge[k][0] + edge[k][1] * edge[k][1] + edge[k][2] * edge[k][2];
  }
  const double x = edge[0][1] * edge[1][2] - edge[0][2] * edge[1][1];
  const double y = edge[0][2] * edge[1][0] - edge[0][0] * edge[1][2];
  const double z = edge[0][0] * edge[1][1] - edge[0][1] * edge[1][0];
  shape.area = 0.5 * std::sqrt(x * x + y * y + z * z);
  return shape;
}

}  // namespace kiln

#include "mesh/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "kiln/validate.h"
#include "mesh/vector.h"

namespace kiln {

Bounds Bounds::of(const Mesh& mesh) {
  validate(mesh);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Bounds bounds{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for_each_alive(mesh.triangles.size(), [&](std::size_t i) {
    const Triangle& triangle = mesh.triangles[i];
    const Vec3& a = mesh.positions[triangle[0]];
    const Vec3& b = mesh.positions[triangle[1]];
    const Vec3& c = mesh.positions[triangle[2]];
    if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return;
    for (const Vec3* corner : {&a, &b, &c}) {
      const double xyz[3] = {corner->x, corner->y, corner->z};
      for (std::size_t k = 0; k < 3; ++k) {
        bounds.low[k] = std::min(bounds.low[k], xyz[k]);
        bounds.high[k] = std::max(bounds.high[k], xyz[k]);
      }
    }
  });
  if (!(bounds.high[0] >= bounds.low[0])) {
    throw Error(
        ErrorCode::input,
        "'" + mesh.name +
            "' has no triangle with finite corners: nothing can be baked from it. Check the "
            "file's coordinates.");
  }
  return bounds;
}

Frame Frame::of(const Mesh& mesh) {
  const Bounds bounds = Bounds::of(mesh);
  if (bounds.low == bounds.high) {
    throw Error(ErrorCode::input,
                "'" + mesh.name +
                    "' has no triangle with finite, distinct corners: nothing can be "
                    "baked from it. Check the file's coordinates.");
  }
  return of(mesh, bounds);
}

Frame Frame::of(const Mesh& mesh, const Bounds& bounds) {
  Frame frame;
  double squared = 0;
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double side = bounds.high[k] - bounds.low[k];
    if (!(side >= 0) || !std::isfinite(side)) largest = -1;
    if (largest >= 0) largest = std::max(largest, side);
  }
  if (!(largest > 0)) {
    throw Error(ErrorCode::usage,
                "The bounds have no size: `high` must be finite, nowhere below `low`, and above it "
                "somewhere.");
  }
  for (std::size_t k = 0; k < 3; ++k) {
    frame.center[k] = mesh.origin[k] + (bounds.low[k] + bounds.high[k]) / 2;
    const double side = (bounds.high[k] - bounds.low[k]) / largest;
    squared += side * side;
  }
  frame.diagonal = largest * std::sqrt(squared);
  int exponent = 0;
  std::frexp(frame.diagonal, &exponent);  // diagonal = m * 2^exponent with m in [0.5, 1)
  frame.scale = std::ldexp(1.0, -exponent);
  return frame;
}

Vec3 Frame::to_frame(const Mesh& mesh, std::size_t vertex) const {
  const Vec3& p = mesh.positions[vertex];
  // The origin's offset first: both are large where the object is far away, their difference is not.
  return {static_cast<float>((p.x + (mesh.origin[0] - center[0])) * scale),
          static_cast<float>((p.y + (mesh.origin[1] - center[1])) * scale),
          static_cast<float>((p.z + (mesh.origin[2] - center[2])) * scale)};
}

std::vector<Vec3> Frame::to_frame(const Mesh& mesh) const {
  std::vector<Vec3> result(mesh.positions.size());
  parallel_for(result.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = to_frame(mesh, i);
  });
  return result;
}

}  // namespace kiln

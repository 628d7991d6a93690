#include "mesh/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "base/option.h"
#include "base/parallel.h"
#include "kiln/validate.h"
#include "mesh/steps.h"
#include "mesh/usable.h"

namespace kiln {

Bounds Bounds::of(const Mesh& mesh) {
  validate(mesh);
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  const Bounds none{{kUnbounded, kUnbounded, kUnbounded}, {-kUnbounded, -kUnbounded, -kUnbounded}};
  Bounds bounds = none;
  std::mutex mutex;
  parallel_for(mesh.triangles.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    Bounds part = none;
    for (std::size_t i = begin; i < end; ++i) {
      if (!has_area(mesh.positions, mesh.triangles[i])) continue;
      for (const std::uint32_t corner : mesh.triangles[i]) {
        const Vec3& p = mesh.positions[corner];
        const double xyz[3] = {p.x + 0.0, p.y + 0.0, p.z + 0.0};  // Adding 0 turns -0 into +0
        for (std::size_t k = 0; k < 3; ++k) {
          part.low[k] = std::min(part.low[k], xyz[k]);
          part.high[k] = std::max(part.high[k], xyz[k]);
        }
      }
    }
    const std::lock_guard lock(mutex);
    for (std::size_t k = 0; k < 3; ++k) {
      bounds.low[k] = std::min(bounds.low[k], part.low[k]);
      bounds.high[k] = std::max(bounds.high[k], part.high[k]);
    }
  });
  if (!(bounds.high[0] >= bounds.low[0])) {
    throw Error(
        ErrorCode::input,
        "'" + mesh.name +
            "' has no triangle with finite, distinct corners: nothing can be baked from it. Check "
            "the file's coordinates.");
  }
  return bounds;
}

Frame Frame::of(const Mesh& mesh) { return of(mesh, bulk_bounds(mesh, Bounds::of(mesh))); }

Frame Frame::of(const Mesh& mesh, const Bounds& bounds) {
  Frame frame;
  double squared_diagonal = 0;
  double longest_side = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double side = bounds.high[k] - bounds.low[k];
    if (!(side >= 0) || !std::isfinite(side)) longest_side = -1;
    if (longest_side >= 0) longest_side = std::max(longest_side, side);
  }
  if (!(longest_side > 0)) {
    throw Error(ErrorCode::usage, "The bounds have no size: " + option("high") +
                                      " must be finite, nowhere below " + option("low") +
                                      ", and above it "
                                      "somewhere.");
  }
  for (std::size_t k = 0; k < 3; ++k) {
    frame.center[k] = mesh.origin[k] + (bounds.low[k] + bounds.high[k]) / 2;
    const double side = (bounds.high[k] - bounds.low[k]) / longest_side;
    squared_diagonal += side * side;
  }
  frame.diagonal = longest_side * std::sqrt(squared_diagonal);
  int exponent = 0;
  std::frexp(frame.diagonal, &exponent);  // diagonal = m * 2^exponent with m in [0.5, 1)
  frame.scale = std::ldexp(1.0, -exponent);
  return frame;
}

Vec3 Frame::to_frame(const Mesh& mesh, std::size_t vertex) const {
  return to_frame(mesh.positions[vertex], mesh.origin);
}

Vec3 Frame::to_frame(const Vec3& p, const std::array<double, 3>& origin) const {
  // Computes the difference between origin and centre first: far from the world's origin, both are large, but their
  // difference is small.
  return {static_cast<float>((p.x + (origin[0] - center[0])) * scale),
          static_cast<float>((p.y + (origin[1] - center[1])) * scale),
          static_cast<float>((p.z + (origin[2] - center[2])) * scale)};
}

Vec3 Frame::to_world(const Vec3& p) const {
  return {static_cast<float>(p.x / scale + center[0]), static_cast<float>(p.y / scale + center[1]),
          static_cast<float>(p.z / scale + center[2])};
}

std::vector<Vec3> Frame::to_frame_within(const Mesh& mesh, double reach) const {
  std::vector<Vec3> result(mesh.positions.size());
  parallel_for(result.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = to_frame(mesh, i);
  });
  const auto inside = [&](const Vec3& p) {
    return dot(to_double(p), to_double(p)) <= reach * reach;
  };
  if (std::all_of(result.begin(), result.end(), inside)) return result;
  std::vector<std::uint8_t> used(result.size());
  for (const Triangle& t : mesh.triangles) {
    if (!has_area(mesh.positions, t)) continue;
    for (const std::uint32_t corner : t) used[corner] = 1;
  }
  constexpr float kNoPosition = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (used[i] == 0 && !inside(result[i])) result[i] = {kNoPosition, kNoPosition, kNoPosition};
  }
  return result;
}

std::array<double, 3> local_origin(const std::array<double, 3>& center, double diagonal) {
  std::array<double, 3> origin{};
  double distance = 0;
  for (const double x : center) distance = std::max(distance, std::abs(x));
  if (!(diagonal > 0) || !std::isfinite(diagonal) || !(distance > 16 * diagonal)) return origin;
  const double step = std::exp2(std::ceil(std::log2(diagonal)));
  if (!(step > 0) || !std::isfinite(step)) return origin;
  for (std::size_t k = 0; k < 3; ++k) origin[k] = std::round(center[k] / step) * step + 0.0;
  return origin;
}

}  // namespace kiln

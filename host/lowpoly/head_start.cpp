#include "lowpoly/head_start.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "lowpoly/height_rule.h"
#include "mesh/fans.h"

namespace kiln {
namespace {

/// Height fields are brought down to this share of their heights for it.
constexpr double kFlattened = 0.1;

}  // namespace

/// meshoptimizer leaves pairs of triangles back to back, and edges with four triangles, where the high
/// poly had none: the former are removed, the latter cut. It also lets no triangle turn over, but as seen
/// from the side: height fields are made flat for it, so that this is nearly as seen from above.
void head_start(Work& work, std::size_t faces, double error, bool height_field) {
  static_assert(sizeof(Triangle) == 3 * sizeof(unsigned int) && sizeof(Vec3) == 3 * sizeof(float));
  std::vector<Vec3> positions = to_floats(work.points);
  if (height_field) {
    for (Vec3& p : positions) p.z *= static_cast<float>(kFlattened);
    error *= kFlattened;
  }
  std::vector<Triangle> triangles(work.triangles.size());
  const std::size_t indices =
      meshopt_simplify(triangles.data()->data(), work.triangles.data()->data(),
                       work.triangles.size() * 3, &positions.data()->x, positions.size(),
                       sizeof(Vec3), faces * 3, static_cast<float>(error), 0, nullptr);
  if (indices == 0) return;
  triangles.resize(indices / 3);
  if (height_field && std::any_of(triangles.begin(), triangles.end(), [&](const Triangle& t) {
        return !(upward(work.points[t[0]], work.points[t[1]], work.points[t[2]]) > kLeastUpward);
      })) {
    return;
  }
  if (!has_repeated_sides(work.triangles)) {
    remove_back_to_back(triangles);
    if (triangles.empty()) return;
    if (has_repeated_sides(triangles)) {
      for (const std::uint32_t original : split_into_fans(triangles, work.points.size())) {
        work.points.push_back(work.points[original]);
      }
    }
  }
  work.triangles = std::move(triangles);
  work.sources.clear();
}

}  // namespace kiln

#include "mesh/cage.h"

#include "kiln/validate.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr const char* kInner = "inner";

/// The corners of triangles [first, first + those of the low poly); none where a vertex of the low poly
/// would lie in two places.
std::vector<Vec3> corners_of(const Mesh& low, const Mesh& cage, std::span<const Vec3> positions,
                             std::size_t first) {
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::vector<std::uint32_t> partner(low.positions.size(), kNone);
  std::vector<Vec3> corners;
  corners.reserve(3 * low.triangles.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& known = partner[low.triangles[t][k]];
      const std::uint32_t now = cage.triangles[first + t][k];
      if (known == kNone) known = now;
      corners.push_back(positions[now]);
      if (known == now || positions[known] == positions[now]) continue;
      if (is_finite(positions[known]) && is_finite(positions[now])) return {};
    }
  }
  return corners;
}

bool begins_with_inner(const Mesh& cage) {
  return !cage.groups.empty() && cage.groups.front() < cage.group_names.size() &&
         cage.group_names[cage.groups.front()] == kInner;
}

}  // namespace

CageCorners read_cage(const Mesh& low, const Mesh& cage, const Frame& frame) {
  validate(cage);
  const std::vector<Vec3> positions = frame.to_frame(cage);
  const std::size_t count = low.triangles.size();
  CageCorners result;
  if (cage.triangles.size() == count) {
    result.outer = corners_of(low, cage, positions, 0);
    if (!result.outer.empty()) return result;
  } else if (cage.triangles.size() == 2 * count) {
    result.kind = CageKind::shells;
    const bool inner_first = begins_with_inner(cage);
    result.outer = corners_of(low, cage, positions, inner_first ? count : 0);
    result.inner = corners_of(low, cage, positions, inner_first ? 0 : count);
    if (!result.outer.empty() && !result.inner.empty()) return result;
  }
  auto hull = std::make_shared<CageHull>();
  hull->name = cage.name;
  hull->low_triangles = count;
  for (const Triangle& t : cage.triangles) {
    if (!is_finite(positions[t[0]]) || !is_finite(positions[t[1]]) || !is_finite(positions[t[2]])) {
      continue;
    }
    hull->triangles.push_back(t);
  }
  hull->positions = positions;
  CageCorners other;
  other.kind = CageKind::hull;
  other.hull = std::move(hull);
  return other;
}

}  // namespace kiln

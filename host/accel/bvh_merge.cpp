#include "accel/bvh_range.h"

namespace kiln::bvh {

/// True if all corners are equal, in the same order: then all hits are equal, and ties go to the lower
/// index.
bool Merger::same_corners(std::uint32_t a, std::uint32_t b) const {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& p = positions_[triangles_[a][k]];
    const Vec3& q = positions_[triangles_[b][k]];
    if (p.x != q.x || p.y != q.y || p.z != q.z) return false;
  }
  return true;
}

bool Merger::corners_before(std::uint32_t a, std::uint32_t b) const {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& p = positions_[triangles_[a][k]];
    const Vec3& q = positions_[triangles_[b][k]];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    if (p.z != q.z) return p.z < q.z;
  }
  return a < b;
}

Primitive* Merger::merge(Primitive* first, Primitive* last) const {
  std::sort(first, last, [this](const Primitive& a, const Primitive& b) {
    return corners_before(a.triangle(), b.triangle());
  });
  if (removes_duplicates_) {
    last = std::unique(first, last, [this](const Primitive& a, const Primitive& b) {
      return same_corners(a.triangle(), b.triangle());
    });
  }
  // Boxes whose size exceeds single precision have no finite area, and are sorted to the end.
  const auto size = [](const Primitive& primitive) {
    const float area = primitive.box.half_area();
    return area < kInfinity ? area : kInfinity;
  };
  std::stable_sort(first, last,
                   [&](const Primitive& a, const Primitive& b) { return size(a) < size(b); });
  return last;
}

std::size_t Merger::leaf(const Primitive* first, const Primitive* last,
                         std::uint32_t (&found)[KILN_BVH_LEAF_TRIANGLES]) const {
  std::size_t count = 0;
  // Boxes are compared first: most triangles already differ there, and boxes are contiguous in memory.
  float low[KILN_BVH_LEAF_TRIANGLES];
  for (; first != last; ++first) {
    const std::uint32_t index = first->triangle();
    const float x = first->box.lo[0];
    std::size_t at = 0;
    while (at < count && !(removes_duplicates_ && low[at] == x && same_corners(found[at], index)))
      ++at;
    found[at] = at < count ? std::min(found[at], index) : index;
    low[at] = x;
    if (at == count) ++count;
  }
  return count;
}

}  // namespace kiln::bvh

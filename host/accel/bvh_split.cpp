#include <cstdint>
#include <cstdlib>

#include "accel/bvh_range.h"

namespace kiln::bvh {

std::size_t part(std::span<Primitive> primitives, const Mapping& mapping, const Split& split) {
  // An axis that is split has a finite extent of centres, so none overflows, and bins_of only rounds down.
  const int axis = split.axis;
  const float origin = mapping.origin[axis], scale = mapping.scale[axis];
  const auto bin = static_cast<float>(split.bin);
  std::size_t end = 0;
  for (Primitive& here : primitives) {
    const Primitive primitive = here;
    const float center = here.box.lo[axis] + here.box.hi[axis];
    here = primitives[end];
    primitives[end] = primitive;
    end += (center - origin) * scale < bin ? 1 : 0;
  }
  return end;
}

float overlap(const Bins& bins, const Mapping& mapping, const Split& split) {
  const auto axis = static_cast<std::size_t>(split.axis);
  Box left, right;
  for (int i = 0; i < mapping.count; ++i) {
    (i < split.bin ? left : right).include(bins[static_cast<std::size_t>(i)][axis].box);
  }
  const float length = std::max(left.hi[split.axis], right.hi[split.axis]) -
                       std::min(left.lo[split.axis], right.lo[split.axis]);
  const float both = std::min(left.hi[split.axis], right.hi[split.axis]) -
                     std::max(left.lo[split.axis], right.lo[split.axis]);
  return length > 0 ? std::max(both, 0.0F) / length : 0;
}

Split apart_split(const Bins& bins, const Mapping& mapping) {
  Split best;
  std::int64_t best_off = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (mapping.scale[axis] == 0) continue;
    std::int64_t all = 0, left = 0;
    const auto a = static_cast<std::size_t>(axis);
    for (int i = 0; i < mapping.count; ++i) all += bins[static_cast<std::size_t>(i)][a].count;
    for (int i = 1; i < mapping.count; ++i) {
      left += bins[static_cast<std::size_t>(i - 1)][a].count;
      if (left == 0 || left == all) continue;
      Split split{axis, i, 0};
      split.cost = overlap(bins, mapping, split);
      const std::int64_t off = std::abs(all - 2 * left);
      if (split.cost < best.cost || (split.cost == best.cost && off < best_off)) {
        best = split;
        best_off = off;
      }
    }
  }
  return best;
}

Corner widest_corner(std::span<const Primitive> primitives, std::span<const Vec3> positions,
                     std::span<const Triangle> triangles) {
  std::array<Box, 3> corners;
  for (const Primitive& primitive : primitives) {
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k].include(corner_of(positions, triangles[primitive.triangle()], k));
    }
  }
  Corner widest;
  float most = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const float extent = corners[k].hi[axis] - corners[k].lo[axis];
      if (!(extent > most)) continue;
      most = extent;
      const float low = corners[k].lo[axis], middle = low + extent / 2;
      widest = {k, axis, middle < corners[k].hi[axis] ? middle : low};
    }
  }
  return widest;
}

}  // namespace kiln::bvh

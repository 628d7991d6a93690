#include <cstdint>
#include <cstdlib>

#include "accel/bvh_range.h"

namespace kiln::bvh {

std::size_t partition_bins(std::span<Primitive> primitives, const Mapping& mapping,
                           const Split& split) {
  // Along the split's axis the extent of the centres is finite, so no value overflows, and the conversion of
  // bins_of() is a rounding down.
  const int axis = split.axis;
  const float origin = mapping.origin[axis], scale = mapping.scale[axis];
  const auto bin = static_cast<float>(split.bin);
  std::size_t end = 0;
  for (Primitive& primitive_here : primitives) {
    const Primitive primitive = primitive_here;
    const float center = primitive_here.box.lo[axis] + primitive_here.box.hi[axis];
    primitive_here = primitives[end];
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
  const float shared_length = std::min(left.hi[split.axis], right.hi[split.axis]) -
                              std::max(left.lo[split.axis], right.lo[split.axis]);
  return length > 0 ? std::max(shared_length, 0.0F) / length : 0;
}

Split least_overlap_split(const Bins& bins, const Mapping& mapping) {
  Split best;
  std::int64_t best_imbalance = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (mapping.scale[axis] == 0) continue;
    std::int64_t triangle_count = 0, left = 0;
    const auto a = static_cast<std::size_t>(axis);
    for (int i = 0; i < mapping.count; ++i)
      triangle_count += bins[static_cast<std::size_t>(i)][a].count;
    for (int i = 1; i < mapping.count; ++i) {
      left += bins[static_cast<std::size_t>(i - 1)][a].count;
      if (left == 0 || left == triangle_count) continue;
      Split split{axis, i, 0};
      split.cost = overlap(bins, mapping, split);
      const std::int64_t off = std::abs(triangle_count - 2 * left);
      if (split.cost < best.cost || (split.cost == best.cost && off < best_imbalance)) {
        best = split;
        best_imbalance = off;
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
  float max_variation = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const float extent = corners[k].hi[axis] - corners[k].lo[axis];
      if (!(extent > max_variation)) continue;
      max_variation = extent;
      const float low = corners[k].lo[axis], middle = low + extent / 2;
      widest = {k, axis, middle < corners[k].hi[axis] ? middle : low};
    }
  }
  return widest;
}

}  // namespace kiln::bvh

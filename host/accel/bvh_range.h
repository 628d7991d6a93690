// Input of the BVH builder: triangles as boxes, ranges of triangles, and splits of a range.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "base/vectors.h"
#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln::bvh {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr int kMaxBins = 16;

struct Box {
  Float4 lo = splat(kInfinity);
  Float4 hi = splat(-kInfinity);
  void include(const Box& other) {
    lo = lower(lo, other.lo);
    hi = upper(hi, other.hi);
  }
  void include(Float4 point) {
    lo = lower(lo, point);
    hi = upper(hi, point);
  }
  float half_area() const {
    const Float4 size = hi - lo;
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
};

/// A triangle during the build: its box, not widened, and its index, which is stored in the unused lane of
/// `lo`.
struct Primitive {
  Box box;
  std::uint32_t triangle() const { return std::bit_cast<std::uint32_t>(box.lo[3]); }
  /// The doubled centre of the box.
  Float4 center() const {
    Float4 sum = box.lo + box.hi;
    sum[3] = 0;
    return sum;
  }
};

struct Range {
  std::size_t begin = 0;
  std::size_t end = 0;
  Box box;
  Box centers;
  bool merged = false;  ///< True if the range's duplicates have been removed
  std::size_t size() const { return end - begin; }
  bool is_leaf() const { return size() <= KILN_BVH_LEAF_TRIANGLES; }
};

/// Minimum extent of the centres along an axis that is split; dividing by a smaller extent could overflow.
inline constexpr float kMinExtent = 1e-30f;

/// True if all centres are equal: the scale of Mapping is then 0 on every axis.
inline bool is_flat(const Range& range) {
  const Float4 extent = range.centers.hi - range.centers.lo;
  const auto is_split = [&](int axis) {
    return extent[axis] > kMinExtent && extent[axis] < kInfinity;
  };
  return !is_split(0) && !is_split(1) && !is_split(2);
}

struct Bin {
  Box box;
  std::uint32_t count = 0;
};
using Bins = std::array<std::array<Bin, 3>, kMaxBins>;

/// Maps doubled centres to bins.
struct Mapping {
  Float4 origin;
  Float4 scale;
  int count = 0;

  explicit Mapping(const Range& range) : origin(range.centers.lo) {
    count = static_cast<int>(std::min<std::size_t>(kMaxBins, 4 + range.size() / 8));
    const Float4 extent = range.centers.hi - range.centers.lo;
    for (int axis = 0; axis < 4; ++axis) {
      const bool usable = axis < 3 && extent[axis] > kMinExtent;
      scale[axis] = usable ? 0.9999f * static_cast<float>(count) / extent[axis] : 0.0f;
    }
  }
  Int4 bins_of(const Primitive& primitive) const {
    const Float4 place = (primitive.center() - origin) * scale;
    const Int4 index = to_int4(place);
    const Int4 last = Int4{} + (count - 1);
    const Int4 below = select(index < last, index, last);
    return select(below > 0, below, Int4{});  // overflowing centres convert to negative numbers
  }
};

struct Split {
  int axis = -1;
  int bin = 0;  ///< First bin of the right side
  float cost = kInfinity;
};

inline float blocks_of(std::uint32_t triangles) {
  const std::uint32_t blocks = (triangles + KILN_BVH_LEAF_TRIANGLES - 1) / KILN_BVH_LEAF_TRIANGLES;
  return static_cast<float>(blocks);
}

inline Split best_split(const Bins& bins, const Mapping& mapping) {
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    if (mapping.scale[axis] == 0) continue;
    std::array<float, kMaxBins> right_cost{};
    const auto a = static_cast<std::size_t>(axis);
    Bin right;
    for (int i = mapping.count - 1; i > 0; --i) {
      const Bin& bin = bins[static_cast<std::size_t>(i)][a];
      right.box.include(bin.box);
      right.count += bin.count;
      right_cost[static_cast<std::size_t>(i)] =
          right.count == 0 ? kInfinity : right.box.half_area() * blocks_of(right.count);
    }
    Bin left;
    for (int i = 1; i < mapping.count; ++i) {
      const Bin& bin = bins[static_cast<std::size_t>(i - 1)][a];
      left.box.include(bin.box);
      left.count += bin.count;
      if (left.count == 0) continue;
      const float cost =
          left.box.half_area() * blocks_of(left.count) + right_cost[static_cast<std::size_t>(i)];
      if (cost < best.cost) best = {axis, i, cost};
    }
  }
  return best;
}

/// Moves the primitives whose bin lies before the split's first right bin to the front of the range. Branch-free, since
/// half of the branches would be mispredicted. \returns their number
std::size_t partition_bins(std::span<Primitive> primitives, const Mapping& mapping,
                           const Split& split);

/// Overlap of a split's two sides along its axis, as a share of their total length: 0 if they are separate.
float overlap(const Bins& bins, const Mapping& mapping, const Split& split);

/// Finds the split with the least overlap along its axis; among equal ones, the one that divides
/// the triangles most evenly.
Split least_overlap_split(const Bins& bins, const Mapping& mapping);

/// Selects one coordinate of a triangle: the index of a corner, and an axis.
struct Corner {
  std::size_t corner = 0;
  int axis = 0;
  float middle = 0;  ///< Split value: at least one triangle is at or below it, and one above
};
inline Float4 corner_of(std::span<const Vec3> positions, const Triangle& triangle,
                        std::size_t corner) {
  const Vec3& p = positions[triangle[corner]];
  return Float4{p.x, p.y, p.z, 0};
}
/// Selects the coordinate with the largest variation; the triangles must not all be equal.
Corner widest_corner(std::span<const Primitive> primitives, std::span<const Vec3> positions,
                     std::span<const Triangle> triangles);

/// Processes ranges whose triangles all have the same centre, the only ranges that can contain
/// duplicates: removes triangles equal to one of a lower index, and sorts the others by the size of
/// their boxes.
class Merger {
 public:
  /// \param drop true: remove duplicates; false: only sort
  Merger(std::span<const Vec3> positions, std::span<const Triangle> triangles, bool drop)
      : positions_(positions), triangles_(triangles), removes_duplicates_(drop) {}

  /// \returns the end of the remaining triangles
  Primitive* merge(Primitive* first, Primitive* last) const;

  /// Writes the triangles of a leaf without duplicates. \returns their number
  std::size_t leaf(const Primitive* first, const Primitive* last,
                   std::uint32_t (&found)[KILN_BVH_LEAF_TRIANGLES]) const;

 private:
  bool same_corners(std::uint32_t a, std::uint32_t b) const;
  bool corners_before(std::uint32_t a, std::uint32_t b) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bool removes_duplicates_;
};

/// \throws Error(input): the triangle has an index beyond the positions
[[noreturn]] void throw_bad_index(std::size_t triangle, std::size_t position_count);
/// \throws Error(input) if there are more triangles than leaves can name
void require_supported_count(std::size_t triangle_count);

}  // namespace kiln::bvh

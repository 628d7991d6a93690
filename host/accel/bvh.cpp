#include "accel/bvh.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "kiln/error.h"
#include "mesh/usable.h"

namespace kiln {
namespace {

// Four floats in a register. GCC's and Clang's vector extension: baseline SSE2 on x86, NEON on ARM.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kMaxBins = 16;
// Levels of 8-wide nodes below which ranges are halved by count: 2^31 triangles need 10 more at most
// (each level divides by 8), so no tree is deeper than 26.
constexpr std::uint32_t kSahLevels = 15;
static_assert(kSahLevels + 11 <= KILN_BVH_MAX_DEPTH);

Float4 splat(float value) { return Float4{value, value, value, value}; }
Float4 lower(Float4 a, Float4 b) { return a < b ? a : b; }
Float4 upper(Float4 a, Float4 b) { return a > b ? a : b; }

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

/// A triangle while building: its box, not widened, and its index in the unused lane of `lo`.
struct Primitive {
  Box box;
  std::uint32_t triangle() const { return std::bit_cast<std::uint32_t>(box.lo[3]); }
  /// Twice the centre.
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
  bool merged = false;  ///< No two of its triangles are the same
  std::size_t size() const { return end - begin; }
  bool is_leaf() const { return size() <= KILN_BVH_LEAF_TRIANGLES; }
};

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
      // Below 1e-30 the quotient could overflow; such an axis is not split.
      const bool usable = axis < 3 && extent[axis] > 1e-30f;
      scale[axis] = usable ? 0.9999f * static_cast<float>(count) / extent[axis] : 0.0f;
    }
  }
  /// All centres are one.
  bool is_flat() const { return scale[0] == 0 && scale[1] == 0 && scale[2] == 0; }
  Int4 bins_of(const Primitive& primitive) const {
    const Float4 place = (primitive.center() - origin) * scale;
    const Int4 index = __builtin_convertvector(place, Int4);
    const Int4 last = Int4{} + (count - 1);
    const Int4 below = index < last ? index : last;
    return below > 0 ? below : Int4{};  // overflown centres convert to negative numbers
  }
};

struct Split {
  int axis = -1;
  int bin = 0;  ///< First bin of the right side
  float cost = kInfinity;
};

float blocks_of(std::uint32_t triangles) {
  return static_cast<float>((triangles + KILN_BVH_LEAF_TRIANGLES - 1) / KILN_BVH_LEAF_TRIANGLES);
}

Split best_split(const Bins& bins, const Mapping& mapping) {
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

/// A finished subtree, with indices relative to its own arrays.
struct Subtree {
  std::vector<kiln_bvh_node> nodes;
  std::vector<kiln_bvh_block> blocks;
  std::uint32_t depth = 0;
};

class Builder {
 public:
  Builder(std::span<const Vec3> positions, std::span<const Triangle> triangles, bool merge)
      : positions_(positions), triangles_(triangles), merge_(merge) {}

  Bvh build() {
    Bvh bvh;
    const Range root = gather();
    bvh.triangles = root.size();
    bvh.skipped = triangles_.size() - root.size();
    // The top of the tree one node after the other, with parallel binning; then subtrees in parallel.
    // Where the cut lies depends on the triangle count alone, so the tree does too.
    const std::size_t cut = std::max<std::size_t>(4096, root.size() / 64);
    Subtree top;
    std::vector<Task> tasks;
    emit_top(root, cut, top, tasks);
    std::vector<std::uint32_t> order(tasks.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return tasks[a].range.size() > tasks[b].range.size();
    });
    std::vector<Subtree> subtrees(tasks.size());
    parallel_for(order.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Task& task = tasks[order[i]];
        Subtree& subtree = subtrees[order[i]];
        subtree.nodes.reserve(task.range.size() / 12 + 8);
        subtree.blocks.reserve(task.range.size() / 2 + 8);
        emit(task.range, task.level, subtree);
      }
    });
    join(top, tasks, subtrees, bvh);
    bvh.duplicates = duplicates_;
    bvh.triangles -= duplicates_;
    return bvh;
  }

 private:
  struct Task {
    Range range;
    std::uint32_t level = 0;
    std::size_t node = 0;  ///< Where the subtree hangs: node and child of the top
    int child = 0;
  };

  /// Fills primitives_ with the usable triangles, in order. \returns the range of all of them
  Range gather() {
    constexpr std::size_t grain = 1 << 15;
    const std::size_t count = triangles_.size();
    const std::size_t pieces = (count + grain - 1) / grain;
    primitives_ = std::make_unique_for_overwrite<Primitive[]>(count);
    std::vector<Range> filled(pieces);
    std::atomic<std::size_t> bad_index{count};
    parallel_for(pieces, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t piece = first; piece < last; ++piece) {
        Range range;
        range.begin = range.end = piece * grain;
        for (std::size_t i = piece * grain; i < std::min(count, (piece + 1) * grain); ++i) {
          const Triangle& triangle = triangles_[i];
          if (std::max({triangle[0], triangle[1], triangle[2]}) >= positions_.size()) {
            std::size_t seen = bad_index;
            while (i < seen && !bad_index.compare_exchange_weak(seen, i)) {
            }
            continue;
          }
          if (!usable(triangle)) continue;
          Primitive primitive;
          for (std::uint32_t corner : triangle) {
            const Vec3& p = positions_[corner];
            primitive.box.include(Float4{p.x, p.y, p.z, 0});
          }
          range.centers.include(primitive.center());
          range.box.include(primitive.box);
          primitive.box.lo[3] = std::bit_cast<float>(static_cast<std::uint32_t>(i));
          primitives_[range.end++] = primitive;
        }
        filled[piece] = range;
      }
    });
    if (bad_index < count) {
      throw Error(ErrorCode::input, "Triangle " + std::to_string(bad_index) +
                                        " has a vertex index beyond the mesh's " +
                                        std::to_string(positions_.size()) +
                                        " vertices. Repair the mesh's indices.");
    }
    Range all;
    for (const Range& range : filled) {
      if (all.end != range.begin) {
        std::memmove(static_cast<void*>(&primitives_[all.end]), &primitives_[range.begin],
                     range.size() * sizeof(Primitive));
      }
      all.end += range.size();
      all.box.include(range.box);
      all.centers.include(range.centers);
    }
    return all;
  }

  bool usable(const Triangle& triangle) const { return has_area(positions_, triangle); }

  void fill_bins(const Range& range, const Mapping& mapping, Bins& bins) const {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Primitive& primitive = primitives_[i];
      const Int4 index = mapping.bins_of(primitive);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Bin& bin = bins[static_cast<std::size_t>(index[axis])][axis];
        bin.box.include(primitive.box);
        ++bin.count;
      }
    }
  }

  void fill_bins_parallel(const Range& range, const Mapping& mapping, Bins& bins) const {
    constexpr std::size_t grain = 1 << 14;
    const std::size_t pieces = (range.size() + grain - 1) / grain;
    std::vector<Bins> partial(pieces);
    parallel_for(pieces, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t piece = first; piece < last; ++piece) {
        Range part = range;
        part.begin = range.begin + piece * grain;
        part.end = std::min(range.end, part.begin + grain);
        fill_bins(part, mapping, partial[piece]);
      }
    });
    for (const Bins& part : partial) {
      for (std::size_t i = 0; i < kMaxBins; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          bins[i][axis].box.include(part[i][axis].box);
          bins[i][axis].count += part[i][axis].count;
        }
      }
    }
  }

  /// Cuts a range in two, neither empty.
  void split(const Range& range, bool by_count, bool parallel, Range& left, Range& right) {
    left = right = Range{};
    left.begin = range.begin;
    right.end = range.end;
    Split chosen;
    const Mapping mapping(range);
    if (!by_count) {
      Bins bins;
      if (parallel) {
        fill_bins_parallel(range, mapping, bins);
      } else {
        fill_bins(range, mapping, bins);
      }
      chosen = best_split(bins, mapping);
    }
    if (chosen.axis < 0) {
      left.end = right.begin = range.begin + range.size() / 2;
      left.merged = right.merged = range.merged;
      order_by_place(range);
      measure(left);
      measure(right);
      return;
    }
    std::size_t i = range.begin;
    std::size_t j = range.end;
    while (i < j) {
      const Primitive primitive = primitives_[i];
      Box box = primitive.box;
      if (mapping.bins_of(primitive)[chosen.axis] < chosen.bin) {
        left.box.include(box);
        left.centers.include(primitive.center());
        ++i;
      } else {
        right.box.include(box);
        right.centers.include(primitive.center());
        primitives_[i] = primitives_[--j];
        primitives_[j] = primitive;
      }
    }
    left.end = right.begin = i;
  }

  static bool one_centre(const Range& range) { return range.merged || Mapping(range).is_flat(); }

  /// Before a range is halved by count: what lies together stays together. Ranges of one centre are in
  /// order of their boxes' size already.
  void order_by_place(const Range& range) {
    if (one_centre(range)) return;
    const Float4 extent = range.centers.hi - range.centers.lo;
    const int axis = extent[0] >= extent[1] && extent[0] >= extent[2] ? 0
                     : extent[1] >= extent[2]                         ? 1
                                                                      : 2;
    const auto before = [axis](const Primitive& a, const Primitive& b) {
      const float at_a = a.center()[axis], at_b = b.center()[axis];
      return at_a != at_b ? at_a < at_b : a.triangle() < b.triangle();
    };
    Primitive* const first = primitives_.get();
    std::nth_element(first + range.begin, first + range.begin + range.size() / 2, first + range.end,
                     before);
  }

  /// Whether all corners are the same numbers, in the same order: then so is every answer, and ties go
  /// to the lower index.
  bool same_corners(std::uint32_t a, std::uint32_t b) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = positions_[triangles_[a][k]];
      const Vec3& q = positions_[triangles_[b][k]];
      if (p.x != q.x || p.y != q.y || p.z != q.z) return false;
    }
    return true;
  }

  bool corners_before(std::uint32_t a, std::uint32_t b) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = positions_[triangles_[a][k]];
      const Vec3& q = positions_[triangles_[b][k]];
      if (p.x != q.x) return p.x < q.x;
      if (p.y != q.y) return p.y < q.y;
      if (p.z != q.z) return p.z < q.z;
    }
    return a < b;
  }

  /// Triangles of one centre: drops those that are the same as one of a lower index, and orders the others
  /// by the size of their boxes. Only such ranges can hold triangles that are the same.
  void merge(Range& range) {
    Primitive* const first = primitives_.get() + range.begin;
    Primitive* last = first + range.size();
    std::sort(first, last, [this](const Primitive& a, const Primitive& b) {
      return corners_before(a.triangle(), b.triangle());
    });
    if (merge_) {
      Primitive* const all = last;
      last = std::unique(first, last, [this](const Primitive& a, const Primitive& b) {
        return same_corners(a.triangle(), b.triangle());
      });
      duplicates_ += static_cast<std::uint64_t>(all - last);
    }
    // Boxes beyond single precision have no number for an area, and come last.
    const auto size = [](const Primitive& primitive) {
      const float area = primitive.box.half_area();
      return area < kInfinity ? area : kInfinity;
    };
    std::stable_sort(first, last,
                     [&](const Primitive& a, const Primitive& b) { return size(a) < size(b); });
    range.end = static_cast<std::size_t>(last - primitives_.get());
    range.merged = true;
  }

  void measure(Range& range) const {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      range.box.include(primitives_[i].box);
      range.centers.include(primitives_[i].center());
    }
  }

  /// Opens a range into the up to 8 children of a node.
  int open(const Range& range, std::uint32_t level, std::size_t parallel_above,
           std::array<Range, KILN_BVH_WIDTH>& children) {
    const bool by_count = level >= kSahLevels;
    children[0] = range;
    int count = 1;
    while (count < KILN_BVH_WIDTH) {
      int widest = -1;
      float most = -1;
      for (int i = 0; i < count; ++i) {
        const Range& child = children[static_cast<std::size_t>(i)];
        if (child.is_leaf()) continue;
        const float measure = by_count ? static_cast<float>(child.size()) : child.box.half_area();
        if (measure > most) {
          most = measure;
          widest = i;
        }
      }
      if (widest < 0) break;
      Range& parent_slot = children[static_cast<std::size_t>(widest)];
      if (!parent_slot.merged && one_centre(parent_slot)) {
        merge(parent_slot);
        continue;  // it may be a leaf now
      }
      const Range parent = parent_slot;
      split(parent, by_count, parent.size() > parallel_above,
            children[static_cast<std::size_t>(widest)], children[static_cast<std::size_t>(count)]);
      ++count;
    }
    return count;
  }

  static kiln_bvh_node empty_node() {
    kiln_bvh_node node;
    for (auto& axis : node.planes) {
      std::fill(std::begin(axis[0]), std::end(axis[0]), kInfinity);
      std::fill(std::begin(axis[1]), std::end(axis[1]), -kInfinity);
    }
    std::fill(std::begin(node.child), std::end(node.child), KILN_BVH_LEAF);
    std::fill(std::begin(node.pad), std::end(node.pad), 0u);
    return node;
  }

  static void set_box(kiln_bvh_node& node, int child, const Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
      node.planes[axis][0][child] = box.lo[axis] - KILN_BVH_EPSILON;
      node.planes[axis][1][child] = box.hi[axis] + KILN_BVH_EPSILON;
    }
  }

  /// The triangles of a leaf, each once. \returns how many there are
  std::size_t leaf_triangles(const Range& range, std::uint32_t (&found)[KILN_BVH_LEAF_TRIANGLES]) {
    std::size_t count = 0;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const std::uint32_t index = primitives_[i].triangle();
      std::size_t at = 0;
      while (at < count && !(merge_ && same_corners(found[at], index))) ++at;
      found[at] = at < count ? std::min(found[at], index) : index;
      if (at == count) {
        ++count;
      } else {
        ++duplicates_;
      }
    }
    return count;
  }

  std::uint32_t emit_block(const Range& range, Subtree& out) {
    kiln_bvh_block block;
    std::uint32_t found[KILN_BVH_LEAF_TRIANGLES] = {};
    const std::size_t count = leaf_triangles(range, found);
    for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
      const bool used = lane < count;
      const std::uint32_t index = found[used ? lane : 0];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const Vec3& p = positions_[triangles_[index][used ? corner : 0]];
        block.corner[corner][0][lane] = p.x;
        block.corner[corner][1][lane] = p.y;
        block.corner[corner][2][lane] = p.z;
      }
      block.triangle[lane] = used ? index : KILN_NO_TRIANGLE;
    }
    out.blocks.push_back(block);
    return static_cast<std::uint32_t>(out.blocks.size() - 1);
  }

  void emit(const Range& range, std::uint32_t level, Subtree& out) {
    std::array<Range, KILN_BVH_WIDTH> children;
    const int count = open(range, level, range.size(), children);
    const std::size_t self = out.nodes.size();
    out.nodes.push_back(empty_node());
    out.depth = std::max(out.depth, level + 1);
    for (int i = 0; i < count; ++i) {
      const Range& child = children[static_cast<std::size_t>(i)];
      set_box(out.nodes[self], i, child.box);
      if (child.is_leaf()) {
        out.nodes[self].child[i] = KILN_BVH_LEAF | emit_block(child, out);
      } else {
        out.nodes[self].child[i] = static_cast<std::uint32_t>(out.nodes.size());
        emit(child, level + 1, out);
      }
    }
  }

  void emit_top(const Range& root, std::size_t cut, Subtree& top, std::vector<Task>& tasks) {
    std::vector<Task> open_tasks{{root, 0, 0, 0}};
    if (root.size() == 0) {
      top.nodes.push_back(empty_node());
      top.depth = 1;
      return;
    }
    for (std::size_t next = 0; next < open_tasks.size(); ++next) {
      const Task task = open_tasks[next];
      const std::size_t self = top.nodes.size();
      if (next != 0) top.nodes[task.node].child[task.child] = static_cast<std::uint32_t>(self);
      top.nodes.push_back(empty_node());
      top.depth = std::max(top.depth, task.level + 1);
      std::array<Range, KILN_BVH_WIDTH> children;
      const int count = open(task.range, task.level, cut, children);
      for (int i = 0; i < count; ++i) {
        const Range& child = children[static_cast<std::size_t>(i)];
        set_box(top.nodes[self], i, child.box);
        if (child.is_leaf()) {
          top.nodes[self].child[i] = KILN_BVH_LEAF | emit_block(child, top);
        } else {
          std::vector<Task>& list = child.size() > cut ? open_tasks : tasks;
          list.push_back({child, task.level + 1, self, i});
        }
      }
    }
  }

  static void join(Subtree& top, const std::vector<Task>& tasks,
                   const std::vector<Subtree>& subtrees, Bvh& bvh) {
    std::vector<std::size_t> first_node(tasks.size());
    std::vector<std::size_t> first_block(tasks.size());
    bvh.node_count = top.nodes.size();
    bvh.block_count = top.blocks.size();
    bvh.depth = top.depth;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      first_node[i] = bvh.node_count;
      first_block[i] = bvh.block_count;
      bvh.node_count += subtrees[i].nodes.size();
      bvh.block_count += subtrees[i].blocks.size();
      bvh.depth = std::max(bvh.depth, subtrees[i].depth);
      top.nodes[tasks[i].node].child[tasks[i].child] = static_cast<std::uint32_t>(first_node[i]);
    }
    bvh.node_data = std::make_unique_for_overwrite<kiln_bvh_node[]>(bvh.node_count);
    bvh.block_data = std::make_unique_for_overwrite<kiln_bvh_block[]>(bvh.block_count);
    std::copy(top.nodes.begin(), top.nodes.end(), bvh.node_data.get());
    std::copy(top.blocks.begin(), top.blocks.end(), bvh.block_data.get());
    parallel_for(tasks.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Subtree& subtree = subtrees[i];
        std::copy(subtree.blocks.begin(), subtree.blocks.end(),
                  bvh.block_data.get() + first_block[i]);
        kiln_bvh_node* out = bvh.node_data.get() + first_node[i];
        for (const kiln_bvh_node& node : subtree.nodes) {
          *out = node;
          for (int c = 0; c < KILN_BVH_WIDTH; ++c) {
            const bool leaf = (node.child[c] & KILN_BVH_LEAF) != 0;
            out->child[c] += static_cast<std::uint32_t>(leaf ? first_block[i] : first_node[i]);
          }
          ++out;
        }
      }
    });
  }

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bool merge_;
  std::unique_ptr<Primitive[]> primitives_;
  std::atomic<std::uint64_t> duplicates_{0};
};

}  // namespace

Bvh build_bvh(std::span<const Vec3> positions, std::span<const Triangle> triangles, bool merge) {
  if (triangles.size() >= KILN_BVH_LEAF) {
    throw Error(ErrorCode::input, "The mesh has " + std::to_string(triangles.size()) +
                                      " triangles; at most 2147483647 are supported. Split it.");
  }
  return Builder(positions, triangles, merge).build();
}

void refit_bvh(Bvh& bvh, std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  std::vector<Box> leaves(bvh.block_count);
  parallel_for(bvh.block_count, 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      kiln_bvh_block& block = bvh.block_data[i];
      for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
        const bool used = block.triangle[lane] != KILN_NO_TRIANGLE;
        const Triangle& triangle = triangles[block.triangle[used ? lane : 0]];
        for (std::size_t corner = 0; corner < 3; ++corner) {
          const Vec3& p = positions[triangle[used ? corner : 0]];
          block.corner[corner][0][lane] = p.x;
          block.corner[corner][1][lane] = p.y;
          block.corner[corner][2][lane] = p.z;
          leaves[i].include(Float4{p.x, p.y, p.z, 0});
        }
      }
    }
  });
  // A child's index is larger than its parent's. Widening a union is the union of what was widened.
  std::vector<Box> boxes(bvh.node_count);
  for (std::size_t i = bvh.node_count; i-- > 0;) {
    kiln_bvh_node& node = bvh.node_data[i];
    for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
      // Unused children have inverted bounds, and stay so.
      if (node.planes[0][0][c] > node.planes[0][1][c]) continue;
      const std::uint32_t child = node.child[c];
      const bool leaf = (child & KILN_BVH_LEAF) != 0;
      const Box& box = leaf ? leaves[child & ~KILN_BVH_LEAF] : boxes[child];
      boxes[i].include(box);
      for (int axis = 0; axis < 3; ++axis) {
        node.planes[axis][0][c] = box.lo[axis] - KILN_BVH_EPSILON;
        node.planes[axis][1][c] = box.hi[axis] + KILN_BVH_EPSILON;
      }
    }
  }
}

}  // namespace kiln

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

#include "accel/bvh_nodes.h"
#include "accel/bvh_prisms.h"
#include "accel/bvh_range.h"
#include "base/parallel.h"
#include "kiln/error.h"
#include "mesh/usable.h"

namespace kiln {
namespace {

using namespace bvh;

// Level from which ranges are split at the median instead of by the surface area heuristic. Each level then divides the
// number of triangles by 8, so 2^31 triangles add at most 10 levels, and no tree is deeper than 26.
constexpr std::uint32_t kSahLevels = 15;
// Minimum number of triangles of a range whose split is checked for overlap, and maximum overlap of the two sides as a
// share of their total length.
constexpr std::size_t kMinOverlapTriangles = 64;
constexpr float kMaxOverlapShare = 0.9F;
// The overlap of a split is checked if the split's cost exceeds this share of the unsplit range's cost.
constexpr float kMinCostRatio = 0.75F;
static_assert(kSahLevels + 11 <= KILN_BVH_MAX_DEPTH);

class Builder {
 public:
  Builder(std::span<const Vec3> positions, std::span<const Triangle> triangles, bool merge)
      : positions_(positions),
        triangles_(triangles),
        duplicate_merger_(positions, triangles, merge),
        prisms_(merge) {}

  TreeParts build() {
    TreeParts tree_parts;
    const Range root = gather_usable_triangles();
    tree_parts.skipped = triangles_.size() - root.size();
    // Builds the top of the tree node by node, with parallel binning, then all subtrees in parallel. The size at which
    // subtrees begin depends on the triangle count alone, so the tree does not depend on the number of threads.
    const std::size_t cut = std::max<std::size_t>(4096, root.size() / 64);
    std::vector<Task>& tasks = tree_parts.tasks;
    emit_top(root, cut, tree_parts.top, tasks);
    std::vector<std::uint32_t> task_order(tasks.size());
    for (std::uint32_t i = 0; i < task_order.size(); ++i) task_order[i] = i;
    std::stable_sort(task_order.begin(), task_order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return tasks[a].range.size() > tasks[b].range.size();
    });
    tree_parts.subtrees.resize(tasks.size());
    parallel_for(task_order.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Task& task = tasks[task_order[i]];
        Subtree& subtree = tree_parts.subtrees[task_order[i]];
        subtree.nodes.reserve(task.range.size() / 12 + 8);
        subtree.blocks.reserve(task.range.size() / 2 + 8);
        emit_nodes(task.range, task.level, subtree);
        primitives_.discard(task.range.begin, task.range.end);
      }
    });
    double leaf_area = tree_parts.top.leaf_area;
    bool has_crowded_leaves = false;
    for (const Subtree& subtree : tree_parts.subtrees) {
      leaf_area += subtree.leaf_area;
      has_crowded_leaves = has_crowded_leaves || subtree.has_crowded_leaves;
    }
    if (const double area{root.box.half_area()}; area > 0)
      tree_parts.leaves_per_line = leaf_area / area;
    tree_parts.has_crowded_nodes =
        prisms_ && (has_crowded_leaves || tree_parts.leaves_per_line > kMinCrowdedLeaves);
    tree_parts.duplicates = duplicates_;
    tree_parts.triangles = root.size() - duplicates_;
    return tree_parts;
  }

 private:
  /// Fills primitives_ with the usable triangles, in order. \returns the range of all of them
  Range gather_usable_triangles() {
    constexpr std::size_t kTrianglesPerTask = 1 << 15;
    const std::size_t count = triangles_.size();
    const std::size_t pieces = (count + kTrianglesPerTask - 1) / kTrianglesPerTask;
    primitives_ = PageArray<Primitive>(count);
    std::vector<Range> piece_ranges(pieces);
    std::atomic<std::size_t> bad_index{count};
    parallel_for(pieces, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t piece = first; piece < last; ++piece) {
        Range range;
        range.begin = range.end = piece * kTrianglesPerTask;
        for (std::size_t i = piece * kTrianglesPerTask;
             i < std::min(count, (piece + 1) * kTrianglesPerTask); ++i) {
          const Triangle& triangle = triangles_[i];
          if (std::max({triangle[0], triangle[1], triangle[2]}) >= positions_.size()) {
            std::size_t first_bad = bad_index;
            while (i < first_bad && !bad_index.compare_exchange_weak(first_bad, i)) {
            }
            continue;
          }
          if (!is_usable(triangle)) continue;
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
        piece_ranges[piece] = range;
      }
    });
    if (bad_index < count) throw_bad_index(bad_index, positions_.size());
    Range all;
    for (const Range& range : piece_ranges) {
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

  bool is_usable(const Triangle& triangle) const { return has_area(positions_, triangle); }

  void fill_bins(const Range& range, const Mapping& bin_mapping, Bins& bins) const {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Primitive& primitive = primitives_[i];
      const Int4 index = bin_mapping.bins_of(primitive);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Bin& bin = bins[static_cast<std::size_t>(index[axis])][axis];
        bin.box.include(primitive.box);
        ++bin.count;
      }
    }
  }

  void fill_bins_parallel(const Range& range, const Mapping& bin_mapping, Bins& bins) const {
    constexpr std::size_t kTrianglesPerTask = 1 << 14;
    const std::size_t pieces = (range.size() + kTrianglesPerTask - 1) / kTrianglesPerTask;
    std::vector<Bins> partial_bins(pieces);
    parallel_for(pieces, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t piece = first; piece < last; ++piece) {
        Range part = range;
        part.begin = range.begin + piece * kTrianglesPerTask;
        part.end = std::min(range.end, part.begin + kTrianglesPerTask);
        fill_bins(part, bin_mapping, partial_bins[piece]);
      }
    });
    for (const Bins& part : partial_bins) {
      for (std::size_t i = 0; i < kMaxBins; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          bins[i][axis].box.include(part[i][axis].box);
          bins[i][axis].count += part[i][axis].count;
        }
      }
    }
  }

  /// Splits a range into two ranges, neither of which is empty.
  void split(const Range& range, bool by_count, bool parallel, Range& left, Range& right) {
    left = right = Range{};
    left.begin = range.begin;
    right.end = range.end;
    Split chosen_split;
    const Mapping bin_mapping(range);
    if (!by_count) {
      Bins bins;
      if (parallel) {
        fill_bins_parallel(range, bin_mapping, bins);
      } else {
        fill_bins(range, bin_mapping, bins);
      }
      chosen_split = best_split(bins, bin_mapping);
      if (chosen_split.axis >= 0 && range.size() >= kMinOverlapTriangles &&
          chosen_split.cost > kMinCostRatio * range.box.half_area() *
                                  blocks_of(static_cast<std::uint32_t>(range.size())) &&
          split_with_least_overlap(range, bin_mapping, bins, chosen_split, left, right)) {
        return;
      }
    }
    if (chosen_split.axis < 0) {
      left.end = right.begin = range.begin + range.size() / 2;
      left.merged = right.merged = range.merged;
      sort_by_position(range);
      measure_range(left);
      measure_range(right);
      return;
    }
    Primitive* const first = primitives_.data();
    left.end = right.begin = range.begin + partition_bins({first + range.begin, first + range.end},
                                                          bin_mapping, chosen_split);
    measure_range(left);
    measure_range(right);
  }

  /// Replaces a split whose sides overlap much by one with less overlap. If no split separates the boxes, the
  /// range is split at the middle of the corner coordinate with the largest variation. Triangles of similar shape,
  /// and duplicates, then stay together, and a bounding prism fits them tightly.
  /// \returns true if the range was split
  [[gnu::noinline]] bool split_with_least_overlap(const Range& range, const Mapping& bin_mapping,
                                                  const Bins& bins, Split& chosen_split,
                                                  Range& left, Range& right) {
    if (!(overlap(bins, bin_mapping, chosen_split) > kMaxOverlapShare)) return false;
    chosen_split = least_overlap_split(bins, bin_mapping);
    if (!(chosen_split.cost > kMaxOverlapShare)) return false;
    Primitive* const first = &primitives_[range.begin];
    Primitive* const last = first + range.size();
    const Corner widest = widest_corner({first, last}, positions_, triangles_);
    const Primitive* const middle = std::partition(first, last, [&](const Primitive& primitive) {
      return corner_of(positions_, triangles_[primitive.triangle()], widest.corner)[widest.axis] <=
             widest.middle;
    });
    left.end = right.begin = range.begin + static_cast<std::size_t>(middle - first);
    measure_range(left);
    measure_range(right);
    return true;
  }

  static bool has_one_centre(const Range& range) { return range.merged || is_flat(range); }

  /// Sorts a range by position before it is divided into halves of equal count, so that neighbours stay together.
  /// Ranges in which all triangles have the same centre are already sorted by the size of their boxes.
  void sort_by_position(const Range& range) {
    if (has_one_centre(range)) return;
    const Float4 extent = range.centers.hi - range.centers.lo;
    const int axis = extent[0] >= extent[1] && extent[0] >= extent[2] ? 0
                     : extent[1] >= extent[2]                         ? 1
                                                                      : 2;
    const auto has_lower_centre = [axis](const Primitive& a, const Primitive& b) {
      const float at_a = a.center()[axis], at_b = b.center()[axis];
      return at_a != at_b ? at_a < at_b : a.triangle() < b.triangle();
    };
    Primitive* const first = primitives_.data();
    std::nth_element(first + range.begin, first + range.begin + range.size() / 2, first + range.end,
                     has_lower_centre);
  }

  void measure_range(Range& range) const {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      range.box.include(primitives_[i].box);
      range.centers.include(primitives_[i].center());
    }
  }

  /// Splits a node's range into up to 8 children.
  int open(const Range& range, std::uint32_t level, std::size_t parallel_above,
           std::array<Range, KILN_BVH_WIDTH>& children) {
    const bool by_count = level >= kSahLevels;
    children[0] = range;
    int count = 1;
    while (count < KILN_BVH_WIDTH) {
      int child_to_split = -1;
      float max_measure = -1;
      for (int i = 0; i < count; ++i) {
        const Range& child = children[static_cast<std::size_t>(i)];
        if (child.is_leaf()) continue;
        const float measure = by_count ? static_cast<float>(child.size()) : child.box.half_area();
        if (measure > max_measure) {
          max_measure = measure;
          child_to_split = i;
        }
      }
      if (child_to_split < 0) break;
      Range& parent_slot = children[static_cast<std::size_t>(child_to_split)];
      if (!parent_slot.merged && has_one_centre(parent_slot)) {
        Primitive* const first = &primitives_[parent_slot.begin];
        Primitive* const end = duplicate_merger_.merge(first, first + parent_slot.size());
        const auto left = static_cast<std::size_t>(end - first);
        duplicates_ += parent_slot.size() - left;
        parent_slot.end = parent_slot.begin + left;
        parent_slot.merged = true;
        continue;  // not split now, since the child may have become a leaf: the choice is repeated
      }
      const Range parent = parent_slot;
      split(parent, by_count, parent.size() > parallel_above,
            children[static_cast<std::size_t>(child_to_split)],
            children[static_cast<std::size_t>(count)]);
      ++count;
    }
    return count;
  }

  std::uint32_t emit_block(const Range& range, Subtree& out) {
    kiln_bvh_block block;
    std::uint32_t lane_triangles[KILN_BVH_LEAF_TRIANGLES] = {};
    const std::size_t count = duplicate_merger_.leaf(
        &primitives_[range.begin], &primitives_[range.begin] + range.size(), lane_triangles);
    if (count != range.size())
      // writes are avoided, since all threads share the counter
      duplicates_ += range.size() - count;
    for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
      const bool is_used = lane < count;
      const std::uint32_t index = lane_triangles[is_used ? lane : 0];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const Vec3& p = positions_[triangles_[index][is_used ? corner : 0]];
        block.corner[corner][0][lane] = p.x;
        block.corner[corner][1][lane] = p.y;
        block.corner[corner][2][lane] = p.z;
      }
      block.triangle[lane] = is_used ? index : KILN_NO_TRIANGLE;
    }
    out.blocks.push_back(block);
    return static_cast<std::uint32_t>(out.blocks.size() - 1);
  }

  void emit_nodes(const Range& range, std::uint32_t level, Subtree& out) {
    std::array<Range, KILN_BVH_WIDTH> children;
    const int count = open(range, level, range.size(), children);
    const std::size_t self = out.nodes.size();
    const double leaf_area = out.leaf_area;
    out.nodes.push_back(empty_node());
    out.depth = std::max(out.depth, level + 1);
    for (int i = 0; i < count; ++i) {
      const Range& child = children[static_cast<std::size_t>(i)];
      set_box(out.nodes[self], i, child.box);
      if (child.is_leaf()) {
        out.nodes[self].child[i] = KILN_BVH_LEAF | emit_block(child, out);
        out.leaf_area += double{child.box.half_area()};
      } else {
        out.nodes[self].child[i] = static_cast<std::uint32_t>(out.nodes.size());
        emit_nodes(child, level + 1, out);
      }
    }
    if (out.leaf_area - leaf_area > kMinCrowdedLeaves * double{range.box.half_area()})
      out.has_crowded_leaves = true;
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
          top.leaf_area += double{child.box.half_area()};
        } else {
          std::vector<Task>& list = child.size() > cut ? open_tasks : tasks;
          list.push_back({child, task.level + 1, self, i});
        }
      }
    }
  }

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  bvh::Merger duplicate_merger_;
  bool prisms_;
  PageArray<Primitive> primitives_;
  std::atomic<std::uint64_t> duplicates_{0};
};

}  // namespace

void bvh::throw_bad_index(std::size_t triangle, std::size_t position_count) {
  throw Error(ErrorCode::input,
              "Triangle " + std::to_string(triangle) + " has a vertex index beyond the mesh's " +
                  std::to_string(position_count) + " vertices. Repair the mesh's indices.");
}

void bvh::require_supported_count(std::size_t triangle_count) {
  if (triangle_count < KILN_BVH_LEAF) return;
  throw Error(ErrorCode::input, "The mesh has " + std::to_string(triangle_count) +
                                    " triangles; at most 2147483647 are supported. Split it.");
}

TreeParts bvh::build_parts(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                           bool merge) {
  require_supported_count(triangles.size());
  return Builder(positions, triangles, merge).build();
}

Bvh build_bvh(std::span<const Vec3> positions, std::span<const Triangle> triangles, bool merge) {
  return join_parts(build_parts(positions, triangles, merge));
}

}  // namespace kiln

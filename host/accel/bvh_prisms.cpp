#include "accel/bvh_prisms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "accel/bounding_prism.h"
#include "accel/bvh_range.h"
#include "base/parallel.h"

namespace kiln::bvh {
namespace {

constexpr std::uint32_t kMinPrismTriangles =
    // cost of a prism test in units of triangle tests; subtrees with fewer triangles get no prism
    16;
// A prism is worthwhile if its surface area, or its thickness, is at most this share of that of the node's box and of
// the enclosing prism.
constexpr double kMaxAreaRatio = 0.75, kMaxThicknessRatio = 0.5;
// maximum tilt of thin prisms: with a larger tilt they reject few rays
constexpr double kMaxThinTilt = 0.5;
constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// An inner child that may get a bounding prism.
struct Candidate {
  std::uint32_t node = 0;  ///< Index of the child
  std::uint32_t triangles = 0;
  double box = 0;              ///< Half the surface area of the node's box
  std::array<double, 3> size;  ///< Size of its box
  Prism prism{};
};

class PrismPlacer {
 public:
  explicit PrismPlacer(Bvh& bvh) : bvh_(bvh) {}

  void add() {
    sum_subtrees();
    find_candidates();
    if (candidates_.empty()) return;
    fit_prisms();
    choose_prisms();
    insert_prisms();
  }

 private:
  static bool is_child_used(const kiln_bvh_node& node, std::size_t c) {
    return node.planes[0][0][c] <= node.planes[0][1][c];
  }
  static bool is_leaf(std::uint32_t child) { return (child & KILN_BVH_LEAF) != 0; }

  static std::array<double, 3> box_size_of(const kiln_bvh_node& node, std::size_t c) {
    std::array<double, 3> size;
    for (std::size_t a = 0; a < 3; ++a) {
      size[a] = double{node.planes[a][1][c]} - double{node.planes[a][0][c]};
    }
    return size;
  }
  static double half_area(const std::array<double, 3>& size) {
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
  static double half_area(const kiln_bvh_node& node, std::size_t c) {
    return half_area(box_size_of(node, c));
  }

  /// Counts the triangles and sums the areas of leaves in each node's subtree. A child's index
  /// is larger than its parent's.
  void sum_subtrees() {
    triangles_.assign(bvh_.node_count, 0);
    leaf_area_.assign(bvh_.node_count, 0);
    for (std::size_t i = bvh_.node_count; i-- > 0;) {
      const kiln_bvh_node& node = bvh_.node_data[i];
      for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
        if (!is_child_used(node, c)) continue;
        const std::uint32_t child = node.child[c];
        if (is_leaf(child)) {
          const kiln_bvh_block& block = bvh_.block_data[child & ~KILN_BVH_LEAF];
          for (const kiln_uint triangle : block.triangle) {
            triangles_[i] += triangle != KILN_NO_TRIANGLE ? 1 : 0;
          }
          leaf_area_[i] += half_area(node, c);
        } else {
          triangles_[i] += triangles_[child];
          leaf_area_[i] += leaf_area_[child];
        }
      }
    }
  }

  /// Finds the crowded nodes. The root gets no prism, since it has no parent.
  void find_candidates() {
    std::vector<bool> has_crowded_leaves(bvh_.node_count, false);
    const kiln_bvh_node& top = bvh_.node_data[0];
    Box root;
    for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
      if (!is_child_used(top, c)) continue;
      const auto& p = top.planes;
      root.include(Float4{p[0][0][c], p[1][0][c], p[2][0][c], 0});
      root.include(Float4{p[0][1][c], p[1][1][c], p[2][1][c], 0});
    }
    has_crowded_leaves[0] = leaf_area_[0] > kMinCrowdedLeaves * double{root.half_area()};
    for (std::size_t i = 0; i < bvh_.node_count; ++i) {
      const kiln_bvh_node& node = bvh_.node_data[i];
      for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
        const std::uint32_t child = node.child[c];
        if (!is_child_used(node, c) || is_leaf(child)) continue;
        const std::array<double, 3> size = box_size_of(node, c);
        const double box = half_area(size);
        has_crowded_leaves[child] =
            has_crowded_leaves[i] || leaf_area_[child] > kMinCrowdedLeaves * box;
        if (!has_crowded_leaves[child] || triangles_[child] < kMinPrismTriangles) continue;
        candidates_.push_back({child, triangles_[child], box, size, {}});
      }
    }
  }

  Corners corners_of_subtree(std::uint32_t top, std::size_t triangles) const {
    Corners corners;
    corners.x.reserve(3 * triangles);
    corners.y.reserve(3 * triangles);
    corners.z.reserve(3 * triangles);
    std::vector<std::uint32_t> open{top};
    while (!open.empty()) {
      const kiln_bvh_node& node = bvh_.node_data[open.back()];
      open.pop_back();
      for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
        if (!is_child_used(node, c)) continue;
        if (!is_leaf(node.child[c])) {
          open.push_back(node.child[c]);
          continue;
        }
        const kiln_bvh_block& block = bvh_.block_data[node.child[c] & ~KILN_BVH_LEAF];
        for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
          if (block.triangle[lane] == KILN_NO_TRIANGLE) continue;
          for (const auto& at : block.corner) corners.add(at[0][lane], at[1][lane], at[2][lane]);
        }
      }
    }
    return corners;
  }

  void fit_prisms() {
    std::vector<std::uint32_t> candidate_order(candidates_.size());
    for (std::uint32_t i = 0; i < candidate_order.size(); ++i) candidate_order[i] = i;
    std::stable_sort(candidate_order.begin(), candidate_order.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       return candidates_[a].triangles > candidates_[b].triangles;
                     });
    parallel_for(candidate_order.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Candidate& candidate = candidates_[candidate_order[i]];
        candidate.prism = fit_prism(corners_of_subtree(candidate.node, candidate.triangles));
      }
    });
  }

  /// Chooses prisms top down: those that are much smaller than the node's box and than the enclosing prism.
  void choose_prisms() {
    std::vector<std::uint32_t> candidate_of(bvh_.node_count, kNone);
    for (std::uint32_t i = 0; i < candidates_.size(); ++i) candidate_of[candidates_[i].node] = i;
    struct EnclosingBounds {
      double half_area = std::numeric_limits<double>::infinity();
      double height = half_area;
    };
    std::vector<EnclosingBounds> enclosing_bounds(bvh_.node_count);
    prism_of_node_.assign(bvh_.node_count, kNone);
    for (std::size_t i = 0; i < bvh_.node_count; ++i) {
      if (const std::uint32_t k = candidate_of[i]; k != kNone) {
        const Candidate& candidate = candidates_[k];
        const Prism& prism = candidate.prism;
        const Vec3d& axis = prism.normals[4];
        const double across = std::abs(axis.x) * candidate.size[0] +
                              std::abs(axis.y) * candidate.size[1] +
                              std::abs(axis.z) * candidate.size[2];
        const double height = prism.height() + 2 * prism.slack;
        const bool small = prism.half_area <
                           kMaxAreaRatio * std::min(candidate.box, enclosing_bounds[i].half_area);
        const bool thin =
            prism.half_area < candidate.box && prism.tilt < kMaxThinTilt &&
            height < kMaxThicknessRatio * std::min(across, enclosing_bounds[i].height);
        if (small || thin) {
          prism_of_node_[i] = k;
          enclosing_bounds[i] = {prism.half_area,
                                 prism.tilt < kMaxThinTilt ? height : enclosing_bounds[i].height};
        }
      }
      const kiln_bvh_node& node = bvh_.node_data[i];
      for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
        if (is_child_used(node, c) && !is_leaf(node.child[c]))
          enclosing_bounds[node.child[c]] = enclosing_bounds[i];
      }
    }
  }

  /// Inserts each bounding prism right before its node, and updates the indices of children.
  void insert_prisms() {
    std::vector<std::uint32_t> new_index(bvh_.node_count);
    std::uint32_t prisms = 0;
    for (std::size_t i = 0; i < bvh_.node_count; ++i) {
      if (prism_of_node_[i] != kNone) ++prisms;
      new_index[i] = static_cast<std::uint32_t>(i) + prisms;
    }
    const std::size_t count = bvh_.node_count + prisms;
    if (prisms == 0 || count >= KILN_BVH_PRISM) return;
    auto nodes = std::make_unique_for_overwrite<kiln_bvh_node[]>(count);
    for (std::size_t i = 0; i < bvh_.node_count; ++i) {
      kiln_bvh_node node = bvh_.node_data[i];
      for (kiln_uint& child : node.child) {
        if (is_leaf(child)) continue;
        child = prism_of_node_[child] == kNone ? new_index[child]
                                               : KILN_BVH_PRISM | (new_index[child] - 1);
      }
      nodes[new_index[i]] = node;
      if (prism_of_node_[i] == kNone) continue;
      const kiln_bvh_prism prism = prism_of(candidates_[prism_of_node_[i]].prism);
      static_assert(sizeof prism == sizeof node);
      std::memcpy(&nodes[new_index[i] - 1], &prism, sizeof prism);
    }
    bvh_.node_data = std::move(nodes);
    bvh_.node_count = count;
    bvh_.prisms = prisms;
  }

  Bvh& bvh_;
  std::vector<std::uint32_t> triangles_;
  std::vector<double> leaf_area_;
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> prism_of_node_;  ///< Per node: index of its candidate, or kNone
};

}  // namespace

void add_prisms(Bvh& bvh) { PrismPlacer(bvh).add(); }

}  // namespace kiln::bvh

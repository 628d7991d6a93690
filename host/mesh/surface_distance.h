// Distances from points to a triangle mesh, to measure how far a low poly deviates from a high poly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/box.h"
#include "mesh/vector.h"

namespace kiln {

/// A tree of boxes over triangles, for nearest-point queries. Immutable after construction, so queries may run on
/// several threads. Degenerate triangles count as segments or points. Coordinates should be of about unit size. Cost:
/// O(n log n) to build; about 1 microsecond per query near a surface of 5,000 triangles.
class SurfaceDistance {
 public:
  /// Copies its arguments. Triangles must have finite corners.
  SurfaceDistance(std::span<const Vec3> positions, std::span<const Triangle> triangles);

  /// Squared distance to the surface; infinity if there is no triangle.
  /// \param within  upper bound of the squared distance, as for nearest()
  double squared(const Vec3& point, double within = std::numeric_limits<double>::infinity()) const;
  /// Squared distance to the surface.
  /// \param corners  [out] corners of the nearest triangle; null if there is no triangle
  double squared(const Vec3& point, double within, const Vec3*& corners) const;
  /// True if the surface is within a squared distance of the point. Faster than finding the nearest triangle.
  bool is_within(const Vec3& point, double squared) const;
  /// Index of the nearest triangle; 0 if there is no triangle. Ties are resolved deterministically.
  /// \param within  upper bound of the squared distance, if one is known; it makes the search faster
  std::uint32_t nearest(const Vec3& point,
                        double within = std::numeric_limits<double>::infinity()) const;

  /// Calls `body` with the three corners of each triangle that a ball touches. Some triangles are visited several
  /// times. The order depends on the triangles alone.
  /// \param body  returns whether to continue
  void each_within(const Vec3& center, double squared_radius,
                   const std::function<bool(const Vec3*)>& body) const;

  /// Corners of all triangles, three per triangle, in tree order. Some triangles occur several times.
  std::span<const Vec3> corners() const { return corners_; }
  /// Index of the triangle whose corners stand at 3 * i in corners().
  std::uint32_t triangle_at(std::size_t i) const { return leaf_order_[i]; }

 private:
  struct Node : Box<Vec3> {
    /// For a leaf, its first triangle; for an inner box, the index of its right child
    std::uint32_t first = 0;
    /// For a leaf, its number of triangles; 0 for an inner box, whose left child is the next box
    std::uint32_t count = 0;
  };
  struct TriangleCentre {
    Vec3 center;
    std::uint32_t triangle;
  };
  /// A range of triangles in the tree, and the index of its box.
  struct Part {
    std::size_t first, last, box;
  };
  void cut_long_triangles(std::span<const Vec3> positions, std::span<const Triangle> triangles);
  bool split_part(std::span<TriangleCentre> items, const Part& part, std::array<Part, 2>& halves);
  void build(std::span<TriangleCentre> items, const Part& part);
  void fit_box(std::size_t box);

  std::vector<Node> nodes_;
  /// Pieces of triangles, if the tree is built over pieces. Then TriangleCentre::triangle and leaf_order_ number pieces.
  std::vector<Node> pieces_;
  /// \param leaf_index  [out] index of the nearest triangle in leaf order
  /// \param best        only triangles below this squared distance count
  /// \param enough      the search stops at this squared distance
  /// \returns the squared distance
  double search_nearest(const Vec3& point, std::uint32_t& leaf_index, double best,
                        double enough = -1) const;
  void test_leaf(const Vec3d& at, const Node& leaf, std::uint32_t& leaf_index, double& best) const;

  std::vector<Vec3> corners_;  ///< Corners of all triangles in leaf order, three per triangle
  std::vector<std::uint32_t> leaf_order_;  ///< Index of each triangle in leaf order
};

/// Squared distance of a point to a triangle: to its plane if the point's projection lies inside, otherwise to the
/// nearest edge.
/// \param corners  three corners
/// \param best     results above this need not be exact
double squared_distance_to_triangle(const Vec3d& point, const Vec3* corners, double best);

/// Statistics of distances from one surface to another.
struct DistanceReport {
  double largest = 0;
  double mean = 0;
  double root_mean_square = 0;
  std::uint64_t samples = 0;
  /// Number of samples for which the nearest point was searched. Samples on triangles that the other mesh contains
  /// unchanged need no search.
  std::uint64_t searched_count = 0;
};

/// Index of the i-th of `count` samples, which are evenly spaced in the list of four samples per triangle (corners,
/// then centroid).
inline std::uint64_t distance_sample(std::uint64_t i, std::uint64_t count,
                                     std::uint64_t available) {
  const auto sample = static_cast<std::uint64_t>(
      static_cast<double>(i) * (static_cast<double>(available) / static_cast<double>(count)));
  return sample < available ? sample : available - 1;
}
/// \param k  index of a corner, or 3 for the centroid
inline Vec3 distance_point(std::span<const Vec3> positions, const Triangle& t, std::size_t k) {
  if (k < 3) return positions[t[k]];
  const Vec3 &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
  return {(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3};
}

/// Distances from the low poly to the high poly, sampled at corners, centroids and edge midpoints of the low poly's
/// triangles. Samples on triangles that the high poly contains unchanged need no search. The result does not depend on
/// threads.
DistanceReport low_to_high_distance(const SurfaceDistance& dense, std::span<const Vec3> positions,
                                    std::span<const Triangle> triangles);

/// Distances from the high poly to the low poly, sampled at corners and centroids of the high poly's triangles: at all
/// of them if there are at most `max_samples`, otherwise at evenly spaced ones. Degenerate triangles count; all corners
/// must be finite. The result does not depend on threads. Samples on triangles that the low poly contains unchanged
/// have distance 0 without a search. (Triangle soups keep all their triangles, and their boxes overlap too much for
/// fast searches.)
DistanceReport one_sided_distance(std::span<const Vec3> dense_positions,
                                  std::span<const Triangle> dense_triangles,
                                  const SurfaceDistance& low, std::uint64_t max_samples);

}  // namespace kiln

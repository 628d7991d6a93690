// Distances from points to a triangle mesh: how far a low poly deviates from a high poly.
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

/// A box tree over triangles for nearest-point queries. Immutable after construction; queries may run on several
/// threads. Degenerate triangles count as segments or points. Coordinates should be of about unit size. Cost: O(n log
/// n) to build; about 1 microsecond per query near a surface of 5,000 triangles.
class SurfaceDistance {
 public:
  /// Copies its input. Triangles must have finite corners.
  SurfaceDistance(std::span<const Vec3> positions, std::span<const Triangle> triangles);

  /// Squared distance to the surface; infinity if there is no triangle.
  /// \param within  upper bound of the squared distance, as for nearest()
  double squared(const Vec3& point, double within = std::numeric_limits<double>::infinity()) const;
  /// Squared distance to the surface, and the corners of the nearest triangle; null if there is no triangle.
  double squared(const Vec3& point, double within, const Vec3*& corners) const;
  /// True if a triangle is within a squared distance. Faster than finding the nearest triangle.
  bool is_within(const Vec3& point, double squared) const;
  /// Index of the nearest triangle; 0 if there is no triangle. Ties are resolved deterministically.
  /// \param within  an upper bound of the squared distance, if one is known; speeds up the search
  std::uint32_t nearest(const Vec3& point,
                        double within = std::numeric_limits<double>::infinity()) const;

  /// Calls `body` with the three corners of each triangle that a ball touches, for some triangles repeatedly. The
  /// order depends on the triangles alone.
  void each_within(const Vec3& center, double squared_radius,
                   const std::function<void(const Vec3*)>& body) const;

  /// Corners of all triangles, three per triangle, in tree order; some triangles occur repeatedly.
  std::span<const Vec3> corners() const { return corners_; }

 private:
  struct Node : Box<Vec3> {
    /// Of a leaf, the first triangle; of an inner box, the index of the right child
    std::uint32_t first = 0;
    /// Of a leaf, the number of triangles; 0 for inner boxes, which the left child follows
    std::uint32_t count = 0;
  };
  struct Item {
    Vec3 center;
    std::uint32_t triangle;
  };
  /// A range of triangles of the tree, and the index of its box.
  struct Part {
    std::size_t first, last, box;
  };
  void cut_long_triangles(std::span<const Vec3> positions, std::span<const Triangle> triangles);
  bool split_part(std::span<Item> items, const Part& part, std::array<Part, 2>& halves);
  void build(std::span<Item> items, const Part& part);
  void fit_box(std::size_t box);

  std::vector<Node> nodes_;
  /// Pieces of triangles, if the tree is built over them; Item::triangle and leaf_order_ then number pieces.
  std::vector<Node> pieces_;
  /// \returns the squared distance
  /// \param leaf_index  [out] index of the nearest triangle in leaf order
  /// \param best        squared distance below which triangles count
  /// \param enough      squared distance at which the search stops
  double search_nearest(const Vec3& point, std::uint32_t& leaf_index, double best,
                        double enough = -1) const;
  void test_leaf(const Vec3d& at, const Node& leaf, std::uint32_t& leaf_index, double& best) const;

  std::vector<Vec3> corners_;  ///< Corners of all triangles in leaf order, three per triangle
  std::vector<std::uint32_t> leaf_order_;  ///< Index of each triangle in leaf order
};

/// Squared distance of a point to a triangle: to its plane if the projection is inside, otherwise to the nearest
/// edge.
/// \param corners  three corners
/// \param best     results above this need not be exact
double squared_distance_to_triangle(const Vec3d& point, const Vec3* corners, double best);

/// One-sided distance statistics.
struct DistanceReport {
  double largest = 0;
  double mean = 0;
  double root_mean_square = 0;
  std::uint64_t samples = 0;
  /// Number of samples that required a search, since they lie on triangles that the low poly does not contain
  /// unchanged.
  std::uint64_t searched_count = 0;
};

/// Index of the i-th of `count` samples, evenly spaced in the list of four samples per triangle (corners, then
/// centroid).
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

/// Distances from the low poly to the high poly, sampled at corners, centroids and edge midpoints of its triangles.
/// `searched_count` stays 0. Does not depend on threads.
DistanceReport low_to_high_distance(const SurfaceDistance& dense, std::span<const Vec3> positions,
                                    std::span<const Triangle> triangles);

/// Distances from the high poly to the low poly, sampled at corners and centroids of the high poly's triangles: all
/// of them if there are at most `max_samples`, otherwise evenly spaced ones. Degenerate triangles count; all corners
/// must be finite. Does not depend on threads. Samples on triangles that the low poly contains unchanged have
/// distance 0 without a search. Triangle soups, which keep all triangles, have boxes that overlap too much for fast
/// searches.
DistanceReport one_sided_distance(std::span<const Vec3> dense_positions,
                                  std::span<const Triangle> dense_triangles,
                                  const SurfaceDistance& low, std::uint64_t max_samples);

}  // namespace kiln

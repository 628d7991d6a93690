// Distance from points to a triangle mesh, on the host: how far a low poly strays from a high poly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

struct Vec3d;

/// A box tree over triangles that answers "how far is the nearest surface point". Immutable after
/// construction; queries may run on several threads. Degenerate triangles count as the segment or
/// point that they are. Meant for coordinates of about unit size.
/// Cost: n log n to build; about 1 microsecond a query near the surface of 5,000 triangles.
class SurfaceDistance {
 public:
  /// Copies what it needs. Triangles must have finite corners.
  SurfaceDistance(std::span<const Vec3> positions, std::span<const Triangle> triangles);

  /// Squared distance, in the units of the positions, squared. Infinite where there is no triangle.
  /// \param within  as nearest()
  double squared(const Vec3& point, double within = std::numeric_limits<double>::infinity()) const;
  /// The same, and the corners of the triangle that is nearest; null where there is none.
  double squared(const Vec3& point, double within, const Vec3*& corners) const;
  /// True if some triangle is no farther than a squared distance. Quicker than finding the nearest.
  bool is_within(const Vec3& point, double squared) const;
  /// The triangle that is nearest, as numbered when it was given; 0 where there is none. Of several it is
  /// always the same one.
  /// \param within  a squared distance that one surely is nearer than; what is known of it spares most of the search
  std::uint32_t nearest(const Vec3& point,
                        double within = std::numeric_limits<double>::infinity()) const;

  /// Calls `body` with the three corners of each triangle that a ball touches, of some several times. The order depends
  /// on the triangles alone.
  void each_within(const Vec3& center, double squared_radius,
                   const std::function<void(const Vec3*)>& body) const;

  /// Corners of all triangles, three a triangle, in an order of its own; of some several times.
  std::span<const Vec3> corners() const { return corners_; }

 private:
  struct Box {
    Vec3 low, high;
    std::uint32_t first = 0;  ///< Leaf: first triangle. Inner: index of the right child.
    std::uint32_t count = 0;  ///< Leaf: number of triangles. Inner: 0; the left child follows.
  };
  struct Item {
    Vec3 center;
    std::uint32_t triangle;
  };
  /// Triangles from `first` to `last`, whose box is `box`.
  struct Part {
    std::size_t first, last, box;
  };
  void cut_up(std::span<const Vec3> positions, std::span<const Triangle> triangles);
  bool split(std::span<Item> items, const Part& part, std::array<Part, 2>& halves);
  void build(std::span<Item> items, const Part& part);
  void fit_box(std::size_t box);

  std::vector<Box> boxes_;
  /// While the tree is built of pieces of triangles: these, which Item::triangle and order_ then number.
  std::vector<Box> pieces_;
  /// \returns the squared distance. \param place  out: in the order of the leaves
  /// \param best    no triangle from so far on counts
  /// \param enough  one that is no farther than this ends the search
  double search(const Vec3& point, std::uint32_t& place, double best, double enough = -1) const;
  void look_at(const Vec3d& at, const Box& leaf, std::uint32_t& place, double& best) const;

  std::vector<Vec3> corners_;         ///< Three a triangle, in the order of the leaves.
  std::vector<std::uint32_t> order_;  ///< Triangles in the order of the leaves.
};

/// Squared distance of a triangle: the plane's where the foot lies inside, else the nearest edge's.
/// \param corners  three
/// \param best     what is farther for sure need not be exact
double squared_to_triangle(const Vec3d& point, const Vec3* corners, double best);

/// One-sided distance statistics.
struct DistanceReport {
  double largest = 0;
  double mean = 0;
  double root_mean_square = 0;
  std::uint64_t samples = 0;
  std::uint64_t searched = 0;  ///< Those among them that no kept triangle answers.
};

/// Which of all samples the i-th of `count` is: evenly spaced in the list of four a triangle, its corners, then its
/// centroid.
inline std::uint64_t distance_sample(std::uint64_t i, std::uint64_t count,
                                     std::uint64_t available) {
  const auto sample = static_cast<std::uint64_t>(
      static_cast<double>(i) * (static_cast<double>(available) / static_cast<double>(count)));
  return sample < available ? sample : available - 1;
}
/// \param k  a corner, or 3: the centroid
inline Vec3 distance_point(std::span<const Vec3> positions, const Triangle& t, std::size_t k) {
  if (k < 3) return positions[t[k]];
  const Vec3 &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
  return {(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3};
}

/// Distances from the low poly to the high poly. Samples are corners, centroids and middles of edges of its triangles.
/// `searched` stays 0. Does not depend on threads.
DistanceReport distance_back(const SurfaceDistance& dense, std::span<const Vec3> positions,
                             std::span<const Triangle> triangles);

/// Distances from the high poly to the low poly, sampled at the high poly's triangles' centroids and
/// corners: all of them up to `max_samples`, else evenly spaced ones. Degenerate dense triangles are
/// sampled like the others; all corners must be finite. Does not depend on threads.
/// A triangle that the low poly keeps answers for its own samples: in soups, which keep all, boxes overlap so much
/// that a search would meet a share of them all.
DistanceReport one_sided_distance(std::span<const Vec3> dense_positions,
                                  std::span<const Triangle> dense_triangles,
                                  const SurfaceDistance& low, std::uint64_t max_samples);

}  // namespace kiln

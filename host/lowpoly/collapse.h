// Edge collapse with quadric errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// Reduces a triangle mesh step by step: the edge whose collapse costs least goes first, to the point
/// that its quadric calls best (Garland and Heckbert 1997, "Surface Simplification Using Quadric Error
/// Metrics"), with planes that hold open borders in place (section 6).
///
/// Kept at every step: the topology (link condition; borders do not pinch, components do not vanish),
/// triangles that do not turn over, and, unless that costs several times as much, ones that do not
/// become slivers or turn far.
/// Edges with any number of triangles are allowed. Deterministic: ties go to the lower vertices.
/// Coordinates should be of about unit size; arithmetic is in double precision.
/// Cost: about 5 microseconds a collapse.
class EdgeCollapser {
 public:
  /// Triangles must have three different vertices, and no twin of the same orientation.
  /// \param height_field  vertices on the sides of the bounding rectangle in x and y stay on them, corners
  ///                      where they are, and no triangle turns over as seen from +z
  EdgeCollapser(std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                bool height_field = false);

  /// Collapses until at most `faces` triangles are left, the next collapse would stray from the planes
  /// by more than `distance` (root mean square, by its quadric), or nothing more is allowed. May be
  /// called again with lower `faces` or a longer `distance`, and goes on where it stopped.
  void run(std::size_t faces, double distance = std::numeric_limits<double>::infinity());

  std::size_t faces() const { return faces_; }

  /// What is left, with only the vertices in use, in the order they came.
  void extract(std::vector<Vec3d>& positions, std::vector<Triangle>& triangles) const;

 private:
  /// Sum of squared distances to planes, weighted by area: symmetric matrix, vector, constant.
  struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, c = 0;
    double area = 0;
    void add_plane(const Vec3d& normal, const Vec3d& through, double weight);
    Quadric& operator+=(const Quadric& other);
    double at(const Vec3d& p) const;
  };
  struct Entry {
    double cost;
    std::uint32_t a, b;  ///< a < b
    std::uint32_t stamp_a, stamp_b;
    std::uint32_t leniency;  ///< How often it was refused for the shapes it would leave.
    bool operator<(const Entry& other) const;  ///< Dearer first out last, as std heaps want.
  };
  struct Neighbour {
    std::uint32_t vertex, triangles;
  };

  void find_sides();
  void build_quadrics();
  void fill_heap();
  Entry entry_for(std::uint32_t a, std::uint32_t b) const;
  void push(std::uint32_t a, std::uint32_t b);
  std::vector<std::uint64_t> edges() const;
  Vec3d best_point(std::uint32_t a, std::uint32_t b, const Quadric& sum) const;
  static Vec3d free_point(const Vec3d& pa, const Vec3d& pb, const Quadric& sum);
  bool keeps_shapes(const Entry& entry, const Vec3d& target) const;
  bool keeps_topology(std::uint32_t a, std::uint32_t b);
  bool keeps_shape(std::uint32_t moved, std::uint32_t other, const Vec3d& target,
                   std::uint32_t leniency) const;
  void collapse(std::uint32_t a, std::uint32_t b, const Vec3d& target);
  void tidy(std::uint32_t vertex);
  void gather(std::uint32_t vertex, std::vector<Neighbour>& neighbours) const;
  bool contains(std::uint32_t triangle, std::uint32_t vertex) const;

  std::vector<Vec3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint8_t>
      sides_;  ///< Of the rectangle that a vertex lies on, a bit each; of a height field
  std::vector<std::uint8_t> alive_;  ///< Per triangle.
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> stamps_, valence_;
  std::vector<std::vector<std::uint32_t>>
      around_;  ///< Triangles of a vertex, some no longer alive.
  std::vector<Entry> heap_;
  std::vector<Neighbour> near_a_, near_b_;
  std::size_t faces_ = 0;
};

}  // namespace kiln

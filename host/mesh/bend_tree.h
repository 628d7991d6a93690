// A mesh's area and bend in balls.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// What a part of a surface adds to a ball's sums.
struct BendSums {
  double area = 0;
  double bend = 0;  ///< angle * length / 2 of edges; each triangle has one half of its edges
  /// Adds another part's sums.
  BendSums& operator+=(const BendSums& other) {
    area += other.area;
    bend += other.bend;
    return *this;
  }
};

/// Triangles in a balanced tree of boxes, with the sums of each box. What a ball costs has a bound:
/// more than 800 long triangles, or 3,200 short, may cross its border (needles round one tip, sheets
/// that lie on each other). Then it takes boxes of them, each by the share of one of its triangles.
class BendTree {
 public:
  /// Memory that searches use again, and what they cost. One a thread.
  struct Room {
    std::vector<std::size_t> boxes;        ///< Where the group's searches begin
    std::vector<std::size_t> front, next;  ///< Boxes of one level
    bool crowded = false;                  ///< A ball of the group had too much to clip
    std::uint64_t steps = 0;               ///< Boxes and triangles looked at so far
  };

  /// \param usable  0 for triangles that do not count
  /// \param angle   of each triangle's edges, edge k from corner k, signed; 0: flat
  /// All of them have to outlive the tree.
  BendTree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
           std::span<const std::uint8_t> usable, std::span<const std::array<float, 3>> angle);

  /// Corners of triangles, each once: neighbours in space are neighbours here.
  /// \param place  the one vertex of each vertex's position
  std::vector<std::uint32_t> places(std::span<const std::uint32_t> place) const;

  /// Finds where balls of this radius or less around points of a box may begin: boxes too large to
  /// lie in one of them are opened, boxes beyond all of them left out.
  void begin(const Vec3d& low, const Vec3d& high, double radius, Room& room) const;

  /// The surface's sums in a ball. \param room  of begin(), for a box that the centre is in
  BendSums within(const Vec3d& centre, double radius, Room& room) const;

 private:
  struct Node {
    Vec3 low, high;
    BendSums sums;
  };
  struct Item {
    std::array<float, 3> centre;
    std::uint32_t triangle;
  };
  /// What of a triangle's, or a box's, area and bend lies in a ball.
  struct Shares {
    double area, bend;
  };

  static std::size_t first_of(std::uint32_t level) { return (std::size_t{1} << level) - 1; }
  std::size_t begin_of(std::uint32_t level, std::size_t i) const {
    return static_cast<std::size_t>(std::uint64_t{order_.size()} * i >> level);
  }
  template <typename Body>
  void for_each_of(std::uint32_t level, const Body& body) const;
  static bool lies_in_no_ball(const Node& node, double radius);
  void split(std::uint32_t level, std::size_t i);
  void fill_leaf(std::size_t leaf);
  void join(std::size_t at);
  static void widen(Node& node, const Vec3& low, const Vec3& high);
  std::array<Vec3d, 3> corners(std::uint32_t triangle, const Vec3d& from) const;
  BendSums whole(std::uint32_t triangle) const;
  BendSums clipped(std::size_t item, const Vec3d& centre, double squared) const;
  Shares shares(std::size_t item, const Vec3d& centre, double squared) const;
  bool settled(const Node& node, const Vec3d& centre, double radius, BendSums& sums) const;
  BendSums by_levels(const Vec3d& centre, double radius, Room& room) const;

  std::span<const Vec3> positions_;
  std::span<const Triangle> triangles_;
  std::span<const std::array<float, 3>> angle_;
  std::vector<Item> order_;
  std::uint32_t levels_ = 0;
  std::vector<BendSums> whole_;  // of each item
  std::vector<Node> nodes_;      // level by level; children of i are 2 i + 1 and 2 i + 2
};

}  // namespace kiln

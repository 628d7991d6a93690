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

/// Sums that a part of a surface adds to a ball's.
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

/// A triangle, or a part of one that is long: its cuts are edges without an angle.
struct BendPiece {
  std::array<Vec3, 3> corner;
  std::array<float, 3> angle;  ///< Angle of edge k, from corner k; signed
  float area = 0, bend = 0;    ///< Sums of the whole subtree, as BendSums
};

/// Pieces of triangles in a balanced tree of boxes, with the sums of each box.
///
/// The sums of a ball are exact where its border crosses at most 4,096 pieces. Beyond, boxes
/// with a diagonal below 1/8 of the radius count by the share of their width that is in the ball. Where
/// that, too, leaves more than 4,096 (needles round one tip, sheets that lie on each other), one piece of some hundred
/// in the same box stands for it. So a ball costs some thousand steps at most, however many edges it holds.
class EdgeTree {
 public:
  /// A piece near some balls, with a ball around it.
  struct Near {
    BendPiece piece;
    Vec3d centre;
    double radius = 0;
  };
  /// Space is cut into cubes with sides of a radius: what balls around points of one may hold.
  struct Cell {
    std::array<std::int64_t, 3> at{};
    bool known = false;
    bool few = false;                ///< `pieces` are all; else searches begin at `boxes`
    std::vector<Near> pieces;        ///< In the tree's order
    std::vector<std::size_t> boxes;  ///< ...
  };
  /// Scratch memory that searches use again, and what they cost. One a thread, for one tree.
  struct Scratch {
    std::vector<Cell> cells;
    std::vector<std::size_t> front, next;  ///< Boxes of one level
    std::uint64_t steps = 0;               ///< Boxes and pieces looked at so far
  };

  /// \param usable  0 for triangles that do not count
  /// \param angle   of each triangle's edges, edge k from corner k, signed; 0: flat
  /// \param radius  of the balls
  EdgeTree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
           std::span<const std::uint8_t> usable, std::span<const std::array<float, 3>> angle,
           double radius);

  /// The surface's sums in a ball. They are the same to the bit whatever the scratch was used for before.
  BendSums within(const Vec3d& centre, Scratch& scratch) const;

  std::size_t pieces() const { return pieces_.size(); }

 private:
  struct Node {
    Vec3 low, high;
    BendSums sums;
  };
  struct Item {
    std::array<float, 3> centre;
    std::uint32_t piece;
  };
  /// Shares of a piece's, or a box's, area and bend that lie in a ball.
  struct Shares {
    double area, bend;
  };

  static std::size_t first_of(std::uint32_t level) { return (std::size_t{1} << level) - 1; }
  std::size_t begin_of(std::uint32_t level, std::size_t i) const {
    return static_cast<std::size_t>(std::uint64_t{count_} * i >> level);
  }
  template <typename Body>
  void for_each_of(std::uint32_t level, const Body& body) const;
  void split(std::vector<Item>& order, std::uint32_t level, std::size_t i) const;
  void fill_leaf(std::size_t leaf);
  void join(std::size_t at);
  const Cell& cell_of(const Vec3d& centre, Scratch& scratch) const;
  bool gather(const Vec3d& low, const Vec3d& high, Cell& cell, std::uint64_t& steps) const;
  void begin(const Vec3d& low, const Vec3d& high, Cell& cell, std::uint64_t& steps) const;
  BendSums by_pieces(const Cell& cell, const Vec3d& centre, Scratch& scratch) const;
  BendSums clipped(const BendPiece& piece, const Vec3d& centre, bool& cut) const;
  Shares shares(const BendPiece& piece, const Vec3d& centre) const;
  bool settled(const Node& node, const Vec3d& centre, bool coarse, BendSums& sums) const;
  bool by_boxes(const Cell& cell, const Vec3d& centre, bool coarse, Scratch& scratch,
                BendSums& sums) const;
  BendSums by_levels(const Vec3d& centre, Scratch& scratch) const;

  double radius_, squared_;
  std::size_t count_ = 0;  // of pieces
  std::uint32_t levels_ = 0;
  std::vector<BendPiece> pieces_;  // leaf by leaf
  std::vector<Node> nodes_;        // level by level; children of i are 2 i + 1 and 2 i + 2
};

}  // namespace kiln

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

/// A direction in steps of 1/127 along each axis.
using CoarseNormal = std::array<std::int8_t, 3>;
CoarseNormal coarse_normal(const Vec3d& direction);

/// A triangle, or a part of one that is long: its cuts are edges without an angle.
struct BendPiece {
  std::array<Vec3, 3> corner;
  std::array<float, 3> angle;  ///< Angle of edge k, from corner k; signed
  float area = 0, bend = 0;    ///< Sums of the whole subtree, as BendSums
  std::uint32_t triangle = 0;  ///< Triangle of the mesh
  CoarseNormal normal{};       ///< That triangle's
};

/// Triangles in a set of bounded size, to be emptied and filled anew many times.
class TriangleSet {
 public:
  static constexpr std::uint32_t kMost = 4096;

  void clear() {
    count_ = 0;
    if (slots_.empty()) slots_.resize(kSlots);
    if (++round_ != 0) return;
    slots_.assign(kSlots, {});  // the rounds' numbers begin again
    round_ = 1;
  }
  bool contains(std::uint32_t triangle) const { return slots_[slot_of(triangle)].round == round_; }
  /// \returns false where it is there
  bool add(std::uint32_t triangle) {
    Slot& slot = slots_[slot_of(triangle)];
    if (slot.round == round_) return false;
    slot = {triangle, round_};
    ++count_;
    return true;
  }
  /// No more may be added.
  bool full() const { return count_ == kMost; }

 private:
  static constexpr std::uint32_t kSlots = 4 * kMost;
  struct Slot {
    std::uint32_t triangle = 0, round = 0;
  };
  /// Slot of a triangle, or the one that it would take.
  std::uint32_t slot_of(std::uint32_t triangle) const {
    std::uint32_t at = triangle * 2654435761U % kSlots;
    while (slots_[at].round == round_ && slots_[at].triangle != triangle) at = (at + 1) % kSlots;
    return at;
  }

  std::vector<Slot> slots_;
  std::uint32_t round_ = 0, count_ = 0;
};

/// The sheet that a point lies on: of the surface around it, what is connected with the point and whatever does not
/// look the other way.
struct Sheet {
  Vec3d normal;  ///< Unit, at the point
  const TriangleSet* connected =
      nullptr;  ///< Null: too many to say, so that nothing counts as connected

  /// Cosine below which a face looks the other way. An angle that no regular prism or antiprism has.
  static constexpr double kOpposed = -0.6;

  bool is_opposed(const CoarseNormal& other) const {
    return normal.x * other[0] + normal.y * other[1] + normal.z * other[2] < kOpposed * 127;
  }
  bool counts(const BendPiece& piece) const {
    return !is_opposed(piece.normal) ||
           (connected != nullptr && connected->contains(piece.triangle));
  }
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
    TriangleSet connected;                 ///< With the last point
    std::vector<std::uint32_t> reached;    ///< ... in the order in which they were found
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
  /// The same of one sheet: to the bit within() where the ball holds no other. Where the ball holds more than 8,192
  /// leaves of four pieces, some 2,048 of them stand for all.
  BendSums within(const Vec3d& centre, const Sheet& sheet, Scratch& scratch) const;
  /// True if a ball may hold faces that look the other way than a sheet (Sheet::is_opposed()).
  bool may_hold_opposed(const Vec3d& centre, const Sheet& sheet, Scratch& scratch) const;

  std::size_t pieces() const { return pieces_.size(); }

 private:
  struct Node {
    Vec3 low, high;
    BendSums sums;
    CoarseNormal normal_low{}, normal_high{};  ///< Box of the pieces' normals

    bool may_be_opposed(const Sheet& sheet) const;
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
  template <typename Counts>
  BendSums by_pieces(const Cell& cell, const Vec3d& centre, Scratch& scratch,
                     const Counts& counts) const;
  BendSums of_leaf(std::size_t leaf, const Sheet& sheet, const Vec3d& centre, bool& left_out) const;
  BendSums by_leaves_of(const Sheet& sheet, const Vec3d& centre, Scratch& scratch) const;
  BendSums clipped(const BendPiece& piece, const Vec3d& centre, bool& cut) const;
  Shares shares(const BendPiece& piece, const Vec3d& centre) const;
  bool settled(const Node& node, const Vec3d& centre, bool coarse, BendSums& sums) const;
  bool by_boxes(const Cell& cell, const Vec3d& centre, bool coarse, Scratch& scratch,
                BendSums& sums) const;
  template <typename Settle>
  std::uint32_t open_levels(std::size_t most, Scratch& scratch, const Settle& settle) const;
  BendSums by_levels(const Vec3d& centre, Scratch& scratch) const;

  double radius_, squared_;
  std::size_t count_ = 0;  // of pieces
  std::uint32_t levels_ = 0;
  std::vector<BendPiece> pieces_;  // leaf by leaf
  std::vector<Node> nodes_;        // level by level; children of i are 2 i + 1 and 2 i + 2
};

}  // namespace kiln

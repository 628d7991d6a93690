// A tree of a mesh's pieces of surface, for sums of area and edge bend over balls.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// Area and bend of the part of a surface that lies in a ball.
struct BendSums {
  double area = 0;
  /// Sum of angle * length / 2 over all edges. One half of each edge belongs to each of its two triangles
  double bend = 0;
  /// Adds the sums of another part.
  BendSums& operator+=(const BendSums& other) {
    area += other.area;
    bend += other.bend;
    return *this;
  }
};

/// A direction whose components are quantized to steps of 1/127.
using CoarseNormal = std::array<std::int8_t, 3>;
CoarseNormal coarse_normal(const Vec3d& direction);

/// A triangle, or a piece of a long triangle. Cuts between pieces of a triangle are edges with an angle of 0.
struct BendPiece {
  std::array<Vec3, 3> corner;
  std::array<float, 3> angle;  ///< Signed angle at edge k, which starts at corner k
  float area = 0, bend = 0;    ///< Sums over the whole piece, see BendSums
  std::uint32_t triangle = 0;  ///< Index of the triangle in the mesh
  CoarseNormal normal{};       ///< Normal of the triangle
};

/// A set of at most kMaxTriangles triangles. It can be cleared in constant time.
class TriangleSet {
 public:
  static constexpr std::uint32_t kMaxTriangles = 4096;

  void clear() {
    count_ = 0;
    if (hash_slots_.empty()) hash_slots_.resize(kHashSlots);
    if (++current_round_ != 0) return;
    hash_slots_.assign(kHashSlots,
                       {});  // The round counter has overflowed, so all slots are cleared
    current_round_ = 1;
  }
  bool contains(std::uint32_t triangle) const {
    return hash_slots_[slot_of(triangle)].round == current_round_;
  }
  /// Adds a triangle.
  /// \returns false if it is already in the set
  bool add(std::uint32_t triangle) {
    Slot& slot = hash_slots_[slot_of(triangle)];
    if (slot.round == current_round_) return false;
    slot = {triangle, current_round_};
    ++count_;
    return true;
  }
  /// True if the set has no space left.
  bool full() const { return count_ == kMaxTriangles; }

 private:
  static constexpr std::uint32_t kHashSlots = 4 * kMaxTriangles;
  struct Slot {
    std::uint32_t triangle = 0, round = 0;
  };
  /// Hash slot of a triangle, or the free slot in which it would be stored.
  std::uint32_t slot_of(std::uint32_t triangle) const {
    std::uint32_t at = triangle * 2654435761U % kHashSlots;
    while (hash_slots_[at].round == current_round_ && hash_slots_[at].triangle != triangle)
      at = (at + 1) % kHashSlots;
    return at;
  }

  std::vector<Slot> hash_slots_;
  std::uint32_t current_round_ = 0, count_ = 0;
};

/// The sheet of a point: the surface that is connected with the point or faces in about the same direction.
struct Sheet {
  Vec3d normal{};  ///< Unit normal at the point
  /// Triangles connected with the point; null if there are too many, and then no triangle counts as connected
  const TriangleSet* connected = nullptr;

  /// A face is opposed to the sheet if the cosine between their normals is below this. No regular prism or antiprism
  /// has this angle.
  static constexpr double kMaxOpposedCosine = -0.6;

  bool is_opposed(const CoarseNormal& other) const {
    return normal.x * other[0] + normal.y * other[1] + normal.z * other[2] <
           kMaxOpposedCosine * 127;
  }
  bool belongs_to_sheet(const BendPiece& piece) const {
    return !is_opposed(piece.normal) ||
           (connected != nullptr && connected->contains(piece.triangle));
  }
};

/// Bounding box of a set of normals.
struct NormalBox {
  CoarseNormal low{127, 127, 127}, high{-127, -127, -127};  ///< Empty at first

  void add(const CoarseNormal& normal);
  void add(const NormalBox& other);
  /// True if a normal in the box may be opposed to the sheet.
  bool may_be_opposed(const Sheet& sheet) const;
};

/// A balanced tree of boxes over pieces of triangles. Each box stores the sums of its pieces.
///
/// The sums of a ball are exact if its boundary crosses at most 4,096 pieces. Otherwise, boxes with a diagonal below
/// 1/8 of the radius count in proportion to their overlap with the ball. If the boundary still crosses more than 4,096
/// pieces (as for fans of needles, or overlapping sheets), one piece represents some hundred pieces of a box. So a
/// query takes at most a few thousand steps.
class EdgeTree {
 public:
  /// Bounding sphere of a piece that lies near a cell.
  struct BoundingSphere {
    Vec3d centre{};
    /// The sphere lies outside of a ball whose centre is at this squared distance or farther
    double squared_reach = 0;
    /// The sphere lies inside of a ball whose centre is nearer than this squared distance; 0 if no ball can contain it
    double squared_inside_distance = 0;
  };
  /// Space is divided into cubes whose sides are one radius long. A cell is one cube, with the candidates for balls
  /// around points in it.
  struct Cell {
    std::array<std::int64_t, 3> at{};
    bool is_filled = false;
    /// True if `pieces` lists all candidates; if false, searches start at `boxes`
    bool lists_all_pieces = false;
    std::vector<BendPiece> pieces;        ///< Candidate pieces, in tree order
    std::vector<BoundingSphere> spheres;  ///< Bounding spheres of `pieces`
    NormalBox normals;                    ///< Bounding box of the candidates' normals
    std::vector<std::size_t> boxes;       ///< Nodes at which searches start, in tree order
  };
  /// Reusable scratch memory, and a counter of steps. Each thread needs one for each tree.
  struct Scratch {
    std::vector<Cell> cells;
    std::vector<BendSums> sums;                ///< Sums of each piece in a ball, in tree order
    std::vector<const BendPiece*> cut_pieces;  ///< Pieces that the ball's boundary may cross
    std::vector<std::uint32_t> cut_sums;       ///< Indices of `cut_pieces` in `sums`
    /// Nodes of one tree level, and those of the next level
    std::vector<std::size_t> front, next;
    TriangleSet connected;                      ///< Triangles connected with the most recent point
    std::vector<std::uint32_t> connected_list;  ///< Triangles of `connected` in order of discovery
    std::uint64_t steps = 0;                    ///< Boxes and pieces visited so far
  };

  /// \param usable  for each triangle, 0 if it is skipped
  /// \param angle   for each triangle, the signed angle at edge k, which starts at corner k; 0: flat
  /// \param radius  radius of all balls
  EdgeTree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
           std::span<const std::uint8_t> usable, std::span<const std::array<float, 3>> angle,
           double radius);

  /// Sums of the surface in a ball. The bits do not depend on what the scratch memory was used for before.
  BendSums within(const Vec3d& centre, Scratch& scratch) const;
  /// Sums of one sheet in a ball. Bit-identical to the other within() if the ball contains no other sheet. If the ball
  /// contains more than 8,192 leaves of four pieces, about 2,048 leaves represent them.
  BendSums within(const Vec3d& centre, const Sheet& sheet, Scratch& scratch) const;
  /// True if a ball may contain faces that are opposed to a sheet (Sheet::is_opposed()).
  bool may_hold_opposed(const Vec3d& centre, const Sheet& sheet, Scratch& scratch) const;

  std::size_t pieces() const { return pieces_.size(); }

 private:
  struct Node {
    Vec3 low, high;
    BendSums sums;
    NormalBox normals;  ///< Bounding box of the pieces' normals
  };
  struct PieceCentre {
    std::array<float, 3> centre;
    std::uint32_t piece;
  };
  /// Shares of the area and the bend of a piece, or of a box, that lie in a ball.
  struct BallShares {
    double area, bend;
  };

  static std::size_t first_node_of_level(std::uint32_t level) {
    return (std::size_t{1} << level) - 1;
  }
  std::size_t first_piece_of(std::uint32_t level, std::size_t i) const {
    return static_cast<std::size_t>(std::uint64_t{count_} * i >> level);
  }
  template <typename Body>
  void for_each_node_of(std::uint32_t level, const Body& body) const;
  void split_node(std::vector<PieceCentre>& order, std::uint32_t level, std::size_t i) const;
  void fill_leaf(std::size_t leaf);
  void join(std::size_t at);
  const Cell& cell_of(const Vec3d& centre, Scratch& scratch) const;
  bool collect_pieces(const Vec3d& low, const Vec3d& high, Cell& cell, std::uint64_t& steps) const;
  void find_start_boxes(const Vec3d& low, const Vec3d& high, Cell& cell,
                        std::uint64_t& steps) const;
  template <typename Belongs>
  BendSums sum_by_pieces(const Cell& cell, const Vec3d& centre, Scratch& scratch,
                         const Belongs& belongs) const;
  BendSums sum_leaf(std::size_t leaf, const Sheet& sheet, const Vec3d& centre,
                    bool& left_out) const;
  BendSums sum_by_leaves(const Sheet& sheet, const Vec3d& centre, Scratch& scratch) const;
  BendSums clipped(const BendPiece& piece, const Vec3d& centre, bool& cut) const;
  BendSums clipped(const BendPiece& piece, const std::array<Vec3d, 3>& corner, bool& cut) const;
  BallShares shares_in_ball(const BendPiece& piece, const Vec3d& centre) const;
  bool try_add_unopened(const Node& node, const Vec3d& centre, bool coarse, BendSums& sums) const;
  bool sum_by_boxes(const Cell& cell, const Vec3d& centre, bool coarse, Scratch& scratch,
                    BendSums& sums) const;
  template <typename Settle>
  std::uint32_t open_levels(std::size_t most, Scratch& scratch, const Settle& settle) const;
  BendSums sum_by_levels(const Vec3d& centre, Scratch& scratch) const;

  double radius_, squared_;
  std::size_t count_ = 0;  // Number of pieces
  std::uint32_t levels_ = 0;
  std::vector<BendPiece> pieces_;  // Pieces, leaf by leaf
  // Nodes, level by level; the children of node i are 2 i + 1 and 2 i + 2
  std::vector<Node> nodes_;
};

}  // namespace kiln

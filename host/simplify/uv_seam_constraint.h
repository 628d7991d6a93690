// Constraint that keeps a UV layout, and the borders between groups.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kiln/types.h"
#include "simplify/collapse_constraint.h"
#include "simplify/layout_borders.h"
#include "simplify/layout_copies.h"

namespace kiln {

/// A UV layout: UVs by corner, and group and chart of each triangle.
struct Layout {
  std::vector<Vec2> uvs;
  std::vector<Triangle> corners;  ///< For each triangle, indices into uvs
  /// For each triangle, the index of its combination of group, object and material; empty if all have the same.
  std::vector<std::uint32_t> groups;
  /// For each group, a triangle of the given mesh that has it
  std::vector<std::uint32_t> group_of;
  std::vector<std::uint32_t> charts;  ///< Chart of each triangle
};

/// Keeps UV seams (with their end points and crossings), open borders and borders between groups in place, on the
/// surface and in the layout. No UV triangle flips, and no charts begin to overlap.
///
/// Inside a chart, a vertex that moves gets the UV that fits the affine maps of its triangles best. The error of that
/// fit adds to the cost (Hoppe 1999, "New Quadric Metric for Simplifying Meshes with Appearance Attributes", section
/// 3). UV copies, such as mirrored halves, collapse together, so that they stay copies. A vertex on a seam or border
/// only collapses along that line, into the next vertex on it, together on both sides.
class UvSeamConstraint : public CollapseConstraint {
 public:
  /// \param layout  UVs of equal value at a vertex must have the same index
  UvSeamConstraint(const CollapseMesh& mesh, Layout layout);

  UvSeamConstraint(const UvSeamConstraint&) = delete;
  UvSeamConstraint& operator=(const UvSeamConstraint&) = delete;

  void add_planes(const CollapseMesh& mesh, std::vector<Quadric>& quadrics) const override;
  std::optional<Vec3d> place(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                             Anchor anchor, Quadric& sum) const override;
  bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
             const Vec3d& target) const override;
  void collapse(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                const Vec3d& target, std::uint32_t kept) override;
  bool find_twins(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
                  const Vec3d& target, std::vector<std::array<std::uint32_t, 2>>& twins) override;
  void end_twins() override { moved_uvs_.clear(); }
  bool may_move(const CollapseMesh& mesh, std::uint32_t vertex, const Vec3d& target) const override;

  /// The current layout. Its corners are indexed by the triangles that the constructor received.
  const Layout& layout() const { return layout_; }

 private:
  /// Error of UVs as a quadric (Hoppe 1999). Each triangle maps a position p to a UV coordinate g . p + d, by an affine
  /// map with gradient g; its weight w is its area. The sums are over triangles.
  struct UvErrorSums {
    std::array<Quadric, 2> linear;    ///< For u and for v: sum of w (g . p + d)^2
    std::array<Vec3d, 2> gradient{};  ///< For u and for v: sum of w g
    std::array<double, 2> offset{};   ///< For u and for v: sum of w d
    double weight = 0;
    UvErrorSums& operator+=(const UvErrorSums& other);
    double best_uv(std::size_t axis, const Vec3d& p) const;
  };
  /// A pair of corners that merge: `kept` replaces `gone`.
  struct Pair {
    std::uint32_t gone, kept;
  };
  struct Plan {
    enum class Kind : std::uint8_t { none, inside, onto } kind = Kind::none;
    /// Removed and kept vertex; inside a chart, both move to the merged position
    std::uint32_t gone = 0, kept = 0;
    std::array<Pair, 2> pairs{};
    std::size_t count = 0;
  };

  bool is_line(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b) const;
  bool is_uv_border(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b) const;
  std::uint32_t corner_at(const CollapseMesh& mesh, std::uint32_t t, std::uint32_t vertex) const;
  void classify(const CollapseMesh& mesh, std::span<const std::uint64_t> edges);
  void add_uv_errors(const CollapseMesh& mesh);
  Plan plan(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor) const;
  bool pair_corners(const CollapseMesh& mesh, Plan& plan) const;
  Quadric cost_of(const Plan& plan) const;
  Vec2 uv_at(const Plan& plan, const Vec3d& target) const;
  bool keeps_uvs(const CollapseMesh& mesh, std::uint32_t vertex, const Plan& plan,
                 const Vec2& uv) const;
  bool keeps_line(const CollapseMesh& mesh, const Plan& plan) const;

  /// Rank of a corner: 0 if it has no copies, 1 if it has copies, 2 if it lies on a fold. Of two corners that merge,
  /// the one of lower rank is removed.
  int rank(std::uint32_t uv) const;
  bool has_copies(const Plan& plan) const;
  struct TwinGroup;
  std::uint32_t find_twin_corner(const CollapseMesh& mesh, std::uint32_t gone, const Pair& pair,
                                 bool& unique) const;
  bool add_twins(const CollapseMesh& mesh, TwinGroup& group, std::size_t of) const;

  Layout layout_;
  LayoutCopies uv_copies_;
  std::vector<std::uint32_t> vertex_of_;               ///< Vertex of each UV
  std::unordered_map<std::uint32_t, Vec2> moved_uvs_;  ///< New UVs of copies during a collapse
  LayoutBorders chart_borders_;
  std::vector<UvErrorSums> uv_error_sums_;  ///< Error sums of each UV
  /// For each vertex: kInsideVertex, kLineVertex (it only moves along a seam or border) or kCornerVertex (it does not
  /// move)
  std::vector<std::uint8_t> vertex_class_;
  double scale_ = 1;  ///< Length on the surface of one UV unit
};

}  // namespace kiln

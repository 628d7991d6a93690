// Shape criteria for the triangles an edge collapse leaves.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "simplify/collapse_mesh.h"

namespace kiln {

using TriangleCorners = std::array<Vec3d, 3>;

/// Looks at the triangles around an edge before and after its collapse.
class CollapseShape {
 public:
  /// Times a collapse may be refused for its shapes before only folds stop it.
  static constexpr std::uint32_t kMostLenient = 2;

  explicit CollapseShape(const CollapseMesh& mesh);

  /// From now on no edge may become sharp, or a sharp one sharper by more than this (cosine).
  void limit_edges(double sharpening) { sharpening_ = sharpening; }

  /// True if the triangles that survive have an area and turn little enough for `leniency`. Nor may they face
  /// away from the surface that they stand for, or fold onto a neighbour where none did.
  /// \param b      kNoVertex: `a` is moved alone
  /// \param fixed  an end that does not move: its triangles stay as they are; or kNoVertex
  bool keeps(CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, const Vec3d& target,
             std::uint32_t fixed, std::uint32_t leniency);

  /// The surface around both is what `kept` stands for.
  void merge(std::uint32_t kept, std::uint32_t gone) { facing_[kept] += facing_[gone]; }
  /// Follows CollapseMesh::compact().
  void renumber(const std::vector<std::uint32_t>& number) { renumber_values(facing_, number); }

 private:
  /// A triangle around the vertex that the two become: the corners that stay, in order.
  struct Star {
    std::uint32_t first, second;
    bool turned;          ///< By more than a little.
    Vec3d before, after;  ///< Unit normals; before: zero where there was no area.
  };
  /// Normals, weighted by area, and the area.
  struct Facing {
    Vec3d sum;
    double area = 0;
    Facing& operator+=(const Facing& other);
    double cosine(const Vec3d& unit_normal) const;
  };
  bool add(CollapseMesh& mesh, std::uint32_t moved, std::uint32_t other, const Vec3d& target,
           std::uint32_t leniency, const Facing& facing);
  bool folds(CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t leniency);

  std::vector<Facing> facing_;  ///< Mean orientation of the surface each vertex stands for.
  std::vector<Star> star_;
  bool any_turned_ = false;  ///< True if star_ has any that may fold.
  std::optional<double> sharpening_;
};

}  // namespace kiln

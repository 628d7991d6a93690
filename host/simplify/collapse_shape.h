// Limits of shape for the triangles that an edge collapse leaves.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "simplify/collapse_mesh.h"

namespace kiln {

using TriangleCorners = std::array<Vec3d, 3>;

/// Compares the triangles around an edge before and after its collapse.
class CollapseShape {
 public:
  /// Largest leniency. A collapse that was rejected for bad shapes this often is from then on rejected only for folds.
  static constexpr std::uint32_t kMaxLeniency = 2;

  explicit CollapseShape(const CollapseMesh& mesh);

  /// From now on, no edge may become sharp, and at edges that are sharp already, the cosine may fall by at most
  /// `sharpening`.
  void limit_sharpening(double sharpening) { sharpening_ = sharpening; }

  /// True if every triangle that remains has an area, turns by less than the limit for `leniency`, does not face away
  /// from the surface that it replaces, and does not fold onto a neighbour unless it did before.
  /// \param b      second vertex of the edge; kNoVertex if `a` moves without a collapse
  /// \param fixed  the vertex of the edge that does not move, so that its triangles keep their shape; kNoVertex if both
  ///   move
  bool keeps(CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, const Vec3d& target,
             std::uint32_t fixed, std::uint32_t leniency);

  /// Adds the mean orientation of the surface around `gone` to that of `kept`.
  void merge(std::uint32_t kept, std::uint32_t gone) {
    orientation_of_vertex_[kept] += orientation_of_vertex_[gone];
  }
  /// Renumbers the vertices after CollapseMesh::compact().
  void renumber(const std::vector<std::uint32_t>& number) {
    renumber_values(orientation_of_vertex_, number);
  }

 private:
  /// A triangle around the merged vertex: its two other corners, in the triangle's order, and its normals.
  struct Star {
    std::uint32_t first, second;
    bool turns_far;  ///< True if the triangle turns by more than the angle of kSafeTurnCosine
    /// Unit normals before and after the collapse; `before` is zero if the triangle had no area
    Vec3d before{}, after{};
  };
  /// Sum of area-weighted normals, and sum of areas.
  struct MeanOrientation {
    Vec3d sum{};
    double area = 0;
    MeanOrientation& operator+=(const MeanOrientation& other);
    double cosine_to_mean(const Vec3d& unit_normal) const;
  };
  bool add(CollapseMesh& mesh, std::uint32_t moved, std::uint32_t other, const Vec3d& target,
           std::uint32_t leniency, const MeanOrientation& facing);
  bool creates_folds(CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t leniency);

  /// For each vertex, the mean orientation of all triangles that were merged into it
  std::vector<MeanOrientation> orientation_of_vertex_;
  std::vector<Star> new_triangles_;
  bool any_turns_far_ =
      false;  ///< True if one of new_triangles_ turns by more than the angle of kSafeTurnCosine
  std::optional<double> sharpening_;
};

}  // namespace kiln

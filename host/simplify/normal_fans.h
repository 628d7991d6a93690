// Corners of a low poly that share a normal, and the angle of normals to faces.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/disjoint_sets.h"
#include "kiln/mesh.h"
#include "mesh/two_sided.h"
#include "mesh/vector.h"

namespace kiln {

/// Rows of normals.
using Normals = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// A triangle's normal, twice its area long.
inline Vec3d face_of(const std::vector<Vec3>& positions, const Triangle& t) {
  const Vec3d a(positions[t[0]]);
  return cross(Vec3d(positions[t[1]]) - a, Vec3d(positions[t[2]]) - a);
}

/// Makes rows unit; (0, 0, 1) where one has no direction.
void normalize(Normals& normals);

/// Angle-weighted normals, which look the way of all faces around, if any does.
/// \param slots  of each corner, its normal's row, of `count`
Normals angle_weighted(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint32_t>& slots, std::size_t count);

/// Takes normals towards the angle-weighted ones, where a face would look too far from its normal.
/// \param slots  of each corner, its normal's row
void keep_facing(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                 const std::vector<std::uint32_t>& slots, Normals& normals);

/// Corners share a normal if they share a vertex and its UVs. Normals split at seams thus cost no
/// vertices. At creases, where these are asked for, they do.
class NormalFans {
 public:
  /// \param sides  of `low`: fronts and backs of two-sided sheets share none, nor do sheets by themselves with bodies
  /// \param least_turn  cosine: edges whose faces turn by more are creases, which part normals; -1: none
  /// \param hard  sides of triangles that are creases however they turn, 3 * triangle + corner; empty: none
  explicit NormalFans(const Mesh& low, const TwoSided& sides, double least_turn = -1,
                      const std::vector<bool>& hard = {});

  /// Joins normals over seams where they part by less at both ends.
  /// \param of_seams, of_creases  cosines: of UV seams, and of creases that are none
  void soften(const Normals& normals, const std::vector<std::uint32_t>& slots, double of_seams,
              double of_creases);

  /// The normal of each corner; numbered in the order of vertices.
  std::vector<std::uint32_t> slots();
  std::size_t count() const { return count_; }
  /// Edges that part normals.
  std::size_t hard() const { return seams_.size(); }

 private:
  /// Corners on the two sides of both ends of an edge.
  struct Seam {
    std::array<std::array<std::uint32_t, 2>, 2> ends;
    bool crease;  ///< It is no UV seam.
  };

  std::uint32_t corner(std::uint32_t triangle, std::uint32_t vertex) const {
    const Triangle& t = welded_[triangle];
    return 3 * triangle + (t[0] == vertex ? 0U : t[1] == vertex ? 1U : 2U);
  }
  std::uint32_t uv_of(std::size_t corner) const { return uvs_.empty() ? 0 : uvs_[corner]; }
  bool is_seam(const std::array<std::array<std::uint32_t, 2>, 2>& ends) const;
  std::array<std::array<std::uint32_t, 2>, 2> ends_of(std::uint32_t a, std::uint32_t b,
                                                      std::uint32_t one,
                                                      std::uint32_t other) const {
    return {{{corner(one, a), corner(other, a)}, {corner(one, b), corner(other, b)}}};
  }
  void find_seams(std::size_t vertices);
  std::size_t part_sides(const TwoSided& sides, std::size_t vertices);
  void join_over_edges(const Mesh& low, std::size_t vertices, double least_turn,
                       const std::vector<bool>& hard);

  DisjointSets sets_;
  std::vector<Triangle> welded_;
  std::vector<std::uint32_t>
      uvs_;  ///< By corner, the first UV of the same value; empty: there are none
  std::vector<std::uint32_t> order_;  ///< Corners by vertex
  std::vector<Seam> seams_;
  std::size_t count_ = 0;
};

}  // namespace kiln

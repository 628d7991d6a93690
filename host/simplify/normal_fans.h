// Groups of low-poly corners that share a normal, and angles between normals and faces.
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

/// Matrix with one normal per row.
using Normals = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// A triangle's normal, twice its area long.
inline Vec3d face_of(const std::vector<Vec3>& positions, const Triangle& t) {
  const Vec3d a = to_double(positions[t[0]]);
  return cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a);
}

/// Normalizes rows; zero rows become (0, 0, 1).
void normalize(Normals& normals);

/// Angle-weighted normals that face the same way as all faces around, if possible.
/// \param slots  by corner, its normal's row, of `count`
Normals angle_weighted(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint32_t>& slots, std::size_t count);

/// Blends normals with the angle-weighted ones where the angle to a face would be too large.
/// \param slots  by corner, its normal's row
void keep_facing(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                 const std::vector<std::uint32_t>& slots, Normals& normals);

/// Corners share a normal if they share a vertex and its UVs. Splitting normals at UV seams thus costs no extra
/// vertices; splitting them at creases, which is optional, does.
class NormalFans {
 public:
  /// \param sides  of `low`: fronts and backs of two-sided sheets share no normal, nor do one-sided sheets with
  ///               bodies
  /// \param least_turn  cosine: edges whose faces turn by more are creases, which split normals; -1: none
  /// \param hard  by side, 3 * triangle + corner: true if it is a crease at any angle; empty: none
  explicit NormalFans(const Mesh& low, const TwoSided& sides, double least_turn = -1,
                      const std::vector<bool>& hard = {});

  /// Merges the normals on both sides of seams whose angle at both ends is below a limit.
  /// \param of_seams, of_creases  cosines of the limits: at UV seams, and at creases without a seam
  void soften(const Normals& normals, const std::vector<std::uint32_t>& slots, double of_seams,
              double of_creases);

  /// By corner, the number of its normal; numbered in the order of vertices.
  std::vector<std::uint32_t> slots();
  std::size_t count() const { return count_; }
  /// Number of edges that split normals.
  std::size_t hard() const { return seams_.size(); }

 private:
  /// Corners on both sides of an edge, at both of its ends.
  struct Seam {
    std::array<std::array<std::uint32_t, 2>, 2> ends;
    bool crease;  ///< True for a crease, false for a UV seam.
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
  std::size_t split_sides(const TwoSided& sides, std::size_t vertices);
  void join_over_edges(const Mesh& low, std::size_t vertices, double least_turn,
                       const std::vector<bool>& hard);

  DisjointSets sets_;
  std::vector<Triangle> welded_;
  std::vector<std::uint32_t> uvs_;    ///< By corner, the first UV of the same value; empty: no UVs
  std::vector<std::uint32_t> order_;  ///< Corners, grouped by vertex
  std::vector<Seam> seams_;
  std::size_t count_ = 0;
};

}  // namespace kiln

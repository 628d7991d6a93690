// Groups the corners of a low poly that share a normal, and computes angles between normals and faces.
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

/// A matrix with one normal per row.
using Normals = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// A triangle's normal, with twice the triangle's area as its length.
inline Vec3d face_of(const std::vector<Vec3>& positions, const Triangle& t) {
  const Vec3d a = to_double(positions[t[0]]);
  return cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a);
}

/// Normalizes each row. A zero row becomes (0, 0, 1).
void normalize(Normals& normals);

/// Computes angle-weighted normals, corrected so that each faces the same way as all faces around it where possible.
/// \param normal_of_corner  for each corner, the row of its normal, below `count`
Normals angle_weighted(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint32_t>& normal_of_corner, std::size_t count);

/// Blends each normal whose angle to a face is too large with the angle-weighted normal.
/// \param normal_of_corner  for each corner, the row of its normal
void keep_facing_forward(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                         const std::vector<std::uint32_t>& normal_of_corner, Normals& normals);

/// Corners share a normal if they share a vertex and its UV. So splitting normals at UV seams costs no extra vertices.
/// Splitting them at creases does cost vertices, and is optional.
class NormalFans {
 public:
  /// \param sides  two-sided triangles of `low`: the front and the back of a sheet share no normal, nor do a one-sided
  ///   sheet and a body
  /// \param least_turn  cosine of the largest angle between faces that share a normal. Edges at larger angles are
  ///   creases, at which normals are split; with -1, there are no creases
  /// \param hard  true for each side (3 * triangle + corner) that is a crease at any angle; may be empty
  explicit NormalFans(const Mesh& low, const TwoSided& sides, double least_turn = -1,
                      const std::vector<bool>& hard = {});

  /// Merges the normals on the two sides of a seam if the angle between them is below a limit at both vertices.
  /// \param of_seams, of_creases  cosines of the limits at UV seams, and at creases that are not UV seams
  void soften(const Normals& normals, const std::vector<std::uint32_t>& normal_of_corner,
              double of_seams, double of_creases);

  /// For each corner, the index of its normal. Normals are numbered in the order of vertices.
  std::vector<std::uint32_t> normal_of_corner();
  std::size_t count() const { return count_; }
  /// Number of edges at which normals are split.
  std::size_t count_split_edges() const { return seam_edges_.size(); }

 private:
  /// The four corners at an edge: on both sides, at both vertices.
  struct Seam {
    std::array<std::array<std::uint32_t, 2>, 2> ends;
    bool is_crease;  ///< True for a crease, false for a UV seam
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
  std::size_t split_sheet_sides(const TwoSided& sides, std::size_t vertices);
  void join_over_edges(const Mesh& low, std::size_t vertices, double least_turn,
                       const std::vector<bool>& hard);

  DisjointSets corner_sets_;
  std::vector<Triangle> welded_;
  /// For each corner, the first UV with the same value; empty without UVs
  std::vector<std::uint32_t> uvs_;
  std::vector<std::uint32_t> corners_by_vertex_;  ///< Corners grouped by vertex
  std::vector<Seam> seam_edges_;
  std::size_t count_ = 0;
};

}  // namespace kiln

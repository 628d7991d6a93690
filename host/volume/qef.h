// Quadric error functions of clusters of vertices.
#pragma once

#include <array>

#include "mesh/vector.h"
#include "shared/volume.h"
#include "volume/cell_grid.h"

namespace kiln {

/// Sum over crossings, with point p and unit normal n, of (n . (x - p))^2 = x' A x - 2 b' x + c.
/// Padded coordinates and double precision give an accuracy of 1e-5 cells for clusters of any size.
struct Qef {
  std::array<double, 6> a{};  ///< Symmetric matrix A: xx xy xz yy yz zz
  Vec3d b{};
  double c = 0;
  Vec3d mass{};  ///< Sum of the positions of the crossings
  double count = 0;

  /// \param cell  the cell whose lowest corner is the origin of `local`
  void add(const kiln_volume_qef& local, const CellPlace& cell);
  void add(const Qef& other);

  /// Root-mean-square distance of a point to the tangent planes at the crossings, in cells.
  double error_at(const Vec3d& place) const;

  struct Minimum {
    Vec3d place{};
    double error;  ///< Root-mean-square distance to the tangent planes at the crossings, in cells
  };
  /// The minimum within a box. Along eigenvectors of A whose eigenvalue is below
  /// KILN_VOLUME_EIGEN_LIMIT times the largest, the position is that of the crossings' mean
  /// (Lindstrom 2000, section 3.3).
  Minimum find_minimum(const Vec3d& low, const Vec3d& high) const;
};

}  // namespace kiln

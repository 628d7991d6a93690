// Quadric error functions of clusters of vertices.
#pragma once

#include <array>

#include "mesh/vector.h"
#include "shared/volume.h"
#include "volume/cell_grid.h"

namespace kiln {

/// Sum over crossings (point p, unit normal n) of (n . (x - p))^2 = x' A x - 2 b' x + c, in padded coordinates and
/// double precision: exact to 1e-5 cells for clusters of any size.
struct Qef {
  std::array<double, 6> a{};  ///< Symmetric matrix A: xx xy xz yy yz zz
  Vec3d b{};
  double c = 0;
  Vec3d mass{};  ///< Sum of the positions of the crossings
  double count = 0;

  /// \param cell cell whose lowest corner is the origin of `local`
  void add(const kiln_volume_qef& local, const CellPlace& cell);
  void add(const Qef& other);

  /// Root-mean-square distance of a point to the crossings' planes, in cells.
  double error_at(const Vec3d& place) const;

  struct Minimum {
    Vec3d place{};
    double error;  ///< Root-mean-square distance to the crossings' planes, in cells
  };
  /// The minimum within a box. In directions whose eigenvalues are below KILN_VOLUME_EIGEN_LIMIT of the largest, the
  /// mean of the crossings is used (Lindstrom 2000, section 3.3).
  Minimum find_minimum(const Vec3d& low, const Vec3d& high) const;
};

}  // namespace kiln

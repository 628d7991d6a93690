// Quadric error functions of clusters of vertices.
#pragma once

#include <array>

#include "mesh/vector.h"
#include "shared/volume.h"
#include "volume/cell_grid.h"

namespace kiln {

/// Sum over crossings (point p, unit normal n) of (n . (x - p))^2 = x' A x - 2 b' x + c, in padded
/// coordinates and double precision: a cluster's is exact to 1e-5 cells however many it gathers.
struct Qef {
  std::array<double, 6> a{};  ///< xx xy xz yy yz zz
  Vec3d b;
  double c = 0;
  Vec3d mass;  ///< Sum of the points
  double count = 0;

  /// \param cell  whose lowest corner `local` is relative to
  void add(const kiln_volume_qef& local, const CellPlace& cell);
  void add(const Qef& other);

  /// Root mean square distance of a place to the crossings' planes, cells.
  double error_at(const Vec3d& place) const;

  struct Minimum {
    Vec3d place;
    double error;  ///< Root mean square distance to the crossings' planes, cells
  };
  /// Place where the function is least within a box. Directions whose eigenvalues are below
  /// KILN_VOLUME_EIGEN_LIMIT of the largest keep the crossings' mean (Lindstrom 2000, section 3.3).
  Minimum minimum(const Vec3d& low, const Vec3d& high) const;
};

}  // namespace kiln

// Mean curvature by another way than maps take, to compare them with.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// MeanCurvature's definition in other code: the edges and triangles of the ball one by one, nothing interpolated and
/// nothing left out. Triangles meet by their corners' coordinates, angles are arc cosines, and a triangle's area in the
/// ball is that of 64 strips, to some 0.1% of the ball's disc. Some tenths of a millisecond a point.
class CurvatureCheck {
 public:
  /// Triangles near the last point, one list a thread.
  struct Scratch {
    Vec3d centre;
    std::vector<std::uint32_t> near;
    bool known = false;
  };

  /// As MeanCurvature's, but nothing has to stay.
  CurvatureCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                 double radius);

  /// As MeanCurvature::at().
  double at(const Vec3d& point, Scratch& scratch) const;

 private:
  struct Piece {
    std::array<Vec3d, 3> corner;
    std::array<double, 3> angle{};  ///< Angle of edge k, from corner k; signed
    int order = 0;                  ///< Binary, of its size along x
    double x = 0;                   ///< Its least
  };

  void find_angles();
  void gather(const Vec3d& centre, Scratch& scratch) const;

  double radius_;
  std::vector<Piece> pieces_;  // by `order`, then by `x`, so that those near a place are found
};

}  // namespace kiln

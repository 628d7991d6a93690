// Mean curvature by another way than maps take, to compare them with.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// The curvature of a point's own sheet, as MeanCurvature::on() has it, in other code: the edges and triangles of the
/// ball one by one, nothing interpolated and nothing left out. Triangles meet by their corners' coordinates, angles are
/// arc cosines, and a triangle's area in the ball is that of 64 strips, to some 0.1% of the ball's disc. The patch that
/// is connected with the point is of any size. Some tenths of a millisecond a point.
class CurvatureCheck {
 public:
  /// Triangles near the last point, one list a thread.
  struct Scratch {
    Vec3d centre;
    std::vector<std::uint32_t> near;
    bool known = false;
    std::vector<std::uint8_t> connected;  ///< Per triangle, for the last point
    std::vector<std::uint32_t> reached;
  };

  /// As MeanCurvature's, but nothing has to stay.
  CurvatureCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                 double radius);

  /// At a point of a triangle.
  double at(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;

 private:
  struct Piece {
    std::array<Vec3d, 3> corner;
    std::array<double, 3> angle{};  ///< Angle of edge k, from corner k; signed
    std::array<std::uint32_t, 3>
        beside{};  ///< Ring through the pieces with edge k: the next, 3 * piece + edge
    Vec3d normal;  ///< Unit
    std::uint32_t triangle = 0;
    int order = 0;  ///< Binary, of its size along x
    double x = 0;   ///< Its least
  };

  void find_angles();
  void gather(const Vec3d& centre, Scratch& scratch) const;
  void find_connected(const Vec3d& point, std::uint32_t seed, Scratch& scratch) const;

  double radius_;
  std::vector<std::uint32_t> piece_of_;  // per triangle
  std::vector<Piece> pieces_;  // by `order`, then by `x`, so that those near a place are found
};

}  // namespace kiln

// Mean curvature by an independent method, to check the maps against.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// Mean curvature of the sheet that a point lies on. The definition is that of MeanCurvature::on(),
/// but the computation is independent: each edge and triangle in the ball is integrated by itself,
/// without interpolation or cut-offs. Triangles are connected if their corners have equal
/// coordinates, angles are computed by arc cosines, and the area of a triangle within the ball is
/// integrated over 64 strips, to about 0.1% of the ball's disc. The connected patch may have any
/// size. A point costs tenths of a millisecond.
class CurvatureCheck {
 public:
  /// Working memory of a thread. It keeps the triangles near the last point, for the next one.
  struct Scratch {
    Vec3d centre{};
    std::vector<std::uint32_t> nearby_pieces;
    bool is_gathered = false;
    /// For each gathered triangle, 1 if it is connected with the triangle of the last point
    std::vector<std::uint8_t> is_connected;
    std::vector<std::uint32_t> visited_pieces;
  };

  /// The parameters are those of MeanCurvature's constructor, but are copied.
  CurvatureCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                 double radius);

  /// Mean curvature at a point of a triangle.
  double at(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;

 private:
  struct Piece {
    std::array<Vec3d, 3> corner{};
    std::array<double, 3> angle{};  ///< Signed dihedral angle at edge k, which starts at corner k
    /// For edge k, 3 * p + e: p is the next piece in the ring of pieces around the edge, e the
    /// number of the edge in that piece
    std::array<std::uint32_t, 3> next_side{};
    Vec3d normal{};  ///< Unit normal of the triangle
    std::uint32_t triangle = 0;
    int size_exponent = 0;  ///< Binary exponent of the triangle's size along x
    double x = 0;           ///< Smallest x of the triangle's corners
  };

  void find_angles();
  void gather_pieces(const Vec3d& centre, Scratch& scratch) const;
  void find_connected(const Vec3d& point, std::uint32_t seed, Scratch& scratch) const;

  double radius_;
  std::vector<std::uint32_t> piece_of_;  // For each triangle, the index of its piece
  std::vector<Piece> pieces_;  // Pieces, sorted by `size_exponent`, then by `x`, for range queries
};

}  // namespace kiln

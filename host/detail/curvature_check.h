// Mean curvature by an independent method, to check the maps against.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// The curvature of the point's own sheet, defined as MeanCurvature::on() but computed independently: each edge and
/// triangle in the ball is integrated by itself, without interpolation or cut-offs. Triangles are connected by equal
/// coordinates of corners, angles are arc cosines, and a triangle's area in the ball is integrated over 64 strips, to
/// some 0.1% of the ball's disc. The connected patch may have any size. A point costs tenths of a millisecond.
class CurvatureCheck {
 public:
  /// Working memory of a thread: the triangles near its last point.
  struct Scratch {
    Vec3d centre{};
    std::vector<std::uint32_t> nearby_pieces;
    bool is_gathered = false;
    /// For each triangle, 1 if it is connected with the last point
    std::vector<std::uint8_t> is_connected;
    std::vector<std::uint32_t> visited_pieces;
  };

  /// Takes the parameters of MeanCurvature's constructor, but copies them.
  CurvatureCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                 double radius);

  /// Mean curvature at a point of a triangle.
  double at(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const;

 private:
  struct Piece {
    std::array<Vec3d, 3> corner{};
    std::array<double, 3> angle{};  ///< Angle of edge k, from corner k; signed
    /// Links the pieces around edge k in a ring: 3 * (next piece) + the edge's number there
    std::array<std::uint32_t, 3> next_side{};
    Vec3d normal{};  ///< Unit normal of the triangle
    std::uint32_t triangle = 0;
    int size_exponent = 0;  ///< Binary exponent of the triangle's size along x
    double x = 0;           ///< Smallest x of its corners
  };

  void find_angles();
  void gather_pieces(const Vec3d& centre, Scratch& scratch) const;
  void find_connected(const Vec3d& point, std::uint32_t seed, Scratch& scratch) const;

  double radius_;
  std::vector<std::uint32_t> piece_of_;  // For each triangle, the index of its piece
  std::vector<Piece> pieces_;            // sorted by `order`, then by `x`, for range queries
};

}  // namespace kiln

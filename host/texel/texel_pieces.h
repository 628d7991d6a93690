// UV triangles in fixed point, the input of scan conversion.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/error.h"
#include "mesh/low_surface.h"
#include "mesh/uv_grid.h"
#include "shared/texel.h"

namespace kiln {

/// A texel that no triangle covers, and the triangle that it is assigned to.
struct AssignedTexel {
  std::uint32_t column = 0, row = 0;
  std::uint32_t triangle = 0;
};

/// Pieces of a low poly for scan conversion: first the pieces of its triangles in ascending order, then the pieces that
/// add_assigned_texels() adds for assigned texels.
struct TexelPieces {
  std::uint32_t fraction_bits = 0;  ///< Fixed-point bits below one sample, 10 to 28
  std::vector<kiln_texel_piece> pieces;
  std::vector<kiln_texel_corners> corners;
  std::vector<FixedPointTriangle> fixed_point_triangles;
  /// Warnings "uv-outside", "uv-degenerate", "uv-missing" and "low-degenerate"
  std::vector<Warning> warnings;

  /// Snaps all usable triangles to the grid of 2^-fraction_bits samples. Triangles that reach more than one unit beyond the
  /// unit square are clipped to [-1, 2] x [-1, 2] and become several pieces, in double precision, with the same
  /// result for both triangles at a shared edge. Parts beyond the unit square are counted as outside; triangles
  /// completely outside have no piece.
  /// \param sample_width, sample_height  size of the map in samples, 1 to 2^18
  static TexelPieces of(const LowSurface& surface, std::uint32_t sample_width,
                        std::uint32_t sample_height);

  /// Adds pieces for the given texels, which no other piece covers. Their samples are points of the texel's triangle:
  /// with one sample a texel, the point nearest to the texel's centre; with several, the points nearest to each
  /// sample's own centre, so that they spread over the triangle's part of the texel. All are moved by 1/256 of the
  /// way to the triangle's centre.
  /// \param width, height, samples size of the map in texels; N: N x N samples a texel
  void add_assigned_texels(const LowSurface& surface, std::span<const AssignedTexel> texels,
                           std::uint32_t width, std::uint32_t height, std::uint32_t samples);
};

/// The point of a triangle nearest to (at_x, at_y), as weights of corners 1 and 2.
/// \param x, y coordinates of the corners
std::array<double, 2> nearest_weights(const std::array<double, 3>& x,
                                      const std::array<double, 3>& y, double at_x, double at_y);

}  // namespace kiln

// UV triangles in fixed point: what the texel kernels scan-convert.
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

/// A texel that no triangle covers, given to one.
struct OwnedTexel {
  std::uint32_t column = 0, row = 0;
  std::uint32_t triangle = 0;
};

/// The scan-convertible pieces of a low poly, in ascending order of triangles; after them those of own().
struct TexelPieces {
  std::uint32_t shift = 0;  ///< Fixed-point bits below one sample, 10 to 28
  std::vector<kiln_texel_piece> pieces;
  std::vector<kiln_texel_corners> corners;
  std::vector<FixedTriangle> fixed;
  std::vector<Warning> warnings;  ///< "uv-outside", "uv-degenerate", "uv-missing", "low-degenerate"

  /// Snaps all usable triangles to the grid of 2^-shift samples. Triangles that reach farther than
  /// one unit out of the unit square are clipped to [-1, 2] x [-1, 2]. They become several pieces,
  /// in double precision, the same way from both sides of a shared edge. Parts outside the unit
  /// square count as outside; triangles wholly outside have no piece.
  /// \param sample_width, sample_height  of the map, in samples, 1 to 2^18
  static TexelPieces of(const LowSurface& surface, std::uint32_t sample_width,
                        std::uint32_t sample_height);

  /// Adds pieces that cover texels which no other piece covers, all of their samples. Samples are points of the
  /// texel's triangle: one sample the nearest to the texel's centre; of several, each one near to it, so that they
  /// spread over what the texel holds of the triangle. All are moved by 1/256 of the way to its middle.
  /// \param width, height, samples  of the map, as of() was given them: in texels, and samples a texel's side
  void own(const LowSurface& surface, std::span<const OwnedTexel> texels, std::uint32_t width,
           std::uint32_t height, std::uint32_t samples);
};

/// The barycentric weights of corners 1 and 2 of the point of a triangle that is nearest to a place.
/// \param x, y  of the corners
std::array<double, 2> nearest_weights(const std::array<double, 3>& x,
                                      const std::array<double, 3>& y, double at_x, double at_y);

}  // namespace kiln

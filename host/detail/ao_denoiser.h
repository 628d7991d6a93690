// Less noise in shares of rays: smoothed over the surface as far as it does not blur.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "cl/context.h"
#include "mesh/low_surface.h"
#include "mesh/surface_links.h"

namespace kiln {

/// Chooses for each place how often to smooth, by two estimates of every texel from other rays.
///
/// Smoothed by itself, one estimate is held against the other, unsmoothed one: the mean square of
/// their difference has three parts: the latter's noise, the detail that smoothing lost, and the
/// noise that it left. The noise is the same for all of them, so the lost detail is known over some
/// texels (the choice among a bank of filters after Rousselle, Knaus and Zwicker, "Adaptive Rendering
/// with Non-Local Means Filtering", 2012). The same bytes on every device and number of threads.
class AoDenoiser {
 public:
  AoDenoiser(cl::Context& context, const LowSurface& surface, std::uint32_t width,
             std::uint32_t height);

  /// Texels of a band of rows.
  struct Texels {
    std::uint32_t first_row = 0, row_count = 0;
    std::span<const std::uint32_t> place;     ///< (row - first_row) * width + column
    std::span<const std::uint32_t> triangle;  ///< Triangles of the low poly
    const cl::Array<float>& points;           ///< Positions and normals, 6 planes
    std::uint32_t points_plane = 0;
  };
  void prepare(const Texels& texels);
  /// Bytes a texel on the host while run() works, with its result.
  static constexpr std::uint64_t kBytesOfTexel = (4 * 2 + 2) * sizeof(float);
  /// As many more where it looks for unsure texels.
  static constexpr std::uint64_t kBytesOfUnsure = 3 * 2 * sizeof(float) + 1;

  struct Result {
    std::vector<float> shares;  ///< Per texel
    std::vector<float> errors;  ///< Root mean square expected around it, over some 2,000 texels
    std::vector<std::uint8_t> unsure;  ///< Per texel: 1 where plain rays may be nearer; see run()
  };
  /// \param estimates      two of each texel: a, b, a, b...
  /// \param plain_variance  variance of plain rays, as a share of that of both estimates' mean, to find the texels
  ///                        where these may be nearer; 0: not looked for
  Result run(std::span<const float> estimates, double plain_variance = 0);

 private:
  // After 0, 1, 2, 4 and 8 steps, whose deviations are 0 to 2.3 texels.
  static constexpr std::array<std::uint32_t, 5> kSteps{0, 1, 2, 4, 8};
  static constexpr std::uint32_t kTile = 16;  // texels a side
  /// Two numbers for each texel of each level. The first level is the caller's.
  struct Levels {
    std::array<std::span<const float>, kSteps.size()> of;
    std::array<std::unique_ptr<float[]>, kSteps.size()> memory;
  };
  struct Between {
    std::uint32_t before = 0, behind = 0;
    double way = 0;
  };

  /// Sums over some texels: their number, and of each level squares of errors, and of noise.
  struct Tile {
    double count = 0, blur = 0;  // blur: squares of what the first step loses
    std::array<double, kSteps.size()> error{}, noise{};  // error: without blur
    void add(const Tile& other);
  };
  struct Choice {
    std::int32_t level = -1;  // -1: the tile has no texels
    float error = 0;
    bool is_unsure = false;  // plain rays are expected to be nearer than any level
  };

  std::uint32_t tile_of(std::uint32_t place) const {
    return place / width_ / kTile * tiles_across_ + place % width_ / kTile;
  }
  void sort_into_tiles(const Texels& texels);
  static std::vector<Between> between(std::uint32_t places, std::uint32_t tiles);
  Levels smoothed(std::span<const float> estimates);
  /// Smooths pairs of values in place.
  void smooth(std::uint32_t steps, std::span<float> pairs);
  void launch_steps(std::uint32_t steps);
  Tile errors_of(const Levels& levels, std::size_t tile) const;
  std::vector<Choice> choose(const Levels& levels, double plain_variance) const;
  void widen_unsure(std::vector<Choice>& choices) const;
  void mark_unsure(const Levels& levels, std::span<const float> result, double plain_variance,
                   std::span<std::uint8_t> unsure);

  cl::Context& context_;
  const LowSurface& surface_;
  SurfaceTopology topology_;
  std::uint32_t width_, height_, tiles_across_, tiles_down_ = 0, count_ = 0;
  std::vector<std::uint32_t> place_;       // of each texel
  std::vector<std::uint32_t> tile_first_;  // [tiles + 1] into the next
  std::vector<std::uint32_t> by_tile_;     // texels
  cl::Array<std::uint32_t> neighbours_;    // with their weights
  cl::Array<float> from_, to_;
};

}  // namespace kiln

// Denoises shares of rays: smooths them over the surface wherever that loses no detail.
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

/// Chooses for each texel how often to smooth, from two estimates of it by independent rays.
///
/// Each smoothed estimate is compared with the other, unsmoothed one. The mean squared difference of the two has
/// three parts: the unsmoothed estimate's noise, the detail that smoothing lost, and the noise that smoothing left.
/// The first part is the same for all levels, so the lost detail can be measured over some texels (as Rousselle,
/// Knaus and Zwicker choose among a bank of filters, "Adaptive Rendering with Non-Local Means Filtering", 2012).
/// The result has the same bytes on every device and number of threads.
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
  /// Host memory in bytes a texel that run() and its result take.
  static constexpr std::uint64_t kBytesPerTexel = (4 * 2 + 2) * sizeof(float);
  /// Additional memory, in bytes a texel, of spread() and of run() with a search for unsure texels.
  static constexpr std::uint64_t kBytesPerTexelToFindUnsure =
      (3 * 2 + 1) * sizeof(float) + 1 + 8 * sizeof(std::uint32_t);

  struct Result {
    std::vector<float> shares;  ///< Smoothed share of each texel
    /// Expected root mean square error around the texel, over about 2,000 texels
    std::vector<float> errors;
    /// For each texel, 1 if plain rays may have a smaller error; see run()
    std::vector<std::uint8_t> unsure;
    /// For each texel, the variance of plain rays' shares, measured over the texels within two steps; see run()
    std::vector<float> plain_variance;
  };
  /// \param estimates two of each texel, interleaved: a, b, a, b...
  /// \param plain_variance variance of plain rays, as a share of the variance of both estimates' mean; used to find
  ///     texels where plain rays may have a smaller error. 0: no search
  Result run(std::span<const float> estimates, double plain_variance = 0);

  /// Radius in texels around a texel within which blur is expected. It grows with the difference between the
  /// texel's plain rays and its smoothed share, measured in deviations of the plain rays. 0: smoothing lost no
  /// visible detail.
  static std::uint32_t blur_reach(double plain, double smoothed, double plain_variance);
  /// Marks the texels within `reach` steps of `texels`, across seams, too. Blur follows lines, such as contact
  /// shadows, and single texels of a line may be missed, since their noise is as large as their blur.
  /// \param unsure in/out: per texel: 1 if it is marked
  /// \returns the newly marked texels, ascending
  std::vector<std::uint32_t> spread(std::span<const std::uint32_t> texels, std::uint32_t reach,
                                    std::vector<std::uint8_t>& unsure);

 private:
  // Numbers of smoothing steps of the levels. Standard deviations of their kernels: 0 to 2.3 texels.
  static constexpr std::array<std::uint32_t, 5> kSteps{0, 1, 2, 4, 8};
  static constexpr std::uint32_t kTile = 16;  // Side of a tile in texels
  /// Both estimates of each texel, for each level of smoothing. Level 0 refers to the caller's array.
  struct Levels {
    std::array<std::span<const float>, kSteps.size()> of;
    std::array<std::unique_ptr<float[]>, kSteps.size()> memory;
  };
  struct TileInterpolation {
    std::uint32_t tile_before = 0, tile_after = 0;
    double weight = 0;
  };

  /// Sums over the texels of a tile: their number, and for each level the squared error and the squared
  /// noise.
  struct Tile {
    double count = 0, blur = 0;  // `blur` is the squared error by blur after the first step
    // `error` excludes the blur of the first step
    std::array<double, kSteps.size()> error{}, noise{};
    void add(const Tile& other);
  };
  struct Choice {
    std::int32_t level = -1;  // Index of the level that is used; -1 if the tile has no texels
    float error = 0;
    bool is_unsure = false;  // True if plain rays are expected to have less error than every level
  };

  std::uint32_t tile_of(std::uint32_t place) const {
    return place / width_ / kTile * tiles_across_ + place % width_ / kTile;
  }
  void sort_into_tiles(const Texels& texels);
  static std::vector<TileInterpolation> interpolate_tiles(std::uint32_t places,
                                                          std::uint32_t tiles);
  Levels smoothed(std::span<const float> estimates);
  /// Smooths pairs of values in place.
  void smooth(std::uint32_t steps, std::span<float> pairs);
  void launch_steps(std::uint32_t steps);
  Tile errors_of(const Levels& levels, std::size_t tile) const;
  std::vector<Choice> choose(const Levels& levels, double plain_variance) const;
  void widen_unsure(std::vector<Choice>& choices) const;
  void mark_unsure(const Levels& levels, std::span<const float> smoothed, double plain_variance,
                   Result& result);

  cl::Context& context_;
  const LowSurface& surface_;
  SurfaceTopology topology_;
  std::uint32_t width_, height_, tiles_across_, tiles_down_ = 0, count_ = 0;
  std::vector<std::uint32_t> place_;  // Position of each texel in the band
  // [tiles + 1] Index of each tile's first entry in by_tile_
  std::vector<std::uint32_t> tile_first_;
  std::vector<std::uint32_t> by_tile_;   // Indices of the texels, sorted by tile
  cl::Array<std::uint32_t> neighbours_;  // Neighbours of each texel, with their weights
  // copy of neighbours_, downloaded by the first spread()
  std::vector<std::uint32_t> host_neighbours_;
  cl::Array<float> from_, to_;
};

}  // namespace kiln

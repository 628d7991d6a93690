// Denoises ambient occlusion: smooths it over the surface wherever that loses no detail.
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

/// Chooses for each texel how many smoothing steps to apply, from two estimates of its value by
/// independent rays.
///
/// Each smoothed estimate is compared with the other estimate, unsmoothed. The mean squared
/// difference of these two has three parts: the noise of the unsmoothed estimate, the detail that
/// smoothing lost, and the noise that smoothing left. The first part is the same for all numbers of
/// steps, so the lost detail can be measured by averaging over some texels (as Rousselle, Knaus and
/// Zwicker choose among a bank of filters, "Adaptive Rendering with Non-Local Means Filtering",
/// 2012). The result is bit-identical on every device and for every number of threads.
class AoDenoiser {
 public:
  AoDenoiser(cl::Context& context, const LowSurface& surface, std::uint32_t width,
             std::uint32_t height);

  /// The texels of a band of rows of the map.
  struct Texels {
    std::uint32_t first_row = 0, row_count = 0;
    /// Pixel index in the band: (row - first_row) * width + column
    std::span<const std::uint32_t> place;
    std::span<const std::uint32_t> triangle;  ///< Triangle of the low poly that each texel shows
    /// Six arrays, one per component: positions, then normals
    const cl::Array<float>& points;
    std::uint32_t points_plane = 0;
  };
  void prepare(const Texels& texels);
  /// Host memory for run() and its result, in bytes per texel.
  static constexpr std::uint64_t kBytesPerTexel = (4 * 2 + 2) * sizeof(float);
  /// Additional host memory, in bytes per texel, of run() if it searches for unsure texels, and of
  /// mark_nearby().
  static constexpr std::uint64_t kBytesPerTexelToFindUnsure =
      (3 * 2 + 1) * sizeof(float) + 1 + 8 * sizeof(std::uint32_t);

  struct Result {
    /// Smoothed value of each texel: the share of rays that hit nothing
    std::vector<float> shares;
    /// Expected root-mean-square error around each texel, averaged over about 2,000 texels
    std::vector<float> errors;
    /// For each texel, 1 if it may be better to cast OcclusionOptions::rays rays (plain rays) than
    /// to smooth; see run()
    std::vector<std::uint8_t> unsure;
    /// For each texel, the variance of the result of plain rays, measured over the texels within
    /// two steps; see run()
    std::vector<float> plain_variance;
  };
  /// \param estimates  two estimates of each texel, interleaved: a, b, a, b...
  /// \param plain_variance  variance of the result of plain rays, as a multiple of the variance of
  ///   the mean of both estimates; used to find texels where plain rays may have a smaller error.
  ///   0: no search
  Result run(std::span<const float> estimates, double plain_variance = 0);

  /// Radius in texels around a texel within which smoothing is expected to have blurred detail. It
  /// grows with the difference between the result of the texel's plain rays and its smoothed value,
  /// in standard deviations of the former. 0: smoothing lost no visible detail.
  static std::uint32_t blur_reach(double plain, double smoothed, double plain_variance);
  /// Marks the texels within `reach` steps of `texels` on the surface, which may lie beyond a seam.
  /// Blurred texels form lines, for instance along contact shadows, and mark_unsure() may miss
  /// single texels of a line whose noise is as large as their blur.
  /// \param unsure  [in, out] for each texel, 1 if it is marked
  /// \returns the newly marked texels, ascending
  std::vector<std::uint32_t> mark_nearby(std::span<const std::uint32_t> texels, std::uint32_t reach,
                                         std::vector<std::uint8_t>& unsure);

 private:
  // Number of smoothing steps of each level. The standard deviations of the resulting kernels are 0
  // to 2.3 texels.
  static constexpr std::array<std::uint32_t, 5> kSteps{0, 1, 2, 4, 8};
  static constexpr std::uint32_t kTileSide = 16;  // Side of a tile in texels
  /// Both estimates of each texel at each level of smoothing. Level 0, without smoothing, refers to
  /// the caller's array.
  struct Levels {
    std::array<std::span<const float>, kSteps.size()> estimates;
    std::array<std::unique_ptr<float[]>, kSteps.size()> memory;
  };
  struct TileInterpolation {
    std::uint32_t previous_tile = 0, next_tile = 0;
    double weight = 0;
  };

  /// Sums over the texels of a tile: their number, and for each level of smoothing the squared
  /// error and the squared noise.
  struct Tile {
    // `blur` is the squared error from the blur of the first smoothing step
    double count = 0, blur = 0;
    // `error` does not include the blur of the first smoothing step
    std::array<double, kSteps.size()> error{}, noise{};
    void add(const Tile& other);
  };
  struct LevelChoice {
    std::int32_t level = -1;  // Index of the chosen level; -1 if the tile has no texels
    float error = 0;
    // True if plain rays are expected to have a smaller error than any level of smoothing
    bool is_unsure = false;
  };

  std::uint32_t tile_of(std::uint32_t place) const {
    return place / width_ / kTileSide * tiles_across_ + place % width_ / kTileSide;
  }
  void sort_into_tiles(const Texels& texels);
  static std::vector<TileInterpolation> interpolate_tiles(std::uint32_t places,
                                                          std::uint32_t tiles);
  Levels make_levels(std::span<const float> estimates);
  /// Smooths pairs of values in place.
  void smooth(std::uint32_t steps, std::span<float> pairs);
  void launch_steps(std::uint32_t steps);
  Tile measure_errors(const Levels& levels, std::size_t tile) const;
  std::vector<LevelChoice> choose_levels(const Levels& levels, double plain_variance) const;
  void widen_unsure_tiles(std::vector<LevelChoice>& choices) const;
  void mark_unsure(const Levels& levels, std::span<const float> smoothed, double plain_variance,
                   Result& result);

  cl::Context& context_;
  const LowSurface& surface_;
  SurfaceTopology topology_;
  std::uint32_t width_, height_, tiles_across_, tiles_down_ = 0, count_ = 0;
  std::vector<std::uint32_t> place_;  // Position of each texel in the band
  // [tiles + 1] Index in texels_by_tile_ of each tile's first texel
  std::vector<std::uint32_t> tile_first_;
  std::vector<std::uint32_t> texels_by_tile_;  // Indices of the texels, grouped by tile
  cl::Array<std::uint32_t> neighbours_;        // Neighbours of each texel, with their weights
  // Host copy of neighbours_, downloaded by the first call of mark_nearby()
  std::vector<std::uint32_t> host_neighbours_;
  cl::Array<float> smoothing_input_, smoothing_output_;
};

}  // namespace kiln

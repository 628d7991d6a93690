#include "detail/ao_denoiser.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "detail/hemisphere_rays.h"
#include "mesh/kernels_shared.h"
#include "shared/ao_denoiser.h"
#include "shared/visibility.h"

namespace kiln {
namespace {

constexpr std::size_t kTexelsPerSmoothingTask = 1 << 14;
constexpr std::uint32_t kNone = 0xFFFFFFFFU;

double square(double value) { return value * value; }

/// Smoothing is accepted where it loses no detail; elsewhere a texel is recomputed from
/// OcclusionOptions::rays rays of its own, without smoothing (called plain rays below). Smoothing
/// blurs in several ways, and each has a bound of its own here. Let a and b be the two estimates,
/// whose noise is independent, and r_a and r_b their smoothed versions. Then the product (a - r_a)
/// (b - r_b) is the squared blur plus noise of mean 0. Averaged over n texels, the standard
/// deviation of that noise is the variance of one estimate divided by sqrt(n).
struct BlurBounds {
  /// Maximum squared error of a tile's best level of smoothing, as a share of the squared error of
  /// plain rays. At 0, nothing is smoothed.
  static constexpr double kMaxErrorShare = 0.8;
  /// Number of tiles on each side that are summed to decide about a tile: 5 x 5 tiles, 80 x 80
  /// texels. With 1 instead of 2, the noise of the measured blur exceeds the error of plain rays in
  /// half of the flat tiles.
  static constexpr std::int64_t kTileReach = 2;
  /// Number of standard deviations that are added to a tile's measured blur. With 0, half of the
  /// flat tiles would be accepted by chance where few texels are averaged.
  static constexpr double kBlurDeviations = 0.5;
  /// Bounds on the measured blur: of one texel, in units of an estimate's variance; and of the mean
  /// over the 17 texels within 2 steps and over the 67 texels within 8 steps, in standard
  /// deviations of that mean, which are 1/4 and 1/8 of those of a texel. With higher bounds, thin
  /// lines are smoothed away. With lower ones, noise is mistaken for blur, and plain rays are cast
  /// needlessly.
  static constexpr double kMaxBlurAtTexel = 3, kMaxBlurNear = 2, kMaxBlurFar = 2;
  static constexpr double kNoiseDivisorNear = 4, kNoiseDivisorFar = 8;
  /// Bound on the blur that smoothing steps after the second add, as a multiple of the squared
  /// error of plain rays. This blur is measured with little noise.
  static constexpr double kMaxBlurBeyondTwoSteps = 3;
  /// Maximum squared distance in texels from a texel to the centroid of its smoothing weights,
  /// averaged by 8 steps of smoothing. Texels above it are not smoothed but recomputed from plain
  /// rays: at open borders of charts and at creases, all neighbours lie on one side, so the
  /// gradient of the occlusion shifts the mean. At a straight border the squared distance is 0.25,
  /// or 0.09 after averaging. With a lower bound, texels of flat surfaces would be recomputed, too.
  static constexpr double kMaxSquaredCentroidShift = 0.01;
  /// Squared errors below this are not visible in 8 bits.
  static constexpr double kInvisibleSquaredError = 1.0 / 255 / 255;
  /// Differences between the results of plain rays and of smoothing, in standard deviations of
  /// plain rays, above which texels one step and two steps away are recomputed, too. With higher
  /// values, gaps in a thin line are not closed. With lower ones, texels that are marked by chance
  /// mark_nearby over whole charts. With these values each texel marks 0.16 others by chance on average.
  static constexpr double kBlurOneStepAway = 2.5, kBlurTwoStepsAway = 3;
  /// Minimum variance of plain rays. The measured variance is 0 where both estimates agree by
  /// chance.
  static constexpr double kMinPlainVariance = 4 * kInvisibleSquaredError;
};

/// Sum of two squared differences: between smoothed a and unsmoothed b, and between smoothed b and
/// unsmoothed a.
double cross_error(std::span<const float> raw, std::span<const float> level, std::size_t a) {
  const std::size_t b = a + 1;
  return square(static_cast<double>(raw[a]) - level[b]) +
         square(static_cast<double>(raw[b]) - level[a]);
}

}  // namespace

AoDenoiser::AoDenoiser(cl::Context& context, const LowSurface& surface, std::uint32_t width,
                       std::uint32_t height)
    : context_(context),
      surface_(surface),
      topology_(SurfaceTopology::of(surface)),
      width_(width),
      height_(height),
      tiles_across_((width + kTileSide - 1) / kTileSide) {}

void AoDenoiser::sort_into_tiles(const Texels& texels) {
  tiles_down_ = (texels.row_count + kTileSide - 1) / kTileSide;
  place_.assign(texels.place.begin(), texels.place.end());
  tile_first_.assign(std::size_t{tiles_across_} * tiles_down_ + 1, 0U);
  for (const std::uint32_t place : place_) ++tile_first_[tile_of(place) + 1];
  for (std::size_t t = 1; t < tile_first_.size(); ++t) tile_first_[t] += tile_first_[t - 1];
  texels_by_tile_.resize(count_);
  std::vector<std::uint32_t> next(tile_first_.begin(), tile_first_.end() - 1);
  for (std::uint32_t i = 0; i < count_; ++i) texels_by_tile_[next[tile_of(place_[i])]++] = i;
}

void AoDenoiser::prepare(const Texels& texels) {
  host_neighbours_.clear();
  count_ = static_cast<std::uint32_t>(texels.place.size());
  sort_into_tiles(texels);
  const std::size_t pixels = std::size_t{texels.row_count} * width_;
  const auto number = std::make_unique_for_overwrite<std::uint32_t[]>(pixels);
  const auto triangle = std::make_unique_for_overwrite<std::uint32_t[]>(pixels);
  parallel_for(pixels, kTexelsPerSmoothingTask, [&](std::size_t begin, std::size_t end) {
    std::fill(&number[begin], &number[end], kNone);
    std::fill(&triangle[begin], &triangle[end], KILN_NO_TRIANGLE);
  });
  parallel_for(count_, kTexelsPerSmoothingTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      number[place_[i]] = static_cast<std::uint32_t>(i);
      triangle[place_[i]] = texels.triangle[i];
    }
  });
  const TexelLinks links = TexelLinks::of(surface_, topology_, {triangle.get(), pixels}, width_,
                                          height_, texels.first_row);
  const std::size_t neighbour_count = std::size_t{KILN_AO_DENOISER_NEIGHBOURS} * count_;
  const auto neighbour_or_self = [&](std::uint32_t own, std::uint32_t place) {
    const std::uint32_t found = place == KILN_VISIBILITY_NO_LINK ? kNone : number[place];
    return found == kNone ? own : found;
  };
  make_room(context_, neighbours_, neighbour_count);
  neighbours_.write_by(context_, neighbour_count, [&](std::span<std::uint32_t> neighbours) {
    parallel_for(count_, kTexelsPerSmoothingTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto own = static_cast<std::uint32_t>(i);
        const std::uint32_t at = place_[i], w = width_;
        const bool is_inner_link = links.kind[at] == KILN_VISIBILITY_INNER;
        const std::array<std::uint32_t, KILN_AO_DENOISER_NEIGHBOURS> neighbour{
            at - 1, at + 1, at - w, at + w, at - w - 1, at - w + 1, at + w - 1, at + w + 1};
        for (std::size_t k = 0; k < neighbour.size(); ++k) {
          neighbours[i * neighbour.size() + k] =
              is_inner_link ? neighbour_or_self(own, neighbour[k]) : own;
        }
      }
    });
    constexpr std::size_t kLinkStride = KILN_AO_DENOISER_NEIGHBOURS + 1;
    parallel_for(links.links.size() / kLinkStride, kTexelsPerSmoothingTask,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t b = begin; b < end; ++b) {
                     const std::uint32_t* link = &links.links[b * kLinkStride];
                     const std::uint32_t own = number[link[0]];
                     for (std::size_t k = 0; k < KILN_AO_DENOISER_NEIGHBOURS; ++k) {
                       neighbours[std::size_t{KILN_AO_DENOISER_NEIGHBOURS} * own + k] =
                           neighbour_or_self(own, link[k + 1]);
                     }
                   }
                 });
  });
  const kiln_ao_denoiser_params params{count_, texels.points_plane};
  make_room(context_, smoothing_input_, std::size_t{2} * count_);
  make_room(context_, smoothing_output_, std::size_t{2} * count_);
  context_.launch(context_.kernel("ao_denoiser", "kiln_ao_denoiser_compute_weights"), count_,
                  kLocal, params, neighbours_, texels.points);
}

void AoDenoiser::launch_steps(std::uint32_t steps) {
  const cl::Kernel smooth = context_.kernel("ao_denoiser", "kiln_ao_denoiser_smooth");
  const kiln_ao_denoiser_params params{count_, 0};
  for (std::uint32_t step = 0; step < steps; ++step) {
    context_.launch(smooth, count_, kLocal, params, neighbours_, smoothing_input_,
                    smoothing_output_);
    std::swap(smoothing_input_, smoothing_output_);
  }
}

void AoDenoiser::smooth(std::uint32_t steps, std::span<float> pairs) {
  smoothing_input_.write(context_, std::span<const float>(pairs));
  launch_steps(steps);
  smoothing_input_.read(context_, pairs);
}

AoDenoiser::Levels AoDenoiser::make_levels(std::span<const float> estimates) {
  Levels levels;
  levels.estimates[0] = estimates;
  smoothing_input_.write(context_, estimates);
  for (std::size_t k = 1; k < levels.estimates.size(); ++k) {
    launch_steps(kSteps[k] - kSteps[k - 1]);
    levels.memory[k] = std::make_unique_for_overwrite<float[]>(estimates.size());
    const std::span<float> level(levels.memory[k].get(), estimates.size());
    smoothing_input_.read(context_, level);
    levels.estimates[k] = level;
  }
  return levels;
}

void AoDenoiser::Tile::add(const Tile& other) {
  count += other.count;
  blur += other.blur;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    error[k] += other.error[k];
    noise[k] += other.noise[k];
  }
}

AoDenoiser::Tile AoDenoiser::measure_errors(const Levels& levels, std::size_t tile) const {
  const std::span<const float> raw = levels.estimates[0], smoothed_once = levels.estimates[1];
  Tile sum;
  sum.count = tile_first_[tile + 1] - tile_first_[tile];
  for (std::size_t n = tile_first_[tile]; n < tile_first_[tile + 1]; ++n) {
    const std::size_t a = std::size_t{2} * texels_by_tile_[n], b = a + 1;
    for (std::size_t k = 0; k < levels.estimates.size(); ++k) {
      const std::span<const float> level = levels.estimates[k];
      // The noise of the mean of both estimates is half of the variance of one. The expected
      // squared difference of the estimates is twice that variance; hence the division by 4.
      const double noise = square(static_cast<double>(level[a]) - level[b]) / 4;
      sum.noise[k] += noise;
      if (k <= 1) {
        sum.error[k] += noise;
        continue;
      }
      sum.error[k] += (cross_error(raw, level, a) - cross_error(raw, smoothed_once, a)) / 2 +
                      square(static_cast<double>(smoothed_once[a]) - smoothed_once[b]) / 2 - noise;
    }
    sum.blur += cross_error(raw, smoothed_once, a) / 2 -
                square(static_cast<double>(raw[a]) - raw[b]) / 2 -
                square(static_cast<double>(smoothed_once[a]) - smoothed_once[b]) / 2;
  }
  return sum;
}

std::vector<AoDenoiser::LevelChoice> AoDenoiser::choose_levels(const Levels& levels,
                                                               double plain_variance) const {
  std::vector<Tile> tiles(tile_first_.size() - 1);
  parallel_for(tiles.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) tiles[t] = measure_errors(levels, t);
  });
  std::vector<LevelChoice> choices(tiles.size());
  const auto tile_columns = static_cast<std::int64_t>(tiles_across_);
  const auto down = static_cast<std::int64_t>(tiles_down_);
  parallel_for(tiles.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::int64_t>(begin); t < static_cast<std::int64_t>(end); ++t) {
      const auto own = static_cast<std::size_t>(t);
      if (tiles[own].count == 0) continue;
      const std::int64_t x = t % tile_columns, y = t / tile_columns;
      const auto sum_within = [&](std::int64_t reach) {
        Tile sum;
        for (std::int64_t j = std::max<std::int64_t>(0, y - reach);
             j <= std::min(down - 1, y + reach); ++j) {
          for (std::int64_t i = std::max<std::int64_t>(0, x - reach);
               i <= std::min(tile_columns - 1, x + reach); ++i) {
            sum.add(tiles[static_cast<std::size_t>(j * tile_columns + i)]);
          }
        }
        return sum;
      };
      const Tile adjacent_tiles = sum_within(1);
      // The blur of the first smoothing step is measured from single texels, which are noisy, so
      // two standard deviations of that noise are subtracted. The blur of further steps is measured
      // with less noise.
      const double noise_allowance = 8 * adjacent_tiles.noise[0] / std::sqrt(adjacent_tiles.count);
      const double blur = std::max(0.0, adjacent_tiles.blur - noise_allowance);
      double min_blur = 0;
      for (std::size_t k = 0; k < kSteps.size(); ++k) {
        const double squared_error =
            std::max(adjacent_tiles.error[k], adjacent_tiles.noise[k]) + (k == 0 ? 0.0 : blur);
        if (k != 0 && squared_error >= min_blur) continue;
        min_blur = squared_error;
        choices[own] = {static_cast<std::int32_t>(k),
                        static_cast<float>(std::sqrt(squared_error / adjacent_tiles.count))};
      }
      if (plain_variance == 0) continue;
      // Fewer than two smoothing steps leave more noise than plain rays have. The noise of
      // plain rays is so small that the blur has to be averaged over more texels before the two can
      // be compared.
      const Tile surrounding_tiles = sum_within(BlurBounds::kTileReach);
      const double lost_blur =
          std::max(0.0, surrounding_tiles.blur + BlurBounds::kBlurDeviations * 2 *
                                                     surrounding_tiles.noise[0] /
                                                     std::sqrt(surrounding_tiles.count));
      double best = HUGE_VAL;
      for (std::size_t k = 2; k < kSteps.size(); ++k) {
        const double squared_error =
            std::max(surrounding_tiles.error[k], surrounding_tiles.noise[k]) + lost_blur;
        if (squared_error >= best) continue;
        best = squared_error;
        choices[own].level = static_cast<std::int32_t>(k);
      }
      choices[own].error = static_cast<float>(std::sqrt(best / surrounding_tiles.count));
      choices[own].is_unsure =
          best > BlurBounds::kMaxErrorShare * plain_variance * surrounding_tiles.noise[0] +
                     BlurBounds::kInvisibleSquaredError / 4 * surrounding_tiles.count;
    }
  });
  if (plain_variance > 0) widen_unsure_tiles(choices);
  return choices;
}

/// Marks a tile as unsure if at least half of its neighbours are. Where smoothing fails all around
/// a tile, smoothing the tile alone would save little, and its texels would be the worst of the
/// map.
void AoDenoiser::widen_unsure_tiles(std::vector<LevelChoice>& choices) const {
  const std::vector<LevelChoice> previous = choices;
  const auto across = static_cast<std::int64_t>(tiles_across_);
  const auto down = static_cast<std::int64_t>(tiles_down_);
  for (std::int64_t t = 0; t < across * down; ++t) {
    int unsure = 0, neighbours = 0;
    for (std::int64_t n = 0; n < 9; ++n) {
      const std::int64_t x = t % across + n % 3 - 1, y = t / across + n / 3 - 1;
      if (n == 4 || x < 0 || y < 0 || x >= across || y >= down) continue;
      const LevelChoice& other = previous[static_cast<std::size_t>(y * across + x)];
      if (other.level < 0) continue;
      ++neighbours;
      unsure += other.is_unsure ? 1 : 0;
    }
    if (2 * unsure >= neighbours && unsure > 0)
      choices[static_cast<std::size_t>(t)].is_unsure = true;
  }
}

/// For each coordinate along one side of the map: the tiles whose centres lie before and after it,
/// and the weight of the second tile in the interpolation between them.
std::vector<AoDenoiser::TileInterpolation> AoDenoiser::interpolate_tiles(std::uint32_t places,
                                                                         std::uint32_t tiles) {
  std::vector<TileInterpolation> result(places);
  for (std::uint32_t at = 0; at < places; ++at) {
    const double middle = (at + 0.5) / kTileSide - 0.5, previous = std::floor(middle);
    const auto tile = [&](double number) {
      return static_cast<std::uint32_t>(std::clamp(number, 0.0, tiles - 1.0));
    };
    result[at] = {tile(previous), tile(previous + 1), middle - previous};
  }
  return result;
}

/// Marks texels as unsure where the measured blur exceeds the bounds of BlurBounds.
void AoDenoiser::mark_unsure(const Levels& levels, std::span<const float> smoothed,
                             double plain_variance, Result& result) {
  std::vector<std::uint8_t>& unsure = result.unsure;
  const std::span<const float> raw = levels.estimates[0], smoothed_twice = levels.estimates[2];
  const std::size_t pairs = std::size_t{2} * count_;
  const auto first_blur_memory = std::make_unique_for_overwrite<float[]>(pairs);
  const auto further_blur_memory = std::make_unique_for_overwrite<float[]>(pairs);
  const std::span<float> first_blur(first_blur_memory.get(), pairs),
      further_blur(further_blur_memory.get(), pairs);
  const kiln_ao_denoiser_params params{count_, 0};
  context_.launch(context_.kernel("ao_denoiser", "kiln_ao_denoiser_measure_centroids"), count_,
                  kLocal, params, neighbours_, smoothing_input_);
  // Squared distance from each texel to the centroid of its weights (kMaxSquaredCentroidShift),
  // stored twice per texel
  smoothing_input_.read(context_, further_blur);
  const auto product = [&](std::span<const float> of, std::size_t a) {
    return (of[a] - smoothed[a]) * (of[a + 1] - smoothed[a + 1]);
  };
  parallel_for(count_, kTexelsPerSmoothingTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t a = 2 * i, b = a + 1;
      const float estimate_difference = raw[a] - raw[b];
      first_blur[a] = product(raw, a);
      first_blur[b] = estimate_difference * estimate_difference / 2;
      further_blur[a] = product(smoothed_twice, a);
      // Where surfaces interpenetrate, all rays hit and both estimates are 0. Without noise the
      // blur cannot be measured, so such texels are treated like a chart's border.
      if (raw[a] == 0 && raw[b] == 0) further_blur[b] = 1;
    }
  });
  const auto mark_where = [&](const auto& is_unsure) {
    parallel_for(count_, kTexelsPerSmoothingTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (is_unsure(2 * i)) unsure[i] = 1;
      }
    });
  };
  smooth(kSteps[2], first_blur);
  smooth(kSteps[2], further_blur);
  mark_where([&](std::size_t a) {
    const double variance = first_blur[a + 1];
    return product(raw, a) >
               BlurBounds::kMaxBlurAtTexel * variance + BlurBounds::kInvisibleSquaredError ||
           first_blur[a] > BlurBounds::kMaxBlurNear / BlurBounds::kNoiseDivisorNear * variance +
                               BlurBounds::kInvisibleSquaredError ||
           further_blur[a] > BlurBounds::kMaxBlurBeyondTwoSteps * plain_variance * variance / 2 +
                                 BlurBounds::kInvisibleSquaredError / 4;
  });
  // The variance of the mean of both estimates is half of the measured variance of one.
  for (std::size_t i = 0; i < count_; ++i) {
    result.plain_variance[i] = static_cast<float>(plain_variance * first_blur[2 * i + 1] / 2);
  }
  smooth(kSteps[4] - kSteps[2], first_blur);
  smooth(kSteps[4] - kSteps[2], further_blur);
  mark_where([&](std::size_t a) {
    return first_blur[a] >
               BlurBounds::kMaxBlurFar / BlurBounds::kNoiseDivisorFar * first_blur[a + 1] +
                   BlurBounds::kInvisibleSquaredError ||
           (further_blur[a + 1] > BlurBounds::kMaxSquaredCentroidShift &&
            smoothed[a] + smoothed[a + 1] > 0);
  });
}

std::uint32_t AoDenoiser::blur_reach(double plain, double smoothed, double plain_variance) {
  const double squared_deviations =
      square(plain - smoothed) / std::max(plain_variance, BlurBounds::kMinPlainVariance);
  if (squared_deviations > square(BlurBounds::kBlurTwoStepsAway)) return 2;
  return squared_deviations > square(BlurBounds::kBlurOneStepAway) ? 1 : 0;
}

std::vector<std::uint32_t> AoDenoiser::mark_nearby(std::span<const std::uint32_t> texels,
                                                   std::uint32_t reach,
                                                   std::vector<std::uint8_t>& unsure) {
  // Mask of the low bits of an entry, which hold the neighbour's index; the high bits hold its
  // weight (kiln_ao_denoiser_compute_weights)
  constexpr std::uint32_t kIndexMask = 0xFFFFFFU;
  if (!texels.empty() && host_neighbours_.empty()) {
    host_neighbours_.resize(std::size_t{KILN_AO_DENOISER_NEIGHBOURS} * count_);
    neighbours_.read(context_, std::span(host_neighbours_));
  }
  std::vector<std::uint32_t> added, border(texels.begin(), texels.end());
  // Neighbours that were already marked stay in the list, so that the second step starts from all
  // texels that the first step reached.
  for (std::uint32_t step = 0; step < reach; ++step) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t i : border) {
      for (std::size_t k = 0; k < KILN_AO_DENOISER_NEIGHBOURS; ++k) {
        const std::uint32_t neighbour =
            host_neighbours_[std::size_t{KILN_AO_DENOISER_NEIGHBOURS} * i + k] & kIndexMask;
        next.push_back(neighbour);
        if (std::exchange(unsure[neighbour], std::uint8_t{1}) == 0) added.push_back(neighbour);
      }
    }
    border = std::move(next);
    std::sort(border.begin(), border.end());
    border.erase(std::unique(border.begin(), border.end()), border.end());
  }
  std::sort(added.begin(), added.end());
  return added;
}

AoDenoiser::Result AoDenoiser::run(std::span<const float> estimates, double plain_variance) {
  const Levels levels = make_levels(estimates);
  const std::vector<LevelChoice> choices = choose_levels(levels, plain_variance);
  Result result{std::vector<float>(count_), std::vector<float>(count_), {}, {}};
  std::vector<float> half_results;  // Smoothed versions of estimates a and b, interleaved
  if (plain_variance > 0) {
    half_results.resize(std::size_t{2} * count_);
    result.unsure.resize(count_);
    result.plain_variance.resize(count_);
  }
  const std::vector<TileInterpolation> columns = interpolate_tiles(width_, tiles_across_);
  const std::vector<TileInterpolation> rows =
      interpolate_tiles(tiles_down_ * kTileSide, tiles_down_);
  parallel_for(count_, kTexelsPerSmoothingTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t x = place_[i] % width_, y = place_[i] / width_;
      const auto [x0, x1, right] = columns[x];
      const auto [y0, y1, below] = rows[y];
      double sum = 0, weights = 0, sum_a = 0, sum_b = 0;
      bool is_unsure = false;
      const auto add_tile = [&](std::uint32_t across, std::uint32_t down, double weight) {
        const LevelChoice& choice = choices[std::size_t{down} * tiles_across_ + across];
        if (choice.level < 0) return;
        const std::span<const float> level =
            levels.estimates[static_cast<std::size_t>(choice.level)];
        sum += weight * (static_cast<double>(level[2 * i]) + level[2 * i + 1]) / 2;
        weights += weight;
        if (half_results.empty()) return;
        sum_a += weight * level[2 * i];
        sum_b += weight * level[2 * i + 1];
        is_unsure = is_unsure || choice.is_unsure;
      };
      add_tile(x0, y0, (1 - right) * (1 - below));
      add_tile(x1, y0, right * (1 - below));
      add_tile(x0, y1, (1 - right) * below);
      add_tile(x1, y1, right * below);
      result.shares[i] = static_cast<float>(sum / weights);
      result.errors[i] = choices[std::size_t{y / kTileSide} * tiles_across_ + x / kTileSide].error;
      if (half_results.empty()) continue;
      half_results[2 * i] = static_cast<float>(sum_a / weights);
      half_results[2 * i + 1] = static_cast<float>(sum_b / weights);
      result.unsure[i] = is_unsure ? 1 : 0;
    }
  });
  if (plain_variance > 0) mark_unsure(levels, half_results, plain_variance, result);
  return result;
}

}  // namespace kiln

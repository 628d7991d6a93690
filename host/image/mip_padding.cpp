#include "image/mip_padding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr std::size_t kRowsPerTask = 16, kTexelsPerTask = std::size_t{1} << 18;
/// Padding up to this distance from charts, in texels, is not replaced, because bilinear filters of levels 0 and 1
/// read it.
constexpr int kKeptTexels = 2;
/// The finest level whose bias is corrected. A texel of this level corresponds to a square of
/// texels of the map. All filled texels of a square are moved by the same share of the range in
/// which each may change.
constexpr std::uint32_t kFirstLevel = 4;
constexpr int kMaxRounds = 40;
/// Largest bias of a level that may remain (0.3 steps of 8 bits), and the tolerance of the
/// iteration; both in units of the map's values.
constexpr double kMaxBias = 0.3 / 255, kBiasTolerance = 0.05 / 255;
/// Regularisation of the linear system, as a multiple of its mean diagonal. In a large map, the
/// weights of different levels are almost the same. With less regularisation, neighbouring squares
/// would be moved in opposite directions; this cancels in the biases, but is visible at single
/// charts.
constexpr double kRidge = 2;

/// Single texels are shifted only if moving whole squares leaves a bias above this: 0.4 steps of 8
/// bits, in units of the map's values.
constexpr double kMaxSquareBias = 0.4 / 255;
/// Maximum rounds of Newton's method, and maximum number of times that the regularisation is
/// weakened, when single texels are shifted.
constexpr int kMaxNewtonRounds = 30, kMaxRidgeRounds = 8;
constexpr double kRidgeFactor = 0.1;

/// What a texel is: `chart`, part of a chart; `kept`, a copy of a chart's texel that stays as it
/// is; `shiftable`, such a copy that is not adjacent to a chart and may be shifted in step 3;
/// `filled`, any other texel.
enum class TexelRole : std::uint8_t { chart, kept, shiftable, filled };

/// A level of the mip pyramid: for each texel, the number of chart texels under it, and their mean.
struct MeanLevel {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t> count;
  std::vector<float> mean;
};

std::uint32_t halve(std::uint32_t size) { return (size + 1) / 2; }

bool is_in_chart(std::uint8_t coverage) {
  return coverage == kCoverageBaked || coverage == kCoverageMissed;
}

/// \param keeps_copies  see pad_for_mips()
std::vector<TexelRole> classify_texels(const Image& image, std::span<const std::uint8_t> coverage,
                                       bool keeps_copies) {
  const std::size_t texels = coverage.size(), width = image.width;
  std::vector<std::uint8_t> is_near_chart(texels), is_near_after_step(texels);
  parallel_for(texels, kTexelsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) is_near_chart[i] = is_in_chart(coverage[i]) ? 1 : 0;
  });
  std::vector<std::uint8_t> is_beside_chart;
  for (int step = 0; step < kKeptTexels; ++step) {
    parallel_for(image.height, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        const std::size_t top = y == 0 ? 0 : y - 1;
        const std::size_t bottom = std::min<std::size_t>(y + 1, image.height - 1);
        for (std::size_t x = 0; x < width; ++x) {
          std::uint8_t is_near = 0;
          for (std::size_t v = top; v <= bottom; ++v) {
            for (std::size_t u = x == 0 ? 0 : x - 1; u <= std::min(x + 1, width - 1); ++u)
              is_near |= is_near_chart[v * width + u];
          }
          is_near_after_step[y * width + x] = is_near;
        }
      }
    });
    is_near_chart.swap(is_near_after_step);
    if (step == 0) is_beside_chart = is_near_chart;
  }
  std::vector<TexelRole> result(texels);
  parallel_for(texels, kTexelsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const bool is_copy =
          coverage[i] == kCoverageGutter && (keeps_copies || is_near_chart[i] != 0);
      result[i] = is_in_chart(coverage[i])                   ? TexelRole::chart
                  : !is_copy                                 ? TexelRole::filled
                  : !keeps_copies && is_beside_chart[i] == 0 ? TexelRole::shiftable
                                                             : TexelRole::kept;
    }
  });
  return result;
}

/// Computes the next coarser level.
/// \param fine_count, fine_mean  functions that return the count and the mean of a texel of the
///   finer level
template <typename Count, typename Mean>
MeanLevel make_coarser_level(std::uint32_t width, std::uint32_t height, std::size_t channels,
                             const Count& fine_count, const Mean& fine_mean) {
  MeanLevel level{halve(width), halve(height), {}, {}};
  level.count.resize(std::size_t{level.width} * level.height);
  level.mean.resize(level.count.size() * channels);
  parallel_for(level.height, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < level.width; ++x) {
        double sums[4] = {};
        std::uint32_t count = 0;
        for (std::size_t v = 2 * y; v < std::min<std::size_t>(2 * y + 2, height); ++v) {
          for (std::size_t u = 2 * x; u < std::min<std::size_t>(2 * x + 2, width); ++u) {
            const std::size_t from = v * width + u;
            const std::uint32_t own = fine_count(from);
            if (own == 0) continue;
            count += own;
            const float* const mean = fine_mean(from);
            for (std::size_t c = 0; c < channels; ++c)
              sums[c] += static_cast<double>(own) * static_cast<double>(mean[c]);
          }
        }
        const std::size_t to = y * level.width + x;
        level.count[to] = count;
        for (std::size_t c = 0; c < channels && count != 0; ++c)
          level.mean[to * channels + c] = static_cast<float>(sums[c] / count);
      }
    }
  });
  return level;
}

/// Builds levels 1 and coarser.
std::vector<MeanLevel> make_pyramid(const Image& image, const std::vector<TexelRole>& texels) {
  const std::size_t channels = image.channels;
  std::vector<MeanLevel> levels;
  levels.push_back(make_coarser_level(
      image.width, image.height, channels,
      [&](std::size_t i) { return texels[i] == TexelRole::chart ? 1U : 0U; },
      [&](std::size_t i) { return &image.pixels[i * channels]; }));
  while (levels.back().width > 1 || levels.back().height > 1) {
    const MeanLevel& fine = levels.back();
    levels.push_back(make_coarser_level(
        fine.width, fine.height, channels, [&](std::size_t i) { return fine.count[i]; },
        [&](std::size_t i) { return &fine.mean[i * channels]; }));
  }
  return levels;
}

/// Step 1 of pad_for_mips(): from the coarsest level down, squares without chart texels get the
/// value of the square that encloses them.
void fill_by_squares(Image& image, const std::vector<TexelRole>& texels,
                     std::vector<MeanLevel>& levels) {
  const std::size_t channels = image.channels;
  for (std::size_t k = levels.size() - 1; k-- > 0;) {
    MeanLevel& fine = levels[k];
    const MeanLevel& coarse = levels[k + 1];
    parallel_for(fine.height, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        for (std::size_t x = 0; x < fine.width; ++x) {
          const std::size_t to = y * fine.width + x;
          if (fine.count[to] != 0) continue;
          std::copy_n(&coarse.mean[(y / 2 * coarse.width + x / 2) * channels], channels,
                      &fine.mean[to * channels]);
        }
      }
    });
  }
  const MeanLevel& first = levels.front();
  parallel_for(image.height, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < image.width; ++x) {
        const std::size_t to = y * image.width + x;
        if (texels[to] != TexelRole::filled) continue;
        std::copy_n(&first.mean[(y / 2 * first.width + x / 2) * channels], channels,
                    &image.pixels[to * channels]);
      }
    }
  });
}

/// The range of the charts' values in one channel.
struct ChartRange {
  float low = std::numeric_limits<float>::infinity(), high = -low;
  void add(float value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool is_constant() const { return !(high > low); }
};

/// The ranges of all channels.
std::vector<ChartRange> measure_ranges(const Image& image, const std::vector<TexelRole>& texels) {
  const std::size_t channels = image.channels;
  const std::size_t tasks = (texels.size() + kTexelsPerTask - 1) / kTexelsPerTask;
  std::vector<ChartRange> parts(tasks * channels);
  parallel_for(tasks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t task = begin; task < end; ++task) {
      const std::size_t last = std::min(texels.size(), (task + 1) * kTexelsPerTask);
      for (std::size_t i = task * kTexelsPerTask; i < last; ++i) {
        if (texels[i] != TexelRole::chart) continue;
        for (std::size_t c = 0; c < channels; ++c)
          parts[task * channels + c].add(image.pixels[i * channels + c]);
      }
    }
  });
  // Joined in order, so that of zeros of both signs the first one counts
  std::vector<ChartRange> ranges(channels);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    ranges[i % channels].low = std::min(ranges[i % channels].low, parts[i].low);
    ranges[i % channels].high = std::max(ranges[i % channels].high, parts[i].high);
  }
  return ranges;
}

/// Solves a symmetric positive definite system by Gaussian elimination, which needs no pivoting for such systems.
void solve_positive(std::vector<double>& matrix, std::vector<double>& right) {
  const std::size_t n = right.size();
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t row = k + 1; row < n; ++row) {
      const double factor = matrix[row * n + k] / matrix[k * n + k];
      for (std::size_t column = k; column < n; ++column)
        matrix[row * n + column] -= factor * matrix[k * n + column];
      right[row] -= factor * right[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t column = k + 1; column < n; ++column)
      right[k] -= matrix[k * n + column] * right[column];
    right[k] /= matrix[k * n + k];
  }
}

/// Corrects biases: step 2 of pad_for_mips().
class BiasCorrection {
 public:
  BiasCorrection(Image& image, const std::vector<TexelRole>& texels,
                 const std::vector<MeanLevel>& levels)
      : image_(image), texels_(texels), squares_(levels[kFirstLevel - 1]) {
    const double total_count = levels.back().count[0];
    for (std::size_t k = kFirstLevel - 1; k < levels.size(); ++k) {
      const MeanLevel& level = levels[k];
      const std::size_t shift = k + 1 - kFirstLevel;
      std::vector<double> weights(squares_.count.size());
      for (std::size_t y = 0; y < squares_.height; ++y) {
        for (std::size_t x = 0; x < squares_.width; ++x) {
          const std::size_t u = x >> shift, v = y >> shift;
          weights[y * squares_.width + x] =
              level.count[v * level.width + u] / (total_count * count_texels(u, v, k + 1));
        }
      }
      weights_.push_back(std::move(weights));
    }
  }

  /// \param mean  mean of the charts
  void correct_bias(std::size_t channel, double mean, const ChartRange& range) {
    if (range.is_constant()) return;
    const std::size_t squares = squares_.count.size();
    const Squares now = measure_squares(channel, range);
    // For each square, by which share of the possible range its filled texels are moved: at 1 to
    // the highest value of the charts, at -1 to the lowest.
    std::vector<double> shift_shares(squares);
    bool changed = false;
    for (int round = 0; round < kMaxRounds && compute_step(now, mean, shift_shares); ++round)
      changed = true;
    if (!changed) return;
    parallel_for(image_.height, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        for (std::size_t x = 0; x < image_.width; ++x) {
          const std::size_t i = y * image_.width + x;
          if (texels_[i] != TexelRole::filled) continue;
          const double share =
              shift_shares[(y >> kFirstLevel) * squares_.width + (x >> kFirstLevel)];
          float& own = value(i, channel);
          const double most = share > 0 ? static_cast<double>(range.high) - own
                                        : static_cast<double>(own) - range.low;
          own = std::clamp(static_cast<float>(own + share * most), range.low, range.high);
        }
      }
    });
  }

 private:
  float& value(std::size_t texel, std::size_t channel) const {
    return image_.pixels[texel * image_.channels + channel];
  }
  /// Number of the image's texels under a texel of a level; smaller than the texel's square at the
  /// right and lower borders.
  double count_texels(std::size_t x, std::size_t y, std::size_t level) const {
    const std::size_t side = std::size_t{1} << level;
    return static_cast<double>(std::min<std::size_t>(side, image_.width - x * side)) *
           static_cast<double>(std::min<std::size_t>(side, image_.height - y * side));
  }

  /// For each square: the sum of its values, and by how much its filled texels can raise or lower
  /// that sum.
  struct Squares {
    std::vector<double> sum, max_increase, max_decrease;
  };
  Squares measure_squares(std::size_t channel, const ChartRange& range) const {
    const std::size_t squares = squares_.count.size();
    Squares result{std::vector<double>(squares), std::vector<double>(squares),
                   std::vector<double>(squares)};
    parallel_for(squares_.height, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const std::size_t last = std::min<std::size_t>((row + 1) << kFirstLevel, image_.height);
        for (std::size_t y = row << kFirstLevel; y < last; ++y) {
          for (std::size_t x = 0; x < image_.width; ++x) {
            const std::size_t square = row * squares_.width + (x >> kFirstLevel);
            const std::size_t i = y * image_.width + x;
            const double own = value(i, channel);
            result.sum[square] += own;
            if (texels_[i] != TexelRole::filled) continue;
            result.max_increase[square] += std::max(0.0, range.high - own);
            result.max_decrease[square] += std::max(0.0, own - range.low);
          }
        }
      }
    });
    return result;
  }

  /// Computes one step of the iteration.
  /// \returns false if no bias needs a correction, or none can be corrected
  bool compute_step(const Squares& now, double mean, std::vector<double>& shift_shares) const {
    const std::size_t levels = weights_.size(), squares = shift_shares.size();
    std::vector<double> bias(levels, mean), gain(squares), direction(squares);
    double max_bias = 0;
    for (std::size_t k = 0; k < levels; ++k) {
      for (std::size_t s = 0; s < squares; ++s) {
        const double change =
            shift_shares[s] * (shift_shares[s] > 0 ? now.max_increase[s] : now.max_decrease[s]);
        bias[k] -= weights_[k][s] * (now.sum[s] + change);
      }
      max_bias = std::max(max_bias, std::abs(bias[k]));
      bias[k] = std::copysign(std::max(0.0, std::abs(bias[k]) - kMaxBias), bias[k]);
    }
    if (max_bias <= kMaxBias + kBiasTolerance) return false;
    for (std::size_t k = 0; k < levels; ++k) {
      for (std::size_t s = 0; s < squares; ++s) direction[s] += bias[k] * weights_[k][s];
    }
    for (std::size_t s = 0; s < squares; ++s) {
      const bool up = direction[s] > 0;
      if (up ? shift_shares[s] >= 1 : shift_shares[s] <= -1) continue;
      gain[s] = shift_shares[s] > 0 || (shift_shares[s] == 0 && up) ? now.max_increase[s]
                                                                    : now.max_decrease[s];
    }
    std::vector<double> matrix(levels * levels);
    double diagonal = 0;
    for (std::size_t k = 0; k < levels; ++k) {
      for (std::size_t l = 0; l <= k; ++l) {
        double sum = 0;
        for (std::size_t s = 0; s < squares; ++s) sum += gain[s] * weights_[k][s] * weights_[l][s];
        matrix[k * levels + l] = matrix[l * levels + k] = sum;
      }
      diagonal += matrix[k * levels + k];
    }
    if (!(diagonal > 0)) return false;
    for (std::size_t k = 0; k < levels; ++k)
      matrix[k * levels + k] += kRidge * diagonal / static_cast<double>(levels);
    solve_positive(matrix, bias);
    for (std::size_t s = 0; s < squares; ++s) {
      double change = 0;
      for (std::size_t k = 0; k < levels; ++k) change += bias[k] * weights_[k][s];
      shift_shares[s] = std::clamp(shift_shares[s] + change, -1.0, 1.0);
    }
    return true;
  }

  Image& image_;
  const std::vector<TexelRole>& texels_;
  const MeanLevel& squares_;  ///< The pyramid's level kFirstLevel
  /// For each level from kFirstLevel on, and each square: the weight of the value of one of the
  /// square's texels in the level's weighted mean
  std::vector<std::vector<double>> weights_;
};

/// Shifts single texels: step 3 of pad_for_mips(). It finds the shifts with the smallest sum of
/// squares for which the bias of each level is at most kMaxBias and all values stay within the
/// range of the charts' values. The shift of a texel is a linear combination of its weights in all
/// levels, clamped to that range. The coefficients are the multipliers, which minimise the convex
/// dual of the problem by Newton's method.
class TexelCorrection {
 public:
  TexelCorrection(Image& image, const std::vector<TexelRole>& texels,
                  const std::vector<MeanLevel>& levels)
      : image_(image), texels_(texels), levels_(levels.size()) {
    const double total_count = levels.back().count[0];
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const MeanLevel& level = levels[k];
      std::vector<double> weights(level.count.size());
      for (std::size_t y = 0; y < level.height; ++y) {
        for (std::size_t x = 0; x < level.width; ++x) {
          const std::size_t side = std::size_t{2} << k;
          const auto area = static_cast<double>(std::min(side, image.width - x * side) *
                                                std::min(side, image.height - y * side));
          weights[y * level.width + x] = level.count[y * level.width + x] / (total_count * area);
        }
      }
      widths_.push_back(level.width);
      weights_.push_back(std::move(weights));
    }
  }

  /// \param mean  mean of the charts
  void correct_bias(std::size_t channel, double mean, const ChartRange& range) {
    if (range.is_constant()) return;
    channel_ = channel;
    range_ = {range.low, range.high};
    // Most maps need no shifts, which an estimate shows.
    constexpr double kEstimateError =
        1e-9;  // As a share of the largest value; rounding is far below
    const double margin =
        kEstimateError * std::max(std::abs(double{range.low}), std::abs(double{range.high}));
    const std::vector<double> estimates = estimate_biases(mean);
    if (std::all_of(estimates.begin(), estimates.end(),
                    [&](double bias) { return std::abs(bias) + margin <= kMaxSquareBias; })) {
      return;
    }
    std::vector<double> target = compute_biases(mean);
    if (std::none_of(target.begin(), target.end(),
                     [](double bias) { return std::abs(bias) > kMaxSquareBias; })) {
      return;
    }
    // Only the part of a bias beyond the bound has to be corrected.
    for (double& bias : target) bias -= std::clamp(bias, -kMaxBias, kMaxBias);
    std::vector<double> multipliers(levels_, 0.0);
    DualState state = evaluate(multipliers, target);
    double ridge = state.trace() / static_cast<double>(levels_), least = state.largest_bias();
    std::vector<double> best = multipliers;
    for (int round = 0; round < kMaxRidgeRounds && ridge > 0 && least > kBiasTolerance; ++round) {
      ridge *= kRidgeFactor;
      minimise(target, ridge, multipliers, state);
      if (state.largest_bias() >= least) continue;
      least = state.largest_bias();
      best = multipliers;
    }
    multipliers = std::move(best);
    apply(multipliers);
  }

 private:
  struct DualState {
    double dual = 0;
    std::vector<double> bias;  ///< Part of each level's bias that exceeds the bias that may remain
    std::vector<double> matrix;  ///< Derivatives of `bias` with respect to the multipliers
    double largest_bias() const {
      double largest = 0;
      for (const double each : bias) largest = std::max(largest, std::abs(each));
      return largest;
    }
    double trace() const {
      double sum = 0;
      for (std::size_t k = 0; k < bias.size(); ++k) sum += matrix[k * bias.size() + k];
      return sum;
    }
  };

  float& value(std::size_t texel) const {
    return image_.pixels[texel * image_.channels + channel_];
  }
  bool is_free(std::size_t texel) const {
    return texels_[texel] == TexelRole::filled || texels_[texel] == TexelRole::shiftable;
  }

  /// The bias of each level: the mean of its texels, weighted by the charts' area under each, minus
  /// the mean of the charts.
  std::vector<double> compute_biases(double mean) const {
    const std::size_t rows = (image_.height + kRowsPerTask - 1) / kRowsPerTask;
    std::vector<double> parts(rows * levels_, 0.0);
    parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const std::size_t last = std::min<std::size_t>((row + 1) * kRowsPerTask, image_.height);
        for (std::size_t y = row * kRowsPerTask; y < last; ++y) {
          for (std::size_t x = 0; x < image_.width; ++x) {
            const double own = value(y * image_.width + x);
            for (std::size_t k = 0; k < levels_; ++k)
              parts[row * levels_ + k] += weight(k, x, y) * own;
          }
        }
      }
    });
    std::vector<double> result(levels_, -mean);
    for (std::size_t i = 0; i < parts.size(); ++i) result[i % levels_] += parts[i];
    return result;
  }

  /// Computes the same as compute_biases(), but adds the sums of each level's squares to get those of the next level.
  /// This takes far fewer additions, whose rounding differs.
  std::vector<double> estimate_biases(double mean) const {
    // The rows of a task are one row of squares of this level.
    constexpr std::size_t kTaskLevels = kFirstLevel;
    static_assert(kRowsPerTask == std::size_t{1} << kTaskLevels);
    const std::size_t tasks = (image_.height + kRowsPerTask - 1) / kRowsPerTask;
    std::size_t width = widths_[kTaskLevels - 1], height = tasks;
    std::vector<double> parts(tasks * kTaskLevels), sums(width * height);
    parallel_for(tasks, 1, [&](std::size_t begin, std::size_t end) {
      std::vector<double> fine, coarse;
      for (std::size_t task = begin; task < end; ++task) {
        const std::size_t first = task * kRowsPerTask;
        std::size_t rows = std::min<std::size_t>(kRowsPerTask, image_.height - first);
        fine.resize(rows * image_.width);
        for (std::size_t i = 0; i < fine.size(); ++i) fine[i] = value(first * image_.width + i);
        std::size_t columns = image_.width;
        for (std::size_t k = 0; k < kTaskLevels; ++k) {
          coarse = sum_squares(fine, columns, rows);
          columns = widths_[k];
          rows = halve(static_cast<std::uint32_t>(rows));
          parts[task * kTaskLevels + k] = weigh(coarse, &weights_[k][(first >> (k + 1)) * columns]);
          fine.swap(coarse);
        }
        std::copy(fine.begin(), fine.end(),
                  sums.begin() + static_cast<std::ptrdiff_t>(task * width));
      }
    });
    std::vector<double> result(levels_, -mean);
    for (std::size_t i = 0; i < parts.size(); ++i) result[i % kTaskLevels] += parts[i];
    for (std::size_t k = kTaskLevels; k < levels_; ++k) {
      sums = sum_squares(sums, width, height);
      width = widths_[k];
      height = halve(static_cast<std::uint32_t>(height));
      result[k] += weigh(sums, weights_[k].data());
    }
    return result;
  }

  /// The sums over squares of 2 x 2 elements.
  static std::vector<double> sum_squares(const std::vector<double>& fine, std::size_t width,
                                         std::size_t height) {
    const std::size_t columns = (width + 1) / 2;
    std::vector<double> sums(columns * ((height + 1) / 2));
    for (std::size_t y = 0; y < height; ++y) {
      for (std::size_t x = 0; x < width; ++x) sums[y / 2 * columns + x / 2] += fine[y * width + x];
    }
    return sums;
  }
  static double weigh(const std::vector<double>& sums, const double* weights) {
    double sum = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) sum += weights[i] * sums[i];
    return sum;
  }

  double weight(std::size_t k, std::size_t x, std::size_t y) const {
    return weights_[k][(y >> (k + 1)) * widths_[k] + (x >> (k + 1))];
  }

  /// Calls body(texel, weights) for each texel of a band of rows that may be shifted.
  template <typename Body>
  void for_each_free_texel(std::size_t row, const Body& body) const {
    std::vector<double> weights(levels_);
    const std::size_t last = std::min<std::size_t>((row + 1) * kRowsPerTask, image_.height);
    for (std::size_t y = row * kRowsPerTask; y < last; ++y) {
      for (std::size_t x = 0; x < image_.width; ++x) {
        const std::size_t texel = y * image_.width + x;
        if (!is_free(texel)) continue;
        for (std::size_t k = 0; k < levels_; ++k) weights[k] = weight(k, x, y);
        body(texel, weights);
      }
    }
  }

  double shift_of(const std::vector<double>& multipliers,
                  const std::vector<double>& weights) const {
    double shift = 0;
    for (std::size_t k = 0; k < levels_; ++k) shift += multipliers[k] * weights[k];
    return shift;
  }

  DualState evaluate(const std::vector<double>& multipliers,
                     const std::vector<double>& target) const {
    const std::size_t rows = (image_.height + kRowsPerTask - 1) / kRowsPerTask, n = levels_;
    std::vector<DualState> parts(rows);
    parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        DualState part{0, std::vector<double>(n), std::vector<double>(n * n)};
        for_each_free_texel(row, [&](std::size_t texel, const std::vector<double>& weights) {
          const double shift = shift_of(multipliers, weights), own = value(texel);
          const double moved = std::clamp(own + shift, double{range_[0]}, double{range_[1]}) - own;
          part.dual += shift * moved - moved * moved / 2;
          const bool is_within = moved == shift;
          for (std::size_t k = 0; k < n; ++k) {
            part.bias[k] += weights[k] * moved;
            for (std::size_t l = 0; is_within && l <= k; ++l) {
              part.matrix[k * n + l] += weights[k] * weights[l];
            }
          }
        });
        parts[row] = std::move(part);
      }
    });
    DualState state{0, target, std::vector<double>(n * n)};
    for (const DualState& part : parts) {
      state.dual += part.dual;
      for (std::size_t k = 0; k < n; ++k) {
        state.bias[k] += part.bias[k];
        for (std::size_t l = 0; l <= k; ++l) state.matrix[k * n + l] += part.matrix[k * n + l];
      }
    }
    for (std::size_t k = 0; k < n; ++k) {
      state.dual += multipliers[k] * target[k];
      for (std::size_t l = k + 1; l < n; ++l) state.matrix[k * n + l] = state.matrix[l * n + k];
    }
    return state;
  }

  /// Minimises the dual function plus ridge / 2 times the sum of the multipliers' squares.
  void minimise(const std::vector<double>& target, double ridge, std::vector<double>& multipliers,
                DualState& state) const {
    const auto cost = [&](const DualState& at, const std::vector<double>& by) {
      double squares = 0;
      for (const double each : by) squares += each * each;
      return at.dual + ridge * squares / 2;
    };
    for (int round = 0; round < kMaxNewtonRounds; ++round) {
      std::vector<double> step(levels_), matrix = state.matrix;
      double slope = 0;
      for (std::size_t k = 0; k < levels_; ++k) {
        matrix[k * levels_ + k] += ridge;
        step[k] = -(state.bias[k] + ridge * multipliers[k]);
      }
      const std::vector<double> downhill = step;
      solve_positive(matrix, step);
      for (std::size_t k = 0; k < levels_; ++k) slope += step[k] * downhill[k];
      // Newton steps are shortened repeatedly, since they are far too long if nearly all texels are
      // at an end of the range.
      constexpr double kMinSlope = 1e-14, kMinShare = 1e-9;
      if (!(slope > kMinSlope)) return;
      double share = 1;
      for (; share >= kMinShare; share /= 4) {
        std::vector<double> next = multipliers;
        for (std::size_t k = 0; k < levels_; ++k) next[k] += share * step[k];
        DualState there = evaluate(next, target);
        constexpr double kMinGain = 1e-4;
        if (cost(there, next) > cost(state, multipliers) - kMinGain * share * slope) continue;
        multipliers = std::move(next);
        state = std::move(there);
        break;
      }
      if (share < kMinShare) return;
    }
  }

  void apply(const std::vector<double>& multipliers) {
    const std::size_t rows = (image_.height + kRowsPerTask - 1) / kRowsPerTask;
    parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        for_each_free_texel(row, [&](std::size_t texel, const std::vector<double>& weights) {
          const auto moved = static_cast<float>(value(texel) + shift_of(multipliers, weights));
          value(texel) = std::clamp(moved, range_[0], range_[1]);
        });
      }
    });
  }

  Image& image_;
  const std::vector<TexelRole>& texels_;
  std::size_t levels_;
  std::size_t channel_ = 0;
  std::array<float, 2> range_{};
  std::vector<std::size_t> widths_;  ///< Width of each level, in texels
  std::vector<std::vector<double>>
      /// Weights of a texel's value in the mean of each level, one for each texel of the level
      weights_;
};

}  // namespace

void pad_for_mips(Image& image, std::span<const std::uint8_t> coverage, bool keeps_copies) {
  if (coverage.size() != std::size_t{image.width} * image.height || coverage.size() < 2) return;
  const std::vector<TexelRole> texels = classify_texels(image, coverage, keeps_copies);
  const auto is = [&](TexelRole kind) {
    return std::find(texels.begin(), texels.end(), kind) != texels.end();
  };
  if (!is(TexelRole::chart) || !(is(TexelRole::filled) || is(TexelRole::shiftable))) return;
  std::vector<MeanLevel> levels = make_pyramid(image, texels);
  const std::vector<float> means = levels.back().mean;
  const bool finite =
      std::all_of(means.begin(), means.end(), [](float mean) { return std::isfinite(mean); });
  if (!finite) return;
  fill_by_squares(image, texels, levels);
  if (levels.size() < kFirstLevel) return;
  for (MeanLevel& level : levels) level.mean = {};  // Only the counts are used from here on
  const std::vector<ChartRange> ranges = measure_ranges(image, texels);
  {
    BiasCorrection squares(image, texels, levels);
    for (std::size_t c = 0; c < image.channels; ++c) squares.correct_bias(c, means[c], ranges[c]);
  }
  TexelCorrection single(image, texels, levels);
  for (std::size_t c = 0; c < image.channels; ++c) single.correct_bias(c, means[c], ranges[c]);
}

void pad_for_mips(BakedMap& map, std::span<const std::uint8_t> coverage, bool keeps_copies) {
  const bool has_mean = map.info.type != MapType::id && map.info.type != MapType::coverage;
  if (has_mean && map.mips.empty()) pad_for_mips(map.image, coverage, keeps_copies);
}

}  // namespace kiln

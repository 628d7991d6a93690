#include "image/mip_padding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr std::size_t kRowsPerTask = 16;
/// Padding up to this distance from charts, in texels, is not replaced, because bilinear filters of levels 0 and 1
/// read it.
constexpr int kKeptTexels = 2;
/// Finest level whose bias is corrected. Each texel of this level corresponds to a square of texels of the map, whose
/// filled texels change together.
constexpr std::uint32_t kFirstLevel = 4;
constexpr int kMaxRounds = 40;
/// Largest bias that may remain (0.3 steps of 8 bits), and the tolerance with which the correction reaches it; both
/// in values of the map.
constexpr double kMaxBias = 0.3 / 255, kBiasTolerance = 0.05 / 255;
/// Regularisation of the linear system, as a share of its mean diagonal. Weights hardly differ between levels of a
/// large map. With less regularisation, neighbouring squares would change by opposite amounts, which cancel in the
/// biases but are visible on single charts.
constexpr double kRidge = 2;

enum class TexelRole : std::uint8_t { chart, kept, filled };

/// A level of the pyramid: per texel, the number of chart texels under it and their mean.
struct MeanLevel {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t> count;
  std::vector<float> mean;
};

std::uint32_t halved(std::uint32_t size) { return (size + 1) / 2; }

bool in_chart(std::uint8_t coverage) {
  return coverage == kCoverageBaked || coverage == kCoverageMissed;
}

std::vector<TexelRole> classify(const Image& image, std::span<const std::uint8_t> coverage) {
  const std::size_t texels = coverage.size(), width = image.width;
  std::vector<std::uint8_t> near(texels), wider(texels);
  for (std::size_t i = 0; i < texels; ++i) near[i] = in_chart(coverage[i]) ? 1 : 0;
  for (int step = 0; step < kKeptTexels; ++step) {
    parallel_for(image.height, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        const std::size_t top = y == 0 ? 0 : y - 1;
        const std::size_t bottom = std::min<std::size_t>(y + 1, image.height - 1);
        for (std::size_t x = 0; x < width; ++x) {
          std::uint8_t any = 0;
          for (std::size_t v = top; v <= bottom; ++v) {
            for (std::size_t u = x == 0 ? 0 : x - 1; u <= std::min(x + 1, width - 1); ++u)
              any |= near[v * width + u];
          }
          wider[y * width + x] = any;
        }
      }
    });
    near.swap(wider);
  }
  std::vector<TexelRole> result(texels);
  for (std::size_t i = 0; i < texels; ++i) {
    result[i] = in_chart(coverage[i])                            ? TexelRole::chart
                : near[i] != 0 && coverage[i] == kCoverageGutter ? TexelRole::kept
                                                                 : TexelRole::filled;
  }
  return result;
}

/// \param fine_count, fine_mean  functions of a texel of the finer level: its count, and its sum or mean
template <typename Count, typename Mean>
MeanLevel coarser_means(std::uint32_t width, std::uint32_t height, std::size_t channels,
                        const Count& fine_count, const Mean& fine_mean) {
  MeanLevel level{halved(width), halved(height), {}, {}};
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
  levels.push_back(coarser_means(
      image.width, image.height, channels,
      [&](std::size_t i) { return texels[i] == TexelRole::chart ? 1U : 0U; },
      [&](std::size_t i) { return &image.pixels[i * channels]; }));
  while (levels.back().width > 1 || levels.back().height > 1) {
    const MeanLevel& fine = levels.back();
    levels.push_back(coarser_means(
        fine.width, fine.height, channels, [&](std::size_t i) { return fine.count[i]; },
        [&](std::size_t i) { return &fine.mean[i * channels]; }));
  }
  return levels;
}

/// Step 1: from the coarsest level down, squares without chart texels get the value of the enclosing square.
void fill_by_squares(Image& image, const std::vector<TexelRole>& texels,
                     std::vector<MeanLevel>& levels) {
  const std::size_t channels = image.channels;
  for (std::size_t k = levels.size() - 1; k-- > 0;) {
    MeanLevel& fine = levels[k];
    const MeanLevel& coarse = levels[k + 1];
    for (std::size_t y = 0; y < fine.height; ++y) {
      for (std::size_t x = 0; x < fine.width; ++x) {
        const std::size_t to = y * fine.width + x;
        if (fine.count[to] != 0) continue;
        std::copy_n(&coarse.mean[(y / 2 * coarse.width + x / 2) * channels], channels,
                    &fine.mean[to * channels]);
      }
    }
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

/// Corrects biases: step 2 of pad_for_mips().
class BiasCorrection {
 public:
  BiasCorrection(Image& image, const std::vector<TexelRole>& texels,
                 const std::vector<MeanLevel>& levels)
      : image_(image), texels_(texels), squares_(levels[kFirstLevel - 1]) {
    const double all = levels.back().count[0];
    for (std::size_t k = kFirstLevel - 1; k < levels.size(); ++k) {
      const MeanLevel& level = levels[k];
      const std::size_t shift = k + 1 - kFirstLevel;
      std::vector<double> weights(squares_.count.size());
      for (std::size_t y = 0; y < squares_.height; ++y) {
        for (std::size_t x = 0; x < squares_.width; ++x) {
          const std::size_t u = x >> shift, v = y >> shift;
          weights[y * squares_.width + x] =
              level.count[v * level.width + u] / (all * area(u, v, k + 1));
        }
      }
      weights_.push_back(std::move(weights));
    }
  }

  /// \param mean  mean of the charts
  void correct(std::size_t channel, double mean) {
    Range range;
    for (std::size_t i = 0; i < texels_.size(); ++i) {
      if (texels_[i] == TexelRole::chart) range.add(value(i, channel));
    }
    if (!(range.high > range.low)) return;
    const std::size_t squares = squares_.count.size();
    const Squares now = measure(channel, range);
    // For each square, how far its filled texels are moved: 1 is to the highest value, -1 to the lowest.
    std::vector<double> shift_shares(squares);
    bool changed = false;
    for (int round = 0; round < kMaxRounds && step(now, mean, shift_shares); ++round)
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
  struct Range {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    void add(float value) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  };

  float& value(std::size_t texel, std::size_t channel) const {
    return image_.pixels[texel * image_.channels + channel];
  }
  /// Number of the image's texels under a texel of a level, which is smaller at the right and lower sides.
  double area(std::size_t x, std::size_t y, std::size_t level) const {
    const std::size_t side = std::size_t{1} << level;
    return static_cast<double>(std::min<std::size_t>(side, image_.width - x * side)) *
           static_cast<double>(std::min<std::size_t>(side, image_.height - y * side));
  }

  /// For each square: the sum of values, and by how much its filled texels can raise and lower that sum.
  struct Squares {
    std::vector<double> sum, rise, fall;
  };
  Squares measure(std::size_t channel, const Range& range) const {
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
            result.rise[square] += std::max(0.0, range.high - own);
            result.fall[square] += std::max(0.0, own - range.low);
          }
        }
      }
    });
    return result;
  }

  /// Computes one step of the correction.
  ///          \returns false if no bias needs a correction, or none can be corrected
  bool step(const Squares& now, double mean, std::vector<double>& shift_shares) const {
    const std::size_t levels = weights_.size(), squares = shift_shares.size();
    std::vector<double> bias(levels, mean), gain(squares), toward(squares);
    double most = 0;
    for (std::size_t k = 0; k < levels; ++k) {
      for (std::size_t s = 0; s < squares; ++s) {
        const double change = shift_shares[s] * (shift_shares[s] > 0 ? now.rise[s] : now.fall[s]);
        bias[k] -= weights_[k][s] * (now.sum[s] + change);
      }
      most = std::max(most, std::abs(bias[k]));
      bias[k] = std::copysign(std::max(0.0, std::abs(bias[k]) - kMaxBias), bias[k]);
    }
    if (most <= kMaxBias + kBiasTolerance) return false;
    for (std::size_t k = 0; k < levels; ++k) {
      for (std::size_t s = 0; s < squares; ++s) toward[s] += bias[k] * weights_[k][s];
    }
    for (std::size_t s = 0; s < squares; ++s) {
      const bool up = toward[s] > 0;
      if (up ? shift_shares[s] >= 1 : shift_shares[s] <= -1) continue;
      gain[s] = shift_shares[s] > 0 || (shift_shares[s] == 0 && up) ? now.rise[s] : now.fall[s];
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
    solve(matrix, bias);
    for (std::size_t s = 0; s < squares; ++s) {
      double change = 0;
      for (std::size_t k = 0; k < levels; ++k) change += bias[k] * weights_[k][s];
      shift_shares[s] = std::clamp(shift_shares[s] + change, -1.0, 1.0);
    }
    return true;
  }

  /// Solves a symmetric positive definite system by Gaussian elimination, which needs no pivoting for such systems.
  static void solve(std::vector<double>& matrix, std::vector<double>& right) {
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

  Image& image_;
  const std::vector<TexelRole>& texels_;
  const MeanLevel& squares_;  ///< The pyramid's level kFirstLevel
  /// For each level from kFirstLevel on, and each square: weight of the value of a texel of the square in the level's
  /// weighted mean
  std::vector<std::vector<double>> weights_;
};

}  // namespace

void pad_for_mips(Image& image, std::span<const std::uint8_t> coverage) {
  if (coverage.size() != std::size_t{image.width} * image.height || coverage.size() < 2) return;
  const std::vector<TexelRole> texels = classify(image, coverage);
  const auto is = [&](TexelRole kind) {
    return std::find(texels.begin(), texels.end(), kind) != texels.end();
  };
  if (!is(TexelRole::chart) || !is(TexelRole::filled)) return;
  std::vector<MeanLevel> levels = make_pyramid(image, texels);
  const std::vector<float> means = levels.back().mean;
  const bool finite =
      std::all_of(means.begin(), means.end(), [](float mean) { return std::isfinite(mean); });
  if (!finite) return;
  fill_by_squares(image, texels, levels);
  if (levels.size() < kFirstLevel) return;
  BiasCorrection correction(image, texels, levels);
  for (std::size_t c = 0; c < image.channels; ++c) correction.correct(c, means[c]);
}

void pad_for_mips(BakedMap& map, std::span<const std::uint8_t> coverage) {
  const bool has_mean = map.info.type != MapType::id && map.info.type != MapType::coverage;
  if (has_mean && map.mips.empty()) pad_for_mips(map.image, coverage);
}

}  // namespace kiln

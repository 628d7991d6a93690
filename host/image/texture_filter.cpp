#include "image/texture_filter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "base/srgb.h"
#include "base/vectors.h"
#include "image/wrap.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::size_t kGrain = std::size_t{1} << 15;
// The mip level is chosen such that the narrow side of the footprint is kMinWidth to 2 * kMinWidth
// texels wide.
constexpr double kMinWidth = 2;

float decode_srgb(float value) {
  const float byte = value * 255;
  const float nearest = std::round(byte);
  if (nearest >= 0 && nearest <= 255 && std::abs(byte - nearest) < 1e-4F) {
    return linear_values_of_bytes()[static_cast<std::size_t>(nearest)];
  }
  return static_cast<float>(from_srgb(value));
}

/// The texels of the next finer level that a texel covers along one axis, and their shares of it.
struct AxisCover {
  AxisCover(std::uint32_t place, std::uint32_t narrow, std::uint32_t wide) {
    const double ratio = static_cast<double>(wide) / narrow;
    const double begin = place * ratio, end = begin + ratio;
    first = static_cast<std::uint32_t>(begin);
    for (std::uint32_t i = first; i < wide && i < end && count < 4; ++i, ++count) {
      shares[count] = (std::min<double>(i + 1.0, end) - std::max<double>(i, begin)) / ratio;
    }
  }
  std::uint32_t first = 0, count = 0;
  std::array<double, 4> shares{};
};

// Replacements for std::floor and std::ceil that need no function call, for numbers below 2^62.
std::int64_t floor_to_integer(double value) {
  const auto whole = static_cast<std::int64_t>(value);
  return whole - (static_cast<double>(whole) > value ? 1 : 0);
}
double ceil_to_integer(double value) { return -static_cast<double>(floor_to_integer(-value)); }
double fraction(double value) {
  const bool is_small = std::abs(value) < 0x1p62;
  return value - (is_small ? static_cast<double>(floor_to_integer(value)) : std::floor(value));
}

/// Sampling points on a level: a grid of rows and columns, evenly spread over a parallelogram with
/// sides a and b. The centre of the parallelogram lies `right` texels to the right of the centre of
/// texel (x, y), and `below` texels below it.
struct SamplingGrid {
  std::int64_t x, y;
  float right, below, ax, ay, bx, by;
  int columns, rows;
};

/// Loads a texel's channels; the other lanes are undefined.
/// \param end  end of the level's memory, which a load of four values must not exceed
template <std::uint32_t Channels>
Float4 read_texel(const float* from, const float* end) {
  if (end - from >= 4) [[likely]]
    return load_float4(from);
  Float4 texel{};
  for (std::uint32_t k = 0; k < Channels; ++k) texel[k] = from[k];
  return texel;
}

Float4 mix(Float4 a, Float4 b, float share) { return a + (b - a) * splat(share); }

/// Sums bilinear samples at the points of a grid.
/// \tparam Inside  true: all points and the texels around them lie within the picture
template <std::uint32_t Channels, bool Inside>
std::array<double, 4> sum_of_samples(const SamplingGrid& sampling_grid, const float* pixels,
                                     std::int64_t width, std::int64_t height,
                                     const FilteredTexture::Wraps& wraps) {
  const float* end = pixels + width * height * Channels;
  const float across = 1.0F / static_cast<float>(sampling_grid.columns);
  const float down = 1.0F / static_cast<float>(sampling_grid.rows);
  std::array<double, 4> sum{};
  for (int j = 0; j < sampling_grid.rows; ++j) {
    const float t = (static_cast<float>(j) + 0.5F) * down - 0.5F;
    for (int i = 0; i < sampling_grid.columns; i += 4) {
      const Float4 column = splat(static_cast<float>(i)) + Float4{0.5F, 1.5F, 2.5F, 3.5F};
      const Float4 s = column * splat(across) - splat(0.5F);
      const Float4 x =
          splat(sampling_grid.right + sampling_grid.bx * t) + splat(sampling_grid.ax) * s;
      const Float4 y =
          splat(sampling_grid.below + sampling_grid.by * t) + splat(sampling_grid.ay) * s;
      const Int4 left = floor_int4(x), top = floor_int4(y);
      const Float4 right = x - to_float4(left);
      const Float4 below = y - to_float4(top);
      Float4 partial_sum{};
      for (int k = 0; k < 4 && i + k < sampling_grid.columns; ++k) {
        std::int64_t x0 = sampling_grid.x + left[k], y0 = sampling_grid.y + top[k], x1 = x0 + 1,
                     y1 = y0 + 1;
        if constexpr (!Inside) {
          x0 = wrapped_texel(x0, width, wraps[0]), x1 = wrapped_texel(x1, width, wraps[0]);
          y0 = wrapped_texel(y0, height, wraps[1]), y1 = wrapped_texel(y1, height, wraps[1]);
        }
        const auto at = [&](std::int64_t to_right, std::int64_t to_bottom) {
          const float* from = pixels + (to_bottom * width + to_right) * Channels;
          return Inside ? load_float4(from) : read_texel<Channels>(from, end);
        };
        const Float4 upper_row = mix(at(x0, y0), at(x1, y0), right[k]);
        partial_sum += mix(upper_row, mix(at(x0, y1), at(x1, y1), right[k]), below[k]);
      }
      for (std::size_t k = 0; k < 4; ++k) sum[k] += double{partial_sum[k]};
    }
  }
  return sum;
}

template <std::uint32_t Channels>
std::array<double, 4> sum_of_samples(const SamplingGrid& sampling_grid, const float* pixels,
                                     std::int64_t width, std::int64_t height,
                                     const FilteredTexture::Wraps& wraps) {
  // Largest distance of a point from the centre, plus one texel for its bilinear neighbours and one
  // for rounding.
  const auto reach_x =
      static_cast<std::int64_t>(std::abs(sampling_grid.ax) + std::abs(sampling_grid.bx)) / 2 + 2;
  const auto reach_y =
      static_cast<std::int64_t>(std::abs(sampling_grid.ay) + std::abs(sampling_grid.by)) / 2 + 2;
  // Texels are loaded four values at a time, even if they have fewer channels. At the end of the
  // last row this would read beyond the memory.
  const bool inside = sampling_grid.x >= reach_x && sampling_grid.x + reach_x < width - 4 &&
                      sampling_grid.y >= reach_y && sampling_grid.y + reach_y < height - 1;
  return inside ? sum_of_samples<Channels, true>(sampling_grid, pixels, width, height, wraps)
                : sum_of_samples<Channels, false>(sampling_grid, pixels, width, height, wraps);
}

/// Squared length of a vector of UVs on a level, in texels.
double squared_texel_length(const std::array<double, 2>& side, double width, double height) {
  const double across = side[0] * width, down = side[1] * height;
  return across * across + down * down;
}

/// Length of a vector in texels, rounded up to a whole number; at least 1.
/// \param squared  squared length
double texels_along(double squared) {
  double texels = 1;
  while (texels < 4 && texels * texels < squared)
    ++texels;  // Most lengths are small, and then this is faster than a square root
  return texels * texels < squared ? ceil_to_integer(std::sqrt(squared)) : texels;
}

/// Smallest width of a parallelogram: the smaller singular value of the matrix of its sides.
double width_of(const FilteredTexture::ParallelogramSides& sides, double width, double height) {
  const double ax = sides[0][0] * width, ay = sides[0][1] * height;
  const double bx = sides[1][0] * width, by = sides[1][1] * height;
  const double a = ax * ax + ay * ay, b = bx * bx + by * by, both = ax * bx + ay * by;
  const double half = (a - b) / 2;
  return std::sqrt(std::max(0.0, (a + b) / 2 - std::sqrt(half * half + both * both)));
}

}  // namespace

FilteredTexture::FilteredTexture(std::shared_ptr<const Image> image, TextureKind kind,
                                 const TextureReading& reading)
    : image_(std::move(image)), channels_(image_->channels) {
  const std::size_t texels = std::size_t{image_->width} * image_->height;
  if (texels == 0 || channels_ < 1 || channels_ > 4 ||
      image_->pixels.size() != texels * channels_) {
    throw Error(
        ErrorCode::input,
        "A texture must have pixels, 1 to 4 channels, and one value per pixel and channel.");
  }
  if (kind == TextureKind::normal) {
    reading.normals.check(*image_);
    if (reading.normals.computes_z) channels_ = 3;
  }
  std::uint32_t width = image_->width, height = image_->height;
  levels_.push_back({width, height, image_->pixels.data(), {}});
  while (width > 1 || height > 1) {
    width = std::max(1U, width / 2);
    height = std::max(1U, height / 2);
    levels_.push_back({width, height, nullptr, {}});
  }
  convert(*image_, kind, reading);
}

/// Creates the finest level if the picture cannot be read in place.
void FilteredTexture::convert(const Image& image, TextureKind kind, const TextureReading& reading) {
  const std::size_t from = image.channels, texels = image.pixels.size() / from;
  std::atomic<std::uint64_t> replaced_values{0};
  std::atomic<bool> has_transparent{false};
  const bool has_alpha = from % 2 == 0 && kind != TextureKind::normal;
  parallel_for(texels, kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint64_t non_finite = 0;
    bool is_transparent = false;
    for (std::size_t i = begin * from; i < end * from; ++i) {
      non_finite += std::isfinite(image.pixels[i]) ? 0U : 1U;
    }
    for (std::size_t i = begin; has_alpha && reading.by_alpha && i < end; ++i) {
      is_transparent = is_transparent || image.pixels[i * from + from - 1] != 1;
    }
    if (non_finite != 0) replaced_values += non_finite;
    if (is_transparent) has_transparent = true;
  });
  replaced_count_ = replaced_values;
  has_weight_channel_ = has_transparent || reading.empty != nullptr;
  const std::uint32_t values = channels_ < 3 ? 1 : 3;
  stored_channels_ = has_weight_channel_ ? values + 1 : channels_;
  if (kind == TextureKind::linear && replaced_count_ == 0 && !has_weight_channel_) return;
  Level& level = levels_[0];
  level.memory.resize(texels * stored_channels_);
  level.pixels = level.memory.data();
  parallel_for(texels, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::array<float, 4> texel{};
      for (std::size_t c = 0; c < from; ++c) {
        const float value = image.pixels[i * from + c];
        texel[c] = std::isfinite(value) ? value : 0;
      }
      const float alpha = has_alpha ? texel[from - 1] : 1;
      if (kind == TextureKind::srgb) {
        for (std::size_t c = 0; c < values && c < from; ++c) texel[c] = decode_srgb(texel[c]);
      } else if (kind == TextureKind::normal) {
        for (std::size_t c = 0; c < from; ++c) {
          if (std::isfinite(image.pixels[i * from + c])) texel[c] = texel[c] * 2 - 1;
        }
        reading.normals.apply(texel);
      }
      float* const to = &level.memory[i * stored_channels_];
      if (!has_weight_channel_) {
        std::copy_n(texel.begin(), stored_channels_, to);
        continue;
      }
      float weight = has_transparent ? std::max(alpha, kMinWeight) : 1;
      if (reading.empty != nullptr && reading.empty->has(i)) weight *= kMinWeight;
      for (std::size_t c = 0; c < values; ++c) to[c] = texel[c] * weight;
      to[values] = weight;
    }
  });
}

const FilteredTexture::Level& FilteredTexture::level(std::size_t number) const {
  if (number < built_levels_.load(std::memory_order_acquire)) return levels_[number];
  const std::lock_guard lock(levels_mutex_);
  for (std::size_t made = built_levels_.load(std::memory_order_relaxed); made <= number; ++made) {
    downsample(levels_[made - 1], levels_[made]);
    built_levels_.store(made + 1, std::memory_order_release);
  }
  return levels_[number];
}

void FilteredTexture::downsample(const Level& level, Level& next) const {
  next.memory.resize(std::size_t{next.width} * next.height * stored_channels_);
  next.pixels = next.memory.data();
  const std::size_t rows = std::max<std::size_t>(1, kGrain / next.width);
  parallel_for(next.height, rows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      const AxisCover down(static_cast<std::uint32_t>(y), next.height, level.height);
      for (std::uint32_t x = 0; x < next.width; ++x) {
        const AxisCover across(x, next.width, level.width);
        std::array<double, 4> sum{};
        for (std::size_t j = 0; j < down.count; ++j) {
          const float* row =
              &level.pixels[((down.first + j) * level.width + across.first) * stored_channels_];
          for (std::size_t i = 0; i < across.count; ++i) {
            const double share = down.shares[j] * across.shares[i];
            for (std::size_t c = 0; c < stored_channels_; ++c)
              sum[c] += share * row[i * stored_channels_ + c];
          }
        }
        float* to = &next.memory[(y * next.width + x) * stored_channels_];
        for (std::size_t c = 0; c < stored_channels_; ++c) to[c] = static_cast<float>(sum[c]);
      }
    }
  });
}

void FilteredTexture::mean(double u, double v, const ParallelogramSides& given, float* value,
                           const Wraps& wraps) const {
  ParallelogramSides sides = given;
  for (std::array<double, 2>& side : sides) {
    // For a footprint this large, the mean is that of the whole picture.
    if (!(side[0] * side[0] + side[1] * side[1] < 1e12)) sides = {{{1, 0}, {0, 1}}};
  }
  const auto squared = [&](std::size_t side, std::size_t on) {
    return squared_texel_length(sides[side], levels_[on].width, levels_[on].height);
  };
  constexpr double kMinMinifiedWidth = 2 * kMinWidth;
  std::size_t level_number = 0;
  // The width of the parallelogram is at most its shorter side, so this comparison avoids most
  // square roots.
  if (squared(0, 0) >= kMinMinifiedWidth * kMinMinifiedWidth &&
      squared(1, 0) >= kMinMinifiedWidth * kMinMinifiedWidth) {
    const double narrow = width_of(sides, levels_[0].width, levels_[0].height);
    if (narrow >= kMinMinifiedWidth)
      level_number = static_cast<std::size_t>(std::log2(narrow / kMinWidth));
  }
  level_number = std::min(level_number, levels_.size() - 1);
  const auto parts_of = [&](std::size_t side) { return texels_along(squared(side, level_number)); };
  double along_a = parts_of(0), along_b = parts_of(1);
  while (level_number + 1 < levels_.size() && !(along_a * along_b <= kMaxParts)) {
    ++level_number;
    along_a = parts_of(0);
    along_b = parts_of(1);
  }
  const Level& level = this->level(level_number);
  // Limits the number of samples on the last level, whose single texel holds the mean of the
  // picture
  const double most = kMaxParts;
  SamplingGrid sampling_grid{};
  sampling_grid.columns = static_cast<int>(std::min(along_a, most));
  sampling_grid.rows = static_cast<int>(std::min(along_b, most / sampling_grid.columns));
  const double x = wrapped_coordinate(u, wraps[0], fraction) * level.width - 0.5;
  const double y = (1 - wrapped_coordinate(v, wraps[1], fraction)) * level.height - 0.5;
  sampling_grid.x = floor_to_integer(x), sampling_grid.y = floor_to_integer(y);
  sampling_grid.right = static_cast<float>(x - static_cast<double>(sampling_grid.x));
  sampling_grid.below = static_cast<float>(y - static_cast<double>(sampling_grid.y));
  sampling_grid.ax = static_cast<float>(sides[0][0] * level.width);
  sampling_grid.ay = static_cast<float>(-sides[0][1] * level.height);
  sampling_grid.bx = static_cast<float>(sides[1][0] * level.width);
  sampling_grid.by = static_cast<float>(-sides[1][1] * level.height);
  const auto sum_on_level = [&] {
    const std::int64_t width = level.width, height = level.height;
    switch (stored_channels_) {
      case 1:
        return sum_of_samples<1>(sampling_grid, level.pixels, width, height, wraps);
      case 2:
        return sum_of_samples<2>(sampling_grid, level.pixels, width, height, wraps);
      case 3:
        return sum_of_samples<3>(sampling_grid, level.pixels, width, height, wraps);
      default:
        return sum_of_samples<4>(sampling_grid, level.pixels, width, height, wraps);
    }
  };
  const std::array<double, 4> sum = sum_on_level();
  const double share = 1.0 / (double{1} * sampling_grid.columns * sampling_grid.rows);
  if (!has_weight_channel_) {
    for (std::size_t c = 0; c < channels_; ++c) value[c] = static_cast<float>(sum[c] * share);
    return;
  }
  const std::size_t values = stored_channels_ - 1;
  for (std::size_t c = 0; c < values; ++c) value[c] = static_cast<float>(sum[c] / sum[values]);
  // If the mean weight is about kMinWeight, alpha is 0 everywhere in the footprint.
  const double alpha = sum[values] * share;
  if (channels_ > values)
    value[values] = alpha > 2 * double{kMinWeight} ? static_cast<float>(alpha) : 0;
}

}  // namespace kiln

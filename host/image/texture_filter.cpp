#include "image/texture_filter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "image/srgb.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::size_t kGrain = std::size_t{1} << 15;
// On the level that is read a parallelogram is this many texels across, to twice that.
constexpr double kAcross = 2;

float linear(float value) {
  const float byte = value * 255;
  const float nearest = std::round(byte);
  if (nearest >= 0 && nearest <= 255 && std::abs(byte - nearest) < 1e-4F) {
    return linear_of_bytes()[static_cast<std::size_t>(nearest)];
  }
  return static_cast<float>(from_srgb(value));
}

/// A texel of a level that is half as wide: which texels of the wider one it covers, and how much of each.
struct Cover {
  Cover(std::uint32_t place, std::uint32_t narrow, std::uint32_t wide) {
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

std::int64_t wrapped(std::int64_t place, std::int64_t size) {
  if (place >= 0 && place < size)
    return place;  // nearly always, and a division takes as long as all else
  const std::int64_t rest = place % size;
  return rest < 0 ? rest + size : rest;
}

/// How long a vector of UV is on a level, texels.
double length_on(const std::array<double, 2>& side, std::uint32_t width, std::uint32_t height) {
  const double across = side[0] * width, down = side[1] * height;
  return std::sqrt(across * across + down * down);
}

/// How wide a parallelogram is where it is narrowest: the lesser singular value of its sides.
double width_of(const FilteredTexture::Sides& sides, double width, double height) {
  const double ax = sides[0][0] * width, ay = sides[0][1] * height;
  const double bx = sides[1][0] * width, by = sides[1][1] * height;
  const double a = ax * ax + ay * ay, b = bx * bx + by * by, both = ax * bx + ay * by;
  const double half = (a - b) / 2;
  return std::sqrt(std::max(0.0, (a + b) / 2 - std::sqrt(half * half + both * both)));
}

}  // namespace

FilteredTexture::FilteredTexture(const Image& image, TextureKind kind) : channels_(image.channels) {
  const std::size_t texels = std::size_t{image.width} * image.height;
  if (texels == 0 || channels_ < 1 || channels_ > 4 || image.pixels.size() != texels * channels_) {
    throw Error(ErrorCode::input, "A texture has no pixels, or not as many as its size says.");
  }
  if (kind == TextureKind::normal && channels_ < 3) {
    throw Error(ErrorCode::input, "A normal map needs three channels, but the texture has " +
                                      std::to_string(channels_) + ".");
  }
  Level level{image.width, image.height, std::vector<float>(image.pixels.size())};
  std::atomic<std::uint64_t> replaced{0};
  parallel_for(texels, kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint64_t bad = 0;
    for (std::size_t i = begin * channels_; i < end * channels_; ++i) {
      float value = image.pixels[i];
      const bool is_color = channels_ == 2 ? i % 2 == 0 : i % channels_ < 3;
      if (!std::isfinite(value)) {
        value = 0;
        ++bad;
      } else if (kind == TextureKind::srgb && is_color) {
        value = linear(value);
      } else if (kind == TextureKind::normal) {
        value = value * 2 - 1;
      }
      level.pixels[i] = value;
    }
    replaced += bad;
  });
  replaced_ = replaced;
  levels_.push_back(std::move(level));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    levels_.push_back(half(levels_.back()));
  }
}

FilteredTexture::Level FilteredTexture::half(const Level& level) const {
  Level next{std::max(1U, level.width / 2), std::max(1U, level.height / 2), {}};
  next.pixels.resize(std::size_t{next.width} * next.height * channels_);
  const std::size_t rows = std::max<std::size_t>(1, kGrain / next.width);
  parallel_for(next.height, rows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      const Cover down(static_cast<std::uint32_t>(y), next.height, level.height);
      for (std::uint32_t x = 0; x < next.width; ++x) {
        const Cover across(x, next.width, level.width);
        std::array<double, 4> sum{};
        for (std::size_t j = 0; j < down.count; ++j) {
          const float* row =
              &level.pixels[((down.first + j) * level.width + across.first) * channels_];
          for (std::size_t i = 0; i < across.count; ++i) {
            const double share = down.shares[j] * across.shares[i];
            for (std::size_t c = 0; c < channels_; ++c) sum[c] += share * row[i * channels_ + c];
          }
        }
        float* to = &next.pixels[(y * next.width + x) * channels_];
        for (std::size_t c = 0; c < channels_; ++c) to[c] = static_cast<float>(sum[c]);
      }
    }
  });
  return next;
}

/// Adds the bilinear value at a place, in texels from the middle of the first one.
void FilteredTexture::add(const Level& level, double x, double y, double* sum) const {
  const double left = std::floor(x), top = std::floor(y);
  const std::int64_t width = level.width, height = level.height;
  const std::int64_t x0 = wrapped(static_cast<std::int64_t>(left), width);
  const std::int64_t y0 = wrapped(static_cast<std::int64_t>(top), height);
  const std::int64_t x1 = x0 + 1 == width ? 0 : x0 + 1, y1 = y0 + 1 == height ? 0 : y0 + 1;
  const double right = x - left, below = y - top;
  const auto at = [&](std::int64_t column, std::int64_t row) {
    return &level.pixels[static_cast<std::size_t>(row * width + column) * channels_];
  };
  const float *a = at(x0, y0), *b = at(x1, y0), *c = at(x0, y1), *d = at(x1, y1);
  for (std::size_t k = 0; k < channels_; ++k) {
    const double upper = a[k] + (double{b[k]} - a[k]) * right;
    const double lower = c[k] + (double{d[k]} - c[k]) * right;
    sum[k] += upper + (lower - upper) * below;
  }
}

void FilteredTexture::mean(double u, double v, const Sides& given, float* value) const {
  Sides sides = given;
  for (std::array<double, 2>& side : sides) {
    // Over so many pictures the mean is the whole one's.
    if (!(side[0] * side[0] + side[1] * side[1] < 1e12)) sides = {{{1, 0}, {0, 1}}};
  }
  const double narrow = width_of(sides, levels_[0].width, levels_[0].height);
  std::size_t number = 0;
  if (narrow >= 2 * kAcross) number = static_cast<std::size_t>(std::log2(narrow / kAcross));
  number = std::min(number, levels_.size() - 1);
  const auto parts_of = [&](std::size_t side) {
    const Level& level = levels_[number];
    return std::max(1.0, std::ceil(length_on(sides[side], level.width, level.height)));
  };
  double along_a = parts_of(0), along_b = parts_of(1);
  while (number + 1 < levels_.size() && !(along_a * along_b <= kMostParts)) {
    ++number;
    along_a = parts_of(0);
    along_b = parts_of(1);
  }
  const Level& level = levels_[number];
  const double most = kMostParts;  // of the last level: one texel, which holds the mean
  const int columns = static_cast<int>(std::min(along_a, most));
  const int rows = static_cast<int>(std::min(along_b, most / columns));
  const double x = (u - std::floor(u)) * level.width - 0.5;
  const double y = (1 - (v - std::floor(v))) * level.height - 0.5;
  const double ax = sides[0][0] * level.width, ay = -sides[0][1] * level.height;
  const double bx = sides[1][0] * level.width, by = -sides[1][1] * level.height;
  std::array<double, 4> sum{};
  for (int j = 0; j < rows; ++j) {
    const double t = (j + 0.5) / rows - 0.5;
    for (int i = 0; i < columns; ++i) {
      const double s = (i + 0.5) / columns - 0.5;
      add(level, x + ax * s + bx * t, y + ay * s + by * t, sum.data());
    }
  }
  for (std::size_t c = 0; c < channels_; ++c) {
    value[c] = static_cast<float>(sum[c] / (double{1} * columns * rows));
  }
}

}  // namespace kiln

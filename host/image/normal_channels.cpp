#include "image/normal_channels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "image/grey.h"
#include "kiln/error.h"

namespace kiln {
namespace {

/// Bounds by which the contents of channels are recognized. Values are components of vectors, in
/// [-1, 1].
struct ChannelBounds {
  std::size_t samples = std::size_t{1} << 16;  ///< Number of sampled texels
  /// Largest difference between the values of an unused channel: 1.5 steps of a byte, which covers
  /// lossy block compression.
  float max_unused_range = 3.0F / 255;
  /// Tolerance: a channel whose values are all within this of -1, or all within this of 1, counts as filled by the
  /// decoder
  float max_distance_from_bound = 4.0F / 255;
  /// Largest x^2 + y^2 of a unit vector: 1, plus two steps of a byte
  float in_disc = 1.04F;
  double nearly_all = 0.99;  ///< Share of texels that counts as nearly all of them
  /// Deviation of x^2 + y^2 + z^2 from 1 above which a vector is no unit vector. A unit vector
  /// whose stored z differs from the true one by at most `constant` deviates by at most 0.024.
  float off_unit = 0.04F;
  double min_share = 2e-4;  ///< Share of texels above which a property is not a coincidence
};
constexpr ChannelBounds kChannelBounds;

/// Statistics of texels sampled all over a picture.
struct ChannelStatistics {
  std::size_t count = 0;
  std::array<float, 4> min_values, max_values;
  /// Number of texels that are not unit vectors, although (red, green) lies in the unit disc
  std::size_t off_unit = 0;
  std::size_t in_disc = 0;  ///< Number of texels whose first two channels lie in the unit disc
  std::size_t in_disc_alpha = 0;  ///< Number of texels whose (alpha, green) lies in the unit disc
  bool grey = true;               ///< True if red, green and blue are equal

  explicit ChannelStatistics(const Image& image) {
    min_values.fill(std::numeric_limits<float>::infinity());
    max_values.fill(-std::numeric_limits<float>::infinity());
    const std::size_t texels = image.pixels.size() / image.channels;
    const std::size_t wanted = std::min(texels, kChannelBounds.samples);
    for (std::size_t k = 0; k < wanted; ++k) {
      // Texels are selected by multiples of the golden ratio, which spreads them evenly in both
      // directions.
      const std::size_t i =
          wanted == texels ? k
                           : static_cast<std::size_t>((k * 0x9E3779B97F4A7C15U >> 11U) % texels);
      std::array<float, 4> n{};
      bool all_finite = true;
      for (std::size_t c = 0; c < image.channels; ++c) {
        n[c] = image.pixels[i * image.channels + c] * 2 - 1;
        all_finite = all_finite && std::isfinite(n[c]);
      }
      if (all_finite) add(n);
    }
  }

  bool is_constant(std::size_t c) const {
    return max_values[c] - min_values[c] <= kChannelBounds.max_unused_range;
  }
  bool is_filled(std::size_t c) const {
    return max_values[c] <= -1 + kChannelBounds.max_distance_from_bound ||
           min_values[c] >= 1 - kChannelBounds.max_distance_from_bound;
  }
  bool nearly_all(std::size_t some) const {
    return static_cast<double>(some) >= kChannelBounds.nearly_all * static_cast<double>(count);
  }

 private:
  void add(const std::array<float, 4>& n) {
    ++count;
    for (std::size_t c = 0; c < 4; ++c) {
      min_values[c] = std::min(min_values[c], n[c]);
      max_values[c] = std::max(max_values[c], n[c]);
    }
    const float x = n[0], y = n[1], z = n[2], alpha = n[3], tilt = x * x + y * y;
    in_disc += tilt <= kChannelBounds.in_disc ? 1 : 0;
    in_disc_alpha += alpha * alpha + y * y <= kChannelBounds.in_disc ? 1 : 0;
    off_unit +=
        tilt <= kChannelBounds.in_disc && std::abs(tilt + z * z - 1) > kChannelBounds.off_unit ? 1
                                                                                               : 0;
    const bool same = std::abs(n[0] - n[1]) <= kChannelBounds.max_unused_range;
    grey = grey && same && std::abs(n[2] - n[1]) <= kChannelBounds.max_unused_range;
  }
};

/// True for the DXT5nm layout: x is in alpha, red is unused, and alpha is not a constant 1, as an
/// opacity would be.
bool is_dxt5nm(const Image& image, const ChannelStatistics& s) {
  return image.channels == 4 && (s.is_filled(0) || s.grey) &&
         s.min_values[3] < 1 - kChannelBounds.max_distance_from_bound &&
         s.nearly_all(s.in_disc_alpha);
}

/// True if a picture's two channels are x and y instead of grey and opacity.
bool holds_x_and_y(const Image& image, const ChannelStatistics& s) {
  return image.channels == 2 && s.min_values[1] < 1 - kChannelBounds.max_distance_from_bound &&
         s.nearly_all(s.in_disc);
}

/// True for a picture of three or more channels whose blue is unused.
bool lacks_blue(const Image& image, const ChannelStatistics& s) {
  if (image.channels < 3 || s.count == 0 || !s.nearly_all(s.in_disc)) return false;
  if (s.max_values[2] < 0) return true;
  // Blue is also constant if all normals have the same tilt, but then the vectors have unit length.
  return s.is_constant(2) &&
         static_cast<double>(s.off_unit) > kChannelBounds.min_share * static_cast<double>(s.count);
}

}  // namespace

NormalChannels NormalChannels::of(const Image& image, NormalTextureFormat format) {
  NormalChannels result;
  // NormalChannels::check() rejects pictures with fewer channels or without pixels
  if (image.channels < 2 || image.pixels.empty()) return result;
  result.down =
      format == NormalTextureFormat::directx || format == NormalTextureFormat::two_channel_directx;
  const ChannelStatistics s(image);
  const bool in_alpha = is_dxt5nm(image, s);
  const bool looks_two_channel = in_alpha || holds_x_and_y(image, s) || lacks_blue(image, s);
  switch (format) {
    case NormalTextureFormat::automatic:
      result.computes_z = looks_two_channel;
      break;
    case NormalTextureFormat::opengl:
    case NormalTextureFormat::directx:
      result.contradicts_format = looks_two_channel;
      break;
    case NormalTextureFormat::two_channel:
    case NormalTextureFormat::two_channel_directx:
      result.computes_z = true;
      // Blue may hold z, which two-channel formats ignore. What contradicts them is (x, y) outside of the unit disc.
      result.contradicts_format = !looks_two_channel && !s.nearly_all(s.in_disc);
      break;
  }
  result.in_alpha = result.computes_z && in_alpha;
  return result;
}

void NormalChannels::check(const Image& image) const {
  const std::uint32_t needed_channels = computes_z ? 2 : 3;
  if (image.channels >= needed_channels) return;
  throw Error(ErrorCode::input, "A normal map needs " + std::string(computes_z ? "two" : "three") +
                                    " channels, but the texture has " +
                                    std::to_string(image.channels) + ".");
}

void NormalChannels::apply(std::array<float, 4>& texel) const {
  if (in_alpha) texel[0] = texel[3];
  if (down) texel[1] = -texel[1];
  if (!computes_z) return;
  const double x = texel[0], y = texel[1];
  texel[2] = static_cast<float>(std::sqrt(std::max(0.0, 1 - x * x - y * y)));
}

bool holds_heights(const Image& image, NormalTextureFormat format) {
  if (image.channels < 2) return true;
  if (format == NormalTextureFormat::two_channel ||
      format == NormalTextureFormat::two_channel_directx) {
    return false;
  }
  const auto is_of_normals = [&] {
    const ChannelStatistics s(image);
    return is_dxt5nm(image, s) || holds_x_and_y(image, s);
  };
  return is_grey(image, kLossyRounding) && !is_of_normals();
}

GreenEvidence GreenEvidence::of(const Image& image, const NormalChannels& channels) {
  GreenEvidence green_evidence;
  if (image.width < 3 || image.height < 3 || image.channels < 2) return green_evidence;
  // Minimum z of a normal; the slopes of steeper ones are dominated by rounding.
  constexpr float kMinZ = 0.2F;
  const auto slopes_at = [&](std::size_t x, std::size_t y, double& p, double& q) {
    std::array<float, 4> n{};
    for (std::size_t c = 0; c < image.channels; ++c) n[c] = image.at(x, y)[c] * 2 - 1;
    channels.apply(n);
    if (!(n[2] > kMinZ)) return false;
    p = -double{n[0]} / n[2];
    q = -double{n[1]} / n[2];
    return true;
  };
  const std::size_t across = image.width - 2, texels = across * (image.height - 2);
  const std::size_t wanted = std::min(texels, kChannelBounds.samples);
  std::size_t count = 0;
  for (std::size_t k = 0; k < wanted; ++k) {
    const std::size_t i =
        wanted == texels ? k : static_cast<std::size_t>((k * 0x9E3779B97F4A7C15U >> 11U) % texels);
    const std::size_t x = i % across + 1, y = i / across + 1;
    double above = 0, below = 0, left = 0, right = 0, unused = 0;
    if (!slopes_at(x, y - 1, above, unused) || !slopes_at(x, y + 1, below, unused) ||
        !slopes_at(x - 1, y, unused, left) || !slopes_at(x + 1, y, unused, right)) {
      continue;
    }
    // v increases upwards, but row numbers increase downwards.
    const double p_along_v = above - below, q_along_u = right - left;
    green_evidence.up += (p_along_v - q_along_u) * (p_along_v - q_along_u);
    green_evidence.down += (p_along_v + q_along_u) * (p_along_v + q_along_u);
    ++count;
  }
  if (count == 0) return {};
  green_evidence.up /= static_cast<double>(count);
  green_evidence.down /= static_cast<double>(count);
  return green_evidence;
}

bool GreenEvidence::suggests_down() const {
  // kMinSquare is the smallest mean square that counts as evidence: differences of 0.01, which is
  // one or two steps of a byte.
  constexpr double kMinRatio = 4, kMinSquare = 1e-4;
  return up > kMinSquare && up > kMinRatio * down;
}

}  // namespace kiln

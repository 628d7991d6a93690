#include "detail/empty_texels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "base/parallel.h"
#include "image/wrap.h"

namespace kiln {
namespace {

/// Bounds that tell background from painted texels.
struct BackgroundBounds {
  /// Approximate number of texels outside of charts whose colours are counted
  std::size_t samples = std::size_t{1} << 16;
  double min_share =
      0.25;  ///< Minimum share of the counted texels that have the background's colour
  /// Maximum difference from the background's colour in any channel; covers JPEG artefacts near an
  /// edge
  float max_color_difference = 12.0F / 255;
  /// Maximum distance in texels from charts to background. In a picture with wider padding, filters
  /// do not reach the background, so nothing is excluded
  int reach = 8;
};
constexpr BackgroundBounds kBackgroundBounds;

bool has_alpha(const Image& image) { return image.channels % 2 == 0; }

/// A texel's colour, packed into an integer with one byte per channel.
std::uint32_t key_of(const Image& image, const float* texel) {
  std::uint32_t key = 0;
  for (std::uint32_t c = 0; c < image.channels; ++c) {
    const float value = texel[c] > 0 ? std::min(texel[c], 1.0F) : 0;  // NaN becomes 0
    key |= static_cast<std::uint32_t>(std::lround(value * 255)) << (8 * c);
  }
  // All fully transparent texels count as one colour.
  if (has_alpha(image) && key >> (8 * (image.channels - 1)) == 0) key = 0;
  return key;
}

bool are_near(const Image& image, std::uint32_t a, std::uint32_t b) {
  for (std::uint32_t c = 0; c < image.channels; ++c) {
    const int difference =
        static_cast<int>(a >> (8 * c) & 255U) - static_cast<int>(b >> (8 * c) & 255U);
    if (static_cast<float>(std::abs(difference)) >
        kBackgroundBounds.max_color_difference * 255 + 0.5F)
      return false;
  }
  return true;
}

std::optional<std::uint32_t> background_of(const Image& image, const TexelBits& charts) {
  const std::size_t texels = std::size_t{image.width} * image.height;
  const std::size_t sample_count = std::min(texels, 4 * kBackgroundBounds.samples);
  std::unordered_map<std::uint32_t, std::size_t> color_counts;
  std::size_t outside_count = 0;
  for (std::size_t k = 0; k < sample_count; ++k) {
    const std::size_t i = sample_count == texels
                              ? k
                              : static_cast<std::size_t>((k * 0x9E3779B97F4A7C15U >> 11U) % texels);
    if (charts.has(i)) continue;
    ++outside_count;
    ++color_counts[key_of(image, &image.pixels[i * image.channels])];
  }
  if (outside_count == 0) return std::nullopt;
  // Of equally frequent colours, the smallest key is used, so that the result does not depend on the hash table's
  // order.
  const auto most_frequent =
      std::max_element(color_counts.begin(), color_counts.end(), [](const auto& a, const auto& b) {
        return a.second != b.second ? a.second < b.second : a.first > b.first;
      });
  std::size_t near_count = 0;
  for (const auto& [key, count] : color_counts)
    near_count += are_near(image, key, most_frequent->first) ? count : 0;
  if (static_cast<double>(near_count) <
      kBackgroundBounds.min_share * static_cast<double>(outside_count))
    return std::nullopt;
  return most_frequent->first;
}

bool is_near_background(const Image& image, const float* texel, std::uint32_t key) {
  if (has_alpha(image) && key == 0) {
    return !(texel[image.channels - 1] > kBackgroundBounds.max_color_difference);
  }
  for (std::uint32_t c = 0; c < image.channels; ++c) {
    const float value = static_cast<float>(key >> (8 * c) & 255U) / 255;
    if (!(std::abs(texel[c] - value) <= kBackgroundBounds.max_color_difference)) return false;
  }
  return true;
}

template <typename Word>
void for_each_word(const TexelBits& bits, const Word& word) {
  for (std::size_t y = 0; y < bits.height(); ++y) {
    for (std::size_t w = 0; w < bits.words_in_row(); ++w) word(y, w);
  }
}

bool intersects(const TexelBits& a, const TexelBits& b) {
  bool is_any_added = false;
  for_each_word(a, [&](std::size_t y, std::size_t w) {
    is_any_added = is_any_added || (a.row(y)[w] & b.row(y)[w]) != 0;
  });
  return is_any_added;
}

bool is_full(const TexelBits& bits) {
  for (std::size_t y = 0; y < bits.height(); ++y) {
    for (std::size_t w = 0; w < bits.words_in_row(); ++w) {
      const bool last = w + 1 == bits.words_in_row();
      if (bits.row(y)[w] != (last ? bits.last_word() : ~std::uint64_t{0})) return false;
    }
  }
  return true;
}

}  // namespace

bool ChartTexels::add(const Corners& uvs, const Wraps& wraps) { return add_rows(uvs, wraps, 0); }

void ChartTexels::add_touched(const Corners& uvs, const Wraps& wraps) { add_rows(uvs, wraps, 0.5); }

/// \param reach  half the side of the square around a texel's centre that the triangle must
///   overlap, in texels
bool ChartTexels::add_rows(const Corners& uvs, const Wraps& wraps, double reach) {
  constexpr double kCentreTolerance = 1e-4, kMaxTexel = 1e9;
  const double width = chart_bits_.width(), height = chart_bits_.height();
  std::array<std::array<double, 2>, 3> at{};
  double top = std::numeric_limits<double>::infinity(), bottom = -top, least = top,
         most_frequent = -top;
  for (std::size_t k = 0; k < 3; ++k) {
    at[k] = {uvs[k][0] * width - 0.5, (1 - uvs[k][1]) * height - 0.5};
    if (!(std::abs(at[k][0]) < kMaxTexel && std::abs(at[k][1]) < kMaxTexel)) return false;
    least = std::min(least, at[k][0]), most_frequent = std::max(most_frequent, at[k][0]);
    top = std::min(top, at[k][1]), bottom = std::max(bottom, at[k][1]);
  }
  const double slack = reach + kCentreTolerance;
  if (!wraps && (most_frequent < -slack || least > width - 1 + slack)) return false;
  // A triangle whose UVs span many repetitions of the picture would be scanned once for each of
  // them. Such a picture tiles and has no charts, so all of its texels count as covered.
  constexpr double kMaxRepetitions = 4;
  const bool is_clamped = !wraps || (*wraps)[1] == TextureWrap::clamp;
  if (!is_clamped && bottom - top > kMaxRepetitions * height) {
    for (std::size_t y = 0; y < chart_bits_.height(); ++y)
      chart_bits_.add(y, 0, chart_bits_.width());
    return true;
  }
  auto first = static_cast<std::int64_t>(std::ceil(top - slack));
  auto last = static_cast<std::int64_t>(std::floor(bottom + slack));
  if (is_clamped) {
    // With clamping, all rows outside the picture read its outermost row, so marking that row
    // covers them.
    if (wraps && top < 0) chart_bits_.add(0, 0, chart_bits_.width());
    if (wraps && bottom > height - 1)
      chart_bits_.add(chart_bits_.height() - 1, 0, chart_bits_.width());
    first = std::max<std::int64_t>(first, 0);
    last = std::min<std::int64_t>(last, std::int64_t{chart_bits_.height()} - 1);
  }
  bool is_any_added = false;
  for (std::int64_t y = first; y <= last; ++y) {
    // Clips the triangle to the horizontal strip whose lines are at most `reach` away from the
    // row's centre line; if `reach` is 0, the strip is that line.
    const double from_y = std::clamp(static_cast<double>(y) - reach, top, bottom);
    const double to = std::clamp(static_cast<double>(y) + reach, top, bottom);
    double left = std::numeric_limits<double>::infinity(), right = -left;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto &a = at[k], &b = at[(k + 1) % 3];
      const double begin = std::max(std::min(a[1], b[1]), from_y);
      const double end = std::min(std::max(a[1], b[1]), to);
      if (begin > end) continue;
      const double rise = b[1] - a[1];
      for (const double row : {begin, end}) {
        const double x = rise != 0 ? a[0] + (b[0] - a[0]) * ((row - a[1]) / rise) : a[0];
        left = std::min({left, x, rise != 0 ? x : b[0]});
        right = std::max({right, x, rise != 0 ? x : b[0]});
      }
    }
    if (left <= right) {
      is_any_added = add_row(y, std::max(left, least) - slack,
                             std::min(right, most_frequent) + slack, wraps) ||
                     is_any_added;
    }
  }
  return is_any_added;
}

/// \returns true if any texel was added
bool ChartTexels::add_row(std::int64_t y, double left, double right, const Wraps& wraps) {
  const auto width = static_cast<std::int64_t>(chart_bits_.width());
  const auto height = static_cast<std::int64_t>(chart_bits_.height());
  auto begin = static_cast<std::int64_t>(std::ceil(left));
  auto end = static_cast<std::int64_t>(std::floor(right)) + 1;
  if (begin >= end) return false;
  if (!wraps) {
    begin = std::max<std::int64_t>(begin, 0), end = std::min(end, width);
    if (begin >= end) return false;
  } else {
    y = wrapped_texel(y, height, (*wraps)[1]);
    const TextureWrap wrap = (*wraps)[0];
    if (wrap == TextureWrap::clamp) {
      begin = std::clamp<std::int64_t>(begin, 0, width - 1);
      end = std::clamp<std::int64_t>(end, 1, width);
    } else if (end - begin >= width ||
               (wrap == TextureWrap::mirror && (begin < 0 || end > width))) {
      begin = 0, end = width;
    } else {
      const std::int64_t length = end - begin;
      begin = wrapped_texel(begin, width, wrap);
      end = begin + length;
      if (end > width) {
        chart_bits_.add(static_cast<std::size_t>(y), 0, static_cast<std::size_t>(end - width));
        end = width;
      }
    }
  }
  chart_bits_.add(static_cast<std::size_t>(y), static_cast<std::size_t>(begin),
                  static_cast<std::size_t>(end));
  return true;
}

std::optional<TexelBits> find_empty_texels(const Image& image, const TexelBits& charts) {
  if (is_full(charts)) return std::nullopt;
  const std::optional<std::uint32_t> background = background_of(image, charts);
  if (!background) return std::nullopt;
  TexelBits background_texels(image.width, image.height);
  parallel_for(image.height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t w = 0; w < background_texels.words_in_row(); ++w) {
        std::uint64_t outside_bits = ~charts.row(y)[w];
        if (w + 1 == background_texels.words_in_row())
          outside_bits &= background_texels.last_word();
        std::uint64_t background_bits = 0;
        for (; outside_bits != 0; outside_bits &= outside_bits - 1) {
          const auto bit = static_cast<std::size_t>(std::countr_zero(outside_bits));
          if (is_near_background(image, image.at(w * 64 + bit, y), *background))
            background_bits |= std::uint64_t{1} << bit;
        }
        background_texels.row(y)[w] = background_bits;
      }
    }
  });
  TexelBits near_charts = charts;
  for (int step = 0; step < kBackgroundBounds.reach; ++step) near_charts = dilated(near_charts);
  if (!intersects(near_charts, background_texels)) return std::nullopt;
  TexelBits dilated_background = dilated(background_texels);
  for_each_word(dilated_background, [&](std::size_t y, std::size_t w) {
    dilated_background.row(y)[w] &= ~charts.row(y)[w];
  });
  return dilated_background;
}

}  // namespace kiln

#include "image/value_range.h"

#include <algorithm>
#include <cmath>

#include "image/wrap.h"

namespace kiln {
namespace {

// A query uses the finest level on which the rectangle spans at most this many blocks in each
// direction.
constexpr std::int64_t kMaxBlocks = 3;

double fraction_of(double value) { return value - std::floor(value); }

struct TexelSpan {
  std::int64_t begin, end;  // Inclusive range; empty if end < begin
};

/// Maps a span of a row that repeats infinitely to the texels of the picture that it shows. The
/// span must be shorter than the row.
std::array<TexelSpan, 2> find_shown_spans(double begin, double end, std::int64_t size,
                                          TextureWrap wrap) {
  if (wrap == TextureWrap::clamp) {
    const auto most = static_cast<double>(size - 1);
    return {TexelSpan{static_cast<std::int64_t>(std::clamp(begin, 0.0, most)),
                      static_cast<std::int64_t>(std::clamp(end, 0.0, most))},
            TexelSpan{0, -1}};
  }
  const auto row = static_cast<double>(size);
  const double period = wrap == TextureWrap::mirror ? 2 * row : row;
  const double shift = std::floor(begin / period) * period;
  const auto a = static_cast<std::int64_t>(begin - shift);
  const auto b = static_cast<std::int64_t>(end - shift);
  if (wrap == TextureWrap::repeat)
    return {TexelSpan{a, std::min(b, size - 1)}, TexelSpan{0, b - size}};
  // With mirroring, a span may run forwards, then backwards, then forwards again.
  const TexelSpan mirrored{2 * size - 1 - std::min(b, 2 * size - 1),
                           2 * size - 1 - std::max(a, size)};
  return {a < size ? TexelSpan{a, std::min(b, size - 1)} : TexelSpan{0, b - 2 * size},
          b < size ? TexelSpan{0, -1} : mirrored};
}

}  // namespace

BoundedChannel::BoundedChannel(const Image& image, std::uint32_t channel) {
  if (channel == 3 && image.channels == 2) channel = 1;  // Alpha of a picture with grey and alpha
  Level level{image.width, image.height, {}};
  level.ranges.resize(std::size_t{image.width} * image.height);
  for (std::size_t i = 0; i < level.ranges.size(); ++i) {
    float value = channel < image.channels ? image.pixels[i * image.channels + channel] : 1.0F;
    if (!std::isfinite(value)) value = 0;
    level.ranges[i] = {value, value};
  }
  levels_.push_back(std::move(level));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& wide = levels_.back();
    Level next{(wide.width + 1) / 2, (wide.height + 1) / 2, {}};
    next.ranges.reserve(static_cast<std::size_t>(next.width * next.height));
    for (std::int64_t y = 0; y < next.height; ++y) {
      for (std::int64_t x = 0; x < next.width; ++x) {
        Range range = wide.ranges[static_cast<std::size_t>(2 * y * wide.width + 2 * x)];
        for (std::int64_t j = 2 * y; j < std::min(2 * y + 2, wide.height); ++j) {
          for (std::int64_t i = 2 * x; i < std::min(2 * x + 2, wide.width); ++i) {
            const Range& part = wide.ranges[static_cast<std::size_t>(j * wide.width + i)];
            range = {std::min(range.least, part.least), std::max(range.most, part.most)};
          }
        }
        next.ranges.push_back(range);
      }
    }
    levels_.push_back(std::move(next));
  }
}

double BoundedChannel::at(double u, double v, const Wraps& wraps) const {
  const Level& level = levels_[0];
  const double x =
      wrapped_coordinate(u, wraps[0], fraction_of) * static_cast<double>(level.width) - 0.5;
  const double y =
      (1 - wrapped_coordinate(v, wraps[1], fraction_of)) * static_cast<double>(level.height) - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const auto texel = [&](std::int64_t dx, std::int64_t dy) {
    const std::int64_t i =
        wrapped_texel(static_cast<std::int64_t>(left) + dx, level.width, wraps[0]);
    const std::int64_t j =
        wrapped_texel(static_cast<std::int64_t>(top) + dy, level.height, wraps[1]);
    return double{level.ranges[static_cast<std::size_t>(j * level.width + i)].least};
  };
  const double right = x - left, below = y - top;
  const double upper = texel(0, 0) + (texel(1, 0) - texel(0, 0)) * right;
  const double lower = texel(0, 1) + (texel(1, 1) - texel(0, 1)) * right;
  return upper + (lower - upper) * below;
}

BoundedChannel::Range BoundedChannel::over(double u0, double v0, double u1, double v1,
                                           const Wraps& wraps) const {
  const Level& base = levels_[0];
  const auto width = static_cast<double>(base.width), height = static_cast<double>(base.height);
  // The texels that are read by bilinear filtering at any point of the rectangle.
  const double left = std::floor(u0 * width - 0.5), right = std::floor(u1 * width - 0.5) + 1;
  const double top = std::floor((1 - v1) * height - 0.5),
               bottom = std::floor((1 - v0) * height - 0.5) + 1;
  const Range& whole_range = levels_.back().ranges[0];
  if (!(right - left < width && bottom - top < height)) return whole_range;
  // The parts of the rectangle within each repetition of the picture are looked up separately,
  // since the blocks of coarser levels are cut off at the picture's border.
  const auto inside = [&](std::int64_t ax, std::int64_t ay, std::int64_t bx, std::int64_t by) {
    std::size_t level_number = 0;
    while (level_number + 1 < levels_.size() &&
           ((bx >> level_number) - (ax >> level_number) >= kMaxBlocks ||
            (by >> level_number) - (ay >> level_number) >= kMaxBlocks)) {
      ++level_number;
    }
    const Level& level = levels_[level_number];
    Range range = level.ranges[static_cast<std::size_t>((ay >> level_number) * level.width +
                                                        (ax >> level_number))];
    for (std::int64_t y = ay >> level_number; y <= by >> level_number; ++y) {
      for (std::int64_t x = ax >> level_number; x <= bx >> level_number; ++x) {
        const Range& part = level.ranges[static_cast<std::size_t>(y * level.width + x)];
        range = {std::min(range.least, part.least), std::max(range.most, part.most)};
      }
    }
    return range;
  };
  Range range = whole_range;
  bool first = true;
  for (const auto& [ay, by] : find_shown_spans(top, bottom, base.height, wraps[1])) {
    for (const auto& [ax, bx] : find_shown_spans(left, right, base.width, wraps[0])) {
      if (by < ay || bx < ax) continue;
      const Range part = inside(ax, ay, bx, by);
      range =
          first ? part : Range{std::min(range.least, part.least), std::max(range.most, part.most)};
      first = false;
    }
  }
  return range;
}

}  // namespace kiln

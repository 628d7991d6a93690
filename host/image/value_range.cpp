#include "image/value_range.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

// A rectangle is looked up on the level where it is this many blocks a side, or fewer.
constexpr std::int64_t kBlocks = 3;

std::int64_t wrapped(std::int64_t place, std::int64_t size) {
  const std::int64_t rest = place % size;
  return rest < 0 ? rest + size : rest;
}

}  // namespace

BoundedChannel::BoundedChannel(const Image& image, std::uint32_t channel) {
  if (channel == 3 && image.channels == 2) channel = 1;  // grey and alpha
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

double BoundedChannel::at(double u, double v) const {
  const Level& level = levels_[0];
  const double x = (u - std::floor(u)) * static_cast<double>(level.width) - 0.5;
  const double y = (1 - (v - std::floor(v))) * static_cast<double>(level.height) - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const auto texel = [&](std::int64_t dx, std::int64_t dy) {
    const std::int64_t i = wrapped(static_cast<std::int64_t>(left) + dx, level.width);
    const std::int64_t j = wrapped(static_cast<std::int64_t>(top) + dy, level.height);
    return double{level.ranges[static_cast<std::size_t>(j * level.width + i)].least};
  };
  const double right = x - left, below = y - top;
  const double upper = texel(0, 0) + (texel(1, 0) - texel(0, 0)) * right;
  const double lower = texel(0, 1) + (texel(1, 1) - texel(0, 1)) * right;
  return upper + (lower - upper) * below;
}

BoundedChannel::Range BoundedChannel::over(double u0, double v0, double u1, double v1) const {
  const Level& base = levels_[0];
  const auto width = static_cast<double>(base.width), height = static_cast<double>(base.height);
  // All texels that bilinear reading takes from.
  double left = std::floor(u0 * width - 0.5), right = std::floor(u1 * width - 0.5) + 1;
  double top = std::floor((1 - v1) * height - 0.5),
         bottom = std::floor((1 - v0) * height - 0.5) + 1;
  const Range& all = levels_.back().ranges[0];
  if (!(right - left < width && bottom - top < height)) return all;
  const double shift_x = std::floor(left / width) * width,
               shift_y = std::floor(top / height) * height;
  left -= shift_x;
  right -= shift_x;
  top -= shift_y;
  bottom -= shift_y;
  // Over the picture's border, blocks of the coarser levels are no longer whole: looked up in parts.
  const auto x0 = static_cast<std::int64_t>(left), x1 = static_cast<std::int64_t>(right);
  const auto y0 = static_cast<std::int64_t>(top), y1 = static_cast<std::int64_t>(bottom);
  const auto inside = [&](std::int64_t ax, std::int64_t ay, std::int64_t bx, std::int64_t by) {
    std::size_t number = 0;
    while (number + 1 < levels_.size() && ((bx >> number) - (ax >> number) >= kBlocks ||
                                           (by >> number) - (ay >> number) >= kBlocks)) {
      ++number;
    }
    const Level& level = levels_[number];
    Range range =
        level.ranges[static_cast<std::size_t>((ay >> number) * level.width + (ax >> number))];
    for (std::int64_t y = ay >> number; y <= by >> number; ++y) {
      for (std::int64_t x = ax >> number; x <= bx >> number; ++x) {
        const Range& part = level.ranges[static_cast<std::size_t>(y * level.width + x)];
        range = {std::min(range.least, part.least), std::max(range.most, part.most)};
      }
    }
    return range;
  };
  Range range = all;
  bool first = true;
  for (const auto& [ay, by] : {std::pair(y0, std::min(y1, base.height - 1)),
                               std::pair(std::int64_t{0}, y1 - base.height)}) {
    for (const auto& [ax, bx] : {std::pair(x0, std::min(x1, base.width - 1)),
                                 std::pair(std::int64_t{0}, x1 - base.width)}) {
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

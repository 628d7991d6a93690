#include "lowpoly/chart_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kiln {
namespace {

FlatPoint turned(const FlatPoint& p, const FlatPoint& turn) {
  return {turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y};
}

struct Box {
  FlatPoint low{std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  FlatPoint high{-low.x, -low.y};
  void add(const FlatPoint& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
};

/// Rows of cells, set or not.
class Cells {
 public:
  Cells(std::uint32_t width, std::uint32_t height)
      : width_(width), height_(height), set_(std::size_t{width} * height, 0) {}

  /// Sets every cell that comes within `margin` of the segment. A cell is a square, so its centre may be
  /// farther by the square's reach in that direction.
  void widen(const FlatPoint& a, const FlatPoint& b, double margin) {
    const FlatPoint along = b - a;
    const double squared = dot(along, along);
    const double reach = margin + 1;
    const auto cell = [](double x, std::uint32_t count) {
      return static_cast<std::uint32_t>(std::clamp(std::floor(x), 0.0, count - 1.0));
    };
    const std::uint32_t x0 = cell(std::min(a.x, b.x) - reach, width_);
    const std::uint32_t x1 = cell(std::max(a.x, b.x) + reach, width_);
    const std::uint32_t y0 = cell(std::min(a.y, b.y) - reach, height_);
    const std::uint32_t y1 = cell(std::max(a.y, b.y) + reach, height_);
    for (std::uint32_t y = y0; y <= y1; ++y) {
      std::uint8_t* const row = set_.data() + std::size_t{y} * width_;
      for (std::uint32_t x = x0; x <= x1; ++x) {
        if (row[x] != 0) continue;
        const FlatPoint p{x + 0.5 - a.x, y + 0.5 - a.y};
        const double t = squared > 0 ? std::clamp(dot(p, along) / squared, 0.0, 1.0) : 0.0;
        const FlatPoint d = p - along * t;
        const double distance = std::sqrt(dot(d, d));
        row[x] =
            distance * distance <= margin * distance + 0.5 * (std::abs(d.x) + std::abs(d.y)) + 1e-9;
      }
    }
  }

  /// Sets cells whose centres are inside.
  void fill(const std::vector<std::vector<FlatPoint>>& rings) {
    std::vector<std::vector<double>> crossings(height_);
    for (const auto& ring : rings) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        FlatPoint a = ring[i], b = ring[(i + 1) % ring.size()];
        if (a.y > b.y) std::swap(a, b);
        const double first = std::max(std::ceil(a.y - 0.5), 0.0);
        for (double y = first; y + 0.5 < b.y && y < height_; ++y) {
          crossings[static_cast<std::size_t>(y)].push_back(a.x + (b.x - a.x) * (y + 0.5 - a.y) /
                                                                     (b.y - a.y));
        }
      }
    }
    for (std::uint32_t y = 0; y < height_; ++y) {
      std::sort(crossings[y].begin(), crossings[y].end());
      for (std::size_t i = 0; i + 1 < crossings[y].size(); i += 2) {
        const double last = std::min(crossings[y][i + 1] - 0.5, width_ - 1.0);
        for (double x = std::max(std::ceil(crossings[y][i] - 0.5), 0.0); x <= last; ++x) {
          set_[std::size_t{y} * width_ + static_cast<std::size_t>(x)] = 1;
        }
      }
    }
  }

  std::vector<ChartMask::Run> runs() const {
    std::vector<ChartMask::Run> result;
    for (std::uint32_t y = 0; y < height_; ++y) {
      const std::uint8_t* const row = set_.data() + std::size_t{y} * width_;
      for (std::uint32_t x = 0; x < width_; ++x) {
        if (row[x] == 0) continue;
        const std::uint32_t first = x;
        while (x + 1 < width_ && row[x + 1] != 0) ++x;
        result.push_back({y, first, x});
      }
    }
    std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) {
      return a.last - a.first > b.last - b.first;
    });
    return result;
  }

 private:
  std::uint32_t width_, height_;
  std::vector<std::uint8_t> set_;
};

}  // namespace

ChartMask make_mask(const Outline& outline, double angle, double scale, double margin) {
  ChartMask mask;
  mask.turn = {std::cos(angle), std::sin(angle)};
  std::vector<std::vector<FlatPoint>> rings = outline.rings;
  Box box;
  for (auto& ring : rings) {
    for (FlatPoint& p : ring) {
      p = turned(p, mask.turn) * scale;
      box.add(p);
    }
  }
  mask.shift = {margin - box.low.x, margin - box.low.y};
  const auto cells = [&](double extent) {
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(extent + 2 * margin)));
  };
  mask.width = cells(box.high.x - box.low.x);
  mask.height = cells(box.high.y - box.low.y);
  for (auto& ring : rings) {
    for (FlatPoint& p : ring) p = p + mask.shift;
  }
  Cells grid(mask.width, mask.height);
  grid.fill(rings);
  for (const auto& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const FlatPoint a = ring[i], step = ring[(i + 1) % ring.size()] - a;
      // Short pieces, so that their boxes hold few cells.
      const double pieces = std::max(1.0, std::ceil(std::sqrt(dot(step, step)) / 3));
      for (double k = 0; k < pieces; ++k) {
        grid.widen(a + step * (k / pieces), a + step * ((k + 1) / pieces), margin);
      }
    }
  }
  mask.runs = grid.runs();
  return mask;
}

double best_box_angle(const Outline& outline) {
  double best = 0, least = std::numeric_limits<double>::max();
  constexpr int kSteps = 48;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = i * (0.5 * std::numbers::pi / kSteps);
    const FlatPoint turn{std::cos(angle), std::sin(angle)};
    Box box;
    for (const auto& ring : outline.rings) {
      for (const FlatPoint& p : ring) box.add(turned(p, turn));
    }
    const double area = (box.high.x - box.low.x) * (box.high.y - box.low.y);
    if (area < least * (1 - 1e-9)) least = area, best = angle;
  }
  return best;
}

}  // namespace kiln

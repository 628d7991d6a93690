#include "pack/box_packing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mesh/box.h"
#include "pack/rectangle_packing.h"

namespace kiln {
namespace {

/// The bounding box of a rotated outline.
struct TurnedBox : Box<Vec2d> {
  Vec2d turn{};  ///< Cosine and sine of the rotation
};

TurnedBox turned_box(const Outline& outline) {
  const double angle = best_box_angle(outline);
  TurnedBox box;
  box.turn = {std::cos(angle), std::sin(angle)};
  for (const auto& ring : outline.rings) {
    for (const Vec2d& p : ring) {
      box.add({box.turn.x * p.x - box.turn.y * p.y, box.turn.y * p.x + box.turn.x * p.y});
    }
  }
  return box;
}

}  // namespace

OutlinePacking pack_boxes(std::span<const Outline> outlines, std::uint32_t size, double padding) {
  // Boxes are aligned to multiples of one texel, or of the padding if that is smaller.
  const double step = std::min(1.0, padding);
  const auto side = static_cast<std::uint32_t>(std::floor(size / step));
  const auto border = static_cast<std::uint32_t>(std::ceil(padding / step));
  std::vector<TurnedBox> boxes;
  double area = 0;
  for (const Outline& outline : outlines) {
    boxes.push_back(turned_box(outline));
    area += outline.area;
  }
  std::vector<PackSize> sizes(boxes.size());
  std::vector<PackPlace> places;
  OutlinePacking best;
  // Bounds between which the scale is found by bisection, in grid cells per unit of the outlines
  double low = 0, high = std::sqrt(1.0 * side * side / area);
  for (int round = 0; round < 24 && high - low > 0.004 * high; ++round) {
    const double scale = low > 0 || round < 2 ? 0.5 * (low + high) : 0.25 * high;
    double covered_area = 0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const auto cells = [&](double extent) {
        return static_cast<std::uint32_t>(std::ceil(extent * scale)) + border;
      };
      sizes[i] = {cells(boxes[i].high.x - boxes[i].low.x), cells(boxes[i].high.y - boxes[i].low.y)};
      covered_area += 1.0 * sizes[i].width * sizes[i].height;
    }
    if (covered_area > 1.0 * side * side || !pack_rectangles(sizes, side, places)) {
      high = scale;
      continue;
    }
    low = scale;
    best.scale = scale * step;
    best.places.resize(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const TurnedBox& box = boxes[i];
      const double x = places[i].x + 0.5 * border, y = places[i].y + 0.5 * border;
      // A placement with `turned` rotates the box by another 90 degrees, so that its top edge becomes the left one.
      best.places[i] =
          places[i].turned
              ? OutlinePlace{{-box.turn.y, box.turn.x},
                             {(x + box.high.y * scale) * step, (y - box.low.x * scale) * step}}
              : OutlinePlace{box.turn,
                             {(x - box.low.x * scale) * step, (y - box.low.y * scale) * step}};
    }
  }
  return best;
}

}  // namespace kiln

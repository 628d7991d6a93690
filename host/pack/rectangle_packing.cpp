#include "pack/rectangle_packing.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace kiln {
namespace {

constexpr std::size_t kSkylineLimit = 8192;

/// The skyline: the upper boundary of the placed rectangles. From the x of a node to the x of the next node its height
/// is the node's y.
class Skyline {
 public:
  explicit Skyline(std::uint32_t side) : side_(side), nodes_{{0, 0}} {}

  struct Candidate {
    std::uint32_t top = std::numeric_limits<std::uint32_t>::max();
    std::uint64_t wasted_area = 0;  ///< Area below the rectangle that no later rectangle can use
    std::uint32_t x = 0, y = 0;
    std::size_t node = 0;
    bool is_found = false;
    auto key() const { return std::tuple(y, wasted_area, x); }
  };

  Candidate best(std::uint32_t width, std::uint32_t height) const {
    Candidate result;
    if (width > side_) return result;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const std::uint32_t x = nodes_[i].x;
      if (x + width > side_) break;
      std::uint32_t y = 0;
      for (std::size_t j = i; j < nodes_.size() && nodes_[j].x < x + width; ++j) {
        y = std::max(y, nodes_[j].y);
      }
      if (y + height > side_) continue;
      Candidate candidate{y + height, 0, x, y, i, true};
      for (std::size_t j = i; j < nodes_.size() && nodes_[j].x < x + width; ++j) {
        const std::uint32_t end =
            std::min(j + 1 < nodes_.size() ? nodes_[j + 1].x : side_, x + width);
        candidate.wasted_area += std::uint64_t{end - nodes_[j].x} * (y - nodes_[j].y);
      }
      if (!result.is_found || candidate.key() < result.key()) result = candidate;
    }
    return result;
  }

  void place(const Candidate& at, std::uint32_t width) {
    const std::uint32_t end = at.x + width;
    std::size_t last = at.node;  // One past the last node that starts under the rectangle
    // Height of the last of these nodes, whose skyline continues to the right of the rectangle
    std::uint32_t tail_height = 0;
    while (last < nodes_.size() && nodes_[last].x < end) tail_height = nodes_[last++].y;
    const bool is_node_cut = end < (last < nodes_.size() ? nodes_[last].x : side_);
    nodes_.erase(nodes_.begin() + static_cast<std::ptrdiff_t>(at.node),
                 nodes_.begin() + static_cast<std::ptrdiff_t>(last));
    const auto insert_position = nodes_.begin() + static_cast<std::ptrdiff_t>(at.node);
    if (is_node_cut) {
      nodes_.insert(insert_position, {Node{at.x, at.top}, Node{end, tail_height}});
    } else {
      nodes_.insert(insert_position, Node{at.x, at.top});
    }
  }

 private:
  struct Node {
    std::uint32_t x, y;
  };
  std::uint32_t side_;
  std::vector<Node> nodes_;
};

bool pack_skyline(std::span<const PackSize> sizes, std::span<const std::uint32_t> order,
                  std::uint32_t side, std::vector<PackPlace>& places) {
  Skyline skyline(side);
  for (const std::uint32_t i : order) {
    const PackSize& size = sizes[i];
    const auto upright_spot = skyline.best(size.width, size.height);
    const auto rotated_spot = skyline.best(size.height, size.width);
    const bool is_rotated = rotated_spot.is_found &&
                            (!upright_spot.is_found || rotated_spot.key() < upright_spot.key());
    const auto& chosen_spot = is_rotated ? rotated_spot : upright_spot;
    if (!chosen_spot.is_found) return false;
    skyline.place(chosen_spot, is_rotated ? size.height : size.width);
    places[i] = {chosen_spot.x, chosen_spot.y, is_rotated};
  }
  return true;
}

bool pack_shelves(std::span<const PackSize> sizes, std::span<const std::uint32_t> order,
                  std::uint32_t side, std::vector<PackPlace>& places) {
  std::uint64_t shelf_bottom = 0, height = 0, x = 0;
  for (const std::uint32_t i : order) {
    const std::uint32_t shorter_side = std::min(sizes[i].width, sizes[i].height);
    const std::uint32_t up = std::max(sizes[i].width, sizes[i].height);
    if (x + shorter_side > side) {
      shelf_bottom += height;
      x = 0;
    }
    if (x == 0) height = up;
    if (shorter_side > side || shelf_bottom + height > side) return false;
    places[i] = {static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(shelf_bottom),
                 sizes[i].width > sizes[i].height};
    x += shorter_side;
  }
  return true;
}

}  // namespace

bool pack_rectangles(std::span<const PackSize> sizes, std::uint32_t side,
                     std::vector<PackPlace>& places) {
  places.resize(sizes.size());
  // Sorts by decreasing longer side. Rectangles on shelves are turned upright; on the skyline they may have either
  // rotation.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(sizes.size());
  for (std::uint32_t i = 0; i < sizes.size(); ++i) {
    const std::uint64_t longer = std::max(sizes[i].width, sizes[i].height);
    keys[i] = {~(longer << 32 | std::min(sizes[i].width, sizes[i].height)), i};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(sizes.size());
  std::transform(keys.begin(), keys.end(), order.begin(), [](const auto& k) { return k.second; });
  return pack_shelves(sizes, order, side, places) ||
         (sizes.size() <= kSkylineLimit && pack_skyline(sizes, order, side, places));
}

}  // namespace kiln

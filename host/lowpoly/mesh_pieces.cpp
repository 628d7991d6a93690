#include "lowpoly/mesh_pieces.h"

#include <algorithm>

#include "base/parallel.h"

namespace kiln {

std::vector<std::vector<std::uint32_t>> pieces_of(std::span<const Vec3> positions,
                                                  std::span<const Triangle> triangles,
                                                  std::size_t least) {
  struct Item {
    Vec3 corner;
    std::uint32_t triangle;
  };
  std::vector<Item> items(triangles.size());
  for (std::uint32_t t = 0; t < items.size(); ++t) {
    items[t] = {positions[triangles[t][0]], t};
  }
  std::vector<std::span<Item>> pieces{items};
  while (pieces[0].size() / 2 >= least) {
    std::vector<std::span<Item>> halves(2 * pieces.size());
    parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::span<Item> all = pieces[i];
        Vec3 low = all[0].corner, high = low;
        for (const Item& item : all) {
          const Vec3& p = item.corner;
          low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
          high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        const float x = high.x - low.x, y = high.y - low.y, z = high.z - low.z;
        const auto axis = x >= y && x >= z ? &Vec3::x : y >= z ? &Vec3::y : &Vec3::z;
        const std::size_t half = all.size() / 2;
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(half), all.end(),
                         [&](const Item& a, const Item& b) {
                           return a.corner.*axis != b.corner.*axis ? a.corner.*axis < b.corner.*axis
                                                                   : a.triangle < b.triangle;
                         });
        halves[2 * i] = all.subspan(0, half);
        halves[2 * i + 1] = all.subspan(half);
      }
    });
    pieces = std::move(halves);
  }
  std::vector<std::vector<std::uint32_t>> result(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (const Item& item : pieces[i]) result[i].push_back(item.triangle);
    std::sort(result[i].begin(), result[i].end());
  }
  return result;
}

}  // namespace kiln
